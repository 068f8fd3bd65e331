"""From what the engine holds to samples in the paper's axes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mjsim.classify import ContactHistory
from model import Parameters, State, trajectory
from model.arrays import Array

COORDINATES, NSENSOR = 3, 14
"""Sizes of the row of a step: azimuth, inward and upward; after their velocities and spin two
contact sensors, with force, gap and velocity each."""
SENSORS = COORDINATES + 6
"""Where the sensors begin; place and velocities are those before the step."""
COLUMNS = SENSORS + NSENSOR
SLIPS = 5, 6, 12, 13
"""Where they hold the slip velocities of A and B."""
NORMALS = 0, 7
"""Where they hold the normal forces."""
HUGE = 1e10
"""Beyond this MuJoCo takes a coordinate for divergence (mjMAXVAL)."""
_FORCE, _DIST, _SLIP = slice(0, 3), 3, slice(5, 7)
FRAMES = {
    "A": np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]]),
    "B": np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]]),
}
"""Normal and tangents of the contacts, in rows along the paper's axes."""


def joint_state(x: npt.ArrayLike, p: Parameters) -> tuple[Array, Array]:
    """Places (..., 3), at azimuth zero, and velocities (..., 6) of the joints of states x (..., 6
    or 8).

    The axes of the joints are the paper's, so that the velocities are v_A, v_B and the slip of (4)
    rearranged: ``qvel = (omega_c, v_h, v_y, o_x, o_y - omega_c, o_z)`` with the angular velocity o
    of the ball."""
    y, v_y, omega_c, slip_x, slip_y, slip_z, h, v_h = State.of(x)
    roll = (p.R - h) / p.r * omega_c
    place = np.stack([np.zeros_like(y), h, y], axis=-1)
    qvel = np.stack(
        [omega_c, v_h, v_y, slip_x + roll, slip_y - roll - omega_c, slip_z + v_y / p.r], axis=-1
    )
    return place, qvel


def state(place: Array, qvel: Array, p: Parameters) -> State:
    """The states of joint coordinates, as columns; the inverse of `joint_state`."""
    _, h, y = np.moveaxis(place, -1, 0)
    omega_c, v_h, v_y, o_x, o_y, o_z = np.moveaxis(qvel, -1, 0)
    roll = (p.R - h) / p.r * omega_c
    return State(y, v_y, omega_c, o_x - roll, o_y + omega_c + roll, o_z - v_y / p.r, h, v_h)


def contacts(rows: Array) -> ContactHistory:
    """Loads, friction, slip speeds and gaps of contacts in successive steps, from rows (steps,
    `COLUMNS`)."""
    each = rows[:, SENSORS:].reshape(len(rows), 2, NSENSOR // 2)
    normal, first, second = np.moveaxis(each[..., _FORCE], -1, 0)
    slips = np.moveaxis(each[..., _SLIP], -1, 0)
    return ContactHistory(
        normal,
        np.hypot(first, second),
        np.hypot(slips[0], slips[1]),
        rows[:, COORDINATES - 1 : 0 : -1],
    )


def samples(time: Array, rows: Array, lead: float, p: Parameters) -> npt.NDArray[np.void]:
    """Samples of dtype `SAMPLE`, shape (n,), all but the case; time (n,), rows (n, `COLUMNS`).

    Places are `lead` s ahead of velocities, and are brought back by these: that leaves h^2/8 times
    the acceleration."""
    place, qvel, sensors = np.split(rows, [COORDINATES, SENSORS], axis=1)
    place = place - lead * qvel[:, :3]
    block = trajectory.samples(time, place[:, 0], state(place, qvel, p), p)
    for contact, sensor in zip("AB", np.split(sensors, 2, axis=1), strict=True):
        gap = block[f"gap_{contact}"]
        speed = block[f"slip_speed_{contact}"]
        touches = sensor[:, _FORCE.start] > 0
        block[f"force_{contact}"] = sensor[:, _FORCE] @ FRAMES[contact]
        # Of a contact that bears nothing the coordinates say how far it is, and how fast.
        gap[touches] = sensor[touches, _DIST]
        speed[touches] = np.hypot(*sensor[touches, _SLIP].T)
    return block
