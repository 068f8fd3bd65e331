"""Motions that recur: a ball that hops for ever, followed through flows that become slower until it hardly hops.

It starts near its hop; then the flow is lowered in held steps. At each of them the tops of the hops say period, height
and orbit; how the heights settle after a step says by what factor a disturbance shrinks from hop to hop; and the flow
at which the height would be zero is extrapolated. Every number is measured with two time steps: an engine
may locate a landing to a time step only, and the difference is then the error of the finer one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from compare.measure.field import constrained
from compare.measure.lab import Lab, Level, coarse_step, time_unit
from compare.measure.record import Measurement, Missing, Records, measurement, state_of, sure_enough
from compare.runs.tasks import Task
from compare.statistics import Measured, peaks, top
from model import Case, Flow, Parameters, Trajectory
from model.arrays import Array

NAME = "recurrent"
SET = "hopping"
"""The parameter set; it is measured whenever the `reference` is."""
START = (6.4e-3, 0.0, 57.3, -106.0, 0.0, 0.0)
"""Near the top of a hop."""
FLOWS = {
    Level.QUICK: (1.0,),
    Level.DEFAULT: (1.0, 0.95, 0.91, 0.87, 0.83, 0.80),
    Level.FULL: (1.0, 0.97, 0.94, 0.91, 0.88, 0.85, 0.82, 0.80),
}
"""Flows of the staircase in units of that of the set."""
HOLD, MEASURED, LATER = 12.0, 3.0, 2.0
"""How long each is held, the last part of it in which the motion is measured, and the first in which disturbances are
too large to be linear, s."""
REFINED = 8, 16
"""Steps in one of `coarse_step`."""
SAMPLE = 1e-3
"""Sample interval, s: a parabola through three samples then gives a top to 1e-6 of the height."""


class Hops(NamedTuple):
    """The tops of the hops in part of a run, (n,) each."""

    time: Array
    height: Array
    theta: Array
    x: Array
    """States there, (n, 8)."""

    @property
    def values(self) -> dict[str, float]:
        """Period, mean angular velocity and height."""
        span, rounds = self.time[-1] - self.time[0], len(self.time) - 1
        return {
            "orbit_period": float(span / rounds),
            "orbit_omega_c": float((self.theta[-1] - self.theta[0]) / span),
            "orbit_height": float(self.height.mean()),
        }

    @property
    def spread(self) -> dict[str, float]:
        """Half the range that each value has over single hops.

        Disturbances swing while they die out, so that means of parts may agree by chance.
        """
        periods = np.diff(self.time)
        single = {
            "orbit_period": periods,
            "orbit_omega_c": np.diff(self.theta) / periods,
            "orbit_height": self.height,
        }
        return {name: float(np.ptp(values)) / 2 for name, values in single.items()}


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Period, orbit, height and the shrinking of disturbances at each flow, and where hopping would begin."""
    if "reference" not in sets:
        yield Missing(NAME, next(iter(sets), ""), f"hops that last are those of the set {SET}")
        return
    p = Parameters.named(SET)
    tasks = [_task(lab, p, refined) for refined in REFINED]
    for failure in lab.complete(tasks):
        yield Missing(NAME, SET, f"the run {failure.reason}")
        return
    runs, births = lab.run(tasks), []
    for k, share in enumerate(FLOWS[lab.level]):
        q = p.replace(omega_0=share * p.omega_0)
        last = [tops(run, (k + 1) * HOLD - MEASURED, (k + 1) * HOLD) for run in runs]
        if any(len(each.time) < 6 for each in last):
            yield Missing(NAME, SET, f"at omega_0 = {q.omega_0:.4g} rad/s the ball does not hop any more")
            break
        births.append((q.omega_0, *(each.values["orbit_height"] for each in last)))
        conditions = {**state_of(constrained(Case.NR, last[1].x[-1], q)), "period": last[1].values["orbit_period"]}
        for name, value in last[1].values.items():
            error = math.hypot(value - last[0].values[name], last[1].spread[name])
            yield measurement(lab, NAME, SET, q, name, Measured(value, error), tasks, **conditions)
        if k:
            parts = (runs[0], LATER), (runs[1], LATER), (runs[1], 2 * LATER)
            coarse, fine, later = (
                shrinking(tops(run, k * HOLD + since, (k + 1) * HOLD - MEASURED).x, q) for run, since in parts
            )
            factor = Measured(fine, math.hypot(fine - coarse, fine - later))
            if sure_enough("orbit_multiplier", factor, 1.0):
                yield measurement(lab, NAME, SET, q, "orbit_multiplier", factor, tasks, **conditions)
            else:
                yield Missing(NAME, SET, f"how disturbances shrink at omega_0 = {q.omega_0:.4g} rad/s is too uncertain")
    if len(births) >= 3:
        yield measurement(lab, NAME, SET, p, "orbit_birth", birth(births[-3:]), tasks)


def _task(lab: Lab, p: Parameters, refined: int) -> Task:
    flows = [share * p.omega_0 for share in FLOWS[lab.level]]
    flow, lasts = Flow.staircase(flows, HOLD), HOLD * len(flows)
    return lab.task(p, START, lasts, coarse_step(p) / refined, flow=flow, samples=round(lasts / SAMPLE))


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
    return Hops(t[k] + by, states[:, 0], run.theta[k] + by * run.omega_c[k], states)


def shrinking(states: Array, p: Parameters) -> float:
    """Factor by which disturbances shrink from one hop to the next, from states (n, 8) at tops that settle.

    What changes from hop to hop obeys a linear map of height, omega_c and slip_x; its eigenvalue of largest modulus.
    """
    unit, speed = time_unit(p), math.sqrt(p.g * p.R)
    changes = np.diff(states[:, [0, 2, 3]] / np.array([p.R, 1 / unit, speed / p.r]), axis=0)
    weight = 1 / np.linalg.norm(changes[:-1], axis=1, keepdims=True)
    matrix = np.linalg.lstsq(weight * changes[:-1], weight * changes[1:])[0]
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def birth(rows: Sequence[tuple[float, ...]]) -> Measured:
    """Flow at which the height would be zero: parabolas through flows and heights, of the coarse and the fine step."""
    flows, *heights = np.array(rows).T
    coarse, fine = (float(np.polyfit(each, flows, 2)[-1]) for each in heights)
    straight = float(np.polyfit(heights[1][-2:], flows[-2:], 1)[-1])
    return Measured(fine, math.hypot(fine - coarse, fine - straight))
