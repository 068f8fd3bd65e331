"""Loops over steps: compiled with numba, which the extra `fast` installs, or as they stand."""

from __future__ import annotations

import functools
import hashlib
import inspect
from pathlib import Path
from typing import Any

from mjsim import recorder
from mjsim.coulomb import compiled as kernels

if kernels.COMPILES:
    import numba
    from numba.extending import register_jitable

    _register = functools.cache(register_jitable)


def loop(function: Any) -> Any:
    """A loop that is compiled when it is called first, by one process at a time.

    So are the functions of mjsim that it calls, which must be known above it.

    Numba keeps what it compiles on disk by name, and compiles it again when the function's own file
    has changed, but not when that of a function has which it calls: the name contains the digest of
    those."""
    if not kernels.COMPILES:
        return function
    called = _called(function)
    for each in called:
        _register(each)
    files = sorted({*map(inspect.getfile, called), str(recorder.__file__), str(kernels.__file__)})
    digest = hashlib.sha256(b"".join(Path(file).read_bytes() for file in files)).hexdigest()
    function.__qualname__ += f"_{digest[:16]}"
    try:
        compiled = numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    except RuntimeError:  # no place for a cache
        compiled = numba.njit(nogil=True, error_model="numpy")(function)

    @functools.wraps(function)
    def call(*given: Any) -> Any:
        if not compiled.overloads:
            with kernels.alone(compiled):
                compiled.compile(tuple(map(numba.typeof, given)))
        return compiled(*given)

    return call


def _called(function: Any) -> set[Any]:
    """The functions of mjsim that a function calls, and those that they call."""
    names = map(function.__globals__.get, function.__code__.co_names)
    own = {
        each
        for each in names
        if inspect.isfunction(each) and each.__module__.startswith(f"{__package__}.")
    }
    return own.union(*map(_called, own))
