"""The league: every engine that is installed on the same tasks at several time steps, against theory.

Each discipline is a set of runs and what they are off by. Stationary states start at rest and are judged once that
start is forgotten, as in `trials`; the approach to SS and the motions through landings are held against the
event-driven simulation, thresholds and cases against closed-form theory.
"""

from __future__ import annotations

import functools
import json
import math
import os
import statistics
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
from rich.table import Table

import analytic
from compare.bench import trials
from compare.bench.trials import APPROACH, HITTING, LANDING, ROLLING, ROUGH, SLIPPING, STATES, Asked, Stationary
from compare.kit import pages
from compare.kit.campaign import Campaign
from compare.kit.engines import ENGINES, Engine, Settings
from compare.kit.pages import Rows
from compare.kit.statistics import plain
from compare.kit.tasks import Task, carry_out
from model import Case, Trajectory
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
CAPTION = (
    "Relative errors of ω_c: in stationary states (case and ω₀ in rad/s) from rest, once the start is forgotten; as "
    "root mean square in motions. ω₀₁: relative error of the flow at which rolling ends; ω₀₂: how near to the flow at "
    "which the wall begins to carry the ball the engine is right on both sides. Cost: processor time divided by "
    "simulated time."
)
"""What the columns are."""
Runs = Sequence[Trajectory]


@dataclass(frozen=True)
class Contestant:
    """An engine with settings."""

    name: str
    engine: Engine
    step: float | None
    """s; None for one that chooses its own."""
    settings: Settings

    def task(self, asked: Asked) -> Task:
        """A run; it samples no more often than it steps."""
        p, x0, lasts, interval = asked
        every = max(interval, self.step or 0.0)
        return Task(
            engine=self.engine.name, parameters=p, x0=x0, t_end=lasts, settings=self.settings, sample_interval=every
        )


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

    those = []
    for engine in ENGINES.values():
        for step in steps if "timestep" in engine.options else [None]:
            if chosen is None or engine.name in chosen:
                given = {"timestep": step} if step else {}
                those.append(Contestant(engine.name, engine, step, engine.configure(given, SLIPPING.p)))
    return those


def measure(campaign: Campaign, those: Sequence[Contestant], quick: bool = False) -> list[Entry]:
    """The entries of all contestants that are installed; runs that are there already aren't repeated."""
    asked = [discipline for discipline in disciplines() if discipline.quick or not quick]
    return scored(campaign, [each for each in those if not each.engine.missing], asked, cost)


def scored(
    campaign: Campaign,
    those: Sequence[Contestant],
    asked: Sequence[Discipline],
    cost: Callable[[Task], float] | None = None,
) -> list[Entry]:
    """What contestants reach in some disciplines, and what a run takes by `cost`, if given, measured once."""
    rows = [[[each.task(run) for run in discipline.runs] for discipline in asked] for each in those]
    failed = {f.task.key: f.reason for f in campaign.complete(task for row in rows for tasks in row for task in tasks)}
    entries = []
    for number, (each, row) in enumerate(zip(those, rows, strict=True)):
        entry = Entry(each.name, each.step)
        for discipline, tasks in zip(asked, row, strict=True):
            reasons = [failed[task.key] for task in tasks if task.key in failed]
            entry.failures.update({discipline.name: reasons[0]} if reasons else {})
            entry.scores[discipline.name] = math.nan if reasons else discipline.score(campaign.run(tasks))
        if cost:
            campaign.report(f"cost of {each.name}", number, len(those), 0)
            task = each.task(APPROACH.run)
            kept = campaign.directory / f"{task.key}.cost.json"
            if not kept.exists():
                write_text(kept, json.dumps(cost(task)))
            entry.scores[COST] = float(json.loads(kept.read_text("utf-8")))
        entries.append(entry)
    return entries


def cost(task: Task) -> float:
    """Processor time divided by simulated time of one run by itself, without what it takes to begin.

    The time of this process and of those that it started and that ended.
    """

    def clock() -> float:
        ended = os.times()
        return time.process_time() + ended.children_user + ended.children_system

    def seconds(task: Task) -> float:
        begin = clock()
        carry_out([task])
        return clock() - begin

    half = replace(task, t_end=task.t_end / 2)
    return statistics.median(seconds(task) - seconds(half) for _ in range(REPEATS)) / half.t_end


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


def rows(entries: Sequence[Entry]) -> Rows:
    """A table with a head, and a row for each entry; only disciplines that some entry has."""
    forms = {CASES: "{:.0f}".format, COST: "{:.2g}".format, OPEN: "{:.0%}".format, WALL: "≤ {:g}".format}
    asked = list(dict.fromkeys(name for entry in entries for name in entry.scores))
    table = [["engine", "step", *asked]]
    for entry in entries:
        row = [entry.name, "its own" if entry.step is None else f"{1e3 * entry.step:g} ms"]
        for name in asked:
            score = entry.scores.get(name)
            if name in entry.failures or score is None:
                row.append("failed" if name in entry.failures else "")
            else:
                row.append("not seen" if math.isnan(score) else forms.get(name, number)(score))
        table.append(row)
    return table


