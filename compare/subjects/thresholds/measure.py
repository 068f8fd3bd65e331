"""Flows at which one kind of motion gives way to another, the thresholds of the bifurcation
diagram: each measured in two ways that have nothing in common but the engine.

* Bisected, by the engine's own contacts: the largest flow at which a rolling ball stays without
  slip, or on the floor; the least at which the wall holds a ball that rides it; the flow up to
  which a lifted ball, pressed lightly on the floor, goes back to rolling on both; the largest flow
  at which a slipping ball settles.
* Extrapolated from settled states on one side: the flow at which their lag behind the fluid, their
  sinking or the force of the floor would vanish, or at which omega_0 along the branch has its
  maximum.

First what a run at a held flow says: whether a ball goes on as it began, settles, or leaves floor
or wall."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from typing import Unpack

import numpy as np

from compare.campaign.tasks import Task
from compare.engines.study import sliding_speeds
from compare.method import settling
from compare.method.brackets import Answer, Attempt, Bracket, Search
from compare.method.conditions import Conditions
from compare.method.protocol import Protocol
from compare.method.record import Measured, Measurement, Missing, Records, Sets
from compare.method.runner import Runner, coarse_step
from compare.method.settling import PRESSES, SettlingCriteria, SteadyState, physical_case
from compare.method.statistics import (
    COVERAGE,
    POINTS,
    Estimate,
    extrapolated_maximum,
    extrapolated_zero,
    settled_case,
    tail,
    uniform,
)
from compare.method.together import Procedure, narrowed, settled, together
from model import Case, Contact, Parameters, State, Trajectory
from model.arrays import Array

SLIPPING_SPEED = 3e-8
"""Slip speed, divided by sqrt(g R), that counts as slip: contacts are solved to 1e-12, and a ball
whose friction falls short by a millionth reaches it within a run."""
SLIP_SEEN = 1e-6
"""That millionth: relative distance from its threshold from which on slip is seen. (It limits what
a threshold is known to since one of the default level had been seen 1e-6 too high.)"""
LAGS = 1e-3
"""Relative lag behind the fluid from which on a ball that has slipped may have to slip again."""
CREEPS = 100.0
"""Slip, in that unit, at which a ball may creep to rest jammed between floor and wall."""
COARSE = 1e-2  # relative width of a bracket where only the neighbourhood is wanted
AWAY = 0.03  # relative distance from a known end of rolling, where an engine beside looks for it
# Relative distances of settled states from where something vanishes; from where a ball rides the
# wall as slowly as it can; and below a fold, in parts of the range of slipping: slip goes like the
# root.
DISTANCES = np.array([0.005, 0.01, 0.02, 0.03, 0.05])
DISTANCES_OF_NR = np.array([0.002, 0.008, 0.02, 0.035, 0.05])
DISTANCES_BELOW_FOLD = np.array([0.01, 0.02, 0.035, 0.05, 0.08, 0.11, 0.15])


def lifts(end: Bracket) -> bool:
    """Whether rolling at both points ends by lifting off, not by slip, by the runs at its end.

    Just below omega_03 the floor carries as little, but rolling may end there by slip at both
    contacts, which is as fast at one as at the other, and lasts. A ball that lifts off slips on the
    floor alone before, or rolls on the wall in the end."""
    if (run := end.runs[1]) is None:
        return False
    p = run.header.parameters
    unloaded = bool(run.force_A[tail(run), 1].mean() < PRESSES * p.m * p.g)
    lifted = [case.A is Contact.N for case in run.cases]
    on = slice(0, lifted.index(True) if any(lifted) else None)
    floor, wall = sliding_speeds(run)
    return unloaded and bool(
        slip(wall, run) < 1 or wall[on].max(initial=0.0) <= floor[on].max(initial=0.0) / 2
    )


def slip(speeds: Array, run: Trajectory, share: float = 0.1) -> float:
    """Largest of slip speeds (n,) at the end, in units of `SLIPPING_SPEED` sqrt(g R)."""
    p = run.header.parameters
    return float(speeds[tail(run, share)].max() / (SLIPPING_SPEED * math.sqrt(p.g * p.R)))


def stays_rolling(run: Trajectory) -> bool | None:
    """Whether a ball that rolls on both goes on so; None while slip still dies out.

    None, too, while a ball that has slipped lags behind the fluid: it rolls more slowly than it is
    asked about; and while it touches the floor now and then: where friction alone could hold it, it
    may come to rest there. Slip dies out that has fallen below 0.6 of what it was in the second
    half (moved from 0.9 after results had been seen); slip below a hundredth of what counts is
    none. On a floor that carries next to nothing slip up to `CREEPS` shows nothing (chosen after a
    set with mu eta = 0.8 had crept so below its threshold)."""
    if not presses(run):
        return None if np.any(run.force_A[tail(run), 1] > 0) else False
    speeds, _ = sliding_speeds(run)
    last, before = slip(speeds, run), slip(speeds[len(speeds) // 2 :], run, share=1.0)
    if last >= 1:
        m, g = run.header.parameters.m, run.header.parameters.g
        creeps = last < CREEPS and run.force_A[tail(run), 1].mean() < PRESSES * m * g
        return False if last > 0.6 * before and not creeps else None
    lag = 1 - run.omega_c[-1] / run.omega_0[-1]
    caught_up = lag < LAGS or slip(speeds, run, share=1.0) < 1
    return True if last < 1e-2 and caught_up else None


def may_settle(run: Trajectory) -> bool | None:
    """Whether a ball settles on the floor, after 10/c (or None), or 40/c (True if not clear).

    Other motions still die out in a short run: with the usual share of change a ball just above a
    fold seemed to settle on some sets. (A tenth of it was chosen after that had been seen; a
    hundredth gives the same brackets.)"""
    brief = run.time[-1] * run.header.parameters.c < 20
    return settles(run, 0.02) if brief else settles(run) is not False


def presses(run: Trajectory) -> bool:
    """Whether the floor carries something all the time in the end."""
    return bool(np.all(run.force_A[tail(run), 1] > 0))


def settles(run: Trajectory, slowed: float = 0.2) -> bool | None:
    """Whether a ball that slips comes to rest on the floor; None where a run is short.

    In the last tenth its speed must change by less than a share `slowed` of what it does in the
    tenth before the middle. On the way past a fold that it has missed the change falls at most like
    1/time^2, from one to the other to 0.22; after that it rises."""
    if settled_case(run).A is Contact.N or settled_case(run) is Case.SR or not presses(run):
        return False
    middle, last = (abs(float(run.omega_c[k] - run.omega_c[k - 10])) for k in (-51, -1))
    # round-off: at rest
    slowing = last / middle if last > 1e-11 * abs(float(run.omega_c[-1])) and middle > 0 else 0.0
    return False if slowing > 1 else True if slowing < slowed else None


@dataclass(frozen=True)
class Passage:
    """A flow up to which, or from which on, a ball moves in some case."""

    name: str
    time: float  # how long a run takes in which that is asked, in units of 1/c
    answer: Answer  # yes below the flow, no above
    start: str = ""  # how balls start of which is asked when that ends
    thresholds: tuple[str, ...] = ()  # those that it may be


# The ball still rolls; the wall doesn't hold it; it settles on the floor, or may.
RR_ENDS = Passage("RR ends", 5, stays_rolling, "with the fluid", ("omega_01", "omega_03"))
NS_ENDS = Passage(
    "NS ends",
    20,
    lambda run: physical_case(settled_case(run)) is not Case.NR,
    "on the wall",
    ("omega_02",),
)
SS_ENDS = Passage("SS ends", 10, may_settle, "rest", ("omega_04",))
ENDS = RR_ENDS, NS_ENDS, SS_ENDS
# It begins to slip on the wall; pressed to the floor it rolls on both again; it settles there.
NR_BEGINS = Passage("NR begins", 5, lambda run: slip(sliding_speeds(run)[1], run) > 1)
RR_RETURNS = Passage("RR returns", 20, lambda run: presses(run) and settled_case(run) is Case.RR)
FOLD = Passage("fold", 1.4, settles)
From = Callable[[Parameters], Array]  # the state in which a ball starts, by its parameters


def measure(runner: Runner, sets: Sets, records: Records) -> Measured:
    """The thresholds of each set: bisected, and extrapolated from settled states."""
    return together(runner, (_of_set(runner, name, p, records) for name, p in sets.items()))


def _of_set(runner: Runner, name: str, p: Parameters, records: Records) -> Procedure[None]:
    """The thresholds of a set."""
    each = Findings(runner, name, p, *_where_cases_change(runner, name, records))
    yield from _end_of_rolling(each)
    yield from _sinking_and_slipping(each)
    yield from _settle_beside(each)
    yield from _on_the_wall_and_back(each)
    top, smooth = _end_of_slipping(each)
    if top and runner.sampling.slow:
        yield from _fold(each, top)
    for kind, bracket in each.brackets.items():
        if bracket.failure and kind is not NS_ENDS:  # which is looked for roughly
            why = f"{kind.name}: its flow is known less well, as a run {bracket.failure}"
            yield each.missing(why, 0)
    yield from _rows(each)
    yield from _rows_of_slipping(each, top, smooth)


def _end_of_rolling(each: Findings) -> Procedure[None]:
    """The largest flow at which a ball that rolls at both points goes on so."""
    if change := each.changes.get(RR_ENDS):
        width = each.runner.sampling.thresholds_width * change.high
        yield from each.narrow(each.sure, each.search(RR_ENDS, change, width))


def _sinking_and_slipping(each: Findings) -> Procedure[None]:
    """Roughly, up to where the wall holds no ball, and SS settles on the floor.

    A bracket counts only if something was seen beyond it, or that is granted."""
    searches = []
    if change := each.changes.get(NS_ENDS):
        searches.append(each.search(NS_ENDS, change, COARSE * change.low))
    change, end = each.changes.get(SS_ENDS), each.brackets.get(RR_ENDS)
    if change and end and not lifts(end) and end.high < change.high:
        change = replace(change, low=max(change.low, end.high))
        searches.append(each.search(SS_ENDS, change, COARSE * change.low))
    yield from each.narrow(False, *searches)
    for kind, bracket in [*each.brackets.items()]:
        if each.sure and not (bracket.runs[1] or bracket.high in each.cases[kind]):
            del each.brackets[kind]


def _on_the_wall_and_back(each: Findings) -> Procedure[None]:
    """Where slip begins on the wall, and where a ball that is pressed on the floor, with a bit less
    spin, rolls again: from settled states continued.

    It rolls more slowly then than the fluid, in proportion to that bit, which therefore is no more
    than the bracket's width: drag that goes with the square of the lag doesn't make up for it."""
    searches, width = [], each.runner.sampling.thresholds_width
    begins, carried = each.brackets.get(NS_ENDS), each.states.get("NR", [])
    if begins and len(carried) == len(DISTANCES_OF_NR):
        start = continued(carried, height=settling.safe_height(each.p))
        searches.append(each.search(NR_BEGINS, begins, width * begins.high, start))
    end, lifted = each.brackets.get(RR_ENDS), each.states.get("lifted", [])
    if end and len(lifted) == len(DISTANCES_OF_NR):
        change = Bracket(end.low * (1 - COARSE), end.high * (1 + COARSE))
        pressed = continued(lifted, height=0.0, less=width)
        searches.append(each.search(RR_RETURNS, change, width * end.high, pressed))
    yield from each.narrow(each.sure, *searches)


def _fold(each: Findings, top: Estimate) -> Procedure[None]:
    """The largest flow at which a ball on the floor settles, at the fold.

    There all slows down, like the root of the distance."""
    narrowest, nearest = each.runner.sampling.thresholds_fold, each.states["last SS"][0].mean
    change = around(top.value, max(narrowest, 5.0 * top.uncertainty / top.value))
    time, width = 1 / math.sqrt(narrowest), narrowest * top.value
    yield from each.narrow(False, each.search(FOLD, change, width, lambda _: nearest, time))


@dataclass(frozen=True, eq=False)
class Findings:
    """What was found on one set so far."""

    runner: Runner
    set: str
    p: Parameters
    cases: Mapping[Passage, Mapping[float, Case]]
    """In which cases balls that start so were seen to settle, by flow, the slowest first."""
    changes: Mapping[Passage, Bracket]
    """Flows between which a passage is looked for."""
    brackets: dict[Passage, Bracket] = field(default_factory=dict)
    states: dict[str, list[SteadyState]] = field(default_factory=dict)
    """Settled states beside a limit, the nearest first, by which: see `_settle_beside`."""

    @property
    def sure(self) -> bool:
        """Whether what is beyond a bracket must be seen: not where it is granted."""
        return not self.runner.sampling.granted

    def narrow(self, careful: bool, *searches: tuple[Passage, Search]) -> Procedure[None]:
        """Narrow down what is searched for."""
        brackets = yield from narrowed(*(search for _, search in searches), careful=careful)
        self.brackets.update(zip((kind for kind, _ in searches), brackets, strict=True))

    def search(
        self,
        kind: Passage,
        around: Bracket,
        width: float,
        start: From | None = None,
        time: float = 1.0,
    ) -> tuple[Passage, Search]:
        """A search by runs at held flows, `time` times as long as usual.

        They start as the passage says, unless another start is given; for the end of slipping, from
        the state that the ball reached at the largest flow so far."""

        def task(omega: float, bracket: Bracket, attempt: Attempt) -> Task:
            q = self.p.replace(omega_0=float(omega))
            if kind is SS_ENDS and (last := bracket.runs[0]):
                x0 = last.x[-1]
            else:
                x0 = start(q) if start else settling.initial_condition("", q, kind.start).x0
            t_end = settling.rounded_duration(q, kind.time * time * attempt.time)
            return self.runner.task(q, x0, t_end, coarse_step(q) / attempt.divisor)

        return kind, Search(around, task, kind.answer, width)

    def bracket_seen(self, kind: Passage) -> Bracket | None:
        """A bracket both of whose ends were seen in runs."""
        bracket = self.brackets.get(kind)
        return bracket if bracket and None not in bracket.runs else None

    def missing(self, why: str, rows: int = 1) -> Missing:
        """A record of a threshold that was not found, and why."""
        return self.runner.missing(self.set, why, rows)

    def row(
        self,
        quantity: str,
        at: Estimate | float | None,
        tasks: Sequence[Task],
        **how: Unpack[Conditions],
    ) -> Measurement | Missing:
        """The measurement of a threshold, or of a number; or why it wasn't found."""
        if at is None:
            return self.missing(f"too few states settled for {quantity} by {how['by']}, or no zero")
        p = self.p.replace(omega_0=at.value) if isinstance(at, Estimate) else self.p
        return self.runner.measurement(self.set, p, quantity, at, tasks, **how)

    def row_of_bracket(
        self, quantity: str, of: Bracket, side: str, by: str
    ) -> Measurement | Missing:
        """The measurement of a threshold that lies in a bracket."""
        # Slip that is still too small to count may have begun below: it is proportional to the
        # distance. A ball that lags behind the fluid still rolls where one as fast as that may not.
        below, above = of.runs
        speed = max(slip(speeds, above) for speeds in sliding_speeds(above)) if above else 0.0
        unseen = lag = 0.0
        if quantity in ("omega_01", "omega_02"):
            unseen = max(of.width / max(1.0, speed), SLIP_SEEN * of.high)
        if below and quantity in ("omega_01", "omega_03"):
            lag = uniform(abs(float(below.omega_0[-1] - below.omega_c[-1])))
        place = of.place.also(unseen_slip=unseen, behind_fluid=lag)
        return self.row(quantity, place, of.tasks, side=side, by=by)

    def rows_of_zero(self, which: str, what: str, quantity: str, side: str, by: str) -> Measured:
        """The measurement of a threshold, extrapolated from settled states to a zero."""
        if which in self.states:
            states = self.states[which]
            place = extrapolated(states, what, extrapolated_zero)
            tasks = [state.task for state in states]
            yield self.row(quantity, place, tasks, side=side, by=f"{by} → 0")


