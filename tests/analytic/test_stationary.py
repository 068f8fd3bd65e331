"""Stationary solutions: zeros of the vector fields, the formulas of Propositions 1-6, eigenvalues by differences."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analytic import (
    SlipStability,
    Stability,
    StationarySolution,
    contact_forces,
    slowest_time_constant,
    solution,
    stable_solutions,
    stationary_solutions,
    thresholds,
    vector_field,
)
from analytic.mechanics.dynamics import jacobian
from analytic.stationary import slipping_branch as stability
from analytic.stationary.slipping_branch import branch, fold, points_at
from model import Case, InputError, Parameters, State
from model.cases import TRAITS
from model.kinematics import VARIABLES, slip_speeds
from tests.directions import slip_directions

P = Parameters.named("reference")
EPS = np.finfo(float).eps
FLOWS = [1.0, 8.0, 13.0, 14.0, 22.0, 28.0, 33.0, 41.0, 60.0]


def of_case(p: Parameters, case: Case) -> list[StationarySolution]:
    return [s for s in stationary_solutions(p) if s.case is case]


@pytest.mark.parametrize("eta", [0.02, 0.2, 0.39, 0.6])
@pytest.mark.parametrize("omega_0", FLOWS)
def test_solutions_are_zeros_of_the_fields(omega_0: float, eta: float) -> None:
    """Round-off of the largest acceleration is all that may be left; NS sinks, which is its only rate (48)."""
    p = P.replace(omega_0=omega_0, eta=eta)
    scale = (p.g + p.R * (omega_0**2 + p.c * omega_0)) / (p.j * p.r)
    for s in stationary_solutions(p):
        rate = State.of(vector_field(s.case, s.x, p))
        if s.case is Case.NS:
            assert s.moves
            assert rate.y == s.state.v_y < 0
            rate = rate._replace(y=0.0)
        assert np.abs(rate).max() <= 100 * EPS * scale, s
        if s.case is not Case.RR:
            force = contact_forces(s.case, s.x, p)
            np.testing.assert_array_equal([s.force_A, s.force_B], force)


@pytest.mark.parametrize("omega_0", [1.0, 8.0, 13.0])
def test_proposition_1(omega_0: float) -> None:
    p = P.replace(omega_0=omega_0)
    (s,) = of_case(p, Case.RR)
    assert s.exists
    assert s.stability is Stability.ASYMPTOTIC
    assert s.state.omega_c == omega_0
    assert s.force_A[2] == 0
    np.testing.assert_allclose(s.eigenvalues, [-p.c / (1 + 2 * p.j)], rtol=1e-14)


def test_proposition_2() -> None:
    (s,) = of_case(P.replace(omega_0=0.0), Case.RS)
    assert (s.family, s.stability) == (("slip_y",), Stability.NEUTRAL)
    np.testing.assert_allclose(s.force_A, [0, P.m * P.g, 0], atol=1e-18)
    np.testing.assert_array_equal(s.force_B, 0)
    assert not of_case(P, Case.RS)


@pytest.mark.parametrize("eta", [0.2, 0.6])
def test_propositions_3_and_5(eta: float) -> None:
    """(35) with the sign of its range corrected, (36); (46), (47). Stability in SR turns at sqrt(g/(jR))."""
    for factor, exists in ((0.999999, False), (1.000001, True)):
        p = P.replace(eta=eta)
        p = p.replace(omega_0=factor * np.sqrt(p.g / (eta * p.R)))
        for case in (Case.SR, Case.NR):
            (s,) = of_case(p, case)
            assert s.exists == s.slip_stable == exists
            np.testing.assert_allclose(
                s.state.slip_x, p.g / (p.j * p.omega_0 * p.r) - p.omega_0 * p.R / p.r, rtol=1e-13
            )
            np.testing.assert_allclose(s.force_B, [p.m * p.R * p.omega_0**2, p.m * p.g, 0], rtol=1e-13)
            np.testing.assert_allclose(s.force_A, 0, atol=1e-13 * p.m * p.g)
        (s,) = of_case(p, Case.NR)
        assert (s.stability, s.family) == (Stability.NEUTRAL, ("y",))
    for factor, kind in ((0.999, Stability.UNSTABLE), (1.001, Stability.ASYMPTOTIC)):
        (s,) = of_case(P.replace(omega_0=factor * np.sqrt(P.g / (P.j * P.R))), Case.SR)
        assert s.stability is kind


@pytest.mark.parametrize("omega_0", [14.0, 25.0, 33.0, 41.0])
def test_proposition_4(omega_0: float) -> None:
    """(37)-(42) at the alpha of the solution."""
    p = P.replace(omega_0=omega_0)
    solutions = of_case(p, Case.SS)
    assert len(solutions) == (1 if omega_0 < thresholds(p).omega_02 else 2)
    for s in solutions:
        assert s.exists
        alpha, _ = slip_directions(s.x, p)
        np.testing.assert_allclose(alpha, s.alpha, rtol=1e-12)
        cos, sin = np.cos(s.alpha), np.sin(s.alpha)
        den = (1 + p.j * cos**2) * p.mu * p.eta + (p.j - p.eta) * cos
        omega_c = np.sqrt(p.mu * p.g / p.R) * np.sqrt((1 + p.eta * cos**2) / den)
        v_A = -p.mu * p.g / (p.j * omega_c) * (p.j - p.eta) * sin / den
        np.testing.assert_allclose(s.state.omega_c, omega_c, rtol=1e-12)
        np.testing.assert_allclose(slip_speeds(s.x, p)[0], v_A, rtol=1e-12)
        drag = p.g * p.mu / (p.R * p.c) * cos * sin * (p.j - p.eta) / den
        np.testing.assert_allclose(omega_0, omega_c - drag, rtol=1e-12)
        np.testing.assert_allclose(s.force_A[1], p.m * p.g * (p.j - p.eta) * cos / den, rtol=1e-12)
        np.testing.assert_allclose(s.force_B[0], p.mu * p.m * p.g * (1 + p.j * cos**2) / den, rtol=1e-12)
    assert [s.stability for s in solutions] == [Stability.ASYMPTOTIC, Stability.UNSTABLE][: len(solutions)]


def test_proposition_6() -> None:
    """(49) with its second row, omega_c = omega_0, restored; (50); eigenvalues +-i omega_0, also where omega_0 = 0."""
    for omega_0 in (0.0, 12.0, 31.0):
        p = P.replace(omega_0=omega_0)
        (s,) = of_case(p, Case.NS)
        sink = (p.g - p.eta * omega_0**2 * p.R) / p.c
        expected = [0, -sink, omega_0, (p.eta - p.j) / p.j * omega_0 * p.R / p.r, 0, sink / p.r, 0, 0]
        np.testing.assert_allclose(s.x, expected, rtol=1e-13, atol=1e-13)
        np.testing.assert_allclose(s.force_B, p.m * p.R * omega_0**2 * np.array([1, p.eta, 0]), rtol=1e-13)
        assert s.stability is Stability.NEUTRAL
        pair = s.eigenvalues[np.abs(s.eigenvalues.real) <= 1e-12 * max(omega_0, 1)]
        np.testing.assert_allclose(sorted(pair.imag)[0], -omega_0, rtol=1e-12)
        np.testing.assert_allclose(sorted(pair.imag)[-1], omega_0, rtol=1e-12)
    assert not of_case(P.replace(omega_0=32.0), Case.NS)


# --- one solution, and those that attract -----------------------------------------------------------------------


def test_solution_of_a_case() -> None:
    """The stable one; the unstable one on request; below omega_02 that of NR formally."""
    p = P.replace(omega_0=35.0)
    first, second = of_case(p, Case.SS)
    assert np.array_equal(solution(p, Case.SS).x, first.x)
    assert np.array_equal(solution(p, Case.SS, stable=False).x, second.x)
    slow = P.replace(omega_0=9.0)
    assert solution(slow, Case.NR, formal=True).exists is False
    for ask, message in (
        (lambda: solution(slow, Case.NR), r"case NR has no stable stationary solution at omega_0 = 9 rad s-1 \(mu"),
        (lambda: solution(slow, Case.SS), "case SS has no stable stationary solution"),
        (lambda: solution(slow, Case.RR, stable=False), "case RR has no unstable stationary solution"),
        (lambda: solution(p, Case.NN), "case NN has no stable"),
    ):
        with pytest.raises(InputError, match=message):
            ask()


@pytest.mark.parametrize(
    ("eta", "omega_0", "expected"),
    [
        (0.2, 9.0, {Case.RR}),
        (0.2, 20.0, {Case.SS}),
        (0.2, 35.0, {Case.SS, Case.SR, Case.NR}),
        (0.2, 50.0, {Case.SR, Case.NR}),
        (0.6, 12.0, {Case.RR}),
        (0.6, 20.0, {Case.RR, Case.NR}),
        (0.6, 25.0, {Case.SR, Case.NR}),
        (0.6, 0.0, {Case.RR, Case.RS}),
    ],
)
def test_stable_solutions(eta: float, omega_0: float, expected: set[Case]) -> None:
    """The regions of Figs. 7, 10 and 11; no sinking ball among them, nor the far part of SS."""
    attracting = stable_solutions(P.replace(eta=eta, omega_0=omega_0))
    assert {s.case for s in attracting} == expected
    assert len(attracting) == len(expected)


def test_slowest_time_constant() -> None:
    """The groups of time in theory.md: RR, NR's swing; inf where nothing decays."""
    p = P.replace(omega_0=9.0)
    assert slowest_time_constant(solution(p, Case.RR)) == pytest.approx((1 + 2 * p.j) / p.c)
    fast = P.replace(omega_0=45.0)
    assert slowest_time_constant(solution(fast, Case.NR)) == pytest.approx(2 * (1 + p.j) / p.c)
    assert slowest_time_constant(solution(P.replace(c=0.0), Case.RR)) == np.inf


