"""A convergence study in the time step, with Richardson extrapolation to a zero step.

An engine measures the same with several time steps. Of every check the deviation from theory,
divided by its scale, is extrapolated by polynomials in the step h: with all powers from the first,
and where the observed order is above 1.5 also with those from the second. The standard uncertainty
of the limit is made up of what the last term changes, and of the difference of both kinds of
polynomials, or from the limit by the observed order where that is low; with three steps alone it is
at least a share of what extrapolation takes away, as in a grid-convergence index.

What has no limit: settled states next to a measured threshold, since there the step decides on the
case, and thresholds that move by more than a hundredth with the step."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.optimize import brentq, linear_sum_assignment

from compare.method.quantities import quantity
from compare.method.record import Check, Measurement
from compare.method.runner import coarse_step
from compare.method.scales import time_unit
from compare.method.statistics import COVERAGE, Estimate
from model.arrays import Array
from model.kinematics import VARIABLES, state_units

GCI_SAFETY = 0.1
"""Least standard uncertainty of a limit from three steps, divided by what extrapolation takes away
from the finest: one check is all they allow. Grid-convergence indices have a factor of safety of
1.25, for two standard uncertainties."""
SAME = 0.01
"""Least tolerance in units of the required resolution: sampling, windows and fits are the same at
every step, and no step shows what they do. (Both chosen after a first measurement on 24 sets.)"""
LOOSER, COARSEST = 300.0, 2e-2
"""A check in the limit may overlook so many times as much as one of the engine on trial, but no
more than 2 %, unless that may, too. (Raised from 100 after a first measurement, when uncertainties
were made three times as large.)"""
NEAR = 0.1  #: largest difference of the conditions of one thing at different steps, by their size
MARGIN = 0.03
"""Relative distance from a threshold below which no limit is taken of a settled state: with a step
of a millisecond thresholds lie up to so far off, and so the step decides on the case. (Chosen after
a first measurement on 24 sets.)"""
FAR_OFF = 0.01
"""Relative range of a threshold over the time steps above which its limit can't be told from three
or four of them. (Chosen after a measurement on 24 sets.)"""
WORST = "law_in_motion"
"""The largest deviation in a motion is no smooth function of the step: its limit is as uncertain as
all that extrapolation takes away."""
LOWEST_ORDER = 0.75
"""Observed order below which the limit by that power is looked at, too: where a ball loses the
floor, a deviation may fall as the root of the step. (Chosen after that had been seen, at one
threshold of 115.)"""
ORDERS = 0.2, 2.5
"""Between which an order is looked for: others show where terms of several orders cancel."""
LEAST_STEPS = 3  #: time steps with which a number must have been measured to have a limit
Ends = Set[tuple[str, float]]  #: measured thresholds, each with the name of its set
Alike = tuple[str, int, str, tuple[tuple[str, str], ...]]
"""What checks of one thing share: protocol, criterion, set, and conditions that are no numbers."""
Limit = tuple[Check, float]
"""A check in the zero-step limit, and the observed order, nan where the step shows nothing."""


@dataclass(frozen=True)
class StepSeries:
    """The same check with several time steps, the coarsest first."""

    divisors: tuple[int, ...]  #: time steps in one that the protocol asks for, (n,)
    checks: tuple[Check, ...]

    @property
    def last(self) -> Check:
        """That with the finest step."""
        return self.checks[-1]

    @cached_property
    def errors(self) -> Array:
        """Deviations from theory divided by their scales, (n,)."""
        return np.array(
            [(c.measurement.value - c.predicted) / (c.scale or 1.0) for c in self.checks]
        )

    @cached_property
    def uncertainties(self) -> Array:
        """Their standard uncertainties, which have nothing to do with the step, (n,)."""
        return np.array([c.measurement.uncertainty / (c.scale or 1.0) for c in self.checks])

    @property
    def steps(self) -> Array:
        """The time steps in natural units, sqrt(R/g) or the time in which the fluid turns by a
        radian, whichever is the shorter, (n,)."""
        p = self.last.measurement.parameters
        shortest = min(time_unit(p), 1 / abs(p.omega_0) if p.omega_0 else math.inf)
        return coarse_step(p) / shortest / np.array(self.divisors, float)


def zero_step_limit(series: StepSeries, ends: Ends = frozenset()) -> Limit | None:
    """A check extrapolated to a zero time step; None where it has no limit.

    What is counted, or unknown to theory, has none but what the finest step says, of two or more
    that can be measured. (Cases of one step counted until chance decided that of a ball that
    chatters.)"""
    m, scale, n = series.last.measurement, series.last.scale or 1.0, len(series.checks)
    required, is_threshold = quantity(m.quantity).resolution, quantity(m.quantity).threshold
    if _next_to_threshold(m, ends):
        return None
    if (required == 0 and n > 1) or (math.isnan(series.last.predicted) and n >= LEAST_STEPS):
        return series.last, math.nan
    errors = series.errors
    if n < LEAST_STEPS or not np.all(np.isfinite(errors)):
        return None
    if is_threshold and np.ptp(errors) > FAR_OFF:
        return None
    limit, order = extrapolated(series.steps, errors, series.uncertainties)
    safety = 1.0 if m.quantity == WORST else GCI_SAFETY if n == LEAST_STEPS else 0.0
    taken = safety * (limit.value - errors[-1])
    hidden = _hidden_by_brackets(series) if is_threshold else 0.0
    looser = max(required, min(LOOSER * required, COARSEST))
    least = SAME * looser / COVERAGE
    doubt = max(math.hypot(limit.uncertainty, taken, hidden), least) * scale
    value = series.last.predicted + limit.value * scale
    measured = replace(m, value=value, uncertainty=doubt)
    return replace(series.last, measurement=measured, uncertainty=doubt, required=looser), order


def _next_to_threshold(m: Measurement, ends: Ends) -> bool:
    """Whether a settled state is so near a threshold that the step may decide on its case."""
    flow = m.parameters.omega_0
    near = any(name == m.set and abs(flow - end) < MARGIN * end for name, end in ends)
    return near and m.protocol in ("settled", "hysteresis")


def _hidden_by_brackets(series: StepSeries) -> float:
    """What the last two brackets of a threshold may hide of a change with the step."""
    before, finest = series.divisors[-2:]
    return math.hypot(*series.uncertainties[-2:]) * before / (finest - before)


def extrapolated(steps: Array, errors: Array, own: Array) -> tuple[Estimate, float]:
    """The limit of errors (n,) with steps (n,) in natural units, and the observed order.

    `own` (n,) are standard uncertainties of the errors that have nothing to do with the step. Where
    the last three errors differ by no more than these, the last is the limit, and the order nan; at
    worst they go on so to a zero step. Where four or more fall faster than by any order that is
    looked for, the last is, too, to within its last change. (Chosen after errors of fourth order
    had been seen.)

    The uncertainty covers the truth where the leading term is at least a third of what the next one
    would be with a step of a natural time unit. Of random series whose leading term may vanish by
    chance it misses one in a hundred."""
    finest, change = float(errors[-1]), abs(float(errors[-1] - errors[-2]))
    noise = COVERAGE * math.hypot(*np.sort(own[-3:])[1:])
    if max(change, float(np.ptp(errors[-3:]))) <= noise:
        further = change * float(steps[-1] / (steps[-2] - steps[-1]))
        return Estimate(finest, math.hypot(further, float(own[-1]))), math.nan
    if _falls_faster(steps, errors):
        return Estimate(finest, math.hypot(change, float(own[-1]))), math.nan
    order = observed_order(steps[-3:], errors[-3:])
    first = _polynomial_limit(steps, errors, own, 1)
    if math.isnan(order):  # the changes fall as no power of the step
        return Estimate(first.value, math.hypot(first.uncertainty, float(np.ptp(errors)))), order
    other = first
    if order < LOWEST_ORDER:
        other = Estimate(_power_limit(steps[-2:], errors[-2:], order), first.uncertainty)
    elif order > 1.5:
        other = _polynomial_limit(steps, errors, own, 2)
    surer = min(first, other, key=lambda each: each.uncertainty)
    apart = abs(first.value - other.value)
    return Estimate(surer.value, math.hypot(surer.uncertainty, apart)), order


def _falls_faster(steps: Array, errors: Array) -> bool:
    """Whether four or more errors fall faster than by the highest order that is looked for."""
    slopes = np.diff(errors) / np.diff(steps ** ORDERS[1])
    one_way = np.all(slopes[1:] * slopes[:-1] > 0)
    return bool(len(slopes) > 2 and one_way and np.all(np.diff(np.abs(slopes)) < 0))


def observed_order(steps: Array, errors: Array) -> float:
    """The order p by which three errors change as h^p; nan where there is none within `ORDERS`."""
    h, (coarse, middle, fine) = steps, errors

    def misfit(p: float) -> float:
        first, second = h[0] ** p - h[1] ** p, h[1] ** p - h[2] ** p
        return float((coarse - middle) * second - (middle - fine) * first)

    low, high = ORDERS
    return float(brentq(misfit, low, high)) if misfit(low) * misfit(high) < 0 else math.nan


def _power_limit(steps: Array, errors: Array, order: float) -> float:
    """The limit of two errors that change as a power of the step."""
    (coarse, fine), h = errors, steps
    return float(fine - (coarse - fine) * h[1] ** order / (h[0] ** order - h[1] ** order))


def _polynomial_limit(steps: Array, errors: Array, own: Array, lowest: int) -> Estimate:
    """The limit by polynomials with the powers of h from the lowest on.

    With as many terms as give the least uncertainty: more leave less out, but amplify the noise."""

    def fit(terms: int) -> tuple[float, float]:
        powers = np.array([0, *(lowest + k for k in range(terms))])
        weights = np.linalg.inv((steps[-terms - 1 :, None] / steps[-1]) ** powers)[0]
        value = float(weights @ errors[-terms - 1 :])
        return value, float(np.linalg.norm(weights * own[-terms - 1 :]))

    found, (before, _) = [], fit(0)
    for terms in range(1, len(steps)):
        value, noise = fit(terms)
        # Terms left out are smaller than those fitted by the step in natural units.
        least = abs(value - errors[-1]) * float(steps[0]) ** terms
        found.append(Estimate(value, math.hypot(noise, abs(value - before), least)))
        before = value
    return min(found, key=lambda each: each.uncertainty)


def series_by_step(
    found: Mapping[int, Sequence[Check]], finest: Mapping[str, int]
) -> Iterator[StepSeries]:
    """Each check, by step divisor, with its protocol's `finest`, and those with coarser steps."""
    groups: dict[Alike, dict[int, list[Check]]] = {}
    for divisor in sorted(found):
        for check in found[divisor]:
            groups.setdefault(_shared(check), {}).setdefault(divisor, []).append(check)
    for (protocol, *_), by_divisor in groups.items():
        if (last := finest[protocol]) not in by_divisor:
            continue
        ones = by_divisor.pop(last)
        series = [{last: own} for own in ones]
        for divisor, others in by_divisor.items():
            for i, k in _pair_nearest(ones, others):
                series[i][divisor] = others[k]
        for each in series:
            divisors, checks = zip(*sorted(each.items()), strict=True)
            yield StepSeries(divisors, checks)


