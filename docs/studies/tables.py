"""Write the measured tables of a page, as in ``python -m docs.studies.tables
docs/records/settings.md``; or of another.

Each table stands between two lines ``<!-- begin: NAME -->`` and ``<!-- end: NAME -->``. Runs are
kept in a results directory and not computed again."""

from __future__ import annotations

import argparse
import functools
import json
import os
import pickle
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

from compare.bench import league
from compare.bench.runner import Result
from compare.kit import drawing, pages, progress
from compare.kit.campaign import Campaign
from compare.kit.engines import default_settings
from compare.kit.pages import Rows
from docs.studies import (
    accuracy,
    confirmation,
    engines,
    extrapolation,
    settings,
    statements,
    states,
)
from docs.studies.states import Entry
from mjsim import ContactSettings
from model import InputError
from model.files import write_text
from model.parameters import check_choice, check_names


def write(page: Path, name: str, rows: Rows) -> None:
    """Put a table where a page has its name; raises `InputError` if it has no place for it."""
    text = page.read_text("utf-8")
    begin, end = f"<!-- begin: {name} -->", f"<!-- end: {name} -->"
    if text.count(begin) != 1 or text.count(end) != 1:
        raise InputError(f"{page} must have the lines {begin!r} and {end!r} once each")
    before, rest = text.split(begin)
    write_text(page, f"{before}{begin}\n{pages.markdown(rows)}\n{end}{rest.split(end)[1]}")


def write_all(tables: Mapping[str, Callable[[], Rows]], what: str, page: str) -> int:
    """As a program: measure and write all tables that a page has a place for, or those named."""
    parser = argparse.ArgumentParser(description=what)
    parser.add_argument("page", type=Path, metavar="FILE", help=page)
    parser.add_argument(
        "--only", action="append", choices=list(tables), metavar="NAME", help="only this table"
    )
    args = parser.parse_args()
    text = args.page.read_text("utf-8")
    for name in args.only or [each for each in tables if f"<!-- begin: {each} -->" in text]:
        write(args.page, name, tables[name]())
    return 0


def _of_settings(entries: Sequence[Entry]) -> Rows:
    """Entries of one time step, which isn't named."""
    (_, _, *head), *body = states.rows(entries)
    return [["settings", *head], *([name, *cells] for name, _, *cells in body)]


def variants(step: float) -> settings.Ways:
    """Other ways to set MuJoCo; a firmer impedance keeps the damping b_f h = 1 of the friction
    rows."""
    firm = {"solimp": 0.1, "solreffriction": 2 * step / 0.1}
    firmly = f"{settings.OURS}, solreffriction {firm['solreffriction']:g}, solimp 0.1"

    def soft(**changes: Any) -> ContactSettings:
        return ContactSettings.at(step, **changes)

    return {
        "MuJoCo's defaults, cone pyramidal": replace(default_settings(step), cone="pyramidal"),
        f"{firmly}, cone pyramidal": soft(**firm, cone="pyramidal"),
        f"{settings.OURS}, integrator implicit": soft(integrator="implicit"),
        f"{settings.OURS}, integrator implicitfast": soft(integrator="implicitfast"),
        f"{firmly}, integrator discrete": soft(**firm, integrator="discrete"),
        f"{settings.OURS}, integrator discrete": soft(integrator="discrete"),
        f"{settings.OURS}, noslip_iterations 10": soft(noslip_iterations=10),
        settings.OURS: soft(),
    }


TABLES: dict[str, Callable[[Campaign], Rows]] = {
    "engines": lambda campaign: engines.counted(campaign.directory.parent),
    "limits": lambda campaign: engines.limits(campaign.directory.parent),
    "not-confirmed": lambda campaign: engines.not_confirmed(campaign.directory.parent),
    "chosen": lambda campaign: engines.chosen(campaign.directory.parent),
    "misses": lambda campaign: extrapolation.misses(),
    "landings": lambda campaign: settings.landings(settings.STEP),
    "formulas": lambda campaign: confirmation.table(),
    "reached": accuracy.reached,
    "transient": accuracy.transient,
    "events": accuracy.event_times,
    "split": accuracy.force_split,
    "ablation": lambda campaign: _of_settings(
        settings.reached(campaign, settings.rungs(settings.STEP))
    ),
    "frontier": lambda campaign: states.rows(settings.frontier(campaign, settings.STEPS)),
    "variants": lambda campaign: _of_settings(settings.reached(campaign, variants(settings.STEP))),
}
"""The tables by name."""


