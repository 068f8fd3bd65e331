"""What engines beside the one on trial say: limits of no step that contain the truth, and whom a claim can ask."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import tests.measured
from compare.claim import Bearing, Claim, Outcome
from compare.kit.quantities import quantity
from compare.kit.record import Check, Missing, Records
from compare.kit.statistics import COVERAGE
from compare.witnesses import CEILING, COARSEST, _limit, extrapolated, hear
from model import Parameters

P = Parameters.named("reference")
RATIOS = 1 / np.array([1.0, 2.0, 3.0, 4.0])
STEPS = RATIOS / 20
CLAIM = Claim(
    id="it",
    section="Stationary states",
    source="(1)",
    statement="It goes round.",
    bearings=(Bearing(protocol="settled", quantity="omega_c", predict=lambda m: m.parameters.omega_0),),
)


def seen(error: float, engine: str, **conditions: float) -> Records:
    """A measurement of omega_c with a relative error."""
    m = tests.measured.measured("settled", "omega_c", P.omega_0 * (1 + error), 1e-12, P, "mine", **conditions)
    return Records((replace(m, engine=engine),))


@pytest.mark.parametrize(
    ("errors", "order"), [(0.3 * RATIOS, 1.0), (0.3 * RATIOS**2, 2.0), (0.1 * RATIOS + 0.02 * RATIOS**2, 1.13)]
)
def test_known_sequences_have_their_limit_and_order(errors, order):
    limit, found = extrapolated(STEPS, 7.0 + errors, np.full(4, 1e-12))
    assert limit.value == pytest.approx(7.0, abs=min(1e-10, COVERAGE * limit.uncertainty))
    assert found == pytest.approx(order, abs=0.01)


def test_where_terms_of_two_orders_cancel_no_order_is_found_and_the_limit_is_covered():
    errors = np.array([1.28e-3, -3.7e-4, -4.7e-4])  # -2.8e-3 h + 4.1e-3 h^2
    limit, order = extrapolated(1 / np.array([1.0, 2.0, 3.0]) / 20, errors, np.full(3, 1e-14))
    assert math.isnan(order)
    assert abs(limit.value) <= COVERAGE * limit.uncertainty


def test_a_deviation_that_falls_as_the_root_of_the_step_is_covered():
    """As where heavy-core loses the floor: 23.56, 23.45, 23.42 and 23.40 rad/s, in theory 23.30."""
    for errors in (0.01 * np.sqrt(RATIOS), np.array([1.102e-2, 6.33e-3, 5.39e-3, 4.8e-3])):
        limit, _ = extrapolated(STEPS, errors, np.full(4, 1.4e-4))
        assert abs(limit.value) <= COVERAGE * limit.uncertainty


def test_where_there_is_only_noise_the_last_is_the_limit_and_there_is_no_order():
    limit, order = extrapolated(STEPS, np.array([1e-3, -2e-3, 5e-4, -5e-4]), np.full(4, 1e-3))
    assert (limit.value, math.isnan(order)) == (-5e-4, True)
    assert limit.uncertainty >= 1e-3


def test_the_uncertainty_of_a_limit_covers_the_truth():
    """Smooth errors of both orders, with terms that fall as the step in natural units, and noise of known size."""
    rng, covered = np.random.default_rng(1), []
    for _ in range(400):
        first = int(rng.integers(1, 3))
        size = rng.uniform(0.3, 1.0, 5) * rng.choice([-1, 1], 5)
        terms = [size[k] * STEPS ** (first + k) for k in range(5)]
        own = 10 ** rng.uniform(-9, -4)
        truth = rng.normal()
        limit, _ = extrapolated(STEPS, truth + sum(terms) + own * rng.uniform(-1, 1, 4), np.full(4, own))
        covered.append(abs(limit.value - truth) <= COVERAGE * limit.uncertainty)
    assert all(covered)


@pytest.mark.parametrize(
    ("left", "outcome"), [(0.0, Outcome.CONFIRMED), (0.05, Outcome.REFUTED)], ids=["vanishes", "stays"]
)
def test_a_claim_is_judged_in_the_limit_of_no_step(left, outcome):
    """States that differ a little with the step are the same state; at 2 ms it is off by what users see."""
    steps = {n: seen(left + 0.01 / n, "mujoco-plain", slip_x=1.0 + 0.05 / n) for n in (1, 2, 3, 4)}
    _, plain = hear(CLAIM, {"mujoco": {1: seen(0.0, "mujoco")}, "mujoco-plain": steps}).witnesses
    assert (plain.outcome, plain.left_out) == (outcome, 0)
    assert plain.order == pytest.approx(1.0, abs=1e-6)
    assert plain.typical == plain.worst == pytest.approx(left + 0.005)
    (check,) = plain.checks
    resolves = quantity("omega_c").resolves
    assert check.ceiling == max(resolves, min(CEILING * resolves, COARSEST))


@pytest.mark.parametrize(("left", "outcome"), [(5e-7, Outcome.CONFIRMED), (5e-6, Outcome.REFUTED)])
def test_three_steps_show_a_limit_to_a_share_of_what_extrapolation_takes_away(left, outcome):
    """Of 3.3e-6, with a standard uncertainty of a tenth; with four steps the lesser one is noticed, too."""
    steps = {n: seen(left + 1e-5 / n, "mujoco-plain") for n in (1, 2, 3, 4)}
    three = {n: records for n, records in steps.items() if n < 4}
    assert [hear(CLAIM, {"mujoco-plain": each}).outcome for each in (three, steps)] == [outcome, Outcome.REFUTED]


@pytest.mark.parametrize(
    ("errors", "agrees"), [((7.0e-4, 1.2e-3, 1.2e-3), True), ((0.03, 0.02, 0.015), None), ((0.02, 0.02, 0.02), False)]
)
def test_brackets_of_thresholds_hide_what_changes_with_the_step(errors, agrees):
    """Two that are the same don't show a limit that well, and one that moves far shows none; one that stays off is."""
    places = [tests.measured.measured("thresholds", "omega_01", 10 * (1 + error), 1.4e-3) for error in errors]
    checks = [Check(measurement=place, predicted=10.0, tolerance=0.0, scale=10.0) for place in places]
    limit = _limit(list(zip((2, 3, 4), checks, strict=True)))
    assert (limit and limit[0].agrees) is agrees


