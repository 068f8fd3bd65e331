"""An engine on exact cases, in a process of its own: what breaks or hangs loses a case.

An engine is anything with three functions, a module most simply:

* ``build(case, timestep)`` makes the scene of a case anew, or raises `NotImplementedError` with the
  reason why it can't;
* ``step(n)`` takes n steps, setting ``case.force(t, position, velocity)`` before each where
  ``case.forced``;
* ``state()`` returns position, velocity and spin of the body in SI units and world axes, then those
  of the one under it, if there is one.

It may say of itself ``NAME``; ``PRECISION``, ``f64`` or ``f32``; ``FEATURES`` of `Scene.needs` that
it has; ``DECLARED``, all that isn't a free body in plain geometry under the engine's own settings;
``NOTE``, what is worst and why; ``TIMESTEPS`` in the place of `TIME_STEPS`; ``KNOWN``, package and
version with which it works, ``"mujoco 4.0.0"``; ``MISSING``, why it can't be used here."""

from __future__ import annotations

import importlib
import math
import multiprocessing
import os
import subprocess
import sys
import threading
import time
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np

from compare.bench.case import TOLERANCE, ContactCase
from compare.campaign import compiling
from compare.engines import adapters
from compare.engines.adapters.scene import TIME_STEPS
from model import InputError
from model.arrays import Array
from model.parameters import POSITIVE, check_choice, check_number
from model.versions import ABSENT, absent, version

LIMIT = 300.0  # longest that a run at one step may take, s of real time
BEGIN = 120.0  # longest that an engine may take to load, s
LIFTED = 1e-3
"""Gap, in units of the body's least size, from which a contact that should last counts as lost."""
FLOORS = {"f64": 1e-11, "f32": 1e-5}  # errors that are only round-off; there is no order in them
FUNCTIONS = ("build", "step", "state")
TOLD = {"precision": "PRECISION", "declared": "DECLARED", "note": "NOTE", "steps": "TIMESTEPS"}
TOLD |= {"features": "FEATURES", "missing": "MISSING"}
"""Where an engine has what it may say of itself, by fields of `About`."""
ARE_LISTS = "TIMESTEPS", "FEATURES"
"""Lists; the others are texts."""


@dataclass(frozen=True)
class About:
    """What an engine says of itself."""

    name: str
    precision: str = "f64"
    declared: str = ""
    note: str = ""  # what is worst, and why, in a sentence
    version: str = ""
    """Of its package, and the version with which it is known to work if that is another."""
    steps: tuple[float, ...] = TIME_STEPS
    features: tuple[str, ...] = ()  # of `ContactCase.needs`, what it can do
    missing: str = ""  # why it can't be used here; empty if it can


@dataclass(frozen=True)
class Result:
    """An engine on a case; nan for what isn't known."""

    case: str
    engine: About
    steps: tuple[float, ...] = ()
    errors: tuple[float, ...] = ()
    """At each step, in units of the case's scales; nan where the run failed."""
    costs: tuple[float, ...] = ()
    """Processor time divided by simulated time, at each step."""
    creep: float = math.nan
    """Mean slip speed where the body should stick or roll, at the shortest step, m/s."""
    lost: float = math.nan
    """Share of samples, at the shortest step, in which a contact that should last is open."""
    failure: str = ""
    skipped: str = ""
    """Why the engine was not tried."""

    @property
    def error(self) -> float:
        """The error at the shortest step, in units of the case's scales."""
        return self.errors[-1] if self.errors else math.nan

    @property
    def cost(self) -> float:
        """Processor time divided by simulated time, at the shortest step."""
        return self.costs[-1] if self.costs else math.nan

    @property
    def order(self) -> float:
        """The power of the step with which the error falls; nan where there is none."""
        errors, floor = np.array(self.errors), FLOORS.get(self.engine.precision, FLOORS["f64"])
        if len(errors) < 2 or not (errors > floor).all():
            return math.nan
        return float(np.polyfit(np.log(self.steps), np.log(errors), 1)[0])

    @property
    def passed(self) -> bool:
        """Whether the error at the shortest step is at most `TOLERANCE`."""
        return self.error <= TOLERANCE


def run(
    case: ContactCase, engine: Any, steps: Sequence[float] | None = None, limit: float = LIMIT
) -> Result:
    """Run an engine on one case: a module or its name, ``module:object``, or an object.

    ``limit`` is the longest time for one step's run, s. Raises `InputError` if the engine can't be
    used, or for a step that is none."""
    for step in steps or ():
        check_number("step", step, "s", POSITIVE)
    (found,) = run_all([case], engine, steps, limit)
    if found.engine.missing:
        raise InputError(found.engine.missing)
    return found


