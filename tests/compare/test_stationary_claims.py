"""Claims on stationary states, judged on records made by hand: right theory is confirmed, wrong ones are refuted."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import analytic
from analytic import StationarySolution
from compare.claims import flowmeter, stationary
from compare.claims.claim import Outcome
from compare.claims.judge import judge
from compare.measure.quantities import quantity
from compare.measure.record import Records
from compare.measure.settling import determined, family, scale
from model import Case, Parameters
from tests.measured import measured

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
                    rows.append(measured("settled", what, stationary.number(what, s, q), sure, q, name, **at))
            mask = sum(1 << case for case in {family(s.case) for s in stationary.lasting(q)})
            rows.append(measured("plane", "cases", float(mask), 0.0, q, name, figure="fig-7"))
        still = p.replace(omega_0=0.0)
        resting = analytic.solution(still, Case.RS)
        for what in determined(Case.RS):
            sure = coarse * quantity(what).resolves / 3 * scale(what, still)
            value = stationary.number(what, resting, still)
            rows.append(measured("settled", what, value, sure, still, name, case="RN", start="spinning"))
    return Records(tuple(rows))


@pytest.fixture(scope="module")
def records() -> Records:
    return _records()


def _outcomes(records: Records) -> dict[str, Outcome]:
    return {verdict.claim.id: verdict.outcome for verdict in judge(CLAIMS, records)}


JUDGED = (
    "prop-1",
    "prop-1-rough",
    "prop-2-forces",
    "prop-3-5",
    "prop-4",
    "prop-6",
    "fig-7",
    "fig-9",
    "fig-10",
    "fig-11",
)


def test_the_right_theory_is_confirmed(records: Records) -> None:
    outcome_of = _outcomes(records)
    assert {outcome_of[name] for name in JUDGED} == {Outcome.CONFIRMED}
    assert outcome_of["operating-range"] is outcome_of["unloading-limit"] is Outcome.CONFIRMED
    assert outcome_of["slope-jump"] is outcome_of["fig-13-left"] is Outcome.NOT_RUN


def test_coarse_measurements_tell_nothing() -> None:
    outcome_of = _outcomes(_records(coarse=2.0))
    assert outcome_of["prop-1"] is outcome_of["prop-4"] is outcome_of["fig-9"] is Outcome.INCONCLUSIVE


def _changed(monkeypatch: pytest.MonkeyPatch, change: Any) -> None:
    """Replace every public way to the stationary solutions by one with other solutions, of which there may be none."""
    right = {name: getattr(analytic, name) for name in ("stationary_solutions", "stable_solutions", "solution")}

    def several(name: str) -> Any:
        return lambda p, **more: [new for s in right[name](p, **more) if (new := change(s, p)) is not None]

    def one(p: Parameters, case: Case, **how: Any) -> StationarySolution:
        new: StationarySolution | None = change(right["solution"](p, case, **how), p)
        if new is None:
            raise LookupError
        return new

    monkeypatch.setattr(analytic, "stationary_solutions", several("stationary_solutions"))
    monkeypatch.setattr(analytic, "stable_solutions", several("stable_solutions"))
    monkeypatch.setattr(analytic, "solution", one)


def _without(case: Case) -> Any:
    return lambda s, p: None if s.case is case else s


def _scaled(case: Case, **factors: float) -> Any:
    def change(s: StationarySolution, p: Parameters) -> StationarySolution:
        if s.case is not case:
            return s
        return replace(s, **{name: getattr(s, name) * factor for name, factor in factors.items()})

    return change


def _exchanged(s: StationarySolution, p: Parameters) -> StationarySolution | None:
    """SS with mu and eta exchanged."""
    if s.case is not Case.SS:
        return s
    swapped = p.replace(mu=p.eta, eta=p.mu)
    return next((other for other in _RIGHT(swapped) if other.case is Case.SS and other.stable), None)


_RIGHT = analytic.stationary_solutions

WRONG = {
    "SR exists nowhere": (_without(Case.SR), {"prop-3-5", "fig-10", "fig-11"}),
    "NR exists nowhere": (_without(Case.NR), {"prop-3-5", "fig-9", "fig-7"}),
    "NS exists nowhere": (_without(Case.NS), {"prop-6", "fig-9", "fig-7"}),
    "SS exists nowhere": (_without(Case.SS), {"prop-4", "fig-10", "fig-7"}),
    "SS with mu and eta exchanged": (_exchanged, {"prop-4", "fig-10"}),
    "forces of NR 1 % off": (_scaled(Case.NR, force_B=1.01), {"prop-3-5"}),
    "forces of SR 1 % off": (_scaled(Case.SR, force_B=1.01), {"prop-3-5"}),
    "forces of SS 1 % off": (_scaled(Case.SS, force_A=1.01), {"prop-4"}),
    "forces of RR 1 % off": (_scaled(Case.RR, force_B=1.01), {"prop-1"}),
    "forces of RS 1 % off": (_scaled(Case.RS, force_A=1.01), {"prop-2-forces"}),
    "a state of NS off by a millionth": (_scaled(Case.NS, x=1 + 1e-6), {"prop-6"}),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_theory_is_refuted(name: str, records: Records, monkeypatch: pytest.MonkeyPatch) -> None:
    change, noticed = WRONG[name]
    _changed(monkeypatch, change)
    outcome_of = _outcomes(records)
    assert {claim for claim in JUDGED if outcome_of[claim] is Outcome.REFUTED} >= noticed
    assert Outcome.ERROR not in outcome_of.values()


def test_a_wall_that_carries_at_other_flows_is_refuted(records: Records, monkeypatch: pytest.MonkeyPatch) -> None:
    def change(s: StationarySolution, p: Parameters) -> StationarySolution | None:
        return None if s.case in (Case.NR, Case.SR) and p.Omega_0 < 3.0 else s

    _changed(monkeypatch, change)
    outcome_of = _outcomes(records)
    assert outcome_of["prop-3-5"] is outcome_of["fig-7"] is Outcome.REFUTED


def test_a_wrong_range_is_refuted(records: Records, monkeypatch: pytest.MonkeyPatch) -> None:
    t = analytic.thresholds
    monkeypatch.setattr(analytic, "operating_range", lambda p: t(p).omega_02)
    assert _outcomes(records)["operating-range"] is Outcome.REFUTED
    monkeypatch.undo()
    monkeypatch.setattr(analytic, "unloading_limit", lambda p: 2 * t(p).omega_02)
    assert _outcomes(records)["unloading-limit"] is Outcome.REFUTED


def test_rolling_that_should_end_earlier_is_refuted(records: Records, monkeypatch: pytest.MonkeyPatch) -> None:
    t = analytic.thresholds
    monkeypatch.setattr(analytic, "thresholds", lambda p: replace(t(p), omega_03=0.8 * t(p).omega_03))
    assert _outcomes(records)["prop-1-rough"] is Outcome.REFUTED


class TestLoop:
    p = SETS["slipping"]

    def _level(self, Omega_0: float, case: Case, before: str) -> Records:
        q = self.p.replace(omega_0=Omega_0 * np.sqrt(self.p.g / self.p.R))
        s = next(s for s in analytic.stable_solutions(q) if s.case is case)
        at = {"case": case.name, "before": before, "side": "up", "level": 1.0}
        sure = 1e-9 * q.omega_0
        return Records(
            (
                measured("hysteresis", "case", float(case), 0.0, q, "slipping", **at),
                measured("hysteresis", "omega_c", float(s.x[2]), sure, q, "slipping", **at),
            )
        )

    def test_a_ball_keeps_to_its_branch(self) -> None:
        for case, before in ((Case.SS, "SS"), (Case.NR, "NR")):
            assert _outcomes(self._level(2.6, case, before))["fig-13-left"] is Outcome.CONFIRMED

    def test_a_ball_that_leaves_it_is_a_refutation(self) -> None:
        for case, before in ((Case.SS, "NR"), (Case.NR, "SS")):
            assert _outcomes(self._level(2.6, case, before))["fig-13-left"] is Outcome.REFUTED

    def test_where_its_branch_has_ended_it_changes(self) -> None:
        assert _outcomes(self._level(1.7, Case.SS, "NR"))["fig-13-left"] is Outcome.CONFIRMED


class TestSlope:
    p = SETS["slipping"].replace(omega_0=24.0)

    def _records(self, by: str, case: Case, value: float) -> Records:
        return Records((measured("slope", "slope", value, 1e-6, self.p, "slipping", by=by, case=case.name),))

    def test_slopes(self, monkeypatch: pytest.MonkeyPatch) -> None:
        right = analytic.characteristic_slope(self.p, Case.SS)
        records = self._records("neighbours", Case.SS, right)
        assert _outcomes(records)["slope-slipping"] is Outcome.CONFIRMED
        assert _outcomes(self._records("neighbours", Case.SS, 1.01 * right))["slope-slipping"] is Outcome.REFUTED
        monkeypatch.setattr(analytic, "characteristic_slope", lambda p, case: 0.99 * right)
        assert _outcomes(records)["slope-slipping"] is Outcome.REFUTED

    def test_a_state_that_theory_does_not_know_is_a_refutation(self) -> None:
        slow = self._records("neighbours", Case.NR, 1.0)
        assert _outcomes(slow)["slope-rolling"] is Outcome.REFUTED

    @pytest.mark.parametrize(("by", "claim"), [("jump", "slope-jump"), ("mean", "slope-mean")])
    def test_jump_and_mean(self, by: str, claim: str, monkeypatch: pytest.MonkeyPatch) -> None:
        name = {"jump": "slope_jump", "mean": "mean_slope"}[by]
        right = getattr(analytic, name)
        records = self._records(by, Case.SS, right(self.p))
        assert _outcomes(records)[claim] is Outcome.CONFIRMED
        monkeypatch.setattr(analytic, name, lambda p: right(p) + 0.001)
        assert _outcomes(records)[claim] is Outcome.REFUTED
