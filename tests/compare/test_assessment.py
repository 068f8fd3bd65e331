"""What other engines say is judged in zero-step limits that contain the truth, of all that they
were asked."""

import math

import numpy as np
import pytest

from compare.method.quantities import quantity
from compare.method.record import Check, Missing, Records
from compare.method.statistics import COVERAGE
from compare.verification.assessment import full_verdict
from compare.verification.claim import Criterion, Outcome
from compare.verification.convergence import (
    COARSEST,
    LOOSER,
    StepSeries,
    extrapolated,
    zero_step_limit,
)
from model import Case, Parameters
from tests.measured import claim, measured

P = Parameters.named("reference")
RATIOS = 1 / np.array([1.0, 2.0, 3.0, 4.0])
STEPS = RATIOS / 20


def seen(error, **conditions):
    """A measurement of omega_c with a relative error."""
    value = P.omega_0 * (1 + error)
    return Records((measured("settled", "omega_c", value, 1e-12, P, "mine", **conditions),))


def said(steps, trial=None, of=None, engine="mujoco-plain"):
    """What an engine says by its measurements at steps that are so many times shorter, beside the
    engine on trial."""
    evidence = {"mujoco": {1: trial or seen(0.0)}, engine: steps}
    return full_verdict(of or claim(), evidence).engines[1]


SERIES = (
    (0.3 * RATIOS, 1e-12, 1.0),
    (0.3 * RATIOS**2, 1e-12, 2.0),
    (0.1 * RATIOS + 0.02 * RATIOS**2, 1e-12, 1.13),
    # terms of two orders cancel: -2.8e-3 h + 4.1e-3 h^2
    ([1.28e-3, -3.7e-4, -4.7e-4], 1e-14, None),
    (0.01 * np.sqrt(RATIOS), 1.4e-4, ...),
    ([1.102e-2, 6.33e-3, 5.39e-3, 4.8e-3], 1.4e-4, ...),  # as where heavy-core loses the floor
    ([1e-3, -2e-3, 5e-4, -5e-4], 1e-3, None),  # noise: the last is the limit
)


@pytest.mark.parametrize(("errors", "own", "order"), SERIES)
def test_known_sequences_have_their_limit_and_order(errors, own, order):
    limit, found = extrapolated(STEPS[: len(errors)], np.asarray(errors), np.full(len(errors), own))
    assert abs(limit.value) <= COVERAGE * limit.uncertainty
    assert limit.uncertainty >= own
    assert own > 1e-12 or order is None or abs(limit.value) <= 1e-10
    assert order is ... or (
        math.isnan(found) if order is None else found == pytest.approx(order, abs=0.01)
    )


def test_errors_of_fourth_order_have_a_limit_where_four_steps_show_it():
    """Three may differ so little by chance: then all by which they differ is in doubt."""
    steps = np.array([1.0, 0.5, 0.25, 0.125]) / 20
    errors = steps**4
    limit, order = extrapolated(steps, errors, np.zeros(4))
    assert math.isnan(order)
    assert (limit.value, limit.uncertainty) == pytest.approx((errors[3], errors[2] - errors[3]))
    few, _ = extrapolated(steps[1:], errors[1:], np.zeros(3))
    assert few.uncertainty >= np.ptp(errors[1:])


def test_the_uncertainty_of_a_limit_covers_the_truth():
    """Smooth errors of both orders, with terms that fall as the step in natural units, and noise of
    known size."""
    rng, covered = np.random.default_rng(1), []
    for _ in range(400):
        first = int(rng.integers(1, 3))
        size = rng.uniform(0.3, 1.0, 5) * rng.choice([-1, 1], 5)
        terms = [size[k] * STEPS ** (first + k) for k in range(5)]
        own = 10 ** rng.uniform(-9, -4)
        truth = rng.normal()
        errors = truth + sum(terms) + own * rng.uniform(-1, 1, 4)
        limit, _ = extrapolated(STEPS, errors, np.full(4, own))
        covered.append(abs(limit.value - truth) <= COVERAGE * limit.uncertainty)
    assert all(covered)


@pytest.mark.parametrize(
    ("left", "least", "steps", "near", "outcome"),
    [
        (0.0, 0.01, 4, 0.9, Outcome.CONFIRMED),
        (0.05, 0.01, 4, 0.9, Outcome.REFUTED),
        # Next to a threshold the step decides on the case, and all of a state in the wrong case
        # would be off.
        (0.05, 0.01, 4, 0.99, Outcome.INCONCLUSIVE),
        # Three steps show a limit to a tenth of what extrapolation takes away, 3.3e-6; with four
        # the lesser is noticed.
        (5e-7, 1e-5, 3, 0.9, Outcome.CONFIRMED),
        (5e-7, 1e-5, 4, 0.9, Outcome.REFUTED),
        (5e-6, 1e-5, 3, 0.9, Outcome.REFUTED),
    ],
)
def test_a_claim_is_judged_in_the_zero_step_limit(left, least, steps, near, outcome):
    """States that differ a little with the step are the same state; at 2 ms it is off by what users
    see."""
    end = Records((measured("thresholds", "omega_01", near * P.omega_0, 1e-6, P, "mine"),))
    errors = {n: seen(left + least / n, slip_x=1.0 + 0.05 / n) for n in range(1, steps + 1)}
    plain = said(errors, seen(0.0) + end)
    assert plain.outcome is outcome
    for check in plain.checks:
        assert (plain.left_out, plain.order) == (0, pytest.approx(1.0, abs=1e-6))
        assert plain.typical == plain.farthest == pytest.approx(left + least / 2)
        required = quantity("omega_c").resolution
        assert check.required == max(required, min(LOOSER * required, COARSEST))


