"""What three engines say in a validation that was kept: rows for the page on MuJoCo's
settings."""

import math
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from pathlib import Path
from statistics import median
from unittest import mock

from compare.engines.study import PLAIN
from compare.figures.pages import Rows
from compare.method import quantities
from compare.method.record import Relation
from compare.report import wording
from compare.subjects.catalogue import CLAIMS
from compare.validation import stored
from compare.verification import convergence
from compare.verification.assessment import full_verdict
from compare.verification.claim import Outcome, Verdict

QUANTITIES = {
    "angular velocity ω_c": ("omega_c",),
    "slip": ("slip_",),
    "forces": ("force_",),
    "thresholds": ("omega_0",),
    "decay rates and frequencies": ("decay_rate", "slowest_decay", "frequency"),
    "accelerations and forces in motion": ("rate_", "moving_force_"),
    "where motions end": ("end_",),
}
"""Beginnings of the names of quantities, by what they are together."""


def verdicts(results: Path) -> list[Verdict]:
    """Of all claims of the last validation in a results directory; raises as
    `compare.report.results.load`."""
    return [full_verdict(claim, stored(results)) for claim in CLAIMS]


def counted(results: Path) -> Rows:
    """How many claims each engine was asked, and how they came out, with its deviations at a step
    of 2 ms."""
    head = ["engine", "asked", "confirmed", "to", "at worst", "refuted", "inconclusive"]
    rows = [[*head, "typical deviation", "worst"]]
    for row in wording.engines(verdicts(results)):
        to, _, at_worst = row["to"].partition(", at worst ")
        refuted, expected = str(len(row["refuted"])), sum(row["refuted"].values())
        refuted += f" ({expected} as expected)" if expected else ""
        asked = [row[name] for name in ("engine", "asked", "confirmed")]
        rows.append([*asked, to, at_worst, refuted, row["open"], row["typical"], row["worst"]])
    return rows


def verdict(results: Path) -> Rows:
    """What README tells of each engine: how many of the claims that it was asked came out how."""
    rows = [["engine", "confirmed", "refuted", "inconclusive"]]
    for row in wording.engines(verdicts(results)):
        if "mujoco" in row["engine"]:
            falsely = sum(not expected for expected in row["refuted"].values())
            due = len(row["refuted"]) - falsely
            refuted = f"{falsely}" + (f", and {due} that should be" if due else "")
            confirmed = f"{row['confirmed']} of {row['asked']}"
            rows.append([f"`{row['engine']}`", confirmed, refuted, row["open"]])
    return rows


def limits(results: Path) -> Rows:
    """How far plain MuJoCo is from theory in the zero-step limit, and how sure that is, by
    quantity."""
    head = ["in the zero-step limit", "numbers", "median deviation", "worst deviation"]
    rows = [[*head, "tolerance of the worst"]]
    own = [w for v in verdicts(results) for w in v.engines if w.engine == PLAIN.name]
    checks = {
        (c.measurement.quantity, c.measurement.value): c
        for w in own
        for c in w.checks
        if c.scale > 0
    }
    equal = [c for c in checks.values() if c.relation is Relation.EQUAL]
    for text, names in QUANTITIES.items():
        found = [c for c in equal if c.measurement.quantity.startswith(names)]
        off = [
            (abs(c.deviation) / c.scale, c.resolution) for c in found if math.isfinite(c.predicted)
        ]
        told = median(x for x, _ in off), *max(off)
        rows.append([text, str(len(off)), *(f"{x:.1e}" for x in told)])
    return rows


@contextmanager
def _required(times: float) -> Iterator[None]:
    """All required resolutions multiplied."""
    known = quantities.QUANTITIES
    other = {name: replace(q, resolution=times * q.resolution) for name, q in known.items()}
    with mock.patch.dict(known, other):
        yield


def _constant(name: str) -> Callable[[float], AbstractContextManager[None]]:
    """A constant of `compare.verification.convergence` multiplied."""
    return lambda times: mock.patch.object(convergence, name, times * getattr(convergence, name))


CHOSEN = {
    name: _constant(name)
    for name in ("GCI_SAFETY", "SAME", "LOOSER", "COARSEST", "MARGIN", "FAR_OFF", "LOWEST_ORDER")
} | {"all required resolutions": _required}
"""What was chosen after a first measurement and can be changed without measuring anew."""


def chosen(results: Path) -> Rows:
    """The verdicts, by any engine, that change where a constant is half or twice as large."""

    def said() -> dict[str, Outcome]:
        return {
            f"{v.claim.id} by {w.engine}": w.outcome for v in verdicts(results) for w in v.engines
        }

    rows, now = [["constant", "value", "half of it", "twice of it"]], said()
    for name, multiplied in CHOSEN.items():
        cells = []
        for times in (0.5, 2.0):
            with multiplied(times):
                other = said().items()
            changed = [f"{who}: {outcome}" for who, outcome in other if outcome is not now[who]]
            cells.append("; ".join(changed) or "none")
        rows.append([name, f"{getattr(convergence, name, '')}", *cells])
    return rows
