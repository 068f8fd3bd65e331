"""Ladder of settings, and error against cost: what ways of setting MuJoCo, and other methods, reach and take.

Each is a contestant of a small league: the stationary states and the approach to one of `trials`.
"""

from __future__ import annotations

import json
import statistics
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

from compare.runs.campaign import BATCH, Campaign
from compare.runs.engines import EVENT, MOREAU, NEWCOMER, newcomer
from compare.runs.tasks import Task
from compare.scorecard import league
from compare.scorecard.contenders import Contestant
from compare.scorecard.league import CONTACT, ERRORS, Entry
from compare.statistics import plain
from mjsim import ContactSettings, Run
from model.files import reading_json, write_text

FILE = "scores.json"
STEP = 1e-3
"""Time step of the ladder and the variants, s."""
STEPS = (4e-3, 2e-3, 1e-3)
"""Time steps of error against cost that figures show, s."""
BASES: dict[str, Callable[[float], ContactSettings]] = {"ours": ContactSettings.at, "MuJoCo's defaults": newcomer}
"""Settings for a time step in s, beside which others are named."""


def name(settings: ContactSettings) -> str:
    """The base from which settings differ least, and in what they differ."""
    changes = {base: _changes(at(settings.timestep), settings) for base, at in BASES.items()}
    base = min(changes, key=lambda each: len(changes[each]))
    return ", ".join([base, *changes[base]])


def _changes(base: ContactSettings, settings: ContactSettings) -> list[str]:
    values = {f.name: getattr(settings, f.name) for f in fields(settings)}
    return [f"{each} {_text(value)}" for each, value in values.items() if value != getattr(base, each)]


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, tuple):
        return " ".join(_text(part) for part in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def rungs(step: float) -> list[ContactSettings]:
    """From what a newcomer writes to ours, each with one thing more than the one before."""
    return [
        replace(newcomer(step), cone="pyramidal", coordinates="free", wall="prism"),
        replace(newcomer(step), cone="pyramidal", coordinates="free"),
        replace(newcomer(step), coordinates="free"),
        newcomer(step),
        ContactSettings.at(step, memory=False, servo=0.0, order=1),
        ContactSettings.at(step, memory=False, order=1),
        ContactSettings.at(step, order=1),
        ContactSettings.at(step),
    ]


def rivals(step: float) -> list[ContactSettings]:
    """Settings whose error is compared with their cost."""
    return [
        ContactSettings.at(step),
        ContactSettings.at(step, order=1),
        ContactSettings.at(step, order=1, memory=False, servo=0.0),
        newcomer(step),
        ContactSettings.at(step, coordinates="free", memory=False, order=1),
    ]


def others(step: float) -> list[ContactSettings]:
    """Other ways to set MuJoCo; a firmer impedance keeps the damping b_f h = 1 of the friction rows."""
    firm = {"solimp": 0.1, "solreffriction": 2 * step / 0.1}
    return [
        replace(newcomer(step), cone="pyramidal"),
        ContactSettings.at(step, **firm, cone="pyramidal", memory=False, order=1),
        ContactSettings.at(step, integrator="implicit"),
        ContactSettings.at(step, integrator="implicitfast"),
        ContactSettings.at(step, **firm, integrator="discrete"),
        ContactSettings.at(step, integrator="discrete"),
        ContactSettings.at(step, memory=False, noslip_iterations=10),
        ContactSettings.at(step, memory=False),
        ContactSettings.at(step),
    ]


def reached(campaign: Campaign, ways: Sequence[ContactSettings]) -> list[Entry]:
    """Errors of ways to set MuJoCo, and how often contact is lost."""
    return league.scored(campaign, [_way(each) for each in ways], [*ERRORS, CONTACT])


def frontier(campaign: Campaign, steps: Sequence[float]) -> list[Entry]:
    """Entries, with their cost, of MuJoCo under several settings and of the two simulators of theory, over the step."""
    ways = [_way(each) for alike in zip(*map(rivals, steps), strict=True) for each in alike]
    theory = [each for name in (MOREAU.name, EVENT.name) for each in league.contestants([name], steps)]
    return league.scored(campaign, [*ways, *theory], ERRORS, _cost)


def _way(settings: ContactSettings) -> Contestant:
    """MuJoCo set in some way, without a warning where contacts hover: what poor settings do is the question here."""
    return Contestant(name(settings), NEWCOMER, settings.timestep, settings)


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
