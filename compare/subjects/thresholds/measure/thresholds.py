"""The thresholds of the bifurcation diagram, each measured in two ways that have nothing in common but the engine.

* Bisected, by the engine's own contacts: the largest flow at which a rolling ball stays without slip, or on the floor;
  the least at which the wall holds a ball that rides it; the flow up to which a lifted ball, pressed lightly on the
  floor, goes back to rolling on both; the largest flow at which a slipping ball settles.
* Extrapolated from settled states on one side: the flow at which their lag behind the fluid, their sinking or the force
  of the floor would vanish, or at which omega_0 along the branch has its maximum.

And the critical drag: below it slipping at both points ends in a fold, above it passes to the wall without a jump. At
the end of the branch the floor carries nothing; the sign of the slope of omega_0 over the floor's force there decides
whether the branch turns back. States are settled in stronger drag than that, where they last up to the end.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from compare.kit.brackets import Answer, Bracket, Care, Search, narrow
from compare.kit.engines import sliding_speeds
from compare.kit.fits import POINTS, initial_slope, straight_line, turning, vanishing
from compare.kit.lab import Lab, coarse_step, time_unit
from compare.kit.record import Measurement, Missing, Records, if_found, measurement
from compare.kit.settling import (
    PRESSES,
    Settled,
    begin,
    family,
    high,
    lasting,
    presses,
    settle_groups,
    settled_cases,
    settles,
)
from compare.kit.statistics import COVERAGE, Measured, settled_case, tail
from compare.kit.tasks import Task
from model import Case, Contact, Parameters, State, Trajectory
from model.arrays import Array

PROTOCOL = "thresholds"
COARSE = 1e-2
"""Relative width of a bracket where only the neighbourhood is wanted."""
DISTANCES: Array = np.array([0.005, 0.01, 0.02, 0.03, 0.05])
"""Relative distances of settled states from a flow at which something vanishes."""
TURNS: Array = np.array([0.01, 0.02, 0.035, 0.05, 0.08, 0.11, 0.15])
"""The same below a fold, where slip goes like the root of the distance; in parts of the range of slipping."""
RIDES: Array = np.array([0.002, 0.008, 0.02, 0.035, 0.05])
"""The same of the states that are continued to where a ball rides the wall as slowly as it can."""
SLIPPING_SPEED = 3e-8
"""Slip speed, divided by sqrt(g R), that counts as slip: contacts are solved to 1e-12, and a ball whose friction falls
short by a millionth reaches it within a run."""
CREEPS = 100.0
"""Slip, in units of that, at which a ball may creep while it comes to rest jammed between floor and wall."""
FIRST_DRAGS, NEARER_DRAGS = (2.0, 4.0), (1.6, 2.6)
"""Drags at which the birth of a fold is looked for: two values of c sqrt(R/g), then multiples of the drag extrapolated
from those two, so far off that states still settle soon."""
BEFORE_END = (0.02, 0.035, 0.055, 0.08, 0.12)
"""Distances of the states from omega_02 there, in parts of the range of slipping."""

FOUND = {"rolling": ("omega_01", "omega_03"), "riding": ("omega_02",), "slipping": ("omega_04",)}
"""The thresholds at which each ends or begins."""
AWAY = 0.03
"""Relative distance from there at which an engine beside the one on trial looks for the end of rolling."""

Key = tuple[str, str]
"""A set, and what is looked for: the end of "rolling", "slipping", "leaning", the "fold", or where "riding" begins."""
From = str | Array | Callable[[Parameters], Array]
"""How a ball starts: a name that `settling.begin` knows, a state, or a function of the parameters for it."""


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Begin between flows whose settled cases differ: settle states beside each change, then bisect and extrapolate.

    A change is between the fastest flow at which a ball was seen to settle so, and the next at which it settled
    otherwise. Without such flows it is looked for from half the slowest, or up to twice the fastest.
    """
    fine, narrowest = lab.effort("thresholds.width"), lab.effort("thresholds.fold")
    slowest = "with the fluid" if lab.beside else "rest"
    kinds = {"rolling": "with the fluid", "riding": "on the wall", "slipping": slowest}
    seen = {(name, kind): settled_cases(records, name, how) for name in sets for kind, how in kinds.items()}
    around: dict[Key, Bracket] = {}
    for key, cases in seen.items():
        if flows := list(cases):
            ended = {Case.NR} if key[1] != "rolling" else set(Case) - {Case.RR}
            low = max((flow for flow in flows if cases[flow] not in ended), default=flows[0] / 2)
            around[key] = Bracket(low, next((flow for flow in flows if flow > low), 2 * flows[-1]))
        if any(m.set == key[0] for m in records.select(PROTOCOL)):  # look where the engine on trial found something
            around.pop(key, None)
            for known in filter(None, (records.threshold(key[0], quantity) for quantity in FOUND[key[1]])):
                away = AWAY if key[1] == "rolling" else COARSE / 3
                around[key] = Bracket(known.value * (1 - away), known.value * (1 + away))

    # The largest flow at which a ball that rolls on both goes on so; and roughly, where sinking and slipping end.
    searches: dict[Key, Search] = {}
    for (name, kind), change in around.items():
        if kind == "rolling":
            searches[name, kind] = _search(lab, sets[name], kind, change, kinds[kind], fine * change.high)
    brackets, searches = _narrowed(lab, searches, careful=not lab.beside), {}
    for (name, kind), change in around.items():
        if kind == "riding":
            searches[name, kind] = _search(lab, sets[name], "sinking", change, kinds[kind], COARSE * change.low)
        end = brackets.get((name, "rolling"))
        if kind == "slipping" and end and not lifts(end) and end.high < change.high:
            change = replace(change, low=max(change.low, end.high))
            searches[name, kind] = _search(lab, sets[name], kind, change, "rest", COARSE * change.low)
    brackets |= _narrowed(lab, searches, careful=False)
    if not lab.beside:
        brackets = {key: bracket for key, bracket in brackets.items() if bracket.runs[1] or bracket.high in seen[key]}
    states, searches = _settled_beside(lab, sets, brackets), {}

    # Where a ball that rides the wall begins to slip on it, and up to where one pressed to the floor rolls again. They
    # begin from settled states continued to each flow; the pressed one has a thousandth less spin on the wall.
    for name, p in sets.items():
        begins, end = brackets.pop((name, "riding"), None), brackets.get((name, "rolling"))
        if begins and len(riding := states[name, "riding"]) == len(RIDES):
            ride = rider(riding, height=high(p))
            searches[name, "riding"] = _search(lab, p, "riding", begins, ride, fine * begins.high)
        if end and len(lifted := states.get((name, "lifted"), [])) == len(RIDES):
            pressed = rider(lifted, height=0.0, less=1e-3)
            change = Bracket(end.low * (1 - COARSE), end.high * (1 + COARSE))
            searches[name, "leaning"] = _search(lab, p, "leaning", change, pressed, fine * end.high)
    brackets |= _narrowed(lab, searches, careful=not lab.beside)

    # The largest flow at which a ball on the floor settles, at least five standard uncertainties about the maximum of
    # the branch. There is no fold where the floor would have to pull at that maximum, or there is none and the floor's
    # force vanishes just where the wall begins to carry the ball.
    folds, smooth, searches = {}, set(), {}
    for name, p in sets.items():
        turned, held = states.get((name, "turning"), []), brackets.get((name, "riding"))
        top, unloaded = extrapolated(turned, "slip_x", turning), extrapolated(turned, "force_Ay", vanishing)
        off = max(abs(unloaded.value - held.high), COVERAGE * unloaded.uncertainty) if held and unloaded else math.inf
        forces = partial(turning, others=np.array([state.values["force_Ay"].value for state in turned]))
        pressing = extrapolated(turned, "slip_x", forces)
        sure = COVERAGE * pressing.uncertainty if pressing else math.inf
        if pressing.value < -sure if pressing else held and off < narrowest * held.high:
            smooth.add(name)
        elif top and pressing and pressing.value > sure:
            folds[name], half = top, max(narrowest, 5.0 * top.uncertainty / top.value)
            change = Bracket(top.value * (1 - half), top.value * (1 + half))
            # At a fold all slows down, like the root of the distance: that costs more than an engine beside may.
            time, width = 1 / math.sqrt(narrowest), narrowest * top.value
            if not lab.beside:
                searches[name, "fold"] = _search(lab, p, "fold", change, turned[0].mean, width, time)
    brackets |= _narrowed(lab, searches, careful=False)
    for name, p in sets.items():
        shown = {kind: b for (one, kind), b in brackets.items() if one == name and None not in b.runs}
        beside = {kind: settled for (one, kind), settled in states.items() if one == name}
        ends = _ends(seen[name, "slipping"], brackets.get((name, "slipping"))) if (name, "turning") in states else 0
        for (one, kind), b in brackets.items():
            if one == name and b.failure:
                yield Missing(PROTOCOL, name, f"{kind}: its limit is known less well, as a run {b.failure}", 0)
        yield from _rows(lab, name, p, shown, beside, folds.get(name), ends, name in smooth)


