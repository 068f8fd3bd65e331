"""How much each level measures: step counts, durations and grids of every protocol, a row a number."""

from __future__ import annotations

from enum import IntEnum
from typing import Any


class Level(IntEnum):
    """How much is measured."""

    QUICK = 0
    DEFAULT = 1
    FULL = 2


_FLOWS = (
    *(0.43, 0.51, 0.62, 0.75, 0.9, 1.02, 1.13, 1.26, 1.4, 1.53),
    *(1.7, 1.87, 2.05, 2.27, 2.5, 2.78, 3.1, 3.43, 3.8, 4.2),
)
_FEW = (0.62, 1.4, 1.7, 2.5, 4.2)
"""Chosen with results in sight, so that on the sets of quick they bracket every threshold."""
_STARTS = "rest", "with the fluid", "on the wall"
EFFORT: dict[str, tuple[Any, Any, Any]] = {
    # quick, default, full
    # settling: lengths of successive rounds, in units of `settling.SPAN`. The later ones are longer, because a ball on
    # the wall that goes on from its mean swings again, if less, and that has to die out, too.
    "settling.rounds": ((1.0, 2.0, 2.0),) * 3,
    "settling.steps": (2048,) * 3,  # a round is a multiple of so many coarse time steps
    # settled: flows omega_0 sqrt(R/g) for every kind of start, and the share of the drift limit down to which a state
    # goes on, and the multiple of it up to which it counts.
    "settled.starts": (dict.fromkeys(_STARTS, _FEW), dict.fromkeys(_STARTS, _FLOWS), dict.fromkeys(_STARTS, _FLOWS)),
    "settled.sharp": (1.0, 0.1, 0.1),
    "settled.loose": (1.0, 1.0, 1.0),
    # flows inside a bracket in each round, by which it shrinks to a half or an eighth
    "brackets.sections": (1, 7, 7),
    # thresholds: relative widths of the last brackets, of those about a fold, and the factor on the settling tolerance
    "thresholds.width": (5e-5, 1e-6, 5e-7),
    "thresholds.fold": (1.2e-3, 3e-4, 1.5e-4),
    "thresholds.loose": (10.0, 1.0, 1.0),
    "thresholds.rounds": ((1.0, 2.0, 2.0),) * 3,
    # edge: parts of the way from omega_02 to omega_04, lines for each edge, time of a run in units of 1/c
    "edge.flows": ((0.3,), (0.1, 0.17, 0.26, 0.38, 0.6), (0.1, 0.17, 0.26, 0.38, 0.45, 0.6, 0.8)),
    "edge.lines": (3, 4, 6),
    "edge.time": (20.0, 60.0, 60.0),
    # plane: points spread evenly over each plane, and added in each round
    "plane.spread": (8, 160, 600),
    "plane.rounds": ((1.0, 2.0, 2.0),) * 3,  # as settling.rounds, in units of half of it
    "plane.added": ((4,), (60, 60, 60), (200,) * 5),
    # hysteresis: how long each level of the loop is held in units of 1/c, parts of a gap in which a case changes
    "hysteresis.hold": (40.0, 60.0, 100.0),
    "hysteresis.parts": (2, 4, 8),
    # slope: slipping states of a set at which it is measured, at most
    "slope.slipping": (2, 20, 20),
    # unsteady: time after a jump in units of 1/c, and its time steps in a coarse one; rates of the ramps, in units of c
    # times the range of flows in which the ball slips
    "unsteady.lasts": (48.0,) * 3,
    "unsteady.refine": ((2, 4),) * 3,
    "unsteady.rates": ((1e-2,), (2.5e-3, 5e-3, 1e-2), (1.25e-3, 2.5e-3, 5e-3, 1e-2)),
    # pulsation
    "pulsation.octaves": ((3, 6), (0, 1, 3, 4, 6, 7), tuple(range(8))),  # of the frequencies, above c/(4 pi)
    "pulsation.steps": (512, 1024, 2048),  # least number of time steps in a period
    "pulsation.samples": (256, 256, 256),  # in a period
    "pulsation.width": (1e-3, 2.5e-4, 1.2e-4),  # relative width to which the onset of slip is bracketed
    # unloading
    "unloading.refine": ((16, 32), (32, 64), (64, 128)),  # time steps in a coarse one where the ball lands
    # recurrent: flows of the staircase in units of that of the set
    "recurrent.flows": (
        (1.0,),
        (1.0, 0.95, 0.91, 0.87, 0.83, 0.80),
        (1.0, 0.97, 0.94, 0.91, 0.88, 0.85, 0.82, 0.80),
    ),
    # choice: sets; the contacts of the second hover for long
    "choice.sets": (1, 2, 2),
    # bounds: parts of a step of `short.REFINED`. Contacts with much friction answer more slowly: with whole steps the
    # slope of gamma was too coarse on 11 of the 24 sets of the default level.
    "bounds.refined": (1, 4, 4),
    # field, growth, steepest, rates, laws, motions
    "field.starts": (4, 4, 12),  # random starts for every case and set
    "field.kept": (4, 6, 24),  # most states measured for every case and set
    "growth.more": (1, 2, 6),  # multiples of the numbers of directions in growth.PUSHES
    "steepest.states": (1, 3, 12),  # random states of every set out of which slip is pushed all round
    "rates.refined": ((8, 16), (16, 32), (32, 64)),  # the two time steps, in parts of the coarse step
    "rates.leaning": ((8, 16),) * 3,  # in SR: with shorter steps an almost unloaded floor lets go under larger loads
    "rates.more": (1, 2, 5),  # multiples of the numbers of states in rates.STATES
    "laws.refined": ((4, 8), (8, 16), (16, 32)),  # the two time steps, in parts of the coarse step
    "motions.pieces": (6, 20, 32),  # pieces of a motion
}


BESIDE: dict[str, Any] = {
    # engines beside the one on trial measure as much as the quick level at every level, but for this
    "settled.starts": {"with the fluid": (0.62, 1.7, 4.2), "on the wall": (1.7, 4.2)},
    "settled.loose": 100.0,
    "settling.rounds": (0.45, 1.0, 1.0),
    "settling.steps": 512,
    "brackets.sections": 1,
    "thresholds.width": 5e-4,
    "thresholds.loose": 1e4,
    "thresholds.rounds": (0.4, 1.0),
    "plane.rounds": (1.0, 2.0),
    "hysteresis.hold": 15.0,
    "hysteresis.parts": 1,
    "unsteady.lasts": 16.0,
    "unsteady.refine": (2, 2),
    "unsteady.rates": (4e-2,),
    "pulsation.octaves": (3,),
    "pulsation.steps": 256,
    "pulsation.samples": 512,
    "pulsation.width": 2e-3,
    "rates.refined": (16, 16),
    "rates.leaning": (16, 16),
    "rates.more": 0.5,
    "laws.refined": (4, 4),
    "field.starts": 2,
    "field.kept": 2,
}


BESIDE_LONGER: dict[str, Any] = {
    # and at the levels above quick, on whose rarer sets motions die out more slowly
    "thresholds.loose": 1e3,
    "thresholds.rounds": (1.0, 2.0),
    "unsteady.lasts": 48.0,
}


def effort(name: str, level: Level, beside: bool = False) -> Any:
    """The entry of `EFFORT` for a level, or of an engine beside the one on trial."""
    if not beside:
        return EFFORT[name][level]
    more = BESIDE_LONGER if level > Level.QUICK else {}
    return (BESIDE | more).get(name, EFFORT[name][Level.QUICK])
