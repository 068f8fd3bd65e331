"""What is measured: by whom, on which sets, with which steps, in which detail, how many numbers.

`PLAN` is the table, a line a protocol. Below it are the parameter sets of each level, and
`Sampling`: step counts, durations, grids.

A few sets are chosen by hand, and a design fills a box evenly. Friction is greater on the floor in
some, on the wall in others, and the wall's is below and above the inertia j; drag is weak in some
and strong in others. Two have another law of drag, at Reynolds numbers of hundreds. Each protocol
chooses omega_0 itself: that of a set is not used.

An engine other than the one on trial, with time steps of its own, measures as much as the quick
level at every level, but for what `OWN_STEPS` says, and looks where the one on trial found
something."""

import math
from collections.abc import Iterable
from dataclasses import KW_ONLY, dataclass, replace
from enum import IntEnum
from typing import Any

import numpy as np

from compare.campaign.sweep import sobol
from compare.engines.study import MOREAU, Engine, Role
from model import Parameters
from model.drag import QUADRATIC, SCHILLER_NAUMANN


class Level(IntEnum):
    """How much is measured."""

    QUICK = 0
    DEFAULT = 1
    FULL = 2


Names = tuple[str, ...]  #: of parameter sets
ONE_BALL = ("reference",)  #: for what one ball shows as well as many, or the paper draws for one
ENDS_OF_ROLLING = (*ONE_BALL, "high-wall-friction")
"""One ball that comes to slip on the floor, and one that the wall's friction lifts first."""
DRAG_LAWS = (*ONE_BALL, "wake", "blunt")  #: one for each law of drag
LIMIT_SETS = (*ENDS_OF_ROLLING, "rough-floor", "wake")
"""Also a floor on which balls slip, or ride the wall, at one flow; and another law of drag."""
VARIED = (*ENDS_OF_ROLLING, "rough-floor", "thick-fluid", "wake", "blunt", "rubber-wall")
"""Those above; drag so strong that nothing folds; another law of drag; friction of the wall above
that of the floor and the inertia. On them all wrong theories are noticed that are noticed on all
nine sets chosen by hand."""
MOST_LIMIT_SETS = 12
"""Sets, at most, that engines in the zero-step limit measure above the quick level."""


@dataclass(frozen=True)
class Entry:
    """The plan of a protocol."""

    trial: Names = VARIED
    """Sets that the engine on trial measures at the quick level; at the others all of them."""
    limit: Names = ()
    """Sets that an engine in the zero-step limit measures at the quick level. At the others
    these are the first `MOST_LIMIT_SETS`, and `reference` alone where none is named here."""
    steps: tuple[int, int] = (3, 3)
    """With how many of its time steps it does, the coarsest first: at quick, and above. 0: not."""
    as_it_comes: Names = ()  #: sets that an engine with its own settings measures, at every level
    free: Names = ()  #: sets that the ball as a free body measures, above the quick level
    _: KW_ONLY
    level: Level = Level.QUICK  #: the least level of which the protocol is a part
    by: Engine | None = None
    """Who measures, where it isn't the engine on trial; engines beside that one then don't."""
    settles: bool = True  #: whether it needs motions that settle
    seeded: bool = False
    """Whether an engine beside the one on trial looks where that one found something."""
    only: str = ""  #: why it needs the set `reference`, and no other; empty if it takes all sets
    numbers: int = 1
    """How many numbers there must be of a set at the quick level with the protocol's own time step,
    or reasons: the least that any set has by MuJoCo, event-driven simulation or time stepping."""
    seconds: float = 1.0
    """Processor time at the quick level on some machine, of the engine on trial."""


