"""The ball on a free joint, which may cross the axis; of what is done between the steps it has drag alone.

With ``scene="facets"`` it is MuJoCo as it comes. With ``scene="rigid"`` contacts obey `mjsim.Coulomb`, which serves any
model and knows nothing of this one.
Semi-implicit steps are leapfrog: places are half a step ahead of velocities. The wall is a block that is turned to the
ball before each step and moves during it as a cylinder does past the ball (`against`).
"""

from __future__ import annotations

import copy
import math
from typing import Any, NamedTuple

import mujoco
import numpy as np
import numpy.typing as npt

from mjsim import recorder
from mjsim.contact_settings import ContactSettings
from mjsim.corrections import Ball
from mjsim.coulomb import Coulomb
from mjsim.coulomb.law import Law
from mjsim.world_axes import against, driven, joint_velocities, slip, spun, unwrapped
from model import Parameters, State
from model.arrays import Array
from model.kinematics import to_world

_INTEGRATION = mujoco.mjtState.mjSTATE_INTEGRATION
_PLACE, _SEEN, (_A_x, _A_y, _B_x, _B_y) = recorder.COORDINATES, recorder.SENSORS, recorder.SLIPS


class Body(NamedTuple):
    """A ball in the engine's memory."""

    qpos: Any
    qvel: Any
    last: Any
    """Accelerations in the last step."""
    applied: Any
    """Forces on ball and wall."""
    sensors: Any
    wall: Any
    at: Any
    """Quaternion and place of the wall."""
    heavy: float
    """Mass of a wall that moves, kg."""
    margins: Any
    """Gaps below which contacts are seen, A and B, m."""
    ball: Ball
    served: Any
    """What takes a step, see `under_law`."""


def step(body: Body, duration: float, anew: bool, omega_0: float, theta: float, seen: Any) -> float:
    """Take a step of so many seconds under Coulomb's law, with places half of it ahead of velocities, and see it.

    `theta` is the azimuth before the last step; that before this one is returned.
    """
    ahead, ball, qpos, qvel, applied = duration / 2, body.ball, body.qpos, body.qvel, body.applied
    x, y = qpos[0], qpos[1]
    forces = driven(qpos, qpos[3:], qvel, body.last, ahead, omega_0, ball)
    for i in range(6):
        applied[i] = forces[i]
    theta = unwrapped(math.atan2(y, x), theta)
    body.wall[0], body.wall[3] = math.cos(theta / 2), math.sin(theta / 2)
    spin = spun(qpos[3:], qvel)
    A_x, A_y, B_x, B_y = slip(qpos, qvel, spin, ahead, ball)
    inwards, onwards, up = against(qpos, qvel, spin, ahead, ball.R, ball.r)
    qvel[6], qvel[7], qvel[8] = -inwards, onwards, -up
    applied[6], applied[8] = body.heavy / ahead * inwards, body.heavy / ahead * up
    body.at[2], qpos[7], qpos[8], qpos[9] = qpos[2], 0.0, 0.0, 0.0
    seen[-2], seen[-1] = qpos[2] - ball.r, ball.R - math.hypot(x, y)
    under_law(body.served, duration, anew)
    for i in range(len(body.sensors)):
        seen[i] = body.sensors[i]
    # the engine has them of a wall that is ahead
    seen[_A_x], seen[_A_y], seen[_B_x], seen[_B_y] = A_x, A_y, B_x, B_y
    return theta


def steps(body: Body, duration: float, fluid: Array, theta: float, rows: Array) -> float:
    """Take a `step` for each omega_0, noted in rows (steps, `COLUMNS`)."""
    for number in range(len(fluid)):
        row = rows[number]
        note(row, body.qpos, body.qvel, duration / 2, body.ball)
        theta = step(body, duration, False, fluid[number], theta, row[_SEEN:])
        row[0] = theta
    return theta


def note(row: Any, qpos: Any, qvel: Any, ahead: float, ball: Ball) -> None:
    """Write coordinates, but for the azimuth, and velocities into a row, as those of a ball on joints.

    The place is `ahead` of the velocities; these are along the axes of where the ball was.
    """
    row[1], row[2] = ball.R - math.hypot(qpos[0], qpos[1]), qpos[2] - ball.r
    velocities = joint_velocities(qpos, qpos[3:], qvel, ahead)
    for i in range(6):
        row[_PLACE + i] = velocities[i]


