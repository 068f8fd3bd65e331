"""Steps of the integrator through one chart, up to the first guard that fires.

LSODA integrates, except while a slip is small: its direction is stiff then, which LSODA doesn't detect where hardly
anything else moves, and BDF takes over. Where both need tiny steps because only round-off is left, the motion is
continued along a straight line.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import BDF, LSODA
from scipy.optimize import brentq

from analytic.simulation.motion import FINER, GAPS, Chart
from model.arrays import Array

ONSET_SLIP, SMALL_SLIP = 1e-7, 1e-2
"""Slip that has just set in, and slip whose direction may be stiff, relative to the spin of rolling at sqrt(g R)."""
PATIENCE = 300
"""Steps of LSODA with a small slip after which BDF takes over; a slip that dies out takes fewer."""
MAX_RESTARTS = 20
"""How often in one stretch a solver may fail; the other one then takes over."""
EPS = math.ulp(1.0)
LOCAL = 0.25
"""Tolerance of a step of the integrator relative to that asked for: errors of many steps add up."""


class StalledError(ArithmeticError):
    """A solver can't go on, or the run makes no progress."""


class Step(NamedTuple):
    """A step of an integrator."""

    time: float
    z: list[float]
    sample_times: Sequence[float] = ()
    """Times to sample within the step."""
    samples: Sequence[list[float]] = ()
    """Coordinates then."""
    guard: str | None = None
    """The guard that fired at its end."""


class Stretch:
    """What to integrate, and how well; and the guards of the case, of which one fires when it falls below zero.

    Parameters
    ----------
    motion, start, until : the case, and times in s
    times : when to sample, s, outside the stretch, too
    relative : tolerance; the absolute one in natural units is `FINER`
    steady : whether the flow stays what it is

    A guard that starts at zero, where round-off mustn't end the case, has to rise above the absolute tolerance first,
    or to fall below -`relative`; a gap is armed by any height.
    """

    def __init__(self, motion: Chart, start: float, until: float, times: Array, relative: float, steady: bool) -> None:
        self.motion, self.start, self.until, self.times = motion, start, until, times
        self.relative, self.absolute, self.steady = relative, relative / FINER, steady
        self._arm = [0.0 if name in GAPS else self.absolute for name in motion.ends]
        values = motion.guards(start, motion.start)
        self._level = [0.0 if value > arm else -relative for value, arm in zip(values, self._arm, strict=True)]
        self._opens = any(gap == 0 for gap, name in zip(values, motion.ends, strict=True) if name in GAPS)

    def steps(self, first_step: float | None) -> Iterator[Step]:
        """Steps with the samples in them, the last of them ending at a guard or at `until`.

        BDF while the slip is small, LSODA while it isn't. `first_step` in s for a motion that may soon end. Where a
        solver's steps become shorter than its time can resolve, the other one goes on with a time that starts from zero
        again. Raises `StalledError` after `MAX_RESTARTS`.
        """
        t, z, small = self.start, self.motion.start, self.motion.least_slip(self.motion.start) < ONSET_SLIP
        failures = 0
        if self._opens and (last := self._straight(t, z)):
            yield last
            return
        while t < self.until:
            try:
                slow = 0
                for step in self._solve(BDF if small else LSODA, t, z, first_step):
                    yield step
                    t, z, first_step = step.time, step.z, None
                    if step.guard:
                        return
                    grown = self.motion.least_slip(z) > SMALL_SLIP
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

    def _straight(self, t: float, z: Sequence[float]) -> Step | None:
        """All the rest, if a straight line solves the equations to the tolerance and no guard fires; else None.

        What moves by less than the tolerance is taken to rest.
        """
        if not self.steady:
            return None
        motion, left = self.motion, self.until - t
        here, rates, enough = np.array(z), np.array(motion.rates(t, z)), self.relative * np.array(self.motion.scale)
        rates[left * np.abs(rates) < enough] = 0.0
        for ahead in (left / 2, left):
            there = (here + ahead * rates).tolist()
            bent = left * np.abs(motion.rates(t + ahead, there) - rates)
            if np.any(bent > enough) or min(motion.guards(t + ahead, there)) < 0:
                return None
        due = self.times[slice(*np.searchsorted(self.times, [t, self.until], side="right"))]
        return Step(self.until, there, due.tolist(), (here + np.outer(due - t, rates)).tolist())

    def _solve(self, method: Any, start: float, z: list[float], first_step: float | None) -> Iterator[Step]:
        """Steps of one solver; its time runs from zero, for directions settle in less than the round-off of `start`."""
        motion, times = self.motion, self.times
        least = np.array(motion.scale)
        least[list(motion.slips)] *= self.relative

        def jacobian(t: float, z: Array) -> Array:
            """By forward differences, small relative to each coordinate or its natural size.

            Relative to a slip itself down to a floor, for its direction may be a steep function of it. (The differences
            of scipy grow with each call for a coordinate that the rates don't depend on, until they overflow.)
            """
            shift = math.sqrt(EPS) * np.maximum(np.abs(z), least)
            here = np.array(motion.rates(start + t, z.tolist()))
            beside = [motion.rates(start + t, shifted) for shifted in (z + np.diag(shift)).tolist()]
            return np.asarray((np.array(beside) - here).T / shift)

        solver = method(
            lambda t, z: motion.rates(start + t, z.tolist()),
            0.0,
            z,
            self.until - start,
            rtol=LOCAL * self.relative,
            atol=LOCAL * self.absolute * np.array(motion.scale),
            first_step=first_step,
            **({"jac": jacobian} if method is BDF else {}),
        )
        taken = int(np.searchsorted(times, start, side="right"))
        while solver.status == "running":
            message = solver.step()
            z = solver.y.tolist()
            if solver.status == "failed" or not math.isfinite(sum(z)):
                raise StalledError(f"{method.__name__} in case {motion.case.name}: {message}")
            t = self.until if solver.t == solver.t_bound else start + float(solver.t)
            fired = []
            for k, value in enumerate(motion.guards(t, z)):
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
                end, guard = min((self._root(k, between, start, *span), motion.ends[k]) for k in fired)
                t, z = start + end, between(end).tolist()
            due = int(np.searchsorted(times, t, side="right"))
            samples = between(times[taken:due] - start).T.tolist() if due > taken else []
            yield Step(t, z, times[taken:due].tolist(), samples, guard)
            if guard:
                return
            taken = due

    def _root(self, k: int, between: Callable[[float], Array], origin: float, start: float, end: float) -> float:
        """When within (start, end) after the origin guard k fell through its level.

        The interpolant may differ from the step's ends by round-off.
        """

        def value(t: float) -> float:
            return self.motion.guards(origin + t, between(t).tolist())[k] - self._level[k]

        if value(start) <= 0:
            return start
        if value(end) >= 0:
            return end
        return float(brentq(value, start, end, xtol=4 * EPS * end, rtol=4 * EPS))
