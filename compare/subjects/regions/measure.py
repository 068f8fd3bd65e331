"""Which motions there are over planes of parameters, the border between the basins of two, and
where that is born."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import islice, zip_longest
from typing import NamedTuple

import numpy as np
from scipy.spatial import Delaunay

from compare.campaign.tasks import Task
from compare.method.brackets import Attempt, Bracket, Search
from compare.method.conditions import Conditions
from compare.method.protocol import Protocol
from compare.method.record import Measured, Measurement, Missing, Records, Sets, if_found
from compare.method.runner import Runner, coarse_step
from compare.method.scales import time_unit
from compare.method.settling import (
    SettlingCriteria,
    initial_condition,
    physical_case,
    rounded_duration,
    settle_groups,
    starts_at,
)
from compare.method.statistics import (
    COVERAGE,
    Estimate,
    estimate,
    extrapolated_zero,
    initial_slope,
    straight_line,
    tail,
    taper,
)
from compare.method.step_pairs import constrained
from compare.method.together import Procedure, narrowed, settled, together
from compare.plan import Level
from model import Case, Parameters, State, Trajectory
from model.arrays import Array
from model.drag import QUADRATIC
from model.kinematics import SLIP_XYZ

FIGURES = ("fig-7", "fig-8")  # mu as it is, and mu = eta
WAYS = ("rest", "half as fast", "with the fluid", "on the wall")
"""How balls start at each point of a plane."""


@dataclass(eq=False)
class Plane:
    """What was seen on one plane; points are (2,) of the unit square."""

    figure: str
    points: list[Array]  # those to be measured next
    tried: set[tuple[float, ...]] = field(default_factory=set)
    seen: list[tuple[Array, int]] = field(default_factory=list)
    """Points at which all runs settled, and bit masks of the cases reached."""


def planes(runner: Runner, sets: Sets, records: Records) -> Measured:
    """Bit masks of the cases reached over the planes of Figs. 7 and 8, SR counted as NR.

    In a plane of eta and omega_0 points are spread evenly first; more are put where neighbours
    differ, each kind of border in turn, and among rare ones. Points that don't settle are left
    out."""
    from scipy.stats import qmc  # slow to import

    # In such drag states settle within seconds, and slipping still lasts beyond the flow at which
    # the wall can carry.
    p = sets["reference"].replace(c=1.25)
    spread = [
        list(qmc.Halton(2, seed=7 + k).random(runner.sampling.plane_spread))
        for k in range(len(FIGURES))
    ]
    both = [Plane(figure, points) for figure, points in zip(FIGURES, spread, strict=True)]
    for count in (*runner.sampling.plane_added, 0):
        chosen = [(plane, u) for plane in both for u in plane.points]
        starts = []
        for plane, u in chosen:
            eta, flow = (np.array([0.02, 0.45]) + u * np.array([0.78, 3.15])).tolist()
            q = p.replace(
                eta=eta, omega_0=flow / time_unit(p), mu=eta if plane.figure == "fig-8" else p.mu
            )
            starts.append([initial_condition(plane.figure, q, how) for how in WAYS])
        # Only the case matters: states may drift a thousand times as far as those whose values are
        # compared.
        criteria = SettlingCriteria(span=20.0, loose=1000.0, rounds=runner.sampling.plane_rounds)
        for (plane, u), states in zip(chosen, settle_groups(runner, starts, criteria), strict=True):
            if not any(each.failure for each in states):
                mask = sum(1 << case for case in {physical_case(each.case) for each in states})
                plane.seen.append((u, mask))
                q, tasks = states[0].start.p, [each.task for each in states]
                yield runner.measurement("reference", q, "cases", mask, tasks, figure=plane.figure)
        for plane in both:
            plane.tried |= {tuple(u.tolist()) for u in plane.points}
            fresh = (u for u in added_points(plane.seen) if tuple(u.tolist()) not in plane.tried)
            plane.points = list(islice(fresh, count))
    for plane in both:
        if out := len(plane.tried) - len(plane.seen):
            at = f"{plane.figure}: {out} of {len(plane.tried)} points"
            why = f"{at} are left out, too close to a change of case to settle"
            yield runner.missing("reference", why)


def added_points(seen: Sequence[tuple[Array, int]]) -> list[Array]:
    """Points to measure next: midpoints at each kind of border, and at rare cases.

    A set of cases is rare if it was seen less than half as often as if all were seen equally often.
    """
    if len(seen) < 4:
        return []
    places, masks = np.array([u for u, _ in seen]), [m for _, m in seen]
    often = Counter(masks)
    rare = {m for m, number in often.items() if number < 0.5 * len(masks) / len(often)}
    borders: dict[tuple[int, ...], list[tuple[float, int, int]]] = {}
    for a, b in {
        tuple(sorted((int(t[i]), int(t[i - 1]))))
        for t in Delaunay(places).simplices
        for i in range(3)
    }:
        if masks[a] != masks[b] or masks[a] in rare:
            length = float(np.hypot(*(places[a] - places[b])))
            borders.setdefault(tuple(sorted((masks[a], masks[b]))), []).append((-length, a, b))
    rows = zip_longest(*(sorted(edges) for _, edges in sorted(borders.items())))
    turns = [edge for row in rows for edge in row if edge]
    return [(places[a] + places[b]) / 2 for _, a, b in turns]


FAR_FROM_EDGE = 0.1  # a long way, in two fifths of a run, divided by the distance of the attractors
ARRIVED = 0.01  # distance at which a ball has arrived, divided likewise
WIDTHS = 2 * math.sqrt(3)
"""Most by which the places in two brackets of a width differ, in standard uncertainties of one."""
CLOSING = (0.1, 0.17, 0.26, 0.38)
"""Flows, as parts of the way from omega_02 to omega_04, on the way to where the edge begins."""
SWINGS_ON = "on the border the ball swings on: quadratic drag of a slight lag damps next to nothing"


def borders(runner: Runner, sets: Sets, records: Records) -> Measured:
    """The state on the border between two basins, at flows from omega_02 to omega_04.

    Where at one flow a ball slips on the floor (SS) or goes round with the fluid (SR, which is NR
    at y = 0), the straight line between the two states crosses the border between their basins. Two
    runs close to it on either side stay together for a while near the unstable state. The mean of
    their states while they are together begins the next line. At the quick level the edge is
    followed to where it begins for the set with most drag alone, which settles soonest."""
    limits: dict[str, tuple[float, float]] = {}
    for name, p in sets.items():
        holds, folds = (records.threshold(name, omega) for omega in ("omega_02", "omega_04"))
        if p.drag == QUADRATIC:
            yield runner.missing(name, SWINGS_ON)
        elif holds and folds:
            limits[name] = holds.value, folds.value
        else:
            yield runner.missing(name, "at no flow are a slipping ball and a lifted one settled")
    at_quick = runner.level is Level.QUICK
    soonest = max(limits, key=lambda name: sets[name].c, default="") if at_quick else ""
    flows = (
        (name, sets[name].replace(omega_0=low + part * (high - low)))
        for name, (low, high) in limits.items()
        for part in (CLOSING if name == soonest else runner.sampling.edge_flows)
    )
    edges = yield from together(runner, (_follow(runner, name, p) for name, p in flows))
    for name, (low, high) in limits.items():
        last = low + (max(CLOSING) + 1e-6) * (high - low)
        near = [edge for edge in edges if edge and edge.set == name and edge.p.omega_0 < last]
        if len(near) >= len(CLOSING):
            yield _where_it_begins(sorted(near, key=lambda edge: edge.p.omega_0))
        elif name == soonest or not at_quick:
            yield runner.missing(name, "too few crossings to follow the edge to the lifted ball")


def _follow(runner: Runner, name: str, p: Parameters) -> Procedure[Edge | None]:
    """The state on the border at a flow, where lines crossed it."""
    starts = [initial_condition(name, p, how) for how in ("rest", "on the wall")]
    (both,) = yield from settled(starts, criteria=SettlingCriteria(loose=10.0))
    slipping, lifted = both
    if not (slipping.settled_in(Case.SS) and lifted.settled_in(Case.NR, Case.SR)):
        came_to = ", ".join(state.failure or state.case.name for state in both)
        why = f"no two attractors settled at omega_0 = {p.omega_0:.4g} rad/s: {came_to}"
        yield runner.missing(name, why)
        return None
    # on floor and wall: a lifted ball moves alike at every height
    a, b = (constrained(Case.SS, state.mean, p) for state in both)
    line, edge, missed, moves = Line(a, b - a), None, 0, list[Array]()
    for _ in range(runner.sampling.edge_lines):
        search = _search(runner, p, line, (a, b), 5e-3 * 4.0**missed if edge else 0.0)
        (bracket,) = yield from narrowed(search, careful=False)
        if None in bracket.runs:
            moves, missed = [], missed + 1
        else:
            before, edge = edge, Edge(runner, name, p, b, line, bracket)
            moves = [*moves, np.abs(edge.crossing - before.crossing)] if before else []
            line, missed = edge.next_line(), 0
    if not (edge and moves):  # it is to be crossed by the last line, and by one before
        at = f"at omega_0 = {p.omega_0:.4g} rad/s"
        yield runner.missing(name, f"{at} the last lines missed the border", 5)
        return None
    edge = replace(edge, moves=tuple(moves))
    yield from edge.rows()
    return edge


class Line(NamedTuple):
    """A straight line of states (8,) between the attractors, or across the border."""

    centre: Array
    along: Array
    """Its length is the distance of the attractors."""


def _search(
    runner: Runner, p: Parameters, line: Line, rests: tuple[Array, Array], reach: float
) -> Search:
    """A search for the place of the border on a line: from one attractor to the other, or within
    `reach` of the centre.

    Later lines are a hundredth as long, and four times as long after each that missed the
    border."""
    t_end, step = rounded_duration(p, runner.sampling.edge_time), coarse_step(p)
    around, width = (Bracket(-reach, reach), 2.5e-6) if reach else (Bracket(0.0, 1.0), 1e-5)

    def task(s: float, bracket: Bracket, attempt: Attempt) -> Task:
        lasts, x0 = t_end * attempt.time, line.centre + s * line.along
        return runner.task(p, x0, lasts, step, samples=round(lasts / (8 * step)))

    slipping, lifted = (float(State.of(x).omega_c) for x in rests)
    return Search(around, task, partial(ends_slipping, slipping=slipping, lifted=lifted), width)


def _where_it_begins(near: Sequence[Edge]) -> Measurement | Missing:
    """The flow at which an edge meets the lifted ball: both have the same omega_c there."""
    noise = max(float(edge.uncertainty[2]) for edge in near)
    apart = [edge.estimate((edge.crossing - edge.lifted)[2], noise) for edge in near]
    place = extrapolated_zero(np.array([edge.p.omega_0 for edge in near]), apart)
    tasks = [task for edge in near for task in edge.bracket.tasks]
    at = Conditions(side="from above", by="unstable slipping meets the lifted ball")
    first, p = near[0], near[0].p.replace(omega_0=place.value)
    row = first.runner.measurement(first.set, p, "omega_02", place, tasks, **at)
    return if_found(row, "the edge points to no flow at which it meets the lifted ball")


@dataclass(frozen=True, eq=False)
class Edge:
    """The border between two basins at one flow, where it crosses a line."""

    runner: Runner
    set: str
    p: Parameters
    lifted: Array  # the settled state on that side
    line: Line
    bracket: Bracket
    # by how much each of the last crossings differs from that of the line before
    moves: tuple[Array, ...] = ()

    @property
    def crossing(self) -> Array:
        """The state in the middle of the bracket."""
        return np.asarray(self.line.centre + self.bracket.place.value * self.line.along)

    def next_line(self) -> Line:
        """The next line: from where the last two runs agreed, as they part.

        Together they are within 2e-3 of the distance of the attractors."""
        both, before = [run.x for run in self.bracket.runs if run is not None], self.line.along
        low, high = (x[: min(map(len, both))] for x in both)
        along = np.abs((high - low) @ before / float(before @ before))
        together = int(np.argmax(along > 2e-3)) or len(along)
        length = max(together - together // 4, 1)
        weights = taper(length)
        mean = weights @ (low + high)[together - length : together] / (2 * weights.sum())
        parting = constrained(Case.SS, (high - low)[together - 1], self.p)
        line = parting * float(before @ before) / float(parting @ before)
        return Line(constrained(Case.SS, mean, self.p), line)

    @property
    def by_bracket(self) -> Array:
        """Standard uncertainty of the crossing (8,) by the bracket."""
        return np.asarray(self.bracket.place.uncertainty * self.line.along)

    @property
    def further(self) -> Array:
        """How far lines beyond the last may move the crossing (8,).

        Moves are taken to shrink as the last two did, but for what two brackets explain of a move:
        together they are at least the last one, and at most ten of its size; and no less than the
        distance from the crossing to the next line, through the mean of the last two runs. (Chosen
        after moves had been seen that were no longer than brackets are wide.)"""
        *_, before, last = (0.0, *(float(np.linalg.norm(move[SLIP_XYZ])) for move in self.moves))
        sure = float(np.linalg.norm(self.by_bracket[SLIP_XYZ]))
        ratio = min(max(last - WIDTHS * sure, 0.0) / before, 0.9) if before else 0.0
        centre, onward = self.next_line()
        alike = np.ones(8)
        alike[2] = self.p.R / self.p.r
        off, along = (centre - self.crossing) * alike, onward * alike
        ahead = np.abs(off - (off @ along) / (along @ along) * along) / alike
        return np.asarray(np.maximum(self.moves[-1] / (1 - ratio), ahead))

    @property
    def uncertainty(self) -> Array:
        """Standard uncertainty of the crossing (8,), by the bracket and further lines."""
        return np.asarray(np.hypot(self.by_bracket, self.further))

    def estimate(self, value: float, uncertainty: float) -> Estimate:
        """A number of the state at the crossing, by the causes of its uncertainty."""
        causes = self.bracket.place, estimate(0.0, further_lines=1.0)
        moves = self.by_bracket, self.further
        sizes = [float(np.linalg.norm(move[SLIP_XYZ])) for move in moves]
        return estimate(value, edge=uncertainty).told_apart("edge", causes, sizes)

    def rows(self) -> Measured:
        """Measurements of the state: omega_c, slips and the spin on the wall."""
        x, sure, roll = State.of(self.crossing), State.of(self.uncertainty), self.p.R / self.p.r
        values = {name: getattr(x, name) for name in ("omega_c", "slip_x", "slip_y", "slip_z")}
        values["wall_spin"] = x.slip_x + roll * x.omega_c
        slips = max(sure.slip_x, sure.slip_y, sure.slip_z, roll * sure.omega_c)
        row = partial(self.runner.measurement, self.set, self.p, tasks=self.bracket.tasks)
        for name, value in values.items():
            of = self.estimate(value, slips / roll if name == "omega_c" else slips)
            yield row(quantity=f"edge_{name}", value=of, case="SS")


def ends_slipping(run: Trajectory, slipping: float, lifted: float) -> bool | None:
    """Whether a run tends to slipping, by its direction, or the rest state ahead; of the two
    attractors omega_c is given.

    None while it moves by little, ever more slowly, and to neither attractor: then it isn't the
    border's instability that moves it."""
    parts = np.array_split(run.omega_c[tail(run, 0.4)], 4)
    first, second, third, last = (
        float(taper(len(part)) @ part / taper(len(part)).sum()) for part in parts
    )
    before, now, way = second - first, last - third, abs(lifted - slipping)
    grows = before * now > 0 and abs(now) > max(abs(before), 1e-5 * way)
    if abs(last - first) > FAR_FROM_EDGE * way or grows:
        return (last - first) * (slipping - lifted) > 0
    # by a geometric series
    end = last + now * abs(now) / max(abs(before) - abs(now), abs(now), 1e-300)
    rests = [abs(end - each) < ARRIVED * way for each in (slipping, lifted)]
    return rests[0] if any(rests) else None


