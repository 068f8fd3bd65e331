"""Steps through one case, up to the first guard that fires, where they aren't compiled: those of
scipy.

By LSODA, except while a slip is small: its direction is stiff then, which LSODA doesn't detect
where hardly anything else moves, and BDF takes over. Where both need tiny steps because only
round-off is left, the motion is continued along a straight line."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import BDF, LSODA
from scipy.optimize import brentq

from analytic.simulation import equations
from analytic.simulation.charts import TURNING, least_slip
from analytic.simulation.equations import FINER, LOCAL, ONSET_SLIP, PATIENCE, SMALL_SLIP, Motion
from model.arrays import Array

DONE, FIRED, STUCK, PAUSED = range(4)
"""Why steps end: at the end, at a guard, because they would be too short, for a breath."""
MAX_RESTARTS = 20
"""How often in one stretch a solver may fail; the other one then takes over."""
EPS = math.ulp(1.0)
Pace = tuple[float, float, float, bool, int]
"""How the steps of a stretch go on: a time, s, from which tau counts, since directions settle in
less than the round-off of the time of the run; tau; length of the next step, 0 if one is to be
found; whether a slip is small; strides since it was not."""


class Stretch(NamedTuple):
    """What to integrate; z, level and samples are written to."""

    k: Motion
    until: float
    """s"""
    z: Array
    """Coordinates (n,)."""
    scale: Array
    """Natural size of each (n,)."""
    times: Array
    """Of all samples of the run, s, shape (m,)."""
    samples: Array
    """Coordinates then (m, n)."""
    arm: Array
    """Above which values guards are armed, and at which they fire (guards,), as `charts.arm_guards`
    says."""
    level: Array


class StalledError(ArithmeticError):
    """A solver can't go on, or the run makes no progress."""


def first_pace(
    start: float, z: Array, scale: Array, case: int, opens: bool, first_step: float
) -> Pace:
    """How steps begin in a stretch (a `Pace`); if a contact `opens`, a straight line is tried at
    once."""
    small = least_slip(z, scale, case) < ONSET_SLIP
    return start, 0.0, 0.0 if small else first_step, small, 1 if opens else 0


def finish_straight(t: float, of: Stretch, taken: int) -> int:
    """Fill in the rest of a stretch if a straight line solves its equations and no guard fires:
    samples taken, else -1.

    What moves by less than the tolerance is taken to rest.
    """
    k, until, z, scale, times, samples, arm, _ = of
    if len(k.waves) > 0 or k.line.slope != 0:
        return -1
    rate, there, other = np.empty(len(z)), np.empty(len(z)), np.empty(len(z))
    values, left = np.empty(len(arm)), until - t
    equations.rates(t, z, k, rate)
    for i in range(len(z)):
        if left * abs(rate[i]) < k.rtol * scale[i]:
            rate[i] = 0.0
    for ahead in (left / 2, left):
        for i in range(len(z)):
            there[i] = z[i] + ahead * rate[i]
        equations.rates(t + ahead, there, k, other)
        for i in range(len(z)):
            if left * abs(other[i] - rate[i]) > k.rtol * scale[i]:
                return -1
        equations.guards(t + ahead, there, k, values)
        for value in values:
            if value < 0:
                return -1
    while taken < len(times) and times[taken] <= until:
        for i in range(len(z)):
            samples[taken, i] = z[i] + (times[taken] - t) * rate[i]
        taken += 1
    for i in range(len(z)):
        z[i] = there[i]
    return taken


