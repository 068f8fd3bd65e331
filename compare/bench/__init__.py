"""Exact contact cases, engines on trial on them, and the league."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from compare.bench.exact import cases
    from compare.bench.runner import Result, run

__all__ = ["Result", "cases", "run"]
_MODULES = {"Result": "runner", "cases": "exact", "run": "runner"}


def __getattr__(name: str) -> Any:
    """What is asked for is imported then: a list of the cases needs no solver."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(f"compare.bench.{_MODULES[name]}"), name)
