"""What is done between MuJoCo's steps: drag, wall, margins, surface velocities.

Before each step the wall is turned to be tangent at the ball's azimuth and the drag of the fluid (9) is written as a
generalised force. The body axes of a homogeneous ball are arbitrary: they are set upright, so that forces and
velocities of the ball's joint are along the paper's axes, ``v = (omega_c, v_h, v_y, o_x, o_y - omega_c, o_z)``.

Four corrections then take out what softness and first-order stepping would leave. None of them knows a solution of the
problem; each is built from what the last step gave and vanishes where motion and forces are steady.

* Margins. The contact point lies midway in the overlap, so that a ball which sinks in rolls on a shorter lever. Each
  step a margin takes a share ``servo_gain`` of the gap, until the loaded contact stands at no gap at all.
* Impact. A ball that comes down overlaps by up to a step's way before the engine sees it; the stiffness would throw it
  back with up to a quarter of its speed, however small the step, and the other contact would answer a step late. It is
  set on the surface, and the engine's own solver is asked, with time standing still, for the impulses at both contacts
  that leave no approach and no rebound: again by their margins.
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
from dataclasses import dataclass
from typing import Any, Protocol, Self

import mujoco
import numpy as np
import numpy.typing as npt
from mujoco.batch import Batch

from mjsim import recorder
from mjsim.contact_settings import ContactSettings
from model import Parameters
from model.arrays import Array

_UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
_NORMAL_A, _NORMAL_B = 1, 15
"""Where the sensors hold the normal forces."""
_NORMALS = slice(_NORMAL_A, None, _NORMAL_B - _NORMAL_A)
_ROUNDS = 40
"""Rounds of the search for margins and forces that belong to the first state, or to an impact."""
_UNDAMPED = np.array([1e6, 1e-6])
"""Factors of solref that leave the stiffness and take away the damping: an impact's impulse is the margin's alone."""
_FALL = 0.01
"""Way in a step from which on it is an impact, in units of the gap that counts as touching."""
_REST = 1e-6
"""Normal speed after an impact, relative to that before, up to which the search for the impulses has succeeded."""
_TOUCH = 1e-15
"""Least margin of a ball that has just landed, m: more than the round-off of a gap, or the engine sees no contact."""
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
        for _ in range(_ROUNDS):
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
        return {name: values.copy() for name, values in self._carried().items()} | {"last": np.array(self._last)}

    def restore(self, state: dict[str, Array]) -> None:
        for name, values in self._carried().items():
            values[...] = state[name]
        self._last = state["last"].tolist()

    def _carried(self) -> dict[str, Array]:
        """The engine's arrays on whose values the next step depends."""
        names = ("qpos", "qvel", "qacc_warmstart", "qfrc_constraint", "sensordata")
        surfaces = {"floor": self._floor, "wall": self._wall}
        return {name: getattr(self.data, name) for name in names} | surfaces | {"margins": self.margins}

    def _steps(self, omega_0: list[float], step: Callable[[Any, Any], None]) -> None:
        model, data, p, settings = self.model, self.data, self._p, self._settings
        qpos, qvel, applied, turn, margins = (
            data.qpos, data.qvel, data.qfrc_applied, data.mocap_quat[0], model.pair_margin
        )  # fmt: skip
        gain = settings.servo_gain if step is mujoco.mj_step else 0.0
        constraint, normal, floor, wall, orientation = (
            data.qfrc_constraint, data.sensordata.item, self._floor, self._wall, qpos[3:7]
        )  # fmt: skip
        m, R, r, mc, inertia = p.m, p.R, p.r, p.m * p.c, p.j * p.m * p.r**2
        ahead, shift, lag = settings.midpoint, settings.memory_gain(p.m), settings.friction_lag
        spin_shift, shifts = shift / r, settings.shifts_surfaces
        cos, sin, slides = math.cos, math.sin, _SLIDES**2
        u0, u1, u2, u3, u4, u5, last_around = self._last
        for omega in omega_0:
            theta, h, y, *_ = qpos.tolist()
            v0, v1, v2, v3, v4, v5 = qvel.tolist()
            if gain:
                if normal(_NORMAL_A) == 0 or normal(_NORMAL_B) == 0:
                    self._last = [u0, u1, u2, u3, u4, u5, last_around]
                    if self._lands(omega):
                        h, y = qpos[1:3].tolist()
                        v0, v1, v2, v3, v4, v5 = u0, u1, u2, u3, u4, u5 = qvel.tolist()
                        last_around = (R - h) * v0
                margins[0], margins[1] = max(0.0, margins.item(0) - gain * y), max(0.0, margins.item(1) - gain * h)
            half = theta / 2
            turn[0], turn[3] = cos(half), sin(half)
            orientation[0] = 1.0
            orientation[1] = orientation[2] = orientation[3] = 0.0
            rho = R - h
            # Changes over the last step; half of them lies ahead till the middle of this one.
            d0, d1, d2, d3, d5 = v0 - u0, v1 - u1, v2 - u2, v3 - u3, v5 - u5
            around = rho * v0
            its_change = around - last_around
            # Drag (9), and what the inertial forces grow by till the middle.
            grows = 2 * m * ahead * (v0 * v1 - u0 * u1)
            applied[0] = rho * (grows - mc * (around + ahead * its_change - rho * omega))
            applied[1] = -m * ahead * (v0 * around - u0 * last_around) - mc * (v1 + ahead * d1)
            applied[2] = -mc * (v2 + ahead * d2)
            applied[3] = -inertia * ahead * (v0 * v5 - u0 * u5)
            applied[5] = inertia * ahead * (v0 * v3 - u0 * u3)
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
            step(model, data)
            u0, u1, u2, u3, u4, u5, last_around = v0, v1, v2, v3, v4, v5, around
        self._last = [u0, u1, u2, u3, u4, u5, last_around]

    def _lands(self, omega_0: float) -> bool:
        """Deal with contacts that carried nothing in the last step; tell whether the ball came down on one."""
        data, margins, timestep = self.data, self.model.pair_margin, self._settings.timestep
        normals, gaps, speeds = data.sensordata[_NORMALS], data.qpos[2:0:-1], data.qvel[2:0:-1]
        lands = (normals == 0) & (gaps < 0) & (speeds * timestep < -_FALL * self._settings.touching(self._p.g))
        if not lands.any():
            return False
        gaps[lands] = 0.0
        load = (np.array(self._last[2:0:-1]) - speeds) / timestep
        margins[:2] = _touching(margins[:2], lands, self._settings.margin(1.0) * load)
        changing = margins, self.model.pair_solref, data.qfrc_constraint, data.sensordata
        kept = [(values, values.copy()) for values in changing]
        last, touches = self._last, (normals > 0) | (gaps <= 0)
        self.model.pair_solref *= _UNDAMPED
        for _ in range(_ROUNDS):
            self._steps([omega_0], mujoco.mj_forward)
            self._last = last
            jump = timestep * (data.qacc - data.qacc_smooth)
            after = speeds + jump[2:0:-1]
            margins[:2] = _margins(margins[:2], after, touches, self._settings)
        if _at_rest(margins[:2], after, speeds, touches):
            data.qvel += jump
        for values, copy in kept:
            values[:] = copy
        return True


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
        self._acceleration, self._smooth = batch.bind("qacc"), batch.bind("qacc_smooth")
        self._contact = self._outputs = batch.bind("qfrc_constraint"), self._sensors
        self.margins, self._solref = batch.expand("pair_margin"), batch.expand("pair_solref")
        self._views(models[0])
        self._coefficients(parameters)
        # What a step makes use of, here because making arrays takes longer than filling them.
        runs = len(models)
        self._now, self._last, self._change = (_Quantities.of(runs) for _ in range(3))
        self._half, self._drag, self._fluid = np.empty(runs), np.empty((3, runs)), np.empty(runs)
        self._around = self._drag[0]
        self._surface, self._square, self._less = (np.empty((2, 2, runs)) for _ in range(3))
        self._mixed, self._ends = self._surface.reshape(4, -1)[1:3], self._surface.reshape(4, -1)[::3]
        self._slides = np.empty((2, 1, runs))
        self._share = np.empty((runs, 2))
        self._take(self._qvel, self._last)
        self._settle(omega_0)

    def _views(self, model: Any) -> None:
        """Views of the engine's arrays, with the runs in the last axis."""
        turn, applied = self._batch.bind("mocap_quat")[:, 0], self._batch.bind("qfrc_applied").T
        self._azimuth, self._inward, self._orientation = self._qpos[:, 0], self._qpos[:, 1], self._qpos[:, 3:7]
        self._gaps, self._speeds = self._qpos[:, 2:0:-1], self._qvel[:, 2:0:-1]
        self._cos, self._sin = turn[:, 0], turn[:, 3]
        self._force, self._torque, self._moment = applied[:3], applied[0], applied[3:6:2]
        floor, wall = (model.geom(name).id for name in ("floor", "wall"))
        surfaces = self._batch.expand("geom_surfacevel")
        self._surfaces = surfaces[:, floor : wall + 1 : wall - floor, :2].transpose(1, 2, 0)

    def _coefficients(self, parameters: Sequence[Parameters]) -> None:
        settings = self._settings
        m, r, R, j, c = (np.array([getattr(p, name) for p in parameters]) for name in ("m", "r", "R", "j", "c"))
        self._r, self._R, self._mc = r, R, m * c
        self._lengths = np.stack([R, np.ones_like(r), np.ones_like(r), r, r, r])
        self._rho = self._lengths[0]
        ahead = settings.midpoint
        self._factors = _Quantities.of(len(m))
        self._factors.velocity[:] = ahead
        self._factors.slip[:] = _SLIDES
        self._factors.product[:] = ahead * np.stack([2 * m / r, -m / r, np.zeros_like(m), -j * m, j * m])
        self._per_slide = settings.friction_lag / _SLIDES
        shift = np.array([settings.memory_gain(mass) for mass in m])
        self._shift = np.stack([-shift / r, shift, shift, shift / r]).reshape(2, 2, -1)
        self._reach = np.array([[settings.touching(p.g)] for p in parameters])
        self._gain, self._shifts = settings.servo_gain, settings.shifts_surfaces

    def _settle(self, omega_0: Array) -> None:
        stiffness = self._settings.solimp * self._settings.k
        approach = self._speeds * self._settings.timestep
        touching = (np.abs(self._gaps) < self._reach) & (np.abs(approach) < self._reach)
        for _ in range(_ROUNDS):
            self._prepare(omega_0)
            self._batch.forward()
            if self._settings.servo:
                lower = self.margins - self._acceleration[:, 2:0:-1] / stiffness
                np.maximum(lower, 0.0, out=self.margins, where=touching)
            self._take(self._qvel - self._settings.timestep * self._acceleration, self._last)

    def sample(self, omega_0: Array, row: Array) -> None:
        split = recorder.NQ + recorder.NV
        row[:, : recorder.NQ], row[:, recorder.NQ : split] = self._qpos, self._qvel
        self.advance(omega_0[None])
        row[:, split:] = self._sensors

    def advance(self, omega_0: Array) -> None:
        gain, gaps, share, margins = self._gain, self._gaps, self._share, self.margins
        for omega in omega_0:
            if gain:
                normals = self._contact[1][:, _NORMALS]
                if not normals.all():
                    self._land(normals == 0, omega)
                np.multiply(gaps, gain, out=share)
                np.subtract(margins, share, out=share)
                np.maximum(share, 0.0, out=margins)
            self._prepare(omega)
            self._batch.step()
            self._now, self._last, self._contact = self._last, self._now, self._outputs

    def _land(self, opened: npt.NDArray[np.bool_], omega_0: Array) -> None:
        """Deal with contacts, marked in (runs, 2), that carried nothing in the last step."""
        timestep = self._settings.timestep
        lands = opened & (self._gaps < 0) & (self._speeds * timestep < -_FALL * self._reach)
        if not lands.any():
            return
        self._gaps[lands] = 0.0
        load = (self._last.velocity[2:0:-1].T - self._speeds) / timestep
        self.margins[:] = _touching(self.margins, lands, self._settings.margin(1.0) * load)
        runs = np.flatnonzero(lands.any(axis=1))
        margins, solref, speeds = self.margins[runs], self._solref[runs], self._speeds[runs]
        touches = ~opened[runs] | (self._gaps[runs] <= 0)
        contact = constraint, sensors = tuple(values.copy() for values in self._contact)
        self._contact = constraint.copy(), sensors.copy()
        self._solref[runs] = solref * _UNDAMPED
        for _ in range(_ROUNDS):
            self._prepare(omega_0)
            self._batch.forward(runs)
            for values, output in zip(self._contact, self._outputs, strict=True):
                values[runs] = output[runs]
            jump = timestep * (self._acceleration[runs] - self._smooth[runs])
            after = speeds + jump[:, 2:0:-1]
            self.margins[runs] = _margins(self.margins[runs], after, touches, self._settings)
        stopped = _at_rest(self.margins[runs], after, speeds, touches)
        self._qvel[runs[stopped]] += jump[stopped]
        self.margins[runs], self._solref[runs], self._contact = margins, solref, contact
        self._take(self._qvel, self._now)
        self._last.rows[:, runs] = self._now.rows[:, runs]

    def state(self) -> dict[str, Array]:
        constraint, sensors = self._contact
        carried = self._carried() | {"qfrc_constraint": constraint, "sensordata": sensors, "last": self._last.rows}
        return {name: values.copy() for name, values in carried.items()}

    def restore(self, state: dict[str, Array]) -> None:
        for name, values in self._carried().items():
            values[...] = state[name]
        # What the engine puts out can't be written back: until its next step, the copies stand in for it.
        self._contact = state["qfrc_constraint"], state["sensordata"]
        self._last.rows[:] = state["last"]

    def _carried(self) -> dict[str, Array]:
        """The arrays that can be written and of which the next step depends on the values."""
        inner = {name: self._batch.bind(name) for name in ("qpos", "qvel", "qacc_warmstart")}
        return inner | {"margins": self.margins, "surfaces": self._surfaces}

    def _take(self, qvel: Array, to: _Quantities) -> None:
        """Put the quantities of the velocities qvel (runs, 6) in their place."""
        np.subtract(self._R, self._inward, out=self._rho)
        np.multiply(qvel.T, self._lengths, out=to.velocity)
        np.multiply(qvel[:, 0], self._r, out=to.spin)
        for operation, left, right, result in to.derived:
            operation(left, right, result)

    def _prepare(self, omega_0: Array) -> None:
        """Write wall, forces and surface velocities for the next step."""
        now, change, drag, around = self._now, self._change, self._drag, self._around
        np.multiply(self._azimuth, 0.5, out=self._half)
        np.cos(self._half, out=self._cos)
        np.sin(self._half, out=self._sin)
        np.copyto(self._orientation, _UPRIGHT)
        self._take(self._qvel, now)
        np.subtract(now.rows, self._last.rows, out=change.rows)
        np.multiply(change.rows, self._factors.rows, out=change.rows)
        # Drag (9), and what the inertial forces grow by till the middle.
        np.add(now.centre, change.centre, out=drag)
        np.multiply(self._rho, omega_0, out=self._fluid)
        np.subtract(around, self._fluid, out=around)
        np.multiply(drag, self._mc, out=drag)
        np.subtract(change.force, drag, out=self._force)
        np.multiply(self._torque, self._rho, out=self._torque)
        np.copyto(self._moment, change.moment)
        if self._shifts:
            self._shift_surfaces(now.slip, change.slip)

    def _shift_surfaces(self, slip: Array, change: Array) -> None:
        """Write the surface velocities; slip and `_SLIDES` times its change, both (2, 2, runs)."""
        (constraint, sensors), surface, slides = self._contact, self._surface, self._slides
        square, less = self._square, self._less
        np.multiply(slip, slip, out=square)
        np.multiply(change, change, out=less)
        np.subtract(square, less, out=square)
        np.add(square[:, :1], square[:, 1:], out=slides)
        np.heaviside(slides, 0.0, out=slides)
        np.multiply(slides, self._per_slide, out=slides)
        np.multiply(change, slides, out=change)
        # The generalised contact forces that hold A_z, A_x, B_y, B_z, less the normal forces in two of them.
        np.subtract(constraint.T[1:3], sensors.T[_NORMALS][::-1], out=self._mixed)
        np.copyto(self._ends, constraint.T[3:5])
        np.multiply(surface, self._shift, out=surface)
        np.add(surface, change, out=self._surfaces)


