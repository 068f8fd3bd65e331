"""Compiling by numba, which the extra `fast` installs."""

from __future__ import annotations

import gc
import hashlib
from collections.abc import Callable
from contextlib import ExitStack, suppress
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any, TypeVar

try:
    import numba
    from numba.extending import overload, register_jitable
except ImportError:
    numba = None

F = TypeVar("F", bound=Callable[..., Any])
_CALLED = {"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
_registered = set[Callable[..., Any]]()


def register(*modules: ModuleType) -> str:
    """Let compiled functions call the functions that modules list as `TEXT`; return a digest of their sources."""
    for function in (each for module in modules for each in module.TEXT):
        if numba is not None and function not in _registered:
            _registered.add(register_jitable(**_CALLED)(function))
    return hashlib.sha256(b"".join(Path(str(module.__file__)).read_bytes() for module in modules)).hexdigest()[:16]


def compiled(digest: str) -> Callable[[F], F]:
    """A decorator: compiles a function at its first call, for threads to run it at once; without numba leaves it as is.

    Numba keeps what it compiles on disk by name and compiles it again when its own file has changed, but not when that
    of a function has which it calls: the name contains the digest of those.
    """

    def compile_(function: F) -> F:
        if numba is None or numba.config.DISABLE_JIT:
            return function
        own: Any = FunctionType(function.__code__, function.__globals__, function.__name__, function.__defaults__)
        own.__qualname__, own.__doc__ = f"{function.__qualname__}_{digest}", function.__doc__
        try:
            return _compiled_by_one_process(numba.njit(cache=True, nogil=True, error_model="numpy")(own))  # type: ignore[no-any-return]
        except RuntimeError:  # no place for a cache
            return numba.njit(nogil=True, error_model="numpy")(own)  # type: ignore[no-any-return]

    return compile_


def _compiled_by_one_process(function: Any) -> Any:
    """A compiled function: of processes that need it at once one compiles, the others take what it keeps on disk."""
    compile_ = function._compile_for_args

    def compile_alone(*given: Any, **named: Any) -> Any:
        with ExitStack() as stack:
            with suppress(ImportError, OSError):  # no such locks here
                import fcntl

                file = stack.enter_context((Path(function.stats.cache_path) / "compiling").open("w"))
                fcntl.flock(file, fcntl.LOCK_EX)
            if gc.isenabled():  # looking for garbage among all that compiling makes takes a tenth of it
                gc.disable()
                stack.callback(gc.enable)
            return compile_(*given, **named)

    function._compile_for_args = compile_alone
    return function


def in_place_of(function: Callable[..., Any]) -> Callable[[F], F]:
    """A decorator: where compiled functions call `function`, the decorated one is compiled in its place."""

    def register(other: F) -> F:
        overload(function, strict=False, jit_options=_CALLED)(lambda *types: other)
        return other

    return register
