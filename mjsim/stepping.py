"""Balls on joints along the paper's coordinates, and the loop round MuJoCo's step.

Before each step the wall is turned to be tangent at the ball's azimuth, the margins follow the
gaps, and `mjsim.corrections` says what drives the step. The body axes of a homogeneous ball are
arbitrary: they are set upright, so that forces and velocities of the ball's joint are along the
paper's axes. Positions are kept half a step ahead of velocities (leapfrog). Contacts are in the
order A, B.

A ball that lands in a step, or comes near the axis, where polar coordinates end, takes it as
`mjsim.free` says; so it does the first one, which finds the margins and forces that belong to the
start."""

from __future__ import annotations

import functools
import math
from typing import Any, NamedTuple

import mujoco
import numpy as np

from mjsim import recorder
from mjsim.contact_settings import ContactSettings
from mjsim.corrections import Ball, Velocity, corrections, lands, near_axis
from mjsim.coulomb.compiling import entry
from mjsim.coulomb.engine import mj_step
from mjsim.free import Fine
from mjsim.recorder import COORDINATES, HUGE, NORMALS, NSENSOR, SENSORS
from model import Parameters, State
from model.arrays import Array

_CHANGE = 0.5
"""Most that contact forces may change in a step before the ball goes on upon its joints, in units
of what the largest force, at least that of gravity and the wall's friction, does as the ball goes
round."""
NOT, LANDS, GOES_ON, BEGINS = range(4)
"""Whether a ball takes the next step in fine ones: not; as it lands; in the shortest, as it did the
last one; or in these as the first of all, without a blow, after which it goes on upon its joints
however forces change."""
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
    """Generalised forces of the contacts: the second to the fifth are inward, upward, moments about
    x and y."""
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
    """Generalised forces of the contacts in the last step (6), N and N m, and normal ones (2),
    N."""
    marks: Any
    """Whether the next step is due to be taken in fine ones, and whether the last one was, with its
    forces held."""
    ball: Ball
    served: Any
    """Addresses of the engine's model and data."""


def seen_forces(body: Joints) -> None:
    """Copy the contact forces of the last step from the engine, unless that step was taken in fine
    ones."""
    if body.marks[_HELD] == 0:
        for i in range(6):
            body.forces[i] = body.contact[i]
        body.forces[6] = body.sensors[_NORMAL_A] + body.adhesion[0]
        body.forces[7] = body.sensors[_NORMAL_B] + body.adhesion[1]


def drive(omega_0: float, row: Any, body: Joints) -> None:
    """Let the margins follow the gaps and set what drives the next step; say if the ball is due to
    land in it.

    Place and velocities are noted in the row.
    """
    qpos, forces, margins, applied, ball = (
        body.qpos,
        body.forces,
        body.margins,
        body.applied,
        body.ball,
    )
    seen_forces(body)
    v, before = velocity_of(body.qvel), velocity_of(body.last)
    theta, h, y = float(qpos[0]), float(qpos[1]), float(qpos[2])
    given = float(forces[1]), float(forces[2]), float(forces[3]), float(forces[4])
    loads = float(forces[6]), float(forces[7])
    if body.marks[_DUE] == NOT and loads[0] * loads[1] == 0:
        floor = loads[0] == 0 and lands(y, v.v_y, before.v_y, ball)
        if floor or (
            loads[1] == 0 and (lands(h, v.v_h, before.v_h, ball) or near_axis(ball.R - h, v, ball))
        ):
            body.marks[_DUE] = LANDS
    if (
        ball.gain > 0
    ):  # a ball that sinks in rolls on a shorter lever: its contact point lies midway in the overlap
        margins[0], margins[1] = (
            max(0.0, margins[0] - ball.gain * y),
            max(0.0, margins[1] - ball.gain * h),
        )
    body.turn[0], body.turn[3] = math.cos(theta / 2), math.sin(theta / 2)
    qpos[3], qpos[4], qpos[5], qpos[6] = 1.0, 0.0, 0.0, 0.0
    driving, surfaces, (lift_A, lift_B) = corrections(
        v, before, ball.R - h, omega_0, given, loads, ball
    )
    for i in range(COORDINATES):
        row[i] = qpos[i]
    for i in range(6):
        row[COORDINATES + i], applied[i] = body.qvel[i], driving[i]
    body.floor[0], body.floor[1], body.wall[0], body.wall[1] = surfaces
    # Adhesion of a contact adds R times itself to the reference acceleration of its normal row, and
    # pulls the body by as much. With the pull taken back, minus what slip would take from the
    # contact leaves De Saxce's share.
    lift_A, lift_B = lift_A * (y < margins[0]), lift_B * (h < margins[1])
    body.adhesion[0], body.adhesion[1] = -lift_A, -lift_B
    applied[1] -= lift_B
    applied[2] -= lift_A


def velocity_of(v: Any) -> Velocity:
    """The velocities of the six joints by name, from an array (6)."""
    return Velocity(float(v[0]), float(v[1]), float(v[2]), float(v[3]), float(v[4]), float(v[5]))


