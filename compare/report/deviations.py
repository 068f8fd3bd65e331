"""Deviations from theory in standard uncertainties: are the uncertainties what they say?

Of numbers whose errors are normally distributed 32 % lie beyond one standard uncertainty, 5 %
beyond two and .3 % beyond three; of an error that may be anything within bounds 42 %, and none
beyond two."""

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

from compare.method.quantities import QUANTITIES
from compare.method.record import Relation
from compare.verification.claim import Verdict

SOLVERS = frozenset({"solver", "solver_at_random", "rounding"})
"""Causes of which one accuracy is known for all numbers. What is left of them is spread over many
powers of ten, so that most of the numbers that they limit are nearer to theory than that."""
LIMITED, OTHERS = "limited by solvers and round-off", "limited by what changes show"
"""What makes up most of a number's uncertainty."""


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


def distribution(ran: Sequence[Verdict]) -> list[Deviations]:
    """For each engine: of all its numbers, by what limits them, and of each quantity.

    Of what has an uncertainty and a prediction, each number once; what only bounds is left out."""
    sizes: dict[tuple[str, str], dict[Any, float]] = defaultdict(dict)
    for said in (each for verdict in ran for each in verdict.engines):
        for check in said.checks:
            m, size = check.measurement, check.coverage * check.share
            if check.tolerance and check.relation is Relation.EQUAL and math.isfinite(size):
                most = max(m.budget, key=m.budget.__getitem__, default="")
                limit = LIMITED if most in SOLVERS else OTHERS
                at = m.parameters.omega_0, tuple(sorted(m.at.items()))
                for group in ("", limit, m.quantity):
                    sizes[said.engine, group][m.quantity, m.value, m.protocol, m.set, at] = size
    titles = {"": "", LIMITED: LIMITED, OTHERS: OTHERS}
    titles |= {name: known.symbol for name, known in QUANTITIES.items()}
    return [
        Deviations(engine, title, [*sizes[engine, group].values()])
        for engine in dict.fromkeys(engine for engine, _ in sizes)
        for group, title in titles.items()
        if (engine, group) in sizes
    ]