def check(engine: Any) -> None:
    """`InputError` if an engine can't be used here."""
    with closing(EngineProcess(engine)) as trial:
        if trial.about.missing:
            raise InputError(trial.about.missing)


def run_all(
    cases: Iterable[ContactCase],
    engine: Any,
    steps: Sequence[float] | None = None,
    limit: float = LIMIT,
) -> Iterator[Result]:
    """Run an engine on many cases in one process, begun anew where it hangs or dies."""
    with closing(EngineProcess(engine, limit)) as trial:
        for case in cases:
            yield trial.result(case, steps)


class EngineProcess:
    """A process with an engine in it."""

    def __init__(self, engine: Any, limit: float = LIMIT) -> None:
        self._engine = engine.__name__ if hasattr(engine, "__spec__") else engine
        self._limit = limit
        self.about = self._start()

    def _start(self) -> About:
        # Not by `multiprocessing`, which runs a person's script a second time unless that is
        # guarded.
        self._pipe, far = multiprocessing.Pipe()
        self._heard, self._told = multiprocessing.Pipe(duplex=False)
        compiling.workers.add(self._heard)
        handles = far.fileno(), self._told.fileno()
        serve = f"from {__name__} import serve_engine; serve_engine"
        paths = [path or str(Path.cwd()) for path in sys.path]
        self._process = subprocess.Popen(
            [sys.executable, "-c", f"{serve}{handles}"],
            env=os.environ | {"PYTHONPATH": os.pathsep.join(paths)},
            pass_fds=handles,
            stdin=subprocess.PIPE,  # ends when we do
            stdout=subprocess.DEVNULL,  # engines are talkative
            start_new_session=True,  # Ctrl-C is for us
        )
        far.close()
        self._pipe.send(self._engine)
        answer = self._answer(BEGIN)
        name = self._engine if isinstance(self._engine, str) else type(self._engine).__name__
        return answer if isinstance(answer, About) else About(name, missing=f"{name} {answer}")

    def _answer(self, limit: float) -> Any:
        """What the process sends within `limit` s, or in words why it doesn't."""
        try:
            if self._pipe.poll(limit):
                return self._pipe.recv()
            self.close()
            return f"took longer than {limit:g} s"
        except (EOFError, OSError):
            return f"crashed (exit code {self._process.wait()})"

    def close(self) -> None:
        """End the process."""
        with self._process:
            self._process.kill()
        self._pipe.close()

    def result(self, case: ContactCase, steps: Sequence[float] | None = None) -> Result:
        """The result of the engine on a case, at all steps until one hangs."""
        about, found = self.about, Result(case.name, self.about)
        if about.missing:
            return replace(found, skipped=about.missing)
        if lacking := ", ".join(need for need in case.needs if need not in about.features):
            why = f"{about.name} doesn't say in FEATURES that it can do this: {lacking}"
            return replace(found, skipped=why)
        runs: list[tuple[Array | None, float, str]] = []
        chosen = tuple(sorted(steps or about.steps, reverse=True))
        for step in chosen:
            if self._process.poll() is not None:
                self.close()
                self._start()
            self._pipe.send((case, step))
            answer = self._answer(self._limit)
            if isinstance(answer, str):  # it hung or died
                lost = (None, math.nan, f"{answer} at a step of {1e3 * step:g} ms")
                runs += [lost] * (len(chosen) - len(runs))
                break
            if isinstance(answer, NotImplementedError):
                return replace(found, skipped=str(answer))
            runs.append(answer)
        states, costs, failures = zip(*runs, strict=True)
        found = replace(found, steps=chosen, costs=costs, failure=next(filter(None, failures), ""))
        if found.failure and "known to work" in about.version:
            found = replace(found, failure=f"{found.failure} ({about.version})")
        errors = tuple(math.nan if each is None else case.error(each) for each in states)
        found = replace(found, errors=errors)
        if states[-1] is None:
            return found
        gaps, slips = case.touching(states[-1])
        slips, gaps = slips[case.in_contact("R")], gaps[case.in_contact("RS")]
        lifted = gaps > LIFTED * min(case.body.size)
        return replace(
            found,
            creep=float(slips.mean()) if slips.size else math.nan,
            lost=float(lifted.mean()) if gaps.size else math.nan,
        )


