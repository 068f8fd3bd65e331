"""Many runs on an executor: each is carried out once; results don't depend on the workers.

The runs of a batch are one file, ``LABEL-ID.h5``, in which the name of each is `Task.key`, the hash
of all that determines it. A file appears only when it is whole, so the directory itself is the
record of what is done: whatever stops a campaign, starting it again does the rest. A run that broke
down has a file of its own, ``LABEL-KEY.failed.h5``, with the samples it has and the reason."""

from __future__ import annotations

import copy
import hashlib
import json
import math
import os
import re
import sys
import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import numpy as np

from compare.campaign.lock import Lock
from compare.campaign.progress import Show, show_nothing
from compare.campaign.tasks import Task, carry_out, deadline, failed_path
from compare.campaign.workers import Workers, first_done, processes
from model import InputError, SimulationError, StorageError, Trajectory, storage
from model.files import make_directory, remove_leftovers, write_text
from model.parameters import POSITIVE, Range, check_number
from model.versions import current_versions

BATCH = 64  #: most runs that a process takes at once, and stores in one file
MOST_STEPS = 3e5  #: of a batch of several runs: some seconds, so that progress is told
HELD = 2**16  #: most samples of a batch, some 11 MB; a run with more is one by itself
READ = 2**19
"""Samples held in memory, some 90 MB: most runs are looked at soon after. The runs of `motions` at
the default level are more than half of that: read again and again, they took ten minutes."""
SOON_DONE = 10.0
"""Processor time of a batch, s, that isn't worth a file where most runs are removed."""
FAILURES = "failures.json"
Save = Callable[[Mapping[str, Trajectory], Path], None]
Ended = tuple[str, Path | None, Trajectory | None]
"""Why a run isn't whole, or empty; its file, if any; the run, if it has no file."""
_BROKEN = ".failed.h5"
_NAME = re.compile(r".+-([0-9a-f]{24})(\.failed)?\.h5")  #: label, ID, and whether it broke down


@dataclass(frozen=True)
class Failure:
    """A task that has no whole run."""

    task: Task
    reason: str

    def described(self) -> dict[str, Any]:
        """The key, the reason, and the task, to try it again; JSON-able."""
        return {"key": self.task.key, "reason": self.reason, "task": self.task.describe()}


