"""A score card for contact settings: what a ball that rolls and slips does under them, and what it should do.

MuJoCo's settings run as they are in the study's scene, driven by its drag and wall but without its corrections; another
engine runs in its own loop. Every number stands against closed-form theory or the event-driven simulation, and beside
what other settings give.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

import analytic
from compare.runs.progress import Show
from compare.runs.tasks import carry_out
from compare.scorecard import trials
from compare.scorecard.advice import advice
from compare.scorecard.contenders import NEWCOMER, OURS, PLAIN, Contender, Other, costs
from compare.scorecard.native import Native
from compare.scorecard.trials import AT_REST, KICKED, ROLLING, ROUGH, SLIPPING, SMOOTH, STATES, Held, State
from compare.statistics import plain
from mjsim import ContactSettings
from model import Case, Contact, Parameters, Trajectory

GOOD, GOOD_SPEED = 1e-3, 1e-4
"""Relative error, and error of a speed in m/s, up to which a number is shown as good."""
WINDOW = 0.5
"""Time over which stationary states are averaged, s."""
AGREES = 0.9
"""Share of samples in the right case from which a case counts as reproduced."""
SLIDES = 0.01
"""Slip speed, in units of sqrt(g R), from which a contact counts as slipping."""
CARRIES = 0.01
"""Normal force, in units of m g, from which it counts as closed."""
ONSET = (1.02, 1.05, 1.1)
"""omega_0 at which slip is measured, in units of omega_01, to find by extrapolation where it begins."""


@dataclass(frozen=True)
class Column:
    """Everything measured of one contender."""

    name: str
    timestep: float
    cases: dict[str, float]
    """By case: share of samples in the case in which the event-driven simulation is."""
    stationary: tuple[Held, ...]
    omega_01: float
    """Relative error of the threshold where rolling is lost; nan if slip doesn't begin near it."""
    transient: float
    """Relative rms error of omega_c over the transient; nan if the run diverged."""
    cost: float
    """Time of a step over that of our defaults."""
    advice: tuple[str, ...] = ()

    @property
    def reproduced(self) -> list[str]:
        """The cases that are reproduced."""
        return [name for name, share in self.cases.items() if share >= AGREES]

    @property
    def cost_of_a_second(self) -> float:
        """Time of a simulated second over that of our defaults."""
        return self.cost * ContactSettings.timestep / self.timestep

    def of(self, state: State) -> Held:
        """What was measured of a state."""
        return next(each for each in self.stationary if each.name == state.name)

    def to_mapping(self) -> dict[str, Any]:
        """JSON-able data; None for what is missing."""
        values = dataclasses.asdict(self)
        more = {"reproduced": self.reproduced, "cost_of_a_second": self.cost_of_a_second}
        return {name: plain(value) for name, value in (values | more).items()}


def grade(
    yours: Native | None,
    others: Sequence[Contender | Other] = (OURS, PLAIN, NEWCOMER),
    show: Show = lambda what, done, total, failed: None,
) -> list[Column]:
    """Columns of the score card: the given settings first, with advice, then the others.

    Raises `InputError` if MuJoCo refuses the settings.
    """
    given = [Contender("yours", yours.loop(), yours)] if yours else []
    contenders = [*given, *others]
    columns = []
    for k, (contender, cost) in enumerate(zip(contenders, costs(contenders), strict=True)):
        show(f"grade {contender.name}", k, len(contenders), 0)
        columns.append(_column(contender, cost))
    if yours:
        ours = columns[0]
        said = advice(yours, ours.of(ROLLING).creep, ours.of(SLIPPING).open)
        columns[0] = dataclasses.replace(ours, advice=tuple(said))
    return columns


def _column(contender: Contender | Other, cost: float) -> Column:
    h, states = contender.timestep, tuple(_held(contender, state) for state in STATES)
    return Column(contender.name, h, _cases(contender), states, _onset(contender), _transient(contender), cost)


def _held(contender: Contender | Other, state: State) -> Held:
    return trials.held(_settled(contender, state), state, state.forgets)


def _settled(contender: Contender | Other, state: State) -> Trajectory:
    """The state from rest, sampled in every step once the start is forgotten."""
    forgotten, step = state.forgets, contender.timestep
    return contender.run(state.p, AT_REST, forgotten + WINDOW, step, skip=forgotten)


def _onset(contender: Contender | Other) -> float:
    """Relative error of omega_01, from slip_z above it, extrapolated to zero along a parabola."""
    omega_01 = analytic.thresholds(SMOOTH).omega_01
    states = [State(SMOOTH.replace(omega_0=factor * omega_01), Case.SS) for factor in ONSET]
    runs = [_settled(contender, state) for state in states]
    return onset([float(run.slip_z.mean()) if run.complete else math.nan for run in runs], states)


