"""Putting a wrong function in the place of a right one, wherever it is known, for as long as a
context lasts."""

import importlib
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from typing import Any

from analytic.simulation import compiling
from compare.plan import Level
from tests.by_scipy import runs_by_scipy

Function = Callable[..., Any]
Fault = Callable[..., Any]
"""Takes the right function, then what that takes, and gives its own answer."""
PACKAGES = ("analytic", "compare")
"""Where functions of the theory are known by name."""


@dataclass(frozen=True)
class WrongTheory:
    """A theory with one fault."""

    what: str
    """The fault, in words."""
    module: str
    function: str
    wrong: Fault
    level: Level = Level.QUICK
    """The least level whose measurements can show it."""
    test: str = ""
    """The unit test that sees it, where no measurement can."""


@contextmanager
def believed(*wrongs: WrongTheory) -> Iterator[None]:
    """Believe wrong theories: every name and table entry of a right function stands for the wrong
    one."""
    rights = [getattr(importlib.import_module(each.module), each.function) for each in wrongs]
    puts = [faulty(right, each.wrong) for each, right in zip(wrongs, rights, strict=True)]
    _exchange(dict(zip(map(id, rights), puts, strict=True)))
    # Compiled runs would believe what they believed when they were compiled.
    with runs_by_scipy() if compiling.called.intersection(rights) else nullcontext():
        try:
            yield
        finally:
            _exchange(dict(zip(map(id, puts), rights, strict=True)))


def faulty(right: Function, fault: Fault) -> Function:
    """The wrong function."""
    return lambda *args, **named: fault(right, *args, **named)


def _exchange(new: Mapping[int, Function]) -> None:
    """Put functions in the place of others, which are named by `id`."""
    for module in [module for name, module in sys.modules.items() if name.startswith(PACKAGES)]:
        for name, value in list(vars(module).items()):
            if id(value) in new:
                setattr(module, name, new[id(value)])
            elif isinstance(value, dict):
                value.update(
                    {key: new[id(entry)] for key, entry in value.items() if id(entry) in new}
                )


def noting(what: str, seen: set[str]) -> Fault:
    """No fault: where the function is called that is noted."""

    def noted(right: Function, *args: Any, **named: Any) -> Any:
        seen.add(what)
        return right(*args, **named)

    return noted
