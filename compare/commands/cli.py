"""The program ``dualball``: one command line for everything, one module a command.

Exit codes: 0 done and as expected, 1 a verdict failed, a run broke down or a design doesn't reach its fastest flow,
2 a mistake in what was asked, 130 interrupted by Ctrl-C, 143 by SIGTERM.
"""

from __future__ import annotations

import argparse
import codecs
import gc
import importlib
import io
import os
import re
import sys
import textwrap
from collections.abc import Sequence
from typing import NoReturn

from compare.commands import options, signals
from compare.kit import pages
from model import InputError, SimulationError
from model.errors import suggestion
from model.files import leave
from model.versions import version

GROUPS: dict[str, dict[str, tuple[str, str]]] = {
    "study": {
        "validate": ("validate", "hold simulation against theory, claim by claim; the main job"),
        "judge": ("validate", "judge the stored measurements of a validation again and write report.html anew"),
        "figures": ("look", "draw the paper's figures, with measured points where there are results"),
    },
    "the ball": {
        "parameters": ("predict", "the parameters of the ball that commands take, their units and ranges; the sets"),
        "predict": ("predict", "stationary solutions, thresholds and operating range, from theory"),
        "simulate": ("simulate", "one run with any engine, into an HDF5 file"),
        "inspect": ("look", "what a trajectory file holds"),
        "compare": ("look", "two motions side by side: differences, cases, parameters"),
        "sweep": ("simulate", "many runs over ranges of parameters, resumable"),
        "collect": ("simulate", "gather the runs of a directory into one file for xarray"),
        "attractors": ("attractors", "what balls come to from many starts: stationary, periodic, chaotic motions"),
        "basins": ("attractors", "what becomes of the ball from each start of a plane of states, resumable"),
        "design": ("design", "the best meter for a fluid and a range of flows, within bounds"),
        "render": ("look", "a picture or film of a run: the scene, contact forces, slip, case"),
        "explore": ("look", "a page on this machine to play with: theory as sliders move, the motion in 3-D"),
    },
    "contacts and engines": {
        "forecast": ("bench", "what the contacts of a MuJoCo model will do: depth, creep, hovering, largest step"),
        "cases": ("cases", "the exact contact cases: listed, shown, or as files for engines in any language"),
        "league": ("bench", "all installed engines on the exact cases, as they come and in the best settings known"),
    },
}
"""The commands, as help groups them: the module of each, loaded for nothing else, and what it is for."""
MOVED = {
    "compare -o": "--plot",
    "compare --output": "--plot",
    "attractors --page": "-o",
    "attractors --starts": "--random",
    "basins --save": "-o",
    "sweep --hold": "--time",
    "render --from": "--at",
    "render --seconds": "--time",
    "render --force-arrow": "--arrows FORCE SLIP",
    "render --slip-arrow": "--arrows FORCE SLIP",
}
"""Options of earlier versions by command, and what they are called now."""
GONE = {
    "report": "'dualball judge' writes report.html anew, too",
    "search": "it is 'python -m docs.studies.search' in a clone",
    "view": "'dualball simulate --view' opens the viewer, 'dualball explore' a page with the motion in 3-D",
    "grade": "'dualball league --settings FILE.xml' puts settings on the exact cases, 'dualball forecast' any model",
}
"""Commands of earlier versions, and what to use now."""


def program() -> NoReturn:
    """This process as the program: ends with the exit code, and at once for a second signal.

    What standard output can't show in its encoding is spelled.
    """
    codecs.register_error("spelled", pages.spelled)
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="spelled")
    os.environ["MPLBACKEND"] = "agg"  # figures go into files: that of a notebook would be looked for here, too
    if not {"render", "--view"} & {*sys.argv}:  # MuJoCo would load a window library, by way of a Python of its own
        os.environ.setdefault("MUJOCO_GL", "disable")
    with signals.answered(signals.end):
        try:
            code = main()
        except SystemExit as done:  # as of --help
            code = int(done.code or 0)
        code = _flushed(code)
        if code >= 128:  # threads may still be at what nobody wants any more
            gc.collect()  # lets go of what workers shared
            leave(code)
    sys.exit(code)