def number(value: float) -> str:
    """An error: round-off is shown as such, a run without one as diverged."""
    return "diverged" if math.isnan(value) else "< 1e-14" if value < 1e-14 else f"{value:.1e}"


def tables(entries: Sequence[Entry]) -> Iterator[Table]:
    """The league for the terminal: for each time step a column an engine, those that choose their own in all."""
    steps: list[float | None] = [step for step in dict.fromkeys(entry.step for entry in entries) if step]
    for step in steps or [None]:
        own = [entry for entry in entries if entry.step in (step, None)]
        title = "League" if step is None else f"League, step {1e3 * step:g} ms"
        _, _, *lines = zip(*rows(own), strict=True)
        yield pages.table(
            title, [["", *(entry.name.replace("-", "- ") for entry in own)], *lines], no_wrap=True, padding=0
        )


def settings_table(data: dict[str, Any]) -> Rows:
    """What each contestant was set to, of `to_mapping`: a name, versions, and settings or why it is missing."""
    table = [["engine", "versions", "settings"]]
    for each in data["contestants"]:
        versions = ", ".join(f"{name} {version}" for name, version in each["versions"].items())
        given = ", ".join(f"{name} {value}" for name, value in each.get("settings", {}).items() if name != "timestep")
        table.append([each["name"], versions, each["missing"] or given])
    return table


def _stationary(state: Stationary) -> Discipline:
    """Relative error of omega_c in a state that is settled in from rest."""
    return Discipline(
        state.name, (state.run,), lambda runs: abs(state.held(runs[0]).omega_c), state in (ROLLING, SLIPPING)
    )


def _motion(of: trials.Transient) -> Discipline:
    """Rms error of omega_c over a motion."""
    return Discipline(of.name, (of.run,), lambda runs: of.errors(runs[0].time, runs[0].x)[0], quick=True)


def _wall_holds() -> Discipline:
    """The least margin from which on the wall holds a ball above omega_02 and lets it slide down below; nan if none."""
    omega_02 = analytic.thresholds(ROUGH).omega_02
    runs: list[Asked] = []
    for margin in MARGINS:
        riding = Stationary(ROUGH.replace(omega_0=omega_02 * (1 + margin)), Case.NR).solution.state
        for sign in (1, -1):
            p = ROUGH.replace(omega_0=omega_02 * (1 + sign * margin))
            runs.append((p, riding._replace(y=p.R, omega_c=p.omega_0), RIDES, RIDES / 100))

    def score(runs: Runs) -> float:
        holds = [bool(run.y[-1] > 0.9 * ROUGH.R) for run in runs]
        wrong = [margin for margin, up, down in zip(MARGINS, holds[::2], holds[1::2], strict=True) if not up or down]
        return next((margin for margin in MARGINS if not wrong or margin > wrong[-1]), math.nan)

    return Discipline(WALL, tuple(runs), score)


def _open(runs: Runs) -> float:
    """Largest share of samples in which a contact that should carry a force carries none."""
    *ended, passing = runs
    shares = [state.held(run).open for run, state in zip(ended, STATES, strict=True)]
    # In the first sample the ball has yet to sink into a soft contact.
    carries = np.stack([passing.force_A[1:, 1], passing.force_B[1:, 0]]) > 0
    return max(*shares, 1 - float(carries.mean(axis=1).min()))


ERRORS = (*map(_stationary, STATES), _motion(APPROACH))
"""Those of ways to set MuJoCo."""
CONTACT = Discipline(OPEN, tuple(run for each in ERRORS for run in each.runs), _open)
"""How often contact is lost in the runs of `ERRORS`."""


@functools.cache
def disciplines() -> tuple[Discipline, ...]:
    """Those of the league, in the order of its table."""

    def reproduced(runs: Runs) -> float:
        """In how many of the nine cases a run is where the event-driven simulation is in it."""
        return float(sum(trials.share(run, case) >= trials.AGREES for run, case in zip(runs, Case, strict=True)))

    onset, cases = tuple(state.run for state in trials.beyond_rolling()), tuple(map(trials.scenario, Case))
    return (
        *ERRORS[:3],
        replace(ERRORS[0], name=CREEP, score=lambda runs: ROLLING.held(runs[0]).creep),
        ERRORS[-1],
        _motion(LANDING),
        _motion(HITTING),
        Discipline(ROLLING_ENDS, onset, lambda runs: abs(trials.onset(runs))),
        _wall_holds(),
        Discipline(CASES, cases, reproduced, quick=True),
    )
