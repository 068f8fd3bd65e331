"""Many steps at once: the loops of time stepping, compiled where numba is installed."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from analytic.compiling import compiled
from analytic.stepping import At, Ball, Constants, step
from model.arrays import Array


class Flow(NamedTuple):
    """Arrays of a `model.Flow`."""

    start: Array
    value: Array
    slope: Array
    waves: Array


@compiled
def _state(at: At, p: Constants) -> tuple[float, float, float, float, float, float, float, float]:
    """The variables of `model.State`."""
    v_h, v_y, v_k, o_x, o_y, o_z = at.u
    return at.y, v_y, v_k / (p.R - at.h), o_x - v_k / p.r, o_y + v_k / p.r, o_z - v_y / p.r, at.h, v_h


@compiled
def advance(
    ball: Ball, start: float, dt: float, first: int, count: int, flow: Flow, p: Constants, events: Array
) -> tuple[Ball, int, int]:
    """Go on from step `first` of `count` that begin at `start`; return the ball, the next step, and events noted.

    A row of `events` takes time, code of the case before and after, impulses of landings. It ends early when no row
    is left, or when a step doesn't converge.
    """
    noted, k = 0, first
    while k < count and noted < len(events):
        before, ball = ball.case, step(ball, dt, _fluid(flow, start + (k + 0.5) * dt), p)
        k += 1
        if ball.residual != 0:
            break
        if ball.case != before or ball.impact.A_y > 0 or ball.impact.B_x > 0:
            events[noted, 0], events[noted, 1], events[noted, 2] = start + k * dt, before, ball.case
            events[noted, 3], events[noted, 4], events[noted, 5] = ball.impact.A_x, ball.impact.A_y, ball.impact.A_z
            events[noted, 6], events[noted, 7], events[noted, 8] = ball.impact.B_x, ball.impact.B_y, ball.impact.B_z
            noted += 1
    return ball, k, noted


@compiled
def follow(
    ball: Ball,
    starts: Array,
    dts: Array,
    counts: npt.NDArray[np.int64],
    sampled: npt.NDArray[np.bool_],
    quiet: float,
    flow: Flow,
    p: Constants,
    x: Array,
    case: npt.NDArray[np.int8],
    landings: npt.NDArray[np.int64],
) -> float:
    """One run through stretches of steps, into the rows of an `Ensemble`; return its end, less than 0 if it failed.

    Rows beyond the end of a run that has been quiet for long repeat its last state.
    """
    row, now, landed, known = 1, 0.0, 0.0, 0
    for s in range(len(starts)):
        for k in range(counts[s]):
            now = float(starts[s] + (k + 1) * dts[s])
            ball = step(ball, dts[s], _fluid(flow, now - dts[s] / 2), p)
            if ball.residual != 0:
                return -now
            if ball.landings > known:
                landings[row] += ball.landings - known
                known, landed = ball.landings, now
        if sampled[s]:
            x[row, 0], x[row, 1], x[row, 2], x[row, 3], x[row, 4], x[row, 5], x[row, 6], x[row, 7] = _state(ball.at, p)
            case[row] = ball.case
            row += 1
            if now - landed > quiet:
                x[row:] = x[row - 1]
                case[row:] = case[row - 1]
                return now
    return now


@compiled
def _fluid(flow: Flow, time: float) -> float:
    """`model.Flow` at a time."""
    k = 0
    if len(flow.start) > 1:
        k = max(int(np.searchsorted(flow.start, time, side="right")) - 1, 0)
    omega_0 = flow.value[k] + flow.slope[k] * max(time - flow.start[k], 0.0)
    for n in range(len(flow.waves)):
        omega_0 += flow.waves[n, 0] * math.sin(2 * math.pi * flow.waves[n, 1] * time + flow.waves[n, 2])
    return float(omega_0)
