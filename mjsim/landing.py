"""Landings: a ball that lands, or comes near the vessel's axis, is a free body under Coulomb's law for that step.

`mjsim.free` takes it through the step in fine ones, with the rigid law that serves any model, and no axis. From what
comes out the ball goes on upon its joints: places, velocities, accelerations, and the forces of its contacts, from
which the margins follow (`ContactSettings.held`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mjsim import recorder, scene
from mjsim.contact_settings import ContactSettings
from mjsim.free import FreeBall
from mjsim.world_axes import unwrapped
from model import Parameters, State
from model.arrays import Array
from model.kinematics import Motion, from_world, rotated

FINE = 128
"""Fine steps in one of the settings."""
_LATEST = 16
"""Fine steps over which accelerations are taken."""
_FIRST = 16
"""Fine steps after which the forces of a state are known."""
_BLOWS = 8
"""Most blows in a step whose moments are found."""
_OPEN = 1e-9
"""Gap of a contact that is open, in units of R."""
_UPRIGHT = 1.0, 0.0, 0.0, 0.0


class Landed(NamedTuple):
    """How a ball goes on upon its joints."""

    place: Array
    """Azimuth, h and y, (3,)."""
    velocity: Array
    rates: Array
    """Velocities of the joints and what a second changes of them, (6,)."""
    forces: Array
    """Generalised forces of the contacts (6) and their normal forces (2), as the engine has them, N and N m."""
    change: float
    """What a component of the contact forces would change in a whole step at the pace of the end, at most, N."""
    seen: Array
    """Sensors of the fine steps, (n, `NSENSOR`)."""


class Fine:
    """One ball that takes steps of some settings in fine ones."""

    def __init__(self, p: Parameters, settings: ContactSettings) -> None:
        self._p, self._step = p, settings.timestep / FINE
        rigid = ContactSettings.rigid_at(self._step)
        self._ball = FreeBall(scene.build(p, rigid)[0], p, State(), rigid, 0.0)
        self._slow = settings.slowest_fall(p.g) * self._step
        """What a gap loses in a fine step in which the contact closes with a blow, m."""

    def forces(self, x: State, theta: float, omega_0: float) -> Landed:
        """What accelerates a ball in a state, and the forces of its contacts."""
        self._ball.place(x, theta)
        return self._advance(omega_0, _FIRST)

    def step(self, x: State, theta: float, omega_0: float) -> Landed:
        """A whole step, with the sensors of its first fine one.

        Where a contact closes, the fine steps begin anew so that it does in the middle of one: of a blow that two
        share, friction, which turns, would have two directions. Those after it are late; that is taken back at the end.
        """
        left, late, gaps, first = FINE, 0.0, np.array([x.y, x.h]), np.empty(0)
        for _ in range(_BLOWS):
            self._ball.place(x, theta)
            landed = self._advance(omega_0, left)
            first = landed.seen[:1] if len(first) == 0 else first
            closing = self._closing(landed.seen, gaps)
            if closing is None:
                break
            count, contact = closing
            self._ball.place(x, theta)
            if count:
                before = self._advance(omega_0, count)
                place, v, rates = before.place, before.velocity, before.rates
            else:
                (place, v), rates = self._joints(), np.zeros(6)
            gap = 2 - contact  # as the joints are ordered
            wait = float(np.clip(-place[gap] / v[gap], 0.0, 2 * self._step)) - self._step / 2
            place, v = place + wait * v[:3], v + wait * rates
            place[gap] = -self._step / 2 * v[gap]
            x, theta = recorder.state(np.append(place, _UPRIGHT), v, self._p), float(place[0])
            left, late, gaps = left - count, late + wait, np.array([x.y, x.h])
            gaps[contact] = 0.0
        place, v = landed.place - late * landed.velocity[:3], landed.velocity - late * landed.rates
        if left < _FIRST:  # the forces found may be those of a blow
            x = recorder.state(np.append(place, _UPRIGHT), v, self._p)
            landed = self.forces(x, float(place[0]), omega_0)._replace(change=np.inf)
        return landed._replace(place=place, velocity=v, seen=first)

    def _closing(self, seen: Array, gaps: Array) -> tuple[int, int] | None:
        """The first fine step in which a contact closes, and which, or None; `gaps` are those before."""
        loads, open_ = seen[:, recorder.NORMALS], np.abs(gaps) > _OPEN * self._p.R
        was_open = np.vstack([open_, loads[:-1] == 0])
        falls = np.diff(seen[:, -2:], axis=0, prepend=gaps[None]) < -self._slow
        found = np.argwhere((loads > 0) & was_open & falls)
        return (int(found[0, 0]), int(found[0, 1])) if len(found) else None

    def _advance(self, omega_0: float, count: int) -> Landed:
        """So many fine steps."""
        seen, fluid, latest = np.empty((count, recorder.NSENSOR)), np.full(count, omega_0), min(_LATEST, count // 2)
        self._ball.advance(fluid[latest:], seen[: count - latest])
        _, before = self._joints()
        self._ball.advance(fluid[:latest], seen[count - latest :])
        place, v = self._joints()
        rates = (v - before) / (self._step * max(latest, 1))
        half = count - count // 2
        forces = recorder.forces(seen[[-1, -2 % count]], place[0]).mean(axis=0)
        change = np.abs(forces - recorder.forces(seen[-half:][:1], place[0] - v[0] * self._step * half)[0]).max()
        (A_x, A_y, A_z), (B_x, B_y, B_z) = forces
        given = np.array([0, A_x + B_x, A_y + B_y, -self._p.r * A_z, self._p.r * B_z, 0, A_y, B_x])
        return Landed(place, v, rates, given, float(change) * FINE / half, seen)

    def _joints(self) -> tuple[Array, Array]:
        """Places (3,) and velocities (6,) of the joints at one time."""
        (qpos, qvel), ball = (self._ball.data.qpos, self._ball.data.qvel), self._ball
        place, spin = qpos[:3] - ball.ahead * qvel[:3], rotated(qpos[3:7], qvel[3:6])
        x, azimuth = from_world(Motion(place, qvel[:3].copy(), spin), self._p)
        place, v = recorder.joint_state(x, unwrapped(float(azimuth), ball.theta), self._p)
        return place[:3], v