@dataclass
class Campaign:
    """A directory of runs, locked against other programs, and the workers that fill it.

    Parameters
    ----------
    directory : where the run files go; made if it doesn't exist
    workers : number of processes, or `Workers` of another kind; 0 runs everything in this process
    batch : most runs that a process takes at once
    limit : longest time a run may take, s; a run that takes longer is reported as failed
    report : called after every batch with `doing`, and how many runs are done, in all, and failed
    doing : what the campaign is about
    label : what the names of new files begin with, see `reduce`
    save : writes the whole runs of a batch, by key, to a file
    passing : whether `reduce` removes most: what is soon done is stored only if memory is short"""

    directory: Path
    workers: int | Workers = field(default_factory=lambda: os.cpu_count() or 1)
    batch: int = BATCH
    limit: float = math.inf
    report: Show = show_nothing
    doing: str = ""
    label: str = "runs"
    save: Save = storage.save_batch
    passing: bool = False

    def __post_init__(self) -> None:
        self.fleet = processes(self.workers) if isinstance(self.workers, int) else self.workers
        check_number("batch", self.batch, "runs", Range(1, whole=True))
        if self.limit != math.inf:
            check_number("limit", self.limit, "s", POSITIVE)
        self.directory = Path(self.directory).resolve()
        self._made = not self.directory.exists()
        make_directory(self.directory)
        self._owned = Lock(self.directory)
        remove_leftovers(self.directory)
        self._files: dict[str, Path] = {}
        self._failed: dict[str, Failure] = {}
        self._lock = threading.Lock()
        self._read: dict[str, Trajectory] = {}
        # A file that was cut or changed is set aside; those of other versions of the program are
        # left alone.
        others, ours = 0, current_versions()["dualball"]
        for file in sorted(self.directory.glob("*.h5")):
            if not (name := _NAME.fullmatch(file.name)):
                continue
            try:
                version, keys = storage.contents(file)
            except StorageError as error:
                file.replace(file.with_suffix(".damaged"))
                what = f"{error}; it is set aside, its runs are carried out again"
                print(f"dualball: {what}", file=sys.stderr)
                continue
            others += version != ours
            if version == ours:
                self._files |= dict.fromkeys(keys or [name[1]], file)
        if others:
            left = f"{others} files of runs of other versions are left alone in {self.directory}"
            print(f"dualball: {left}", file=sys.stderr)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *error: object) -> None:
        self.fleet.close(at_once=kind is not None)
        self._owned.release()
        try:
            remove_leftovers(self.directory)
        finally:  # also without a handle to look with
            if self._made:
                with suppress(OSError):  # it holds something
                    self.directory.rmdir()

    def part(self, label: str, doing: str) -> Campaign:
        """A part of the campaign with a label and runs of its own, for another thread."""
        part = copy.copy(self)
        part.label, part.doing, part._read = label, doing, {}
        part._files = {
            key: f for key, f in self._files.items() if label in (f.stem, f.name.rpartition("-")[0])
        }
        return part

    def load(self, key: str) -> Trajectory:
        """The run of a task that was carried out, by its key; raises `StorageError`."""
        if key not in self._read:
            runs = storage.load_runs(self._files[key])
            self._keep_in_memory(runs if key in runs else {key: runs[""]})
        return self._read[key]

    def _keep_in_memory(self, runs: Mapping[str, Trajectory]) -> None:
        """Keep runs in memory, and forget the earliest while there are more than `READ` samples.

        What isn't stored is before it is forgotten, all of it, in files as long as a batch: runs
        that are looked at in another order would have longer ones read again and again."""
        others = [key for key in self._read if key not in runs]
        self._read = {key: self._read[key] for key in others} | dict(runs)
        samples = sum(len(run.time) for run in self._read.values())
        while samples > READ and others:
            first = others.pop(0)
            if first not in self._files:
                self._store({key: run for key, run in self._read.items() if key not in self._files})
            samples -= len(self._read.pop(first).time)

    def _store(self, runs: dict[str, Trajectory]) -> None:
        """Store runs in files of at most `HELD` samples, or of one run that has more."""
        while runs:
            ends = np.cumsum([len(run.time) for run in runs.values()])
            some = [*runs][: max(1, int(np.searchsorted(ends, HELD, "right")))]
            own = {key: runs.pop(key) for key in some}
            file = store_together(own, self.directory / self.label, self.save)
            self._files |= dict.fromkeys(some, file)

    def run(self, tasks: Sequence[Task]) -> list[Trajectory]:
        """Carry out what is not yet done and load the runs, one a task, in order.

        Raises `SimulationError` for the first task that failed, `InputError` if it could not even
        start: use `complete` where failures are expected."""
        for failure in self.complete(tasks):
            key = failure.task.key
            if key in self._files:
                raise SimulationError(f"the run {key} {failure.reason}", self.load(key))
            raise InputError(f"the run {key} failed: {failure.reason}")
        return [self.load(task.key) for task in tasks]

    def complete(self, tasks: Iterable[Task]) -> list[Failure]:
        """Carry out every task that has no run yet; return those that failed, now or earlier.

        The directory's `FAILURES` lists all that have failed in this campaign, for programs."""
        unique = {task.key: task for task in tasks}
        todo = [unique[key] for key in unique if key not in self._files and key not in self._read]
        broken = [key for key in unique if self._files.get(key, Path()).name.endswith(_BROKEN)]
        failures = [Failure(unique[key], self.load(key).header.failure) for key in broken]
        done = len(unique) - len(todo) - len(failures)
        self.report(self.doing, done, len(unique), len(failures))
        for batch, outcomes in self._carry_out(todo):
            for task, (reason, file, _) in zip(batch, outcomes, strict=True):
                failures += [Failure(task, reason)] if reason else []
                done += not reason
                if file:
                    self._files[task.key] = file
            both = zip(batch, outcomes, strict=True)
            self._keep_in_memory({task.key: run for task, (*_, run) in both if run})
            self.report(self.doing, done, len(unique), len(failures))
        with self._lock:  # the parts of a campaign share the list
            known = len(self._failed)
            for failure in failures:
                self._failed.setdefault(failure.task.key, failure)
            if len(self._failed) > known:
                failed = [failure.described() for failure in self._failed.values()]
                write_text(self.directory / FAILURES, json.dumps(failed, indent=1))
        return failures

    def keep(self, keys: Collection[str]) -> None:
        """Store runs of the label in a file of their own, ``LABEL.h5``, for good."""
        file = self.directory / f"{self.label}.h5"
        if keys:
            storage.save_batch({key: self.load(key) for key in sorted(keys)}, file)
            self._files |= dict.fromkeys(keys, file)

    def reduce(self) -> None:
        """Remove all runs of the label but those kept and those that broke down."""
        own = {file for file in self._files.values() if file.name.rpartition("-")[0] == self.label}
        gone = {file for file in own if not file.name.endswith(_BROKEN)}
        for file in gone:
            file.unlink(missing_ok=True)
        self._read = {}
        self._files = {key: file for key, file in self._files.items() if file not in gone}

    def _carry_out(self, todo: Sequence[Task]) -> Iterator[tuple[list[Task], list[Ended]]]:
        """Yield each batch of tasks that ends, with what became of them.

        Tasks are shared out evenly among the workers, the longest first: then all end together; no
        batch of several has more than `MOST_STEPS`. A worker that dies takes all batches under way
        with it. Their tasks are tried again at the end, one at a time; one that then loses its
        worker twice has failed."""
        fresh = deque[list[Task]]()
        share = min(sum(task.steps for task in todo) / self.fleet.count, MOST_STEPS)
        steps, samples = 0.0, 0.0  # of the batch that grows: the sum, and the most of a run
        for task in sorted(todo, key=lambda task: -task.steps):
            steps, samples = steps + task.steps, max(samples, task.samples)
            last = fresh[-1] if fresh else []
            full = (
                len(last) == self.batch or (len(last) + 1) * samples > HELD or steps > 1.001 * share
            )
            if not last or full:
                fresh.append([])
                steps, samples = task.steps, task.samples
            fresh[-1].append(task)
        pending: dict[Future[list[Ended]], list[Task]] = {}
        again: deque[Task] = deque()
        died: Counter[str] = Counter()
        while True:
            # No more than a few batches wait at the executor, so that memory stays flat however
            # long the list.
            alone = not fresh and not pending
            if alone:
                if not again:
                    return
                fresh.append([again.popleft()])
            while fresh and len(pending) < 2 * self.fleet.count:
                batch = fresh.popleft()
                how = self.directory / self.label, self.save, self.passing, self.limit
                pending[self.fleet.submit(run_batch, batch, *how)] = batch
            for future in first_done(pending):
                batch = pending.pop(future)
                if future.cancelled():
                    raise StorageError("the workers' scheduler is gone; finished runs are kept")
                error = future.exception()
                if error is None:
                    yield batch, future.result()
                elif not isinstance(error, self.fleet.lost):
                    raise error
                elif alone and died[batch[0].key]:
                    yield batch, [("its worker died (killed, or out of memory)", None, None)]
                else:  # a task alone may have died by one of another part of the campaign
                    died.update(task.key for task in batch if alone)
                    again.extend(batch)