@pytest.mark.parametrize(("near", "outcome"), [(0.99, Outcome.INCONCLUSIVE), (0.9, Outcome.REFUTED)])
def test_no_limit_is_taken_next_to_a_threshold(near, outcome):
    """There the step decides on the case, and all of a state in the wrong case would be off."""
    steps = {n: seen(0.05 + 0.01 / n, "mujoco-plain") for n in (1, 2, 3, 4)}
    end = tests.measured.measured("thresholds", "omega_01", near * P.omega_0, 1e-6, P, "mine")
    _, plain = hear(CLAIM, {"mujoco": {1: seen(0.0, "mujoco") + Records((end,))}, "mujoco-plain": steps}).witnesses
    assert plain.outcome == outcome


def test_other_states_are_not_aligned_and_two_steps_are_not_enough():
    steps = {n: seen(0.0, "mujoco-plain", slip_x=100.0 * (n == 1), slip_y=100.0 * (n == 2)) for n in (1, 2, 3)}
    (plain,) = hear(CLAIM, {"mujoco-plain": steps}).witnesses
    assert (plain.outcome, plain.left_out) == (Outcome.INCONCLUSIVE, 1)
    assert "three time steps" in plain.reason


@pytest.mark.parametrize(("error", "outcome"), [(0.049, Outcome.CONFIRMED), (0.051, Outcome.REFUTED)])
def test_an_engine_as_it_comes_may_be_off_by_its_allowance(error, outcome):
    (said,) = hear(CLAIM, {"mujoco-defaults": {2: seen(error, "mujoco-defaults")}}).witnesses
    assert (said.outcome, said.worst) == (outcome, pytest.approx(error))


def test_who_measured_nothing_was_not_asked_and_says_why():
    none = {1: Records((), (Missing("settled", "mine", "nothing settles"),))}
    said = hear(CLAIM, {"mujoco": {1: seen(0.0, "mujoco")}, "mujoco-plain": none, "mujoco-defaults": {2: Records()}})
    assert said.outcome is Outcome.CONFIRMED
    _, plain, defaults = said.witnesses
    assert {plain.outcome, defaults.outcome} == {Outcome.NOT_ASKED}
    assert plain.reason == "nothing measured: mine: nothing settles"
    assert defaults.reason == "only settled states are asked of an engine as it comes"
