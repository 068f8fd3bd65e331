"""Where measurements and predictions meet: the checks of a claim, and the verdict."""

import functools
import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import ParamSpec, TypeVar

import analytic
from analytic.orbits.periodic import NoOrbitError
from compare.method.quantities import quantity
from compare.method.record import Check, Measurement, Missing, Records
from compare.method.statistics import Estimate, coverage
from compare.plan import PLAN
from compare.verification.claim import Claim, Criterion, Outcome, Verdict
from model import Flow, InputError, Parameters, SimulationError, Trajectory
from model.errors import suggestion

P = ParamSpec("P")
R = TypeVar("R")
RTOL = 3e-8
"""Relative tolerance of simulations that predict: with less a wrong theory may never end, and with
more they are less sure than what is measured."""
UNKNOWN = (LookupError, InputError, NoOrbitError, SimulationError)
"""What a prediction raises without such a state: a deviation, not a breakdown."""

ENOUGH = 2 / 3  #: part of the numbers of each criterion that must be able to tell
SILENT = "its protocol measured less than is planned, and does not say why"

_computed = functools.cache(lambda function, *args, **options: function(*args, **options))


def theory(function: Callable[P, R], *args: P.args, **options: P.kwargs) -> R:
    """The value of a function of `analytic` at hashable arguments, from a cache.

    Name the function through its module where it is called, as in ``theory(pulsation.slip_onset, p,
    f)``: then a theory that was exchanged is the one that is asked."""
    result: R = _computed(function, *args, **options)  # type: ignore[arg-type]  # are hashable
    return result


def simulated(
    p: Parameters,
    x: tuple[float, ...],
    t_end: float,
    samples: int = 1,
    flow: Flow | None = None,
    rtol: float = RTOL,
) -> Trajectory:
    """The motion from a state x by event-driven simulation, with so many samples."""
    return theory(analytic.simulate, p, x, t_end, flow, sample_interval=t_end / samples, rtol=rtol)


def integrated(value: float, size: float, rtol: float = RTOL) -> Estimate:
    """A number of a simulated motion, of this size.

    Of 395 numbers of 76 motions, simulated with `RTOL` and with 1e-11, none differs by more than a
    quarter of `RTOL`. Three times as much may be off elsewhere. (It was 100 times the tolerance, a
    bound.)"""
    return Estimate(value, rtol * abs(size))


def forget() -> None:
    """Empty the cache of predictions."""
    _computed.cache_clear()


def verdict(claim: Claim, records: Records) -> Verdict:
    """The verdict on a claim: each measurement beside its prediction, and the outcome.

    Refuted if one check deviates beyond its tolerance; else not run if one of its protocols was not
    carried out; else inconclusive if of a criterion too few checks are fine enough to tell, see
    `ENOUGH`; else not run if the claim predicts numbers and has none, since counts confirm no
    number; else inconclusive if planned numbers are lost without a reason that their protocol gave;
    else confirmed. A check that is too coarse confirms nothing, and is counted apart. Whatever a
    prediction raises makes the verdict an error of this claim alone."""
    absent, lost = not_carried_out(claim, records), lost_to(claim, records)
    left_out = (each for each in records.missing if each.protocol in claim.protocols)
    missing = (*absent, *counted([*lost, *left_out]))
    try:
        checks = tuple(checks_of(claim, records))
    except Exception as error:
        # a theory that breaks down, in whatever way, loses its claim and no other
        reason = f"{type(error).__name__}: {error}"
        return Verdict(claim=claim, outcome=Outcome.ERROR, error=reason, missing=missing)
    if not checks and not missing:
        known = sorted({m.protocol for m in records.measurements} & claim.protocols)
        why = "no number bears on the claim"
        missing = tuple(Missing(name, "all sets", why, 0) for name in known)
    said = outcome(claim, checks, per_criterion(checks), lost)
    if absent and said is not Outcome.REFUTED:
        said = Outcome.NOT_RUN
    return Verdict(claim=claim, outcome=said, checks=checks, missing=missing)


