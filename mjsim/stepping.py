"""The loop round MuJoCo's step, the same for one run and for a batch.

Before each step the wall is turned to be tangent at the ball's azimuth, the margins follow the gaps, and
`mjsim.corrections` says what drives the step. The body axes of a homogeneous ball are arbitrary: they are set upright,
so that forces and velocities of the ball's joint are along the paper's axes. Positions are kept half a step ahead of
velocities (leapfrog).

A step in which a ball lands is divided: halved until the landing lies within a finest step, where `mjsim.landing` deals
with it. From there on the steps are as long as the forces allow that change after an impact, up to the whole.

Polar coordinates end at the vessel's axis: `mjsim.axis` takes a ball past it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from mjsim import axis, landing, recorder
from mjsim.balls import TICKS, Balls, Runs
from mjsim.contact_settings import ContactSettings
from mjsim.corrections import Ball, Velocity, near_axis
from model import Parameters
from model.arrays import Array

_LANDINGS = 20
"""Most rounds in which a step is halved or a landing is dealt with."""
_JUDGED = 8
"""Short steps after which their length is adapted."""
_CHANGE = 0.25
"""Most that accelerations may change in a divided step, in units of what the largest, at least that of gravity and the
wall's friction, does in a whole step as the ball goes round. Four times less brings motions through landings no more
than a fifth closer to those of a tenth of the step: the engine against itself, on random sets
(docs/mujoco-settings.md)."""
_CARRIED = "given_up", "_more", "_passing"
"""What is carried from one step to the next beside the balls."""
_SHARE, _MOST = 16, 30_000
"""A run that takes this many divided steps more than so many in each whole one is given up. Balls that hop take three,
a contact that opens and closes for ever takes all 128."""


class Polar:
    """One or many balls on joints along the paper's coordinates.

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
        self._balls = balls = Balls(models, parameters, settings, batched)
        self.model, self.data = models[0], balls.engine.data
        self.margins = balls.margins
        """Margins of the contacts, shape (2, runs), m."""
        self._sensors = balls.sensors.T
        self._parameters = parameters
        self._R, self._r = (np.array([getattr(p, name) for p in parameters]) for name in "Rr")
        self.given_up, self._steps = np.full(len(models), np.inf), 0
        """When each run was given up, as its steps were divided again and again, s; inf for those that go on."""
        self._more, self._counted = np.zeros(len(models)), 0
        """Divided steps that each run has taken beyond its share, and the whole steps that were counted."""
        self._passing = np.full((6, len(models)), np.nan)
        """Acceleration and that of the spin in world axes of balls that pass the axis, m s-2 and rad s-2."""
        start = [recorder.joint_state(x, theta_0, p) for x, p in zip(x0s, parameters, strict=True)]
        balls.qpos[:], balls.qvel[:] = (np.stack(part, axis=-1) for part in zip(*start, strict=True))
        self._whole = True
        """Whether all runs take whole steps."""
        landing.begin(balls, omega_0)

    def advance(self, omega_0: Iterable[Array], sensors: Array | None = None, row: Array | None = None) -> None:
        """Take a step for each omega_0 (runs,), and note its sensors, (steps, runs, `NSENSOR`).

        A row (runs, `COLUMNS`) gets (qpos, qvel, sensors) of the first step and the time by which positions are ahead.
        """
        balls = self._balls
        if row is not None:
            row[:, : recorder.NQ], row[:, recorder.NQ : recorder.SENSORS] = balls.qpos.T, balls.qvel.T
            row[:, 3 : recorder.NQ] = 1, 0, 0, 0  # as every step begins; others of the batch may have begun one since
            row[:, -1] = balls.leads
        for k, fluid in enumerate(omega_0):
            if self._whole and balls.drive(fluid):
                balls.engine.step_all()  # mj_step
                if sensors is not None:
                    sensors[k] = self._sensors
            else:
                self._divided(fluid, None if sensors is None else sensors[k])
            self._steps += 1
        if row is not None and sensors is not None:
            row[:, recorder.SENSORS : -1] = sensors[0]

    def _divided(self, fluid: Array, sensors: Array | None) -> None:
        """Take a step in which some ball lands or comes near the axis; the others take it in one."""
        balls = self._balls
        gaps = (balls.gaps + balls.speeds * (balls.settings.timestep * balls.settings.midpoint - balls.leads)).T
        left, taken = np.full(len(balls.ticks), TICKS), np.zeros(len(balls.ticks), dtype=int)
        before = self._rates(slice(None))
        self._more = np.maximum(self._more - _SHARE * (self._steps - self._counted), 0.0)
        self._counted = self._steps
        while len(runs := np.flatnonzero(left)):
            if np.isfinite(self._passing[0, runs]).any() or not balls.drive(fluid, runs):
                self._watch(runs, fluid)
                balls.drive(fluid, runs, watched=True)
            passes = np.isfinite(self._passing[0, runs])
            for k in runs[passes]:
                axis.advance(balls, k, self._parameters[k], self._passing[:, k])
            if not passes.all():
                balls.step(runs[~passes])
            if sensors is not None:
                first = runs[left[runs] == TICKS]
                sensors[first] = self._sensors[first]
                sensors[first, -2:] = gaps[first]
            left[runs] -= balls.ticks[runs]
            taken[runs] += 1
            self._more[runs] += 1
            ends = (taken[runs] == _JUDGED) | (left[runs] == 0)
            judged = runs[ends & (balls.ticks[runs] < TICKS) & ~passes]
            if len(judged):  # halve or double their short steps by how accelerations changed in those taken
                ticks, g, radius = balls.ticks[judged], balls.g[judged], self._R[judged]
                rates = self._rates(judged)
                change = np.abs(rates - before[:, judged]).max(axis=0) / taken[judged]
                pace = np.maximum(np.abs(balls.qvel[0, judged]), np.sqrt(g / radius))
                forces = np.maximum(g + balls.eta[judged] * radius * pace**2, np.abs(rates).max(axis=0))
                usual = balls.settings.timestep * pace * forces
                grows = (change < _CHANGE * usual / 4) & (left[judged] % (2 * ticks) == 0)
                changes = grows | ((change > _CHANGE * usual) & (ticks > 1))
                balls.damp(judged[~changes])
                balls.resize(judged[changes], np.where(grows, 2 * ticks, ticks // 2)[changes])
                before[:, judged], taken[judged] = rates, 0
        lost = np.flatnonzero(self._more > _MOST)
        if len(lost):
            self.given_up[lost], self._more[lost] = self._steps * balls.settings.timestep, 0.0
            balls.lay_down(lost)
        self._whole = bool((balls.ticks == TICKS).all())

    def _watch(self, runs: Runs, fluid: Array) -> None:
        """Divide steps in which a ball lands or comes near the axis, and let those land that do."""
        balls = self._balls
        gone = runs[np.isfinite(self._passing[0, runs]) & ~self._near(runs)]
        if len(gone):
            self._passing[:, gone] = np.nan
            closed = landing.touching(balls) | (balls.gaps <= 0)
            landing.restart(balls, gone, np.zeros(len(gone)), closed[:, gone], fluid)
        for _ in range(_LANDINGS):
            moments = landing.moments(balls)
            first, near = moments.min(axis=0), self._near(runs)
            due = np.isfinite(first[runs]) & np.isnan(self._passing[0, runs])
            fine = balls.ticks[runs] == 1
            coarse, lands = runs[(due | near) & ~fine], runs[due & fine]
            if len(coarse) == 0 == len(lands):
                break
            balls.resize(coarse, balls.ticks[coarse] // 2)
            if len(lands):
                closed = (moments == first) | landing.touching(balls)
                landing.restart(balls, lands, first[lands], closed[:, lands], fluid)
        for k in runs[near & fine & np.isnan(self._passing[0, runs])]:
            self._passing[:, k] = axis.acceleration(balls, k, self._parameters[k])

    def _near(self, runs: Runs) -> npt.NDArray[np.bool_]:
        """Which of the runs are so near the axis that their steps are too long."""
        balls = self._balls
        rho, ball = self._R[runs] - balls.qpos[1, runs], Ball(*balls.table[:, runs])
        near: npt.NDArray[np.bool_] = near_axis(rho, Velocity(*balls.qvel[:, runs]), ball) & (balls.loads[1, runs] == 0)
        return near

    def _rates(self, runs: Runs | slice) -> Array:
        """What forces and moments accelerated in the last step, (6, k), m s-2: not what the axes do as they turn."""
        balls, (omega_c, v_h, _, o_x, _, o_z) = self._balls, self._balls.qvel[:, runs]
        rates: Array = (balls.qvel[:, runs] - balls.last[:, runs]) / balls.steps[runs]
        rho = self._R[runs] - balls.qpos[1, runs]
        rates[0] = rho * rates[0] - 2 * omega_c * v_h
        rates[1] += rho * omega_c**2
        rates[3:] += omega_c * np.stack([o_z, 0 * o_z, -o_x])
        rates[3:] *= self._r[runs]
        return rates

    def state(self) -> dict[str, Array]:
        """Copies of all that is carried from one step to the next."""
        return (
            self._balls.state()
            | {"steps": np.array([self._steps, self._counted])}
            | {name: getattr(self, name).copy() for name in _CARRIED}
        )

    def restore(self, state: dict[str, Array]) -> None:
        """Go on from such a state."""
        self._balls.restore(state)
        self._steps, self._counted = state["steps"].tolist()
        for name in _CARRIED:
            getattr(self, name)[:] = state[name]
        self._whole = bool((self._balls.ticks == TICKS).all())
