"""One run as data: everything that determines it, its identity, and how each engine carries it out."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import resources
from typing import Any

import analytic
import mjsim
from mjsim import ContactSettings
from model import Flow, InputError, Parameters, SimulationError, Trajectory
from model.errors import suggestion
from model.trajectory import current_versions


@dataclass(frozen=True, kw_only=True)
class Task:
    """A run that stands for itself: two tasks with equal `key` give equal data, bit for bit."""

    engine: str
    """``mujoco``, ``event`` or ``time-stepping``."""
    parameters: Parameters
    x0: tuple[float, ...]
    """Initial state, 6 or 8 entries."""
    t_end: float
    """s"""
    flow: Flow | None = None
    """omega_0 over time; None for a steady ``parameters.omega_0``."""
    settings: ContactSettings | analytic.Settings | None = None
    """Numerical settings of the engine; None for its defaults."""
    sample_interval: float | None = None
    """s; None for a thousandth of t_end."""

    def __post_init__(self) -> None:
        if self.engine not in ENGINES:
            raise InputError(
                f"no engine is called {self.engine!r}{suggestion(self.engine, ENGINES)}; there are {', '.join(ENGINES)}"
            )
        if self.settings is not None and isinstance(self.settings, ContactSettings) != (self.engine == "mujoco"):
            raise InputError(f"settings of another engine were given to {self.engine!r}")

    @property
    def fluid(self) -> Flow:
        """omega_0 over time, also where `flow` is None."""
        return self.flow or Flow.steady(self.parameters.omega_0)

    @functools.cached_property
    def key(self) -> str:
        """Hash of all that determines the run: the fields of the task, the program's sources, the engine's version."""
        text = json.dumps({"task": self.describe(), "code": _code(self.engine)}, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:24]

    def describe(self) -> dict[str, Any]:
        """The task as JSON-able data."""
        return {
            "engine": self.engine,
            "parameters": dataclasses.asdict(self.parameters),
            "x0": list(self.x0),
            "t_end": self.t_end,
            "flow": self.fluid.to_mapping(),
            "settings": dataclasses.asdict(self.settings) if self.settings else None,
            "sample_interval": self.sample_interval,
        }

    @property
    def batch_key(self) -> str:
        """Tasks of equal batch key can be carried out together."""
        shared = {k: v for k, v in self.describe().items() if k not in ("parameters", "x0", "flow")}
        return json.dumps(shared, sort_keys=True)


def carry_out(tasks: Sequence[Task]) -> list[Trajectory]:
    """Run tasks of one `Task.batch_key`; a run that breaks down comes back with its failure in the header."""
    return ENGINES[tasks[0].engine](tasks)


def _mujoco(tasks: Sequence[Task]) -> list[Trajectory]:
    first = tasks[0]
    return mjsim.simulate_many(
        [task.parameters for task in tasks],
        [task.x0 for task in tasks],
        first.t_end,
        flow=[task.fluid for task in tasks],
        settings=first.settings if isinstance(first.settings, ContactSettings) else None,
        sample_interval=first.sample_interval,
    )


def _analytic(tasks: Sequence[Task]) -> list[Trajectory]:
    found = []
    for task in tasks:
        settings = task.settings if isinstance(task.settings, analytic.Settings) else analytic.Settings()
        settings = dataclasses.replace(settings, method=task.engine)
        try:
            trajectory = analytic.simulate(
                task.parameters, task.x0, task.t_end, task.fluid, settings, sample_interval=task.sample_interval
            )
        except SimulationError as error:
            trajectory = error.trajectory
        found.append(trajectory)
    return found


ENGINES: dict[str, Callable[[Sequence[Task]], list[Trajectory]]] = {
    "mujoco": _mujoco,
    "event": _analytic,
    "time-stepping": _analytic,
}


@functools.cache
def _code(engine: str) -> dict[str, str]:
    """Digest of the sources that produce an engine's results, and the versions they stand on."""
    digest = hashlib.sha256()
    for package in ("model", "mjsim" if engine == "mujoco" else "analytic"):
        for entry in sorted(resources.files(package).iterdir(), key=lambda entry: entry.name):
            if entry.name.endswith((".py", ".xml")):
                digest.update(entry.name.encode() + b"\0" + entry.read_bytes() + b"\0")
    stands_on = ("numpy", "mujoco") if engine == "mujoco" else ("numpy", "scipy")
    return {"sources": digest.hexdigest(), **{name: current_versions()[name] for name in stands_on}}
