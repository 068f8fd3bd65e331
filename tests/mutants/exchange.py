"""Putting a wrong function in the place of a right one, wherever it is known, for as long as a context lasts.

Most faults change the answer of the right function, or the parameters of the ball it is given.
"""

from __future__ import annotations

import functools
import importlib
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from typing import Any
from unittest import mock

import numpy as np

from analytic.mechanics.drag import Law
from analytic.simulation import hybrid
from analytic.simulation.equations import Motion
from compare.kit.levels import Level
from model import Case, Parameters

Function = Callable[..., Any]
Fault = Callable[..., Any]
"""Takes the right function, then what that takes, and gives its own answer."""
Change = Callable[[Any], Any]
PACKAGES = ("analytic", "compare")
"""Where functions of the theory are known by name."""
COMPILED = "analytic.mechanics", "analytic.simulation"
"""Those of which compiled runs are made."""


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
    """Believe wrong theories: every name and table entry of a right function stands for the wrong one."""
    rights = [getattr(importlib.import_module(each.module), each.function) for each in wrongs]
    puts = [_with(right, each.wrong) for each, right in zip(wrongs, rights, strict=True)]
    _exchange(dict(zip(map(id, rights), puts, strict=True)))
    plainly = mock.patch.object(hybrid, "run_compiled", hybrid.run_through_flow)
    # Compiled runs would believe what they believed when they were compiled.
    with plainly if any(each.module.startswith(COMPILED) for each in wrongs) else nullcontext():
        try:
            yield
        finally:
            _exchange(dict(zip(map(id, puts), rights, strict=True)))


def _with(right: Function, fault: Fault) -> Function:
    """The wrong function."""
    return lambda *args, **named: fault(right, *args, **named)


def _exchange(new: Mapping[int, Function]) -> None:
    """Put functions in the place of others, which are named by `id`."""
    for module in [module for name, module in sys.modules.items() if name.startswith(PACKAGES)]:
        for name, value in list(vars(module).items()):
            if id(value) in new:
                setattr(module, name, new[id(value)])
            elif isinstance(value, dict):
                value.update({key: new[id(entry)] for key, entry in value.items() if id(entry) in new})


def noting(what: str, seen: set[str]) -> Fault:
    """No fault: where the function is called that is noted."""

    def noted(right: Function, *args: Any, **named: Any) -> Any:
        seen.add(what)
        return right(*args, **named)

    return noted


def answer(change: Change) -> Fault:
    """Its answer is changed."""
    return lambda right, *args, **named: change(right(*args, **named))


def scaled(factor: float, *entries: int) -> Fault:
    """Its answer is `factor` times too large: all of it, or these entries."""
    return answer(times(factor, *entries))


def of_case(case: Case | None, change: Change) -> Fault:
    """Of its list of solutions those of a case are changed, all for None."""
    return answer(lambda solutions: [change(s) if case in (None, s.case) else s for s in solutions])


def without(case: Case) -> Fault:
    """Its list of solutions lacks a case."""
    return answer(lambda solutions: [s for s in solutions if s.case is not case])


Ball = Parameters | Motion
"""The parameters of a ball, as they are given or as plain numbers."""


def given(change: Change) -> Fault:
    """It takes other parameters for those of the ball."""
    change = functools.lru_cache(change)
    return lambda right, *args, **named: right(*(change(a) if isinstance(a, Ball) else a for a in args), **named)


def replaced(p: Ball, **values: Any) -> Ball:
    """The parameters with some of them changed."""
    if isinstance(p, Parameters):
        return p.replace(**values)
    law = Law(*(term * (values.get("c", p.c) / p.c if p.c else 1.0) for term in p.law))
    return p._replace(law=law, **values)


def other(**factors: float) -> Fault:
    """It takes a ball some of whose parameters are multiplied."""
    return given(lambda p: replaced(p, **{name: getattr(p, name) * factor for name, factor in factors.items()}))


swapped = given(lambda p: replaced(p, mu=p.eta, eta=p.mu))
"""It takes the friction of the floor for that of the wall, and the other way round."""


def where(test: Change, fault: Fault) -> Fault:
    """The fault shows only where the first argument passes a test."""
    return lambda right, first, *rest, **named: (_with(right, fault) if test(first) else right)(first, *rest, **named)


def in_case(fault: Fault, *cases: Case) -> Fault:
    """The fault shows only where the first argument is one of these cases."""
    return where(cases.__contains__, fault)


def fields(**changes: Change) -> Change:
    """A dataclass or named tuple with some of its fields changed."""

    def change(record: Any) -> Any:
        put = {name: each(getattr(record, name)) for name, each in changes.items()}
        return record._replace(**put) if hasattr(record, "_replace") else replace(record, **put)

    return change


def entries(**changes: Change) -> Change:
    """A mapping with some of its entries changed."""
    return lambda mapping: mapping | {name: change(mapping[name]) for name, change in changes.items()}


def times(factor: float, *entries: int) -> Change:
    """A number or array multiplied, or some entries of a sequence."""

    def change(values: Any) -> Any:
        if not entries:
            return factor * values
        parts = [factor * part if k in entries else part for k, part in enumerate(values)]
        if isinstance(values, np.ndarray):
            return np.array(parts)
        return type(values)(*parts) if hasattr(values, "_fields") else type(values)(parts)

    return change