@functools.cache
def _league(kept: Path) -> dict[str, list[Result]]:
    """Of all engines, each measured unless its file is there: delete that of an engine whose
    adapter has changed."""

    def results(name: str) -> list[Result]:
        file = kept / f"{name}.pickle"
        if not file.exists():
            (found,) = league.measure({name: league.ENTRIES[name]}, None, 1, show).values()
            file.write_bytes(pickle.dumps(found))
        return cast(list[Result], pickle.loads(file.read_bytes()))

    with progress.reporter(counted=True) as show, ThreadPoolExecutor(os.cpu_count()) as pool:
        found = dict(zip(league.ENTRIES, pool.map(results, league.ENTRIES), strict=True))
    if missing := [
        results[0].skipped
        for results in found.values()
        if all(result.skipped for result in results)
    ]:
        raise InputError(f"the page is about all engines: {missing[0]}")
    write_text(kept / "league.json", json.dumps(league.to_mapping(found)))
    drawing.save(league.draw(found), Path(__file__).parents[1] / "league.svg")
    return found


def _errors(asked: bool, kept: Path) -> Rows:
    """Errors by case of the engines as they come, or of those in their best settings."""
    chosen = {
        name: own for name, own in _league(kept).items() if name.endswith("-defaults") == asked
    }
    return league.rows({name.removesuffix("-defaults"): own for name, own in chosen.items()})


LEAGUE: dict[str, Callable[[Campaign], Rows]] = {
    "league": lambda campaign: league.summary(_league(campaign.directory)),
    "league-best": lambda campaign: _errors(False, campaign.directory),
    "league-defaults": lambda campaign: _errors(True, campaign.directory),
    "league-about": lambda campaign: league.declarations(_league(campaign.directory)),
}
VERDICTS: dict[str, Callable[[Campaign], Rows]] = {
    "verdict": lambda campaign: engines.verdict(campaign.directory.parent)
}
STATEMENTS: dict[str, Callable[[Campaign], Rows]] = {
    "statements": lambda campaign: statements.table()
}
PAGES = {
    "settings.md": ("settings", TABLES),
    "league.md": ("league", LEAGUE),
    "README.md": ("settings", VERDICTS),
    "statements.md": ("settings", STATEMENTS),
}
"""Directory of the runs, and tables of each page."""


def main(argv: Sequence[str] | None = None) -> int:
    """Measure and write all tables of a page, or those named."""
    parser = argparse.ArgumentParser(
        description="Write the measured tables of a page of the documentation."
    )
    parser.add_argument(
        "page", type=Path, metavar="FILE", help=f"a page called {' or '.join(PAGES)}"
    )
    parser.add_argument(
        "--only", action="append", metavar="NAME", help="only this table (may be repeated)"
    )
    parser.add_argument(
        "-o",
        "--output",
        type=Path,
        default=Path("results"),
        metavar="DIR",
        help="where runs are kept",
    )
    parser.add_argument(
        "--workers", type=int, default=os.cpu_count() or 1, metavar="N", help="processes (0: none)"
    )
    args = parser.parse_args(argv)
    check_choice("page", args.page.name, list(PAGES))
    runs, tables = PAGES[args.page.name]
    check_names(args.only or (), list(tables), "table")
    with (
        progress.reporter(counted=True) as show,
        Campaign(args.output / runs, args.workers, report=show) as campaign,
    ):
        for name in args.only or tables:
            campaign.doing = name
            write(args.page, name, tables[name](campaign))
    return 0


if __name__ == "__main__":
    sys.exit(main())
