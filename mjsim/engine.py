"""Stepping simulations, sampling them, and handing out trajectories."""

from __future__ import annotations

import dataclasses
import functools
import math
import os
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor
from typing import Any

import numpy as np
import numpy.typing as npt

from mjsim import recorder, scene
from mjsim.classify import Classifier
from mjsim.contact_settings import ContactModel, ContactSettings, RigidContacts
from mjsim.mid_step import BallConstants, resistance
from model import (
    Events,
    Flow,
    Header,
    InputError,
    Parameters,
    SimulationError,
    State,
    Trajectory,
    time_scales,
)
from model.arrays import Array
from model.errors import check_type
from model.kinematics import UNITS, VARIABLES, check_place
from model.parameters import POSITIVE, Range, check_number
from model.trajectory import MOST_SAMPLES

EVENT_TIMES = "located between the time steps; what jumps only to the step"
"""How exact events are, as files say."""
DEEP = 1e-4
"""How deep in floor or wall a ball may start, in R: rigid contacts end that deep at most."""
NOTED = 4096
"""Steps that are noted before their cases are told, and samples handed out."""
RUNS_A_THREAD = 16
"""Fewest runs for which a thread is worth its while: with fewer, threads wait for one another's
Python."""
MOST_THREADS = 1024
MOST_STEPS = 1e15
"""Of a run: so many can be counted."""


