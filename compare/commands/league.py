"""``dualball league``: all engines that are installed, on the same tasks, against theory."""

from __future__ import annotations

import argparse
import json
import sys
from typing import Any

from compare.commands import options, running
from compare.kit import pages
from compare.kit.engines import ENGINES
from model import InputError
from model.files import make_directory, write_text
from model.parameters import check_names

JSON, PAGE, RUNS = "league.json", "league.html", "league"


def add(commands: options.Commands) -> None:
    """Declare the command."""
    command = options.command(
        commands, "league", run, "all engines that are installed on the same tasks, against theory"
    )
    command.add_argument("--quick", action="store_true", help="one time step and fewer tasks: within a minute")
    command.add_argument(
        "--engine", action="append", metavar="NAME", help=f"only this one (repeatable): {', '.join(ENGINES)}"
    )
    running.add_workers(command)
    options.outputs(command, "results")


def run(args: argparse.Namespace) -> int:
    """Measure what isn't there yet, show the table, write JSON and page."""
    from compare.bench import league  # here, because nothing else needs it

    check_names(args.engine or (), list(ENGINES), "engine")
    those = league.contestants(args.engine, league.QUICK if args.quick else league.STEPS)
    missing = {each.name: each.engine.missing for each in those if each.engine.missing}
    if all(each.name in missing for each in those):
        raise InputError(f"there is nothing to compare: {'; '.join(missing.values())}")
    for name, why in missing.items():
        print(f"dualball: {name} is left out: {why}", file=sys.stderr)
    make_directory(args.output)
    with running.campaign(args, "league", RUNS) as campaign:
        entries = league.measure(campaign, those, args.quick)
    data = league.to_mapping(those, entries)
    write_text(args.output / JSON, json.dumps(data, indent=1))
    write_text(args.output / PAGE, html(data))
    options.show(data, args.json, *league.tables(entries), league.CAPTION)
    if not args.json:
        print(f"page: {args.output / PAGE}")
    return 0


def html(data: dict[str, Any]) -> str:
    """The league of `league.to_mapping` as one page, which needs nothing but itself."""
    from compare.bench import figures as settings  # here, because drawing takes a second to load
    from compare.bench import league
    from compare.report.pictures import address, svg

    entries = league.from_mapping(data)
    failures = [
        (f"{entry.name}, {1e3 * (entry.step or 0):g} ms, {name}", reason)
        for entry in entries
        for name, reason in entry.failures.items()
    ]
    shown = {"rows": league.rows(entries), "settings": league.settings_table(data), "caption": league.CAPTION}
    shown |= {"failures": failures, "picture": address(svg(settings.draw_league(entries)))}
    return pages.render("compare.report", "league.html", **shown)
