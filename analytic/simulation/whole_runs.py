"""Event-driven runs from start to end in one compiled call, which threads can make at once.

The text is that of `hybrid.go_through` and all that it calls, but for `follow` and `note`: samples are states alone, RR
is integrated under every law of drag, and where steps become too short the run ends.
"""

from __future__ import annotations

import math
import sys
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from analytic.mechanics import contact_problem, drag, rigid_body
from analytic.mechanics.rigid_body import Forces
from analytic.simulation import charts, compiling, equations, hybrid, motion, solvers, transitions
from analytic.simulation.charts import NONE
from analytic.simulation.equations import A_LANDS, Motion
from analytic.simulation.integrator import StalledError
from analytic.simulation.motion import REPORT_EVERY, Fluid, Moment
from analytic.simulation.settings import Settings
from model import Flow, Parameters, State
from model.arrays import Array


class Course(NamedTuple):
    """The rows of an `Ensemble` that belong to a run, and how it goes on."""

    times: Array
    x: Array
    case: npt.NDArray[np.int8]
    landings: npt.NDArray[np.int64]
    blow: float
    """Normal impulse from which a landing counts, N s."""
    quiet: float
    """For how long nothing must land for the run to be stopped, s."""
    stop: Array
    """The sample at which it is, if nothing more lands, shape (1,), s."""
    taken: npt.NDArray[np.int64]
    """Samples taken, shape (1,)."""
    over: npt.NDArray[np.bool_]
    """Whether nobody wants it any more, shape (1,)."""


@compiling.in_place_of(hybrid.note)
def _note(run: Course, before: Moment, case: int, at: Moment, after: int, impulse: Forces) -> None:
    if max(impulse.A_y, impulse.B_x) > run.blow:
        run.landings[min(run.taken[0], len(run.times) - 1)] += 1
        run.stop[0] = stop(at.time, run.times, run.quiet)


@compiling.in_place_of(hybrid.follow)
def _follow(case: int, at: Moment, until: float, k: Motion, run: Course) -> tuple[int, Moment]:
    room = np.empty((6, charts.MOST))
    k, n = charts.begin(case, at, k, room[0], room[1])
    z, scale, rate, count = room[0, :n], room[1, :n], room[2, :n], charts.count_ends(k)
    values, arm, level = room[3, :count], room[4, :count], room[5, :count]
    lands, until = k.fall.landing <= until, min(until, k.fall.landing)
    equations.guards(at.time, z, k, values)
    opens, lasts = charts.levels(values, k, arm, level), charts.hop(at, z, k, rate)
    pace = solvers.first_pace(at.time, z, scale, case, opens, lasts / 20 if lasts < until - at.time else 0.0)
    if run.taken[0] == 0:
        _sample(case, at, run)
    samples = np.empty((np.searchsorted(run.times, until, side="right") + 1, n))
    why, guard, now = solvers.PAUSED, NONE, at.time
    most = int(np.int64(REPORT_EVERY))  # a constant would be compiled for itself
    while why == solvers.PAUSED:
        first = run.taken[0]
        why, pace, guard, taken = solvers.stretch(k, pace, until, z, scale, run.times, first, samples, arm, level, most)
        if run.over[0]:
            raise InterruptedError("nobody wants the run any more")
        if why == solvers.STUCK:
            raise StalledError("steps become too short")
        for row in range(first, taken):
            _sample(case, charts.moment(run.times[row], samples[row], at, k), run)
        now = until if why == solvers.DONE else max(pace[0] + pace[1], run.times[taken - 1])
    fired = charts.ENDS[case][guard] if why == solvers.FIRED else A_LANDS if lands else NONE
    return fired, charts.moment(now, z, at, k)


def stop(landed: float, times: Array, quiet: float) -> float:
    """The sample at which a run is quiet if nothing lands after a time; inf if there is none."""
    row = np.searchsorted(times, landed + quiet, side="right")
    return times[row] if row < len(times) else math.inf


def _sample(case: int, at: Moment, run: Course) -> None:
    """Take the next sample."""
    row = run.taken[0]
    for i in range(8):
        run.x[row, i] = at.x[i]
    run.case[row] = case
    run.taken[0] += 1


TEXT = (_sample, stop)


carry_out = compiling.compiled(
    compiling.read(drag, rigid_body, contact_problem, equations, transitions, charts, solvers, sys.modules[__name__])
)(hybrid.go_through)
"""A run from a moment on, into its rows."""


@lru_cache
def _given(p: Parameters, flow: Flow, settings: Settings, t_end: float) -> tuple[Motion, Array]:
    """What runs of one ball in one flow share."""
    k = motion.of_ball(p, Fluid.of(flow, 0.0), settings)
    k = k._replace(waves=np.array(k.waves, dtype=float).reshape(-1, 3))
    return k, np.array(hybrid.pieces(flow, t_end))


def carried_out(x0: State, p: Parameters, flow: Flow, settings: Settings, rows: Course) -> bool:
    """A run into its rows; whether compiled steps could carry it out."""
    try:
        carry_out(Moment(0.0, 0.0, x0), *_given(p, flow, settings, float(rows.times[-1])), rows)
    except ArithmeticError:
        return False
    return True
