"""MuJoCo on Warp, on a processor."""

from __future__ import annotations

from typing import Any

import mujoco
import mujoco_warp as engine
import warp

from compare.bench.adapters.free import Free, State
from compare.bench.case import Vector

warp.config.quiet = True


class MujocoWarp(Free):
    KNOWN = "mujoco-warp 4.0.0"
    PRECISION = "f32"

    def make(self) -> None:
        spec = mujoco.MjSpec.from_string(self.case.mjcf(self.timestep))
        model = spec.compile()
        data = mujoco.MjData(model)
        mujoco.mj_resetDataKeyframe(model, data, 0)
        mujoco.mj_forward(model, data)
        self.host = model
        with warp.ScopedDevice("cpu"):
            self.model, self.data = engine.put_model(model), engine.put_data(model, data, nconmax=32, njmax=128)
        self.body = model.body("body").id

    def advance(self) -> None:
        with warp.ScopedDevice("cpu"):
            engine.step(self.model, self.data)

    def state(self) -> State:
        import numpy as np
        from compare.bench.adapters.free import turned
        q, v = self.data.qpos.numpy()[0], self.data.qvel.numpy()[0].astype(float)
        return q[-7:-4].astype(float), v[-6:-3], turned(q[-4:].astype(float), v[-3:])

    def push(self, force: Vector) -> None:
        self.data.xfrc_applied.numpy()[0, self.body, :3] = force


defaults = MujocoWarp("mujoco-warp-defaults")
