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
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from analytic import drag, flight
from analytic.motion import Chart, Fluid, Moment, Path, natural_units
from analytic.rigid_body import Velocities, state, velocities
from model import Case, Parameters, State
from model.arrays import Array
from model.drag import STOKES


class _Start(NamedTuple):
    """A moment in the resting frame."""

    Z: complex
    """Position of the centre, m."""
    V: complex
    """Its velocity, m s-1."""
    spin: complex
    """Horizontal spin of the ball, rad s-1."""
    upright: float
    """Spin about the vertical, rad s-1."""
    turn: complex
    """e^(i theta)."""


def rolling(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """RN: (Z, dZ/dt, work); the spin follows."""
    start, unit, energy = _start(at, p), *_units(p)

    def lag_and_share(t: float, Z: complex, V: complex) -> tuple[complex, float]:
        lag = _lag(Z, V, omega_0(t))
        return lag, _coefficient(lag, p) / (1 + p.j)

    def rates(t: float, z: Sequence[float]) -> list[float]:
        Z, V = _centre(z)
        lag, share = lag_and_share(t, Z, V)
        return [V.real, V.imag, -share * lag.real, -share * lag.imag, _power(lag, V, p)]

    def guards(t: float, z: Sequence[float]) -> tuple[float, ...]:
        Z, V = _centre(z)
        lag, share = lag_and_share(t, Z, V)
        return p.mu - p.j * share * abs(lag) / p.g, _gap(Z, p)

    def path(t: Array, z: Array) -> Path:
        _, V = _centre(z)
        rolled = _path(t, z, at, p, start.upright, 1j * V / p.r)
        x = State.of(rolled.x)  # slip_x = 0 and v_h + r slip_z = 0 hold exactly
        return replace(rolled, x=x._replace(slip_x=0.0, slip_z=-x.v_h / p.r).stacked())

    return Chart(case, [*_pairs(start), at.work], [*unit, energy], rates, ("A slips", "B lands"), guards, path)


def slipping(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """SN: (Z, dZ/dt, sliding speed at A, its direction in the resting frame, work)."""
    start, unit, energy = _start(at, p), *_units(p)
    (*_, v), lever = unit, 1 + 1 / p.j

    def rates(t: float, z: Sequence[float]) -> list[float]:
        *_, speed, phase, _ = z
        (Z, V), along = _centre(z), cmath.rect(1.0, phase)
        lag, friction = _lag(Z, V, omega_0(t)), -p.mu * p.g * along
        c = _coefficient(lag, p)
        force, turning = -c * lag + friction, (-c * lag + lever * friction) / along
        work = _power(lag, V, p) - p.m * p.mu * p.g * speed
        return [V.real, V.imag, force.real, force.imag, turning.real, turning.imag / max(speed, floor * v), work]

    def guards(t: float, z: Sequence[float]) -> tuple[float, ...]:
        *_, speed, _, _ = z
        return speed / v, _gap(_centre(z)[0], p)

    def path(t: Array, z: Array) -> Path:
        *_, speed, phase, _ = z
        (Z, V), slide = _centre(z), speed * np.exp(1j * phase)
        # e^(i theta)(-a + i b) with a, b along the cosine and minus the sine of alpha (6), (8).
        back = slide * np.conj(Z) / np.abs(Z)
        slid = _path(t, z, at, p, start.upright, (slide - V) / (1j * p.r))
        return replace(slid, alpha=np.arctan2(-back.imag, -back.real))

    # The velocity of the lowest point; at the onset it is zero and only alpha tells its direction.
    speed = abs(start.V + 1j * p.r * start.spin)
    phase = cmath.phase(start.turn * complex(-math.cos(at.alpha), -math.sin(at.alpha)))
    first, scale = [*_pairs(start), speed, phase, at.work], [*unit, v, 1.0, energy]
    return Chart(case, first, scale, rates, ("A sticks", "B lands"), guards, path, slips=(4,))


def flying(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """NN, where the whole spin rests."""
    return (_flying_by_stokes if p.drag == STOKES else _flying)(case, at, p, omega_0)


def _flying(case: Case, at: Moment, p: Parameters, omega_0: Fluid) -> Chart:
    """(Z, dZ/dt, y, v_y, work): c depends on all components of the velocity."""
    start, (unit, energy) = _start(at, p), _units(p)

    def rates(t: float, z: Sequence[float]) -> list[float]:
        (Z, V), v_y = _centre(z), z[5]
        lag = _lag(Z, V, omega_0(t))
        c = _coefficient(lag, p, v_y)
        work = _power(lag, V, p, v_y)
        return [V.real, V.imag, -c * lag.real, -c * lag.imag, v_y, -p.g - c * v_y, work]

    def guards(t: float, z: Sequence[float]) -> tuple[float, ...]:
        return _gap(_centre(z)[0], p), z[4] / p.R

    def path(t: Array, z: Array) -> Path:
        return _path(t, z, at, p, start.upright, np.full(len(t), start.spin), (z[4], z[5]))

    first, scale = [*_pairs(start), at.x.y, at.x.v_y, at.work], [*unit, p.R, unit[-1], energy]
    return Chart(case, first, scale, rates, ("B lands", "A lands"), guards, path)


def _flying_by_stokes(case: Case, at: Moment, p: Parameters, omega_0: Fluid) -> Chart:
    """(Z, dZ/dt, work); height and fall are known (`flight`)."""
    start, unit, energy = _start(at, p), *_units(p)
    y, v_y = at.x.y, at.x.v_y

    def rates(t: float, z: Sequence[float]) -> list[float]:
        Z, V = _centre(z)
        lag, rise = _lag(Z, V, omega_0(t)), v_y - (p.c * v_y + p.g) * flight.decay(t - at.time, p.c)
        return [V.real, V.imag, -p.c * lag.real, -p.c * lag.imag, _power(lag, V, p, rise)]

    def guards(t: float, z: Sequence[float]) -> tuple[float, ...]:
        return (_gap(_centre(z)[0], p),)

    def path(t: Array, z: Array) -> Path:
        return _path(t, z, at, p, start.upright, np.full(len(t), start.spin), flight.fall(t - at.time, y, v_y, p))

    first, scale, landing = [*_pairs(start), at.work], [*unit, energy], at.time + flight.fall_time(y, v_y, p)
    return Chart(case, first, scale, rates, ("B lands",), guards, path, landing=landing)


def _start(at: Moment, p: Parameters) -> _Start:
    turn, u = cmath.exp(1j * at.theta), velocities(at.x, p)
    return _Start((p.R - at.x.h) * turn, turn * complex(-u.v_h, u.v_k), turn * complex(-u.o_x, u.o_z), u.o_y, turn)


def _pairs(start: _Start) -> list[float]:
    return [start.Z.real, start.Z.imag, start.V.real, start.V.imag]


def _units(p: Parameters) -> tuple[list[float], float]:
    """Natural sizes of (Z, dZ/dt), and of the work."""
    _, v, _, energy = natural_units(p)
    return [p.R, p.R, v, v], energy


def _centre(z: Any) -> tuple[Any, Any]:
    """Z and dZ/dt from the coordinates, of one time or of many."""
    Z_x, Z_y, V_x, V_y, *_ = z
    return Z_x + 1j * Z_y, V_x + 1j * V_y


def _lag(Z: complex, V: complex, omega_0: float) -> complex:
    """Horizontal velocity relative to the fluid, m s-1."""
    return V - 1j * omega_0 * Z


def _coefficient(lag: complex, p: Parameters, v_y: float = 0.0) -> float:
    """c(|w|), s-1."""
    return float(drag.of_velocity(lag.real, v_y, lag.imag, p))


def _power(lag: complex, V: complex, p: Parameters, v_y: float = 0.0) -> float:
    """Power of the drag, W."""
    mc = p.m * _coefficient(lag, p, v_y)
    return -mc * (lag * V.conjugate()).real - mc * v_y**2


def _gap(Z: complex, p: Parameters) -> float:
    return 1 - abs(Z) / p.R


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
