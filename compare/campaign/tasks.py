"""One run as data: all that determines it, its identity, and how engines carry it out."""

from __future__ import annotations

import ctypes
import dataclasses
import functools
import hashlib
import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import mujoco
import numpy.typing as npt

from compare.engines import study
from compare.engines.study import Engine
from model import Flow, InputError, Parameters, State, Trajectory, storage

# MuJoCo would print each of its warnings, and write them to MUJOCO_LOG.TXT in the current
# directory; a run that diverges says so itself.
mujoco.set_mju_user_warning(lambda text: None)


@dataclass(frozen=True, kw_only=True)
class Task:
    """A run that stands for itself: two tasks with equal `key` give equal data, bit for bit."""

    engine: str  #: name of a `compare.engines.study.Engine`
    parameters: Parameters
    x0: npt.ArrayLike  #: initial state, 6 or 8 numbers; kept as a `State`
    t_end: float  #: s
    flow: Flow | None = None  #: omega_0 over time; None for a steady ``parameters.omega_0``
    settings: Any = None  #: numerical settings of the engine; if None is given its defaults
    sample_interval: float | None = None  #: s; None for a thousandth of t_end

    def __post_init__(self) -> None:
        if not isinstance(self.settings, self.simulator.settings | None):
            raise InputError(f"settings of another engine were given to {self.engine!r}")
        settings = self.settings or self.simulator.configure({}, self.parameters)
        object.__setattr__(self, "x0", State.one(self.x0))
        object.__setattr__(self, "settings", settings)

    @property
    def simulator(self) -> Engine:
        """The engine of that name; `InputError` if there is none."""
        return study.engine(self.engine)

    def check(self) -> None:
        """`InputError` for a run that can't begin, before others are carried out."""
        self.simulator.check_set(self.parameters)
        self.simulator.check_run(self)

    @property
    def fluid(self) -> Flow:
        """The flow, steady where `flow` is None."""
        return self.flow or Flow.steady(self.parameters.omega_0)

    @functools.cached_property
    def key(self) -> str:
        """Hash of all that determines the run: the task, sources, the engine's version."""
        engine = self.simulator
        code = {"sources": sources(*engine.sources), **engine.versions}
        text = json.dumps({"task": self.describe(), "code": code}, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:24]

    def describe(self) -> dict[str, Any]:
        """The task as JSON-able data."""
        return {
            "engine": self.engine,
            "parameters": dataclasses.asdict(self.parameters),
            "x0": self.x0,
            "t_end": self.t_end,
            "flow": self.fluid.to_mapping(),
            "settings": dataclasses.asdict(self.settings),
            "sample_interval": self.sample_interval,
        }

    @property
    def steps(self) -> float:
        """How many time steps it takes; 1 for an engine that has none."""
        return self.t_end / (self.settings.timestep or self.t_end)

    @property
    def samples(self) -> float:
        """How many samples it has, about."""
        return self.t_end / self.sample_interval if self.sample_interval else 1000


def deadline(limit: float) -> Callable[[float], None]:
    """A function that raises `TimeoutError` once `limit` s of real time have passed."""
    start = time.monotonic()

    def check(done: float) -> None:
        if time.monotonic() - start > limit:
            raise TimeoutError(f"it took longer than {limit:g} s")

    return check


def carry_out(
    task: Task,
    check: Callable[[float], object] = lambda done: None,
    stop: Callable[[], bool] = lambda: False,
) -> Trajectory:
    """Run a task, calling `check` from time to time with the fraction done. A run that breaks down
    has its failure in the header, and so has one that ends because `stop` says so."""
    task.simulator.check_set(task.parameters)
    if simulate := task.simulator.simulate:

        def check_stop(done: float) -> None:
            check(done)
            if stop():
                raise InterruptedError("interrupted")

        return simulate(task, check_stop)
    assert task.simulator.stream
    _stop_timers()
    run = task.parameters, task.x0, task.t_end, task.fluid, task.settings
    how = {"sample_interval": task.sample_interval, "progress": check}
    under_way, blocks, reached, stopped = task.simulator.stream(*run, **how), [], 0.0, ""
    for block in under_way:
        blocks.append(block)
        # between rare samples blocks are empty
        reached = block["time"].max(initial=reached)
        if stop():
            stopped = f"was stopped at t = {reached:g} s"
            break
    header = dataclasses.replace(under_way.header, failure=under_way.header.failure or stopped)
    return Trajectory.from_blocks(header, blocks, under_way.events)


def store(
    task: Task,
    path: Path,
    stop: Callable[[], bool] = lambda: False,
    tell: Callable[[float], object] = lambda done: None,
) -> str:
    """Carry out one task into a file, until `stop` says so; return why the run is not whole, or
    nothing.

    A run that breaks down is kept under `failed_path`, until one into the same file is whole.
    `tell` is called with the fraction done. Raises `StorageError` if a file can't be written."""
    run = carry_out(task, tell, stop)
    failure = run.header.failure
    storage.save(run, failed_path(path) if failure else path)
    if not failure:
        failed_path(path).unlink(missing_ok=True)
    return failure


def failed_path(path: Path) -> Path:
    """The path at which a run that broke down is kept, by that of a whole run."""
    return path.with_suffix(f".failed{'.csv' if path.suffix.lower() == '.csv' else '.h5'}")


@functools.cache
def _stop_timers() -> None:
    """Stop MuJoCo's timers, which nobody reads here: they ask the clock at every stage of a step,
    for a tenth of its processor time."""
    from mjsim.coulomb.engine import LIBRARY  # here, because the law takes long to load

    ctypes.c_void_p.in_dll(LIBRARY, "mjcb_time").value = None


@functools.cache
def sources(*names: str) -> str:
    """Digest of the sources of packages, with all that is below them, and of modules."""
    digest = hashlib.sha256()
    for name in names:
        spec = find_spec(name)
        assert spec
        assert spec.origin
        top = Path(spec.origin)
        for path in sorted(top.parent.rglob("*")) if spec.submodule_search_locations else [top]:
            if path.suffix in (".py", ".xml"):
                place = path.relative_to(top.parent).as_posix()
                digest.update(b"%s\0%s\0" % (place.encode(), path.read_bytes()))
    return digest.hexdigest()
