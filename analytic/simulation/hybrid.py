"""Event-driven simulation: each case by its own equations, from one change of case to the next.

`go_through` is one text: `whole_runs` compiles it, with a `follow` and a `note` of its own. Here `integrator` follows
the coordinates of `charts` up to the guard that turns negative first (with Stokes' drag RR is known in closed form),
and `transitions` says how to go on.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

from analytic.mechanics import dynamics
from analytic.mechanics.rigid_body import Forces
from analytic.simulation import charts, equations, motion, transitions, two_point_rolling
from analytic.simulation.charts import NONE, Chart
from analytic.simulation.equations import A_LANDS, RR, RR_ENDS, Motion
from analytic.simulation.integrator import StalledError, Stretch
from analytic.simulation.motion import REPORT_EVERY, Event, Fluid, Moment, Path, Recorder
from analytic.simulation.settings import Settings
from model import Case, Contact, Flow, Parameters, State
from model.arrays import Array, Real

_LEAST_JUMP = 1e-12
"""Change of the flow at a knot, relative to the largest flow, above which it is a jump."""
MAX_EVENTS_AT_ONCE = 100
"""Changes of case without any progress in time after which a run is given up."""


def go_through(at: Moment, k: Motion, pieces: Any, run: Any) -> None:
    """From a moment to the last sample, or to when the run is stopped.

    pieces : rows of start, end, the `equations.Line` of the flow, and whether it jumps at the start
    run : keeps what `follow` and `note` find
    """
    case, at_once, impact = NONE, 0, False
    for n in range(len(pieces)):
        piece = pieces[n]
        end = piece[1]
        k = equations.changed(k, k.case, k.side, equations.Line(piece[2], piece[3], piece[4]), k.fall)
        if case == NONE or piece[5] != 0:
            before = at
            after, at, impulse = transitions.settle(at, k)
            impact = impulse.A_y > 0 or impulse.B_x > 0
            if impact or (case != NONE and after != case):
                note(run, before, after if case == NONE else case, at, after, impulse)
            case = after
        while at.time < min(end, run.stop[0]):
            since = at.time
            guard, before = follow(case, at, min(end, run.stop[0]), k, run)
            at = before
            if guard != NONE:
                after, at, impulse = transitions.react(guard, case, before, k)
                note(run, before, case, at, after, impulse)
                case = after
            at_once = at_once + 1 if at.time - since <= 1e-14 * end else 0
            if at_once > MAX_EVENTS_AT_ONCE:
                raise StalledError("no way on: one change of case follows the other")


def pieces(flow: Flow, t_end: float) -> list[list[float]]:
    """Those of a flow, as `go_through` takes them."""
    rows = []
    for start, end in pairwise([0.0, *flow.knots(t_end).tolist(), t_end]):
        jump = abs(float(flow.line(start) - flow.line(np.nextafter(start, -1.0))))
        rows.append([start, end, *Fluid.of(flow, start).line(), float(jump > _LEAST_JUMP * np.abs(flow.value).max())])
    return rows


def run(x0: State, theta_0: float, p: Parameters, flow: Flow, settings: Settings, recorder: Recorder) -> None:
    """Simulate from state x0 and record; the contract of `simulation.simulate`.

    Raises `StalledError`, `NotConvergedError` if the integrator, the contact problem or the sequence of cases gets
    stuck.
    """
    following, t_end = _Run(p, settings, recorder), float(recorder.times[-1])
    try:
        k = motion.of_ball(p, Fluid.of(flow, 0.0), settings)
        go_through(Moment(0.0, theta_0, x0), k, pieces(flow, t_end), following)
    finally:
        following.hand_over()


class _Run:
    """What a run in Python keeps."""

    stop = (math.inf,)

    def __init__(self, p: Parameters, settings: Settings, recorder: Recorder) -> None:
        self.p, self.leave_rolling, self.recorder, self.steps = p, settings.leave_rolling, recorder, 0
        self.sampled: list[tuple[int, Path, Array]] = []
        """Stretches of samples: the case, the path, and omega_0 along it."""
        self.taken = 0

    def keep(self, case: int, path: Path, wanted: npt.NDArray[np.bool_], fluid: Fluid) -> Moment:
        """Keep those moments of a path that are samples; the last one of all."""
        if np.any(wanted):
            kept = Path(*(column[wanted] for column in path))
            self.sampled.append((case, kept, np.asarray(fluid(kept.time))))
            self.taken += len(kept.time)
        self.recorder.reached(float(path.time[-1]))
        at = Moment(*(column[-1].tolist() for column in path))
        return at._replace(x=State(*at.x))

    def hand_over(self) -> None:
        """Record all samples: forces of one case after the other, since that is quicker than of one path."""
        if not self.sampled:
            return
        cases, paths, fluids = zip(*self.sampled, strict=True)
        path, omega_0 = Path(*map(np.concatenate, zip(*paths, strict=True))), np.concatenate(fluids)
        case, forces = np.repeat(cases, [len(each.time) for each in paths]), np.empty((len(omega_0), 6))
        for each in set(cases):
            here = case == each
            forces[here] = path_forces(Case(each), Path(*(column[here] for column in path)), self.p, omega_0[here])
        self.recorder.add(path.time, path.theta, path.x, forces, case, path.work)


def note(run: _Run, before: Moment, case: int, at: Moment, after: int, impulse: Forces) -> None:
    """Keep an event between two moments."""
    run.recorder.events.append(Event(at.time, Case(case), Case(after), impulse))


def follow(case: int, at: Moment, until: float, k: Motion, run: _Run) -> tuple[int, Moment]:
    """One case up to the first guard or `until`; samples are recorded even if it is interrupted."""
    wanted, fluid = run.recorder.times, Fluid(*k.line, k.waves)
    if case == RR and k.stokes:
        end = two_point_rolling.end(at, until, run.p, fluid, run.leave_rolling)
        stop, first = until if end is None else end, not run.taken
        times = wanted[slice(*np.searchsorted(wanted, [-1.0 if first else at.time, stop], side="right"))]
        path = two_point_rolling.path(np.append(times, stop), at, run.p, fluid)
        return NONE if end is None else RR_ENDS, run.keep(case, path, np.arange(len(times) + 1) < len(times), fluid)
    chart = Chart.of(case, at, k)
    landing = chart.k.fall.landing
    lands, until = landing <= until, min(until, landing)
    moments: list[Array | list[float]] = [[at.time]]
    states: list[Array | list[list[float]]] = [[chart.start]]
    sampled, guard = [run.taken == 0], NONE
    lasts = charts.hop(at, chart.start, chart.k, chart.start.copy())
    try:
        for step in Stretch(chart, at.time, until, wanted).steps(lasts / 20 if lasts < until - at.time else None):
            if len(step.samples):
                moments.append(step.sample_times)
                states.append(step.samples)
            moments.append([step.time])
            states.append([step.z])
            sampled += [True] * len(step.samples) + [False]
            guard = step.guard
            run.steps += step.stands_for
            if run.steps >= REPORT_EVERY:
                run.steps = 0
                run.recorder.reached(step.time)
    finally:
        path = chart.path(np.concatenate(moments), np.concatenate(states).T)
        last = run.keep(case, path, np.array(sampled), fluid)
    return A_LANDS if guard == NONE and lands else guard, last


def path_forces(case: Case, path: Path, p: Parameters, omega_0: Real) -> Array:
    """Contact forces along a path, shape (n, 6), N; in RR those of least utilisation."""
    slip_A = (np.sin(path.alpha), np.cos(path.alpha)) if case.A is Contact.S else None
    slip_B = (np.sin(path.beta), np.cos(path.beta)) if case.B is Contact.S else None
    f = dynamics.forces(case, State.of(path.x), p, omega_0, slip_A, slip_B)
    return np.stack(np.broadcast_arrays(*f, path.time)[:6], axis=-1)
