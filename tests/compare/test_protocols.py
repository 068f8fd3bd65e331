"""Protocols find what is known to be there, and say what broke down, did not settle or isn't
there."""

import itertools
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import linalg

import analytic
from analytic.flowmeter import pulsation
from compare import plan
from compare.engines.study import MUJOCO, PLAIN
from compare.method import settling
from compare.method.brackets import FINER, LONGER, USUAL, Bracket, Search, narrow
from compare.method.conditions import state_of
from compare.method.quantities import QUANTITIES
from compare.method.record import Missing, Records
from compare.method.runner import Runner, coarse_step
from compare.method.scales import time_unit
from compare.method.statistics import (
    COVERAGE,
    Estimate,
    estimate,
    extrapolated_maximum,
    hops,
    propagator,
    propagator_error,
    steady_limit,
    uniform,
    zero_and_slope,
)
from compare.method.step_pairs import (
    Start,
    at_zero_step,
    lag_error,
    of_no_order,
    of_three_steps,
    unlike,
)
from compare.method.together import asked, together
from compare.plan import Level, sets
from compare.subjects.attractors import measure as attractors
from compare.subjects.catalogue import CLAIMS
from compare.subjects.flowmeter import measure as flowmeter
from compare.subjects.motion import measure as moving
from compare.subjects.regions import measure as regions
from compare.subjects.slipping import measure as slipping
from compare.subjects.stability import measure as stability
from compare.subjects.stationary import measure as settled
from compare.subjects.thresholds import measure as thresholds
from compare.subjects.unsteady import measure as unsteady
from compare.verification.claim import Outcome
from compare.verification.judge import select
from model import Case, Flow, Parameters, State
from tests.measured import judged, measured, motion
from tests.measured import thresholds as known

P, HOPPING = Parameters.named("reference"), Parameters.named("hopping")
QUICK = sets(Level.QUICK)
SETS, WALL, THICK = {"reference": P}, {"rough-wall": QUICK["rough-wall"]}, P.replace(c=10.0)
ROUGH, SAMPLES = QUICK["high-wall-friction"], 50
PROTOCOLS = {
    "field": lambda runner: moving.field(runner, SETS, Records()),
    "growth": lambda runner: slipping.measure(runner, SETS, Records()),
    "bounds": lambda runner: slipping.bounds(
        runner, SETS, known("reference", P, "omega_01", "omega_02")
    ),
    "lift": lambda runner: slipping.lift(runner, {"rubber-wall": QUICK["rubber-wall"]}, Records()),
    "laws": lambda runner: moving.laws(runner, SETS, Records()),
    "motions": lambda runner: moving.motions(runner, SETS, Records()),
    "impacts": lambda runner: moving.impacts(runner, SETS, Records()),
    "pulsation": lambda runner: unsteady.pulsation(
        runner,
        WALL,
        known(
            "rough-wall", QUICK["rough-wall"], "omega_01", "omega_02", "omega_04", uncertainty=0.0
        ),
    ),
}


@pytest.mark.parametrize("name", PROTOCOLS)
def test_a_run_that_breaks_down_is_said_and_takes_no_other_with_it(runner, name, monkeypatch):
    """The first group is said to, in pulsations the first run; validation shows what all of them
    measure."""
    groups, tried = Runner.groups, []

    def breaking(runner, asked):
        for group, runs in zip(asked, groups(runner, asked), strict=True):
            if len(group) > 1 or name == "pulsation":  # not a run that has to settle first
                tried.append(group)
            yield "diverged at once" if tried == [group] else runs

    monkeypatch.setattr(Runner, "groups", breaking)
    left = Records.of(PROTOCOLS[name](runner))
    (lost,) = [each for each in left.missing if "the run diverged at once" in each.reason]
    assert lost.rows < len(left.measurements)
    if name == "pulsation":
        quantities = {m.quantity for m in left.measurements}
        assert quantities == {"gain", "phase_lag", "slip_amplitude", "mean_error"}


@pytest.mark.parametrize(
    ("measure", "p", "said"),
    [
        (slipping.measure, P.replace(eta=0.0), slipping.FRICTIONLESS),
        (slipping.bounds, P.replace(eta=0.0), slipping.FRICTIONLESS),
        (unsteady.pulsation, ROUGH, "no flow at which two-point rolling ends by slipping"),
        (unsteady.jumps, ROUGH, "no flows between which the ball slips at both points"),
        (thresholds.measure, P, "ends two-point rolling"),
        (flowmeter.hysteresis, THICK, "no flow at which SS gives way to NR"),
    ],
)
def test_what_is_not_there_is_said(runner, measure, p, said):
    """Without friction, slip, settled states, or a change from SS to NR."""
    rows = list(measure(runner, {"mine": p}, Records()))
    assert {(type(row), row.set) for row in rows} == {(Missing, "mine")}
    assert any(said in row.reason for row in rows)


