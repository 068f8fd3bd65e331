"""``dualball simulate``, ``sweep``, ``collect``: a run, many over ranges of parameters, and one file of all of them."""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from compare.commands import options, running
from compare.kit import campaign, sweep
from compare.kit.tasks import failed_path, journal_path, store
from compare.kit.workers import interrupts
from compare.view import inspection
from model import Flow
from model.files import check_writable


def add(commands: options.Commands) -> None:
    """Declare the commands."""
    command = options.command(commands, "simulate", run, "one run with any engine, into an HDF5 file")
    running.add_engine(command)
    options.add_parameters(command)
    running.add_flow(command)
    running.add_start(command)
    command.add_argument("--time", type=options.number, default=10.0, metavar="s", help="duration (default 10)")
    command.add_argument(
        "--sample-interval", type=options.number, metavar="s", help="default: a thousandth of the duration"
    )
    command.add_argument("-o", "--output", type=Path, metavar="FILE", help="HDF5 file to write")
    options.outputs(command, shown="print the last state as JSON")

    command = options.command(commands, "sweep", grid, "many runs over ranges of parameters, resumable")
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
    """Simulate, keep what there is, and show it."""
    task = running.task(args, options.parameters(args), flow=running.flow(args), sample_interval=args.sample_interval)
    if args.output:
        check_writable(args.output)
    with tempfile.TemporaryDirectory() as scratch, interrupts() as interrupted:
        path = args.output or Path(scratch) / "run.h5"
        try:
            failure = store(task, path, stop=interrupted)
        except KeyboardInterrupt:  # the second Ctrl-C
            print("dualball: interrupted; no samples are kept", file=sys.stderr)
            return 130
        about = inspection.describe(failed_path(path) if failure else path)
        options.show(about, args.json, inspection.table(about))
        if args.output and not failure and not args.json:
            print(f"written to {args.output}")
        if failure:
            kept = "nothing is kept without --output"
            if args.output:
                kept, journal = f"its samples so far are kept in {failed_path(path)}", journal_path(task, path)
                if journal.exists():
                    kept += f", and the same command goes on from what {journal} holds"
            print(f"dualball: the simulation {failure}; {kept}", file=sys.stderr)
        return 130 if interrupted() else 1 if failure else 0


def grid(args: argparse.Namespace) -> int:
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
        options.show(summary | {"failures": campaign.listed(failures)}, args.json)
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
