"""Settings under test, and how they run: MuJoCo's in the study's scene and loop, other engines' in their own."""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from compare.runs.engines import Engine
from compare.runs.tasks import Task, carry_out
from compare.scorecard.native import Native
from compare.scorecard.trials import KICKED, SLIPPING
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
    def timestep(self) -> float:
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
        header = Header("mujoco", p, Flow.steady(p.omega_0), self.loop.to_mapping(), failure=failure)
        return Trajectory.from_blocks(header, [block], Events())

    def clock(self, steps: int) -> Callable[[], float]:
        """A function that goes on by so many steps and returns the processor time in s."""
        stepper, omega_0 = self.start(SLIPPING.p, KICKED), np.full((steps, 1), SLIPPING.p.omega_0)

        def spend() -> float:
            begin = time.process_time()
            stepper.advance(omega_0)
            return time.process_time() - begin

        return spend


@dataclass(frozen=True)
class Other:
    """Another engine, in settings that a time step in s leads to."""

    engine: Engine
    timestep: float

    @property
    def name(self) -> str:
        """The engine's."""
        return self.engine.name

    def task(self, p: Parameters, x0: npt.ArrayLike, t_end: float, interval: float) -> Task:
        """A run of the engine."""
        settings = self.engine.configure({"timestep": self.timestep}, p)
        return Task(engine=self.name, parameters=p, x0=x0, t_end=t_end, settings=settings, sample_interval=interval)

    def run(self, p: Parameters, x0: npt.ArrayLike, t_end: float, interval: float, skip: float = 0.0) -> Trajectory:
        """As `Contender.run`; of what follows `skip`, fifty samples."""
        (run,) = carry_out([self.task(p, x0, t_end, max(interval, (t_end - skip) / 50) if skip else interval)])
        kept = run.time >= skip
        return replace(run, **{name: getattr(run, name)[kept] for name in columns(Trajectory)})

    def clock(self, steps: int) -> Callable[[], float]:
        """As `Contender.clock`, always from the start, without what it takes to begin."""
        times = [count * steps * self.timestep for count in (1, 2)]

        def spend() -> float:
            spent = []
            for t_end in times:
                begin = processor_time()
                carry_out([self.task(SLIPPING.p, KICKED, t_end, t_end)])
                spent.append(processor_time() - begin)
            return spent[1] - spent[0]

        return spend


OURS = Contender("dualball", ContactSettings())
PLAIN = Contender("MuJoCo", Native().loop(), Native())
NEWCOMER = Contender("newcomer", Native().loop(coordinates="free", wall="prism"), Native())
"""What a newcomer might write: MuJoCo's defaults, a free ball, and a wall of flat facets."""


def processor_time() -> float:
    """Of this process and of those that it started and that ended, s."""
    ended = os.times()
    return time.process_time() + ended.children_user + ended.children_system


def costs(contenders: Sequence[Contender | Other]) -> list[float]:
    """Medians of time per step over that of our defaults, measured in turn."""
    clocks = [contender.clock(_TIMED) for contender in (OURS, *contenders)]
    times: list[list[float]] = [[] for _ in clocks]
    for _ in range(_REPEATS):
        for clock, spent in zip(clocks, times, strict=True):
            spent.append(clock())
    ours, *others = (statistics.median(spent) for spent in times)
    return [1.0 if of is OURS else other / ours for of, other in zip(contenders, others, strict=True)]
