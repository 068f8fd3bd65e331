"""The league: every engine that is installed on the same tasks, over the time step, against theory.

Each discipline is a set of runs and what they are off by. Stationary states start at rest and are judged once that
start is forgotten, as in `trials`; the approach to SS and the motions through landings are held against the
event-driven simulation, thresholds and cases against closed-form theory.
"""

from __future__ import annotations

import json
import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

import analytic
from compare.runs.campaign import Campaign
from compare.runs.engines import ENGINES, NEWCOMER, Engine, Settings, newcomer
from compare.runs.tasks import Task
from compare.scorecard import trials
from compare.scorecard.contenders import Contestant, seconds
from compare.scorecard.trials import (
    APPROACH,
    AT_REST,
    HITTING,
    LANDING,
    ROLLING,
    ROUGH,
    SLIPPING,
    STATES,
    WINDOW,
    Held,
    Motion,
    Stationary,
)
from compare.statistics import plain
from model import Case, Parameters, Trajectory
from model.files import write_text

STEPS = (4e-3, 2e-3, 1e-3)
"""Time steps, s."""
QUICK = (2e-3,)
MARGINS = (1e-3, 3e-3, 1e-2, 3e-2, 1e-1)
"""How far from omega_02, relative, it is asked whether the wall holds the ball."""
RIDES = 4.0
"""For how long, s: at the least margin it takes a ball 2.3 s to slide down by R."""
REPEATS = 3
"""Cost is the median of as many timings."""
CREEP, ROLLING_ENDS, WALL, CASES, COST = "creep (m/s)", "ω₀₁", "ω₀₂", "cases (of 9)", "cost"
OPEN = "open"
Runs = Sequence[Trajectory]
Asked = tuple[Parameters, Sequence[float], float, float]
"""A run: its parameters, start, duration and interval of the samples in s."""


@dataclass(frozen=True)
class Discipline:
    """What is asked of every contestant."""

    name: str
    runs: tuple[Asked, ...]
    score: Callable[[Runs], float]
    """Made of whole runs, one for each of `runs`; nan for what doesn't show."""
    quick: bool = False
    """Whether the small league has it."""


@dataclass(frozen=True)
class Entry:
    """What a contestant reaches with a time step."""

    name: str
    step: float | None
    scores: dict[str, float] = field(default_factory=dict)
    """By discipline; nan where it broke down, and for what doesn't show."""
    failures: dict[str, str] = field(default_factory=dict)
    """By discipline, why."""


def contestants(chosen: Sequence[str] | None = None, steps: Sequence[float] = STEPS) -> list[Contestant]:
    """The engines chosen by name, or all, whether installed or not, with each time step that they don't choose."""
    those = [engine for engine in ENGINES.values() if chosen is None or engine.name in chosen]
    return [
        Contestant(engine.name, engine, step, _settings(engine, step))
        for engine in those
        for step in (steps if "timestep" in engine.options else [None])
    ]


def _settings(engine: Engine, step: float | None) -> Settings:
    """Those of a person's run, but MuJoCo as it comes has a free ball in flat facets, as the others' newcomers have."""
    if engine is NEWCOMER and step:
        return replace(newcomer(step), coordinates="free", wall="prism", cone="pyramidal")
    return engine.configure({"timestep": step} if step else {}, SLIPPING.p)


def measure(campaign: Campaign, those: Sequence[Contestant], quick: bool = False) -> list[Entry]:
    """The entries of all contestants that are installed; runs that are there already aren't repeated."""
    asked = [discipline for discipline in DISCIPLINES if discipline.quick or not quick]
    return scored(campaign, [each for each in those if not each.engine.missing], asked, cost)


def scored(
    campaign: Campaign,
    those: Sequence[Contestant],
    asked: Sequence[Discipline],
    cost: Callable[[Task], float] | None = None,
) -> list[Entry]:
    """What contestants reach in some disciplines, and what a run takes by `cost`, if given."""
    rows = [[[each.task(*run) for run in discipline.runs] for discipline in asked] for each in those]
    failed = {f.task.key: f.reason for f in campaign.complete(task for row in rows for tasks in row for task in tasks)}
    entries = []
    for number, (each, row) in enumerate(zip(those, rows, strict=True)):
        entry = Entry(each.name, each.step)
        for discipline, tasks in zip(asked, row, strict=True):
            reasons = [failed[task.key] for task in tasks if task.key in failed]
            entry.failures.update({discipline.name: reasons[0]} if reasons else {})
            runs = [] if reasons else [campaign.load(task.key) for task in tasks]
            entry.scores[discipline.name] = discipline.score(runs) if runs else math.nan
        if cost:
            campaign.report(f"cost of {each.name}", number, len(those), 0)
            entry.scores[COST] = _kept(campaign, each.task(*APPROACHING.runs[0]), cost)
        entries.append(entry)
    return entries


def _kept(campaign: Campaign, task: Task, cost: Callable[[Task], float]) -> float:
    """What a run costs, measured once and kept beside it."""
    path = campaign.directory / f"{task.key}.cost.json"
    if not path.exists():
        write_text(path, json.dumps(cost(task)))
    return float(json.loads(path.read_text("utf-8")))