class Run:
    """A simulation under way: iterating advances it and yields blocks of samples, of dtype
    `model.trajectory.SAMPLE`.

    Parameters
    ----------
    p : parameters; its omega_0 is used if there is no `flow`
    x0 : state (19) at the start, 6 entries, or 8 with h and v_h
    t_end : duration, s
    settings : `RigidContacts` under Coulomb's law, those of 1 ms if None; or `ContactSettings`
    sample_interval : s; rounded to a whole number of steps, t_end/1000 if None
    theta_0 : azimuth at the start, rad
    progress : called with the fraction done, from time to time; an error that it raises ends the
        run

    A run that diverges yields what it has, and its header says why.

    Raises
    ------
    InputError
        If an argument is of another type or out of range, or the time step is too large for
        the problem.
    """

    def __init__(
        self,
        p: Parameters,
        x0: npt.ArrayLike,
        t_end: float,
        flow: Flow | None = None,
        settings: ContactModel | None = None,
        *,
        sample_interval: float | None = None,
        theta_0: float = 0.0,
        progress: Callable[[float], object] | None = None,
    ) -> None:
        check_type("p", p, Parameters)
        check_type("flow", flow, Flow | None)
        check_type("settings", settings, ContactModel | None)
        self._flow, self._settings = flow or Flow.steady(p.omega_0), settings or RigidContacts()
        self._p, self._x0, self._theta_0 = p, State.one(x0), check_number("theta_0", theta_0, "rad")
        self._progress = progress or (lambda done: None)
        self._timestep = self._settings.timestep
        given = p, self._x0, t_end, self._flow, self._settings, sample_interval
        self._interval, self._count = check_run(*given)
        self._at_rest = p.replace(omega_0=0.0)  # whatever flows, the engine is the same
        _, mjcf = scene.compiled(self._at_rest, self._settings)
        shown = dataclasses.asdict(self._settings) | {
            "t_end": float(t_end), "sample_interval": self._interval * self._timestep,
            "x0": list(self._x0), "theta_0": self._theta_0, "event_times": EVENT_TIMES,
        }  # fmt: skip
        name = "mujoco" if isinstance(self._settings, RigidContacts) else "mujoco-plain"
        self.header = Header(name, p, self._flow, shown, mjcf)
        """Where the trajectory comes from; a failure appears here."""
        self._classifier = Classifier(
            p, self._timestep, self._settings.midpoint, self._settings.dead_band
        )
        self._end = math.inf
        """When it broke down, s."""

    @property
    def events(self) -> Events:
        """Changes of case so far."""
        return self._classifier.events(self._end)

    def __iter__(self) -> Iterator[npt.NDArray[np.void]]:
        from mjsim import stepping  # here, because the law takes long to load, compiled

        ball = stepping.ball_of(self._at_rest, self._settings)
        ball.start(self._x0, self._theta_0)
        step, steps = 0, (self._count - 1) * self._interval + 1  # none after the last sample
        noted, waiting = np.empty((NOTED, recorder.COLUMNS)), np.empty((0, recorder.COLUMNS))
        while step < steps and not self.header.failure:
            rows = noted[: steps - step]
            ball.advance(self._flow((step + np.arange(len(rows)) + 0.5) * self._timestep), rows)
            waiting = np.concatenate([waiting, rows[-step % self._interval :: self._interval]])
            step += len(rows)
            self._classifier.add(recorder.contacts(rows), step == steps)
            self._progress(step / steps)
            first = -(-step // self._interval) - len(waiting)
            told = -(-self._classifier.decided // self._interval) - first
            raw, waiting = waiting[:told], waiting[told:]
            yield self._finish(first, raw, ball.lead)
        if not self.header.failure:
            stepping.give_back(ball, self._settings)

    def trajectory(self) -> Trajectory:
        """The whole run, carried out to its end."""
        blocks = list(self)
        return Trajectory.from_blocks(self.header, blocks, self.events)

    def _finish(self, first: int, raw: Array, lead: float) -> npt.NDArray[np.void]:
        """Turn raw samples (n, columns) into a block, up to where the run diverges or the ball
        breaks through."""
        p, samples = self._p, np.arange(first, first + len(raw))
        time = samples.astype(float) * (self._interval * self._timestep)
        sound = (np.abs(raw) < recorder.HUGE).all(axis=1) & (raw[:, 1:3] > -p.r).all(axis=1)
        count = len(raw) if sound.all() else int(sound.argmin())
        block = recorder.samples(time[:count], raw[:count], lead, p)
        block["case"] = self._classifier.cases(samples[:count] * self._interval)
        if count < len(raw):
            self._end = end = float(time[count])
            named = zip(VARIABLES, UNITS, strict=True)
            left = [f"{x} = {block[x][-1]:.6g} {unit}" for x, unit in named if count]
            failure = f"diverged by t = {end:g} s{', after ' * bool(left)}{', '.join(left)}"
            self.header = dataclasses.replace(self.header, failure=failure)
        return block


def check_run(
    p: Parameters,
    x0: State,
    t_end: float,
    flow: Flow,
    settings: ContactModel,
    sample_interval: float | None,
) -> tuple[int, int]:
    """`InputError` for a run that can't begin; a warning if friction at both contacts makes soft
    ones chatter. Returns `sampling`.

    A run may go on where another one ended, a little below the floor."""
    if isinstance(settings, ContactSettings) and settings.contact_decay(p.mu, p.eta) > 1:
        warnings.warn(
            f"with mu = {p.mu:g} and eta = {p.eta:g} a ball that slips at both contacts chatters "
            f"with these settings; "
            "ContactSettings.suited gives slower contacts",
            stacklevel=4,
        )
    check_timestep(settings.timestep, p, flow, t_end, x0)
    load = p.g + p.R * float(x0.omega_c) ** 2  # on the floor, and on the wall
    check_place(x0, p, max(settings.touching(load), DEEP * p.R))
    return sampling(t_end, settings.timestep, sample_interval)


def check_timestep(timestep: float, p: Parameters, flow: Flow, t_end: float, x0: State) -> None:
    """`time_scales.check_timestep` with the drag of these engines."""
    check_number("t_end", t_end, "s", POSITIVE)
    ball = BallConstants.of(p)
    time_scales.check_timestep(
        timestep, p, flow, t_end, lambda speed: resistance(speed, 0.0, 0.0, ball) / p.m, x0
    )


def sampling(t_end: float, timestep: float, sample_interval: float | None) -> tuple[int, int]:
    """Steps between samples and number of samples, both ends included."""
    t_end = check_number("t_end", t_end, "s", Range(timestep), "to hold a time step it")
    longest, meaning = Range(high=MOST_STEPS * timestep), f"for at most {MOST_STEPS:g} steps it"
    check_number("t_end", t_end, "s", longest, meaning)
    if sample_interval is None:
        sample_interval = max(t_end / 1000, timestep)
    least = Range(timestep * (1 - 1e-9))
    check_number("sample_interval", sample_interval, "s", least, "to hold a time step it")
    least, meaning = Range(t_end / MOST_SAMPLES), f"for at most {MOST_SAMPLES:g} samples it"
    check_number("sample_interval", sample_interval, "s", least, meaning)
    steps = max(1, round(sample_interval / timestep))
    return steps, math.floor(t_end / (steps * timestep) + 1e-9) + 1


def simulate(
    p: Parameters,
    x0: npt.ArrayLike,
    t_end: float,
    flow: Flow | None = None,
    settings: ContactModel | None = None,
    *,
    sample_interval: float | None = None,
    theta_0: float = 0.0,
    progress: Callable[[float], None] | None = None,
) -> Trajectory:
    """Simulate one run with MuJoCo; arguments and errors as of `Run`.

    Raises `SimulationError` if the run diverges; it carries the samples so far.
    """
    run = p, x0, t_end, flow, settings
    trajectory = Run(
        *run, sample_interval=sample_interval, theta_0=theta_0, progress=progress
    ).trajectory()
    if not trajectory.complete:
        raise SimulationError(f"the simulation {trajectory.header.failure}", trajectory)
    return trajectory


def simulate_many(
    parameters: Sequence[Parameters],
    x0s: Sequence[npt.ArrayLike],
    t_end: float,
    flow: Flow | Sequence[Flow] | None = None,
    settings: ContactModel | None = None,
    *,
    sample_interval: float | None = None,
    theta_0: float = 0.0,
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[Trajectory]:
    """Simulate many runs, in this process; arguments as of `Run`, parameters and starts one for
    each.

    `flow` is one for all, one for each, or None for each one's own omega_0. `threads` of them go on
    at once; None is a thread for each processor that has `RUNS_A_THREAD` of them. Results are the
    same to the bit whatever the number. A run that breaks down has a header that says so; the
    others go on.

    Raises
    ------
    InputError
        If an argument is of another type or out of range, or numbers of runs differ.
    """
    check_type("parameters", parameters, Sequence)
    flows = flow if isinstance(flow, Sequence) else [flow] * len(parameters)
    if not len(parameters) == len(x0s) == len(flows) or len(parameters) == 0:
        raise InputError(
            f"every run needs parameters, a start and a flow, but there are {len(parameters)} "
            f"parameter sets, "
            f"{len(x0s)} starts and {len(flows)} flows"
        )
    if threads is None:
        threads = max(1, min(os.cpu_count() or 1, len(flows) // RUNS_A_THREAD))
    threads = int(check_number("threads", threads, "threads", Range(1, MOST_THREADS, whole=True)))
    done, over = np.zeros(len(flows)), threading.Event()

    def report(run: int, fraction: float) -> None:
        if over.is_set():  # another one has raised an error
            raise CancelledError
        done[run] = fraction
        if progress:
            progress(float(done.mean()))

    how: dict[str, Any] = {"sample_interval": sample_interval, "theta_0": theta_0}
    runs = [
        Run(p, x0, t_end, own, settings, progress=functools.partial(report, k), **how)
        for k, (p, x0, own) in enumerate(zip(parameters, x0s, flows, strict=True))
    ]
    with ThreadPoolExecutor(min(threads, len(runs))) as pool:
        try:
            return list(pool.map(Run.trajectory, runs))
        finally:
            over.set()
