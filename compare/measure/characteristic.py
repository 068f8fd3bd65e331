"""The characteristic curve omega_c(omega_0), going out from settled states: its slope, and its loop of hysteresis.

For a slope only the flow is changed: at settled states, across the onset of slipping, and on average from there to
unloading. For the loop of Fig. 13 the flow rises and falls in held steps, all in one run: a ramp would overshoot the
fold of the slipping branch, where settling slows down without bound. Its levels are where cases were seen to change,
and between.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby, pairwise

import numpy as np

from compare.measure.lab import Lab, coarse_step
from compare.measure.levels import Level
from compare.measure.record import Condition, Measurement, Missing, Records, if_sure, measurement
from compare.measure.settling import STEPS_A_SAMPLE, Settled, duration, family, high, judged, settle_groups
from compare.measure.trials import Start
from compare.runs.tasks import Task
from compare.statistics import Measured
from model import Case, Flow, Parameters, State, Trajectory
from model.arrays import Array
from model.trajectory import columns

STEP = 1e-3
"""Relative distance of neighbouring flows; half of it shows what the curvature does."""
ACROSS = (-1e-3, -5e-4, 5e-4, 1e-3, 2e-3, 4e-3, 8e-3)
"""Distances from the flow at which slipping sets in, relative to it."""
SLIPPING = {Level.QUICK: 2, Level.DEFAULT: 20, Level.FULL: 20}
"""Slipping states of a set at which the slope is measured, at most."""
SPAN = 24.0
"""Length of a round, in units of 1/c."""
SHARP = {"neighbours": 0.3, "jump": 0.1, "mean": 1.0}
"""How much less than it may a state is to drift, if it can be had, by what is measured: for the jump they lie close."""
HOLD = {Level.QUICK: 40.0, Level.DEFAULT: 60.0, Level.FULL: 100.0}
"""How long each level of the loop is held, in units of 1/c."""
BETWEEN = {Level.QUICK: 2, Level.DEFAULT: 4, Level.FULL: 8}
"""Into how many parts the gap between two flows is divided in which a case gives way to another."""


@dataclass(frozen=True)
class Curve:
    """Settled states to be joined to slopes."""

    by: str
    set: str
    p: Parameters
    """With the flow at which the slope is wanted."""
    flows: tuple[float, ...]
    x0: tuple[float, ...] = (0.0,) * 8
    noise: float = 0.0
    """Standard uncertainty of the flows, rad s-1."""


def slope(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Slopes at the settled states, the jump where slipping sets in, and the mean slope from there to unloading."""
    curves = [
        curve
        for name, p in sets.items()
        for curve in [*_local(name, records, SLIPPING[lab.level]), *_wide(name, p, records)]
    ]
    for by, sharp in SHARP.items():
        own = [curve for curve in curves if curve.by == by]
        starts = [[Start(c.set, c.p.replace(omega_0=w), by, np.array(c.x0)) for w in c.flows] for c in own]
        for curve, states in zip(own, settle_groups(lab, starts, span=SPAN, sharp=sharp), strict=True):
            yield _slope(lab, curve, states)


def _slope(lab: Lab, curve: Curve, states: Sequence[Settled]) -> Measurement | Missing:
    where = f"{curve.by} at omega_0 = {curve.p.omega_0:.4g} rad/s"
    failure = next((each.failure for each in states if each.failure), "")
    if failure:
        return Missing("slope", curve.set, f"{where}: {failure}")
    value = REDUCTIONS[curve.by](curve, states)
    if not value:
        cases = ", ".join(each.case.name for each in states)
        return Missing("slope", curve.set, f"{where}: the states there are not of one kind ({cases})")
    tasks, at = [each.task for each in states], {"case": states[-1].case.name, "by": curve.by}
    row = measurement(lab, "slope", curve.set, curve.p, "slope", value, tasks, **at)
    return if_sure(row, 1.0, f"{where}: the slope is uncertain by {value.uncertainty:.1g}, too much to be of use")


