"""The loops over steps and what is done between them: compiled with numba, which the extra `fast` installs, or as they
stand.

Of balls on joints that of `mjsim.stepping`, of free ones those of `mjsim.free` and `mjsim.landing`.
"""

from __future__ import annotations

import hashlib
import inspect
from pathlib import Path
from typing import Any

from mjsim import corrections, free, landing, recorder, stepping, world_axes
from mjsim.coulomb import compiled as kernels

if kernels.COMPILES:
    import numba
    from numba.extending import overload, register_jitable


up_to_landing, steps, through = stepping.up_to_landing, free.steps, landing.through


def served(law: Any, data: Any) -> Any:
    """The first argument of `free.under_law`: addresses for compiled loops, else the law and the data."""
    return law.addresses(data) if kernels.COMPILES else (law, data)


def served_plain(model: Any, data: Any) -> Any:
    """The argument of `stepping.engine_step`: addresses for compiled loops, else the model and the data."""
    return (model._address, data._address) if kernels.COMPILES else (model, data)


def _compiled(function: Any) -> Any:
    """A loop that is compiled when it is called first, by one process at a time; for arrays of any layout.

    Numba keeps what it compiles on disk by name, and compiles it again when the function's own file has changed, but
    not when that of a function has which it calls: the name contains the digest of those.
    """
    function.__qualname__ += f"_{_digest}"
    try:
        loop = numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    except RuntimeError:  # no place for a cache
        loop = numba.njit(nogil=True, error_model="numpy")(function)

    def kind(argument: Any) -> Any:
        found = numba.typeof(argument)
        return found.copy(layout="A") if isinstance(found, numba.types.Array) else found

    def call(*given: Any) -> Any:
        if not loop.overloads:
            with kernels.alone(loop):
                loop.compile(tuple(map(kind, given)))
        return loop(*given)

    return call


if kernels.COMPILES:
    _modules = corrections, stepping, world_axes, free, landing
    for module in _modules:  # the loops call their functions
        for each in vars(module).values():
            if inspect.isfunction(each) and each.__module__ == module.__name__:
                register_jitable(each)
    _files = (Path(str(module.__file__)) for module in (*_modules, recorder, kernels))
    _digest = hashlib.sha256(b"".join(file.read_bytes() for file in _files)).hexdigest()[:16]

    @overload(free.under_law, strict=False)  # type: ignore[untyped-decorator]
    def _under_law(served: Any, duration: Any, anew: Any) -> Any:
        return lambda served, duration, anew: kernels.step_of(served[0], served[1], served[2], duration, anew)

    @overload(stepping.engine_step, strict=False)  # type: ignore[untyped-decorator]
    def _engine_step(served: Any) -> Any:
        return lambda served: kernels.mj_step(served[0], served[1])

    up_to_landing, steps, through = map(_compiled, (up_to_landing, steps, through))
