"""Coordinates in which the motion of each case is regular, its equations in them, and what can end it.

On the wall these are the active variables of the case (Table 4), except that a slip with two components is given by
its speed q and direction (alpha at A, beta at B): the friction depends on the direction alone, so that the rates have
limits as the slip vanishes and q simply crosses zero. In SS both pairs are kept, although they share
slip_z = q_A cos alpha = q_B cos beta; what integration errors make of that bond is damped. Away from the wall the
horizontal motion is kept in the resting frame as complex numbers, where the vessel's axis is a place like any other:
position Z = rho e^(i theta), and (a, b) along the paper's i, k becomes e^(i theta)(-a + i b).

The equations themselves are those of `dynamics`; only rates are converted here. The last coordinate is always the
work of drag and friction, J.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq

from analytic.dynamics import FORCES, Forces, newton_euler
from model import Case, Parameters
from model.arrays import Array

Fluid = Callable[[float], float]
"""omega_0 in rad s-1 at a time in s."""


GAPS = ("A lands", "B lands")
"""Names of the guards that are distances."""


@dataclass(frozen=True)
class Moment:
    """A state together with what the state alone does not tell."""

    time: float
    theta: float
    x: list[float]
    """The eight state variables."""
    alpha: float = math.nan
    """Direction of slip at A (8), rad, where it slips: the state doesn't tell at the very onset."""
    beta: float = math.nan
    """Direction of slip at B (8), rad."""
    work: float = 0.0
    """Work of drag, friction and impacts so far, J."""


@dataclass(frozen=True)
class Path:
    """States along a stretch of one case: arrays of shape (n,), and x (n, 8)."""

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
    rates: Callable[[float, list[float]], list[float]]
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
        least = math.inf
        for k in self.slips:
            least = min(least, z[k] / self.scale[k])
        return least


