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
from itertools import pairwise

import numpy as np

from compare.kit.lab import Lab, coarse_step
from compare.kit.record import Condition, Measurement, Missing, Records, if_sure, measurement
from compare.kit.settling import STEPS_A_SAMPLE, Settled, duration, family, high, judged, settle_groups, settled_cases
from compare.kit.statistics import Measured
from compare.kit.tasks import Task
from compare.kit.trials import Start
from model import Case, Flow, Parameters, State, Trajectory
from model.trajectory import columns

STEP = 1e-3
"""Relative distance of neighbouring flows; half of it shows what the curvature does."""
ACROSS = (-1e-3, -5e-4, 5e-4, 1e-3, 2e-3, 4e-3, 8e-3)
"""Distances from the flow at which slipping sets in, relative to it."""
SHARP = {"neighbours": 0.3, "jump": 0.1, "mean": 1.0}
"""Drift limit down to which a state goes on, relative to that of settled states, by what is measured: for the jump the
states lie close together."""


@dataclass(frozen=True)
class Curve:
    """Flows of settled states that are joined to a slope."""

    by: str
    set: str
    p: Parameters
    """With the flow at which the slope is wanted."""
    flows: tuple[float, ...]
    x0: tuple[float, ...] = (0.0,) * 8
    noise: float = 0.0
    """Standard uncertainty of the flow at which slipping sets in, and of others measured so, rad s-1."""