def _where_cases_change(
    runner: Runner, name: str, records: Records
) -> tuple[dict[Passage, dict[float, Case]], dict[Passage, Bracket]]:
    """The cases to which balls settled, by flow, and the flows between which they change.

    Without such flows from half the slowest, or up to twice the fastest. An engine beside the one
    on trial looks where that one found something."""
    starts = RR_ENDS.start, NS_ENDS.start, runner.sampling.settled_starts[0][0]
    cases, changes = {}, {}
    for kind, how in zip(ENDS, starts, strict=True):
        seen = cases[kind] = settling.settled_cases(records, name, how)
        if flows := list(seen):
            ended = {Case.NR} if kind is not RR_ENDS else set(Case) - {Case.RR}
            low = max((flow for flow in flows if seen[flow] not in ended), default=flows[0] / 2)
            high = next((flow for flow in flows if flow > low), 2 * flows[-1])
            changes[kind] = Bracket(low, high)
    if any(m.set == name for m in records.select("thresholds")):
        changes = {
            kind: around(known.value, AWAY if kind is RR_ENDS else COARSE / 3)
            for kind in ENDS
            for quantity in kind.thresholds
            if (known := records.threshold(name, quantity))
        }
    return cases, changes


def around(flow: float, part: float) -> Bracket:
    """A bracket of a flow, to either side by a part of it."""
    return Bracket(flow * (1 - part), flow * (1 + part))


