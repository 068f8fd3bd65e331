"""Putting a wrong function in the place of a right one, wherever it is known, for as long as a context lasts."""

from __future__ import annotations

import functools
import importlib
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from model import Case, Parameters

Function = Callable[..., Any]
PACKAGES = ("analytic", "compare.claims")
"""Where functions of the theory are known by name."""


@dataclass(frozen=True)
class WrongTheory:
    """A theory with one fault."""

    what: str
    """The fault, in words."""
    module: str
    function: str
    wrong: Callable[[Function], Function]
    """Makes the wrong function from the right one."""


@contextmanager
def believed(wrong: WrongTheory) -> Iterator[None]:
    """Believe a wrong theory: every name and table entry of the right function stands for the wrong one."""
    right = getattr(importlib.import_module(wrong.module), wrong.function)
    put = wrong.wrong(right)
    _exchange(right, put)
    try:
        yield
    finally:
        _exchange(put, right)


def _exchange(old: Function, new: Function) -> None:
    modules = [module for name, module in sys.modules.items() if name.startswith(PACKAGES)]
    for module in modules:
        for name, value in list(vars(module).items()):
            if value is old:
                setattr(module, name, new)
            elif isinstance(value, dict):
                value.update({key: new for key, entry in value.items() if entry is old})


def scaled(factor: float, *entries: int) -> Callable[[Function], Function]:
    """What it returns is `factor` times too large: all of it, or these entries of a sequence."""

    def wrong(right: Function) -> Function:
        def function(*args: Any, **named: Any) -> Any:
            result = right(*args, **named)
            if not entries:
                return factor * result
            parts = list(result)
            for k in entries:
                parts[k] = factor * parts[k]
            return type(result)(*parts) if hasattr(result, "_fields") else type(result)(parts)

        return function

    return wrong


def in_case(case: Case, change: Callable[[Function], Function]) -> Callable[[Function], Function]:
    """The fault shows only where the first argument is this case."""

    def wrong(right: Function) -> Function:
        faulty = change(right)
        return lambda first, *rest, **named: (faulty if first is case else right)(first, *rest, **named)

    return wrong


def given(change: Callable[[Parameters], Parameters]) -> Callable[[Function], Function]:
    """It takes other parameters for those of the ball."""
    change = functools.cache(change)

    def wrong(right: Function) -> Function:
        return lambda *args, **named: right(*(change(a) if isinstance(a, Parameters) else a for a in args), **named)

    return wrong


def other(**factors: float) -> Callable[[Parameters], Parameters]:
    """The parameters with some of them multiplied."""
    return lambda p: p.replace(**{name: getattr(p, name) * factor for name, factor in factors.items()})


def swapped(p: Parameters) -> Parameters:
    """The parameters with the friction coefficients of floor and wall exchanged."""
    return p.replace(mu=p.eta, eta=p.mu)


def answer(change: Callable[[Any], Any]) -> Callable[[Function], Function]:
    """Its answer is changed."""
    return lambda right: lambda *args, **named: change(right(*args, **named))


def fields(**changes: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """The answer with some of its fields changed."""
    return lambda answer: replace(answer, **{name: change(getattr(answer, name)) for name, change in changes.items()})


def each(case: Case | None, change: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Of a list of solutions those of a case are changed, all for None; None in the place of one takes it away."""

    def changed(solutions: list[Any]) -> list[Any]:
        rows = [change(s) if case in (None, s.case) else s for s in solutions]
        return [s for s in rows if s is not None]

    return changed


def times(factor: float, *entries: int) -> Callable[[Any], Any]:
    """An array with all, or some, of its entries multiplied."""

    def change(values: Any) -> Any:
        out = np.array(values)
        out[list(entries) if entries else ...] *= factor
        return out

    return change
