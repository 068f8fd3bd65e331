"""Steps of the integrator through one chart, up to the first guard that fires.

Where numba is installed, those of `solvers`; else LSODA, except while a slip is small: its direction is stiff then,
which LSODA doesn't detect where hardly anything else moves, and BDF takes over. Where both need tiny steps because only
round-off is left, the motion is continued along a straight line.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from functools import cache
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import BDF, LSODA
from scipy.optimize import brentq

from analytic.simulation.motion import FINER, GAPS, REPORT_EVERY, Chart
from model import Case
from model.arrays import Array

ONSET_SLIP, GROWN_SLIP, SMALL_SLIP = 1e-7, 1e-4, 1e-2
"""Slip that has just set in; from which on compiled steps that are short cost less than stiff ones; and whose direction
may be stiff: relative to the spin of rolling at sqrt(g R)."""
PATIENCE = 300
"""Steps with a small slip after which BDF takes over; a slip that dies out takes fewer."""
MAX_RESTARTS = 20
"""How often in one stretch a solver may fail; the other one then takes over."""
EPS = math.ulp(1.0)
LOCAL = 0.25
"""Tolerance of a step of the integrator relative to that asked for: errors of many steps add up."""
FINEST, FINEST_STIFF = 1e-13, 1e-11
"""Least relative tolerances of compiled steps: what round-off leaves of explicit ones, and of those of a small slip."""


@cache
def _solvers() -> ModuleType | None:
    """The compiled ones, where numba is installed."""
    try:
        import numba

        if numba.config.DISABLE_JIT:
            return None
        from analytic.simulation import solvers
    except ImportError:
        return None
    return solvers


class StalledError(ArithmeticError):
    """A solver can't go on, or the run makes no progress."""


NONE = np.empty(0)


class Step(NamedTuple):
    """A step of an integrator."""

    time: float
    z: list[float]
    sample_times: Array = NONE
    """Times to sample within the step, shape (m,)."""
    samples: Array = NONE
    """Coordinates then, shape (m, n)."""
    guard: str | None = None
    """The guard that fired at its end."""
    stands_for: int = 1
    """Steps that it stands for."""


