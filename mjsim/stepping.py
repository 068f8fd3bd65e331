"""What is done between MuJoCo's steps: drag, wall, margins, surface velocities.

Before each step the wall is turned to be tangent at the ball's azimuth and the drag of the fluid (9) is written as a
generalised force. The body axes of a homogeneous ball are arbitrary: they are set upright, so that forces and
velocities of the ball's joint are along the paper's axes, ``v = (omega_c, v_h, v_y, o_x, o_y - omega_c, o_z)``.

Three corrections then take out what softness and first-order stepping would leave. None of them knows a solution of the
problem; each is built from what the last step gave and vanishes where motion and forces are steady.

* Margins. The contact point lies midway in the overlap, so that a ball which sinks in rolls on a shorter lever. Each
  step a margin takes a share ``servo_gain`` of the gap, until the loaded contact stands at no gap at all.
* Memory. A rolling contact of finite softness creeps at R_t f/b_f. Surfaces that move backwards at that speed for the
  last step's friction f leave only the change of f to creep. f follows from the normal forces and the generalised
  contact force, ``(., A_x + B_x, A_y + B_y, -r A_z, r B_z, r (A_x - B_y))``.
* Midpoint. MuJoCo takes drag and inertial forces at the beginning of a step, and the direction of sliding friction at
  1/b_f after it. The last acceleration carries all of them to its middle: the former as an applied force, the latter
  as a surface velocity, where the contact truly slides. Positions are kept half a step ahead of velocities (leapfrog).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, Protocol

import mujoco
import numpy as np
from mujoco.batch import Batch

from mjsim import recorder
from mjsim.contact_settings import ContactSettings
from model import Parameters
from model.arrays import Array

_UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
_NORMAL_A, _NORMAL_B = 1, 15
"""Where the sensors hold the normal forces."""
_START = 40
"""Rounds of the search for margins and forces that belong to the first state."""
_SLIDES = 3.0
"""A contact slides if its speed is over this many times its change in a step; a slip that is ending dies out faster."""


class Stepper(Protocol):
    """One or many simulations in the engine."""

    margins: Array
    """Margins of the contacts, shape (runs, 2), m."""

    def sample(self, omega_0: Array, row: Array) -> None:
        """Take one step; write (qpos, qvel, sensors) of its beginning to row (runs, 41); omega_0 (runs,)."""

    def advance(self, omega_0: Array) -> None:
        """Take a step for every row of omega_0 (steps, runs)."""

    def state(self) -> dict[str, Array]:
        """Copies of all that is carried from one step to the next."""

    def restore(self, state: dict[str, Array]) -> None:
        """Go on from such a state."""


class Single(Stepper):
    """One simulation in plain floats, which beat arrays of one."""

    def __init__(
        self, model: Any, p: Parameters, settings: ContactSettings, start: tuple[Array, Array], omega_0: float
    ) -> None:
        self.model, self.data, self._p, self._settings = model, mujoco.MjData(model), p, settings
        self.data.qpos[:], self.data.qvel[:] = start
        self.data.qpos[:3] += settings.lead * start[1][:3]
        self._floor, self._wall = (model.geom_surfacevel[model.geom(name).id] for name in ("floor", "wall"))
        self._remember(start[1])
        self.margins = model.pair_margin[None]
        self._settle(omega_0)

    def _settle(self, omega_0: float) -> None:
        """Find the margins, friction forces and accelerations that belong to the first state, at rest in time."""
        model, data, timestep = self.model, self.data, self._settings.timestep
        stiffness = self._settings.solimp * self._settings.k
        reach = self._settings.touching(self._p.g)
        for _ in range(_START):
            self._steps([omega_0], mujoco.mj_forward)
            if self._settings.servo:
                for contact, axis in enumerate((2, 1)):
                    if abs(data.qpos[axis]) < reach and abs(data.qvel[axis]) * timestep < reach:
                        model.pair_margin[contact] = max(0.0, model.pair_margin[contact] - data.qacc[axis] / stiffness)
            self._remember(data.qvel - timestep * data.qacc)

    def _remember(self, qvel: Array) -> None:
        """Take these for the velocities of the last step, with rho omega_c as the seventh."""
        self._last = [*qvel.tolist(), float((self._p.R - self.data.qpos[1]) * qvel[0])]

    def sample(self, omega_0: Array, row: Array) -> None:
        data, split = self.data, recorder.NQ + recorder.NV
        row[0, : recorder.NQ], row[0, recorder.NQ : split] = data.qpos, data.qvel
        self.advance(omega_0[None])
        row[0, split:] = data.sensordata

    def advance(self, omega_0: Array) -> None:
        self._steps(omega_0[:, 0].tolist(), mujoco.mj_step)

    def state(self) -> dict[str, Array]:
        raise NotImplementedError("only runs in a batch can be taken up again")

    def restore(self, state: dict[str, Array]) -> None:
        raise NotImplementedError("only runs in a batch can be taken up again")

    def _steps(self, omega_0: list[float], step: Callable[[Any, Any], None]) -> None:
        model, data, p, settings = self.model, self.data, self._p, self._settings
        qpos, qvel, applied, turn, margins = (
            data.qpos, data.qvel, data.qfrc_applied, data.mocap_quat[0], model.pair_margin
        )  # fmt: skip
        constraint, normal, floor, wall, orientation = (
            data.qfrc_constraint, data.sensordata.item, self._floor, self._wall, qpos[3:7]
        )  # fmt: skip
        m, R, r, mc, inertia = p.m, p.R, p.r, p.m * p.c, p.j * p.m * p.r**2
        ahead, shift, lag = settings.midpoint, settings.memory_gain(p.m), settings.friction_lag
        spin_shift, shifts, gain = shift / r, settings.shifts_surfaces, settings.servo_gain
        cos, sin, slides = math.cos, math.sin, _SLIDES**2
        u0, u1, u2, u3, u4, u5, last_around = self._last
        for omega in omega_0:
            theta, h, y, *_ = qpos.tolist()
            v0, v1, v2, v3, v4, v5 = qvel.tolist()
            half = theta / 2
            turn[0], turn[3] = cos(half), sin(half)
            orientation[0] = 1.0
            orientation[1] = orientation[2] = orientation[3] = 0.0
            rho = R - h
            # Change over the last step, and the velocities expected in the middle of this one.
            d0, d1, d2, d3, d5 = v0 - u0, v1 - u1, v2 - u2, v3 - u3, v5 - u5
            around = rho * v0
            its_change = around - last_around
            w0, w1, middle = v0 + ahead * d0, v1 + ahead * d1, around + ahead * its_change
            # Drag (9), and what the inertial forces grow by till the middle.
            applied[0] = rho * (mc * (rho * omega - middle) + 2 * m * (w1 * w0 - v1 * v0))
            applied[1] = -mc * w1 - m * (w0 * middle - v0 * around)
            applied[2] = -mc * (v2 + ahead * d2)
            applied[3] = inertia * (v0 * v5 - w0 * (v5 + ahead * d5))
            applied[5] = inertia * (w0 * (v3 + ahead * d3) - v0 * v3)
            if shifts:
                _, force_h, force_y, moment_x, moment_y, _ = constraint.tolist()
                turned, turned_change = r * v5, r * d5
                x, z, a_x, a_z = v1 + turned, around - r * v3, d1 + turned_change, its_change - r * d3
                on = lag if slides * (a_x * a_x + a_z * a_z) < x * x + z * z else 0.0
                floor[0] = on * a_z - spin_shift * moment_x
                floor[1] = on * a_x + shift * (force_h - normal(_NORMAL_B))
                y_, z, a_y, a_z = (
                    v2 - turned,
                    around + r * (v4 + v0),
                    d2 - turned_change,
                    its_change + r * (v4 - u4 + d0),
                )
                on = lag if slides * (a_y * a_y + a_z * a_z) < y_ * y_ + z * z else 0.0
                wall[0] = on * a_y + shift * (force_y - normal(_NORMAL_A))
                wall[1] = on * a_z + spin_shift * moment_y
            if gain and step is mujoco.mj_step:
                margins[0], margins[1] = max(0.0, margins.item(0) - gain * y), max(0.0, margins.item(1) - gain * h)
            step(model, data)
            u0, u1, u2, u3, u4, u5, last_around = v0, v1, v2, v3, v4, v5, around
        self._last = [u0, u1, u2, u3, u4, u5, last_around]


class Many(Stepper):
    """Many simulations in one batch; what `Single` does, as operations on arrays with the runs in the last axis."""

    def __init__(
        self, models: Sequence[Any], parameters: Sequence[Parameters], settings: ContactSettings,
        start: Sequence[tuple[Array, Array]], omega_0: Array,
    ) -> None:  # fmt: skip
        self._batch = batch = Batch(models[0], nsim=len(models), nthread=1)
        _expand_differences(batch, models)
        self._settings = settings
        self._qpos, self._qvel, self._sensors = (batch.bind(name) for name in ("qpos", "qvel", "sensordata"))
        self._qpos[:], self._qvel[:] = (np.stack(part) for part in zip(*start, strict=True))
        self._qpos[:, :3] += settings.lead * self._qvel[:, :3]
        self._orientation = self._qpos[:, 3:7]
        self._applied, self._turn = batch.bind("qfrc_applied"), batch.bind("mocap_quat")[:, 0]
        self._acceleration = batch.bind("qacc")
        self._contact = self._outputs = batch.bind("qfrc_constraint"), self._sensors
        self.margins = batch.expand("pair_margin")
        surface = batch.expand("geom_surfacevel")
        self._floor, self._wall = (surface[:, models[0].geom(name).id, :2].T for name in ("floor", "wall"))
        m, r, R, j, c = (np.array([getattr(p, name) for p in parameters]) for name in ("m", "r", "R", "j", "c"))
        self._R, self._mc = R, m * c
        one, none = np.ones_like(m), np.zeros_like(m)
        self._lengths = np.stack([R, one, one, r, r, r, r])
        self._inertia = np.stack([2 * m / r, -m / r, none, -j * m, none, j * m])
        shift = np.array([settings.memory_gain(mass) for mass in m])
        self._shift = np.stack([-shift / r, shift, shift, shift / r])
        self._reach = np.array([[settings.touching(p.g)] for p in parameters])
        # Kept here, since every step needs them and the settings work them out each time.
        self._ahead, self._lag, self._gain = settings.midpoint, settings.friction_lag, settings.servo_gain
        self._shifts = settings.shifts_surfaces
        self._last = self._velocities()
        self._settle(omega_0)

    def _settle(self, omega_0: Array) -> None:
        stiffness = self._settings.solimp * self._settings.k
        gaps, speeds = self._qpos[:, 2:0:-1], self._qvel[:, 2:0:-1] * self._settings.timestep
        touching = (np.abs(gaps) < self._reach) & (np.abs(speeds) < self._reach)
        for _ in range(_START):
            self._prepare(omega_0)
            self._batch.forward()
            if self._settings.servo:
                lower = self.margins - self._acceleration[:, 2:0:-1] / stiffness
                np.maximum(lower, 0.0, out=self.margins, where=touching)
            self._last = self._velocities(self._qvel - self._settings.timestep * self._acceleration)

    def sample(self, omega_0: Array, row: Array) -> None:
        split = recorder.NQ + recorder.NV
        row[:, : recorder.NQ], row[:, recorder.NQ : split] = self._qpos, self._qvel
        self.advance(omega_0[None])
        row[:, split:] = self._sensors

    def advance(self, omega_0: Array) -> None:
        gain, gaps, margins = self._gain, self._qpos[:, 2:0:-1], self.margins
        for omega in omega_0:
            velocities = self._prepare(omega)
            if gain:
                np.maximum(margins - gain * gaps, 0.0, out=margins)
            self._batch.step()
            self._last, self._contact = velocities, self._outputs

    def state(self) -> dict[str, Array]:
        constraint, sensors = self._contact
        carried = self._carried() | {"qfrc_constraint": constraint, "sensordata": sensors, "last": self._last}
        return {name: values.copy() for name, values in carried.items()}

    def restore(self, state: dict[str, Array]) -> None:
        for name, values in self._carried().items():
            values[...] = state[name]
        # What the engine puts out can't be written back: until its next step, the copies stand in for it.
        self._contact = state["qfrc_constraint"], state["sensordata"]
        self._last = state["last"]

    def _carried(self) -> dict[str, Array]:
        """The arrays that can be written and of which the next step depends on the values."""
        inner = {name: self._batch.bind(name) for name in ("qpos", "qvel", "qacc_warmstart")}
        return inner | {"margins": self.margins, "floor": self._floor, "wall": self._wall}

    def _velocities(self, qvel: Array | None = None) -> Array:
        """(rho omega_c, v_h, v_y, r omega_c, r o_x, r o_y, r o_z), all in m s-1, shape (7, runs)."""
        np.subtract(self._R, self._qpos[:, 1], out=self._lengths[0])
        velocities: Array = (self._qvel if qvel is None else qvel).T.take(_VELOCITIES, axis=0)
        velocities *= self._lengths
        velocities[5] += velocities[3]
        return velocities

    def _prepare(self, omega_0: Array) -> Array:
        """Write wall, forces and surface velocities for the next step; return its velocities."""
        qpos, turn = self._qpos, self._turn
        half = qpos[:, 0] * 0.5
        np.cos(half, out=turn[:, 0])
        np.sin(half, out=turn[:, 3])
        np.copyto(self._orientation, _UPRIGHT)
        v = self._velocities()
        rho = self._lengths[0]
        change = v - self._last
        middle = v + self._ahead * change
        # Drag (9), and what the inertial forces grow by till the middle.
        force = (middle[3] * middle - v[3] * v).take(_INERTIAL, axis=0)
        force *= self._inertia
        middle[0] -= rho * omega_0
        force[:3] -= self._mc * middle[:3]
        force[0] *= rho
        self._applied.T[:] = force
        if self._shifts:
            constraint, sensors = self._contact
            surface = constraint.T.take(_FRICTION, axis=0)
            surface[1:3] -= sensors.T.take(_NORMALS, axis=0)
            surface *= self._shift
            slip, slip_change = _SLIP.dot(v), _SLIP.dot(change)
            slides = _PAIRS.dot(slip * slip - _SLIDES**2 * slip_change * slip_change) > 0
            surface += self._lag * slip_change * slides
            self._floor[:], self._wall[:] = surface[:2], surface[2:]
        return v


_VELOCITIES = np.array([0, 1, 2, 0, 3, 4, 5])
"""Of the joints, in the order of `Many._velocities`."""
_INERTIAL = np.array([1, 0, 2, 6, 5, 4])
"""The velocity that, times omega_c, gives the inertial force of each joint; axial ones have none."""
_FRICTION, _NORMALS = np.array([3, 1, 2, 4]), np.array([_NORMAL_B, _NORMAL_A])
"""The joints' contact forces that hold A_z, A_x, B_y, B_z, and the normal forces in the second and third."""
_SLIP = np.array([
    [1.0, 0, 0, 0, -1, 0, 0], [0, 1, 0, 0, 0, 0, 1], [0, 0, 1, 0, 0, 0, -1], [1, 0, 0, 0, 0, 1, 0]
])  # fmt: skip
"""Slip velocities v_Az, v_Ax, v_By, v_Bz, in the order of the surfaces' axes, of `Many._velocities`; sums of no more
than two terms, which no order of summation can change: a run doesn't depend on how many others share its batch."""
_PAIRS = np.array([[1.0, 1, 0, 0], [1, 1, 0, 0], [0, 0, 1, 1], [0, 0, 1, 1]])
"""Adds what belongs to one contact."""


def _expand_differences(batch: Batch, models: Sequence[Any]) -> None:
    """Give each simulation its own value of every model field in which the models differ."""
    for name in mujoco.batch.MODEL_FIELDS:
        owner, _, field = name.rpartition(".")
        values = [np.asarray(getattr(getattr(model, owner) if owner else model, field)) for model in models]
        if any(not np.array_equal(values[0], value) for value in values[1:]):
            batch.expand(name)[:] = np.stack(values)
