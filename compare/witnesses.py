"""What engines other than the one on trial say of a claim: in the limit of no time step, or as they
come.

An engine in the limit measures the same with several time steps. Of every check the deviation from
theory, divided by its scale, is extrapolated to no step, by polynomials in h through the steps that
begin with h or, too, where the order found is above 1.5, with h^2. The standard uncertainty is made
up of what the last term changes and of the difference of both kinds of polynomials, or from the
limit by the power found where that is low; where there are only three steps it is at least a share
of what extrapolation takes away. A claim is then judged as always, with a ceiling on what a check
may overlook. Settled states next to a measured threshold have no limit, since there the step
decides on the case, and thresholds none that move by more than a hundredth with the step.

An engine as it comes measures with its own step alone, and a claim holds if no number is off by
more than a share of its scale, `Engine.allowance`."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace
from functools import reduce
from operator import or_
from statistics import median
from typing import Self

import numpy as np
from scipy.optimize import brentq, linear_sum_assignment

from compare.claim import Claim, Outcome, Verdict, Witness
from compare.judge import (
    checks_of,
    lost_to,
    outcome,
    per_bearing,
    undecided_bearings,
    verdict,
)
from compare.kit.engines import Engine, engine
from compare.kit.lab import coarse_step
from compare.kit.quantities import quantity
from compare.kit.record import Check, Measurement, Missing, Records, RecordsByEngine, Relation
from compare.kit.scales import time_unit
from compare.kit.statistics import COVERAGE, Estimate
from model.arrays import Array
from model.kinematics import VARIABLES, state_units

SAFETY = 0.1
"""Least standard uncertainty of a limit from three steps, divided by what extrapolation takes away
from the finest: one check is all they allow. Grid convergence studies have a factor of safety of
1.25, for two standard uncertainties."""
SAME = 0.01
"""Least tolerance in units of the ceiling: sampling, windows and fits are the same at every step,
and no step shows what they do. (Both chosen after a first measurement on 24 sets.)"""
CEILING, COARSEST = 300.0, 2e-2
"""A check in the limit may overlook so many times as much as one of the engine on trial, but no
more than 2 %, unless that may, too. (Raised from 100 after a first measurement, when uncertainties
were made three times as large.)"""
USUAL_STEP = 2e-3
"""MuJoCo's own time step, s, at which users meet its deviations."""
NEAR = 0.1
"""Largest difference of the conditions of two measurements of the same thing with different steps,
by their size."""
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
"""Order found below which the limit by that power is looked at, too: where a ball loses the floor,
a deviation may fall as the root of the step. (Chosen after that had been seen, at one threshold of
115.)"""
LEAST_STEPS = 3
"""Time steps with which a number must have been measured to have a limit."""
Step = tuple[int, Check]
"""A check, and the time steps in one that its protocol asks for."""


def full_verdict(claim: Claim, testimony: RecordsByEngine) -> Verdict:
    """The verdict on a claim by the engine on trial, and what each engine says, that one first."""
    (name, steps), *others = testimony.items()
    measured = steps[max(steps)]
    thresholds = measured.select("thresholds", where=lambda m: m.quantity.startswith("omega_0"))
    ends = {(m.set, m.value) for m in thresholds}
    if len(steps) == 1 and not engine(name).allowance:
        said = verdict(claim, measured)
        first = Witness(
            engine=name,
            outcome=Outcome.NOT_ASKED if said.outcome is Outcome.NOT_RUN else said.outcome,
            reason=said.error,
            checks=said.checks,
            deviations=_deviations(said.checks),
            left_out=said.left_out,
        )
    else:
        first = _testify(claim, engine(name), steps, ends)
        said = Verdict(claim=claim, outcome=first.outcome, checks=first.checks, error=first.reason)
    beside = (_testify(claim, engine(other), own, ends, first.checks) for other, own in others)
    return replace(said, witnesses=(first, *beside))


