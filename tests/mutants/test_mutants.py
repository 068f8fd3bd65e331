"""Wrong theories are believed everywhere for a while, and forgotten without a trace."""

import ast
import contextlib
import csv
import dataclasses
import importlib
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import analytic
from analytic.stationary import solutions as stationary
from compare.campaign.campaign import Campaign
from compare.engines.adapters.free import Library
from compare.engines.study import ENGINES, MUJOCO
from compare.figures import pages
from compare.method.runner import Runner
from compare.plan import Level
from compare.subjects.stationary import claims
from compare.verification.claim import Outcome
from docs.studies import mutants
from model import Case, Parameters
from tests.mutants import blind, formulas, trial
from tests.mutants.engines import WRONG_ENGINES
from tests.mutants.exchange import believed, noting
from tests.mutants.theories import FOR_TESTS, THEORIES

P = Parameters.named("reference").replace(omega_0=25.0)


def test_each_replaces_a_function_that_exists_and_gives_it_back() -> None:
    """Also where its believer breaks down."""
    assert len({wrong.what for wrong in (*THEORIES, *FOR_TESTS)}) == len(THEORIES) + len(FOR_TESTS)
    for wrong in (*THEORIES, *FOR_TESTS):
        module = importlib.import_module(wrong.module)
        right = getattr(module, wrong.function)
        with contextlib.suppress(ZeroDivisionError), believed(wrong):
            assert getattr(module, wrong.function) is not right, wrong.what
            raise ZeroDivisionError
        assert getattr(module, wrong.function) is right, wrong.what


@pytest.mark.parametrize("what", ["flight with 5 % more drag", "flight with 1 % less weight"])
def test_a_motion_under_a_wrong_theory_is_wrong_and_does_not_break_down(what):
    """Then a verdict would be lost by an error, whatever was measured."""
    wrong, up = next(each for each in THEORIES if each.what == what), [0.03, 0, 9, 0, 0, 0, 0.03, 0]
    right = analytic.simulate(P, up, 0.02)
    with believed(wrong):
        other = analytic.simulate(P, up, 0.02)
    assert 1e-5 < np.abs(other.x[-1] - right.x[-1]).max() < 1


def test_a_function_that_is_noted_answers_as_before() -> None:
    """Wherever it is called: a claim that doesn't call it can't notice its faults, and isn't judged
    by them."""
    seen, noted = set(), next(each for each in THEORIES if each.function == "stationary_solutions")
    with believed(dataclasses.replace(noted, wrong=noting("it", seen)), THEORIES[0]):
        found = claims.analytic.stationary_solutions(P)
    assert seen == {"it"}
    assert [s.case for s in found] == [s.case for s in stationary.stationary_solutions(P)]


@pytest.mark.parametrize("wrong", WRONG_ENGINES, ids=lambda wrong: wrong.name)
def test_a_wrong_engine_moves_otherwise_and_does_not_say_so(wrong, tmp_path, monkeypatch):
    monkeypatch.setattr("compare.engines.study.ENGINES", dict(ENGINES) | {wrong.name: wrong})
    start, runs = [0.02, 0.0, 14.0, -1.0, 2.0, 7.0, 0.0, 0.0], {}
    with Campaign(tmp_path, workers=0) as campaign:
        for engine in (MUJOCO, wrong):
            runner = Runner(campaign, engine, Level.QUICK)
            (runs[engine.name],) = runner.campaign.run([runner.task(P, start, 0.4, 4e-3)])
    right, other = runs[MUJOCO.name], runs[wrong.name]
    assert other.header.parameters == right.header.parameters == P
    assert np.abs(other.x - right.x).max() > 1e-6


