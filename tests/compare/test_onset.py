"""Thresholds are bracketed where they are known to be, and what has none says so."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

import analytic
from compare.catalogue import CLAIMS
from compare.claim import Outcome
from compare.judge import judge, select
from compare.kit.brackets import FINER, LONGER, USUAL, Bracket, Search, narrow
from compare.kit.lab import time_unit
from compare.kit.levels import Level, sets
from compare.kit.record import Missing, Records
from compare.kit.settling import PRESSES
from compare.kit.statistics import Measured, extrapolated_maximum, zero_and_slope
from compare.subjects.thresholds.measure import answers, thresholds
from model import Case, Parameters, State
from tests.measured import measured

REFERENCE = Parameters.named("reference")
NUMBERS = SimpleNamespace(each=list, effort=SimpleNamespace(sections=7, granted=False))
"""Stands for a lab whose tasks are their own runs."""


def narrowed(answer, width, task=lambda v, b, attempt: (v, attempt), careful=True):
    """The bracket in which an answer to (value, attempt) changes, from 0 to 1."""
    (bracket,) = narrow(NUMBERS, [Search(Bracket(0.0, 1.0), task, answer, width)], careful=careful)
    return bracket


def test_bisection_closes_in_on_the_change():
    bracket = narrowed(lambda run: run[0] < math.pi / 10, 1e-6)
    assert bracket.low < math.pi / 10 < bracket.high <= bracket.low + 1e-6
    assert bracket.shift == 0
    # An end that was taken for granted is asked: it has a run if it was right.
    assert narrowed(lambda run: run[0] < 0.95, 0.5, careful=False).runs[1] == (1.0, USUAL)
    assert narrowed(lambda run: True, 0.5, careful=False).runs[1] is None
    moves = narrowed(lambda run: run[0] < (0.31 if run[1] is FINER else 0.3), 1e-4)  # with the time step
    assert moves.low < 0.3 < moves.high
    assert moves.place.uncertainty >= moves.shift > 0


def test_runs_that_are_undecided_or_break_down_leave_the_place_open():
    """What is undecided is run again, for longer; what broke says why."""

    def answer(run):
        value, attempt = run
        if abs(value - 0.5) < 0.1:
            return value < 0.47 if attempt is LONGER and value < 0.47 else None
        return value < 0.5

    bracket = narrowed(answer, 1e-3, careful=False)
    assert 0.4 < bracket.low < 0.47 <= 0.5 < bracket.high
    assert bracket.high - bracket.low > 0.1
    broken = narrowed(lambda v: v < 0.5, 1e-3, lambda v, b, attempt: v if abs(v - 0.5) > 0.1 else "broke")
    assert broken.low < 0.4 < 0.6 < broken.high
    assert broken.failure == "broke"


@pytest.mark.parametrize(("eta", "end", "lost"), [(0.99, "omega_01", False), (1.01, "omega_03", True)])
def test_a_floor_that_carries_little_is_not_lost_where_the_ball_slips_on_both(eta, end, lost):
    """Beyond the end of rolling, on walls a little smoother and rougher than the inertia j."""
    p = REFERENCE.replace(eta=eta * REFERENCE.j)
    p = p.replace(omega_0=1.002 * getattr(analytic.thresholds(p), end))
    run = analytic.simulate(p, State(omega_c=p.omega_0), 2.0)
    assert answers.lifts(Bracket(0.0, 1.0, (None, run))) is lost
    assert run.force_A[-1, 1] < PRESSES * p.m * p.g


def test_the_drag_at_which_a_fold_is_born_is_judged_where_that_of_the_set_is_too_strong_for_one():
    p = REFERENCE.replace(c=20 * REFERENCE.c)
    born = analytic.bifurcation.diagram.critical_drag(p)
    for value, outcome in (born, Outcome.CONFIRMED), (1.01 * born, Outcome.REFUTED):
        row = measured("birth", "critical_drag", value, 1e-4 * born, p, "mine")
        assert judge(select(CLAIMS, ["double-points"]), Records((row,)))[0].outcome is outcome


@pytest.mark.parametrize("power", [1.3, 1.687, 2.0])
def test_a_bent_line_has_its_zero_and_slope(power):
    """Of growth along a line, where drag isn't linear: few claims of few sets would notice."""
    x, noise = np.array([0.0, 1.1, 1.5, 2.0]), np.full(4, 1e-6)
    zero, slope = zero_and_slope(x, x**power - 1.7, noise)
    assert abs(zero.value - 1.7 ** (1 / power)) < 3 * zero.uncertainty < 0.03
    assert abs(slope.value - power * zero.value ** (power - 1)) < 3 * slope.uncertainty < 0.06
    assert np.isnan([m.value for m in zero_and_slope(x, x + 1, noise)]).all()


@pytest.mark.parametrize("bend", [0.0, 1e-15, -1e-15, 1e-4])
def test_a_line_has_no_maximum(bend):
    """Nor has one that is bent by round-off, or so little that a maximum would be far away."""
    where = np.linspace(1.0, 2.0, 6)[::-1]
    order = [Measured(float(w), 0.0) for w in where]
    assert not math.isfinite(extrapolated_maximum(where - bend * where**2, order).value)


def test_an_end_that_cannot_be_extrapolated_is_missing_and_no_finding(lab, monkeypatch):
    """Of a set without fold, and the cases in which balls settle there."""
    monkeypatch.setattr(thresholds, "extrapolated", lambda *what: None)
    p, rows = sets(Level.QUICK)["thick-fluid"], []
    for flow in (0.6, 1.4, 2.5):
        q = p.replace(omega_0=flow / time_unit(p))
        cases = {s.case for s in analytic.stable_solutions(q)}
        floor = next(case for case in (Case.RR, Case.SS, Case.NR) if case in cases)
        wall = Case.NR if Case.NR in cases else Case.NS
        for start, case in (("rest", floor), ("with the fluid", floor), ("on the wall", wall)):
            rows.append(measured("settled", "case", float(case), 0.0, q, "thick-fluid", start=start, case=case.name))
    records = Records.of(thresholds.measure(lab, {"thick-fluid": p}, Records(tuple(rows))))
    assert any("points to no flow at which it ends" in each.reason for each in records.missing)
    assert [m.value for m in records.select("thresholds", "folds")] == [1.0]  # an end is seen, and no smooth one


def test_protocol_without_settled_states(lab):
    rows = list(thresholds.measure(lab, {"reference": REFERENCE}, Records()))
    assert all(isinstance(row, Missing) for row in rows)
    assert any("ends two-point rolling" in row.reason for row in rows)


def test_a_range_that_another_threshold_may_end_is_not_held_against_the_tolerances_of_this_one():
    p = REFERENCE.replace(eta=0.99 * REFERENCE.j)
    row = measured("thresholds", "omega_01", analytic.thresholds(p).omega_01, 1e-9, p, "mine")
    assert judge(select(CLAIMS, ["design-limit"]), Records((row,)))[0].outcome is Outcome.CONFIRMED
