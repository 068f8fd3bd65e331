"""State, frames and slip: equations (1)-(8), in both directions.

The state of the paper is ``x = [y, v_y, omega_c, slip_x, slip_y, slip_z]`` (19). Motion away from
the wall adds ``h = R - rho``, the gap at B (rho is the radius of the centre's orbit), and its rate
``v_h``, so that the full state has eight entries, those of `State`; a state of six entries means
``h = v_h = 0``.

Vectors are given in the co-rotating frame of the paper: i points radially inwards, j upwards, k = i
x j along the orbit. The world frame has z along the vessel's axis, up from the floor, and the
centre of the ball stands at ``(rho cos theta, rho sin theta, r + y)``."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from model.arrays import Array, Real
from model.errors import InputError
from model.parameters import Parameters, Range, check_number


class State(NamedTuple):
    """The state (19) of a ball, or its rate: floats, or arrays of one shape for many states.

    A tuple, taken wherever a state is asked for: ``State(omega_c=3.0, slip_x=-1.0)``."""

    y: Real = 0.0
    """Gap at A, m."""
    v_y: Real = 0.0
    """Its rate, m s-1."""
    omega_c: Real = 0.0
    """Angular velocity of the orbit, rad s-1."""
    slip_x: Real = 0.0
    """Angular velocities of slipping (4), rad s-1."""
    slip_y: Real = 0.0
    slip_z: Real = 0.0
    h: Real = 0.0
    """Gap at B, m."""
    v_h: Real = 0.0
    """Its rate, m s-1."""

    @classmethod
    def of(cls, x: npt.ArrayLike) -> State:
        """The state of 6 or 8 numbers, as floats, or states of an array (..., 6 or 8), as columns.

        A `State` is returned as it is. Raises `InputError` as `full_state`."""
        if isinstance(x, State):
            return x
        columns = np.moveaxis(full_state(x), -1, 0)
        return cls(*(columns.tolist() if columns.ndim == 1 else columns))

    @classmethod
    def one(cls, x: npt.ArrayLike) -> State:
        """A single state, checked, as floats; raises `InputError` for more than one."""
        if (state := full_state(x)).ndim > 1:
            raise InputError(f"one state is needed, not an array of shape {np.shape(x)}")
        return cls(*state.tolist())

    def stacked(self) -> Array:
        """The states as one array (..., 8); inverse of `of`."""
        return np.stack(np.broadcast_arrays(*self), axis=-1)


VARIABLES = State._fields
SLIP_XYZ = slice(VARIABLES.index("slip_x"), VARIABLES.index("slip_z") + 1)
"""The slips among the columns of states."""
TURNING = slice(VARIABLES.index("omega_c"), VARIABLES.index("slip_z") + 1)
"""omega_c and the slips: all that moves in SS, where both contacts last."""
UNITS = ("m", "m s-1", "rad s-1", "rad s-1", "rad s-1", "rad s-1", "m", "m s-1")


def state_units(p: Parameters) -> Array:
    """Natural sizes of the state (8,): R, sqrt(g R), sqrt(g/R), and sqrt(g R)/r for slip."""
    speed = math.sqrt(p.g * p.R)
    return np.array([p.R, speed, speed / p.R, speed / p.r, speed / p.r, speed / p.r, p.R, speed])


def check_place(x: State, p: Parameters, depth: float = 0.0) -> None:
    """`InputError` for a ball deeper in floor or wall than `depth`, m, or on the axis."""
    inside = Range(0.0 - depth, p.R, below=True)
    check_number("y", x.y, "m", Range(0.0 - depth), "to be above the floor it")
    check_number("h", x.h, "m", inside, "to be between wall and axis it")


class Motion(NamedTuple):
    """Motion of the ball in the world frame; arrays of shape (..., 3)."""

    position: Array
    """Of the centre, m."""
    velocity: Array
    """Of the centre, m s-1."""
    spin: Array
    """Angular velocity of the ball, rad s-1."""


def rotated(quaternion: Array, vector: Array) -> Array:
    """Vectors (..., 3) rotated by unit quaternions (..., 4), the scalar first."""
    scalar, axis = quaternion[..., :1], quaternion[..., 1:]
    turn = 2 * np.cross(axis, vector)
    return np.asarray(vector + scalar * turn + np.cross(axis, turn))


def full_state(x: npt.ArrayLike) -> Array:
    """Return states of shape (..., 8), adding h = v_h = 0 to states of shape (..., 6).

    Raises `InputError` for what isn't numbers, for another length or a value that is not finite."""
    try:
        state = np.asarray(x, dtype=float)
    except (TypeError, ValueError) as error:
        raise InputError(f"a state must be numbers, not {x!r}") from error
    if state.ndim == 0 or state.shape[-1] not in (6, 8):
        six = f"6 entries ({', '.join(VARIABLES[:6])})"
        raise InputError(f"a state has {six} or 8 (with h, v_h), not {state.shape}")
    if not np.all(np.isfinite(state)):
        place = tuple(np.argwhere(~np.isfinite(state))[0])
        k = int(place[-1])
        raise InputError(f"{VARIABLES[k]} = {state[place]} {UNITS[k]} must be finite")
    if state.shape[-1] == 6:
        state = np.concatenate([state, np.zeros((*state.shape[:-1], 2))], axis=-1)
    return state