def _settle_beside(each: Findings) -> Procedure[None]:
    """Settle states beside every change; those count that settle in the case there."""
    sampling, asked = each.runner.sampling, dict[str, tuple[Case, str, Array]]()
    if carried := each.brackets.get(NS_ENDS):
        asked["NR"] = Case.NR, "on the wall", carried.high * (1 + DISTANCES_OF_NR)
        if sampling.slow:  # a ball that sinks swings for long
            asked["NS"] = Case.NS, "on the wall", carried.low * (1 - DISTANCES / 2)
    end, last = each.brackets.get(RR_ENDS), each.brackets.get(SS_ENDS)
    if end and lifts(end):
        asked["lifted"] = Case.NR, "on the wall", end.high * (1 + DISTANCES_OF_NR)
    elif end and last:
        span = last.low - end.high
        asked["first SS"] = Case.SS, "rest", end.high + DISTANCES * min(span, end.high)
        asked["last SS"] = Case.SS, "rest", last.low - DISTANCES_BELOW_FOLD * span
    starts = [
        settling.starts_at(each.set, each.p, how, flows.tolist())
        for _, how, flows in asked.values()
    ]
    criteria = SettlingCriteria(loose=sampling.thresholds_loose, rounds=sampling.thresholds_rounds)
    found = yield from settled(*starts, criteria=criteria)
    for (which, (case, *_)), states in zip(asked.items(), found, strict=True):
        each.states[which] = [s for s in states if not s.failure and physical_case(s.case) is case]


