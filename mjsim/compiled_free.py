"""Loops over steps of a free ball, compiled with numba, which the extra `fast` installs: the same source as without."""

from __future__ import annotations

from typing import Any

import numba
from numba.extending import overload, register_jitable

from mjsim import compiled, corrections, free, landing, world_axes
from mjsim.coulomb import compiled as kernels

for each in (
    *(world_axes.outwards, world_axes.driven, world_axes.spun, world_axes.against, world_axes.slip),
    *(world_axes.unwrapped, world_axes.joint_velocities, free.step, landing.closes),
):
    register_jitable(each)


@overload(free.under_law, strict=False)  # type: ignore[untyped-decorator]
def _under_law(served: Any, duration: Any, anew: Any) -> Any:
    return lambda served, duration, anew: kernels.step_of(served[0], served[1], served[2], duration, anew)


def _compiled(function: Any) -> Any:
    """A loop that is compiled when it is called first, by one process at a time."""
    named = compiled.named_after(corrections, world_axes, free, landing, kernels)(function)
    loop = numba.njit(cache=True, nogil=True, error_model="numpy")(named)

    def call(*given: Any) -> Any:
        if loop.signatures:
            return loop(*given)
        with kernels.alone(loop):
            return loop(*given)

    return call


steps, through = _compiled(free.steps), _compiled(landing.through)
