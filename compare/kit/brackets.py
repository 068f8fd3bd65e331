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


@dataclass(frozen=True)
class Care:
    """How a run is done: `time` times as long, with the time step divided by `refine`."""

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
    said: tuple[tuple[float, bool | None], ...] = ()
    """All that was asked so far: values and answers."""
    failure: str = ""
    """Why a run broke down, the last one if several did."""

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


Question = tuple[Search, float, Bracket]
"""What is asked, at which value, given the bracket so far."""
Asked = tuple[list[Task], list[Trajectory | None], list[bool | None]]


def narrow(lab: Lab, searches: Sequence[Search], careful: bool = True) -> list[Bracket]:
    """Narrow every search down to its width, or as far as runs show it, all of them together, round by round.

    A round asks inside every bracket, and once more, for longer, where the run doesn't show the answer; one that breaks
    down shows none. The new bracket is from the last yes before the first no to the first no beyond which runs show all
    answers. An end that was taken for granted, and is still one, is asked in the end; if it was wrong it has no run. An
    engine beside the one on trial, which looks where that one found something, takes it for granted.

    With `careful` the ends of the brackets are asked once more with half the time step: one that doesn't hold is as
    uncertain as the bracket before it was wide, see `Bracket.shift`.
    """
    failures: dict[Search, str] = {}
    sections = lab.effort.sections

    def ask(questions: Sequence[Question], care: Care = USUAL) -> Asked:
        tasks, runs = [search.task(value, bracket, care) for search, value, bracket in questions], []
        for (search, *_), run in zip(questions, lab.each(tasks), strict=True):
            if isinstance(run, str):
                failures[search] = run
            runs.append(None if isinstance(run, str) else run)
        answers = [None if run is None else q[0].answer(run) for q, run in zip(questions, runs, strict=True)]
        unclear = [n for n, (run, answer) in enumerate(zip(runs, answers, strict=True)) if run and answer is None]
        if care is USUAL and unclear:
            for n, task, longer, answer in zip(unclear, *ask([questions[n] for n in unclear], LONGER), strict=True):
                tasks[n], runs[n], answers[n] = task, longer, answer
        return tasks, runs, answers

    brackets = [search.begin for search in searches]
    before = list(brackets)
    todo = list(range(len(searches)))
    while todo := [k for k in todo if brackets[k].high - brackets[k].low > searches[k].width]:
        values = {k: np.linspace(brackets[k].low, brackets[k].high, sections + 2).tolist() for k in todo}
        asked = [(searches[k], value, brackets[k]) for k in todo for value in values[k][1:-1]]
        tasks, runs, answers = ask(asked)
        for n, k in enumerate(todo):
            inside = slice(n * sections, (n + 1) * sections)
            ends = brackets[k].runs
            said, shown = [True, *answers[inside], False], [ends[0], *runs[inside], ends[1]]
            yes = max(m for m in range(said.index(False)) if said[m])
            undecided = [m for m, (answer, run) in enumerate(zip(said, shown, strict=True)) if answer is None and run]
            no = said.index(False, max(undecided, default=yes))
            by = tuple(tasks[inside][max(yes - 1, 0) : no])
            all_said = *brackets[k].said, *zip(values[k][1:-1], answers[inside], strict=True)
            new = Bracket(values[k][yes], values[k][no], (shown[yes], shown[no]), by, said=all_said)
            before[k], brackets[k] = brackets[k], new
        todo = [k for k in todo if brackets[k].high - brackets[k].low < 0.51 * (before[k].high - before[k].low)]
    granted = [(k, end) for k, b in enumerate(brackets) for end in (0, 1) if not (b.runs[end] or lab.effort.granted)]
    _, runs, answers = ask([(searches[k], (brackets[k].low, brackets[k].high)[end], brackets[k]) for k, end in granted])
    for (k, end), shows, holds in zip(granted, runs, answers, strict=True):
        if holds is (end == 0):
            kept = brackets[k].runs
            brackets[k] = replace(brackets[k], runs=(kept[0], shows) if end else (shows, kept[1]))
    if careful:
        asked = [(s, value, b) for s, b in zip(searches, brackets, strict=True) for value in (b.low, b.high)]
        _, runs, answers = ask(asked, FINER)
        for k in range(len(searches)):
            low, high = answers[2 * k : 2 * k + 2]
            if low is False or high is True or None in runs[2 * k : 2 * k + 2]:
                brackets[k] = replace(brackets[k], shift=before[k].high - before[k].low)
    return [replace(b, failure=failures.get(search, "")) for search, b in zip(searches, brackets, strict=True)]
