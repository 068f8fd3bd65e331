"""Ladder of settings, and error against cost: what ways of setting MuJoCo, and other methods, reach and take.

Each is tried on the stationary states and the transient of `trials`. Error and cost are those of one way of running:
of a batch for MuJoCo on joints (`compare.runs`), of single runs for what has no batches.
"""

from __future__ import annotations

import dataclasses
import functools
import json
import math
import statistics
import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np

import analytic
from compare.runs.campaign import BATCH, Campaign
from compare.runs.engines import MOREAU, NEWCOMER
from compare.runs.tasks import Task, carry_out
from compare.scorecard import kept, trials
from compare.scorecard import settings as ways
from compare.scorecard.trials import AT_REST, KICKED, PASSES, SLIPPING, STATES
from compare.statistics import plain
from mjsim import ContactSettings, Run
from model import StorageError, Trajectory
from model.files import write_text

Settings = ContactSettings | analytic.Settings
"""Of MuJoCo, or of the simulators of theory."""
FILE = "scores.json"
STEP = 1e-3
"""Time step of the ladder and the variants, s."""
STEPS = (4e-3, 2e-3, 1e-3)
"""Time steps of error against cost that figures show, s."""
WINDOW = 0.1
"""Last part of a settled run, which is averaged."""
REPEATS = 3
"""Cost is the median of as many timings."""
MUJOCO = NEWCOMER.name
"""MuJoCo without a warning where contacts hover: what poor settings do is the question here."""


@dataclass(frozen=True)
class Score:
    """What a method reaches in one quantity."""

    method: str
    """What `settings.name` calls the settings of MuJoCo, or the name of another engine."""
    step: float | None
    """Time step, s; None if the method chooses its own."""
    quantity: str
    """`State.name`, or `trials.TRANSIENT`."""
    error: float
    """Of omega_c, relative, in the transient rms; nan if the run diverged."""
    open: float
    """Share of samples in which a contact that should carry a force carries none."""
    cost: float = math.nan
    """Processor time over simulated time; nan where it isn't measured."""

    def to_mapping(self) -> dict[str, Any]:
        """JSON-able data; None for what is not finite."""
        values: dict[str, Any] = plain(dataclasses.asdict(self))
        return values

    @classmethod
    def from_mapping(cls, values: Mapping[str, Any]) -> Self:
        """Inverse of `to_mapping`."""
        numbers = {name: math.nan for name in ("error", "open", "cost") if values[name] is None}
        return cls(**{**values, **numbers})


def ladder(campaign: Campaign, step: float = STEP) -> list[Score]:
    """Scores under settings that each have one thing more than the one before."""
    return scores(campaign, ways.ladder(step))


def variants(campaign: Campaign, step: float = STEP) -> list[Score]:
    """Scores under other ways to set MuJoCo."""
    return scores(campaign, ways.variants(step))


def frontier(campaign: Campaign, steps: Sequence[float]) -> list[Score]:
    """Scores, with their cost, of MuJoCo under several settings and of the two simulators of theory, over the step."""
    methods: list[Settings] = [each for alike in zip(*map(ways.rivals, steps), strict=True) for each in alike]
    methods += [analytic.Settings(method=MOREAU.name, step=step) for step in steps]
    methods.append(analytic.Settings())
    scored = scores(campaign, methods)
    spent = {_identity(method): cost(campaign, method) for method in methods}
    return [dataclasses.replace(score, cost=spent[score.method, score.step]) for score in scored]


def scores(campaign: Campaign, methods: Sequence[Settings]) -> list[Score]:
    """All quantities of all methods, in that order; what they run shares batches where it can."""
    campaign.complete([trials.EXACT, *(task for method in methods for task in tasks(method))])
    (exact,) = campaign.run([trials.EXACT])
    return [score for method in methods for score in _scores(campaign, method, exact)]


def _identity(method: Settings) -> tuple[str, float | None]:
    """Name and time step (s) of a method."""
    if isinstance(method, ContactSettings):
        return ways.name(method), method.timestep
    return method.method, method.step


def tasks(method: Settings) -> list[Task]:
    """A run for each of the states, equally long so that they share a batch, and the transient."""
    engine = MUJOCO if isinstance(method, ContactSettings) else method.method
    run = functools.partial(Task, engine=engine, settings=method)
    lasts = math.ceil(max(state.forgets for state in STATES) / (1 - WINDOW))
    passing = run(parameters=SLIPPING.p, x0=KICKED, t_end=PASSES, sample_interval=PASSES / 100)
    return [*(run(parameters=state.p, x0=AT_REST, t_end=lasts) for state in STATES), passing]


def _scores(campaign: Campaign, method: Settings, exact: Trajectory) -> list[Score]:
    *settling, passing = tasks(method)
    row = []
    for state, task in zip(STATES, settling, strict=True):
        held = trials.held(kept.run(campaign, task), state, (1 - WINDOW) * task.t_end)
        row.append(Score(*_identity(method), state.name, abs(held.omega_c), held.open))
    run = kept.run(campaign, passing)
    if not run.complete:
        return [*row, Score(*_identity(method), trials.TRANSIENT, math.nan, math.nan)]
    error, _ = trials.deviation(run.time, run.x, exact)
    # In the first sample the ball has yet to sink into a soft contact.
    carries = np.stack([run.force_A[1:, 1], run.force_B[1:, 0]]) > 0
    return [*row, Score(*_identity(method), trials.TRANSIENT, error, 1 - float(carries.mean(axis=1).min()))]


def cost(campaign: Campaign, method: Settings) -> float:
    """Processor time over simulated time of the transient: measured once, and kept beside its run."""
    *_, task = tasks(method)
    return kept.cost(campaign, task, lambda: statistics.median(_time_spent(task) for _ in range(REPEATS)) / task.t_end)


def _time_spent(task: Task) -> float:
    """Processor time in s of a run: its share of a full batch where runs share one, without what it takes to begin."""
    if not isinstance(task.settings, ContactSettings):
        begin = time.process_time()
        carry_out([task])
        return time.process_time() - begin
    count = BATCH if task.settings.coordinates == "polar" else 1  # free balls are stepped one after the other
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of contacts that hover
        given = [task.parameters] * count, [task.x0] * count, task.t_end, [task.fluid] * count, task.settings
        run = Run(*given, sample_interval=task.sample_interval)
    begin = time.process_time()
    for _ in run:
        pass
    return (time.process_time() - begin) / count


def write(campaign: Campaign, directory: Path) -> None:
    """Measure ladder and error against cost for figures, and keep them beside the results, unless they are there."""
    if not (directory / FILE).exists():
        measured = {"ladder": ladder(campaign), "frontier": frontier(campaign, STEPS)}
        content = {name: [score.to_mapping() for score in row] for name, row in measured.items()}
        write_text(directory / FILE, json.dumps(content, indent=1))


def read(directory: Path) -> dict[str, tuple[Score, ...]]:
    """The scores by name, none where none were measured; raises `StorageError` for a file that isn't whole."""
    path = directory / FILE
    if not path.exists():
        return {}
    try:
        rows = json.loads(path.read_text("utf-8"))
        return {name: tuple(Score.from_mapping(values) for values in rows[name]) for name in ("ladder", "frontier")}
    except (ValueError, KeyError, TypeError) as error:
        raise StorageError(f"{path} is damaged: remove it, and it is measured again") from error
