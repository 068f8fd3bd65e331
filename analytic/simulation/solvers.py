"""Two methods of stepping through one case, and the moments at which it ends.

`explicit_steps` is Dormand and Prince's method of order 8, with the coefficients and the dense
output of `scipy.integrate.DOP853`; guards are looked at four times in each step. `implicit_steps`
is for a slip that has just set in, whose direction is stiff: linearly implicit Euler steps,
extrapolated (Deuflhard, SIAM Rev. 27 (1985) 505; Hairer & Wanner, Solving ODEs II, IV.9). Its steps
end at samples, and are taken anew to end at a guard."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.integrate import DOP853

from analytic.simulation import coordinates, equations
from analytic.simulation.equations import FINER, LOCAL, SMALL_SLIP, STIFF_STEPS, System
from model.arrays import Array

DONE, FIRED, STUCK, PAUSED, OTHER = range(5)
"""Why steps end: at the end, at a guard, because they would be too short, for a breath, or as the
other method should go on."""
EPS = math.ulp(1.0)
_NAMES = ("A", "B", "C", "E3", "E5", "D")
A, B, C, E3, E5, D = (np.ascontiguousarray(getattr(DOP853, name)) for name in _NAMES)
A_MORE, C_MORE = np.ascontiguousarray(DOP853.A_EXTRA), np.ascontiguousarray(DOP853.C_EXTRA)
STAGES, ALL = len(B), len(B) + 1 + len(C_MORE)
GROWN_SLIP = 1e-4
"""Slip from which on steps that are short cost less than stiff ones."""
FINEST, FINEST_STIFF = 1e-13, 1e-11
"""Least relative tolerances: what round-off leaves of explicit steps, and of a small slip."""
SAFETY, SHRINK, GROW = 0.9, 0.2, 10.0
"""Of the length of a step: below what its error allows; and by how much it may change."""
LOOKS_A_STEP = 4
"""How often in a step guards are looked at."""
INSIDE, CLEAR = 8, 2.0
"""The stage, .65 of the step on, at which guards are looked at, too; and by how many times what
they vary by they have to be positive for a step not to be looked into."""
DYING = 1e-7
"""Slip in natural units below which it goes straight to zero, too soon for its rate to change."""
ROOT_STEPS = 200
COLUMNS, USUAL = 12, 9
"""Most columns of an extrapolation, and how many steps aim at."""


class Stretch(NamedTuple):
    """What to integrate; z, level and samples are written to."""

    k: System
    until: float
    """s"""
    z: Array
    """Coordinates (n,)."""
    scale: Array
    """Natural size of each (n,)."""
    times: Array
    """Of all samples of the run, s, shape (m,)."""
    samples: Array
    """Coordinates then, in the first columns (m, MOST)."""
    arm: Array
    """Values above which guards are armed, and at which they fire, of `coordinates.arm_guards`."""
    level: Array


def _interpolate(x: float, z: Array, F: Array, out: Array) -> None:
    """Coordinates at a share x of a step begun at z, from the coefficients F of its interpolant."""
    for i in range(len(z)):
        value = 0.0
        for n in range(len(F)):
            value = (value + F[len(F) - 1 - n, i]) * (x if n % 2 == 0 else 1 - x)
        out[i] = z[i] + value


def _root(
    guard: int,
    level: float,
    low: float,
    high: float,
    t: float,
    h: float,
    k: System,
    z: Array,
    F: Array,
    now: Array,
    values: Array,
) -> float:
    """Share of a step in (low, high) at which a guard falls through its level, to round-off.

    By false position, whose end that stays counts half the next time (Illinois), or by halving."""
    _interpolate(low, z, F, now)
    equations.guards(t + low * h, now, k, values)
    above = values[guard] - level
    _interpolate(high, z, F, now)
    equations.guards(t + high * h, now, k, values)
    below = values[guard] - level
    if above <= 0:
        return low
    if below >= 0:
        return high
    stays = 0
    for n in range(ROOT_STEPS):
        if high - low <= 4 * EPS * max(high, abs(t / h)):
            break
        x = (low * below - high * above) / (below - above)
        if n % 3 == 2 or not low < x < high:
            x = (low + high) / 2
        _interpolate(x, z, F, now)
        equations.guards(t + x * h, now, k, values)
        value = values[guard] - level
        if value > 0:
            low, above = x, value
            below = below / 2 if stays == 1 else below
            stays = 1
        else:
            high, below = x, value
            above = above / 2 if stays == -1 else above
            stays = -1
    return high


def _weighted_sum(weights: Array, count: int, K: Array, out: Array) -> None:
    """The sum of the first `count` rows of K (s, n), each times its weight."""
    out[:] = 0.0
    for j in range(count):
        for i in range(len(out)):
            out[i] += weights[j] * K[j, i]


def _interpolant(
    t: float, h: float, k: System, z: Array, new: Array, K: Array, now: Array, F: Array
) -> None:
    """Coefficients F of the interpolant of a step from z to `new`; computes three more stages K."""
    for s in range(len(C_MORE)):
        _weighted_sum(A_MORE[s], STAGES + 1 + s, K, now)
        now[:] = z + h * now
        equations.rates(t + C_MORE[s] * h, now, k, K[STAGES + 1 + s])
    F[0] = new - z
    F[1], F[2] = h * K[0] - F[0], 2 * F[0] - h * (K[STAGES] + K[0])
    for j in range(len(D)):
        _weighted_sum(D[j], ALL, K, F[3 + j])
        F[3 + j] *= h


def _first_fall(
    t: float,
    h: float,
    k: System,
    z: Array,
    F: Array,
    arm: Array,
    level: Array,
    seen: Array,
    now: Array,
    values: Array,
) -> tuple[int, float]:
    """The guard that first falls through its level in a step, or -1, and at which share of it.

    `seen` (LOOKS_A_STEP + 1, guards) holds their values at both ends, and takes those between."""
    fired, end = -1, 2.0
    for look in range(1, LOOKS_A_STEP):
        _interpolate(look / LOOKS_A_STEP, z, F, now)
        equations.guards(t + look / LOOKS_A_STEP * h, now, k, seen[look])
    for guard in range(len(arm)):
        for look in range(1, LOOKS_A_STEP + 1):
            share = look / LOOKS_A_STEP
            if seen[look, guard] > arm[guard]:
                level[guard] = 0.0
            lowest = share
            if look > 1:  # a dip between the looks: the vertex of the parabola through three
                one, two, three = seen[look - 2, guard], seen[look - 1, guard], seen[look, guard]
                bend = one - 2 * two + three
                away = (one - three) / (2 * bend) if bend > 0 else 2.0
                if abs(away) < 1 and two - bend * away * away / 2 < level[guard] + bend:
                    lowest = share + (away - 1) / LOOKS_A_STEP
                    _interpolate(lowest, z, F, now)
                    equations.guards(t + lowest * h, now, k, values)
                    if not values[guard] < level[guard]:
                        lowest = share
            if lowest < share or seen[look, guard] < level[guard]:
                high = min(lowest, share)
                low = share - (1 if high > share - 1 / LOOKS_A_STEP else 2) / LOOKS_A_STEP
                root = _root(guard, level[guard], max(low, 0.0), high, t, h, k, z, F, now, values)
                if root < end:
                    fired, end = guard, root
                break
    return fired, end


def _first_length(share: float, rate: Array, left: float, of: Stretch) -> float:
    """Length of a first step, s, in which coordinates would change by a share of their size."""
    fastest = 0.0
    for i in range(len(rate)):
        fastest = max(fastest, abs(rate[i]) / (of.scale[i] / FINER + abs(of.z[i])))
    return min(left, share / fastest if fastest > 0 else left)


def _time_to_stop(rate: Array, rtol: float, of: Stretch) -> float:
    """Time that a dying slip has left, along a straight line; inf if a direction turns too much."""
    left, (first, end) = math.inf, coordinates.TURNING[of.k.case]
    for i in range(first, end, 2):
        if of.z[i] < DYING * of.scale[i] and rate[i] < 0:
            left = min(left, -of.z[i] / rate[i])
    for i in range(first, end, 2):
        if left < math.inf and (rate[i + 1] * left) ** 2 > rtol:
            return math.inf
    return left


def _is_past(time: float, start: float, tau: float) -> bool:
    """Whether start + tau is at a time or later, however that is rounded."""
    return time <= start + tau or time - start <= tau


def explicit_steps(
    of: Stretch, start: float, tau: float, h: float, taken: int, most: int
) -> tuple[int, float, float, int, int]:
    """Up to `most` explicit steps from start + tau on: why they end, tau, h, guard, samples taken.

    A slip below `SMALL_SLIP` for more than `STIFF_STEPS` steps is for the other method. A step is
    interpolated where a sample is due, or a guard not `CLEAR`."""
    k, until, z, scale, times, samples, arm, level = of
    n, span, rtol, slow, rejected = len(z), until - start, max(LOCAL * k.rtol, FINEST), 0, False
    K, F = np.empty((ALL, n)), np.empty((3 + len(D), n))
    new, now = np.empty(n), np.empty(n)
    values, seen = np.empty(len(arm)), np.empty((LOOKS_A_STEP + 1, len(arm)))
    five, three = np.empty(n), np.empty(n)
    equations.rates(start + tau, z, k, K[0])
    equations.guards(start + tau, z, k, seen[0])
    if h <= 0:
        h = _first_length(0.01, K[0], span - tau, of)
    for _ in range(most):
        if tau >= span:
            return DONE, tau, h, -1, taken
        last = tau + h >= span
        if last:
            h = span - tau
        if h <= 4 * EPS * tau or h < 1e-300:
            return STUCK, tau, h, -1, taken
        for s in range(1, STAGES):
            _weighted_sum(A[s], s, K, now)
            for i in range(n):
                now[i] = z[i] + h * now[i]
            equations.rates(start + (tau + C[s] * h), now, k, K[s])
            if s == INSIDE:
                equations.guards(start + (tau + C[s] * h), now, k, values)
        _weighted_sum(B, STAGES, K, new)
        for i in range(n):
            new[i] = z[i] + h * new[i]
        after = span if last else tau + h
        equations.rates(start + after, new, k, K[STAGES])
        _weighted_sum(E5, STAGES + 1, K, five)
        _weighted_sum(E3, STAGES + 1, K, three)
        fifth = third = 0.0
        for i in range(n):
            size = rtol * (scale[i] / FINER + max(abs(z[i]), abs(new[i])))
            fifth += (five[i] / size) ** 2
            third += (three[i] / size) ** 2
        bound = fifth + 0.01 * third
        error = h * fifth / math.sqrt(bound * n) if bound > 0 else bound
        if not error < 1:
            h *= max(SHRINK, SAFETY * error**-0.125) if error < math.inf else SHRINK
            rejected = True
            continue
        equations.guards(start + after, new, k, seen[LOOKS_A_STEP])
        clear = True
        for guard in range(len(arm)):
            one, two, end = seen[0, guard], values[guard], seen[LOOKS_A_STEP, guard]
            if one > arm[guard]:
                level[guard] = 0.0
            low = min(one, two, end)
            clear = clear and low > CLEAR * (max(one, two, end) - low)
        fired, until = -1, after
        if not clear or (taken < len(times) and _is_past(times[taken], start, after)):
            _interpolant(start + tau, h, k, z, new, K, now, F)
            fired, share = _first_fall(start + tau, h, k, z, F, arm, level, seen, now, values)
            until = tau + share * h if fired >= 0 else after
            while taken < len(times) and _is_past(times[taken], start, until):
                due = min(max((times[taken] - start - tau) / h, 0.0), 1.0)
                _interpolate(due, z, F, samples[taken])
                taken += 1
            if fired >= 0:
                _interpolate(share, z, F, now)
                z[:] = now
                return FIRED, until, h, fired, taken
        z[:] = new
        K[0] = K[STAGES]
        seen[0] = seen[LOOKS_A_STEP]
        tau = after
        grow = GROW if error == 0 else min(GROW, SAFETY * error**-0.125)
        h *= min(grow, 1.0) if rejected else grow
        rejected = False
        least = coordinates.least_slip(z, scale, k.case)
        slow = slow + 1 if least <= SMALL_SLIP else 0
        left = _time_to_stop(K[0], rtol, of) if least < DYING else math.inf
        sampled = taken < len(times) and _is_past(times[taken], start, tau + left)
        if tau + left <= span and not sampled:
            z += left * K[0]
            equations.guards(start + tau + left, z, k, values)
            return FIRED, tau + left, h, int(values.argmin()), taken
        if slow > STIFF_STEPS:
            return OTHER, tau, h, -1, taken
    return PAUSED, tau, h, -1, taken


def _lu_factor(M: Array, order: npt.NDArray[np.int64]) -> None:
    """LU factors of M in its place, with the exchanges of rows in `order`."""
    n = len(M)
    for i in range(n):
        best = i
        for r in range(i + 1, n):
            if abs(M[r, i]) > abs(M[best, i]):
                best = r
        order[i] = best
        for c in range(n):
            M[i, c], M[best, c] = M[best, c], M[i, c]
        for r in range(i + 1, n):
            M[r, i] /= M[i, i]
            for c in range(i + 1, n):
                M[r, c] -= M[r, i] * M[i, c]


def _lu_solve(M: Array, order: npt.NDArray[np.int64], b: Array) -> None:
    """The solution of M x = b in the place of b, from what `_lu_factor` left."""
    n = len(M)
    for i in range(n):
        b[i], b[order[i]] = b[order[i]], b[i]
    for i in range(n):
        for c in range(i):
            b[i] -= M[i, c] * b[c]
    for i in range(n - 1, -1, -1):
        for c in range(i + 1, n):
            b[i] -= M[i, c] * b[c]
        b[i] /= M[i, i]


def _extrapolation_step(
    of: Stretch, t: float, h: float, J: Array, table: Array
) -> tuple[float, int]:
    """A step extrapolated from 1, 2, 3 … linearly implicit Euler steps, into table[0]; its error,
    and columns taken."""
    k, z, n, error, rtol = of.k, of.z, len(J), math.inf, max(LOCAL * of.k.rtol, FINEST_STIFF)
    M, order, rate = np.empty((n, n)), np.empty(n, np.int64), np.empty(n)
    for column in range(COLUMNS):
        steps = column + 1
        part, y = h / steps, table[column]
        M[:] = np.eye(n) - part * J
        _lu_factor(M, order)
        y[:] = z
        for s in range(steps):
            equations.rates(t + (s + 1) * part, y, k, rate)
            rate *= part
            _lu_solve(M, order, rate)
            y += rate
        square = 0.0
        for q in range(column - 1, -1, -1):
            square = 0.0
            for i in range(n):
                more = (table[q + 1, i] - table[q, i]) / (steps / (q + 1) - 1)
                table[q, i] = table[q + 1, i] + more
                size = rtol * (of.scale[i] / FINER + max(abs(z[i]), abs(table[q, i])))
                square += (more / size) ** 2
        error = math.sqrt(square / n) if column > 0 else math.inf
        if error <= 1 or (not error < 1e10 and column > 0):
            return error, steps
    return error, COLUMNS


def implicit_steps(
    of: Stretch, start: float, tau: float, h: float, taken: int
) -> tuple[int, float, float, int, int]:
    """As `explicit_steps`, by `STIFF_STEPS` implicit ones, or until all slips are `GROWN_SLIP`.

    A Jacobian shifts z by a share of it, at least of its size, of a slip times the tolerance."""
    k, until, z, scale, times, samples, arm, level = of
    n, span, (first, end) = len(z), until - start, coordinates.TURNING[k.case]
    table, J, here, rate = np.empty((COLUMNS, n)), np.empty((n, n)), np.empty(n), np.empty(n)
    now, values = np.empty(n), np.empty(len(arm))
    for _ in range(STIFF_STEPS):
        if tau >= span:
            return DONE, tau, h, -1, taken
        equations.rates(start + tau, z, k, here)
        for c in range(n):
            now[:] = z
            is_slip = c in range(first, end, 2)
            now[c] += math.sqrt(EPS) * max(abs(z[c]), scale[c] * (k.rtol if is_slip else 1.0))
            equations.rates(start + tau, now, k, rate)
            J[:, c] = (rate - here) / (now[c] - z[c])
        if h <= 0:
            h = _first_length(1e-3, here, span - tau, of)
        stop = min(span, times[taken] - start) if taken < len(times) else span
        while True:
            length = min(h, stop - tau)
            if length <= 4 * EPS * tau or length < 1e-300:
                return STUCK, tau, h, -1, taken
            error, columns = _extrapolation_step(of, start + tau, length, J, table)
            if error <= 1:
                break
            h = length / 4
        after = stop if length == stop - tau else tau + length
        now[:] = table[0]
        equations.guards(start + after, now, k, values)
        fired = -1
        for guard in range(len(arm)):
            if values[guard] > arm[guard]:
                level[guard] = 0.0
            elif values[guard] < level[guard]:
                fired = guard
                break
        if fired >= 0:  # halve the step until it ends at the guard
            low, high = 0.0, length
            while high - low > 4 * EPS * max(tau, length):
                middle, fell = (low + high) / 2, -1
                _extrapolation_step(of, start + tau, middle, J, table)
                equations.guards(start + (tau + middle), table[0], k, values)
                for guard in range(len(arm)):
                    fell = guard if values[guard] < level[guard] else fell
                if fell >= 0:
                    high, fired = middle, fell
                    now[:] = table[0]
                else:
                    low = middle
            z[:] = now
            return FIRED, tau + high, h, fired, taken
        z[:] = now
        tau = after
        while taken < len(times) and _is_past(times[taken], start, tau):
            samples[taken, :n] = z
            taken += 1
        if length == h or error < 0.01:
            grow = 1.4 ** (USUAL - columns) * SAFETY * max(error, 1e-3) ** (-1 / columns)
            h = length * min(4.0, grow)
        if coordinates.least_slip(z, scale, k.case) > GROWN_SLIP:
            return OTHER, tau, 0.0, -1, taken
    return PAUSED, tau, h, -1, taken
