"""What settings of MuJoCo are tried on: stationary states and motions of the ball; and how far a
run is from them.

A run of a state starts at rest against the wall, which is no solution of the problem, and is judged
only once that start is forgotten: a run that began in the state would stay there whatever it would
have converged to."""

from __future__ import annotations

import json
import math
import os
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from matplotlib.figure import Figure

import analytic
from analytic import StationarySolution
from compare.kit import style
from compare.kit.campaign import Campaign
from compare.kit.engines import AnySettings, Engine
from compare.kit.pages import Rows
from compare.kit.tasks import Task, carry_out
from model import Case, Contact, Parameters, State, Trajectory
from model.arrays import Array
from model.files import write_text
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

        That takes ln(1/eps) = 36 time constants: the slowest of the state, or that of spinning up
        before, (1 + 2j)/c."""
        return -math.log(EPS) * max(
            analytic.slowest_time_constant(self.solution), (1 + 2 * self.p.j) / self.p.c
        )

    @property
    def settles(self) -> float:
        """How long a run lasts, s, in whose last part, a `WINDOW` of it, the start is forgotten."""
        return math.ceil(self.forgets / (1 - WINDOW))

    @property
    def run(self) -> Asked:
        """From rest until it is settled."""
        return self.p, AT_REST, self.settles, self.settles / 1000

    def held(self, run: Trajectory, since: float | None = None) -> Held:
        """How far the samples of a run since a time in s are from the state; by default the last
        `WINDOW` of `run`."""
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
            open=max(
                float(np.mean(normal <= 0))
                for contact, _, normal in contacts
                if contact is not Contact.N
            ),
            creep=max(
                [float(speed.mean()) for contact, speed, _ in contacts if contact is Contact.R],
                default=0.0,
            ),
        )


ROLLING = Stationary(SMOOTH.replace(omega_0=12.0), Case.RR)
SLIPPING = Stationary(SMOOTH.replace(omega_0=25.0), Case.SS)
BARELY, RIDING = (
    Stationary(SMOOTH.replace(omega_0=14.5), Case.SS),
    Stationary(ROUGH.replace(omega_0=25.0), Case.NR),
)
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
        """By the event-driven simulation, at the times of all runs, since blows don't let it be
        interpolated."""
        sharp = analytic.Settings(rtol=1e-12)
        return analytic.simulate(
            self.p, self.x0, self.lasts, settings=sharp, sample_interval=FINEST
        )

    def errors(self, time: Array, x: Array) -> tuple[float, float]:
        """Relative rms errors of omega_c and of the slip, in units of its largest component, of
        states x (n, 8)."""
        truth = np.stack(
            [np.interp(time, self.exact.time, column) for column in self.exact.x.T], axis=-1
        )
        slip = (
            np.sqrt(np.mean(np.sum((x - truth)[:, SLIP_XYZ] ** 2, axis=-1)))
            / np.abs(truth[:, SLIP_XYZ]).max()
        )
        omega_c = State.of(x).omega_c / State.of(truth).omega_c - 1
        return float(np.sqrt(np.mean(omega_c**2))), float(slip)


FINEST = 2.5e-5
"""Of this all time steps of the studies are multiples, s."""
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


REPEATS = 3
"""Cost is the median of as many timings."""
COST, OPEN = "cost", "open"
COLUMNS = 3
LEAST = 1e-16
"""Smaller errors are drawn here: an error may be zero."""
Runs = Sequence[Trajectory]


@dataclass(frozen=True)
class Contestant:
    """An engine with settings."""

    name: str
    engine: Engine
    step: float | None
    """s; None for one that chooses its own."""
    settings: AnySettings

    def task(self, asked: Asked) -> Task:
        """A run; it samples no more often than it steps."""
        p, x0, lasts, interval = asked
        every = max(interval, self.step or 0.0)
        return Task(
            engine=self.engine.name,
            parameters=p,
            x0=x0,
            t_end=lasts,
            settings=self.settings,
            sample_interval=every,
        )


@dataclass(frozen=True)
class Discipline:
    """What is asked of every contestant."""

    name: str
    runs: tuple[Asked, ...]
    score: Callable[[Runs], float]
    """Made of whole runs, one for each of `runs`; nan for what doesn't show."""


