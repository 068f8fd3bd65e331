"""Claims on stationary states, judged on records made by hand: right theory is confirmed, wrong ones are refuted."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import analytic
from analytic import StationarySolution
from compare.claim import Outcome
from compare.judge import judge
from compare.kit.quantities import quantity
from compare.kit.record import Records
from compare.kit.settling import determined, family, scale
from compare.settled import lasting, number
from compare.subjects.flowmeter import claims as flowmeter
from compare.subjects.stationary import claims as stationary
from model import Case, Parameters
from tests.measured import measured, unnoticed

CLAIMS = (*stationary.CLAIMS, *stationary.DIAGRAMS, *flowmeter.CLAIMS)
SETS = {
    "slipping": Parameters.named("reference").replace(mu=0.3, eta=0.2),
    "rolling": Parameters.named("high-wall-friction"),
}
FLOWS = (0.6, 1.4, 1.7, 2.6, 4.2)
"""omega_0 sqrt(R/g); at 2.6 SS and NR last side by side in the first set, at 1.4 RR and NR in the second."""


def _ends(p: Parameters) -> Iterator[tuple[str, StationarySolution]]:
    """Where each start ends: on the floor as long as a state there attracts."""
    states = {family(s.case): s for s in analytic.stable_solutions(p)}
    on_floor = [states[case] for case in (Case.RR, Case.SS, Case.NR) if case in states]
    yield "rest", on_floor[0]
    yield "with the fluid", on_floor[0]
    yield "on the wall", states.get(Case.NR) or analytic.solution(p, Case.NS)


def _records(coarse: float = 0.1) -> Records:
    """What a perfect engine would measure with uncertainties of `coarse` times what is allowed."""
    rows = []
    for name, p in SETS.items():
        for q in (p.replace(omega_0=Omega_0 * np.sqrt(p.g / p.R)) for Omega_0 in FLOWS):
            for start, s in _ends(q):
                at = {"case": s.case.name, "start": start}
                rows.append(measured("settled", "case", float(s.case), 0.0, q, name, **at))
                for what in determined(s.case):
                    sure = coarse * quantity(what).resolves / 3 * scale(what, q)
                    rows.append(measured("settled", what, number(what, s, q), sure, q, name, **at))
            mask = sum(1 << case for case in {family(s.case) for s in lasting(q)})
            rows.append(measured("plane", "cases", float(mask), 0.0, q, name, figure="fig-7"))
        still = p.replace(omega_0=0.0)
        resting = analytic.solution(still, Case.RS)
        for what in determined(Case.RS):
            sure = coarse * quantity(what).resolves / 3 * scale(what, still)
            value = number(what, resting, still)
            rows.append(measured("settled", what, value, sure, still, name, case="RN", start="spinning"))
    return Records(tuple(rows))


@pytest.fixture(scope="module")
def records() -> Records:
    return _records()


def _outcomes(records: Records) -> dict[str, Outcome]:
    return {verdict.claim.id: verdict.outcome for verdict in judge(CLAIMS, records)}


JUDGED = (
    *("prop-1", "prop-1-rough", "prop-2-forces", "prop-3-5", "prop-4", "prop-6"),
    *("fig-7", "fig-9", "fig-10", "fig-11"),
)


def test_the_right_theory_is_confirmed(records: Records) -> None:
    outcome_of = _outcomes(records)
    assert {outcome_of[name] for name in JUDGED} == {Outcome.CONFIRMED}
    assert outcome_of["operating-range"] is outcome_of["unloading-limit"] is Outcome.CONFIRMED
    assert outcome_of["slope-jump"] is outcome_of["fig-13-left"] is Outcome.NOT_RUN


def test_wrong_theories_are_noticed(records: Records) -> None:
    solutions = ("stationary_solutions", "stable_solutions", "_rr", "_lifting_spin", "_wall_carries")
    assert not unnoticed(stationary.CLAIMS, records, *solutions)
    assert not unnoticed(flowmeter.CLAIMS, records, "operating_range", "reading_range")


def test_coarse_measurements_tell_nothing() -> None:
    outcome_of = _outcomes(_records(coarse=2.0))
    assert outcome_of["prop-1"] is outcome_of["prop-4"] is outcome_of["fig-9"] is Outcome.INCONCLUSIVE


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
def test_a_ball_keeps_to_its_branch_of_the_loop(Omega_0: float, case: Case, before: str, outcome: Outcome) -> None:
    p = SETS["slipping"]
    q = p.replace(omega_0=Omega_0 * np.sqrt(p.g / p.R))
    s = next(s for s in analytic.stable_solutions(q) if s.case is case)
    at = {"case": case.name, "before": before, "side": "up", "level": 1.0}
    values = {"case": (float(case), 0.0), "omega_c": (float(s.x[2]), 1e-9 * q.omega_0)}
    rows = (measured("hysteresis", what, *value, q, "slipping", **at) for what, value in values.items())
    assert _outcomes(Records(tuple(rows)))["fig-13-left"] is outcome


def _slope(by: str, case: Case, value: float) -> Records:
    p = SETS["slipping"].replace(omega_0=24.0)
    return Records((measured("slope", "slope", value, 1e-6, p, "slipping", by=by, case=case.name),))


def test_a_slope_of_a_state_that_theory_does_not_know_is_a_refutation() -> None:
    assert _outcomes(_slope("neighbours", Case.NR, 1.0))["slope-rolling"] is Outcome.REFUTED


@pytest.mark.parametrize(
    ("by", "claim", "function", "args"),
    [
        ("neighbours", "slope-slipping", "characteristic_slope", (Case.SS,)),
        ("jump", "slope-jump", "slope_jump", ()),
        ("mean", "slope-mean", "mean_slope", ()),
    ],
)
def test_slopes(by: str, claim: str, function: str, args: tuple[Case, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    right = getattr(analytic, function)
    value = right(SETS["slipping"].replace(omega_0=24.0), *args)
    off = min(0.001, 0.01 * abs(value))
    assert _outcomes(_slope(by, Case.SS, value))[claim] is Outcome.CONFIRMED
    assert _outcomes(_slope(by, Case.SS, value + off))[claim] is Outcome.REFUTED
    monkeypatch.setattr(analytic, function, lambda p, *more: right(p, *more) + off)
    assert _outcomes(_slope(by, Case.SS, value))[claim] is Outcome.REFUTED
