"""MuJoCo on Warp, on a processor in single precision: scenes of `mujoco_free`."""

from __future__ import annotations

import warnings

import mujoco
import mujoco_warp as engine
import numpy as np
import warp

from compare.engines.adapters import mujoco_free
from compare.engines.adapters.free import BodyState
from compare.engines.adapters.scene import Vector
from model.kinematics import rotated

warp.config.quiet = True

_WORST = (
    "worst where MuJoCo is, and as much: in facets, and with what must not move, since its soft "
    "friction creeps; nothing is seen of single precision beside that"
)


class Warp(mujoco_free.Bodies):
    """The same scenes, stepped by Warp."""

    PRECISION = "f32"
    TIMESTEPS = (4e-3, 2e-3)  # a step takes 5 ms, a thousand times MuJoCo's
    FEATURES = ("moving surface", "tripod", "disc")

    def make(self) -> None:
        super().make()
        model, data = self.model, self.data
        mujoco.mj_forward(model, data)
        self.number = model.body("body").id
        # that the friction of one geom is less than MuJoCo likes: a pair's counts
        with warp.ScopedDevice("cpu"), warnings.catch_warnings(action="ignore"):
            self.model = engine.put_model(model)
            self.data = engine.put_data(model, data, nconmax=32, njmax=128)

    def advance(self) -> None:
        with warp.ScopedDevice("cpu"):
            engine.step(self.model, self.data)

    def read(self) -> BodyState:
        q, v = (np.asarray(each.numpy()[0], float) for each in (self.data.qpos, self.data.qvel))
        return q[-7:-4], v[-6:-3], rotated(q[-4:], v[-3:])

    def push(self, force: Vector) -> None:
        # on a processor the engine's own memory
        self.data.xfrc_applied.numpy()[0, self.number, :3] = force


defaults = Warp("mujoco-warp-defaults", _WORST)
best = Warp(
    "mujoco-warp",
    _WORST,
    tune=mujoco_free.studied,
    declared="elliptic cone, contact settings of the study",
)
