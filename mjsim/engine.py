"""Stepping one or many simulations, sampling them, and handing out trajectories."""

from __future__ import annotations

import dataclasses
import functools
import math
import os
import threading
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from mjsim import limits, recorder, scene
from mjsim.classify import Classifier
from mjsim.contact_settings import ContactSettings
from mjsim.stepping import HUGE, Engine, JointedBall
from model import Events, Flow, Header, Parameters, SimulationError, State, Trajectory
from model.arrays import Array
from model.errors import check_type
from model.kinematics import UNITS, VARIABLES
from model.parameters import Range, check_number

if TYPE_CHECKING:
    from mjsim.free import FreeBall
    from mjsim.journal import Journal

BLOCK, BLOCK_STEPS = 256, 20_000
"""A run hands out its samples once it has so many, or has taken so many steps."""
EVENT_TIMES = "located between the time steps; what jumps only to the step"
"""How exact events are, as files say."""
NOTED = 16_384
"""Steps of all runs that are noted before their cases are told."""
RUNS_A_THREAD = 16
"""Fewest runs for which a thread is worth its while: with fewer, threads wait for one another's Python."""
MOST_THREADS = 1024

Blocks = list[npt.NDArray[np.void]]
"""Samples of each run, structured arrays of dtype `model.trajectory.SAMPLE`."""


