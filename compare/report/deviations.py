"""Deviations from theory in standard uncertainties: are the uncertainties what they say?

Of numbers whose errors are normally distributed 32 % lie beyond one standard uncertainty, 5 %
beyond two and .3 % beyond three; of an error that may be anything within bounds 42 %, and none
beyond two."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import median

from compare.method.quantities import QUANTITIES
from compare.method.record import Check, Relation
from compare.verification.claim import Verdict

SOLVERS = frozenset({"solver", "solver_at_random", "rounding"})
"""Causes of which one accuracy is known for all numbers. What is left of them is spread over many
powers of ten, so that most of the numbers that they limit are nearer to theory than that."""
LIMITED, OTHERS = "limited by solvers and round-off", "limited by what changes show"


@dataclass(frozen=True)
class Deviations:
    """Of some numbers: how far they are from theory, in standard uncertainties."""

    engine: str
    quantity: str
    """Its symbol, or what limits quantities; empty for all."""
    sizes: Sequence[float]

    @property
    def median(self) -> float:
        """The median size."""
        return median(self.sizes)

    def beyond(self, uncertainties: int) -> float:
        """The share of numbers that are farther off than so many standard uncertainties."""
        return sum(size > uncertainties for size in self.sizes) / len(self.sizes)


@dataclass(frozen=True)
class Deviation:
    """How far a number is from theory."""

    quantity: str
    limit: str
    """What makes up most of its uncertainty: `LIMITED` or `OTHERS`."""
    size: float
    """In standard uncertainties."""


def deviations(checks: Iterable[Check]) -> list[Deviation]:
    """Those of checks, each number once.

    Of what has an uncertainty and a prediction; what only bounds is left out."""
    found = {}
    for check in checks:
        m = check.measurement
        size = check.coverage * check.share
        if check.tolerance and check.relation is Relation.EQUAL and math.isfinite(size):
            where = m.protocol, m.set, m.parameters.omega_0, tuple(sorted(m.at.items()))
            most = max(m.budget, key=m.budget.__getitem__, default="")
            limit = LIMITED if most in SOLVERS else OTHERS
            found[m.quantity, m.value, where] = Deviation(m.quantity, limit, size)
    return list(found.values())


def distribution(ran: Sequence[Verdict]) -> list[Deviations]:
    """For each engine: of all its numbers, by what limits them, and of each quantity."""
    rows = []
    for engine in dict.fromkeys(each.engine for verdict in ran for each in verdict.engines):
        own = deviations(
            check
            for verdict in ran
            for each in verdict.engines
            if each.engine == engine
            for check in each.checks
        )
        kinds = [("", own)]
        kinds += [(name, [d for d in own if d.limit == name]) for name in (LIMITED, OTHERS)]
        kinds += [
            (known.symbol, [d for d in own if d.quantity == name])
            for name, known in QUANTITIES.items()
        ]
        rows += [Deviations(engine, name, [d.size for d in of]) for name, of in kinds if of]
    return rows
