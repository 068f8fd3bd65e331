"""Rates of what `coordinates` has, and what ends a case, on plain floats, compiled by numba.

At the wall the forces are those of (21) to (29), and the rates those of Newton and Euler (20) with
h = 0; away from it both are written in the resting frame. `dynamics` has them for arrays of states,
and test_coordinates holds these against it. What is found is written into a list or an array."""

from __future__ import annotations

import cmath
import math
from typing import Any, NamedTuple

from analytic.mechanics import drag
from analytic.mechanics.rigid_body import Velocities
from model import Case
from model.arrays import Array

RR, RS, RN, SR, SS, SN, NR, NS, NN = (int(case) for case in Case)
A_STICKS, B_STICKS, A_SLIPS, B_SLIPS, A_LIFTS, B_OPENS, A_LANDS, B_LANDS, RR_ENDS = range(9)
"""What ends a case."""
NONE = -1
ENDS = (
    (RR_ENDS, NONE, NONE, NONE),
    (B_STICKS, A_SLIPS, NONE, NONE),
    (A_SLIPS, B_LANDS, NONE, NONE),
    (A_STICKS, B_SLIPS, A_LIFTS, NONE),
    (A_STICKS, B_STICKS, A_LIFTS, B_OPENS),
    (A_STICKS, B_LANDS, NONE, NONE),
    (A_LANDS, B_SLIPS, NONE, NONE),
    (A_LANDS, B_STICKS, NONE, NONE),
    (B_LANDS, A_LANDS, NONE, NONE),
)
"""What can end each case, by number; at the wall what coordinates show, then what forces do."""
COUNT_OF_ENDS = tuple(sum(end != NONE for end in ends) for ends in ENDS)
ROLLS, SLIPS, AWAY = range(3)
"""Contacts: with the floor a case's number divided by three, with the wall the remainder."""
FINER = 1e3
"""Relative tolerance of an integrator divided by the absolute one in natural units."""
LOCAL = 0.25
"""Tolerance of a step relative to that asked for: errors of many steps add up."""
ONSET_SLIP, SMALL_SLIP = 1e-7, 1e-2
"""Slip at its onset, and where its direction may be stiff, relative to rolling at sqrt(g R)"""
STIFF_STEPS = 300
"""Steps with a small slip after which a stiff method takes over; to die out takes fewer."""
STABILITY, FEASIBILITY = range(2)
"""What `Settings.leave_rolling` asks of RR: that slip dies out, or only that forces hold it."""


class Line(NamedTuple):
    """The part of a flow that is a line."""

    start: float
    """Time at which it has its value, s."""
    value: float
    slope: float


class Fall(NamedTuple):
    """A flight under Stokes' drag, which is known."""

    since: float
    """When it began, s;"""
    v_y: float
    """its vertical velocity then, m s-1;"""
    landing: float
    """and when it ends on the floor, s; inf of any other motion."""


NO_FALL = Fall(0.0, 0.0, math.inf)


class System(NamedTuple):
    """The system in one case: all that its motion depends on; SI units."""

    m: float
    r: float
    R: float
    j: float
    mu: float
    eta: float
    g: float
    c: float
    """Rate of Stokes' drag, s-1."""
    law: drag.DragLaw
    """Of the drag."""
    stokes: bool
    """Whether that is Stokes'."""
    rtol: float
    """Tolerance of the integrator; the slip in natural units, too, below which the turning rate of
    its direction is capped: the rate is inverse to the slip, and directions settle before the slip
    vanishes."""
    restitution: float
    leaves: int
    """`STABILITY` or `FEASIBILITY`."""
    unit: float
    """Natural units: of time, s,"""
    spin: float
    """and of the spin of the ball, rad s-1."""
    waves: Array
    """Rows of amplitude, angular frequency and phase, (k, 3)."""
    line: Line
    case: int
    side: float
    """Sine of the direction of a slip that keeps to one line."""
    fall: Fall


def in_case(k: System, case: int, side: float, line: Line, fall: Fall) -> System:
    """The system in another case, with its side, line of the flow and known fall."""
    return System(*k[:-4], line, case, side, fall)


