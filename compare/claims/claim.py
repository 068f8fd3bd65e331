"""Statements of the paper that can be checked, and the verdicts on them.

A claim says what is stated and where, and which measurements bear on it: a `Bearing` picks measurements by protocol,
quantity and conditions, and predicts each by a function of `analytic`. The verdict is computed from the numbers. That
the paper's text had to be corrected, or holds formally only, is another matter: `Claim.text`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import KW_ONLY, dataclass, field
from enum import StrEnum

from compare.measure.lab import Level
from compare.measure.quantities import quantity
from compare.measure.record import Measurement
from compare.statistics import Measured
from model import Parameters


class Outcome(StrEnum):
    """What the numbers say of a claim."""

    CONFIRMED = "confirmed"
    REFUTED = "refuted"
    INCONCLUSIVE = "inconclusive"
    """What was measured is too coarse to tell."""
    NOT_RUN = "not run"
    ERROR = "error"
    """The prediction broke down."""


class Text(StrEnum):
    """How the statement relates to the paper's text."""

    PRINTED = "as printed"
    CORRECTED = "corrected"
    """True once a listed erratum is corrected."""
    FORMAL = "formal only"
    """Outside the physical model: algebra is all there is."""


class Relation(StrEnum):
    """How a measured value should stand to the predicted one."""

    EQUAL = "="
    AT_MOST = "≤"
    AT_LEAST = "≥"


Prediction = float | Measured
"""A predicted value, with its own uncertainty where it comes from an integrator."""


@dataclass(frozen=True)
class Bearing:
    """Measurements that bear on a claim, and what theory says they should be."""

    protocol: str
    quantity: str
    predict: Callable[[Measurement], Prediction]
    """Raises one of `judge.UNKNOWN` where theory knows no such state."""
    _: KW_ONLY
    when: Callable[[Measurement], bool] = lambda m: True
    scale: Callable[[Parameters], float] | None = None
    """Natural size of the quantity, over which errors are counted; None for the predicted value itself."""
    size: Callable[[Measurement], float] | None = None
    """The same where it depends on more than the parameters, such as a rate that is one part of an eigenvalue."""
    relation: Relation = Relation.EQUAL
    by: str = ""
    """The function or equation that predicts, for the reader."""

    def __post_init__(self) -> None:
        quantity(self.quantity)


@dataclass(frozen=True, kw_only=True)
class Check:
    """A measured number beside its prediction."""

    measurement: Measurement
    predicted: float
    """nan where theory knows no such state."""
    tolerance: float
    """Largest deviation that still agrees."""
    scale: float
    relation: Relation = Relation.EQUAL

    @property
    def deviation(self) -> float:
        """Measured less predicted, as far as it goes against the relation."""
        error = self.measurement.value - self.predicted
        if self.relation is Relation.AT_MOST:
            return max(error, 0.0)
        return min(error, 0.0) if self.relation is Relation.AT_LEAST else error

    @property
    def resolves(self) -> float:
        """Resolving power: the smallest relative error of the prediction that this check would notice."""
        return self.tolerance / self.scale if self.scale else math.inf

    @property
    def agrees(self) -> bool:
        """Whether the deviation is within the tolerance; not for nan."""
        return abs(self.deviation) <= self.tolerance

    @property
    def conclusive(self) -> bool:
        """Whether the check resolves as much as its quantity asks for."""
        return self.resolves <= quantity(self.measurement.quantity).resolves


@dataclass(frozen=True, kw_only=True)
class Claim:
    """One checkable statement."""

    id: str
    source: str
    """Proposition, equation, figure or table."""
    statement: str
    bearings: tuple[Bearing, ...] = ()
    algebra: Callable[[], Iterable[Check]] | None = None
    """For a claim that is formal only: theory against theory."""
    text: Text = Text.PRINTED
    reason: str = ""
    """What had to be corrected, or why a refutation is expected."""
    expected: Outcome = Outcome.CONFIRMED
    level: Level = Level.QUICK
    """The least level at which it is measured."""
    section: str = ""
    """Part of the `catalogue`, which says it."""

    def __post_init__(self) -> None:
        if (self.algebra is not None) != (self.text is Text.FORMAL) or bool(self.bearings) == bool(self.algebra):
            raise ValueError(f"claim {self.id}: measurements bear on it, or it is formal only and has its algebra")

    @property
    def protocols(self) -> frozenset[str]:
        """The protocols that it needs."""
        return frozenset(bearing.protocol for bearing in self.bearings)


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What the numbers say of a claim."""

    claim: Claim
    outcome: Outcome
    checks: tuple[Check, ...] = ()
    error: str = ""
    """Why it could not be judged."""
    missing: tuple[str, ...] = field(default=())
    """What could not be measured, and why."""

    @property
    def passed(self) -> bool:
        """Whether the outcome is the one to be expected."""
        return self.outcome is self.claim.expected

    @property
    def resolving_power(self) -> Mapping[str, float]:
        """By quantity, the relative error of theory that every single check would notice: the largest of all."""
        power: dict[str, float] = {}
        for check in self.checks:
            if check.measurement.quantity not in ("case", "cases"):
                name = check.measurement.quantity
                power[name] = max(power.get(name, 0.0), check.resolves)
        return power

    @property
    def worst(self) -> float:
        """Largest deviation over tolerance of all checks; inf where theory knows no such state."""
        ratios = [_ratio(abs(check.deviation), check.tolerance) for check in self.checks]
        return max(ratios, default=math.nan)


def _ratio(deviation: float, tolerance: float) -> float:
    if math.isnan(deviation):
        return math.inf
    if tolerance == 0:
        return 0.0 if deviation == 0 else math.inf
    return deviation / tolerance
