"""Command-line options that several commands share, and what they mean."""

from __future__ import annotations

import argparse
import dataclasses
import json
import math
import os
import re
import shutil
import sys
import traceback
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from compare.engines.adapters import STUDIED
from compare.figures.pages import readable
from model import InputError, Parameters, drag
from model.errors import suggestion
from model.files import check_writable
from model.parameters import ANY, NOT_NEGATIVE, Range

if TYPE_CHECKING:
    from rich.console import Console

Commands = Any
"""What `argparse` calls the sub-parsers of a program."""


class Parser(argparse.ArgumentParser):
    """Raises `InputError`, one line, where argparse would print the usage and exit, and for an
    output that is read.

    Options are written in full."""

    def __init__(self, **given: Any) -> None:
        super().__init__(allow_abbrev=False, **given)
        self.rules: list[tuple[str, str, bool]] = []
        """Options that mean nothing without another one, or (False) beside it."""

    def needs(self, option: str, other: str) -> None:
        """Refuse an option unless another one is there."""
        self.rules.append((option, other, True))

    def excludes(self, option: str, *others: str) -> None:
        """Refuse others beside an option, which would have no effect."""
        self.rules += [(other, option, False) for other in others]

    def error(self, message: str) -> NoReturn:
        raise InputError(f"{message}; see '{self.prog} --help'")

    def parse_known_args(  # type: ignore[override]
        self, *given: Any
    ) -> tuple[argparse.Namespace, list[str]]:
        """As argparse does, but for what that takes in silence, or tells of in other words."""
        self._refuse_one_dash(given[0])
        found, rest = super().parse_known_args(*given)
        self._refuse_what_is_left(rest)
        self._keep_rules(given[0])
        self._refuse_to_write_what_is_read(found)
        return found, rest

    def _refuse_one_dash(self, words: Iterable[str]) -> None:
        """One dash before a long name would be a short option and its value."""
        for word in words:
            option = word.partition("=")[0].replace("_", "-")
            if re.match("-[^-]", option) and f"-{option}" in self._option_string_actions:
                self.error(f"there is no option {option!r}: it is '-{option}'")

    def _refuse_what_is_left(self, rest: Iterable[str]) -> None:
        """Words that are neither options nor their values."""
        for word in rest:
            if word.startswith("-"):
                option = word.partition("=")[0]
                similar = suggestion(option, self._option_string_actions)
                self.error(f"there is no option {option!r}{similar}")
            self.error(f"{word!r} is one argument too many")

    def _keep_rules(self, words: Iterable[str]) -> None:
        """Options without those that they need, or beside those that they exclude."""
        known = self._option_string_actions
        names = (word.partition("=")[0] for word in words)
        there = {known[name].option_strings[-1] for name in names if name in known}
        for option, other, together in self.rules:
            if option in there and (other in there) != together:
                why = f"is for {other}" if together else f"has no effect beside {other}"
                self.error(f"{option} {why}")

    def _refuse_to_write_what_is_read(self, found: argparse.Namespace) -> None:
        """An output that another argument names, too, or that is a link to such a file."""
        for action in (each for each in self._actions if isinstance(each.type, Output)):
            output: Path | None = getattr(found, action.dest, None)
            others = (value for name, value in vars(found).items() if name != action.dest)
            for path in _named_files(others):
                with suppress(OSError):  # one doesn't exist, or can't be a name
                    if output and path.samefile(output):
                        named = "/".join(action.option_strings)
                        self.error(f"argument {named}: {str(output)!r} is read and would be lost")


def _named_files(values: Iterable[Any]) -> Iterator[Path]:
    """Files that arguments may name; one run of a batch is named like a file in it."""
    for value in values:
        if isinstance(value, list):
            yield from _named_files(value)
        elif isinstance(value, str | Path):
            yield from (Path(value), Path(value).parent)


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
            limits = ["finite"] * (not math.isfinite(number))
            limits += [str(self.allowed)] * (self.allowed != ANY)
            must = f"it must be {' and '.join(limits)}"
            raise argparse.ArgumentTypeError(f"{said} is out of range: {must}")
        return int(number) if self.allowed.whole else number

    @property
    def metavar(self) -> str:
        """What help shows in its place: its unit, or that it is a number."""
        return "N" if self.allowed.whole else readable(self.unit) or "NUMBER"


