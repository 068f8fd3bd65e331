"""Where slip begins to grow (3.2, 4): gamma in closed form along each arrow, its zero and slope.

Out of NR gamma is known at every state, (56)-(61). Where the ball goes round with the fluid gamma
is a straight line in omega_0^2, (61), (67), (74), (82), (83): `SlipBound`. At a fixed omega_c, for
a ball that lags behind the fluid or leads, it is one in the fluid's push, with Stokes' law in
omega_0, (66), (73): `HeldBound`. `slip_stability.gamma` is the same along any direction."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from analytic.mechanics import drag, dynamics
from model import Case, InputError, Parameters
from model.arrays import Array


@dataclass(frozen=True)
class SlipBound:
    """gamma = offset + slope * omega_0^2 in rad s-2, of a ball that goes round with the fluid."""

    offset: float
    slope: float

    @property
    def zero(self) -> float:
        """omega_0^2 (rad2 s-2) where slip neither grows nor dies out; inf if gamma has no slope.

        Negative: no flow reaches it."""
        return -self.offset / self.slope if self.slope else math.inf

    def gamma(self, omega_0: npt.ArrayLike) -> Array:
        """gamma in rad s-2 at flows omega_0 in rad s-1, any shape."""
        return np.asarray(self.offset + self.slope * np.asarray(omega_0, dtype=float) ** 2)


@dataclass(frozen=True)
class HeldBound:
    """gamma = side * push/((1+j) r) - hold in rad s-2, of a ball that rolls at omega_c.

    The fluid's push is c(|w|) w in m s-2 with w = R (omega_0 - omega_c)."""

    p: Parameters
    omega_c: float
    side: int
    hold: float
    """Friction's part, rad s-2."""

    @property
    def zero(self) -> float:
        """omega_0 in rad s-1 at which slip neither grows nor dies out; inf without drag."""
        if self.p.c == 0:
            return math.inf
        push = self.side * (1 + self.p.j) * self.p.r * self.hold
        lag = float(drag.speed_of(abs(push), self.p)) / self.p.R
        return self.omega_c + math.copysign(lag, push)

    @property
    def slope(self) -> float:
        """d gamma/d omega_0 at the zero, s-1."""
        lag = self.p.R * abs(self.zero - self.omega_c) if self.p.c else 0.0
        return self.side * float(drag.slope(lag, self.p)) * self.p.R / ((1 + self.p.j) * self.p.r)

    def gamma(self, omega_0: npt.ArrayLike) -> Array:
        """gamma in rad s-2 at flows omega_0 in rad s-1, any shape."""
        lag = self.p.R * (np.asarray(omega_0, dtype=float) - self.omega_c)
        push = drag.coefficient(np.abs(lag), self.p) * lag
        return np.asarray(self.side * push / ((1 + self.p.j) * self.p.r) - self.hold)


def gamma_nr(beta: npt.ArrayLike, x: npt.ArrayLike, p: Parameters) -> Array:
    """gamma (56), rad s-2, of a slip at B along beta (rad) out of states x (..., 6 or 8) of NR.

    Shapes broadcast; `InputError` if x isn't a state of NR."""
    pull, lag, friction = _nr_terms(x, p)
    return np.asarray(pull * np.cos(beta) + lag * np.sin(beta) - friction)


def steepest_nr(x: npt.ArrayLike, p: Parameters) -> Array:
    """beta_1 (58), rad: the direction in which slip at the wall grows the most out of states of NR.

    Along beta_2 = beta_1 + pi it dies out the fastest: a state is stable where gamma along beta_1
    is negative, (59)."""
    pull, lag, _ = _nr_terms(x, p)
    return np.arctan2(lag, pull)


def nr_to_ns(p: Parameters) -> SlipBound:
    """(60), (61): slip at B out of the stationary NR, along beta = 0, where it grows most."""
    unit = (1 + p.j) / (p.j * p.r)
    return SlipBound(unit * p.g, -unit * p.eta * p.R)


