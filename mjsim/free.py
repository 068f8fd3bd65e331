"""The ball on a free joint, which may cross the axis, under Coulomb's law: whole runs, and landings
of balls on joints.

The law is `mjsim.Coulomb`, rigid, which serves any model and knows nothing of this one; of what is
done between the steps there is drag alone. Semi-implicit steps are leapfrog: places are half a step
ahead of velocities. The wall is a block that is turned to the ball before each step and moves
during it as a cylinder does past the ball (`against`). A ball that lands, or comes near the
vessel's axis, takes that step in shorter ones (`through`)."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import mujoco
import numpy as np

from mjsim import recorder, scene
from mjsim.contact_settings import ContactSettings
from mjsim.corrections import Ball
from mjsim.coulomb import Coulomb
from mjsim.coulomb.compiling import entry
from mjsim.coulomb.engine import mj_step, models
from mjsim.coulomb.step import start_anew
from mjsim.world_axes import against, driven, joint_velocities, slip, spun, unwrapped
from model import Parameters, State
from model.arrays import Array
from model.kinematics import to_world

FINE = 1024
"""The step in which a contact closes is that part of one of the settings;"""
COARSE = 64
"""the longest after a blow is that one, which they come to by doubling;"""
_FIRST = 8
"""and the longest before one."""
_SHARE = 5e-3
"""`share` of the law: contact forces must be steady enough for their change in a step to be
told."""
_MEAN = 4
"""Steps over which contact forces are taken: they may go up and down from step to step."""
_TOUCHES = 1e-6
"""Gap of a contact that touches, in units of R."""
_LEAST = 16
"""A blow just after the beginning or before the end of a whole step has a step shorter by up to
that."""

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
    """Addresses of the engine's model and data, and of what the law remembers."""


def step(body: Body, duration: float, anew: bool, omega_0: float, theta: float, seen: Any) -> float:
    """Take a step of so many seconds under Coulomb's law, places half of it ahead of velocities;
    `seen` gets sensors.

    `theta` is the azimuth before the last step; that before this one is returned.
    """
    ahead, ball, qpos, qvel, applied = duration / 2, body.ball, body.qpos, body.qvel, body.applied
    forces = driven(qpos, qpos[3:], qvel, body.last, ahead, omega_0, ball)
    for i in range(6):
        applied[i] = forces[i]
    theta = unwrapped(math.atan2(qpos[1], qpos[0]), theta)
    body.wall[0], body.wall[3] = math.cos(theta / 2), math.sin(theta / 2)
    spin = spun(qpos[3:], qvel)
    A_x, A_y, B_x, B_y = slip(qpos, qvel, spin, ahead, ball)
    inwards, onwards, up = against(qpos, qvel, spin, ahead, ball.R, ball.r)
    qvel[6], qvel[7], qvel[8] = -inwards, onwards, -up
    applied[6], applied[8] = body.heavy / ahead * inwards, body.heavy / ahead * up
    body.at[2], qpos[7], qpos[8], qpos[9] = qpos[2], 0.0, 0.0, 0.0
    models(body.served[0], 1)[0].opt.timestep = duration
    if anew:
        start_anew(body.served[2])
    mj_step(body.served[0], body.served[1])
    for i in range(len(body.sensors)):
        seen[i] = body.sensors[i]
    # the engine has them of a wall that is ahead
    seen[_A_x], seen[_A_y], seen[_B_x], seen[_B_y] = A_x, A_y, B_x, B_y
    return theta


@entry
def steps(body: Body, duration: float, fluid: Array, theta: float, rows: Array) -> float:
    """Take a `step` for each omega_0, noted in rows (steps, `COLUMNS`) as those of a ball on
    joints."""
    for number in range(len(fluid)):
        row = rows[number]
        qpos = (
            body.qpos
        )  # half a step ahead of velocities, and these along the axes of where the ball was
        row[1], row[2] = body.ball.R - math.hypot(qpos[0], qpos[1]), qpos[2] - body.ball.r
        velocities = joint_velocities(qpos, qpos[3:], body.qvel, duration / 2)
        for i in range(6):
            row[_PLACE + i] = velocities[i]
        theta = step(body, duration, False, fluid[number], theta, row[_SEEN:])
        row[0] = theta
    return theta


def closes(gap: float, speed: float, rate: float, fall: float) -> float:
    """Time until a gap closes faster than `fall`, s; infinite if it doesn't."""
    if gap <= 0:
        return 0.0 if speed < -fall else math.inf
    square = speed * speed - 2 * rate * gap
    root = math.sqrt(max(square, 0.0))
    return 2 * gap / (root - speed) if square > fall * fall and root > speed else math.inf