def test_the_list_has_a_row_for_each_fault_and_names_tests_that_there_are(tmp_path):
    trials = [trial.Trial(wrong.what, {"prop-1": Outcome.REFUTED}) for wrong in THEORIES]
    tried = {"quick": [*trials[1:], trial.Trial("nobody's", {})]}
    mutants.write(tmp_path / "page.md", tried, [trial.Trial("crooked", {})])
    page = (tmp_path / "page.md").read_text("utf-8")
    assert f"| theories, by quick | {len(THEORIES)} | {len(THEORIES) - 1} | 0 | 0 | 1 |" in page
    assert "| engines, measured anew | 1 | 0 | 0 | 0 | 1 |" in page
    with (tmp_path / "page.csv").open(encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    assert {len(row) for row in rows} == {len(head)}
    assert len(rows) == len(THEORIES) + len(FOR_TESTS) + len(mutants.BY_HAND) + 1
    assert rows[-1] == ["engine", "crooked", "mjsim", "nobody", ""]
    seen_by = (f"analytic/test_{wrong.test}" for wrong in FOR_TESTS)
    for named in (*mutants.BY_HAND.values(), *seen_by):
        file, _, test = named.partition("::")
        text = (Path(__file__).parents[1] / f"{file}.py").read_text("utf-8")
        assert f"def {test}(" in text, named


@pytest.mark.slow
@pytest.mark.parametrize("wrong", FOR_TESTS, ids=lambda wrong: wrong.what)
def test_what_no_measurement_shows_a_unit_test_sees(wrong, tmp_path):
    """In a process of its own, which believes it before the test is imported."""
    file, _, test = wrong.test.partition("::")
    (tmp_path / "believing.py").write_text(
        "from tests.mutants.exchange import believed\nfrom tests.mutants.theories import "
        "FOR_TESTS\n"
        f"belief = believed(next(w for w in FOR_TESTS if w.what == {wrong.what!r}))\n"
        "def pytest_configure(config): belief.__enter__()\n"
    )
    root = Path(__file__).parents[2]
    words = f"-p believing -n0 -xq -p no:cacheprovider tests/analytic/test_{file}.py -k {test}"
    where = {**os.environ, "PYTHONPATH": f"{root}{os.pathsep}{tmp_path}"}
    line = [sys.executable, "-m", "pytest", *words.split()]
    done = subprocess.run(line, cwd=root, env=where, capture_output=True, text=True)
    assert "1 failed" in done.stdout, done.stdout


def test_a_round_is_played_by_a_seed(tmp_path, monkeypatch):
    """One set, one protocol, and faults in what its claims call; the key is kept beside it. Of the
    engines that are asked beside MuJoCo one is there, and the page says so."""
    there = dataclasses.replace(MUJOCO, name="siconos", divisors=(1, 2, 4))
    absent = dataclasses.replace(
        ENGINES["drake"], needs=Library("no-such-library", "compare.engines.adapters.drake")
    )
    monkeypatch.setitem(ENGINES, "siconos", there)
    monkeypatch.setitem(ENGINES, "drake", absent)
    monkeypatch.setattr(blind, "BY", (MUJOCO,))
    said = blind.play(1, tmp_path, theories=3, engines=0, protocols=("field",))
    key = json.loads((tmp_path / blind.KEY).read_text("utf-8"))
    assert len(key) == 3
    assert all(f"| `{what}` | " in said for what in key)
    assert "| mujoco | " in said
    assert "| siconos | " in said
    assert "Measured by mujoco, siconos; not installed: drake." in said
    assert " | none | " in said  # false alarms


def test_the_page_of_blind_rounds_counts_its_rows():
    page = blind.PAGE.read_text("utf-8")
    table = blind.rounds(page)
    assert pages.markdown(table) in page
    assert len(table) == page.count("\n## Seed ") + 2
    assert blind.rounds("\n## Seed 7\n\n| `a → b` | – | x |  |\n")[1] == ["7", "1", "0", "0", "1"]


def _formula(p):
    return {"number": (p.mu + 2.0) * p.r**2, "case": Case.SS}


@pytest.mark.parametrize("kind", formulas.KINDS)
def test_faults_are_made_of_formulas(kind):
    """A fault changes what it is about, and nothing else."""
    p = P.replace(eta=0.3)
    rng, nodes = np.random.default_rng(0), list(ast.walk(formulas.tree(_formula)))
    places = [n for n, node in enumerate(nodes) if formulas.faulty(kind, node, rng)]
    assert len(places) == (2 if kind == "argument" else 1)
    for place in places:
        wrong = formulas.wrong_theory(_formula, kind, place, rng).wrong(_formula, p)
        right = _formula(p)
        about = "case" if kind == "case" else "number"
        assert {name for name in right if wrong[name] != right[name]} == {about}
