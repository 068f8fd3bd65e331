"""Unsteady flow: both protocols on one set, the claims, and wrong theories that they notice."""

from __future__ import annotations

import numpy as np
import pytest

import analytic
import mjsim
from compare.claims import unsteady as claims
from compare.claims.claim import Outcome
from compare.claims.judge import judge
from compare.measure import pulsation, unsteady
from compare.measure.lab import Lab
from compare.measure.levels import Level
from compare.measure.record import Measurement, Records
from compare.measure.sets import sets
from compare.runs.campaign import Campaign
from compare.runs.engines import MUJOCO
from model import Case, Flow, Parameters
from tests.mutants.exchange import believed
from tests.mutants.theories import THEORIES

NAME = "rough-wall"
P = sets(Level.QUICK)[NAME]
WAKE = sets(Level.QUICK)["wake"]
UNSTEADY = [
    wrong
    for wrong in THEORIES
    if wrong.module in ("analytic.response", "analytic.pulsation") or wrong.what.startswith("a ramp")
]


def thresholds(name: str, p: Parameters) -> Records:
    """What the protocol of that name would have measured, by theory."""
    values = {q: getattr(analytic.thresholds(p), q) for q in ("omega_01", "omega_02", "omega_04")}
    common = {"protocol": "thresholds", "uncertainty": 0.0, "engine": "mujoco", "set": name, "parameters": p}
    return Records(tuple(Measurement(quantity=q, value=v, **common) for q, v in values.items() if np.isfinite(v)))


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> Records:
    with Campaign(tmp_path_factory.mktemp("runs"), workers=0) as campaign:
        lab, pulsating = Lab(campaign, MUJOCO, Level.QUICK), {NAME: P, "wake": WAKE}
        known = sum((thresholds(name, p) for name, p in pulsating.items()), Records())
        rows = [*pulsation.measure(lab, pulsating, known), *unsteady.measure(lab, {NAME: P}, known)]
    return Records.of(rows)


def test_everything_is_measured(records: Records) -> None:
    assert not records.missing
    for quantity in ("gain", "phase_lag", "slip_amplitude", "mean_error"):
        assert len(list(records.select("pulsation", quantity))) == 2 * len(pulsation.OCTAVES[Level.QUICK])
    assert {m.quantity for m in records.select("unsteady")} == {"jump_delay", "jump_peak", "jump_height", "ramp_end"}


def test_theory_and_engine_agree(records: Records) -> None:
    assert {v.claim.id: v.outcome for v in judge(claims.CLAIMS, records)} == dict.fromkeys(
        ("pulsation-lag", "pulsation-slip", "pulsation-mean", "jump-slipping", "ramp-fold"), Outcome.CONFIRMED
    )


@pytest.mark.parametrize("wrong", UNSTEADY, ids=lambda wrong: wrong.what)
def test_wrong_theories_are_noticed(records: Records, wrong) -> None:
    with believed(wrong):
        assert any(v.outcome is Outcome.REFUTED for claim in claims.CLAIMS for v in judge([claim], records))


@pytest.mark.slow
def test_pulsation_under_the_quadratic_law(tmp_path) -> None:
    blunt = sets(Level.QUICK)["blunt"]
    with Campaign(tmp_path, workers=0) as campaign:
        lab = Lab(campaign, MUJOCO, Level.QUICK)
        measured = Records.of(pulsation.measure(lab, {"blunt": blunt}, thresholds("blunt", blunt)))
    assert not measured.missing
    assert {v.outcome for v in judge(claims.CLAIMS[:3], measured)} == {Outcome.CONFIRMED}


@pytest.mark.slow
def test_a_mean_may_hang_on_more_than_the_state(tmp_path) -> None:
    """Where theory itself has two answers (docs/theory.md, 11) the protocol sees that its own is none, blind."""
    p, f, a = sets(Level.DEFAULT)["design-5"].replace(omega_0=11.7694), 4.0, 199.89
    early, late = (
        analytic.pulsation.mean_error(p, a, f, leave_rolling=rule) for rule in ("slip-stability", "infeasible")
    )
    assert late - early > 0.015 * abs(early)
    begin = analytic.pulsation.swing(p, a, f, 0.0)[0] - p.omega_0
    rhythm = pulsation.Rhythm("design-5", p, f, a, reach=1.0, begin=float(begin) / a)
    with Campaign(tmp_path, workers=0) as campaign:
        (row,) = pulsation.mean_errors(Lab(campaign, MUJOCO, Level.DEFAULT), [(rhythm, a)])
    assert "more than the state" in row.reason


def test_sets_without_slip_say_why(tmp_path) -> None:
    wall = {"wall": Parameters.named("high-wall-friction")}
    with Campaign(tmp_path, workers=0) as campaign:
        lab = Lab(campaign, MUJOCO, Level.QUICK)
        rows = [*pulsation.measure(lab, wall, Records()), *unsteady.measure(lab, wall, Records())]
    assert [row.reason for row in rows] == [
        "no flow was measured at which two-point rolling ends by slipping",
        "no flows were measured between which the ball slips at both points",
    ]


def test_a_row_points_to_its_limit() -> None:
    assert pulsation.limit(5 + 0.3 ** np.arange(3)) == pytest.approx(5.0, rel=1e-12)
    assert pulsation.limit(np.array([0.0, 1.0, 3.0])) == 3.0


def test_rolling_on_is_judged_after_the_beginning(records: Records) -> None:
    class Run:
        time = np.linspace(0.0, 1.5, 16)
        case = np.full(16, Case.RR)

    assert pulsation.rolls_on(Run)
    for case, at, rolls in (
        (Case.SS, 0, True),
        (Case.SS, 14, True),
        (Case.SS, 9, False),
        (Case.NR, 9, False),
        (Case.RS, 9, True),
    ):
        Run.case = np.full(16, Case.RR)
        Run.case[at : at + pulsation.LASTS] = case
        assert pulsation.rolls_on(Run) is rolls


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