LAWLESS = 0.25  #: processor time of a step without the law, divided by that of one with it
HOPS = "hops that last are those of the set hopping"
# fmt: off
PLAN: dict[str, Entry] = {
    # What is a single long run begins first: beside it there is work for the other workers. Then
    # what takes longest. At the quick level engines in the limit are too coarse for thresholds: no
    # claim was decided by theirs.
    # protocol          on trial, quick   in the limit     steps   as it comes
    "recurrent":  Entry(ONE_BALL, only=HOPS, numbers=3, seconds=6),
    "stepped":    Entry(ONE_BALL, only=HOPS, by=MOREAU, numbers=3),
    "choice":     Entry(ONE_BALL,         ONE_BALL,        (4, 4), numbers=2, seconds=1,
                        only="it is one of balls with mu > 1"),
    "thresholds": Entry(VARIED,           LIMIT_SETS,       (0, 4),
                        seeded=True, numbers=5, seconds=23),
    "settled":    Entry(VARIED,           LIMIT_SETS,       (4, 4), ONE_BALL,
                        numbers=88, seconds=11),
    "edge":       Entry(("reference", "rough-floor"), numbers=5, seconds=11),
    "rates":      Entry((*DRAG_LAWS, "high-wall-friction", "thick-fluid"), ONE_BALL,
                        numbers=89, seconds=13),
    "pulsation":  Entry(DRAG_LAWS,        ONE_BALL, numbers=8, seconds=14),
    "slope":      Entry(VARIED,           ONE_BALL, numbers=2, seconds=8),
    "unsteady":   Entry(DRAG_LAWS,        ONE_BALL, numbers=3, seconds=7),
    "unloading":  Entry(ENDS_OF_ROLLING, numbers=9, seconds=3),
    "laws":       Entry(VARIED,           ONE_BALL, settles=False, numbers=6, seconds=4),
    "plane":      Entry(ONE_BALL, only="the planes of Figs. 7 and 8 are those of reference only",
                        numbers=24, seconds=8),
    "birth":      Entry(VARIED, seconds=4),
    "bounds":     Entry(VARIED,           ONE_BALL, numbers=18, seconds=3),
    "mirrored":   Entry(ONE_BALL,         ONE_BALL, numbers=38, seconds=0.4),
    "growth":     Entry(VARIED,           LIMIT_SETS, settles=False, numbers=20, seconds=2),
    "steepest":   Entry(VARIED,           LIMIT_SETS, settles=False, seconds=1),
    "lift":       Entry(VARIED,           ENDS_OF_ROLLING, (4, 4),
                        settles=False, numbers=5, seconds=1),
    "field":      Entry(VARIED,           LIMIT_SETS,
                        free=ONE_BALL, settles=False, numbers=264, seconds=5),
    "motions":    Entry(ONE_BALL,         ONE_BALL, settles=False, numbers=240, seconds=0.8),
    "runs":       Entry(DRAG_LAWS,        ONE_BALL,
                        free=ONE_BALL, settles=False, numbers=116, seconds=1.2),
    "torque":     Entry(ONE_BALL,         ONE_BALL,        (4, 4), seconds=0.4),
    "impacts":    Entry(ENDS_OF_ROLLING,  ONE_BALL, settles=False, numbers=37, seconds=0.2),
    "hysteresis": Entry(ONE_BALL,         ONE_BALL,        (4, 4), numbers=22, seconds=1.4),
    "followed":   Entry(ONE_BALL, level=Level.DEFAULT, only=HOPS),
    "rebounding": Entry(ONE_BALL, level=Level.DEFAULT, only=HOPS, by=MOREAU),
    "swing":      Entry(ONE_BALL, level=Level.DEFAULT,
                        only="swings that last are those of reference on a very rough floor"),
    "calm":       Entry(ONE_BALL, level=Level.DEFAULT,
                        only="strong drag is tried on sets of its own"),
}
# fmt: on


def planned(protocol: str, engine: Engine, divisor: int, level: Level) -> dict[str, Parameters]:
    """The sets that a protocol measures at a level, by an engine with such a step; by name."""
    entry, known, above = PLAN[protocol], sets(level), level > Level.QUICK
    names: Iterable[str] = known if above else entry.trial
    if engine.role is Role.AS_IT_COMES:
        names = entry.as_it_comes
    elif engine.role is Role.FREE_BODY:
        names = entry.free if above else ()
    elif engine.role is Role.IN_THE_LIMIT:
        names = tuple(known)[: MOST_LIMIT_SETS if entry.limit else 1] if above else entry.limit
        if divisor not in engine.divisors[: entry.steps[above]]:
            names = ()
    if level < entry.level or (entry.by and engine.divisors != (1,)):
        names = ()
    return {name: p for name, p in known.items() if name in names}


