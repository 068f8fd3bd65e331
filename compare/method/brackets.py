"""Where along omega_0 a run's answer changes: brackets narrowed down, many at a time."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compare.campaign.tasks import Task
from compare.method.runner import Runner
from compare.method.statistics import Estimate, estimate, uniform
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
    shift: float = 0.0  #: how far the place moves with half the time step
    said: tuple[tuple[float, bool | None], ...] = ()
    """All that was asked so far: values and answers."""
    failure: str = ""  #: why a run broke down, the last one if several did

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
    width: float  #: width at which it is narrow enough


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
    asked = _Narrowing(runner, searches)
    asked.rounds()
    asked.granted_ends()
    if careful:
        asked.ends_with_half_the_step()
    return asked.brackets


class _Narrowing:
    """Searches that are narrowed down together, step by step, each with its bracket so far."""

    def __init__(self, runner: Runner, searches: Sequence[Search]) -> None:
        self.runner, self.searches = runner, searches
        # one that was narrowed down before, with another question, may have had a run break down
        self.brackets = [replace(search.bracket, failure="") for search in searches]
        self.before = list(self.brackets)
        """Those of the round before."""

    def rounds(self) -> None:
        """Ask inside all brackets that are too wide, until none is or runs show no more."""
        sections, todo = self.runner.sampling.sections, list(range(len(self.searches)))
        while todo := [k for k in todo if self.brackets[k].width > self.searches[k].width]:
            ends = (self.brackets[k].ends for k in todo)
            inside = [np.linspace(*both, sections + 2).tolist()[1:-1] for both in ends]
            asked = [(k, value) for k, row in zip(todo, inside, strict=True) for value in row]
            replies = iter(self.answers(asked))
            for k, values in zip(todo, inside, strict=True):
                self.before[k] = self.brackets[k]
                own = [next(replies) for _ in values]
                self.brackets[k] = _narrowed(self.brackets[k], values, own)
            todo = [k for k in todo if self.brackets[k].width < 0.51 * self.before[k].width]

    def granted_ends(self) -> None:
        """Ask at the ends that were taken for granted, unless they still are to be."""
        if self.runner.sampling.granted:
            return
        unseen = [(k, n) for k, b in enumerate(self.brackets) for n in (0, 1) if not b.runs[n]]
        replies = self.answers([(k, self.brackets[k].ends[end]) for k, end in unseen])
        for (k, end), reply in zip(unseen, replies, strict=True):
            if reply.answer is (end == 0):
                yes, no = self.brackets[k].runs
                runs = (yes, reply.run) if end else (reply.run, no)
                self.brackets[k] = replace(self.brackets[k], runs=runs)

    def ends_with_half_the_step(self) -> None:
        """Ask at all ends with half the time step: those that don't hold are less certain."""
        asked = [(k, value) for k, b in enumerate(self.brackets) for value in b.ends]
        replies = self.answers(asked, FINER)
        for k, (low, high) in enumerate(zip(replies[::2], replies[1::2], strict=True)):
            if low.answer is False or high.answer is True or not (low.run and high.run):
                self.brackets[k] = replace(self.brackets[k], shift=self.before[k].width)

    def answers(self, asked: Sequence[tuple[int, float]], how: Attempt = USUAL) -> list[Reply]:
        """Ask at values of searches, by number; those without an answer anew, for longer."""
        replies = []
        tasks = [self.searches[k].task(value, self.brackets[k], how) for k, value in asked]
        for (k, _), task, run in zip(asked, tasks, self.runner.each(tasks), strict=True):
            if isinstance(run, str):
                self.brackets[k] = replace(self.brackets[k], failure=run)
                replies.append(Reply(task, None, None))
            else:
                replies.append(Reply(task, run, self.searches[k].answer(run)))
        unclear = [n for n, reply in enumerate(replies) if reply.run and reply.answer is None]
        if how is USUAL and unclear:
            longer = self.answers([asked[n] for n in unclear], LONGER)
            for n, reply in zip(unclear, longer, strict=True):
                replies[n] = reply
        return replies


def _narrowed(bracket: Bracket, values: Sequence[float], replies: Sequence[Reply]) -> Bracket:
    """The bracket that is left once values inside it were asked."""
    answers, runs = [reply.answer for reply in replies], [reply.run for reply in replies]
    places, said = [bracket.low, *values, bracket.high], [True, *answers, False]
    shown = [bracket.runs[0], *runs, bracket.runs[1]]
    yes = max(n for n in range(said.index(False)) if said[n])
    both = enumerate(zip(said, shown, strict=True))
    undecided = [n for n, (answer, run) in both if answer is None and run]
    no = said.index(False, max(undecided, default=yes))
    by = tuple(reply.task for reply in replies[max(yes - 1, 0) : no])
    all_said = *bracket.said, *zip(values, answers, strict=True)
    seen = shown[yes], shown[no]
    return replace(bracket, low=places[yes], high=places[no], runs=seen, tasks=by, said=all_said)
