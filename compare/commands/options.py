"""Command-line options that several commands share, and what they mean."""

from __future__ import annotations

import argparse
import dataclasses
import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from rich.console import Console

from compare.kit.pages import readable
from compare.kit.statistics import plain
from model import Parameters, drag

Parser = argparse.ArgumentParser
Commands = Any
"""What `argparse` calls the sub-parsers of a program."""


class _Help(argparse.HelpFormatter):
    """Help that says the default of each option that has one."""

    def _get_help_string(self, action: argparse.Action) -> str | None:
        default, text = action.default, action.help or ""
        if default is None or default is False or default == [] or default == argparse.SUPPRESS or "default" in text:
            return text
        if not isinstance(default, Path):
            default = f"{default:g}" if isinstance(default, float) else getattr(default, "name", default)
        return f"{text} (default {default})"


def command(
    commands: Commands, name: str, run: Callable[[argparse.Namespace], int], summary: str, example: str = ""
) -> Parser:
    """Declare a command; the example is what follows its name."""
    epilog = f"Example: dualball {name} {example}" if example else None
    declared: Parser = commands.add_parser(name, description=summary, epilog=epilog, formatter_class=_Help)
    declared.set_defaults(run=run)
    return declared


def add_axes(parser: Parser, option: str, meaning: str, form: str = "NAME=FROM:TO:COUNT", **more: Any) -> None:
    """An option, to be given once or more often, for `compare.kit.sweep.Axis`."""
    parser.add_argument(option, action="append", metavar=form, help=meaning, **{"default": [], **more})


def outputs(parser: Parser, directory: str = "", shown: str = "print JSON") -> None:
    """``--json``; and what all commands have that fill a directory: its name, workers' progress or none."""
    if directory:
        where = "directory of the results; what it holds already is not computed again"
        parser.add_argument("-o", "--output", type=Path, default=Path(directory), metavar="DIR", help=where)
        parser.add_argument("--quiet", action="store_true", help="no progress")
    parser.add_argument("--json", action="store_true", help=shown)


def show(data: Any, as_json: bool, *shown: Any) -> None:
    """Print data as JSON, numbers that are not finite as null; or what is shown of it, tables and lines."""
    if as_json:
        print(json.dumps(plain(data), indent=1))
    else:
        Console(markup=False).print(*shown, sep="\n")


def add_parameters(parser: argparse.ArgumentParser) -> None:
    """Options that choose a parameter set and change some of its values."""
    group = parser.add_argument_group("parameters", "a set, and values that replace its own")
    source = group.add_mutually_exclusive_group()
    source.add_argument("--set", metavar="NAME", default="reference", help=f"one of {', '.join(Parameters.names())}")
    source.add_argument("--parameters", metavar="FILE", help="TOML file with all of them, or with a [fluid] table")
    for field in Parameters.quantities():
        meta, option = field.metadata, f"--{field.name.replace('_', '-')}"
        unit, allowed = readable(meta["unit"]) or "NUMBER", f", {meta['allowed']}".replace(", any", "")
        group.add_argument(
            option, dest=f"parameter_{field.name}", metavar=unit, type=number, help=meta["meaning"] + allowed
        )
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
