"""Coordinates in which the motion of each case is regular, its equations in them, and what can end it.

On the wall these are the active variables of the case (Table 4), except that a slip with two components is given by
its speed q and direction (alpha at A, beta at B): the friction depends on the direction alone, so that the rates have
limits as the slip vanishes and q simply crosses zero. In SS both pairs are kept, although they share
slip_z = q_A cos alpha = q_B cos beta; what integration errors make of that bond is damped. The equations are those of
`dynamics`; only rates are converted here. Away from the wall see `charts_off_wall`. The first coordinate is always the
azimuth, the last one the work of drag and friction, J.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from analytic import charts_off_wall, drag, dynamics
from analytic.motion import Chart, Fluid, Moment, Path, natural_units
from model import Case, Parameters, State
from model.arrays import Array


def chart(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """The chart of a case (any but RR, see `two_point_rolling`) that starts at a moment.

    `floor` is the slip in natural units below which the turning rate of its direction is capped: the rate is inverse to
    the slip, and directions settle before the slip vanishes.
    """
    return _CHARTS[case](case, at, p, omega_0, floor)


def _rates(case: Case, x: State, p: Parameters, omega_0: float, *slips: dynamics.Direction) -> tuple[State, float]:
    """Rates of a state with the slip directions given, A before B, and the power of drag and contacts, W.

    The contact points move with (6).
    """
    f = dynamics.FORCES[case](x, p, omega_0, *slips)
    c = drag.of_velocity(0.0, x.v_y, p.R * (x.omega_c - omega_0), p)
    fluid = -p.m * c * (p.R**2 * x.omega_c * (x.omega_c - omega_0) + x.v_y**2)
    at_A = f.A_x * (x.v_y + p.r * x.slip_z) + f.A_y * x.v_y - f.A_z * p.r * x.slip_x
    at_B = -f.B_y * p.r * x.slip_z + f.B_z * p.r * x.slip_y
    return dynamics.newton_euler(case, x, f, p, omega_0), float(fluid + at_A + at_B)


def _one_slip(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """RS and SR: (theta, omega_c, speed of the slip along k, work); the slip keeps its sign."""
    slip, angle = ("slip_y", at.beta) if case is Case.RS else ("slip_x", at.alpha)
    sign, (T, _, w, E), G = math.copysign(1.0, math.sin(angle)), natural_units(p), p.m * p.g

    def state(z: Any) -> State:
        return State(omega_c=z[1], **{slip: sign * z[2]})

    def rates(t: float, z: Sequence[float]) -> list[float]:
        dx, power = _rates(case, state(z), p, omega_0(t), (sign, 0.0))
        return [z[1], dx.omega_c, sign * getattr(dx, slip), power]

    def guards(t: float, z: Sequence[float]) -> tuple[float, ...]:
        f = dynamics.FORCES[case](state(z), p, omega_0(t), (sign, 0.0))
        if case is Case.RS:
            return z[2] / w, (p.mu * f.A_y - math.hypot(f.A_x, f.A_z)) / G
        return z[2] / w, (p.eta * f.B_x - math.hypot(f.B_y, f.B_z)) / G, f.A_y / G

    def path(t: Array, z: Array) -> Path:
        along, none = np.full_like(t, sign * math.pi / 2), np.full_like(t, math.nan)
        alpha, beta = (none, along) if case is Case.RS else (along, none)
        return Path(t, z[0], state(z).stacked(), alpha, beta, z[3])

    start = [at.theta, at.x.omega_c, sign * getattr(at.x, slip), at.work]
    ends = ("B sticks", "A slips") if case is Case.RS else ("A sticks", "B slips", "A lifts")
    return Chart(case, start, [1.0, 1 / T, w, E], rates, ends, guards, path)


def _ss(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """SS: (theta, omega_c, q_A, alpha, q_B, beta, work)."""
    T, _, w, E = natural_units(p)
    G, least, damping = p.m * p.g, floor * w, 1 / T

    def rates(t: float, z: Sequence[float]) -> list[float]:
        _, omega_c, q_A, alpha, q_B, beta, _ = z
        sA, cA, sB, cB = math.sin(alpha), math.cos(alpha), math.sin(beta), math.cos(beta)
        x = State(omega_c=omega_c, slip_x=q_A * sA, slip_y=q_B * sB, slip_z=q_A * cA)
        dx, power = _rates(case, x, p, omega_0(t), (sA, cA), (sB, cB))
        bond = damping * (q_B * cB - q_A * cA)
        dq_A, turn_A = dx.slip_x * sA + dx.slip_z * cA, dx.slip_x * cA - dx.slip_z * sA
        dq_B, turn_B = dx.slip_y * sB + dx.slip_z * cB - bond * cB, dx.slip_y * cB - dx.slip_z * sB
        return [omega_c, dx.omega_c, dq_A, turn_A / max(q_A, least), dq_B, turn_B / max(q_B, least), power]

    def guards(t: float, z: Sequence[float]) -> tuple[float, ...]:
        _, omega_c, q_A, alpha, q_B, beta, _ = z
        directions = (math.sin(alpha), math.cos(alpha)), (math.sin(beta), math.cos(beta))
        f = dynamics.FORCES[case]((0.0, 0.0, omega_c), p, 0.0, *directions)  # depend on nothing else
        return q_A / w, q_B / w, f.A_y / G, f.B_x / G

    def path(t: Array, z: Array) -> Path:
        theta, omega_c, q_A, alpha, q_B, beta, work = z
        slips = q_A * np.sin(alpha), q_B * np.sin(beta), q_A * np.cos(alpha)
        return Path(t, theta, State(0.0, 0.0, omega_c, *slips).stacked(), alpha, beta, work)

    x = at.x
    q_A, q_B = math.hypot(x.slip_x, x.slip_z), math.hypot(x.slip_y, x.slip_z)
    start = [at.theta, x.omega_c, q_A, at.alpha, q_B, at.beta, at.work]
    ends = ("A sticks", "B sticks", "A lifts", "B opens")
    return Chart(case, start, [1.0, 1 / T, w, 1.0, w, 1.0, E], rates, ends, guards, path, slips=(2, 4))


def _off_floor(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """NR: (theta, y, v_y, omega_c, slip_x, work); NS: (theta, y, v_y, omega_c, slip_x, q_B, beta, work)."""
    (T, v, w, E), G, slips = natural_units(p), p.m * p.g, case is Case.NS

    def rates(t: float, z: Sequence[float]) -> list[float]:
        if not slips:
            dx, power = _rates(case, State(*z[1:5]), p, omega_0(t))
            return [z[3], *dx[:4], power]
        _, y, v_y, omega_c, slip_x, q, beta, _ = z
        s, c = math.sin(beta), math.cos(beta)
        dx, power = _rates(case, State(y, v_y, omega_c, slip_x, q * s, q * c), p, omega_0(t), (s, c))
        dq, turn = dx.slip_y * s + dx.slip_z * c, (dx.slip_y * c - dx.slip_z * s) / max(q, floor * w)
        return [omega_c, *dx[:4], dq, turn, power]

    def guards(t: float, z: Sequence[float]) -> tuple[float, ...]:
        if slips:
            return z[5] / w, z[1] / p.R
        f = dynamics.FORCES[case](State(*z[1:5]), p, omega_0(t))
        return (p.eta * f.B_x - math.hypot(f.B_y, f.B_z)) / G, z[1] / p.R

    def path(t: Array, z: Array) -> Path:
        none = np.full_like(t, math.nan)
        if not slips:
            return Path(t, z[0], State(*z[1:5]).stacked(), none, none, z[5])
        theta, y, v_y, omega_c, slip_x, q, beta, work = z
        x = State(y, v_y, omega_c, slip_x, q * np.sin(beta), q * np.cos(beta)).stacked()
        return Path(t, theta, x, none, beta, work)

    slip, unit = ([math.hypot(at.x.slip_y, at.x.slip_z), at.beta], [w, 1.0]) if slips else ([], [])
    start, scale = [at.theta, *at.x[:4], *slip, at.work], [1.0, p.R, v, 1 / T, w, *unit, E]
    ends = ("B sticks" if slips else "B slips", "A lands")
    return Chart(case, start, scale, rates, ends, guards, path, slips=(5,) if slips else ())


_CHARTS = {
    Case.RS: _one_slip,
    Case.SR: _one_slip,
    Case.SS: _ss,
    Case.NR: _off_floor,
    Case.NS: _off_floor,
    Case.RN: charts_off_wall.rolling,
    Case.SN: charts_off_wall.slipping,
    Case.NN: charts_off_wall.flying,
}
