"""MuJoCo as it comes: a free body in the case's own MJCF, with every contact parameter at its default."""

from __future__ import annotations

from typing import Any

import mujoco

from compare.bench.case import FACETS, Case

NAME = "mujoco-defaults"
KNOWN = "mujoco 4.0.0"
DECLARED = f"{FACETS} planes for a cylinder; a table that turns hangs on a hinge"
_scene: Any = None


def build(case: Case, timestep: float) -> None:
    """The scene at its start."""
    global _scene
    model = mujoco.MjModel.from_xml_string(case.mjcf(timestep))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    _scene = case, model, data, model.body("body").id


def step(n: int) -> None:
    """Take n steps."""
    case, model, data, body = _scene
    if not case.forced:
        mujoco.mj_step(model, data, n)
        return
    for _ in range(n):
        data.xfrc_applied[body, :3] = case.force(data.time, data.qpos[-7:-4], data.qvel[-6:-3])
        mujoco.mj_step(model, data)


def state() -> Any:
    """Position, velocity and spin."""
    _, model, data, body = _scene
    mujoco.mj_kinematics(model, data)
    return data.qpos[-7:-4], data.qvel[-6:-3], data.xmat[body].reshape(3, 3) @ data.qvel[-3:]
