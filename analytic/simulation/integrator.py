"""Steps through one case, up to the first guard that fires.

By the explicit steps of `solvers`, except while a slip is small: its direction is stiff then, and
implicit ones take over. Where both need tiny steps because only round-off is left, the motion is
continued along a straight line. Compiled, like `equations`."""

import math

import numpy as np

from analytic.simulation import coordinates, equations, solvers
from analytic.simulation.equations import SMALL_SLIP, STIFF_STEPS
from analytic.simulation.solvers import DONE, OTHER, PAUSED, STUCK, Stretch

Pace = tuple[float, float, float, bool, int]
"""How the steps of a stretch go on: a time, s, from which tau counts, since directions settle in
less than the round-off of the time of the run; tau; length of the next step, 0 if one is to be
found; whether a slip is small; strides since it was not."""


class StalledError(ArithmeticError):
    """A solver can't go on, or the run makes no progress."""


def finish_straight(t: float, of: Stretch, taken: int) -> int:
    """Fill in the rest of a stretch if a straight line solves it: samples taken, else -1.

    What moves by less than the tolerance is taken to rest."""
    k, until, z, scale, times, samples, arm, _ = of
    if len(k.waves) > 0 or k.line.slope != 0:
        return -1
    n, left = len(z), until - t
    rate, other, values = np.empty(n), np.empty(n), np.empty(len(arm))
    equations.rates(t, z, k, rate)
    rate[left * np.abs(rate) < k.rtol * scale] = 0.0
    for ahead in (left / 2, left):
        there = z + ahead * rate
        equations.rates(t + ahead, there, k, other)
        equations.guards(t + ahead, there, k, values)
        if np.any(left * np.abs(other - rate) > k.rtol * scale) or np.any(values < 0):
            return -1
    while taken < len(times) and times[taken] <= until:
        samples[taken, :n] = z + (times[taken] - t) * rate
        taken += 1
    z[:] = there
    return taken


def stretch(of: Stretch, pace: Pace, taken: int, most: int) -> tuple[int, Pace, int, int]:
    """Integrate a case for so many steps at most: why it ended, pace, guard, and samples taken."""
    start, tau, h, small, slow = pace
    why, left = OTHER, most
    while why == OTHER or (why == PAUSED and left > 0):
        left -= STIFF_STEPS if small else most
        end = finish_straight(start + tau, of, taken) if slow % 2 == 1 else -1
        if end >= 0:
            return DONE, (start, tau, h, small, slow), -1, end
        if small:
            why, tau, h, guard, taken = solvers.implicit_steps(of, start, tau, h, taken)
        else:
            why, tau, h, guard, taken = solvers.explicit_steps(of, start, tau, h, taken, most)
        total = 0.0
        for value in of.z:
            total += value
        if not abs(total) < math.inf:
            why = STUCK
        slow = 0 if coordinates.least_slip(of.z, of.scale, of.k.case) > SMALL_SLIP else slow + 1
        if why == OTHER:
            start, tau, h, small = start + tau, 0.0, 0.0, not small
    return why, (start, tau, h, small, slow), guard, taken
