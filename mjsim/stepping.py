"""The ball on joints along the paper's coordinates, and the loop round MuJoCo's step.

Before a step the ball is set back to azimuth zero, where the wall is tangent, and drag and inertia
are those in its middle (`mjsim.mid_step`). All else is MuJoCo's: plain, or with rigid contacts
under `mjsim.Coulomb`, the law for any model. Under that semi-implicit steps are leapfrog, places
half a step ahead of velocities, and contacts are in sight long before they close, so that they need
no depth. The ball's axes are left to turn: set upright, contacts would seem to be fixed on it.
"""

from __future__ import annotations

import contextlib
import math
from contextlib import AbstractContextManager
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numba.extending import register_jitable

from mjsim import recorder, scene
from mjsim.contact_settings import LANDING_PARTS, ContactModel, RigidContacts
from mjsim.coulomb import Coulomb
from mjsim.coulomb.compiling import entry
from mjsim.coulomb.engine import mj_step, models
from mjsim.mid_step import BallConstants, Velocity, mid_step_forces, resistance
from mjsim.recorder import COORDINATES, NSENSOR, SENSORS
from model import Parameters, State
from model.arrays import Array

_NEAR, _PART, _MOST = 32.0, 0.25, 1024
"""Steps to the axis below which they are shorter, where it is nearer than that part of R; into how
many parts, at most, a step is divided."""
_SLOW, _LEAST, _AFTER = 32.0, 3e-2, 32
"""Slip, in units of its change in a step, up to which steps after a landing are divided, too: where
slip is slow, friction turns fast; the least change, in units of a fall in a step; for how many
steps. (Chosen after balls that hop had been seen.)"""
SHARE = 1e-6
"""`share` of the law: part of gravity to which the slip of contacts must be predicted."""
_NORMAL_A, _NORMAL_B = recorder.NORMALS
_SLIP_A, _, _SLIP_B, _ = recorder.SLIPS


class Joints(NamedTuple):
    """A ball on its joints: what the engine has in its memory, and what is ours."""

    qpos: Any
    qvel: Any
    applied: Any
    sensors: Any
    azimuth: Any
    """How far it was set back, rad, an array of one."""
    margins: Any
    """Gaps at which contacts are in sight, m."""
    last: Any
    """Velocities along the paper's axes a step ago."""
    slips: Any
    """Slip at A and B a step ago, along two tangents, m s-1."""
    landed: Any
    """How many more steps may be divided for a landing, an array of one."""
    g: float
    """m s-2"""
    ball: BallConstants
    ahead: float
    """Steps by which places, and forces, are ahead of velocities."""
    step: float
    """The time step, s."""
    model: int
    data: int
    """Addresses in the engine."""


def spin_axes(turned: Any) -> tuple[tuple[float, float, float], ...]:
    """The ball's axes along the paper's, as the rows of a matrix, from a quaternion."""
    w, a, b, c = float(turned[0]), float(turned[1]), float(turned[2]), float(turned[3])
    return (
        (w * w + a * a - b * b - c * c, 2 * (a * b - w * c), 2 * (a * c + w * b)),
        (2 * (a * b + w * c), w * w - a * a + b * b - c * c, 2 * (b * c - w * a)),
        (2 * (a * c - w * b), 2 * (b * c + w * a), w * w - a * a - b * b + c * c),
    )


def velocity_of(body: Joints) -> Velocity:
    """The velocities of the joints, the spin's along the paper's axes."""
    v, (x, y, z) = body.qvel, spin_axes(body.qpos[3:])
    a, b, c = float(v[3]), float(v[4]), float(v[5])
    return Velocity(
        float(v[0]), float(v[1]), float(v[2]),
        x[0] * a + x[1] * b + x[2] * c, y[0] * a + y[1] * b + y[2] * c, z[0] * a + z[1] * b + z[2] *
        c,
    )  # fmt: skip


