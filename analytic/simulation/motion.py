"""Data of the event-driven simulation: a moment, a path of one case, and the chart of a case, its coordinates."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Self

import numpy as np

from model import Case, Flow, Parameters, State
from model.arrays import Array, Real


@dataclass(frozen=True)
class Fluid:
    """omega_0 in rad s-1 at a time in s, between two knots of a `model.Flow`: a line and waves."""

    start: float
    value: float
    slope: float = 0.0
    waves: tuple[tuple[float, float, float], ...] = ()
    """Amplitude in rad s-1, angular frequency in rad s-1, phase in rad."""

    def __call__(self, t: Real) -> Real:
        """omega_0 at a time, or at times of any shape."""
        omega_0, sin = self.value + self.slope * (t - self.start), math.sin if isinstance(t, float) else np.sin
        for amplitude, omega, phase in self.waves:
            omega_0 = omega_0 + amplitude * sin(omega * t + phase)
        return omega_0

    @property
    def steady(self) -> bool:
        """Whether omega_0 stays what it is up to the next knot."""
        return not self.slope and not self.waves

    @classmethod
    def of(cls, flow: Flow, start: float) -> Self:
        """That of a flow from one of its knots, or from 0, on."""
        k = int(np.searchsorted(flow.start, start, side="right")) - 1
        waves = tuple((a, 2 * math.pi * f, phase) for a, f, phase in flow.waves.tolist())
        if k < 0:
            return cls(start, float(flow.value[0]), 0.0, waves)
        return cls(float(flow.start[k]), float(flow.value[k]), float(flow.slope[k]), waves)


GAPS = ("A lands", "B lands")
"""Names of the guards that are distances."""


class Moment(NamedTuple):
    """A state together with what the state alone does not tell."""

    time: float
    theta: float
    x: State
    alpha: float = math.nan
    """Direction of slip at A (8), rad, where it slips: the state doesn't tell at the very onset."""
    beta: float = math.nan
    """Direction of slip at B (8), rad."""
    work: float = 0.0
    """Work of drag, friction and impacts so far, J."""


class Path(NamedTuple):
    """Moments along a stretch of one case: arrays of shape (n,), and x (n, 8)."""

    time: Array
    theta: Array
    x: Array
    alpha: Array
    beta: Array
    work: Array


@dataclass(frozen=True)
class Chart:
    """The motion of one case in its coordinates z."""

    case: Case
    start: list[float]
    scale: list[float]
    """Natural size of each coordinate, for absolute tolerances."""
    rates: Callable[[float, Sequence[float]], list[float]]
    ends: tuple[str, ...]
    """What can end the case."""
    guards: Callable[[float, Sequence[float]], tuple[float, ...]]
    """A quantity for each of `ends` that is positive while the case lasts, in natural units."""
    path: Callable[[Array, Array], Path]
    """States from times (n,) and coordinates (k, n)."""
    landing: float = math.inf
    """When the ball will touch the floor, where that is known in advance, s."""
    slips: tuple[int, ...] = ()
    """Which coordinates are slips with a direction of their own."""

    def least_slip(self, z: Sequence[float]) -> float:
        """The smallest slip that has a direction, in natural units; inf if there is none."""
        return min((z[k] / self.scale[k] for k in self.slips), default=math.inf)


def natural_units(p: Parameters) -> tuple[float, float, float, float]:
    """Units: of time, of velocity, of the spin of the ball, of energy."""
    time = math.sqrt(p.R / p.g)
    return time, p.R / time, p.R / (time * p.r), p.m * p.g * p.R