def _testify(
    claim: Claim,
    by: Engine,
    steps: Mapping[int, Records],
    ends: Set[tuple[str, float]],
    trial: Sequence[Check] = (),
) -> Witness:
    """What an engine says of a claim; `ends` are measured thresholds, `trial` the checks of the
    engine on trial.

    Of a bearing it should have as many numbers as with any of its steps, and where the engine on
    trial has some, one, or one for each set that was asked of both.

    Nothing, where theory breaks down, or no protocol of the claim was asked of it. Else it leaves
    the claim undecided where too few of its numbers can tell, those without a limit among them: see
    `_limit_of_no_step`."""
    protocols = claim.protocols
    rows = [
        (n, row)
        for n, own in sorted(steps.items())
        for row in own.rows
        if row.protocol in protocols
    ]
    finest = {
        row.protocol: n for n, row in rows
    }  # the largest number by which the step of each was divided
    lost = [each for own in steps.values() for each in lost_to(claim, own)]
    missing = lost + [
        row for n, row in rows if isinstance(row, Missing) and finest[row.protocol] == n
    ]
    try:
        found = {n: checks_of(claim, own) for n, own in steps.items()}
    except Exception as error:  # a theory that breaks down loses its claim, whoever measured
        return Witness(
            engine=by.name, outcome=Outcome.ERROR, reason=f"{type(error).__name__}: {error}"
        )
    asked = {(row.protocol, row.set) for _, row in rows}
    shared = {(c.bearing, m.set) for c in trial if ((m := c.measurement).protocol, m.set) in asked}
    if not shared and not any(found.values()):
        reasons = [
            "at this level nothing that bears on the claim was asked of it",
            *map(str, missing[:3]),
        ]
        return Witness(engine=by.name, outcome=Outcome.NOT_ASKED, reason="; ".join(reasons))
    orders = list[float]()
    if (
        share := by.allowance
    ):  # numbers may be off by a share of their scales, since their errors have no limit
        checks = tuple(
            replace(c, tolerance=share * c.scale, ceiling=2 * share)
            if quantity(c.measurement.quantity).resolution
            else c
            for c in found[max(found)]
        )
    else:
        limits = [
            limit
            for row in _sequences_by_step(found, finest)
            if (limit := _limit_of_no_step(row, ends))
        ]
        checks, orders = (
            tuple(check for check, _ in limits),
            [order for _, order in limits if math.isfinite(order)],
        )
    most = reduce(or_, map(per_bearing, found.values()))
    wanted = (
        most
        | Counter(bearing for bearing, _ in shared)
        | Counter({check.bearing for check in trial})
    )
    usual = (
        (c, coarse_step(c.measurement.parameters) / n) for n, each in found.items() for c in each
    )
    return Witness(
        engine=by.name,
        outcome=outcome(claim, checks, wanted, lost),
        reason=_too_few(claim, checks, wanted, missing) or "; ".join(map(str, lost[:3])),
        checks=checks,
        order=median(orders) if orders else math.nan,
        deviations=_deviations(c for c, step in usual if by.allowance or step == USUAL_STEP),
        left_out=sum(each.rows for each in missing) + most.total() - len(checks),
    )


def _too_few(
    claim: Claim, checks: Sequence[Check], wanted: Counter[int], missing: Sequence[Missing]
) -> str:
    """In words of which bearings too few numbers can tell, and what was not measured of these;
    empty if of none."""
    if not (few := undecided_bearings(checks, wanted)):
        return ""
    symbols: dict[str, list[str]] = {}
    for n, told in sorted(few.items()):
        symbols.setdefault(f"{told} of {wanted[n]}", []).append(
            quantity(claim.bearings[n].quantity).symbol
        )
    counts = " and ".join(
        f"{count} in {', '.join(dict.fromkeys(those))}" for count, those in symbols.items()
    )
    gone = [
        str(each) for each in missing if each.protocol in {claim.bearings[n].protocol for n in few}
    ]
    return "; ".join([f"too few numbers can tell: {counts}", *gone[:3]])


