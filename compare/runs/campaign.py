"""Many runs on an executor: each is computed once, none is lost, and order or number of workers change nothing.

A run's file is named by the hash of all that determines it (`compare.runs.tasks.Task.key`) and appears only when it is
whole, so the directory itself is the record of what is done: whatever stops a campaign, starting it again does the
rest. A run that broke down is stored as ``KEY.failed.h5`` with the samples it has and the reason.
"""

from __future__ import annotations

import json
import math
import os
from collections import Counter, deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from compare.runs.progress import Show
from compare.runs.tasks import Outcome, OutOfTimeError, Task, failed_path, store
from compare.runs.workers import Workers, processes
from model import InputError, SimulationError, StorageError, Trajectory, storage
from model.files import make_directory, remove_leftovers, write_text
from model.parameters import POSITIVE, Range, check_number

BATCH = 64
"""Runs in one MuJoCo batch: where the engine's cost a step stops falling."""
ATTEMPTS = 2
"""How often a task alone may take its worker down with it before it is given up."""
FAILURES = "failures.json"


@dataclass(frozen=True)
class Failure:
    """A task that has no whole run."""

    task: Task
    reason: str


@dataclass
class Campaign:
    """A directory of runs and the workers that fill it; a context manager.

    Parameters
    ----------
    directory : where the run files go; made if it doesn't exist
    workers : number of processes, or `Workers` of another kind; 0 runs everything in this process
    batch : most runs in one MuJoCo batch
    limit : longest time a run may take, s; a run that takes longer is reported as failed
    memory : most samples of new runs that are kept in memory, so that `run` needn't read them from their files
    report : called after every batch with `doing`, and how many runs are done, in all, and failed
    doing : what the campaign is about
    """

    directory: Path
    workers: int | Workers = field(default_factory=lambda: os.cpu_count() or 1)
    batch: int = BATCH
    limit: float = math.inf
    memory: int = 0
    report: Show = lambda what, done, total, failed: None
    doing: str = ""

    def __post_init__(self) -> None:
        self._workers = processes(self.workers) if isinstance(self.workers, int) else self.workers
        check_number("batch", self.batch, "runs", Range(1, whole=True))
        if self.limit != math.inf:
            check_number("limit", self.limit, "s", POSITIVE)
        self.directory = Path(self.directory).resolve()
        make_directory(self.directory)
        self._executor: Executor | None = None
        self._failed: dict[str, Failure] = {}
        self._listed = -1
        self._held: dict[str, Trajectory] = {}
        self._samples = 0
        remove_leftovers(self.directory)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._stop(at_once=kind is not None)
        remove_leftovers(self.directory)

    def path(self, task: Task) -> Path:
        """Where the task's run is, or will be."""
        return self.directory / f"{task.key}.h5"

    def run(self, tasks: Sequence[Task]) -> list[Trajectory]:
        """Carry out what is not yet done and load the runs, one a task, in order.

        Raises `SimulationError` for the first task that failed, `InputError` if it could not even start: use
        `complete` where failures are expected.
        """
        failed = {failure.task.key: failure.reason for failure in self.complete(tasks)}
        for task in tasks:
            if task.key in failed:
                kept = failed_path(self.path(task))
                if kept.exists():
                    raise SimulationError(f"the run {task.key} {failed[task.key]}", storage.load(kept))
                raise InputError(f"the run {task.key} failed: {failed[task.key]}")
        return [self._held.get(task.key) or storage.load(self.path(task)) for task in tasks]

    def complete(self, tasks: Iterable[Task]) -> list[Failure]:
        """Carry out every task that has no file yet; return those that failed, now or earlier.

        The directory's `FAILURES` lists all that have failed in this campaign, for programs.
        """
        unique = list({task.key: task for task in tasks}.values())
        new = [task for task in unique if task.key not in self._held]
        there = {entry.name for entry in os.scandir(self.directory)} if new else set()
        todo, failures = [], []
        for task in new:
            kept = failed_path(self.path(task))
            if kept.name in there:
                failures.append(Failure(task, storage.load(kept).header.failure))
            elif self.path(task).name not in there:
                todo.append(task)
        done = len(unique) - len(todo) - len(failures)
        self.report(self.doing, done, len(unique), len(failures))
        for finished, failed in self._carry_out(_batches(todo, self.batch, self._workers.count)):
            done += finished
            failures += failed
            self.report(self.doing, done, len(unique), len(failures))
        self._failed |= {failure.task.key: failure for failure in failures}
        if len(self._failed) != self._listed and (self._failed or (self.directory / FAILURES).exists()):
            write_text(self.directory / FAILURES, json.dumps(listed(self._failed.values()), indent=1))
        self._listed = len(self._failed)
        return failures

    def _carry_out(self, fresh: Iterator[tuple[Task, ...]]) -> Iterator[tuple[int, list[Failure]]]:
        """Yield, for each batch that ends, how many of its runs are whole and those that failed."""
        pending: dict[Future[list[Outcome]], tuple[Task, ...]] = {}
        # A worker that dies takes other batches down with it. Those are tried again one by one, alone, so that it
        # shows which is to blame; a batch to blame is taken apart.
        suspects: deque[tuple[Task, ...]] = deque()
        blamed: Counter[str] = Counter()
        while True:
            # No more than a few batches wait at the executor, so that memory stays flat however long the list.
            while len(pending) < 2 * self._workers.count and (batch := next(fresh, ())):
                pending[self._submit(batch)] = batch
            alone = not pending
            if alone:
                if not suspects:
                    return
                batch = suspects.popleft()
                pending[self._submit(batch)] = batch
            ended, _ = wait(pending, return_when=FIRST_COMPLETED)
            for future in ended:
                batch = pending.pop(future)
                error = future.exception()
                if error is None:
                    yield self._tally(batch, future.result())
                elif not isinstance(error, self._workers.lost):
                    raise error
                else:
                    self._stop(at_once=True)
                    if alone and len(batch) > 1:
                        suspects.extend((task,) for task in batch)
                    elif alone and (blamed.update([batch[0].key]) or blamed[batch[0].key]) >= ATTEMPTS:
                        yield 0, [Failure(batch[0], "its worker died (killed, or out of memory)")]
                    else:
                        suspects.append(batch)

    def _submit(self, batch: tuple[Task, ...]) -> Future[list[Outcome]]:
        for _ in range(2):
            if self._executor is None:
                self._executor = self._workers.start()
            try:
                return self._executor.submit(run_batch, batch, self.directory, self.limit, self.memory > 0)
            except self._workers.lost:
                self._stop(at_once=True)
        raise StorageError("workers die as soon as they are started")

    def _tally(self, batch: Sequence[Task], outcomes: Sequence[Outcome]) -> tuple[int, list[Failure]]:
        """How many runs of a batch are whole, and the others; whole ones are held, as long as there is memory."""
        failures = []
        for task, outcome in zip(batch, outcomes, strict=True):
            if outcome.failure:
                failures.append(Failure(task, outcome.failure))
            elif outcome.run:
                self._held[task.key] = outcome.run
                self._samples += len(outcome.run.time)
        while self._samples > self.memory:
            self._samples -= len(self._held.pop(next(iter(self._held))).time)
        return len(batch) - len(failures), failures

    def _stop(self, at_once: bool) -> None:
        if self._executor is not None:
            self._workers.stop(self._executor, at_once)
            self._executor = None


