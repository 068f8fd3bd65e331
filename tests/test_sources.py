"""Sources are read at a glance: functions as long as their thought, and no class or constant of two meanings.

A function has no more than 60 lines beside the docstring, and six parameters. Exceptions are named, each with the
reason for which it is one; a name that is none any more is to be taken out.
"""

from __future__ import annotations

import ast
from collections import Counter
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

LINES, PARAMETERS = 60, 6
ROOT = Path(__file__).parents[1]
PACKAGES = "model", "analytic", "mjsim", "compare"


@cache
def trees(package: str) -> dict[str, ast.Module]:
    """The modules of a package by their files, parsed."""
    paths = sorted((ROOT / package).rglob("*.py"))
    return {path.relative_to(ROOT).as_posix(): ast.parse(path.read_text("utf-8")) for path in paths}


def functions() -> Iterator[tuple[str, int, int]]:
    """Every function by file and name: its lines beside the docstring, its named parameters."""
    for path, tree in (each for package in PACKAGES for each in trees(package).items()):
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef):
                document = node.body[0] if ast.get_docstring(node) else None
                own = (document.end_lineno or 0) - document.lineno + 1 if document else 0
                names = {each.arg for each in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)}
                lines = (node.end_lineno or 0) - node.lineno + 1 - own
                yield f"{path}:{node.name}", lines, len(names - {"self", "cls"})


EXCEPTIONS = {
    # doors for users, whose options have names and defaults
    *("analytic/simulation/ensemble.py:simulate_many", "analytic/simulation/simulator.py:simulate"),
    *("mjsim/engine.py:__init__", "mjsim/engine.py:simulate", "mjsim/engine.py:simulate_many"),
    *("compare/validation.py:validate", "compare/view/render.py:write"),
    # compiled by numba, which takes numbers and arrays, and formulas in the form that is compiled
    *("analytic/simulation/equations.py:forces", "analytic/simulation/equations.py:is_straight"),
    *(f"analytic/simulation/solvers.py:{name}" for name in ("_root", "_interpolant", "_first_fall")),
    *(f"analytic/simulation/solvers.py:_{name}" for name in ("extrapolation_step", "explicit_steps", "implicit_steps")),
    *(f"analytic/mechanics/contact_problem.py:{name}" for name in ("_implicit_step", "solve_pair")),
    *("mjsim/corrections.py:corrections", "mjsim/landing.py:through"),
    *(f"mjsim/coulomb/compiled.py:{name}" for name in ("_hand_on", "_holds", "_put_back")),
    "mjsim/world_axes.py:driven",
    # what an exact case is made of
    "compare/bench/one_contact.py:closed_form",
    # all that a measured number is made of
    "compare/kit/record.py:measurement",
}
SAME = {
    # what every subject, file format, adapter or page has
    *("CAPTION", "CLAIMS", "DEFAULTS", "FIGURES", "PROTOCOL", "PROTOCOLS", "SCHEMA", "SCHEMA_VERSION", "SECTIONS"),
    *("Scene", "Settings", "best", "defaults", "free"),
    "TEXT",  # what is compiled
    # the same, with another value: degrees of polynomials, records, random numbers, units and symbols of other names
    *("DEGREES", "EPS", "FEWEST", "G", "LEAST", "LISTED", "PATIENCE", "PUSH", "REFINED", "RTOL", "SEED", "SET"),
    *("SKIPPED", "STARTS", "STEPS", "SYMBOLS", "T", "UNITS"),
}
"""Names of which a package may have several."""


def test_functions_have_no_more_lines_and_parameters_than_a_reader_keeps_in_mind():
    longest = {name: size for name, *size in functions() if size[0] > LINES or size[1] > PARAMETERS}
    assert {name: size for name, size in longest.items() if name not in EXCEPTIONS} == {}
    assert EXCEPTIONS - longest.keys() == set()


@pytest.mark.parametrize("package", PACKAGES)
def test_names_have_one_meaning_in_a_package(package):
    defined = Counter()
    for tree in trees(package).values():
        found = set()
        for node in tree.body:
            targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
            names = [each for target in targets if target for each in ast.walk(target) if isinstance(each, ast.Name)]
            found |= {each.id for each in names if isinstance(each.ctx, ast.Store)}
            found |= {node.name} if isinstance(node, ast.ClassDef) else set()
        defined.update(name for name in found if not name.startswith("_"))
    assert [name for name, count in defined.items() if count > 1 and name not in SAME] == []