_LARGE = 2.0
"""Lengths of a meter, m, above which the user is asked whether millimetres were meant."""
number = Number()
count = Number(allowed=Range(1, 1e6, whole=True))
processes = Number(allowed=Range(0, 8 * (os.cpu_count() or 1), whole=True))
"""Of this machine, some 250 MB each: a slip of the finger would bring it down."""
seed = Number(allowed=Range(0, 2**32, whole=True))
seconds = Number("s", Range(1e-9, 1e9))
"""A duration, or a time step."""
moment = Number("s", NOT_NEGATIVE)
speed = Number(allowed=Range(1e-3, 1e3))
"""Of what is shown: times real time."""


@dataclass(frozen=True)
class Output:
    """A file to be written, for argparse: its name must promise what it holds.

    One that can't be written is refused before a long run, not after; so is one that is also read
    (`Parser`)."""

    what: str
    suffixes: tuple[str, ...]

    def __call__(self, text: str) -> Path:
        if Path(text).suffix.lower() not in self.suffixes:
            ends = " or ".join(filter(None, [", ".join(self.suffixes[:-1]), self.suffixes[-1]]))
            raise argparse.ArgumentTypeError(
                f"{text!r} would hold {self.what}: its name must end in {ends}"
            )
        try:
            check_writable(text)
        except InputError as error:
            raise argparse.ArgumentTypeError(str(error)) from error
        return Path(text)


HDF5 = Output("HDF5", (".h5", ".hdf5", ".nc"))
TABLE = Output("CSV", (".csv",))
DATA = Output("HDF5 or CSV", (*HDF5.suffixes, *TABLE.suffixes))
MARKDOWN = Output("Markdown", (".md",))
PAGE = Output("an HTML page", (".html", ".htm"))
FIGURE = Output("a figure", (".png", ".svg", ".pdf"))
MAP = Output("a map", (*FIGURE.suffixes, ".json"))
ENDINGS = {suffix for each in (HDF5, TABLE, MARKDOWN, PAGE, MAP) for suffix in each.suffixes}
"""Names of files end in these."""


def is_table(output: Path | None) -> bool:
    return output is not None and output.suffix.lower() in TABLE.suffixes


def results(text: str) -> Path:
    """The path of a directory to write to, for argparse; a name that ends like that of a file is
    refused."""
    if Path(text).suffix.lower() in ENDINGS and not Path(text).is_dir():
        raise argparse.ArgumentTypeError(
            f"{text!r} would be a directory, but its name is that of a file"
        )
    return Path(text)


def engine(name: str) -> Any:
    """An engine by its name, for argparse: one that can run here."""
    from compare.engines import study  # here, because help waits for none of them

    try:
        found = study.engine(name)
        found.check()
        return found
    except InputError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


FOREIGN = ", ".join(sorted(STUDIED))
"""Those that others have written, each as NAME and NAME-defaults."""
PREFIX = "parameter_"
"""How the destinations of options begin that are parameters of the ball."""


class Help(argparse.HelpFormatter):
    """Help that says what kind of thing an option takes, and its default if it has one."""

    def _get_default_metavar_for_optional(self, action: argparse.Action) -> str:
        if isinstance(action.type, Number):
            return action.type.metavar
        of_file = action.type is Path or isinstance(action.type, Output)
        return "FILE" if of_file else super()._get_default_metavar_for_optional(action)

    _get_default_metavar_for_positional = _get_default_metavar_for_optional

    def add_argument(self, action: argparse.Action) -> None:
        """As argparse, but for parameters of the ball, which `dualball parameters` lists for all
        commands."""
        if not action.dest.startswith(PREFIX):
            super().add_argument(action)

    def add_usage(self, usage: str | None, actions: Iterable[argparse.Action], *more: Any) -> None:
        super().add_usage(
            usage, [each for each in actions if not each.dest.startswith(PREFIX)], *more
        )

    def _get_help_string(self, action: argparse.Action) -> str | None:
        default, text = action.default, action.help or ""
        none = default is None or default is False or default in ([], argparse.SUPPRESS)
        if none or "default" in text:
            return text
        return f"{text} (default {f'{default:g}' if isinstance(default, float) else default})"


def warn(said: str) -> None:
    print(f"dualball: warning: {said}", file=sys.stderr)


def warn_of_model(*sets: Parameters) -> None:
    """Warn where the paper's model leaves out too much of a fluid that is known."""
    from analytic.flowmeter import real_fluid  # here, because help needs none of it
    from compare.figures.validity import model_warning

    for doubt in model_warning(max(map(real_fluid.model_error, sets), default=0.0)):
        warn(doubt.removeprefix("Warning: "))


def own_set(args: argparse.Namespace) -> dict[str, Parameters]:
    """The parameter set that --set or --parameters names, by its name; {} if neither is given."""
    if args.parameters:
        return {args.parameters.stem: Parameters.load(args.parameters)}
    return {args.set: Parameters.named(args.set)} if args.set else {}


