"""Where along omega_0 a run's answer changes: brackets narrowed down, many at a time."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compare.kit.lab import Lab
from compare.kit.statistics import Measured
from compare.kit.tasks import Task
from model import Trajectory

Answer = Callable[[Trajectory], bool | None]
"""Yes, no, or None where the run doesn't show it, and is done again for longer."""
SECTIONS = 7
"""Flows inside a bracket in each round, by which it shrinks to an eighth."""


@dataclass(frozen=True)
class Care:
    """How a run is done: times as long, and with the time step over `refine`."""

    time: int = 1
    refine: int = 1


USUAL, LONGER, FINER = Care(), Care(time=4), Care(refine=2)


@dataclass(frozen=True, eq=False)
class Bracket:
    """Two values between which the answer changes from yes to no, and the runs that said so."""

    low: float
    high: float
    runs: tuple[Trajectory | None, Trajectory | None] = (None, None)
    tasks: tuple[Task, ...] = ()
    shift: float = 0.0
    """How far the place moves with half the time step."""

    @property
    def place(self) -> Measured:
        """Its middle; the uncertainty is that of a uniform distribution, and the shift."""
        return Measured((self.low + self.high) / 2, math.hypot((self.high - self.low) / math.sqrt(12), self.shift))


@dataclass(frozen=True, eq=False)
class Search:
    """A question with a yes at `begin.low` and a no at `begin.high`."""

    begin: Bracket
    task: Callable[[float, Bracket, Care], Task]
    """The run to ask at a value, given the bracket so far."""
    answer: Answer
    width: float
    """Width at which it is narrow enough."""


def narrow(lab: Lab, searches: Sequence[Search], careful: bool = True) -> list[Bracket]:
    """Narrow every search down to its width, or as far as runs show it, all of them together, round by round.

    With `careful` the ends of the brackets are asked once more with half the time step: one that doesn't hold is as
    uncertain as the bracket before it was wide, see `Bracket.shift`.
    """
    brackets = [search.begin for search in searches]
    before = list(brackets)
    todo = list(range(len(searches)))
    while todo := [k for k in todo if brackets[k].high - brackets[k].low > searches[k].width]:
        for k, bracket in zip(todo, _round(lab, [searches[k] for k in todo], [brackets[k] for k in todo]), strict=True):
            before[k], brackets[k] = brackets[k], bracket
        todo = [k for k in todo if brackets[k].high - brackets[k].low < (before[k].high - before[k].low) / 2]
    if careful:
        ends = [(s, v, b) for s, b in zip(searches, brackets, strict=True) for v in (b.low, b.high)]
        runs = iter(lab.run([s.task(v, b, FINER) for s, v, b in ends]))
        for k, search in enumerate(searches):
            low, high = search.answer(next(runs)), search.answer(next(runs))
            if low is False or high is True:
                brackets[k] = replace(brackets[k], shift=before[k].high - before[k].low)
    return brackets


def _round(lab: Lab, searches: Sequence[Search], brackets: Sequence[Bracket]) -> list[Bracket]:
    """Ask inside every bracket; once more, for longer, where the run doesn't show the answer.

    The new bracket is from the last yes before the first no to that no.
    """
    values = [np.linspace(b.low, b.high, SECTIONS + 2).tolist() for b in brackets]
    asked = [(s, b, v) for s, b, row in zip(searches, brackets, values, strict=True) for v in row[1:-1]]
    tasks = [s.task(v, b, USUAL) for s, b, v in asked]
    runs = lab.run(tasks)
    answers = [s.answer(run) for (s, _, _), run in zip(asked, runs, strict=True)]
    unclear = [k for k, answer in enumerate(answers) if answer is None]
    longer = [asked[k][0].task(asked[k][2], asked[k][1], LONGER) for k in unclear]
    for k, task, run in zip(unclear, longer, lab.run(longer), strict=True):
        tasks[k], runs[k], answers[k] = task, run, asked[k][0].answer(run)
    narrower = []
    for n, (bracket, at) in enumerate(zip(brackets, values, strict=True)):
        inside = slice(n * SECTIONS, (n + 1) * SECTIONS)
        said, shown = [True, *answers[inside], False], [bracket.runs[0], *runs[inside], bracket.runs[1]]
        no = said.index(False)
        yes = max(k for k in range(no) if said[k])
        by = tuple(tasks[inside][max(yes - 1, 0) : no])
        narrower.append(Bracket(at[yes], at[no], (shown[yes], shown[no]), by))
    return narrower
