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
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum, StrEnum, auto
from functools import partial
from itertools import pairwise
from typing import Unpack

import numpy as np

from compare.campaign.tasks import Task
from compare.engines.study import sliding_speeds
from compare.method import settling
from compare.method.brackets import Answer, Attempt, Bracket, Search, narrow
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
)
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


class Passage(StrEnum):
    """A flow up to which, or from which on, a ball moves in some case."""

    RR_ENDS = "RR ends"
    NS_ENDS = "NS ends"
    SS_ENDS = "SS ends"
    NR_BEGINS = "NR begins"
    RR_RETURNS = "RR returns"
    FOLD = "fold"


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


ASKED: dict[Passage, tuple[float, Answer]] = {
    Passage.RR_ENDS: (5, stays_rolling),
    Passage.NS_ENDS: (20, lambda run: physical_case(settled_case(run)) is not Case.NR),
    Passage.SS_ENDS: (10, may_settle),
    Passage.NR_BEGINS: (5, lambda run: slip(sliding_speeds(run)[1], run) > 1),
    Passage.RR_RETURNS: (20, lambda run: presses(run) and settled_case(run) is Case.RR),
    Passage.FOLD: (1.4, settles),
}
"""How long a run takes, in units of 1/c, and what is asked of it: yes below a threshold, no above.

The ball still rolls; the wall doesn't hold it; it settles on the floor, or may; it begins to slip
on the wall; pressed to the floor it rolls on both again; it settles on the floor."""


COARSE = 1e-2
"""Relative width of a bracket where only the neighbourhood is wanted."""
AWAY = 0.03
"""Relative distance from a known end of rolling, where an engine beside looks for it."""
DISTANCES = np.array([0.005, 0.01, 0.02, 0.03, 0.05])
"""Relative distances of settled states from where something vanishes."""
DISTANCES_BELOW_FOLD = np.array([0.01, 0.02, 0.035, 0.05, 0.08, 0.11, 0.15])
"""The same below a fold, in parts of the range of slipping: slip goes like the root."""
DISTANCES_OF_NR = np.array([0.002, 0.008, 0.02, 0.035, 0.05])
"""The same from where a ball rides the wall as slowly as it can."""


FOUND = {
    Passage.RR_ENDS: ("omega_01", "omega_03"),
    Passage.NS_ENDS: ("omega_02",),
    Passage.SS_ENDS: ("omega_04",),
}
"""The thresholds that each limit may be."""
STARTS = {
    Passage.RR_ENDS: "with the fluid",
    Passage.NS_ENDS: "on the wall",
    Passage.SS_ENDS: "rest",
}
"""How balls start of which is asked when that ends."""
From = Callable[[Parameters], Array]
"""The state in which a ball starts, by its parameters."""


class Beside(Enum):
    """Settled states beside a limit, from which it is extrapolated or searched for."""

    NR = auto()
    NS = auto()
    LIFTED = auto()
    """NR beyond the end of RR."""
    SS = auto()
    """SS next to the end of RR."""
    SS_LAST = auto()
    """SS next to its own end."""

    @property
    def case(self) -> Case:
        """The case in which they settle."""
        return {Beside.NS: Case.NS, Beside.SS: Case.SS, Beside.SS_LAST: Case.SS}.get(self, Case.NR)


def measure(runner: Runner, sets: Sets, records: Records) -> Measured:
    """The thresholds of each set: bisected, and extrapolated from settled states."""
    sure = not runner.sampling.granted
    found = [_where_cases_change(runner, name, p, records) for name, p in sets.items()]
    _narrow(runner, found, _end_of_rolling, careful=sure)
    _narrow(runner, found, _sinking_and_slipping)
    _settle_beside(runner, found)
    _narrow(runner, found, _on_the_wall_and_back, careful=sure)
    _narrow(runner, found, _fold)
    for each in found:
        for kind, bracket in each.brackets.items():
            if bracket.failure and kind is not Passage.NS_ENDS:  # which is looked for roughly
                yield each.missing(
                    f"{kind}: its flow is known less well, as a run {bracket.failure}", 0
                )
        yield from _rows(each)
        yield from _rows_of_slipping(each)