def slope(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Slopes at the settled states, the jump where slipping sets in, and the mean slope from there to unloading."""
    most = lab.effort("slope.slipping")
    curves = [c for name, p in sets.items() for c in (*_local(name, records, most), *_wide(name, p, records))]
    for by, sharp in SHARP.items():
        own = [curve for curve in curves if curve.by == by]
        starts = [[Start(c.set, c.p.replace(omega_0=w), by, np.array(c.x0)) for w in c.flows] for c in own]
        for curve, states in zip(own, settle_groups(lab, starts, span=24.0, sharp=sharp), strict=True):
            where = f"{by} at omega_0 = {curve.p.omega_0:.4g} rad/s"
            if failure := next((each.failure for each in states if each.failure), ""):
                yield Missing("slope", curve.set, f"{where}: {failure}")
            elif value := _slope(curve, states):
                tasks, at = [each.task for each in states], {"case": states[-1].case.name, "by": by}
                row = measurement(lab, "slope", curve.set, curve.p, "slope", value, tasks, **at)
                why = f"{where}: the slope is uncertain by {value.uncertainty:.1g}, too much to be of use"
                yield if_sure(row, 1.0, why)
            else:
                cases = ", ".join(each.case.name for each in states)
                yield Missing("slope", curve.set, f"{where}: the states there are not of one kind ({cases})")


def _local(name: str, records: Records, most: int) -> Iterator[Curve]:
    """Settled states that slip on the floor, at most so many; of the others, that of the fastest flow."""
    states: dict[Case, dict[float, dict[str, Measurement]]] = {case: {} for case in Case}
    for m in records.select("settled", where=lambda m: m.set == name and m.quantity != "case"):
        if m.parameters.omega_0:
            at = states[family(Case[str(m.conditions["case"])])].setdefault(m.parameters.omega_0, {})
            at[m.quantity] = m
    for case in (Case.RR, Case.SS, Case.NR):
        alike = sorted(states[case].items())
        few = np.linspace(0, len(alike) - 1, most).round() if case is Case.SS else [len(alike) - 1]
        for k in sorted({int(n) for n in few if alike}):
            omega_0, values = alike[k]
            p, moving = values["omega_c"].parameters, ("v_y", "omega_c", "slip_x", "slip_y", "slip_z")
            x0 = (high(p) * (case is Case.NR), *(values[q].value for q in moving), 0.0, 0.0)
            flows = tuple(omega_0 * (1 + d) for d in (-STEP, -STEP / 2, STEP / 2, STEP))
            yield Curve("neighbours", name, p, flows, x0)


def _wide(name: str, p: Parameters, records: Records) -> Iterator[Curve]:
    """Across the onset of slipping, and from there to the flow at which the wall begins to carry the ball."""
    slips, holds = records.threshold(name, "omega_01"), records.threshold(name, "omega_02")
    if slips is not None:
        q, x0 = p.replace(omega_0=slips.value), (0.0, 0.0, slips.value, 0.0, 0.0, 0.0, 0.0, 0.0)
        around = tuple(slips.value * (1 + d) for d in ACROSS)
        yield Curve("jump", name, q, around, x0, slips.uncertainty)
        if holds is not None and holds.value > slips.value:
            noise = math.hypot(slips.uncertainty, holds.uncertainty)
            yield Curve("mean", name, q, (*around[:2], holds.value), noise=noise)


def _slope(curve: Curve, states: Sequence[Settled]) -> Measured | None:
    """The slope of a curve, from its settled states; None where these are not of the cases that belong.

    Between neighbours: central differences over two distances, without the error that goes with the distance squared.
    The jump: slope above less slope below, each at the threshold itself, above by a cubic through four secants. The
    mean: from where slipping sets in, on the line on which the ball comes there, to the last flow.
    """
    cases = [each.case for each in states]
    f, onset = np.array(curve.flows), curve.p.omega_0
    w, noises = np.transpose([(v.value, v.uncertainty) for v in (each.values["omega_c"] for each in states)])
    noise, below = float(noises.max()), (w[1] - w[0]) / (f[1] - f[0])
    if curve.by == "neighbours" and len(set(map(family, cases))) == 1:
        wide, near = (w[3] - w[0]) / (f[3] - f[0]), (w[2] - w[1]) / (f[2] - f[1])
        return Measured(near + (near - wide) / 3, math.hypot((near - wide) / 3, 2 * noise / (f[2] - f[1])))
    if curve.by == "jump" and cases[1:3] == [Case.RR, Case.SS]:
        secants, middles = np.diff(w[2:]) / np.diff(f[2:]), (f[2:-1] + f[3:]) / 2 - onset
        cubic, parabola = np.polyfit(middles, secants, 3), np.polyfit(middles[:3], secants[:3], 2)
        # What noise of the states does to the secants, and these to the slope: no weight in the cubic exceeds 4.
        solved = 4 * math.sqrt(2) * noise / (f[3] - f[2])
        placed = parabola[-2] * curve.noise
        return Measured(float(cubic[-1] - below), math.hypot(cubic[-1] - parabola[-1], solved, placed))
    if curve.by == "mean" and cases == [Case.RR, Case.RR, Case.SS]:
        first, rise = w[1] + (onset - f[1]) * (w[1] - w[0]) / (f[1] - f[0]), f[2] - onset
        return Measured(float((w[2] - first) / rise), 3 * math.hypot(noise, curve.noise) / rise)
    return None


def hysteresis(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Case and omega_c at every level of the loop, and the case at the level before."""
    loops, tasks = {}, []
    for name, p in sets.items():
        if rise := _levels(name, records, lab.effort("hysteresis.parts")):
            loops[name] = [("up", flow) for flow in rise] + [("down", flow) for flow in rise[-2::-1]]
            flows = [flow for _, flow in loops[name]]
            hold = duration(p.replace(omega_0=flows[0]), lab.effort("hysteresis.hold"))
            samples = round(hold / (STEPS_A_SAMPLE * coarse_step(p))) * len(flows)
            q, start, flow = p.replace(omega_0=flows[0]), State(omega_c=flows[0]), Flow.staircase(flows, hold)
            tasks.append(lab.task(q, start, hold * len(flows), coarse_step(p), flow=flow, samples=samples))
    runs = zip(tasks, lab.each(tasks), strict=True)
    for name in sets:
        if name not in loops:
            yield Missing("hysteresis", name, "no flow at which slipping on the floor gives way to riding the wall")
            continue
        task, run = next(runs)
        if isinstance(run, str):
            yield Missing("hysteresis", name, f"the run {run}")
        else:
            yield from _held(lab, name, task, run, loops[name], records)


def _levels(name: str, records: Records, parts: int) -> list[float]:
    """Rising flows in rad s-1: one at which the ball rolls, and those about the changes of case.

    Empty unless a ball from rest slips at one flow and rides the wall at the next.
    """
    floor, wall = (settled_cases(records, name, how) for how in ("rest", "on the wall"))
    gives_way = [(a, b) for a, b in pairwise(floor) if (floor[a], floor[b]) == (Case.SS, Case.NR)]
    if not gives_way:
        return []
    takes_up = [(a, b) for a, b in pairwise(wall) if (wall[a], wall[b]) == (Case.NS, Case.NR)]
    levels = set([flow for flow in floor if floor[flow] is Case.RR][-1:])
    for a, b in (*takes_up[:1], gives_way[-1]):
        levels |= {a + (b - a) * k / parts for k in range(parts + 1)}
    return sorted(levels)


def _held(
    lab: Lab, name: str, task: Task, run: Trajectory, levels: Sequence[tuple[str, float]], records: Records
) -> Iterator[Measurement | Missing]:
    """What the ball settles to at each level."""
    # What half the step changes of omega_c, relative to omega_0: the most of all settled states.
    settled = records.select("settled", "omega_c", lambda m: m.set == name and m.parameters.omega_0 > 0)
    certainty = max(m.uncertainty / m.parameters.omega_0 for m in settled)
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
