"""Thresholds, fold and the maps of Figs. 7 and 8 are where solutions come and go, to all digits."""

import numpy as np
import pytest
import sympy as sp

from analytic import stationary_solutions, thresholds
from analytic.bifurcation import diagram
from analytic.bifurcation.diagram import Exists, case_map, double_points, number_of_folds, threshold_curves
from analytic.stationary import slipping_branch as sb
from model import Case, InputError, Parameters

P = Parameters.named("reference")
EPS = np.finfo(float).eps
KAPPAS = [1e-6, 1e-3, 0.07, 1.0, 30.0]


def groups(mu, eta, kappa):
    return P.replace(mu=mu, eta=eta, c=kappa * np.sqrt(P.g / P.R))


CASES = [
    (mu, eta, kappa)
    for kappa in KAPPAS
    for mu in (0.05, 0.2, 1.0)
    for eta in (0.01, 0.2, 0.39, 0.4 * (1 - 1e-9))
    if eta > kappa**2 / (4 * mu**2)
]


@pytest.mark.parametrize(("mu", "eta", "kappa"), CASES)
def test_the_fold_is_where_the_flow_is_greatest_to_all_digits(mu, eta, kappa):
    """Of (41) with 50 digits: its greatest value is omega_04, and its slope says that the maximum is there."""
    p, near = groups(mu, eta, kappa), [sp.Rational(k, 10**5) for k in (-1, 0, 1)]
    J, M, E, K = (sp.Rational(v) for v in (p.j, p.mu, p.eta, p.kappa))

    def flow(s):
        cos, sin = 1 / sp.sqrt(1 + sp.exp(2 * s)), -1 / sp.sqrt(1 + sp.exp(-2 * s))
        den = (1 + J * cos**2) * M * E + (J - E) * cos
        return (sp.sqrt(M * (1 + E * cos**2) / den) - M / K * cos * sin * (J - E) / den).evalf(50)

    before, here, after = (flow(sp.Float(float(sb.fold(p)), 50) + d) for d in near)
    assert abs(thresholds(p).omega_04 / np.sqrt(p.g / p.R) / float(here) - 1) <= 1e-12
    # The slope of the flow over its curvature is how far the maximum is away.
    assert abs((after - before) / (after - 2 * here + before) / 2) * near[2] <= 1e-10


def test_order_and_existence_of_the_thresholds():
    for p in map(Parameters.named, Parameters.names()):
        t = thresholds(p)
        if p.eta < p.j:
            assert t.omega_01 < t.omega_02
            assert np.isnan(t.omega_04) or t.omega_04 > t.omega_02
        else:
            assert np.isnan(t.omega_01)
            assert t.omega_02 < t.omega_03
        assert t.eta_cr == pytest.approx(p.c**2 * p.R / (4 * p.g * p.mu**2), rel=8 * EPS)

    def missing(**change):
        t = thresholds(P.replace(**change))
        return {n for n in ("omega_01", "omega_02", "omega_03", "omega_04", "eta_cr") if np.isnan(getattr(t, n))}

    assert missing() == set()
    assert missing(eta=0.6) == {"omega_01", "omega_04"}
    assert missing(eta=0.0) == {"omega_02", "omega_04"}
    assert missing(eta=0.02) == missing(c=0.0) == missing(mu=0.0) == {"omega_04"}  # the first is below eta_cr
    assert missing(mu=0.0, c=0.0) == {"omega_04", "eta_cr"}
    assert thresholds(P.replace(mu=0.0)).omega_01 == 0
    assert thresholds(P.replace(mu=0.0)).eta_cr == np.inf
    assert thresholds(P.replace(c=0.0)).eta_cr == 0
    assert thresholds(P.replace(c=diagram.critical_drag(P))).eta_cr == pytest.approx(P.eta, rel=8 * EPS)
    assert diagram.critical_drag(P.replace(drag="quadratic", nu_f=1e-5)) == np.inf


@pytest.mark.parametrize(
    ("eta", "changes"),
    [
        (
            0.2,
            {
                "omega_01": {"RR": -1, "SS": 1},
                "omega_02": {"SS": 1, "SR": 1, "NR": 1, "NS": -1},
                "omega_04": {"SS": -2},
            },
        ),
        (0.02, {"omega_01": {"RR": -1, "SS": 1}, "omega_02": {"SS": -1, "SR": 1, "NR": 1, "NS": -1}}),
        (0.6, {"omega_02": {"SR": 1, "NR": 1, "NS": -1}, "omega_03": {"RR": -1}}),
    ],
)
def test_solutions_appear_and_vanish_at_the_thresholds(eta, changes):
    """The number of solutions that exist changes exactly at the special points (relative 1e-9 on either side)."""
    p = P.replace(eta=eta)
    for name, expected in changes.items():
        low, high = (
            [s.case for s in stationary_solutions(p.replace(omega_0=getattr(thresholds(p), name) * side)) if s.exists]
            for side in (1 - 1e-9, 1 + 1e-9)
        )
        change = {case.name: high.count(case) - low.count(case) for case in Case}
        assert {case: number for case, number in change.items() if number} == expected


