"""What settings are tried on: stationary states, motions, and the nine cases; and how far a run is from them.

A run of a state starts at rest against the wall, which is no solution of the problem, and is judged only once that
start is forgotten: a run that began in the state would stay there whatever it would have converged to.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

import analytic
from analytic import StationarySolution
from model import Case, Contact, Parameters, State, Trajectory
from model.arrays import Array
from model.kinematics import SLIP_XYZ

Asked = tuple[Parameters, Sequence[float], float, float]
"""A run: its parameters, start, duration and interval of the samples in s."""
EPS = float(np.finfo(float).eps)
SMOOTH, ROUGH = Parameters.named("reference"), Parameters.named("high-wall-friction")
WINDOW = 0.1
"""Last part of a settled run, which is averaged."""
AT_REST = State()
"""Start against the wall, on the floor."""


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
    def forgets(self) -> float:
        """Time in s after which what is left of the start is lost in round-off.

        That takes ln(1/eps) = 36 time constants: the slowest of the state, or that of spinning up before, (1 + 2j)/c.
        """
        return -math.log(EPS) * max(analytic.slowest_time_constant(self.solution), (1 + 2 * self.p.j) / self.p.c)

    @property
    def settles(self) -> float:
        """How long a run lasts, s, in whose last part, a `WINDOW` of it, the start is forgotten."""
        return math.ceil(self.forgets / (1 - WINDOW))

    @property
    def run(self) -> Asked:
        """From rest until it is settled."""
        return self.p, AT_REST, self.settles, self.settles / 1000

    def held(self, run: Trajectory, since: float | None = None) -> Held:
        """How far the samples of a run since a time in s are from the state; by default the last `WINDOW` of `run`."""
        if not run.complete:
            return Held(self.name, *[math.nan] * 4)
        since = (1 - WINDOW) * self.settles if since is None else since
        last, x = slice(int(np.searchsorted(run.time, since)), None), self.solution.x
        contacts = (
            (self.case.A, run.slip_speed_A[last], run.force_A[last, 1]),
            (self.case.B, run.slip_speed_B[last], run.force_B[last, 0]),
        )
        return Held(
            name=self.name,
            omega_c=float(run.omega_c[last].mean() / self.solution.state.omega_c) - 1,
            slip=float(np.abs(run.x[last, SLIP_XYZ].mean(axis=0) - x[SLIP_XYZ]).max()) * self.p.r,
            open=max(float(np.mean(normal <= 0)) for contact, _, normal in contacts if contact is not Contact.N),
            creep=max([float(speed.mean()) for contact, speed, _ in contacts if contact is Contact.R], default=0.0),
        )


ROLLING = Stationary(SMOOTH.replace(omega_0=12.0), Case.RR)
SLIPPING = Stationary(SMOOTH.replace(omega_0=25.0), Case.SS)
BARELY, RIDING = Stationary(SMOOTH.replace(omega_0=14.5), Case.SS), Stationary(ROUGH.replace(omega_0=25.0), Case.NR)
STATES = (ROLLING, BARELY, SLIPPING, RIDING)
"""Rolling, slipping little and much, and carried by the wall alone."""


@dataclass(frozen=True)
class Transient:
    """A motion from a start, s, of which theory knows the course."""

    name: str
    p: Parameters
    x0: State
    lasts: float
    course: str = ""
    """What happens, in words."""

    @property
    def run(self) -> Asked:
        """All of it."""
        return self.p, self.x0, self.lasts, self.lasts / 100

    @cached_property
    def exact(self) -> Trajectory:
        """By the event-driven simulation."""
        sharp = analytic.Settings(rtol=1e-12)
        return analytic.simulate(self.p, self.x0, self.lasts, settings=sharp, sample_interval=self.lasts / 2000)

    def errors(self, time: Array, x: Array) -> tuple[float, float]:
        """Relative rms errors of omega_c and of the slip, in units of its largest component, of states x (n, 8)."""
        truth = np.stack([np.interp(time, self.exact.time, column) for column in self.exact.x.T], axis=-1)
        slip = np.sqrt(np.mean(np.sum((x - truth)[:, SLIP_XYZ] ** 2, axis=-1))) / np.abs(truth[:, SLIP_XYZ]).max()
        omega_c = State.of(x).omega_c / State.of(truth).omega_c - 1
        return float(np.sqrt(np.mean(omega_c**2))), float(slip)


KICKED = State(omega_c=14.35, slip_x=-1.0, slip_y=2.0, slip_z=7.0)
"""From here the ball slips at both points all the time."""
APPROACH = Transient("approach to " + SLIPPING.name, SLIPPING.p, KICKED, 2.0)
LANDING = Transient(
    "lands on the floor",
    SMOOTH,
    State(y=0.02, v_y=-0.2, omega_c=12.0, slip_x=30.0, slip_y=-10.0, slip_z=20.0),
    0.7,
    "slides down the wall, lands, slips at both points, sticks",
)
HITTING = Transient(
    "hits the wall",
    SMOOTH,
    State(omega_c=10.0, slip_x=1.0, slip_y=2.0, slip_z=3.0, h=0.002, v_h=-0.3),
    0.7,
    "slides on the floor, hits the wall, is lifted, lands, sticks",
)

ONSET = (1.02, 1.05, 1.1)
"""omega_0 at which slip is measured, in units of omega_01, to find by extrapolation where it begins."""


@functools.cache
def beyond_rolling() -> tuple[Stationary, ...]:
    """The states at `ONSET`."""
    omega_01 = analytic.thresholds(SMOOTH).omega_01
    return tuple(Stationary(SMOOTH.replace(omega_0=factor * omega_01), Case.SS) for factor in ONSET)


def onset(runs: Sequence[Trajectory]) -> float:
    """Relative error of omega_01, from settled slip_z in the states at `ONSET` extrapolated to zero along a parabola.

    The same is done with theory's slip, and the difference taken. It is nan if slip doesn't begin near omega_01.
    """
    exact = [float(state.solution.state.slip_z) for state in beyond_rolling()]
    if not all(run.complete for run in runs):
        return math.nan
    slips = [float(run.slip_z[-round(WINDOW * len(run.time)) :].mean()) for run in runs]
    if not all(abs(slip / of - 1) < 0.5 for slip, of in zip(slips, exact, strict=True)):
        return math.nan
    # omega_0 as a function of slip, at no slip.
    seen, true = (float(np.polynomial.Polynomial.fit(each, ONSET, 2)(0.0)) for each in (slips, exact))
    return seen - true


AGREES = 0.9
"""Share of samples in the right case from which a case counts as reproduced."""
SLIDES = 0.01
"""Slip speed, in units of sqrt(g R), from which a contact counts as slipping."""
CARRIES = 0.01
"""Normal force, in units of m g, from which it counts as closed."""
SCENARIOS: dict[Case, tuple[Parameters, State]] = {
    Case.RR: (ROLLING.p, State(omega_c=12.0)),
    Case.RS: (ROLLING.p, State(omega_c=6.0, slip_y=-30.0)),
    Case.RN: (ROLLING.p, State(omega_c=4.0, h=0.4 * SMOOTH.R)),
    Case.SR: (ROUGH, State(omega_c=8.0, slip_x=-40.0)),
    Case.SS: (SLIPPING.p, KICKED),
    Case.SN: (ROLLING.p, State(omega_c=4.0, slip_x=40.0, slip_z=40.0, h=0.4 * SMOOTH.R)),
    Case.NR: (ROUGH.replace(omega_0=25.0), State(y=ROUGH.R, omega_c=25.0, slip_x=-27.0)),
    Case.NS: (ROLLING.p, State(y=SMOOTH.R, omega_c=12.0, slip_z=-10.0)),
    Case.NN: (
        ROLLING.p,
        State(y=0.5 * SMOOTH.R, omega_c=4.0, slip_x=5.0, slip_y=5.0, slip_z=5.0, h=0.4 * SMOOTH.R),
    ),
}
"""For each case parameters and a state from which the ball is in it for a while."""


@functools.cache
def phase(case: Case) -> tuple[float, float]:
    """Times (s) between which the event-driven simulation of a scenario is in its case, 1 s at most."""
    stretches = analytic.simulate(*SCENARIOS[case], 1.0, sample_interval=1e-3).phases()
    return next((first, last) for each, first, last in stretches if each is case)


def scenario(case: Case) -> Asked:
    """The run of a scenario, as long as the event-driven simulation is in its case."""
    begin, end = phase(case)
    return *SCENARIOS[case], end, (end - begin) / 200


def share(run: Trajectory, case: Case) -> float:
    """Share of the samples of a run of a scenario that are in its case, where the event-driven simulation is in it."""
    begin, end = phase(case)
    # The first steps press the ball into a soft contact, and the end may come early: a tenth is left out each.
    margin = 0.1 * (end - begin)
    judged = (run.time >= begin + margin) & (run.time < end - margin)
    if not (run.complete and judged.any()):
        return 0.0
    # In the case by what moves and what carries; a contact that chatters carries its mean.
    p, right = run.header.parameters, np.ones(len(run.time), dtype=bool)
    for contact, normal, speed in (
        (case.A, run.force_A[:, 1], run.slip_speed_A),
        (case.B, run.force_B[:, 0], run.slip_speed_B),
    ):
        mean = np.convolve(normal, np.ones(9) / 9, mode="same") if len(normal) >= 9 else normal
        closed = mean > CARRIES * p.m * p.g
        slips = speed > SLIDES * math.sqrt(p.g * p.R)
        right &= ~closed if contact is Contact.N else closed & (slips == (contact is Contact.S))
    return float(right[judged].mean())
