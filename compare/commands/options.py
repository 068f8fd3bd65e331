"""Command-line options that several commands share, and what they mean."""

from __future__ import annotations

import argparse
import dataclasses
import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from rich.console import Console

from model import Parameters, drag

Parser = argparse.ArgumentParser
Commands = Any
"""What `argparse` calls the sub-parsers of a program."""


def command(commands: Commands, name: str, run: Callable[[argparse.Namespace], int], summary: str) -> Parser:
    """Declare a command."""
    declared: Parser = commands.add_parser(name, help=summary, description=summary)
    declared.set_defaults(run=run)
    return declared


def add_axes(parser: Parser, option: str, meaning: str, form: str = "NAME=FROM:TO:COUNT", **more: Any) -> None:
    """An option, to be given once or more often, for `compare.runs.sweep.Axis`."""
    parser.add_argument(option, action="append", metavar=form, help=meaning, **{"default": [], **more})


def outputs(parser: Parser, directory: str = "", shown: str = "print JSON") -> None:
    """``--json``; and what all commands have that fill a directory: its name, workers' progress or none."""
    if directory:
        parser.add_argument("-o", "--output", type=Path, default=Path(directory), metavar="DIR")
        parser.add_argument("--quiet", action="store_true", help="no progress")
    parser.add_argument("--json", action="store_true", help=shown)


def show(data: dict[str, Any], table: Callable[[dict[str, Any]], Any], as_json: bool) -> None:
    """Print data as JSON or as a table."""
    if as_json:
        print(json.dumps(data, indent=1))
    else:
        Console().print(table(data))


def add_parameters(parser: argparse.ArgumentParser) -> None:
    """Options that choose a parameter set and change some of its values."""
    group = parser.add_argument_group("parameters")
    source = group.add_mutually_exclusive_group()
    source.add_argument("--set", metavar="NAME", default="reference", help=f"one of {', '.join(Parameters.names())}")
    source.add_argument("--parameters", metavar="FILE", help="TOML file with all of them, or with a [fluid] table")
    for field in Parameters.quantities():
        option, meaning = f"--{field.name.replace('_', '-')}", "{meaning} ({allowed})".format_map(field.metadata)
        dest, unit = f"parameter_{field.name}", field.metadata["unit"]
        group.add_argument(option, dest=dest, metavar=unit, type=number, help=meaning)
    group.add_argument("--drag", dest="parameter_drag", metavar="LAW", help=f"law of drag: {', '.join(drag.LAWS)}")


def parameters(args: argparse.Namespace) -> Parameters:
    """The parameters that the options of `add_parameters` name."""
    chosen = Parameters.load(args.parameters) if args.parameters else Parameters.named(args.set)
    return chosen.replace(**given(args, [field.name for field in dataclasses.fields(Parameters)], "parameter_"))


def given(args: argparse.Namespace, names: Iterable[str], prefix: str = "") -> dict[str, Any]:
    """The options of these names that were given, with their values."""
    values = {name: getattr(args, prefix + name) for name in names}
    return {name: value for name, value in values.items() if value is not None}


def number(text: str) -> float:
    """A number of the command line, for argparse."""
    try:
        return float(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"{text!r} is not a number") from error