COUNT = {Level.DEFAULT: 24, Level.FULL: 96}
SEED = 20161
LOW = {"mu": 0.05, "eta": 0.05, "j": 0.2, "r/R": 0.1, "kappa": 0.05, "R": 0.04, "g": 6.0, "m": 0.01}
HIGH = {"mu": 1.0, "eta": 1.0, "j": 0.66, "r/R": 0.4, "kappa": 0.4, "R": 0.08, "g": 10.0, "m": 0.05}
"""Ranges of the design; lengths in m, masses in kg, g in m s-2."""

# fmt: off
_FIELDS = ("m", "r", "R", "j", "mu", "eta", "g", "c", "nu_f", "drag")
_CHOSEN: dict[str, tuple[Any, ...]] = {
    "rough-floor": (0.02, 0.012,  0.06,  0.3, 0.45, 0.15, 9.81, 2.0),
    "rough-wall":  (0.05, 0.015,  0.05, 0.55, 0.15, 0.35,  8.0, 1.5),
    "thick-fluid": (0.03, 0.008,  0.04, 0.45, 0.25,  0.1,  9.0, 5.0),
    "heavy-core":  (0.01,  0.02,  0.07, 0.25,  0.7,  0.5,  9.5, 2.5),
    "wake":        (0.02, 0.012,  0.06, 0.42,  0.5,  0.2,  9.0, 1.4, 8e-05, SCHILLER_NAUMANN),
    "blunt":       (0.03,  0.01,  0.05,  0.4,  0.5,  0.2,  8.5, 1.2, 4e-05, QUADRATIC),
    "rubber-wall": (0.04,  0.01, 0.055, 0.35,  0.3,  0.8,  7.0, 3.0),
}
# fmt: on


def sets(level: Level) -> dict[str, Parameters]:
    """The sets of a level by name."""
    sets = {name: Parameters.named(name) for name in ("reference", "high-wall-friction")}
    for name, chosen in _CHOSEN.items():
        sets[name] = Parameters(**dict(zip(_FIELDS, chosen, strict=False)), omega_0=1.0)
    if level > Level.QUICK:  # a scrambled Sobol sequence fills the box evenly
        low, high = np.array(list(LOW.values())), np.array(list(HIGH.values()))
        unit = sobol(len(LOW), COUNT[level] - len(sets), SEED)
        for k, row in enumerate((low + unit * (high - low)).tolist(), start=1):
            values = dict(zip(LOW, row, strict=True))
            ratio, kappa = values.pop("r/R"), values.pop("kappa")
            c = kappa * math.sqrt(values["g"] / values["R"])
            sets[f"design-{k}"] = Parameters(**values, r=ratio * values["R"], c=c, omega_0=1.0)
    return sets


