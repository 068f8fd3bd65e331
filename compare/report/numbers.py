"""Every measured number, as columns that the page searches: what was measured at which flow on which set?"""

from __future__ import annotations

import base64
import json
import math
import zlib
from collections.abc import Mapping, Sequence
from typing import Any

from compare.kit.check import Check
from compare.kit.pages import readable
from compare.kit.record import Measurement, Records
from compare.report import wording


def columns(records: Records, checks: Mapping[str, Sequence[Check]]) -> dict[str, list[Any]]:
    """A row for each check, with the id of its claim, and for each measurement on which no claim bears."""

    def key(m: Measurement) -> tuple[Any, ...]:  # the same for a copy that another process has judged
        conditions = tuple(sorted(m.conditions.items()))
        return m.protocol, m.quantity, m.engine, m.set, m.parameters.omega_0, m.value, conditions

    judged = [(claim, check.measurement, check) for claim, own in checks.items() for check in own]
    known = {key(m) for _, m, _ in judged}
    rows = [*judged, *(("", m, None) for m in records.measurements if key(m) not in known)]
    return {
        "set": [m.set for _, m, _ in rows],
        "omega_0": [float(f"{m.parameters.omega_0:.6g}") for _, m, _ in rows],
        "quantity": [f"{wording.SYMBOLS[m.quantity]} {readable(m.unit)}".rstrip() for _, m, _ in rows],
        "conditions": [wording.conditions(m.conditions) for _, m, _ in rows],
        "engine": [m.engine for _, m, _ in rows],
        "measured": [_shown(m, m.value) for _, m, _ in rows],
        "uncertainty": [float(f"{m.uncertainty:.2g}") for _, m, _ in rows],
        "relation": [c.relation.replace("=", "") if c else "" for _, _, c in rows],
        "predicted": [_shown(m, c.predicted) if c else "" for _, m, c in rows],
        "deviation": [float(f"{c.deviation:.2g}") if c and math.isfinite(c.deviation) else "" for _, _, c in rows],
        "tolerance": [float(f"{c.tolerance:.2g}") if c else "" for _, _, c in rows],
        "claim": [claim for claim, _, _ in rows],
        "mark": [
            "" if c is None else "fail" if not c.agrees else "pass" if c.conclusive else "coarse" for *_, c in rows
        ],
    }


def packed(of: Mapping[str, Sequence[Any]]) -> str:
    """Columns as JSON, compressed (deflate) and written in base64: about a tenth of their length."""
    text = json.dumps(of, ensure_ascii=False, separators=(",", ":"))
    return base64.b64encode(zlib.compress(text.encode(), 9)).decode()


def _shown(m: Measurement, value: float) -> float | str:
    """A number with two digits of its uncertainty, nine in all at most; cases by their names."""
    if not math.isfinite(value) or m.quantity in ("case", "cases"):
        return wording.value(m, value)
    digits = 1 - math.floor(math.log10(m.uncertainty)) if m.uncertainty else 15
    return float(f"{round(value, digits):.9g}") + 0.0  # no negative zero
