"""How slip begins: how a slight slip grows, from which flow on, and when a ball leaves the floor."""

from __future__ import annotations

from compare.kit.programme import FOUR, ONE, TWO, Protocol
from compare.subjects.slipping.measure import growth, onset

PROTOCOLS = (
    Protocol("growth", growth.measure, plain=FOUR, waits=False),
    Protocol("steepest", growth.steepest, plain=FOUR, waits=False),
    Protocol("lift", onset.lift, plain=TWO, steps=(4, 4), waits=False),
    Protocol("bounds", onset.bounds, ("thresholds",), plain=ONE, cost=2),
)
