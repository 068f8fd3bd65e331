"""The loop round MuJoCo's step, the same for one run and for a batch.

Before each step the wall is turned to be tangent at the ball's azimuth, the margins follow the gaps, and
`mjsim.corrections` says what drives the step. The body axes of a homogeneous ball are arbitrary: they are set upright,
so that forces and velocities of the ball's joint are along the paper's axes. Positions are kept half a step ahead of
velocities (leapfrog).

A ball that lands in a step, or comes near the axis, where polar coordinates end, takes it as `mjsim.landing` says; so
it does the first one, which finds the margins and forces that belong to the start.

Arrays have the runs in the last axis and contacts in the order A, B.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
import numpy.typing as npt
from mujoco.batch import MODEL_FIELDS, Batch

from mjsim import recorder
from mjsim.contact_settings import ContactSettings
from mjsim.corrections import BEGINS, GOES_ON, LANDS, NOT, Ball, Velocity, ball_of, near_axis
from model import Parameters, State
from model.arrays import Array

if TYPE_CHECKING:
    from mjsim.landing import Fine, Landed

HUGE = 1e10
"""Beyond this MuJoCo takes a coordinate for divergence (mjMAXVAL)."""
_CHANGE = 0.5
"""Most that contact forces may change in a step before the ball goes on upon its joints, in units of what the
largest force, at least that of gravity and the wall's friction, does as the ball goes round."""


class Polar:
    """One or many balls on joints along the paper's coordinates.

    Parameters
    ----------
    models, parameters, x0s : one of each for every run; full states (8,); omega_0 is that of the steps
    settings : shared by all runs
    theta_0 : azimuth at the start, rad
    """

    def __init__(
        self, models: Sequence[Any], parameters: Sequence[Parameters], settings: ContactSettings,
        x0s: Sequence[npt.ArrayLike], theta_0: float,
    ) -> None:  # fmt: skip
        from mjsim import compiled  # here, because numba takes long to load

        self._parameters, self._settings, runs = parameters, settings, len(models)
        self.model = models[0]
        self.data, array, self._step = _batch(models) if runs > 1 else _single(models[0])
        self._drive, self._h, self.lead = compiled.drive, settings.timestep, settings.timestep * settings.midpoint
        """What is done before a step; the step, and how far places are ahead of velocities, s."""
        self._qpos, self._qvel, sensors = array("qpos"), array("qvel"), array("sensordata")
        self.margins, self._sensors = array("pair_margin")[:2], sensors.T
        """Margins of the contacts, shape (2, runs), m."""
        surfaces, self._start = array("geom_surfacevel"), array("qacc_warmstart")
        floor, wall = (surfaces[6 * models[0].geom(name).id :][:2] for name in ("floor", "wall"))
        self._last, self._forces = np.zeros((6, runs)), np.zeros((8, runs))
        """Velocities a step ago; generalised forces of the contacts in the last step (6), N and N m, and normal ones,
        which are the engine's, but for"""
        self._held, self._due = np.ones(runs, dtype=bool), np.full(runs, NOT, dtype=np.int8)
        """runs whose last step wasn't the engine's; and whether they take the next one in fine ones."""
        self._adhesion = array("pair_adhesion")[:2]
        """By how much the engine tells that contacts bear less than they do, N."""
        given = {"forces": self._forces, "qvel": self._qvel, "last": self._last, "qpos": self._qpos}
        given["margins"] = self.margins
        self._state: dict[str, Any] = given | {"start": self._start, "due": self._due}
        """All that is carried from one step to the next."""
        self._arguments = (
            np.array([Ball.of(p, settings) for p in parameters]).T, self._due, self._held, array("qfrc_constraint"),
            sensors[recorder.NORMALS], *given.values(), array("mocap_quat"), array("qfrc_applied"), floor, wall,
            self._adhesion,
        )  # fmt: skip
        self._fine = functools.cache(functools.partial(_fine, settings=settings))
        for run, (x0, p) in enumerate(zip(x0s, parameters, strict=True)):
            x = State.of(x0)
            place, v = recorder.joint_state(x, theta_0, p)
            fall = settings.slowest_fall(p.g)
            calm = all(speed >= -fall or gap > -self._h * speed for gap, speed in ((x.y, x.v_y), (x.h, x.v_h)))
            if settings.servo:
                self._due[run] = BEGINS if calm else LANDS
            self._set(run, place, v, np.zeros(6))

    def _set(self, run: int, place: Array, v: Array, rates: Array) -> None:
        """Let a run go on from a place and velocities at one time, with such accelerations and the forces it has."""
        self._qvel[:, run], self._last[:, run], self._start[:, run] = v, v - self._h * rates, rates
        self._qpos[:3, run] = place + self.lead * (v + rates * self.lead / 2)[:3]
        self._held[run] = True

    def advance(self, omega_0: Array, rows: Array | None = None) -> None:
        """Take steps with omega_0 (steps, runs), and note each in rows (steps, runs, `COLUMNS`)."""
        scratch = np.empty((len(self._due), recorder.COLUMNS))
        for fluid, row in zip(omega_0, itertools.repeat(scratch) if rows is None else rows, strict=False):
            some = self._drive(fluid, row, *self._arguments)
            lands = list(self._landing()) if some else []
            self._last[:] = self._qvel
            self._step()
            self._held[:], self._due[:] = False, NOT
            row[:, recorder.SENSORS :] += self._sensors
            for run, how, x, theta, rates, gaps in lands:
                fine = self._fine(self._parameters[run])
                landed = fine.step(x, theta, rates, float(fluid[run]), how != LANDS)
                self._land(run, landed, how == BEGINS)
                row[run, recorder.SENSORS :], row[run, -2:] = landed.seen, gaps

    def _landing(self) -> Iterator[tuple[Any, ...]]:
        """Runs that land in the coming step, but for those that have diverged.

        Of each its number, and how; state and azimuth at the time of its velocities, what a second changes of these;
        and gaps.
        """
        sound = (np.abs(self._qpos) < HUGE).all(axis=0) & (np.abs(self._qvel) < HUGE).all(axis=0)
        for run in np.flatnonzero((self._due != NOT) & sound).tolist():
            ahead, v = self._qpos[:3, run], self._qvel[:, run]
            rates = (v - self._last[:, run]) / self._h
            place = ahead - self.lead * (v + rates * self.lead / 2)[:3]
            x, gaps = recorder.state(place, v, self._parameters[run]), ahead[:0:-1].copy()
            yield run, int(self._due[run]), x, float(place[0]), rates, gaps

    def _land(self, run: int, landed: Landed, calm: bool) -> None:
        """Go on after a step in fine ones: upon the joints, if forces change slowly or are `calm`, and the axis is far.

        The contacts get margins with which they bear their forces.
        """
        p, v = self._parameters[run], landed.velocity
        near = (
            near_axis(p.R - landed.place[1], Velocity(*v), ball_of(self._arguments[0], run)) and landed.forces[7] == 0
        )
        pace = max(abs(v[0]), math.sqrt(p.g / p.R))
        most = max(p.m * (p.g + p.eta * p.R * pace**2), np.abs(landed.forces[[1, 2]]).max())
        fast = landed.change > _CHANGE * self._h * pace * most and not calm
        self._due[run] = GOES_ON if near or fast else NOT
        self._forces[:, run] = landed.forces
        self._set(run, landed.place, v, landed.rates * (not near))
        if self._settings.servo:
            loads = landed.forces[6:] / p.m
            self.margins[:, run] = np.maximum(landed.place[:0:-1] + self._settings.margin(loads), 0.0) * (loads > 0)

    def state(self) -> dict[str, Array]:
        """Copies of all that is carried from one step to the next."""
        contact, normals = self._arguments[3:5]
        np.copyto(self._forces, np.concatenate([contact, normals + self._adhesion]), where=~self._held)
        return {name: values.copy() for name, values in self._state.items()}

    def restore(self, state: dict[str, Array]) -> None:
        """Go on from such a state."""
        for name, values in self._state.items():
            values[...] = state[name]
        self._held[:] = True


