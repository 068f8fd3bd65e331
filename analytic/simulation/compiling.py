"""Plain functions compiled with numba, which the extra `fast` installs; without it they run as they are, slower."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])

try:
    import numba
except ImportError:
    numba = None


def compiled(function: F) -> F:
    """The function, compiled at its first call and kept on disk; threads can run it at once."""
    if numba is None:
        return function
    return numba.njit(cache=True, nogil=True, error_model="numpy")(function)  # type: ignore[no-any-return]


def callable_when_compiled(*functions: Callable[..., Any]) -> None:
    """Let functions `compiled` in this folder call plain ones from elsewhere, which are compiled with them."""
    if numba is not None:
        for each in functions:
            numba.extending.register_jitable(error_model="numpy")(each)
        forget_stale(Path(__file__).with_name("__pycache__"), {each.__code__.co_filename for each in functions})


def forget_stale(directory: Path, sources: Iterable[str]) -> None:
    """Delete what numba keeps in a directory if one of the sources has changed, which numba doesn't notice itself.

    It compiles a function again when its own file has changed, but not when that of a function has that it calls.
    """
    made_of = hashlib.sha256(b"".join(Path(each).read_bytes() for each in sorted(sources))).hexdigest()
    note = directory / "compiled-from.txt"
    if os.access(directory, os.W_OK) and not (note.exists() and note.read_text() == made_of):
        for stale in directory.glob("*.nb?"):
            stale.unlink(missing_ok=True)
        note.write_text(made_of)
