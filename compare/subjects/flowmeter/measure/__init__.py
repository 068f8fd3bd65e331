"""The characteristic curve of the flowmeter: its slopes, its loop of hysteresis, and what happens at unloading."""

from __future__ import annotations

from compare.kit.programme import ONE, TWO, Protocol
from compare.subjects.flowmeter.measure import characteristic, unloading

PROTOCOLS = (
    Protocol("hysteresis", characteristic.hysteresis, ("settled",), quick=ONE),
    Protocol(
        "unloading",
        unloading.measure,
        ("thresholds",),
        quick=TWO,
        cost=4,
        drawn=lambda m: m.conditions["start"] == "unloading",
    ),
    Protocol("slope", characteristic.slope, ("settled", "thresholds"), cost=6),
)