@pytest.mark.parametrize(("share", "turns"), [(1.1, True), (0.9, False)])
def test_a_slip_that_friction_holds_at_a_trace_is_no_smooth_motion(share, turns):
    """It doesn't change, yet a 1e-4 of it turns its friction so far that the rates are others."""
    time = np.linspace(0.0, 1e-3, 5)
    # A sphere's contact point feels friction f as an acceleration f/m (1 + 1/j).
    friction = P.m * moving.MOST_TURN / (time[-1] * (1 + 1 / P.j)) * share
    x = np.tile([0, 0, 1.0, 0, 1.0 / P.r, 0, 0, 0], (5, 1))
    forces = {"force_A": np.zeros((5, 3)), "force_B": np.full((5, 3), friction / P.eta)}
    run = SimpleNamespace(header=SimpleNamespace(parameters=P), time=time, x=x, **forces)
    assert moving.turns_or_hovers(Case.NS, run, slice(0, 5)) is turns


@pytest.mark.slow
def test_a_mean_may_depend_on_more_than_the_state(runner):
    """Where theory itself has two answers (docs/theory.md, 11) the protocol sees that its own is
    none, blind."""
    p, f, a = sets(Level.DEFAULT)["design-5"].replace(omega_0=11.7694), 4.0, 199.89
    theory, rules = analytic.flowmeter.pulsation, ("slip-stability", "infeasible")
    early, late = (theory.mean_error(p, a, f, leave_rolling=rule) for rule in rules)
    assert late - early > 0.015 * abs(early)
    begin = theory.swing(p, a, f, 0.0)[0] - p.omega_0
    runner = replace(runner, level=Level.DEFAULT)
    driven = unsteady.Pulsation(runner, "design-5", p, f, a, reach=1.0, lead=float(begin) / a)
    (row,) = together(runner, [unsteady.mean_error(driven, a)])
    assert COVERAGE * row.uncertainty > QUANTITIES["mean_error"].resolution * 0.9 * abs(row.value)


def test_every_deviation_is_measured_and_there_is_none_where_the_laws_hold():
    """Of a ball that slips at both points as (14) and (15) say, with some of it changed."""
    rng = np.random.default_rng(4)
    w_x, w_y, w_z = rng.uniform(5.0, 20.0, (3, SAMPLES))
    normal = ROUGH.m * ROUGH.g * rng.uniform(0.5, 1.0, SAMPLES)
    (A_x, A_z), (B_y, B_z) = (
        -coefficient * normal * np.stack([first, second]) / np.hypot(first, second)
        for coefficient, first, second in ((ROUGH.mu, w_z, -w_x), (ROUGH.eta, -w_z, w_y))
    )
    A, B = np.stack([A_x, normal, A_z], axis=-1), np.stack([normal, B_y, B_z], axis=-1)
    right = {
        "slip_x": w_x,
        "slip_y": w_y,
        "slip_z": w_z,
        "force_A": A,
        "force_B": B,
        "case": Case.SS,
    }

    def found(law, contact, **changes):
        of = moving.deviations(motion(ROUGH, np.linspace(0.0, 1.0, SAMPLES), **right | changes))
        return next(
            value
            for (_, name, point), value in of.items()
            if name.startswith(law) and point == contact
        )

    ratio, law, rolls = "friction over normal force", "(14), (15)", "where it rolls it doesn't slip"
    for contact, coefficient in (("A", ROUGH.mu), ("B", ROUGH.eta)):
        assert found(law, contact) <= moving.ROUNDING
        assert found(ratio, contact) == pytest.approx(coefficient, rel=moving.ROUNDING)
        assert np.isnan(found(rolls, contact))  # nothing rolls: that law has no samples
    assert found(ratio, "B", force_B=B * [1.0, 1.01, 1.01]) == pytest.approx(1.01 * ROUGH.eta)
    assert found(ratio, "A", force_A=A * [0.99, 1.0, 0.99]) == pytest.approx(0.99 * ROUGH.mu)
    one = np.where(np.arange(SAMPLES)[:, None] == 7, [1.0, -1.0, 1.0], 1.0)
    assert found(law, "B", force_B=B * one) > 0.1 * ROUGH.eta
    assert found("where it is closed there is no gap", "A", gap_A=1e-3 * ROUGH.R) == pytest.approx(
        1e-3
    )
    assert found(rolls, "A", slip_z=1e-3 * w_z, slip_x=1e-3 * w_x, case=Case.RS) > 0


def test_an_uncertainty_is_made_up_of_its_causes():
    drifting = estimate(2.0, 10.0, drift=0.3, solver=0.4)
    assert drifting == Estimate(2.0, 5.0)
    whole = drifting.also(time_step=12.0).times(-2.0)
    assert whole == Estimate(-4.0, 26.0)
    assert whole.budget == {"drift": 6.0, "solver": 8.0, "time_step": 24.0}
    assert Estimate(1.0, 3.0).also(bracket=4.0).budget == {"measured": 3.0, "bracket": 4.0}