def continued(states: Sequence[SteadyState], height: float, less: float = 0.0) -> From:
    """A state that rides the wall at a height, continued in omega_0, with less spin."""
    omegas = np.array([state.start.p.omega_0 for state in states])
    slips = [state.values["slip_x"].value for state in states]
    fit = np.polynomial.Polynomial.fit(omegas, slips, len(omegas) - 1)

    def start(p: Parameters) -> Array:
        slip_x = float(fit(p.omega_0))
        wall_spin = slip_x + p.R / p.r * p.omega_0
        return State(y=height, omega_c=p.omega_0, slip_x=slip_x - less * wall_spin).stacked()

    return start


def _end_of_slipping(each: Findings) -> tuple[Estimate | None, bool]:
    """The maximum of omega_0 along SS, if it ends in a fold; whether it ends without.

    There is no fold where the floor would have to pull at that maximum, or there is none and the
    floor's force vanishes just where the wall begins to carry the ball."""
    last, held = each.states.get("last SS", []), each.brackets.get(NR_BEGINS)
    top = extrapolated(last, "slip_x", extrapolated_maximum)
    unloaded = extrapolated(last, "force_Ay", extrapolated_zero)
    off = math.inf
    if held and unloaded:
        off = max(abs(unloaded.value - held.high), COVERAGE * unloaded.uncertainty)
    carried = np.array([state.values["force_Ay"].value for state in last])
    forces = partial(extrapolated_maximum, others=carried)
    if pressing := extrapolated(last, "slip_x", forces):
        sure = COVERAGE * pressing.uncertainty
        return top if pressing.value > sure else None, pressing.value < -sure
    return None, bool(held and off < each.runner.sampling.thresholds_fold * held.high)