def _local(name: str, records: Records, most: int) -> Iterator[Curve]:
    """Settled states that slip on the floor, at most so many; of the others, that of the fastest flow."""
    rows = [m for m in records.select("settled") if m.set == name and m.quantity != "case" and m.parameters.omega_0]
    rows.sort(key=_flow_and_case)
    states = [(*key, {m.quantity: m for m in same}) for key, same in groupby(rows, key=_flow_and_case)]
    for case in (Case.RR, Case.SS, Case.NR):
        alike = [(omega_0, values) for omega_0, each, values in states if each is case]
        few = np.linspace(0, len(alike) - 1, most).round() if case is Case.SS else [len(alike) - 1]
        for k in sorted({int(n) for n in few if alike}):
            omega_0, values = alike[k]
            p, moving = values["omega_c"].parameters, ("v_y", "omega_c", "slip_x", "slip_y", "slip_z")
            x0 = (high(p) * (case is Case.NR), *(values[q].value for q in moving), 0.0, 0.0)
            flows = tuple(omega_0 * (1 + d) for d in (-STEP, -STEP / 2, STEP / 2, STEP))
            yield Curve("neighbours", name, p, flows, x0)


def _flow_and_case(m: Measurement) -> tuple[float, Case]:
    return m.parameters.omega_0, family(Case[str(m.conditions["case"])])


def _wide(name: str, p: Parameters, records: Records) -> Iterator[Curve]:
    """Across the onset of slipping, and from there to the flow at which the wall begins to carry the ball."""
    one, two = records.threshold(name, "omega_01"), records.threshold(name, "omega_02")
    if one is not None:
        q, x0 = p.replace(omega_0=one.value), (0.0, 0.0, one.value, 0.0, 0.0, 0.0, 0.0, 0.0)
        around = tuple(one.value * (1 + d) for d in ACROSS)
        yield Curve("jump", name, q, around, x0, one.uncertainty)
        if two is not None and two.value > one.value:
            noise = math.hypot(one.uncertainty, two.uncertainty)
            yield Curve("mean", name, q, (*around[:2], two.value), noise=noise)


def _neighbours(curve: Curve, states: Sequence[Settled]) -> Measured | None:
    """Central differences over two distances, without the error that goes with the square of the distance."""
    if len({family(each.case) for each in states}) > 1:
        return None
    f, w, noise = _points(curve, states)
    wide, near = (w[3] - w[0]) / (f[3] - f[0]), (w[2] - w[1]) / (f[2] - f[1])
    return Measured(near + (near - wide) / 3, math.hypot((near - wide) / 3, 2 * noise / (f[2] - f[1])))


def _jump(curve: Curve, states: Sequence[Settled]) -> Measured | None:
    """Slope above less slope below, each brought to the threshold itself: above by a cubic through four secants."""
    if [each.case for each in states[1:3]] != [Case.RR, Case.SS]:
        return None
    f, w, noise = _points(curve, states)
    below = (w[1] - w[0]) / (f[1] - f[0])
    secants, middles = np.diff(w[2:]) / np.diff(f[2:]), (f[2:-1] + f[3:]) / 2 - curve.p.omega_0
    cubic, parabola = np.polyfit(middles, secants, 3), np.polyfit(middles[:3], secants[:3], 2)
    # What noise of the states does to the secants, and these to the slope: no weight in the cubic exceeds 4.
    solved = 4 * math.sqrt(2) * noise / (f[3] - f[2])
    placed = parabola[-2] * curve.noise
    return Measured(float(cubic[-1] - below), math.hypot(cubic[-1] - parabola[-1], solved, placed))


def _mean(curve: Curve, states: Sequence[Settled]) -> Measured | None:
    """From where slipping sets in, along the line on which the ball comes there, to the last flow."""
    if [each.case for each in states] != [Case.RR, Case.RR, Case.SS]:
        return None
    f, w, noise = _points(curve, states)
    onset = w[1] + (curve.p.omega_0 - f[1]) * (w[1] - w[0]) / (f[1] - f[0])
    rise = f[2] - curve.p.omega_0
    return Measured(float((w[2] - onset) / rise), 3 * math.hypot(noise, curve.noise) / rise)


REDUCTIONS = {"neighbours": _neighbours, "jump": _jump, "mean": _mean}


