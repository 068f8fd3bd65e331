"""What drag, wall, servo and recording cost on top of MuJoCo's own step."""

from __future__ import annotations

import functools
import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco.batch import Batch

from mjsim import recorder, scene
from mjsim.contact_settings import ContactSettings
from mjsim.engine import Run
from model import Flow, Parameters
from model.arrays import Array
from model.kinematics import VARIABLES


@dataclass(frozen=True)
class Cost:
    """Time per step of one simulation, s, and the ratio of the whole loop to bare steps of the same scene."""

    runs: int
    bare: float
    whole: float

    @property
    def ratio(self) -> float:
        """Whole loop over bare steps."""
        return self.whole / self.bare


def cost(
    p: Parameters, x0: Sequence[float], runs: int = 1, steps: int = 2500, repeats: int = 5,
    settings: ContactSettings | None = None,
) -> Cost:  # fmt: skip
    """Medians over `repeats` of bare and whole timings taken in turn, of processor time, with a sample every 100 steps.

    Start from a stationary state (or near one), or the two don't solve the same contacts: the bare steps hold the
    ball at one azimuth, where the wall stands, by a single assignment a step.
    """
    settings = settings or ContactSettings()
    bare, whole = [], []
    for _ in range(repeats):
        loop = Run(
            [p] * runs, [x0] * runs, steps * settings.timestep, [Flow.steady(p.omega_0)] * runs, settings,
            sample_interval=100 * settings.timestep, batched=runs > 1,
        )  # fmt: skip
        start = time.process_time()
        last = [blocks[0][-1] for blocks in loop][-1]
        whole.append((time.process_time() - start) / (steps * runs))
        bare.append(_bare(p, settings, last, loop.margins[0], runs, steps) / (steps * runs))
    return Cost(runs, statistics.median(bare), statistics.median(whole))


def _bare(p: Parameters, settings: ContactSettings, last: np.void, margin: Array, runs: int, steps: int) -> float:
    """Time in s of the given steps of the scene with no more around them than a loop."""
    model = scene.build(p, settings)
    model.pair_margin[:] = margin
    x = np.array([last[name] for name in VARIABLES])
    qpos, qvel = recorder.joint_state(x, 0.0, p)
    if runs == 1:
        data = mujoco.MjData(model)
        data.qpos[:], data.qvel[:] = qpos, qvel
        azimuth, step = data.qpos[:1], functools.partial(mujoco.mj_step, model, data)
    else:
        batch = Batch(model, nsim=runs, nthread=1)
        batch.bind("qpos")[:], batch.bind("qvel")[:] = qpos, qvel
        azimuth, step = batch.bind("qpos")[:, 0], batch.step
    start = time.process_time()
    for _ in range(steps):
        step()
        azimuth[:] = 0.0
    return time.process_time() - start