def to_mapping(those: Sequence[Contestant], entries: Sequence[Entry]) -> dict[str, Any]:
    """JSON-able data: contestants with versions and settings, those that are missing with the reason, and entries."""
    about = {}
    for each in reversed(those):  # the settings are those of the first step
        settings = {} if each.engine.missing else {"settings": asdict(each.settings)}
        about[each.name] = {"name": each.name, "missing": each.engine.missing, "versions": each.engine.versions}
        about[each.name] |= settings
    listed = [about[name] for name in dict.fromkeys(each.name for each in those)]
    data: dict[str, Any] = plain({"contestants": listed, "entries": [asdict(entry) for entry in entries]})
    return data


def from_mapping(data: dict[str, Any]) -> list[Entry]:
    """The entries of `to_mapping`."""
    entries = [Entry(**values) for values in data["entries"]]
    return [
        replace(entry, scores={name: math.nan if v is None else v for name, v in entry.scores.items()})
        for entry in entries
    ]


def cost(task: Task) -> float:
    """Processor time over simulated time of one run by itself, without what it takes to begin."""
    half = replace(task, t_end=task.t_end / 2)
    return statistics.median(seconds(task) - seconds(half) for _ in range(REPEATS)) / half.t_end


def _held(run: Trajectory, state: Stationary) -> Held:
    """How far the end of a run from rest is from the state that it settles in."""
    return trials.held(run, state, (1 - WINDOW) * state.settles)


def _stationary(state: Stationary) -> Discipline:
    """Relative error of omega_c in a state that is settled in from rest."""
    runs, quick = ((state.p, AT_REST, state.settles, state.settles / 1000),), state in (ROLLING, SLIPPING)
    return Discipline(state.name, runs, lambda runs: abs(_held(runs[0], state).omega_c), quick)


def _motion(of: Motion) -> Discipline:
    """Rms error of omega_c over a motion."""
    runs = ((of.p, of.x0, of.lasts, of.lasts / 100),)
    return Discipline(of.name, runs, lambda runs: of.errors(runs[0].time, runs[0].x)[0], quick=True)


def _end_of_rolling() -> Discipline:
    """Relative error of omega_01, where slip measured above it would begin by the same extrapolation as theory's."""
    states = trials.beyond_rolling()

    def score(runs: Runs) -> float:
        extrapolated = trials.onset([float(run.slip_z[-100:].mean()) for run in runs])
        return abs(extrapolated - trials.onset([float(state.solution.state.slip_z) for state in states]))

    return Discipline(
        ROLLING_ENDS, tuple((s.p, AT_REST, math.ceil(s.forgets), s.forgets / 1000) for s in states), score
    )


def _wall_holds() -> Discipline:
    """The least margin from which on the wall holds a ball above omega_02 and lets it slide down below; nan if none."""
    omega_02 = analytic.thresholds(ROUGH).omega_02
    runs: list[Asked] = []
    for margin in MARGINS:
        for sign in (1, -1):
            p = ROUGH.replace(omega_0=omega_02 * (1 + sign * margin))
            riding = Stationary(ROUGH.replace(omega_0=omega_02 * (1 + margin)), Case.NR).solution.state
            runs.append((p, riding._replace(y=p.R, omega_c=p.omega_0), RIDES, RIDES / 100))

    def score(runs: Runs) -> float:
        holds = [bool(run.y[-1] > 0.9 * ROUGH.R) for run in runs]
        wrong = [margin for margin, up, down in zip(MARGINS, holds[::2], holds[1::2], strict=True) if not up or down]
        return next((margin for margin in MARGINS if not wrong or margin > wrong[-1]), math.nan)

    return Discipline(WALL, tuple(runs), score)


def _cases() -> Discipline:
    """How many of the nine cases a run is in where the event-driven simulation is."""
    runs: list[Asked] = []
    for case, (p, x0) in trials.SCENARIOS.items():
        begin, end = trials.phase(case)
        runs.append((p, x0, end, (end - begin) / 200))

    def score(runs: Runs) -> float:
        shares = [trials.share(run, case) for run, case in zip(runs, trials.SCENARIOS, strict=True)]
        return float(sum(share >= trials.AGREES for share in shares))

    return Discipline(CASES, tuple(runs), score, quick=True)


def _open(runs: Runs) -> float:
    """Largest share of samples in which a contact that should carry a force carries none."""
    *ended, passing = runs
    shares = [_held(run, state).open for run, state in zip(ended, STATES, strict=True)]
    # In the first sample the ball has yet to sink into a soft contact.
    carries = np.stack([passing.force_A[1:, 1], passing.force_B[1:, 0]]) > 0
    return max(*shares, 1 - float(carries.mean(axis=1).min()))


APPROACHING = _motion(APPROACH)
ERRORS = (*map(_stationary, STATES), APPROACHING)
"""Of ways of setting MuJoCo, and, beside them, how often contact is lost."""
CONTACT = Discipline(OPEN, tuple(run for each in ERRORS for run in each.runs), _open)
DISCIPLINES = (
    *ERRORS[:3],
    replace(ERRORS[0], name=CREEP, score=lambda runs: _held(runs[0], ROLLING).creep),
    APPROACHING,
    _motion(LANDING),
    _motion(HITTING),
    _end_of_rolling(),
    _wall_holds(),
    _cases(),
)
"""In the order of the table."""