def fluid(t: float, k: System) -> float:
    """omega_0 at a time, rad s-1: a line and waves."""
    start, value, slope = k.line
    omega_0 = value + slope * (t - start)
    for n in range(len(k.waves)):
        wave = k.waves[n]
        omega_0 = omega_0 + wave[0] * math.sin(wave[1] * t + wave[2])
    return omega_0


def drag_rate(w_h: float, w_y: float, w_k: float, k: System) -> float:
    """c(|w|) of a velocity relative to the fluid, s-1."""
    return k.c if k.stokes else float(drag.rate(drag.speed(w_h, w_y, w_k), k.law))


def forces(
    case: int,
    omega_c: float,
    v_y: float,
    w_x: float,
    c: float,
    lag: float,
    s_A: float,
    c_A: float,
    s_B: float,
    c_B: float,
    k: System,
) -> tuple[float, float, float, float, float, float]:
    """Forces of floor and wall along i, j, k in the cases at the wall, N; in RR with B_y = 0.

    `lag` is omega_c - omega_0; s and c are sine and cosine of the directions of slip."""
    u, G, drive, j = k.m * k.R * omega_c * omega_c, k.m * k.g, k.m * k.R * c * lag, k.j
    if case == RR:
        z = j * drive / (1 + 2 * j)
        return -j * u, G, z, (1 + j) * u, 0.0, z
    if case == RS:
        B_x = (1 + j) * u
        B_z = -k.eta * B_x * s_B
        return -j * u, G, j * (drive - B_z) / (1 + j), B_x, 0.0, B_z
    if case == SR:
        B_y = j * k.m * (k.R * omega_c * omega_c + k.r * omega_c * w_x)
        A_y = G - B_y
        A_z = k.mu * A_y * s_A
        return 0.0, A_y, A_z, u, B_y, j * (drive - A_z) / (1 + j)
    if case == SS:
        determinant = 1 + k.mu * k.eta * c_A * c_B
        A_y, B_x = (G - k.eta * c_B * u) / determinant, (u + k.mu * c_A * G) / determinant
        return -k.mu * A_y * c_A, A_y, k.mu * A_y * s_A, B_x, k.eta * B_x * c_B, -k.eta * B_x * s_B
    if case == NR:
        B_y = j * k.m * (k.g + c * v_y + k.R * omega_c * omega_c + k.r * omega_c * w_x) / (1 + j)
        return 0.0, 0.0, 0.0, u, B_y, j * drive / (1 + j)
    return 0.0, 0.0, 0.0, u, k.eta * u * c_B, -k.eta * u * s_B


def _wall_state(z: Any, k: System) -> tuple[float, ...]:
    """Of a ball at the wall: omega_c, v_y, slip_x, slip_z, q_A, sin and cos of alpha, q_B, those of
    beta, slip_y."""
    v_y = w_x = w_z = q_A = s_A = c_A = q_B = s_B = c_B = 0.0
    omega_c = z[1]
    if k.case == SR:
        q_A, s_A = z[2], k.side
        w_x = q_A * s_A
    elif k.case == RS:
        q_B, s_B = z[2], k.side
    elif k.case == SS:
        q_A, s_A, c_A = z[2], math.sin(z[3]), math.cos(z[3])
        q_B, s_B, c_B = z[4], math.sin(z[5]), math.cos(z[5])
        w_x, w_z = q_A * s_A, q_A * c_A
    elif k.case == NR or k.case == NS:
        v_y, omega_c, w_x = z[2], z[3], z[4]
        if k.case == NS:
            q_B, s_B, c_B = z[5], math.sin(z[6]), math.cos(z[6])
            w_z = q_B * c_B
    return omega_c, v_y, w_x, w_z, q_A, s_A, c_A, q_B, s_B, c_B, q_B * s_B