@dataclass(frozen=True)
class _Quantities:
    """What a step looks at, with the runs in the last axis; all parts are views of `rows`."""

    rows: Array
    velocity: Array
    """(rho omega_c, v_h, v_y, r o_x, r o_y, r o_z), m s-1."""
    slip: Array
    """((v_Az, v_Ax), (v_By, v_Bz)), in the order of the surfaces' axes, m s-1."""
    product: Array
    """r omega_c times (v_h, rho omega_c, 0, r o_z, r o_x), in the order of the inertial forces, m2 s-2."""
    spin: Array
    """r omega_c, m s-1."""

    centre: Array
    """The first three velocities."""
    force: Array
    moment: Array
    """The first three products and the others."""
    derived: tuple[tuple[np.ufunc, Array, Array, Array], ...]
    """What leads from the velocities of the joints to all of these: operation, operands, result."""

    @classmethod
    def of(cls, runs: int) -> Self:
        rows = np.zeros((16, runs))
        v, slip, product, spin = rows[:6], rows[6:10].reshape(2, 2, runs), rows[10:15], rows[15]
        derived = (
            (np.add, v[4], spin, v[4]),
            (np.subtract, v[0:3:2], v[3:6:2], slip[:, 0]),
            (np.add, v[1::-1], v[5:3:-1], slip[:, 1]),
            (np.multiply, v[1::-1], spin, product[:2]),
            (np.multiply, v[5:2:-2], spin, product[3:]),
        )
        return cls(rows, v, slip, product, spin, v[:3], product[:3], product[3:], derived)