def _shared(check: Check) -> Alike:
    """What a check shares with those of the same thing with other steps."""
    m = check.measurement
    texts = sorted((name, v) for name, v in m.at.items() if isinstance(v, str))
    return m.protocol, check.criterion, m.set, tuple(texts)


def _pair_nearest(ones: Sequence[Check], others: Sequence[Check]) -> Iterator[tuple[int, int]]:
    """Pairs of indices of checks of one kind that were measured at the same place, or nearly so."""
    p, names = ones[0].measurement.parameters, sorted(_numbers_of(ones[0].measurement))
    natural = dict(zip(VARIABLES, state_units(p), strict=True))
    natural |= dict.fromkeys(("frequency", "decay_rate"), 1 / time_unit(p))
    here, there = (
        np.array([[_numbers_of(c.measurement).get(name, 0.0) for name in names] for c in checks])
        for checks in (ones, others)
    )
    largest = np.maximum(np.abs(here).max(axis=0), np.abs(there).max(axis=0))
    size = np.maximum(largest, [natural.get(name, 1e-300) for name in names])
    apart = np.abs((here[:, None] - there[None]) / size).max(axis=2)
    pairs = zip(*(index.tolist() for index in linear_sum_assignment(apart)), strict=True)
    yield from ((i, k) for i, k in pairs if apart[i, k] <= NEAR)


def _numbers_of(m: Measurement) -> dict[str, float]:
    """The numbers among conditions, and those of the parameters that protocols choose."""
    numbers = {name: v for name, v in m.at.items() if isinstance(v, float)}
    return numbers | {name: getattr(m.parameters, name) for name in ("omega_0", "c", "mu", "eta")}
