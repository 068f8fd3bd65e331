"""Steps of a free ball under Coulomb's law, compiled with numba, which the extra `fast` installs: see `mjsim.free`."""

from __future__ import annotations

import math
from typing import Any

import numba
from numba.extending import register_jitable

from mjsim import compiled, corrections, free
from mjsim.corrections import Ball
from mjsim.coulomb import Coulomb
from mjsim.coulomb import compiled as kernels
from model.arrays import Array

_driven, _unwrapped = register_jitable(free.driven), register_jitable(free.unwrapped)


@numba.njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
@compiled.named_after(corrections, free, kernels)
def _advance(
    m: int, d: int, head: int, ball: Any, fluid: Array,
    qpos: Array, qvel: Array, applied: Array, wall: Array, sensors: Array, seen: Array, theta: float,
) -> float:  # fmt: skip
    for number in range(len(fluid)):
        x, y = qpos[0], qpos[1]
        forces = _driven(qpos, qpos[3:], qvel, fluid[number], ball)
        for i in range(6):
            applied[i] = forces[i]
        theta = _unwrapped(math.atan2(y, x), theta)
        wall[0], wall[3] = math.cos(theta / 2), math.sin(theta / 2)
        seen[number, -2], seen[number, -1] = qpos[2] - ball.r, ball.R - math.hypot(x, y)
        kernels.mj_step1(m, d)
        kernels.control_linked(m, d, head)
        kernels.mj_step2(m, d)
        kernels.retain_linked(m, d, head)
        for i in range(len(sensors)):
            seen[number, i] = sensors[i]
    return theta


def advance(law: Coulomb, data: Any, ball: Ball, fluid: Array, seen: Array, theta: float) -> float:
    """As `mjsim.free` takes steps, one for each omega_0; return the azimuth before the last."""
    state = data.qpos, data.qvel, data.qfrc_applied, data.mocap_quat[0], data.sensordata
    return float(_advance(*law.addresses(data), Ball(*map(float, ball)), fluid, *state, seen, theta))
