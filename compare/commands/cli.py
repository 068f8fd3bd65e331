"""The program ``dualball``: one command line for everything, one module a command.

Exit codes: 0 done and as expected, 1 a verdict failed, a run broke down or a design doesn't reach its fastest flow,
2 a mistake in what was asked, 130 interrupted.
"""

from __future__ import annotations

import argparse
import importlib
import os
import re
import sys
import textwrap
from collections.abc import Sequence

from compare.commands import options
from model import InputError, SimulationError
from model.trajectory import current_versions

GROUPS = {
    "study": {"validate": "validate", "judge": "validate", "report": "look", "figures": "look"},
    "the ball": {
        **{"predict": "predict", "simulate": "simulate", "inspect": "look", "compare": "look"},
        **{"sweep": "simulate", "collect": "simulate"},
        **{"attractors": "attractors", "basins": "attractors", "search": "attractors", "design": "design"},
        **{"render": "look", "view": "look"},
    },
    "contacts and engines": {"forecast": "forecast", "grade": "bench", "cases": "bench", "league": "bench"},
}
"""The commands, as help groups them, and the module of each: `predict` doesn't wait for the engines of the others."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program with the given arguments, the process's own for None; return its exit code."""
    # argparse takes -1e-6 and -inf for options, unlike -1: a space in front makes values of them.
    words = [re.sub(r"^-(?=\.?\d|inf|nan)", " -", word) for word in (sys.argv[1:] if argv is None else argv)]
    try:
        args = _parser(words).parse_args(words)
        args.words = ["dualball", *(word.strip() for word in words)]  # a page says with what it was written
        return int(args.run(args))
    except InputError as error:
        print(f"dualball: error: {error}", file=sys.stderr)
        return 2
    except SimulationError as error:
        print(f"dualball: {error}", file=sys.stderr)
        return 1
    except BrokenPipeError:  # the reader of our output has gone, as `| head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except KeyboardInterrupt:
        print("dualball: interrupted; finished runs are kept, the same command goes on from there", file=sys.stderr)
        return 130


def _parser(words: Sequence[str]) -> options.Parser:
    """The parser of the command that was asked for, or of all of them."""
    parser = options.Parser(
        prog="dualball",
        usage="dualball [-h] [--version] COMMAND ...",
        description="A physics engine on trial: the dual-point contact ball, in closed form and in MuJoCo.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"dualball {current_versions()['dualball']}")
    commands = parser.add_subparsers(metavar="COMMAND", required=True, prog="dualball", help=argparse.SUPPRESS)
    known = {name: module for group in GROUPS.values() for name, module in group.items()}
    asked = known.get(words[0]) if words else None
    for module in [asked] if asked else dict.fromkeys(known.values()):
        importlib.import_module(f"compare.commands.{module}").add(commands)
    if not asked:
        listed = []
        for title, group in GROUPS.items():
            listed.append(f"\n{title.capitalize()}:")
            for name in group:
                what, indent = commands.choices[name].description or "", " " * 14
                listed.append(textwrap.fill(what, 100, initial_indent=f"  {name:<12}", subsequent_indent=indent))
        parser.epilog = "\n".join([*listed, "\n'dualball COMMAND --help' says more."]).lstrip("\n")
    return parser


if __name__ == "__main__":
    sys.exit(main())
