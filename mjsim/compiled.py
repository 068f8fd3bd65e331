"""Loops over steps and what is done between them, compiled with numba, which the extra `fast` installs.

Of balls on joints this has a loop of its own over `mjsim.corrections`; of free ones those of `mjsim.free` and
`mjsim.landing` themselves.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
from numba import types
from numba.extending import overload, register_jitable
from numba.np.unsafe.ndarray import to_fixed_tuple

from mjsim import corrections as source
from mjsim import free, landing, world_axes
from mjsim.corrections import Ball, Velocity
from mjsim.coulomb import compiled as kernels
from model.arrays import Array

for each in (  # the others call them
    *(source.slip, source.resistance, source.lands, source.hovering, source.near_axis, source.unbearable),
    *(world_axes.outwards, world_axes.driven, world_axes.spun, world_axes.against, world_axes.slip),
    *(world_axes.unwrapped, world_axes.joint_velocities, free.step, landing.closes, landing.average),
):
    register_jitable(each)
_corrections, _eventful, _followed = map(
    numba.njit(cache=True, nogil=True), (source.corrections, source.eventful, source.followed)
)
_BALL, _VELOCITY = len(Ball._fields), len(Velocity._fields)
_ROWS = types.Array(types.float64, 2, "A")
_GIVEN = types.Array(types.float64, 2, "A", readonly=True)


def named_after(*modules: Any) -> Callable[..., Any]:
    """Give a function a name that contains the digest of what it calls.

    Numba keeps what it compiles on disk by name, and compiles it again when the function's own file has changed, but
    not when the file of a function that it calls has.
    """
    digest = hashlib.sha256(b"".join(Path(module.__file__).read_bytes() for module in modules)).hexdigest()

    def name(function: Callable[..., Any]) -> Callable[..., Any]:
        function.__qualname__ += f"_{digest[:16]}"
        return function

    return name


@numba.njit(cache=True, nogil=True)  # type: ignore[untyped-decorator]
@named_after(source)
def drive(
    omega_0: Array, balls: Array, due: Any, held: Any, contact: Array, normals: Array, forces: Array, qvel: Array,
    last: Array, qpos: Array, margins: Array, turn: Array, applied: Array, floor: Array, wall: Array,
) -> bool:  # fmt: skip
    """As `mjsim.stepping.drive`."""
    some = False
    for k in range(qpos.shape[1]):
        ball = Ball(*to_fixed_tuple(balls[:, k], _BALL))
        if not held[k]:
            for i in range(6):
                forces[i, k] = contact[i, k]
            forces[6, k], forces[7, k] = normals[0, k], normals[1, k]
        v, before = Velocity(*to_fixed_tuple(qvel[:, k], _VELOCITY)), Velocity(*to_fixed_tuple(last[:, k], _VELOCITY))
        loads = forces[6, k], forces[7, k]
        if loads[0] * loads[1] == 0:
            due[k] |= _eventful((qpos[0, k], qpos[1, k], qpos[2, k]), v, before, loads, ball)
        some |= due[k]
        if ball.gain > 0:
            margins[0, k] = _followed(margins[0, k], qpos[2, k], ball.gain)
            margins[1, k] = _followed(margins[1, k], qpos[1, k], ball.gain)
        turn[0, k], turn[3, k] = math.cos(qpos[0, k] / 2), math.sin(qpos[0, k] / 2)
        qpos[3, k], qpos[4:7, k] = 1.0, 0.0
        given, (floor[0, k], floor[1, k], wall[0, k], wall[1, k]) = _corrections(
            v, before, ball.R - qpos[1, k], omega_0[k], to_fixed_tuple(forces[:6, k], 6), loads, ball
        )
        applied[0, k], applied[1, k], applied[2, k], applied[3, k], applied[4, k], applied[5, k] = given
    return some


_FLAGS = types.Array(types.boolean, 1, "C")
with kernels.alone(drive):
    drive.compile((types.float64[::1], _ROWS, _FLAGS, _FLAGS, *[_GIVEN] * 2, *[_ROWS] * 9))
drive.disable_compile()


@overload(free.under_law, strict=False)  # type: ignore[untyped-decorator]
def _under_law(served: Any, duration: Any, anew: Any) -> Any:
    return lambda served, duration, anew: kernels.step_of(served[0], served[1], served[2], duration, anew)


_named = named_after(source, world_axes, free, landing, kernels)


def _compiled(function: Any) -> Any:
    """A loop that is compiled when it is called first, by one process at a time."""
    loop = numba.njit(cache=True, nogil=True, error_model="numpy")(_named(function))

    def call(*given: Any) -> Any:
        if loop.overloads:
            return loop(*given)
        with kernels.alone(loop):
            return loop(*given)

    return call


steps, through = _compiled(free.steps), _compiled(landing.through)
