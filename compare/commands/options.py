"""Command-line options that several commands share, and what they mean."""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn

from rich.console import Console

from compare.kit.pages import readable
from compare.kit.statistics import plain
from model import InputError, Parameters, drag
from model.parameters import ANY, NOT_NEGATIVE, Range

Commands = Any
"""What `argparse` calls the sub-parsers of a program."""


class Parser(argparse.ArgumentParser):
    """Raises `InputError`, one line, where argparse would print the usage and exit."""

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message}; see '{self.prog} --help'")


@dataclass(frozen=True)
class Number:
    """A number of the command line in its range, for argparse: an int if it must be whole."""

    unit: str = "1"
    allowed: Range = ANY

    def __call__(self, text: str) -> float:
        try:
            number = float(text)
        except ValueError as error:
            raise argparse.ArgumentTypeError(f"{text.strip()!r} is not a number") from error
        if not math.isfinite(number) or number not in self.allowed:
            said = f"{number:g} {readable(self.unit)}".rstrip()
            limits = "finite" if self.allowed == ANY else self.allowed
            raise argparse.ArgumentTypeError(f"{said} is out of range: it must be {limits}")
        return int(number) if self.allowed.whole else number

    @property
    def metavar(self) -> str:
        """What stands for it in help: its unit, or that it is a number."""
        return "N" if self.allowed.whole else readable(self.unit) or "NUMBER"


_LARGE = 2.0
"""Lengths of a meter, m, above which the user is asked whether millimetres were meant."""
number = Number()
count = Number(allowed=Range(1, 1e6, whole=True))
count_or_none = Number(allowed=Range(0, 1e6, whole=True))
seed = Number(allowed=Range(0, 2**32, whole=True))
seconds = Number("s", Range(1e-9, 1e9))
"""A duration, or a time step."""
moment = Number("s", NOT_NEGATIVE)


def written(text: str) -> Path:
    """A file to be written, for argparse; one that can't be written is refused before a long run, not after."""
    from model.files import check_writable  # here, because what only shows needs no HDF5

    try:
        check_writable(text)
    except InputError as error:
        raise argparse.ArgumentTypeError(str(error)) from error
    return Path(text)


def hdf5(text: str) -> Path:
    """The same of a file to be written as HDF5: other names would promise another format."""
    if Path(text).suffix not in (".h5", ".hdf5", ".nc"):
        raise argparse.ArgumentTypeError(f"{text!r} would hold HDF5: its name must end in .h5, .hdf5 or .nc")
    return written(text)


class _Help(argparse.HelpFormatter):
    """Help that says what kind of thing an option takes, and its default if it has one."""

    def _get_default_metavar_for_optional(self, action: argparse.Action) -> str:
        if isinstance(action.type, Number):
            return action.type.metavar
        return "FILE" if action.type in (Path, written, hdf5) else super()._get_default_metavar_for_optional(action)

    _get_default_metavar_for_positional = _get_default_metavar_for_optional

    def _get_help_string(self, action: argparse.Action) -> str | None:
        default, text = action.default, action.help or ""
        if default is None or default is False or default == [] or default == argparse.SUPPRESS or "default" in text:
            return text
        if not isinstance(default, Path):
            default = f"{default:g}" if isinstance(default, float) else getattr(default, "name", default)
        return f"{text} (default {default})"


def command(commands: Commands, name: str, run: Callable[[argparse.Namespace], int], example: str) -> Parser:
    """Declare a command; the example is what follows its name."""
    declared: Parser = commands.add_parser(name, epilog=f"Example: dualball {name} {example}", formatter_class=_Help)
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
        text = meta["meaning"] + f", {meta['allowed']}".replace(", any", "")
        parse = Number(meta["unit"], meta["allowed"])
        group.add_argument(option, dest=f"parameter_{field.name}", type=parse, help=text)
    group.add_argument("--drag", dest="parameter_drag", metavar="LAW", help=f"law of drag: {', '.join(drag.LAWS)}")


def parameters(args: argparse.Namespace) -> Parameters:
    """The parameters that the options of `add_parameters` name."""
    chosen = Parameters.load(args.parameters) if args.parameters else Parameters.named(args.set)
    p = chosen.replace(**given(args, [field.name for field in dataclasses.fields(Parameters)], "parameter_"))
    if max(p.r, p.R) > _LARGE:
        print(f"dualball: warning: r = {p.r:g} m, R = {p.R:g} m: were millimetres meant?", file=sys.stderr)
    return p


def given(args: argparse.Namespace, names: Iterable[str], prefix: str = "") -> dict[str, Any]:
    """The options of these names that were given, with their values."""
    values = {name: getattr(args, prefix + name) for name in names}
    return {name: value for name, value in values.items() if value is not None}
