"""Protocols of stationary states say what did not settle, and a state on the wrong branch is refuted."""

from dataclasses import replace

import pytest

import analytic
from compare.claim import Outcome
from compare.judge import judge
from compare.kit import levels, settling
from compare.kit.lab import time_unit
from compare.kit.levels import Level, sets
from compare.kit.record import Missing, Records
from compare.subjects.flowmeter import claims as flowmeter
from compare.subjects.flowmeter import measure as characteristic
from compare.subjects.stationary import claims as stationary
from compare.subjects.stationary import measure as settled
from model import Case, Parameters
from tests.measured import measured

THICK = Parameters.named("reference").replace(c=10.0)


def _measured(lab, patch, p, *flows):
    starts = tuple((how, flows) for how in ("rest", "with the fluid", "on the wall"))
    patch.setattr(levels, "AT_QUICK", replace(levels.AT_QUICK, settled_starts=starts))
    return Records.of(settled.measure(lab, {"thick": p}, Records()))


class TestSettled:
    def test_what_does_not_settle_is_missing(self, lab, monkeypatch):
        monkeypatch.setattr(levels, "AT_QUICK", replace(levels.AT_QUICK, settling_rounds=(1.0,)))
        monkeypatch.setattr(settling, "SOLVED", 1e-3)
        found = _measured(lab, monkeypatch, THICK, 0.6)
        assert not found.measurements
        starts = [each for each in found.missing if " still drifts" in each.reason]
        states = [each for each in found.missing if "no values of it" in each.reason]
        assert len(starts) + len(states) == len(found.missing)
        assert sum(each.rows for each in starts) == 4
        assert len(states) == 3  # from rest and with the fluid the ball ends in the same
        assert all(each.rows > 10 for each in states)

    def test_a_state_that_depends_on_the_step_is_missing(self, lab, monkeypatch):
        right = settling.settle

        def other_case(lab, starts, patience):
            states = right(lab, starts, patience)
            return [replace(each, case=Case.SN) for each in states] if patience.refine == 2 else states

        monkeypatch.setattr(settled, "settle", other_case)
        found = _measured(lab, monkeypatch, THICK, 0.6)
        assert {m.quantity for m in found.measurements} == {"case"}
        assert len(found.missing) == 3
        assert all("is SN with half the time step" in each.reason and each.rows > 10 for each in found.missing)

    def test_what_quadratic_drag_does_not_settle_has_no_values(self, lab, monkeypatch):
        """A ball that goes round with the fluid keeps a slight lag; one that slips or sinks settles."""
        found = _measured(lab, monkeypatch, sets(Level.QUICK)["blunt"], 0.6, 2.0)
        cases = {m.conditions["case"] for m in found.measurements if m.quantity == "omega_c"}
        assert cases == {"SS", "NS"}
        assert any("quadratic drag fades with the lag" in each.reason for each in found.missing)


def test_what_swings_for_ever_settles_by_going_on_from_its_mean(lab, monkeypatch):
    """A ball that sinks along the wall: also where a round is rounded to another length than the usual one."""
    monkeypatch.setattr(
        levels, "AT_QUICK", replace(levels.AT_QUICK, settling_rounds=(0.45, 1.0, 1.0), settling_steps=512)
    )
    p = sets(Level.QUICK)["rough-floor"].replace(omega_0=21.74)
    (state,) = settling.settle(lab, [settling.named_start("rough-floor", p, "on the wall")])
    assert (state.case, state.failure) == (Case.NS, "")


def _outcomes(records):
    claims = (*stationary.CLAIMS, *stationary.DIAGRAMS, *flowmeter.CLAIMS)
    return {verdict.claim.id: verdict.outcome for verdict in judge(claims, records)}


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
    p = Parameters.named("reference").replace(mu=0.3)
    q = p.replace(omega_0=Omega_0 / time_unit(p))
    s = next(s for s in analytic.stable_solutions(q) if s.case is case)
    at = {"case": case.name, "before": before, "side": "up", "level": 1.0}
    values = {"case": (float(case), 0.0), "omega_c": (float(s.x[2]), 1e-9 * q.omega_0)}
    rows = (measured("hysteresis", what, *value, q, "slipping", **at) for what, value in values.items())
    assert _outcomes(Records(tuple(rows)))["fig-13-left"] is outcome


def test_a_slope_of_a_state_that_theory_does_not_know_is_a_refutation():
    p = Parameters.named("reference").replace(omega_0=24.0)
    row = measured("slope", "slope", 1.0, 1e-6, p, by="neighbours", case="NR")
    assert _outcomes(Records((row,)))["slope-rolling"] is Outcome.REFUTED


def test_no_loop_without_a_change_from_slipping_to_riding(lab):
    assert [type(row) for row in characteristic.hysteresis(lab, {"thick": THICK}, Records())] == [Missing]
