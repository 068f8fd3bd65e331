"""The stationary states and the transient on which settings are tried, and how far a run is from them.

A run of a state starts at rest against the wall, which is no solution of the problem, and is judged only once that
start is forgotten: a run that began in the state would stay there whatever it would have converged to.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

import analytic
from analytic import StationarySolution
from compare.runs.tasks import Task
from model import Case, Contact, Parameters, Trajectory
from model.arrays import Array

EPS = float(np.finfo(float).eps)
SMOOTH, ROUGH = Parameters.named("reference"), Parameters.named("high-wall-friction")
WINDOW = 0.1
"""Last part of a settled run, which is averaged."""
AT_REST = (0.0,) * 8
"""Start against the wall, on the floor."""


@dataclass(frozen=True)
class State:
    """A stationary state that a ball settles in."""

    p: Parameters
    case: Case

    @property
    def name(self) -> str:
        """Case and omega_0."""
        return f"{self.case.name} at {self.p.omega_0:g}"

    @cached_property
    def solution(self) -> StationarySolution:
        """The state in closed form; raises as `analytic.solution`."""
        return analytic.solution(self.p, self.case)

    @property
    def forgets(self) -> float:
        """Time in s after which what is left of the start is lost in round-off.

        That takes ln(1/eps) = 36 time constants: the slowest of the state, or that of spinning up before, (1 + 2j)/c.
        """
        return -math.log(EPS) * max(analytic.slowest_time_constant(self.solution), (1 + 2 * self.p.j) / self.p.c)


ROLLING = State(SMOOTH.replace(omega_0=12.0), Case.RR)
SLIPPING = State(SMOOTH.replace(omega_0=25.0), Case.SS)
STATES = (ROLLING, State(SMOOTH.replace(omega_0=14.5), Case.SS), SLIPPING, State(ROUGH.replace(omega_0=25.0), Case.NR))
"""Rolling, slipping little and much, and carried by the wall alone."""


@dataclass(frozen=True)
class Held:
    """How far a settled run is from a state; nan if it diverged."""

    name: str
    """Of the state."""
    omega_c: float
    """Relative error of omega_c."""
    slip: float
    """Largest error of a component of slip, times r, m s-1."""
    open: float
    """Largest share of samples in which a contact that should carry a force carries none."""
    creep: float
    """Largest mean slip speed at a contact that should roll, m s-1; 0 if none should."""


def held(run: Trajectory, state: State, since: float) -> Held:
    """Compare the samples of a run from a time in s with a state."""
    if not run.complete:
        return Held(state.name, *[math.nan] * 4)
    last, x = slice(int(np.searchsorted(run.time, since)), None), state.solution.x
    contacts = (
        (state.case.A, run.slip_speed_A[last], run.force_A[last, 1]),
        (state.case.B, run.slip_speed_B[last], run.force_B[last, 0]),
    )
    return Held(
        name=state.name,
        omega_c=float(run.omega_c[last].mean() / x[2]) - 1,
        slip=float(np.abs(run.x[last, 3:6].mean(axis=0) - x[3:6]).max()) * state.p.r,
        open=max(float(np.mean(normal <= 0)) for contact, _, normal in contacts if contact is not Contact.N),
        creep=max([float(speed.mean()) for contact, speed, _ in contacts if contact is Contact.R], default=0.0),
    )


TRANSIENT = "approach to " + SLIPPING.name
KICKED = (0.0, 0.0, 14.35, -1.0, 2.0, 7.0, 0.0, 0.0)
"""Start of the transient, in which the ball slips at both points all the time."""
PASSES = 2.0
"""Duration of the transient, s."""
_SHARP = analytic.Settings(rtol=1e-12)
EXACT = Task(engine="event", parameters=SLIPPING.p, x0=KICKED, t_end=PASSES, settings=_SHARP, sample_interval=1e-3)
"""The transient by the event-driven simulation."""


def deviation(time: Array, x: Array, exact: Trajectory) -> tuple[float, float]:
    """Relative rms errors of omega_c and of the slip, in units of its largest component, of states x (n, 8)."""
    truth = np.stack([np.interp(time, exact.time, column) for column in exact.x.T], axis=-1)
    slip = np.sqrt(np.mean(np.sum((x - truth)[:, 3:6] ** 2, axis=-1))) / np.abs(truth[:, 3:6]).max()
    return float(np.sqrt(np.mean((x[:, 2] / truth[:, 2] - 1) ** 2))), float(slip)
