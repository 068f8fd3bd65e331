"""MuJoCo in the league on the study's joints."""

import math
from typing import Any

import numpy as np

from compare.campaign.tasks import Task, carry_out
from compare.engines.adapters.free import BodyState
from compare.engines.adapters.mujoco_free import Bodies, studied
from compare.engines.study import PLAIN
from model import InputError
from model.kinematics import to_world


class PlainOnJoints(Bodies):
    """The engine `mujoco-plain` for cases with a `motion`, simulated at the first step."""

    def build(self, case: Any, timestep: float) -> None:
        self._task: Task | None = None
        if not case.motion:
            super().build(case, timestep)
            return
        (p, x0), t_end = case.motion, timestep * math.ceil(case.times[-1] / timestep - 1e-9)
        settings, self._begin, self._at = PLAIN.at(timestep, p), np.array(case.body.position), 0
        self._task = Task(
            engine=PLAIN.name,
            parameters=p,
            x0=x0,
            t_end=t_end,
            settings=settings,
            sample_interval=timestep,
        )

    def step(self, n: int) -> None:
        if not self._task:
            super().step(n)
            return
        if not self._at:
            run = carry_out(self._task)
            if run.header.failure:
                raise InputError(run.header.failure)
            self._states = np.stack(to_world(run.x, run.theta, self._task.parameters), axis=1)
            self._states[:, 0] += self._begin - self._states[0, 0]
        self._at += n

    def state(self) -> BodyState:
        return tuple(self._states[self._at]) if self._task else super().state()


on_joints = PlainOnJoints(
    "mujoco-plain",
    "contacts soft enough for sliding let a ball that lands sink in and throw it back",
    tune=studied,
    declared="the ball in the vessel on joints: azimuth, radius, height, spin; elliptic cone, "
    "settings of the study",
)