def rates(t: float, z: Any, k: System, out: Any) -> None:
    """Rates of the coordinates of a case."""
    if k.case % 3 == AWAY:
        return _rates_away(t, z, k, out)
    omega_0 = fluid(t, k)
    omega_c, v_y, w_x, w_z, q_A, s_A, c_A, q_B, s_B, c_B, _ = _wall_state(z, k)
    lag = omega_c - omega_0
    c = drag_rate(0.0, v_y, k.R * lag, k)
    A_x, A_y, A_z, B_x, B_y, B_z = forces(k.case, omega_c, v_y, w_x, c, lag, s_A, c_A, s_B, c_B, k)
    jmr = k.j * k.m * k.r
    push = (A_z + B_z) / k.m - c * k.R * lag
    roll = push / k.r
    power = -k.m * c * (k.R * k.R * omega_c * lag + v_y * v_y)
    dw_x = -A_z / jmr - omega_c * (v_y / k.r + w_z) - roll
    dw_z = dv_y = 0.0
    if k.case == NR or k.case == NS:
        dv_y = B_y / k.m - k.g - c * v_y
        out[1], out[2], out[3], out[4], first = v_y, dv_y, push / k.R, dw_x, 5
    else:
        out[1], first = push / k.R, 2
    out[0] = omega_c
    if k.case == SS or k.case == NS:
        dw_z = (A_x - B_y) / jmr + omega_c * (k.R * omega_c / k.r + w_x) - dv_y / k.r
    if k.case == SR or k.case == SS:
        bond = (q_A * c_A - w_z) / k.unit
        out[first] = dw_x * s_A + dw_z * c_A - bond * c_A
        power -= k.r * q_A * k.mu * A_y
        if k.case == SS:
            out[first + 1] = (dw_x * c_A - dw_z * s_A) / max(q_A, k.rtol * k.spin)
            first += 1
        first += 1
    if k.case == RS or k.case == SS or k.case == NS:
        dw_y = B_z / jmr + roll
        bond = (q_B * c_B - w_z) / k.unit
        out[first] = dw_y * s_B + dw_z * c_B - bond * c_B
        power -= k.r * q_B * k.eta * B_x
        if k.case != RS:
            out[first + 1] = (dw_y * c_B - dw_z * s_B) / max(q_B, k.rtol * k.spin)
            first += 1
        first += 1
    out[first] = power


def guards(t: float, z: Any, k: System, out: Any) -> None:
    """What is positive while a case lasts, in natural units, in the order of `ENDS`."""
    if k.case % 3 == AWAY:
        return _guards_away(t, z, k, out)
    omega_c, v_y, w_x, _, q_A, s_A, c_A, q_B, s_B, c_B, _ = _wall_state(z, k)
    lag = omega_c - fluid(t, k)
    c = drag_rate(0.0, v_y, k.R * lag, k)
    if k.case == RR:
        out[0] = rolls_on(omega_c, t, k)
        return
    A_x, A_y, A_z, B_x, B_y, B_z = forces(k.case, omega_c, v_y, w_x, c, lag, s_A, c_A, s_B, c_B, k)
    G = k.m * k.g
    if k.case == RS:
        out[0], out[1] = q_B / k.spin, (k.mu * A_y - math.sqrt(A_x * A_x + A_z * A_z)) / G
    elif k.case == SR:
        out[0] = q_A / k.spin
        out[1] = (k.eta * B_x - math.sqrt(B_y * B_y + B_z * B_z)) / G
        out[2] = A_y / G
    elif k.case == SS:
        out[0], out[1], out[2], out[3] = q_A / k.spin, q_B / k.spin, A_y / G, B_x / G
    else:
        out[0], out[1] = z[1] / k.R, q_B / k.spin
        if k.case == NR:
            out[1] = (k.eta * B_x - math.sqrt(B_y * B_y + B_z * B_z)) / G


def loads(omega_c: float, t: float, k: System) -> tuple[float, float]:
    """As `rolling_forces._loads`: centrifugal load and friction of RR, in units of the weight."""
    lag = abs(omega_c - fluid(t, k))
    friction = k.j * drag_rate(0.0, 0.0, k.R * lag, k) * k.R / k.g * lag / (1 + 2 * k.j)
    return k.R / k.g * omega_c * omega_c, friction


def last_share(u: float, z: float, k: System) -> float:
    """B_y in units of m g at which RR ends, from its loads, as `rolling_forces._last_share`."""
    at_B = (1 + k.j) * u
    return min(max(at_B - _normal_forces(at_B, z, k.eta)[0], 0.0), k.j * u)


def slip_margin(u: float, z: float, k: System) -> float:
    """How far RR is from lasting slip, in units of m g, as `rolling_forces.slip_margin`."""
    share = last_share(u, z, k)
    of_floor = k.mu * (1 - share) - math.sqrt((k.j * u - share) ** 2 + z * z)
    return min(k.eta * (1 + k.j) * u - z, of_floor)


