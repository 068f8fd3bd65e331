"""No class or constant has two meanings in a package."""

import ast
from collections import Counter
from pathlib import Path

import pytest

SAME = {
    # what every subject, file format, adapter or page has
    *(
        "CAPTION",
        "CLAIMS",
        "DEFAULTS",
        "FIGURES",
        "PROTOCOL",
        "PROTOCOLS",
        "SCHEMA",
        "SCHEMA_VERSION",
        "SECTIONS",
        "TEXT",
    ),
    *("Scene", "Settings", "best", "defaults", "free"),
    "TEXT",  # what is compiled
    "Simulation",  # under Coulomb's law, compiled and as formulas
    # the same, with another value: degrees of polynomials, records, random numbers, units and symbols of other names
    *("DEGREES", "EPS", "FEWEST", "G", "LEAST", "LISTED", "PATIENCE", "PUSH", "REFINED", "RTOL", "SEED", "SET"),
    "SKIPPED",
    *("STARTS", "STEPS", "SYMBOLS", "T", "UNITS"),
}


@pytest.mark.parametrize("package", ["model", "analytic", "mjsim", "compare"])
def test_names_have_one_meaning_in_a_package(package):
    defined = Counter()
    for path in (Path(__file__).parent.parent / package).rglob("*.py"):
        found = set()
        for node in ast.parse(path.read_text()).body:
            targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
            names = [each for target in targets if target for each in ast.walk(target) if isinstance(each, ast.Name)]
            found |= {each.id for each in names if isinstance(each.ctx, ast.Store)}
            found |= {node.name} if isinstance(node, ast.ClassDef) else set()
        defined.update(name for name in found if not name.startswith("_"))
    assert [name for name, count in defined.items() if count > 1 and name not in SAME] == []