@pytest.mark.parametrize(("omega_0", "c"), [(3.0, 0.1), (9.0, 1.0), (20.0, 4.0), (30.0, 1.0)])
def test_time_constants_of_ns(omega_0: float, c: float) -> None:
    """c, and the roots of x^2 - (1 + q (1+j)/j) x + q/j in units of c: the slower one is that of the spin slip_y."""
    p = P.replace(omega_0=omega_0, c=c)
    q = p.eta * p.Omega_0**2 / (1 - p.eta * p.Omega_0**2)
    expected = np.sort([1.0, *np.roots([1.0, -(1 + q * (1 + p.j) / p.j), q / p.j])])
    s = solution(p, Case.NS)
    decaying = -s.eigenvalues.real[np.abs(s.eigenvalues.imag) < 0.5 * omega_0] / c
    np.testing.assert_allclose(decaying, expected, rtol=1e-10)
    assert slowest_time_constant(s) == pytest.approx(1 / (c * expected[0]), rel=1e-10)


def test_neutral_with_respect_to_slipping() -> None:
    """Definition 3: a ball at rest that rolls may as well spin; and the end of rolling, to round-off."""
    (s,) = of_case(P.replace(omega_0=0.0), Case.RR)
    assert s.slip_stability is SlipStability.NEUTRAL
    (s,) = of_case(P.replace(omega_0=thresholds(P).omega_01), Case.RR)
    assert s.slip_stability is SlipStability.NEUTRAL
    assert s.slip_stable
    (s,) = of_case(P.replace(omega_0=14.0), Case.RR)
    assert s.slip_stability is SlipStability.UNSTABLE
    assert not s.slip_stable


