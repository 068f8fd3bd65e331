"""Each stationary solution exists, is stable and is free as its proposition says, with all its
digits."""

import numpy as np
import pytest

from analytic import solution, stationary_solutions, vector_field
from analytic.mechanics.dynamics import jacobian
from analytic.stationary.slipping_branch import branch, eigenvalues_at, fold, hopf_places, points_at
from model import Case, Parameters, State
from model.cases import TRAITS
from model.kinematics import VARIABLES

P = Parameters.named("reference")
EPS = np.finfo(float).eps


def test_solution_of_a_case():
    """The stable one; the unstable one on request; below omega_02 that of NR formally."""
    p = P.replace(omega_0=35.0)
    first, second = stationary_solutions(p, (Case.SS,))
    assert np.array_equal(solution(p, Case.SS).x, first.x)
    assert np.array_equal(solution(p, Case.SS, stable=False).x, second.x)
    assert solution(P.replace(omega_0=9.0), Case.NR, formal=True).exists is False


def test_the_jacobian_in_rn_has_the_spin_that_goes_with_the_radial_speed():
    """Central differences of slip_z = -v_h/r; NS and SS are held by eigenvalues, with the drag
    laws."""
    p, x = (
        P.replace(omega_0=14.0),
        State(omega_c=9.0, slip_y=2.0, slip_z=-0.3 / P.r, h=0.01, v_h=0.3),
    )
    active = [VARIABLES.index(name) for name in TRAITS[Case.RN].active]
    exact, directions, step = jacobian(Case.RN, np.array(x), p), np.eye(8)[active], 1e-6
    directions[:, 5] = -directions[:, 7] / p.r
    up, down = (vector_field(Case.RN, x + sign * step * directions, p) for sign in (1, -1))
    off = (up - down)[:, active].T / (2 * step) - exact
    assert np.abs(off).max() <= 1e-7 * np.abs(exact).max()


@pytest.mark.parametrize("mu", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("eta", [0.05, 0.2, 0.39])
def test_the_branch_is_stable_before_the_fold_and_has_one_unstable_direction_after(mu, eta):
    """As far as mu <= 1."""
    p = P.replace(mu=mu, eta=eta)
    turning = float(fold(p))
    s = np.linspace(-15, 15, 301)
    unstable = np.sum(eigenvalues_at(s, p).real > 1e-9, axis=-1)
    beyond = s > turning if np.isfinite(turning) else np.zeros(s.shape, bool)
    np.testing.assert_array_equal(unstable, beyond)


def test_hopf_points_exist_for_rough_floors_only():
    """Between two of them two directions are unstable; with (12) released so has Fig. 12."""
    assert hopf_places(P) == []
    p = P.replace(mu=3.0, eta=0.35)
    places = hopf_places(p)
    assert len(places) == 2
    for place in places:
        values = eigenvalues_at(place, p)
        pair = values[np.abs(values.imag) > 1]
        assert np.abs(pair.real).max() <= 1e-9 * np.abs(pair).max()
    assert np.sum(eigenvalues_at(np.mean(places), p).real > 0) == 2


@pytest.mark.parametrize("eta", [0.05, 0.2, 0.39, 0.4 - 1e-9])
@pytest.mark.parametrize("kappa", [1e-6, 1e-2, 1.0, 30.0])
@pytest.mark.parametrize("mu", [0.05, 0.2, 1.0])
def test_roots_of_the_branch_to_round_off(mu, kappa, eta):
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


VANISHING = [  # what exists, is how stable, and is free
    # nothing holds the ball to the wall: in NS it sinks
    (
        {"omega_0": 0.0},
        {
            "RR": (True, "ASYMPTOTIC", ()),
            "RS": (True, "NEUTRAL", ("slip_y",)),
            "NS": (True, "NEUTRAL", ("y",)),
        },
        "RR RS NS",
    ),
    # nothing fixes omega_c, and nothing feeds a steady slip: no SS, no steady sinking
    (
        {"c": 0.0},
        {"RR": (True, "NEUTRAL", ("omega_c",)), "RS": (True, "NEUTRAL", ("slip_y", "omega_c"))}
        | {"SR": (False, "UNSTABLE", ("omega_c",)), "NR": (False, "NEUTRAL", ("y", "omega_c"))},
        "RR RS SR NR",
    ),
    # the ball goes round with the fluid, sliding on the floor with any spin about the radius
    ({"mu": 0.0}, {"RR": False, "SR": (True, "NEUTRAL", ("slip_x",))}, None),
    # the wall never carries the weight (NR, SR can't exist), and the spin about the axis is free
    (
        {"eta": 0.0},
        {**dict.fromkeys(("RR", "RS", "SR", "NR"), False), "SS": (True, "NEUTRAL", ("slip_y",))}
        | {"NS": (True, "NEUTRAL", ("y", "slip_y"))},
        None,
    ),
    ({"eta": 0.0, "omega_0": 9.0}, {"RR": True, "RS": True}, None),
    # the ball goes round with the fluid and spins as it likes about the axis
    ({"mu": 0.0, "eta": 0.0}, {"SS": (True, "NEUTRAL", ("slip_y",))}, None),
]


@pytest.mark.parametrize(("change", "expected", "those"), VANISHING)
def test_vanishing_parameters(change, expected, those):
    """Existence alone where the table says only that; all cases with a solution where it lists
    them."""
    p = P.replace(**change)
    solutions = stationary_solutions(p)
    kinds = {s.case.name: (s.exists, s.stability.name, s.family) for s in solutions}
    for case, kind in expected.items():
        assert (kinds[case][0] if isinstance(kind, bool) else kinds[case]) == kind
    assert those is None or set(kinds) == set(those.split())
    assert "SS" not in kinds or p.mu > 0 or p.eta == 0
    # Nothing that exists moves but by sinking; without friction at the floor the ball doesn't spin
    # about the radius.
    for s in (s for s in solutions if s.exists and p.c > 0):
        assert np.abs(vector_field(s.case, s.x, p)[1:]).max() <= 1e-11, s.case
        if s.case is not Case.SS:
            assert s.state.omega_c == (0.0 if s.case is Case.RS and p.eta else p.omega_0)
        if p.mu == 0 and s.case is not Case.NS:
            assert abs(s.state.slip_x + p.R / p.r * s.state.omega_c) <= 1e-12


def test_dimensions_of_table_4():
    """As many eigenvalues as Table 4 has variables; in NS y is cyclic, (48), and adds none."""
    flows = {Case.RR: 9.0, Case.RS: 0.0, Case.SR: 30.0, Case.SS: 20.0, Case.NR: 30.0, Case.NS: 9.0}
    printed = {Case.RR: 1, Case.RS: 2, Case.SR: 2, Case.SS: 4, Case.NR: 4, Case.NS: 6}
    for case, flow in flows.items():
        values = solution(P.replace(omega_0=flow), case, formal=True).eigenvalues
        assert len(values) == printed[case] - (case is Case.NS), case
        assert len(TRAITS[case].active) == printed[case]
