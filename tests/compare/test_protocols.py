"""Protocols of motions say what broke down or isn't there, and read each number as it is."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import analytic
from compare.kit.lab import Lab
from compare.kit.levels import Level, sets
from compare.kit.quantities import QUANTITIES
from compare.kit.record import Missing, Records
from compare.kit.statistics import COVERAGE
from compare.subjects.flowmeter import measure as flowmeter
from compare.subjects.motion.measure import laws, motions
from compare.subjects.slipping.measure import growth, onset
from compare.subjects.unsteady import measure as unsteady
from model import Case, Parameters
from tests.measured import motion, thresholds

QUICK = sets(Level.QUICK)
SETS = {"reference": QUICK["reference"]}
PROTOCOLS = {
    "field": lambda lab: motions.field(lab, SETS, Records()),
    "growth": lambda lab: growth.measure(lab, SETS, Records()),
    "bounds": lambda lab: onset.bounds(lab, SETS, thresholds("reference", SETS["reference"], "omega_01", "omega_02")),
    "lift": lambda lab: onset.lift(lab, {"rubber-wall": QUICK["rubber-wall"]}, Records()),
    "impacts": lambda lab: motions.impacts(lab, SETS, Records()),
}


@pytest.mark.parametrize("name", PROTOCOLS)
def test_a_run_that_breaks_down_is_said_and_takes_no_other_with_it(lab, name, monkeypatch):
    """The first group of runs is said to; validation shows what all of them measure."""
    groups, tried = Lab.groups, []

    def breaking(lab, asked):
        for group, runs in zip(asked, groups(lab, asked), strict=True):
            tried.extend([group] if len(group) > 1 else [])  # not a run that has to settle first
            yield "diverged at once" if tried == [group] else runs

    monkeypatch.setattr(Lab, "groups", breaking)
    left = Records.of(PROTOCOLS[name](lab))
    assert ["the run diverged at once" in missing.reason for missing in left.missing].count(True) == 1
    assert sum(missing.rows for missing in left.missing if "at once" in missing.reason) < len(left.measurements)


def test_without_friction_nothing_rolls_and_the_reader_is_told(lab):
    smooth = {"ice": SETS["reference"].replace(eta=0.0)}
    for protocol, measure in (("growth", growth.measure), ("bounds", onset.bounds)):
        assert list(measure(lab, smooth, Records())) == [Missing(protocol, "ice", growth.FRICTIONLESS)]


@pytest.mark.parametrize(("share", "turns"), [(1.1, True), (0.9, False)])
def test_a_slip_that_friction_holds_at_a_trace_is_no_smooth_motion(share, turns):
    """It doesn't change, yet a 1e-4 of it turns its friction so far that the rates are others."""
    p, time = Parameters.named("reference"), np.linspace(0.0, 1e-3, 5)
    # A sphere's contact point feels friction f as an acceleration f/m (1 + 1/j).
    friction = p.m * motions.TURN / (time[-1] * (1 + 1 / p.j)) * share
    x = np.tile([0, 0, 1.0, 0, 1.0 / p.r, 0, 0, 0], (5, 1))
    forces = {"force_A": np.zeros((5, 3)), "force_B": np.full((5, 3), friction / p.eta)}
    run = SimpleNamespace(header=SimpleNamespace(parameters=p), time=time, x=x, **forces)
    assert motions.turns_or_hovers(Case.NS, run, slice(0, 5)) is turns


# --- a pulsating flow, laws at every instant, tops between samples ----------------------------------------------


def test_a_run_that_breaks_down_leaves_out_its_own_pulsation(lab, monkeypatch):
    each, tried, name = Lab.each, [], "rough-wall"
    known = thresholds(name, QUICK[name], "omega_01", "omega_02", "omega_04", uncertainty=0.0)

    def breaking(lab, tasks):
        tried.append(tasks)
        runs = list(each(lab, tasks))
        return ["diverged", *runs[1:]] if len(tried) == 1 else runs

    monkeypatch.setattr(Lab, "each", breaking)
    left = Records.of(unsteady.pulsation(lab, {name: QUICK[name]}, known))
    assert [missing.reason.endswith("the run diverged") for missing in left.missing] == [True]
    assert {m.quantity for m in left.measurements} == {"gain", "phase_lag", "slip_amplitude", "mean_error"}