@entry
def up_to_landing(body: Joints, fluid: Array, rows: Array, done: int) -> int:
    """Take a step for each omega_0 from number `done` on, up to one with a landing: the number of
    that.

    Steps are noted in rows (steps, `COLUMNS`); a ball that has diverged takes none."""
    while done < len(fluid):
        row = rows[done]
        drive(float(fluid[done]), row, body)
        if body.marks[_DUE] != NOT:
            sound = True
            for i in range(6):
                sound = sound and abs(body.qpos[i]) < HUGE and abs(body.qvel[i]) < HUGE
            if sound:
                return done
        for i in range(6):
            body.last[i] = body.qvel[i]
        body.marks[_DUE] = body.marks[_HELD] = 0
        mj_step(body.served[0], body.served[1])
        for i in range(NSENSOR):
            row[SENSORS + i] = body.sensors[i]
        row[SENSORS + _NORMAL_A] += body.adhesion[0]
        row[SENSORS + _NORMAL_B] += body.adhesion[1]
        done += 1
    return done


class JointedBall:
    """A ball on joints, with an engine of its own.

    Parameters
    ----------
    model : of its own, since its wall moves
    x : state at the start; omega_0 is that of the steps
    theta_0 : azimuth at the start, rad
    """

    def __init__(
        self, model: Any, p: Parameters, settings: ContactSettings, x: State, theta_0: float
    ) -> None:
        self.model, self.data = model, mujoco.MjData(model)
        self._p, self._settings, self._h = p, settings, settings.timestep
        self.lead = self._h * settings.midpoint
        """How far places are ahead of velocities, s."""
        data, (floor, wall) = self.data, (model.geom(name).id for name in ("floor", "wall"))
        self.body = Joints(
            qpos=data.qpos,
            qvel=data.qvel,
            start=data.qacc_warmstart,
            margins=model.pair_margin,
            contact=data.qfrc_constraint,
            sensors=data.sensordata,
            applied=data.qfrc_applied,
            adhesion=model.pair_adhesion,
            turn=data.mocap_quat[0],
            floor=model.geom_surfacevel[floor],
            wall=model.geom_surfacevel[wall],
            last=np.zeros(6),
            forces=np.zeros(8),
            marks=np.zeros(2, np.int8),
            ball=Ball(*map(float, Ball.of(p, settings))),
            served=(model._address, data._address),
        )
        place, v = recorder.joint_state(x, theta_0, p)
        fall = settings.slowest_fall(p.g)
        calm = all(
            speed >= -fall or gap > -self._h * speed for gap, speed in ((x.y, x.v_y), (x.h, x.v_h))
        )
        self.body.marks[_DUE] = (BEGINS if calm else LANDS) if settings.servo else NOT
        self._set(place, v, np.zeros(6))

    @functools.cached_property
    def _fine(self) -> Fine:
        """A free ball for steps that are taken in fine ones, made once one is."""
        return Fine(self._p, self._settings)

    def _set(self, place: Array, v: Array, rates: Array) -> None:
        """Set place, velocities and accelerations, all at one time, from which to go on; contact
        forces are kept."""
        body = self.body
        body.qvel[:], body.last[:], body.start[:] = v, v - self._h * rates, rates
        body.qpos[:3] = place + self.lead * (v + rates * self.lead / 2)[:3]
        body.marks[_HELD] = 1

    def advance(self, fluid: Array, rows: Array) -> None:
        """Take a step for each omega_0, noted in rows (steps, `COLUMNS`); those in which it lands
        in fine ones."""
        p, body, done = self._p, self.body, 0
        while (done := up_to_landing(body, fluid, rows, done)) < len(fluid):
            how, v = int(body.marks[_DUE]), body.qvel.copy()
            rates = (v - body.last) / self._h
            place = body.qpos[:3] - self.lead * (v + rates * self.lead / 2)[:3]
            x, theta = recorder.state(place, v, p), float(place[0])
            step = self._fine.step(x, theta, rates, float(fluid[done]), how != LANDS)
            place, v, rates, body.forces[:], change, rows[done, SENSORS:] = step
            near = near_axis(p.R - place[1], Velocity(*v), body.ball) and body.forces[7] == 0
            pace = max(abs(v[0]), math.sqrt(p.g / p.R))
            most = max(p.m * (p.g + p.eta * p.R * pace**2), np.abs(body.forces[[1, 2]]).max())
            fast = change > _CHANGE * self._h * pace * most and how != BEGINS
            body.marks[_DUE] = (
                GOES_ON if near or fast else NOT
            )  # on the joints where forces change slowly
            self._set(place, v, rates * (not near))
            if self._settings.servo:  # margins with which contacts bear their forces
                loads = body.forces[6:] / p.m
                body.margins[:] = np.maximum(place[:0:-1] + self._settings.margin(loads), 0.0) * (
                    loads > 0
                )
            done += 1

    def state(self) -> dict[str, Array]:
        """Copies of all that is carried from one step to the next, for `restore`."""
        seen_forces(self.body)
        self.body.marks[_HELD] = 1
        return {name: getattr(self.body, name).copy() for name in _KEPT}

    def restore(self, state: dict[str, Array]) -> None:
        """Go on from what `state` returned."""
        for name in _KEPT:
            getattr(self.body, name)[:] = state[name]


_KEPT = ("forces", "qvel", "last", "qpos", "margins", "start", "marks")
