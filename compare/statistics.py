"""Numbers with uncertainties from sampled runs: window means, settling, extrapolation to a vanishing step."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq, linear_sum_assignment

from model import Case, InputError, Trajectory
from model.arrays import Array

COVERAGE = 3.0
"""Standard uncertainties in a tolerance."""


@dataclass(frozen=True)
class Measured:
    """A value, its standard uncertainty, and how many independent samples it stands on."""

    value: float
    uncertainty: float
    independent: float = math.nan


@dataclass(frozen=True)
class Extrapolated:
    """The limit of a vanishing time step; `order` is what the three steps show, nan if they show none."""

    value: float
    uncertainty: float
    order: float


def window_mean(time: npt.ArrayLike, values: npt.ArrayLike) -> Measured:
    """Mean of samples (n,) at equally spaced times (n,) of a run that has settled or nearly so.

    Three causes of uncertainty are added in quadrature: scatter, with the number of independent samples from the
    autocorrelation; the rest of an exponential approach, from the means of three thirds (Aitken); and the rounding
    of the samples themselves. Raises `InputError` for fewer than 6 samples or values that are not finite.
    """
    t, v = np.asarray(time, dtype=float), np.asarray(values, dtype=float)
    if t.shape != v.shape or t.ndim != 1 or len(v) < 6:
        raise InputError(
            f"a window mean needs two equal rows of at least 6 samples, not shapes {t.shape} and {v.shape}"
        )
    if not np.all(np.isfinite(v)):
        raise InputError("a window mean needs finite samples")
    mean = float(v.mean())
    independent = len(v) / correlation_length(v)
    scatter = float(v.std(ddof=1)) / math.sqrt(independent)
    rounding = float(np.finfo(float).eps * np.abs(v).max())
    return Measured(mean, math.sqrt(scatter**2 + _approach(v) ** 2 + rounding**2), independent)


def correlation_length(values: Array) -> float:
    """Samples per independent sample, 1 + 2 sum rho_k >= 1, summed while pairs of rho_k are positive (Geyer 1992)."""
    v = values - values.mean()
    variance = float(v @ v)
    if variance <= (np.finfo(float).eps * np.abs(values).max()) ** 2 * len(v):
        return 1.0
    spectrum = np.abs(np.fft.rfft(v, 2 * len(v))) ** 2
    rho = np.fft.irfft(spectrum)[: len(v)] / variance
    pairs = rho[: len(rho) // 2 * 2].reshape(-1, 2).sum(axis=1)
    last = int(np.argmax(pairs <= 0)) if np.any(pairs <= 0) else len(pairs)
    return float(min(max(1.0, 2 * pairs[:last].sum() - 1), len(v)))


def _approach(v: Array) -> float:
    """How far the mean still is from the limit of an exponential approach, judged by the means of three thirds."""
    first, second, third = (float(part.mean()) for part in np.array_split(v, 3))
    slower = abs(third - second) / abs(second - first) if second != first else 0.0
    # Thirds that come together by less than a twentieth say only that nothing has settled.
    return abs(third - first) / 2 + abs(third - second) * slower / (1 - min(slower, 0.95))


def settled_from(time: npt.ArrayLike, values: npt.ArrayLike, tolerance: float) -> float:
    """Earliest time (s) from which samples stay within `tolerance` of the mean of their last tenth; nan if never.

    A run counts as settled only if it did so in its first 9 tenths.
    """
    t, v = np.asarray(time, dtype=float), np.asarray(values, dtype=float)
    tail = max(1, len(v) // 10)
    away = np.flatnonzero(np.abs(v - v[-tail:].mean()) > tolerance)
    if len(away) == 0:
        return float(t[0])
    return float(t[away[-1] + 1]) if away[-1] + 1 < len(v) - tail else math.nan


def richardson(
    steps: Sequence[float], values: Sequence[float], uncertainties: Sequence[float] = (0.0, 0.0, 0.0)
) -> Extrapolated:
    """Extrapolate three values at decreasing time steps to step 0, by ``value + const step^order``.

    The uncertainty is what the observed order changes against the nearest whole one, and the noise. Where differences
    don't shrink like a power of the step between 0.2 and 8 there is no order to go by: the value at the smallest step
    stands, and the largest difference is its uncertainty. Raises `InputError` unless there are three falling steps.
    """
    if not len(steps) == len(values) == len(uncertainties) == 3 or not steps[0] > steps[1] > steps[2] > 0:
        raise InputError(f"Richardson extrapolation needs three falling time steps > 0, not {list(steps)}")
    (h1, h2, h3), (v1, v2, v3) = steps, values
    noise = math.hypot(*uncertainties)
    spread = max(abs(v1 - v2), abs(v2 - v3))

    def excess(order: float) -> float:
        return float((v1 - v2) * (h2**order - h3**order) - (v2 - v3) * (h1**order - h2**order))

    low, high = 0.2, 8.0
    if abs(v2 - v3) <= 3 * noise or excess(low) * excess(high) >= 0:
        return Extrapolated(v3, math.hypot(spread, noise), math.nan)
    order = float(brentq(excess, low, high))
    correction, whole = ((v3 - v2) / ((h2 / h3) ** q - 1) for q in (order, max(1, round(order))))
    return Extrapolated(v3 + correction, abs(correction - whole) + (1 + abs(correction / (v3 - v2))) * noise, order)


def tail(run: Trajectory, share: float = 0.1) -> slice:
    """The samples of the last part of a run."""
    return slice(int((1 - share) * len(run.time)), None)


def settled_mean(run: Trajectory, values: Array, share: float = 0.1) -> Measured:
    """Mean of values (n,), one a sample, over the last part of a run."""
    last = tail(run, share)
    return window_mean(run.time[last], values[last])


def settled_case(run: Trajectory, share: float = 0.1) -> Case:
    """The case of most samples in the last part of a run."""
    return Case(int(np.bincount(run.case[tail(run, share)]).argmax()))


def straight_line(x: npt.ArrayLike, y: npt.ArrayLike, noise: npt.ArrayLike) -> tuple[Measured, Measured]:
    """Zero and slope of the line through points x, y (n,) whose y have the standard uncertainties `noise`.

    The uncertainties are those of the points carried over, and the scatter about the line where that is larger.
    """
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    weight = np.maximum(np.broadcast_to(noise, y.shape), np.finfo(float).eps * np.abs(y).max()) ** -2.0
    # About the weighted mean, height and slope are independent of each other, and one point may outweigh all others.
    x0, y0 = np.average(x, weights=weight), np.average(y, weights=weight)
    spread = np.sum(weight * (x - x0) ** 2)
    slope = np.sum(weight * (x - x0) * (y - y0)) / spread
    scatter = max(1.0, np.sum(weight * (y - y0 - slope * (x - x0)) ** 2) / max(1, len(x) - 2))
    height, rise = np.sqrt(scatter / weight.sum()), np.sqrt(scatter / spread)
    zero = x0 - y0 / slope
    return (
        Measured(float(zero), math.hypot(height / slope, (zero - x0) / slope * rise)),
        Measured(float(slope), float(rise)),
    )


def propagator(record: Array, lag: int) -> Array:
    """P (d, d) with record[k + lag] = P record[k] in least squares, of a record (n, d, d) of a linear motion.

    The columns of record[k] are d independent motions at sample k; rows should be scaled to be of like size.
    """
    now, later = record[:-lag], record[lag:]
    gram = np.einsum("nij,nkj->ik", now, now)
    return np.asarray(np.linalg.solve(gram, np.einsum("nij,nkj->ik", now, later)).T)


def exponents(at: Callable[[int], Array], interval: float, longest: int) -> npt.NDArray[np.complex128]:
    """All exponents (d,) in s-1 of a linear motion whose propagator over k sample intervals is at(k), (d, d).

    Each is followed to lags that are longer by a factor of two, up to its own time constant or `longest`: a longer lag
    shows what is slow more sharply, and what is fast has gone by then.
    """
    lag, found = 1, _logarithms(at(1)) / interval
    while 2 * lag <= longest:
        lag *= 2
        slow = np.abs(found) * lag * interval < 1
        if not slow.any():
            break
        found = np.where(slow, matched(_logarithms(at(lag)) / (lag * interval), found), found)
    return found


def matched(values: npt.NDArray[np.complex128], to: npt.NDArray[np.complex128]) -> npt.NDArray[np.complex128]:
    """Values (d,) in the order in which they are, one to one, nearest to others (d,)."""
    order = linear_sum_assignment(np.abs(to[:, None] - values[None, :]))[1]
    return np.asarray(values[order])


def _logarithms(matrix: Array) -> npt.NDArray[np.complex128]:
    """Logarithms of the eigenvalues of a matrix; of one that is 0, a decay to round-off."""
    values = np.linalg.eigvals(matrix).astype(complex)
    return np.asarray(np.log(np.where(values == 0, np.finfo(float).eps, values)))
