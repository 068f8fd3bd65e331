"""Stepping one or many simulations: drag, wall and margins from outside, MuJoCo's contact solver inside.

Before each step the wall is turned to be tangent at the ball's azimuth and the drag of the fluid (9) is written as a
generalised force. Two slow corrections take out what the softness of MuJoCo's contacts would leave: the margins of the
contacts move against what is left of the penetration, and the surfaces get the velocity at which the last friction
force would make them creep, backwards. The body axes of a homogeneous ball are arbitrary: they are set upright before
each step, so that forces and velocities of the ball's joint are along the paper's axes.

The generalised contact force of the chain is then, with r times the moments about the centre,
``Q = (., A_x + B_x, A_y + B_y, -r A_z, r B_z, r (A_x - B_y))``, which with the normal forces gives the friction.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, Protocol

import mujoco
import numpy as np
import numpy.typing as npt
from mujoco.batch import Batch

from mjsim import recorder, scene
from mjsim.classify import Changes, classify
from mjsim.contact_settings import ContactSettings
from model import Flow, Header, InputError, Parameters, SimulationError, Trajectory
from model.arrays import Array
from model.kinematics import UNITS, VARIABLES, full_state
from model.parameters import check_number

BLOCK = 256
"""Samples a run keeps before it hands them out."""
_UPRIGHT = (1.0, 0.0, 0.0, 0.0)
_NORMAL_A, _NORMAL_B = 1, 15
"""Where the sensors hold the normal forces."""
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
    ) -> None:  # fmt: skip
        if not len(parameters) == len(x0s) == len(flows) or len(parameters) == 0:
            raise InputError(
                f"every run needs parameters, a start and a flow, but there are {len(parameters)} parameter sets, "
                f"{len(x0s)} starts and {len(flows)} flows"
            )
        self._parameters, self._flows, self._settings = list(parameters), list(flows), settings
        self._interval, self._count = _sampling(t_end, settings.timestep, sample_interval)
        states = [full_state(np.asarray(x0, dtype=float)) for x0 in x0s]
        theta_0 = check_number("theta_0", theta_0, "rad")
        start = [recorder.joint_state(x, theta_0, p) for x, p in zip(states, parameters, strict=True)]
        models = [scene.build(p, settings) for p in parameters]
        self._stepper: _Stepper = (
            _Single(models[0], parameters[0], settings, start[0])
            if len(models) == 1
            else _Many(models, parameters, settings, start)
        )
        shown = settings.to_mapping() | {
            "t_end": float(t_end), "sample_interval": self._interval * settings.timestep,
            "x0": None, "theta_0": theta_0,
        }  # fmt: skip
        self.headers = [
            Header("mujoco", p, flow, shown | {"x0": x.tolist()}, scene.mjcf(p, settings))
            for p, flow, x in zip(parameters, flows, states, strict=True)
        ]
        """Where each trajectory comes from; a failure appears here."""
        self.changes = [Changes() for _ in parameters]
        """Changes of case, growing while the runs advance."""

    @property
    def samples(self) -> int:
        """Samples each run will have, for progress."""
        return self._count

    @property
    def margins(self) -> Array:
        """Present margins of the contacts A and B, shape (runs, 2), m."""
        return self._stepper.margins

    def __iter__(self) -> Iterator[list[npt.NDArray[np.void]]]:
        n = len(self._parameters)
        for first in range(0, self._count, BLOCK):
            rows = range(first, min(first + BLOCK, self._count))
            raw = np.empty((len(rows), n, recorder.NQ + recorder.NV + recorder.NSENSOR))
            for k, row in enumerate(rows):
                omega_0 = self._omega_0(row * self._interval, self._interval if row + 1 < self._count else 1)
                self._stepper.sample(omega_0[0], raw[k])
                self._stepper.advance(omega_0[1:])
            time = np.arange(rows.start, rows.stop, dtype=np.float64) * (self._interval * self._settings.timestep)
            yield [self._finish(i, time, raw[:, i]) for i in range(n)]
            if all(header.failure for header in self.headers):
                return

    def _omega_0(self, first: int, count: int) -> Array:
        """omega_0 in the middle of each step, shape (count, runs)."""
        time = (np.arange(first, first + count) + 0.5) * self._settings.timestep
        return np.stack([flow(time) for flow in self._flows], axis=-1)

    def _finish(self, i: int, time: Array, raw: Array) -> npt.NDArray[np.void]:
        """Samples of run i from raw rows, cut where they diverge."""
        p = self._parameters[i]
        qpos, qvel, sensors = np.split(raw, [recorder.NQ, recorder.NQ + recorder.NV], axis=1)
        good = np.logical_and.accumulate((np.abs(raw) < _HUGE).all(axis=1))
        sound = 0 if self.headers[i].failure else int(good.sum())
        block = recorder.samples(time[:sound], qpos[:sound], qvel[:sound], sensors[:sound], p)
        block["case"] = classify(block, p, self._settings)
        self.changes[i].add(block)
        if not self.headers[i].failure and sound < len(time):
            last = recorder.state(qpos[sound - 1], qvel[sound - 1], p) if sound else None
            self._fail(i, float(time[sound]), last)
        return block

    def _fail(self, i: int, time: float, last: Array | None) -> None:
        where = "" if last is None else " after " + ", ".join(
            f"{name} = {value:.6g} {unit}" for name, value, unit in zip(VARIABLES, last, UNITS, strict=True)
        )  # fmt: skip
        object.__setattr__(self.headers[i], "failure", f"diverged by t = {time:g} s{where}")


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
    trajectory = simulate_many(
        [p], [x0], t_end, flow, settings, sample_interval=sample_interval, theta_0=theta_0, progress=progress
    )[0]
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
    settings = settings or ContactSettings()
    run = Run(parameters, x0s, t_end, flows, settings, sample_interval=sample_interval, theta_0=theta_0)
    blocks: list[list[npt.NDArray[np.void]]] = [[] for _ in parameters]
    done = 0
    for parts in run:
        for kept, part in zip(blocks, parts, strict=True):
            kept.append(part)
        done += BLOCK
        if progress:
            progress(min(1.0, done / run.samples))
    return [
        Trajectory.from_blocks(header, kept, changes.events)
        for header, kept, changes in zip(run.headers, blocks, run.changes, strict=True)
    ]


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


class _Stepper(Protocol):
    """One or many simulations in the engine."""

    margins: Array
    """Margins of the contacts, shape (runs, 2), m."""

    def sample(self, omega_0: Array, row: Array) -> None:
        """Take one step; write (qpos, qvel, sensors) of its beginning to row (runs, 41); omega_0 (runs,)."""

    def advance(self, omega_0: Array) -> None:
        """Take a step for every row of omega_0 (steps, runs)."""


class _Single(_Stepper):
    """One simulation in plain floats, which beat arrays of one."""

    def __init__(self, model: Any, p: Parameters, settings: ContactSettings, start: tuple[Array, Array]) -> None:
        self._model, self._data = model, mujoco.MjData(model)
        self._data.qpos[:], self._data.qvel[:] = start
        self._p, self._settings = p, settings
        self.margins = model.pair_margin[None]

    def sample(self, omega_0: Array, row: Array) -> None:
        data = self._data
        row[0, : recorder.NQ], row[0, recorder.NQ : recorder.NQ + recorder.NV] = data.qpos, data.qvel
        self.advance(omega_0[None])
        row[0, recorder.NQ + recorder.NV :] = data.sensordata

    def advance(self, omega_0: Array) -> None:
        model, data, step, cos, sin = self._model, self._data, mujoco.mj_step, math.cos, math.sin
        qpos, qvel, drag, wall = data.qpos, data.qvel, data.qfrc_applied, data.mocap_quat[0]
        constraint, sensors, margins = data.qfrc_constraint, data.sensordata, model.pair_margin
        floor_slip, wall_slip = (model.geom_surfacevel[model.geom(name).id] for name in ("floor", "wall"))
        orientation = qpos[3:7]
        mc, R, r = self._p.m * self._p.c, self._p.R, self._p.r
        gain, reach = self._settings.servo_gain, float(self._settings.servo_reach(self._p.g))
        shift = self._settings.memory_gain(self._p.m)
        margin_A, margin_B = margins.tolist()
        for omega in omega_0[:, 0].tolist():
            theta, h, y, *_ = qpos.tolist()
            omega_c, v_h, v_y, *_ = qvel.tolist()
            wall[0], wall[3] = cos(theta / 2), sin(theta / 2)
            orientation[:] = _UPRIGHT
            drag[0], drag[1], drag[2] = -mc * (R - h) * (R - h) * (omega_c - omega), -mc * v_h, -mc * v_y
            if gain:
                if y < reach:
                    margins[0] = margin_A = max(0.0, margin_A - gain * y)
                if h < reach:
                    margins[1] = margin_B = max(0.0, margin_B - gain * h)
            if shift:
                _, force_h, force_y, moment_x, moment_y, _ = constraint.tolist()
                floor_slip[0], floor_slip[1] = -shift / r * moment_x, shift * (force_h - sensors[_NORMAL_B])
                wall_slip[0], wall_slip[1] = shift * (force_y - sensors[_NORMAL_A]), shift / r * moment_y
            step(model, data)


class _Many(_Stepper):
    """Many simulations in one batch; forces, walls and margins are array operations over all of them."""

    def __init__(
        self, models: Sequence[Any], parameters: Sequence[Parameters], settings: ContactSettings,
        start: Sequence[tuple[Array, Array]],
    ) -> None:  # fmt: skip
        self._batch = batch = Batch(models[0], nsim=len(models), nthread=1)
        _expand_differences(batch, models)
        self._qpos, self._qvel, self._sensors = (batch.bind(name) for name in ("qpos", "qvel", "sensordata"))
        self._qpos[:], self._qvel[:] = (np.stack(part) for part in zip(*start, strict=True))
        self._drag, self._wall = batch.bind("qfrc_applied"), batch.bind("mocap_quat")[:, 0]
        self._constraint = batch.bind("qfrc_constraint")
        self.margins = batch.expand("pair_margin")
        surface = batch.expand("geom_surfacevel")
        self._floor_slip, self._wall_slip = (surface[:, models[0].geom(name).id, :2] for name in ("floor", "wall"))
        self._minus_mc = np.array([[-p.m * p.c] for p in parameters])
        self._R = np.array([p.R for p in parameters])
        self._gain = settings.servo_gain
        self._reach = settings.servo_reach(np.array([[p.g] for p in parameters]))
        shift = np.array([settings.memory_gain(p.m) for p in parameters])
        r = np.array([p.r for p in parameters])
        self._shift, self._shift_r = shift, shift / r
        self._remembers = settings.memory

    def sample(self, omega_0: Array, row: Array) -> None:
        split = recorder.NQ + recorder.NV
        row[:, : recorder.NQ], row[:, recorder.NQ : split] = self._qpos, self._qvel
        self.advance(omega_0[None])
        row[:, split:] = self._sensors

    def advance(self, omega_0: Array) -> None:
        qpos, qvel, margins, wall = self._qpos, self._qvel, self.margins, self._wall
        gaps = qpos[:, 2:0:-1]
        velocity, drag = qvel[:, :3], self._drag[:, :3]
        half, rho = np.empty(len(qpos)), np.empty(len(qpos))
        for omega in omega_0:
            np.multiply(qpos[:, 0], 0.5, out=half)
            np.cos(half, out=wall[:, 0])
            np.sin(half, out=wall[:, 3])
            qpos[:, 3:7] = _UPRIGHT
            np.multiply(velocity, self._minus_mc, out=drag)
            np.subtract(self._R, qpos[:, 1], out=rho)
            drag[:, 0] -= self._minus_mc[:, 0] * omega
            drag[:, 0] *= rho * rho
            if self._gain:
                lower = margins - self._gain * gaps
                np.maximum(lower, 0.0, out=margins, where=gaps < self._reach)
            if self._remembers:
                self._remember()
            self._batch.step()

    def _remember(self) -> None:
        """Shift the surfaces by the last friction forces: A_z, A_x of the floor, B_y, B_z of the wall."""
        force, sensors, shift = self._constraint, self._sensors, self._shift
        np.multiply(force[:, 3], -self._shift_r, out=self._floor_slip[:, 0])
        np.multiply(force[:, 1] - sensors[:, _NORMAL_B], shift, out=self._floor_slip[:, 1])
        np.multiply(force[:, 2] - sensors[:, _NORMAL_A], shift, out=self._wall_slip[:, 0])
        np.multiply(force[:, 4], self._shift_r, out=self._wall_slip[:, 1])


def _expand_differences(batch: Batch, models: Sequence[Any]) -> None:
    """Give each simulation its own value of every model field in which the models differ."""
    for name in mujoco.batch.MODEL_FIELDS:
        owner, _, field = name.rpartition(".")
        values = [np.asarray(getattr(getattr(model, owner) if owner else model, field)) for model in models]
        if any(not np.array_equal(values[0], value) for value in values[1:]):
            batch.expand(name)[:] = np.stack(values)
