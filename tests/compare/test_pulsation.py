"""Unsteady flow: both protocols on one set, and the claims."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import analytic
import mjsim
from compare.claim import Outcome
from compare.judge import judge
from compare.kit.lab import Lab
from compare.kit.levels import Level
from compare.kit.quantities import QUANTITIES
from compare.kit.record import Records
from compare.kit.sets import sets
from compare.kit.statistics import COVERAGE
from compare.subjects.unsteady import claims
from compare.subjects.unsteady import measure as unsteady
from model import Case, Flow, Parameters
from tests.measured import thresholds

NAME, QUICK = "rough-wall", sets(Level.QUICK)


def known(name: str) -> Records:
    """Flows of a set that exist, as if they had been measured before."""
    found = thresholds(name, QUICK[name], "omega_01", "omega_02", "omega_04")
    return Records(tuple(replace(m, uncertainty=0.0) for m in found.measurements if np.isfinite(m.value)))


@pytest.fixture(scope="module")
def records(lab) -> Records:
    given = lab, {NAME: QUICK[NAME]}, known(NAME)
    return Records.of([*unsteady.pulsation(*given), *unsteady.jumps(*given)])


def test_everything_is_measured_and_theory_and_engine_agree(records: Records, lab) -> None:
    assert not records.missing
    for quantity in ("gain", "phase_lag", "slip_amplitude", "mean_error"):
        assert len(list(records.select("pulsation", quantity))) == len(lab.effort.pulsation_octaves)
    assert {m.quantity for m in records.select("unsteady")} == {"jump_delay", "jump_peak", "jump_height", "ramp_end"}
    # pulsation-limits is about thresholds, too, of which there are none here
    assert {v.claim.id for v in judge(claims.CLAIMS, records) if v.outcome is Outcome.CONFIRMED} == {
        *("pulsation-lag", "pulsation-slip", "pulsation-mean", "jump-slipping", "ramp-fold")
    }


def test_a_run_that_breaks_down_leaves_out_its_own_pulsation(records: Records, lab, monkeypatch) -> None:
    each, tried = Lab.each, []

    def breaking(lab, tasks):
        tried.append(tasks)
        runs = list(each(lab, tasks))
        return ["diverged", *runs[1:]] if len(tried) == 1 else runs

    monkeypatch.setattr(Lab, "each", breaking)
    left = Records.of(unsteady.pulsation(lab, {NAME: QUICK[NAME]}, known(NAME)))
    assert [missing.reason.endswith("the run diverged") for missing in left.missing] == [True]
    assert len(left.measurements) == len(list(records.select("pulsation", where=lambda m: m.set == NAME))) / 2


@pytest.mark.slow
def test_pulsation_under_the_quadratic_law(lab) -> None:
    measured = Records.of(unsteady.pulsation(lab, {"blunt": QUICK["blunt"]}, known("blunt")))
    assert not measured.missing
    assert {v.outcome for v in judge(claims.CLAIMS[:3], measured)} == {Outcome.CONFIRMED}


@pytest.mark.slow
def test_a_mean_may_depend_on_more_than_the_state(lab) -> None:
    """Where theory itself has two answers (docs/theory.md, 11) the protocol sees that its own is none, blind."""
    p, f, a = sets(Level.DEFAULT)["design-5"].replace(omega_0=11.7694), 4.0, 199.89
    theory, rules = analytic.flowmeter.pulsation, ("slip-stability", "infeasible")
    early, late = (theory.mean_error(p, a, f, leave_rolling=rule) for rule in rules)
    assert late - early > 0.015 * abs(early)
    begin = theory.swing(p, a, f, 0.0)[0] - p.omega_0
    driven = unsteady.Pulsation("design-5", p, f, a, reach=1.0, begin=float(begin) / a)
    (row,) = unsteady.mean_errors(replace(lab, level=Level.DEFAULT), [(driven, a)])
    assert COVERAGE * row.uncertainty > QUANTITIES["mean_error"].resolves * 0.9 * abs(row.value)


def test_sets_without_slip_say_why(lab) -> None:
    wall = {"wall": Parameters.named("high-wall-friction")}
    rows = [*unsteady.pulsation(lab, wall, Records()), *unsteady.jumps(lab, wall, Records())]
    assert [row.reason for row in rows] == [
        "no flow was measured at which two-point rolling ends by slipping",
        "no flows were measured between which the ball slips at both points",
    ]


def test_limit_of_a_geometric_sequence() -> None:
    assert unsteady.limit(5 + 0.3 ** np.arange(3)) == pytest.approx(5.0, rel=1e-12)
    assert unsteady.limit(np.array([0.0, 1.0, 3.0])) == 3.0


CASES = [(Case.RR, 0, True), (Case.SS, 0, True), (Case.SS, 14, True), (Case.SS, 9, False), (Case.NR, 9, False)]


@pytest.mark.parametrize(("case", "at", "rolls"), [*CASES, (Case.RS, 9, True)])
def test_rolling_on_is_judged_after_the_beginning(case, at: int, rolls: bool) -> None:
    cases = np.full(16, Case.RR)
    cases[at : at + unsteady.LASTING] = case
    assert unsteady.rolls_on(SimpleNamespace(time=np.linspace(0.0, 1.5, 16), case=cases)) is rolls


def test_a_measured_flow_by_both_witnesses(tmp_path) -> None:
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
