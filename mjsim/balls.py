"""Balls in the engine on joints along the paper's coordinates, each with a step of its own.

Arrays have the runs in the last axis and contacts in the order A, B. One run by itself is driven in plain floats, which
beat arrays of one; where numba is installed, `mjsim.compiled` beats both.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from mjsim import backend
from mjsim.contact_settings import ContactSettings
from mjsim.corrections import NO_LIMIT, Ball, Velocity, corrections, eventful, followed, hovering
from model import Parameters
from model.arrays import Array

GAPS = slice(2, 0, -1)
"""Where the joints hold the gaps (y, h) and what goes with them."""
NORMALS = slice(1, 28, 14)
"""Where the sensors hold the normal forces."""
TICKS = 128
"""Finest steps in one of the settings."""
_DRAG, _TORQUE, _GAIN, _FALL, _MEMORY, _LAG, _HOVER, _WEIGHT, _LIMIT = (
    Ball._fields.index(name)
    for name in ("drag", "torque", "gain", "fall", "memory_A", "lag_A", "hover_A", "weight", "hover")
)
"""Rows of `Balls.table`."""

_OUTPUTS = "qfrc_constraint", "sensordata"
_CONTINUOUS = 0.02
"""Hover number of contacts in short steps: they open below this share of the weight."""
_LEAST = 1e-9
"""Stands in for zero where a quotient would be infinite."""
_NONE = np.empty(0, dtype=np.intp)
Runs = npt.NDArray[np.intp]


class Balls:
    """Views of what the engine holds, and what drives its steps.

    Parameters
    ----------
    models, parameters : one of each for every run
    settings : shared by all runs
    batched : whether to use MuJoCo's batch
    """

    def __init__(
        self, models: Sequence[Any], parameters: Sequence[Parameters], settings: ContactSettings, batched: bool
    ) -> None:
        self.settings, self._compiled = settings, backend.compiled()
        self._form = backend.ARRAYS if batched or self._compiled else backend.FLOATS
        self.engine = backend.batch(models) if batched else backend.single(models[0])
        self.ticks = np.full(len(models), TICKS)
        """How long each run's step is, in finest steps."""
        self._normal = np.array([Ball.of(p, settings) for p in parameters]).T
        self.table, self._still = self._normal.copy(), self._normal.copy()
        """`Ball` of each run, shape (fields, runs)."""
        self.eta = np.array([p.eta for p in parameters])
        self.g = np.array([p.g for p in parameters])
        self.reach = np.array([settings.touching(p.g) for p in parameters])
        """Gaps within which a contact touches at the start, shape (runs,), m."""
        array, lean = self.engine.array, self._form.lean
        self.qpos, self.qvel, self.sensors = array("qpos"), array("qvel"), array("sensordata")
        self.gaps, self.speeds = self.qpos[GAPS], self.qvel[GAPS]
        self.acceleration, self.force = array("qacc"), array("qfrc_smooth")
        self.margins, self.applied = array("pair_margin")[:2], array("qfrc_applied")
        surfaces = array("geom_surfacevel")
        floor, wall = (lean(surfaces[6 * models[0].geom(name).id :][:2]) for name in ("floor", "wall"))
        self._driven = lean(array("mocap_quat")), lean(self.applied), floor, wall
        self._place, self._velocity, self._lean_margins = lean(self.qpos[:3]), lean(self.qvel), lean(self.margins)
        self._orientation = lean(self.qpos[3:7])
        self._upright = lean(np.outer([1.0, 0, 0, 0], np.ones(self.qpos.shape[1])))
        self.last: Array = np.empty(self.qvel.shape)
        """The velocities a step ago."""
        self._lean_last = lean(self.last)
        self._outputs = array(_OUTPUTS[0]), self.sensors[NORMALS]
        self._latest = self._contact = tuple(lean(output) for output in self._outputs)
        self._written = self.last, self.qpos, self.margins, *self._driven
        carried = ("qpos", "qvel", "qacc_warmstart", "pair_margin", "pair_solreffriction", "geom_surfacevel")
        self._carried = {name: array(name) for name in carried} | {"last": self.last}
        self._ball = Ball(*self._quantities(self.table))
        self._alike = True
        """Whether no run has ever had another step: what goes with it is then a batch's, which costs less."""

    @property
    def solref(self) -> Array:
        """Stiffness and damping of the contacts, shape (4, runs), as the engine takes them."""
        return self.engine.array("pair_solref")[:4]

    @property
    def steps(self) -> Array:
        """Each run's step, shape (runs,), s."""
        return self.ticks * (self.settings.timestep / TICKS)

    @property
    def leads(self) -> Array:
        """Time by which each run's positions are ahead of its velocities, shape (runs,), s."""
        return self.steps * self.settings.midpoint

    @property
    def stiffness(self) -> Array:
        """Acceleration of a ball per margin of a contact, shape (runs,), s-2."""
        time, ratio = self.settings.solref
        stiffness: Array = (time * ratio * self.ticks / TICKS) ** -2.0
        return stiffness

    @property
    def loads(self) -> Array:
        """Normal forces of the contacts in the last step, shape (2, runs), N and N m."""
        return _rows(self._contact[1])

    def drive(self, fluid: Array, moving: Runs | None = None, watched: bool = False) -> bool:
        """Let the margins of the `moving` runs follow the gaps and set what drives the next step.

        All runs move if None, and note their velocities, for a step that all take. Do nothing and return False if a
        ball lands in the step or reaches the axis, unless that is `watched`.
        """
        whole, table, ball = moving is None, self.table, self._ball
        if moving is not None:
            table = self._still
            table[:] = self.table
            table[_GAIN], table[_FALL] = 0.0, np.inf
            table[_GAIN : _FALL + 1, moving] = self.table[_GAIN : _FALL + 1, moving]
        if self._compiled:
            if not self._compiled(watched, whole, fluid, table, self.qvel, *self._contact, *self._written):
                return False
        else:
            form, read, margins, turn = self._form, self._form.read, self._lean_margins, self._driven[0]
            ball = ball if whole else Ball(*self._quantities(table))
            place, contact, normals = read(self._place), *(read(each) for each in self._contact)
            velocity, last = Velocity(*read(self._velocity)), Velocity(*read(self._lean_last))
            open_ = not watched and form.some(normals[0] * normals[1] == 0)
            if open_ and form.some(eventful(place, velocity, last, normals, ball)):
                return False
            theta, h, y = place
            margin_A, margin_B = read(margins)
            margins[0], margins[1] = followed(margin_A, y, ball.gain), followed(margin_B, h, ball.gain)
            turn[0], turn[3] = form.cos(theta / 2), form.sin(theta / 2)
            self._orientation[:] = self._upright
            _, applied, floor, wall = self._driven
            forces, (floor[0], floor[1], wall[0], wall[1]) = corrections(
                velocity, last, ball.R - h, self._quantities(fluid), contact, normals, ball
            )
            applied[0], applied[1], applied[2], applied[3], applied[4], applied[5] = forces
            if whole:
                self.last[:] = self.qvel
        if whole:
            self._contact = self._latest
        return True

    def step(self, runs: Runs) -> None:
        """Let the given runs take a step."""
        self.last[:, runs] = self.qvel[:, runs]
        self.engine.step(runs)
        self._note(runs)

    def forward(self, runs: Runs, fluid: Array, less: Array | float = 0.0) -> None:
        """Forces and accelerations of the present state of the given runs, at a fixed time.

        `less`, (6, k), is taken off the forces that drive them.
        """
        self.drive(fluid, _NONE, watched=True)
        self.applied[:, runs] -= less
        self.engine.forward(runs)
        self._note(runs)

    def _note(self, runs: Runs) -> None:
        """Take over the contact forces of some runs, where those in use aren't the engine's own."""
        if self._contact is not self._latest:
            for kept, output in zip(self._contact, self._outputs, strict=True):
                kept.reshape(len(kept), -1)[:, runs] = output[:, runs]

    def resize(self, runs: Runs, ticks: npt.NDArray[np.int_]) -> None:
        """Give runs steps of another length, (k,).

        Positions are moved to their new lead over the velocities with the acceleration of the last step. The remaining
        softness of a closed contact is scaled: stiffness with the inverse square of the step, which keeps the forces.
        """
        if len(runs) == 0:
            return
        ahead = self.settings.midpoint
        before, after = self.steps[runs], ticks * (self.settings.timestep / TICKS)
        ratio = after / before
        change = self.qvel[:, runs] - self.last[:, runs]
        acceleration = change / before
        way = (after - before) * ahead
        self.qpos[:3, runs] += way * (self.qvel[:, runs] + acceleration * (after + before) * ahead / 2)[:3]
        closed, shorter = self.loads[:, runs] > 0, np.minimum(ratio, 1.0)
        softness = np.where(closed, self.margins[:, runs] - self.gaps[:, runs], self.margins[:, runs]) * ratio**2
        self.gaps[:, runs] *= np.where(closed, shorter**2, 1.0)
        self.speeds[:, runs] *= np.where(closed, shorter, 1.0)
        self.margins[:, runs] = np.maximum(softness + closed * self.gaps[:, runs], 0.0)
        self.last[:, runs] = self.qvel[:, runs] - change * ratio
        self.ticks[runs] = ticks
        self._set_steps(runs)

    def _set_steps(self, runs: Runs) -> None:
        """Set all that goes with the steps of some runs alone."""
        scale = self.ticks[runs] / TICKS
        self._alike &= bool((scale == 1).all())
        if self._alike:
            return
        self.engine.set_timestep(self.steps)
        self.solref[:, runs] = np.resize(self.settings.spring, (4, 1)) / scale ** np.array([[2], [1]] * 2)
        self.table[_FALL : _FALL + 2, runs] = self._normal[_FALL : _FALL + 2, runs] * scale
        self.damp(runs)

    def lay_down(self, runs: Runs) -> None:
        """Put runs that have ended to rest, where the fluid does not move them."""
        self.resize(runs, np.full(len(runs), TICKS))
        self.qpos[1:3, runs], self.qvel[:, runs], self.last[:, runs] = 0.0, 0.0, 0.0
        for table in (self.table, self._normal):
            table[_DRAG, runs] = table[_TORQUE, runs] = 0.0
            table[_FALL, runs] = np.inf
        self._ball = Ball(*self._quantities(self.table))

    def damp(self, runs: Runs, load: Array | None = None) -> None:
        """Set the damping of friction: in proportion to the number of steps, as far as contacts stay continuous.

        A contact that slides fast hovers with more than it needs. It bears the weight or, in an impact, a given `load`
        (k,), m s-2. Slip is part of the load: what the damping takes from it, the margin of a closed contact gives.
        """
        self._alike &= load is None
        if self._alike:
            return
        times = np.broadcast_to(TICKS / self.ticks[runs], (2, len(runs)))
        bears, hover = np.maximum(self.g[runs] if load is None else load, _LEAST), self.hover(runs)
        enough = _CONTINUOUS / np.maximum(hover / bears, _LEAST)
        damping = np.where((times == 1) & (load is None), 1.0, np.minimum(enough, times))
        reference = self.engine.array("pair_solreffriction")[:4:2]
        less = (self.settings.solreffriction / reference[:, runs] - damping) * hover / self.stiffness[runs]
        self.margins[:, runs] = np.maximum(self.margins[:, runs] + (self.loads[:, runs] > 0) * less, 0.0)
        reference[:, runs] = self.settings.solreffriction / damping
        self.table[_MEMORY:_LAG, runs] = self._normal[_MEMORY:_LAG, runs] / damping
        self.table[_HOVER:_WEIGHT, runs] = self._normal[_HOVER:_WEIGHT, runs] * damping
        self.table[_LIMIT, runs] = self._normal[_LIMIT, runs] if load is None else NO_LIMIT
        if self.settings.friction_lag:
            self.table[_LAG:_HOVER, runs] = (self._normal[_LAG:_HOVER, runs] + 0.5) * times / damping - 0.5
        self._ball = Ball(*self._quantities(self.table))

    def hover(self, runs: Runs | slice) -> Array:
        """Loads (2, k) below which contacts hover at the present slip and the damping of the settings, m s-2."""
        ball = Ball(*self._normal[:, runs])
        return np.stack(hovering(Velocity(*self.qvel[:, runs]), ball.R - self.qpos[1, runs], ball))

    @property
    def ball(self) -> Ball:
        """What drives all runs, each quantity (runs,)."""
        return Ball(*self.table)

    def state(self) -> dict[str, Array]:
        """Copies of all that is carried from one step to the next."""
        more = dict(zip(_OUTPUTS, self._contact, strict=True)) | {"ticks": self.ticks}
        return {name: _rows(values) for name, values in (self._carried | more).items()}

    def restore(self, state: dict[str, Array]) -> None:
        """Go on from such a state."""
        for name, values in (self._carried | {"ticks": self.ticks}).items():
            values[...] = state[name].reshape(values.shape)
        # What the engine puts out can't be written back: until its next step, the copies stand in for it.
        self._contact = tuple(self._form.lean(state[name]) for name in _OUTPUTS)
        self._set_steps(np.arange(len(self.ticks)))

    def _quantities(self, rows: Array) -> Any:
        """The rows of an array (n, runs) as quantities."""
        return self._form.read(self._form.lean(rows))


def _rows(lean: Array) -> Array:
    """A copy of a lean array with the runs in the last axis."""
    return np.array(lean).reshape(len(lean), -1)