# --- eigenvalues -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("omega_0", [14.0, 33.0, 41.0])
def test_jacobian_against_differences(omega_0: float) -> None:
    """Central differences err by round-off/step + step^2: with the step 1e-5 of the slip about 1e-9 of the size."""
    p = P.replace(omega_0=omega_0)
    for s in stationary_solutions(p):
        active = [VARIABLES.index(name) for name in TRAITS[s.case].active]
        exact = jacobian(s.case, s.x, p)
        _, _, _, *slips, _, _ = s.x
        step = 1e-5 * max(min((abs(slip) for slip in slips if slip), default=1.0), 1e-2)
        x = np.array(s.state._replace(y=0.1 if s.case in (Case.NR, Case.NS) else 0.0))
        numeric = np.stack(
            [
                (vector_field(s.case, x + step * e, p) - vector_field(s.case, x - step * e, p))[active] / (2 * step)
                for e in np.eye(8)[active]
            ],
            axis=-1,
        )
        assert np.abs(numeric - exact).max() <= 1e-7 * np.abs(exact).max(), s.case


def test_jacobian_of_cases_without_stationary_solutions() -> None:
    """RN, SN, NN by differences too; in RN slip_z goes with v_h."""
    x = np.array([0, 0, 9.0, 0, 2.0, -0.3 / P.r, 0.01, 0.3])
    exact = jacobian(Case.RN, x, P)
    names = TRAITS[Case.RN].active
    for column, name in enumerate(names):
        e = np.eye(8)[VARIABLES.index(name)] * 1e-6
        if name == "v_h":
            e = e + np.eye(8)[5] * (-1e-6 / P.r)
        difference = (vector_field(Case.RN, x + e, P) - vector_field(Case.RN, x - e, P)) / 2e-6
        rows = [VARIABLES.index(n) for n in names]
        np.testing.assert_allclose(exact[:, column], difference[rows], atol=1e-6 * np.abs(exact).max())


