"""The corrections compiled with numba, which the extra `fast` installs: the same source, run by run.

What is done to a ball stands in `mjsim.corrections`; this is only the loop over the runs round it.
"""

from __future__ import annotations

import math

import numba
from numba import types
from numba.np.unsafe.ndarray import to_fixed_tuple

from mjsim import corrections as source
from mjsim.corrections import Ball, Motion
from model.arrays import Array

_compile = numba.njit(cache=True)
_motion, _corrections, _followed = _compile(source.motion), _compile(source.corrections), _compile(source.followed)
_BALL, _MOTION = len(Ball._fields), len(Motion._fields)
_ROWS = types.Array(types.float64, 2, "A")
_GIVEN = types.Array(types.float64, 2, "A", readonly=True)


@numba.njit(types.boolean(types.boolean, types.float64[::1], *[_GIVEN] * 5, *[_ROWS] * 7), cache=True)  # type: ignore[untyped-decorator]
def drive(
    watched: bool, omega_0: Array, balls: Array, last: Array, contact: Array, normals: Array, qvel: Array,
    now: Array, qpos: Array, margins: Array, turn: Array, applied: Array, floor: Array, wall: Array,
) -> bool:  # fmt: skip
    """As `mjsim.stepping.Polar._drive`, for arrays (n, runs); puts the present motion into `now`."""
    runs = qpos.shape[1]
    if not watched:
        for k in range(runs):
            if normals[0, k] * normals[1, k] == 0:
                return False
    for k in range(runs):
        ball = Ball(*to_fixed_tuple(balls[:, k], _BALL))
        if ball.gain > 0:
            margins[0, k] = _followed(margins[0, k], qpos[2, k], ball.gain)
            margins[1, k] = _followed(margins[1, k], qpos[1, k], ball.gain)
        turn[0, k], turn[3, k] = math.cos(qpos[0, k] / 2), math.sin(qpos[0, k] / 2)
        qpos[3, k], qpos[4:7, k] = 1.0, 0.0
        rho = ball.R - qpos[1, k]
        at = _motion(rho, ball.r, *to_fixed_tuple(qvel[:, k], 6))
        before = Motion(*to_fixed_tuple(last[:, k], _MOTION))
        forces, (floor[0, k], floor[1, k], wall[0, k], wall[1, k]) = _corrections(
            at, before, rho, omega_0[k], to_fixed_tuple(contact[:, k], 6), to_fixed_tuple(normals[:, k], 2), ball
        )
        applied[0, k], applied[1, k], applied[2, k], applied[3, k], _, applied[5, k] = forces
        for i in range(_MOTION):
            now[i, k] = at[i]
    return True