def _flushed(code: int) -> int:
    """The exit code, once what was printed has arrived, or if nobody wants to read it, as with `| head`."""
    try:
        sys.stdout.flush()
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        if code == 0 and not isinstance(error, BrokenPipeError):
            print(f"dualball: error: cannot write to standard output: {error.strerror}", file=sys.stderr)
            return 2
    return code


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program with the given arguments, the process's own for None; return its exit code."""
    args = argparse.Namespace(resumes=False)
    try:
        return _run(sys.argv[1:] if argv is None else argv, args)
    except InputError as error:
        print(f"dualball: error: {error}", file=sys.stderr)
        return 2
    except SimulationError as error:
        print(f"dualball: {error}", file=sys.stderr)
        return 1
    except BrokenPipeError:  # `_flushed` sees to it
        return 0
    except OSError as error:  # the machine can't do it: of what a user named `StorageError` tells
        where = f"{error.filename}: " if error.filename else ""
        print(f"dualball: error: {where}{error.strerror or error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt as error:
        there = args.resumes and args.output.is_dir()
        kept = f"; what is done is kept in {args.output}, the same command goes on from there" if there else ""
        print(f"dualball: interrupted{kept}", file=sys.stderr)
        return error.code if isinstance(error, signals.Interrupted) else 130


def _run(argv: Sequence[str], args: argparse.Namespace) -> int:
    """Carry out a command, whose arguments are added to `args`."""
    # argparse takes -1e-6 and -inf for options, unlike -1: a space in front makes values of them.
    words = [re.sub(r"^-(?=\.?\d|inf|nan)", " -", word) for word in argv]
    words = [re.sub(r"^--[\w-]+", lambda option: option[0].replace("_", "-"), word) for word in words]
    words = words or ["--help"]
    _parser(words).parse_args(words, args)
    args.words = ["dualball", *(word.strip() for word in words)]  # a page says with what it was written
    with options.no_empty_directories(args), signals.raised():
        return int(args.run(args))


def _parser(words: Sequence[str]) -> options.Parser:
    """The parser of the command that was asked for, or of their names."""
    parser = options.Parser(
        prog="dualball",
        usage="dualball [-h] [--version] COMMAND ...",
        description="A physics engine on trial: the dual-point contact ball, in closed form and in MuJoCo.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"dualball {version('dualball')}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True, prog="dualball", help=argparse.SUPPRESS)
    known = {name: about for group in GROUPS.values() for name, about in group.items()}
    if words[0] == "--print-completion":
        _complete(parser, commands, words[1:])
    for old in (f"{words[0]} {word.partition('=')[0]}" for word in words):
        if old in MOVED:
            raise InputError(f"{old} is {MOVED[old]} now")
    if words[0] in known:
        module, what = known[words[0]]
        importlib.import_module(f"compare.commands.{module}").add(commands)
        commands.choices[words[0]].description = what
        return parser
    if words[0] in GONE:
        raise InputError(f"there is no command {words[0]!r} any more: {GONE[words[0]]}")
    if not words[0].startswith("-"):
        raise InputError(f"there is no command {words[0]!r}{suggestion(words[0], known)}; see 'dualball --help'")
    if words[0] not in ("-h", "--help", "--version"):
        raise InputError(f"there is no option {words[0]!r}{suggestion(words[0], ['--help', '--version'])}")
    listed = []
    for title, group in GROUPS.items():
        listed.append(f"\n{title.capitalize()}:")
        for name, (_, what) in group.items():
            commands.add_parser(name)
            listed.append(textwrap.fill(what, 100, initial_indent=f"  {name:<12}", subsequent_indent=" " * 14))
    parser.add_argument(
        "--print-completion", metavar="SHELL", help="print what bash, zsh, fish or tcsh complete words by"
    )
    parser.epilog = "\n".join([*listed, "\n'dualball COMMAND --help' says more."]).lstrip("\n")
    return parser


def _complete(parser: options.Parser, commands: options.Commands, shell: Sequence[str]) -> NoReturn:
    """Print what a shell completes commands, options and files by, and end."""
    try:
        import shtab  # here, because it is optional
    except ImportError as error:
        raise InputError("--print-completion needs shtab: pip install 'dualball[completion]'") from error
    if tuple(shell) not in {(each,) for each in shtab.SUPPORTED_SHELLS}:
        raise InputError(f"--print-completion takes one of {', '.join(shtab.SUPPORTED_SHELLS)}")
    for module in dict.fromkeys(module for group in GROUPS.values() for module, _ in group.values()):
        importlib.import_module(f"compare.commands.{module}").add(commands)
    commands.help = "a command"  # what has no help isn't completed
    print(shtab.complete(parser, shell[0]))
    raise SystemExit(0)
