"""``dualball simulate``: one run with any engine."""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from compare.commands import options, running
from compare.kit.tasks import failed_path, journal_path, store
from compare.kit.workers import interrupts
from compare.view import inspection
from model.files import check_writable


def add(commands: options.Commands) -> None:
    """Declare the command."""
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