class Run:
    """Simulations under way: iterating advances them and yields blocks of samples.

    Balls of equal parameters share an engine, one after the other; results don't depend on that, to the bit.

    Parameters
    ----------
    parameters, x0s, flows : one of each for every run; states of 6 or 8 entries
    t_end : duration, s
    settings : shared by all runs
    sample_interval : s; rounded to a whole number of steps, t_end/1000 if None
    theta_0 : azimuth at the start, rad
    journal : keeps what was done, and knows what an earlier process did
    progress : called with the fraction done, from time to time; an error that it raises ends the runs

    Each iteration yields `Blocks`. A run that diverges yields what it has, then empty blocks, and its header says why.

    Raises
    ------
    InputError
        If an argument is out of range, the time step is too large for the problem, or numbers of runs differ.
    """

    def __init__(
        self,
        parameters: Sequence[Parameters],
        x0s: Sequence[npt.ArrayLike],
        t_end: float,
        flows: Sequence[Flow],
        settings: ContactSettings,
        *,
        sample_interval: float | None = None,
        theta_0: float = 0.0,
        journal: Journal | None = None,
        progress: Callable[[float], object] | None = None,
    ) -> None:
        limits.check_runs(parameters, x0s, flows, settings)
        self._parameters, self._flows, self._settings = list(parameters), list(flows), settings
        self._journal, self._progress = journal, progress or (lambda done: None)
        self._interval, self._count = limits.sampling(t_end, settings.timestep, sample_interval)
        theta_0 = check_number("theta_0", theta_0, "rad")
        states = [State.one(x0) for x0 in x0s]
        for x, p, flow in zip(states, parameters, flows, strict=True):
            limits.check_timestep(settings.timestep, p, flow, t_end)
            limits.check_start(x, p, settings)
        scenes = [p.replace(omega_0=0.0) for p in parameters]  # the fluid is no part of a scene
        built = {p: scene.build(p, settings) for p in dict.fromkeys(scenes)}
        models = [built[p][0] for p in scenes]
        self._balls = balls(zip(models, scenes, states, strict=True), settings, theta_0)
        shown = dataclasses.asdict(settings) | {
            "t_end": float(t_end), "sample_interval": self._interval * settings.timestep, "x0": None,
            "theta_0": theta_0, "event_times": EVENT_TIMES,
        }  # fmt: skip
        self.headers = [
            Header("mujoco", p, flow, shown | {"x0": list(x)}, built[still][1])
            for p, flow, x, still in zip(parameters, flows, states, scenes, strict=True)
        ]
        """Where each trajectory comes from; a failure appears here."""
        corner = (1 / math.cos(math.pi / scene.FACETS) - 1) * (settings.scene == "facets")
        self._deepest = np.array([(p.r + (p.R + p.r) * corner, p.r) for p in parameters])
        """How far h and y may be negative: a ball with its centre beyond wall or floor has come through."""
        self._classifier = Classifier(parameters, settings)
        self._steps = (self._count - 1) * self._interval + 1
        """All that are taken: nothing is needed of those after the last sample."""
        self._rows = np.empty((max(64, NOTED // len(parameters)), len(parameters), recorder.COLUMNS))
        self._ends = [math.inf] * len(parameters)
        """When each run broke down, s."""

    @property
    def events(self) -> list[Events]:
        """Changes of case of each run so far."""
        return [self._classifier.events(i, end) for i, end in enumerate(self._ends)]

    @property
    def margins(self) -> Array:
        """Present margins of the contacts A and B, shape (runs, 2), m."""
        return np.array([ball.margins for ball in self._balls])

    def __iter__(self) -> Iterator[Blocks]:
        blocks, state = self._journal.recall() if self._journal else (iter(()), {})
        done, step, kept = 0, int(state.get("steps", 0)), [state["waiting"]] if state else []
        if state:
            for k, ball in enumerate(self._balls):
                ball.restore({name: state[f"{name}_{k}"] for name in ball.state()})
            self._classifier.restore(state)
        for raw in blocks:
            yield self._finish(done, raw)
            done += len(raw)
        first = step
        while step < self._steps and not all(header.failure for header in self.headers):
            rows = self._rows[: self._steps - step]
            time = (step + np.arange(len(rows)) + 0.5) * self._settings.timestep
            for k, (ball, flow) in enumerate(zip(self._balls, self._flows, strict=True)):
                ball.advance(flow(time), rows[:, k])
            kept.append(rows[-step % self._interval :: self._interval].copy())
            step += len(rows)
            self._classifier.add(recorder.contacts(rows), step == self._steps)
            self._progress(step / self._steps)
            if step < self._steps and step - first < BLOCK_STEPS and sum(map(len, kept)) < BLOCK:
                continue
            first, ready = step, -(-self._classifier.decided // self._interval) - done
            raw, waiting = np.split(np.concatenate(kept), [ready])
            kept = [waiting]  # their cases are not yet decided
            if self._journal:
                state = {"steps": np.array(step), "waiting": waiting}
                states = enumerate(ball.state() for ball in self._balls)
                state |= {f"{name}_{k}": own[name] for k, own in states for name in own} | self._classifier.state()
                self._journal.note(raw, state)
            yield self._finish(done, raw)
            done += len(raw)

    def trajectories(self) -> list[Trajectory]:
        """All runs, carried out to their ends."""
        kept: list[Blocks] = [[] for _ in self.headers]
        for blocks in self:
            for own, block in zip(kept, blocks, strict=True):
                own.append(block)
        return [Trajectory.from_blocks(*each) for each in zip(self.headers, kept, self.events, strict=True)]

    def _finish(self, first: int, raw: Array) -> Blocks:
        """Samples of each run from raw ones (samples, runs, columns), cut where a run breaks down."""
        samples = np.arange(first, first + len(raw))
        time = samples.astype(float) * (self._interval * self._settings.timestep)
        inside = (raw[..., 1:3] > -self._deepest).all(axis=2)
        sound = np.logical_and.accumulate((np.abs(raw) < HUGE).all(axis=2) & inside)
        blocks: Blocks = []
        for i, (p, header) in enumerate(zip(self._parameters, self.headers, strict=True)):
            count = 0 if header.failure else int(sound[:, i].sum())
            part = recorder.samples(time[:count], raw[:count, i], self._balls[0].lead, p)
            if not header.failure and count < len(time):
                self._ends[i] = end = float(time[count])
                names = zip(VARIABLES, UNITS, strict=True)
                left = [f"{name} = {part[name][-1]:.6g} {unit}" for name, unit in names] if count else []
                failure = f"diverged by t = {end:g} s{', after ' * bool(left)}{', '.join(left)}"
                self.headers[i] = header = dataclasses.replace(header, failure=failure)
            part["case"] = self._classifier.cases(i, samples[:count] * self._interval)
            blocks.append(part)
        return blocks


def balls(
    given: Iterable[tuple[Any, Parameters, State]], settings: ContactSettings, theta_0: float
) -> Sequence[JointedBall | FreeBall]:
    """Balls that advance, one for each run with its model, parameters and start."""
    if settings.scene != "joints":
        from mjsim.free import FreeBall  # here, because the law of its contacts takes long to load

        return [FreeBall(*each, settings, theta_0) for each in given]
    engines: dict[Parameters, Engine] = {}
    return [
        JointedBall(engines.get(p) or engines.setdefault(p, Engine(model, p, settings)), x, theta_0)
        for model, p, x in given
    ]


def simulate(
    p: Parameters,
    x0: npt.ArrayLike,
    t_end: float,
    flow: Flow | None = None,
    settings: ContactSettings | None = None,
    *,
    sample_interval: float | None = None,
    theta_0: float = 0.0,
    progress: Callable[[float], None] | None = None,
) -> Trajectory:
    """Simulate one run with MuJoCo.

    Parameters
    ----------
    p : parameters; its omega_0 is used if there is no `flow`
    x0 : state (19) at the start, 6 entries, or 8 with h and v_h
    t_end : duration, s
    settings : `ContactSettings.for_problem` if None
    sample_interval, theta_0, progress : as in `Run`

    Raises
    ------
    InputError
        If an argument is of another type or out of range.
    SimulationError
        If the run diverges; it carries the samples so far.
    """
    limits.check_runs([p], [x0], [flow], settings)
    flows, settings = [flow or Flow.steady(p.omega_0)], settings or ContactSettings.for_problem(p)
    asked = [p], [x0], t_end, flows, settings
    run = Run(*asked, sample_interval=sample_interval, theta_0=theta_0, progress=progress)
    (trajectory,) = run.trajectories()
    if not trajectory.complete:
        raise SimulationError(f"the simulation {trajectory.header.failure}", trajectory)
    return trajectory


def simulate_many(
    parameters: Sequence[Parameters],
    x0s: Sequence[npt.ArrayLike],
    t_end: float,
    flow: Flow | Sequence[Flow] | None = None,
    settings: ContactSettings | None = None,
    *,
    sample_interval: float | None = None,
    theta_0: float = 0.0,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[Trajectory]:
    """Simulate many runs at once, in this process; arguments as in `simulate`.

    `flow` is one for all, one for each, or None for each one's own omega_0. Each thread steps its share of the runs;
    None is a thread for each processor that has `RUNS_A_THREAD` of them. Results are the same to the
    bit whatever the number. A run that breaks down has a header that says so; the others go on.

    Raises
    ------
    InputError
        If an argument is out of range, or numbers of runs differ.
    """
    check_type("parameters", parameters, Sequence)
    asked = flow if isinstance(flow, Sequence) else [flow] * len(parameters)
    limits.check_runs(parameters, x0s, asked, settings)
    flows = [own or Flow.steady(p.omega_0) for own, p in zip(asked, parameters, strict=True)]
    if threads is None:
        threads = max(1, min(os.cpu_count() or 1, len(flows) // RUNS_A_THREAD))
    parts = min(int(check_number("threads", threads, "threads", Range(1, MOST_THREADS, whole=True))), len(flows))
    # The softest settings that any of the runs asks for.
    settings = settings or min((ContactSettings.for_problem(p) for p in parameters), key=lambda s: s.solimp)
    how: dict[str, Any] = {"sample_interval": sample_interval, "theta_0": theta_0}
    shares, done, over = [slice(k, None, parts) for k in range(parts)], [0.0] * parts, threading.Event()

    def report(part: int, fraction: float) -> None:
        if over.is_set():  # another thread has raised an error
            raise CancelledError
        done[part] = fraction
        if progress:
            progress(sum(done) / parts)

    runs = [
        Run(parameters[own], x0s[own], t_end, flows[own], settings, progress=functools.partial(report, k), **how)
        for k, own in enumerate(shares)
    ]
    found: list[Any] = [None] * len(flows)
    with ThreadPoolExecutor(parts) as pool:
        try:
            for own, trajectories in zip(shares, pool.map(Run.trajectories, runs), strict=True):
                found[own] = trajectories
        finally:
            over.set()
    return found