def under_law(served: tuple[Coulomb, Any], duration: float, anew: bool) -> None:
    """A step of MuJoCo's under the law, with what it remembers or `anew`; compiled, it is served by addresses."""
    law, data = served
    law.model.opt.timestep = duration
    if anew:
        law.reset()
    law.step(data)


class FreeBall:
    """One of them, with an engine of its own; arguments and methods as of `mjsim.stepping.JointedBall`."""

    def __init__(
        self, model: Any, p: Parameters, x: npt.ArrayLike, settings: ContactSettings, theta_0: float,
        share: float = Law.share,
    ) -> None:  # fmt: skip
        from mjsim import compiled  # here, because it has this module compiled

        self._steps = compiled.steps
        self.model = model = copy.copy(model)  # its wall moves
        self.data = mujoco.MjData(model)
        self.p, self.theta, self._timestep = p, theta_0, settings.timestep
        self.law = Coulomb(self.model, rigid=True, share=share) if settings.rigid else None
        self.lead = settings.timestep / 2 if self.law else 0.0
        data, wall = self.data, self.model.body("wall") if self.law else None
        self.body = Body(
            qpos=data.qpos,
            qvel=data.qvel,
            last=data.qacc_warmstart,
            applied=data.qfrc_applied,
            sensors=data.sensordata,
            wall=wall.quat if wall else data.mocap_quat[0],
            at=wall and wall.pos,
            heavy=float(model.dof_M0[-1]),
            margins=model.pair_margin,
            ball=Ball(*map(float, Ball.of(p, settings))),
            served=self.law and compiled.served(self.law, data),
        )
        self.place(x, theta_0)

    def place(self, x: npt.ArrayLike, theta: float) -> None:
        """Begin anew in a state."""
        mujoco.mj_resetData(self.model, self.data)
        if self.law:
            self.law.reset()
        now, x, self.theta = to_world(x, theta, self.p), State.of(x), theta
        place = now.position
        if self.lead:
            there = x._replace(y=x.y + self.lead * x.v_y, h=x.h + self.lead * x.v_h)
            place = to_world(there, theta + self.lead * float(x.omega_c), self.p).position
        self.data.qpos[:7] = [*place, 1.0, 0.0, 0.0, 0.0]
        self.data.qvel[:6] = [*now.velocity, *now.spin]

    def advance(self, fluid: Array, rows: Array) -> None:
        """Take a step for each omega_0, noted in rows (steps, `COLUMNS`)."""
        if self.law:
            self.theta = self._steps(self.body, self._timestep, fluid, self.theta, rows)
            return
        for row, omega_0 in zip(rows, fluid.tolist(), strict=True):
            self._soft_step(omega_0, row)

    def _soft_step(self, omega_0: float, row: Array) -> None:
        data, ball = self.data, self.body.ball
        place, turned, velocity = data.qpos[:3].tolist(), data.qpos[3:7].tolist(), data.qvel[:6].tolist()
        note(row, place + turned, velocity, 0.0, ball)
        data.qfrc_applied[:] = driven(place, turned, velocity, [0.0] * 6, 0.0, omega_0, ball)
        row[0] = self.theta = unwrapped(math.atan2(place[1], place[0]), self.theta)
        mujoco.mj_step(self.model, data)
        row[_SEEN:] = *data.sensordata, row[2], row[1]

    @property
    def margins(self) -> Array:
        """Margins of both contacts, m: zero, since there are none."""
        return np.zeros(2)

    def state(self) -> dict[str, Array]:
        """Copies of all that is carried from one step to the next."""
        kept = np.empty(mujoco.mj_stateSize(self.model, _INTEGRATION))
        mujoco.mj_getState(self.model, self.data, kept, _INTEGRATION)
        return {"integration": kept, "azimuth": np.array(self.theta)} | (self.law.state() if self.law else {})

    def restore(self, state: dict[str, Array]) -> None:
        """Go on from such a state."""
        mujoco.mj_setState(self.model, self.data, state["integration"], _INTEGRATION)
        self.theta = float(state["azimuth"])
        if self.law:
            self.law.restore(state)
