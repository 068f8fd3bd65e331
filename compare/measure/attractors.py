"""A swing that lasts although nothing settles, and what strong drag and rough floors do, on sets of their own.

* A ball that swings for ever beside a Hopf point: it slips at both points, and goes round now faster and now slower. It
  is left alone until its turning points repeat.
* Balls in strong drag, followed until drag has had its time: do they go on hopping?
* Floors so rough (mu > 1) that rolling and slipping are both consistent with the forces: rolling on for as long as
  forces allow would lead to a cycle of sticking and slipping that never settles.

Swings are measured with two time steps; the difference is taken for the error of the finer one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np
from scipy.stats import qmc

from compare.measure.field import constrained
from compare.measure.hopping import SAMPLE, finer
from compare.measure.lab import Lab, coarse_step, time_unit
from compare.measure.levels import Level
from compare.measure.record import Measurement, Missing, Records, measurement, state_of
from compare.measure.settling import settle
from compare.measure.trials import Start
from compare.statistics import peaks, top
from model import Case, Parameters, State, Trajectory

VERY_ROUGH = {"mu": 2.5, "eta": 0.38, "c": 1.0, "omega_0": 24.648}
"""A floor on which a ball swings, in SI."""
SWINGING = State(omega_c=22.39, slip_x=-0.03, slip_z=0.26)
SWINGS, SWUNG = 24.0, 4.0
"""Duration, and the last part of it in which the swing is measured, s."""
SWING_REFINED = 60, 80
"""Steps in one of `coarse_step`: with coarser or finer ones the contact of the floor, on which there is a hundredth of
the weight, comes and goes."""

SEED, SETS, STARTS = 5, 16, 3
LOW = {"mu": 0.05, "eta": 0.05, "j": 0.2, "kappa": 2.0, "Omega_0": 0.5}
HIGH = {"mu": 1.0, "eta": 1.0, "j": 0.6, "kappa": 8.0, "Omega_0": 6.0}
"""The box that the sets with strong drag fill evenly; the rest is as in the reference."""
CALMED = 60.0
"""Duration in units of 1/c of the weakest drag."""
HIGH_ENOUGH = 1e-3
"""Height over R that a hop must have to be one."""

ROUGH = {
    "rough-floor-1": (1.7222, 0.0388, 0.482, 0.292, 0.1099, 2.635),
    "rough-floor-2": (1.2277, 0.1721, 0.611, 0.154, 0.1198, 2.099),
}
"""mu, eta, j, r/R, kappa, omega_0 sqrt(R/g). The second is left to the higher levels: its contacts hover for long."""


def swing(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Period, mean and size of the swing of omega_c."""
    p, end = sets["reference"].replace(**VERY_ROUGH), SWINGS - SWUNG
    steps = [coarse_step(p) / refined for refined in SWING_REFINED]
    # Some 160 samples in a swing.
    tasks = [lab.task(p, SWINGING, SWINGS, step, samples=round(SWINGS / (2 * SAMPLE))) for step in steps]
    runs = lab.attempt(tasks)
    if isinstance(runs, str):
        yield Missing("swing", "reference", f"the run {runs}")
    elif any(np.any(run.case[run.time > end] != Case.SS) for run in runs):
        yield Missing("swing", "reference", "the ball does not slip at both points for ever")
    else:
        coarse, fine, before = (_swung(runs[n], since) for n, since in ((0, end), (1, end), (1, end - SWUNG)))
        conditions = {**state_of(constrained(Case.SS, runs[1].x[-1], p)), "period": fine["swing_period"]}
        for name, value in fine.items():
            sure = finer(coarse[name], value, before[name])
            yield measurement(lab, "swing", "reference", p, name, sure, tasks, **conditions)


def _swung(run: Trajectory, start: float) -> dict[str, float]:
    """From the turning points of omega_c in `SWUNG` s after a time."""
    inside = (run.time > start) & (run.time <= start + SWUNG)
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


def calm(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Whether each ball still hops at the end: 1 or 0."""
    reference, rng, name = sets["reference"], np.random.default_rng(SEED), "strong drag"
    points = qmc.scale(qmc.Sobol(len(LOW), rng=SEED).random(SETS), list(LOW.values()), list(HIGH.values()))
    unit, tasks = time_unit(reference), []
    for mu, eta, j, kappa, Omega_0 in points.tolist():
        p = reference.replace(mu=mu, eta=eta, j=j, c=kappa / unit, omega_0=Omega_0 / unit)
        for _ in range(STARTS):
            slips = p.omega_0 * p.R / p.r * rng.uniform(-2, 2, 3)
            x = State(rng.uniform(0, p.R), 0.0, p.omega_0 * rng.uniform(-0.5, 2), *slips)
            tasks.append(lab.task(p, x, CALMED * unit / LOW["kappa"], coarse_step(p) / 4, samples=2000))
    for task, run in zip(tasks, lab.each(tasks), strict=True):
        if isinstance(run, str):
            yield Missing("calm", name, f"a run {run}")
        else:
            at = state_of(State.of(task.x0).stacked())
            yield measurement(lab, "calm", name, task.parameters, "hops", hops(run), [task], **at, duration=task.t_end)


def hops(run: Trajectory) -> float:
    """1 if in the last third of a run the ball has been in the air and has come down again, else 0."""
    late = run.y[2 * len(run.y) // 3 :]
    top = int(np.argmax(late))
    up, down = late[top] - late[: top + 1].min(), late[top] - late[top:].min()
    return float(min(up, down) > HIGH_ENOUGH * run.header.parameters.R)


def choice(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Case and omega_c of what a ball settles to from rest, in a flow above omega_01."""
    reference, starts = sets["reference"], []
    unit = math.sqrt(reference.g / reference.R)
    for name, (mu, eta, j, ratio, kappa, Omega_0) in list(ROUGH.items())[: 1 if lab.level is Level.QUICK else None]:
        p = reference.replace(mu=mu, eta=eta, j=j, r=ratio * reference.R, c=kappa * unit, omega_0=Omega_0 * unit)
        starts.append(Start(name, p, "rest", np.zeros(8)))
    for start, settled in zip(starts, settle(lab, starts), strict=True):
        if settled.failure:
            yield Missing("choice", start.set, settled.failure)
            continue
        for quantity, value in (("case", settled.case), ("omega_c", settled.values["omega_c"])):
            yield measurement(lab, "choice", start.set, start.p, quantity, value, [settled.task])