def lands(body: Joints) -> bool:
    """Whether the ball comes to touch floor or wall in the next step, faster than by the fall of a
    part of it; or has done so, and slips slowly. Notes how it slips."""
    fall, lands, slow = body.g * body.step, False, False
    for k, i, normal, slip in ((0, 2, _NORMAL_A, _SLIP_A), (1, 1, _NORMAL_B, _SLIP_B)):
        v, closed = body.qvel[i], body.sensors[normal] > 0
        way = body.step * (2 * v - body.last[i])  # if it goes on as in the last step
        lands |= not closed and v < -fall / LANDING_PARTS and body.qpos[i] + way < 0
        one, other = body.sensors[slip], body.sensors[slip + 1]
        change = math.hypot(one - body.slips[k, 0], other - body.slips[k, 1])
        slow |= closed and change > _LEAST * fall and math.hypot(one, other) < _SLOW * change
        body.slips[k, 0], body.slips[k, 1] = one, other
    lands &= body.ahead > 0
    body.landed[0] = _AFTER if lands else max(body.landed[0] - 1, 0)
    return lands or (slow and body.landed[0] > 0)


def stop_landing(body: Joints) -> None:
    """Stop a ball where it touches floor or wall, if it would overlap what it didn't touch in the
    last step, so that one step has all of the impact."""
    for i, normal in ((1, _NORMAL_B), (2, _NORMAL_A)):
        if body.ahead > 0 and body.qpos[i] < 0 and body.sensors[normal] == 0:
            body.qpos[i] = 0.0


def take_step(body: Joints, step: float, omega_0: float) -> None:
    """Take a step of so many seconds."""
    qpos, applied, last, v = body.qpos, body.applied, body.last, velocity_of(body)
    stop_landing(body)
    body.azimuth[0] += qpos[0]
    qpos[0] = 0.0
    before = Velocity(last[0], last[1], last[2], last[3], last[4], last[5])
    rho = body.ball.R - float(qpos[1])
    force = mid_step_forces(v, before, rho, omega_0, body.ahead, step, body.ball)
    x, y, z = spin_axes(qpos[3:])
    for i in range(3):
        applied[i] = force[i]
        applied[3 + i] = x[i] * force[3] + y[i] * force[4] + z[i] * force[5]
    falls_on_A = v.v_y < 0 and body.sensors[_NORMAL_A] == 0
    falls_on_B = v.v_h < 0 and body.sensors[_NORMAL_B] == 0
    mj_step(body.model, body.data)
    if (falls_on_A and body.sensors[_NORMAL_A] > 0) or (falls_on_B and body.sensors[_NORMAL_B] > 0):
        v = velocity_of(body)  # of an impact nothing is extrapolated
    for i in range(6):
        last[i] = v[i]


def change_step(body: Joints, old: float, new: float) -> None:
    """Go on in steps of another length, s: places stay ahead by the same part of a step, and
    margins are what a fall makes in one."""
    v = velocity_of(body)
    for i in range(COORDINATES):
        body.qpos[i] += body.ahead * (new - old) * body.qvel[i]
    for i in range(6):
        body.last[i] = v[i] - new / old * (v[i] - body.last[i])
    for i in range(len(body.margins)):
        body.margins[i] *= (new / old) ** 2
    models(body.model, 1)[0].opt.timestep = new


def parts(body: Joints) -> int:
    """In how many steps one is divided: a power of two, so that the ball has `_NEAR` of them to go
    to the axis; `LANDING_PARTS` where it lands; else 1."""
    rho, v_h = body.ball.R - float(body.qpos[1]), float(body.qvel[1])
    along = rho * float(body.qvel[0])
    way, speed, count = 0.0, math.hypot(v_h, along), LANDING_PARTS if lands(body) else 1
    if rho < _PART * body.ball.R:
        way = _NEAR * body.step * speed
    nearest = max(rho - body.step * speed, rho * abs(along) / max(speed, 1e-300))
    while count * nearest < way and count <= _MOST:
        count *= 2
    return count


