"""Coordinates in which the motion of each case is regular, its equations in them, and what can end it.

At the wall these are the active variables of the case (Table 4), except that each slip is given by its speed q and its
direction (alpha at A, beta at B): friction depends on the direction alone, so that the rates have limits as the slip
vanishes and q simply crosses zero. The slip of RS or SR keeps to one line, and needs no direction. In SS both pairs are
kept, although they share slip_z = q_A cos alpha = q_B cos beta; deviations from that relation by integration errors are
damped. The equations are those of `dynamics`; only rates are converted here.

Away from the wall (RN, SN, NN) the frame rests, so that the vessel's axis is no singular point. The horizontal motion
is kept in complex numbers: position Z = rho e^(i theta), and (a, b) along the paper's i, k becomes
e^(i theta)(-a + i b); coordinates are their real and imaginary parts. The spin about the vertical never changes. The
equations are those of `dynamics`, written anew for this frame; test_charts compares the two.

The first coordinate is the azimuth, or Z, the last one the work of drag and friction, J.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from analytic.mechanics import drag, dynamics
from analytic.mechanics.rigid_body import Forces, Velocities, state, velocities
from analytic.simulation.motion import Chart, Fluid, Moment, Path, natural_units
from analytic.simulation.two_point_rolling import MARGINS
from model import Case, Contact, Parameters, State
from model.arrays import Array
from model.drag import STOKES
from model.kinematics import SLIP_XYZ

_LOADS: dict[str, Callable[[Forces, Parameters], float]] = {
    "A slips": lambda f, p: p.mu * f.A_y - math.hypot(f.A_x, f.A_z),
    "B slips": lambda f, p: p.eta * f.B_x - math.hypot(f.B_y, f.B_z),
    "A lifts": lambda f, p: f.A_y,
    "B opens": lambda f, p: f.B_x,
}
"""Forces in N that are positive until a contact slips or opens."""
_ENDS = {
    Case.RR: ("RR ends",),
    Case.RS: ("B sticks", "A slips"),
    Case.SR: ("A sticks", "B slips", "A lifts"),
    Case.SS: ("A sticks", "B sticks", "A lifts", "B opens"),
    Case.NR: ("A lands", "B slips"),
    Case.NS: ("A lands", "B sticks"),
    Case.RN: ("A slips", "B lands"),
    Case.SN: ("A sticks", "B lands"),
    Case.NN: ("B lands", "A lands"),
}
"""What can end each case; at the wall what the coordinates show first, then what forces do."""


def chart(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float, leave_rolling: str) -> Chart:
    """The chart of a case that starts at a moment; when RR ends is for `leave_rolling` to say, as in `Settings`.

    `floor` is the slip in natural units below which the turning rate of its direction is capped: the rate is inverse to
    the slip, and directions settle before the slip vanishes.
    """
    if case.B is Contact.N:
        return _away_from_wall(case, at, p, omega_0, floor)
    return _at_wall(case, at, p, omega_0, floor, leave_rolling)


def _at_wall(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float, leave_rolling: str) -> Chart:
    """(theta; omega_c, off the floor y, v_y, omega_c, slip_x; speed and direction of each slip; work)."""
    T, v, w, E = natural_units(p)
    turns, free = case in (Case.SS, Case.NS), slice(0, 4) if case.A is Contact.N else slice(2, 3)
    start, scale = [at.theta, *at.x[free]], [1.0, *[p.R, v, 1 / T, w][free]]
    first = len(start)
    points = (case.A, SLIP_XYZ.start, at.alpha, p.mu), (case.B, SLIP_XYZ.start + 1, at.beta, p.eta)
    slips = [(k, angle, friction) for contact, k, angle, friction in points if contact is Contact.S]
    for k, angle, _ in slips:
        start += [math.hypot(at.x[k], at.x.slip_z)] + [angle] * turns
        scale += [w] + [1.0] * turns
    line = [(math.copysign(1.0, math.sin(angle)), 0.0) for _, angle, _ in slips]
    """Direction of a slip that keeps to one."""
    coordinates = {"A lands": 1, "A sticks": first, "B sticks": len(start) - 1 - turns}
    shown = [coordinates[end] for end in _ENDS[case] if end in coordinates]
    loads = [_LOADS[end] for end in _ENDS[case] if end in _LOADS]

    def at_z(z: Any, sin: Any = math.sin, cos: Any = math.cos) -> tuple[State, Any, list[dynamics.Direction]]:
        """The state, and speed and direction of each slip."""
        x: list[Any] = [0.0] * len(State._fields)
        x[free], speeds, along = z[1:first], z[first:-1], line
        if turns:
            speeds, along = speeds[::2], [(sin(angle), cos(angle)) for angle in speeds[1::2]]
            x[SLIP_XYZ.stop - 1] = speeds[0] * along[0][1]
        for (k, *_), q, (sine, _) in zip(slips, speeds, along, strict=True):
            x[k] = q * sine
        return State(*x), speeds, along

    def forces(t: float, x: State, along: Sequence[dynamics.Direction]) -> Forces:
        if case is Case.RR:
            return dynamics.rolling_family(x.omega_c, p, omega_0(t), 0.0)
        return dynamics.FORCES[case](x, p, omega_0(t), *along)

    def rates(t: float, z: Sequence[float]) -> list[float]:
        x, speeds, along = at_z(z)
        f, fluid = forces(t, x, along), omega_0(t)
        dx = dynamics.newton_euler(case, x, f, p, fluid)
        c = drag.of_velocity(0.0, x.v_y, p.R * (x.omega_c - fluid), p)
        power = -p.m * c * (p.R**2 * x.omega_c * (x.omega_c - fluid) + x.v_y**2)
        rate = [x.omega_c, *dx[free]]
        for (k, _, friction), q, (sine, cosine) in zip(slips, speeds, along, strict=True):
            bond = (q * cosine - x.slip_z) / T
            rate.append(dx[k] * sine + dx.slip_z * cosine - bond * cosine)
            if turns:
                rate.append((dx[k] * cosine - dx.slip_z * sine) / max(q, floor * w))
            power -= p.r * q * friction * (f.A_y if k == SLIP_XYZ.start else f.B_x)
        return [*rate, power]

    def guards(t: float, z: Sequence[float]) -> tuple[float, ...]:
        if case is Case.RR:
            return (float(MARGINS[leave_rolling](z[1], p, omega_0(t))),)
        near = [z[k] / scale[k] for k in shown]
        if loads:
            x, _, along = at_z(z)
            f = forces(t, x, along)
            near += [load(f, p) / (p.m * p.g) for load in loads]
        return tuple(near)

    def path(t: Array, z: Array) -> Path:
        x, *_ = at_z(z, np.sin, np.cos)
        angles = z[first + 1 : -1 : 2] if turns else [angle for _, angle, _ in slips]
        own = {k: angle for (k, *_), angle in zip(slips, angles, strict=True)}
        alpha, beta = (own.get(k, math.nan) + np.zeros_like(t) for _, k, *_ in points)
        return Path(t, z[0], x.stacked(), alpha, beta, z[-1])

    own = tuple(range(first, len(start), 2)) if turns else ()
    return Chart(case, [*start, at.work], [*scale, E], rates, _ENDS[case], guards, path, slips=own)


def _away_from_wall(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """(Z, dZ/dt; in SN speed of the lowest point and its direction in the resting frame; in NN y, v_y; work).

    In RN the spin follows; in NN all of it rests, and with Stokes' drag the fall is known (`drag.fall`). With another
    law c depends on all components of the velocity.
    """
    _, v, _, E = natural_units(p)
    turn, u = cmath.exp(1j * at.theta), velocities(at.x, p)
    Z_0, V_0, spin = (p.R - at.x.h) * turn, turn * complex(-u.v_h, u.v_k), turn * complex(-u.o_x, u.o_z)
    start, scale = [Z_0.real, Z_0.imag, V_0.real, V_0.imag], [p.R, p.R, v, v]
    falls, ends, landing = case is Case.NN and p.drag == STOKES, _ENDS[case], math.inf
    if case is Case.SN:  # at the onset the speed is zero and only alpha tells its direction
        phase = cmath.phase(turn * complex(-math.cos(at.alpha), -math.sin(at.alpha)))
        start, scale = [*start, abs(V_0 + 1j * p.r * spin), phase], [*scale, v, 1.0]
    elif falls:
        ends, landing = ends[:1], at.time + drag.fall_time(at.x.y, at.x.v_y, p)
    elif case is Case.NN:
        start, scale = [*start, at.x.y, at.x.v_y], [*scale, p.R, v]

    def at_z(z: Any) -> tuple[Any, Any, Any]:
        """Z, dZ/dt and the other coordinates but the work, of one time or of many."""
        return z[0] + 1j * z[1], z[2] + 1j * z[3], z[4:-1]

    def pull(t: float, Z: complex, V: complex, rise: float) -> tuple[complex, float]:
        """Horizontal velocity relative to the fluid, m s-1, and c(|w|), s-1."""
        lag = V - 1j * omega_0(t) * Z
        return lag, float(drag.of_velocity(lag.real, rise, lag.imag, p))

    def rates(t: float, z: Sequence[float]) -> list[float]:
        Z, V, more = at_z(z)
        rise = drag.fall_speed(t - at.time, at.x.v_y, p) if falls else more[1] if case is Case.NN else 0.0
        lag, c = pull(t, Z, V, rise)
        power, push, rest = -p.m * c * (lag * V.conjugate()).real - p.m * c * rise**2, -c * lag, []
        if case is Case.RN:
            push /= 1 + p.j
        elif case is Case.SN:
            (speed, phase), power = more, power - p.m * p.mu * p.g * more[0]
            along = cmath.rect(1.0, phase)
            friction = -p.mu * p.g * along
            turning, push = (push + (1 + 1 / p.j) * friction) / along, push + friction
            rest = [turning.real, turning.imag / max(speed, floor * v)]
        elif more:
            rest = [rise, -p.g - c * rise]
        return [V.real, V.imag, push.real, push.imag, *rest, power]

    def guards(t: float, z: Sequence[float]) -> tuple[float, ...]:
        Z, V, more = at_z(z)
        gap = 1 - abs(Z) / p.R
        if case is Case.RN:
            lag, c = pull(t, Z, V, 0.0)
            return p.mu - p.j * (c / (1 + p.j)) * abs(lag) / p.g, gap
        if case is Case.SN:
            return more[0] / v, gap
        return (gap, more[0] / p.R) if len(more) else (gap,)

    def path(t: Array, z: Array) -> Path:
        Z, V, more = at_z(z)
        rho, back, none = np.abs(Z), np.conj(Z) / np.abs(Z), np.full_like(t, math.nan)
        y, v_y = more if case is Case.NN and not falls else np.zeros((2, len(t)))
        if falls:
            y, v_y = drag.fall(t - at.time, at.x.y, at.x.v_y, p)
        slide = more[0] * np.exp(1j * more[1]) if case is Case.SN else 0.0
        turned = np.full(len(t), spin) if case is Case.NN else (slide - V) / (1j * p.r)
        V, turned = V * back, turned * back
        u_t = Velocities(-V.real, v_y, V.imag, -turned.real, u.o_y, turned.imag)
        x = state(y, p.R - rho, u_t, p)._replace(omega_c=V.imag / rho)  # rho = R - h to the last digit
        if case is Case.RN:  # slip_x = 0 and v_h + r slip_z = 0 hold exactly
            x = x._replace(slip_x=0.0, slip_z=-x.v_h / p.r)
        # e^(i theta)(-a + i b) with a, b along the cosine and minus the sine of alpha (6), (8).
        alpha = np.arctan2(-(slide * back).imag, -(slide * back).real) if case is Case.SN else none
        theta = np.unwrap(np.append(at.theta, np.angle(Z)))[1:]
        return Path(t, theta, x.stacked(), alpha, none, z[-1])

    own = (4,) if case is Case.SN else ()
    return Chart(case, [*start, at.work], [*scale, E], rates, ends, guards, path, landing, own)
