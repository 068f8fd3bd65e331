"""What settings of MuJoCo are tried on: stationary states and motions of the ball; and how far a
run is from them.

A run of a state starts at rest against the wall, which is no solution of the problem, and is judged
only once that start is forgotten: a run that began in the state would stay there whatever it would
have converged to."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

import analytic
from analytic import StationarySolution
from model import Case, Contact, Parameters, State, Trajectory
from model.arrays import Array

Asked = tuple[Parameters, Sequence[float], float, float]
"""A run: its parameters, start, duration and interval of the samples in s."""
EPS = float(np.finfo(float).eps)
SMOOTH, ROUGH = Parameters.named("reference"), Parameters.named("high-wall-friction")
WINDOW = 0.1
"""Last part of a settled run, which is averaged."""
FINEST = 2.5e-5
"""Of this all time steps of the studies are multiples, s."""


@dataclass(frozen=True)
class Stationary:
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
    def settles(self) -> float:
        """How long a run lasts, s, in whose last part, a `WINDOW` of it, the start is forgotten.

        That takes ln(1/eps) = 36 time constants: the slowest of the state, or that of spinning up
        before, (1 + 2j)/c."""
        slowest = analytic.slowest_time_constant(self.solution)
        forgets = -math.log(EPS) * max(slowest, (1 + 2 * self.p.j) / self.p.c)
        return math.ceil(forgets / (1 - WINDOW))

    @property
    def run(self) -> Asked:
        """From rest until it is settled."""
        return self.p, State(), self.settles, self.settles / 1000

    def error(self, run: Trajectory) -> float:
        """Relative, of omega_c at the end."""
        last = run.time >= (1 - WINDOW) * self.settles
        return float(abs(run.omega_c[last].mean() / self.solution.state.omega_c - 1))

    def open(self, run: Trajectory) -> float:
        """Largest share of the last samples in which a contact that should carry a force has
        none."""
        last = run.time >= (1 - WINDOW) * self.settles
        normals = (self.case.A, run.force_A[last, 1]), (self.case.B, run.force_B[last, 0])
        return max(float(np.mean(load <= 0)) for at, load in normals if at is not Contact.N)


ROLLING = Stationary(SMOOTH.replace(omega_0=12.0), Case.RR)
BARELY = Stationary(SMOOTH.replace(omega_0=14.5), Case.SS)
SLIPPING = Stationary(SMOOTH.replace(omega_0=25.0), Case.SS)
ON_THE_WALL = Stationary(ROUGH.replace(omega_0=25.0), Case.NR)
STATES = (ROLLING, BARELY, SLIPPING, ON_THE_WALL)
"""Rolling, slipping little and much, and carried by the wall alone."""


@dataclass(frozen=True)
class Transient:
    """A motion from a start, s, of which theory knows the course."""

    name: str
    p: Parameters
    x0: State
    lasts: float

    @property
    def run(self) -> Asked:
        """All of it."""
        return self.p, self.x0, self.lasts, self.lasts / 100

    @cached_property
    def exact(self) -> Trajectory:
        """By the event-driven simulation, at the times of all runs, since impacts don't let it be
        interpolated."""
        sharp = analytic.Settings(rtol=1e-12)
        return analytic.simulate(
            self.p, self.x0, self.lasts, settings=sharp, sample_interval=FINEST
        )

    def at(self, time: float | Array) -> Array:
        """The exact omega_c at some times, rad/s."""
        return np.asarray(np.interp(time, self.exact.time, self.exact.omega_c))

    def error(self, run: Trajectory) -> float:
        """Relative, of omega_c, in the root of the mean square."""
        return float(np.sqrt(np.mean((run.omega_c / self.at(run.time) - 1) ** 2)))

    def open(self, run: Trajectory) -> float:
        """Largest share of samples in which a contact carries nothing, but the first: there the
        ball has yet to sink into a soft contact."""
        carries = np.stack([run.force_A[1:, 1], run.force_B[1:, 0]]) > 0
        return 1 - float(carries.mean(axis=1).min())


KICKED = State(omega_c=14.35, slip_x=-1.0, slip_y=2.0, slip_z=7.0)
"""From here the ball slips at both points all the time."""
APPROACH = Transient("approach to " + SLIPPING.name, SLIPPING.p, KICKED, 2.0)
LANDING = Transient(
    "slides down the wall, lands, slips at both points, sticks",
    SMOOTH,
    State(y=0.02, v_y=-0.2, omega_c=12.0, slip_x=30.0, slip_y=-10.0, slip_z=20.0),
    0.7,
)
HITTING = Transient(
    "slides on the floor, hits the wall, is lifted, lands, sticks",
    SMOOTH,
    State(omega_c=10.0, slip_x=1.0, slip_y=2.0, slip_z=3.0, h=0.002, v_h=-0.3),
    0.7,
)