def onset(slips: Sequence[float], states: Sequence[State]) -> float:
    """Relative error of omega_01 from settled slip_z in states at `ONSET`; nan if it isn't near theirs."""
    if not all(abs(slip / s.solution.state.slip_z - 1) < 0.5 for slip, s in zip(slips, states, strict=True)):
        return math.nan
    # omega_0 as a function of slip, at no slip.
    return float(np.polynomial.Polynomial.fit(slips, ONSET, 2)(0.0)) - 1


def _transient(contender: Contender | Other) -> float:
    run = contender.run(SLIPPING.p, KICKED, trials.PASSES, max(0.01, contender.timestep))
    return trials.deviation(run.time, run.x, _exact())[0] if run.complete else math.nan


@functools.cache
def _exact() -> Trajectory:
    (run,) = carry_out([trials.EXACT])
    return run


SCENARIOS: dict[Case, tuple[Parameters, tuple[float, ...]]] = {
    Case.RR: (SMOOTH.replace(omega_0=12.0), (0, 0, 12.0, 0, 0, 0)),
    Case.RS: (SMOOTH.replace(omega_0=12.0), (0, 0, 6.0, 0, -30.0, 0)),
    Case.RN: (SMOOTH.replace(omega_0=12.0), (0, 0, 4.0, 0, 0, 0, 0.4 * SMOOTH.R, 0)),
    Case.SR: (ROUGH, (0, 0, 8.0, -40.0, 0, 0)),
    Case.SS: (SLIPPING.p, KICKED),
    Case.SN: (SMOOTH.replace(omega_0=12.0), (0, 0, 4.0, 40.0, 0, 40.0, 0.4 * SMOOTH.R, 0)),
    Case.NR: (ROUGH.replace(omega_0=25.0), (ROUGH.R, 0, 25.0, -27.0, 0, 0)),
    Case.NS: (SMOOTH.replace(omega_0=12.0), (SMOOTH.R, 0, 12.0, 0, 0, -10.0)),
    Case.NN: (SMOOTH.replace(omega_0=12.0), (0.5 * SMOOTH.R, 0, 4.0, 5.0, 5.0, 5.0, 0.4 * SMOOTH.R, 0)),
}
"""For each case parameters and a state from which the ball is in it for a while."""


@functools.cache
def phase(case: Case) -> tuple[float, float]:
    """Times (s) between which the event-driven simulation of a scenario is in its case, 1 s at most."""
    truth = analytic.simulate(*SCENARIOS[case], 1.0, sample_interval=1e-3)
    inside = truth.case == case
    first = int(np.argmax(inside))
    last = first + int(np.argmin(inside[first:])) if not inside[first:].all() else len(inside)
    return float(truth.time[first]), float(truth.time[last - 1])


def _cases(contender: Contender | Other) -> dict[str, float]:
    """By case: share of the samples of its scenario that are in it."""
    shares = {}
    for case, (p, x0) in SCENARIOS.items():
        begin, end = phase(case)
        run = contender.run(p, x0, end, max(contender.timestep, (end - begin) / 200))
        shares[case.name] = share(run, case)
    return shares


def share(run: Trajectory, case: Case) -> float:
    """Share of the samples of a run of a scenario that are in its case, where the event-driven simulation is in it."""
    begin, end = phase(case)
    # The first steps press the ball into a soft contact, and the end may come early: a tenth is left out each.
    margin = 0.1 * (end - begin)
    judged = (run.time >= begin + margin) & (run.time < end - margin)
    return float(_in_case(run, case)[judged].mean()) if run.complete and judged.any() else 0.0


def _in_case(run: Trajectory, case: Case) -> npt.NDArray[np.bool_]:
    """Which samples are in a case, by what moves and what carries; a contact that chatters carries its mean."""
    p, right = run.header.parameters, np.ones(len(run.time), dtype=bool)
    for contact, normal, speed in (
        (case.A, run.force_A[:, 1], run.slip_speed_A),
        (case.B, run.force_B[:, 0], run.slip_speed_B),
    ):
        mean = np.convolve(normal, np.ones(9) / 9, mode="same") if len(normal) >= 9 else normal
        closed = mean > CARRIES * p.m * p.g
        slips = speed > SLIDES * math.sqrt(p.g * p.R)
        right &= ~closed if contact is Contact.N else closed & (slips == (contact is Contact.S))
    return right
