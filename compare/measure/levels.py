"""How much each level measures: step counts, durations and grids of every protocol, a row a number."""

from __future__ import annotations

from enum import IntEnum
from typing import Any


class Level(IntEnum):
    """How much is measured."""

    QUICK = 0
    DEFAULT = 1
    FULL = 2


EFFORT: dict[str, tuple[Any, Any, Any]] = {
    # quick, default, full
}


def effort(name: str, level: Level) -> Any:
    """The entry of `EFFORT` for a level."""
    return EFFORT[name][level]
