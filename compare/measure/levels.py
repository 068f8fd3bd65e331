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
    # field, growth, steepest, rates, laws, motions
    "field.starts": (4, 4, 12),  # random starts for every case and set
    "field.kept": (4, 6, 24),  # most states measured for every case and set
    "growth.more": (1, 2, 6),  # multiples of the numbers of directions in growth.PUSHES
    "steepest.states": (1, 3, 12),  # random states of every set out of which slip is pushed all round
    "rates.refined": ((8, 16), (16, 32), (32, 64)),  # the two time steps, in parts of the coarse step
    "rates.more": (1, 2, 5),  # multiples of the numbers of states in rates.STATES
    "laws.refined": ((4, 8), (8, 16), (16, 32)),  # the two time steps, in parts of the coarse step
    "motions.pieces": (6, 20, 32),  # pieces of a motion
}


def effort(name: str, level: Level) -> Any:
    """The entry of `EFFORT` for a level."""
    return EFFORT[name][level]
