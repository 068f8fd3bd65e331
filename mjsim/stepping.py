"""Balls on joints along the paper's coordinates, and the loop round MuJoCo's step.

Before each step the wall is turned to be tangent at the ball's azimuth, the margins follow the gaps, and
`mjsim.corrections` says what drives the step. The body axes of a homogeneous ball are arbitrary: they are set upright,
so that forces and velocities of the ball's joint are along the paper's axes. Positions are kept half a step ahead of
velocities (leapfrog).

A ball that lands in a step, or comes near the axis, where polar coordinates end, takes it as `mjsim.landing` says; so
it does the first one, which finds the margins and forces that belong to the start.

The same text runs in plain Python, or compiled (`mjsim.compiled`). Contacts are in the order A, B.
"""

from __future__ import annotations

import copy
import functools
import math
from typing import TYPE_CHECKING, Any, NamedTuple

import mujoco
import numpy as np
import numpy.typing as npt

from mjsim import recorder
from mjsim.contact_settings import ContactSettings
from mjsim.corrections import Ball, Velocity, corrections, eventful, followed, near_axis
from mjsim.recorder import COORDINATES, NORMALS, NSENSOR, SENSORS
from model import Parameters, State
from model.arrays import Array

if TYPE_CHECKING:
    from mjsim.landing import Fine

HUGE = 1e10
"""Beyond this MuJoCo takes a coordinate for divergence (mjMAXVAL)."""
_CHANGE = 0.5
"""Most that contact forces may change in a step before the ball goes on upon its joints, in units of what the
largest force, at least that of gravity and the wall's friction, does as the ball goes round."""
NOT, LANDS, GOES_ON, BEGINS = range(4)
"""Whether a ball takes the next step in fine ones: not; as it lands; in the shortest, as it did the last one; or in
these as the first of all, without a blow, after which it goes on upon its joints however forces change."""
_DUE, _HELD = 0, 1
_NORMAL_A, _NORMAL_B = range(NSENSOR)[NORMALS]
"""Where sensors have the normal forces."""


class Joints(NamedTuple):
    """A ball on its joints: what the engine has in its memory, and from `last` on what is ours."""

    qpos: Any
    qvel: Any
    start: Any
    """Accelerations from which the solver starts."""
    margins: Any
    """Of the contacts, m."""
    contact: Any
    """Generalised forces of the contacts: the second to the fifth are inward, upward, moments about x and y."""
    sensors: Any
    applied: Any
    adhesion: Any
    """By how much the engine tells that contacts bear less than they do, N."""
    turn: Any
    """Quaternion of floor and wall;"""
    floor: Any
    wall: Any
    """and their surface velocities, m s-1."""
    last: Any
    """Velocities a step ago."""
    forces: Any
    """Generalised forces of the contacts in the last step (6), N and N m, and normal ones (2), N."""
    marks: Any
    """Whether the next step is due to be taken in fine ones, and whether the last one was, with its forces held."""
    ball: Ball
    served: Any
    """What takes a step, see `engine_step`."""


def seen_forces(body: Joints) -> None:
    """Take the contact forces of the last step from the engine, unless it wasn't the engine's."""
    if body.marks[_HELD] == 0:
        for i in range(6):
            body.forces[i] = body.contact[i]
        body.forces[6] = body.sensors[_NORMAL_A] + body.adhesion[0]
        body.forces[7] = body.sensors[_NORMAL_B] + body.adhesion[1]