def test_errors_of_others_are_told_apart_by_their_causes():
    """By how much each of them moves the number; the combined uncertainty stays."""
    others = [estimate(1.0, drift=0.3, solver=0.4), Estimate(2.0, 0.1), estimate(3.0, drift=7.0)]
    whole = estimate(2.0, 2.0, drift=0.3, points=0.4)
    apart = whole.told_apart("points", others, [5.0, 12.0, 0.0])
    assert apart == whole
    size = 0.8 / 13
    assert apart.budget == pytest.approx(
        {"drift": math.hypot(0.6, 3 * size), "solver": 4 * size, "points": 12 * size}
    )
    assert math.hypot(*apart.budget.values()) == pytest.approx(whole.uncertainty)
    sure = estimate(1.0, points=0.0).told_apart("points", others[:1], [0.0])
    assert sure.budget == {"drift": 0.0, "solver": 0.0}


@pytest.mark.parametrize(("order", "off"), [(1.0, 3.0), (1.585, 0.0), (2.0, 1 / 3), (20.0, 3.0)])
def test_a_zero_step_limit_is_sure_whatever_the_order(order, off):
    """The bounds of a uniform distribution are three variances off."""
    coarse, fine = (7.0 + 0.1 * h**order for h in (1.0, 0.5))
    limit = at_zero_step(coarse, estimate(fine))
    deviation = (limit.value - 7.0) / limit.uncertainty
    assert abs(deviation) <= math.sqrt(3) * (1 + 1e-5)
    assert deviation**2 == pytest.approx(off, abs=1e-3)
    assert limit.budget == {"time_step": pytest.approx((coarse - fine) / math.sqrt(12))}


@pytest.mark.parametrize(
    ("first", "second", "third"), [(0.1, 0, 0), (0, 0.1, 0), (0.1, -0.1, 0), (0, 0, 0.1), (0, 0, 0)]
)
def test_three_steps_leave_no_error_of_first_or_second_order(first, second, third):
    values = [7.0 + first * h + second * h**2 + third * h**3 for h in (1.0, 0.5, 0.25)]
    (limit,), (other,) = of_three_steps(np.array(values)[:, None])
    off, least = abs(limit - other), 1e-13  # round-off
    assert abs(limit - 7.0) <= off + least
    assert bool(third) == (abs(limit - 7.0) > least)
    # where the second power alone is there, all ways to the limit find it
    assert (off > least) == bool(third or first)


def test_ways_to_the_limit_that_agree_by_chance_are_not_believed():
    """Errors of a slip that fall as if by first order, and then faster; seen with 324 numbers."""
    errors = np.array([-4.1923e-6, -1.8494e-6, -0.5784e-6])
    (limit,), (other,) = of_three_steps(errors[:, None])
    by_order_shown = errors[2] + (errors[2] - errors[1])  # the ratio that shows is above a half
    assert abs(limit - by_order_shown) < 0.1 * abs(limit)
    assert abs(limit) < abs(limit - other)


def test_what_changes_by_little_among_what_changes_by_much_is_not_sure():
    assert unlike(np.array([4e-3, -1e-9, 0.0])) == pytest.approx(
        [math.hypot(4, 1) / 1e3, 1e-3, 1e-3]
    )
    assert unlike(np.zeros(0)).size == 0


def test_a_decay_is_that_of_no_push_where_drag_bends():
    """Of a ball that rolls with the fluid, whose drag by Schiller and Naumann a push increases."""
    p = sets(Level.QUICK)["wake"]
    state = stability.Pushed(None, Start("wake", p, "settled", np.zeros(8)), Case.RR)
    lasts, samples = state.record
    time = np.arange(1, samples) * lasts * coarse_step(p) / samples
    decay = p.c / (1 + 2 * p.j)

    def answer(size):
        Re = 2 * p.r * p.R * size / time_unit(p) / p.nu_f
        return np.exp(-decay * (1 + 0.15 * Re**0.687) * time)[:, None, None]

    found = stability.spectrum(state, [answer(size) for size in state.sizes], coarse_step(p) / 16)
    (rate,), (off,) = -found.exponents.real, found.uncertainty
    assert 1e-4 * decay < abs(rate - decay) < 2 * off < 4e-4 * decay


def test_forces_of_rigid_contacts_lag_less():
    """By one step, not by three: the error goes with the square."""
    p = Parameters.named("reference")
    rigid, own = (lag_error(SimpleNamespace(engine=engine), p) for engine in (MUJOCO, PLAIN))
    assert own == pytest.approx(9 * rigid)


@pytest.mark.parametrize("noise", [0.0, 1e-9, 1e-6])
def test_a_propagator_is_as_sure_as_it_explains_its_record(noise):
    exponents = np.array([[-0.02, 0.05], [-0.05, -0.02]])
    record = np.array([linalg.expm(k * exponents) for k in range(64)])
    record += noise * np.random.default_rng(3).standard_normal(record.shape)
    error = np.abs(propagator(record, 8) - linalg.expm(8 * exponents)).max()
    assert error <= COVERAGE * propagator_error(record, 8) + 1e-14
    assert propagator_error(record, 8) <= 30 * noise + 1e-14


