"""The ladder of settings and error against cost: what is tried, from where, and what comes out as data."""

from __future__ import annotations

import dataclasses
import itertools
import math
from pathlib import Path

import numpy as np
import pytest

import analytic
from compare.bench import league, scores
from compare.bench.league import COST, ERRORS, OPEN
from compare.bench.trials import APPROACH, ROLLING, SLIPPING, STATES
from compare.kit.campaign import Campaign
from compare.kit.engines import newcomer
from docs.studies import tables
from mjsim import ContactSettings

STEP = 4e-3


@pytest.fixture
def campaign(tmp_path: Path) -> Campaign:
    return Campaign(tmp_path, workers=0)


def test_the_ladder_ends_at_the_defaults_by_one_thing_at_a_time() -> None:
    rungs = list(scores.rungs(1e-3).values())
    assert rungs[-1] == ContactSettings()
    contact = {"solref", "solreffriction", "solimp", "impratio"}  # one thing: what makes it stiff and continuous
    for low, high in itertools.pairwise(rungs):
        changed = {f.name for f in dataclasses.fields(low) if getattr(low, f.name) != getattr(high, f.name)}
        assert len(changed) == 1 or changed == contact


@pytest.mark.parametrize("step", [1e-3, STEP])
def test_settings_are_named_after_what_they_are(step: float) -> None:
    """After the nearer of ours and MuJoCo's defaults, and each setting that differs, in the order of the fields."""

    def text(value: object) -> str:
        return (
            ("off", "on")[value]
            if isinstance(value, bool)
            else f"{value:g}"
            if isinstance(value, float)
            else str(value)
        )

    bases = {"ours": ContactSettings.at(step), "MuJoCo's defaults": newcomer(step)}
    for name, way in (scores.rungs(step) | scores.rivals(step) | tables.variants(step)).items():
        values = dataclasses.asdict(way).items()
        named = [[base, *(f"{n} {text(v)}" for n, v in values if v != getattr(at, n))] for base, at in bases.items()]
        assert name == ", ".join(min(named, key=len))


def test_no_run_begins_where_it_should_end() -> None:
    for state, discipline in zip(STATES, ERRORS, strict=False):
        ((asked, x0, *_),) = discipline.runs
        assert asked is state.p
        assert abs(x0[2] / state.solution.x[2] - 1) > 0.01


def test_errors_are_those_of_the_run() -> None:
    """A run of the slipping state, with known errors put in."""
    run, exact = analytic.simulate(SLIPPING.p, SLIPPING.solution.x, 0.1), APPROACH.exact
    off = dataclasses.replace(run, omega_c=1.01 * run.omega_c, slip_z=run.slip_z + 2.0, force_B=0 * run.force_B)
    held = SLIPPING.held(off, 0.05)
    assert held.omega_c == pytest.approx(0.01)
    assert held.slip == pytest.approx(2.0 * SLIPPING.p.r)
    assert held.open == 1
    broken = dataclasses.replace(run, header=dataclasses.replace(run.header, failure="diverged"))
    assert math.isnan(SLIPPING.held(broken, 0.05).omega_c)
    scaled = exact.x * np.where(np.arange(8) == 2, 1.001, 1.0)
    omega_c, slip = APPROACH.errors(exact.time, scaled)
    assert omega_c == pytest.approx(1e-3)
    assert slip == 0


def test_ladder_as_records(tmp_path: Path, campaign: Campaign, monkeypatch: pytest.MonkeyPatch) -> None:
    rungs = scores.rungs(STEP)
    poor, ours = scores.reached(campaign, {name: rungs[name] for name in ("MuJoCo's defaults", "ours")})
    assert poor.name == "MuJoCo's defaults"
    assert list(ours.scores) == [*(state.name for state in STATES), APPROACH.name, OPEN]
    assert all(ours.scores[name] < poor.scores[name] for name in ours.scores)
    assert ours.scores[OPEN] == 0
    monkeypatch.setattr(scores, "reached", lambda *_: [poor])
    monkeypatch.setattr(scores, "frontier", lambda *_: [ours])
    scores.write(campaign, tmp_path)
    assert scores.read(tmp_path) == {"ladder": (poor,), "frontier": (ours,)}


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_a_run_that_breaks_down_has_no_error(campaign: Campaign, monkeypatch: pytest.MonkeyPatch) -> None:
    """Known to diverge: a pyramidal cone with a low impedance."""
    wild = ContactSettings.at(STEP, solimp=0.1, solreffriction=20 * STEP, cone="pyramidal", memory=False, order=1)
    monkeypatch.setattr(scores, "ERRORS", ERRORS[:1])
    monkeypatch.setattr(scores, "CONTACT", ERRORS[0])
    (entry,) = scores.reached(campaign, {"wild": wild})
    assert math.isnan(entry.scores[ROLLING.name])
    assert entry.failures.keys() == {ROLLING.name}


def test_frontier_has_a_cost_that_is_measured_once(campaign: Campaign, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scores, "rivals", lambda step: {"ours": ContactSettings.at(step)})
    monkeypatch.setattr(scores, "BATCH", 2)
    entries = scores.frontier(campaign, [STEP])
    assert [(e.name, e.step) for e in entries] == [("ours", STEP), ("time-stepping", STEP), ("event", None)]
    assert all(entry.scores[COST] > 0 for entry in entries)
    assert scores.frontier(campaign, [STEP]) == entries


def test_numbers_of_tables() -> None:
    assert [league.number(value) for value in (1.23e-5, 1e-16, math.nan)] == ["1.2e-05", "< 1e-14", "diverged"]