def _touching(margins: Array, lands: npt.NDArray[np.bool_], asked: Array) -> Array:
    """Margins (..., 2) with those the load asks for where a ball lands from a flight, in which the servo took them."""
    return np.where(lands & (margins == 0), np.maximum(_TOUCH, asked), margins)


def _margins(margins: Array, after: Array, touches: npt.NDArray[np.bool_], settings: ContactSettings) -> Array:
    """Better margins (..., 2) for an impact that leaves the normal speeds `after`, m s-1, at contacts that touch."""
    better = margins - after / (settings.timestep * settings.solimp * settings.k)
    return np.where(touches, np.maximum(0.0, better), margins)


def _at_rest(margins: Array, after: Array, before: Array, touches: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Whether an impact (..., 2) leaves no contact that touches approaching, and none that was pushed rebounding."""
    small = _REST * np.abs(before).max(axis=-1, keepdims=True)
    well = (after >= -small) & ((margins == 0) | (after <= small))
    return np.asarray((well | ~touches).all(axis=-1))


def _expand_differences(batch: Batch, models: Sequence[Any]) -> None:
    """Give each simulation its own value of every model field in which the models differ."""
    for name in mujoco.batch.MODEL_FIELDS:
        owner, _, field = name.rpartition(".")
        values = [np.asarray(getattr(getattr(model, owner) if owner else model, field)) for model in models]
        if any(not np.array_equal(values[0], value) for value in values[1:]):
            batch.expand(name)[:] = np.stack(values)