def test_a_pair_of_steps_shows_the_error_of_an_engine_that_has_none(runner):
    """Its tolerance takes the place of the step, and neither may the pair see too little."""
    lasts, x = 4.0, State(omega_c=3.0, slip_x=40.0, slip_y=15.0, slip_z=-30.0).stacked()
    truth = analytic.simulate(P, x, lasts, rtol=1e-11)
    coarse, fine = (
        float(run.omega_c[-1])
        for run in runner.each([runner.task(P, x, lasts, coarse_step(P) / n) for n in (1, 2)])
    )
    error = at_zero_step(coarse, estimate(fine))
    assert 0 < abs(error.value - truth.omega_c[-1]) <= COVERAGE * error.uncertainty < 1e-6


def test_a_ball_goes_on_with_round_off_into_the_floor(runner):
    x = State(omega_c=1.0, v_y=-1e-14).stacked()
    (run,) = runner.each([runner.task(P, x, 1.0, coarse_step(P))])
    assert run.complete


def test_no_law_of_drag_without_a_fold_is_given_a_drag_at_which_it_is_born(runner):
    sets = {name: QUICK[name] for name in ("reference", "blunt")}
    ends = [known(name, p, "omega_01", "omega_02").rows for name, p in sets.items()]
    found = Records.of(regions.birth(runner, sets, Records(tuple(itertools.chain(*ends)))))
    (born,), (none,) = found.measurements, found.missing
    expected = analytic.bifurcation.diagram.critical_drag(P)
    assert abs(born.value - expected) <= COVERAGE * born.uncertainty < 1e-2 * expected
    assert (none.set, none.reason) == ("blunt", "no drag gives birth to a fold")


def test_sampling_seldom_changes_a_jump_and_a_ramp_by_no_more_than_they_are_unsure():
    p = P.replace(omega_0=1.2 * analytic.thresholds(P).omega_01)
    x = analytic.solution(p, Case.SS).state.stacked()

    def height(samples):
        up, down = (
            analytic.simulate(
                p.replace(omega_0=(1 + side) * p.omega_0), x, 12.0, sample_interval=12.0 / samples
            )
            for side in (1e-4, -1e-4)
        )
        return unsteady._jump_quantities(up, down)["jump_height"]

    seldom, often = height(1500), height(24_000)
    assert 1e-6 < abs(seldom.value - often.value) <= COVERAGE * seldom.uncertainty < 1e-2
    flow = Flow.ramp(p.omega_0, 1.2 * analytic.thresholds(P).omega_04, 120.0)
    once, again = (
        unsteady.caught_up(analytic.simulate(p, x, 120.0, flow, sample_interval=120.0 / samples))
        for samples in (4000, 16_000)
    )
    assert once == pytest.approx(again, rel=1e-8)


@pytest.mark.parametrize(("overshoot", "seen"), [(1e-4, True), (1e-7, False)])
def test_a_peak_too_low_to_be_told_from_none_is_not_measured(overshoot, seen):
    """As of a ball in oil whose swing has died out by then."""
    time = np.linspace(0.0, 40.0, 8001)
    rises = 1 - np.exp(-4 * time) + overshoot * np.exp(-((time - 9.0) ** 2))
    up, down = (
        SimpleNamespace(time=time, omega_c=12 + side * rises, header=SimpleNamespace(parameters=P))
        for side in (1e-3, -1e-3)
    )
    found = unsteady._jump_quantities(up, down)
    for quantity, expected in (("jump_peak", 9.0), ("jump_height", 1 + overshoot)):
        assert found[quantity].value == pytest.approx(
            expected if seen else math.nan, rel=1e-6, nan_ok=True
        )


def test_a_settled_state_is_no_surer_than_solving_at_random_leaves_it():
    """Also where neither half the step nor other starts change it; what is measured takes the place
    of what errors of one sign could come to."""
    p = Parameters.named("reference")
    value = estimate(12.0, drift=0.0, solver=1.0)
    sure = settling.with_changes(value, 0.0, p, 12.0, 2).uncertainty
    steps = 2 / (p.c * coarse_step(p))
    assert sure == pytest.approx(12.0 * settling.SOLVED * math.sqrt(steps))
    assert settling.with_changes(value, 3.0, p, 12.0, 2).uncertainty == pytest.approx(3.0)


def test_first_top_lies_between_samples():
    """Claims predict with it, too: they would not notice if it were wrong."""
    p = QUICK["thick-fluid"]
    run, fine = (
        analytic.simulate(p, [0.05, 1.0, 0, 0, 0, 0, 0.01, 0], 0.5, sample_interval=interval)
        for interval in (0.01, 1e-4)
    )
    top = flowmeter.first_top(run)
    assert (
        uniform(abs(top.value - float(fine.y.max())))
        <= top.uncertainty
        < p.g * 0.01**2 * p.c * 0.01
    )


def make(patch, **sampling):
    """Another sampling at the quick level."""
    patch.setattr(plan, "AT_QUICK", replace(plan.AT_QUICK, **sampling))


