"""Simulators of the study's ball as `compare.kit.engines` runs them: the theory's two, and MuJoCo's ball on joints.

Cases without a vessel are left to an adapter for free bodies, if there is one.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from compare.adapters import mujoco_free
from compare.adapters.scene import TIME_STEPS
from compare.bench.case import Case
from compare.kit.engines import ENGINES
from compare.kit.tasks import Task, carry_out
from model import InputError
from model.kinematics import to_world

JOINTS = "the ball in the vessel on joints: azimuth, radius, height, spin"


class Simulated:
    """An engine of the study by name, and what takes the cases without a vessel."""

    def __init__(self, name: str, declared: str, note: str, free: mujoco_free.Bodies | None = None) -> None:
        self.NAME, self.DECLARED, self.NOTE, self._free = name, declared, note, free
        self.FEATURES = free.FEATURES if free else ()
        if "timestep" not in ENGINES[name].options:
            self.TIMESTEPS = TIME_STEPS[-1:]

    def build(self, case: Case, timestep: float) -> None:
        """The task, or the scene of the other engine."""
        self._task: Task | None = None
        self._at = 0
        if case.motion:
            (p, x0), t_end = case.motion, timestep * math.ceil(case.times[-1] / timestep - 1e-9)
            settings, self._begin = ENGINES[self.NAME].at(timestep, p), np.array(case.body.position)
            self._task = Task(
                engine=self.NAME, parameters=p, x0=x0, t_end=t_end, settings=settings, sample_interval=timestep
            )
        elif self._free:
            self._free.build(case, timestep)
        else:
            raise NotImplementedError("only for a ball in a vessel")

    def step(self, n: int) -> None:
        """Go on by n steps; the first time the whole motion is simulated."""
        if self._free and not self._task:
            self._free.step(n)
        elif self._task and not self._at:
            (run,) = carry_out([self._task])
            if run.header.failure:
                raise InputError(run.header.failure)
            self._states = np.stack(to_world(run.x, run.theta, self._task.parameters), axis=1)
            self._states[:, 0] += self._begin - self._states[0, 0]
        self._at += n

    def state(self) -> Any:
        """Position, velocity and spin."""
        return self._free.state() if self._free and not self._task else tuple(self._states[self._at])


mujoco_plain = Simulated(
    "mujoco-plain",
    f"{JOINTS}; elliptic cone, contact settings of the study",
    "contacts soft enough for sliding let a ball that lands sink in and throw it back",
    mujoco_free.Bodies("mujoco-plain", "", tune=mujoco_free.studied),
)
event = Simulated(
    "event",
    "the equations of the paper, no scene; its own steps",
    "what is left is its relative tolerance, 1e-9, and an impact passes it on",
)
time_stepping = Simulated(
    "time-stepping",
    "the equations of the paper, no scene",
    "a contact closes at the end of a step: after a landing it is of first order, elsewhere of second",
)
