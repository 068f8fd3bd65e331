"""Wrong theories are believed everywhere for a while, and forgotten without a trace."""

from __future__ import annotations

import importlib
from pathlib import Path

import numpy as np
import pytest

import analytic
from analytic import dynamics, stationary
from compare.claims import stationary as claims
from compare.claims.claim import Outcome
from compare.measure.field import constrained
from compare.measure.lab import Lab
from compare.measure.levels import Level
from compare.mutants import engines, trial
from compare.mutants.engines import WRONG_ENGINES
from compare.mutants.exchange import WrongTheory, believed, scaled
from compare.mutants.theories import THEORIES
from compare.runs.campaign import Campaign
from compare.runs.engines import ENGINES, MUJOCO
from model import Case, Parameters

P = Parameters.named("reference").replace(omega_0=25.0)


def test_there_are_many() -> None:
    assert len(THEORIES) >= 40
    assert len(WRONG_ENGINES) >= 8
    assert len({wrong.what for wrong in THEORIES}) == len(THEORIES)


@pytest.mark.parametrize("wrong", THEORIES, ids=lambda wrong: wrong.what)
def test_each_replaces_a_function_that_exists_and_gives_it_back(wrong: WrongTheory) -> None:
    module = importlib.import_module(wrong.module)
    right = getattr(module, wrong.function)
    with believed(wrong):
        assert getattr(module, wrong.function) is not right
    assert getattr(module, wrong.function) is right


@pytest.mark.parametrize("wrong", [w for w in THEORIES if w.module == "analytic.dynamics"], ids=lambda w: w.what)
def test_wrong_equations_of_motion_are_wrong_and_not_broken(wrong: WrongTheory) -> None:
    """Another number somewhere, and no error: a theory that can't be evaluated would be noticed by anybody."""

    p, x = P.replace(mu=0.3), np.array([0.0, 0.1, 12.0, 1.0, 2.0, 3.0, 0.0, 0.0])
    states = [(case, constrained(case, x, p)) for case in Case]

    def numbers() -> list[float]:
        answers = [(analytic.vector_field(*at, p), *analytic.contact_forces(*at, p)) for at in states]
        return np.concatenate([np.ravel(each) for answer in answers for each in answer]).tolist()

    right = numbers()
    assert np.all(np.isfinite(right))
    with believed(wrong):
        assert numbers() != right


@pytest.mark.parametrize("law", ["stokes", "schiller-naumann", "quadratic"])
def test_faults_in_a_law_of_drag_show_under_that_law_alone(law: str) -> None:
    p = P.replace(drag=law, nu_f=2e-4, omega_0=20.0)

    def numbers(p: Parameters) -> tuple[object, ...]:
        solved = [(*s.x.tolist(), *s.eigenvalues.tolist()) for s in analytic.stationary_solutions(p)]
        return *solved, analytic.thresholds(p).omega_04

    right, seen = numbers(p), set()
    of_drag = ("SS lags as", "NS sinks as", "ω₀₄ as", "the drag's slope", "Schiller", "quadratic drag")
    for wrong in (each for each in THEORIES if each.what.startswith(of_drag)):
        with believed(wrong):
            if numbers(p) != right:
                seen.add(wrong.what.split()[0])
    every = {"SS", "NS", "ω₀₄", "the"}
    assert seen == {"stokes": set(), "schiller-naumann": every | {"Schiller"}, "quadratic": every | {"quadratic"}}[law]


def test_a_fault_shows_wherever_the_function_is_known_by_name() -> None:
    doubled = WrongTheory("", "analytic.stationary", "stable_solutions", lambda right: lambda p: 2 * right(p))
    right = analytic.stable_solutions(P)
    with believed(doubled):
        assert len(analytic.stable_solutions(P)) == len(stationary.stable_solutions(P)) == 2 * len(right)
    assert len(analytic.stable_solutions(P)) == len(right)


def test_a_fault_shows_in_tables_of_functions() -> None:
    x = [0.0, 0.0, 12.0, 1.0, 2.0, 3.0, 0.0, 0.0]
    right = np.array(dynamics.forces(Case.SS, x, P, P.omega_0))
    with believed(WrongTheory("", "analytic.dynamics", "_ss", scaled(1.5, 1))):
        wrong = np.array(dynamics.forces(Case.SS, x, P, P.omega_0))
    assert wrong[1] == 1.5 * right[1]
    assert np.array_equal(np.delete(wrong, 1), np.delete(right, 1))


def test_a_theory_that_raises_is_given_back_too() -> None:
    right = stationary.stable_solutions
    with pytest.raises(ZeroDivisionError), believed(THEORIES[0]):
        raise ZeroDivisionError
    assert stationary.stable_solutions is right
    assert claims.analytic.stable_solutions is right


@pytest.mark.parametrize("wrong", WRONG_ENGINES, ids=lambda wrong: wrong.name)
def test_a_wrong_engine_moves_otherwise_and_does_not_say_so(
    wrong: engines.Engine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("compare.runs.engines.ENGINES", dict(ENGINES) | {wrong.name: wrong})
    start, runs = [0.02, 0.0, 14.0, -1.0, 2.0, 7.0, 0.0, 0.0], {}
    with Campaign(tmp_path, workers=0) as campaign:
        for engine in (MUJOCO, wrong):
            lab = Lab(campaign, engine, Level.QUICK)
            (runs[engine.name],) = lab.run([lab.task(P, start, 0.4, 4e-3)])
    right, other = runs[MUJOCO.name], runs[wrong.name]
    assert other.header.parameters == right.header.parameters == P
    assert np.abs(other.x - right.x).max() > 1e-6


def test_the_page_names_what_nobody_noticed() -> None:
    whats, refuted = ("ω₀₁ high", "ω₀₂ high"), {"table-5-P2": Outcome.REFUTED}
    quick, default = [{}, refuted], [{"table-5-P3": Outcome.REFUTED}, refuted]
    powers = [(3e-5, "rough-wall", "table-5-P3"), (4e-6, "reference", "table-5-P3"), (1e-6, "wake", "table-5-P3")]
    levels = [
        trial.Judged(name, [*map(trial.Trial, whats, noticed)], {"omega_01": powers})
        for name, noticed in (("quick", quick), ("default", default))
    ]
    page = trial.page(levels, [trial.Trial("no drag", refuted)])
    assert "## Wrong theories, 2: noticed 1 at quick, 2 at default" in page
    assert "| ω₀₁ high | **nobody** | table-5-P3 |" in page
    assert "| ω₀₂ high | table-5-P2 | table-5-P2 |" in page
    assert "## Wrong engines, 1: noticed 1 at quick" in page
    numbers = "3e-05 | 4e-06 | 67%"
    assert f"| ω₀₁ | 0.0001 | {numbers} | {numbers} | rough-wall, table-5-P3 |" in page
