"""A pulsation that breaks down loses its own numbers, and sets without slip say why."""

from dataclasses import replace

import numpy as np
import pytest

import analytic
from compare.kit.lab import Lab
from compare.kit.levels import Level
from compare.kit.quantities import QUANTITIES
from compare.kit.record import Records
from compare.kit.sets import sets
from compare.kit.statistics import COVERAGE
from compare.subjects.unsteady import measure as unsteady
from model import Parameters
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
