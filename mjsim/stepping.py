"""The loop round MuJoCo's step, the same for one run and for a batch.

Before each step the wall is turned to be tangent at the ball's azimuth, the margins follow the gaps, landings are dealt
with, and `mjsim.corrections` says what drives the step. The body axes of a homogeneous ball are arbitrary: they are set
upright, so that forces and velocities of the ball's joint are along the paper's axes. Positions are kept half a step
ahead of velocities (leapfrog).

Arrays have the runs in the last axis and contacts in the order A, B. One run by itself is stepped in plain floats,
which beat arrays of one; where numba is installed, `mjsim.compiled` beats both.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from mjsim import backend, recorder
from mjsim.contact_settings import ContactSettings
from mjsim.corrections import Ball, Velocity, corrections, followed
from model import Parameters
from model.arrays import Array

_GAPS = slice(2, 0, -1)
"""Where the joints hold the gaps (y, h) and what goes with them."""
_NORMALS = slice(1, None, 14)
"""Where the sensors hold the normal forces."""
_ROUNDS = 40
"""Rounds of the search for margins and forces that belong to the first state, or to an impact."""
_UNDAMPED = np.array([[1e6], [1e-6]] * 2)
"""Factors of solref that leave the stiffness and take away the damping: an impact's impulse is the margin's alone."""
_FALL = 0.01
"""Way in a step from which on it is an impact, in units of the gap that counts as touching."""
_REST = 1e-6
"""Normal speed after an impact, relative to that before, up to which the search for the impulses has succeeded."""
_TOUCH = 1e-15
"""Least margin of a ball that has just landed, m: more than the round-off of a gap, or the engine sees no contact."""


class Stepper(Protocol):
    """One or many simulations in the engine."""

    margins: Array
    """Margins of the contacts, shape (2, runs), m."""
    axis: Array
    """When each run reached the vessel's axis, s; inf for those that have not."""

    def advance(self, omega_0: Iterable[Array], row: Array | None = None) -> None:
        """Take a step for each omega_0 (runs,); write (qpos, qvel, sensors) of the first to row (runs, 41)."""

    def state(self) -> dict[str, Array]:
        """Copies of all that is carried from one step to the next."""

    def restore(self, state: dict[str, Array]) -> None:
        """Go on from such a state."""


