"""Ladder of settings, and error against cost: what ways of setting MuJoCo, and other methods, reach and take.

Each is a contestant of a small league: the stationary states and the approach to one of `trials`.
"""

from __future__ import annotations

import json
import statistics
import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from pathlib import Path

from compare.bench import league
from compare.bench.league import CONTACT, ERRORS, Contestant, Entry
from compare.kit.campaign import BATCH, Campaign
from compare.kit.engines import EVENT, MOREAU, NEWCOMER, newcomer
from compare.kit.statistics import plain
from compare.kit.tasks import Task
from mjsim import ContactSettings, Run
from model.files import reading_json, write_text

FILE = "scores.json"
STEP = 1e-3
"""Time step of the ladder, s."""
STEPS = (4e-3, 2e-3, 1e-3)
"""Time steps of error against cost that figures show, s."""
Ways = Mapping[str, ContactSettings]
"""Ways to set MuJoCo, named after ours or MuJoCo's defaults and what differs from them."""


def rungs(step: float) -> Ways:
    """From what a newcomer writes to ours, each with one thing more than the one before."""
    theirs = "MuJoCo's defaults"
    return {
        f"{theirs}, coordinates free, wall prism, cone pyramidal": league.as_it_comes(step),
        f"{theirs}, coordinates free, cone pyramidal": replace(league.as_it_comes(step), wall=newcomer(step).wall),
        f"{theirs}, coordinates free": replace(newcomer(step), coordinates="free"),
        theirs: newcomer(step),
        "ours, memory off, servo 0, order 1": ContactSettings.at(step, memory=False, servo=0.0, order=1),
        "ours, memory off, order 1": ContactSettings.at(step, memory=False, order=1),
        "ours, order 1": ContactSettings.at(step, order=1),
        "ours": ContactSettings.at(step),
    }


def rivals(step: float) -> Ways:
    """Settings whose error is compared with their cost."""
    named = rungs(step)
    chosen = ("ours", "ours, order 1", "ours, memory off, servo 0, order 1", "MuJoCo's defaults")
    free = ContactSettings.at(step, coordinates="free", memory=False, order=1)
    return {name: named[name] for name in chosen} | {"ours, memory off, order 1, coordinates free": free}


def reached(campaign: Campaign, ways: Ways) -> list[Entry]:
    """Errors of ways to set MuJoCo, and how often contact is lost."""
    return league.scored(campaign, _contestants(ways), [*ERRORS, CONTACT])


def frontier(campaign: Campaign, steps: Sequence[float]) -> list[Entry]:
    """Entries, with their cost, of MuJoCo under several settings and of theory's two simulators, at several steps."""
    ways = [each for alike in zip(*(_contestants(rivals(step)) for step in steps), strict=True) for each in alike]
    theory = [each for name in (MOREAU.name, EVENT.name) for each in league.contestants([name], steps)]
    return league.scored(campaign, [*ways, *theory], ERRORS, _cost)


def _contestants(ways: Ways) -> list[Contestant]:
    """They run without a warning where contacts hover: what poor settings do is the question here."""
    return [Contestant(name, NEWCOMER, each.timestep, each) for name, each in ways.items()]


def _cost(task: Task) -> float:
    """Processor time divided by simulated time of a run, without what it takes to begin: its share of a full batch.

    What has no batches, as free balls, runs by itself.
    """
    settings = task.settings
    if not isinstance(settings, ContactSettings) or settings.coordinates != "polar":
        return league.cost(task)
    given, spent = ([task.parameters] * BATCH, [task.x0] * BATCH, task.t_end, [task.fluid] * BATCH, settings), []
    for _ in range(league.REPEATS):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of contacts that hover
            run = Run(*given, sample_interval=task.sample_interval)
        begin = time.process_time()
        for _ in run:
            pass
        spent.append(time.process_time() - begin)
    return statistics.median(spent) / BATCH / task.t_end


def write(campaign: Campaign, directory: Path) -> None:
    """Measure ladder and error against cost for figures, and keep them beside the results, unless they are there."""
    if not (directory / FILE).exists():
        measured = {"ladder": reached(campaign, rungs(STEP)), "frontier": frontier(campaign, STEPS)}
        content = plain({name: [asdict(entry) for entry in row] for name, row in measured.items()})
        write_text(directory / FILE, json.dumps(content, indent=1))


def read(directory: Path) -> dict[str, tuple[Entry, ...]]:
    """The entries by name, none where none were measured; raises `StorageError` for a file that isn't whole."""
    path = directory / FILE
    if not path.exists():
        return {}
    with reading_json(path, "scores: remove it, and they are measured again") as rows:
        return {name: tuple(league.from_mapping({"entries": rows[name]})) for name in ("ladder", "frontier")}
