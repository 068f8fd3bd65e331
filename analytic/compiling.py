"""Plain functions compiled with numba, which the extra `fast` installs; without it they run as they are, slower."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

F = TypeVar("F", bound=Callable[..., Any])
SOURCES = ("compiling", "corner", "drag", "marching", "rigid_body", "stepping")
"""Modules of this package that what is compiled is made of, its named tuples included."""

try:
    import numba
except ImportError:

    def compiled(function: F) -> F:
        """The function itself."""
        return function

else:
    # What is compiled is kept on disk. Of itself numba compiles a function again when its own file has changed; it
    # must also do so when one of those has that it calls.
    _CODE = b"".join(Path(__file__).with_name(f"{name}.py").read_bytes() for name in SOURCES)
    _STAMP = hashlib.sha256(_CODE).hexdigest()

    def compiled(function: F) -> F:
        """The function, compiled at its first call; threads can run it at once."""
        dispatcher: Any = numba.njit(cache=True, nogil=True, error_model="numpy")(function)
        if not numba.config.DISABLE_JIT:
            dispatcher._cache._cache_file._source_stamp = _STAMP
        return dispatcher  # type: ignore[no-any-return]