class Polar(Stepper):
    """Balls on joints along the paper's coordinates.

    Parameters
    ----------
    models, parameters, x0s : one of each for every run; full states (8,)
    settings : shared by all runs
    theta_0 : azimuth at the start, rad
    omega_0 : in the first step, shape (runs,), rad s-1
    batched : whether to use MuJoCo's batch; more than one run needs it
    """

    def __init__(
        self, models: Sequence[Any], parameters: Sequence[Parameters], settings: ContactSettings,
        x0s: Sequence[npt.ArrayLike], theta_0: float, omega_0: Array, batched: bool = True,
    ) -> None:  # fmt: skip
        self._settings, self._compiled = settings, backend.compiled()
        self._form = backend.ARRAYS if batched or self._compiled else backend.FLOATS
        self._engine = backend.batch(models) if batched else backend.single(models[0])
        self.model, self.data = models[0], self._engine.data
        self._take_views()
        self._balls = np.array([Ball.of(p, settings) for p in parameters]).T
        self._ball = Ball(*self._quantities(self._balls))
        self._reach = np.array([settings.touching(p.g) for p in parameters])
        self._radius = np.array([p.R for p in parameters])
        self.axis, self._steps = np.full(len(models), np.inf), 0
        start = [recorder.joint_state(x, theta_0, p) for x, p in zip(x0s, parameters, strict=True)]
        self._qpos[:], self._qvel[:] = (np.stack(part, axis=-1) for part in zip(*start, strict=True))
        self._qpos[:3] += settings.lead * self._qvel[:3]
        self._last[:] = self._qvel
        self._settle(omega_0)

    def _take_views(self) -> None:
        array, lean = self._engine.array, self._form.lean
        self._qpos, self._qvel, self._sensors = array("qpos"), array("qvel"), array("sensordata")
        self._gaps, self._speeds = self._qpos[_GAPS], self._qvel[_GAPS]
        self._acceleration, self._smooth = array("qacc"), array("qacc_smooth")
        self.margins, self._solref = array("pair_margin")[:2], array("pair_solref")[:4]
        surfaces = array("geom_surfacevel")
        floor, wall = (lean(surfaces[6 * self.model.geom(name).id :][:2]) for name in ("floor", "wall"))
        self._driven = lean(array("mocap_quat")), lean(array("qfrc_applied")), floor, wall
        self._place, self._velocity, self._lean_margins = lean(self._qpos[:3]), lean(self._qvel), lean(self.margins)
        self._orientation = lean(self._qpos[3:7])
        self._upright = lean(np.outer([1.0, 0, 0, 0], np.ones(self._qpos.shape[1])))
        self._outputs = array("qfrc_constraint"), self._sensors[_NORMALS]
        self._latest = self._contact = tuple(lean(output) for output in self._outputs)
        self._written = self._qpos, self.margins, *self._driven
        self._last: Array = np.empty(self._qvel.shape)  # the velocities a step ago
        self._lean_last = lean(self._last)
        carried = ("qpos", "qvel", "qacc_warmstart", "pair_margin", "geom_surfacevel")
        self._carried = {name: array(name) for name in carried} | {"last": self._last}

    def advance(self, omega_0: Iterable[Array], row: Array | None = None) -> None:
        for fluid in omega_0:
            if row is not None:
                row[:, : recorder.NQ], row[:, recorder.NQ : recorder.SENSORS] = self._qpos.T, self._qvel.T
            if not self._drive(fluid, watched=False):
                self._watch(fluid)
                self._drive(fluid, watched=True)
            self._last[:] = self._qvel
            self._engine.step()
            self._contact, self._steps = self._latest, self._steps + 1
            if row is not None:
                row[:, recorder.SENSORS :], row = self._sensors.T, None

    def _drive(self, fluid: Array, watched: bool) -> bool:
        """Let the margins follow the gaps and set what drives the next step.

        Do nothing and return False if some contact carried nothing in the last step and has not been `watched`.
        """
        if self._compiled:
            return self._compiled(watched, fluid, self._balls, self._last, self._qvel, *self._contact, *self._written)
        read, margins, gain = self._form.read, self._lean_margins, self._ball.gain
        load_A, load_B = read(self._contact[1])
        if not watched and self._form.some(load_A * load_B == 0):
            return False
        if self._settings.servo:
            _, h, y = read(self._place)
            margin_A, margin_B = read(margins)
            margins[0], margins[1] = followed(margin_A, y, gain), followed(margin_B, h, gain)
        self._prepare(fluid)
        return True

    def _prepare(self, fluid: Array) -> None:
        """Set the wall and everything that drives the next step."""
        form, ball, turn, applied, floor, wall = self._form, self._ball, *self._driven
        theta, h, _ = form.read(self._place)
        turn[0], turn[3] = form.cos(theta / 2), form.sin(theta / 2)
        self._orientation[:] = self._upright
        velocity, last = Velocity(*form.read(self._velocity)), Velocity(*form.read(self._lean_last))
        contact, normals = self._contact
        forces, (floor[0], floor[1], wall[0], wall[1]) = corrections(
            velocity, last, ball.R - h, form.one(fluid), form.read(contact), form.read(normals), ball
        )
        applied[0], applied[1], applied[2], applied[3], _, applied[5] = forces

    def _watch(self, fluid: Array) -> None:
        """See whether a ball that lacks a contact reaches the axis within a step, or has come down on the contact."""
        load_A, load_B = self._form.read(self._contact[1])
        _, h, y = self._form.read(self._place)
        _, v_h, *_ = self._form.read(self._velocity)
        if self._form.some(self._ball.R - h <= self._settings.timestep * v_h):
            reaches = self._radius - self._qpos[1] <= self._settings.timestep * self._qvel[1]
            self.axis[reaches] = np.minimum(self.axis[reaches], self._steps * self._settings.timestep)
        if self._settings.servo and self._form.some((load_A == 0) & (y < 0) | (load_B == 0) & (h < 0)):
            self._land(fluid)

    def _quantities(self, rows: Array) -> Any:
        """The rows of an array (n, runs) as quantities."""
        return self._form.read(self._form.lean(rows))

    def _settle(self, omega_0: Array) -> None:
        """Find the margins, friction forces and accelerations that belong to the first state, at a fixed time."""
        settings, timestep = self._settings, self._settings.timestep
        touching = (np.abs(self._gaps) < self._reach) & (np.abs(self._speeds * timestep) < self._reach)
        for _ in range(_ROUNDS):
            self._prepare(omega_0)
            self._engine.forward(None)
            if settings.servo:
                lower = self.margins - self._acceleration[_GAPS] / (settings.solimp * settings.k)
                np.maximum(lower, 0.0, out=self.margins, where=touching)
            self._last[:] = self._qvel - timestep * self._acceleration

    def _land(self, omega_0: Array) -> None:
        """Stop balls that came down on a contact which carried nothing in the last step.

        Such a ball overlaps by up to a step's way before the engine sees it; the stiffness would throw it back with up
        to a quarter of its speed, however small the step, and the other contact would answer a step late. It is set on
        the surface, and `mj_forward` gives the impulses at both contacts at a fixed time, while the margins are
        adjusted until neither contact approaches or rebounds.
        """
        settings, timestep, normals = self._settings, self._settings.timestep, self._rows(self._contact[1])
        lands = (normals == 0) & (self._gaps < 0) & (self._speeds * timestep < -_FALL * self._reach)
        if not lands.any():
            return
        self._gaps[lands] = 0.0
        # In flight the servo has taken the margin; the load asks for one.
        asked = settings.margin(1.0) * (self._last[_GAPS] - self._speeds) / timestep
        self.margins[:] = np.where(lands & (self.margins == 0), np.maximum(_TOUCH, asked), self.margins)
        runs = np.flatnonzero(lands.any(axis=0))
        self._stop(runs, ((normals > 0) | (self._gaps <= 0))[:, runs], omega_0)
        self._last[:, runs] = self._qvel[:, runs]  # the jump is over: nothing of it goes on in the next step

    def _stop(self, runs: npt.NDArray[np.intp], touches: npt.NDArray[np.bool_], omega_0: Array) -> None:
        """Apply the impulses that stop the given runs at the contacts that touch, (2, n), if there are such."""
        settings, timestep = self._settings, self._settings.timestep
        before, margins, solref = self._speeds[:, runs], self.margins[:, runs], self._solref[:, runs]
        kept, tried = ([self._rows(part) for part in self._contact] for _ in range(2))
        self._contact = tuple(self._form.lean(rows) for rows in tried)
        self._solref[:, runs] = solref * _UNDAMPED
        for _ in range(_ROUNDS):
            self._prepare(omega_0)
            self._engine.forward(runs)
            for rows, output in zip(tried, self._outputs, strict=True):
                rows[:, runs] = output[:, runs]
            jump = timestep * (self._acceleration - self._smooth)[:, runs]
            after = before + jump[_GAPS]
            better = self.margins[:, runs] - after / (timestep * settings.solimp * settings.k)
            self.margins[:, runs] = np.where(touches, np.maximum(0.0, better), self.margins[:, runs])
        small = _REST * np.abs(before).max(axis=0)
        rests = (after >= -small) & ((self.margins[:, runs] == 0) | (after <= small))
        stopped = (rests | ~touches).all(axis=0)
        self._qvel[:, runs[stopped]] += jump[:, stopped]
        self.margins[:, runs], self._solref[:, runs] = margins, solref
        self._contact = tuple(self._form.lean(rows) for rows in kept)

    def _rows(self, lean: Array) -> Array:
        """A copy of a lean array with the runs in the last axis."""
        return np.array(lean).reshape(len(lean), -1)

    def state(self) -> dict[str, Array]:
        constraint, normals = self._contact
        more = {"constraint": constraint, "normals": normals}
        state = {name: self._rows(values) for name, values in (self._carried | more).items()}
        return state | {"axis": self.axis.copy(), "steps": np.array(self._steps)}

    def restore(self, state: dict[str, Array]) -> None:
        for name, values in self._carried.items():
            values[...] = state[name]
        # What the engine puts out can't be written back: until its next step, the copies stand in for it.
        self._contact = tuple(self._form.lean(state[name]) for name in ("constraint", "normals"))
        self.axis[:], self._steps = state["axis"], int(state["steps"])