def _load(given: Any) -> tuple[Any, About]:
    """An engine, and what it says of itself; `InputError` if it lacks something."""
    engine = given
    if isinstance(given, str):
        module, _, member = given.partition(":")
        if not all(part.isidentifier() for part in module.split(".")):
            raise InputError("write it as Python imports it, package.module")
        try:
            engine = importlib.import_module(module)
            engine = getattr(engine, member) if member else engine
        # whatever a module or a broken package does when it is imported
        except BaseException as error:
            package, known = _package(given, None)
            if package and version(package) == ABSENT:
                return None, About(str(given), missing=absent(package))
            works = f" ({known})" if known else ""
            raise InputError(f"{_in_words(error)}{works}") from error
    name = getattr(engine, "NAME", getattr(engine, "__name__", type(engine).__name__))
    lacking = [function for function in FUNCTIONS if not callable(getattr(engine, function, None))]
    if lacking:
        raise InputError(
            f"{name} has no function {' nor '.join(lacking)}; an engine has {', '.join(FUNCTIONS)}"
        )
    told = {what: getattr(engine, name) for what, name in TOLD.items() if hasattr(engine, name)}
    for what, value in [("NAME", name), *((TOLD[each], value) for each, value in told.items())]:
        several = what in ARE_LISTS
        if not isinstance(value, Collection) or isinstance(value, str) == several:
            raise InputError(f"{what} = {value!r} must be {'a list' if several else 'a text'}")
    if not told.get("steps", TIME_STEPS):
        raise InputError("TIMESTEPS is empty")
    about = About(name, version=_package(given, engine)[1], **told)
    check_choice("PRECISION", about.precision, list(FLOORS))
    steps = tuple(check_number("TIMESTEPS", step, "s", POSITIVE) for step in about.steps)
    return engine, replace(about, steps=steps, features=tuple(about.features))


def _package(given: Any, engine: Any) -> tuple[str, str]:
    """An engine's package, and in words its version and the one known to work; empty if unknown."""
    _, ours, own = str(given).rpartition(f"{adapters.__name__}.")
    listed = adapters.KNOWN.get(own.partition(":")[0], "") if ours else ""
    package, _, known = str(getattr(engine, "KNOWN", listed)).partition(" ")
    here = version(package) if package else ""
    other = f", known to work: {known}" if known and here != known else ""
    return package, f"{package} {here}".strip() + other


def _in_words(error: BaseException) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"


def serve_engine(handle: int, told: int) -> None:
    """Run in the process of an engine: receive the engine, then cases; send their states, and by
    another handle that it compiles.

    It ends with the process that started it."""

    def end_with_parent() -> None:
        sys.stdin.read()
        os._exit(1)

    threading.Thread(target=end_with_parent, daemon=True).start()
    compiling.tell(Connection(told))
    pipe = Connection(handle)
    with suppress(EOFError, BrokenPipeError):  # there are no more cases, or nobody waits any more
        try:
            adapter, about = _load(pipe.recv())
        except (InputError, TypeError) as error:
            pipe.send(f"can't be used: {error}")
            return
        pipe.send(about)
        while not about.missing:
            case, step = pipe.recv()
            pipe.send(_attempt(adapter, case, step))


def _attempt(engine: Any, case: ContactCase, step: float) -> Any:
    """States (n, 9) or None, cost per simulated time, and why there are no states."""
    states, spent, done = np.empty_like(case.exact), 0.0, 0
    try:
        engine.build(case, step)
        for k, t in enumerate(case.times.tolist()):
            near = math.floor(t / step + 1e-6)
            # between two steps, along a line
            for at in (near, near + 1) if t / step - near > 1e-6 else (near,):
                begin = time.process_time()
                if at > done:
                    engine.step(at - done)
                found = engine.state()
                parts = [] if found is None else [np.array(part, dtype=float) for part in found]
                spent, done = spent + time.process_time() - begin, at
                shapes = [part.shape for part in parts]
                if shapes != [(3,)] * 3 * len(case.bodies):
                    of = " of both bodies" if case.under else ""
                    why = f"must return position, velocity and spin{of}, not shapes {shapes}"
                    return None, math.nan, f"state() {why}"
                now = np.concatenate(parts)
                if not (np.abs(now) < 1e8).all():
                    return None, math.nan, f"diverged by t = {t:g} s at a step of {1e3 * step:g} ms"
                states[k] = now if at == near else states[k] + (t / step - near) * (now - states[k])
    except NotImplementedError as error:
        return NotImplementedError(str(error))
    except BaseException as error:  # whatever an engine throws loses the case alone
        return None, math.nan, _in_words(error)
    return states, spent / float(case.times[-1]), ""