@pytest.mark.parametrize(
    ("errors", "agrees"),
    [((7.0e-4, 1.2e-3, 1.2e-3), True), ((0.03, 0.02, 0.015), None), ((0.02, 0.02, 0.02), False)],
)
def test_brackets_of_thresholds_hide_what_changes_with_the_step(errors, agrees):
    """Two that are the same don't show a limit that well, and one that moves far shows none; one
    that stays off is."""
    places = [measured("thresholds", "omega_01", 10 * (1 + error), 1.4e-3) for error in errors]
    known = {"predicted": 10.0, "uncertainty": 0.0, "scale": 10.0}
    checks = tuple(Check(measurement=place, **known) for place in places)
    limit = zero_step_limit(StepSeries((2, 3, 4), checks))
    assert (limit and limit[0].agrees) is agrees


@pytest.mark.parametrize(("steps", "counts"), [(1, False), (2, True)])
def test_a_case_counts_where_two_steps_have_it(steps, counts):
    """Of a ball that chatters chance decides whether one step has any."""
    case = measured("settled", "case", float(Case.SS), 0.0)
    check = Check(measurement=case, predicted=float(Case.SS), uncertainty=0.0, scale=1.0)
    series = StepSeries(tuple(range(4 - steps, 4)), (check,) * steps)
    assert (zero_step_limit(series) is not None) is counts


def test_other_states_are_not_aligned_and_two_steps_are_not_enough():
    steps = {n: seen(0.0, slip_x=100.0 * (n == 1), slip_y=100.0 * (n == 2)) for n in (1, 2, 3)}
    plain = said(steps)
    assert (plain.outcome, plain.left_out) == (Outcome.INCONCLUSIVE, 1)
    assert plain.reason == "too few numbers can tell: 0 of 1 in ω_c"


@pytest.mark.parametrize(
    ("error", "outcome"), [(0.049, Outcome.CONFIRMED), (0.051, Outcome.REFUTED)]
)
def test_an_engine_as_it_comes_may_be_off_by_its_tolerance(error, outcome):
    defaults = said({2: seen(error)}, engine="mujoco-defaults")
    assert (defaults.outcome, defaults.farthest) == (outcome, pytest.approx(error))


def test_who_was_asked_and_measured_nothing_is_undecided_and_says_why():
    unasked = "at this level nothing that bears on the claim was asked of it"
    for name, outcome, reason in (
        ("mine", Outcome.INCONCLUSIVE, "too few numbers can tell: 0 of 1 in ω_c"),
        ("another", Outcome.NOT_ASKED, unasked),
    ):
        plain = said({1: Records((), (Missing("settled", name, "nothing settles"),))})
        assert (plain.outcome, plain.reason) == (outcome, f"{reason}; {name}: nothing settles")


@pytest.mark.parametrize(("near", "outcome"), [(1, Outcome.CONFIRMED), (2, Outcome.INCONCLUSIVE)])
def test_what_has_no_limit_counts_as_too_coarse(near, outcome):
    """Of three states, one or two so near a threshold that the step may decide on their case."""
    ends = Records((measured("thresholds", "omega_01", 2 * P.omega_0, 1e-6, P, "mine"),))
    flows = [P.omega_0] * (3 - near) + [2 * P.omega_0] * near
    rows = [
        measured("settled", "omega_c", flow, 1e-12, P.replace(omega_0=flow), "mine", start=f"{k}")
        for k, flow in enumerate(flows)
    ]
    own = Records(tuple(rows))
    plain = said(dict.fromkeys((1, 2, 3), own), own + ends)
    assert (plain.outcome, plain.left_out) == (outcome, near)


@pytest.mark.parametrize(("lost", "outcome"), [(1, Outcome.CONFIRMED), (2, Outcome.INCONCLUSIVE)])
def test_an_engine_is_asked_every_bearing_on_every_set_that_it_shares(lost, outcome):
    """The engine on trial has a count and a flow on three sets, the other one all counts, but not
    all flows."""
    flow = Criterion("thresholds", "omega_03", lambda m: m.parameters.omega_0)
    of = claim("it", Criterion("thresholds", "lifts", lambda m: 1.0), flow)
    sets = ("one", "another", "third")
    counts = tuple(measured("thresholds", "lifts", 1.0, 0.0, P, name) for name in sets)
    flows = tuple(measured("thresholds", "omega_03", P.omega_0, 1e-6, P, name) for name in sets)
    own = Records(counts + flows[lost:])
    assert said(dict.fromkeys((1, 2, 3), own), Records(counts + flows), of).outcome is outcome
    # counts confirm no number
    assert full_verdict(of, {"mujoco": {1: Records(counts)}}).outcome is Outcome.NOT_RUN


@pytest.mark.parametrize("engine", ["mujoco", "mujoco-plain", "mujoco-defaults"])
def test_an_engine_that_is_asked_alone_counts_what_it_could_not_measure(engine):
    gone = (Missing("settled", "mine", "nothing settles", 3),) * 2
    divisors = {"mujoco": (1,), "mujoco-plain": (1, 2, 4), "mujoco-defaults": (2,)}[engine]
    steps = {n: Records(seen(0.3 / n).measurements, gone) for n in divisors}
    verdict = full_verdict(claim(), {engine: steps})
    assert verdict.missing == (Missing("settled", "mine", "nothing settles", 6),)
    assert verdict.planned == 1 + 6