def _ends(cases: Mapping[float, Case], bracket: Bracket | None) -> int:
    """How often, the flow rising over all that were tried, a ball from rest ceases to settle slipping at both."""
    said = {flow: case is Case.SS for flow, case in cases.items()} | dict(bracket.said if bracket else ())
    settles = [said[flow] for flow in sorted(said)]
    return sum(bool(before) and after is False for before, after in pairwise(settles))


def _settled_beside(lab: Lab, sets: Mapping[str, Parameters], of: Mapping[Key, Bracket]) -> dict[Key, list[Settled]]:
    """Settled states beside every change, the nearest first; only those that did settle in the case that belongs."""
    places: dict[Key, tuple[Array, str]] = {}
    for name in sets:
        if carried := of.get((name, "riding")):
            places[name, "riding"] = carried.high * (1 + RIDES), "on the wall"
            if not lab.beside:  # a ball that sinks swings for long
                places[name, "sinking"] = carried.low * (1 - DISTANCES / 2), "on the wall"
        end, last = of.get((name, "rolling")), of.get((name, "slipping"))
        if end and lifts(end):
            places[name, "lifted"] = end.high * (1 + RIDES), "on the wall"
        elif end and last:
            span = last.low - end.high
            places[name, "slipping"] = end.high + DISTANCES * min(span, end.high), "rest"
            places[name, "turning"] = last.low - TURNS * span, "rest"
    starts = [
        [begin(name, sets[name].replace(omega_0=flow), how) for flow in flows.tolist()]
        for (name, _), (flows, how) in places.items()
    ]
    belongs = {"sinking": Case.NS, "slipping": Case.SS, "turning": Case.SS}
    how = {name: lab.effort(f"thresholds.{name}") for name in ("loose", "rounds")}
    rows = settle_groups(lab, starts, **how)
    return {
        key: [s for s in states if not s.failure and family(s.case) is belongs.get(key[1], Case.NR)]
        for key, states in zip(places, rows, strict=True)
    }