def measure_settled(runner, patch, p, *flows):
    make(
        patch,
        settled_starts=tuple((how, flows) for how in ("rest", "with the fluid", "on the wall")),
    )
    return Records.of(settled.measure(runner, {"thick": p}, Records()))


def test_what_does_not_settle_is_missing(runner, monkeypatch):
    make(monkeypatch, settling_rounds=(1.0,))
    monkeypatch.setattr(settling, "SOLVED", 1e-3)
    found = measure_settled(runner, monkeypatch, THICK, 0.6)
    assert not found.measurements
    starts = [each for each in found.missing if " still drifts" in each.reason]
    states = [each for each in found.missing if "no values of it" in each.reason]
    assert len(starts) + len(states) == len(found.missing)
    assert sum(each.rows for each in starts) == 4
    assert len(states) == 3  # from rest and with the fluid the ball ends in the same
    assert all(each.rows > 10 for each in states)


def test_a_state_that_depends_on_the_step_is_missing(runner, monkeypatch):
    right = settling.settle

    def other_case(runner, starts, criteria):
        states = right(runner, starts, criteria)
        return [replace(each, case=Case.SN) for each in states] if criteria.divisor == 2 else states

    monkeypatch.setattr(settling, "settle", other_case)
    found = measure_settled(runner, monkeypatch, THICK, 0.6)
    assert {m.quantity for m in found.measurements} == {"case"}
    assert len(found.missing) == 3
    assert all(
        "is SN with half the step" in each.reason and each.rows > 10 for each in found.missing
    )


def test_what_quadratic_drag_does_not_settle_has_no_values(runner, monkeypatch):
    """A ball that goes round with the fluid keeps a slight lag; one that slips or sinks settles."""
    found = measure_settled(runner, monkeypatch, QUICK["blunt"], 0.6, 2.0)
    cases = {m.at["case"] for m in found.measurements if m.quantity == "omega_c"}
    assert cases == {"SS", "NS"}
    assert any("quadratic drag fades with the lag" in each.reason for each in found.missing)


def test_nor_has_it_values_in_a_flow_the_other_way_round(runner):
    found = Records.of(settled.mirrored(runner, {"blunt": QUICK["blunt"]}, Records()))
    values = {(m.at["start"], m.quantity) for m in found.measurements}
    assert ("rest", "omega_c") in values
    assert ("on the wall", "omega_c") not in values
    assert any("quadratic drag fades with the lag" in each.reason for each in found.missing)


def test_what_swings_for_ever_settles_by_going_on_from_its_mean(runner, monkeypatch):
    """A ball that sinks along the wall: also where a round is rounded to another length than the
    usual one."""
    make(monkeypatch, settling_rounds=(0.45, 1.0, 1.0))
    p = QUICK["rough-floor"].replace(omega_0=21.74)
    (state,) = settling.settle(
        runner, [settling.initial_condition("rough-floor", p, "on the wall")]
    )
    assert (state.case, state.failure) == (Case.NS, "")


def test_what_dies_out_leads_to_its_limit_and_what_grows_nowhere():
    """So a run that passes an unstable state leaves it, however near it comes in other ways."""
    time = np.linspace(0, 10, 400)
    dies, swings, grows = np.exp(-time), np.sin(9 * time), 1e-4 * np.exp(time / 2)
    led = steady_limit(np.array([2 + dies, 2 + swings, 2 + grows, 2 + dies + grows]), 200)
    np.testing.assert_allclose(led[0], 2, rtol=1e-9)
    np.testing.assert_allclose(led[1], 2, rtol=1e-4)
    assert np.all(led[2:] - 2 > grows[300])


def outcome_of(claim, *rows):
    """By these numbers; the claim's other protocols found nothing to measure."""
    (of,) = select(CLAIMS, [claim])
    nothing = tuple(Missing(name, "reference", "there is none", 0) for name in of.protocols)
    return judged(of, Records(rows, nothing)).outcome


@pytest.mark.parametrize(
    ("Omega_0", "case", "before", "outcome"),
    [
        (2.6, Case.SS, "SS", Outcome.CONFIRMED),  # a ball keeps to its branch
        (2.6, Case.NR, "NR", Outcome.CONFIRMED),
        (2.6, Case.SS, "NR", Outcome.REFUTED),
        (2.6, Case.NR, "SS", Outcome.REFUTED),
        (1.7, Case.SS, "NR", Outcome.CONFIRMED),  # and leaves it where it has ended
    ],
)
def test_a_ball_keeps_to_its_branch_of_the_loop(Omega_0, case, before, outcome):
    """At 2.6 SS and NR last side by side."""
    p = P.replace(mu=0.3)
    q = p.replace(omega_0=Omega_0 / time_unit(p))
    s = next(s for s in analytic.stable_solutions(q) if s.case is case)
    at = {"case": case.name, "before": before, "side": "up", "level": 1.0}
    values = {"case": (float(case), 0.0), "omega_c": (float(s.x[2]), 1e-9 * q.omega_0)}
    rows = (
        measured("hysteresis", what, *value, q, "slipping", **at) for what, value in values.items()
    )
    assert outcome_of("fig-13-left", *rows) is outcome


