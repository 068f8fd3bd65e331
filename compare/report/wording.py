"""Numbers, conditions and verdicts as a reader sees them. Nothing reads these texts back."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence

from compare.claims.claim import Outcome, Verdict
from compare.measure.check import Check
from compare.measure.quantities import QUANTITIES, quantity
from compare.measure.record import Condition, Measurement
from compare.pages import readable
from model import Case

SYMBOLS = {name: each.symbol for name, each in QUANTITIES.items()} | {
    name: name for name in ("v_h", "n_x", "n_y", "n_z")
}
"""How quantities and named conditions are written, where that isn't their name without underscores."""
_UNITS = {"h": "m", "v_h": "m s-1", "f": "Hz", "amplitude": "rad s-1", "rate": "rad s-2"} | {
    name: each.unit for name, each in QUANTITIES.items()
}
MARKS = {
    Outcome.CONFIRMED: ("pass", "✓"),
    Outcome.REFUTED: ("fail", "✗"),
    Outcome.INCONCLUSIVE: ("other", "?"),
    Outcome.ERROR: ("fail", "!"),
    Outcome.NOT_RUN: ("none", "…"),
}
"""Class and sign of each outcome."""


def number(value: float) -> str:
    """A number of a table; of what is tiny its size alone."""
    if not math.isfinite(value):
        return "–" if math.isnan(value) else f"{value:g}"
    return f"{value:.9g}" if abs(value) >= 1e-4 else size(value)


def size(value: float, sign: str = "") -> str:
    """The size of a small number: two digits, or 0."""
    return f"{value:{sign}.1e}" if value else "0"


def value(m: Measurement, of: float) -> str:
    """A value of the measurement's quantity; cases by their names."""
    if not math.isfinite(of):
        return "none" if math.isnan(of) else f"{of:g}"
    if m.quantity == "case":
        return Case(int(of)).name
    if m.quantity == "cases":
        return " ".join(case.name for case in Case if int(of) & 1 << case)
    return number(of)


def conditions(of: Mapping[str, Condition]) -> str:
    """Named conditions as text: "case SS, from above, y = 0.02 m"; states that are 0 are left out."""
    return ", ".join(filter(None, (_condition(name, each) for name, each in of.items())))


def _condition(name: str, of: Condition) -> str:
    if isinstance(of, str):
        return of if name == "side" else f"{name.replace('_', ' ')} {of}"
    if of == 0 and name in ("y", "v_y", "h", "v_h", "slip_x", "slip_y", "slip_z"):
        return ""
    return f"{SYMBOLS.get(name, name.replace('_', ' '))} = {of:.4g} {readable(_UNITS.get(name, '1'))}".rstrip()


def noticed(verdict: Verdict) -> str:
    """What error of theory the claim's checks would notice, by quantity; empty where only counts are compared."""
    alike: dict[str, list[str]] = {}
    for name, each in verdict.resolving_power.items():
        if quantity(name).resolves:
            alike.setdefault(f"{each:.1g}", []).append(SYMBOLS[name])
    power = [f"{size} in {', '.join(names)}" for size, names in alike.items()]
    return f"a relative error of {'; '.join(power)}" if power else ""


def worst(verdict: Verdict) -> str:
    """The check that comes nearest to failing, or fails most; there is one."""
    check = ranked(verdict.checks)[0]
    where = f"{SYMBOLS[check.measurement.quantity]}, {check.measurement.set}"
    if quantity(check.measurement.quantity).resolves == 0:
        return "all equal" if check.agrees else f"not equal: {where}"
    if math.isnan(check.predicted):
        return f"theory knows no such state: {where}"
    return f"{verdict.worst:.2g} of its tolerance ({where})"


def ranked(checks: Sequence[Check]) -> list[Check]:
    """Checks, the worst first: what fails, then what is too coarse, then by deviation over tolerance."""
    return sorted(checks, key=lambda check: (check.agrees, check.conclusive, -check.share))


def headline(verdicts: Sequence[Verdict]) -> str:
    """The page in one line, from the verdicts that were run."""
    failed = [verdict.claim.id for verdict in verdicts if not verdict.passed]
    if failed:
        more = f" and {len(failed) - 4} more" if len(failed) > 4 else ""
        return f"{len(failed)} of {len(verdicts)} claims did not come out as expected: {', '.join(failed[:4])}{more}"
    if not verdicts:
        return "Nothing has been checked yet"
    counts = Counter(verdict.outcome.value for verdict in verdicts)
    return "The paper and the engine agree: " + ", ".join(f"{n} {name}" for name, n in counts.most_common())
