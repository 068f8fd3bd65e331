"""Does a ball go on hopping in strong drag? Many sets and starts, each followed until drag has had its time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from scipy.stats import qmc

from compare.measure.lab import Lab, coarse_step, time_unit
from compare.measure.record import Measurement, Missing, Records, measurement, state_of
from compare.runs.tasks import Task
from model import Parameters, State, Trajectory

NAME = "calm"
SEED = 5
SETS, STARTS = 16, 3
LOW = {"mu": 0.05, "eta": 0.05, "j": 0.2, "kappa": 2.0, "Omega_0": 0.5}
HIGH = {"mu": 1.0, "eta": 1.0, "j": 0.6, "kappa": 8.0, "Omega_0": 6.0}
"""The box that the sets fill evenly; the rest is as in the reference."""
LASTS = 60.0
"""Duration in units of 1/c of the weakest drag."""
REFINED = 4
"""Steps in one of `coarse_step`."""
HIGH_ENOUGH = 1e-3
"""Height over R that a hop must have to be one."""


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Whether each ball still hops at the end: 1 or 0."""
    if "reference" not in sets:
        yield Missing(NAME, next(iter(sets), ""), "strong drag is tried on sets of its own")
        return
    tasks = list(_tasks(lab, sets["reference"]))
    failed = {failure.task.key: failure.reason for failure in lab.complete(tasks)}
    for task in tasks:
        if task.key in failed:
            yield Missing(NAME, "strong drag", f"a run {failed[task.key]}")
            continue
        (run,) = lab.run([task])
        at = state_of(State.of(task.x0).stacked())
        yield measurement(
            lab, NAME, "strong drag", task.parameters, "hops", hops(run), [task], **at, duration=task.t_end
        )


def _tasks(lab: Lab, reference: Parameters) -> Iterator[Task]:
    rng, unit = np.random.default_rng(SEED), time_unit(reference)
    points = qmc.scale(qmc.Sobol(len(LOW), rng=SEED).random(SETS), list(LOW.values()), list(HIGH.values()))
    for mu, eta, j, kappa, Omega_0 in points.tolist():
        p = reference.replace(mu=mu, eta=eta, j=j, c=kappa / unit, omega_0=Omega_0 / unit)
        for _ in range(STARTS):
            slips = p.omega_0 * p.R / p.r * rng.uniform(-2, 2, 3)
            x = State(rng.uniform(0, p.R), 0.0, p.omega_0 * rng.uniform(-0.5, 2), *slips)
            yield lab.task(p, x, LASTS * unit / LOW["kappa"], coarse_step(p) / REFINED, samples=2000)


def hops(run: Trajectory) -> float:
    """1 if in the last third of a run the ball has been in the air and has come down again, else 0."""
    late = run.y[2 * len(run.y) // 3 :]
    top = int(np.argmax(late))
    up, down = late[top] - late[: top + 1].min(), late[top] - late[top:].min()
    return float(min(up, down) > HIGH_ENOUGH * run.header.parameters.R)
