"""Where the engine's own contacts change what they do: brackets of flows, and settled states beside them.

A grid of held flows, with the ball starting at rest, rolling with the fluid, and high on the wall, shows between which
of them the settled case changes. Each change is bracketed and bisected.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from compare.measure import questions
from compare.measure.brackets import Answer, Bracket, Care, Search, narrow
from compare.measure.lab import Lab, time_unit
from compare.measure.laws import PRESSES
from compare.measure.levels import Level
from compare.measure.questions import From, held
from compare.measure.settling import Settled, family, high, settle_groups
from compare.measure.trials import Start
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

ROLLING = questions.rolling, 5, questions.stays_rolling
RIDING = questions.wall, 20, questions.falls
SLIPPING = questions.rest, 40, questions.keeps_on
"""From where a ball starts, for how many 1/c it runs, and what is asked of it."""

Key = tuple[str, str]
"""A set, and what is looked for: the end of "rolling", "slipping", "leaning", or the beginning of "riding"."""
Brackets = Mapping[Key, Bracket]
States = Mapping[Key, Sequence[Settled]]


def look(lab: Lab, sets: Mapping[str, Parameters]) -> dict[Key, list[Case]]:
    """The cases to which the ball comes along the grid, by set and by where it starts."""
    begin: dict[str, tuple[From, float]] = {
        "rest": (questions.rest, 20),
        "rolling": (questions.rolling, 5),
        "wall": (questions.wall, 12),
    }
    tasks = {
        (name, kind): [held(lab, p, omega, start(p, omega), units) for omega in GRID / time_unit(p)]
        for name, p in sets.items()
        for kind, (start, units) in begin.items()
    }
    rows = lab.groups(list(tasks.values()))
    return {key: [family(settled_case(run)) for run in runs] for key, runs in zip(tasks, rows, strict=True)}


def _change(p: Parameters, yes: Sequence[bool]) -> Bracket | None:
    """Between the last flow of an unbroken row of yes along the grid, and the first no; None without such a change."""
    if not yes[0] or all(yes):
        return None
    k = list(yes).index(False)
    return Bracket(*(GRID / time_unit(p))[k - 1 : k + 1].tolist())


def ends_of_rolling(lab: Lab, sets: Mapping[str, Parameters], cases: Mapping[Key, list[Case]]) -> dict[Key, Bracket]:
    """The largest flow at which a ball that rolls on both goes on so, bisected."""
    searches = {
        (name, "rolling"): _search(lab, p, begin, ROLLING, WIDTH[lab.level] * begin.high)
        for name, p in sets.items()
        if (begin := _change(p, [case is Case.RR for case in cases[name, "rolling"]]))
    }
    return _narrowed(lab, searches)


def neighbourhoods(
    lab: Lab, sets: Mapping[str, Parameters], cases: Mapping[Key, list[Case]], rolling: Brackets
) -> dict[Key, Bracket]:
    """Roughly, where the wall begins to carry the ball, and where slipping on the floor ends."""
    searches: dict[Key, Search] = {}
    for name, p in sets.items():
        up, begin = (_change(p, [case is not Case.NR for case in cases[name, kind]]) for kind in ("wall", "rest"))
        if up:
            searches[name, "riding"] = _search(lab, p, up, RIDING, ROUGH_WIDTH * up.high)
        end = rolling.get((name, "rolling"))
        if end and begin and not lifts(end) and end.high < begin.high:
            around = Bracket(max(begin.low, end.high), begin.high)
            width = ROUGH_WIDTH * around.high
            searches[name, "slipping"] = _search(lab, p, around, SLIPPING, width, follow=True)
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
        (name, kind): [Start(name, q, kind, start(q, q.omega_0)) for q in (p.replace(omega_0=w) for w in omegas)]
        for name, p in sets.items()
        for kind, (omegas, start) in _places(name, brackets).items()
    }
    belongs = {"sinking": Case.NS, "slipping": Case.SS, "turning": Case.SS}
    rows = settle_groups(lab, list(begin.values()), loose=LOOSE[lab.level])
    return {
        key: [s for s in states if not s.failure and family(s.case) is belongs.get(key[1], Case.NR)]
        for key, states in zip(begin, rows, strict=True)
    }


def _places(name: str, brackets: Brackets) -> dict[str, tuple[list[float], From]]:
    """Flows at which states of a set are settled, and from where, by what they are for."""
    places: dict[str, tuple[Array, From]] = {}
    if carried := brackets.get((name, "riding")):
        places["riding"] = carried.high * (1 + RIDES), questions.wall
        places["sinking"] = carried.low * (1 - NEAR), questions.wall
    if (end := brackets.get((name, "rolling"))) and lifts(end):
        places["lifted"] = end.high * (1 + RIDES), questions.wall
    elif end and (last := brackets.get((name, "slipping"))):
        span = last.low - end.high
        places["slipping"] = end.high + NEAR * min(span, end.high), questions.rest
        places["turning"] = last.low - TURNS * span, questions.rest
    return {kind: (omegas.tolist(), start) for kind, (omegas, start) in places.items()}


def refined(lab: Lab, sets: Mapping[str, Parameters], brackets: Brackets, states: States) -> dict[Key, Bracket]:
    """The brackets that begin from settled states: of riding and leaning."""
    searches: dict[Key, Search] = {}
    width = WIDTH[lab.level]
    for name, p in sets.items():
        if len(riding := states.get((name, "riding"), [])) == len(RIDES):
            begin = brackets[name, "riding"]
            ride = questions.rider(riding, high(p)), 5, questions.slides
            searches[name, "riding"] = _search(lab, p, begin, ride, width * begin.high)
        if len(lifted := states.get((name, "lifted"), [])) == len(RIDES):
            end = brackets[name, "rolling"]
            around = Bracket(end.low * (1 - ROUGH_WIDTH), end.high * (1 + ROUGH_WIDTH))
            lean = questions.leaning(lifted), 20, questions.rolls_again
            searches[name, "leaning"] = _search(lab, p, around, lean, width * end.high)
    return _narrowed(lab, searches)


def folded(
    lab: Lab, sets: Mapping[str, Parameters], tops: Mapping[str, Measured], states: States
) -> dict[Key, Bracket]:
    """The largest flow at which a ball on the floor settles, about the maximum of the branch on which it comes up."""
    searches: dict[Key, Search] = {}
    units = FOLD_TIME / math.sqrt(FOLD_WIDTH[lab.level])
    for name, top in tops.items():
        width = max(FOLD_WIDTH[lab.level], MARGIN * top.uncertainty / top.value)
        x = states[name, "turning"][0].mean
        around = Bracket(top.value * (1 - width), top.value * (1 + width))
        stay = (lambda p, omega, x=x: x), units, questions.settles
        searches[name, "fold"] = _search(lab, sets[name], around, stay, FOLD_WIDTH[lab.level] * top.value)
    return _narrowed(lab, searches, careful=False)


def _narrowed(lab: Lab, searches: Mapping[Key, Search], careful: bool = True) -> dict[Key, Bracket]:
    return dict(zip(searches, narrow(lab, list(searches.values()), careful), strict=True))


def _search(
    lab: Lab, p: Parameters, begin: Bracket, ask: tuple[From, float, Answer], width: float, follow: bool = False
) -> Search:
    """Narrow a bracket by runs from a state, for some units of 1/c, that give an answer.

    To `follow`, a run goes out from where the ball has come to at the largest flow that it has settled at so far.
    """
    start, units, answer = ask

    def task(omega: float, bracket: Bracket, care: Care) -> Task:
        last = bracket.runs[0] if follow else None
        return held(lab, p, omega, last.x[-1] if last else start(p, omega), units * care.time, care.refine)

    return Search(begin, task, answer, width)
