"""The league: every engine that is installed on the same tasks, over the time step, against theory.

Each discipline is a set of tasks and what its runs are off by. Stationary states start at rest and are judged once that
start is forgotten, as in `trials`; the approach to SS and the motions through landings are held against the
event-driven simulation, thresholds and cases against closed-form theory.
"""

from __future__ import annotations

import functools
import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import analytic
from compare.runs import engines
from compare.runs.campaign import Campaign
from compare.runs.engines import Engine, Settings
from compare.runs.tasks import Task, carry_out
from compare.scorecard import grade, kept, trials
from compare.scorecard.accuracy import LASTS, MOTIONS
from compare.scorecard.contenders import processor_time
from compare.scorecard.trials import AT_REST, KICKED, PASSES, ROLLING, ROUGH, SLIPPING, SMOOTH, STATES, WINDOW, State
from compare.statistics import plain
from model import Case, Trajectory

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
Runs = Sequence[Trajectory]


@dataclass(frozen=True)
class Contestant:
    """An engine in one of its two settings."""

    name: str
    engine: Engine
    settings: Callable[[float | None], Settings]
    """For a time step in s; None for an engine that chooses its own."""

    def task(self, step: float | None, state: State, x0: Sequence[float], lasts: float, interval: float) -> Task:
        """A run; it samples no more often than it steps."""
        p, settings = state.p, self.settings(step)
        interval = max(interval, step or 0.0)
        return Task(
            engine=self.engine.name,
            parameters=p,
            x0=tuple(x0),
            t_end=lasts,
            settings=settings,
            sample_interval=interval,
        )


@dataclass(frozen=True)
class Discipline:
    """What is asked of every contestant."""

    name: str
    runs: tuple[tuple[State, Sequence[float], float, float], ...]
    """Problem, start, duration and interval of the samples in s of each run."""
    score: Callable[[Runs], float]
    """Made of whole runs, one for each of `runs`; nan for what doesn't show."""
    quick: bool = False
    """Whether the small league has it."""


@dataclass(frozen=True)
class Entry:
    """What a contestant reaches with a time step."""

    name: str
    step: float | None
    """s; None for one that chooses its own."""
    scores: dict[str, float] = field(default_factory=dict)
    """By discipline; nan where it broke down, and for what doesn't show."""
    failures: dict[str, str] = field(default_factory=dict)
    """By discipline, why."""


def contestants(chosen: Sequence[str] | None = None) -> list[Contestant]:
    """Those of the engines chosen by name, or all, whether installed or not."""
    listed = [Contestant(engine.name, engine, _settings(engine)) for engine in engines.ENGINES.values()]
    prism = Contestant(engines.NEWCOMER.name, engines.NEWCOMER, _prism)
    listed = [prism if each.engine is engines.NEWCOMER else each for each in listed]
    return [each for each in listed if chosen is None or each.name in chosen]


def _settings(engine: Engine) -> Callable[[float | None], Settings]:
    return lambda step: engine.configure({} if step is None else {"timestep": step}, SLIPPING.p)


def _prism(step: float | None) -> Settings:
    """MuJoCo as it comes, with a free ball in flat facets, as the others' newcomers have it."""
    assert step
    return replace(engines.newcomer(step), coordinates="free", wall="prism", cone="pyramidal")


def measure(
    campaign: Campaign, those: Sequence[Contestant], steps: Sequence[float] = STEPS, quick: bool = False
) -> list[Entry]:
    """The entries of all contestants that are installed; runs that are there already aren't repeated."""
    asked = [discipline for discipline in DISCIPLINES if discipline.quick or not quick]
    those = [each for each in those if not each.engine.missing]
    starters = [(each, step) for each in those for step in (steps if "timestep" in each.engine.options else [None])]
    return scored(campaign, starters, asked, cost)


def scored(
    campaign: Campaign,
    starters: Sequence[tuple[Contestant, float | None]],
    asked: Sequence[Discipline],
    cost: Callable[[Task], float] | None = None,
) -> list[Entry]:
    """What contestants reach with a time step each in some disciplines, and what a run takes by `cost`, if given."""
    tasks = {
        (each.name, step, discipline.name): [each.task(step, *run) for run in discipline.runs]
        for each, step in starters
        for discipline in asked
    }
    failed = {
        failure.task.key: failure.reason for failure in campaign.complete(t for row in tasks.values() for t in row)
    }
    entries = []
    for number, (each, step) in enumerate(starters):
        campaign.report(f"cost of {each.name}", number, len(starters), 0)
        entry = Entry(each.name, step)
        for discipline in asked:
            row = tasks[each.name, step, discipline.name]
            reasons = [failed[task.key] for task in row if task.key in failed]
            entry.failures.update({discipline.name: reasons[0]} if reasons else {})
            score = math.nan if reasons else discipline.score([kept.run(campaign, task) for task in row])
            entry.scores[discipline.name] = score
        if cost:
            passing = each.task(step, *APPROACH.runs[0])
            entry.scores[COST] = kept.cost(campaign, passing, functools.partial(cost, passing))
        entries.append(entry)
    return entries