def _narrowed(lab: Lab, searches: Mapping[Key, Search], careful: bool = True) -> dict[Key, Bracket]:
    return dict(zip(searches, narrow(lab, list(searches.values()), careful), strict=True))


def _search(
    lab: Lab, p: Parameters, question: str, around: Bracket, start: From, width: float, time: float = 1.0
) -> Search:
    """Narrow a bracket by runs at held flows, `time` times as long as a question of `ASKED` takes.

    For the end of slipping, a run starts from the state that the ball reached at the largest flow so far.
    """
    units, answer = ASKED[question]

    def task(omega: float, bracket: Bracket, care: Care) -> Task:
        q, last = p.replace(omega_0=float(omega)), bracket.runs[0] if question == "slipping" else None
        x0 = last.x[-1] if last else begin("", q, start).x0 if isinstance(start, str) else start
        t_end = lasting(q, units * time * care.time)
        return lab.task(q, x0(q) if callable(x0) else x0, t_end, coarse_step(q) / care.refine)

    return Search(around, task, answer, width)


def rider(states: Sequence[Settled], height: float, less: float = 0.0) -> Callable[[Parameters], Array]:
    """A state that rides the wall at a height, continued in omega_0 from settled states, with less spin."""
    omegas = np.array([state.start.p.omega_0 for state in states])
    fit = np.polynomial.Polynomial.fit(omegas, [state.values["slip_x"].value for state in states], len(omegas) - 1)

    def ride(p: Parameters) -> Array:
        slip_x = float(fit(p.omega_0))
        wall_spin = slip_x + p.R / p.r * p.omega_0
        return State(y=height, omega_c=p.omega_0, slip_x=slip_x - less * wall_spin).stacked()

    return ride


