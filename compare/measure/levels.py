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
    # unsteady: rates of the ramps, in units of c times the range of flows in which the ball slips
    "unsteady.rates": ((1e-2,), (2.5e-3, 5e-3, 1e-2), (1.25e-3, 2.5e-3, 5e-3, 1e-2)),
    # pulsation
    "pulsation.octaves": ((3, 6), (0, 1, 3, 4, 6, 7), tuple(range(8))),  # of the frequencies, above c/(4 pi)
    "pulsation.steps": (512, 1024, 2048),  # least number of time steps in a period
    "pulsation.width": (1e-3, 2.5e-4, 1.2e-4),  # relative width to which the onset of slip is bracketed
    # unloading
    "unloading.loose": (10.0, 1.0, 1.0),  # factor on the settling tolerance of the states in which trials begin
    "unloading.refine": ((16, 32), (32, 64), (64, 128)),  # time steps in a coarse one where the ball lands
    # recurrent: flows of the staircase in units of that of the set
    "recurrent.flows": (
        (1.0,),
        (1.0, 0.95, 0.91, 0.87, 0.83, 0.80),
        (1.0, 0.97, 0.94, 0.91, 0.88, 0.85, 0.82, 0.80),
    ),
    # choice: sets; the contacts of the second hover for long
    "choice.sets": (1, 2, 2),
}


def effort(name: str, level: Level) -> Any:
    """The entry of `EFFORT` for a level."""
    return EFFORT[name][level]
