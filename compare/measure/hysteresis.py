"""The hysteresis loop of Fig. 13: the flow rises and falls in held steps, all in one run.

A ramp would overshoot the fold of the slipping branch, where settling slows down without bound. The levels come from
the settled states: where cases were seen to change, and between.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

from compare.measure.lab import Lab, Level, coarse_step
from compare.measure.record import Condition, Measurement, Missing, Records, measurement
from compare.measure.settled import state
from compare.measure.settling import STEPS_A_SAMPLE, Settled, Start, duration, family, judged
from compare.runs.tasks import Task
from compare.statistics import Measured
from model import Case, Flow, Parameters, Trajectory
from model.trajectory import columns

PROTOCOL = "hysteresis"
HOLD = {Level.QUICK: 40.0, Level.DEFAULT: 60.0, Level.FULL: 100.0}
"""How long each level is held, in units of 1/c."""
BETWEEN = {Level.QUICK: 2, Level.DEFAULT: 4, Level.FULL: 8}
"""Into how many parts the gap between two flows is divided in which a case gives way to another."""


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Case and omega_c at every level, and the case at the level before."""
    loops = {name: _loop(name, records, BETWEEN[lab.level]) for name in sets}
    tasks = {name: _task(lab, sets[name], rise) for name, rise in loops.items() if rise}
    failed = {failure.task.key: failure.reason for failure in lab.complete(list(tasks.values()))}
    for name, rise in loops.items():
        if not rise:
            yield Missing(PROTOCOL, name, "no flow at which slipping on the floor gives way to riding the wall")
        elif tasks[name].key in failed:
            yield Missing(PROTOCOL, name, f"the run {failed[tasks[name].key]}")
        else:
            (run,) = lab.run([tasks[name]])
            yield from _levels(lab, name, sets[name], tasks[name], run, _up_and_down(rise), _certainty(name, records))


def _loop(name: str, records: Records, parts: int) -> list[float]:
    """Flows in rad s-1, rising: one at which the ball rolls, and those about the changes of case.

    Empty unless a ball from rest slips at one flow and rides the wall at the next.
    """
    floor, wall = (_seen(name, records, start) for start in ("rest", "on the wall"))
    flows = sorted(floor)
    gives_way = [(a, b) for a, b in pairwise(flows) if (floor[a], floor[b]) == (Case.SS, Case.NR)]
    if not gives_way:
        return []
    rolls = [flow for flow in flows if floor[flow] is Case.RR]
    takes_up = [(a, b) for a, b in pairwise(sorted(wall)) if (wall[a], wall[b]) == (Case.NS, Case.NR)]
    levels = set(rolls[-1:])
    for low, high in (*takes_up[:1], gives_way[-1]):
        levels |= {low + (high - low) * k / parts for k in range(parts + 1)}
    return sorted(levels)


def _seen(name: str, records: Records, start: str) -> dict[float, Case]:
    """Settled cases of a set from one start, by flow."""
    return {
        m.parameters.omega_0: family(Case(int(m.value)))
        for m in records.select("settled", "case")
        if m.set == name and m.conditions["start"] == start
    }


def _up_and_down(rise: Sequence[float]) -> list[tuple[str, float]]:
    return [("up", flow) for flow in rise] + [("down", flow) for flow in rise[-2::-1]]


def _task(lab: Lab, p: Parameters, rise: Sequence[float]) -> Task:
    levels = [flow for _, flow in _up_and_down(rise)]
    step, hold = coarse_step(p), duration(p.replace(omega_0=rise[0]), HOLD[lab.level])
    samples = round(hold / (STEPS_A_SAMPLE * step)) * len(levels)
    start = state(omega_c=rise[0])
    q = p.replace(omega_0=rise[0])
    return lab.task(q, start, hold * len(levels), step, flow=Flow.staircase(levels, hold), samples=samples)


def _certainty(name: str, records: Records) -> float:
    """What half the step changes of omega_c, relative to omega_0: the most of all settled states."""
    return max(
        m.uncertainty / m.parameters.omega_0
        for m in records.select("settled", "omega_c")
        if m.set == name and m.parameters.omega_0
    )


def _levels(
    lab: Lab,
    name: str,
    p: Parameters,
    task: Task,
    run: Trajectory,
    levels: Sequence[tuple[str, float]],
    certainty: float,
) -> Iterator[Measurement | Missing]:
    count, before = (len(run.time) - 1) // len(levels), "RR"
    for k, (side, flow) in enumerate(levels):
        start = Start(name, p.replace(omega_0=flow), side, run.x[k * count])
        ended = judged(start, task, _part(run, slice(k * count, (k + 1) * count)))
        case = family(ended.case).name
        if ended.failure:
            yield Missing(PROTOCOL, name, f"level {k + 1} ({side}, omega_0 = {flow:.4g} rad/s): {ended.failure}")
        else:
            yield from _records(lab, ended, certainty, side=side, level=float(k + 1), before=before)
        before = case


def _records(lab: Lab, ended: Settled, certainty: float, **at: Condition) -> Iterator[Measurement]:
    start, omega_c = ended.start, ended.values["omega_c"]
    sure = Measured(omega_c.value, math.hypot(omega_c.uncertainty, certainty * start.p.omega_0))
    for quantity, value in (("case", ended.case), ("omega_c", sure)):
        case = ended.case.name
        yield measurement(lab, PROTOCOL, start.set, start.p, quantity, value, [ended.task], case=case, **at)


def _part(run: Trajectory, samples: slice) -> Trajectory:
    return replace(run, **{name: getattr(run, name)[samples] for name in columns(Trajectory)})