NOTES = {"sweep.json", "summary.json"}
"""Files that say what a directory is to hold: alone they are worth nothing."""


@contextmanager
def nothing_left(args: argparse.Namespace) -> Iterator[None]:
    """A context after which, if a command failed, what it made for its output is removed in a
    directory that was empty or wasn't there: empty directories, notes with nothing beside them, and
    after a mistake all of what the same command wouldn't go on from."""
    output: Path | None = getattr(args, "output", None)
    new = [each for each in (output, *output.parents) if not each.exists()] if output else []
    filled = output is None or output.is_file() or (output.is_dir() and any(output.iterdir()))
    with Path(os.devnull).open() as spare:  # a handle to look at the end with
        try:
            yield
        except BaseException as error:
            traceback.clear_frames(error.__traceback__)  # which may hold all other handles
            spare.close()
            inner = sorted(output.rglob("*"), reverse=True) if output and not filled else []
            files = [each for each in inner if not each.is_dir()]
            mistake = isinstance(error, OSError | InputError) and not args.resumes
            if mistake or {each.name for each in files} <= NOTES:
                for each in files:
                    each.unlink()
            for each in [*inner, *new]:
                with suppress(OSError):  # it holds something, or was never made
                    each.rmdir()
            raise


NARROWEST = 40
"""Columns of a terminal below which text isn't broken further."""


def terminal(**look: Any) -> Console:
    """A console of rich that is wide enough for any table off a terminal, and lets a broken pipe be
    an error."""
    from rich.console import Console  # here, because help needs none

    class Terminal(Console):
        def on_broken_pipe(self) -> NoReturn:
            raise BrokenPipeError

    unknown = 80 if sys.stdout.isatty() else 1000
    width = max(shutil.get_terminal_size((unknown, 24)).columns, NARROWEST)
    # rich would colour what looks like a path or a number, in two
    return Terminal(**{"width": width, "highlight": False} | look)


def show(data: Any, as_json: bool, *shown: Any) -> None:
    """Print data as JSON, numbers that are not finite as null; or what is shown of it, tables and
    lines."""
    if as_json:
        from compare.method.statistics import plain  # here, because help needs no arrays

        print(json.dumps(plain(data), indent=1))
        return
    console = terminal(markup=False)
    if sys.stdout.isatty():
        console.print(*shown, sep="\n", crop=False)
        return
    with console.capture() as text:  # tables are filled up with blanks, which no file needs
        console.print(*shown, sep="\n", crop=False)
    print("\n".join(line.rstrip() for line in text.get().splitlines()))


def add_own_set(parser: Parser, which: str = "instead of many") -> None:
    """Options for a parameter set: one of the study by its name, or a file of one's own."""
    own = parser.add_mutually_exclusive_group()
    named = f"one set, {which}: {', '.join(Parameters.names())}"
    own.add_argument("--set", metavar="NAME", help=named)
    own.add_argument("--parameters", type=Path, help=f"your own set, a TOML file, {which}")


def add_axes(
    parser: Parser, option: str, meaning: str, form: str = "NAME=FROM:TO:COUNT", **more: Any
) -> None:
    """An option for ranges or lists of values (`sweep.Axis`), to be given once or more often."""
    more = {"default": []} | more
    parser.add_argument(option, action="append", metavar=form, help=meaning, **more)


def add_directory(parser: Parser, directory: str, *names: str) -> None:
    """Options of all commands that fill a directory: its name, and whether to show progress."""
    where = "directory of the results"
    if parser.get_default("resumes"):
        where += "; what it holds already is not computed again"
    look: dict[str, Any] = {"default": Path(directory), "metavar": "DIR", "help": where}
    parser.add_argument(*names or ("-o", "--output"), dest="output", type=results, **look)
    parser.add_argument("--quiet", action="store_true", help="no progress")


def add_json(parser: Parser, shown: str = "print JSON") -> None:
    parser.add_argument("--json", action="store_true", help=shown)


def add_engine(parser: Parser, default: str = "mujoco") -> None:
    group = parser.add_argument_group("engine")
    add_engine_name(group, default, f"default {default}")
    group.add_argument(
        "--timestep", type=seconds, help="time step (default: the engine's; event has none)"
    )
    group.add_argument("--rtol", type=number, help="relative tolerance of event (default 1e-9)")
    restitution = "coefficient of restitution of event and time-stepping (default 0)"
    group.add_argument("--restitution", type=number, help=restitution)


