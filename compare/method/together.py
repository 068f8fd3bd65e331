"""Procedures of many sets carried out together, each written as if it were alone.

A procedure is a generator that yields rows, and waits for runs, settled states or brackets as in
``(states,) = yield from settled(starts)``. What all procedures wait for is carried out at once."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Sequence
from typing import Any, NamedTuple, TypeVar

from compare.campaign.tasks import Task
from compare.method.brackets import Bracket, Search, narrow
from compare.method.record import Measurement, Missing
from compare.method.runner import Runner
from compare.method.settling import SettlingCriteria, SteadyState, settle_groups
from compare.method.step_pairs import Start, StepPair, StepPairResult, results_of, without_missing
from model import Trajectory

T = TypeVar("T")
USUAL_CRITERIA = SettlingCriteria()


class Wanted(NamedTuple):
    """What a procedure waits for: an answer for each of several things."""

    how: Callable[..., Iterable[Any]]
    """Called with the runner, what is wanted by all, and the option."""
    option: tuple[Any, ...]
    what: Sequence[Any]


Procedure = Generator[Measurement | Missing | Wanted, Any, T]


def asked(*groups: Sequence[Task]) -> Procedure[list[list[Trajectory] | str]]:
    """The runs of each group of tasks, or why one failed."""
    runs: list[list[Trajectory] | str] = yield Wanted(Runner.groups, (), groups)
    return runs


def settled(
    *groups: Sequence[Start], criteria: SettlingCriteria = USUAL_CRITERIA
) -> Procedure[list[list[SteadyState]]]:
    """The states to which each group of starts settles."""
    states: list[list[SteadyState]] = yield Wanted(settle_groups, (criteria,), groups)
    return states


def narrowed(*searches: Search, careful: bool = True) -> Procedure[list[Bracket]]:
    """The brackets of searches, see `narrow`."""
    brackets: list[Bracket] = yield Wanted(narrow, (careful,), searches)
    return brackets


def stepped(*pairs: StepPair) -> Procedure[list[StepPairResult]]:
    """What was read from pairs of runs; those of which one broke down are missing."""
    found: list[StepPairResult | Missing] = yield Wanted(results_of, (), pairs)
    return (yield from without_missing(found))


def together(
    runner: Runner, procedures: Iterable[Procedure[T]]
) -> Generator[Measurement | Missing, None, list[T]]:
    """The rows of procedures, one procedure after the other; what each of them comes to."""
    under_way, waiting, results = list(procedures), dict[int, Wanted](), dict[int, T]()
    rows: list[list[Measurement | Missing]] = [[] for _ in under_way]

    def go_on(k: int, answer: list[Any] | None = None) -> None:
        try:
            while not isinstance(said := under_way[k].send(answer), Wanted):
                rows[k].append(said)
                answer = None
        except StopIteration as end:
            results[k] = end.value
        else:
            waiting[k] = said

    for k in range(len(under_way)):
        go_on(k)
    while waiting:
        how, option, _ = next(iter(waiting.values()))
        now = {k: each.what for k, each in waiting.items() if each[:2] == (how, option)}
        for k in now:
            del waiting[k]
        answers = iter(how(runner, [each for what in now.values() for each in what], *option))
        for k, what in now.items():
            go_on(k, [next(answers) for _ in what])
    for own in rows:
        yield from own
    return [results[k] for k in range(len(under_way))]
