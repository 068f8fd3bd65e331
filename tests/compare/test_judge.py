"""A verdict is computed from the numbers, and can be lost in every way; what bears on claims is
listed whole."""

import itertools
import math
import time
from collections import Counter
from dataclasses import replace

import pytest

from compare import validation
from compare.method.quantities import quantity
from compare.method.record import Missing, Planned, Records, Relation
from compare.method.statistics import COVERAGE, Estimate
from compare.plan import PLAN, Level, sets
from compare.subjects.catalogue import CLAIMS, PROTOCOLS
from compare.verification.assessment import full_verdict
from compare.verification.claim import Claim, Criterion, Outcome, Text
from compare.verification.judge import select, theory
from model import InputError, Parameters
from tests import measured as made
from tests.measured import judged

P = Parameters.named("reference")
FINE = quantity("omega_c").resolution / 10
"""Relative uncertainty with which a check of omega_c resolves enough."""


def measured(value, uncertainty, name="omega_c"):
    return Records((made.measured("settled", name, value, uncertainty, P, "mine"),))


def claim(predict=lambda m: m.parameters.omega_0, quantity="omega_c", **more):
    return made.claim("it", Criterion("settled", quantity, predict, **more))


def outcome(of, records):
    return judged(of, records).outcome


@pytest.mark.parametrize(
    ("value", "uncertainty", "expected"),
    [
        (P.omega_0, FINE, Outcome.CONFIRMED),
        (P.omega_0 * (1 + 1e-5), FINE, Outcome.REFUTED),
        (P.omega_0, 0.01 * P.omega_0, Outcome.INCONCLUSIVE),  # too coarse, however well it agrees
        (2 * P.omega_0, 0.01 * P.omega_0, Outcome.REFUTED),  # even if it is coarse
        (math.nan, FINE, Outcome.NOT_RUN),  # no number
        (P.omega_0, math.inf, Outcome.NOT_RUN),
    ],
)
def test_a_verdict_is_computed_from_the_numbers(value, uncertainty, expected):
    assert outcome(claim(), measured(value, uncertainty)) is expected


@pytest.mark.parametrize(
    ("count", "off", "expected"),
    [
        (1, 2.9, Outcome.CONFIRMED),
        (1, 3.1, Outcome.REFUTED),
        (100, 3.1, Outcome.CONFIRMED),
        (100, 4.3, Outcome.REFUTED),
    ],
)
def test_one_of_many_numbers_may_be_farther_off_by_chance(count, off, expected):
    values = [P.omega_0 * (1 + FINE * off), *[P.omega_0] * (count - 1)]
    records = sum((measured(value, FINE * P.omega_0) for value in values), Records())
    assert outcome(claim(), records) is expected


def test_without_measurements_it_was_not_run_and_the_reason_is_kept():
    why = Missing("settled", "mine", "nothing settles")
    other = Missing("other", "mine", "no matter")
    verdict = judged(claim(), Records((), (why, other, why)))
    assert verdict.outcome is Outcome.NOT_RUN
    assert verdict.missing == (replace(why, rows=2),)
    assert [str(each) for each in verdict.missing] == ["mine: nothing settles (2 left out)"]
    assert "no number bears on" in str(judged(claim(), measured(1.0, FINE, "v_y")).missing[0])


def rows(count, protocol="settled", name="omega_c", set="mine"):
    return tuple(made.measured(protocol, name, P.omega_0, FINE, P, set, n=k) for k in range(count))


GONE = {
    "one number kept": lambda m: m.at["n"] == 0,
    "every second": lambda m: m.at["n"] % 2,
    "one number": lambda m: m.at["n"] != 1,
    "one set": lambda m: m.set == "mine",
    "one criterion": lambda m: m.quantity == "omega_c",
    "another claim's": lambda m: m.quantity != "v_y",
}


