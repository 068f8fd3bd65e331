"""A measured number beside a predicted one, whoever predicted it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from compare.kit.quantities import quantity
from compare.kit.record import Measurement


class Relation(StrEnum):
    """How a measured value should stand to the predicted one."""

    EQUAL = "="
    AT_MOST = "≤"
    AT_LEAST = "≥"


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
    ceiling: float | None = None
    """What it may overlook, where that isn't what its quantity says."""

    @property
    def deviation(self) -> float:
        """Measured less predicted, as far as it goes against the relation."""
        error = self.measurement.value - self.predicted
        if self.relation is Relation.AT_MOST:
            return max(error, 0.0)
        return min(error, 0.0) if self.relation is Relation.AT_LEAST else error

    @property
    def share(self) -> float:
        """Size of the deviation divided by the tolerance; inf where theory knows no such state, or without
        tolerance."""
        if self.deviation == 0:
            return 0.0
        share = abs(self.deviation / self.tolerance) if self.tolerance else math.inf
        return math.inf if math.isnan(share) else share

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
        ceiling = quantity(self.measurement.quantity).resolves if self.ceiling is None else self.ceiling
        return self.resolves <= ceiling