def extrapolated(
    states: Sequence[SteadyState],
    quantity: str,
    to: Callable[[Array, Sequence[Estimate]], Estimate],
) -> Estimate | None:
    """The flow to which a quantity of settled states is extrapolated, or None."""
    if len(states) < POINTS:
        return None
    flows = [state.start.p.omega_0 for state in states]
    values = [state.values["omega_c" if quantity == "lag" else quantity] for state in states]
    if quantity == "lag":
        both = zip(flows, values, strict=True)
        values = [replace(orbit, value=flow - orbit.value) for flow, orbit in both]
    place = to(np.array(flows), values)
    return place if math.isfinite(place.uncertainty) else None


def _rows(each: Findings) -> Measured:
    """Rows of the end of rolling (omega_01 or omega_03), and of omega_02."""
    none = "no flow that was tried, up to twice the fastest of the settled states,"
    if not (rolling := each.bracket_seen(RR_ENDS)):
        yield each.missing(f"{none} ends two-point rolling")
    elif lifts(rolling):
        yield each.row("lifts", 1.0, rolling.tasks)
        yield each.row_of_bracket("omega_03", rolling, "from below", "loss of the floor")
        if returns := each.bracket_seen(RR_RETURNS):
            by = "return to rolling when pressed"
            yield each.row_of_bracket("omega_03", returns, "from above", by)
        else:
            yield each.missing("no lifted ball settled that could be pressed back to the floor")
    else:
        yield each.row("lifts", 0.0, rolling.tasks)
        yield each.row_of_bracket("omega_01", rolling, "from below", "onset of slip")
        by = "lag of settled slipping"
        yield from each.rows_of_zero("first SS", "lag", "omega_01", "from above", by)
    if begins := each.bracket_seen(NR_BEGINS):
        yield each.row_of_bracket("omega_02", begins, "from above", "onset of sliding on the wall")
    else:
        yield each.missing(f"{none} is the least to hold a ball on the wall")
    by = "speed of settled sinking"
    yield from each.rows_of_zero("NS", "v_y", "omega_02", "from below", by)