def test_a_prediction_is_no_surer_than_its_computation(monkeypatch):
    """A number without an error of its own agrees with one computed more sharply, and with no
    other."""
    blunt = QUICK["blunt"].replace(omega_0=4.0)
    thrown, time = State(y=3.0, v_y=0.7, omega_c=7.0, slip_x=42.0, slip_y=-56.0, h=0.03), 0.2
    end = analytic.simulate(blunt, thrown.stacked(), time, rtol=1e-11).slip_x[-1]
    at = {"f": 1.0, "amplitude": 13.0}
    monkeypatch.setattr(pulsation, "FINE", 512)
    gain = abs(pulsation.first_harmonic(blunt, at["amplitude"], at["f"]))
    monkeypatch.setattr(pulsation, "PERIODIC_RTOL", 1e-9)
    mean = pulsation.mean_error(blunt, at["amplitude"], at["f"], settled=1e-9)
    monkeypatch.undo()
    start = {"start": "thrown", "time": time, **state_of(thrown.stacked())}
    for claim, protocol, quantity, value, conditions in (
        ("flight", "runs", "end_slip_x", end, start),
        ("pulsation-lag", "pulsation", "gain", gain, at),
        ("pulsation-mean", "pulsation", "mean_error", mean, at | {"slips": "at both points"}),
    ):
        for factor, agrees in ((1.0, True), (1.001, False)):
            row = measured(protocol, quantity, factor * value, 0.0, blunt, "blunt", **conditions)
            (of,) = select(CLAIMS, [claim])
            (check,) = judged(of, Records((row,))).checks
            assert check.agrees is agrees
            assert check.tolerance > 0


def test_numbers_that_no_quick_set_has_are_judged_too():
    strong, smooth = P.replace(c=20 * P.c), P.replace(eta=0.99 * P.j)
    end, at = analytic.thresholds(smooth).omega_01, {"by": "neighbours", "case": "NR"}
    unknown = measured("slope", "slope", 1.0, 1e-6, P.replace(omega_0=24.0), **at)
    # The drag at which a fold is born, of a set whose own is too strong for one.
    born = analytic.bifurcation.diagram.critical_drag(strong)
    right, wrong = (
        measured("birth", "critical_drag", factor * born, 1e-4 * born, strong)
        for factor in (1.0, 1.01)
    )
    for claim, row, outcome in (
        ("double-points", right, Outcome.CONFIRMED),
        ("double-points", wrong, Outcome.REFUTED),
        ("slope-rolling", unknown, Outcome.REFUTED),
        # A range that another threshold may end is not held against the tolerances of this one.
        ("design-limit", measured("thresholds", "omega_01", end, 1e-9, smooth), Outcome.CONFIRMED),
    ):
        assert outcome_of(claim, row) is outcome


def narrowed(answer, width, task=lambda v, b, attempt: (v, attempt), careful=True):
    """The bracket in which an answer to (value, attempt) changes, from 0 to 1, of a runner whose
    tasks are their runs."""
    runner = SimpleNamespace(each=list, sampling=SimpleNamespace(sections=7, granted=False))
    (bracket,) = narrow(runner, [Search(Bracket(0.0, 1.0), task, answer, width)], careful=careful)
    return bracket


def test_bisection_closes_in_on_the_change_unless_runs_are_undecided_or_break_down():
    """What is undecided is run again, for longer; what broke says why."""
    bracket = narrowed(lambda run: run[0] < math.pi / 10, 1e-6)
    assert bracket.low < math.pi / 10 < bracket.high <= bracket.low + 1e-6
    assert bracket.shift == 0
    # An end that was taken for granted is asked: it has a run if it was right.
    assert narrowed(lambda run: run[0] < 0.95, 0.5, careful=False).runs[1] == (1.0, USUAL)
    assert narrowed(lambda run: True, 0.5, careful=False).runs[1] is None
    # with the time step
    moves = narrowed(lambda run: run[0] < (0.31 if run[1] is FINER else 0.3), 1e-4)
    assert moves.low < 0.3 < moves.high
    assert moves.place.uncertainty >= uniform(moves.shift) > 0

    def answer(run):
        value, attempt = run
        if abs(value - 0.5) < 0.1:
            return value < 0.47 if attempt is LONGER and value < 0.47 else None
        return value < 0.5

    bracket = narrowed(answer, 1e-3, careful=False)
    assert 0.4 < bracket.low < 0.47 <= 0.5 < bracket.high
    assert bracket.high - bracket.low > 0.1
    broken = narrowed(
        lambda v: v < 0.5, 1e-3, lambda v, b, attempt: v if abs(v - 0.5) > 0.1 else "broke"
    )
    assert broken.low < 0.4 < 0.6 < broken.high
    assert broken.failure == "broke"