def to_mapping(those: Sequence[Contestant], entries: Sequence[Entry]) -> dict[str, Any]:
    """JSON-able data: contestants with versions and settings, those that are missing with the reason, and entries."""
    about = []
    for each in those:
        steps = [entry.step for entry in entries if entry.name == each.name]
        settings = {"settings": asdict(each.settings(steps[0]))} if steps else {}
        about.append({"name": each.name, "missing": each.engine.missing, "versions": each.engine.versions, **settings})
    data: dict[str, Any] = plain({"contestants": about, "entries": [asdict(entry) for entry in entries]})
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
    return statistics.median(_seconds(task) - _seconds(half) for _ in range(REPEATS)) / half.t_end


def _seconds(task: Task) -> float:
    begin = processor_time()
    carry_out([task])
    return processor_time() - begin


def stationary(state: State) -> Discipline:
    """Relative error of omega_c in a state that is settled in from rest."""
    lasts = math.ceil(state.forgets / (1 - WINDOW))

    def score(runs: Runs) -> float:
        return abs(trials.held(runs[0], state, (1 - WINDOW) * lasts).omega_c)

    return Discipline(state.name, ((state, AT_REST, lasts, lasts / 1000),), score, quick=state in (ROLLING, SLIPPING))


def _creep() -> Discipline:
    """Of the rolling state, from the same run."""
    lasts = math.ceil(ROLLING.forgets / (1 - WINDOW))
    rolling = stationary(ROLLING)
    return replace(rolling, name=CREEP, score=lambda runs: trials.held(runs[0], ROLLING, (1 - WINDOW) * lasts).creep)


def _motion(name: str, state: State, x0: Sequence[float], lasts: float) -> Discipline:
    """Rms error of omega_c over a motion."""

    @functools.cache
    def exact() -> Trajectory:
        sharp = analytic.Settings(rtol=1e-12)
        return analytic.simulate(state.p, x0, lasts, settings=sharp, sample_interval=lasts / 2000)

    def score(runs: Runs) -> float:
        return trials.deviation(runs[0].time, runs[0].x, exact())[0]

    return Discipline(name, ((state, x0, lasts, lasts / 100),), score, quick=True)


def _end_of_rolling() -> Discipline:
    """Relative error of omega_01, where slip measured above it would begin by the same extrapolation as theory's."""
    omega_01 = analytic.thresholds(SMOOTH).omega_01
    states = [State(SMOOTH.replace(omega_0=factor * omega_01), Case.SS) for factor in grade.ONSET]

    def score(runs: Runs) -> float:
        extrapolated = grade.onset([float(run.slip_z[-100:].mean()) for run in runs], states)
        return abs(extrapolated - grade.onset([float(state.solution.x[5]) for state in states], states))

    return Discipline(ROLLING_ENDS, tuple((s, AT_REST, math.ceil(s.forgets), s.forgets / 1000) for s in states), score)


def _wall_holds() -> Discipline:
    """The least margin from which on the wall holds a ball above omega_02 and lets it slide down below; nan if none."""
    omega_02 = analytic.thresholds(ROUGH).omega_02
    runs = []
    for margin in MARGINS:
        for sign in (1, -1):
            p = ROUGH.replace(omega_0=omega_02 * (1 + sign * margin))
            riding = State(ROUGH.replace(omega_0=omega_02 * (1 + margin)), Case.NR).solution.x.copy()
            riding[[0, 2]] = p.R, p.omega_0
            runs.append((State(p, Case.NR), riding.tolist(), RIDES, RIDES / 100))

    def score(runs: Runs) -> float:
        holds = [bool(run.y[-1] > 0.9 * ROUGH.R) for run in runs]
        wrong = [margin for margin, up, down in zip(MARGINS, holds[::2], holds[1::2], strict=True) if not up or down]
        return next((margin for margin in MARGINS if not wrong or margin > wrong[-1]), math.nan)

    return Discipline(WALL, tuple(runs), score)


def _cases() -> Discipline:
    """How many of the nine cases a run is in where the event-driven simulation is."""
    runs = []
    for case, (p, x0) in grade.SCENARIOS.items():
        begin, end = grade.phase(case)
        runs.append((State(p, case), x0, end, (end - begin) / 200))

    def score(runs: Runs) -> float:
        shares = [grade.share(run, case) for run, case in zip(runs, grade.SCENARIOS, strict=True)]
        return float(sum(share >= grade.AGREES for share in shares))

    return Discipline(CASES, tuple(runs), score, quick=True)


_SLIDES, _HITS = MOTIONS.values()
APPROACH = _motion(trials.TRANSIENT, SLIPPING, KICKED, PASSES)
DISCIPLINES = (
    *(stationary(state) for state in STATES[:3]),
    _creep(),
    APPROACH,
    _motion("lands on the floor", State(SMOOTH, Case.RR), _SLIDES, LASTS),
    _motion("hits the wall", State(SMOOTH, Case.RR), _HITS, LASTS),
    _end_of_rolling(),
    _wall_holds(),
    _cases(),
)
"""In the order of the table."""
