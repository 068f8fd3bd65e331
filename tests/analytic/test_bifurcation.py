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
        t = thresholds(P.replace(**change))
        return {
            n
            for n in ("omega_01", "omega_02", "omega_03", "omega_04", "eta_cr")
            if np.isnan(getattr(t, n))
        }

    assert missing() == set()
    assert missing(eta=0.6) == {"omega_01", "omega_04"}
    assert missing(eta=0.0) == {"omega_02", "omega_04"}
    # the first is below eta_cr
    assert missing(eta=0.02) == missing(c=0.0) == missing(mu=0.0) == {"omega_04"}
    assert missing(mu=0.0, c=0.0) == {"omega_04", "eta_cr"}
    assert thresholds(P.replace(mu=0.0)).omega_01 == 0
    assert thresholds(P.replace(mu=0.0)).eta_cr == np.inf
    assert thresholds(P.replace(c=0.0)).eta_cr == 0
    assert thresholds(P.replace(c=diagram.critical_drag(P))).eta_cr == pytest.approx(
        P.eta, rel=8 * EPS
    )
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
    below, above = (
        Counter(
            s.case.name for s in stationary_solutions(p.replace(omega_0=float(flow))) if s.exists
        )
        for flow in flows
    )
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
    m, jm = p.m * (1 + p.density_ratio / 2) * p.R, p.j * p.m * p.R
    rate, without = (
        np.linalg.solve([[mass, -1, -1], [jm, 1, 0], [jm, 0, 1]], [1.0, 0, 0])[0]
        for mass in (m, p.m * p.R)
    )
    assert diagram.inertia_shifts(p)["rolling_rate"] == pytest.approx(rate / without - 1, rel=1e-12)