def counted(missing: Iterable[Missing]) -> tuple[Missing, ...]:
    """What is missing for each reason, the most first."""
    rows = Counter[Missing]()
    for each in missing:
        rows[replace(each, rows=0)] += each.rows
    return tuple(replace(each, rows=count) for each, count in rows.most_common())


def outcome(
    claim: Claim, checks: Sequence[Check], wanted: Counter[int], lost: Sequence[Missing] = ()
) -> Outcome:
    """The outcome of a claim by its checks, of which so many were wanted: see `verdict`."""
    if not all(check.agrees for check in checks):
        return Outcome.REFUTED
    if inconclusive_criteria(checks, wanted):
        return Outcome.INCONCLUSIVE
    if not checks or (claim.numbers and claim.numbers.isdisjoint(per_criterion(checks))):
        return Outcome.NOT_RUN
    return Outcome.INCONCLUSIVE if lost else Outcome.CONFIRMED


def lost_to(claim: Claim, records: Records) -> tuple[Missing, ...]:
    """What a claim misses of the planned numbers, though no protocol said why."""
    asked = {(each.protocol, each.quantity) for each in claim.criteria}
    asked |= {(each.protocol, "") for each in claim.criteria}
    return tuple(
        Missing(protocol, of, f"{name} was measured and is lost" if name else SILENT, rows)
        for (protocol, of, name), rows in sorted(records.lost.items())
        if (protocol, name) in asked
    )


def not_carried_out(claim: Claim, records: Records) -> tuple[Missing, ...]:
    """The protocols of a claim of which there is nothing, though they are planned at its level."""
    done = {row.protocol for row in (*records.rows, *records.planned)}
    return tuple(
        Missing(name, "all sets", f"protocol {name} was not carried out")
        for name in sorted(claim.protocols - done)
        if PLAN[name].level <= claim.level
    )


def per_criterion(checks: Iterable[Check]) -> Counter[int]:
    """How many checks there are of each criterion, by its number."""
    return Counter(check.criterion for check in checks)


def inconclusive_criteria(checks: Iterable[Check], wanted: Counter[int]) -> dict[int, int]:
    """Criteria of which too few of the checks that are wanted can tell, and how many can."""
    told = per_criterion(check for check in checks if check.conclusive)
    return {n: told[n] for n, count in wanted.items() if told[n] < ENOUGH * count}


def checks_of(claim: Claim, records: Records) -> list[Check]:
    """Every measurement that bears on a claim beside its prediction."""
    return covered(
        replace(check(criterion, m), criterion=n)
        for n, criterion in enumerate(claim.criteria)
        for m in records.select(criterion.protocol, criterion.quantity, criterion.when)
    )


def covered(checks: Iterable[Check]) -> list[Check]:
    """The checks of a claim, with tolerances for as many numbers as there are."""
    checks = list(checks)
    wide = coverage(sum(check.uncertainty > 0 for check in checks))
    return [replace(check, coverage=wide) for check in checks]


def check(criterion: Criterion, m: Measurement) -> Check:
    """One measurement beside its prediction; the scale of what must be exactly equal is 1."""
    known = quantity(m.quantity)
    try:
        prediction = criterion.predict(m)
        own = prediction if isinstance(prediction, Estimate) else Estimate(float(prediction), 0.0)
        size = criterion.size(m) if criterion.size else known.size(m.parameters, own.value)
    except UNKNOWN:
        own, size = Estimate(math.nan, 0.0), 1.0
    return Check(
        measurement=m,
        predicted=own.value,
        uncertainty=math.hypot(m.uncertainty, own.uncertainty),
        scale=1.0 if known.resolution == 0 else size,
        relation=criterion.relation,
    )


def select(claims: Iterable[Claim], ids: Sequence[str] | None) -> list[Claim]:
    """The claims of the given ids, all for None; `InputError` for an unknown id."""
    known = {claim.id: claim for claim in claims}
    for name in ids or ():
        if name not in known:
            raise InputError(
                f"no claim is called {name!r}{suggestion(name, known)}; "
                "'dualball validate --list' lists them"
            )
    return [known[name] for name in (ids or known)]