FIRST_DRAGS = (2.0, 4.0)  # drag at which the range of slipping is measured first, c sqrt(R/g)
NEARER_DRAGS = (1.6, 2.6)
"""Drag measured then, in units of that extrapolated from those: states settle soon."""
BEFORE_FOLD = (0.02, 0.035, 0.055, 0.08, 0.12)
"""Distances of flows below omega_02, in parts of the range of slipping."""


def birth(runner: Runner, sets: Sets, records: Records) -> Measured:
    """The drag at which the fold is born: d omega_0/dA_y of SS is zero at A_y = 0.

    Below that drag slipping ends in a fold, and above it passes to the wall without a jump. At the
    end of the branch the floor carries nothing; the sign of the slope of omega_0 over the floor's
    force there decides whether the branch turns back. States are settled in stronger drag, where
    they last up to the end. The zero is that of the straight line through the slopes as a function
    of 1/c."""
    return together(runner, (_birth(runner, name, p, records) for name, p in sets.items()))


def _birth(runner: Runner, name: str, p: Parameters, records: Records) -> Procedure[None]:
    """The drag at which the fold of a set is born."""
    begins, ends = (records.threshold(name, omega) for omega in ("omega_01", "omega_02"))
    if not (begins and ends and begins.value < ends.value):
        yield runner.missing(name, "there is no range of slipping that ends at the wall")
        return
    flows = [ends.value - part * (ends.value - begins.value) for part in BEFORE_FOLD]
    drags = [kappa / time_unit(p) for kappa in FIRST_DRAGS]
    # 1/c, s, to which the lag by a force is proportional; the slope of omega_0 as a function of the
    # floor's force where that vanishes
    lags, slopes, tasks = list[float](), list[Estimate](), list[Task]()
    for _ in (FIRST_DRAGS, NEARER_DRAGS):
        groups = [starts_at(name, p.replace(c=c), "rest", flows) for c in drags]
        for states in (yield from settled(*groups)):
            if all(state.settled_in(Case.SS) for state in states):
                forces = [state.values["force_Ay"] for state in states]
                at = np.array([state.start.p.omega_0 for state in states])
                lags.append(1 / states[0].start.p.c)
                slopes.append(initial_slope(at, forces))
                tasks += [state.task for state in states]
        if len(lags) < len(FIRST_DRAGS):
            break
        lag, _ = straight_line(lags, slopes)
        drags = [1 / lag.value * k for k in NEARER_DRAGS if lag.value > 0]
    if len(lags) < len(FIRST_DRAGS) + len(NEARER_DRAGS):
        yield runner.missing(name, "too few states of slipping settle near the end of the branch")
    elif lag.value <= COVERAGE * lag.uncertainty:  # else the drag may have no bound
        yield runner.missing(name, "no drag gives birth to a fold")
    else:
        drag = replace(lag.times(1 / lag.value**2), value=1 / lag.value)
        yield runner.measurement(name, p, "critical_drag", drag, tasks)


PROTOCOLS = (
    Protocol("plane", planes),
    Protocol("edge", borders, ("thresholds",)),
    Protocol("birth", birth, ("thresholds",)),
)