@pytest.mark.parametrize("gone", GONE)
def test_what_was_measured_must_be_there(gone):
    """Numbers that are gone without a reason leave a claim undecided, whoever measured."""
    both = made.claim(
        "it",
        Criterion("settled", "omega_c", lambda m: m.parameters.omega_0),
        Criterion("settled", "wall_spin", lambda m: m.parameters.omega_0),
    )
    spins, speeds = rows(2, name="wall_spin"), rows(2, name="v_y")
    whole = Records(rows(4) + rows(4, set="other") + spins + speeds)
    kept = tuple(m for m in whole.measurements if GONE[gone](m))
    less = replace(whole, measurements=kept)
    expected = Outcome.CONFIRMED if gone == "another claim's" else Outcome.INCONCLUSIVE
    verdict = judged(both, less)
    assert verdict.outcome is expected
    assert verdict.planned == 10
    criterion = [m for m in whole.measurements if m.quantity != "v_y"]
    assert verdict.left_out == sum(not GONE[gone](m) for m in criterion)
    steps = dict.fromkeys((1, 2, 3), less)
    for engine, own in ("mujoco-plain", steps), ("mujoco-defaults", {2: less}):
        said = full_verdict(both, {"mujoco": {1: whole}, engine: own}).engines[1]
        assert said.outcome is expected, engine
        assert ("is lost" in said.reason) == (expected is Outcome.INCONCLUSIVE)


def test_a_set_of_which_a_protocol_says_nothing_leaves_its_claims_undecided():
    silent = Counter([Planned("settled", "other", "")])
    for of, expected in ("settled", Outcome.INCONCLUSIVE), ("lift", Outcome.CONFIRMED):
        about = made.claim("it", Criterion(of, "omega_c", lambda m: m.parameters.omega_0))
        whole = Records(rows(2, of))
        assert outcome(about, replace(whole, planned=whole.planned + silent)) is expected


def test_a_claim_is_not_run_before_all_of_its_protocols_are_carried_out():
    """Whatever the others say, unless that refutes it; those of a later level need not be."""
    predict, names = (lambda m: m.parameters.omega_0), ("settled", "lift", "swing")
    criteria = [Criterion(of, "omega_c", predict) for of in names]
    about, one, both = made.claim("it", *criteria), rows(2), rows(2) + rows(2, "lift")
    assert outcome(about, Records(both)) is Outcome.CONFIRMED
    excused = Records(rows(2), (Missing("lift", "mine", "why", 0),))
    assert outcome(about, excused) is not Outcome.NOT_RUN
    verdict = judged(about, Records(one))
    assert verdict.outcome is Outcome.NOT_RUN
    assert str(verdict.missing[0]) == "all sets: protocol lift was not carried out"
    off = made.claim("it", Criterion("settled", "omega_c", lambda m: 0.0), *criteria)
    assert outcome(off, Records(one)) is Outcome.REFUTED


def test_most_numbers_must_be_fine_enough_to_tell():
    sure, coarse = measured(P.omega_0, FINE), measured(P.omega_0, 0.01 * P.omega_0)
    for count, expected in (4, Outcome.CONFIRMED), (3, Outcome.INCONCLUSIVE):
        verdict = judged(claim(), sum([*[sure] * count, coarse, coarse], Records()))
        assert verdict.outcome is expected
        assert verdict.resolving_power["omega_c"] < 1e-6


def test_a_state_that_theory_does_not_know_refutes_and_a_breakdown_loses_its_own_claim_only():
    claims = [claim(lambda m: {}["no such state"]), claim(lambda m: 1 / 0), claim()]
    unknown, broken, right = (judged(each, measured(P.omega_0, FINE)) for each in claims)
    outcomes = [each.outcome for each in (unknown, broken, right)]
    assert outcomes == [Outcome.REFUTED, Outcome.ERROR, Outcome.CONFIRMED]
    assert unknown.worst == math.inf
    assert "division by zero" in broken.error


def test_bounds_hold_on_one_side_and_what_must_be_equal_has_no_tolerance():
    for relation, agrees in ((Relation.AT_MOST, -1), (Relation.AT_LEAST, 1)):
        of = claim(relation=relation)
        assert outcome(of, measured(P.omega_0 * (1 + agrees), FINE)) is Outcome.CONFIRMED
        assert outcome(of, measured(P.omega_0 * (1 - agrees / 2), FINE)) is Outcome.REFUTED
    of = claim(lambda m: 5.0, "cases")
    assert outcome(of, measured(5.0, 0.0, "cases")) is Outcome.CONFIRMED
    assert outcome(of, measured(4.0, 0.0, "cases")) is Outcome.REFUTED