def stretch(of: Stretch, pace: Pace, taken: int, most: int) -> tuple[int, Pace, int, int]:
    """Integrate a case for at most so many steps: why that ended, the pace, the guard, and how many
    samples are taken.

    Where a solver's steps become shorter than its time can resolve, the other one goes on with a
    time that starts from zero again; after `MAX_RESTARTS` it is stuck."""
    start, tau, first, small, slow = pace
    t, steps, failures = start + tau, 0, 0
    if slow and (end := finish_straight(t, of, taken)) >= 0:
        return DONE, pace, -1, end
    while t < of.until:
        slow, method = 0, BDF if small else LSODA
        try:
            for step in _steps(method, t, of, taken, first):
                (t, guard, taken), first, steps = step, 0.0, steps + 1
                if guard >= 0:
                    return FIRED, (t, 0.0, 0.0, small, 0), guard, taken
                grown = least_slip(of.z, of.scale, of.k.case) > SMALL_SLIP
                slow = 0 if grown else slow + 1
                if slow % PATIENCE == PATIENCE - 1 and (end := finish_straight(t, of, taken)) >= 0:
                    return DONE, pace, -1, end
                if steps >= most and t < of.until:
                    return PAUSED, (t, 0.0, 0.0, small, 0), -1, taken
                if grown if small else slow > PATIENCE:
                    break
        except StalledError:
            failures += 1
            if failures > MAX_RESTARTS:
                return STUCK, (t, 0.0, 0.0, small, 0), -1, taken
        small = not small
    return DONE, pace, -1, taken


def _steps(
    method: Any, start: float, of: Stretch, taken: int, first: float
) -> Iterator[tuple[float, int, int]]:
    """Steps of one of scipy's solvers: time, guard that fired or -1, samples taken. Its own time
    begins at 0."""
    k, until, z, scale, times, samples, arm, level = of
    least, armed, levels = np.array(scale), arm.tolist(), level.tolist()
    least[slice(*TURNING[k.case], 2)] *= k.rtol

    def rates(t: float, z: Array) -> list[float]:
        out = [0.0] * len(least)
        equations.rates(start + t, z.tolist(), k, out)
        return out

    def guards(t: float, z: Array) -> list[float]:
        out = [0.0] * len(armed)
        equations.guards(start + t, z.tolist(), k, out)
        return out

    def jacobian(t: float, z: Array) -> Array:
        """By forward differences, small relative to each coordinate or its natural size.

        Relative to a slip itself down to a floor, for its direction may be a steep function of it.
        (The differences of scipy grow with each call for a coordinate that the rates don't depend
        on, until they overflow.)"""
        shift = math.sqrt(EPS) * np.maximum(np.abs(z), least)
        beside = np.array([rates(t, shifted) for shifted in z + np.diag(shift)])
        return np.asarray((beside - np.array(rates(t, z))).T / shift)

    solver = method(
        rates,
        0.0,
        z.copy(),
        until - start,
        rtol=LOCAL * k.rtol,
        atol=LOCAL * k.rtol * scale / FINER,
        first_step=first or None,
        **({"jac": jacobian} if method is BDF else {}),
    )
    while solver.status == "running":
        solver.step()
        now, tau, guard = solver.y, float(solver.t), -1
        if solver.status == "failed" or not math.isfinite(sum(now)):
            raise StalledError(method.__name__)
        t, fired = until if solver.t == solver.t_bound else start + tau, []
        for n, value in enumerate(guards(t - start, now)):
            if value > armed[n]:
                levels[n] = 0.0
            elif value < levels[n]:
                fired.append(n)
        level[:] = levels
        if fired or (taken < len(times) and times[taken] <= t):
            between = solver.dense_output()
            if fired:
                span = float(solver.t_old), tau
                tau, guard = min((_root(n, guards, between, levels[n], *span), n) for n in fired)
                t, now = start + tau, between(tau)
            due = slice(taken, int(np.searchsorted(times, t, side="right")))
            if due.stop > taken:
                samples[due], taken = between(times[due] - start).T, due.stop
        z[:] = now
        yield t, guard, taken
        if guard >= 0:
            return


def _root(
    guard: int,
    guards: Any,
    between: Callable[[float], Array],
    level: float,
    start: float,
    end: float,
) -> float:
    """When within (start, end) a guard fell through its level; the interpolant may miss the ends by
    round-off."""

    def value(t: float) -> float:
        return float(guards(t, between(t))[guard]) - level

    if value(start) <= 0:
        return start
    if value(end) >= 0:
        return end
    return float(brentq(value, start, end, xtol=4 * EPS * end, rtol=4 * EPS))
