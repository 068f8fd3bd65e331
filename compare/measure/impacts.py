"""Landings from free flight on the floor and on the wall: velocities and slips shortly after.

The ball comes down steeply or at a slant, with slip or none. It is looked at a few steps after the engine's own contact
has closed, at the same moment with two time steps.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from compare.measure.lab import Lab, coarse_step, state_units, time_unit
from compare.measure.record import Measurement, Missing, Records, measurement, state_of
from compare.runs.tasks import Task
from compare.statistics import Measured
from model import Case, Contact, Parameters
from model.arrays import Array
from model.kinematics import VARIABLES

NAME = "impacts"
LANDINGS: dict[str, tuple[float, ...]] = {
    "floor, with slip": (0.05, -0.5, 0.5, 0.6, 0.2, -0.9, 0.4, 0.0),
    "floor, no slip": (0.05, -0.5, 0.3, 0.0, 0.1, 0.5, 0.5, 0.0),
    "floor, at a slant": (0.04, -0.4, 0.8, -0.3, 0.3, 0.2, 0.6, -0.5),
    "wall, with slip": (0.5, 0.2, 0.6, 0.3, 0.8, -0.7, 0.04, -0.5),
    "wall, no slip": (0.4, 0.0, 0.5, 0.2, 0.0, 0.0, 0.04, -0.5),
    "wall, at a slant": (0.6, -0.5, 0.9, -0.4, -0.2, 0.1, 0.05, -0.3),
}
"""States in units of R, sqrt(R/g), and for slip sqrt(g R)/r."""
FLOW = 0.8
"""omega_0 sqrt(R/g)."""
LASTS = 0.4
"""Duration in units of sqrt(R/g)."""
REFINED = 16
"""Steps in one of `coarse_step`; the second run has twice as many."""
AFTER = 6
"""Steps of the coarser run after contact at which the ball is looked at: then friction has built up."""
NAMES = ("v_y", "omega_c", "slip_x", "slip_y", "slip_z", "v_h")


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """The state shortly after every landing."""
    cases = [(name, how, *_start(p, how)) for name, p in sets.items() for how in LANDINGS]
    tasks = [_tasks(lab, p, x) for _, _, p, x in cases]
    lab.complete([task for pair in tasks for task in pair])
    for (name, how, p, x), pair in zip(cases, tasks, strict=True):
        coarse, fine = lab.run(pair)
        contact = [case.A if how.startswith("floor") else case.B for case in coarse.cases]
        closed = [k for k, each in enumerate(contact) if each is not Contact.N]
        at = closed[0] + AFTER if closed else len(contact)
        if at >= len(contact) or Case(int(coarse.case[at])) != Case(int(fine.case[2 * at])):
            yield Missing(NAME, name, f"{how}: the contact did not close for good within {LASTS:g} sqrt(R/g)")
            continue
        step = coarse_step(p) / REFINED
        units = dict(zip(VARIABLES, state_units(p), strict=True))
        changes = [
            abs(getattr(fine, quantity)[2 * at] - getattr(coarse, quantity)[at]) / units[quantity] for quantity in NAMES
        ]
        # The contact closes at a step, up to one late: for so long weight and friction act otherwise than they should.
        late = step / time_unit(p) / 2
        time, start = float(coarse.time[at]), state_of(x)
        for quantity in NAMES:
            after = float(getattr(fine, quantity)[2 * at])
            value = Measured(after, math.hypot(max(changes), late) * units[quantity])
            yield measurement(lab, NAME, name, p, f"after_{quantity}", value, pair, start=how, time=time, **start)


def _start(p: Parameters, how: str) -> tuple[Parameters, Array]:
    return p.replace(omega_0=FLOW / time_unit(p)), np.array(LANDINGS[how]) * state_units(p)


def _tasks(lab: Lab, p: Parameters, x: Array) -> list[Task]:
    step = coarse_step(p) / REFINED
    return lab.pair(p, x, round(LASTS * time_unit(p) / step), step)