def test_eigenvalues_of_the_branch_in_both_coordinates() -> None:
    """Where slip is not yet tiny the plain Jacobian gives the same eigenvalues."""
    s = np.linspace(-5, 5, 21)
    states, flow = stability.states(s, P)
    values = stability.eigenvalues_at(s, P)
    for x, omega_0, expected in zip(states, flow, values, strict=True):
        matrix = jacobian(Case.SS, x, P.replace(omega_0=float(omega_0)))
        values = np.linalg.eigvals(matrix)
        # Round-off of the stiff entries is what the small eigenvalues suffer.
        tolerance = 1e3 * EPS * np.abs(matrix).max()
        for value in expected:
            assert np.abs(values - value).min() <= tolerance


@pytest.mark.parametrize(("mu", "eta", "c"), [(0.2, 0.2, 1.0), (0.2, 0.02, 1.0), (0.7, 0.35, 0.01), (1.5, 0.1, 5.0)])
def test_ends_of_the_branch(mu: float, eta: float, c: float) -> None:
    """The finite eigenvalues tend to closed forms linearly in the distance exp(-|s|) from the end.

    In RR (omega_01) lambda^2 + c lambda/(1+2j) + 2 (g/R) mu (1+eta)/((1+mu eta)(1+2j)) = 0; in SR (omega_02)
    (2 mu eta omega_02 - c)/(1+j), which is positive exactly if there is a fold (87), and +-i omega_02.
    """
    p = P.replace(mu=mu, eta=eta, c=c)
    stiffness = 2 * p.g / p.R * mu * (1 + eta) / ((1 + mu * eta) * (1 + 2 * p.j))
    omega_02 = np.sqrt(p.g / (eta * p.R))
    at_rr = np.roots([1.0, c / (1 + 2 * p.j), stiffness])
    at_sr = np.array([(2 * mu * eta * omega_02 - c) / (1 + p.j), 1j * omega_02, -1j * omega_02])
    for expected, sign in ((at_rr, -1), (at_sr, 1)):
        for distance in (18.0, 25.0):
            values = stability.eigenvalues_at(sign * distance, p)
            for value in expected:
                assert np.abs(values - value).min() <= 1e4 * np.exp(-distance) * max(np.abs(expected).max(), 1)
    assert (at_sr[0].real > 0) == (eta > c**2 * p.R / (4 * p.g * mu**2))


