"""Steps of the integrator through one chart, up to the first guard that fires.

Where numba is installed, those of `solvers`; else LSODA, except while a slip is small: its direction is stiff then,
which LSODA doesn't detect where hardly anything else moves, and BDF takes over. Where both need tiny steps because only
round-off is left, the motion is continued along a straight line.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import cache
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import BDF, LSODA
from scipy.optimize import brentq

from analytic.simulation.charts import NONE, TURNING, Chart, least_slip, levels
from analytic.simulation.equations import FINER, LOCAL, ONSET_SLIP, PATIENCE, SMALL_SLIP, straight
from analytic.simulation.motion import REPORT_EVERY
from model import Case
from model.arrays import Array

MAX_RESTARTS = 20
"""How often in one stretch a solver may fail; the other one then takes over."""
EPS = math.ulp(1.0)


@cache
def solvers() -> ModuleType | None:
    """The compiled ones, where numba is installed."""
    try:
        import numba

        if numba.config.DISABLE_JIT:
            return None
        from analytic.simulation import solvers as compiled
    except ImportError:
        return None
    return compiled


class StalledError(ArithmeticError):
    """A solver can't go on, or the run makes no progress."""


NO_SAMPLES = np.empty(0)


class Step(NamedTuple):
    """A step of an integrator."""

    time: float
    z: list[float]
    sample_times: Array = NO_SAMPLES
    """Times to sample within the step, shape (m,)."""
    samples: Array = NO_SAMPLES
    """Coordinates then, shape (m, n)."""
    guard: int = NONE
    """The guard that fired at its end."""
    stands_for: int = 1
    """Steps that it stands for."""


class Stretch:
    """What to integrate, and how well; and the guards of the case, of which one fires when it falls below zero.

    Parameters
    ----------
    chart, start, until : the case, and times in s
    times : when to sample, s, outside the stretch, too
    """

    def __init__(self, chart: Chart, start: float, until: float, times: Array) -> None:
        self.chart, self.start, self.until, self.times, self.relative = chart, start, until, times, chart.k.rtol
        self._absolute = np.array(chart.scale) / FINER
        self._arm, self._level = [0.0] * len(chart.ends), [0.0] * len(chart.ends)
        self._opens = levels(chart.guards(start, chart.start), chart.k, self._arm, self._level)

    def steps(self, first_step: float | None) -> Iterator[Step]:
        """Steps with the samples in them, the last of them ending at a guard or at `until`.

        Compiled ones where numba is; else, and where those become too short, for tolerances are extreme, BDF while the
        slip is small, LSODA while it isn't. `first_step` in s for a motion that may soon end. Where a solver's steps
        become shorter than its time can resolve, the other one goes on with a time that starts from zero again. Raises
        `StalledError` after `MAX_RESTARTS`.
        """
        t, z, failures = self.start, self.chart.start, 0
        if steps := solvers():
            for step in self._compiled(steps, first_step):
                yield step
                t, z, first_step = step.time, step.z, None
                if step.guard != NONE:
                    return
        elif self._opens and (last := self._straight(t, z)):
            yield last
            return
        small = self._least_slip(z) < ONSET_SLIP
        while t < self.until:
            try:
                slow = 0
                for step in self._solve(BDF if small else LSODA, t, z, first_step):
                    yield step
                    t, z, first_step = step.time, step.z, None
                    if step.guard != NONE:
                        return
                    grown = self._least_slip(z) > SMALL_SLIP
                    slow = 0 if grown else slow + 1
                    if slow % PATIENCE == PATIENCE - 1 and (last := self._straight(t, z)):
                        yield last
                        return
                    if grown if small else slow > PATIENCE:
                        break
            except StalledError:
                failures += 1
                if failures > MAX_RESTARTS:
                    raise
            small = not small

    def _compiled(self, solvers: Any, first_step: float | None) -> Iterator[Step]:
        """Long strides: to the end, to a guard, or to where they become too short."""
        chart, times, here, scale = self.chart, self.times, np.array(self.chart.start), np.array(self.chart.scale)
        motion = chart.k._replace(waves=np.array(chart.k.waves, dtype=float).reshape(-1, 3))
        taken = int(np.searchsorted(times, self.start, side="right"))
        room = int(np.searchsorted(times, self.until, side="right")) + 1  # `_passed` may be a last digit ahead
        samples = np.empty((room, len(here)))
        arm, level, why = np.array(self._arm), np.array(self._level), solvers.PAUSED
        pace = solvers.first_pace(self.start, here, scale, chart.k.case, self._opens, first_step or 0.0)
        while why == solvers.PAUSED:
            before = taken
            why, pace, guard, taken = solvers.stretch(
                motion, pace, self.until, here, scale, times, taken, samples, arm, level, REPORT_EVERY
            )
            self._level = level.tolist()
            if why == solvers.STUCK:
                return
            t = self.until if why == solvers.DONE else max([pace[0] + pace[1], *times[before:taken][-1:].tolist()])
            end = chart.ends[guard] if why == solvers.FIRED else NONE
            yield Step(t, here.tolist(), times[before:taken], samples[before:taken], end, REPORT_EVERY)

    def _least_slip(self, z: list[float]) -> float:
        return least_slip(z, self.chart.scale, self.chart.k.case)

    def _straight(self, t: float, z: list[float]) -> Step | None:
        """All the rest, if it is a straight line; else None."""
        chart, k = self.chart, self.chart.k
        rate, there, other, values = (z.copy() for _ in range(4))
        if len(k.waves) or k.line.slope or not straight(
            t, self.until, z, chart.scale, k, rate, values[: len(chart.ends)], there, other
        ):  # fmt: skip
            return None
        due = self.times[slice(*np.searchsorted(self.times, [t, self.until], side="right"))]
        return Step(self.until, there, due, np.array(z) + np.outer(due - t, rate))

    def _solve(self, method: Any, start: float, z: list[float], first_step: float | None) -> Iterator[Step]:
        """Steps of one solver; its time runs from zero, for directions settle in less than the round-off of `start`."""
        chart, times = self.chart, self.times
        least = np.array(chart.scale)
        least[slice(*TURNING[chart.k.case], 2)] *= self.relative

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
                raise StalledError(f"{method.__name__} in case {Case(chart.k.case).name}: {message}")
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
            between, guard = solver.dense_output(), NONE
            if fired:
                span = float(solver.t_old), float(solver.t)
                end, guard = min((self._root(k, between, start, *span), chart.ends[k]) for k in fired)
                t, z = start + end, between(end).tolist()
            due = int(np.searchsorted(times, t, side="right"))
            samples = between(times[taken:due] - start).T if due > taken else NO_SAMPLES
            yield Step(t, z, times[taken:due], samples, guard)
            if guard != NONE:
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
