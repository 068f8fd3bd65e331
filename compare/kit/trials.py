"""Trials: motions run with two time steps, whose difference is the error of the finer one."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from compare.kit.lab import Lab, coarse_step
from compare.kit.record import Condition, Measurement, Missing, measurement
from compare.kit.statistics import Measured
from compare.kit.tasks import Task
from model import Flow, Parameters
from model.arrays import Array


@dataclass(frozen=True, eq=False)
class Start:
    """From where a run begins."""

    set: str
    p: Parameters
    name: str
    x0: Array


@dataclass(frozen=True, eq=False)
class Trial(Start):
    """A motion that is run with two time steps."""

    t_end: float
    """s"""
    refine: tuple[int, int]
    """Time steps in one of `coarse_step`, fewer first."""
    samples: int | None = None
    """None for every step."""
    read: Callable[..., Any] = lambda run: run
    """What is read from the runs with one time step."""
    flow: Flow | None = None
    variants: tuple[Parameters, ...] = ()
    """Parameters of the runs that are read together; empty for one run with those of the start."""
    conditions: Mapping[str, Condition] = field(default_factory=dict)
    """Of all measurements of this trial."""
    rows: int = 1
    """Measurements that are left out if a run breaks down."""


@dataclass(frozen=True, eq=False)
class TrialResult:
    """What was read from a trial with the coarser and with the finer time step."""

    protocol: str
    trial: Trial
    tasks: Sequence[Task] = field(repr=False)
    """The runs, those with the coarser step first."""
    coarse: Any
    fine: Any

    def row(self, lab: Lab, quantity: str, value: Measured | float, **conditions: Condition) -> Measurement:
        """A measurement of this trial."""
        trial, conditions = self.trial, {**self.trial.conditions, **conditions}
        return measurement(lab, self.protocol, trial.set, trial.p, quantity, value, self.tasks, **conditions)


def carry_out(lab: Lab, protocol: str, trials: Iterable[Trial]) -> Iterator[TrialResult | Missing]:
    """Run all trials, and read each; or say which of its runs broke down."""
    tasks: list[tuple[Trial, list[Task]]] = []
    for trial in trials:
        tasks.append((trial, []))
        for step in (coarse_step(trial.p) / refine for refine in trial.refine):
            samples = trial.samples or round(trial.t_end / step)
            for p in trial.variants or (trial.p,):
                task = lab.task(p, trial.x0, trial.t_end, step, flow=trial.flow, samples=samples)
                tasks[-1][1].append(task)
    for (trial, own), runs in zip(tasks, lab.groups([own for _, own in tasks]), strict=True):
        if isinstance(runs, str):
            yield Missing(protocol, trial.set, f"{trial.name}: the run {runs}", trial.rows)
        else:
            half = len(runs) // 2
            yield TrialResult(protocol, trial, own, trial.read(*runs[:half]), trial.read(*runs[half:]))


def finer(coarse: float, fine: Measured) -> Measured:
    """What the finer step shows: its difference from the coarser one adds to its own uncertainty in quadrature."""
    return Measured(fine.value, math.hypot(fine.value - coarse, fine.uncertainty))