def test_the_branch_is_asked_for_where_there_is_one():
    for change in ({"eta": 0.6}, {"eta": 0.0}, {"mu": 0.0}, {"c": 0.0}):
        with pytest.raises(InputError, match="SS has a branch from RR to SR for"):
            number_of_folds(P.replace(**change))


@pytest.mark.parametrize("law", ["stokes", "quadratic"])
@pytest.mark.parametrize("equal", [False, True])
def test_double_points(equal, law):
    """There the curves that are said to meet do meet; under the quadratic law the fold is never born."""
    p = P.replace(drag=law, nu_f=1e-5)
    points = double_points(p, equal)
    assert len(points) == (2 if law == "stokes" else 1)
    for point in points:
        eta = point.eta * np.array([1 + 1e-8, 1 - 1e-8])
        curves = threshold_curves(p, eta if equal else p.mu, eta)
        for name in point.meets:  # some of them begin or end there
            assert np.nanmax(np.abs(curves[name] * np.sqrt(P.g / P.R) / point.omega_0 - 1)) <= 1e-6


@pytest.mark.parametrize("mu", [0.2, None])
def test_map_against_the_solutions(mu):
    """A coarse map agrees with `stationary_solutions` at every point (None: mu = eta, Fig. 8)."""
    eta, omega_0 = np.linspace(0.0, 0.7, 8), np.linspace(-60.0, 60.0, 13)
    plane = case_map(P, eta if mu is None else mu, eta, omega_0)
    assert plane.shape == (8, 13)
    wrong = []
    for row, e in zip(plane, eta, strict=True):
        for flags, w in zip(row, omega_0, strict=True):
            p = P.replace(eta=float(e), mu=float(e) if mu is None else mu, omega_0=float(w))
            solved = Exists(0)
            for s in stationary_solutions(p):
                if s.exists and s.case is not Case.RS and not (p.mu == 0 and s.case in (Case.SR, Case.SS)):
                    solved |= Exists.SS_BEYOND_FOLD if s.case is Case.SS and not s.stable else Exists[s.case.name]
            if solved != Exists(int(flags)):
                wrong.append((e, w, solved, Exists(int(flags))))
    assert not wrong


# --- the fluid's inertia against the balance of forces and moments of a ball in a swirl ----------------------


BALL, RATIOS = Parameters.named("steel-in-water"), [0.0, 0.127, 0.4, 0.7]


def rolls(p, omega):
    """Whether some free force B_y puts the forces on a ball that rolls round with the fluid into both cones.

    Newton with the pressure gradient of the swirl, 3/2 of the displaced mass times its centripetal acceleration, and
    with half the displaced mass added to the ball's; Euler without either.
    """
    s, centripetal, B_y = p.density_ratio, p.R * omega**2, np.linspace(0.0, p.m * p.g, 200_001)
    A_y, A_x = p.m * p.g - B_y, B_y - p.j * p.m * centripetal  # A_x turns the spin with the orbit
    B_x = (p.m + s * p.m / 2) * centripetal - 1.5 * s * p.m * centripetal - A_x
    return bool(np.any((np.abs(A_x) <= p.mu * A_y) & (B_y <= p.eta * B_x)))


@pytest.mark.parametrize("s", RATIOS)
def test_rolling_ends_where_no_forces_hold_it_and_the_wall_carries_it(s):
    for mu, eta in ((0.2, 0.2), (0.05, 0.3), (0.5, 0.1)):
        p = BALL.replace(mu=mu, eta=eta, density_ratio=s)
        omega_01 = diagram.thresholds_with_inertia(p)["omega_01"]
        # B_y is tried in 2e5 parts of m g: relative changes of omega_01 that matter are far above their size.
        assert rolls(p, omega_01 * (1 - 1e-4))
        assert not rolls(p, omega_01 * (1 + 1e-4))
    p = BALL.replace(density_ratio=s)
    centripetal = p.m * p.R * diagram.thresholds_with_inertia(p)["omega_02"] ** 2
    assert p.eta * ((1 + s / 2) * centripetal - 1.5 * s * centripetal) == pytest.approx(p.m * p.g, rel=1e-12)


def test_the_fluid_that_comes_along_slows_the_answer():
    """Forces along the orbit on a ball that rolls at both points, with half the displaced mass added to its own."""
    p = BALL.replace(density_ratio=0.4)
    # m (1 + s/2) R w' = A_z + B_z + push, j m R w' = -A_z, j m R w' = -B_z
    m, jm = p.m * (1 + p.density_ratio / 2) * p.R, p.j * p.m * p.R
    rate, without = (
        np.linalg.solve([[mass, -1, -1], [jm, 1, 0], [jm, 0, 1]], [1.0, 0, 0])[0] for mass in (m, p.m * p.R)
    )
    assert diagram.inertia_shifts(p)["rolling_rate"] == pytest.approx(rate / without - 1, rel=1e-12)