@dataclass(frozen=True, eq=False)
class Findings:
    """What was found on one set so far."""

    runner: Runner
    set: str
    p: Parameters
    cases: Mapping[Passage, Mapping[float, Case]]
    """In which cases balls that start so were seen to settle, by flow, the slowest first."""
    changes: Mapping[Passage, Bracket]
    """Flows between which a limit is looked for."""
    brackets: dict[Passage, Bracket] = field(default_factory=dict)
    states: dict[Beside, list[SteadyState]] = field(default_factory=dict)
    """The nearest first."""

    def search(
        self,
        kind: Passage,
        around: Bracket,
        width: float,
        start: From | None = None,
        time: float = 1.0,
    ) -> tuple[Passage, Search]:
        """A search by runs at held flows, `time` times as long as `ASKED` takes.

        They start as `STARTS` says, unless another start is given; for the end of slipping, from
        the state that the ball reached at the largest flow so far."""
        units, answer = ASKED[kind]

        def task(omega: float, bracket: Bracket, attempt: Attempt) -> Task:
            q = self.p.replace(omega_0=float(omega))
            if kind is Passage.SS_ENDS and (last := bracket.runs[0]):
                x0 = last.x[-1]
            else:
                x0 = start(q) if start else settling.initial_condition("", q, STARTS[kind]).x0
            t_end = settling.rounded_duration(q, units * time * attempt.time)
            return self.runner.task(q, x0, t_end, coarse_step(q) / attempt.divisor)

        return kind, Search(around, task, answer, width)

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
            why = f"too few states settled for {quantity} by {how['by']}"
            return self.missing(f"{why}, or their extrapolation has no zero")
        p = self.p.replace(omega_0=at.value) if isinstance(at, Estimate) else self.p
        return self.runner.measurement(self.set, p, quantity, at, tasks, **how)

    def row_of_bracket(
        self, quantity: str, of: Bracket, side: str, by: str
    ) -> Measurement | Missing:
        """The measurement of a threshold that lies in a bracket."""
        # Slip that is still too small to count may have begun below: it is proportional to the
        # distance.
        _, above = of.runs
        speed = max(slip(speeds, above) for speeds in sliding_speeds(above)) if above else 0.0
        unseen = 0.0
        if quantity in ("omega_01", "omega_02"):
            unseen = max(of.width / max(1.0, speed), SLIP_SEEN * of.high)
        return self.row(quantity, of.place.also(unseen_slip=unseen), of.tasks, side=side, by=by)

    def rows_of_zero(self, kind: Beside, what: str, quantity: str, side: str, by: str) -> Measured:
        """The measurement of a threshold, extrapolated from settled states to a zero."""
        if kind in self.states:
            states = self.states[kind]
            place = extrapolated(states, what, extrapolated_zero)
            tasks = [state.task for state in states]
            yield self.row(quantity, place, tasks, side=side, by=f"{by} → 0")


def _where_cases_change(runner: Runner, name: str, p: Parameters, records: Records) -> Findings:
    """For each kind of change the flows of settled states between which the case changes.

    Without such flows from half the slowest, or up to twice the fastest. An engine beside the one
    on trial looks where that one found something."""
    starts = STARTS | {Passage.SS_ENDS: runner.sampling.settled_starts[0][0]}
    cases = {kind: settling.settled_cases(records, name, how) for kind, how in starts.items()}
    changes = {}
    for kind, seen in cases.items():
        if flows := list(seen):
            ended = {Case.NR} if kind is not Passage.RR_ENDS else set(Case) - {Case.RR}
            low = max((flow for flow in flows if seen[flow] not in ended), default=flows[0] / 2)
            high = next((flow for flow in flows if flow > low), 2 * flows[-1])
            changes[kind] = Bracket(low, high)
    if any(m.set == name for m in records.select("thresholds")):
        changes = {}
        for kind, quantities in FOUND.items():
            away = AWAY if kind is Passage.RR_ENDS else COARSE / 3
            for known in (records.threshold(name, quantity) for quantity in quantities):
                if known:
                    changes[kind] = around(known.value, away)
    return Findings(runner, name, p, cases, changes)


def around(flow: float, part: float) -> Bracket:
    """A bracket of a flow, to either side by a part of it."""
    return Bracket(flow * (1 - part), flow * (1 + part))