def frame(theta: Array | float) -> Array:
    """Basis vectors i, j, k of the co-rotating frame as rows, shape (..., 3, 3), in world axes."""
    cos, sin = np.cos(theta), np.sin(theta)
    zero, one = np.zeros_like(cos), np.ones_like(cos)
    rows = [[-cos, -sin, zero], [zero, zero, one], [-sin, cos, zero]]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def angular_velocity(x: npt.ArrayLike, p: Parameters) -> Array:
    """Angular velocity of the ball (4) in the co-rotating frame, (..., 3), with rho for R."""
    _, v_y, omega_c, slip_x, slip_y, slip_z, h, _ = State.of(x)
    roll = (p.R - h) / p.r * omega_c
    return np.stack([roll + slip_x, slip_y - roll, v_y / p.r + slip_z], axis=-1)


def slip_velocities(x: npt.ArrayLike, p: Parameters) -> tuple[Array, Array]:
    """Velocities v_A, v_B of the lowest and the outermost point of the ball, each (..., 3), m s-1.

    (6) with its first row completed by v_y and v_h: v_A = (v_h + v_y + r w_z, v_y, -r w_x),
    v_B = (v_h, -r w_z, r w_y)."""
    _, v_y, _, w_x, w_y, w_z, _, v_h = State.of(x)
    v_A = np.stack([v_h + v_y + p.r * w_z, v_y, -p.r * w_x], axis=-1)
    v_B = np.stack([v_h, -p.r * w_z, p.r * w_y], axis=-1)
    return v_A, v_B


def slip_speeds(x: npt.ArrayLike, p: Parameters) -> tuple[Array, Array]:
    """Tangential slip speeds at A and B (7), each (...), m s-1."""
    (A_x, _, A_z), (_, B_y, B_z) = (np.moveaxis(v, -1, 0) for v in slip_velocities(x, p))
    return np.hypot(A_x, A_z), np.hypot(B_y, B_z)


def to_world(x: npt.ArrayLike, theta: npt.ArrayLike, p: Parameters) -> Motion:
    """Motion in the world frame of states x (..., 6 or 8) at azimuths theta (...)."""
    state, theta = State.of(x), np.asarray(theta, dtype=float)
    rho = p.R - state.h
    position = np.broadcast_arrays(rho * np.cos(theta), rho * np.sin(theta), p.r + state.y)
    velocity = np.stack([state.v_h, state.v_y, rho * state.omega_c], axis=-1)
    turn = np.swapaxes(frame(theta), -1, -2)
    spin = _matrix_product(turn, angular_velocity(x, p))
    return Motion(np.stack(position, axis=-1), _matrix_product(turn, velocity), spin)


def from_world(motion: Motion, p: Parameters) -> tuple[State, Array]:
    """States, as columns, and azimuths theta (...) of a motion in the world; inverse of `to_world`.

    On the axis itself the orbit has no direction: theta is 0 there and omega_c is nan."""
    px, py, pz = np.moveaxis(motion.position, -1, 0)
    theta, rho = np.arctan2(py, px), np.hypot(px, py)
    axes = frame(theta)
    v_h, v_y, v_k = np.moveaxis(_matrix_product(axes, motion.velocity), -1, 0)
    o_x, o_y, o_z = np.moveaxis(_matrix_product(axes, motion.spin), -1, 0)
    with np.errstate(invalid="ignore", divide="ignore"):
        omega_c = np.where(rho > 0, v_k / rho, np.nan)
    # v_k is rho omega_c: the rolling part needs no division by rho.
    slips = o_x - v_k / p.r, o_y + v_k / p.r, o_z - v_y / p.r
    return State(pz - p.r, v_y, omega_c, *slips, p.R - rho, v_h), theta


def _matrix_product(matrix: Array, vector: Array) -> Array:
    """Vectors (..., 3) multiplied by matrices (..., 3, 3)."""
    return np.asarray(np.einsum("...ab,...b->...a", matrix, vector))


def tangent(radius: float, azimuth: float) -> tuple[Array, Array]:
    """Point and inward normal, each (3,), of the plane that touches a cylinder about z there."""
    normal = -np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    return -radius * normal, normal
