"""Event-driven simulation: each case by its own equations, from one change of case to the next.

`follow` goes along the coordinates of `coordinates` up to the guard that turns negative first, and
`transitions` says how to go on. All is compiled together, so that a run is one call, which threads
can make at once."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from analytic.mechanics import dynamics
from analytic.mechanics.rigid_body import Forces
from analytic.simulation import compiling, coordinates, equations, motion, transitions
from analytic.simulation.equations import A_LANDS, AWAY, NONE, System
from analytic.simulation.integrator import StalledError, stretch
from analytic.simulation.motion import HybridState, Recorder, Rows
from analytic.simulation.settings import LANDED, Settings
from analytic.simulation.solvers import DONE, FIRED, STUCK, Stretch
from model import Case, Contact, Flow, Parameters, State
from model.arrays import Array

_LEAST_JUMP = 1e-12
"""Change of the flow at a knot, relative to the largest flow, above which it is a jump."""
MAX_EVENTS_AT_ONCE = 100
"""Changes of case without any progress in time after which a run is given up."""
STRIDES, STEPS, ENDLESS = 20, 1000, 2**62
"""How often a case is followed, and steps each time, between two looks at progress and keyboard;
and as many as there are, of a run that nobody looks at."""


class Stage(NamedTuple):
    """How far a run has come: the hybrid state, the case, and what is counted."""

    at: HybridState
    case: int = NONE
    begun: int = 0
    """Pieces of the flow that have begun."""
    at_once: int = 0
    """Changes of case since the last progress in time."""


def _state_parts(at: HybridState) -> tuple[Any, ...]:
    """The fields of a hybrid state as a plain tuple."""
    return at.time, at.theta, at.x[:], at.alpha, at.beta, at.work


def follow(
    case: int, at: HybridState, until: float, k: System, run: Rows, steps: int
) -> tuple[int, HybridState]:
    """Follow a case to a guard, a time, or for so many steps: what ended it, and the state then."""
    room = np.empty((6, coordinates.MOST))
    k, n = coordinates.begin(case, at, k, room[0], room[1])
    z, scale, rate, count = room[0, :n], room[1, :n], room[2, :n], coordinates.count_guards(k)
    values, arm, level = room[3, :count], room[4, :count], room[5, :count]
    lands, until = k.fall.landing <= until, min(until, k.fall.landing)
    equations.guards(at.time, z, k, values)
    opens = coordinates.arm_guards(values, k, arm, level)
    lasts = coordinates.rebound_time(at, z, k, rate)
    first = lasts / 20 if lasts < until - at.time else 0.0
    small = coordinates.least_slip(z, scale, case) < equations.ONSET_SLIP
    # where a contact opens, a straight line is tried at once
    pace = at.time, 0.0, 0.0 if small else first, small, 1 if opens else 0
    if run.taken[0] == 0:
        _keep_sample(at, k, run)
    of = Stretch(k, until, z, scale, run.times, run.x, arm, level)
    why, pace, guard, taken = stretch(of, pace, run.taken[0], steps)
    near = _keep_samples(of, at, taken, run)
    now = until if why == DONE else max(pace[0] + pace[1], run.times[taken - 1])
    run.reached[0] = now
    if run.over[0]:
        raise InterruptedError("nobody wants the run any more")
    if why == STUCK:
        raise StalledError("steps become too short")
    fired = NONE
    if why == FIRED:
        fired = equations.ENDS[case][guard]
    elif lands and why == DONE:
        fired = A_LANDS
    return fired, _with_nearest_azimuth(coordinates.hybrid_state(now, z, at, k), k, near)


def _with_nearest_azimuth(at: HybridState, k: System, near: float) -> HybridState:
    """The state with that of its azimuths, off the wall up to whole turns, which is nearest."""
    if k.case % 3 != AWAY:
        return at
    theta = at.theta - 2 * math.pi * math.floor((at.theta - near) / (2 * math.pi) + 0.5)
    return HybridState(at.time, theta, at.x, at.alpha, at.beta, at.work)


def _keep_samples(of: Stretch, at: HybridState, taken: int, run: Rows) -> float:
    """Store samples up to number `taken` of a stretch begun at `at`; return the last azimuth."""
    near = at.theta
    for row in range(run.taken[0], taken):
        m = coordinates.hybrid_state(run.times[row], of.samples[row, : len(of.z)], at, of.k)
        m = _with_nearest_azimuth(m, of.k, near)
        near = m.theta
        _keep_sample(m, of.k, run)
    return near


def _keep_sample(at: HybridState, k: System, run: Rows) -> None:
    """Store a hybrid state as the next sample, and what its forces follow from."""
    row = motion.keep_sample(at.x, k.case, run)
    if len(run.path) > 0:
        run.path[row, :5] = at.theta, at.work, at.alpha, at.beta, equations.fluid(at.time, k)


def _keep_event(
    at: HybridState, case: int, after: int, impulse: Forces, k: System, run: Rows
) -> None:
    """Store a change of case or an impact, and count landings."""
    least = LANDED * k.m * math.sqrt(k.g * k.R) * (1 + k.restitution)
    if max(impulse.A_y, impulse.B_x) > least:
        motion.count_landings(at.time, 1, run)
    motion.keep_event(at.time, case, after, impulse, run)


@compiling.compiled
def run_through_flow(
    stage: Stage, k: System, pieces: Any, run: Rows, strides: int, steps: int
) -> tuple[Any, ...]:
    """Follow a run to its last sample or stop, or for some strides: is it over, and its stage.

    The stage is in parts, plain tuples: a signal would be answered while numba makes named ones,
    which doesn't look whether it has got them.

    pieces : rows of start, end, the `equations.Line` of the flow, and whether it jumps at the start
    steps : in a stride, at most"""
    at, case, begun, at_once = stage
    for n in range(max(begun - 1, 0), len(pieces)):
        piece = pieces[n]
        end = piece[1]
        line = equations.Line(piece[2], piece[3], piece[4])
        k = equations.in_case(k, k.case, k.side, line, k.fall)
        if begun <= n:
            begun = n + 1
            if case == NONE or piece[5] != 0:
                before = at
                after, at, impulse = transitions.settle(at, k)
                if impulse.A_y > 0 or impulse.B_x > 0 or (case != NONE and after != case):
                    _keep_event(before, after if case == NONE else case, after, impulse, k, run)
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
                _keep_event(before, case, after, impulse, k, run)
                case = after
            at_once = at_once + 1 if at.time - since <= 1e-14 * end else 0
            if at_once > MAX_EVENTS_AT_ONCE:
                raise StalledError("no way on: one change of case follows the other")
    return True, _state_parts(at), case, begun, at_once


@lru_cache
def prepare(p: Parameters, flow: Flow, settings: Settings, t_end: float) -> tuple[System, Array]:
    """What runs of one ball in one flow share: the system, and pieces of the flow as rows."""
    rows, least = [], _LEAST_JUMP * np.abs(flow.value).max()
    for start, end in pairwise([0.0, *flow.knots(t_end).tolist(), t_end]):
        jump = abs(float(flow.line(start) - flow.line(np.nextafter(start, -1.0))))
        rows.append([start, end, *motion.line_of(flow, start), float(jump > least)])
    return motion.of_ball(p, flow, settings), np.array(rows)


def carry_out(
    x0: State, theta_0: float, p: Parameters, flow: Flow, settings: Settings, recorder: Recorder
) -> None:
    """Simulate a run, event-driven, from state x0 and azimuth theta_0.

    Where the ball hardly leaves what it touches, round-off may stop it: it is then tried once more,
    with half of the tolerance. Raises `StalledError`, `NotConvergedError` if the integrator, the
    contact problem or the sequence of cases gets stuck."""
    start, times = HybridState(0.0, theta_0, x0), recorder.rows.times
    k, pieces = prepare(p, flow, settings, float(times[-1]))
    try:
        _carry_out(start, k, pieces, recorder)
    except ArithmeticError:
        _carry_out(start, k._replace(rtol=k.rtol / 2), pieces, recorder)


def _carry_out(start: HybridState, k: System, pieces: Array, recorder: Recorder) -> None:
    """As `carry_out`, at one tolerance."""
    run, stage, done = recorder.begin(), Stage(start), False
    strides = STRIDES if len(run.path) else ENDLESS
    while not done:
        done, parts, *far = run_through_flow(stage, k, pieces, run, strides, STEPS)
        time, theta, x, *rest = parts
        stage = Stage(HybridState(time, theta, State(*x), *rest), *far)
        recorder.look()


def sample_forces(run: Rows, p: Parameters) -> Array:
    """Forces of the samples (n, 6), N; in RR those of least friction utilisation."""
    count = int(run.taken[0])
    x, codes, forces = run.x[:count], run.case[:count], np.empty((count, 6))
    for case in map(Case, np.unique(codes)):
        here = codes == case
        alpha, beta, omega_0 = run.path[:count][here, 2:5].T
        slip_A = (np.sin(alpha), np.cos(alpha)) if case.A is Contact.S else None
        slip_B = (np.sin(beta), np.cos(beta)) if case.B is Contact.S else None
        f = dynamics.forces(case, State.of(x[here]), p, omega_0, slip_A, slip_B)
        forces[here] = np.stack(np.broadcast_arrays(*f, alpha)[:6], axis=-1)
    return forces
