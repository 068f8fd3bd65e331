"""Compiled functions: numba with a cache on disk that is never stale, and C functions by
address."""

from __future__ import annotations

import contextlib
import functools
import hashlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import llvmlite.binding
import mujoco
import numba
import numpy.typing as npt
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.types.functions import ExternalFunction
from numba.experimental.function_type import _get_wrapper_address
from numba.extending import intrinsic
from numba.np import linalg


def _no_blas() -> None:
    raise ImportError("products of matrices are left to their own functions")


# Numba loads scipy, which takes a quarter of a second, to see whether `np.convolve` could use it.
_ensure_blas, linalg.ensure_blas = linalg.ensure_blas, _no_blas
import numba.np.arraymath  # noqa: E402

linalg.ensure_blas = _ensure_blas

if numba.config.DISABLE_JIT:
    raise ImportError("Coulomb's law is compiled by numba, which NUMBA_DISABLE_JIT switches off")
_OPTIONS = {"nogil": True, "error_model": "numpy", "fastmath": {"reassoc", "contract"}}


class _Part(JITCodeLibrary):  # type: ignore[misc]
    """Code that is nothing by itself: what calls it is optimised and made to run with it."""

    codegen = property(lambda self: self)

    def set_env(self, name: str, environment: Any) -> None:
        pass

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        return 0


class _PartCompiler(Compiler):  # type: ignore[misc]
    """Numba's compiler, for parts."""

    def __init__(self, typing: Any, target: Any, library: None, *given: Any) -> None:
        super().__init__(typing, target, _Part(target.codegen(), "part"), *given)


def kernel(function: Any, views: bool = False) -> Any:
    """A decorator: compile a function that other compiled ones call.

    It is compiled once for arguments of the same types, whatever constants it is called with. No
    references are counted: it makes no arrays, and returns none unless it `views` memory.
    """
    options = _OPTIONS | {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "_nrt": views}
    dispatcher = numba.njit(pipeline_class=_PartCompiler, **options)(function)
    template = dispatcher.get_call_template
    dispatcher.get_call_template = lambda given, named: template(
        tuple(map(types.unliteral, given)), named
    )
    return dispatcher


def view(function: Any) -> Any:
    """A decorator: a kernel that returns memory as an array."""
    return kernel(function, views=True)


def entry(function: Any) -> Any:
    """A decorator: compile a function that Python calls, at its first call, and keep it on disk.

    What it calls is a `kernel`, or a plain function that numba knows by `register_jitable`. Numba
    compiles it again when its own file has changed; that its name holds the digest of all sources
    makes it do so, too, when what it calls has changed. One process compiles at a time.
    """
    folders = {Path(__file__).parent, Path(function.__code__.co_filename).parent}
    function.__qualname__ += f"_{_digest(frozenset(folders))}"
    try:
        dispatcher = numba.njit(cache=True, **_OPTIONS)(function)
    except RuntimeError:  # no place for a cache
        dispatcher = numba.njit(**_OPTIONS)(function)

    @functools.wraps(function)
    def call(*given: Any) -> Any:
        if not dispatcher.overloads:
            with _alone(dispatcher):
                dispatcher.compile(tuple(map(numba.typeof, given)))
        return dispatcher(*given)

    call.dispatcher = dispatcher  # type: ignore[attr-defined]
    return call


@functools.cache
def _digest(folders: frozenset[Path]) -> str:
    """What compiled code depends on: sources, their package, and where MuJoCo keeps its fields."""
    files = sorted(path for folder in folders for path in folder.glob("*.py"))
    about = f"{__package__}, MuJoCo {mujoco.__version__}".encode()
    return hashlib.sha256(about + b"".join(map(Path.read_bytes, files))).hexdigest()[:16]


def c_address(call: Any) -> int:
    """The address of an entry of addresses, for C to call it."""
    dispatcher = call.dispatcher
    signature = (types.int64,) * call.__wrapped__.__code__.co_argcount
    with _alone(dispatcher):
        dispatcher.compile(signature)
    return int(_get_wrapper_address(dispatcher, dispatcher.nopython_signatures[0]))


@contextlib.contextmanager
def _alone(function: Any) -> Iterator[None]:
    """Within this no other process compiles: those that wait take what this one keeps on disk."""
    with contextlib.ExitStack() as stack:
        # no such locks here, or no place for a cache
        with contextlib.suppress(ImportError, OSError, TypeError):
            import fcntl

            file = stack.enter_context((Path(function.stats.cache_path) / "compiling").open("w"))
            fcntl.flock(file, fcntl.LOCK_EX)
        yield


def c_function(name: str, address: int, returns: Any, *arguments: Any) -> Any:
    """A C function for compiled code to call; the linker knows its address by the name, which no
    other package may have."""
    llvmlite.binding.add_symbol(name, address)
    return ExternalFunction(name, returns(*arguments))


def address_of(name: str, array: npt.NDArray[Any]) -> Any:
    """A compiled function that returns an array's address, also in code another process
    compiled."""
    llvmlite.binding.add_symbol(name, array.ctypes.data)

    @intrinsic  # type: ignore[untyped-decorator]
    def address(context: Any) -> Any:
        def code(context: Any, builder: Any, call: Any, args: Any) -> Any:
            known, integer = builder.module.globals, ir.IntType(64)
            found = known.get(name) or cgutils.add_global_variable(builder.module, integer, name)
            return builder.ptrtoint(found, integer)

        return types.int64(), code

    return address


@intrinsic  # type: ignore[untyped-decorator]
def call(context: Any, function: Any, m: Any, d: Any) -> Any:
    """Call a C function of two addresses, which returns one, by its own."""

    def code(context: Any, builder: Any, call: Any, args: Any) -> Any:
        integer = ir.IntType(64)
        kind = ir.FunctionType(integer, [integer, integer]).as_pointer()
        return builder.call(builder.inttoptr(args[0], kind), args[1:])

    return types.int64(types.int64, types.int64, types.int64), code
