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
from typing import Any, NamedTuple

import numpy as np

from analytic import flight
from analytic.motion import Chart, Fluid, Moment, Path, natural_units
from model import Case, Parameters
from model.arrays import Array


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
    share = p.c / (1 + p.j)

    def rates(t: float, z: list[float]) -> list[float]:
        lag = _lag(t, z, omega_0)
        return [z[2], z[3], -share * lag.real, -share * lag.imag, _power(lag, z, p)]

    def guards(t: float, z: Sequence[float]) -> tuple[float, ...]:
        return p.mu - p.j * share * abs(_lag(t, z, omega_0)) / p.g, _gap(z, p)

    def path(t: Array, z: Array) -> Path:
        found = _path(t, z, at, p, start.upright, 1j * (z[2] + 1j * z[3]) / p.r)
        # slip_x = 0 and v_h + r slip_z = 0 hold exactly.
        found.x[:, 3], found.x[:, 5] = 0.0, -found.x[:, 7] / p.r
        return found

    return Chart(case, [*_pairs(start), at.work], [*unit, energy], rates, ("A slips", "B lands"), guards, path)


def slipping(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """SN: (Z, dZ/dt, sliding speed at A, its direction in the resting frame, work)."""
    start, unit, energy = _start(at, p), *_units(p)
    v, lever = unit[2], 1 + 1 / p.j

    def rates(t: float, z: list[float]) -> list[float]:
        lag, along = _lag(t, z, omega_0), cmath.rect(1.0, z[5])
        push, friction = -p.c * lag, -p.mu * p.g * along
        force, turning = push + friction, (push + lever * friction) / along
        work = _power(lag, z, p) - p.m * p.mu * p.g * z[4]
        return [z[2], z[3], force.real, force.imag, turning.real, turning.imag / max(z[4], floor * v), work]

    def guards(t: float, z: Sequence[float]) -> tuple[float, ...]:
        return z[4] / v, _gap(z, p)

    def path(t: Array, z: Array) -> Path:
        slide = z[4] * np.exp(1j * z[5])
        found = _path(t, z, at, p, start.upright, (slide - z[2] - 1j * z[3]) / (1j * p.r))
        place = z[0] + 1j * z[1]
        # e^(i theta)(-a + i b) with a, b along the cosine and minus the sine of alpha (6), (8).
        back = slide * np.conj(place) / np.abs(place)
        found.alpha[:] = np.arctan2(-back.imag, -back.real)
        return found

    # The velocity of the lowest point; at the onset it is zero and only alpha tells its direction.
    speed = abs(start.V + 1j * p.r * start.spin)
    phase = cmath.phase(start.turn * complex(-math.cos(at.alpha), -math.sin(at.alpha)))
    return Chart(
        case,
        [*_pairs(start), speed, phase, at.work],
        [*unit, v, 1.0, energy],
        rates,
        ("A sticks", "B lands"),
        guards,
        path,
        slips=(4,),
    )


def flying(case: Case, at: Moment, p: Parameters, omega_0: Fluid, floor: float) -> Chart:
    """NN: (Z, dZ/dt, work); height and fall are known (`flight`), and the whole spin rests."""
    start, unit, energy = _start(at, p), *_units(p)
    y, v_y = at.x.y, at.x.v_y

    def rates(t: float, z: list[float]) -> list[float]:
        lag, rise = _lag(t, z, omega_0), v_y - (p.c * v_y + p.g) * flight.decay(t - at.time, p.c)
        return [z[2], z[3], -p.c * lag.real, -p.c * lag.imag, _power(lag, z, p) - p.m * p.c * rise**2]

    def path(t: Array, z: Array) -> Path:
        return _path(t, z, at, p, start.upright, np.full(len(t), start.spin), flight.fall(t - at.time, y, v_y, p))

    return Chart(
        case,
        [*_pairs(start), at.work],
        [*unit, energy],
        rates,
        ("B lands",),
        lambda t, z: (_gap(z, p),),
        path,
        landing=at.time + flight.fall_time(y, v_y, p),
    )


def _start(at: Moment, p: Parameters) -> _Start:
    turn = cmath.exp(1j * at.theta)
    _, v_y, omega_c, w_x, w_y, w_z, h, v_h = at.x
    rho = p.R - h
    v_k = rho * omega_c
    spin = turn * complex(-(w_x + v_k / p.r), w_z + v_y / p.r)
    return _Start(rho * turn, turn * complex(-v_h, v_k), spin, w_y - v_k / p.r, turn)


def _pairs(start: _Start) -> list[float]:
    return [start.Z.real, start.Z.imag, start.V.real, start.V.imag]


def _units(p: Parameters) -> tuple[list[float], float]:
    """Natural sizes of (Z, dZ/dt), and of the work."""
    _, v, _, energy = natural_units(p)
    return [p.R, p.R, v, v], energy


def _lag(t: float, z: Sequence[float], omega_0: Fluid) -> complex:
    """Horizontal velocity relative to the fluid, m s-1."""
    return complex(z[2], z[3]) - 1j * omega_0(t) * complex(z[0], z[1])


def _power(lag: complex, z: Sequence[float], p: Parameters) -> float:
    """Power of the drag along the floor, W."""
    return -p.m * p.c * (lag.real * z[2] + lag.imag * z[3])


def _gap(z: Sequence[float], p: Parameters) -> float:
    return 1 - math.hypot(z[0], z[1]) / p.R


def _path(
    t: Array, z: Array, at: Moment, p: Parameters, upright: float, spin: Any, fall: tuple[Array, Array] | None = None
) -> Path:
    """States from (Z, dZ/dt), the horizontal spin in the resting frame, and height and rate of a flight."""
    height, rise = (np.zeros_like(t), np.zeros_like(t)) if fall is None else fall
    place, speed = z[0] + 1j * z[1], z[2] + 1j * z[3]
    radius, back = np.abs(place), np.conj(place) / np.abs(place)
    speed, spin = speed * back, spin * back
    rolled = speed.imag / p.r
    columns = [
        height,
        rise,
        speed.imag / radius,
        -spin.real - rolled,
        upright + rolled,
        spin.imag - rise / p.r,
        p.R - radius,
        -speed.real,
    ]
    angle = np.unwrap(np.append(at.theta, np.angle(place)))[1:]
    none = np.full_like(t, math.nan)
    return Path(t, angle, np.stack(columns, axis=-1), none, none.copy(), z[-1])
