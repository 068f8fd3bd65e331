"""Sources are read at a glance: functions as long as their thought, and no class or constant of two
meanings.

A function has no more than 75 lines beside the docstring, and six parameters. Exceptions are named,
each with the reason for which it is one; a name that is none any more is to be taken out."""

import ast
import functools
from collections import Counter
from pathlib import Path

LINES, PARAMETERS, LOCALS = 75, 6, 20
ROOT = Path(__file__).parents[1]
EXCEPTIONS = {
    # calls of users, whose options have names and defaults
    *("analytic/simulation/ensemble.py:simulate_many", "analytic/simulation/simulator.py:simulate"),
    *("mjsim/engine.py:__init__", "mjsim/engine.py:simulate", "mjsim/engine.py:simulate_many"),
    "compare/validation.py:validate",
    *("analytic/flowmeter/design.py:best", "mjsim/coulomb/coulomb.py:__init__"),
    # compiled by numba, which takes numbers and arrays, and formulas in the form that is compiled
    "analytic/simulation/equations.py:forces",
    "analytic/simulation/solvers.py:_root",
    "analytic/simulation/solvers.py:_interpolant",
    "analytic/simulation/solvers.py:_first_fall",
    "analytic/simulation/solvers.py:explicit_steps",
    *(f"analytic/mechanics/contact_problem.py:{name}" for name in ("_implicit_step", "solve_pair")),
    "mjsim/mid_step.py:mid_step_forces",
    # what an exact case is made of
    "compare/bench/closed_forms.py:closed_form",
}
SAME = {
    # what every subject, file format, adapter or page has
    *"CAPTION CLAIMS DEFAULTS FIGURES PROTOCOL PROTOCOLS SCHEMA SCHEMA_VERSION SECTIONS".split(),
    *"Scene Settings best defaults free".split(),
    # the same, with another value: degrees of polynomials, records, random numbers, units and
    # symbols of other names
    *"DEGREES EPS FEWEST G LEAST LISTED PUSH RTOL SEED SET SKIPPED STARTS".split(),
    *"STEPS SYMBOLS T UNITS".split(),
}
"""Names of which a package may have several."""


@functools.cache
def packages():
    """The modules of each package by their files, parsed."""
    return [
        {
            path.relative_to(ROOT): ast.parse(path.read_text("utf-8"))
            for path in (ROOT / package).rglob("*.py")
        }
        for package in ("model", "analytic", "mjsim", "compare")
    ]


def test_functions_have_no_more_lines_and_parameters_than_a_reader_keeps_in_mind():
    large = set()
    for path, tree in (each for trees in packages() for each in trees.items()):
        for node in (each for each in ast.walk(tree) if isinstance(each, ast.FunctionDef)):
            lines = node.end_lineno - node.lineno + 1
            if ast.get_docstring(node):
                lines -= node.body[0].end_lineno - node.body[0].lineno + 1
            given = node.args
            names = {each.arg for each in given.posonlyargs + given.args + given.kwonlyargs}
            if lines > LINES or len(names - {"self", "cls"}) > PARAMETERS:
                large.add(f"{path.as_posix()}:{node.name}")
    assert large == EXCEPTIONS


def test_functions_of_the_law_have_few_locals():
    for path in (ROOT / "mjsim/coulomb").glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.FunctionDef):
                named = (each for each in ast.walk(node) if isinstance(each, ast.Name))
                own = {each.id for each in named if isinstance(each.ctx, ast.Store)}
                own -= {each.arg for each in node.args.args}
                assert len(own) <= LOCALS, f"{path.name}: {node.name}"


def test_names_have_one_meaning_in_a_package():
    for trees in packages():
        defined = Counter()
        for tree in trees.values():
            targets = [
                each for node in tree.body if isinstance(node, ast.Assign) for each in node.targets
            ]
            targets += [node.target for node in tree.body if isinstance(node, ast.AnnAssign)]
            parts = [
                each
                for target in targets
                for each in ast.walk(target)
                if isinstance(each, ast.Name)
            ]
            names = {each.id for each in parts if isinstance(each.ctx, ast.Store)}
            defined.update(
                names | {node.name for node in tree.body if isinstance(node, ast.ClassDef)}
            )
        several = {name for name, count in defined.items() if count > 1 and name[0] != "_"}
        assert several - SAME == set()