def store_together(runs: Mapping[str, Trajectory], place: Path, save: Save) -> Path:
    """Write whole runs, by key, into a file ``PLACE-ID.h5``, named by all of them."""
    digest = hashlib.sha256(" ".join(runs).encode()).hexdigest()[:24]
    path = Path(f"{place}-{digest}.h5")
    save(runs, path)
    return path


def run_batch(
    tasks: Sequence[Task], place: Path, save: Save, passing: bool, limit: float
) -> list[Ended]:
    """Carry out tasks, each within so many s, and store them; raises `StorageError`.

    Where most are removed (`passing`) whole runs are handed out instead, unless they took long."""
    begun, whole, ended = time.process_time(), dict[str, Trajectory](), dict[str, Ended]()
    for task in tasks:
        try:
            run = carry_out(task, deadline(limit))
        except StorageError:  # a full disk is for the user to mend
            raise
        except (InputError, TimeoutError, MemoryError) as error:
            ended[task.key] = str(error) or "out of memory", None, None
            continue
        if run.complete:
            whole[task.key] = run
        else:
            path = failed_path(Path(f"{place}-{task.key}.h5"))
            storage.save(run, path)
            ended[task.key] = run.header.failure, path, None
    if passing and time.process_time() - begun < SOON_DONE:
        ended |= {key: ("", None, run) for key, run in whole.items()}
    elif whole:
        ended |= dict.fromkeys(whole, ("", store_together(whole, place, save), None))
    return [ended[task.key] for task in tasks]
