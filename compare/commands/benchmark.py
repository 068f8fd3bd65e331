"""``dualball benchmark``: cost of the loop as ratios."""

from __future__ import annotations

import argparse
import dataclasses

from compare.commands import options
from compare.runs import benchmark
from compare.statistics import plain


def add(commands: options.Commands) -> None:
    """Declare the command."""
    command = options.command(
        commands, "benchmark", run, "cost of the loop round MuJoCo's step, as ratios within one run"
    )
    options.outputs(command)


def run(args: argparse.Namespace) -> int:
    """Measure and show."""
    figures = benchmark.run()
    options.show(plain(dataclasses.asdict(figures)), lambda _: benchmark.table(figures), args.json)
    return 0
