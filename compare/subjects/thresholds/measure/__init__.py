"""Flows at which one kind of motion gives way to another, and which motions there are over a plane
of parameters."""

from __future__ import annotations

from compare.kit.programme import Protocol
from compare.subjects.thresholds.measure import basins, birth, thresholds

PROTOCOLS = (
    Protocol(
        "plane",
        basins.planes,
        alone="the planes of Figs. 7 and 8 are those of reference only",
        cost=3,
    ),
    Protocol("thresholds", thresholds.measure, ("settled",), follows=True, cost=20),
    Protocol("edge", basins.borders, ("thresholds",), cost=8),
    Protocol("birth", birth.birth, ("thresholds",), cost=3),
)
