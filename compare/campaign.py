"""Many runs on an executor: each is computed once, none is lost, and order or number of workers change nothing.

A run's file is named by the hash of all that determines it (`compare.tasks.Task.key`) and appears only when it is
whole, so the directory itself is the record of what is done: whatever stops a campaign, starting it again does the
rest. A run that broke down is stored as ``KEY.failed.h5`` with the samples it has and the reason.
"""

from __future__ import annotations

import math
import os
import signal
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from types import TracebackType
from typing import Self

from compare.tasks import Task, carry_out
from model import InputError, SimulationError, StorageError, Trajectory, storage
from model.hdf5 import remove_leftovers

BATCH = 64
"""Runs in one MuJoCo batch: where the engine's cost a step stops falling."""
ATTEMPTS = 2
"""How often a task may take its worker down with it before it is given up."""


@dataclass(frozen=True)
class Failure:
    """A task that has no whole run."""

    task: Task
    reason: str


@dataclass(frozen=True)
class Progress:
    """Where a campaign stands, handed to the callback after every batch."""

    done: int
    total: int
    failed: int


@dataclass
class Campaign:
    """A directory of runs and the workers that fill it; a context manager.

    Parameters
    ----------
    directory : where the run files go; made if it doesn't exist
    workers : number of processes; 0 runs everything in this one
    executor : makes the executor instead (Dask's client has one of the same shape)
    report : called with a `Progress` after every batch
    """

    directory: Path
    workers: int = field(default_factory=lambda: os.cpu_count() or 1)
    batch: int = BATCH
    executor: Callable[[], Executor] | None = None
    report: Callable[[Progress], None] = lambda progress: None
    failures: list[Failure] = field(default_factory=list)

    def __post_init__(self) -> None:
        if self.workers < 0:
            raise InputError(f"workers = {self.workers} is out of range: must be >= 0")
        if self.batch < 1:
            raise InputError(f"batch = {self.batch} is out of range: must be >= 1")
        self.directory = Path(self.directory)
        try:
            self.directory.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise StorageError(f"cannot write to {self.directory}: {error.strerror}") from error
        if not os.access(self.directory, os.W_OK | os.X_OK):
            raise StorageError(f"cannot write to {self.directory}: Permission denied")
        self._pool: Executor | None = None
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

        Raises `SimulationError` for the first task that failed: use `complete` where failures are expected.
        """
        self.complete(tasks)
        for task in tasks:
            if not self.path(task).exists():
                reason = next((f.reason for f in self.failures if f.task.key == task.key), "not computed")
                partial = self._failed_path(task)
                if partial.exists():
                    raise SimulationError(reason, storage.load(partial))
                raise StorageError(f"the run {task.key} failed: {reason}")
        return [storage.load(self.path(task)) for task in tasks]

    def complete(self, tasks: Iterable[Task]) -> list[Failure]:
        """Carry out every task that has no file yet; return those that failed, now or earlier."""
        tasks = list({task.key: task for task in tasks}.values())
        there = {entry.name for entry in os.scandir(self.directory)}
        failures = [
            Failure(task, storage.load(self._failed_path(task)).header.failure)
            for task in tasks
            if self._failed_path(task).name in there
        ]
        given_up = {failure.task.key for failure in failures}
        todo = [task for task in tasks if self.path(task).name not in there and task.key not in given_up]
        done = len(tasks) - len(todo) - len(failures)
        self.report(Progress(done, len(tasks), len(failures)))
        for finished, failed in self._carry_out(_batches(todo, self.batch, self.workers)):
            done += finished
            failures += failed
            self.report(Progress(done, len(tasks), len(failures)))
        known = {failure.task.key for failure in self.failures}
        self.failures += [failure for failure in failures if failure.task.key not in known]
        return failures

    def _failed_path(self, task: Task) -> Path:
        return self.directory / f"{task.key}.failed.h5"

    def _carry_out(self, batches: Iterator[tuple[Task, ...]]) -> Iterator[tuple[int, list[Failure]]]:
        """Yield, for each batch that ends, how many of its runs are whole and those that failed."""
        if self.workers == 0 and self.executor is None:
            for batch in batches:
                yield _tally(batch, run_batch(batch, self.directory))
            return
        retries: deque[tuple[tuple[Task, ...], int]] = deque()
        pending: dict[Future[list[str]], tuple[tuple[Task, ...], int]] = {}
        while True:
            # No more than a few batches wait at the executor, so that memory stays flat however long the list.
            while len(pending) < 2 * max(self.workers, 1):
                batch, attempt = retries.popleft() if retries else (next(batches, ()), 0)
                if not batch:
                    break
                pending[self._submit(batch)] = (batch, attempt)
            if not pending:
                return
            ended, _ = wait(pending, return_when=FIRST_COMPLETED)
            for future in ended:
                batch, attempt = pending.pop(future)
                error = future.exception()
                if error is None:
                    yield _tally(batch, future.result())
                elif isinstance(error, BrokenProcessPool):
                    self._stop(at_once=True)
                    if len(batch) > 1:  # find the one that takes its worker down
                        retries.extend(((task,), attempt) for task in batch)
                    elif attempt + 1 < ATTEMPTS:
                        retries.append((batch, attempt + 1))
                    else:
                        yield 0, [Failure(batch[0], "its worker process died (killed, or out of memory)")]
                else:
                    raise error

    def _submit(self, batch: tuple[Task, ...]) -> Future[list[str]]:
        for _ in range(2):
            if self._pool is None:
                self._pool = self.executor() if self.executor else _processes(self.workers)
            try:
                return self._pool.submit(run_batch, batch, self.directory)
            except BrokenProcessPool:
                self._stop(at_once=True)
        raise StorageError("worker processes die as soon as they are started")

    def _stop(self, at_once: bool) -> None:
        if self._pool is None:
            return
        if at_once and isinstance(self._pool, ProcessPoolExecutor):
            for process in list((self._pool._processes or {}).values()):
                process.terminate()
        self._pool.shutdown(wait=True, cancel_futures=True)
        self._pool = None


def run_batch(tasks: Sequence[Task], directory: Path) -> list[str]:
    """Carry out tasks and store each; return, per task, why it failed (empty if it is whole)."""
    reasons = []
    for task, trajectory in zip(tasks, carry_out(tasks), strict=True):
        suffix = ".h5" if trajectory.complete else ".failed.h5"
        try:
            storage.save(trajectory, directory / f"{task.key}{suffix}")
            reasons.append(trajectory.header.failure)
        except StorageError as error:
            reasons.append(str(error))
    return reasons


def _processes(workers: int) -> ProcessPoolExecutor:
    return ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_start_worker)


def _start_worker() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to handle


def _batches(tasks: Iterable[Task], size: int, workers: int) -> Iterator[tuple[Task, ...]]:
    """Tasks that can run together, in the order of their first appearance, shared out evenly among the workers."""
    groups: dict[str, list[Task]] = {}
    for task in tasks:
        groups.setdefault(task.batch_key, []).append(task)
    for group in groups.values():
        share = min(size, math.ceil(len(group) / max(workers, 1)))
        for start in range(0, len(group), share):
            yield tuple(group[start : start + share])


def _tally(batch: Sequence[Task], reasons: Sequence[str]) -> tuple[int, list[Failure]]:
    failed = [Failure(task, reason) for task, reason in zip(batch, reasons, strict=True) if reason]
    return len(batch) - len(failed), failed