def _narrow(
    runner: Runner,
    found: Sequence[Findings],
    searches: Callable[[Findings], Iterator[tuple[Passage, Search]]],
    careful: bool = False,
) -> None:
    """Narrow down what is searched for on a set, on all sets together."""
    asked = [(each, kind, search) for each in found for kind, search in searches(each)]
    brackets = narrow(runner, [search for *_, search in asked], careful)
    for (each, kind, _), bracket in zip(asked, brackets, strict=True):
        each.brackets[kind] = bracket


def _end_of_rolling(each: Findings) -> Iterator[tuple[Passage, Search]]:
    """A search for the largest flow at which a ball that rolls at both points goes on so."""
    if change := each.changes.get(Passage.RR_ENDS):
        width = each.runner.sampling.thresholds_width * change.high
        yield each.search(Passage.RR_ENDS, change, width)


def _sinking_and_slipping(each: Findings) -> Iterator[tuple[Passage, Search]]:
    """Rough searches up to where the wall holds no ball, and SS settles on the floor."""
    if change := each.changes.get(Passage.NS_ENDS):
        yield each.search(Passage.NS_ENDS, change, COARSE * change.low)
    change, end = each.changes.get(Passage.SS_ENDS), each.brackets.get(Passage.RR_ENDS)
    if change and end and not lifts(end) and end.high < change.high:
        change = replace(change, low=max(change.low, end.high))
        yield each.search(Passage.SS_ENDS, change, COARSE * change.low)


def _settle_beside(runner: Runner, found: Sequence[Findings]) -> None:
    """Settle states beside every change; those count that settle in the case there.

    A bracket counts only if something was seen beyond it, or that is granted."""
    beside: list[tuple[Findings, Beside, str, Array]] = []  # how they start, flows in rad s-1
    for each in found:
        for kind, bracket in [*each.brackets.items()]:
            seen = bracket.runs[1] or bracket.high in each.cases[kind]
            if not (seen or runner.sampling.granted):
                del each.brackets[kind]
        if carried := each.brackets.get(Passage.NS_ENDS):
            beside.append((each, Beside.NR, "on the wall", carried.high * (1 + DISTANCES_OF_NR)))
            if runner.sampling.slow:  # a ball that sinks swings for long
                beside.append((each, Beside.NS, "on the wall", carried.low * (1 - DISTANCES / 2)))
        end, last = each.brackets.get(Passage.RR_ENDS), each.brackets.get(Passage.SS_ENDS)
        if end and lifts(end):
            beside.append((each, Beside.LIFTED, "on the wall", end.high * (1 + DISTANCES_OF_NR)))
        elif end and last:
            span = last.low - end.high
            near = end.high + DISTANCES * min(span, end.high)
            beside.append((each, Beside.SS, "rest", near))
            beside.append((each, Beside.SS_LAST, "rest", last.low - DISTANCES_BELOW_FOLD * span))
    starts = [
        settling.starts_at(each.set, each.p, how, flows.tolist()) for each, _, how, flows in beside
    ]
    criteria = SettlingCriteria(
        loose=runner.sampling.thresholds_loose, rounds=runner.sampling.thresholds_rounds
    )
    settled = settling.settle_groups(runner, starts, criteria)
    for (each, which, *_), states in zip(beside, settled, strict=True):
        each.states[which] = [
            s for s in states if not s.failure and physical_case(s.case) is which.case
        ]


def _on_the_wall_and_back(each: Findings) -> Iterator[tuple[Passage, Search]]:
    """Searches for where slip begins on the wall, and where a pressed ball rolls again.

    They begin from settled states continued; the pressed one has a bit less spin."""
    width = each.runner.sampling.thresholds_width
    begins, carried = each.brackets.get(Passage.NS_ENDS), each.states.get(Beside.NR, [])
    if begins and len(carried) == len(DISTANCES_OF_NR):
        start = continued(carried, height=settling.safe_height(each.p))
        yield each.search(Passage.NR_BEGINS, begins, width * begins.high, start)
    end, lifted = each.brackets.get(Passage.RR_ENDS), each.states.get(Beside.LIFTED, [])
    if end and len(lifted) == len(DISTANCES_OF_NR):
        change = Bracket(end.low * (1 - COARSE), end.high * (1 + COARSE))
        pressed = continued(lifted, height=0.0, less=1e-3)
        yield each.search(Passage.RR_RETURNS, change, width * end.high, pressed)


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
    last, held = each.states.get(Beside.SS_LAST, []), each.brackets.get(Passage.NR_BEGINS)
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


