"""Event-driven simulation: each case by its own equations, from one change of case to the next.

`follow` goes along the coordinates of `coordinates` up to the guard that turns negative first, and
`transitions` says how to go on. All is compiled together, so that a run is one call, which threads
can make at once."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple, Self

import numpy as np
import numpy.typing as npt

from analytic.mechanics import dynamics
from analytic.mechanics.rigid_body import Forces
from analytic.simulation import compiling, coordinates, equations, motion, transitions
from analytic.simulation.coordinates import NONE
from analytic.simulation.equations import A_LANDS, AWAY, System
from analytic.simulation.integrator import StalledError, first_pace, stretch
from analytic.simulation.motion import HybridState, Recorder
from analytic.simulation.settings import ENDLESS, Settings
from analytic.simulation.solvers import DONE, FIRED, STUCK, Stretch
from model import Case, Contact, Flow, Parameters, State
from model.arrays import Array

_LEAST_JUMP = 1e-12
"""Change of the flow at a knot, relative to the largest flow, above which it is a jump."""
MAX_EVENTS_AT_ONCE = 100
"""Changes of case without any progress in time after which a run is given up."""
STRIDES, STEPS = 20, 1000
"""How often a case is followed, and steps each time, between two looks at progress and keyboard."""


class Stage(NamedTuple):
    """How far a run has come: the moment, the case, and what is counted."""

    at: HybridState
    case: int = NONE
    begun: int = 0
    """Pieces of the flow that have begun."""
    at_once: int = 0
    """Changes of case since the last progress in time."""


class Stop(NamedTuple):
    """What stops a run before its end."""

    impact: float
    """Normal impulse from which a landing counts, N s."""
    quiet: float
    """For how long nothing must land for the run to be stopped, s."""
    over: npt.NDArray[np.bool_]
    """Whether nobody wants it any more, shape (1,)."""


class Record(NamedTuple):
    """Arrays with what is kept of a run, a row a sample or event."""

    times: Array
    """Of the samples, s, shape (n,)."""
    x: Array
    """States (n, 8)."""
    case: npt.NDArray[np.int8]
    landings: npt.NDArray[np.int64]
    """Landings since the sample before (n,)."""
    path: Array
    """Azimuth, directions of slip, work, and omega_0 (n, 5); none where nobody wants them."""
    z: Array
    """For coordinates of samples that are not kept yet (n * MOST,)."""
    events: Array
    """Times, cases before and after, impulses (m, 9), from the last look on; none where nobody
    wants them."""
    taken: npt.NDArray[np.int64]
    """How many samples are kept, and how many events, shape (2,)."""
    reached: Array
    """How far the run is, and the sample at which it is stopped if nothing more lands, shape (2,),
    s."""
    stop: Stop

    @classmethod
    def of(cls, times: Array, x: Array, case: Any, landings: Any, stop: Stop, whole: bool) -> Self:
        """A new record that fills the arrays given; paths and events are kept only if the `whole`
        run is wanted."""
        n, events = (len(times), 3 * STRIDES) if whole else (0, 0)
        path, z = np.empty((n, 5)), np.empty(len(times) * coordinates.MOST)
        reached = [0.0, _quiet_from(0.0, times, stop.quiet)]
        landings[:] = 0
        taken = np.zeros(2, np.int64)
        return cls(
            times, x, case, landings, path, z, np.empty((events, 9)), taken, np.array(reached), stop
        )


def _state_parts(at: HybridState) -> tuple[Any, ...]:
    """The fields of a moment as a plain tuple."""
    return at.time, at.theta, at.x[:], at.alpha, at.beta, at.work


def follow(
    case: int, at: HybridState, until: float, k: System, run: Record, steps: int
) -> tuple[int, HybridState]:
    """Follow one case to the first guard, up to a time, or for so many steps: what ended it, and
    the moment then."""
    room = np.empty((6, coordinates.MOST))
    k, n = coordinates.begin(case, at, k, room[0], room[1])
    z, scale, rate, count = room[0, :n], room[1, :n], room[2, :n], coordinates.count_guards(k)
    values, arm, level = room[3, :count], room[4, :count], room[5, :count]
    lands, until = k.fall.landing <= until, min(until, k.fall.landing)
    equations.guards(at.time, z, k, values)
    opens = coordinates.arm_guards(values, k, arm, level)
    lasts = coordinates.rebound_time(at, z, k, rate)
    pace = first_pace(
        at.time, z, scale, case, opens, lasts / 20 if lasts < until - at.time else 0.0
    )
    if run.taken[0] == 0:
        _keep_sample(at, k, run)
    of = Stretch(
        k, until, z, scale, run.times, run.z[: n * len(run.times)].reshape(-1, n), arm, level
    )
    why, pace, guard, taken = stretch(of, pace, run.taken[0], steps)
    near = _keep_samples(of, at, taken, run)
    now = until if why == DONE else max(pace[0] + pace[1], run.times[taken - 1])
    run.reached[0] = now
    if run.stop.over[0]:
        raise InterruptedError("nobody wants the run any more")
    if why == STUCK:
        raise StalledError("steps become too short")
    fired = (
        coordinates.ENDS[case][guard]
        if why == FIRED
        else A_LANDS
        if lands and why == DONE
        else NONE
    )
    return fired, _with_nearest_azimuth(coordinates.hybrid_state(now, z, at, k), k, near)


def _with_nearest_azimuth(at: HybridState, k: System, near: float) -> HybridState:
    """The same moment; of the azimuths that it may have off the wall that which is nearest to
    another."""
    if k.case % 3 != AWAY:
        return at
    theta = at.theta - 2 * math.pi * math.floor((at.theta - near) / (2 * math.pi) + 0.5)
    return HybridState(at.time, theta, at.x, at.alpha, at.beta, at.work)


def _keep_samples(of: Stretch, at: HybridState, taken: int, run: Record) -> float:
    """Store samples up to number `taken` of a stretch that began at `at`; return the azimuth at the
    last, or `at`'s."""
    near = at.theta
    for row in range(run.taken[0], taken):
        m = _with_nearest_azimuth(
            coordinates.hybrid_state(run.times[row], of.samples[row], at, of.k), of.k, near
        )
        near = m.theta
        _keep_sample(m, of.k, run)
    return near


