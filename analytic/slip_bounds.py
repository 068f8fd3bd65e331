"""Where slip begins to grow (sections 3.2 and 4): gamma in closed form along each arrow, with its zero and its slope.

Out of NR gamma is known at every state, (56)-(61). Out of RR each bound of the paper is a straight line: gamma over
omega_0 at a fixed omega_c, for a ball that lags behind the fluid or leads, (66) and (73); or gamma over omega_0^2 where
the ball goes round with the fluid, (61), (67), (74), (82), (83). `slip_stability.gamma` gives the same from the vector
fields, along any direction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from analytic import dynamics
from model import Case, InputError, Parameters
from model.arrays import Array


@dataclass(frozen=True)
class SlipBound:
    """gamma = offset + slope * q in rad s-2, with q = omega_0 (rad s-1) or omega_0^2 (rad2 s-2)."""

    power: int
    """1: q = omega_0. 2: q = omega_0^2."""
    offset: float
    slope: float

    @property
    def zero(self) -> float:
        """The value of q at which slip neither grows nor dies out; inf where gamma doesn't depend on the flow.

        Negative for power 2 means that no flow reaches it.
        """
        return -self.offset / self.slope if self.slope else math.inf

    def gamma(self, omega_0: npt.ArrayLike) -> Array:
        """gamma in rad s-2 at flows omega_0 in rad s-1, any shape."""
        return np.asarray(self.offset + self.slope * np.asarray(omega_0, dtype=float) ** self.power)


def gamma_nr(beta: npt.ArrayLike, x: npt.ArrayLike, p: Parameters) -> Array:
    """gamma (56) in rad s-2 of a slip of the wall contact along beta (rad) out of states x (..., 6 or 8) of NR.

    Shapes broadcast; `InputError` if x isn't a state of NR.
    """
    pull, lag, friction = _nr_terms(x, p)
    return np.asarray(pull * np.cos(beta) + lag * np.sin(beta) - friction)


def steepest_nr(x: npt.ArrayLike, p: Parameters) -> Array:
    """beta_1 (58) in rad: the direction along which slip at the wall grows the most out of states x (...) of NR.

    Along beta_2 = beta_1 + pi it dies out the fastest: a state is stable where gamma along beta_1 is negative, (59).
    """
    pull, lag, _ = _nr_terms(x, p)
    return np.arctan2(lag, pull)


def nr_to_ns(p: Parameters, side: int = 1) -> SlipBound:
    """(60), (61): slip of the wall contact out of the stationary NR, along beta = 0 (side 1) or beta = pi (side -1)."""
    unit = (1 + p.j) / (p.j * p.r)
    return SlipBound(2, side * unit * p.g, -unit * p.eta * p.R)


def rr_to_rs(p: Parameters, omega_c: float, side: int) -> SlipBound:
    """(66) with eta for its mu: slip at B along slip_y > 0 (side 1) or < 0 (side -1) of a ball that rolls at omega_c.

    Zero at omega_0 = omega_c + side * eta (1+j)(1+2j) omega_c^2/(j c).
    """
    slope = side * p.c * p.R / ((1 + p.j) * p.r)
    return SlipBound(1, -slope * omega_c - p.eta * (1 + 2 * p.j) * p.R * omega_c**2 / (p.j * p.r), slope)


def rr_to_rs_stationary(p: Parameters) -> SlipBound:
    """(67): slip at B, of either side, where omega_c = omega_0; it dies out at every flow but omega_0 = 0."""
    return SlipBound(2, 0.0, -p.eta * (1 + 2 * p.j) * p.R / (p.j * p.r))


def rr_to_sr(p: Parameters, omega_c: float, side: int) -> SlipBound:
    """(73): slip at A along slip_x > 0 (side 1) or < 0 (side -1) of a ball that rolls at omega_c.

    Zero at omega_0 = omega_c - side * (1+2j) mu (g - j R omega_c^2)/(j R c).
    """
    slope = -side * p.c * p.R / ((1 + p.j) * p.r)
    weight = p.g - p.j * p.R * omega_c**2
    return SlipBound(1, -slope * omega_c - p.mu * (1 + 2 * p.j) * weight / (p.j * (1 + p.j) * p.r), slope)


def rr_to_sr_stationary(p: Parameters) -> SlipBound:
    """(74): slip at A, of either side, where omega_c = omega_0; it dies out below omega_03."""
    unit = p.mu * (1 + 2 * p.j) / ((1 + p.j) * p.r)
    return SlipBound(2, -unit * p.g / p.j, unit * p.R)


def rr_to_ss(p: Parameters, side: int = 1) -> SlipBound:
    """Slip at both points where omega_c = omega_0, along (0, 0), (82), side 1, or along (pi, pi), (83), side -1.

    (83) has a real bound for eta > 1 only, below which slip would grow; but there the wall would have to
    pull, against (12), as section 4.3 ends. (82) has one where the floor presses for eta < j only.
    """
    unit = 1 / (p.j * p.r * (1 + p.mu * p.eta))
    drive = side * (p.mu * p.eta * (1 + p.j) + p.j) - p.eta
    return SlipBound(2, -unit * p.mu * p.g * (1 + side * p.eta), unit * p.R * drive)


def filippov_share(outer: Case, omega_c: float, p: Parameters) -> float:
    """delta of (69): f_RR = delta f^- + (1 - delta) f^+, with f^+- the sides of RR in `outer`, RS or SR.

    From the growths of slip on the two sides, whose combination must not slip. 0 < delta < 1 where slip dies out on
    both sides (or grows on both: SR beyond omega_03); inf if neither side has friction, so that there is no edge.
    """
    if outer not in (Case.RS, Case.SR):
        raise InputError(f"case {outer.name}: RR divides the states of RS and SR only, where one direction slips")
    bound = rr_to_rs if outer is Case.RS else rr_to_sr
    plus, minus = (float(bound(p, omega_c, side).gamma(p.omega_0)) for side in (1, -1))
    return plus / (plus + minus) if plus + minus else math.inf


def _nr_terms(x: npt.ArrayLike, p: Parameters) -> tuple[Array, Array, Array]:
    """Coefficients of cos beta and sin beta in (56), and the friction that resists, rad s-2."""
    _, v_y, omega_c, slip_x, *_ = dynamics.check_state(Case.NR, x, p)
    pull = (p.g + p.c * v_y + p.R * omega_c**2) / p.r + omega_c * slip_x
    return pull, p.c * p.R / p.r * (p.omega_0 - omega_c), p.eta * p.R * (1 + p.j) / (p.j * p.r) * omega_c**2
