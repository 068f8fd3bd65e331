"""Statements of the paper that can be checked, and the verdicts on them.

A `Criterion` picks measurements by protocol, quantity and conditions, and predicts each by a
function of `analytic`. The verdict is computed from the numbers. That the paper's text had to be
corrected is another matter: `Claim.text`."""

import math
import sys
from collections.abc import Callable, Iterable
from dataclasses import KW_ONLY, dataclass
from enum import StrEnum
from functools import cached_property
from pathlib import Path
from statistics import median
from typing import Any, Unpack

from compare.method.conditions import Conditions
from compare.method.quantities import quantity
from compare.method.record import Check, Measurement, Missing, Relation
from compare.method.statistics import Estimate
from compare.plan import Level, sets

When = Callable[[Measurement], bool]
Predict = Callable[[Measurement], float | Estimate]
"""Predicts a value, with its own uncertainty where it comes from an integrator."""


class Outcome(StrEnum):
    """What the numbers say of a claim."""

    CONFIRMED = "confirmed"
    REFUTED = "refuted"
    INCONCLUSIVE = "inconclusive"  #: what was measured is too coarse to tell
    NOT_RUN = "not run"
    ERROR = "error"  #: the prediction broke down
    NOT_ASKED = "not asked"  #: of another engine than the one on trial


class Text(StrEnum):
    """How the statement relates to the paper's text."""

    PRINTED = "as printed"
    CORRECTED = "corrected"  #: true once a listed erratum is corrected


def given(**conditions: Unpack[Conditions]) -> When:
    """A filter of measurements: whether one was made under these conditions."""
    return lambda m: conditions.items() <= m.at.items()


def all_of(*whens: When) -> When:
    """A filter of measurements: whether one passes all of these filters."""
    return lambda m: all(when(m) for when in whens)


@dataclass(frozen=True)
class Criterion:
    """Measurements that bear on a claim, and what theory says they should be."""

    protocol: str
    quantity: str
    predict: Predict  #: raises one of `judge.UNKNOWN` where theory knows no such state
    _: KW_ONLY
    when: When = lambda m: True
    size: Callable[[Measurement], float] | None = None
    """By what errors are divided, where that isn't the natural size of the quantity."""
    relation: Relation = Relation.EQUAL
    by: str = ""  #: the function or equation that predicts, for the reader

    def __post_init__(self) -> None:
        quantity(self.quantity)


@dataclass(frozen=True)
class Claim:
    """One checkable statement."""

    id: str
    source: str  #: proposition, equation, figure or table
    statement: str
    criteria: tuple[Criterion, ...]
    _: KW_ONLY
    text: Text = Text.PRINTED
    reason: str = ""  #: what had to be corrected, or why a refutation is expected
    expected: Outcome = Outcome.CONFIRMED
    level: Level = Level.QUICK  #: the least level at which it is measured
    section: str = ""  #: section of the report, set by the `catalogue`
    place: str = ""  #: FILE:LINE where it is written

    def __post_init__(self) -> None:
        if not self.criteria:
            raise ValueError(f"claim {self.id}: no measurement bears on it")

    @cached_property
    def numbers(self) -> frozenset[int]:
        """Which criteria predict a number, and not a case, a count, or a bound on one side only."""
        sides = {(each.protocol, each.quantity, each.relation) for each in self.criteria}

        def predicts(of: Criterion) -> bool:
            if of.relation is Relation.EQUAL:
                return quantity(of.quantity).resolution > 0
            both = Relation.AT_MOST, Relation.AT_LEAST
            return all((of.protocol, of.quantity, each) in sides for each in both)

        return frozenset(n for n, each in enumerate(self.criteria) if predicts(each))

    @cached_property
    def protocols(self) -> frozenset[str]:
        """Names of the protocols whose measurements bear on it."""
        return frozenset(criterion.protocol for criterion in self.criteria)


def criteria(
    protocol: str, quantities: Iterable[str], predict: Predict, **more: Any
) -> tuple[Criterion, ...]:
    """A `Criterion` for each of several quantities of a protocol, all predicted by one function."""
    return tuple(Criterion(protocol, quantity, predict, **more) for quantity in quantities)


def claim(id: str, source: str, statement: str, *criteria: Criterion, **more: Any) -> Claim:
    """A claim with the criteria that bear on it; `more` are other fields of `Claim`."""
    written = sys._getframe(1)
    file = Path(written.f_code.co_filename).relative_to(Path(__file__).parents[2])
    place = f"{file.as_posix()}:{written.f_lineno}"
    return Claim(id, source, statement, criteria, place=place, **more)


@dataclass(frozen=True, kw_only=True)
class Judged:
    """What numbers say of a claim."""

    outcome: Outcome
    checks: tuple[Check, ...] = ()
    missing: tuple[Missing, ...] = ()  #: what its protocols left out, and why

    @property
    def worst(self) -> float:
        """Largest deviation divided by its tolerance; inf without a state, nan without numbers."""
        return max((check.share for check in self.checks), default=math.nan)

    @property
    def resolving_power(self) -> dict[str, float]:
        """By quantity, the smallest relative error that every conclusive check would notice; every
        check where none is conclusive."""
        power: dict[str, float] = {}
        fine = {check.measurement.quantity for check in self.checks if check.conclusive}
        for check in self.checks:
            name = check.measurement.quantity
            if name not in ("case", "cases") and (check.conclusive or name not in fine):
                power[name] = max(power.get(name, 0.0), check.resolution)
        return power


@dataclass(frozen=True, kw_only=True)
class EngineVerdict(Judged):
    """What one engine says of a claim: by checks in the zero-step limit, where it is judged so."""

    engine: str
    reason: str = ""  #: why it was not asked, or leaves the claim inconclusive
    order: float = math.nan
    """Median of the orders with which the numbers converge; nan where the step shows nothing."""
    deviations: tuple[float, ...] = ()
    """Sizes of deviations, divided by their scales, of numbers that are sure enough to tell them:
    at MuJoCo's own step of 2 ms, or of an engine that is judged at one step at that."""
    left_out: int = 0  #: measurements that they left out, or that have no limit

    @property
    def typical(self) -> float:
        """Median of the deviations; nan where there are none."""
        return median(self.deviations) if self.deviations else math.nan

    @property
    def farthest(self) -> float:
        """The largest deviation; nan where there are none."""
        return max(self.deviations, default=math.nan)


@dataclass(frozen=True, kw_only=True)
class Verdict(Judged):
    """What the numbers of the engine on trial say of a claim."""

    claim: Claim
    error: str = ""  #: why it could not be judged
    engines: tuple[EngineVerdict, ...] = ()  #: what every engine says, the one on trial first

    @property
    def passed(self) -> bool:
        """Whether the outcome is the one to be expected.

        An example refutes on the sets of the study; a user's own set may hold no such example."""
        if self.outcome is Outcome.CONFIRMED and self.claim.expected is Outcome.REFUTED:
            return not {check.measurement.set for check in self.checks} & sets(Level.FULL).keys()
        return self.outcome is self.claim.expected

    @property
    def told(self) -> int:
        """How many of its numbers are fine enough to tell."""
        return sum(check.conclusive for check in self.checks)

    @property
    def planned(self) -> int:
        """How many numbers its protocols had to bear on it, or left out."""
        return len(self.checks) + self.left_out

    @property
    def left_out(self) -> int:
        """How many measurements its protocols left out."""
        return sum(each.rows for each in self.missing)