_FLOWS = (
    *(0.43, 0.51, 0.62, 0.75, 0.9, 1.02, 1.13, 1.26, 1.4, 1.53),
    *(1.7, 1.87, 2.05, 2.27, 2.5, 2.78, 3.1, 3.43, 3.8, 4.2),
)
_FEW = (0.62, 1.4, 1.7, 2.5, 4.2)
"""Chosen with results in sight, so that on the sets of quick they bracket every threshold."""
_STARTS = "rest", "with the fluid", "on the wall"
Flows = tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class Sampling:
    """How much is measured: a number a line, with its value at the quick level, by protocol."""

    halves: tuple[int, int] = (1, 2)  # what the time step of a pair of runs is divided by
    field_steps: tuple[int, int, int] = (1, 2, 4)  # the same, of three runs
    sections: int = 1  # flows inside a bracket in a round: it shrinks to a half, or an eighth
    granted: bool = False  # whether the ends of what is searched through are for granted
    # whether that is measured that takes long: sinking next to the least flow that holds, folds
    slow: bool = True

    # settling: lengths of successive rounds, in units of `settling.SPAN`. Most balls settle within
    # two or three quarters. The later ones are longer, because a ball on the wall that goes on from
    # its mean swings again, if less, and that has to die out, too.
    settling_rounds: tuple[float, ...] = (*(0.25,) * 6, 1.0, 1.0, 2.0)

    # Whether a run that is near goes on from where its means lead. Above quick, where drifts are to
    # be known to a tenth, what is left then of slow motions would be taken for less than it is.
    settling_leads: bool = True

    # settled: flows omega_0 sqrt(R/g) for every kind of start, the first one that which comes to
    # slip
    settled_starts: tuple[tuple[str, Flows], ...] = tuple((how, _FEW) for how in _STARTS)
    settled_sharp: float = 1.0  # share of the drift limit down to which a state goes on
    settled_loose: float = 1.0  # and the multiple of it up to which it counts
    settled_divisor: int = 2  # parts of the step with which it is measured again; 1: it isn't

    thresholds_width: float = 5e-5  # relative width of the last brackets
    thresholds_fold: float = 6e-4  # and of those about a fold
    thresholds_loose: float = 1.0  # factor on the settling tolerance
    thresholds_rounds: tuple[float, ...] = ()  # as settling_rounds; none: those

    edge_flows: Flows = (0.3,)  # parts of the way from omega_02 to omega_04
    edge_lines: int = 3  # for each edge
    edge_time: float = 20.0  # of a run in units of 1/c
    plane_spread: int = 8  # points spread evenly over each plane
    plane_added: tuple[int, ...] = (4,)  # and in each round
    # as settling_rounds, in units of half of it
    plane_rounds: tuple[float, ...] = (*(0.25,) * 4, 2.0, 2.0)
    hysteresis_hold: float = 40.0  # how long each level of the loop is held, in units of 1/c
    hysteresis_parts: int = 2  # of a gap in which a case changes
    slope_slipping: int = 2  # slipping states of a set at which it is measured, at most

    unsteady_lasts: float = 32.0  # time after a jump in units of 1/c
    unsteady_divisors: tuple[int, int] = (2, 4)  # its time steps in a coarse one
    unsteady_ramps: tuple[int, int] = (1, 2)  # those of ramps
    # of ramps, in c times the range of flows in which the ball slips
    unsteady_rates: tuple[float, ...] = (1e-2,)
    pulsation_octaves: tuple[int, ...] = (3, 6)  # of the frequencies, above c/(4 pi)
    pulsation_steps: int = 512  # least number of time steps in a period
    pulsation_samples: int = 256  # in a period
    pulsation_divisor: int = 2  # parts of the time step in the last of successive runs
    pulsation_reach: float = 1.1  # largest amplitude, in units of what ends rolling in a slow one
    pulsation_width: float = 1e-3  # relative width to which the onset of slip is bracketed
    unloading_divisors: tuple[int, int] = (16, 32)  # of the coarse step, where the ball lands

    recurrent_flows: Flows = (1.0,)  # of the staircase in units of that of the set
    choice_sets: int = 1  # the contacts of the second hover for long

    # Parts of a step of `step_pairs.STEP_RATIO`. Contacts with much friction answer more slowly:
    # with whole steps the slope of gamma was too coarse on 11 of the 24 sets of the default level.
    bounds_divisor: int = 2
    growth_more: int = 1  # multiples of the numbers of directions in growth.PUSHES
    steepest_states: int = 1  # random states of every set out of which slip is pushed all round
    field_starts: int = 4  # random starts for every case and set
    field_kept: int = 4  # most states measured for every case and set
    rates_divisors: tuple[int, int] = (8, 16)  # the two time steps, in parts of the coarse step
    # in SR: with shorter ones an almost unloaded floor carries more or none
    rates_SR: tuple[int, int] = (8, 16)
    rates_more: float = 1  # multiples of the numbers of states in rates.STATES
    laws_divisors: tuple[int, int] = (4, 8)  # the two time steps, in parts of the coarse step
    motions_pieces: int = 6  # of a motion