_OURS: Any = spin_axes, velocity_of, lands, stop_landing, take_step, change_step, parts
for _plain in (*_OURS, mid_step_forces, resistance):
    register_jitable(_plain)


@entry
def advance(body: Joints, fluid: Array, rows: Array) -> None:
    """Take a step for each omega_0, noted in rows (steps, `COLUMNS`).

    Place and velocities are those before the step, sensors those in it. All is nan of a ball that
    has come to the axis, where its coordinates end.
    """
    for done in range(len(fluid)):
        row, v, count = rows[done], velocity_of(body), parts(body)
        for i in range(COORDINATES):
            row[i] = body.qpos[i]
        row[0] += body.azimuth[0]
        for i in range(6):
            row[COORDINATES + i] = v[i]
        if count > _MOST:
            rows[done:] = math.nan
            return
        short = body.step / count
        if count > 1:
            change_step(body, body.step, short)
        for k in range(count):
            take_step(body, short, float(fluid[done]))
            for i in range(NSENSOR if k == 0 else 0):
                row[SENSORS + i] = body.sensors[i]
        if count > 1:
            change_step(body, short, body.step)


_MOST_BALLS = 64
"""Balls that are kept for later runs, at most: it takes a millisecond to make one."""
BALLS: dict[tuple[Parameters, ContactModel], JointedBall] = {}
"""Balls whose runs are over, by what they were made of, the latest last."""


def ball_of(p: Parameters, settings: ContactModel) -> JointedBall:
    """A ball with these parameters that no other run has; omega_0 is 0."""
    return BALLS.pop((p, settings), None) or JointedBall(scene.build(p, settings)[0], p, settings)


def give_back(ball: JointedBall, settings: ContactModel) -> None:
    """Keep a ball whose run is over."""
    BALLS[ball.p, settings] = ball
    for oldest in list(BALLS)[:-_MOST_BALLS]:
        BALLS.pop(oldest, None)  # another thread may have it


class JointedBall:
    """A ball on joints, with an engine of its own. It has to `start`.

    Parameters
    ----------
    model : of its own, since its wall moves
    p : omega_0 is that of the steps
    """

    def __init__(self, model: Any, p: Parameters, settings: ContactModel) -> None:
        self.model, self.data, self.p = model, mujoco.MjData(model), p
        data, self.law = self.data, None
        if isinstance(settings, RigidContacts):
            self.law = Coulomb(model, rigid=True, depth=0.0, share=SHARE)
            model.pair_margin[:] = p.g * settings.timestep**2
        self.lead = settings.midpoint * settings.timestep
        """How far places are ahead of velocities, s."""
        self.body = Joints(
            qpos=data.qpos,
            qvel=data.qvel,
            applied=data.qfrc_applied,
            sensors=data.sensordata,
            azimuth=np.zeros(1),
            margins=model.pair_margin,
            last=np.zeros(6),
            slips=np.zeros((2, 2)),
            landed=np.zeros(1, int),
            g=p.g,
            ball=BallConstants(*map(float, BallConstants.of(p))),
            ahead=settings.midpoint,
            step=settings.timestep,
            model=model._address,
            data=data._address,
        )

    def start(self, x: State, theta_0: float) -> None:
        """Begin a run with a state, at an azimuth in rad; nothing is left of an earlier one."""
        mujoco.mj_resetData(self.model, self.data)
        if self.law:
            self.law.reset()
        place, v = recorder.joint_state(x, self.p)
        body = self.body
        body.qpos[:3], body.qvel[:], body.last[:] = place + self.lead * v[:3], v, v
        body.azimuth[:], body.slips[:], body.landed[:] = theta_0, 0.0, 0

    def acting(self) -> AbstractContextManager[None]:
        """Within this the engine's own steps obey the law, if there is one."""
        return self.law.acting(self.data) if self.law else contextlib.nullcontext()

    def advance(self, fluid: Array, rows: Array) -> None:
        """Take a step for each omega_0, noted in rows (steps, `COLUMNS`)."""
        with self.acting():
            advance(self.body, fluid, rows)
