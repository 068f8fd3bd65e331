"""Records of a few steps, of each of which there are two: with one time step, and with half of it.

Polynomials through a record give values and rates of change. Their uncertainty is what the step and the degree change.
"""

from __future__ import annotations

import numpy as np

from compare.kit.fits import value_and_slope
from compare.kit.lab import coarse_step, time_unit
from model import Parameters
from model.arrays import Array

REFINED = 16
"""Steps in one of `coarse_step`; the finer run has twice as many. With shorter ones the studies' settings come to the
engine's least impedance, and contacts then answer no faster."""
LAG = 3
"""Steps by which a contact force lags behind its load."""
LIMIT, DOUBT = 2 / 3, 1 / 3
"""Limit of a vanishing step beyond the finer run, and its uncertainty, in differences of the two runs: the error is
between first order in the step, for the direction of friction, and second, with limits of 1 and 1/3."""


def slip_unit(p: Parameters) -> float:
    """The rate of slip in rad s-2 that a force as large as the weight makes at a contact."""
    return p.g / p.r * (1 + p.j) / p.j


def lag_error(p: Parameters) -> float:
    """Least uncertainty of a force divided by the weight, which halving the step may by chance not show.

    Half the square of the lag `LAG` in units of `time_unit`: the second order, once the first is extrapolated.
    """
    return (LAG * coarse_step(p) / REFINED / time_unit(p)) ** 2 / 2


def polynomials(time: Array, values: Array, degrees: tuple[int, int], at: float = 0.0) -> tuple[Array, Array]:
    """Values and slopes at a time, each (2, ...), of polynomials of two degrees through values (n, ...)."""
    fits = [value_and_slope(time, values, degree, at) for degree in degrees]
    value, slope = (np.array(each) for each in zip(*fits, strict=True))
    return value, slope
