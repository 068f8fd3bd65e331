"""Shell completion: ``dualball --print-completion bash`` prints the script that a shell needs; zsh, fish and tcsh, too.

The script is static, so that completing starts no Python.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import shtab

from compare.claims.catalogue import CLAIMS
from compare.runs.engines import ENGINES
from model import Parameters
from model.kinematics import VARIABLES

_PLACES = {"FILE": shtab.FILE, "FILE.xml": shtab.FILE, "DIR": shtab.DIRECTORY}
"""What an argument is completed with, by the name that its help gives its value."""


def add(parser: argparse.ArgumentParser) -> None:
    """Add ``--print-completion`` to the finished parser of a program with commands."""
    words = {
        "--set": Parameters.names(),
        "--engine": list(ENGINES),
        "--claim": [claim.id for claim in CLAIMS],
        "--start": [f"{name}=" for name in VARIABLES],
    }
    for action in _arguments(parser):
        known = next((words[option] for option in action.option_strings if option in words), None)
        if known:
            action.complete = shtab.cmd(rf"printf '%s\n' {' '.join(known)}")  # type: ignore[attr-defined]
        elif action.metavar in _PLACES:
            action.complete = _PLACES[action.metavar]  # type: ignore[attr-defined]
    shtab.add_argument_to(parser, help="print a script for completion in this shell")


def _arguments(parser: argparse.ArgumentParser) -> Iterator[argparse.Action]:
    """The arguments of a parser and of its commands."""
    for action in parser._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                yield from _arguments(command)
