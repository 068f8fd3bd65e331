"""Where the engine's own contacts change what they do: brackets of flows, and settled states beside them.

A grid of held flows, with the ball starting at rest, rolling with the fluid, and high on the wall, shows between which
of them the settled case changes. Each change is bracketed and bisected.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from compare.measure.brackets import Bracket, Care, Search, narrow
from compare.measure.lab import Lab, Level, time_unit
from compare.measure.laws import PRESSES
from compare.measure.questions import (
    From,
    falls,
    held,
    keeps_on,
    leaning,
    rest,
    rider,
    rolling,
    rolls_again,
    settles,
    slides,
    stays_rolling,
    wall,
)
from compare.measure.settling import Settled, Start, family, high, settle
from compare.runs.tasks import Task
from compare.statistics import Measured, settled_case, tail
from model import Case, Parameters
from model.arrays import Array

GRID: Array = np.linspace(0.3, 4.5, 15)
"""Flows at which every set is looked at, in units of sqrt(g/R)."""
WIDTH = {Level.QUICK: 5e-5, Level.DEFAULT: 1e-6, Level.FULL: 5e-7}
"""Relative width to which a change of the contacts is bracketed."""
ROUGH_WIDTH = 1e-2
"""The same where only the neighbourhood is wanted."""
FOLD_WIDTH = {Level.QUICK: 1.2e-3, Level.DEFAULT: 3e-4, Level.FULL: 1.5e-4}
"""Half of the relative width that is looked at about the maximum of a branch."""
FOLD_TIME = 1.4
"""Length of the runs there times the root of that width, in units of 1/c: at a fold all slows down like this."""
MARGIN = 5.0
"""The least half width that is looked at, in standard uncertainties of the maximum."""
LOOSE = {Level.QUICK: 10.0, Level.DEFAULT: 1.0, Level.FULL: 1.0}
"""How much more than values that are held against theory themselves the states may drift from which places follow."""
NEAR: Array = np.array([0.005, 0.01, 0.02, 0.03, 0.05])
"""Places of settled states from which something is extrapolated to zero, relative."""
TURNS: Array = np.array([0.01, 0.02, 0.035, 0.05, 0.08, 0.11, 0.15])
"""The same below a fold, where slip goes like the root of the distance; in parts of the range of slipping."""
RIDES: Array = np.array([0.002, 0.008, 0.02, 0.035, 0.05])
"""Relative distances of the states that are continued to where a ball rides the wall as slowly as it can."""

Key = tuple[str, str]
"""A set, and what is looked for: the end of "rolling", "slipping", "leaning", or the beginning of "riding"."""
Brackets = Mapping[Key, Bracket]
States = Mapping[Key, Sequence[Settled]]


@dataclass(frozen=True, eq=False)
class Map:
    """What became of the ball of one set at every flow of the grid, by where it started."""

    omegas: Array
    rest: list[Case]
    rolling: list[Case]
    wall: list[Case]


def look(lab: Lab, sets: Mapping[str, Parameters]) -> dict[str, Map]:
    """Run every set at every flow of the grid from each kind of start."""
    begin: dict[str, tuple[From, float]] = {"rest": (rest, 20), "rolling": (rolling, 5), "wall": (wall, 12)}
    tasks = {
        (name, kind, k): held(lab, p, omega, start(p, omega), units)
        for name, p in sets.items()
        for kind, (start, units) in begin.items()
        for k, omega in enumerate(GRID / time_unit(p))
    }
    ends = (family(settled_case(run)) for run in lab.run(list(tasks.values())))
    cases = dict(zip(tasks, ends, strict=True))
    return {
        name: Map(GRID / time_unit(p), *([cases[name, kind, k] for k in range(len(GRID))] for kind in begin))
        for name, p in sets.items()
    }


def change(omegas: Array, yes: Sequence[bool]) -> Bracket | None:
    """Between the last flow of an unbroken row of yes, and the first no; None without such a change."""
    if not yes[0] or all(yes):
        return None
    k = list(yes).index(False)
    return Bracket(float(omegas[k - 1]), float(omegas[k]))


def ends_of_rolling(lab: Lab, sets: Mapping[str, Parameters], maps: Mapping[str, Map]) -> dict[Key, Bracket]:
    """The largest flow at which a ball that rolls on both goes on so, bisected."""
    searches: dict[Key, Search] = {}
    for name, p in sets.items():
        begin = change(maps[name].omegas, [case is Case.RR for case in maps[name].rolling])
        if begin is not None:
            width = WIDTH[lab.level] * begin.high
            searches[name, "rolling"] = Search(begin, _asker(lab, p, rolling, 5), stays_rolling, width)
    return _narrowed(lab, searches)


def neighbourhoods(
    lab: Lab, sets: Mapping[str, Parameters], maps: Mapping[str, Map], rolling: Brackets
) -> dict[Key, Bracket]:
    """Roughly, where the wall begins to carry the ball, and where slipping on the floor ends."""
    searches: dict[Key, Search] = {}
    for name, p in sets.items():
        seen = maps[name]
        if (begin := change(seen.omegas, [case is not Case.NR for case in seen.wall])) is not None:
            searches[name, "riding"] = Search(begin, _asker(lab, p, wall, 20), falls, ROUGH_WIDTH * begin.high)
        end, begin = rolling.get((name, "rolling")), change(seen.omegas, [case is not Case.NR for case in seen.rest])
        if end is not None and begin is not None and not lifts(end) and end.high < begin.high:
            around = Bracket(max(begin.low, end.high), begin.high)
            searches[name, "slipping"] = Search(around, _follower(lab, p, rest), keeps_on, ROUGH_WIDTH * around.high)
    return _narrowed(lab, searches, careful=False)


def lifts(end: Bracket) -> bool:
    """Whether two-point rolling ends by losing the floor, not by slipping: it carries no more than what hovers."""
    run = end.runs[1]
    if run is None:
        return False
    p = run.header.parameters
    return bool(run.force_A[tail(run), 1].mean() < PRESSES * p.m * p.g)


def settled_beside(lab: Lab, sets: Mapping[str, Parameters], brackets: Brackets) -> dict[Key, list[Settled]]:
    """Settled states beside every change, the nearest first; only those that did settle in the case that belongs."""
    begin = {
        (name, kind): [Start(name, q, kind, start(q, q.omega_0)) for q in (p.replace(omega_0=float(w)) for w in omegas)]
        for name, p in sets.items()
        for kind, (omegas, start) in _places(name, brackets).items()
    }
    states = iter(settle(lab, [start for some in begin.values() for start in some], loose=LOOSE[lab.level]))
    belongs = {"sinking": Case.NS, "slipping": Case.SS, "turning": Case.SS}
    return {
        key: [
            s for s in [next(states) for _ in some] if not s.failure and family(s.case) is belongs.get(key[1], Case.NR)
        ]
        for key, some in begin.items()
    }


def _places(name: str, brackets: Brackets) -> dict[str, tuple[Array, From]]:
    """Flows at which states of a set are settled, and from where, by what they are for."""
    places: dict[str, tuple[Array, From]] = {}
    if (carried := brackets.get((name, "riding"))) is not None:
        places["riding"] = carried.high * (1 + RIDES), wall
        places["sinking"] = carried.low * (1 - NEAR), wall
    if (end := brackets.get((name, "rolling"))) is not None and lifts(end):
        places["lifted"] = end.high * (1 + RIDES), wall
    elif end is not None and (last := brackets.get((name, "slipping"))) is not None:
        span = last.low - end.high
        places["slipping"] = end.high + NEAR * min(span, end.high), rest
        places["turning"] = last.low - TURNS * span, rest
    return places


def refined(lab: Lab, sets: Mapping[str, Parameters], brackets: Brackets, states: States) -> dict[Key, Bracket]:
    """The brackets that begin from settled states: of riding and leaning."""
    searches: dict[Key, Search] = {}
    width = WIDTH[lab.level]
    for name, p in sets.items():
        if len(riding := states.get((name, "riding"), [])) == len(RIDES):
            begin = brackets[name, "riding"]
            searches[name, "riding"] = Search(
                begin, _asker(lab, p, rider(riding, high(p)), 5), slides, width * begin.high
            )
        if len(lifted := states.get((name, "lifted"), [])) == len(RIDES):
            end = brackets[name, "rolling"]
            around = Bracket(end.low * (1 - ROUGH_WIDTH), end.high * (1 + ROUGH_WIDTH))
            searches[name, "leaning"] = Search(
                around, _asker(lab, p, leaning(lifted), 20), rolls_again, width * end.high
            )
    return _narrowed(lab, searches)


def folded(
    lab: Lab, sets: Mapping[str, Parameters], tops: Mapping[str, Measured], states: States
) -> dict[str, Bracket]:
    """The largest flow at which a ball on the floor settles, about the maximum of the branch on which it comes up."""
    searches: dict[str, Search] = {}
    for name, top in tops.items():
        width = max(FOLD_WIDTH[lab.level], MARGIN * top.uncertainty / top.value)
        x = states[name, "turning"][0].mean
        around = Bracket(top.value * (1 - width), top.value * (1 + width))
        asker = _asker(lab, sets[name], lambda p, omega, x=x: x, FOLD_TIME / math.sqrt(FOLD_WIDTH[lab.level]))  # type: ignore[misc]
        searches[name] = Search(around, asker, settles, width * top.value)
    return dict(zip(searches, narrow(lab, list(searches.values()), careful=False), strict=True))


def _narrowed(lab: Lab, searches: Mapping[Key, Search], careful: bool = True) -> dict[Key, Bracket]:
    return dict(zip(searches, narrow(lab, list(searches.values()), careful), strict=True))


def _asker(lab: Lab, p: Parameters, start: From, units: float) -> Callable[[float, Bracket, Care], Task]:
    def task(omega: float, bracket: Bracket, care: Care) -> Task:
        return held(lab, p, omega, start(p, omega), units * care.time, care.refine)

    return task


def _follower(lab: Lab, p: Parameters, start: From) -> Callable[[float, Bracket, Care], Task]:
    """From where the ball has come to at the largest flow that it has settled at so far."""

    def task(omega: float, bracket: Bracket, care: Care) -> Task:
        run = bracket.runs[0]
        x0 = start(p, omega) if run is None else run.x[-1]
        return held(lab, p, omega, x0, 40 * care.time, care.refine)

    return task
