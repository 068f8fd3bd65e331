"""Steps of a free ball under Coulomb's law, compiled with numba, which the extra `fast` installs: see `mjsim.free`."""

from __future__ import annotations

import math
from typing import Any

import numba
from numba.extending import register_jitable

from mjsim import compiled, corrections, world_axes
from mjsim.corrections import Ball
from mjsim.coulomb import compiled as kernels
from mjsim.recorder import SENSORS, SLIPS
from model.arrays import Array

_outwards, _driven, _spun, _against, _slip, _unwrapped = (
    register_jitable(each)
    for each in (
        world_axes.outwards,
        world_axes.driven,
        world_axes.spun,
        world_axes.against,
        world_axes.slip,
        world_axes.unwrapped,
    )
)
_A_x, _A_y, _B_x, _B_y = (SLIPS - SENSORS).tolist()


@numba.njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
@compiled.named_after(corrections, world_axes, kernels)
def _advance(
    m: int, d: int, head: int, ball: Any, ahead: float, heavy: float, fluid: Array, qpos: Array, qvel: Array,
    last: Array, applied: Array, wall: Array, at: Array, sensors: Array, seen: Array, theta: float,
) -> float:  # fmt: skip
    for number in range(len(fluid)):
        x, y = qpos[0], qpos[1]
        forces = _driven(qpos, qpos[3:], qvel, last, ahead, fluid[number], ball)
        for i in range(6):
            applied[i] = forces[i]
        theta = _unwrapped(math.atan2(y, x), theta)
        wall[0], wall[3] = math.cos(theta / 2), math.sin(theta / 2)
        spin = _spun(qpos[3:], qvel)
        slip = _slip(qpos, qvel, spin, ahead, ball)
        inwards, onwards, up = _against(qpos, qvel, spin, ahead, ball.R, ball.r)
        qvel[6], qvel[7], qvel[8] = -inwards, onwards, -up
        applied[6], applied[8] = heavy / ahead * inwards, heavy / ahead * up
        at[2], qpos[7], qpos[8], qpos[9] = qpos[2], 0.0, 0.0, 0.0
        seen[number, -2], seen[number, -1] = qpos[2] - ball.r, ball.R - math.hypot(x, y)
        kernels.mj_step1(m, d)
        kernels.control_linked(m, d, head)
        kernels.mj_step2(m, d)
        kernels.retain_linked(m, d, head)
        for i in range(len(sensors)):
            seen[number, i] = sensors[i]
        seen[number, _A_x], seen[number, _A_y], seen[number, _B_x], seen[number, _B_y] = slip
    return theta


def advance(
    served: tuple[int, ...], data: Any, wall: Array, at: Array, ball: Ball, ahead: float, fluid: Array, seen: Array,
    theta: float,
) -> float:  # fmt: skip
    """As `mjsim.free` takes steps, one for each omega_0; return the azimuth before the last step.

    `served` is what `Coulomb.addresses` are; places are `ahead` of velocities; `wall` and `at` are the quaternion and
    the place of the wall.
    """
    heavy = float(data.model.dof_M0[6])
    state = data.qpos, data.qvel, data.qacc_warmstart, data.qfrc_applied, wall, at, data.sensordata
    return float(_advance(*served, ball, ahead, heavy, fluid, *state, seen, theta))