class Stretch:
    """What to integrate, and how well; and the guards of the case, of which one fires when it falls below zero.

    Parameters
    ----------
    chart, start, until : the case, and times in s
    times : when to sample, s, outside the stretch, too
    relative : tolerance; the absolute one in natural units is `FINER`
    steady : whether the flow stays what it is

    A guard that starts at zero, where round-off mustn't end the case, has to rise above the absolute tolerance first,
    or to fall below -`relative`; a gap is armed by any height.
    """

    def __init__(self, chart: Chart, start: float, until: float, times: Array, relative: float, steady: bool) -> None:
        self.chart, self.start, self.until, self.times = chart, start, until, times
        self.relative, self.steady = relative, steady
        self._absolute = np.array(chart.scale) / FINER
        self._arm = [0.0 if name in GAPS else relative / FINER for name in chart.ends]
        values = chart.guards(start, chart.start)
        self._level = [0.0 if value > arm else -relative for value, arm in zip(values, self._arm, strict=True)]
        self._opens = any(gap == 0 for gap, name in zip(values, chart.ends, strict=True) if name in GAPS)

    def steps(self, first_step: float | None) -> Iterator[Step]:
        """Steps with the samples in them, the last of them ending at a guard or at `until`.

        BDF while the slip is small, LSODA while it isn't. `first_step` in s for a motion that may soon end. Where a
        solver's steps become shorter than its time can resolve, the other one goes on with a time that starts from zero
        again. Raises `StalledError` after `MAX_RESTARTS`.
        """
        t, z, small = self.start, self.chart.start, self.chart.least_slip(self.chart.start) < ONSET_SLIP
        failures = 0
        if self._opens and (last := self._straight(t, z)):
            yield last
            return
        while t < self.until:
            try:
                slow, solvers = 0, _solvers() if not failures else None  # scipy's go on where tolerances are extreme
                steps = self._compiled(solvers, small, t, z, first_step) if solvers else None
                for step in steps or self._solve(BDF if small else LSODA, t, z, first_step):
                    yield step
                    t, z, first_step = step.time, step.z, None
                    if step.guard:
                        return
                    grown = self.chart.least_slip(z) > SMALL_SLIP
                    slow = 0 if grown else slow + 1
                    patience = 2 if solvers else PATIENCE
                    if slow % patience == patience - 1 and (last := self._straight(t, z)):
                        yield last
                        return
                    if solvers is None and (grown if small else slow > PATIENCE):
                        break
            except StalledError:
                failures += 1
                if failures > MAX_RESTARTS:
                    raise
                if solvers:
                    continue
            small = not small

    def _compiled(
        self, solvers: Any, small: bool, start: float, z: list[float], first_step: float | None
    ) -> Iterator[Step]:
        """Long strides: to the end, to a guard, or to where the other solver should go on."""
        chart, times, here = self.chart, self.times, np.array(z, dtype=float)
        taken = int(np.searchsorted(times, start, side="right"))
        samples = np.empty((int(np.searchsorted(times, self.until, side="right")), len(here)))
        scale, level = np.array(chart.scale), np.array(self._level)
        rtol = max(LOCAL * self.relative, FINEST_STIFF if small else FINEST)
        slips, unit = np.array(chart.slips, dtype=np.int64), float(chart.scale[chart.slips[0]]) if chart.slips else 1.0
        motion = chart.motion._replace(waves=np.array(chart.motion.waves, dtype=float).reshape(-1, 3))
        floor = scale.copy()
        floor[slips] *= self.relative
        solver, *more = (
            (solvers.implicit, GROWN_SLIP, floor, PATIENCE)
            if small
            else (solvers.explicit, SMALL_SLIP, PATIENCE, REPORT_EVERY)
        )
        tau, h, why = 0.0, 0.0 if small else first_step or 0.0, solvers.PAUSED  # 0: it finds one
        while why == solvers.PAUSED:
            before = taken
            why, tau, h, guard, taken = solver(
                motion, start, tau, h, self.until - start, here, times, taken, samples, rtol,
                rtol * self._absolute, np.array(self._arm), level, slips, unit, *more,
            )  # fmt: skip
            if why == solvers.STUCK or not np.isfinite(here).all():
                raise StalledError(f"steps become too short in case {Case(chart.motion.case).name}")
            t = self.until if why == solvers.DONE else max([start + tau, *times[before:taken][-1:].tolist()])
            self._level = level.tolist()
            name = chart.ends[guard] if why == solvers.FIRED else None
            yield Step(t, here.tolist(), times[before:taken], samples[before:taken], name, REPORT_EVERY)

    def _straight(self, t: float, z: Sequence[float]) -> Step | None:
        """All the rest, if a straight line solves the equations to the tolerance and no guard fires; else None.

        What moves by less than the tolerance is taken to rest.
        """
        if not self.steady:
            return None
        chart, left = self.chart, self.until - t
        here, rates, enough = np.array(z), np.array(chart.rates(t, z)), self.relative * np.array(self.chart.scale)
        rates[left * np.abs(rates) < enough] = 0.0
        for ahead in (left / 2, left):
            there = (here + ahead * rates).tolist()
            bent = left * np.abs(chart.rates(t + ahead, there) - rates)
            if np.any(bent > enough) or min(chart.guards(t + ahead, there)) < 0:
                return None
        due = self.times[slice(*np.searchsorted(self.times, [t, self.until], side="right"))]
        return Step(self.until, there, due, here + np.outer(due - t, rates))

    def _solve(self, method: Any, start: float, z: list[float], first_step: float | None) -> Iterator[Step]:
        """Steps of one solver; its time runs from zero, for directions settle in less than the round-off of `start`."""
        chart, times = self.chart, self.times
        least = np.array(chart.scale)
        least[list(chart.slips)] *= self.relative

        def jacobian(t: float, z: Array) -> Array:
            """By forward differences, small relative to each coordinate or its natural size.

            Relative to a slip itself down to a floor, for its direction may be a steep function of it. (The differences
            of scipy grow with each call for a coordinate that the rates don't depend on, until they overflow.)
            """
            shift = math.sqrt(EPS) * np.maximum(np.abs(z), least)
            here = np.array(chart.rates(start + t, z.tolist()))
            beside = [chart.rates(start + t, shifted) for shifted in (z + np.diag(shift)).tolist()]
            return np.asarray((np.array(beside) - here).T / shift)

        solver = method(
            lambda t, z: chart.rates(start + t, z.tolist()),
            0.0,
            z,
            self.until - start,
            rtol=LOCAL * self.relative,
            atol=LOCAL * self.relative * self._absolute,
            first_step=first_step,
            **({"jac": jacobian} if method is BDF else {}),
        )
        taken = int(np.searchsorted(times, start, side="right"))
        while solver.status == "running":
            message = solver.step()
            z = solver.y.tolist()
            if solver.status == "failed" or not math.isfinite(sum(z)):
                raise StalledError(f"{method.__name__} in case {Case(chart.motion.case).name}: {message}")
            t = self.until if solver.t == solver.t_bound else start + float(solver.t)
            fired = []
            for k, value in enumerate(chart.guards(t, z)):
                if value > self._arm[k]:
                    self._level[k] = 0.0
                elif value < self._level[k]:
                    fired.append(k)
            if not fired and (taken == len(times) or times[taken] > t):
                yield Step(t, z)
                continue
            between, guard = solver.dense_output(), None
            if fired:
                span = float(solver.t_old), float(solver.t)
                end, guard = min((self._root(k, between, start, *span), chart.ends[k]) for k in fired)
                t, z = start + end, between(end).tolist()
            due = int(np.searchsorted(times, t, side="right"))
            samples = between(times[taken:due] - start).T if due > taken else NONE
            yield Step(t, z, times[taken:due], samples, guard)
            if guard:
                return
            taken = due

    def _root(self, k: int, between: Callable[[float], Array], origin: float, start: float, end: float) -> float:
        """When within (start, end) after the origin guard k fell through its level.

        The interpolant may differ from the step's ends by round-off.
        """

        def value(t: float) -> float:
            return self.chart.guards(origin + t, between(t).tolist())[k] - self._level[k]

        if value(start) <= 0:
            return start
        if value(end) >= 0:
            return end
        return float(brentq(value, start, end, xtol=4 * EPS * end, rtol=4 * EPS))
