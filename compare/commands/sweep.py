"""``dualball sweep`` and ``dualball collect``: many runs over ranges of parameters, and one file of all of them."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from compare.commands import options, running
from compare.runs import campaign, collection, progress, sweep
from compare.runs.campaign import Campaign
from compare.runs.tasks import Task


def add(commands: options.Commands) -> None:
    """Declare the commands."""
    command = options.command(commands, "sweep", run, "many runs over ranges of parameters, resumable")
    options.add_parameters(command)
    running.add_start(command)
    command.add_argument(
        "--vary",
        action="append",
        required=True,
        metavar="NAME=FROM:TO:COUNT",
        help="a range, or NAME=A,B,C; several make a grid",
    )
    command.add_argument("--random", type=int, metavar="N", help="N points that fill the ranges NAME=FROM:TO instead")
    command.add_argument("--seed", type=int, default=0)
    command.add_argument(
        "--direction",
        choices=sweep.DIRECTIONS,
        default="held",
        help="held: a run for each point; up, down, both: omega_0 in steps within one run (shows hysteresis)",
    )
    command.add_argument(
        "--hold", type=options.number, default=20.0, metavar="s", help="time at each step (default 20)"
    )
    running.add_engine(command)
    command.add_argument("--time", type=options.number, default=30.0, metavar="s", help="duration (default 30)")
    command.add_argument("-o", "--output", type=Path, default=Path("sweep"), metavar="DIR")
    running.add_workers(command)
    command.add_argument("--batch", type=int, default=campaign.BATCH, metavar="N", help="runs in one MuJoCo batch")
    command.add_argument("--json", action="store_true", help="print a summary as JSON")
    command.add_argument("--quiet", action="store_true", help="no progress")

    command = options.command(commands, "collect", collect, "gather the runs of a directory into one file for xarray")
    command.add_argument("directory", type=Path, metavar="DIR")
    command.add_argument("-o", "--output", type=Path, default=Path("sweep.h5"), metavar="FILE")


def run(args: argparse.Namespace) -> int:
    """Carry out the runs that are not done yet and say which failed."""
    tasks = _tasks(args)
    with (
        progress.shown(quiet=args.quiet or args.json) as show,
        Campaign(args.output, running.workers(args), args.batch, args.limit) as work,
    ):
        work.report = lambda now: show("sweep", now.done, now.total, now.failed)
        failures = work.complete(tasks)
    whole = len(tasks) - len(failures)
    if args.json:
        summary = {"directory": str(args.output), "runs": len(tasks), "whole": whole}
        print(json.dumps(summary | {"failures": campaign.listed(failures)}, indent=1))
    else:
        print(f"{whole} of {len(tasks)} runs are whole, in {args.output}; gather them with: ", end="")
        print(f"dualball collect {args.output}")
        for failure in failures:
            print(f"failed: {failure.task.key}: {failure.reason}", file=sys.stderr)
    return 1 if failures else 0


def _tasks(args: argparse.Namespace) -> list[Task]:
    axes = [sweep.Axis.parse(text) for text in args.vary]
    template = running.task(args)
    if args.direction != "held":
        return [sweep.staircase(template, sweep.levels(axes, args.direction), args.hold)]
    if args.random is not None:
        return sweep.held(template, sweep.random(template.parameters, axes, args.random, args.seed))
    return sweep.held(template, sweep.grid(template.parameters, axes))


def collect(args: argparse.Namespace) -> int:
    """Gather the runs."""
    count = collection.collect(args.directory, args.output)
    print(f"{count} runs gathered into {args.output}")
    return 0
