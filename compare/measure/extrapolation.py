"""Where something vanishes or turns, from settled states on one side of the place: polynomials of rising degree."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from compare.statistics import Measured
from model.arrays import Array

POINTS = 5
"""Least number of states from which a place is extrapolated."""
LEAST_GAIN = 0.2
"""By how much one more point improves a polynomial at best, whatever the points before it seem to say."""
SLOWEST_GAIN = 0.9
"""And at worst, where one improvement after the other goes the same way."""
FAR = 10.0
"""Distance of a maximum from the nearest point, over that of the farthest, beyond which it is none: the polynomials say
nothing any more of what is there, and the round-off of a line has a maximum somewhere, too."""


def vanishing(where: Array, order: Sequence[Measured]) -> Measured:
    """The place at which a quantity is zero; `where` (n,) and its values in the order of their distance from there."""

    def zero(values: Array, count: int) -> float:
        fit = np.polynomial.Polynomial.fit(values[:count] / np.abs(values).max(), where[:count], count - 1)
        return float(fit(0.0))

    return _converged(zero, order)


def initial_slope(where: Array, order: Sequence[Measured]) -> Measured:
    """How the place goes with a quantity where that is zero: the derivative there."""
    size = max(abs(m.value) for m in order)

    def slope(values: Array, count: int) -> float:
        fit = np.polynomial.Polynomial.fit(values[:count] / size, where[:count], count - 1)
        return float(fit.deriv()(0.0)) / size

    return _converged(slope, order)


def turning(where: Array, order: Sequence[Measured]) -> Measured:
    """The place at its maximum as a function of a quantity; nan if the polynomials have none."""

    def maximum(values: Array, count: int) -> float:
        scaled = values[:count] / np.abs(values).max()
        fit = np.polynomial.Polynomial.fit(scaled, where[:count], count - 1)
        roots = [root.real for root in fit.deriv().roots() if abs(root.imag) < 1e-9]
        beyond = [root for root in roots if 0 < (root - scaled[0]) / (scaled[0] - scaled[-1]) < FAR]
        return float(fit(min(beyond, key=lambda root: abs(root - scaled[0])))) if beyond else math.nan

    return _converged(maximum, order)


def _converged(estimate: Callable[[Array, int], float], order: Sequence[Measured]) -> Measured:
    """The estimate from all points, the nearest first, with the noise of each carried over.

    How far it is from the limit: what the farthest point but one changed, shrunk twice by what such changes shrink by
    from one point to the next, the larger of the last two ratios, at least `LEAST_GAIN` and at most 1. The last change
    itself may be small by chance. Where the last two went the same way it is the sum of all that would follow, with a
    ratio of at most `SLOWEST_GAIN`.
    """
    values, noise = (np.array([getattr(m, name) for m in order]) for name in ("value", "uncertainty"))
    count = len(values)
    row = np.array([estimate(values, n) for n in range(count - 3, count + 1)])
    changes = np.abs(np.diff(row))
    ratios = np.divide(changes[1:], changes[:-1], out=np.ones(2), where=changes[:-1] > 0)
    gain = float(np.clip(ratios.max(), LEAST_GAIN, 1.0))
    rest = float(changes[-2]) * gain**2
    if (row[-1] - row[-2]) * (row[-2] - row[-3]) > 0:
        rest /= 1 - min(gain, SLOWEST_GAIN)
    carried = [estimate(values + shift, count) - row[-1] for shift in np.diag(noise)]
    rounding = np.finfo(float).eps * abs(row[-1]) * 2**count
    return Measured(float(row[-1]), math.hypot(rest, rounding, *carried))