@pytest.mark.slow
def test_a_mean_may_depend_on_more_than_the_state(lab):
    """Where theory itself has two answers (docs/theory.md, 11) the protocol sees that its own is none, blind."""
    p, f, a = sets(Level.DEFAULT)["design-5"].replace(omega_0=11.7694), 4.0, 199.89
    theory, rules = analytic.flowmeter.pulsation, ("slip-stability", "infeasible")
    early, late = (theory.mean_error(p, a, f, leave_rolling=rule) for rule in rules)
    assert late - early > 0.015 * abs(early)
    begin = theory.swing(p, a, f, 0.0)[0] - p.omega_0
    driven = unsteady.Pulsation("design-5", p, f, a, reach=1.0, lead=float(begin) / a)
    (row,) = unsteady.mean_errors(replace(lab, level=Level.DEFAULT), [(driven, a)])
    assert COVERAGE * row.uncertainty > QUANTITIES["mean_error"].resolves * 0.9 * abs(row.value)


def test_sets_without_slip_say_why(lab):
    wall = {"wall": Parameters.named("high-wall-friction")}
    rows = [*unsteady.pulsation(lab, wall, Records()), *unsteady.jumps(lab, wall, Records())]
    assert [row.reason for row in rows] == [
        "no flow was measured at which two-point rolling ends by slipping",
        "no flows were measured between which the ball slips at both points",
    ]


ROUGH, SAMPLES = QUICK["high-wall-friction"], 50


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
    right = {"slip_x": w_x, "slip_y": w_y, "slip_z": w_z, "force_A": A, "force_B": B, "case": Case.SS}

    def found(law, contact, **changes):
        of = laws.deviations([motion(ROUGH, np.linspace(0.0, 1.0, SAMPLES), **right | changes)])
        return next(value for (_, name, point), value in of.items() if name.startswith(law) and point == contact)

    ratio, law, rolls = "friction over normal force", "(14), (15)", "where it rolls it doesn't slip"
    for contact, coefficient in (("A", ROUGH.mu), ("B", ROUGH.eta)):
        assert found(law, contact) <= laws.ROUNDING
        assert found(ratio, contact) == pytest.approx(coefficient, rel=laws.ROUNDING)
        assert np.isnan(found(rolls, contact))  # nothing rolls: that law has no samples
    assert found(ratio, "B", force_B=B * [1.0, 1.01, 1.01]) == pytest.approx(1.01 * ROUGH.eta)
    assert found(ratio, "A", force_A=A * [0.99, 1.0, 0.99]) == pytest.approx(0.99 * ROUGH.mu)
    one = np.where(np.arange(SAMPLES)[:, None] == 7, [1.0, -1.0, 1.0], 1.0)
    assert found(law, "B", force_B=B * one) > 0.1 * ROUGH.eta
    assert found("where it is closed there is no gap", "A", gap_A=1e-3 * ROUGH.R) == pytest.approx(1e-3)
    assert found(rolls, "A", slip_z=1e-3 * w_z, slip_x=1e-3 * w_x, case=Case.RS) > 0


def test_first_top_lies_between_samples():
    """Claims predict with it, too: they would not notice if it were wrong."""
    p = QUICK["thick-fluid"]
    run, fine = (
        analytic.simulate(p, [0.05, 1.0, 0, 0, 0, 0, 0.01, 0], 0.5, sample_interval=interval)
        for interval in (0.01, 1e-4)
    )
    top = flowmeter.first_top(run)
    assert abs(top.value - float(fine.y.max())) <= top.uncertainty < p.g * 0.01**2 * p.c * 0.01
