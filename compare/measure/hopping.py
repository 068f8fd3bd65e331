"""A ball that hops for ever: its hop, through flows that become slower, and along walls that become rougher.

* It starts near its hop; then the flow is lowered in held steps. At each the tops of the hops say period, height and
  orbit; how the heights settle says by what factor a disturbance shrinks from hop to hop; and the flow at which the
  height would be zero is extrapolated. At the flow of the set alone Moreau-Jean time stepping shows its hop, too.
* The hop is followed along rougher and rougher walls, to where disturbances grow: from tops that settle, or leave, the
  top of the steady hop is computed, and from two of them the start at the next wall is extrapolated. On both sides of
  the wall at which disturbances neither grow nor shrink, a ball is left alone: does it hop on?

Hops are measured with two time steps: an engine may locate a landing to a step only, and the difference is then the
error of the finer one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from compare.measure.field import constrained
from compare.measure.lab import Lab, coarse_step, time_unit
from compare.measure.levels import Level
from compare.measure.record import Measurement, Missing, Records, if_sure, measurement, state_of
from compare.runs.tasks import Task
from compare.statistics import Measured, peaks, top
from model import Case, Flow, Parameters, State, Trajectory
from model.arrays import Array

SET = "hopping"
TOP = State(y=6.4e-3, omega_c=57.3, slip_x=-106.0)
"""A state near the top of a hop of the set."""
FLOWS = {
    Level.QUICK: (1.0,),
    Level.DEFAULT: (1.0, 0.95, 0.91, 0.87, 0.83, 0.80),
    Level.FULL: (1.0, 0.97, 0.94, 0.91, 0.88, 0.85, 0.82, 0.80),
}
"""Flows of the staircase in units of that of the set."""
HOLD, LAST, LATER = 12.0, 3.0, 2.0
"""How long each is held, the last part of it in which the motion is measured, and the first in which disturbances are
too large to be linear, s."""
REFINED, STEPPED = (8, 16), (40, 80)
"""Steps in one of `coarse_step`, of the engine and of time stepping, which lets slip begin and turn at steps only."""
SAMPLE = 1e-3
"""Sample interval, s: a parabola through three samples then gives a top to 1e-6 of the height."""
WALLS = (1.0, 1.005, 1.015, 1.03, 1.06, 1.1, 1.14, 1.18, 1.22, 1.26, 1.3, 1.34)
"""Friction of the walls along which the hop is followed, in units of that of the set; few balls come to a hop that
start beside it, so that the first steps, with less to extrapolate from, are short."""
NEAR = 4
"""The last walls, among which disturbances come to grow."""
FOLLOWED, ALONE = 10.0, 60.0
"""How long the ball hops at each wall, and how long it is left alone, s."""


class Hops(NamedTuple):
    """The tops of the hops in part of a run: times and angles (n,), and states (n, 8)."""

    time: Array
    theta: Array
    x: Array

    @property
    def values(self) -> dict[str, Measured]:
        """Period, mean angular velocity and height, uncertain by half the range over single hops.

        Disturbances swing while they die out, so that means of parts may agree by chance.
        """
        span, periods, height = self.time[-1] - self.time[0], np.diff(self.time), self.x[:, 0]
        values = {
            "orbit_period": (span / len(periods), periods),
            "orbit_omega_c": ((self.theta[-1] - self.theta[0]) / span, np.diff(self.theta) / periods),
            "orbit_height": (height.mean(), height),
        }
        return {name: Measured(float(mean), float(np.ptp(hops)) / 2) for name, (mean, hops) in values.items()}

    def conditions(self, p: Parameters) -> dict[str, float]:
        """A state at a top, and the period: near a closed orbit."""
        return {**state_of(constrained(Case.NR, self.x[-1], p)), "period": self.values["orbit_period"].value}


def hopping(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Period, orbit, height and the shrinking of disturbances at each flow, and where hopping would begin."""
    yield from _staircase(lab, "recurrent", FLOWS[lab.level], REFINED)


