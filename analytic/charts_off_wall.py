"""Charts of the three cases away from the wall: RN, SN, NN, in the resting frame.

There the vessel's axis is a place like any other. The horizontal motion is kept in complex numbers: position
Z = rho e^(i theta), and (a, b) along the paper's i, k becomes e^(i theta)(-a + i b); coordinates are their real and
imaginary parts. The spin about the vertical never changes. The equations are those of `dynamics`, written anew for this
frame; test_charts holds one against the other.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from analytic import drag, flight
from analytic.motion import Chart, Fluid, Moment, Path, natural_units
from analytic.rigid_body import Velocities, state, velocities
from model import Case, Parameters, State
from model.arrays import Array
from model.drag import STOKES


def rolling(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
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


def slipping(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
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


def flying(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """NN, where the whole spin rests: (Z, dZ/dt, work) with Stokes' drag, where height and fall are known (`flight`).

    Else c depends on all components of the velocity: (Z, dZ/dt, y, v_y, work).
    """
    (start, _, spin, upright), (_, v, _, energy) = _start(at, p), natural_units(p)
    y, v_y, known = at.x.y, at.x.v_y, p.drag == STOKES

    def rates(t: float, z: Sequence[float]) -> list[float]:
        Z, V = _centre(z)
        rise = flight.speed(t - at.time, v_y, p) if known else z[5]
        lag, c, power = _drag(Z, V, omega_0(t), p, rise)
        fall = [] if known else [rise, -p.g - c * rise]
        return [V.real, V.imag, -c * lag.real, -c * lag.imag, *fall, power]

    def guards(t: float, z: Sequence[float]) -> tuple[float, ...]:
        gap = 1 - abs(_centre(z)[0]) / p.R
        return (gap,) if known else (gap, z[4] / p.R)

    def path(t: Array, z: Array) -> Path:
        fall = flight.fall(t - at.time, y, v_y, p) if known else (z[4], z[5])
        return _path(t, z, at, p, upright, np.full(len(t), spin), fall)

    if known:
        landing, more, scale = at.time + flight.fall_time(y, v_y, p), [at.work], [energy]
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
