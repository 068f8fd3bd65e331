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

_UPRIGHT = (1.0, 0.0, 0.0, 0.0)
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


class Single(Stepper):
    """One simulation in plain floats, which beat arrays of one."""

    def __init__(
        self, model: Any, p: Parameters, settings: ContactSettings, start: tuple[Array, Array], omega_0: float
    ) -> None:
        self._model, self._data, self._p, self._settings = model, mujoco.MjData(model), p, settings
        self._data.qpos[:], self._data.qvel[:] = start
        self._data.qpos[:3] += settings.lead * start[1][:3]
        self._floor, self._wall = (model.geom_surfacevel[model.geom(name).id] for name in ("floor", "wall"))
        self._last = start[1].tolist()
        self.margins = model.pair_margin[None]
        self._settle(omega_0)

    def _settle(self, omega_0: float) -> None:
        """Find the margins, friction forces and accelerations that belong to the first state, at rest in time."""
        model, data, timestep = self._model, self._data, self._settings.timestep
        stiffness = self._settings.solimp * self._settings.k
        reach = float(self._settings.servo_reach(self._p.g))
        for _ in range(_START):
            self._steps([omega_0], mujoco.mj_forward)
            if self._settings.servo:
                for contact, axis in enumerate((2, 1)):
                    if abs(data.qpos[axis]) < reach and abs(data.qvel[axis]) * timestep < reach:
                        model.pair_margin[contact] = max(0.0, model.pair_margin[contact] - data.qacc[axis] / stiffness)
            self._last = (data.qvel - timestep * data.qacc).tolist()

    def sample(self, omega_0: Array, row: Array) -> None:
        data, split = self._data, recorder.NQ + recorder.NV
        row[0, : recorder.NQ], row[0, recorder.NQ : split] = data.qpos, data.qvel
        row[0, :3] -= self._settings.lead * data.qvel[:3]
        self.advance(omega_0[None])
        row[0, split:] = data.sensordata

    def advance(self, omega_0: Array) -> None:
        self._steps(omega_0[:, 0].tolist(), mujoco.mj_step)

    def _steps(self, omega_0: list[float], step: Callable[[Any, Any], None]) -> None:
        model, data, p, settings = self._model, self._data, self._p, self._settings
        qpos, qvel, applied, turn, margins = (
            data.qpos, data.qvel, data.qfrc_applied, data.mocap_quat[0], model.pair_margin
        )  # fmt: skip
        constraint, sensors, floor, wall, orientation = (
            data.qfrc_constraint, data.sensordata, self._floor, self._wall, qpos[3:7]
        )  # fmt: skip
        m, R, r, mc, inertia = p.m, p.R, p.r, p.m * p.c, p.j * p.m * p.r**2
        ahead, shift, lag = settings.midpoint, settings.memory_gain(p.m), settings.friction_lag
        gain, reach = settings.servo_gain if step is mujoco.mj_step else 0.0, float(settings.servo_reach(p.g))
        cos, sin, slides = math.cos, math.sin, _SLIDES**2
        u0, u1, u2, u3, u4, u5 = self._last
        margin_A, margin_B = margins.tolist()
        for omega in omega_0:
            theta, h, y, *_ = qpos.tolist()
            v0, v1, v2, v3, v4, v5 = qvel.tolist()
            turn[0], turn[3] = cos(theta / 2), sin(theta / 2)
            orientation[:] = _UPRIGHT
            rho = R - h
            # Change over the last step, and the velocities expected in the middle of this one.
            d0, d1, d2, d3, d4, d5 = v0 - u0, v1 - u1, v2 - u2, v3 - u3, v4 - u4, v5 - u5
            w0, w1, w2, w3, w5 = v0 + ahead * d0, v1 + ahead * d1, v2 + ahead * d2, v3 + ahead * d3, v5 + ahead * d5
            # Drag (9), and what the inertial forces grow by till the middle.
            applied[0] = -mc * rho * rho * (w0 - omega) + 2 * m * rho * (w1 * w0 - v1 * v0)
            applied[1] = -mc * w1 - m * rho * (w0 * w0 - v0 * v0)
            applied[2] = -mc * w2
            applied[3] = -inertia * (w0 * w5 - v0 * v5)
            applied[5] = inertia * (w0 * w3 - v0 * v3)
            if shift or lag:
                _, force_h, force_y, moment_x, moment_y, _ = constraint.tolist()
                s_x, s_z = shift * (force_h - sensors[_NORMAL_B]), -shift / r * moment_x
                a_x, a_z = d1 + r * d5, rho * d0 - r * d3
                if slides * (a_x * a_x + a_z * a_z) < (v1 + r * v5) ** 2 + (rho * v0 - r * v3) ** 2:
                    s_x, s_z = s_x + lag * a_x, s_z + lag * a_z
                floor[0], floor[1] = s_z, s_x
                s_y, s_z = shift * (force_y - sensors[_NORMAL_A]), shift / r * moment_y
                a_y, a_z = d2 - r * d5, rho * d0 + r * (d4 + d0)
                if slides * (a_y * a_y + a_z * a_z) < (v2 - r * v5) ** 2 + (rho * v0 + r * (v4 + v0)) ** 2:
                    s_y, s_z = s_y + lag * a_y, s_z + lag * a_z
                wall[0], wall[1] = s_y, s_z
            if gain:
                if y < reach:
                    margins[0] = margin_A = max(0.0, margin_A - gain * y)
                if h < reach:
                    margins[1] = margin_B = max(0.0, margin_B - gain * h)
            step(model, data)
            u0, u1, u2, u3, u4, u5 = v0, v1, v2, v3, v4, v5
        self._last = [u0, u1, u2, u3, u4, u5]


