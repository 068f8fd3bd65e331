"""What is measured, by whom, on which sets, with which steps, how many numbers: one table."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import KW_ONLY, dataclass

from compare.kit.engines import MOREAU, Engine, Role
from compare.kit.levels import Level, sets
from model import Parameters

Names = tuple[str, ...]
"""Of parameter sets."""
ONE_BALL = ("reference",)
"""For what one ball shows as well as many, or the paper draws for one."""
ENDS_OF_ROLLING = (*ONE_BALL, "high-wall-friction")
"""One ball that comes to slip on the floor, and one that the wall's friction lifts first."""
DRAG_LAWS = (*ONE_BALL, "wake", "blunt")
"""One for each law of drag."""
LIMIT_SETS = (*ENDS_OF_ROLLING, "rough-floor", "wake")
"""Both ends of rolling, a floor rough enough for balls that slip and balls that ride the wall at
one flow, a law of drag."""
VARIED = (*ENDS_OF_ROLLING, "rough-floor", "thick-fluid", "wake", "blunt", "rubber-wall")
"""Each for a reason: the two above; a floor rough enough for balls that slip and balls that ride
the wall at one flow; drag so strong that nothing folds; two other laws of drag; friction of the
wall above that of the floor and the inertia. On them all wrong theories are noticed that are
noticed on all nine sets chosen by hand."""
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
    """With how many of its time steps it does, the coarsest first: at the quick level, and
    above."""
    as_it_comes: Names = ()
    """Sets that an engine with its own settings measures, at every level."""
    free: Names = ()
    """Sets that the ball as a free body measures, above the quick level."""
    _: KW_ONLY
    level: Level = Level.QUICK
    """The least level of which the protocol is a part."""
    by: Engine | None = None
    """Who measures, where it isn't the engine on trial; engines beside that one then don't."""
    settles: bool = True
    """Whether it needs motions that settle."""
    seeded: bool = False
    """Whether an engine beside the one on trial looks where that one found something."""
    only: str = ""
    """Why it needs the set `reference`, and no other; empty if it takes all sets."""
    numbers: int = 1
    """How many numbers there must be of a set at the quick level with the protocol's own time step,
    measured or left out with a reason: the least that any set has by MuJoCo, event-driven
    simulation or time stepping."""
    seconds: float = 1.0
    """Processor time at the quick level on some machine, of the engine on trial."""


LAWLESS = 0.25
"""Processor time of a step without the law, divided by that of one with it."""
HOPS = "hops that last are those of the set hopping"
# fmt: off
PLAN: dict[str, Entry] = {
    # What is a single long run begins first: beside it there is work for the other workers. Then
    # what takes longest.
    # protocol          on trial, quick   in the limit     steps   as it comes
    "recurrent":  Entry(ONE_BALL, only=HOPS, numbers=3, seconds=12),
    "stepped":    Entry(ONE_BALL, only=HOPS, by=MOREAU, numbers=3),
    "choice":     Entry(ONE_BALL,         ONE_BALL,        (4, 4), numbers=2, seconds=6,
                        only="it is one of balls with mu > 1"),
    "thresholds": Entry(VARIED,           LIMIT_SETS,       (3, 4),
                        seeded=True, numbers=5, seconds=42),
    "settled":    Entry(VARIED,           LIMIT_SETS,       (4, 4), ONE_BALL,
                        numbers=88, seconds=21),
    "edge":       Entry(("reference", "rough-floor"), numbers=5, seconds=15),
    "rates":      Entry((*DRAG_LAWS, "high-wall-friction", "thick-fluid"), ONE_BALL,
                        numbers=89, seconds=9),
    "pulsation":  Entry(DRAG_LAWS,        ONE_BALL, numbers=8, seconds=23),
    "slope":      Entry(VARIED,           ONE_BALL, numbers=2, seconds=15),
    "unsteady":   Entry(DRAG_LAWS,        ONE_BALL, numbers=3, seconds=12),
    "unloading":  Entry(ENDS_OF_ROLLING, numbers=9, seconds=4),
    "laws":       Entry(VARIED,           ONE_BALL, settles=False, numbers=6, seconds=5),
    "plane":      Entry(ONE_BALL, only="the planes of Figs. 7 and 8 are those of reference only",
                        numbers=24, seconds=12),
    "birth":      Entry(VARIED, seconds=5),
    "bounds":     Entry(VARIED,           ONE_BALL, numbers=18, seconds=6),
    "mirrored":   Entry(ONE_BALL,         ONE_BALL, numbers=38, seconds=0.4),
    "growth":     Entry(VARIED,           LIMIT_SETS, settles=False, numbers=20, seconds=7),
    "steepest":   Entry(VARIED,           LIMIT_SETS, settles=False, seconds=7),
    "lift":       Entry(VARIED,           ENDS_OF_ROLLING, (4, 4),
                        settles=False, numbers=5, seconds=3),
    "field":      Entry(VARIED,           LIMIT_SETS,
                        free=ONE_BALL, settles=False, numbers=264, seconds=7),
    "motions":    Entry(ONE_BALL,         ONE_BALL, settles=False, numbers=240, seconds=1.5),
    "runs":       Entry(DRAG_LAWS,        ONE_BALL,
                        free=ONE_BALL, settles=False, numbers=116, seconds=1.7),
    "torque":     Entry(ONE_BALL,         ONE_BALL,        (4, 4), seconds=1),
    "impacts":    Entry(ENDS_OF_ROLLING,  ONE_BALL, settles=False, numbers=37, seconds=0.4),
    "hysteresis": Entry(ONE_BALL,         ONE_BALL,        (4, 4), numbers=22, seconds=2),
    "followed":   Entry(ONE_BALL, level=Level.DEFAULT, only=HOPS),
    "rebounding": Entry(ONE_BALL, level=Level.DEFAULT, only=HOPS, by=MOREAU),
    "swing":      Entry(ONE_BALL, level=Level.DEFAULT,
                        only="swings that last are those of reference on a very rough floor"),
    "calm":       Entry(ONE_BALL, level=Level.DEFAULT,
                        only="strong drag is tried on sets of its own"),
}
# fmt: on


def planned(protocol: str, engine: Engine, divisor: int, level: Level) -> dict[str, Parameters]:
    """The sets that a protocol measures at a level, by an engine whose time steps are divided so,
    by name."""
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
