"""The ball on a free joint, for comparison with the joint chain.

A free ball takes the curve of the wall from the engine: the more independent witness and the less accurate one, since
MuJoCo leaves the turning of the contact frame out of what drives the contact (J' v). It may cross the axis. Of the
corrections between the steps only drag, the turning of the wall and the servo of the margins apply to it.

With ``law="rigid"`` its contacts obey `mjsim.Coulomb`, which serves any model and knows nothing of this one.
Semi-implicit steps are leapfrog: places are half a step ahead of velocities. The wall is a block that is turned to the
ball before each step and moves during it as a cylinder does past the ball (`against`).
"""

from __future__ import annotations

import copy
import functools
import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from mjsim import recorder
from mjsim.contact_settings import ContactSettings
from mjsim.corrections import Ball, followed
from mjsim.coulomb import Coulomb
from mjsim.world_axes import against, driven, outwards, slip, spun, unwrapped
from model import Parameters, State
from model.arrays import Array
from model.kinematics import to_world

_INTEGRATION = mujoco.mjtState.mjSTATE_INTEGRATION


@functools.cache
def loops() -> Callable[..., float] | None:
    """`mjsim.compiled_free.advance`, if numba is installed."""
    try:
        from mjsim.compiled_free import advance
    except ImportError:
        return None
    return advance


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
        self._balls = [FreeBall(*each, settings, theta_0) for each in zip(models, parameters, x0s, strict=True)]
        self.margins = np.zeros((2, len(models)))

    def advance(self, omega_0: Iterable[Array], sensors: Array | None = None, row: Array | None = None) -> None:
        if row is not None:
            row[:, : recorder.SENSORS] = [ball.joints() for ball in self._balls]
        fluid = np.array(list(omega_0))
        seen = np.empty((*fluid.shape, recorder.NSENSOR)) if sensors is None else sensors
        for k, ball in enumerate(self._balls):
            ball.advance(fluid[:, k], seen[:, k])
            self.margins[:, k] = ball.model.pair_margin[:2]
        if row is not None and sensors is not None:
            row[:, recorder.SENSORS : -1] = sensors[0]
            row[:, -1] = [ball.ahead for ball in self._balls]

    def state(self) -> dict[str, Array]:
        kept = np.empty((len(self._balls), mujoco.mj_stateSize(self._balls[0].model, _INTEGRATION)))
        for ball, own in zip(self._balls, kept, strict=True):
            mujoco.mj_getState(ball.model, ball.data, own, _INTEGRATION)
        laws = [(k, *kept) for k, ball in enumerate(self._balls) for kept in ball.law_state().items()]
        return {f"{name}_{k}": values for k, name, values in laws} | {
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
            if ball.law:
                ball.law.restore({name: state[f"{name}_{k}"] for name in ball.law_state()})


class FreeBall:
    """One of them, with an engine of its own."""

    def __init__(self, model: Any, p: Parameters, x: npt.ArrayLike, settings: ContactSettings, theta_0: float) -> None:
        self.model = copy.copy(model)  # its margins move
        self.data = mujoco.MjData(self.model)
        self.p, self.theta = p, theta_0
        self._ball = Ball(*map(float, Ball.of(p, settings)))
        self.law = Coulomb(self.model, rigid=True) if settings.rigid else None
        self.ahead = settings.timestep / 2 if self.law else 0.0
        self.place(x, theta_0)
        self._turns = settings.wall == "tangent"
        wall = self.model.body("wall") if self.law else None
        self._wall = wall.quat if wall else self.data.mocap_quat[0]
        self._at = wall.pos if wall else np.zeros(3)
        self._reach = settings.touching(p.g)
        self._served: tuple[int, ...] = ()

    def place(self, x: npt.ArrayLike, theta: float) -> None:
        """Begin anew in a state."""
        mujoco.mj_resetData(self.model, self.data)
        if self.law:
            self.law.reset()
        now, x, self.theta = to_world(x, theta, self.p), State.of(x), theta
        there = x._replace(y=x.y + self.ahead * x.v_y, h=x.h + self.ahead * x.v_h)
        place = to_world(there, theta + self.ahead * float(x.omega_c), self.p).position
        self.data.qpos[:7] = [*place, 1.0, 0.0, 0.0, 0.0]
        self.data.qvel[:6] = [*now.velocity, *now.spin]

    def joints(self) -> tuple[float, ...]:
        """Coordinates and velocities of the joint chain, with the orientation upright, as `recorder` has them.

        The place is `ahead` of the velocities; these are along the axes of where the ball was.
        """
        place, velocity = self.data.qpos[:3].tolist(), self.data.qvel[:6].tolist()
        spin, (out_x, out_y) = spun(self.data.qpos[3:7].tolist(), velocity), outwards(place, velocity, self.ahead)
        self.unwrap(math.atan2(place[1], place[0]))
        rho, (v_x, v_y, v_z) = math.hypot(place[0], place[1]), velocity[:3]
        omega_c = (out_x * v_y - out_y * v_x) / rho if rho > 0 else math.nan
        joints = self.theta, self.p.R - rho, place[2] - self.p.r, 1.0, 0.0, 0.0, 0.0
        speeds = omega_c, -out_x * v_x - out_y * v_y, v_z
        return (
            *joints,
            *speeds,
            -out_x * spin[0] - out_y * spin[1],
            spin[2] - omega_c,
            out_x * spin[1] - out_y * spin[0],
        )

    def law_state(self) -> dict[str, Array]:
        """What the law of rigid contacts remembers, if there is one."""
        return self.law.state() if self.law else {}

    def advance(self, fluid: Array, seen: Array) -> None:
        """Take a step for each omega_0; `seen` (steps, `NSENSOR`) takes the sensors and the gaps of A and B, m."""
        if self.law and (loop := loops()):
            self._served = self._served or self.law.addresses(self.data)
            given = self._served, self.data, self._wall, self._at, self._ball, self.ahead
            self.theta = loop(*given, fluid, seen, self.theta)
            return
        for row, omega_0 in zip(seen, fluid.tolist(), strict=False):
            self._step(omega_0, row)

    def _step(self, omega_0: float, seen: Array) -> None:
        data, p, gain = self.data, self.p, self._ball.gain
        place, turned, velocity = data.qpos[:3].tolist(), data.qpos[3:7].tolist(), data.qvel[:6].tolist()
        last = data.qacc_warmstart[:6].tolist()
        data.qfrc_applied[:6] = driven(place, turned, velocity, last, self.ahead, omega_0, self._ball)
        gaps = place[2] - p.r, p.R - math.hypot(place[0], place[1])
        self.unwrap(math.atan2(place[1], place[0]))
        if self._turns:
            self._wall[:] = (math.cos(self.theta / 2), 0.0, 0.0, math.sin(self.theta / 2))
        if gain:
            for contact, gap in enumerate(gaps):
                if gap < self._reach:
                    self.model.pair_margin[contact] = followed(self.model.pair_margin[contact], gap, gain)
        if self.law:
            spin = spun(turned, velocity)
            inwards, onwards, up = against(place, velocity, spin, self.ahead, p.R, p.r)
            self._at[2], data.qpos[7:], data.qvel[6:] = place[2], 0.0, (-inwards, onwards, -up)
            data.qfrc_applied[[6, 8]] = (
                self.model.dof_M0[6] / self.ahead * inwards,
                self.model.dof_M0[8] / self.ahead * up,
            )
            self.law.step(data)
        else:
            mujoco.mj_step(self.model, data)
        seen[:] = *data.sensordata, *gaps
        if self.law:  # the engine has them of a wall that is ahead
            seen[recorder.SLIPS - recorder.SENSORS] = slip(place, velocity, spin, self.ahead, self._ball)

    def unwrap(self, azimuth: float) -> None:
        """Take the turn of this azimuth that is nearest to the last one; leave it in a run that has diverged."""
        self.theta = unwrapped(azimuth, self.theta)