def stepped(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Period, orbit and height at the flow of the set."""
    yield from _staircase(lab, "stepped", (1.0,), STEPPED)


def _staircase(
    lab: Lab, protocol: str, shares: Sequence[float], refinements: Sequence[int]
) -> Iterator[Measurement | Missing]:
    p = Parameters.named(SET)
    flows = [share * p.omega_0 for share in shares]
    flow, lasts = Flow.staircase(flows, HOLD), HOLD * len(flows)
    tasks = [_task(lab, p, TOP, lasts, refined, flow) for refined in refinements]
    runs, births = lab.attempt(tasks), []
    if isinstance(runs, str):
        yield Missing(protocol, SET, f"the run {runs}")
        return
    for k, omega_0 in enumerate(flows):
        q, end = p.replace(omega_0=omega_0), (k + 1) * HOLD
        last = [tops(run, end - LAST, end) for run in runs]
        at = f"at omega_0 = {omega_0:.4g} rad/s"
        if any(len(each.time) < 6 for each in last):
            yield Missing(protocol, SET, f"{at} the ball does not hop any more")
            break
        coarse, fine = (each.values for each in last)
        births.append((omega_0, coarse["orbit_height"].value, fine["orbit_height"].value))
        conditions = last[1].conditions(q)
        for quantity, value in fine.items():
            error = math.hypot(value.value - coarse[quantity].value, value.uncertainty)
            yield measurement(lab, protocol, SET, q, quantity, Measured(value.value, error), tasks, **conditions)
        if k:
            parts = (runs[0], LATER), (runs[1], LATER), (runs[1], 2 * LATER)
            factor = finer(*(shrinking(tops(run, k * HOLD + after, end - LAST).x, q) for run, after in parts))
            row = measurement(lab, protocol, SET, q, "orbit_multiplier", factor, tasks, **conditions)
            yield if_sure(row, 1.0, f"how disturbances shrink {at} is too uncertain")
    if len(births) >= 3:
        yield measurement(lab, protocol, SET, p, "orbit_birth", birth(births[-3:]), tasks)


def _task(lab: Lab, p: Parameters, x: Sequence[float], lasts: float, refined: int, flow: Flow | None = None) -> Task:
    return lab.task(p, x, lasts, coarse_step(p) / refined, flow=flow, samples=round(lasts / SAMPLE))


def finer(coarse: float, fine: float, other: float) -> Measured:
    """What the finer step shows, uncertain by what the step changes, and another part of the run."""
    return Measured(fine, math.hypot(fine - coarse, fine - other))


def tops(run: Trajectory, start: float, end: float) -> Hops:
    """The tops of the hops between two times; a ball that stays within a tenth of the highest has none."""
    t, y = run.time, run.y
    k, late = peaks(y)
    inside = (t[k] > start) & (t[k] < end)
    high = inside & (y[k] > y[k][inside].max(initial=0.0) / 2)
    k, late = k[high], late[high]
    x, by = run.x, late * (t[1] - t[0])
    states = x[k] + late[:, None] * (x[k + 1] - x[k - 1]) / 2
    states[:, 0], states[:, 1] = top(y, k, late), 0.0
    return Hops(t[k] + by, run.theta[k] + by * run.omega_c[k], states)


def hop_map(states: Array, p: Parameters) -> tuple[float, State]:
    """What states (n, 8) at tops say of the map from hop to hop, linear in height, omega_c and slip_x.

    The modulus of its largest eigenvalue, the factor by which disturbances grow or shrink; and its fixed point.
    """
    units = np.array([p.R, 1 / time_unit(p), math.sqrt(p.g * p.R) / p.r])
    z = states[:, [0, 2, 3]] / units
    changes = np.diff(z, axis=0)
    weight = 1 / np.linalg.norm(changes[:-1], axis=1, keepdims=True)
    matrix = np.linalg.lstsq(weight * changes[:-1], weight * changes[1:])[0]
    shift = z[1:].mean(axis=0) - z[:-1].mean(axis=0) @ matrix
    y, omega_c, slip_x = (units * np.linalg.solve(np.eye(3) - matrix.T, shift)).tolist()
    return float(np.abs(np.linalg.eigvals(matrix)).max()), State(y=y, omega_c=omega_c, slip_x=slip_x)


def shrinking(states: Array, p: Parameters) -> float:
    """Factor by which disturbances shrink from one hop to the next, from states (n, 8) at tops that settle."""
    return hop_map(states, p)[0]


def birth(rows: Sequence[tuple[float, ...]]) -> Measured:
    """Flow at which the height would be zero: parabolas through flows and heights, of the coarse and the fine step."""
    flows, *heights = np.array(rows).T
    coarse, fine = (float(np.polyfit(each, flows, 2)[-1]) for each in heights)
    return finer(coarse, fine, float(np.polyfit(heights[1][-2:], flows[-2:], 1)[-1]))


def followed(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """The wall beyond which disturbances of the hop grow, and whether balls hop on, on both sides of it."""
    p = Parameters.named(SET)
    walls = [p.replace(eta=share * p.eta) for share in WALLS]
    steady: tuple[list[State], list[State]] = [], []
    factors, hops, starts, tasks = [], [], [], []
    for k, q in enumerate(walls):
        starts.append([_ahead(walls[:k], known, q) for known in steady])
        pair = [_task(lab, q, x, FOLLOWED, refined) for x, refined in zip(starts[k], REFINED, strict=True)]
        runs = lab.attempt(pair)
        parts = [] if isinstance(runs, str) else [tops(run, LATER, FOLLOWED) for run in runs]
        if isinstance(runs, str) or any(len(each.time) < 8 for each in parts):
            why = f"the run {runs}" if isinstance(runs, str) else "the ball does not hop"
            yield Missing("followed", SET, f"at eta = {q.eta:.4g} {why}")
            return
        maps = [hop_map(each.x, q) for each in (*parts, tops(runs[1], 2 * LATER, FOLLOWED))]
        for known, (_, state) in zip(steady, maps[:2], strict=True):
            known.append(state)
        factors.append([factor for factor, _ in maps])
        hops.append(parts[1])
        tasks.append(pair)
    rows = death([(q.eta, *each) for q, each in zip(walls, factors, strict=True)][-NEAR:])
    used = [task for pair in tasks[-NEAR:] for task in pair]
    conditions = hops[-NEAR].conditions(walls[-NEAR])
    yield measurement(lab, "followed", SET, walls[-NEAR], "orbit_death", rows, used, **conditions)
    alone = [_task(lab, walls[k], starts[k][1], ALONE, REFINED[0]) for k in (-NEAR, -1)]
    for task, run in zip(alone, lab.each(alone), strict=True):
        if isinstance(run, str):
            yield Missing("followed", SET, f"a run {run}")
        else:
            at = state_of(State.of(task.x0).stacked())
            yield measurement(lab, "followed", SET, task.parameters, "hops", lands(run), [task], **at, duration=ALONE)


def _ahead(walls: Sequence[Parameters], steady: Sequence[State], q: Parameters) -> State:
    """Where to start at the next wall, by the line through the last two steady tops."""
    if len(steady) < 2:
        return steady[0] if steady else TOP
    share = (q.eta - walls[-2].eta) / (walls[-1].eta - walls[-2].eta)
    return State(*(a + share * (b - a) for a, b in zip(*steady[-2:], strict=True)))


def death(rows: Sequence[tuple[float, ...]]) -> Measured:
    """The wall at which disturbances neither grow nor shrink: lines through eta and factors, by `finer`."""
    etas, *factors = np.array(rows).T
    return finer(*(float(np.polyfit(each - 1, etas, 1)[-1]) for each in factors))


def lands(run: Trajectory) -> float:
    """1 if the ball comes down to the floor in the last third of a run, to a tenth of where it is highest; else 0."""
    late = run.y[2 * len(run.y) // 3 :]
    return float(late.min() < late.max() / 10)