def add_engine_name(parser: argparse._ActionsContainer, default: str | None, usual: str) -> None:
    """The option that chooses an engine; `usual` says what is if none is named."""
    known = (
        "mujoco is under Coulomb's law, mujoco-plain isn't, mujoco-defaults is MuJoCo as it comes; "
        "others: mujoco-free, event, time-stepping, siconos, and NAME or NAME-defaults of "
        f"{FOREIGN} ({usual})"
    )
    parser.add_argument("--engine", type=engine, default=default, metavar="NAME", help=known)


def add_workers(parser: Parser) -> None:
    """Options that say where runs are carried out, of commands that go on where they were
    stopped."""
    parser.set_defaults(resumes=True)
    group = parser.add_argument_group("workers")
    choice = group.add_mutually_exclusive_group()
    add_processes(choice)
    choice.add_argument(
        "--scheduler", metavar="ADDRESS", help="a Dask scheduler, as tcp://host:8786"
    )
    longest = "longest real time a run may take (default: no limit)"
    group.add_argument("--limit", type=seconds, default=math.inf, help=longest)


def add_processes(parser: Any) -> None:
    """The option that says how many processes of this machine take part, for a parser or a group of
    one."""
    here, all_of_them = "processes of this machine; 0: this one", os.cpu_count() or 1
    parser.add_argument("--workers", type=processes, default=all_of_them, help=here)


def add_samples(parser: Parser) -> None:
    between = "time between samples (default: duration/1000)"
    parser.add_argument("--sample-interval", type=seconds, help=between)


def add_start(parser: Parser) -> None:
    from model.kinematics import UNITS, VARIABLES  # here, because it loads numpy

    units = ", ".join(f"{name} in {unit}" for name, unit in zip(VARIABLES, UNITS, strict=True))
    meaning = f"initial state: {units}; zero (at rest against the wall) where not named"
    parser.add_argument("--start", nargs="+", default=[], metavar="NAME=VALUE", help=meaning)


def add_plot(parser: Parser, what: str) -> None:
    parser.add_argument(
        "--plot", type=FIGURE, help=f"draw {what}: png, svg or pdf (default: don't)"
    )


def add_verdicts(parser: Parser) -> None:
    one = "only this claim; may be repeated (default: all)"
    parser.add_argument("--claim", action="append", metavar="ID", help=one)
    parser.add_argument("--verbose", action="store_true", help="list every number of each claim")
    add_json(parser, "print the verdicts as JSON")


def add_parameters(parser: argparse.ArgumentParser) -> None:
    """Options that choose a parameter set and change some of its values."""
    what = (
        "a set, and values that replace its own, as --mu 0.3 --omega-0 25: 'dualball parameters' "
        "tells of each"
    )
    group = parser.add_argument_group("parameters", what)
    source = group.add_mutually_exclusive_group()
    source.add_argument(
        "--set", metavar="NAME", default="reference", help=f"one of {', '.join(Parameters.names())}"
    )
    source.add_argument(
        "--parameters", metavar="FILE", help="TOML file with all of them, or with a [fluid] table"
    )
    for field in Parameters.quantities():
        meta, option = field.metadata, f"--{field.name.replace('_', '-')}"
        text = meta["meaning"] + f", {meta['allowed']}".replace(", any", "")
        parse = Number(meta["unit"], meta["allowed"])
        group.add_argument(option, dest=f"{PREFIX}{field.name}", type=parse, help=text)
    group.add_argument(
        "--drag", dest=f"{PREFIX}drag", metavar="LAW", help=f"law of drag: {', '.join(drag.LAWS)}"
    )


def parameters(args: argparse.Namespace) -> Parameters:
    """The parameters that the options of `add_parameters` name; `InputError` for one that
    ``--vary`` replaces."""
    for name in (text.partition("=")[0] for text in getattr(args, "vary", ())):
        if getattr(args, f"{PREFIX}{name}", None) is not None:
            raise InputError(f"--{name.replace('_', '-')} has no effect: {name} is varied")
    chosen = Parameters.load(args.parameters) if args.parameters else Parameters.named(args.set)
    p = chosen.replace(
        **given_options(args, [field.name for field in dataclasses.fields(Parameters)], PREFIX)
    )
    if max(p.r, p.R) > _LARGE:
        warn(f"r = {p.r:g} m, R = {p.R:g} m: were millimetres meant?")
    return p


def given_options(
    args: argparse.Namespace, names: Iterable[str], prefix: str = ""
) -> dict[str, Any]:
    values = {name: getattr(args, prefix + name) for name in names}
    return {name: value for name, value in values.items() if value is not None}