# fmt: off
AT_QUICK = Sampling()  # what others change stands below, a line a protocol
AT_DEFAULT = replace(
    AT_QUICK, sections=7, settling_rounds=(1.0, 1.0, 2.0, 2.0), settling_leads=False,
    settled_starts=tuple((how, _FLOWS) for how in _STARTS), settled_sharp=0.1,
    thresholds_width=1e-6, thresholds_fold=3e-4,
    edge_flows=(0.1, 0.17, 0.26, 0.38, 0.6), edge_lines=4, edge_time=60.0,
    plane_spread=160, plane_added=(60, 60, 60), plane_rounds=(1.0, 2.0, 2.0),
    hysteresis_hold=60.0, hysteresis_parts=4,
    slope_slipping=20,
    unsteady_lasts=48.0, unsteady_rates=(2.5e-3, 5e-3, 1e-2),
    pulsation_octaves=(0, 1, 3, 4, 6, 7), pulsation_steps=1024, pulsation_width=2.5e-4,
    unloading_divisors=(32, 64),
    recurrent_flows=(1.0, 0.95, 0.91, 0.87, 0.83, 0.80),
    choice_sets=2,
    bounds_divisor=4,
    growth_more=2,
    steepest_states=3,
    field_kept=6,
    rates_divisors=(16, 32), rates_more=2,
    laws_divisors=(8, 16),
    motions_pieces=20,
)
AT_FULL = replace(
    AT_DEFAULT,
    thresholds_width=5e-7, thresholds_fold=1.5e-4,
    edge_flows=(0.1, 0.17, 0.26, 0.38, 0.45, 0.6, 0.8), edge_lines=6,
    plane_spread=600, plane_added=(200,) * 5,
    hysteresis_hold=100.0, hysteresis_parts=8,
    unsteady_rates=(1.25e-3, 2.5e-3, 5e-3, 1e-2),
    pulsation_octaves=tuple(range(8)), pulsation_steps=2048, pulsation_width=1.2e-4,
    unloading_divisors=(64, 128),
    recurrent_flows=(1.0, 0.97, 0.94, 0.91, 0.88, 0.85, 0.82, 0.80),
    growth_more=6,
    steepest_states=12,
    field_starts=12, field_kept=24,
    rates_divisors=(32, 64), rates_more=5,
    laws_divisors=(16, 32),
    motions_pieces=32,
)
OWN_STEPS = replace(
    # the same run twice: all numbers are extrapolated to a zero step from several
    AT_QUICK, halves=(2, 2), field_steps=(2, 2, 2), granted=True, slow=False,
    settling_rounds=(*(0.25,) * 6, 1.0),
    settled_starts=(("with the fluid", (0.62, 1.7, 4.2)), ("on the wall", (1.7, 4.2))),
    settled_loose=100.0,
    settled_divisor=1,
    thresholds_width=5e-4,
    hysteresis_hold=15.0, hysteresis_parts=1,
    unsteady_lasts=24.0, unsteady_divisors=(2, 2), unsteady_ramps=(1, 1), unsteady_rates=(4e-2,),
    # where friction creeps, slip counts as such later
    pulsation_octaves=(3,), pulsation_steps=256, pulsation_samples=512, pulsation_divisor=1,
    pulsation_reach=1.5,
    pulsation_width=2e-3,
    rates_divisors=(16, 16), rates_SR=(16, 16), rates_more=0.5,
    bounds_divisor=1,
    laws_divisors=(4, 4),
    field_starts=2, field_kept=2,
)
# fmt: on
OWN_STEPS_ABOVE_QUICK = replace(
    OWN_STEPS,
    settling_rounds=(0.45, 1.0, 1.0),
    settling_leads=False,
    plane_rounds=(1.0, 2.0),
    thresholds_loose=1e3,
    thresholds_rounds=(1.0, 2.0),
    unsteady_lasts=48.0,
)
"""At the levels above quick, on whose rarer sets motions die out more slowly."""