def rolls_on(omega_c: float, t: float, k: System) -> float:
    """How far RR is from its end, >= 0 in it: `slip_margin`, or `rolling_forces.margin`."""
    u, z = loads(omega_c, t, k)
    if k.leaves == STABILITY:
        return slip_margin(u, z, k)
    at_A, at_B = 1 - k.j * u, (1 + k.j) * u
    (low_A, high_A), (low_B, high_B) = _normal_forces(at_A, z, k.mu), _normal_forces(at_B, z, k.eta)
    least, greatest = max(1 - high_A, at_B - high_B), min(1 - low_A, at_B - low_B)
    overlap = -math.inf if greatest == -math.inf else greatest - least
    size_A, size_B = math.sqrt(at_A * at_A + z * z), math.sqrt(at_B * at_B + z * z)
    slack_A = k.mu * size_A - (z if at_A >= 0 else size_A)
    return min(slack_A, k.eta * size_B - (z if at_B >= 0 else size_B), overlap)


def _normal_forces(d: float, z: float, friction: float) -> tuple[float, float]:
    """Least and greatest normal force that one cone admits, as `rolling_forces._normal_forces`."""
    square = d * d + z * z
    top = d + math.sqrt(max((friction - 1) * (friction + 1) * z * z + (friction * d) ** 2, 0.0))
    low = 0.0 if square == 0 else square / top if top > 0 else math.inf
    return low, (top / (1 - friction * friction) if friction < 1 else math.inf)


def _horizontal_drag(t: float, z: Any, rise: float, k: System) -> tuple[complex, complex, float]:
    """Complex horizontal velocity, the same relative to the fluid, m s-1, and c(|w|), s-1."""
    V = complex(z[2], z[3])
    lag = V - 1j * fluid(t, k) * complex(z[0], z[1])
    return V, lag, drag_rate(lag.real, rise, lag.imag, k)


def _rates_away(t: float, z: Any, k: System, out: Any) -> None:
    """`rates` of a ball away from the wall."""
    rise = 0.0
    if k.case == NN and k.fall.landing < math.inf:
        rise = drag.fall_speed(t - k.fall.since, k.fall.v_y, k)
    elif k.case == NN:
        rise = z[5]
    V, lag, c = _horizontal_drag(t, z, rise, k)
    power, push, last = -k.m * c * ((lag * V.conjugate()).real + rise * rise), -c * lag, 4
    if k.case == RN:
        push /= 1 + k.j
    elif k.case == SN:
        power -= k.m * k.mu * k.g * z[4]
        along = cmath.rect(1.0, z[5])
        friction = -k.mu * k.g * along
        turning = (push + (1 + 1 / k.j) * friction) / along
        push += friction
        out[4] = turning.real
        out[5] = turning.imag / max(z[4], k.rtol * math.sqrt(k.R * k.g))
        last = 6
    elif k.fall.landing == math.inf:
        out[4], out[5], last = rise, -k.g - c * rise, 6
    out[0], out[1], out[2], out[3], out[last] = V.real, V.imag, push.real, push.imag, power


def _guards_away(t: float, z: Any, k: System, out: Any) -> None:
    """`guards` of a ball away from the wall."""
    gap = 1 - math.sqrt(z[0] * z[0] + z[1] * z[1]) / k.R
    if k.case == RN:
        _, lag, c = _horizontal_drag(t, z, 0.0, k)
        out[0], out[1] = k.mu - k.j * (c / (1 + k.j)) * abs(lag) / k.g, gap
    elif k.case == SN:
        out[0], out[1] = z[4] / math.sqrt(k.R * k.g), gap
    else:
        out[0] = gap
        if k.fall.landing == math.inf:
            out[1] = z[4] / k.R


def smooth_rates(u: Velocities, h: float, t: float, k: System) -> Velocities:
    """Rates of u by gravity, drag, turning axes: (20) with (9), no contact; h is the gap at B."""
    turn, w_k = u.v_k / (k.R - h), u.v_k - fluid(t, k) * (k.R - h)
    c = drag_rate(u.v_h, u.v_y, w_k, k)
    return Velocities(
        -turn * u.v_k - c * u.v_h,
        -k.g - c * u.v_y,
        turn * u.v_h - c * w_k,
        -turn * u.o_z,
        0.0,
        turn * u.o_x,
    )
