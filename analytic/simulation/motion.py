"""Data of simulations: the ball in its flow, a hybrid state, and the record of a run."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple, Self

import numpy as np
import numpy.typing as npt

from analytic.mechanics import drag, rigid_body
from analytic.mechanics.rigid_body import Forces
from analytic.simulation import equations
from analytic.simulation.equations import Line, System
from analytic.simulation.settings import Settings
from model import Case, Events, Flow, Header, Parameters, State, Trajectory
from model.arrays import Array
from model.drag import STOKES
from model.trajectory import samples

PATH = 8
"""Numbers of a sample beside its state: as many as time stepping has."""
AT_ONCE = 10_000
"""Most events, or time steps, between two looks at progress and keyboard."""


class HybridState(NamedTuple):
    """A state with its time and azimuth, the directions of slip, and the work done so far."""

    time: float
    theta: float
    x: State
    alpha: float = math.nan
    """Direction of slip at A (8), rad; at the very onset the state doesn't determine it."""
    beta: float = math.nan
    """Direction of slip at B (8), rad."""
    work: float = 0.0
    """Work of drag, friction and impacts so far, J."""


def line_of(flow: Flow, start: float) -> Line:
    """The linear piece of a flow, without waves, that holds from `start`, s: a knot, or 0."""
    k = int(np.searchsorted(flow.start, start, side="right")) - 1
    if k < 0:
        return Line(float(start), float(flow.value[0]), 0.0)
    return Line(float(flow.start[k]), float(flow.value[k]), float(flow.slope[k]))


def of_ball(p: Parameters, flow: Flow, settings: Settings) -> System:
    """A ball's constants as plain numbers, with the flow at first; `in_case` sets the case."""
    ball = p.m, p.r, p.R, p.j, p.mu, p.eta, p.g, p.c
    rules = {"slip-stability": equations.STABILITY, "infeasible": equations.FEASIBILITY}
    asked = float(settings.rtol), float(settings.restitution), rules[settings.leave_rolling]
    unit, waves = math.sqrt(p.R / p.g), flow.waves * [1.0, 2 * math.pi, 1.0]
    units, line = (unit, p.R / (unit * p.r)), line_of(flow, 0.0)
    fixed = *ball, drag.law(p), p.drag == STOKES, *asked, *units, waves
    return System(*fixed, line, int(Case.NN), 0.0, equations.NO_FALL)


class Rows(NamedTuple):
    """What is kept of a run, a row a sample or event, in arrays that compiled code fills."""

    times: Array
    """Of the samples, s, shape (n,)."""
    x: Array
    """States (n, 8); of event-driven runs coordinates first, until a stretch has ended."""
    case: npt.NDArray[np.int8]
    landings: npt.NDArray[np.int64]
    """Landings since the sample before (n,)."""
    path: Array
    """Azimuth, work of drag and contacts since the start, and what the simulator has its forces
    from (n, PATH); none where nobody wants them."""
    events: Array
    """Times, codes of the cases before and after, impulses A_x … B_z (m, 9), from the last look on;
    none where nobody wants them."""
    taken: npt.NDArray[np.int64]
    """How many samples are kept, and how many events, shape (2,)."""
    reached: Array
    """How far the run is, and when it is stopped if nothing more lands, shape (2,), s."""
    quiet: float
    """For how long nothing must land for the run to be stopped, s."""
    over: npt.NDArray[np.bool_]
    """Whether nobody wants it any more, shape (1,)."""

    @classmethod
    def filling(
        cls,
        times: Array,
        x: Array,
        case: npt.NDArray[np.int8],
        landings: npt.NDArray[np.int64],
        quiet: float,
        over: npt.NDArray[np.bool_],
    ) -> Self:
        """Rows that fill the arrays given, without paths and events."""
        none = np.empty((0, PATH)), np.empty((0, 9))
        return cls(times, x, case, landings, *none, np.zeros(2, np.int64), np.zeros(2), quiet, over)


