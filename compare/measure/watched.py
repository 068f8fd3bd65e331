"""Slight slips all round, watched: does the ball come back to rolling, or slip for good (Figs. 4 and 5, and RR)?

Flows are on either side of the measured one at which rolling ends; the ball rolls at both points, round with the fluid,
or hangs on the wall as it settled there.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from compare.measure.lab import Lab, Level, coarse_step, time_unit
from compare.measure.record import Measurement, Missing, Records, measurement, state_of
from compare.measure.settling import Start, family, high, settle
from compare.runs.tasks import Task
from compare.statistics import settled_case
from model import Case, Parameters, State
from model.arrays import Array

NAME = "watched"
DIRECTIONS = {Level.QUICK: 4, Level.DEFAULT: 8, Level.FULL: 32}
ENDS = {"omega_01": Case.RR, "omega_03": Case.RR, "omega_02": Case.NR}
"""The measured flows at which rolling at both points, by slip or by lift, or at the wall alone, ends."""
SIDES = (0.97, 1.03)
"""Flows, over that."""
SLIGHT = 0.02
"""Size of the slip in units of sqrt(g R)/r."""
HIGH = 10.0
"""Height in R of a ball on the wall: room to slip down."""
LASTS_NR = 10.0
"""How long a ball on the wall is watched, in units of sqrt(R/g)."""
LASTS_RR = 8.0
"""And one that rolls at both points, in units of 1/c: the fluid has to bring back what the slip has taken."""


@dataclass(frozen=True)
class Slight:
    """A rolling state, its case, and the direction of a slight slip."""

    set: str
    p: Parameters
    case: Case
    x: Array
    n: Array
    side: str
    end: str
    """The flow beside which it is."""

    def task(self, lab: Lab) -> Task:
        """The run that shows what becomes of it."""
        p, x = self.p, self.x.copy()
        x[3:6] += SLIGHT * math.sqrt(p.g * p.R) / p.r * self.n
        step = coarse_step(p) / 2
        lasts = LASTS_NR * time_unit(p) if self.case is Case.NR else LASTS_RR / p.c
        return lab.task(p, x, 64 * step * math.ceil(lasts / step / 64), step, samples=64)


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """The case in which every slight slip ends."""
    slights, missing = _slights(lab, sets, records)
    yield from missing
    tasks = [slight.task(lab) for slight in slights]
    lab.complete(tasks)
    for slight, task, run in zip(slights, tasks, lab.run(tasks), strict=True):
        at = state_of(slight.x) | dict(zip(("n_x", "n_y", "n_z"), slight.n.tolist(), strict=True))
        value, inner = family(settled_case(run)), slight.case.name
        by = {"inner": inner, "side": slight.side, "end": slight.end}
        yield measurement(lab, NAME, slight.set, slight.p, "case", value, [task], **by, **at)


def _slights(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> tuple[list[Slight], list[Missing]]:
    hanging = _hanging(lab, sets, records)
    slights, missing = [], []
    for quantity, case in ENDS.items():
        for name, p in sets.items():
            end = records.threshold(name, quantity)
            if end is None or (case is Case.NR and name not in hanging):
                missing.append(Missing(NAME, name, f"{quantity}, at which {case.name} would end, was not measured"))
                continue
            for factor, side in zip(SIDES, ("below", "above"), strict=True):
                q = p.replace(omega_0=end.value * factor)
                x = State(omega_c=q.omega_0)
                if case is Case.NR:  # the spin about the radial axis is the same, whatever the orbit
                    x = x._replace(y=HIGH * p.R, slip_x=hanging[name] - p.R / p.r * q.omega_0)
                along = directions(case, DIRECTIONS[lab.level])
                slights += [Slight(name, q, case, x.stacked(), n, side, quantity) for n in along]
    return slights, missing


def _hanging(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> dict[str, float]:
    """The spin about the radial axis, slip_x + R/r omega_c, of balls that have settled on the wall alone."""
    ends = {name: records.threshold(name, "omega_02") for name in sets}
    flows = {name: sets[name].replace(omega_0=end.value * SIDES[1]) for name, end in ends.items() if end}
    starts = [
        Start(name, q, "on the wall", np.array([high(q), 0, q.omega_0, 0, 0, 0, 0, 0])) for name, q in flows.items()
    ]
    settled = [state for state in settle(lab, starts) if not state.failure and state.case is Case.NR]
    return {state.start.set: state.values["wall_spin"].value for state in settled}


def directions(case: Case, count: int) -> Array:
    """Unit vectors (count, 3) all round: in the plane of slip_y, slip_z out of NR, over the sphere out of RR."""
    k = np.arange(count) + 0.5
    if case is Case.NR:
        angle = k * 2 * np.pi / count
        return np.stack([np.zeros(count), np.sin(angle), np.cos(angle)], axis=-1)
    z, around = 1 - 2 * k / count, np.pi * (1 + math.sqrt(5)) * k  # Fibonacci's lattice
    return np.stack([np.sqrt(1 - z**2) * np.cos(around), np.sqrt(1 - z**2) * np.sin(around), z], axis=-1)