def test_what_procedures_wait_for_is_carried_out_together(monkeypatch):
    """Also where one asks for more, or for nothing; rows come procedure by procedure."""
    carried_out = []

    def groups(runner, asked):
        carried_out.append(asked)
        return iter(asked)

    def procedure(name, *rounds):
        for wanted in rounds:
            for got in (yield from asked(*wanted)):
                yield f"{name} {got}"
        yield f"{name} ends"

    monkeypatch.setattr(Runner, "groups", groups)
    procedures = procedure("a", ["1", "2"], ["3"]), procedure("b"), procedure("c", ["4"])
    rows = [*together(None, procedures)]
    assert rows == ["a 1", "a 2", "a 3", "a ends", "b ends", "c 4", "c ends"]
    assert carried_out == [["1", "2", "4"], ["3"]]


@pytest.mark.parametrize(
    ("eta", "end", "lost"), [(0.99, "omega_01", False), (1.01, "omega_03", True)]
)
def test_a_floor_that_carries_little_is_not_lost_where_the_ball_slips_on_both(eta, end, lost):
    """Beyond the end of rolling, on walls a little smoother and rougher than the inertia j."""
    p = P.replace(eta=eta * P.j)
    p = p.replace(omega_0=1.002 * getattr(analytic.thresholds(p), end))
    run = analytic.simulate(p, State(omega_c=p.omega_0), 2.0)
    assert thresholds.lifts(Bracket(0.0, 1.0, (None, run))) is lost
    assert run.force_A[-1, 1] < settling.PRESSES * p.m * p.g


@pytest.mark.parametrize("power", [1.3, 1.687, 2.0])
def test_a_bent_line_has_its_zero_and_slope(power):
    """Of growth along a line, where drag isn't linear: few claims of few sets would notice."""
    x, noise = np.array([0.0, 1.1, 1.5, 2.0]), np.full(4, 1e-6)

    def through(y):
        return [estimate(each, time_step=u) for each, u in zip(y, noise, strict=True)]

    zero, slope = zero_and_slope(x, through(x**power - 1.7))
    assert abs(zero.value - 1.7 ** (1 / power)) < 3 * zero.uncertainty < 0.03
    assert abs(slope.value - power * zero.value ** (power - 1)) < 3 * slope.uncertainty < 0.06
    assert zero.budget.keys() == slope.budget.keys() == {"curvature", "time_step"}
    assert np.isnan([m.value for m in zero_and_slope(x, through(x + 1))]).all()


@pytest.mark.parametrize("bend", [0.0, 1e-15, -1e-15, 1e-4])
def test_a_line_has_no_maximum(bend):
    """Nor has one that is bent by round-off, or so little that a maximum would be far away."""
    where = np.linspace(1.0, 2.0, 6)[::-1]
    order = [Estimate(float(w), 0.0) for w in where]
    assert not math.isfinite(extrapolated_maximum(where - bend * where**2, order).value)


def test_an_end_that_cannot_be_extrapolated_is_missing_and_no_finding(runner, monkeypatch):
    """Of a set without fold, and the cases in which balls settle there."""
    monkeypatch.setattr(thresholds, "extrapolated", lambda *what: None)
    p, rows = QUICK["thick-fluid"], []
    for flow in (0.6, 1.4, 2.5):
        q = p.replace(omega_0=flow / time_unit(p))
        cases = {s.case for s in analytic.stable_solutions(q)}
        floor = next(case for case in (Case.RR, Case.SS, Case.NR) if case in cases)
        wall = Case.NR if Case.NR in cases else Case.NS
        for start, case in (("rest", floor), ("with the fluid", floor), ("on the wall", wall)):
            at = {"start": start, "case": case.name}
            rows.append(measured("settled", "case", float(case), 0.0, q, "thick-fluid", **at))
    runner = replace(runner, protocol="thresholds")
    records = Records.of(thresholds.measure(runner, {"thick-fluid": p}, Records(tuple(rows))))
    assert any("points to no flow at which it ends" in each.reason for each in records.missing)
    # An end is seen, but not whether it is a fold.
    assert [*records.select("thresholds", "folds")] == []


def test_a_ball_that_lags_is_not_taken_for_one_that_rolls_with_the_fluid(runner):
    """Pressed to the floor, it does so for as long as anyone waits where drag is quadratic, and
    rolls on in flows that are faster than it by that."""
    p = QUICK["blunt"].replace(eta=0.87)
    runner, known_before = replace(runner, protocol="thresholds"), known("d", p, "omega_03")
    found = Records.of(thresholds.measure(runner, {"d": p}, known_before))
    (pressed,) = found.select("thresholds", "omega_03", lambda m: m.at["side"] == "from above")
    tolerance = COVERAGE * pressed.uncertainty
    assert pressed.value == pytest.approx(analytic.thresholds(p).omega_03, abs=tolerance)
    assert tolerance < QUANTITIES["omega_03"].resolution * pressed.value
    assert pressed.budget["behind_fluid"] > 1e-6 * pressed.value


