"""Ladder of settings, and error against cost: what ways of setting MuJoCo, and other methods, reach and take.

Each is a contestant of a small league: the stationary states and the transient of `trials`.
"""

from __future__ import annotations

import json
import statistics
import time
import warnings
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import numpy as np

from compare.runs.campaign import BATCH, Campaign
from compare.runs.engines import EVENT, MOREAU, NEWCOMER
from compare.runs.tasks import Task
from compare.scorecard import league, trials
from compare.scorecard import settings as ways
from compare.scorecard.league import Contestant, Discipline, Entry, Runs
from compare.scorecard.trials import STATES, WINDOW
from compare.statistics import plain
from mjsim import ContactSettings, Run
from model import StorageError
from model.files import write_text

FILE = "scores.json"
STEP = 1e-3
"""Time step of the ladder and the variants, s."""
STEPS = (4e-3, 2e-3, 1e-3)
"""Time steps of error against cost that figures show, s."""
OPEN = "open"


def ladder(campaign: Campaign, step: float = STEP) -> list[Entry]:
    """Entries of settings that each have one thing more than the one before."""
    return league.scored(campaign, [_way(each) for each in ways.ladder(step)], ASKED)


def variants(campaign: Campaign) -> list[Entry]:
    """Entries of other ways to set MuJoCo."""
    return league.scored(campaign, [_way(each) for each in ways.variants(STEP)], ASKED)


def frontier(campaign: Campaign, steps: Sequence[float]) -> list[Entry]:
    """Entries, with their cost, of MuJoCo under several settings and of the two simulators of theory, over the step."""
    methods = [_way(each) for alike in zip(*map(ways.rivals, steps), strict=True) for each in alike]
    event, moreau = league.contestants([EVENT.name, MOREAU.name])
    return league.scored(campaign, [*methods, *((moreau, step) for step in steps), (event, None)], ERRORS, _cost)


def _way(settings: ContactSettings) -> tuple[Contestant, float]:
    """MuJoCo set in some way, without a warning where contacts hover: what poor settings do is the question here."""
    return Contestant(ways.name(settings), NEWCOMER, lambda step: settings), settings.timestep


def _open(runs: Runs) -> float:
    """Largest share of samples in which a contact that should carry a force carries none."""
    *settled, passing = runs
    shares = [trials.held(r, s, (1 - WINDOW) * r.time[-1]).open for r, s in zip(settled, STATES, strict=True)]
    # In the first sample the ball has yet to sink into a soft contact.
    carries = np.stack([passing.force_A[1:, 1], passing.force_B[1:, 0]]) > 0
    return max(*shares, 1 - float(carries.mean(axis=1).min()))


ERRORS = (*(league.stationary(state) for state in STATES), league.APPROACH)
ASKED = (*ERRORS, Discipline(OPEN, tuple(run for each in ERRORS for run in each.runs), _open))


def _cost(task: Task) -> float:
    """Processor time over simulated time of a run, without what it takes to begin: its share of a full batch.

    What has no batches, as free balls, runs by itself.
    """
    settings = task.settings
    if not isinstance(settings, ContactSettings) or settings.coordinates != "polar":
        return league.cost(task)
    return statistics.median(_share_of_batch(task, settings) for _ in range(league.REPEATS)) / task.t_end


def _share_of_batch(task: Task, settings: ContactSettings) -> float:
    """Processor time in s."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of contacts that hover
        given = [task.parameters] * BATCH, [task.x0] * BATCH, task.t_end, [task.fluid] * BATCH, settings
        run = Run(*given, sample_interval=task.sample_interval)
    begin = time.process_time()
    for _ in run:
        pass
    return (time.process_time() - begin) / BATCH


def write(campaign: Campaign, directory: Path) -> None:
    """Measure ladder and error against cost for figures, and keep them beside the results, unless they are there."""
    if not (directory / FILE).exists():
        measured = {"ladder": ladder(campaign), "frontier": frontier(campaign, STEPS)}
        content = plain({name: [asdict(entry) for entry in row] for name, row in measured.items()})
        write_text(directory / FILE, json.dumps(content, indent=1))


def read(directory: Path) -> dict[str, tuple[Entry, ...]]:
    """The entries by name, none where none were measured; raises `StorageError` for a file that isn't whole."""
    path = directory / FILE
    if not path.exists():
        return {}
    try:
        rows = json.loads(path.read_text("utf-8"))
        return {name: tuple(league.from_mapping({"entries": rows[name]})) for name in ("ladder", "frontier")}
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise StorageError(f"{path} is damaged: remove it, and it is measured again") from error
