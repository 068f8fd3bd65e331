"""What each engine says of a claim: by its own time step, in the zero-step limit, or as it comes.

The engine on trial is judged by the tolerances of its measurements. An engine in the limit measures
the same with several time steps, and is judged by what `convergence` extrapolates, with a looser
required resolution. An engine as it comes measures with its own step alone, and a claim holds if no
number is off by more than a share of its scale, `Engine.relative_tolerance`."""

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import reduce
from operator import or_
from statistics import median

from compare.engines.study import Engine, engine
from compare.method.quantities import quantity
from compare.method.record import Check, Missing, Records, RecordsByEngine, Relation
from compare.method.runner import coarse_step
from compare.verification import judge
from compare.verification.claim import Claim, EngineVerdict, Outcome, Verdict
from compare.verification.convergence import Ends, series_by_step, zero_step_limit

USUAL_STEP = 2e-3  #: MuJoCo's own time step, s, at which users meet its deviations
SEVERAL = 3  #: most reasons that are told


def full_verdict(claim: Claim, evidence: RecordsByEngine) -> Verdict:
    """The verdict on a claim by the engine on trial, and what each engine says, that one first."""
    (name, steps), *others = evidence.items()
    measured = steps[max(steps)]
    thresholds = measured.select("thresholds", where=lambda m: quantity(m.quantity).threshold)
    ends = {(m.set, m.value) for m in thresholds}
    if len(steps) == 1 and not engine(name).relative_tolerance:
        said = judge.verdict(claim, measured)
        first = EngineVerdict(
            engine=name,
            outcome=Outcome.NOT_ASKED if said.outcome is Outcome.NOT_RUN else said.outcome,
            reason=said.error,
            checks=said.checks,
            deviations=_deviations(said.checks),
            missing=said.missing,
            left_out=said.left_out,
        )
    else:
        first = assess(claim, engine(name), steps, ends)
        said = Verdict(
            claim=claim,
            outcome=first.outcome,
            checks=first.checks,
            error=first.reason,
            missing=first.missing,
        )
    beside = (assess(claim, engine(other), own, ends, first.checks) for other, own in others)
    return replace(said, engines=(first, *beside))


def assess(
    claim: Claim, by: Engine, steps: Mapping[int, Records], ends: Ends, trial: Sequence[Check] = ()
) -> EngineVerdict:
    """What an engine says of a claim by its measurements at each step divisor; `ends` are measured
    thresholds, `trial` the checks of the engine on trial.

    Of a criterion it should have as many numbers as with any of its steps, and where the engine on
    trial has some, one, or one for each set that was asked of both.

    Nothing, where theory breaks down, or no protocol of the claim was asked of it. Else it leaves
    the claim inconclusive where too few of its numbers can tell; without a limit none can."""
    rows = ((n, row) for n, own in sorted(steps.items()) for row in own.rows)
    planned = [(n, row) for n, row in rows if row.protocol in claim.protocols]
    finest = {row.protocol: n for n, row in planned}
    asked = {(row.protocol, row.set) for _, row in planned}
    lost = [each for own in steps.values() for each in judge.lost_to(claim, own)]
    missing = lost + [
        row for n, row in planned if isinstance(row, Missing) and n == finest[row.protocol]
    ]
    try:
        found = {n: judge.checks_of(claim, own) for n, own in steps.items()}
    except Exception as error:  # a theory that breaks down loses its claim, whoever measured
        reason = f"{type(error).__name__}: {error}"
        return EngineVerdict(engine=by.name, outcome=Outcome.ERROR, reason=reason)
    shared = {
        (c.criterion, m.set) for c in trial if ((m := c.measurement).protocol, m.set) in asked
    }
    if not shared and not any(found.values()):
        why = "at this level nothing that bears on the claim was asked of it"
        reason = "; ".join([why, *map(str, missing[:SEVERAL])])
        return EngineVerdict(
            engine=by.name, outcome=Outcome.NOT_ASKED, reason=reason, missing=judge.counted(missing)
        )
    if by.relative_tolerance:
        checks, orders = _loosened(found[max(found)], by.relative_tolerance), []
    else:
        every = (zero_step_limit(series, ends) for series in series_by_step(found, finest))
        limits = [limit for limit in every if limit]
        checks = tuple(judge.covered(check for check, _ in limits))
        orders = [order for _, order in limits if math.isfinite(order)]
    most = reduce(or_, map(judge.per_criterion, found.values()))
    wanted = most | Counter(n for n, _ in shared) | Counter({check.criterion for check in trial})
    few = _too_few(claim, checks, wanted, missing)
    usual = (
        c
        for n, each in found.items()
        for c in each
        if by.relative_tolerance or coarse_step(c.measurement.parameters) / n == USUAL_STEP
    )
    return EngineVerdict(
        engine=by.name,
        outcome=judge.outcome(claim, checks, wanted, lost),
        reason=few or "; ".join(map(str, lost[:SEVERAL])),
        checks=checks,
        order=median(orders) if orders else math.nan,
        deviations=_deviations(usual),
        missing=judge.counted(missing),
        left_out=sum(each.rows for each in missing) + most.total() - len(checks),
    )


def _loosened(checks: Sequence[Check], share: float) -> tuple[Check, ...]:
    """Checks whose numbers may be off by a share of their scales: they have no limit."""
    return tuple(
        replace(c, uncertainty=share * c.scale / c.coverage, required=2 * share)
        if quantity(c.measurement.quantity).resolution
        else c
        for c in checks
    )


def _too_few(
    claim: Claim, checks: Sequence[Check], wanted: Counter[int], missing: Sequence[Missing]
) -> str:
    """In words of which criteria too few numbers can tell, and why; empty if of none."""
    if not (few := judge.inconclusive_criteria(checks, wanted)):
        return ""
    symbols: dict[str, list[str]] = {}
    for n, told in sorted(few.items()):
        symbol = quantity(claim.criteria[n].quantity).symbol
        symbols.setdefault(f"{told} of {wanted[n]}", []).append(symbol)
    counts = " and ".join(
        f"{count} in {', '.join(dict.fromkeys(those))}" for count, those in symbols.items()
    )
    protocols = {claim.criteria[n].protocol for n in few}
    gone = [str(each) for each in missing if each.protocol in protocols]
    return "; ".join([f"too few numbers can tell: {counts}", *gone[:SEVERAL]])


def _deviations(checks: Iterable[Check]) -> tuple[float, ...]:
    """Sizes of deviations divided by their scales, of checks that show them for sure."""
    sure = (c for c in checks if c.relation is Relation.EQUAL and c.scale > 10 * c.tolerance)
    numbers = (c for c in sure if quantity(c.measurement.quantity).resolution)
    off = (abs(c.deviation / c.scale) for c in numbers)
    return tuple(each for each in off if math.isfinite(each))