def average(means: Any, sensors: Any, count: int) -> None:
    """Update means of force sensors over `count` steps by those of one more; axes are those of the
    last contact."""
    for contact in range(0, 28, 14):
        for i in range(contact + 1, contact + 4):
            means[i] = (count * means[i] + sensors[i]) / (count + 1)
        for i in range(contact + 5, contact + 11 if sensors[contact] > 0 else 0):
            means[i] = sensors[i]


@entry
def through(
    body: Body, whole: float, longest: float, fall: float, reach: float, omega_0: float, theta: float,
    rates: tuple[float, float], seen: Any,
) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...], float, float]:  # fmt: skip
    """Take a ball through one whole step in short ones that end at its landings; place and
    velocities at one time.

    A contact that closes faster than `fall` does so in the middle of a short step: of a blow that
    two steps share, friction, which turns, would have two directions. Until then it isn't seen;
    others are within `reach`, m. `rates` are what a second changes of the speeds of h and y, m s-2.

    `seen` gets the sensors at the beginning (after a landing in the first fine step), their means
    over `_MEAN` steps half a whole one before the end, or after the last blow, and at the end; and
    has room for a row.

    Returns
    -------
    azimuth, h and y; velocities of the joints, and those before the last step; its duration; time
    between what was seen last, or 0, s"""
    qpos, qvel, last, ball, margins = body.qpos, body.qvel, body.last, body.ball, body.margins
    rate_h, rate_y = rates
    left, growing, finest, shown, first, latest = whole, longest, whole / FINE, False, 0, 0
    velocity = joint_velocities(qpos, qpos[3:], qvel, 0.0)
    before, duration, blow, anew, since = velocity, 0.0, False, True, 0.0
    while left > 1e-9 * whole:
        soon_h = closes(ball.R - math.hypot(qpos[0], qpos[1]), velocity[1], rate_h, fall)
        soon_y = closes(qpos[2] - ball.r, velocity[2], rate_y, fall)
        soon = min(soon_h, soon_y)
        own = min(max(2 * min(soon, left - soon), finest / _LEAST), finest)
        blow = soon <= 0.55 * own
        margins[0] = 0.0 if soon_y < math.inf and not (blow and soon_y == soon) else reach
        margins[1] = 0.0 if soon_h < math.inf and not (blow and soon_h == soon) else reach
        span = max(min(left, soon - own / 2), own / 4)
        duration = own if blow else span / math.ceil(span / growing - 1e-9)
        ahead = duration / 2
        for i in range(3):
            qpos[i] += ahead * (qvel[i] + ahead / 2 * last[i])
        if blow:  # of contacts that touch, too, gaps are nothing: divided by a short step they would be speeds
            rho, least = math.hypot(qpos[0], qpos[1]), _TOUCHES * ball.R
            if soon_y == soon or abs(qpos[2] - ball.r) < least:
                qpos[2] = ball.r
            if soon_h == soon or abs(ball.R - rho) < least:
                qpos[0], qpos[1] = qpos[0] * ball.R / rho, qpos[1] * ball.R / rho
        begin, before = whole - left, velocity
        theta = step(body, duration, anew, omega_0, theta, seen[3])
        if blow:
            longest, growing, first, latest, since = whole / COARSE, finest / 2, 0, 0, 0.0
            for i in range(6):
                last[i] = 0.0
        elif not shown and duration >= finest / 2:
            shown = True
            seen[0] = seen[3]
        for i in range(3):
            qpos[i] -= ahead * (qvel[i] + ahead / 2 * last[i])
        velocity = joint_velocities(qpos, qpos[3:], qvel, 0.0)
        rate_h = 0.0 if blow else (velocity[1] - before[1]) / duration
        rate_y = 0.0 if blow else (velocity[2] - before[2]) / duration
        late = begin >= 0.499 * whole or longest > whole / COARSE
        if not blow and growing == longest and late and first < _MEAN:
            average(seen[1], seen[3], first)
            first, since = first + 1, since - (begin + ahead) / _MEAN
        if not blow and left < (_MEAN + 0.5) * duration and latest < _MEAN:
            average(seen[2], seen[3], latest)
            latest, since = latest + 1, since + (begin + ahead) / _MEAN
        left, anew = left - duration, blow
        growing = min(2 * growing, longest)
    rho = math.hypot(qpos[0], qpos[1])
    place = unwrapped(math.atan2(qpos[1], qpos[0]), theta), ball.R - rho, qpos[2] - ball.r
    return place, velocity, before, duration, since if first == latest == _MEAN else 0.0


