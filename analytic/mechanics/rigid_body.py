"""The ball as a rigid body under gravity, drag and contact forces, whatever its case.

All on plain floats, with parameters p that have the names of `model.Parameters`; compiled, too."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from model import State
from model.arrays import Real


class Velocities(NamedTuple):
    """Velocities of the centre (m s-1) and spin (rad s-1) along i, j, k, or their rates."""

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


def velocities(x: Sequence[Real], p: Any) -> Velocities:
    """Velocities of a state, (2) and (4)."""
    _, v_y, omega_c, w_x, w_y, w_z, h, v_h = x
    v_k = (p.R - h) * omega_c
    return Velocities(v_h, v_y, v_k, w_x + v_k / p.r, w_y - v_k / p.r, w_z + v_y / p.r)


def state(y: Real, h: Real, u: Velocities, p: Any) -> State:
    """The state of a ball with velocities u; inverse of `velocities`."""
    v_h, v_y, v_k, o_x, o_y, o_z = u
    return State(y, v_y, v_k / (p.R - h), o_x - v_k / p.r, o_y + v_k / p.r, o_z - v_y / p.r, h, v_h)


def slip_at_A(u: Velocities, p: Any) -> tuple[Real, Real]:
    """Velocity of the lowest point along i and k (6)."""
    v_h, _, v_k, o_x, _, o_z = u
    return v_h + p.r * o_z, v_k - p.r * o_x


def slip_at_B(u: Velocities, p: Any) -> tuple[Real, Real]:
    """Velocity of the outermost point along j and k (6)."""
    _, v_y, v_k, _, o_y, o_z = u
    return v_y - p.r * o_z, v_k + p.r * o_y


def apply(u: Velocities, P: Forces, p: Any) -> Velocities:
    """Velocities after impulses P; or of accelerations u, those with forces P besides: (20)."""
    m, jmr = p.m, p.j * p.m * p.r
    (v_h, v_y, v_k, o_x, o_y, o_z), (A_x, A_y, A_z, B_x, B_y, B_z) = u, P
    v_h, v_y, v_k = v_h + (A_x + B_x) / m, v_y + (A_y + B_y) / m, v_k + (A_z + B_z) / m
    return Velocities(v_h, v_y, v_k, o_x - A_z / jmr, o_y + B_z / jmr, o_z + (A_x - B_y) / jmr)


def contact_work(u: Velocities, P: Forces, p: Any) -> Real:
    """Work of impulses P at contact points that move with the mean velocities u, J."""
    (A_x, A_y, A_z, B_x, B_y, B_z), (A_s, A_t), (B_s, B_t) = P, slip_at_A(u, p), slip_at_B(u, p)
    return A_x * A_s + A_y * u.v_y + A_z * A_t + B_x * u.v_h + B_y * B_s + B_z * B_t


def energy(y: Real, u: Velocities, p: Any) -> Real:
    """Kinetic and potential energy, J; 0 at rest on the floor."""
    v_h, v_y, v_k, o_x, o_y, o_z = u
    spin = p.j * p.r**2 * (o_x**2 + o_y**2 + o_z**2)
    return p.m * ((v_h**2 + v_y**2 + v_k**2 + spin) / 2 + p.g * y)


def mean(a: Velocities, b: Velocities) -> Velocities:
    """The mean of two velocities."""
    o_x, o_y, o_z = (a.o_x + b.o_x) / 2, (a.o_y + b.o_y) / 2, (a.o_z + b.o_z) / 2
    return Velocities((a.v_h + b.v_h) / 2, (a.v_y + b.v_y) / 2, (a.v_k + b.v_k) / 2, o_x, o_y, o_z)
