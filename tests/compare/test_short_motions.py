"""The protocols of short motions on one set: blind, and sharp enough to notice a theory that is slightly wrong."""

from collections.abc import Callable, Iterator
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

import analytic
from analytic.bifurcation import diagram as bifurcation
from analytic.slipping import slip_stability
from compare.claim import Outcome, Verdict
from compare.judge import judge
from compare.kit.lab import Lab
from compare.kit.levels import Level
from compare.kit.record import Missing, Records
from compare.kit.sets import sets
from compare.kit.short import random_state
from compare.kit.tasks import Task
from compare.subjects.formal import claims as formal
from compare.subjects.motion import claims as motion
from compare.subjects.motion.measure import motions
from compare.subjects.slipping import claims as slipping
from compare.subjects.slipping.measure import growth, onset
from compare.subjects.thresholds.measure.thresholds import birth
from model import Case, Parameters, Trajectory, storage
from model.cases import TRAITS
from tests.measured import thresholds

QUICK = sets(Level.QUICK)
SETS = {"reference": QUICK["reference"]}
Measured = Callable[[str], Records]
LIFTS = {f"lift-{inner.name}-{outer.name}" for inner, outer in slip_stability.LIFT_ARROWS}


@pytest.fixture(scope="module")
def measured(lab: Lab) -> Measured:
    """What each protocol measures, on one set or two."""
    known = thresholds("reference", SETS["reference"], "omega_01", "omega_02")
    protocols = {
        "field": lambda: motions.field(lab, SETS, Records()),
        "growth": lambda: growth.measure(lab, SETS, Records()),
        "bounds": lambda: onset.bounds(lab, SETS, known),
        "lift": lambda: onset.lift(lab, {name: QUICK[name] for name in ("rubber-wall", "rough-floor")}, Records()),
        "motions": lambda: motions.motions(lab, SETS, Records()),
        "impacts": lambda: motions.impacts(lab, SETS, Records()),
    }
    return cache(lambda name: Records.of(protocols[name]()))


def verdicts(records: Records) -> dict[str, Verdict]:
    return {each.claim.id: each for each in judge(motion.LAW_CLAIMS + motion.EQUATIONS + slipping.CLAIMS, records)}


@pytest.mark.parametrize("name", ["field", "growth", "bounds", "lift", "impacts"])
def test_a_run_that_breaks_down_is_said_and_takes_no_other_with_it(measured, name, monkeypatch) -> None:
    whole, groups, tried = measured(name), Lab.groups, []

    def breaking(lab: Lab, asked: list[list[Task]]) -> Iterator[list[Trajectory] | str]:
        for group, runs in zip(asked, groups(lab, asked), strict=True):
            tried.extend([group] if len(group) > 1 else [])  # not a run that has to settle first
            yield "diverged at once" if tried == [group] else runs

    monkeypatch.setattr(Lab, "groups", breaking)
    left = measured.__wrapped__(name)
    assert ["the run diverged at once" in missing.reason for missing in left.missing].count(True) == 1
    assert 0.5 < len(left.measurements) / len(whole.measurements) <= 1


@pytest.mark.parametrize("case", list(Case))
def test_random_states_satisfy_their_case(case: Case) -> None:
    p = SETS["reference"]
    x = random_state(case, p, np.random.default_rng(1))
    analytic.vector_field(case, x, p)  # it refuses a state that isn't of the case
    assert np.count_nonzero(x) == TRAITS[case].dimension + (case is Case.RN)


@pytest.mark.parametrize(
    ("protocol", "ids"),
    [
        ("field", {f"motion-{case.name}" for case in Case}),
        ("growth", {"slip-RR-RS", "slip-RR-SS", "slip-RS-SS", "slip-SR-SS", "slip-NR-NS", "eq-69"}),
        ("bounds", {"eq-61", "eq-66", "eq-67", "eq-82", "eq-83", "fig-4-5"}),
        ("lift", LIFTS),
        ("motions", {"cases"}),
        ("impacts", {"impacts"}),
    ],
)
def test_the_right_theory_is_confirmed(measured: Measured, protocol: str, ids: set[str]) -> None:
    found = verdicts(measured(protocol))
    assert {name: found[name].outcome for name in ids} == dict.fromkeys(ids, Outcome.CONFIRMED)
    if protocol == "growth":
        assert found["extrema"].outcome is Outcome.REFUTED
        assert found["slip-RR-SR"].outcome in (Outcome.CONFIRMED, Outcome.NOT_RUN)  # the wall of this set slips, too
    if protocol == "motions":
        assert len({check.predicted for check in found["cases"].checks}) >= 7


def test_the_fold_is_born_at_the_critical_drag(lab: Lab) -> None:
    thick = {"thick-fluid": QUICK["thick-fluid"]}
    known = thresholds("thick-fluid", thick["thick-fluid"], "omega_01", "omega_02")
    (m,) = Records.of(birth(lab, thick, known)).measurements
    assert abs(m.value - bifurcation.critical_drag(m.parameters)) < 3 * m.uncertainty < 5e-3 * m.value


def test_without_friction_nothing_rolls_and_the_reader_is_told(lab: Lab) -> None:
    smooth = {"ice": SETS["reference"].replace(eta=0.0)}
    for protocol, measure in (("growth", growth.measure), ("bounds", onset.bounds)):
        assert list(measure(lab, smooth, Records())) == [Missing(protocol, "ice", growth.FRICTIONLESS)]


def test_pieces_keep_away_from_changes_of_case(lab: Lab, measured: Measured) -> None:
    key = measured("motions").measurements[0].runs[0]
    (run,) = (runs[key] for path in lab.campaign.directory.glob("*.h5") if key in (runs := storage.load_runs(path)))
    changes = np.flatnonzero(np.diff(run.case)) + 1
    for first in motions.pieces(run, 12):
        for end in (first, first + motions.LENGTH):
            assert np.abs(changes - end).min() >= motions.APART


def test_formal_claims_are_algebra() -> None:
    for verdict in judge(formal.CLAIMS, Records()):
        assert verdict.outcome is Outcome.CONFIRMED
        assert {check.measurement.engine for check in verdict.checks} == {"theory"}


@pytest.mark.parametrize(("share", "turns"), [(1.1, True), (0.9, False)])
def test_a_slip_that_friction_holds_at_a_trace_is_no_smooth_motion(share: float, turns: bool) -> None:
    """It doesn't change, yet a 1e-4 of it turns its friction so far that the rates are others."""
    p, time = Parameters.named("reference"), np.linspace(0.0, 1e-3, 5)
    # A sphere's contact point feels friction f as an acceleration f/m (1 + 1/j).
    friction = p.m * motions.TURN / (time[-1] * (1 + 1 / p.j)) * share
    x = np.tile([0, 0, 1.0, 0, 1.0 / p.r, 0, 0, 0], (5, 1))
    forces = {"force_A": np.zeros((5, 3)), "force_B": np.full((5, 3), friction / p.eta)}
    run = SimpleNamespace(header=SimpleNamespace(parameters=p), time=time, x=x, **forces)
    assert motions.turns_or_hovers(Case.NS, run, slice(0, 5)) is turns
