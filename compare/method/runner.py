"""What a protocol works with: an engine, a campaign of runs, and how much is measured."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Unpack

import numpy as np
import numpy.typing as npt

from compare import plan
from compare.campaign.campaign import Campaign
from compare.campaign.tasks import Task
from compare.engines.study import Engine
from compare.method.conditions import Conditions
from compare.method.record import Measurement, Missing
from compare.method.scales import time_unit
from compare.method.statistics import Estimate
from compare.plan import Level, Sampling
from model import Flow, Parameters, Trajectory


@dataclass(frozen=True)
class Runner:
    """Where protocols run what they need: once, and then it is read from its file."""

    campaign: Campaign
    engine: Engine
    level: Level
    divisor: int = 1  #: time steps in one that a protocol asks for, see `Engine.divisors`
    protocol: str = ""  #: the name of the protocol that is carried out

    @property
    def sampling(self) -> Sampling:
        """How much is measured at this level by this engine."""
        if self.has_own_steps:
            return plan.OWN_STEPS if self.level is Level.QUICK else plan.OWN_STEPS_ABOVE_QUICK
        return (plan.AT_QUICK, plan.AT_DEFAULT, plan.AT_FULL)[self.level]

    @property
    def has_own_steps(self) -> bool:
        """Whether the engine has time steps of its own, beside the one on trial or alone."""
        return self.engine.divisors != (1,)

    def task(
        self,
        p: Parameters,
        x0: npt.ArrayLike,
        t_end: float,
        step: float,
        *,
        flow: Flow | None = None,
        samples: int = 100,
    ) -> Task:
        """The task of a run by the runner's engine with a time step in s, in the studies' settings.

        One that goes on from another begins on floor and wall, not sunk into them."""
        x = np.array(x0, float)
        # y, and h where it is given
        x[[0, 6][: len(x) // 4]] = np.maximum(x[[0, 6][: len(x) // 4]], 0.0)
        return Task(
            engine=self.engine.name,
            parameters=p,
            x0=x,
            t_end=t_end,
            flow=flow,
            settings=self.engine.at(step / self.divisor, p),
            sample_interval=max(step, t_end / samples),
        )

    def measurement(
        self,
        set: str,
        p: Parameters,
        quantity: str,
        value: Estimate | float,
        tasks: Iterable[Task] = (),
        **at: Unpack[Conditions],
    ) -> Measurement:
        """A measurement by the engine, from these runs; a plain number is exact."""
        sure = value if isinstance(value, Estimate) else Estimate(float(value), 0.0)
        return Measurement(
            protocol=self.protocol,
            quantity=quantity,
            value=sure.value,
            uncertainty=sure.uncertainty,
            budget=sure.budget,
            engine=self.engine.name,
            set=set,
            parameters=p,
            at=at,
            runs=tuple(task.key for task in tasks),
        )

    def missing(self, set: str, reason: str, rows: int = 1) -> Missing:
        """What the protocol could not measure, see `Missing`."""
        return Missing(self.protocol, set, reason, rows)

    def groups(self, groups: Sequence[Sequence[Task]]) -> Iterator[list[Trajectory] | str]:
        """The trajectories of each group, or why one failed; held in memory one by one."""
        failures = self.campaign.complete([task for group in groups for task in group])
        failed = {failure.task.key: failure.reason for failure in failures}
        for group in groups:
            reasons = [failed[task.key] for task in group if task.key in failed]
            yield reasons[0] if reasons else self.campaign.run(group)

    def each(self, tasks: Sequence[Task]) -> Iterator[Trajectory | str]:
        """The trajectory of every task, one after the other, or why it failed."""
        for group in self.groups([[task] for task in tasks]):
            yield group if isinstance(group, str) else group[0]


def coarse_step(p: Parameters) -> float:
    """A time step, s: a power of two of 1 ms, about `time_unit`/20, at most 1/(4 omega_0)."""
    finest = math.floor(math.log2(250 / abs(p.omega_0))) if p.omega_0 else math.inf
    return float(1e-3 * 2.0 ** min(round(math.log2(time_unit(p) / 20e-3)), finest))
