"""Deviations from theory in standard uncertainties: are the uncertainties what they say?

Of numbers whose errors are normally distributed 32 % lie beyond one standard uncertainty, 5 %
beyond two and .3 % beyond three; of an error that may be anything within bounds 42 %, and none
beyond two."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import median

from compare.claim import Verdict
from compare.kit.quantities import QUANTITIES
from compare.kit.record import Check, Relation
from compare.kit.statistics import COVERAGE


@dataclass(frozen=True)
class Deviations:
    """Of some numbers: how far they are from theory, in standard uncertainties."""

    engine: str
    quantity: str
    """Its symbol; empty for all quantities."""
    sizes: Sequence[float]

    @property
    def median(self) -> float:
        """The median size."""
        return median(self.sizes)

    def beyond(self, uncertainties: int) -> float:
        """The share of numbers that are farther off than so many standard uncertainties."""
        return sum(size > uncertainties for size in self.sizes) / len(self.sizes)


def sizes(checks: Iterable[Check]) -> dict[str, list[float]]:
    """Sizes of deviations in standard uncertainties, by quantity; each number once.

    Of what has an uncertainty and a prediction; what only bounds is left out."""
    found = {}
    for check in checks:
        m = check.measurement
        size = COVERAGE * check.share
        if check.tolerance and check.relation is Relation.EQUAL and math.isfinite(size):
            where = m.protocol, m.set, m.parameters.omega_0, tuple(sorted(m.at.items()))
            found[m.quantity, m.value, where] = size
    by_quantity: dict[str, list[float]] = {}
    for (name, *_), size in found.items():
        by_quantity.setdefault(name, []).append(size)
    return by_quantity


def distribution(ran: Sequence[Verdict]) -> list[Deviations]:
    """For each engine: of all its numbers, then of each quantity."""
    rows = []
    for engine in dict.fromkeys(each.engine for verdict in ran for each in verdict.engines):
        own = sizes(
            check
            for verdict in ran
            for each in verdict.engines
            if each.engine == engine
            for check in each.checks
        )
        if own:
            rows.append(Deviations(engine, "", [size for those in own.values() for size in those]))
            rows += [
                Deviations(engine, known.symbol, own[name])
                for name, known in QUANTITIES.items()
                if name in own
            ]
    return rows
