"""Flows that change: pulsation, jumps, ramps."""

from __future__ import annotations

from compare.kit.programme import Protocol
from compare.subjects.unsteady.measure import jumps, pulsation

PROTOCOLS = (
    Protocol("pulsation", pulsation.measure, ("thresholds",), cost=11),
    Protocol("unsteady", jumps.measure, ("thresholds",), drawn=lambda m: m.quantity == "jump_height", cost=8),
)