def listed(failures: Iterable[Failure]) -> list[dict[str, Any]]:
    """Failures as JSON-able data: what failed, why, and all that it takes to try it again."""
    return [{"key": f.task.key, "reason": f.reason, "task": f.task.describe()} for f in failures]


def run_batch(tasks: Sequence[Task], directory: Path, limit: float, hand_over: bool = False) -> list[Outcome]:
    """Carry out tasks and store each; `hand_over` the runs themselves, too.

    Where a batch can't be carried out as a whole, its tasks are tried one by one.
    """
    try:
        outcomes = store(tasks, [directory / f"{task.key}.h5" for task in tasks], limit)
    except (InputError, OutOfTimeError, MemoryError) as error:  # StorageError, a full disk, is an InputError
        if len(tasks) > 1:
            return [outcome for task in tasks for outcome in run_batch([task], directory, limit, hand_over)]
        return [Outcome(str(error) or "out of memory")]
    return outcomes if hand_over else [Outcome(outcome.failure) for outcome in outcomes]


def _batches(tasks: Iterable[Task], size: int, workers: int) -> Iterator[tuple[Task, ...]]:
    """Tasks that can run together, shared out evenly among the workers: the longest first, so that all end together."""
    groups: dict[str, list[Task]] = {}
    for task in tasks:
        groups.setdefault(task.batch_key, []).append(task)
    for group in sorted(groups.values(), key=lambda group: -group[0].steps * len(group)):
        share = min(size, math.ceil(len(group) / workers))
        for start in range(0, len(group), share):
            yield tuple(group[start : start + share])
