"""``dualball grade``: a score card for a person's own contact settings."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from rich.console import Console

from compare.commands import options
from compare.runs import progress
from model.files import check_writable, write_text


def add(commands: options.Commands) -> None:
    """Declare the command."""
    command = options.command(
        commands, "grade", run, "a score card for MuJoCo contact settings: yours, dualball's, MuJoCo's own"
    )
    options.add_native(command)
    command.add_argument("-o", "--output", type=Path, metavar="FILE", help="HTML page to write")
    command.add_argument("--json", action="store_true", help="print JSON")


def run(args: argparse.Namespace) -> int:
    """Grade the settings and show the card."""
    from compare.scorecard import card, grade  # here, because nothing else needs it

    if args.output:
        check_writable(args.output)
    yours = options.native(args)
    if yours.note:
        print(f"dualball: {yours.note}", file=sys.stderr)
    with progress.shown(quiet=args.json) as show:
        columns = grade.grade(yours, progress=lambda name, done, total: show(f"grade {name}", done, total, 0))
    if args.output:
        described = f"{options.describe_native(args)} {yours.note}".rstrip()
        write_text(args.output, card.html(columns, described))
    if args.json:
        print(json.dumps([column.to_mapping() for column in columns], indent=1))
        return 0
    console = Console()
    console.print(card.table(columns))
    for item in columns[0].advice:
        console.print(f"• {item}", markup=False, highlight=False)
    return 0
