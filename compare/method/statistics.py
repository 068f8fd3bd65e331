"""Numbers with uncertainties: window means and peaks of sampled runs; zeros, slopes and maxima of
curves through points; exponents of linear motions; numbers as JSON has them."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from statistics import NormalDist
from typing import Any, Self

import numpy as np
import numpy.typing as npt
from numpy.polynomial import Polynomial

from model import Case, Trajectory
from model.arrays import Array

COVERAGE = 3.0  #: standard uncertainties in the tolerance of one number, see `coverage`
TAPER = 8  #: exponent of the window's sine: m periods leave about (TAPER/2)!^2/(pi m^(TAPER+1))


@dataclass(frozen=True)
class Estimate:
    """A value, its standard uncertainty, and what that is made up of."""

    value: float
    uncertainty: float
    budget: Mapping[str, float] = field(default_factory=dict, compare=False)
    """Standard uncertainties by cause, in the unit of the value."""

    def also(self, **causes: float) -> Self:
        """The same value with further causes of error, each a standard uncertainty."""
        known = self.budget or ({"measured": self.uncertainty} if self.uncertainty else {})
        uncertainty = math.hypot(self.uncertainty, *causes.values())
        return replace(self, uncertainty=uncertainty, budget=dict(known) | causes)

    def told_apart(
        self, cause: str, errors: Sequence[Estimate], carried: Sequence[float] | Array
    ) -> Self:
        """The same, where one cause is the errors of others, by the causes of these; each comes to
        so much, `carried` (n,)."""
        budget, parts = dict(self.budget), defaultdict[str, float](float)
        for each, u in zip(errors, carried, strict=True):
            own = each.budget or {cause: 1.0}
            whole = math.hypot(*own.values()) or 1.0
            for name, part in own.items():
                parts[name] = math.hypot(parts[name], u * part / whole)
        size = budget.pop(cause) / (math.hypot(*parts.values()) or 1.0)
        for name, part in parts.items():
            budget[name] = math.hypot(budget.get(name, 0.0), size * part)
        return replace(self, budget=budget)

    def times(self, factor: float) -> Self:
        """The estimate of a number that is so many times as large."""
        value, uncertainty = self.value * factor, self.uncertainty * abs(factor)
        budget = {cause: u * abs(factor) for cause, u in self.budget.items()}
        return replace(self, value=value, uncertainty=uncertainty, budget=budget)


def coverage(count: int) -> float:
    """Standard uncertainties in the tolerance of each of so many numbers (Bonferroni 1936).

    Of normal errors one of them all lies beyond it as seldom as one alone lies beyond `COVERAGE`,
    1 in 370: 3.6 of ten, 4.7 of a thousand. (Chosen after claims with up to 3000 numbers had been
    refuted, at the default level, by one or two of them a little beyond three.)"""
    normal = NormalDist()
    return -normal.inv_cdf(normal.cdf(-COVERAGE) / max(count, 1))


def uniform(half: float) -> float:
    """Standard uncertainty of an error that may be anything up to `half` on either side."""
    return half / math.sqrt(3)


def estimate(value: float, size: float = 1.0, **causes: float) -> Estimate:
    """An estimate whose errors have independent causes, given in units of `size`."""
    budget = {cause: u * size for cause, u in causes.items()}
    return Estimate(float(value), math.hypot(*causes.values()) * size, budget)


def plain(value: Any) -> Any:
    """Nested data as JSON holds it: dataclasses as mappings, a case by name, complex as a pair, and
    None for a number that isn't finite."""
    if is_dataclass(value):
        value = {each.name: getattr(value, each.name) for each in fields(value)}
    if isinstance(value, Mapping):
        return {name: plain(part) for name, part in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, complex):
        value = value.real, value.imag
    if isinstance(value, list | tuple):
        return [plain(part) for part in value]
    if isinstance(value, Case):
        return value.name
    return None if isinstance(value, float) and not math.isfinite(value) else value


def taper(length: int) -> Array:
    """Weights (n,) of a tapered window, which fall to zero at both ends."""
    return np.asarray(np.sin(np.pi * (np.arange(length) + 0.5) / length) ** TAPER)


