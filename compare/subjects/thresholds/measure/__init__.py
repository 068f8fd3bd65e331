"""Flows at which one kind of motion gives way to another, and which motions there are over a plane
of parameters."""

from __future__ import annotations

from compare.kit.programme import Protocol
from compare.subjects.thresholds.measure import basins, birth, thresholds

PROTOCOLS = (
    Protocol("plane", basins.planes),
    Protocol("thresholds", thresholds.measure, ("settled",)),
    Protocol("edge", basins.borders, ("thresholds",)),
    Protocol("birth", birth.birth, ("thresholds",)),
)