class Many(Stepper):
    """Many simulations in one batch; what `Single` does, as operations on arrays with the runs in the last axis."""

    def __init__(
        self, models: Sequence[Any], parameters: Sequence[Parameters], settings: ContactSettings,
        start: Sequence[tuple[Array, Array]], omega_0: Array,
    ) -> None:  # fmt: skip
        self._batch = batch = Batch(models[0], nsim=len(models), nthread=1)
        _expand_differences(batch, models)
        self._settings, self._lead = settings, settings.lead
        self._qpos, self._qvel, self._sensors = (batch.bind(name) for name in ("qpos", "qvel", "sensordata"))
        self._qpos[:], self._qvel[:] = (np.stack(part) for part in zip(*start, strict=True))
        self._qpos[:, :3] += settings.lead * self._qvel[:, :3]
        self._applied, self._turn = batch.bind("qfrc_applied"), batch.bind("mocap_quat")[:, 0]
        self._constraint, self._acceleration = batch.bind("qfrc_constraint"), batch.bind("qacc")
        self.margins = batch.expand("pair_margin")
        surface = batch.expand("geom_surfacevel")
        self._floor, self._wall = (surface[:, models[0].geom(name).id, :2].T for name in ("floor", "wall"))
        column = {name: np.array([getattr(p, name) for p in parameters]) for name in ("m", "r", "R", "j", "c", "g")}
        self._m, self._r, self._R = column["m"], column["r"], column["R"]
        self._mc, self._inertia = column["m"] * column["c"], column["j"] * column["m"] * column["r"] ** 2
        self._shift = np.array([settings.memory_gain(m) for m in column["m"]])
        self._reach = settings.servo_reach(column["g"])[:, None]
        self._last = self._qvel.T.copy()
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
            self._last = (self._qvel - self._settings.timestep * self._acceleration).T.copy()

    def sample(self, omega_0: Array, row: Array) -> None:
        split = recorder.NQ + recorder.NV
        row[:, : recorder.NQ], row[:, recorder.NQ : split] = self._qpos, self._qvel
        row[:, :3] -= self._lead * self._qvel[:, :3]
        self.advance(omega_0[None])
        row[:, split:] = self._sensors

    def advance(self, omega_0: Array) -> None:
        gain, gaps, margins, reach = self._settings.servo_gain, self._qpos[:, 2:0:-1], self.margins, self._reach
        for omega in omega_0:
            velocity = self._prepare(omega)
            if gain:
                np.maximum(margins - gain * gaps, 0.0, out=margins, where=gaps < reach)
            self._batch.step()
            self._last = velocity

    def _prepare(self, omega_0: Array) -> Array:
        """Write wall, forces and surface velocities for the next step; return its velocities, shape (6, runs)."""
        settings, qpos, r, turn = self._settings, self._qpos, self._r, self._turn
        half = qpos[:, 0] / 2
        np.cos(half, out=turn[:, 0])
        np.sin(half, out=turn[:, 3])
        qpos[:, 3:7] = _UPRIGHT
        rho = self._R - qpos[:, 1]
        v = self._qvel.T.copy()
        change = v - self._last
        w = v + settings.midpoint * change
        growth = w[0] * w[_TURNED] - v[0] * v[_TURNED]
        applied = self._applied.T
        drag = -self._mc * w[:3]
        drag[0] = self._mc * rho * rho * (omega_0 - w[0]) + 2 * self._m * rho * growth[1]
        drag[1] -= self._m * rho * growth[0]
        applied[:3] = drag
        np.multiply(growth[3], -self._inertia, out=applied[3])
        np.multiply(growth[2], self._inertia, out=applied[5])
        if settings.shifts_surfaces:
            force, sensors, shift = self._constraint, self._sensors, self._shift
            slip, slip_change = _slip(v, rho, r), _slip(change, rho, r)
            both = settings.friction_lag * slip_change
            for contact in (slice(0, 2), slice(2, 4)):
                speed, its_change = slip[contact], slip_change[contact]
                both[contact] *= _SLIDES**2 * (its_change * its_change).sum(axis=0) < (speed * speed).sum(axis=0)
            both[0] -= shift / r * force[:, 3]
            both[1] += shift * (force[:, 1] - sensors[:, _NORMAL_B])
            both[2] += shift * (force[:, 2] - sensors[:, _NORMAL_A])
            both[3] += shift / r * force[:, 4]
            self._floor[:], self._wall[:] = both[:2], both[2:]
        return v


_TURNED = [0, 1, 3, 5]
"""The velocities that enter inertial forces as products with omega_c."""


def _slip(v: Array, rho: Array, r: Array) -> Array:
    """Slip velocities (v_Az, v_Ax, v_By, v_Bz), in the order of the surfaces' axes, of joint velocities (6, runs)."""
    around, turned = rho * v[0], r * v[5]
    slip: Array = np.stack([around - r * v[3], v[1] + turned, v[2] - turned, around + r * (v[4] + v[0])])
    return slip


def _expand_differences(batch: Batch, models: Sequence[Any]) -> None:
    """Give each simulation its own value of every model field in which the models differ."""
    for name in mujoco.batch.MODEL_FIELDS:
        owner, _, field = name.rpartition(".")
        values = [np.asarray(getattr(getattr(model, owner) if owner else model, field)) for model in models]
        if any(not np.array_equal(values[0], value) for value in values[1:]):
            batch.expand(name)[:] = np.stack(values)