def _deviations(checks: Iterable[Check]) -> tuple[float, ...]:
    """Sizes of deviations divided by their scales, of checks that are certain enough to show
    them."""
    numbers = (
        c
        for c in checks
        if quantity(c.measurement.quantity).resolution and c.relation is Relation.EQUAL
    )
    off = (abs(c.deviation / c.scale) for c in numbers if c.scale > 10 * c.tolerance)
    return tuple(each for each in off if math.isfinite(each))


def _numbers_of(m: Measurement) -> dict[str, float]:
    """The numbers among the conditions of a measurement, and those of its parameters that protocols
    choose."""
    numbers = {name: v for name, v in m.conditions.items() if not isinstance(v, str)}
    return numbers | {name: getattr(m.parameters, name) for name in ("omega_0", "c", "mu", "eta")}


@dataclass(frozen=True)
class Alike:
    """What checks of one thing with different time steps share: all but the numbers among their
    conditions."""

    protocol: str
    bearing: int
    set: str
    texts: tuple[tuple[str, str], ...]

    @classmethod
    def of(cls, check: Check) -> Self:
        """What a check shares with those of the same thing with other steps."""
        m = check.measurement
        texts = sorted(
            (name, value) for name, value in m.conditions.items() if isinstance(value, str)
        )
        return cls(m.protocol, check.bearing, m.set, tuple(texts))


def _sequences_by_step(
    found: Mapping[int, Sequence[Check]], finest: Mapping[str, int]
) -> Iterator[list[Step]]:
    """For each check with the finest step of its protocol: those of the same with coarser steps,
    and itself last."""
    groups: dict[int, dict[Alike, list[Check]]] = {n: {} for n in sorted(found)}
    for n, group in groups.items():
        for check in found[n]:
            group.setdefault(Alike.of(check), []).append(check)
    for n, kind, last in [
        (n, kind, own) for n, group in groups.items() for kind, own in group.items()
    ]:
        if n == finest[kind.protocol]:
            steps: list[list[Step]] = [[] for _ in last]
            for coarser, others in [
                (m, group[kind]) for m, group in groups.items() if m < n and kind in group
            ]:
                for i, k in _pair_nearest(last, others):
                    steps[i].append((coarser, others[k]))
            yield from ([*row, (n, check)] for row, check in zip(steps, last, strict=True))


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


def _limit_of_no_step(
    there: Sequence[Step], ends: Set[tuple[str, float]] = frozenset()
) -> tuple[Check, float] | None:
    """A check extrapolated to no time step, and the order of convergence, nan where the step shows
    nothing.

    None of a state so near a threshold that the step may decide on its case; where it wasn't
    measured with three steps; and of a threshold that moves too far with the step."""
    last = there[-1][1]
    m, scale, p = last.measurement, last.scale or 1.0, last.measurement.parameters
    wanted, threshold = quantity(m.quantity).resolution, m.quantity.startswith("omega_0")
    near = [end for name, end in ends if name == m.set and abs(p.omega_0 - end) < MARGIN * end]
    if near and m.protocol in ("settled", "hysteresis"):
        return None
    if wanted == 0 or (math.isnan(last.predicted) and len(there) >= LEAST_STEPS):
        return (
            last,
            math.nan,
        )  # what is counted, or unknown to theory, has no limit but what the finest step says
    errors = np.array(
        [(each.measurement.value - each.predicted) / (each.scale or 1.0) for _, each in there]
    )
    own = np.array([each.measurement.uncertainty / (each.scale or 1.0) for _, each in there])
    if (
        len(there) < LEAST_STEPS
        or not np.all(np.isfinite(errors))
        or (threshold and np.ptp(errors) > FAR_OFF)
    ):
        return None
    shortest = min(time_unit(p), 1 / abs(p.omega_0) if p.omega_0 else math.inf)
    value, order = extrapolated(
        coarse_step(p) / shortest / np.array([n for n, _ in there], float), errors, own
    )
    ceiling = max(wanted, min(CEILING * wanted, COARSEST))
    share = 1.0 if m.quantity == WORST else SAFETY if len(there) == LEAST_STEPS else 0.0
    taken, hidden = share * (value.value - errors[-1]), 0.0
    if threshold:  # whose last two brackets may hide a change
        (before, _), (finest, _) = there[-2:]
        hidden = math.hypot(*own[-2:]) * before / (finest - before)
    doubt = max(math.hypot(value.uncertainty, taken, hidden), SAME * ceiling / COVERAGE)
    measured = replace(m, value=last.predicted + value.value * scale, uncertainty=doubt * scale)
    return replace(
        last, measurement=measured, tolerance=COVERAGE * measured.uncertainty, ceiling=ceiling
    ), order