def _points(curve: Curve, states: Sequence[Settled]) -> tuple[Array, Array, float]:
    """Flows, omega_c and the largest standard uncertainty of an omega_c, rad s-1."""
    values = [each.values["omega_c"] for each in states]
    return np.array(curve.flows), np.array([v.value for v in values]), max(v.uncertainty for v in values)


def hysteresis(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Case and omega_c at every level of the loop, and the case at the level before."""
    loops = {name: _levels(name, records, BETWEEN[lab.level]) for name in sets}
    tasks = {name: _loop(lab, sets[name], levels) for name, levels in loops.items() if levels}
    runs = lab.each(list(tasks.values()))
    for name, levels in loops.items():
        if not levels:
            yield Missing("hysteresis", name, "no flow at which slipping on the floor gives way to riding the wall")
        elif isinstance(run := next(runs), str):
            yield Missing("hysteresis", name, f"the run {run}")
        else:
            yield from _held(lab, name, tasks[name], run, levels, _certainty(name, records))


def _levels(name: str, records: Records, parts: int) -> list[tuple[str, float]]:
    """Flows in rad s-1, up and down: one at which the ball rolls, and those about the changes of case.

    Empty unless a ball from rest slips at one flow and rides the wall at the next.
    """
    floor, wall = (
        {
            m.parameters.omega_0: family(Case(int(m.value)))
            for m in records.select("settled", "case")
            if m.set == name and m.conditions["start"] == start
        }
        for start in ("rest", "on the wall")
    )
    flows = sorted(floor)
    gives_way = [(a, b) for a, b in pairwise(flows) if (floor[a], floor[b]) == (Case.SS, Case.NR)]
    if not gives_way:
        return []
    rolls = [flow for flow in flows if floor[flow] is Case.RR]
    takes_up = [(a, b) for a, b in pairwise(sorted(wall)) if (wall[a], wall[b]) == (Case.NS, Case.NR)]
    levels = set(rolls[-1:])
    for a, b in (*takes_up[:1], gives_way[-1]):
        levels |= {a + (b - a) * k / parts for k in range(parts + 1)}
    rise = sorted(levels)
    return [("up", flow) for flow in rise] + [("down", flow) for flow in rise[-2::-1]]


def _loop(lab: Lab, p: Parameters, levels: Sequence[tuple[str, float]]) -> Task:
    flows = [flow for _, flow in levels]
    q = p.replace(omega_0=flows[0])
    step, hold = coarse_step(p), duration(q, HOLD[lab.level])
    samples = round(hold / (STEPS_A_SAMPLE * step)) * len(flows)
    start, flow = State(omega_c=flows[0]), Flow.staircase(flows, hold)
    return lab.task(q, start, hold * len(flows), step, flow=flow, samples=samples)


def _certainty(name: str, records: Records) -> float:
    """What half the step changes of omega_c, relative to omega_0: the most of all settled states."""
    return max(
        m.uncertainty / m.parameters.omega_0
        for m in records.select("settled", "omega_c")
        if m.set == name and m.parameters.omega_0
    )


def _held(
    lab: Lab, name: str, task: Task, run: Trajectory, levels: Sequence[tuple[str, float]], certainty: float
) -> Iterator[Measurement | Missing]:
    """What the ball settles to at each level."""
    count, before = (len(run.time) - 1) // len(levels), "RR"
    for k, (side, flow) in enumerate(levels):
        samples = slice(k * count, (k + 1) * count)
        p = task.parameters.replace(omega_0=flow)
        part = replace(run, **{column: getattr(run, column)[samples] for column in columns(Trajectory)})
        ended = judged(Start(name, p, side, part.x[0]), task, part)
        if ended.failure:
            where = f"level {k + 1} ({side}, omega_0 = {flow:.4g} rad/s)"
            yield Missing("hysteresis", name, f"{where}: {ended.failure}")
        else:
            omega_c = ended.values["omega_c"]
            sure = Measured(omega_c.value, math.hypot(omega_c.uncertainty, certainty * flow))
            at: dict[str, Condition] = {"case": ended.case.name, "side": side, "level": float(k + 1), "before": before}
            for quantity, value in (("case", ended.case), ("omega_c", sure)):
                yield measurement(lab, "hysteresis", name, p, quantity, value, [task], **at)
        before = family(ended.case).name
