"""Coordinates in which the motion of each case is regular, its equations in them, and what can end it.

On the wall these are the active variables of the case (Table 4), except that a slip with two components is given by
its speed q and direction (alpha at A, beta at B): the friction depends on the direction alone, so that the rates have
limits as the slip vanishes and q simply crosses zero. In SS both pairs are kept, although they share
slip_z = q_A cos alpha = q_B cos beta; deviations from that relation by integration errors are damped. The equations are
those of `dynamics`; only rates are converted here.

Away from the wall (RN, SN, NN) the frame rests, so that the vessel's axis is no singular point. The horizontal motion
is kept in complex numbers: position Z = rho e^(i theta), and (a, b) along the paper's i, k becomes
e^(i theta)(-a + i b); coordinates are their real and imaginary parts. The spin about the vertical never changes. The
equations are those of `dynamics`, written anew for this frame; test_charts compares the two.

The first coordinate is the azimuth, or Z, the last one the work of drag and friction, J. RR is in `two_point_rolling`.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from analytic.mechanics import drag, dynamics
from analytic.mechanics.rigid_body import Velocities, state, velocities
from analytic.simulation.motion import Chart, Fluid, Moment, Path, natural_units
from model import Case, Parameters, State
from model.arrays import Array
from model.drag import STOKES


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

    def at_z(z: Any) -> State:
        return State(omega_c=z[1], **{slip: sign * z[2]})

    def rates(t: float, z: Sequence[float]) -> list[float]:
        dx, power = _rates(case, at_z(z), p, omega_0(t), (sign, 0.0))
        return [z[1], dx.omega_c, sign * getattr(dx, slip), power]

    def guards(t: float, z: Sequence[float]) -> tuple[float, ...]:
        f = dynamics.FORCES[case](at_z(z), p, omega_0(t), (sign, 0.0))
        if case is Case.RS:
            return z[2] / w, (p.mu * f.A_y - math.hypot(f.A_x, f.A_z)) / G
        return z[2] / w, (p.eta * f.B_x - math.hypot(f.B_y, f.B_z)) / G, f.A_y / G

    def path(t: Array, z: Array) -> Path:
        along, none = np.full_like(t, sign * math.pi / 2), np.full_like(t, math.nan)
        alpha, beta = (none, along) if case is Case.RS else (along, none)
        return Path(t, z[0], at_z(z).stacked(), alpha, beta, z[3])

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


# Away from the wall, in the resting frame


def _rn(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """RN: (Z, dZ/dt, work); the spin follows."""
    (start, _, _, upright), (_, v, _, energy) = _start(at, p), natural_units(p)

    def rates(t: float, z: Sequence[float]) -> list[float]:
        Z, V = _centre(z)
        lag, c, power = _drag(Z, V, omega_0(t), p)
        share = c / (1 + p.j)
        return [V.real, V.imag, -share * lag.real, -share * lag.imag, power]

    def guards(t: float, z: Sequence[float]) -> tuple[float, ...]:
        Z, V = _centre(z)
        lag, c, _ = _drag(Z, V, omega_0(t), p)
        return p.mu - p.j * (c / (1 + p.j)) * abs(lag) / p.g, 1 - abs(Z) / p.R

    def path(t: Array, z: Array) -> Path:
        _, V = _centre(z)
        rolled = _path(t, z, at, p, upright, 1j * V / p.r)
        x = State.of(rolled.x)  # slip_x = 0 and v_h + r slip_z = 0 hold exactly
        return rolled._replace(x=x._replace(slip_x=0.0, slip_z=-x.v_h / p.r).stacked())

    return Chart(case, [*start, at.work], [p.R, p.R, v, v, energy], rates, ("A slips", "B lands"), guards, path)


def _sn(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """SN: (Z, dZ/dt, sliding speed at A, its direction in the resting frame, work)."""
    (start, V, spin, upright), (_, v, _, energy) = _start(at, p), natural_units(p)
    lever = 1 + 1 / p.j

    def rates(t: float, z: Sequence[float]) -> list[float]:
        *_, speed, phase, _ = z
        (Z, V), along = _centre(z), cmath.rect(1.0, phase)
        (lag, c, power), friction = _drag(Z, V, omega_0(t), p), -p.mu * p.g * along
        force, turning = -c * lag + friction, (-c * lag + lever * friction) / along
        work = power - p.m * p.mu * p.g * speed
        return [V.real, V.imag, force.real, force.imag, turning.real, turning.imag / max(speed, floor * v), work]

    def guards(t: float, z: Sequence[float]) -> tuple[float, ...]:
        *_, speed, _, _ = z
        return speed / v, 1 - abs(_centre(z)[0]) / p.R

    def path(t: Array, z: Array) -> Path:
        *_, speed, phase, _ = z
        (Z, V), slide = _centre(z), speed * np.exp(1j * phase)
        # e^(i theta)(-a + i b) with a, b along the cosine and minus the sine of alpha (6), (8).
        back = slide * np.conj(Z) / np.abs(Z)
        slid = _path(t, z, at, p, upright, (slide - V) / (1j * p.r))
        return slid._replace(alpha=np.arctan2(-back.imag, -back.real))

    # The velocity of the lowest point; at the onset it is zero and only alpha tells its direction.
    speed = abs(V + 1j * p.r * spin)
    phase = cmath.phase(cmath.exp(1j * at.theta) * complex(-math.cos(at.alpha), -math.sin(at.alpha)))
    first, scale = [*start, speed, phase, at.work], [p.R, p.R, v, v, v, 1.0, energy]
    return Chart(case, first, scale, rates, ("A sticks", "B lands"), guards, path, slips=(4,))


def _nn(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """NN, where the whole spin rests: (Z, dZ/dt, work) with Stokes' drag, where the fall is known (`drag.fall`).

    Else c depends on all components of the velocity: (Z, dZ/dt, y, v_y, work).
    """
    (start, _, spin, upright), (_, v, _, energy) = _start(at, p), natural_units(p)
    y, v_y, known = at.x.y, at.x.v_y, p.drag == STOKES

    def rates(t: float, z: Sequence[float]) -> list[float]:
        Z, V = _centre(z)
        rise = drag.fall_speed(t - at.time, v_y, p) if known else z[5]
        lag, c, power = _drag(Z, V, omega_0(t), p, rise)
        fall = [] if known else [rise, -p.g - c * rise]
        return [V.real, V.imag, -c * lag.real, -c * lag.imag, *fall, power]

    def guards(t: float, z: Sequence[float]) -> tuple[float, ...]:
        gap = 1 - abs(_centre(z)[0]) / p.R
        return (gap,) if known else (gap, z[4] / p.R)

    def path(t: Array, z: Array) -> Path:
        fall = drag.fall(t - at.time, y, v_y, p) if known else (z[4], z[5])
        return _path(t, z, at, p, upright, np.full(len(t), spin), fall)

    if known:
        landing, more, scale = at.time + drag.fall_time(y, v_y, p), [at.work], [energy]
    else:
        landing, more, scale = math.inf, [y, v_y, at.work], [p.R, v, energy]
    ends = ("B lands",) if known else ("B lands", "A lands")
    return Chart(case, [*start, *more], [p.R, p.R, v, v, *scale], rates, ends, guards, path, landing=landing)


def _start(at: Moment, p: Parameters) -> tuple[list[float], complex, complex, float]:
    """A moment in the resting frame: coordinates of (Z, dZ/dt), dZ/dt, horizontal spin, and that about the vertical."""
    turn, u = cmath.exp(1j * at.theta), velocities(at.x, p)
    Z, V = (p.R - at.x.h) * turn, turn * complex(-u.v_h, u.v_k)
    return [Z.real, Z.imag, V.real, V.imag], V, turn * complex(-u.o_x, u.o_z), u.o_y


def _centre(z: Any) -> tuple[Any, Any]:
    """Z and dZ/dt from the coordinates, of one time or of many."""
    Z_x, Z_y, V_x, V_y, *_ = z
    return Z_x + 1j * Z_y, V_x + 1j * V_y


def _drag(Z: complex, V: complex, omega_0: float, p: Parameters, v_y: float = 0.0) -> tuple[complex, float, float]:
    """Horizontal velocity relative to the fluid, m s-1; c(|w|), s-1; and the power of the drag, W."""
    lag = V - 1j * omega_0 * Z
    c = float(drag.of_velocity(lag.real, v_y, lag.imag, p))
    return lag, c, -p.m * c * (lag * V.conjugate()).real - p.m * c * v_y**2


def _path(
    t: Array, z: Array, at: Moment, p: Parameters, upright: float, spin: Any, fall: tuple[Array, Array] | None = None
) -> Path:
    """States from (Z, dZ/dt), the horizontal spin in the resting frame, and height and rate of a flight."""
    y, v_y = (np.zeros_like(t), np.zeros_like(t)) if fall is None else fall
    Z, V = _centre(z)
    rho, back = np.abs(Z), np.conj(Z) / np.abs(Z)
    V, spin = V * back, spin * back
    u = Velocities(-V.real, v_y, V.imag, -spin.real, upright, spin.imag)
    x = state(y, p.R - rho, u, p)._replace(omega_c=V.imag / rho)  # rho = R - h to the last digit
    angle, none = np.unwrap(np.append(at.theta, np.angle(Z)))[1:], np.full_like(t, math.nan)
    return Path(t, angle, x.stacked(), none, none, z[-1])


_CHARTS = {
    Case.RS: _one_slip,
    Case.SR: _one_slip,
    Case.SS: _ss,
    Case.NR: _off_floor,
    Case.NS: _off_floor,
    Case.RN: _rn,
    Case.SN: _sn,
    Case.NN: _nn,
}
