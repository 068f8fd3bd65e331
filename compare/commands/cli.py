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
from collections.abc import Sequence

from model import InputError, SimulationError
from model.trajectory import current_versions


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program with the given arguments, the process's own for None; return its exit code."""
    # argparse takes -1e-6 and -inf for options, unlike -1: a space in front makes values of them.
    words = [re.sub(r"^-(?=\.?\d|inf|nan)", " -", word) for word in (sys.argv[1:] if argv is None else argv)]
    args = _parser(words).parse_args(words)
    try:
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


_MODULES = {
    "predict": ("predict",),
    "design": ("design",),
    "simulate": ("simulate",),
    "validate": ("validate", "judge"),
    "sweep": ("sweep", "collect"),
    "attractors": ("attractors",),
    "search": ("search", "basins"),
    "look": ("report", "figures", "inspect", "render", "view"),
    "grade": ("grade",),
    "league": ("league",),
}
"""The commands in each module of this package: `predict` doesn't wait for the engines and figures of the others."""


def _parser(words: Sequence[str]) -> argparse.ArgumentParser:
    """The parser of the command that was asked for, or of all of them."""
    parser = argparse.ArgumentParser(
        prog="dualball",
        description="A physics engine on trial: the dual-point contact ball, in closed form and in MuJoCo.",
    )
    parser.add_argument("--version", action="version", version=f"dualball {current_versions()['dualball']}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)
    asked = [module for module, names in _MODULES.items() if words[0:1] and words[0] in names]
    for module in asked or _MODULES:
        importlib.import_module(f"compare.commands.{module}").add(commands)
    return parser


if __name__ == "__main__":
    sys.exit(main())
