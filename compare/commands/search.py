"""``dualball search``: where in parameter space the ball hops for ever, resumable."""

from __future__ import annotations

import argparse
import dataclasses
import json
from pathlib import Path

from rich.console import Console
from rich.markdown import Markdown

from compare.commands import options, running
from compare.runs import progress, regions, search
from compare.runs.search import BOX, Search
from compare.runs.workers import processes
from model import InputError
from model.files import write_text
from model.parameters import POSITIVE, Range, check_names, check_number, parse_number


def add(commands: options.Commands) -> None:
    """Declare the command."""
    command = options.command(commands, "search", run, "where in parameter space the ball hops for ever, resumable")
    command.add_argument("--sets", type=int, default=500, metavar="N", help="parameter sets (default 500)")
    command.add_argument("--starts", type=int, default=5, metavar="N", help="random starts of each (default 5)")
    command.add_argument("--seed", type=int, default=0)
    command.add_argument(
        "--range", action="append", default=[], metavar="NAME=FROM:TO", help=f"part of the box; {', '.join(BOX)}"
    )
    command.add_argument("-o", "--output", type=Path, default=Path("search"), metavar="DIR")
    running.add_workers(command)
    command.add_argument("--save", type=Path, metavar="FILE", help="write the sets with hopping as JSON")
    command.add_argument("--page", type=Path, metavar="FILE", help="write the table as Markdown")
    command.add_argument("--json", action="store_true", help="print the sets with hopping as JSON")
    command.add_argument("--quiet", action="store_true", help="no progress")


def run(args: argparse.Namespace) -> int:
    """Search what hasn't been searched yet, and show the table."""
    count = int(check_number("sets", args.sets, "sets", Range(1, whole=True)))
    starts = int(check_number("starts", args.starts, "starts", Range(1, whole=True)))
    box = dict(BOX) | dict(_range(text) for text in args.range)
    workers = running.workers(args)
    if workers == 0:
        raise InputError("workers = 0: a search needs processes; must be >= 1")
    with progress.shown(quiet=args.quiet or args.json) as show:
        pool = processes(workers) if isinstance(workers, int) else workers
        searched = Search(box, starts, args.seed)
        hopping = search.run(args.output, searched, count, pool, lambda done, total: show("search", done, total, 0))
    if args.save:
        hopping.save(args.save)
    if args.page:
        write_text(args.page, regions.page(hopping))
    if args.json:
        print(json.dumps(dataclasses.asdict(hopping), indent=1))
    else:
        Console().print(Markdown(regions.page(hopping)))
    return 0


def _range(text: str) -> tuple[str, tuple[float, float]]:
    name, _, ends = text.partition("=")
    check_names([name], list(BOX), "group")
    low, separator, high = ends.partition(":")
    if not separator:
        raise InputError(f"{text!r} is no range: write {name}=from:to")
    first, last = (parse_number(name, end, "1", POSITIVE) for end in (low, high))
    if first >= last:
        raise InputError(f"{name} = {first:g}:{last:g} is in the wrong order: a range runs from low to high")
    return name, (first, last)
