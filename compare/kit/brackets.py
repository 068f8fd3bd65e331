"""Where along omega_0 a run's answer changes: brackets narrowed down, many at a time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compare.kit.runner import Runner
from compare.kit.statistics import Estimate, estimate, uniform
from compare.kit.tasks import Task
from model import Trajectory

Answer = Callable[[Trajectory], bool | None]
"""Yes, no, or None where the run doesn't show it, and is done again for longer."""


@dataclass(frozen=True)
class Attempt:
    """How a question's run is done: `time` times as long, the step divided by `divisor`."""

    time: int = 1
    divisor: int = 1


USUAL, LONGER, FINER = Attempt(), Attempt(time=4), Attempt(divisor=2)


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
    def ends(self) -> tuple[float, float]:
        """The lower and the upper value."""
        return self.low, self.high

    @property
    def width(self) -> float:
        """The upper value less the lower one."""
        return self.high - self.low

    @property
    def place(self) -> Estimate:
        """The middle, with the uncertainty of a uniform distribution and the shift."""
        middle = (self.low + self.high) / 2
        return estimate(middle, bracket=uniform(self.width / 2), time_step=uniform(self.shift))


@dataclass(frozen=True, eq=False)
class Search:
    """A question with a yes at the lower end of a bracket and a no at the upper one."""

    bracket: Bracket
    task: Callable[[float, Bracket, Attempt], Task]
    """The run to ask at a value, given the bracket so far."""
    answer: Answer
    width: float
    """Width at which it is narrow enough."""


Question = tuple[Search, float, Bracket]
"""What is asked, at which value, given the bracket so far."""


@dataclass(frozen=True, eq=False)
class Reply:
    """A run that was asked and what it says; no run where it broke down."""

    task: Task
    run: Trajectory | None
    answer: bool | None


def narrow(runner: Runner, searches: Sequence[Search], careful: bool = True) -> list[Bracket]:
    """Narrow every search down to its width, or as far as runs show it, round by round.

    A round asks inside every bracket, and once more, for longer, where the run doesn't show the
    answer; one that breaks down shows none. The new bracket is from the last yes before the first
    no to the first no beyond which runs show all answers. An end that was taken for granted, and is
    still one, is asked in the end; if it was wrong it has no run. An engine beside the one on
    trial, which looks where that one found something, takes it for granted.

    With `careful` the ends of the brackets are asked once more with half the time step: one that
    doesn't hold is as uncertain as the bracket before it was wide, see `Bracket.shift`."""
    failures, sections = dict[Search, str](), runner.sampling.sections
    brackets = [search.bracket for search in searches]
    before, todo = list(brackets), list(range(len(searches)))
    while todo := [k for k in todo if brackets[k].width > searches[k].width]:
        inside = {
            k: np.linspace(brackets[k].low, brackets[k].high, sections + 2).tolist()[1:-1]
            for k in todo
        }
        replies = _answers(
            runner,
            [(searches[k], value, brackets[k]) for k in todo for value in inside[k]],
            failures,
        )
        for n, k in enumerate(todo):
            before[k] = brackets[k]
            brackets[k] = _narrowed(
                brackets[k], inside[k], replies[n * sections : (n + 1) * sections]
            )
        todo = [k for k in todo if brackets[k].width < 0.51 * before[k].width]
    granted = [
        (k, end)
        for k, b in enumerate(brackets)
        for end in (0, 1)
        if not (b.runs[end] or runner.sampling.granted)
    ]
    replies = _answers(
        runner, [(searches[k], brackets[k].ends[end], brackets[k]) for k, end in granted], failures
    )
    for (k, end), reply in zip(granted, replies, strict=True):
        if reply.answer is (end == 0):
            yes, no = brackets[k].runs
            brackets[k] = replace(brackets[k], runs=(yes, reply.run) if end else (reply.run, no))
    if careful:
        asked = [(s, value, b) for s, b in zip(searches, brackets, strict=True) for value in b.ends]
        replies = _answers(runner, asked, failures, FINER)
        for k, (low, high) in enumerate(zip(replies[::2], replies[1::2], strict=True)):
            if low.answer is False or high.answer is True or not (low.run and high.run):
                brackets[k] = replace(brackets[k], shift=before[k].width)
    return [
        replace(b, failure=failures.get(search, ""))
        for search, b in zip(searches, brackets, strict=True)
    ]


def _answers(
    runner: Runner, questions: Sequence[Question], failures: dict[Search, str], how: Attempt = USUAL
) -> list[Reply]:
    """Carry out a run for each question; those without an answer anew for longer."""
    tasks, replies = [search.task(value, bracket, how) for search, value, bracket in questions], []
    for (search, *_), task, run in zip(questions, tasks, runner.each(tasks), strict=True):
        if isinstance(run, str):
            failures[search] = run
            replies.append(Reply(task, None, None))
        else:
            replies.append(Reply(task, run, search.answer(run)))
    unclear = [n for n, reply in enumerate(replies) if reply.run and reply.answer is None]
    if how is USUAL and unclear:
        longer = _answers(runner, [questions[n] for n in unclear], failures, LONGER)
        for n, reply in zip(unclear, longer, strict=True):
            replies[n] = reply
    return replies


def _narrowed(bracket: Bracket, values: Sequence[float], replies: Sequence[Reply]) -> Bracket:
    """The bracket that is left once values inside it were asked."""
    answers, runs = [reply.answer for reply in replies], [reply.run for reply in replies]
    places, said = [bracket.low, *values, bracket.high], [True, *answers, False]
    shown = [bracket.runs[0], *runs, bracket.runs[1]]
    yes = max(n for n in range(said.index(False)) if said[n])
    undecided = [
        n for n, (answer, run) in enumerate(zip(said, shown, strict=True)) if answer is None and run
    ]
    no = said.index(False, max(undecided, default=yes))
    by = tuple(reply.task for reply in replies[max(yes - 1, 0) : no])
    all_said = *bracket.said, *zip(values, answers, strict=True)
    return Bracket(places[yes], places[no], (shown[yes], shown[no]), by, said=all_said)
