"""One run as data: everything that determines it, its identity, and how each engine carries it out."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
import math
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy.typing as npt

import mjsim
from compare.runs import engines
from compare.runs.engines import Engine, Settings
from mjsim.engine import Blocks
from mjsim.journal import Journal
from model import Flow, InputError, Parameters, State, Trajectory, storage

LONG = 1e6
"""Steps from which on a run that hands out its samples keeps a journal and has a worker of its own, without batch."""
HELD = 2**18
"""Most samples of a batch that are held in memory, some 60 MB; more are written as they come."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """A run that stands for itself: two tasks with equal `key` give equal data, bit for bit."""

    engine: str
    """Name of a `compare.runs.engines.Engine`."""
    parameters: Parameters
    x0: npt.ArrayLike
    """Initial state, 6 or 8 numbers; kept as a `State`."""
    t_end: float
    """s"""
    flow: Flow | None = None
    """omega_0 over time; None for a steady ``parameters.omega_0``."""
    settings: Settings | None = None
    """Numerical settings of the engine; None for its defaults."""
    sample_interval: float | None = None
    """s; None for a thousandth of t_end."""

    def __post_init__(self) -> None:
        simulator = self.simulator
        if self.settings is not None and not isinstance(self.settings, simulator.settings):
            raise InputError(f"settings of another engine were given to {self.engine!r}")
        object.__setattr__(self, "x0", State.one(self.x0))

    @property
    def simulator(self) -> Engine:
        """The engine itself; `InputError` if there is none of that name."""
        return engines.engine(self.engine)

    @property
    def fluid(self) -> Flow:
        """omega_0 over time, also where `flow` is None."""
        return self.flow or Flow.steady(self.parameters.omega_0)

    @functools.cached_property
    def key(self) -> str:
        """Hash of all that determines the run: the fields of the task, the program's sources, the engine's version."""
        text = json.dumps({"task": self.describe(), "code": _code(self.simulator)}, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:24]

    def describe(self) -> dict[str, Any]:
        """The task as JSON-able data."""
        return {
            "engine": self.engine,
            "parameters": dataclasses.asdict(self.parameters),
            "x0": self.x0,
            "t_end": self.t_end,
            "flow": self.fluid.to_mapping(),
            "settings": dataclasses.asdict(self.settings) if self.settings else None,
            "sample_interval": self.sample_interval,
        }

    @property
    def chosen_settings(self) -> Settings:
        """The settings, also where `settings` is None."""
        return self.settings or self.simulator.configure({}, self.parameters)

    @property
    def steps(self) -> float:
        """Time steps; 1 for an engine that has none."""
        return self.t_end / (self.chosen_settings.timestep or self.t_end)

    @property
    def long(self) -> bool:
        """Whether the run hands out its samples and takes more than `LONG` steps."""
        return self.simulator.stream is not None and self.steps > LONG

    @property
    def batch_key(self) -> str:
        """Tasks of equal batch key can be carried out together."""
        apart = () if self.long else ("parameters", "x0", "flow")
        shared = {k: v for k, v in self.describe().items() if k not in apart}
        return json.dumps(shared, sort_keys=True)


class OutOfTimeError(RuntimeError):
    """A run took longer than it may."""


@dataclass(frozen=True)
class Deadline:
    """How long something may take, in s of real time from its creation."""

    limit: float = math.inf
    start: float = field(default_factory=time.monotonic)

    def check(self) -> None:
        """Raise `OutOfTimeError` if it is over."""
        if time.monotonic() - self.start > self.limit:
            raise OutOfTimeError(f"it took longer than {self.limit:g} s")


@dataclass(frozen=True)
class Outcome:
    """What became of a task."""

    failure: str
    """Why it is not whole; empty if it is."""
    run: Trajectory | None = field(default=None, repr=False)
    """The run itself, unless it was too long to be held in memory."""


def carry_out(
    tasks: Sequence[Task], deadline: Deadline | None = None, stop: Callable[[], bool] = lambda: False
) -> list[Trajectory]:
    """Run tasks of one `Task.batch_key`; a run that breaks down comes back with its failure in the header."""
    deadline = deadline or Deadline()
    if not tasks[0].simulator.stream:
        return [_simulated(task, deadline, stop) for task in tasks]
    run, blocks, stopped = _begun(tasks, None), [], ""
    for block in run:
        deadline.check()
        blocks.append(block)
        if stop():
            stopped = _stopped(block)
            break
    headers = [replace(header, failure=header.failure or stopped) for header in run.headers]
    return [
        Trajectory.from_blocks(header, parts, events)
        for header, parts, events in zip(headers, zip(*blocks, strict=True), run.events, strict=True)
    ]


def store(
    tasks: Sequence[Task], paths: Sequence[Path], limit: float = math.inf, stop: Callable[[], bool] = lambda: False
) -> list[Outcome]:
    """Run tasks of one `Task.batch_key` into files.

    A run that breaks down is kept under `failed_path`, until one into the same file is whole. If there are more than
    `HELD` samples, those of MuJoCo go to their files as they come, and a run of more than `LONG` steps keeps a journal,
    from which it goes on after having been killed. Once `stop` says so, runs end as if they had broken down, but
    MuJoCo's keep their journals.

    Raises
    ------
    StorageError
        If a file can't be written.
    OutOfTimeError
        If the batch takes longer than `limit` s for each of its runs.
    """
    deadline, first = Deadline(limit * len(tasks)), tasks[0]
    many = first.t_end * len(tasks) > HELD * (first.sample_interval or first.t_end / 1000)
    if first.simulator.stream and (many or first.long):
        outcomes = [Outcome(reason) for reason in _stream(tasks, paths, deadline, stop)]
    else:
        runs = carry_out(tasks, deadline, stop)
        for run, path in zip(runs, paths, strict=True):
            storage.save(run, path if run.complete else failed_path(path))
        outcomes = [Outcome(run.header.failure, run) for run in runs]
    for path, outcome in zip(paths, outcomes, strict=True):
        if not outcome.failure:
            failed_path(path).unlink(missing_ok=True)
    return outcomes


def _stopped(block: Blocks) -> str:
    return f"was stopped at t = {max(part['time'].max(initial=0.0) for part in block):g} s"


def failed_path(path: Path) -> Path:
    """Where a run that broke down is kept."""
    return path.with_suffix(".failed.h5")


def journal_path(task: Task, path: Path) -> Path | None:
    """Where a long run into a file keeps its journal, under its `Task.key`, since the file may have any name."""
    return path.with_name(f"{task.key}.journal") if task.long else None


def _begun(tasks: Sequence[Task], journal: Journal | None) -> mjsim.Run:
    """Runs that hand out their samples, in a batch unless they are long."""
    first = tasks[0]
    parameters, x0s, flows = zip(*((task.parameters, task.x0, task.fluid) for task in tasks), strict=True)
    given = parameters, x0s, first.t_end, flows, first.chosen_settings
    assert first.simulator.stream
    return first.simulator.stream(
        *given, sample_interval=first.sample_interval, batched=not first.long, journal=journal
    )


def _stream(tasks: Sequence[Task], paths: Sequence[Path], deadline: Deadline, stop: Callable[[], bool]) -> list[str]:
    kept = journal_path(tasks[0], paths[0]) if len(tasks) == 1 else None
    journal = Journal(kept) if kept else None
    try:
        run = _begun(tasks, journal)
    except InputError:  # there is nothing to go on with
        if journal:
            journal.discard()
        raise
    stopped = ""
    with ExitStack() as stack:
        writers = [
            stack.enter_context(storage.TrajectoryWriter(path, header))
            for path, header in zip(paths, run.headers, strict=True)
        ]
        for blocks in run:
            deadline.check()
            for writer, block in zip(writers, blocks, strict=True):
                writer.append(block)
            if stop():
                stopped = _stopped(blocks)
                break
        reasons = [header.failure or stopped for header in run.headers]
        for writer, reason, events, path in zip(writers, reasons, run.events, paths, strict=True):
            writer.finish(events, reason, failed_path(path) if reason else path)
    if journal and not stopped:
        journal.discard()
    return reasons


def _simulated(task: Task, deadline: Deadline, stop: Callable[[], bool]) -> Trajectory:
    def check(done: float) -> None:
        deadline.check()
        if stop():
            raise KeyboardInterrupt

    assert task.simulator.simulate
    given = task.parameters, State.one(task.x0), task.t_end, task.fluid, task.chosen_settings, task.sample_interval
    return task.simulator.simulate(*given, check)


@functools.cache
def _code(engine: Engine) -> dict[str, str]:
    """Digest of the sources that produce an engine's results, and the versions they stand on."""
    return {"sources": sources(*engine.sources), **engine.versions}


@functools.cache
def sources(*packages: str) -> str:
    """Digest of the sources of packages."""
    digest = hashlib.sha256()
    for package in packages:
        for entry in sorted(resources.files(package).iterdir(), key=lambda entry: entry.name):
            if entry.name.endswith((".py", ".xml")):
                digest.update(entry.name.encode() + b"\0" + entry.read_bytes() + b"\0")
    return digest.hexdigest()
