"""Compiling by numba.

`mjsim.coulomb` has its own: theory imports nothing of it, and its wheel has no theory."""

import gc
import hashlib
from collections.abc import Callable
from contextlib import ExitStack, suppress
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any, TypeVar

import numba
from numba.extending import register_jitable

F = TypeVar("F", bound=Callable[..., Any])
_CALLED = {"error_model": "numpy", "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
called = set[Callable[..., Any]]()
"""Functions that compiled ones call."""


def compiled(function: F) -> F:
    """Compile a function at its first call, for threads, with what it calls of `analytic`.

    Numba keeps what it compiles on disk by name and compiles it again when its own file has
    changed, but not when that of a function has which it calls: the name contains the digest of
    those. Of processes that need it at once one compiles, the others take what it keeps."""
    if numba.config.DISABLE_JIT:
        return function
    its_own = _called(function)
    for each in its_own - called:
        called.add(register_jitable(**_CALLED)(each))
    files = sorted({each.__code__.co_filename for each in its_own})
    digest = hashlib.sha256(b"".join(Path(file).read_bytes() for file in files)).hexdigest()
    own: Any = FunctionType(
        function.__code__, function.__globals__, function.__name__, function.__defaults__
    )
    own.__qualname__, own.__doc__ = f"{function.__qualname__}_{digest[:16]}", function.__doc__
    try:
        dispatcher = numba.njit(cache=True, nogil=True, error_model="numpy")(own)
    except RuntimeError:  # no place for a cache
        return numba.njit(nogil=True, error_model="numpy")(own)  # type: ignore[no-any-return]
    compile_ = dispatcher._compile_for_args

    def compile_alone(*given: Any, **named: Any) -> Any:
        with ExitStack() as stack:
            with suppress(ImportError, OSError):  # no such locks here
                import fcntl

                file = stack.enter_context(
                    (Path(dispatcher.stats.cache_path) / "compiling").open("w")
                )
                fcntl.flock(file, fcntl.LOCK_EX)
            # looking for garbage among all that compiling makes takes a tenth of it
            if gc.isenabled():
                gc.disable()
                stack.callback(gc.enable)
            return compile_(*given, **named)

    dispatcher._compile_for_args = compile_alone
    return dispatcher  # type: ignore[no-any-return]


def _called(function: Callable[..., Any]) -> set[Callable[..., Any]]:
    """The functions of `analytic` that a function calls, by name or through a module; and so on."""
    found, todo = set[Callable[..., Any]](), [function]
    while todo:
        code, known = (one := todo.pop()).__code__, one.__globals__
        modules = (each for each in map(known.get, code.co_names) if isinstance(each, ModuleType))
        places: list[Any] = [known, *map(vars, modules)]
        for each in (place.get(name) for place in places for name in code.co_names):
            ours = isinstance(each, FunctionType) and each.__module__.startswith("analytic.")
            if ours and each not in found:
                found.add(each)
                todo.append(each)
    return found