def drive(omega_0: float, row: Any, body: Joints) -> None:
    """Let the margins follow the gaps and set what drives the next step; say if the ball is due to land in it.

    The row begins with place and velocities; to the sensors that follow is to be added what they leave out of the
    normal forces.
    """
    qpos, forces, margins, applied, ball = body.qpos, body.forces, body.margins, body.applied, body.ball
    seen_forces(body)
    v, before = velocity_of(body.qvel), velocity_of(body.last)
    theta, h, y = float(qpos[0]), float(qpos[1]), float(qpos[2])
    given = float(forces[1]), float(forces[2]), float(forces[3]), float(forces[4])
    loads = float(forces[6]), float(forces[7])
    if body.marks[_DUE] == NOT and loads[0] * loads[1] == 0 and eventful(h, y, v, before, loads, ball):
        body.marks[_DUE] = LANDS
    if ball.gain > 0:
        margins[0], margins[1] = followed(float(margins[0]), y, ball.gain), followed(float(margins[1]), h, ball.gain)
    body.turn[0], body.turn[3] = math.cos(theta / 2), math.sin(theta / 2)
    qpos[3], qpos[4], qpos[5], qpos[6] = 1.0, 0.0, 0.0, 0.0
    driving, surfaces, (lift_A, lift_B) = corrections(v, before, ball.R - h, omega_0, given, loads, ball)
    for i in range(COORDINATES):
        row[i] = qpos[i]
    for i in range(6):
        row[COORDINATES + i], applied[i] = body.qvel[i], driving[i]
    body.floor[0], body.floor[1], body.wall[0], body.wall[1] = surfaces
    # Adhesion of a contact adds R times itself to the reference acceleration of its normal row, and pulls the body
    # by as much. With the pull taken back, minus what slip would take from the contact leaves De Saxce's share.
    lift_A, lift_B = lift_A * (y < margins[0]), lift_B * (h < margins[1])
    body.adhesion[0], body.adhesion[1] = -lift_A, -lift_B
    for i in range(SENSORS, SENSORS + NSENSOR):
        row[i] = 0.0
    row[SENSORS + _NORMAL_A], row[SENSORS + _NORMAL_B] = -lift_A, -lift_B
    applied[1] -= lift_B
    applied[2] -= lift_A


def up_to_landing(body: Joints, fluid: Array, rows: Array, done: int) -> int:
    """Take a step for each omega_0 from number `done` on, up to one with a landing: the number of that.

    Steps are noted in rows (steps, `COLUMNS`); a ball that has diverged takes none."""
    while done < len(fluid):
        row = rows[done]
        drive(float(fluid[done]), row, body)
        if body.marks[_DUE] != NOT and sound(body):
            return done
        for i in range(6):
            body.last[i] = body.qvel[i]
        body.marks[_DUE] = body.marks[_HELD] = 0
        engine_step(body.served)
        for i in range(NSENSOR):
            row[SENSORS + i] += body.sensors[i]
        done += 1
    return done


def sound(body: Joints) -> bool:
    """Whether place and velocities are numbers of a motion."""
    found = True
    for i in range(6):
        found = found and abs(body.qpos[i]) < HUGE and abs(body.qvel[i]) < HUGE
    return found


def velocity_of(v: Any) -> Velocity:
    """Six numbers of the joints as named velocities."""
    return Velocity(float(v[0]), float(v[1]), float(v[2]), float(v[3]), float(v[4]), float(v[5]))


def engine_step(served: Any) -> None:
    """A step of MuJoCo's; compiled, model and data are known by their addresses."""
    mujoco.mj_step(*served)


class Engine:
    """What balls of equal parameters share, one after the other: MuJoCo, and what takes fine steps."""

    def __init__(self, model: Any, p: Parameters, settings: ContactSettings) -> None:
        from mjsim import compiled  # here, because numba takes long to load, and it has this module compiled

        self.model = model = copy.copy(model)  # its wall moves
        self.data = data = mujoco.MjData(model)
        self.up_to_landing, self.p, self.settings = compiled.up_to_landing, p, settings
        floor, wall = (model.geom_surfacevel[model.geom(name).id, :2] for name in ("floor", "wall"))
        self.body = Joints(
            *(data.qpos, data.qvel, data.qacc_warmstart, model.pair_margin[:2], data.qfrc_constraint),
            *(data.sensordata, data.qfrc_applied, model.pair_adhesion[:2], data.mocap_quat[0], floor, wall),
            *(np.zeros(6), np.zeros(8), np.zeros(2, np.int8)),
            Ball(*map(float, Ball.of(p, settings))),
            compiled.served_plain(model, data),
        )

    @functools.cached_property
    def fine(self) -> Fine:
        from mjsim.landing import Fine  # here, because the law takes long to load

        return Fine(self.p, self.settings)