def run_of(time, y, theta):
    return motion(HOPPING, time, y=y, theta=theta, omega_c=np.gradient(theta, time))


def test_which_balls_hop_and_how_high():
    """Those that come down again and again, but none that swings on the wall, sinks, or hardly
    leaves the floor."""
    t = np.arange(0, 5, 1e-3)
    hop = 4e-3 * np.abs(np.sin(12 * t))
    assert all(hops(run_of(t, y, t)) for y in (hop, np.exp(-t) * hop))
    assert not any(
        hops(run_of(t, y, t)) for y in (4e-3 + hop, np.maximum(4e-3 * (4.5 - t), 0.0), hop / 4000)
    )
    # Parabolas of one period and height: the tops come out between the samples.
    period, height = 0.2217, 4e-3
    phase = np.mod(t, period) / period - 0.5
    run = run_of(t, height * (1 - 4 * phase**2), 57.0 * t)
    tops = attractors.tops(run, 1.0, 4.0)
    # The parabola through three samples is the hop itself.
    assert tops.values["orbit_period"].value == pytest.approx(period, rel=1e-9)
    assert tops.values["orbit_height"].value == pytest.approx(height, rel=1e-9)
    assert max(value.uncertainty for value in tops.values.values()) < 1e-9
    assert len(attractors.tops(run_of(t, np.zeros_like(t), t), 1.0, 4.0).time) == 0


@pytest.mark.parametrize("size", [0.9, 1.05])
def test_map_from_hop_to_hop(size):
    """States that follow a linear map with a complex pair and a fast root: how they change, and
    what stays."""
    cos, sin = size * math.cos(0.23), size * math.sin(0.23)
    turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 0.03]])
    mixed = np.array([[1, 0.3, 0.2], [0.1, 1, 0.4], [0.5, -0.2, 1]])
    states, z = np.zeros((12, 8)), np.array([1e-3, 2e-3, 1e-3])
    for state in states:
        state[[0, 2, 3]] = np.array([5e-3, 57.0, -100.0]) + mixed @ z * np.array([0.05, 14.0, 31.0])
        z = turn @ z
    factor, steady = attractors.hop_map(states, HOPPING)
    assert factor == pytest.approx(size, rel=1e-6)
    assert steady == pytest.approx((5e-3, 0, 57.0, -100.0, 0, 0, 0, 0), rel=1e-6)


def test_where_hopping_begins_and_ends():
    """At no height; and where disturbances neither grow nor shrink."""
    flows = (58.0, 56.0, 54.0)
    curved, straight = ([4e-4 * (w - 52) - b * (w - 52) ** 2 for w in flows] for b in (1e-6, 0.0))
    bent, exact = attractors.birth(flows, curved), attractors.birth(flows, straight)
    assert exact.value == pytest.approx(52.0, abs=1e-9)
    assert 0 < abs(bent.value - 52.0) < bent.uncertainty < 0.1
    place = attractors.death(
        [0.08, 0.09, 0.11], [(0.97, 0.96, 0.96), (0.99, 0.98, 0.98), (1.03, 1.02, 1.02)]
    )
    assert (place.value, place.uncertainty) == pytest.approx((0.1025, 5e-3 / math.sqrt(12)))


def test_a_swing_is_measured_although_loads_are_rough() -> None:
    """A ripple of a thousandth has more tops than the swing, whose period they then gave."""
    time = np.arange(0.0, 6.0, 2e-3)
    rough = 1e-4 * np.random.default_rng(1).choice([-1.0, 1.0], len(time))
    omega_c = 22.4 + 0.05 * np.sin(2 * np.pi * time / 0.33)
    run = SimpleNamespace(time=time, omega_c=omega_c + rough, theta=22.4 * time)
    period, mean, size = attractors._swing(run, 1.0)
    assert period == pytest.approx(0.33, rel=3e-4)
    assert mean == pytest.approx(22.4, rel=1e-9)
    assert size == pytest.approx(0.1, rel=5e-3)


def test_a_ball_leaves_the_floor_where_it_does_however_it_shared_its_load(runner):
    """On this set the load on the floor has a kink just before it is gone: continued as it was, it
    would be gone 2 % earlier."""
    p = sets(Level.DEFAULT)["design-9"]
    rows = [each for each in slipping.lift(runner, {"d": p}, Records()) if each.set == "d"]
    (onset,) = (
        each
        for each in rows
        if not isinstance(each, Missing)
        and (each.quantity, each.at.get("inner")) == ("lift_onset", "RR")
    )
    assert onset.value == pytest.approx(14.68884, abs=3 * onset.uncertainty)
    assert onset.uncertainty < 1e-4 * onset.value


@pytest.mark.parametrize("coarse", [3.0, 2.5, 0.5])
def test_what_has_no_clear_order_is_sure_however_its_errors_fall(coarse):
    """By the first order, by less, or to the other side."""
    shown = of_no_order(coarse, Estimate(2.0, 0.0))
    assert shown.value == pytest.approx(1.0, abs=COVERAGE * shown.uncertainty)