def _keep_sample(at: HybridState, k: System, run: Record) -> None:
    """Store a moment as the next sample."""
    row = run.taken[0]
    for i in range(8):
        run.x[row, i] = at.x[i]
    run.case[row] = k.case
    if len(run.path) > 0:
        path = run.path[row]
        path[0], path[1], path[2], path[3] = at.theta, at.alpha, at.beta, at.work
        path[4] = equations.fluid(at.time, k)
    run.taken[0] += 1


def _keep_event(run: Record, at: HybridState, case: int, after: int, impulse: Forces) -> None:
    """Store a change of case or an impact, and count landings."""
    if max(impulse.A_y, impulse.B_x) > run.stop.impact:
        run.landings[min(run.taken[0], len(run.times) - 1)] += 1
        run.reached[1] = _quiet_from(at.time, run.times, run.stop.quiet)
    if run.taken[1] < len(run.events):
        event = run.events[run.taken[1]]
        event[0], event[1], event[2] = at.time, case, after
        for i in range(6):
            event[3 + i] = impulse[i]
        run.taken[1] += 1


def _quiet_from(landed: float, times: Array, quiet: float) -> float:
    """Time of the first sample at which nothing has landed for `quiet` seconds, if nothing does
    from now on; or inf."""
    row = np.searchsorted(times, landed + quiet, side="right")
    return float(times[row]) if row < len(times) else math.inf


@compiling.compiled
def run_through_flow(
    stage: Stage, k: System, pieces: Any, run: Record, strides: int, steps: int
) -> tuple[Any, ...]:
    """Follow a run to its last sample, to where it is stopped, or for some strides: whether it is
    over, and its stage.

    The stage is in parts, plain tuples: a signal would be answered while numba makes named ones,
    which doesn't look whether it has got them.

    pieces : rows of start, end, the `equations.Line` of the flow, and whether it jumps at the start
    steps : in a stride, at most
    """
    at, case, begun, at_once = stage
    for n in range(max(begun - 1, 0), len(pieces)):
        piece = pieces[n]
        end = piece[1]
        k = equations.in_case(
            k, k.case, k.side, equations.Line(piece[2], piece[3], piece[4]), k.fall
        )
        if begun <= n:
            begun = n + 1
            if case == NONE or piece[5] != 0:
                before = at
                after, at, impulse = transitions.settle(at, k)
                if impulse.A_y > 0 or impulse.B_x > 0 or (case != NONE and after != case):
                    _keep_event(run, before, after if case == NONE else case, after, impulse)
                case = after
        while at.time < min(end, run.reached[1]):
            if strides == 0:
                return False, _state_parts(at), case, begun, at_once
            strides -= 1
            since = at.time
            guard, at = follow(case, at, min(end, run.reached[1]), k, run, steps)
            if guard != NONE:
                before = at
                after, at, impulse = transitions.react(guard, case, before, k)
                _keep_event(run, before, case, after, impulse)
                case = after
            at_once = at_once + 1 if at.time - since <= 1e-14 * end else 0
            if at_once > MAX_EVENTS_AT_ONCE:
                raise StalledError("no way on: one change of case follows the other")
    return True, _state_parts(at), case, begun, at_once