class FreeBall:
    """A ball on a free joint, with an engine of its own; arguments and methods as of
    `mjsim.stepping.JointedBall`.

    `law`: numbers of `mjsim.Coulomb`.
    """

    def __init__(
        self,
        model: Any,
        p: Parameters,
        settings: ContactSettings,
        x: State,
        theta_0: float,
        **law: float,
    ) -> None:
        self.p, self._timestep, self.lead = p, settings.timestep, settings.timestep / 2
        self.model, self.data = model, mujoco.MjData(model)
        self.law = Coulomb(model, rigid=True, **law)
        data, wall = self.data, model.body("wall")
        self.body = Body(
            qpos=data.qpos,
            qvel=data.qvel,
            last=data.qacc_warmstart,
            applied=data.qfrc_applied,
            sensors=data.sensordata,
            wall=wall.quat,
            at=wall.pos,
            heavy=float(model.dof_M0[-1]),
            margins=model.pair_margin,
            ball=Ball(*map(float, Ball.of(p, settings))),
            served=self.law.addresses(data),
        )
        self.place(x, theta_0)

    def place(self, x: State, theta: float) -> None:
        """Put the ball in a state at an azimuth, as for a new run: nothing is remembered."""
        mujoco.mj_resetData(self.model, self.data)
        self.law.reset()
        now, self.theta = to_world(x, theta, self.p), theta
        place = now.position
        if self.lead:
            there = x._replace(y=x.y + self.lead * x.v_y, h=x.h + self.lead * x.v_h)
            place = to_world(there, theta + self.lead * float(x.omega_c), self.p).position
        self.data.qpos[:7] = [*place, 1.0, 0.0, 0.0, 0.0]
        self.data.qvel[:6] = [*now.velocity, *now.spin]

    def advance(self, fluid: Array, rows: Array) -> None:
        """Take a step for each omega_0, noted in rows (steps, `COLUMNS`)."""
        with self.law.acting(self.data):
            self.theta = steps(self.body, self._timestep, fluid, self.theta, rows)

    def state(self) -> dict[str, Array]:
        """Copies of all that is carried from one step to the next, for `restore`."""
        kept = np.empty(mujoco.mj_stateSize(self.model, _INTEGRATION))
        mujoco.mj_getState(self.model, self.data, kept, _INTEGRATION)
        return {"integration": kept, "azimuth": np.array(self.theta)} | self.law.state(self.data)

    def restore(self, state: dict[str, Array]) -> None:
        """Go on from what `state` returned."""
        mujoco.mj_setState(self.model, self.data, state["integration"], _INTEGRATION)
        self.theta = float(state["azimuth"])
        self.law.restore(state, self.data)


class Fine:
    """A free ball that takes, in short steps, those steps of a jointed ball in which that lands."""

    def __init__(self, p: Parameters, settings: ContactSettings) -> None:
        self._p, self._whole, self._fall = p, settings.timestep, settings.slowest_fall(p.g)
        rigid = ContactSettings.rigid_at(settings.timestep / _FIRST)
        self._ball = FreeBall(scene.build(p, rigid)[0], p, rigid, State(), 0.0, share=_SHARE)
        self._ball.lead, self._reach = 0.0, float(self._ball.model.pair_margin.max())

    def step(
        self, x: State, theta: float, rates: Array, omega_0: float, finely: bool
    ) -> tuple[Array, Array, Array, Array, float, Array]:
        """Take a whole step in short ones from a state, with velocities of the joints that change
        at such rates.

        `finely` if there was a blow a short time ago, or none in a first step, whose forces are the
        start of all.

        Returns
        -------
        azimuth, h and y; velocities of the joints, and what a second changes of them; generalised
        forces of the contacts (6) and normal ones (2), as the engine has them, N and N m; what a
        component of the contact forces would change in a whole step at the pace of the end, at
        most, N; sensors at the beginning"""
        ball, seen = self._ball, np.zeros((4, recorder.NSENSOR))
        ball.place(x, theta)
        rho = self._p.R - float(x.h)
        if rho > self._p.R / 4:  # nearer to the axis it flies
            turn, (cos, sin) = float(x.omega_c), (math.cos(theta), math.sin(theta))
            away, along = -rates[1] - rho * turn * turn, rho * rates[0] - 2 * x.v_h * turn
            ball.body.last[:3] = away * cos - along * sin, away * sin + along * cos, rates[2]
        longest = self._whole / (COARSE if finely else _FIRST)
        given = (
            ball.body,
            self._whole,
            longest,
            self._fall,
            self._reach,
            omega_0,
            theta,
            (rates[1], rates[2]),
            seen,
        )
        with ball.law.acting(ball.data):
            place, velocity, before, duration, since = through(*given)
        v = np.array(velocity)
        first, last = recorder.forces(seen[1:3], np.array([place[0] - v[0] * since, place[0]]))
        (A_x, A_y, A_z), (B_x, B_y, B_z) = last
        forces = np.array([0, A_x + B_x, A_y + B_y, -self._p.r * A_z, self._p.r * B_z, 0, A_y, B_x])
        change = float(np.abs(last - first).max()) / since * self._whole if since > 0 else math.inf
        return np.array(place), v, (v - before) / duration, forces, change, seen[0]