class JointedBall:
    """One of them.

    Parameters
    ----------
    engine : its own, or shared with others of the same parameters
    x : full state (8,) at the start; omega_0 is that of the steps
    theta_0 : azimuth at the start, rad
    """

    def __init__(self, engine: Engine, x: npt.ArrayLike, theta_0: float) -> None:
        self.engine, self._p, self._settings, self._body = engine, engine.p, engine.settings, engine.body
        self._h, self.lead = self._settings.timestep, self._settings.timestep * self._settings.midpoint
        """The step, and how far places are ahead of velocities, s."""
        x, body = State.of(x), self._body
        place, v = recorder.joint_state(x, theta_0, self._p)
        fall = self._settings.slowest_fall(self._p.g)
        calm = all(speed >= -fall or gap > -self._h * speed for gap, speed in ((x.y, x.v_y), (x.h, x.v_h)))
        body.forces[:] = body.margins[:] = 0.0
        body.marks[_DUE] = (BEGINS if calm else LANDS) if self._settings.servo else NOT
        self._set(place, v, np.zeros(6))
        self._keep()

    def _set(self, place: Array, v: Array, rates: Array) -> None:
        """Go on from a place and velocities at one time, with such accelerations and the forces it has."""
        body = self._body
        body.qvel[:], body.last[:], body.start[:] = v, v - self._h * rates, rates
        body.qpos[:3] = place + self.lead * (v + rates * self.lead / 2)[:3]
        body.marks[_HELD] = 1

    def advance(self, fluid: Array, rows: Array) -> None:
        """Take a step for each omega_0, noted in rows (steps, `COLUMNS`)."""
        for name, values in self._kept.items():
            getattr(self._body, name)[:] = values
        done = 0
        while (done := self.engine.up_to_landing(self._body, fluid, rows, done)) < len(fluid):
            self._land(float(fluid[done]), rows[done])
            done += 1
        self._keep()

    def _land(self, omega_0: float, row: Array) -> None:
        """Take a step in fine ones, and go on upon the joints, if forces change slowly and the axis is far.

        The contacts get margins with which they bear their forces.
        """
        p, body, how = self._p, self._body, int(self._body.marks[_DUE])
        ahead, v = body.qpos[:3].copy(), body.qvel.copy()
        rates = (v - body.last) / self._h
        place = ahead - self.lead * (v + rates * self.lead / 2)[:3]
        x = recorder.state(place, v, p)
        landed = self.engine.fine.step(x, float(place[0]), rates, omega_0, how != LANDS)
        row[SENSORS:], row[-2:] = landed.seen, ahead[:0:-1]
        v = landed.velocity
        near = near_axis(p.R - landed.place[1], Velocity(*v), body.ball) and landed.forces[7] == 0
        pace = max(abs(v[0]), math.sqrt(p.g / p.R))
        most = max(p.m * (p.g + p.eta * p.R * pace**2), np.abs(landed.forces[[1, 2]]).max())
        fast = landed.change > _CHANGE * self._h * pace * most and how != BEGINS
        body.marks[_DUE] = GOES_ON if near or fast else NOT
        body.forces[:] = landed.forces
        self._set(landed.place, v, landed.rates * (not near))
        if self._settings.servo:
            loads = landed.forces[6:] / p.m
            body.margins[:] = np.maximum(landed.place[:0:-1] + self._settings.margin(loads), 0.0) * (loads > 0)

    def _keep(self) -> None:
        """Keep all that is carried from one step to the next, in an engine that others use."""
        seen_forces(self._body)
        self._body.marks[_HELD] = 1
        self._kept = {name: getattr(self._body, name).copy() for name in _KEPT}

    @property
    def margins(self) -> Array:
        """Margins of both contacts, m."""
        kept: Array = self._kept["margins"]
        return kept

    def state(self) -> dict[str, Array]:
        """All that is carried from one step to the next."""
        return self._kept

    def restore(self, state: dict[str, Array]) -> None:
        """Go on from such a state."""
        self._kept = state


_KEPT = ("forces", "qvel", "last", "qpos", "margins", "start", "marks")