def extrapolated(steps: Array, errors: Array, own: Array) -> tuple[Estimate, float]:
    """The limit of errors (n,) with steps (n,), the coarsest first, and the order found from the
    last three.

    Steps are in natural units, sqrt(R/g) or the time in which the fluid turns by a radian,
    whichever is the shorter.

    `own` (n,) are standard uncertainties of the errors that have nothing to do with the step. Where
    the last three errors differ by no more than these, the last is the limit, and the order nan; at
    worst they go on so to no step. Where four or more fall faster than by any order that is looked
    for, the last is, too, to within its last change. (Chosen after errors of fourth order had been
    seen.)

    The uncertainty covers the truth where the leading term is at least a third of what the next one
    would be with a step of a natural time unit. Of random series whose leading term may vanish by
    chance it misses one in a hundred."""
    change = abs(float(errors[-1] - errors[-2]))
    if max(change, float(np.ptp(errors[-3:]))) <= COVERAGE * math.hypot(*np.sort(own[-3:])[1:]):
        further = change * float(steps[-1] / (steps[-2] - steps[-1]))
        return Estimate(float(errors[-1]), math.hypot(further, float(own[-1]))), math.nan
    h, (coarse, middle, fine) = steps[-3:], errors[-3:]

    def misfit(p: float) -> float:
        first, second = h[0] ** p - h[1] ** p, h[1] ** p - h[2] ** p
        return float((coarse - middle) * second - (middle - fine) * first)

    def fit(q: int, terms: int) -> tuple[float, float]:
        powers = np.array([0, *(q + k for k in range(terms))])
        weights = np.linalg.inv((steps[-terms - 1 :, None] / steps[-1]) ** powers)[0]
        return float(weights @ errors[-terms - 1 :]), float(
            np.linalg.norm(weights * own[-terms - 1 :])
        )

    def limit(q: int) -> Estimate:
        """The limit with as many terms as give the least uncertainty: more leave less out, but
        amplify the noise."""
        found, (before, _) = [], fit(q, 0)
        for terms in range(1, len(steps)):
            value, noise = fit(q, terms)
            # Terms left out are smaller than those fitted by the step in natural units.
            least = abs(value - errors[-1]) * float(steps[0]) ** terms
            found.append(Estimate(value, math.hypot(noise, abs(value - before), least)))
            before = value
        return min(found, key=lambda each: each.uncertainty)

    low, high = (
        0.2,
        2.5,
    )  # an engine of order 1 or 2 shows others where terms of several orders cancel
    slopes = np.diff(errors) / np.diff(steps**high)
    if (
        len(slopes) > 2
        and np.all(slopes[1:] * slopes[:-1] > 0)
        and np.all(np.diff(np.abs(slopes)) < 0)
    ):
        return Estimate(fine, math.hypot(change, float(own[-1]))), math.nan
    order = float(brentq(misfit, low, high)) if misfit(low) * misfit(high) < 0 else math.nan
    first = limit(1)
    if math.isnan(order):  # the changes fall as no power of the step
        return Estimate(first.value, math.hypot(first.uncertainty, float(np.ptp(errors)))), order
    other = first
    if order < LOWEST_ORDER:
        other = Estimate(
            fine - (middle - fine) * h[2] ** order / (h[1] ** order - h[2] ** order),
            first.uncertainty,
        )
    elif order > 1.5:
        other = limit(2)
    surer, apart = (
        min(first, other, key=lambda each: each.uncertainty),
        abs(first.value - other.value),
    )
    return Estimate(surer.value, math.hypot(surer.uncertainty, apart)), order