@pytest.mark.parametrize("mu", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("eta", [0.05, 0.2, 0.39])
def test_the_branch_is_stable_before_the_fold_and_has_one_unstable_direction_after(mu: float, eta: float) -> None:
    """As far as mu <= 1."""
    p = P.replace(mu=mu, eta=eta)
    turning = float(fold(p))
    s = np.linspace(-15, 15, 301)
    unstable = np.sum(stability.eigenvalues_at(s, p).real > 1e-9, axis=-1)
    beyond = s > turning if np.isfinite(turning) else np.zeros(s.shape, bool)
    np.testing.assert_array_equal(unstable, beyond)


def test_hopf_points_exist_for_rough_floors_only() -> None:
    assert stability.hopf_places(P) == []
    p = P.replace(mu=3.0, eta=0.35)
    places = stability.hopf_places(p)
    assert len(places) == 2
    for place in places:
        values = stability.eigenvalues_at(place, p)
        pair = values[np.abs(values.imag) > 1]
        assert np.abs(pair.real).max() <= 1e-9 * np.abs(pair).max()
    between = stability.eigenvalues_at(np.mean(places), p)
    assert np.sum(between.real > 0) == 2


def test_hopf_point_of_figure_12() -> None:
    """With (12) released: one pair crosses, so that the number of unstable directions changes by two there."""
    p = P.replace(eta=0.43)
    (place,) = stability.hopf_places(p)
    before, after = (np.sum(stability.eigenvalues_at(place + d, p).real > 0) for d in (-0.01, 0.01))
    assert abs(before - after) == 2
    with pytest.raises(InputError, match=r"eta = 0\.6 is out of range: SS has no whole branch"):
        stability.hopf_places(P.replace(eta=0.6))


# --- the branch without loss of digits -------------------------------------------------------------------------


@pytest.mark.parametrize("eta", [0.05, 0.2, 0.39, 0.4 - 1e-9])
@pytest.mark.parametrize("kappa", [1e-6, 1e-2, 1.0, 30.0])
@pytest.mark.parametrize("mu", [0.05, 0.2, 1.0])
def test_roots_of_the_branch_to_round_off(mu: float, kappa: float, eta: float) -> None:
    """Every place belongs to its flow, over the whole branch and right up to its ends."""
    p = P.replace(mu=mu, eta=eta, c=kappa * np.sqrt(P.g / P.R))
    for s in (-25.0, -12.0, -3.0, 0.0, 3.0, 12.0):
        Omega_0 = float(branch(s, p).Omega_0)
        low, high = (float(branch(end, p).Omega_0) for end in (-80, 80))
        if min(abs(Omega_0 - low), abs(Omega_0 - high)) < 4 * EPS * Omega_0:
            continue  # the flow can't tell the place from the end
        places = points_at(p.replace(omega_0=Omega_0 * np.sqrt(P.g / P.R)))
        assert places
        for place in places:
            assert abs(float(branch(place, p).Omega_0) - Omega_0) <= 8 * EPS * Omega_0


@given(st.floats(1e-14, 1e-3))
@settings(max_examples=30, deadline=None)
def test_just_beyond_the_end_of_rolling(excess: float) -> None:
    """The slip of a flow a hair beyond omega_01 is that hair over the slope of (41), to the hair's own digits."""
    omega_01 = thresholds(P).omega_01
    p = P.replace(omega_0=omega_01 * (1 + excess))
    (s,) = of_case(p, Case.SS)
    lead = p.omega_0 - omega_01
    den = (1 + p.j) * p.mu * p.eta + p.j - p.eta
    expected = lead / (p.g * p.mu / (p.R * p.c) * (p.j - p.eta) / den)
    digits = 8 * EPS * omega_01 / lead + 2 * abs(expected)  # of the flow itself, and of the next order in alpha
    assert abs(-s.alpha / expected - 1) <= digits
    assert s.stability is Stability.ASYMPTOTIC


# --- mirror images and vanishing parameters --------------------------------------------------------------------


@pytest.mark.parametrize("omega_0", FLOWS)
def test_mirror_image(omega_0: float) -> None:
    """Backwards flow: the reflected solutions, which solve the equations, with the same eigenvalues."""
    p = P.replace(omega_0=-omega_0)
    for s, forward in zip(stationary_solutions(p), stationary_solutions(P.replace(omega_0=omega_0)), strict=True):
        np.testing.assert_array_equal(np.abs(s.x), np.abs(forward.x))
        np.testing.assert_array_equal(s.eigenvalues, forward.eigenvalues)
        rate = vector_field(s.case, s.x, p)
        rate[0] = 0
        assert np.abs(rate).max() <= 1e-10
        if s.case is not Case.RR:
            np.testing.assert_allclose(
                np.concatenate(contact_forces(s.case, s.x, p)), [*s.force_A, *s.force_B], atol=1e-13
            )


VANISHING = [  # what exists, is how stable, and is free
    (
        {"omega_0": 0.0},  # nothing holds the ball to the wall: in NS it sinks
        {"RR": (True, "ASYMPTOTIC", ()), "RS": (True, "NEUTRAL", ("slip_y",)), "NS": (True, "NEUTRAL", ("y",))},
        "RR RS NS",
    ),
    (
        {"c": 0.0},  # nothing fixes omega_c, and nothing feeds a steady slip: no SS, no steady sinking
        {
            "RR": (True, "NEUTRAL", ("omega_c",)),
            "RS": (True, "NEUTRAL", ("slip_y", "omega_c")),
            "SR": (False, "UNSTABLE", ("omega_c",)),
            "NR": (False, "NEUTRAL", ("y", "omega_c")),
        },
        "RR RS SR NR",
    ),
    # mu = 0: the ball goes round with the fluid, sliding on the floor with any spin about the radius.
    ({"mu": 0.0}, {"RR": False, "SR": (True, "NEUTRAL", ("slip_x",))}, None),
    # eta = 0: the wall never carries the weight (NR, SR can't exist), and the spin about the axis is free.
    (
        {"eta": 0.0},
        {
            **dict.fromkeys(("RR", "RS", "SR", "NR"), False),
            "SS": (True, "NEUTRAL", ("slip_y",)),
            "NS": (True, "NEUTRAL", ("y", "slip_y")),
        },
        None,
    ),
    ({"eta": 0.0, "omega_0": 9.0}, {"RR": True, "RS": True}, None),
    # The ball goes round with the fluid and spins as it likes about the axis.
    ({"mu": 0.0, "eta": 0.0}, {"SS": (True, "NEUTRAL", ("slip_y",))}, None),
]


@pytest.mark.parametrize(("change", "expected", "those"), VANISHING)
def test_vanishing_parameters(change: dict[str, float], expected: dict[str, object], those: str | None) -> None:
    """Existence alone where the table says only that; all cases with a solution where it lists them."""
    p = P.replace(**change)
    solutions = stationary_solutions(p)
    kinds = {s.case.name: (s.exists, s.stability.name, s.family) for s in solutions}
    for case, kind in expected.items():
        assert (kinds[case][0] if isinstance(kind, bool) else kinds[case]) == kind
    assert those is None or set(kinds) == set(those.split())
    assert "SS" not in kinds or p.mu > 0 or p.eta == 0
    if p.mu == p.eta == 0:
        for s in solutions:
            assert np.abs(vector_field(s.case, s.x, p)[1:]).max() <= 1e-11