def test_a_prediction_may_be_uncertain_itself():
    off = claim(lambda m: Estimate(P.omega_0 + 1e-7, 1e-7))
    verdict = judged(off, measured(P.omega_0, FINE / 100))
    assert verdict.outcome is Outcome.CONFIRMED
    assert verdict.checks[0].tolerance == pytest.approx(COVERAGE * 1e-7, rel=1e-3)


def test_resolving_power_is_the_error_of_theory_that_would_be_noticed():
    records = measured(P.omega_0, FINE)
    verdict = judged(claim(), records)
    power = verdict.resolving_power["omega_c"]
    for error, noticed in ((0.9 * power, Outcome.CONFIRMED), (1.1 * power, Outcome.REFUTED)):
        assert outcome(claim(lambda m, error=error: P.omega_0 * (1 + error)), records) is noticed


def test_predictions_are_forgotten_between_judgements():
    values = {"omega_c": P.omega_0}
    of = claim(lambda m: theory(values.__getitem__, "omega_c"))
    assert outcome(of, measured(P.omega_0, FINE)) is Outcome.CONFIRMED
    values["omega_c"] *= 1.01
    assert outcome(of, measured(P.omega_0, FINE)) is Outcome.REFUTED


def test_claims_that_are_none_are_refused():
    with pytest.raises(InputError, match="omega_c"):
        claim(quantity="omega_cc")
    with pytest.raises(ValueError, match="no measurement bears on it"):
        Claim("it", "", "", ())
    with pytest.raises(InputError, match="did you mean"):
        select([claim(), replace(claim(), id="prop-1")], ["prop-2"])


def test_a_set_of_ones_own_need_not_show_what_refutes_a_claim():
    false = replace(claim(), expected=Outcome.REFUTED)
    (row,) = measured(P.omega_0, FINE).measurements
    for name, passed in (("mine", True), ("reference", False)):
        verdict = judged(false, Records((replace(row, set=name),)))
        assert (verdict.outcome, verdict.passed) == (Outcome.CONFIRMED, passed)


def test_judging_a_claim_takes_no_longer_than_it_may(monkeypatch):
    """Whatever the files say; the judge takes every `Exception` of a prediction for a breakdown of
    the theory."""
    endless = claim(lambda m: sum(0 for _ in itertools.count()))
    monkeypatch.setattr(validation, "JUDGING", 0.1)
    told = validation._in_time(endless, {"mujoco": {1: measured(P.omega_0, FINE)}})
    assert (told.outcome, told.error) == (Outcome.ERROR, "it took longer than 0.1 s")
    time.sleep(0.3)  # the clock has stopped


def test_every_claim_predicts_a_number_that_could_refute_it():
    """No case, no count, and no bound on one side only."""
    asked = (each for each in CLAIMS if each.expected is Outcome.CONFIRMED)
    assert [each.id for each in asked if not each.numbers] == []
    sides = (Relation.AT_MOST, Relation.AT_LEAST)
    low, high = (Criterion("settled", "omega_c", lambda m: 1.0, relation=each) for each in sides)
    counts = Criterion("plane", "cases", lambda m: 1.0)
    for own, numbers in ((low, high), {0, 1}), ((low, counts), set()), ((high,), set()):
        assert made.claim("it", *own).numbers == numbers


NAMES = {protocol.name for protocol in PROTOCOLS}


def test_every_protocol_bears_on_a_claim_and_every_claim_has_its_protocols():
    assert len(NAMES) == len(PROTOCOLS)
    assert len({claim.id for claim in CLAIMS}) == len(CLAIMS)
    assert {name for claim in CLAIMS for name in claim.protocols} == NAMES == PLAN.keys()
    asked = {n for each in PLAN.values() for n in (*each.trial, *each.limit, *each.as_it_comes)}
    assert asked <= sets(Level.QUICK).keys()
    for claim in CLAIMS:
        plain = claim.text is Text.PRINTED and claim.expected is Outcome.CONFIRMED
        assert plain or claim.reason