def _fold(each: Findings) -> Iterator[tuple[Passage, Search]]:
    """A search for the largest flow at which a ball on the floor settles, at the fold.

    At a fold all slows down, like the root of the distance."""
    top, _ = _end_of_slipping(each)
    if top and each.runner.sampling.slow:
        narrowest = each.runner.sampling.thresholds_fold
        half = max(narrowest, 5.0 * top.uncertainty / top.value)
        nearest, time = each.states[Beside.SS_LAST][0].mean, 1 / math.sqrt(narrowest)
        width = narrowest * top.value
        yield each.search(Passage.FOLD, around(top.value, half), width, lambda _: nearest, time)


def _rows(each: Findings) -> Measured:
    """Rows of the end of rolling (omega_01 or omega_03), and of omega_02."""
    none = "no flow that was tried, up to twice the fastest of the settled states,"
    if not (rolling := each.bracket_seen(Passage.RR_ENDS)):
        yield each.missing(f"{none} ends two-point rolling")
    elif lifts(rolling):
        yield each.row("lifts", 1.0, rolling.tasks)
        yield each.row_of_bracket("omega_03", rolling, "from below", "loss of the floor")
        if returns := each.bracket_seen(Passage.RR_RETURNS):
            by = "return to rolling when pressed"
            yield each.row_of_bracket("omega_03", returns, "from above", by)
        else:
            why = "a lifted ball did not settle, and could not be pressed back to the floor"
            yield each.missing(f"{why}: no second omega_03")
    else:
        yield each.row("lifts", 0.0, rolling.tasks)
        yield each.row_of_bracket("omega_01", rolling, "from below", "onset of slip")
        by = "lag of settled slipping"
        yield from each.rows_of_zero(Beside.SS, "lag", "omega_01", "from above", by)
    if begins := each.bracket_seen(Passage.NR_BEGINS):
        yield each.row_of_bracket("omega_02", begins, "from above", "onset of sliding on the wall")
    else:
        yield each.missing(f"{none} is the least to hold a ball on the wall")
    by = "speed of settled sinking"
    yield from each.rows_of_zero(Beside.NS, "v_y", "omega_02", "from below", by)


def _rows_of_slipping(each: Findings) -> Measured:
    """Rows of the end of slipping, at a fold or at omega_02, and the number of folds."""
    if Beside.SS_LAST not in each.states:
        if (rolling := each.bracket_seen(Passage.RR_ENDS)) and not lifts(rolling):
            yield each.missing("no end of slipping at both points was found", 3)
        return
    top, smooth = _end_of_slipping(each)
    tasks = [state.task for state in each.states[Beside.SS_LAST]]
    # At how many of the rising flows that were tried a ball from rest ceases to settle in SS.
    said: dict[float, bool | None] = {
        flow: case is Case.SS for flow, case in each.cases[Passage.SS_ENDS].items()
    }
    if tried := each.brackets.get(Passage.SS_ENDS):  # between its ends a ball settles too slowly
        said |= {flow: answer for flow, answer in tried.said if flow in tried.ends}
    ends = sum(bool(said[slow]) and said[fast] is False for slow, fast in pairwise(sorted(said)))
    settles = len(tasks) >= POINTS
    # Beside known flows only a ball may have settled at none beyond the last.
    told = settles and (smooth or top is not None)
    if told and (ends or not each.runner.sampling.granted):
        yield each.row("folds", float(ends - smooth), tasks)
    if smooth:
        by = "floor force of settled slipping"
        yield from each.rows_of_zero(Beside.SS_LAST, "force_Ay", "omega_02", "from below", by)
    elif top is None:
        why = "settled slipping points to no flow at which it ends"
        yield each.missing(why, 3)
    else:
        by = "maximum of omega_0 along the branch"
        yield each.row("omega_04", top, tasks, side="from below", by=by)
        if fold := each.bracket_seen(Passage.FOLD):
            yield each.row_of_bracket("omega_04", fold, "from below", "last settled slipping")
        else:
            slow = "costs more than an engine beside the one on trial may"
            why = "the end of slipping at both points is extrapolated; to bracket it "
            yield each.missing(why + ("could not be done" if each.runner.sampling.slow else slow))


PROTOCOLS = (Protocol("thresholds", measure, ("settled",)),)