@lru_cache
def prepare(p: Parameters, flow: Flow, settings: Settings, t_end: float) -> tuple[System, Array]:
    """What runs of one ball in one flow share: the system, and pieces of the flow as rows of an
    array."""
    k, rows = motion.of_ball(p, flow, settings), []
    for start, end in pairwise([0.0, *flow.knots(t_end).tolist(), t_end]):
        jump = abs(float(flow.line(start) - flow.line(np.nextafter(start, -1.0))))
        rows.append(
            [
                start,
                end,
                *motion.line_of(flow, start),
                float(jump > _LEAST_JUMP * np.abs(flow.value).max()),
            ]
        )
    return k, np.array(rows)


def carry_out(
    start: HybridState,
    k: System,
    pieces: Array,
    rows: Callable[[], Record],
    look: Callable[[Record], None] | None = None,
) -> tuple[Record, Exception | None]:
    """Simulate a run into new arrays; return these and the error it broke down with, or None;
    `look` sees progress.

    Where the ball hardly leaves what it touches, round-off may stop it: it is then tried once more,
    with half of the tolerance.
    """
    failure: Exception | None = None
    for rtol in (k.rtol, k.rtol / 2):
        run, stage, done = rows(), Stage(start), False
        try:
            while not done:
                done, (time, theta, x, *rest), *far = run_through_flow(
                    stage, k._replace(rtol=rtol), pieces, run, STRIDES if look else ENDLESS, STEPS
                )
                stage = Stage(HybridState(time, theta, State(*x), *rest), *far)
                if look:
                    look(run)
            return run, None
        except InterruptedError as error:
            return run, error
        except ArithmeticError as error:
            failure = error
    return run, failure


def run(
    x0: State, theta_0: float, p: Parameters, flow: Flow, settings: Settings, recorder: Recorder
) -> None:
    """Simulate a run, event-driven, from state x0 and azimuth theta_0, and write it to the
    recorder.

    Raises `StalledError`, `NotConvergedError` if the integrator, the contact problem or the
    sequence of cases gets stuck."""
    times, events = recorder.times, recorder.events

    def rows() -> Record:
        events.clear()
        n = len(times)
        each = np.empty((n, 8)), np.empty(n, np.int8), np.empty(n, np.int64)
        return Record.of(times, *each, Stop(math.inf, math.inf, np.zeros(1, bool)), whole=True)

    def look(run: Record) -> None:
        count, run.taken[1] = int(run.taken[1]), 0
        recorder.note(run.events[:count], float(run.reached[0]))

    done, failure = carry_out(
        HybridState(0.0, theta_0, x0), *prepare(p, flow, settings, float(times[-1])), rows, look
    )
    events += done.events[: done.taken[1]].tolist()
    recorder.time = max(recorder.time, float(done.reached[0]))
    if count := int(done.taken[0]):
        path = done.path[:count]
        x, codes, forces = done.x[:count], done.case[:count], np.empty((count, 6))
        for case in map(Case, np.unique(codes)):  # in RR those of least utilisation
            here = codes == case
            _, alpha, beta, _, omega_0 = path[here].T
            slip_A = (np.sin(alpha), np.cos(alpha)) if case.A is Contact.S else None
            slip_B = (np.sin(beta), np.cos(beta)) if case.B is Contact.S else None
            f = dynamics.forces(case, State.of(x[here]), p, omega_0, slip_A, slip_B)
            forces[here] = np.stack(np.broadcast_arrays(*f, alpha)[:6], axis=-1)
        recorder.add(times[:count], path[:, 0], x, forces, codes, path[:, 3])
    if failure:
        raise failure
