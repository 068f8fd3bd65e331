"""The ball as a rigid body under gravity, drag and whatever its contacts do, with no case in mind.

All on plain floats.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from model import Parameters
from model.arrays import Real

Six = tuple[float, float, float, float, float, float]


class Velocities(NamedTuple):
    """Velocities of the centre (m s-1) and spin (rad s-1) along the paper's axes i, j, k, or their rates."""

    v_h: Real
    v_y: Real
    v_k: Real
    """rho omega_c."""
    o_x: Real
    o_y: Real
    o_z: Real


class Forces(NamedTuple):
    """Forces of floor (A) and wall (B) on the ball along the paper's axes, N; or impulses, N s."""

    A_x: Real = 0.0
    A_y: Real = 0.0
    A_z: Real = 0.0
    B_x: Real = 0.0
    B_y: Real = 0.0
    B_z: Real = 0.0


NOTHING = Forces()


class Place(NamedTuple):
    """Where the ball's centre is along i and k, and how fast these axes turn about j."""

    x_i: float
    x_k: float
    spin: float


def velocities(x: Sequence[float], p: Parameters) -> Six:
    """Velocities of a state of eight variables, (2) and (4)."""
    _, v_y, omega_c, w_x, w_y, w_z, h, v_h = x
    v_k = (p.R - h) * omega_c
    return v_h, v_y, v_k, w_x + v_k / p.r, w_y - v_k / p.r, w_z + v_y / p.r


def state(y: float, h: float, u: Six, p: Parameters) -> list[float]:
    """The eight state variables of a ball with velocities u; inverse of `velocities`."""
    v_h, v_y, v_k, o_x, o_y, o_z = u
    return [y, v_y, v_k / (p.R - h), o_x - v_k / p.r, o_y + v_k / p.r, o_z - v_y / p.r, h, v_h]


def slip_at_A(u: Six, p: Parameters) -> tuple[float, float]:
    """Velocity of the lowest point along i and k (6)."""
    return u[0] + p.r * u[5], u[2] - p.r * u[3]


def slip_at_B(u: Six, p: Parameters) -> tuple[float, float]:
    """Velocity of the outermost point along j and k (6)."""
    return u[1] - p.r * u[5], u[2] + p.r * u[4]


def apply(u: Six, P: Six, p: Parameters) -> Six:
    """Velocities after impulses P; or with accelerations u, accelerations under forces P besides: (20)."""
    jmr = p.j * p.m * p.r
    A_x, A_y, A_z, B_x, B_y, B_z = P
    return (
        u[0] + (A_x + B_x) / p.m, u[1] + (A_y + B_y) / p.m, u[2] + (A_z + B_z) / p.m,
        u[3] - A_z / jmr, u[4] + B_z / jmr, u[5] + (A_x - B_y) / jmr,
    )  # fmt: skip


def smooth_rates(u: Six, at: Place, omega_0: float, p: Parameters) -> Six:
    """Rates of u by gravity, drag and the turning of the axes: (20) with (9), no contact."""
    v_h, v_y, v_k, o_x, _, o_z = u
    return (
        -at.spin * v_k - p.c * (v_h - omega_0 * at.x_k),
        -p.g - p.c * v_y,
        at.spin * v_h - p.c * (v_k + omega_0 * at.x_i),
        -at.spin * o_z, 0.0, at.spin * o_x,
    )  # fmt: skip


def drag_power(u: Six, at: Place, omega_0: float, p: Parameters) -> float:
    """Power of the drag (9), W."""
    v_h, v_y, v_k = u[:3]
    return -p.m * p.c * (v_h * (v_h - omega_0 * at.x_k) + v_y**2 + v_k * (v_k + omega_0 * at.x_i))


def contact_work(u: Six, P: Six, p: Parameters) -> float:
    """Work of impulses P at contact points that move with the mean velocities u, J."""
    (A_s, A_t), (B_s, B_t) = slip_at_A(u, p), slip_at_B(u, p)
    return P[0] * A_s + P[1] * u[1] + P[2] * A_t + P[3] * u[0] + P[4] * B_s + P[5] * B_t


def energy(y: float, u: Six, p: Parameters) -> float:
    """Kinetic and potential energy, J; 0 at rest on the floor."""
    v_h, v_y, v_k, o_x, o_y, o_z = u
    spin = p.j * p.r**2 * (o_x**2 + o_y**2 + o_z**2)
    return p.m * ((v_h**2 + v_y**2 + v_k**2 + spin) / 2 + p.g * y)


def mean(a: Six, b: Six) -> Six:
    """Half the sum."""
    return (
        (a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2,
        (a[3] + b[3]) / 2, (a[4] + b[4]) / 2, (a[5] + b[5]) / 2,
    )  # fmt: skip


def plus(a: Six, factor: float, b: Six) -> Six:
    """a + factor b."""
    return (
        a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2],
        a[3] + factor * b[3], a[4] + factor * b[4], a[5] + factor * b[5],
    )  # fmt: skip


def turned(u: Six, angle: float) -> Six:
    """Components of u along axes turned by an angle about j."""
    v_h, v_y, v_k, o_x, o_y, o_z = u
    cos, sin = math.cos(angle), math.sin(angle)
    return v_h * cos - v_k * sin, v_y, v_k * cos + v_h * sin, o_x * cos - o_z * sin, o_y, o_z * cos + o_x * sin
