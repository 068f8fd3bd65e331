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
from compare.kit.engines import ENGINES, Engine, engine
from compare.kit.tasks import Task, carry_out
from model import InputError
from model.arrays import Array
from model.kinematics import to_world

JOINTS = "the ball in the vessel on joints: azimuth, radius, height, spin"


class Simulated:
    """An engine of the study by name, and what takes the cases without a vessel."""

    def __init__(self, name: str, free: Any = None, declared: str = "", note: str = "") -> None:
        self.NAME, self._free = name, free
        own = getattr(free, "DECLARED", "")
        self.DECLARED = "; ".join(filter(None, (JOINTS if free else "", declared or own)))
        self.NOTE = note or getattr(free, "NOTE", "")
        self.FEATURES = getattr(free, "FEATURES", ())
        if "timestep" not in ENGINES[name].options:
            self.TIMESTEPS = TIME_STEPS[-1:]
        self._states: Array | None = None

    def build(self, case: Case, timestep: float) -> None:
        """The task, or the scene of the other engine."""
        self._case, self._at, self._states = case, 0, None
        if not case.motion:
            if self._free is None:
                raise NotImplementedError("only for a ball in a vessel")
            self._free.build(case, timestep)
            return
        (p, x0), chosen = case.motion, self.engine(timestep)
        if chosen.missing:
            raise NotImplementedError(chosen.missing)
        settings, t_end = chosen.at(timestep, p), timestep * math.ceil(case.times[-1] / timestep - 1e-9)
        self._task = Task(
            engine=chosen.name, parameters=p, x0=x0, t_end=t_end, settings=settings, sample_interval=timestep
        )

    def engine(self, timestep: float) -> Engine:
        """What takes the ball in its vessel."""
        return engine(self.NAME)

    def step(self, n: int) -> None:
        """Go on by n steps; the first time the whole motion is simulated."""
        if not self._case.motion:
            self._free.step(n)
            return
        if self._states is None:
            (run,) = carry_out([self._task])
            if run.header.failure:
                raise InputError(run.header.failure)
            p, _ = self._case.motion
            self._states = np.stack(to_world(run.x, run.theta, p), axis=1)
            self._states[:, 0] += np.array(self._case.body.position) - self._states[0, 0]
        self._at += n

    def state(self) -> Any:
        """Position, velocity and spin."""
        if not self._case.motion:
            return self._free.state()
        assert self._states is not None
        return tuple(self._states[self._at])


mujoco_plain = Simulated(
    "mujoco-plain",
    mujoco_free.Bodies("mujoco-plain", "", tune=mujoco_free.studied),
    "elliptic cone, contact settings of the study",
    "contacts soft enough for sliding let a ball that lands sink in and throw it back",
)
event = Simulated(
    "event",
    declared="the equations of the paper, no scene; its own steps",
    note="what is left is its relative tolerance, 1e-9, and an impact passes it on",
)
time_stepping = Simulated(
    "time-stepping",
    declared="the equations of the paper, no scene",
    note="a contact closes at the end of a step: after a landing it is of first order, elsewhere of second",
)
