"""``dualball sweep`` and ``dualball collect``: many runs over ranges of parameters, and one file of all of them."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from compare.commands import options, running
from compare.kit import campaign, sweep
from model import Flow


def add(commands: options.Commands) -> None:
    """Declare the commands."""
    command = options.command(commands, "sweep", run, "many runs over ranges of parameters, resumable")
    options.add_parameters(command)
    running.add_start(command)
    options.add_axes(command, "--vary", "a range, or NAME=A,B,C; several make a grid", required=True)
    command.add_argument("--random", type=int, metavar="N", help="N points that fill the ranges NAME=FROM:TO instead")
    command.add_argument("--seed", type=int, default=0)
    command.add_argument(
        "--direction",
        choices=("held", "up", "down", "both"),
        default="held",
        help="held: a run for each point; up, down, both: omega_0 in steps within one run (shows hysteresis)",
    )
    command.add_argument(
        "--hold", type=options.number, default=20.0, metavar="s", help="time at each step (default 20)"
    )
    running.add_engine(command)
    command.add_argument("--time", type=options.number, default=30.0, metavar="s", help="duration (default 30)")
    running.add_workers(command)
    command.add_argument("--batch", type=int, default=campaign.BATCH, metavar="N", help="runs in one MuJoCo batch")
    options.outputs(command, "sweep", "print a summary as JSON")

    command = options.command(commands, "collect", collect, "gather the runs of a directory into one file for xarray")
    command.add_argument("directory", type=Path, metavar="DIR")
    command.add_argument("-o", "--output", type=Path, default=Path("sweep.h5"), metavar="FILE")


def run(args: argparse.Namespace) -> int:
    """Carry out the runs that are not done yet and say which failed."""
    p, axes = options.parameters(args), [sweep.Axis.parse(text) for text in args.vary]
    if args.direction != "held":
        omegas = sweep.levels(axes, args.direction)
        flow, lasts = Flow.staircase(omegas, args.hold), args.hold * len(omegas)
        tasks = [running.task(args, p.replace(omega_0=omegas[0]), flow=flow, t_end=lasts)]
    else:
        sets = sweep.grid(p, axes) if args.random is None else sweep.random(p, axes, args.random, args.seed)
        tasks = [running.task(args, each) for each in sets]  # each with settings that suit its set
    with running.campaign(args, "sweep", batch=args.batch) as work:
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


def collect(args: argparse.Namespace) -> int:
    """Gather the runs."""
    count = sweep.collect(args.directory, args.output)
    print(f"{count} runs gathered into {args.output}")
    return 0
