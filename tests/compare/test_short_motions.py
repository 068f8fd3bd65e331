"""Protocols of short motions say what broke down, and what is without friction; formal claims are algebra."""

from types import SimpleNamespace

import numpy as np
import pytest

from compare.claim import Outcome
from compare.judge import judge
from compare.kit.lab import Lab
from compare.kit.levels import Level
from compare.kit.record import Missing, Records
from compare.kit.sets import sets
from compare.subjects.formal import claims as formal
from compare.subjects.motion.measure import motions
from compare.subjects.slipping.measure import growth, onset
from model import Case, Parameters
from tests.measured import thresholds

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


def test_formal_claims_are_algebra():
    for verdict in judge(formal.CLAIMS, Records()):
        assert verdict.outcome is Outcome.CONFIRMED
        assert {check.measurement.engine for check in verdict.checks} == {"theory"}
