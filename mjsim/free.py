"""The ball on a free joint, for comparison with the joint chain.

A free ball takes the curve of the wall from the engine: the more independent witness and the less accurate one, since
MuJoCo leaves the turning of the contact frame out of what drives the contact (J' v). It may cross the axis. Of the
corrections between the steps only drag, the turning of the wall and the servo of the margins apply to it.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Iterable, Sequence
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from mjsim import recorder
from mjsim.contact_settings import ContactSettings
from mjsim.corrections import Ball, followed, resistance
from model import Parameters
from model.arrays import Array
from model.kinematics import Motion, from_world, rotated, to_world

_INTEGRATION = mujoco.mjtState.mjSTATE_INTEGRATION


class Free:
    """Simulations of free balls, one after the other; arguments and methods as of `mjsim.stepping.Polar`."""

    def __init__(
        self,
        models: Sequence[Any],
        parameters: Sequence[Parameters],
        settings: ContactSettings,
        x0s: Sequence[npt.ArrayLike],
        theta_0: float,
    ) -> None:
        self._balls = [_Ball(*each, settings, theta_0) for each in zip(models, parameters, x0s, strict=True)]
        self.margins, self.given_up = np.zeros((2, len(models))), np.full(len(models), np.inf)

    def advance(self, omega_0: Iterable[Array], sensors: Array | None = None, row: Array | None = None) -> None:
        if row is not None:
            for k, ball in enumerate(self._balls):
                (position, quaternion), (velocity, spin) = (np.split(v, [3]) for v in (ball.data.qpos, ball.data.qvel))
                x, azimuth = from_world(Motion(position, velocity, rotated(quaternion, spin)), ball.p)
                ball.unwrap(float(azimuth))  # coordinates of the joint chain, with the orientation upright
                joints = recorder.joint_state(x, ball.theta, ball.p)
                row[k, : recorder.NQ], row[k, recorder.NQ : recorder.SENSORS] = joints
        for number, fluid in enumerate(omega_0):
            for k, (ball, omega) in enumerate(zip(self._balls, fluid.tolist(), strict=True)):
                gaps = ball.step(omega)
                if sensors is not None:
                    sensors[number, k] = *ball.data.sensordata, *gaps
                self.margins[:, k] = ball.model.pair_margin[:2]
        if row is not None and sensors is not None:
            row[:, recorder.SENSORS : -1], row[:, -1] = sensors[0], 0.0

    def state(self) -> dict[str, Array]:
        kept = np.empty((len(self._balls), mujoco.mj_stateSize(self._balls[0].model, _INTEGRATION)))
        for ball, own in zip(self._balls, kept, strict=True):
            mujoco.mj_getState(ball.model, ball.data, own, _INTEGRATION)
        return {
            "integration": kept,
            "theta": np.array([ball.theta for ball in self._balls]),
            "margins": self.margins.copy(),
        }

    def restore(self, state: dict[str, Array]) -> None:
        self.margins[:] = state["margins"]
        for k, ball in enumerate(self._balls):
            mujoco.mj_setState(ball.model, ball.data, state["integration"][k], _INTEGRATION)
            ball.theta = float(state["theta"][k])
            ball.model.pair_margin[:2] = state["margins"][:, k]


class _Ball:
    def __init__(self, model: Any, p: Parameters, x: npt.ArrayLike, settings: ContactSettings, theta_0: float) -> None:
        self.model = copy.copy(model)  # its margins move
        self.data = mujoco.MjData(self.model)
        self.p, self._ball, self.theta = p, Ball.of(p, settings), theta_0
        start = to_world(x, theta_0, p)
        self.data.qpos[:] = [*start.position, 1.0, 0.0, 0.0, 0.0]
        self.data.qvel[:] = [*start.velocity, *start.spin]
        self._turns = settings.wall == "tangent"
        self._reach = settings.touching(p.g)

    def step(self, omega_0: float) -> tuple[float, float]:
        """Take a step; return the gaps of A and B before it, m."""
        data, p, gain = self.data, self.p, self._ball.gain
        x, y, z, *_ = data.qpos.tolist()
        v_x, v_y, v_z, *_ = data.qvel.tolist()
        w_x, w_y, gaps = v_x + omega_0 * y, v_y - omega_0 * x, (z - p.r, p.R - math.hypot(x, y))
        mc = resistance(w_x, w_y, v_z, self._ball)
        data.qfrc_applied[:3] = -mc * w_x, -mc * w_y, -mc * v_z  # (9)
        if self._ball.torque:  # the spin is along the ball's own axes, that of the fluid along the vessel's
            fluid = rotated(data.qpos[3:7] * [1, -1, -1, -1], np.array([0.0, 0.0, omega_0]))
            data.qfrc_applied[3:] = -self._ball.torque * (data.qvel[3:] - fluid)
        self.unwrap(math.atan2(y, x))
        if self._turns:
            data.mocap_quat[0] = (math.cos(self.theta / 2), 0.0, 0.0, math.sin(self.theta / 2))
        if gain:
            for contact, gap in enumerate(gaps):
                if gap < self._reach:
                    self.model.pair_margin[contact] = followed(self.model.pair_margin[contact], gap, gain)
        mujoco.mj_step(self.model, data)
        return gaps

    def unwrap(self, azimuth: float) -> None:
        """Take the turn of this azimuth that is nearest to the last one; leave it in a run that has diverged."""
        if math.isfinite(azimuth):
            self.theta = azimuth + math.tau * round((self.theta - azimuth) / math.tau)
