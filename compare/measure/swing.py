"""A ball that swings for ever beside a Hopf point: it slips at both points, and goes round now faster and now slower.

It starts near the motion and is left alone until its turning points repeat. It is measured with two time
steps; what they and the time of waiting change is its uncertainty.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from compare.measure.field import constrained
from compare.measure.lab import Lab, coarse_step
from compare.measure.record import Measurement, Missing, Records, measurement, state_of
from compare.statistics import Measured, peaks, top
from model import Case, Parameters, State, Trajectory

NAME = "swing"
SET = "reference"
ROUGH = {"mu": 2.5, "eta": 0.38, "c": 1.0, "omega_0": 24.648}
"""A very rough floor, in SI."""
START = State(omega_c=22.39, slip_x=-0.03, slip_z=0.26)
LASTS, MEASURED = 24.0, 4.0
"""Duration, and the last part of it in which the swing is measured, s."""
REFINED = 60, 80
"""Steps in one of `coarse_step`: with coarser or finer ones the contact of the floor, on which there is a hundredth of
the weight, comes and goes."""
SAMPLE = 2e-3
"""Sample interval, s: some 160 in a swing."""


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Period, mean and size of the swing of omega_c."""
    if SET not in sets:
        yield Missing(NAME, next(iter(sets), ""), f"swings that last are those of {SET} on a very rough floor")
        return
    p = sets[SET].replace(**ROUGH)
    steps = [coarse_step(p) / refined for refined in REFINED]
    tasks = [lab.task(p, START, LASTS, step, samples=round(LASTS / SAMPLE)) for step in steps]
    for failure in lab.complete(tasks):
        yield Missing(NAME, SET, f"the run {failure.reason}")
        return
    runs = lab.run(tasks)
    if any(np.any(run.case[run.time > LASTS - MEASURED] != Case.SS) for run in runs):
        yield Missing(NAME, SET, "the ball does not slip at both points for ever")
        return
    coarse, fine = (_values(run, LASTS - MEASURED) for run in runs)
    before = _values(runs[1], LASTS - 2 * MEASURED)
    conditions = {**state_of(constrained(Case.SS, runs[1].x[-1], p)), "period": fine["swing_period"]}
    for name, value in fine.items():
        sure = Measured(value, math.hypot(value - coarse[name], value - before[name]))
        yield measurement(lab, NAME, SET, p, name, sure, tasks, **conditions)


def _values(run: Trajectory, start: float) -> dict[str, float]:
    """From the turning points of omega_c in `MEASURED` s after a time."""
    inside = (run.time > start) & (run.time <= start + MEASURED)
    time, omega_c = run.time[inside], run.omega_c[inside]
    (k, late), (low, lower) = peaks(omega_c), peaks(-omega_c)
    at = time[k] + late * (time[1] - time[0])
    size = np.mean(top(omega_c, k, late)) - np.mean(top(omega_c, low, lower))
    theta = np.interp(at[[0, -1]], run.time, run.theta)
    return {
        "swing_period": float((at[-1] - at[0]) / (len(at) - 1)),
        "swing_omega_c": float((theta[1] - theta[0]) / (at[-1] - at[0])),
        "swing_size": float(size),
    }
