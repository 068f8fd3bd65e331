"""Errors of the paper that docs/errata.md lists and no other test shows; what documents point to is
there."""

import re
from pathlib import Path

import numpy as np
import pytest

from analytic import contact_forces, thresholds, vector_field
from model import Case, Parameters

P = Parameters.named("reference").replace(omega_0=17.0, mu=0.3, eta=0.45)
STEEL = {"nu_f": 1.004e-6, "rho_f": 998.2, "rho_b": 7850.0, "R": 0.025, "mu": 0.2, "eta": 0.2}
"""In water."""


def test_section_1_1():
    """In a fluid at rest a ball may spin on the spot away from the wall: nothing moves, and the
    floor alone presses."""
    x = [0.0, 0.0, 0.0, 0.0, 30.0, 0.0, 0.02, 0.0]
    still = P.replace(omega_0=0.0)
    np.testing.assert_array_equal(vector_field(Case.RN, x, still), np.zeros(8))
    F_A, F_B = contact_forces(Case.RN, x, still)
    np.testing.assert_array_equal([F_A, F_B], [[0.0, P.m * P.g, 0.0], [0.0] * 3])


def test_section_1_3():
    """Steel in water by (10)."""
    assert Parameters.from_fluid(r=2e-3, **STEEL).c == pytest.approx(0.144, abs=1e-3)
    assert Parameters.from_fluid(r=7.5e-3, **STEEL).c == pytest.approx(1e-2, rel=0.03)


def test_section_5_1():
    """eta_cr mu^2 = c^2 R/(4 g) isn't below 1e-6, and eta_cr may be above eta."""
    steel = Parameters.named("steel-in-water")
    small = Parameters.from_fluid(r=2e-3, **STEEL)
    plastic = Parameters.named("plastic-in-oil")
    values = [thresholds(p).eta_cr * p.mu**2 for p in (steel, small, plastic)]
    assert values == pytest.approx([3.9e-7, 1.5e-5, 2.0e-2], rel=0.03)
    assert thresholds(plastic).eta_cr > 0.87 > plastic.eta


def test_equation_40():
    """Where cos alpha < 0 the spin can't be steady about both the radius and the tangent: (45),
    rows 4 and 5."""
    for omega_c in np.geomspace(0.5, 60.0, 15):
        for alpha in np.linspace(0.5 * np.pi, 1.5 * np.pi, 99)[1:-1]:
            unit = [0.0, 0.0, omega_c, np.sin(alpha), 0.0, np.cos(alpha), 0.0, 0.0]
            # they depend on the directions of slip alone
            F_A, F_B = contact_forces(Case.SS, unit, P)
            slip_z = -F_A[2] / (P.j * P.m * P.r * omega_c)
            size = slip_z / np.cos(alpha)
            if F_A[1] >= 0 and F_B[0] >= 0 and size > 0:
                turning = P.R / P.r * omega_c**2 + omega_c * size * np.sin(alpha)
                assert turning + (F_A[0] - F_B[1]) / (P.j * P.m * P.r) > 0


@pytest.mark.parametrize("document", ["errata.md", "theory.md"])
def test_documents_name_what_exists(document):
    """Every test, function and module the documents point to is there."""
    root = Path(__file__).parents[2]
    text = (root / "docs" / document).read_text("utf-8")
    folders = "analytic", "compare", "docs", "mjsim", "model", "tests"  # not what is installed here
    paths = [path for folder in folders for path in (root / folder).rglob("*.py")]
    sources = {path: path.read_text("utf-8") for path in paths}
    for path in re.findall(r"\]\(\.\./([\w/]+\.py)\)", text):
        assert (root / path).exists(), path
    everything = "\n".join(sources.values())
    for name in re.findall(r"`(test_\w+)`", text):
        assert f"def {name}(" in everything, name
    for module, name in re.findall(r"`(\w+)\.(?!py`)(\w+)`", text):
        source = next(
            (
                s
                for path, s in sources.items()
                if path.name == f"{module}.py" and path.relative_to(root).parts[0] != "tests"
            ),
            "",
        )
        assert re.search(rf"^(def |class )?{name}\b", source, re.MULTILINE), f"{module}.{name}"
