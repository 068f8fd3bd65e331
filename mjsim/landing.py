"""Landings: where in a step they are, and how the ball goes on from there.

A ball that lands is taken to the moment at which the gap closes. There `mj_forward` gives the impulses, then the
margins, friction forces and accelerations of what follows: as at the start of a run, which is a landing, too, if the
ball comes down on what it touches. With these accelerations it is taken back to the times of the steps.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from mjsim.balls import GAPS, Balls, Runs
from mjsim.corrections import lands
from model.arrays import Array

_ROUNDS = 60
"""Most rounds of the search for margins and forces that belong to a state, or to an impact."""
_SAME = 1e-12
"""Change from one round to the next with which it ends, relative to the largest acceleration."""
_SWINGS = 0.01
"""Change over two rounds, divided by that in the last, with which it goes back and forth for ever, and ends, too."""
_UNDAMPED = 1e-6
"""Factor that takes the damping from the contacts: the impulse of an impact is that of the margin alone."""
_TOUCH = 1e-15
"""Least margin of a ball that has just landed, m: more than the round-off of a gap, or the engine sees no contact."""

Mask = npt.NDArray[np.bool_]


def begin(balls: Balls, fluid: Array) -> None:
    """Let all runs go on from states at one time, where positions are not yet ahead of velocities."""
    closed = touching(balls) | ((balls.gaps <= 0) & (balls.speeds < 0))
    balls.last[:] = balls.qvel
    balls.qpos[:3] += balls.leads * balls.qvel[:3]
    runs = np.arange(balls.qpos.shape[1])
    restart(balls, runs, np.zeros(len(runs)), closed, fluid)


def touching(balls: Balls) -> Mask:
    """Which contacts are closed or nearly so, (2, runs)."""
    slow = np.abs(balls.speeds) * balls.settings.timestep < balls.reach
    return (balls.loads > 0) | ((np.abs(balls.gaps) < balls.reach) & slow)


def moments(balls: Balls) -> Array:
    """When in the coming step open contacts close, (2, runs), s after its beginning; inf for those that don't."""
    h, lead, last = balls.steps, balls.leads, balls.last[GAPS]
    due = (balls.loads == 0) & lands(balls.gaps, balls.speeds, last, balls.hover(slice(None)), balls.ball)
    rates = (balls.speeds - last) / h
    gaps = balls.gaps - lead * (balls.speeds + rates * lead / 2)  # at the beginning of the step
    speeds, rates, gaps = balls.speeds[due], rates[due], gaps[due]
    closing = np.sqrt(speeds**2 - 2 * rates * gaps)
    falls = speeds < 0  # else it turns round first; of two forms of the root the one without cancellation
    times = np.full(due.shape, np.inf)
    times[due] = np.where(falls, 2 * gaps, closing + speeds) / np.where(falls, closing - speeds, -rates)
    return times


def restart(balls: Balls, runs: Runs, moment: Array, closed: Mask, fluid: Array) -> None:
    """Let runs go on from moments (k,), s after the beginning of the step, at which contacts (2, k) are closed."""
    h, lead, fall = balls.steps[runs], balls.leads[runs], balls.ball.fall[runs]
    v, before = balls.qvel[:, runs], (balls.qvel - balls.last)[:, runs] / h
    place = balls.qpos[:3, runs] + (moment - lead) * (v + before * (moment + lead) / 2)[:3]
    place[GAPS][closed] = 0.0
    balls.qpos[:3, runs], balls.qvel[:, runs] = place, v + moment * before
    hits = (closed & (balls.speeds[:, runs] < -fall)).any(axis=0)
    if hits.any():
        _stop(balls, runs[hits], closed[:, hits], fluid)
    balls.damp(runs)
    _settle(balls, runs, closed & (np.abs(balls.speeds[:, runs]) <= fall), fluid)
    after = balls.acceleration[:, runs]
    v = balls.qvel[:, runs] - moment * after
    balls.qvel[:, runs], balls.last[:, runs] = v, v - h * after
    balls.qpos[:3, runs] = place + (lead - moment) * (v + after * (moment + lead) / 2)[:3]


def _settle(balls: Balls, runs: Runs, touches: Mask, fluid: Array) -> None:
    """Search for the margins, friction forces and accelerations that belong to the present state, at a fixed time."""
    if balls.settings.servo:
        balls.margins[:, runs] *= touches
    _balance(balls, runs, touches, fluid)


def _stop(balls: Balls, runs: Runs, touches: Mask, fluid: Array) -> None:
    """Apply the impulses that stop the given runs at the contacts that touch, (2, k), if there are such.

    Without the damping of the contacts and the other forces on the ball, `mj_forward` gives the impulses at both
    contacts at a fixed time, while the margins are adjusted until neither contact approaches or rebounds.
    """
    solref = balls.solref[:, runs]
    balls.damp(runs, np.abs(balls.speeds[:, runs]).max(axis=0) / balls.steps[runs])
    balls.solref[1::2, runs] *= _UNDAMPED
    balls.last[:, runs] = balls.qvel[:, runs]
    balls.margins[:, runs] = _TOUCH * touches
    balls.forward(runs, fluid)
    others = np.zeros(balls.qvel.shape)
    others[:, runs] = balls.force[:, runs]
    _balance(balls, runs, touches, fluid, others)
    balls.qvel[:, runs] += balls.steps[runs] * balls.acceleration[:, runs]
    balls.solref[:, runs] = solref


def _balance(balls: Balls, runs: Runs, touches: Mask, fluid: Array, others: Array | None = None) -> None:
    """Search for the margins with which the gaps of contacts that touch, (2, k), have no acceleration, or no speed.

    No speed after an impact, without the `others` of the forces, (6, runs). A contact that slides so fast that it
    hovers with more than it needs would close and open in turn for ever: it is left hovering.
    """
    balls.last[:, runs] = balls.qvel[:, runs]
    states = np.full((2, 8, len(balls.ticks)), np.nan)
    for _ in range(_ROUNDS):
        balls.forward(runs, fluid, 0.0 if others is None else others[:, runs])
        rates, kept, stiffness = balls.acceleration[:, runs], balls.margins[:, runs], balls.stiffness[runs]
        if others is not None:
            excess = rates[GAPS] + balls.speeds[:, runs] / balls.steps[runs]
        else:
            excess = rates[GAPS] if balls.settings.servo else 0 * rates[GAPS]
            balls.last[:, runs] = balls.qvel[:, runs] - balls.steps[runs] * rates
        margins = balls.margins[:, runs] = touches * np.maximum(kept - excess / stiffness, 0.0)
        state = np.concatenate([rates, margins * stiffness])
        before, latest = states[:, :, runs]
        states[:, :, runs] = latest, state
        changes, swings = np.abs(state - latest).max(axis=0), np.abs(state - before).max(axis=0)
        hovers = (swings < _SWINGS * changes) & ((state - latest)[GAPS].sum(axis=0) > 0)
        goes_on = ~(changes <= _SAME * np.abs(rates).max(axis=0)) & ~hovers
        runs, touches = runs[goes_on], touches[:, goes_on]
        if len(runs) == 0:
            return
