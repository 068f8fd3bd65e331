"""The ball on the paper's coordinates under `mjsim.Coulomb`, rigid, as any model could have it.

Semi-implicit steps are leapfrog: places are half a step ahead of velocities. Between the steps there
are drag and inertia in the middle of a step, and the wall is turned to be tangent at the ball. The
ball's axes are left to turn: set upright, its contacts would seem to be fixed on it. Margins keep
contacts in sight, so that they need no depth.
"""

from __future__ import annotations

import dataclasses
import math

import mujoco
import numpy as np

from mjsim import recorder, scene
from mjsim.contact_settings import ContactSettings
from mjsim.corrections import Ball, Velocity, corrections
from mjsim.coulomb import Coulomb
from model import Parameters, State
from model.arrays import Array

_NO_FRICTION, _NO_LOADS = (0.0,) * 4, (0.0,) * 2


def advance(x: State, p: Parameters, duration: float, step: float) -> tuple[State, Array]:
    """The state after a time, s, and the velocities (steps, 6) of the joints before each step."""
    settings = dataclasses.replace(ContactSettings.at(step), servo=0.0, memory=False)
    ball = Ball.of(p, settings)._replace(lag=0.0, gain=0.0, memory=0.0)
    model = scene.build(p, settings)[0]
    data, law = mujoco.MjData(model), Coulomb(model, rigid=True, depth=0.0)
    place, velocity = (np.ravel(each) for each in recorder.joint_state(x, 0.0, p))
    data.qpos[:3], data.qvel[:] = place + step / 2 * velocity[:3], velocity
    velocities = np.empty((round(duration / step) + 1, 6))
    velocities[0], axes = velocity, np.eye(3).ravel()
    with law.acting(data):
        for n in range(len(velocities) - 1):
            theta = data.qpos[0]
            data.mocap_quat[0] = math.cos(theta / 2), 0, 0, math.sin(theta / 2)
            mujoco.mju_quat2Mat(axes, data.qpos[3:7])
            turned, last = axes.reshape(3, 3), velocities[max(n - 1, 0)]
            force = corrections(
                Velocity(*velocities[n]), Velocity(*last), p.R - data.qpos[1], p.omega_0,
                _NO_FRICTION, _NO_LOADS, ball,
            )[0]  # fmt: skip
            data.qfrc_applied[:3], data.qfrc_applied[3:] = force[:3], turned.T @ force[3:]
            mujoco.mj_step(model, data)
            mujoco.mju_quat2Mat(axes, data.qpos[3:7])
            velocities[n + 1] = *data.qvel[:3], *(turned @ data.qvel[3:])
    return recorder.state(data.qpos[:3] - step / 2 * data.qvel[:3], velocities[-1], p), velocities