@dataclass(frozen=True)
class Entry:
    """What a contestant reaches with a time step."""

    name: str
    step: float | None
    scores: dict[str, float] = field(default_factory=dict)
    """By discipline; nan where it broke down, and for what doesn't show."""
    failures: dict[str, str] = field(default_factory=dict)
    """By discipline, why."""


def scored(
    campaign: Campaign,
    those: Sequence[Contestant],
    asked: Sequence[Discipline],
    cost: Callable[[Task], float] | None = None,
) -> list[Entry]:
    """What contestants reach in some disciplines, and what a run takes by `cost`, if given,
    measured once."""
    rows = [[[each.task(run) for run in discipline.runs] for discipline in asked] for each in those]
    failed = {
        f.task.key: f.reason
        for f in campaign.complete(task for row in rows for tasks in row for task in tasks)
    }
    entries = []
    for number, (each, row) in enumerate(zip(those, rows, strict=True)):
        entry = Entry(each.name, each.step)
        for discipline, tasks in zip(asked, row, strict=True):
            reasons = [failed[task.key] for task in tasks if task.key in failed]
            entry.failures.update({discipline.name: reasons[0]} if reasons else {})
            entry.scores[discipline.name] = (
                math.nan if reasons else discipline.score(campaign.run(tasks))
            )
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
    """Processor time divided by simulated time of one run by itself, without what it takes to
    begin.

    The time of this process and of those that it started and that ended.
    """

    def clock() -> float:
        ended = os.times()
        return time.process_time() + ended.children_user + ended.children_system

    def seconds(task: Task) -> float:
        begin = clock()
        carry_out(task)
        return clock() - begin

    half = replace(task, t_end=task.t_end / 2)
    return statistics.median(seconds(task) - seconds(half) for _ in range(REPEATS)) / half.t_end


def rows(entries: Sequence[Entry]) -> Rows:
    """A table with a head, and a row for each entry; only disciplines that some entry has."""
    forms = {COST: "{:.2g}".format, OPEN: "{:.0%}".format}
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


def _stationary(state: Stationary) -> Discipline:
    """Relative error of omega_c in a state that is settled in from rest."""
    return Discipline(state.name, (state.run,), lambda runs: abs(state.held(runs[0]).omega_c))


def _motion(of: Transient) -> Discipline:
    """Rms error of omega_c over a motion."""
    return Discipline(of.name, (of.run,), lambda runs: of.errors(runs[0].time, runs[0].x)[0])


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


def draw_error_over_cost(
    entries: Sequence[Entry], looks: Mapping[str, Mapping[str, Any]]
) -> Figure:
    """A panel for each error of omega_c; entries of one name at several time steps are joined, with
    its looks."""
    other = (COST, OPEN)  # no errors of omega_c
    shown = [
        name for name in dict.fromkeys(n for e in entries for n in e.scores) if name not in other
    ]
    lines = -(-len(shown) // COLUMNS)
    figure = style.figure(11, 0.9 + 3.0 * lines)
    panels = figure.subplots(lines, COLUMNS, sharex=True, sharey=True, squeeze=False).ravel()
    for axes, discipline in zip(panels, shown, strict=False):
        for name, look in looks.items():
            own = [
                e
                for e in entries
                if e.name == name and math.isfinite(e.scores.get(discipline, math.nan))
            ]
            own.sort(key=lambda entry: entry.scores[COST])
            x, y = [e.scores[COST] for e in own], [max(e.scores[discipline], LEAST) for e in own]
            axes.plot(x, y, ms=6, lw=1, label=name, **look)
        axes.set(xscale="log", yscale="log")
        axes.set_title(discipline, fontsize=10)
        axes.grid(alpha=0.3)
    for k, axes in enumerate(panels):
        axes.set_visible(k < len(shown))
        if k % COLUMNS == 0:
            axes.set_ylabel("relative error")
        if k >= len(shown) - COLUMNS:
            axes.set_xlabel("processor time divided by simulated time")
            axes.tick_params(labelbottom=True)
    style.legend(figure, loc="outside lower center", ncols=4)
    return figure