def keep_sample(x: State, case: int, run: Rows) -> int:
    """Store the next sample; return its row."""
    row = int(run.taken[0])
    run.x[row], run.case[row] = x, case
    run.taken[0] += 1
    return row


def keep_event(time: float, case: int, after: int, impulse: Forces, run: Rows) -> None:
    """Store a change of case or an impact, where events are wanted."""
    if run.taken[1] < len(run.events):
        event = run.events[run.taken[1]]
        event[0], event[1], event[2] = time, case, after
        event[3:] = impulse
        run.taken[1] += 1


def count_landings(time: float, count: int, run: Rows) -> None:
    """Count landings: the run is stopped when it has been quiet for long after them."""
    run.landings[min(run.taken[0], len(run.times) - 1)] += count
    run.reached[1] = quiet_from(time, run)


def quiet_from(landed: float, run: Rows) -> float:
    """When nothing has landed for `quiet` seconds, if nothing lands from now on, s; or inf."""
    row = np.searchsorted(run.times, landed + run.quiet, side="right")
    return float(run.times[row]) if row < len(run.times) else math.inf


class Recorder:
    """Collects a run; what it holds at any moment makes a `Trajectory`."""

    def __init__(self, rows: Rows, progress: Callable[[float], None] | None = None) -> None:
        self.rows = rows
        self.events: list[list[float]] = []
        """Those that were taken out of the rows so far."""
        self._progress = progress

    @classmethod
    def whole(cls, times: Array, progress: Callable[[float], None] | None = None) -> Self:
        """One for all that a run tells; `times` are those to sample at, s, increasing."""
        n = len(times)
        each = np.empty((n, 8)), np.empty(n, np.int8), np.zeros(n, np.int64)
        rows = Rows.filling(times, *each, math.inf, np.zeros(1, bool))
        rows = rows._replace(path=np.empty((n, PATH)), events=np.empty((AT_ONCE, 9)))
        return cls(rows, progress)

    def begin(self) -> Rows:
        """Begin a run, or begin it anew: empty rows."""
        run = self.rows
        self.events.clear()
        run.landings[:], run.taken[:], run.reached[:] = 0, 0, (0.0, quiet_from(0.0, run))
        return run

    def look(self) -> None:
        """Take events out of the rows, and tell how far the run has come."""
        self._take_events()
        if self._progress:
            self._progress(float(self.rows.reached[0] / self.rows.times[-1]))

    def _take_events(self) -> None:
        self.events += self.rows.events[: self.rows.taken[1]].tolist()
        self.rows.taken[1] = 0

    def trajectory(self, header: Header, forces: Callable[[Rows, Parameters], Array]) -> Trajectory:
        """The run so far, with ``energy_residual`` and ``energy_scale``, J, among its settings.

        The residual is the largest |change of energy - work of drag, friction and impacts| at a
        sample. `forces` gives those of the samples, (n, 6) in the order A_x … B_z, N."""
        self._take_events()
        run, count, p = self.rows, int(self.rows.taken[0]), header.parameters
        state, (theta, work, *_) = State(*run.x[:count].T), run.path[:count].T
        block, on_ball = samples(run.times[:count], theta, state, p), forces(run, p)
        block["force_A"], block["force_B"] = on_ball[:, :3], on_ball[:, 3:]
        block["case"] = run.case[:count]
        energy = rigid_body.energy(state.y, rigid_body.velocities(state, p), p)
        gained = energy - work
        balance = {  # an impact may precede the first sample
            "energy_residual": float(np.abs(gained - gained[:1]).max(initial=0.0)),
            "energy_scale": float(np.abs([energy, work]).max(initial=0.0)),
        }
        rows = np.array(self.events, dtype=float).reshape(-1, 9)
        cases = rows[:, 1:3].astype(np.int8)
        events = Events(
            time=rows[:, 0],
            from_case=cases[:, 0],
            to_case=cases[:, 1],
            impulse_A=rows[:, 3:6],
            impulse_B=rows[:, 6:],
        )
        header = replace(header, settings={**header.settings, **balance})
        return Trajectory.from_blocks(header, [block], events)
