"""A score card for contact settings: what a ball that rolls and slips does under them, and what it should do.

MuJoCo's settings run as they are in the study's scene, driven by its drag and wall but without its corrections; another
engine runs in its own loop. Every number stands against closed-form theory or the event-driven simulation, and beside
what other settings give.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from compare.runs.progress import Show
from compare.scorecard import trials
from compare.scorecard.advice import advice
from compare.scorecard.contenders import NEWCOMER, OURS, PLAIN, Contender, Contestant, costs
from compare.scorecard.native import Native
from compare.scorecard.trials import AGREES, APPROACH, AT_REST, ROLLING, SCENARIOS, SLIPPING, STATES, Held, Stationary
from compare.statistics import plain
from mjsim import ContactSettings
from model import Trajectory

GOOD, GOOD_SPEED = 1e-3, 1e-4
"""Relative error, and error of a speed in m/s, up to which a number is shown as good."""
WINDOW = 0.5
"""Time over which stationary states are averaged, s."""


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

    def of(self, state: Stationary) -> Held:
        """What was measured of a state."""
        return next(each for each in self.stationary if each.name == state.name)

    def to_mapping(self) -> dict[str, Any]:
        """JSON-able data; None for what is missing."""
        more = {"reproduced": self.reproduced, "cost_of_a_second": self.cost_of_a_second}
        return dict(plain(dataclasses.asdict(self) | more))


def grade(
    yours: Native | None,
    others: Sequence[Contender | Contestant] = (OURS, PLAIN, NEWCOMER),
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


def _column(contender: Contender | Contestant, cost: float) -> Column:
    h = contender.step or ContactSettings.timestep

    def settled(state: Stationary) -> Trajectory:
        """From rest, sampled in every step once the start is forgotten."""
        return contender.run(state.p, AT_REST, state.forgets + WINDOW, h, skip=state.forgets)

    states = tuple(trials.held(settled(state), state, state.forgets) for state in STATES)
    beyond = [settled(state) for state in trials.beyond_rolling()]
    slips = [float(run.slip_z.mean()) if run.complete else math.nan for run in beyond]
    cases = {}
    for case, (p, x0) in SCENARIOS.items():
        begin, end = trials.phase(case)
        cases[case.name] = trials.share(contender.run(p, x0, end, max(h, (end - begin) / 200)), case)
    run = contender.run(APPROACH.p, APPROACH.x0, APPROACH.lasts, max(0.01, h))
    transient = APPROACH.errors(run.time, run.x)[0] if run.complete else math.nan
    return Column(contender.name, h, cases, states, trials.onset(slips), transient, cost)
