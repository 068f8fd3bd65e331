"""Coordinates in which the motion of each case is regular, its equations in them, and what can end it.

On the wall these are the active variables of the case (Table 4), except that a slip with two components is given by
its speed q and direction (alpha at A, beta at B): the friction depends on the direction alone, so that the rates have
limits as the slip vanishes and q simply crosses zero. In SS both pairs are kept, although they share
slip_z = q_A cos alpha = q_B cos beta; what integration errors make of that bond is damped. The equations are those of
`dynamics`; only rates are converted here. Away from the wall see `charts_off_wall`. The last coordinate is always the
work of drag and friction, J.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from analytic import charts_off_wall, dynamics
from analytic.motion import Chart, Fluid, Moment, Path, natural_units
from model import Case, Parameters
from model.arrays import Array


def chart(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """The chart of a case (any but RR, which `rolling` solves in closed form) that starts at a moment.

    `floor` is the slip in natural units below which its direction turns no faster any more: directions turn at a rate
    inverse to the slip, and settle before the slip vanishes.
    """
    return _CHARTS[case](case, at, p, omega_0, floor)


def _friction_power(x: Sequence[float], f: dynamics.Forces, p: Parameters, omega_0: float) -> float:
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
    forces, index, direction = dynamics.FORCES[case], (3 if A_slips else 4), (sign, 0.0)
    T, _, w, E = natural_units(p)
    G = p.m * p.g

    def state(z: Sequence[float]) -> list[float]:
        x = [0.0, 0.0, z[1], 0.0, 0.0, 0.0, 0.0, 0.0]
        x[index] = sign * z[2]
        return x

    def loads(t: float, z: Sequence[float]) -> dynamics.Forces:
        return forces(state(z), p, omega_0(t), direction)

    def rates(t: float, z: list[float]) -> list[float]:
        x, fluid = state(z), omega_0(t)
        f = loads(t, z)
        dx = dynamics.newton_euler(case, x, f, p, fluid)
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

    start = [at.theta, at.x.omega_c, sign * at.x[index], at.work]
    ends = ("A sticks", "B slips", "A lifts") if A_slips else ("B sticks", "A slips")
    return Chart(case, start, [1.0, 1 / T, w, E], rates, ends, guards, path)


def _ss(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """SS: (theta, omega_c, q_A, alpha, q_B, beta, work)."""
    T, _, w, E = natural_units(p)
    forces, G, least, damping = dynamics.FORCES[case], p.m * p.g, floor * w, 1 / T

    def rates(t: float, z: list[float]) -> list[float]:
        _, omega_c, q_A, alpha, q_B, beta, _ = z
        sA, cA, sB, cB = math.sin(alpha), math.cos(alpha), math.sin(beta), math.cos(beta)
        x, fluid = [0.0, 0.0, omega_c, q_A * sA, q_B * sB, q_A * cA, 0.0, 0.0], omega_0(t)
        f = forces(x, p, fluid, (sA, cA), (sB, cB))
        dx = dynamics.newton_euler(case, x, f, p, fluid)
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
    T, v, w, E = natural_units(p)
    forces, G = dynamics.FORCES[case], p.m * p.g

    def state(z: Sequence[float]) -> list[float]:
        return [z[1], z[2], z[3], z[4], 0.0, 0.0, 0.0, 0.0]

    def rates(t: float, z: list[float]) -> list[float]:
        x, fluid = state(z), omega_0(t)
        f = forces(x, p, fluid)
        dx = dynamics.newton_euler(case, x, f, p, fluid)
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
    T, v, w, E = natural_units(p)
    forces, least = dynamics.FORCES[case], floor * w

    def rates(t: float, z: list[float]) -> list[float]:
        _, y, v_y, omega_c, w_x, q, beta, _ = z
        s, c = math.sin(beta), math.cos(beta)
        x, fluid = [y, v_y, omega_c, w_x, q * s, q * c, 0.0, 0.0], omega_0(t)
        f = forces(x, p, fluid, (s, c))
        dx = dynamics.newton_euler(case, x, f, p, fluid)
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


_CHARTS = {
    Case.RS: _signed,
    Case.SR: _signed,
    Case.SS: _ss,
    Case.NR: _nr,
    Case.NS: _ns,
    Case.RN: charts_off_wall.rolling,
    Case.SN: charts_off_wall.slipping,
    Case.NN: charts_off_wall.flying,
}
