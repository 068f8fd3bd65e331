"""Stepping one or many simulations, sampling them, and handing out trajectories."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from mjsim import recorder, scene
from mjsim.classify import Classifier
from mjsim.contact_settings import ContactSettings
from mjsim.free import Free
from mjsim.journal import Journal
from mjsim.stepping import Many, Single, Stepper
from model import Events, Flow, Header, InputError, Parameters, SimulationError, Trajectory
from model.arrays import Array
from model.kinematics import UNITS, VARIABLES, full_state, slip_speeds
from model.parameters import check_number
from model.trajectory import SAMPLE

BLOCK = 256
"""Most samples a run keeps before it hands them out."""
BLOCK_STEPS = 20_000
"""Most steps it takes before that, if one sample doesn't need more, and for which it holds omega_0."""
_HUGE = 1e10
"""Beyond this MuJoCo takes a coordinate for divergence (mjMAXVAL)."""


class Run:
    """Simulations under way: iterating advances them and yields blocks of samples.

    Parameters
    ----------
    parameters, x0s, flows : one of each for every run; states of 6 or 8 entries
    t_end : duration, s
    settings : shared by all runs
    sample_interval : s; rounded to a whole number of steps, t_end/1000 if None
    theta_0 : azimuth at the start, rad
    batched : whether to use MuJoCo's batch even for one run. Its results don't depend on how many runs share it,
        to the bit; a single run outside is faster and rounds differently.
    journal : keeps what was done, and knows what an earlier process did

    Each iteration yields one block per run, structured arrays of dtype `model.trajectory.SAMPLE`. A run that diverges
    yields what it has, then empty blocks, and its header says why.

    Raises
    ------
    InputError
        If an argument is out of range or numbers of runs differ.
    """

    def __init__(
        self, parameters: Sequence[Parameters], x0s: Sequence[npt.ArrayLike], t_end: float,
        flows: Sequence[Flow], settings: ContactSettings, *, sample_interval: float | None = None, theta_0: float = 0.0,
        batched: bool = True, journal: Journal | None = None,
    ) -> None:  # fmt: skip
        if not len(parameters) == len(x0s) == len(flows) or len(parameters) == 0:
            raise InputError(
                f"every run needs parameters, a start and a flow, but there are {len(parameters)} parameter sets, "
                f"{len(x0s)} starts and {len(flows)} flows"
            )
        self._parameters, self._flows, self._settings = list(parameters), list(flows), settings
        self._journal = journal
        self._interval, self._count = _sampling(t_end, settings.timestep, sample_interval)
        states = [full_state(np.asarray(x0, dtype=float)) for x0 in x0s]
        theta_0 = check_number("theta_0", theta_0, "rad")
        for x, p in zip(states, parameters, strict=True):
            _warn_of_hovering(x, p, settings)
        scenes = [p.replace(omega_0=0.0) for p in parameters]  # the fluid is no part of a scene
        models = {p: scene.build(p, settings) for p in dict.fromkeys(scenes)}
        mjcf = {p: scene.mjcf(p, settings) for p in models}
        self._stepper = self._start([models[p] for p in scenes], states, theta_0, batched)
        shown = settings.to_mapping() | {
            "t_end": float(t_end), "sample_interval": self._interval * settings.timestep,
            "x0": None, "theta_0": theta_0,
        }  # fmt: skip
        self.headers = [
            Header("mujoco", p, flow, shown | {"x0": x.tolist()}, mjcf[still])
            for p, flow, x, still in zip(parameters, flows, states, scenes, strict=True)
        ]
        """Where each trajectory comes from; a failure appears here."""
        lengths = [(p.R, p.r) for p in parameters]
        self._alike = [[i for i, own in enumerate(lengths) if own == each] for each in dict.fromkeys(lengths)]
        """Runs of the same geometry, whose samples are worked out together."""
        self._classifiers = [Classifier(p, settings) for p in parameters]
        """They hold the changes of case so far, as `events`."""

    def _start(self, models: Sequence[Any], states: Sequence[Array], theta_0: float, batched: bool) -> Stepper:
        parameters, settings, omega_0 = self._parameters, self._settings, self._omega_0(0, 1)[0]
        if settings.coordinates == "free":
            return Free(models, parameters, settings, states, theta_0)
        start = [recorder.joint_state(x, theta_0, p) for x, p in zip(states, parameters, strict=True)]
        if len(models) == 1 and not batched:
            return Single(models[0], parameters[0], settings, start[0], float(omega_0[0]))
        return Many(models, parameters, settings, start, omega_0)

    @property
    def events(self) -> list[Events]:
        """Changes of case of each run so far."""
        return [classifier.events for classifier in self._classifiers]

    @property
    def samples(self) -> int:
        """Samples each run will have, for progress."""
        return self._count

    @property
    def margins(self) -> Array:
        """Present margins of the contacts A and B, shape (runs, 2), m."""
        return self._stepper.margins

    def __iter__(self) -> Iterator[list[npt.NDArray[np.void]]]:
        first = 0
        for raw in self._raw_blocks():
            last = first + len(raw)
            time = np.arange(first, last, dtype=np.float64) * (self._interval * self._settings.timestep)
            yield self._finish(time, raw, last == self._count)
            if all(header.failure for header in self.headers):
                return
            first = last

    def _raw_blocks(self) -> Iterator[Array]:
        """Raw samples (samples, runs, columns): those the journal knows, then new ones."""
        first = 0
        if self._journal:
            blocks, state = self._journal.recall()
            if state:
                self._stepper.restore(state)
            for raw in blocks:
                yield raw
                first += len(raw)
        size = max(1, min(BLOCK, BLOCK_STEPS // self._interval))
        for start in range(first, self._count, size):
            stop = min(start + size, self._count)
            raw = np.empty((stop - start, len(self._parameters), recorder.NQ + recorder.NV + recorder.NSENSOR))
            self._step(raw, start)
            if self._journal:
                self._journal.note(raw, self._stepper.state())
            yield raw

    def _step(self, raw: Array, start: int) -> None:
        """Take the steps from sample `start` to the one after the last of raw, or to the end; fill raw."""
        interval, stepper = self._interval, self._stepper
        end = min((start + len(raw)) * interval, (self._count - 1) * interval + 1)
        for first in range(start * interval, end, BLOCK_STEPS):
            omega_0 = self._omega_0(first, min(BLOCK_STEPS, end - first))
            for k in range(0, len(omega_0), interval):
                sample, between = divmod(first + k, interval)
                if not between:
                    stepper.sample(omega_0[k], raw[sample - start])
                stepper.advance(omega_0[k if between else k + 1 : k + interval])

    def _omega_0(self, first: int, count: int) -> Array:
        """omega_0 in the middle of each step, shape (count, runs)."""
        time = (np.arange(first, first + count) + 0.5) * self._settings.timestep
        return np.stack([flow(time) for flow in self._flows], axis=-1)

    def _finish(self, time: Array, raw: Array, last: bool) -> list[npt.NDArray[np.void]]:
        """Samples of each run from raw rows (samples, runs, columns), cut where they diverge."""
        sound = np.logical_and.accumulate((np.abs(raw) < _HUGE).all(axis=2)).T
        sound &= np.array([[not header.failure] for header in self.headers])
        blocks = [np.empty(0, SAMPLE)] * len(raw[0])
        for runs in self._alike:
            p, kept = self._parameters[runs[0]], sound[runs]
            rows = raw.transpose(1, 0, 2)[runs][kept]
            qpos, qvel, sensors = np.split(rows, [recorder.NQ, recorder.NQ + recorder.NV], axis=1)
            times = np.broadcast_to(time, kept.shape)[kept]
            block = recorder.samples(times, qpos, qvel, sensors, p, self._settings.lead)
            for i, part in zip(runs, np.split(block, kept.sum(axis=1).cumsum()[:-1]), strict=True):
                if not self.headers[i].failure and len(part) < len(time):
                    self._fail(i, float(time[len(part)]), part)
                blocks[i] = self._classifiers[i].add(part, last or bool(self.headers[i].failure))
        return blocks

    def _fail(self, i: int, time: float, block: npt.NDArray[np.void]) -> None:
        where = "" if len(block) == 0 else " after " + ", ".join(
            f"{name} = {block[name][-1]:.6g} {unit}" for name, unit in zip(VARIABLES, UNITS, strict=True)
        )  # fmt: skip
        self.headers[i] = dataclasses.replace(self.headers[i], failure=f"diverged by t = {time:g} s{where}")


def simulate(
    p: Parameters, x0: npt.ArrayLike, t_end: float, flow: Flow | None = None,
    settings: ContactSettings | None = None, *, sample_interval: float | None = None, theta_0: float = 0.0,
    progress: Callable[[float], None] | None = None,
) -> Trajectory:  # fmt: skip
    """Simulate one run with MuJoCo.

    Parameters
    ----------
    p : parameters; its omega_0 is used if there is no `flow`
    x0 : state (19) at the start, 6 entries, or 8 with h and v_h
    t_end : duration, s
    settings : `ContactSettings.for_problem` if None
    sample_interval, theta_0 : as in `Run`
    progress : called with the fraction done, from time to time

    Raises
    ------
    InputError
        If an argument is out of range.
    SimulationError
        If the run diverges; it carries the samples so far.
    """
    run = Run(
        [p], [x0], t_end, [flow or Flow.steady(p.omega_0)], settings or ContactSettings.for_problem(p),
        sample_interval=sample_interval, theta_0=theta_0, batched=False,
    )  # fmt: skip
    (trajectory,) = _collected(run, progress)
    if not trajectory.complete:
        raise SimulationError(f"the simulation {trajectory.header.failure}", trajectory)
    return trajectory


def simulate_many(
    parameters: Sequence[Parameters], x0s: Sequence[npt.ArrayLike], t_end: float,
    flow: Flow | Sequence[Flow] | None = None, settings: ContactSettings | None = None, *,
    sample_interval: float | None = None, theta_0: float = 0.0, progress: Callable[[float], None] | None = None,
) -> list[Trajectory]:  # fmt: skip
    """Simulate many runs at once as one MuJoCo batch, in this process; arguments as in `simulate`.

    `flow` is one for all, one for each, or None for each one's own omega_0. A run that diverges has a header that
    says so; the others go on.
    """
    flows: Sequence[Flow]
    if flow is None:
        flows = [Flow.steady(p.omega_0) for p in parameters]
    else:
        flows = [flow] * len(parameters) if isinstance(flow, Flow) else flow
    # The softest settings that any of the runs asks for.
    settings = settings or min((ContactSettings.for_problem(p) for p in parameters), key=lambda s: s.solimp)
    run = Run(parameters, x0s, t_end, flows, settings, sample_interval=sample_interval, theta_0=theta_0)
    return _collected(run, progress)


def _collected(run: Run, progress: Callable[[float], None] | None) -> list[Trajectory]:
    """Let all runs come to their ends and join their blocks."""
    blocks: list[list[npt.NDArray[np.void]]] = [[] for _ in run.headers]
    done = 0
    for parts in run:
        for kept, part in zip(blocks, parts, strict=True):
            kept.append(part)
        done += len(parts[0])
        if progress:
            progress(done / run.samples)
    return [
        Trajectory.from_blocks(header, kept, events)
        for header, kept, events in zip(run.headers, blocks, run.events, strict=True)
    ]


def _warn_of_hovering(x: Array, p: Parameters, settings: ContactSettings) -> None:
    """Warn if contact can't be continuous at the slip speeds of the start x, taking the load of gravity for both."""
    for contact, friction, speed, gap in zip("AB", (p.mu, p.eta), slip_speeds(x, p), (x[0], x[6]), strict=True):
        fastest = settings.fastest_slip(p.g, friction)
        if abs(gap) < settings.touching(p.g) and speed > fastest:
            warnings.warn(
                f"the ball slips at {speed:.3g} m s-1 at {contact} at the start, but with these settings contact "
                f"is continuous only up to {fastest:.3g} m s-1; ContactSettings.for_problem finds softer ones",
                stacklevel=4,
            )


def _sampling(t_end: float, timestep: float, sample_interval: float | None) -> tuple[int, int]:
    """Steps between samples and number of samples, both ends included."""
    if check_number("t_end", t_end, "s") < timestep:
        raise InputError(f"t_end = {t_end:g} s is out of range: must be at least one time step, {timestep:g} s")
    if sample_interval is None:
        sample_interval = max(t_end / 1000, timestep)
    if check_number("sample_interval", sample_interval, "s") < timestep * (1 - 1e-9):
        raise InputError(
            f"sample_interval = {sample_interval:g} s is out of range: must be at least one time step, {timestep:g} s"
        )
    steps = max(1, round(sample_interval / timestep))
    return steps, math.floor(t_end / (steps * timestep) + 1e-9) + 1
