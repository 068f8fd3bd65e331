"""Event-driven runs of theory with the integrators of scipy, in plain Python: held against compiled
runs, and in their place where a wrong theory is believed.

By LSODA or another fast method, except while a slip is small: its direction is stiff then, which
LSODA doesn't detect where hardly anything else moves, and BDF takes over."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any
from unittest import mock

import numpy as np
from scipy.integrate import BDF, LSODA
from scipy.optimize import brentq

from analytic.simulation import equations, hybrid
from analytic.simulation.coordinates import TURNING, least_slip
from analytic.simulation.equations import FINER, LOCAL, SMALL_SLIP, STIFF_STEPS
from analytic.simulation.integrator import Pace, finish_straight
from analytic.simulation.solvers import DONE, EPS, FIRED, PAUSED, STUCK, Stretch
from model.arrays import Array

MAX_RESTARTS = 20
"""How often in one stretch a method may fail; the other one then takes over."""


@contextmanager
def runs_by_scipy(fast: Any = LSODA) -> Iterator[None]:
    """For as long as the context lasts; slips that aren't small by the fast method."""
    plain = getattr(hybrid.run_through_flow, "py_func", hybrid.run_through_flow)
    by_it = partial(stretch, fast)
    with mock.patch.multiple(hybrid, run_through_flow=plain, stretch=by_it):
        yield


def stretch(
    fast: Any, of: Stretch, pace: Pace, taken: int, most: int
) -> tuple[int, Pace, int, int]:
    """In the place of `integrator.stretch`."""
    start, tau, first, small, slow = pace
    t, steps, failures = start + tau, 0, 0
    if slow and (end := finish_straight(t, of, taken)) >= 0:
        return DONE, pace, -1, end
    while t < of.until:
        slow, method = 0, BDF if small else fast
        try:
            for step in _steps(method, t, of, taken, first):
                (t, guard, taken), first, steps = step, 0.0, steps + 1
                if guard >= 0:
                    return FIRED, (t, 0.0, 0.0, small, 0), guard, taken
                grown = least_slip(of.z, of.scale, of.k.case) > SMALL_SLIP
                slow = 0 if grown else slow + 1
                if (
                    slow % STIFF_STEPS == STIFF_STEPS - 1
                    and (end := finish_straight(t, of, taken)) >= 0
                ):
                    return DONE, pace, -1, end
                if steps >= most and t < of.until:
                    return PAUSED, (t, 0.0, 0.0, small, 0), -1, taken
                if grown if small else slow > STIFF_STEPS:
                    break
        except ArithmeticError:
            failures += 1
            if failures > MAX_RESTARTS:
                return STUCK, (t, 0.0, 0.0, small, 0), -1, taken
        small = not small
    return DONE, pace, -1, taken


def _steps(
    method: Any, start: float, of: Stretch, taken: int, first: float
) -> Iterator[tuple[float, int, int]]:
    """Steps of a method: time, guard that fired or -1, samples taken. Its own time begins at 0."""
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
        """By forward differences: those of scipy grow with each call for a coordinate that the
        rates don't depend on, until they overflow."""
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
            raise ArithmeticError(method.__name__)
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
                samples[due, : len(z)], taken = between(times[due] - start).T, due.stop
        z[:] = now
        yield t, guard, taken
        if guard >= 0:
            return


def _root(guard: int, guards: Any, between: Any, level: float, start: float, end: float) -> float:
    """When within (start, end) a guard fell through its level; the interpolant may miss the ends by
    round-off."""

    def value(t: float) -> float:
        return float(guards(t, between(t))[guard]) - level

    if value(start) <= 0:
        return start
    if value(end) >= 0:
        return end
    return float(brentq(value, start, end, xtol=4 * EPS * end, rtol=4 * EPS))
