"""Functions stay as long as their thought: no more than 60 lines beside the docstring, and six parameters.

The exceptions are named, each with the reason for which it is one; a name that is none any more is to be taken out.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

LINES, PARAMETERS = 60, 6
PACKAGES = "model", "analytic", "mjsim", "compare"
ROOT = Path(__file__).parents[1]


def functions(package: str) -> Iterator[tuple[str, int, int]]:
    """Every function of a package by file and name: its lines beside the docstring, its named parameters."""
    for path in sorted((ROOT / package).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.FunctionDef):
                document = node.body[0] if ast.get_docstring(node) else None
                own = (document.end_lineno or 0) - document.lineno + 1 if document else 0
                names = {each.arg for each in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)}
                lines = (node.end_lineno or 0) - node.lineno + 1 - own
                yield f"{path.relative_to(ROOT).as_posix()}:{node.name}", lines, len(names - {"self", "cls"})


EXCEPTIONS = {
    # doors for users, whose options have names and defaults
    *("analytic/simulation/ensemble.py:simulate_many", "analytic/simulation/simulator.py:simulate"),
    *("mjsim/engine.py:__init__", "mjsim/engine.py:simulate", "mjsim/engine.py:simulate_many"),
    *("compare/validation.py:validate", "compare/view/render.py:write"),
    # compiled by numba, which takes numbers and arrays, and formulas in the form that is compiled
    *("analytic/simulation/equations.py:forces", "analytic/simulation/equations.py:straight"),
    *(f"analytic/simulation/solvers.py:{name}" for name in ("_root", "_dense", "_first_fall", "_explicit")),
    *(f"analytic/simulation/solvers.py:{name}" for name in ("_extrapolated", "_implicit", "stretch")),
    *(f"analytic/mechanics/contact_problem.py:{name}" for name in ("_continued", "both")),
    *("mjsim/compiled.py:drive", "mjsim/stepping.py:drive", "mjsim/landing.py:through"),
    *("mjsim/coulomb/compiled.py:_holds", "mjsim/coulomb/compiled.py:_put_back", "mjsim/corrections.py:corrections"),
    "mjsim/world_axes.py:driven",
    # what an exact case is made of
    "compare/bench/one_contact.py:closed",
    # all that a run of an engine, a batch, a measured number, a drawn line or a page is made of
    *("compare/adapters/vessel.py:simulate", "mjsim/stepping.py:__init__"),
    *("compare/kit/record.py:measurement", "compare/kit/style.py:curve", "compare/branches.py:going_round"),
}


@pytest.mark.parametrize("package", PACKAGES)
def test_functions_have_no_more_lines_and_parameters_than_a_reader_keeps_in_mind(package):
    longest = {name: (lines, named) for name, lines, named in functions(package) if lines > LINES or named > PARAMETERS}
    assert {name: found for name, found in longest.items() if name not in EXCEPTIONS} == {}


def test_what_is_excepted_needs_to_be():
    found = {
        name for package in PACKAGES for name, *size in functions(package) if size[0] > LINES or size[1] > PARAMETERS
    }
    assert EXCEPTIONS - found == set()
