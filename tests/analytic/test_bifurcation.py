"""Solutions come and go at the thresholds, whose curves meet where double points say they do."""

from collections import Counter

import numpy as np
import pytest

from analytic import stationary_solutions, thresholds
from analytic.bifurcation import diagram
from analytic.bifurcation.diagram import double_points, threshold_curves
from model import Parameters

P = Parameters.named("reference")
EPS = np.finfo(float).eps


def test_thresholds_that_do_not_exist():
    """Their values elsewhere claims hold."""

    def missing(**change):
        of = vars(thresholds(P.replace(**change)))
        return {name for name, value in of.items() if np.isnan(value)}

    assert missing() == set()
    assert missing(eta=0.6) == {"omega_01", "omega_04"}
    assert missing(eta=0.0) == {"omega_02", "omega_04"}
    # the first is below eta_cr
    assert missing(eta=0.02) == missing(c=0.0) == missing(mu=0.0) == {"omega_04"}
    assert missing(mu=0.0, c=0.0) == {"omega_04", "eta_cr"}
    assert thresholds(P.replace(mu=0.0)).omega_01 == 0
    assert thresholds(P.replace(mu=0.0)).eta_cr == np.inf
    assert thresholds(P.replace(c=0.0)).eta_cr == 0
    critical = thresholds(P.replace(c=diagram.critical_drag(P)))
    assert critical.eta_cr == pytest.approx(P.eta, rel=8 * EPS)
    assert diagram.critical_drag(P.replace(drag="quadratic", nu_f=1e-5)) == np.inf


@pytest.mark.parametrize(
    ("eta", "name", "changes"),
    [
        (0.2, "omega_01", {"RR": -1, "SS": 1}),
        (0.2, "omega_02", {"SS": 1, "SR": 1, "NR": 1, "NS": -1}),
        (0.2, "omega_04", {"SS": -2}),
        (0.02, "omega_02", {"SS": -1, "SR": 1, "NR": 1, "NS": -1}),
        (0.6, "omega_02", {"SR": 1, "NR": 1, "NS": -1}),
        (0.6, "omega_03", {"RR": -1}),
    ],
)
def test_solutions_appear_and_vanish_at_the_thresholds(eta, name, changes):
    """Their number changes exactly there: relative 1e-9 on either side."""
    p = P.replace(eta=eta)
    flows = getattr(thresholds(p), name) * np.array([1 - 1e-9, 1 + 1e-9])
    either = (stationary_solutions(p.replace(omega_0=flow)) for flow in flows.tolist())
    below, above = (Counter(s.case.name for s in solutions if s.exists) for solutions in either)
    above.subtract(below)
    assert {case: number for case, number in above.items() if number} == changes


@pytest.mark.parametrize("law", ["stokes", "quadratic"])
@pytest.mark.parametrize("equal", [False, True])
def test_double_points(equal, law):
    """There the curves that are said to meet do meet; under the quadratic law the fold is never
    born."""
    p = P.replace(drag=law, nu_f=1e-5)
    points = double_points(p, equal)
    assert len(points) == (2 if law == "stokes" else 1)
    for point in points:
        eta = point.eta * np.array([1 + 1e-8, 1 - 1e-8])
        curves = threshold_curves(p, eta if equal else p.mu, eta)
        for name in point.meets:  # some of them begin or end there
            assert np.nanmax(np.abs(curves[name] * np.sqrt(P.g / P.R) / point.omega_0 - 1)) <= 1e-6


def test_the_fluid_that_comes_along_slows_the_answer():
    """Forces along the orbit on a ball that rolls at both points, with half the displaced mass
    added to its own."""
    p = Parameters.named("steel-in-water").replace(density_ratio=0.4)
    # m (1 + s/2) R w' = A_z + B_z + push, j m R w' = -A_z, j m R w' = -B_z
    jm, masses = p.j * p.m * p.R, (p.m * (1 + p.density_ratio / 2) * p.R, p.m * p.R)
    balances = ([[mass, -1, -1], [jm, 1, 0], [jm, 0, 1]] for mass in masses)
    rate, without = (np.linalg.solve(each, [1.0, 0, 0])[0] for each in balances)
    assert diagram.inertia_shifts(p)["rolling_rate"] == pytest.approx(rate / without - 1, rel=1e-12)