def chart(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """The chart of a case (any but RR, which `rolling` solves in closed form) that starts at a moment.

    `floor` is the slip in natural units below which its direction turns no faster any more: directions turn at a rate
    inverse to the slip, and settle before the slip vanishes.
    """
    return _CHARTS[case](case, at, p, omega_0, floor)


def _natural(p: Parameters) -> tuple[float, float, float, float]:
    """Units: of time, of velocity, of the spin of the ball, of energy."""
    time = math.sqrt(p.R / p.g)
    return time, p.R / time, p.R / (time * p.r), p.m * p.g * p.R


def _friction_power(x: Sequence[float], f: Forces, p: Parameters, omega_0: float) -> float:
    """Power of drag and contacts on the wall, W: the contact points move with (6)."""
    v_y, omega_c = x[1], x[2]
    drag = -p.m * p.c * (p.R**2 * omega_c * (omega_c - omega_0) + v_y**2)
    at_A = f[0] * (v_y + p.r * x[5]) + f[1] * v_y - f[2] * p.r * x[3]
    at_B = -f[4] * p.r * x[5] + f[5] * p.r * x[4]
    return float(drag + at_A + at_B)


def _signed(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """RS and SR: slip along k alone, (theta, omega_c, speed, work) with a fixed sign."""
    A_slips = case is Case.SR
    sign = math.copysign(1.0, math.sin(at.alpha if A_slips else at.beta))
    forces, index, direction = FORCES[case], (3 if A_slips else 4), (sign, 0.0)
    T, _, w, E = _natural(p)
    G = p.m * p.g

    def state(z: Sequence[float]) -> list[float]:
        x = [0.0, 0.0, z[1], 0.0, 0.0, 0.0, 0.0, 0.0]
        x[index] = sign * z[2]
        return x

    def loads(t: float, z: Sequence[float]) -> Forces:
        return forces(state(z), p, omega_0(t), direction)

    def rates(t: float, z: list[float]) -> list[float]:
        x, fluid = state(z), omega_0(t)
        f = loads(t, z)
        dx = newton_euler(case, x, f, p, fluid)
        return [x[2], dx[2], sign * dx[index], _friction_power(x, f, p, fluid)]

    def guards(t: float, z: Sequence[float]) -> tuple[float, ...]:
        f = loads(t, z)
        if A_slips:
            return z[2] / w, float(p.eta * f[3] - math.hypot(f[4], f[5])) / G, f[1] / G
        return z[2] / w, float(p.mu * f[1] - math.hypot(f[0], f[2])) / G

    def path(t: Array, z: Array) -> Path:
        x = np.zeros((len(t), 8))
        x[:, 2], x[:, index] = z[1], sign * z[2]
        turn, none = np.full_like(t, sign * math.pi / 2), np.full_like(t, math.nan)
        return Path(t, z[0], x, turn if A_slips else none, none if A_slips else turn, z[3])

    start = [at.theta, at.x[2], sign * at.x[index], at.work]
    ends = ("A sticks", "B slips", "A lifts") if A_slips else ("B sticks", "A slips")
    return Chart(case, start, [1.0, 1 / T, w, E], rates, ends, guards, path)


def _ss(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """SS: (theta, omega_c, q_A, alpha, q_B, beta, work)."""
    T, _, w, E = _natural(p)
    forces, G, least, damping = FORCES[case], p.m * p.g, floor * w, 1 / T

    def rates(t: float, z: list[float]) -> list[float]:
        _, omega_c, q_A, alpha, q_B, beta, _ = z
        sA, cA, sB, cB = math.sin(alpha), math.cos(alpha), math.sin(beta), math.cos(beta)
        x, fluid = [0.0, 0.0, omega_c, q_A * sA, q_B * sB, q_A * cA, 0.0, 0.0], omega_0(t)
        f = forces(x, p, fluid, (sA, cA), (sB, cB))
        dx = newton_euler(case, x, f, p, fluid)
        d_x, d_y, d_z = dx[3], dx[4], dx[5]
        bond = damping * (q_B * cB - q_A * cA)
        return [
            omega_c, dx[2],
            d_x * sA + d_z * cA, (d_x * cA - d_z * sA) / max(q_A, least),
            d_y * sB + d_z * cB - bond * cB, (d_y * cB - d_z * sB) / max(q_B, least),
            _friction_power(x, f, p, fluid),
        ]  # fmt: skip

    def guards(t: float, z: Sequence[float]) -> tuple[float, ...]:
        x = (0.0, 0.0, z[1])  # besides omega_c the forces depend on the directions alone
        f = forces(x, p, 0.0, (math.sin(z[3]), math.cos(z[3])), (math.sin(z[5]), math.cos(z[5])))
        return z[2] / w, z[4] / w, f[1] / G, f[3] / G

    def path(t: Array, z: Array) -> Path:
        zero = np.zeros_like(t)
        x = np.stack([
            zero, zero, z[1], z[2] * np.sin(z[3]), z[4] * np.sin(z[5]), z[2] * np.cos(z[3]), zero, zero,
        ], axis=-1)  # fmt: skip
        return Path(t, z[0], x, z[3], z[5], z[6])

    x = at.x
    start = [at.theta, x[2], math.hypot(x[3], x[5]), at.alpha, math.hypot(x[4], x[5]), at.beta, at.work]
    ends = ("A sticks", "B sticks", "A lifts", "B opens")
    return Chart(case, start, [1.0, 1 / T, w, 1.0, w, 1.0, E], rates, ends, guards, path, slips=(2, 4))


def _nr(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """NR: (theta, y, v_y, omega_c, w_x, work)."""
    T, v, w, E = _natural(p)
    forces, G = FORCES[case], p.m * p.g

    def state(z: Sequence[float]) -> list[float]:
        return [z[1], z[2], z[3], z[4], 0.0, 0.0, 0.0, 0.0]

    def rates(t: float, z: list[float]) -> list[float]:
        x, fluid = state(z), omega_0(t)
        f = forces(x, p, fluid)
        dx = newton_euler(case, x, f, p, fluid)
        return [x[2], dx[0], dx[1], dx[2], dx[3], _friction_power(x, f, p, fluid)]

    def guards(t: float, z: Sequence[float]) -> tuple[float, ...]:
        f = forces(state(z), p, omega_0(t))
        return float(p.eta * f[3] - math.hypot(f[4], f[5])) / G, z[1] / p.R

    def path(t: Array, z: Array) -> Path:
        zero, none = np.zeros_like(t), np.full_like(t, math.nan)
        x = np.stack([z[1], z[2], z[3], z[4], zero, zero, zero, zero], axis=-1)
        return Path(t, z[0], x, none, none, z[5])

    x = at.x
    start = [at.theta, x[0], x[1], x[2], x[3], at.work]
    return Chart(case, start, [1.0, p.R, v, 1 / T, w, E], rates, ("B slips", "A lands"), guards, path)


def _ns(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """NS: (theta, y, v_y, omega_c, w_x, q_B, beta, work)."""
    T, v, w, E = _natural(p)
    forces, least = FORCES[case], floor * w

    def rates(t: float, z: list[float]) -> list[float]:
        _, y, v_y, omega_c, w_x, q, beta, _ = z
        s, c = math.sin(beta), math.cos(beta)
        x, fluid = [y, v_y, omega_c, w_x, q * s, q * c, 0.0, 0.0], omega_0(t)
        f = forces(x, p, fluid, (s, c))
        dx = newton_euler(case, x, f, p, fluid)
        return [
            omega_c, v_y, dx[1], dx[2], dx[3],
            dx[4] * s + dx[5] * c, (dx[4] * c - dx[5] * s) / max(q, least),
            _friction_power(x, f, p, fluid),
        ]  # fmt: skip

    def path(t: Array, z: Array) -> Path:
        zero, none = np.zeros_like(t), np.full_like(t, math.nan)
        x = np.stack([z[1], z[2], z[3], z[4], z[5] * np.sin(z[6]), z[5] * np.cos(z[6]), zero, zero], axis=-1)
        return Path(t, z[0], x, none, z[6], z[7])

    x = at.x
    ends = ("B sticks", "A lands")
    start = [at.theta, x[0], x[1], x[2], x[3], math.hypot(x[4], x[5]), at.beta, at.work]
    return Chart(
        case,
        start,
        [1.0, p.R, v, 1 / T, w, w, 1.0, E],
        rates,
        ends,
        lambda t, z: (z[5] / w, z[1] / p.R),
        path,
        slips=(5,),
    )


def _off_wall(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """RN, SN, NN: (Z, dZ/dt, …, work), complex ones as pairs.

    RN: nothing more, the spin follows. SN: sliding speed at A and its direction in the resting frame. NN: nothing
    more, height and fall are known (`fall`). The spin about the vertical never changes; in flight the whole spin rests.
    """
    _, v, _, E = _natural(p)
    turn = cmath.exp(1j * at.theta)
    y, v_y, omega_c, w_x, w_y, w_z, h, v_h = at.x
    rho = p.R - h
    v_k = rho * omega_c
    upright = w_y - v_k / p.r
    spin = turn * complex(-(w_x + v_k / p.r), w_z + v_y / p.r)
    Z, V = rho * turn, turn * complex(-v_h, v_k)
    slip = V + 1j * p.r * spin  # velocity of the lowest point
    roll_share = p.c / (1 + p.j) if case is Case.RN else p.c
    lever = 1 + 1 / p.j

    def drag(t: float, z: Sequence[float]) -> complex:
        return complex(z[2], z[3]) - 1j * omega_0(t) * complex(z[0], z[1])

    def power(t: float, z: Sequence[float]) -> float:
        pull = drag(t, z)
        return -p.m * p.c * (pull.real * z[2] + pull.imag * z[3])

    def rates_rolling(t: float, z: list[float]) -> list[float]:
        push = -roll_share * drag(t, z)
        return [z[2], z[3], push.real, push.imag, power(t, z)]

    def rates_slipping(t: float, z: list[float]) -> list[float]:
        push, along = -p.c * drag(t, z), cmath.rect(1.0, z[5])
        friction = -p.mu * p.g * along
        force = push + friction
        turning = (push + lever * friction) / along
        return [
            z[2], z[3], force.real, force.imag,
            turning.real, turning.imag / max(z[4], floor * v),
            power(t, z) - p.m * p.mu * p.g * z[4],
        ]  # fmt: skip

    def rates_flying(t: float, z: list[float]) -> list[float]:
        push, rise = -p.c * drag(t, z), v_y - (p.c * v_y + p.g) * _decay(t - at.time, p.c)
        return [z[2], z[3], push.real, push.imag, power(t, z) - p.m * p.c * rise**2]

    def path(t: Array, z: Array) -> Path:
        place, speed = z[0] + 1j * z[1], z[2] + 1j * z[3]
        height, rise = fall(t - at.time, y, v_y, p) if case is Case.NN else (np.zeros_like(t), np.zeros_like(t))
        slide = z[4] * np.exp(1j * z[5]) if case is Case.SN else np.zeros_like(place)
        o = np.full_like(place, spin) if case is Case.NN else (slide - speed) / (1j * p.r)
        radius, back = np.abs(place), np.conj(place) / np.abs(place)
        speed, o, slide = speed * back, o * back, slide * back
        # In RN the state must hold slip_x = 0 and v_h + r slip_z = 0 exactly.
        w_x = np.zeros_like(t) if case is Case.RN else -o.real - speed.imag / p.r
        w_z = speed.real / p.r if case is Case.RN else o.imag - rise / p.r
        x = np.stack([
            height, rise, speed.imag / radius, w_x, upright + speed.imag / p.r, w_z, p.R - radius, -speed.real,
        ], axis=-1)  # fmt: skip
        angle = np.unwrap(np.append(at.theta, np.angle(place)))[1:]
        # e^(i theta)(-a + i b) with a, b along the cosine and minus the sine of alpha (6), (8).
        alpha = np.arctan2(-slide.imag, -slide.real) if case is Case.SN else np.full_like(t, math.nan)
        return Path(t, angle, x, alpha, np.full_like(t, math.nan), z[-1])

    def gap(z: Sequence[float]) -> float:
        return 1 - math.hypot(z[0], z[1]) / p.R

    start, scale = [Z.real, Z.imag, V.real, V.imag], [p.R, p.R, v, v]
    if case is Case.RN:

        def grip(t: float, z: Sequence[float]) -> tuple[float, ...]:
            return p.mu - p.j * roll_share * abs(drag(t, z)) / p.g, gap(z)

        return Chart(case, [*start, at.work], [*scale, E], rates_rolling, ("A slips", "B lands"), grip, path)
    if case is Case.SN:
        # At the onset the slip is zero and only alpha tells its direction.
        phase = cmath.phase(turn * complex(-math.cos(at.alpha), -math.sin(at.alpha)))
        ends = ("A sticks", "B lands")
        start = [*start, abs(slip), phase, at.work]
        return Chart(
            case, start, [*scale, v, 1.0, E], rates_slipping, ends, lambda t, z: (z[4] / v, gap(z)), path, slips=(4,)
        )
    landing = at.time + fall_time(y, v_y, p)
    return Chart(
        case, [*start, at.work], [*scale, E], rates_flying, ("B lands",), lambda t, z: (gap(z),), path, landing
    )


def fall(t: Any, y: float, v_y: float, p: Parameters) -> tuple[Any, Any]:
    """Height and vertical velocity after a time t (a float or an array) of flight with drag."""
    return y + v_y * _decay(t, p.c) - p.g * t**2 * second(p.c * t), v_y - (p.c * v_y + p.g) * _decay(t, p.c)


def _decay(t: Any, c: float) -> Any:
    """(1 - exp(-c t))/c."""
    if c == 0:
        return t
    return -(math.expm1(-c * t) if isinstance(t, float) else np.expm1(-c * t)) / c


def fall_time(y: float, v_y: float, p: Parameters) -> float:
    """Time until a flight ends on the floor, s; y >= 0, and v_y > 0 if y = 0."""
    free = (v_y + math.sqrt(v_y**2 + 2 * p.g * y)) / p.g
    if free == 0:
        return 0.0

    def height(t: float) -> float:
        return float(fall(t, y, v_y, p)[0])

    low, high = _rise_time(v_y, p) if v_y > 0 else 0.0, free
    while height(high) > 0:
        low, high = high, 2 * high
    return float(brentq(height, low, high, xtol=4 * math.ulp(1.0) * high, rtol=4 * math.ulp(1.0)))


def _rise_time(v_y: float, p: Parameters) -> float:
    """Time until the top of a flight."""
    return math.log1p(p.c * v_y / p.g) / p.c if p.c > 0 else v_y / p.g


def second(s: Any) -> Any:
    """(s - 1 + exp(-s))/s^2, by its series where that cancels."""
    small = np.abs(s) < 1e-2
    safe = np.where(small, 1.0, s)
    series = 1 / 2 - s / 6 * (1 - s / 4 * (1 - s / 5 * (1 - s / 6 * (1 - s / 7))))
    return np.where(small, series, (safe + np.expm1(-safe)) / safe**2)


_CHARTS = {
    Case.RS: _signed, Case.SR: _signed, Case.SS: _ss, Case.NR: _nr, Case.NS: _ns,
    Case.RN: _off_wall, Case.SN: _off_wall, Case.NN: _off_wall,
}  # fmt: skip