def rr_to_rs(p: Parameters, omega_c: float, side: int) -> HeldBound:
    """(66) with eta for its mu: slip at B along slip_y > 0 (side 1) or < 0 (side -1) of a ball that
    rolls at omega_c.

    For Stokes' law zero at omega_0 = omega_c + side * eta (1+j)(1+2j) omega_c^2/(j c)."""
    return HeldBound(p, omega_c, side, p.eta * (1 + 2 * p.j) * p.R * omega_c**2 / (p.j * p.r))


def rr_to_rs_stationary(p: Parameters) -> SlipBound:
    """(67): slip at B, either side, where omega_c = omega_0; it dies out unless omega_0 = 0."""
    return SlipBound(0.0, -p.eta * (1 + 2 * p.j) * p.R / (p.j * p.r))


def rr_to_sr(p: Parameters, omega_c: float, side: int) -> HeldBound:
    """(73): slip at A along slip_x > 0 (side 1) or < 0 (side -1) of a ball that rolls at omega_c.

    For Stokes' law zero at omega_0 = omega_c - side * (1+2j) mu (g - j R omega_c^2)/(j R c)."""
    weight = p.g - p.j * p.R * omega_c**2
    return HeldBound(p, omega_c, -side, p.mu * (1 + 2 * p.j) * weight / (p.j * (1 + p.j) * p.r))


def rr_to_sr_stationary(p: Parameters) -> SlipBound:
    """(74): slip at A, of either side, where omega_c = omega_0; it dies out below omega_03."""
    unit = p.mu * (1 + 2 * p.j) / ((1 + p.j) * p.r)
    return SlipBound(-unit * p.g / p.j, unit * p.R)


def rr_to_ss(p: Parameters, side: int) -> SlipBound:
    """Slip at both points where omega_c = omega_0, along (0, 0), (82), side 1, or along (pi, pi),
    (83), side -1.

    (83) has a real bound for eta > 1 only, below which slip would grow; but there the wall would
    have to pull, against (12), as 4.3 ends. (82) has one where the floor presses for eta < j."""
    unit = 1 / (p.j * p.r * (1 + p.mu * p.eta))
    drive = side * (p.mu * p.eta * (1 + p.j) + p.j) - p.eta
    return SlipBound(-unit * p.mu * p.g * (1 + side * p.eta), unit * p.R * drive)


def filippov_share(outer: Case, omega_c: float, p: Parameters) -> float:
    """delta of (69): f_RR = delta f^- + (1 - delta) f^+, f^+- the sides of RR in `outer`, RS or SR.

    From the growths of slip on the two sides, whose combination must not slip. 0 < delta < 1 where
    slip dies out on both sides (or grows on both: SR beyond omega_03); inf if neither side has
    friction, so that there is no edge."""
    if outer not in (Case.RS, Case.SR):
        raise InputError(
            f"case {outer.name}: RR divides the states of RS and SR only, where one direction slips"
        )
    bound = rr_to_rs if outer is Case.RS else rr_to_sr
    plus, minus = (float(bound(p, omega_c, side).gamma(p.omega_0)) for side in (1, -1))
    return plus / (plus + minus) if plus + minus else math.inf


def _nr_terms(x: npt.ArrayLike, p: Parameters) -> tuple[Array, Array, Array]:
    """Coefficients of cos beta and sin beta in (56), and the friction that resists, rad s-2."""
    _, v_y, omega_c, slip_x, *_ = dynamics.check_state(Case.NR, x, p)
    lag = p.R * (p.omega_0 - omega_c)
    c = drag.coefficient(drag.speed(0.0, v_y, lag), p)
    pull = (p.g + c * v_y + p.R * omega_c**2) / p.r + omega_c * slip_x
    friction = p.eta * p.R * (1 + p.j) / (p.j * p.r) * omega_c**2
    return np.asarray(pull), np.asarray(c * lag / p.r), friction
