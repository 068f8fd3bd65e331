"""The critical drag: below it slipping at both points ends in a fold, above it passes to the wall
without a jump.

At the end of the branch the floor carries nothing; the sign of the slope of omega_0 over the
floor's force there decides whether the branch turns back. States are settled in stronger drag than
that, where they last up to the end."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from compare.kit.record import Measurement, Missing, Records, if_found, measurement
from compare.kit.runner import Runner
from compare.kit.scales import time_unit
from compare.kit.settling import initial_condition, settle_groups
from compare.kit.statistics import Estimate, initial_slope, straight_line
from compare.kit.tasks import Task
from model import Case, Parameters

FIRST_DRAGS = (2.0, 4.0)
"""Drag at which the range of slipping is measured first, c sqrt(R/g)."""
NEARER_DRAGS = (1.6, 2.6)
"""Drag measured then, in units of that extrapolated from those: far off, where states settle
soon."""
BEFORE_FOLD = (0.02, 0.035, 0.055, 0.08, 0.12)
"""Distances of flows below omega_02, in parts of the range of slipping."""


@dataclass(frozen=True, eq=False)
class BranchEnd:
    """How the branch of slipping ends in one drag."""

    lag: float  # 1/c, s, to which the lag by a force is proportional
    slope: Estimate  # of omega_0 as a function of the floor's force where that vanishes
    tasks: list[Task]


def birth(
    runner: Runner, sets: Mapping[str, Parameters], records: Records
) -> Iterator[Measurement | Missing]:
    """The drag at which the fold is born, where d omega_0/dA_y along the branch of SS is zero at
    its end, A_y = 0.

    The zero of the straight line through the slopes as a function of 1/c.
    """
    ranges = {}
    for name in sets:
        begins, ends = records.threshold(name, "omega_01"), records.threshold(name, "omega_02")
        if begins and ends and begins.value < ends.value:
            ranges[name] = begins.value, ends.value
    found: dict[str, list[BranchEnd]] = {name: [] for name in ranges}
    lags: dict[str, Estimate] = {}
    drags = [(name, kappa / time_unit(sets[name])) for name in ranges for kappa in FIRST_DRAGS]
    for _ in (FIRST_DRAGS, NEARER_DRAGS):
        starts = [
            [
                initial_condition(
                    name, sets[name].replace(c=c, omega_0=high - part * (high - low)), "rest"
                )
                for part in BEFORE_FOLD
            ]
            for name, c in drags
            for low, high in [ranges[name]]
        ]
        for (name, c), states in zip(drags, settle_groups(runner, starts), strict=True):
            if not any(state.failure or state.case is not Case.SS for state in states):
                flows = np.array([state.start.p.omega_0 for state in states])
                slope = initial_slope(flows, [state.values["force_Ay"] for state in states])
                found[name].append(BranchEnd(1 / c, slope, [state.task for state in states]))
        for name, own in found.items():
            if len(own) >= len(FIRST_DRAGS):
                values, noise = zip(
                    *((end.slope.value, end.slope.uncertainty) for end in own), strict=True
                )
                lags[name], _ = straight_line([end.lag for end in own], values, noise)
        drags = [
            (name, 1 / lag.value * k)
            for name, lag in lags.items()
            if lag.value > 0
            for k in NEARER_DRAGS
        ]
    for name, p in sets.items():
        if name not in ranges:
            yield Missing(
                "birth", name, "there is no range of slipping at both points that ends at the wall"
            )
        elif len(found[name]) < len(FIRST_DRAGS) + len(NEARER_DRAGS):
            yield Missing(
                "birth",
                name,
                "too few states of slipping at both points settle near the end of the branch",
            )
        else:
            lag = lags[name]
            drag = replace(lag.times(1 / lag.value**2), value=1 / lag.value)
            tasks = [task for end in found[name] for task in end.tasks]
            row = measurement(runner, "birth", name, p, "critical_drag", drag, tasks)
            yield if_found(row, "no drag gives birth to a fold")
