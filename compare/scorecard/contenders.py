"""Settings under test, and how they run: in the study's scene and loop, one simulation at a time."""

from __future__ import annotations

import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from compare.scorecard.native import Native
from compare.scorecard.trials import KICKED, SLIPPING
from mjsim import ContactSettings, recorder, scene
from mjsim.engine import start
from mjsim.stepping import Stepper
from model import Events, Flow, Header, Parameters, Trajectory

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
        rows = np.empty((count, recorder.SENSORS + recorder.NSENSOR))
        for row in rows:
            stepper.advance(np.full((every, 1), p.omega_0), row[None])
        with np.errstate(invalid="ignore"):
            sound = rows[np.logical_and.accumulate((np.abs(rows) < _HUGE).all(axis=1))]
        times = (before + every * np.arange(len(sound), dtype=float)) * h
        block = recorder.samples(times, sound, p, self.loop.lead)
        failure = "" if len(sound) == count else "diverged"
        header = Header("mujoco", p, Flow.steady(p.omega_0), self.loop.to_mapping(), failure=failure)
        return Trajectory.from_blocks(header, [block], Events())


OURS = Contender("dualball", ContactSettings())
PLAIN = Contender("MuJoCo", Native().loop(), Native())
NEWCOMER = Contender("newcomer", Native().loop(coordinates="free", wall="prism"), Native())
"""What a newcomer might write: MuJoCo's defaults, a free ball, and a wall of flat facets."""


def costs(contenders: Sequence[Contender], steps: int = 1500, repeats: int = 5) -> list[float]:
    """Medians of time per step over that of our defaults, measured in turn."""
    steppers = [contender.start(SLIPPING.p, KICKED) for contender in (OURS, *contenders)]
    omega_0 = np.full((steps, 1), SLIPPING.p.omega_0)
    times: list[list[float]] = [[] for _ in steppers]
    for _ in range(repeats):
        for stepper, spent in zip(steppers, times, strict=True):
            begin = time.process_time()
            stepper.advance(omega_0)
            spent.append(time.process_time() - begin)
    ours, *others = (statistics.median(spent) for spent in times)
    return [1.0 if of is OURS else other / ours for of, other in zip(contenders, others, strict=True)]
