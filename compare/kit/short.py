"""Records of a few steps, of each of which there are two: with one time step, and with half of it.

Polynomials through a record give values and rates of change. Their uncertainty is what the step and the degree change.
"""

from __future__ import annotations

import math

import numpy as np

from compare.kit.fits import value_and_slope
from compare.kit.lab import coarse_step, time_unit
from model import Case, Contact, Parameters, State
from model.arrays import Array
from model.cases import TRAITS
from model.kinematics import VARIABLES

REFINED = 16
"""Steps in one of `coarse_step`; the finer run has twice as many. With shorter ones the studies' settings come to the
engine's least impedance, and contacts then answer no faster."""
LAG = 3
"""Steps by which a contact force lags behind its load."""
HALF_WINDOW, WINDOW_DEGREES = 8, (5, 3)
"""Half the width of a window in the middle of a motion, in steps of the coarser run; degrees of the polynomials
through it, of which the lower one shows what the degree changes."""
EXTRAPOLATION, DOUBT = 2 / 3, 1 / 3
"""Limit of a vanishing step beyond the finer run, and its uncertainty, in differences of the two runs: the error is
between first order in the step, for the direction of friction, and second, with limits of 1 and 1/3."""


def slip_unit(p: Parameters) -> float:
    """The rate of slip in rad s-2 that a force as large as the weight makes at a contact."""
    return p.g / p.r * (1 + p.j) / p.j


def lag_error(p: Parameters, refine: int = 1) -> float:
    """Least uncertainty of a force divided by the weight, which halving the step may by chance not show.

    Half the square of the lag `LAG` in units of `time_unit`: the second order, once the first is extrapolated. The
    steps of `REFINED` may be divided by `refine`.
    """
    return (LAG * coarse_step(p) / (REFINED * refine) / time_unit(p)) ** 2 / 2


def polynomials(time: Array, values: Array, degrees: tuple[int, int], at: float = 0.0) -> tuple[Array, Array]:
    """Values and slopes at a time, each (2, ...), of polynomials of two degrees through values (n, ...)."""
    fits = [value_and_slope(time, values, degree, at) for degree in degrees]
    value, slope = (np.array(each) for each in zip(*fits, strict=True))
    return value, slope


def random_state(case: Case, p: Parameters, rng: np.random.Generator) -> Array:
    """A state (8,) that satisfies the constraints of a case.

    A ball that rolls goes round so slowly, or one that hangs on the wall so fast, that friction has something to
    spare; a ball that the wall alone keeps from turning spins backwards about its radial axis.
    """
    unit, speed = time_unit(p), math.sqrt(p.g * p.R)
    slips = rng.uniform(0.4, 1.0, 3) * rng.choice([-1, 1], 3) * speed / p.r
    omega_c = rng.uniform(0.4, 1.6) / unit
    if case.A is Contact.R and case.B is not Contact.N:
        omega_c = rng.uniform(0.2, 0.7) / unit * min(1.0, math.sqrt(p.mu), math.sqrt(p.mu / p.j))
    if case.B is Contact.R and case.A is not Contact.R:
        hangs = 1.0 if case.A is Contact.N else p.mu
        omega_c = rng.uniform(1.05, 1.3) / unit * max(1.0, math.sqrt(hangs / max(p.eta, 0.01)))
        slips[0] = -rng.uniform(0.6, 1.2) * p.R * omega_c / p.r
    values = {
        "y": rng.uniform(0.2, 0.6) * p.R,
        "v_y": rng.uniform(-0.2, 0.3) * speed,
        "omega_c": omega_c,
        **dict(zip(("slip_x", "slip_y", "slip_z"), slips, strict=True)),
        "h": rng.uniform(0.3, 0.5) * p.R,
        "v_h": rng.uniform(-0.2, 0.3) * speed,
    }
    x = np.array([values[name] if name in TRAITS[case].active else 0.0 for name in VARIABLES])
    return constrained(case, x, p)


def constrained(case: Case, x: Array, p: Parameters) -> Array:
    """The state (8,) with what the case holds at zero set to exactly that, of which a contact leaves some 1e-9."""
    held = [name in TRAITS[case].constraints for name in VARIABLES]
    x = np.where(held, 0.0, x)
    return State.of(x)._replace(slip_z=-State.of(x).v_h / p.r).stacked() if case is Case.RN else x
