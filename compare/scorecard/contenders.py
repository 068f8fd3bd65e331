"""Settings under test, and how they run: MuJoCo's in the study's scene and loop, other engines' in their own."""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from compare.runs.engines import MUJOCO, Engine, Settings
from compare.runs.tasks import Task, carry_out
from compare.scorecard.native import Native
from compare.scorecard.trials import APPROACH
from mjsim import ContactSettings, recorder, scene
from mjsim.engine import start
from mjsim.stepping import Stepper
from model import Events, Flow, Header, Parameters, Trajectory
from model.trajectory import columns

_TIMED, _REPEATS = 1500, 5
"""Steps that are timed at once, and how often."""
_HUGE = 1e8
"""A coordinate, speed or force beyond this, in SI units, has diverged."""


@dataclass(frozen=True)
class Contender:
    """Settings under test."""

    name: str
    loop: ContactSettings
    """Settings of the loop round the engine."""
    native: Native | None = None
    """Settings of the engine where they are not those of `loop`."""

    @property
    def step(self) -> float:
        """s"""
        return self.loop.timestep

    def start(self, p: Parameters, x0: npt.ArrayLike) -> Stepper:
        """A simulation from a state."""
        model = self.native.build(p, self.loop) if self.native else scene.build(p, self.loop)[0]
        return start([model], [p], self.loop, [x0], 0.0, np.full(1, p.omega_0), batched=False)

    def run(self, p: Parameters, x0: npt.ArrayLike, t_end: float, interval: float, skip: float = 0.0) -> Trajectory:
        """Samples from about `skip` to `t_end`, every `interval` s, up to where the run diverges; without cases."""
        h = self.loop.timestep
        every, before = max(1, round(interval / h)), round(skip / h)
        count = int((t_end - skip) / (every * h)) + 1
        stepper = self.start(p, x0)
        stepper.advance(np.full((before, 1), p.omega_0))
        rows = np.empty((count, recorder.COLUMNS))
        for row in rows:
            stepper.advance(np.full((every, 1), p.omega_0), row[None])
        with np.errstate(invalid="ignore"):
            sound = rows[np.logical_and.accumulate((np.abs(rows) < _HUGE).all(axis=1))]
        times = (before + every * np.arange(len(sound), dtype=float)) * h
        block = recorder.samples(times, sound, p)
        failure = "" if len(sound) == count else "diverged"
        header = Header(MUJOCO.name, p, Flow.steady(p.omega_0), self.loop.to_mapping(), failure=failure)
        return Trajectory.from_blocks(header, [block], Events())

    def clock(self, steps: int) -> Callable[[], float]:
        """A function that goes on by so many steps and returns the processor time in s."""
        stepper, omega_0 = self.start(APPROACH.p, APPROACH.x0), np.full((steps, 1), APPROACH.p.omega_0)

        def spend() -> float:
            begin = time.process_time()
            stepper.advance(omega_0)
            return time.process_time() - begin

        return spend


@dataclass(frozen=True)
class Contestant:
    """An engine in its own loop."""

    name: str
    engine: Engine
    step: float | None
    """s; None for one that chooses its own."""
    settings: Settings

    def task(self, p: Parameters, x0: npt.ArrayLike, lasts: float, interval: float) -> Task:
        """A run; it samples no more often than it steps."""
        every = max(interval, self.step or 0.0)
        return Task(
            engine=self.engine.name, parameters=p, x0=x0, t_end=lasts, settings=self.settings, sample_interval=every
        )

    def run(self, p: Parameters, x0: npt.ArrayLike, t_end: float, interval: float, skip: float = 0.0) -> Trajectory:
        """As `Contender.run`; of what follows `skip`, fifty samples."""
        (run,) = carry_out([self.task(p, x0, t_end, max(interval, (t_end - skip) / 50) if skip else interval)])
        kept = run.time >= skip
        return replace(run, **{name: getattr(run, name)[kept] for name in columns(Trajectory)})

    def clock(self, steps: int) -> Callable[[], float]:
        """As `Contender.clock`, always from the start, without what it takes to begin."""
        lasts = steps * (self.step or 0.0)
        tasks = [self.task(APPROACH.p, APPROACH.x0, t_end, t_end) for t_end in (lasts, 2 * lasts)]

        def spend() -> float:
            one, both = map(seconds, tasks)
            return both - one

        return spend


OURS = Contender("dualball", ContactSettings())
PLAIN = Contender("MuJoCo", Native().loop(), Native())
NEWCOMER = Contender("newcomer", Native().loop(coordinates="free", wall="prism"), Native())
"""What a newcomer might write: MuJoCo's defaults, a free ball, and a wall of flat facets."""


def seconds(task: Task) -> float:
    """Processor time of a run, of this process and of those that it started and that ended."""
    begin = _processor_time()
    carry_out([task])
    return _processor_time() - begin


def _processor_time() -> float:
    ended = os.times()
    return time.process_time() + ended.children_user + ended.children_system


def costs(contenders: Sequence[Contender | Contestant]) -> list[float]:
    """Medians of time per step over that of our defaults, measured in turn."""
    clocks = [contender.clock(_TIMED) for contender in (OURS, *contenders)]
    times: list[list[float]] = [[] for _ in clocks]
    for _ in range(_REPEATS):
        for clock, spent in zip(clocks, times, strict=True):
            spent.append(clock())
    ours, *others = (statistics.median(spent) for spent in times)
    return [1.0 if of is OURS else other / ours for of, other in zip(contenders, others, strict=True)]
