"""A pulsation that breaks down loses its own numbers, and sets without slip say why."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import analytic
import mjsim
from compare.kit.lab import Lab
from compare.kit.levels import Level
from compare.kit.quantities import QUANTITIES
from compare.kit.record import Records
from compare.kit.sets import sets
from compare.kit.statistics import COVERAGE
from compare.subjects.unsteady import measure as unsteady
from model import Case, Flow, Parameters
from tests.measured import thresholds

NAME, QUICK = "rough-wall", sets(Level.QUICK)


def known(name):
    """Flows of a set that exist, as if they had been measured before."""
    found = thresholds(name, QUICK[name], "omega_01", "omega_02", "omega_04")
    return Records(tuple(replace(m, uncertainty=0.0) for m in found.measurements if np.isfinite(m.value)))


def test_a_run_that_breaks_down_leaves_out_its_own_pulsation(lab, monkeypatch):
    each, tried = Lab.each, []

    def breaking(lab, tasks):
        tried.append(tasks)
        runs = list(each(lab, tasks))
        return ["diverged", *runs[1:]] if len(tried) == 1 else runs

    monkeypatch.setattr(Lab, "each", breaking)
    left = Records.of(unsteady.pulsation(lab, {NAME: QUICK[NAME]}, known(NAME)))
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
    driven = unsteady.Pulsation("design-5", p, f, a, reach=1.0, begin=float(begin) / a)
    (row,) = unsteady.mean_errors(replace(lab, level=Level.DEFAULT), [(driven, a)])
    assert COVERAGE * row.uncertainty > QUANTITIES["mean_error"].resolves * 0.9 * abs(row.value)


def test_sets_without_slip_say_why(lab):
    wall = {"wall": Parameters.named("high-wall-friction")}
    rows = [*unsteady.pulsation(lab, wall, Records()), *unsteady.jumps(lab, wall, Records())]
    assert [row.reason for row in rows] == [
        "no flow was measured at which two-point rolling ends by slipping",
        "no flows were measured between which the ball slips at both points",
    ]


def test_limit_of_a_geometric_sequence():
    assert unsteady.limit(5 + 0.3 ** np.arange(3)) == pytest.approx(5.0, rel=1e-12)
    assert unsteady.limit(np.array([0.0, 1.0, 3.0])) == 3.0


CASES = [(Case.RR, 0, True), (Case.SS, 0, True), (Case.SS, 14, True), (Case.SS, 9, False), (Case.NR, 9, False)]


@pytest.mark.parametrize(("case", "at", "rolls"), [*CASES, (Case.RS, 9, True)])
def test_rolling_on_is_judged_after_the_beginning(case, at, rolls):
    cases = np.full(16, Case.RR)
    cases[at : at + unsteady.LASTING] = case
    assert unsteady.rolls_on(SimpleNamespace(time=np.linspace(0.0, 1.5, 16), case=cases)) is rolls


def test_a_measured_flow_by_both_witnesses(tmp_path):
    """Noise and a swell that makes the ball slip, a hundred samples a second."""
    p, t = Parameters.named("reference").replace(c=4.0), np.arange(0.0, 3.0, 0.01)
    omega_0 = 12.0 + 4.0 * np.sin(2 * np.pi * t / 3.0) + 0.3 * np.random.default_rng(1).standard_normal(len(t))
    np.savetxt(
        tmp_path / "flow.csv", np.stack([t, omega_0], axis=-1), delimiter=",", header="time,omega_0", comments=""
    )
    flow = Flow.from_csv(tmp_path / "flow.csv")
    theory, run = (simulate(p, [0, 0, 12.0, 0, 0, 0], 3.0, flow) for simulate in (analytic.simulate, mjsim.simulate))
    assert {Case.RR, Case.SS} <= set(theory.cases) & set(run.cases)
    np.testing.assert_allclose(run.omega_c, theory.omega_c, rtol=1e-3)
