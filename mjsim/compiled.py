"""The loops over steps and what is done between them: compiled with numba, which the extra `fast` installs, or as they
stand.

Of balls on joints `drive` of `mjsim.corrections`, of free ones those of `mjsim.free` and `mjsim.landing`.
"""

from __future__ import annotations

import hashlib
import inspect
from pathlib import Path
from typing import Any

from mjsim import corrections, free, landing, recorder, world_axes
from mjsim.corrections import Ball
from mjsim.coulomb import compiled as kernels

if kernels.COMPILES:
    import numba
    from numba.extending import overload, register_jitable
    from numba.np.unsafe.ndarray import to_fixed_tuple


drive, steps, through = corrections.drive, free.steps, landing.through


def served(law: Any, data: Any) -> Any:
    """What `free.under_law` takes a step with, here."""
    return law.addresses(data) if kernels.COMPILES else (law, data)


def _compiled(function: Any, *kinds: Any) -> Any:
    """A loop that is compiled when it is called first, by one process at a time; for all arguments of such `kinds`.

    Numba keeps what it compiles on disk by name, and compiles it again when the function's own file has changed, but
    not when that of a function has which it calls: the name contains the digest of those.
    """
    function.__qualname__ += f"_{_digest}"
    try:
        loop = numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    except RuntimeError:  # no place for a cache
        loop = numba.njit(nogil=True, error_model="numpy")(function)

    def call(*given: Any) -> Any:
        if not loop.overloads:
            with kernels.alone(loop):
                loop.compile(kinds or tuple(map(numba.typeof, given)))
        return loop(*given)

    return call


if kernels.COMPILES:
    _modules = corrections, world_axes, free, landing
    for module in _modules:  # the loops call their functions
        for each in vars(module).values():
            if inspect.isfunction(each) and each.__module__ == module.__name__:
                register_jitable(each)
    _files = (Path(str(module.__file__)) for module in (*_modules, recorder, kernels))
    _digest = hashlib.sha256(b"".join(file.read_bytes() for file in _files)).hexdigest()[:16]
    _fields = len(Ball._fields)

    @overload(corrections.ball_of, strict=False)  # type: ignore[untyped-decorator]
    def _ball_of(balls: Any, run: Any) -> Any:
        return lambda balls, run: Ball(*to_fixed_tuple(balls[:, run], _fields))

    @overload(free.under_law, strict=False)  # type: ignore[untyped-decorator]
    def _under_law(served: Any, duration: Any, anew: Any) -> Any:
        return lambda served, duration, anew: kernels.step_of(served[0], served[1], served[2], duration, anew)

    _rows, _flags = numba.types.Array(numba.float64, 2, "A"), (numba.int8[::1], numba.boolean[::1])
    _given = numba.types.Array(numba.float64, 2, "A", readonly=True)
    drive = _compiled(drive, numba.float64[::1], *[_rows] * 2, *_flags, *[_given] * 2, *[_rows] * 10)
    steps, through = _compiled(steps), _compiled(through)