def lifts(end: Bracket) -> bool:
    """Whether two-point rolling ends by lifting off: the floor carries no more than what hovers, and the wall holds.

    Just below omega_03 the floor carries as little, but rolling may end there by slip at both contacts, which is as
    fast at one as at the other, and lasts. A ball that lifts off slips on the floor alone before, or rolls on the wall
    in the end.
    """
    if (run := end.runs[1]) is None:
        return False
    p = run.header.parameters
    unloaded = bool(run.force_A[tail(run), 1].mean() < PRESSES * p.m * p.g)
    lifted = [case.A is Contact.N for case in run.cases]
    on = slice(0, lifted.index(True) if any(lifted) else None)
    floor, wall = sliding_speeds(run)
    return unloaded and bool(slip(wall, run) < 1 or wall[on].max(initial=0.0) <= floor[on].max(initial=0.0) / 2)


def slip(speeds: Array, run: Trajectory, share: float = 0.1) -> float:
    """Largest of the slip speeds (n,) in the last part of a run, in units of `SLIPPING_SPEED` sqrt(g R)."""
    p = run.header.parameters
    return float(speeds[tail(run, share)].max() / (SLIPPING_SPEED * math.sqrt(p.g * p.R)))


def stays_rolling(run: Trajectory) -> bool | None:
    """Whether a ball that rolls on both neither slips on the floor nor leaves it; None while slip still dies out.

    None, too, while it touches the floor now and then: where friction alone could hold it, it may come to rest there.
    Slip dies out that has fallen below 0.6 of what it was in the second half (moved from 0.9 after results had been
    seen); slip below a hundredth of what counts is none. On a floor that carries next to nothing slip up to `CREEPS`
    shows nothing (chosen after a set with mu eta = 0.8 had crept so below its threshold).
    """
    if not presses(run):
        return None if np.any(run.force_A[tail(run), 1] > 0) else False
    speeds, _ = sliding_speeds(run)
    last, before = slip(speeds, run), slip(speeds[len(speeds) // 2 :], run, share=1.0)
    if last >= 1:
        m, g = run.header.parameters.m, run.header.parameters.g
        creeps = last < CREEPS and run.force_A[tail(run), 1].mean() < PRESSES * m * g
        return False if last > 0.6 * before and not creeps else None
    return True if last < 1e-2 else None


def may_settle(run: Trajectory) -> bool | None:
    """Whether a ball settles on the floor, or may after four times 10/c; None where a run of 10/c doesn't show it.

    Other motions still die out in a short run: with the usual share of change a ball just above a fold seemed to
    settle on some sets. (A tenth of it was chosen after that had been seen; a hundredth gives the same brackets.)
    """
    brief = run.time[-1] * run.header.parameters.c < 20
    return settles(run, 0.02) if brief else settles(run) is not False


ASKED: dict[str, tuple[float, Answer]] = {
    "rolling": (5, stays_rolling),
    "sinking": (20, lambda run: family(settled_case(run)) is not Case.NR),
    "slipping": (10, may_settle),
    "riding": (5, lambda run: slip(sliding_speeds(run)[1], run) > 1),
    "leaning": (20, lambda run: presses(run) and settled_case(run) is Case.RR),
    "fold": (1.4, settles),
}
"""How long a run takes, in units of 1/c, and what is asked of it: yes below a threshold, no above.

The ball still rolls; the wall doesn't hold it; it settles on the floor, or may; it begins to slip on the wall; pressed
to the floor it rolls on both again; it settles on the floor."""


def extrapolated(
    states: Sequence[Settled], quantity: str, to: Callable[[Array, Sequence[Measured]], Measured]
) -> Measured | None:
    """The flow to which a quantity of settled states is extrapolated; None if they are too few, or there is none."""
    if len(states) < POINTS:
        return None
    flows = [state.start.p.omega_0 for state in states]
    values = [state.values["omega_c" if quantity == "lag" else quantity] for state in states]
    if quantity == "lag":
        values = [Measured(flow - orbit.value, orbit.uncertainty) for flow, orbit in zip(flows, values, strict=True)]
    place = to(np.array(flows), values)
    return place if math.isfinite(place.uncertainty) else None


def _rows(
    lab: Lab,
    name: str,
    p: Parameters,
    brackets: Mapping[str, Bracket],
    states: Mapping[str, Sequence[Settled]],
    top: Measured | None,
    ends: int,
    smooth: bool,
) -> Iterator[Measurement | Missing]:
    """What was measured on one set: the end of rolling, the begin of riding, and the end of slipping on both.

    `ends` says at how many flows slipping ends; `top` where by a jump, and `smooth` that it ends once without one.
    """
    tasks = {kind: [state.task for state in settled] for kind, settled in states.items()}
    missing = partial(Missing, PROTOCOL, name)

    def row(quantity: str, at: Measured | None, tasks: Sequence[Task], side: str, by: str) -> Measurement | Missing:
        if at is None:
            return missing(f"too few states settled for {quantity} by {by}, or their extrapolation has no zero")
        return measurement(lab, PROTOCOL, name, p.replace(omega_0=at.value), quantity, at, tasks, side=side, by=by)

    def bisected(quantity: str, of: Bracket, side: str, by: str) -> Measurement | Missing:
        # Slip that is still too small to count may have begun below: it is proportional to the distance.
        speed = max(slip(speeds, run) for run in of.runs[1:] if run for speeds in sliding_speeds(run))
        unseen = (of.high - of.low) / max(1.0, speed) if quantity in ("omega_01", "omega_02") else 0.0
        place = Measured(of.place.value, math.hypot(of.place.uncertainty, unseen))
        return row(quantity, place, of.tasks, side, by)

    def vanishes(kind: str, what: str, quantity: str, side: str, by: str) -> Iterator[Measurement | Missing]:
        if kind in states:
            yield row(quantity, extrapolated(states[kind], what, vanishing), tasks[kind], side, f"{by} → 0")

    rolling, leaning, riding, fold = (brackets.get(kind) for kind in ("rolling", "leaning", "riding", "fold"))
    none = "no flow that was tried, up to twice the fastest of the settled states,"
    if not rolling:
        yield missing(f"{none} ends two-point rolling")
    elif lifts(rolling):
        yield measurement(lab, PROTOCOL, name, p, "lifts", 1.0, rolling.tasks)
        yield bisected("omega_03", rolling, "from below", "loss of the floor")
        if leaning:
            yield bisected("omega_03", leaning, "from above", "return to rolling when pressed")
        else:
            yield missing(
                "a lifted ball did not settle, and could not be pressed back to the floor: no second omega_03"
            )
    else:
        yield measurement(lab, PROTOCOL, name, p, "lifts", 0.0, rolling.tasks)
        yield bisected("omega_01", rolling, "from below", "onset of slip")
        yield from vanishes("slipping", "lag", "omega_01", "from above", "lag of settled slipping")
    if riding:
        yield bisected("omega_02", riding, "from above", "onset of sliding on the wall")
    else:
        yield missing(f"{none} is the least to hold a ball on the wall")
    yield from vanishes("sinking", "v_y", "omega_02", "from below", "speed of settled sinking")
    if "turning" not in states:
        if rolling and not lifts(rolling):
            yield missing("no end of slipping at both points was found", 3)
        return
    counts = len(states["turning"]) >= POINTS  # slipping settles
    if counts and (
        ends or not lab.beside
    ):  # which looks beside known flows only, and may have settled at none beyond the last
        yield measurement(lab, PROTOCOL, name, p, "folds", ends - smooth, tasks["turning"])
    if smooth:
        yield from vanishes("turning", "force_Ay", "omega_02", "from below", "floor force of settled slipping")
    elif top is None:
        yield missing("settled slipping points to no flow at which it ends", 2 if counts else 3)
    else:
        yield row("omega_04", top, tasks["turning"], "from below", "maximum of omega_0 along the branch")
        if fold:
            yield bisected("omega_04", fold, "from below", "last settled slipping")
        else:
            why = "costs more than an engine beside the one on trial may" if lab.beside else "could not be done"
            yield missing(f"the end of slipping at both points is extrapolated; to bracket it {why}")


def birth(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """The drag at which omega_0 as a function of the floor's force has no slope where that vanishes.

    The zero of the straight line through the slopes as a function of 1/c, to which the lag by a force is proportional.
    """
    ranges = {}
    for name in sets:
        begins, ends = records.threshold(name, "omega_01"), records.threshold(name, "omega_02")
        if begins and ends and begins.value < ends.value:
            ranges[name] = begins.value, ends.value
    slopes: dict[str, list[tuple[float, Measured, list[Settled]]]] = {name: [] for name in ranges}
    lags: dict[str, Measured] = {}
    drags = [(name, kappa / time_unit(sets[name])) for name in ranges for kappa in FIRST_DRAGS]
    for _ in (FIRST_DRAGS, NEARER_DRAGS):
        starts = [
            [begin(name, sets[name].replace(c=c, omega_0=high - part * (high - low)), "rest") for part in BEFORE_END]
            for name, c in drags
            for low, high in [ranges[name]]
        ]
        for (name, c), states in zip(drags, settle_groups(lab, starts), strict=True):
            if not any(state.failure or state.case is not Case.SS for state in states):
                flows = np.array([state.start.p.omega_0 for state in states])
                slope = initial_slope(flows, [state.values["force_Ay"] for state in states])
                slopes[name].append((1 / c, slope, states))
        for name, points in slopes.items():
            if len(points) >= len(FIRST_DRAGS):
                at, measured = [lag for lag, *_ in points], [slope for _, slope, _ in points]
                lags[name], _ = straight_line(at, [m.value for m in measured], [m.uncertainty for m in measured])
        drags = [(name, 1 / lag.value * k) for name, lag in lags.items() if lag.value > 0 for k in NEARER_DRAGS]
    for name, p in sets.items():
        if name not in ranges:
            yield Missing("birth", name, "there is no range of slipping at both points that ends at the wall")
        elif len(slopes[name]) < len(FIRST_DRAGS) + len(NEARER_DRAGS):
            yield Missing("birth", name, "too few states of slipping at both points settle near the end of the branch")
        else:
            drag = Measured(1 / lags[name].value, lags[name].uncertainty / lags[name].value ** 2)
            tasks = [state.task for *_, settled in slopes[name] for state in settled]
            yield if_found(
                measurement(lab, "birth", name, p, "critical_drag", drag, tasks), "no drag gives birth to a fold"
            )
