"""Write the measured tables of a page, as in ``python -m docs.studies.tables
docs/records/settings.md``; or of another.

Each table stands between two lines ``<!-- begin: NAME -->`` and ``<!-- end: NAME -->``. Runs are
kept in a results directory and not computed again."""

import argparse
import functools
import json
import os
import pickle
import sys
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import cast

import matplotlib

from compare.bench import league
from compare.bench.runner import Result
from compare.campaign import progress
from compare.campaign.campaign import Campaign
from compare.figures import drawing, pages
from compare.figures.pages import Rows
from docs.studies import engines, extrapolation, settings, statements
from model import InputError
from model.files import make_directory, write_text

RESULTS = Path("results")
RUNS = RESULTS / "settings"


def write(page: Path, name: str, rows: Rows) -> None:
    """Put a table where a page has its name; raises `InputError` if it has no place for it."""
    text = page.read_text("utf-8")
    begin, end = f"<!-- begin: {name} -->", f"<!-- end: {name} -->"
    if text.count(begin) != 1 or text.count(end) != 1:
        raise InputError(f"{page} must have the lines {begin!r} and {end!r} once each")
    before, rest = text.split(begin)
    write_text(page, f"{before}{begin}\n{pages.markdown(rows)}\n{end}{rest.split(end)[1]}")


Tables = Mapping[str, Callable[[], Rows]]


def write_all(tables: Tables, what: str, page: str) -> int:
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


def _by_campaign(table: Callable[[Campaign], Rows]) -> Callable[[], Rows]:
    """A table whose runs are those of a campaign."""

    def rows() -> Rows:
        matplotlib.rcParams["svg.hashsalt"] = "dualball"  # equal figures make equal files
        workers = os.cpu_count() or 1
        with (
            progress.reporter(counted=True) as show,
            Campaign(RUNS, workers, report=show) as campaign,
        ):
            return table(campaign)

    return rows


@functools.cache
def _league() -> dict[str, list[Result]]:
    """Of all engines, each measured unless its file is there: delete that of an engine whose
    adapter has changed."""
    kept = RESULTS / "league"
    make_directory(kept)

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


def _errors(asked: bool) -> Rows:
    """Errors by case of the engines as they come, or of those in their best settings."""
    found = ((name.partition("-defaults"), own) for name, own in _league().items())
    return league.rows({engine: own for (engine, kind, _), own in found if bool(kind) == asked})


TABLES: Tables = {
    "verdict": lambda: engines.verdict(RESULTS),
    "engines": lambda: engines.counted(RESULTS),
    "limits": lambda: engines.limits(RESULTS),
    "misses": extrapolation.misses,
    "chosen": lambda: engines.chosen(RESULTS),
    "ablation": _by_campaign(settings.ablation),
    "landings": settings.landings,
    "frontier": _by_campaign(settings.frontier),
    "league": lambda: league.summary(_league()),
    "league-best": lambda: _errors(False),
    "league-defaults": lambda: _errors(True),
    "league-about": lambda: league.declarations(_league()),
    "statements": statements.table,
}
"""By their names on pages: README.md and three of docs/records."""


if __name__ == "__main__":
    sys.exit(write_all(TABLES, "Write measured tables.", "README.md, or a page of docs/records"))