def _fine(p: Parameters, settings: ContactSettings) -> Fine:
    """What takes fine steps with such a ball."""
    from mjsim.landing import Fine  # here, because the law takes long to load

    return Fine(p, settings)


def _single(model: Any) -> tuple[Any, Callable[[str], Array], Callable[[], Any]]:
    """MuJoCo for one run: its data, fields of them or of the model as views (n, 1), and its step."""
    data = mujoco.MjData(model)

    def array(name: str) -> Array:
        return np.asarray(getattr(data if hasattr(data, name) else model, name)).reshape(-1, 1)

    return data, array, functools.partial(mujoco.mj_step, model, data)


def _batch(models: Sequence[Any]) -> tuple[Any, Callable[[str], Array], Callable[[], Any]]:
    """For many, each with its own value of every model field in which the models differ; views (n, runs)."""
    made = Batch(models[0], nsim=len(models), nthread=1)
    for name in MODEL_FIELDS:
        owner, _, field = name.rpartition(".")
        values = [np.asarray(getattr(getattr(model, owner) if owner else model, field)) for model in models]
        if len({value.tobytes() for value in values}) > 1:
            made.expand(name)[:] = np.stack(values)

    def array(name: str) -> Array:
        values: Array = made.expand(name) if name in MODEL_FIELDS else made.bind(name)
        values = values[:, 0] if name == "mocap_quat" else values  # there is one mocap body
        return values.reshape(len(models), -1).T

    return None, array, made.step
