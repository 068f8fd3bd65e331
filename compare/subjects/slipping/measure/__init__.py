"""How slip begins: how a slight slip grows, from which flow on, and when a ball leaves the
floor."""

from __future__ import annotations

from compare.kit.programme import Protocol
from compare.subjects.slipping.measure import growth, onset

PROTOCOLS = (
    Protocol("growth", growth.measure),
    Protocol("steepest", growth.steepest),
    Protocol("lift", onset.lift),
    Protocol("bounds", onset.bounds, ("thresholds",)),
)