def _rows_of_slipping(each: Findings, top: Estimate | None, smooth: bool) -> Measured:
    """Rows of the end of slipping, at a fold or at omega_02, and the number of folds."""
    if "last SS" not in each.states:
        if (rolling := each.bracket_seen(RR_ENDS)) and not lifts(rolling):
            yield each.missing("no end of slipping at both points was found", 3)
        return
    tasks = [state.task for state in each.states["last SS"]]
    # At how many of the rising flows that were tried a ball from rest ceases to settle in SS.
    said: dict[float, bool | None] = {
        flow: case is Case.SS for flow, case in each.cases[SS_ENDS].items()
    }
    if tried := each.brackets.get(SS_ENDS):  # between its ends a ball settles too slowly
        said |= {flow: answer for flow, answer in tried.said if flow in tried.ends}
    ends = sum(bool(said[slow]) and said[fast] is False for slow, fast in pairwise(sorted(said)))
    # Beside known flows only a ball may have settled at none beyond the last.
    told = len(tasks) >= POINTS and (smooth or top is not None)
    if told and (ends or each.sure):
        yield each.row("folds", float(ends - smooth), tasks)
    if smooth:
        by = "floor force of settled slipping"
        yield from each.rows_of_zero("last SS", "force_Ay", "omega_02", "from below", by)
    elif top is None:
        yield each.missing("settled slipping points to no flow at which it ends", 3)
    else:
        by = "maximum of omega_0 along the branch"
        yield each.row("omega_04", top, tasks, side="from below", by=by)
        if fold := each.bracket_seen(FOLD):
            yield each.row_of_bracket("omega_04", fold, "from below", "last settled slipping")
        else:
            yield each.missing("the end of slipping at both points is extrapolated, not bracketed")


PROTOCOLS = (Protocol("thresholds", measure, ("settled",)),)
