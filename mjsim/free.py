"""The ball on a free joint, for comparison with the joint chain.

A free ball takes the curve of the wall from the engine: the more independent witness and the less accurate one, since
MuJoCo leaves the turning of the contact frame out of what drives the contact (J' v). It may cross the axis.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from mjsim import recorder
from mjsim.contact_settings import ContactSettings
from mjsim.stepping import Stepper
from model import Parameters
from model.arrays import Array
from model.kinematics import WorldState, from_world, to_world

_INTEGRATION = mujoco.mjtState.mjSTATE_INTEGRATION


class Free(Stepper):
    """Simulations of free balls, one after the other."""

    def __init__(
        self, models: Sequence[Any], parameters: Sequence[Parameters], settings: ContactSettings,
        states: Sequence[Array], theta_0: float,
    ) -> None:  # fmt: skip
        self._balls = [_Ball(*each, settings, theta_0) for each in zip(models, parameters, states, strict=True)]
        self.margins = np.zeros((len(models), 2))

    def state(self) -> dict[str, Array]:
        return {
            "integration": np.stack([ball.integration_state() for ball in self._balls]),
            "theta": np.array([ball.theta for ball in self._balls]),
            "margins": self.margins.copy(),
        }

    def restore(self, state: dict[str, Array]) -> None:
        self.margins[:] = state["margins"]
        for k, ball in enumerate(self._balls):
            mujoco.mj_setState(ball.model, ball.data, state["integration"][k], _INTEGRATION)
            ball.theta = float(state["theta"][k])
            ball.model.pair_margin[:] = state["margins"][k]

    def sample(self, omega_0: Array, row: Array) -> None:
        for ball, omega, part in zip(self._balls, omega_0, row, strict=True):
            split = recorder.NQ + recorder.NV
            part[: recorder.NQ], part[recorder.NQ : split] = ball.joint_coordinates()
            ball.steps([float(omega)])
            part[split:] = ball.data.sensordata

    def advance(self, omega_0: Array) -> None:
        for ball, omegas, margins in zip(self._balls, omega_0.T, self.margins, strict=True):
            ball.steps(omegas.tolist())
            margins[:] = ball.model.pair_margin[:2]


class _Ball:
    def __init__(self, model: Any, p: Parameters, x: Array, settings: ContactSettings, theta_0: float) -> None:
        self.model = copy.copy(model)  # its margins move
        self.data = mujoco.MjData(self.model)
        self._p, self._settings, self.theta = p, settings, theta_0
        world = to_world(x, theta_0, p)
        self.data.qpos[:] = np.concatenate([world.position, world.quaternion])
        self.data.qvel[:] = np.concatenate([world.velocity, world.angular_velocity_body])
        self._turns = settings.wall == "tangent"

    def steps(self, omega_0: list[float]) -> None:
        """Take a step for each value of omega_0."""
        model, data, p = self.model, self.data, self._p
        qpos, qvel, force, margins = data.qpos, data.qvel, data.qfrc_applied, model.pair_margin
        mc, gain, reach = p.m * p.c, self._settings.servo_gain, self._settings.touching(p.g)
        for omega in omega_0:
            x, y, z, *_ = qpos.tolist()
            v_x, v_y, v_z, *_ = qvel.tolist()
            force[0], force[1], force[2] = -mc * (v_x + omega * y), -mc * (v_y - omega * x), -mc * v_z
            rho = math.hypot(x, y)
            azimuth = self._unwrap(math.atan2(y, x))
            if self._turns:
                data.mocap_quat[0] = (math.cos(azimuth / 2), 0.0, 0.0, math.sin(azimuth / 2))
            if gain:
                if z - p.r < reach:
                    margins[0] = max(0.0, margins[0] - gain * (z - p.r))
                if p.R - rho < reach:
                    margins[1] = max(0.0, margins[1] - gain * (p.R - rho))
            mujoco.mj_step(model, data)

    def joint_coordinates(self) -> tuple[Array, Array]:
        """The state as coordinates of the joint chain, with the orientation upright."""
        qpos, qvel = self.data.qpos, self.data.qvel
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, qpos[3:7])
        world = WorldState(qpos[:3].copy(), qpos[3:7].copy(), qvel[:3].copy(), rotation.reshape(3, 3) @ qvel[3:6])
        x, azimuth = from_world(world, self._p)
        return recorder.joint_state(x, self._unwrap(float(azimuth)), self._p)

    def _unwrap(self, azimuth: float) -> float:
        """Take the turn of this azimuth that is nearest to the last one; nan in a run that has diverged."""
        if math.isfinite(azimuth):
            self.theta = azimuth + math.tau * round((self.theta - azimuth) / math.tau)
        return self.theta

    def integration_state(self) -> Array:
        """All that the engine carries from one step to the next."""
        state = np.empty(mujoco.mj_stateSize(self.model, _INTEGRATION))
        mujoco.mj_getState(self.model, self.data, state, _INTEGRATION)
        return state
