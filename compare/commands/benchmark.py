"""``dualball benchmark``: cost of the loop as ratios."""

from __future__ import annotations

import argparse

from compare.commands import options
from compare.runs import benchmark


def add(commands: options.Commands) -> None:
    """Declare the command."""
    command = options.command(
        commands, "benchmark", run, "cost of the loop round MuJoCo's step, as ratios within one run"
    )
    command.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Measure and show."""
    figures = benchmark.run()
    options.show(figures.to_mapping(), lambda _: benchmark.table(figures), args.json)
    return 0