def steady_mean(values: Array, length: int, slowest: float = 0.0) -> tuple[Array, Array]:
    """Mean of rows (k, n) over the last `length` samples, tapered, and its drift; both (k,).

    From three windows, each a quarter of its length later than the one before: what is left of an
    approach by a constant ratio, plus the last change itself. Of a time constant of `slowest`
    samples the ratio is known to be no less, however little of the way is seen."""
    first, second, last = _late_means(values, length)
    before, after = np.abs(second - first), np.abs(last - second)
    ratio = np.minimum(np.divide(after, before, out=np.zeros_like(after), where=before > 0), 0.9)
    if 0 < slowest < math.inf:
        ratio = np.maximum(ratio, math.exp(-(length // 4) / slowest))
    return last, after / (1 - ratio)


def steady_limit(values: Array, length: int) -> Array:
    """Where rows (k, n) come to, (k,), if the means of `steady_mean` go on by the ratio at which
    they approach (Aitken 1926); the last mean of what doesn't, or by more than `LARGEST_RATIO`."""
    first, second, last = _late_means(values, length)
    before, after = second - first, last - second
    ratio = np.divide(after, before, out=np.zeros_like(after), where=before != 0)
    ratio[(ratio < 0) | (ratio > LARGEST_RATIO)] = 0.0
    return np.asarray(last + after * ratio / (1 - ratio))


def _late_means(values: Array, length: int) -> list[Array]:
    """Tapered means of rows (k, n) over three windows, the last one at the end."""
    weights = taper(length)
    weights /= weights.sum()
    n, shift = values.shape[1], length // 4
    return [values[:, n - length - k * shift : n - k * shift] @ weights for k in (2, 1, 0)]


def tail(run: Trajectory, share: float = 0.1) -> slice:
    """The slice of samples of the last part of a run."""
    return slice(int((1 - share) * len(run.time)), None)


def settled_case(run: Trajectory) -> Case:
    """The case of most samples in the last part of a run."""
    return Case(int(np.bincount(run.case[tail(run)]).argmax()))


def peaks(values: Array) -> tuple[npt.NDArray[np.intp], Array]:
    """Local maxima of samples (n,): indices, and how much later, in samples, the tops are."""
    k = 1 + np.flatnonzero((values[1:-1] > values[:-2]) & (values[1:-1] >= values[2:]))
    before, at, after = values[k - 1], values[k], values[k + 1]
    return k, (before - after) / (2 * (before - 2 * at + after))


def top(values: Array, k: npt.NDArray[np.intp], late: Array) -> Array:
    """The heights of the parabolas that `peaks` puts through samples (n,)."""
    return np.asarray(values[k] + late * (values[k + 1] - values[k - 1]) / 4)


def hops(run: Trajectory) -> bool:
    """Whether a ball hops on in the last third of a run, see `hops_on`."""
    return hops_on(run.y[tail(run, 1 / 3)], run.header.parameters.R)


def hops_on(y: Array, R: float) -> bool:
    """Whether heights are those of hops: twice near the floor, and high above in between.

    High is more than half as high as the highest sample, near less than a fifth: every tenth sample
    of a hop is so low. What stays below 1e-4 R doesn't hop."""
    highest = y.max()
    near = np.flatnonzero(y < highest / 5)
    if highest < 1e-4 * R or not len(near):
        return False
    return bool(y[near[0] : near[-1] + 1].max() > highest / 2)


POINTS = 5  #: least number of points that extrapolations begin with
LEAST_RATIO, LARGEST_RATIO = 0.2, 0.9
"""Range of the ratio of the geometric series by which the changes of an estimate, point by point,
are continued: two changes may be small by chance, and with a ratio near 1 the sum has no bound."""
FAR = 10.0
"""Largest distance of a maximum from the nearest point, in lengths of the row of points: farther
away it is one of round-off."""


def slope_error(x: Array, degree: int) -> float:
    """Standard uncertainty of a fit's slope at 0, at points x (n,), if that of y is 1."""
    return float(np.linalg.norm(np.linalg.pinv(np.vander(x, degree + 1, increasing=True))[1]))


def straight_line(x: npt.ArrayLike, points: Sequence[Estimate]) -> tuple[Estimate, Estimate]:
    """Zero and slope of the line through points (n,) at x, uncertain by those of the points, or by
    the scatter about the line where that is larger."""
    x, (y, noise) = np.asarray(x, dtype=float), _values(points)
    least = np.finfo(float).eps * np.abs(y).max()
    weight = np.maximum(noise, least) ** -2.0
    # About the weighted mean, height and slope are independent of each other, and one point may
    # outweigh all others.
    x0, y0 = np.average(x, weights=weight), np.average(y, weights=weight)
    spread = np.sum(weight * (x - x0) ** 2)
    slope = np.sum(weight * (x - x0) * (y - y0)) / spread
    scatter = max(1.0, np.sum(weight * (y - y0 - slope * (x - x0)) ** 2) / max(1, len(x) - 2))
    height, rise = np.sqrt(scatter / weight.sum()), np.sqrt(scatter / spread)
    zero = x0 - y0 / slope
    sure = math.hypot(height / slope, (zero - x0) / slope * rise)
    rises = np.sqrt(weight) * (x - x0) / spread
    shifts = np.sqrt(weight) / weight.sum() + (zero - x0) * rises
    return (
        estimate(zero, points=sure).told_apart("points", points, shifts),
        estimate(slope, points=float(rise)).told_apart("points", points, rises),
    )


def _values(points: Sequence[Estimate]) -> tuple[Array, Array]:
    """Values and uncertainties, each (n,)."""
    values, noise = np.transpose([(point.value, point.uncertainty) for point in points])
    return values, noise


def zero_and_slope(x: Array, points: Sequence[Estimate]) -> tuple[Estimate, Estimate]:
    """Zero of the polynomial through points (n,) at x, and its slope; nan unless there is one.

    Uncertain by the noise of every point, and a third of what the last degree changes."""
    y, noise = _values(points)

    def fitted(values: Array, degree: int) -> Array:
        fit = Polynomial.fit(x, values, degree)
        zeros = [zero for zero in _real_roots(fit) if x.min() < zero < x.max()]
        zero = zeros[0] if len(zeros) == 1 else math.nan
        return np.array([zero, fit.deriv()(zero)])

    degree = len(x) - 1
    best = fitted(y, degree)
    shifted = [fitted(y + shift, degree) - best for shift in np.diag(noise)]
    bent = np.abs(best - fitted(y, degree - 1)) / 3
    rows = best, np.linalg.norm([bent, *shifted], axis=0), bent, np.linalg.norm(shifted, axis=0)
    found = []
    for k, (value, spread, bend, carried) in enumerate(np.transpose(rows).tolist()):
        sure = Estimate(value, spread, {"curvature": bend, "points": carried})
        found.append(sure.told_apart("points", points, [shift[k] for shift in shifted]))
    zero, slope = found
    return zero, slope


def extrapolated_zero(where: Array, values: Sequence[Estimate]) -> Estimate:
    """The place (n,) at which a quantity is zero; the value nearest to zero comes first."""

    def zero(y: Array, n: int) -> float:
        return float(Polynomial.fit(y[:n] / np.abs(y).max(), where[:n], n - 1)(0.0))

    return _extrapolated(zero, values)


def initial_slope(where: Array, values: Sequence[Estimate]) -> Estimate:
    """Derivative of the place by a quantity at its zero; as `extrapolated_zero`."""
    size = max(abs(m.value) for m in values)

    def slope(y: Array, n: int) -> float:
        return float(Polynomial.fit(y[:n] / size, where[:n], n - 1).deriv()(0.0)) / size

    return _extrapolated(slope, values)


def extrapolated_maximum(
    where: Array, values: Sequence[Estimate], others: Array | None = None
) -> Estimate:
    """The maximum of the place over a quantity, the nearest value first; nan without one.

    Or what another quantity is there, with its values `others` at the places."""

    def maximum(y: Array, n: int) -> float:
        y = y[:n] / np.abs(y).max()
        fit = Polynomial.fit(y, where[:n], n - 1)
        tops, row = _real_roots(fit.deriv()), y[0] - y[-1]
        beyond = [root for root in tops if 0 < (root - y[0]) / row < FAR]
        nearest = min(beyond, key=lambda root: abs(root - y[0]), default=math.nan)
        return float((fit if others is None else Polynomial.fit(y, others[:n], n - 1))(nearest))

    return _extrapolated(maximum, values)


def _extrapolated(found: Callable[[Array, int], float], points: Sequence[Estimate]) -> Estimate:
    """What is found(values, n) from all n, uncertain by its convergence and their noise.

    It is made without the last two points, without the last, and with all. Its changes are
    continued as a geometric series with the larger ratio of any two, at most 1, from the last
    change but one, since the last may be small by chance, or from the last if it is larger. The
    error is the term after the last, or the sum of all further terms where the last two changes
    have the same sign: with the largest ratio where their ratio has grown, as it does where the
    quantity is no smooth function."""
    values, noise = _values(points)
    count = len(values)
    row = np.array([found(values, n) for n in range(count - 3, count + 1)])
    changes = np.abs(np.diff(row))
    ratios = np.divide(changes[1:], changes[:-1], out=np.ones(2), where=changes[:-1] > 0)
    ratio = float(np.clip(ratios.max(), LEAST_RATIO, 1.0))
    rest = max(float(changes[-2]) * ratio**2, float(changes[-1]) * ratio)
    if (row[-1] - row[-2]) * (row[-2] - row[-3]) > 0:
        rest /= 1 - (LARGEST_RATIO if ratios[1] > ratios[0] > 0 else min(ratio, LARGEST_RATIO))
    carried = [found(values + shift, count) - row[-1] for shift in np.diag(noise)]
    rounding = np.finfo(float).eps * abs(row[-1]) * 2**count
    budget = {"extrapolation": rest, "rounding": rounding, "points": math.hypot(*carried)}
    sure = Estimate(float(row[-1]), math.hypot(rest, rounding, *carried), budget)
    return sure.told_apart("points", points, carried)


def _real_roots(polynomial: Polynomial) -> list[float]:
    return [float(root.real) for root in np.asarray(polynomial.roots()) if abs(root.imag) < 1e-9]


def propagator(record: Array, lag: int) -> Array:
    """P (d, d) with record[k + lag] = P record[k] in least squares, of a record (n, d, d): columns
    of record[k] are d independent motions at sample k, rows are scaled to be of like size."""
    now, later = record[:-lag], record[lag:]
    gram = np.einsum("nij,nkj->ik", now, now)
    return np.asarray(np.linalg.solve(gram, np.einsum("nij,nkj->ik", now, later)).T)


def propagator_error(record: Array, lag: int) -> float:
    """Standard uncertainty of the entries of a `propagator` from what it can't explain of a record,
    as if that were the same at all samples: solvers' errors may be of one sign."""
    now, left = record[:-lag], record[lag:] - propagator(record, lag) @ record[:-lag]
    gram = np.einsum("nij,nkj->ik", now, now)
    sizes = np.einsum("nij->i", left**2)
    return math.sqrt(float(sizes.max()) * float(np.linalg.inv(gram).diagonal().max()))


def exponents(
    at: Callable[[int], Array], interval: float, longest: int
) -> npt.NDArray[np.complex128]:
    """All exponents (d,), s-1, of a linear motion with the propagator at(k), (d, d).

    Each is measured at lags that double up to its own time constant or `longest`: a longer lag
    shows slow exponents more sharply, and fast motions have decayed by then."""

    def rates_at(lag: int) -> npt.NDArray[np.complex128]:
        values = np.linalg.eigvals(at(lag)).astype(complex)
        # a zero is a decay to round-off
        logarithms = np.log(np.where(values == 0, np.finfo(float).eps, values))
        return np.asarray(logarithms / (lag * interval))

    lag, rates = 1, rates_at(1)
    while 2 * lag <= longest:
        lag *= 2
        slow = np.abs(rates) * lag * interval < 1
        if not slow.any():
            break
        rates = np.where(slow, matched(rates_at(lag), rates), rates)
    return rates


def matched(
    values: npt.NDArray[np.complex128], to: npt.NDArray[np.complex128]
) -> npt.NDArray[np.complex128]:
    """Values (d,) reordered so that each stands where the nearest of others (d,) does."""
    from scipy.optimize import linear_sum_assignment  # here, because it takes half a second to load

    order = linear_sum_assignment(np.abs(to[:, None] - values[None, :]))[1]
    return np.asarray(values[order])
