"""The slip bounds of sections 3.2 and 4: as printed, from Newton and Euler by algebra, and at random sets."""

from typing import Any

import numpy as np
import pytest
import sympy as sp

from analytic import contact_forces, thresholds, vector_field
from analytic.mechanics import dynamics
from analytic.mechanics.rigid_body import Forces
from analytic.slipping import slip_bounds, slip_stability
from analytic.slipping.slip_bounds import HeldBound, SlipBound
from model import Case, InputError, Parameters, State
from tests.analytic import newton_euler as ne

P = Parameters.named("reference")
w = sp.Symbol("w", positive=True)


def random_sets(count: int, top: float = 1.0) -> list[Parameters]:
    rng = np.random.default_rng(count)
    sets = []
    for _ in range(count):
        R = 10 ** rng.uniform(-2, 0)
        mu, eta, j, r = rng.uniform([0.02, 0.02, 0.1, 0.05 * R], [top, top, 2 / 3, 0.9 * R]).tolist()
        c, m, g = 10 ** rng.uniform(-2, 1), 10 ** rng.uniform(-3, 1), rng.uniform(1, 15)
        omega_0 = rng.uniform(-3, 3) * np.sqrt(9.81 / R)
        sets.append(Parameters(m=m, r=r, R=R, j=j, mu=mu, eta=eta, g=g, c=c, omega_0=omega_0))
    return sets


# --- as printed ------------------------------------------------------------------------------------------------


def equal(left: Any, right: Any) -> bool:
    return bool(sp.simplify(left - right) == 0)


def test_zeros_as_printed() -> None:
    """(61), (67), (74), (82), (83); those of a lag, (66) with eta and (73), are below."""
    p: Any = ne.PARAMETERS
    j, mu, eta, square = p.j, p.mu, p.eta, p.g / (p.eta * p.R)
    assert equal(slip_bounds.nr_to_ns(p).zero, square)
    assert slip_bounds.rr_to_rs_stationary(p).zero == 0
    assert equal(slip_bounds.rr_to_sr_stationary(p).zero, p.g / (j * p.R))
    assert equal(slip_bounds.rr_to_ss(p).zero, square * mu * eta * (eta + 1) / (mu * eta * (1 + j) + j - eta))
    assert equal(slip_bounds.rr_to_ss(p, -1).zero, square * mu * eta * (eta - 1) / (mu * eta * (1 + j) + j + eta))
    assert SlipBound(3.0, -2.0).zero == 1.5
    assert SlipBound(3.0, 0.0).zero == np.inf
    assert HeldBound(P.replace(c=0.0), 1.0, 1, 1.0).zero == np.inf


@pytest.mark.parametrize("side", [1, -1])
def test_from_newton_and_euler(side: int) -> None:
    """gamma of every bound is the rate of the slip itself, with the forces of the case it leads to."""
    p: Any = ne.PARAMETERS
    omega_0 = ne.omega_0
    spin = p.g / (p.j * omega_0 * p.r) - omega_0 * p.R / p.r
    table: list[tuple[SlipBound | HeldBound, Case, Any, Any, int, list[tuple[Any, Any]]]] = [
        (slip_bounds.rr_to_rs(p, w, side), Case.RS, w, 0, 4, [(side, 0)]),
        (slip_bounds.rr_to_rs_stationary(p), Case.RS, omega_0, 0, 4, [(side, 0)]),
        (slip_bounds.rr_to_sr(p, w, side), Case.SR, w, 0, 3, [(side, 0)]),
        (slip_bounds.rr_to_sr_stationary(p), Case.SR, omega_0, 0, 3, [(side, 0)]),
        (slip_bounds.rr_to_ss(p, side), Case.SS, omega_0, 0, 5, [(0, side)] * 2),
        (slip_bounds.nr_to_ns(p, side), Case.NS, omega_0, spin, 5, [(0, side)]),
    ]
    for bound, outer, omega_c, slip_x, row, directions in table:
        x = [0, 0, omega_c, slip_x, 0, 0, 0, 0]
        rate = dynamics.newton_euler(outer, x, dynamics.FORCES[outer](x, p, omega_0, *directions), p, omega_0)[row]
        if isinstance(bound, HeldBound):
            gamma = bound.side * p.c * p.R * (omega_0 - w) / ((1 + p.j) * p.r) - bound.hold
        else:
            gamma = bound.offset + bound.slope * omega_0**2
        assert equal(gamma, side * rate), outer


# --- at random sets --------------------------------------------------------------------------------------------


def test_zeros_of_a_lag() -> None:
    """(66) with eta, (73) as printed."""
    for p in random_sets(50):
        at_B = p.eta / (p.j * p.c) * (1 + p.j) * (1 + 2 * p.j) * p.omega_0**2
        at_A = (1 + 2 * p.j) * p.mu / (p.j * p.R * p.c) * (p.g - p.j * p.R * p.omega_0**2)
        for side in (1, -1):
            for bound_of, lag in ((slip_bounds.rr_to_rs, at_B), (slip_bounds.rr_to_sr, -at_A)):
                zero = bound_of(p, p.omega_0, side).zero
                assert zero == pytest.approx(p.omega_0 + side * lag, rel=1e-14, abs=1e-14 * abs(lag))


def forces_at_onset(p: Parameters, omega_0: np.ndarray, side: int) -> Forces:
    """While slip sets in along (0, 0), side 1, or (pi, pi), side -1, in an orbit with the fluid."""
    along = (0.0, float(side))
    return dynamics.forces(Case.SS, State(omega_c=omega_0), p, omega_0, along, along)


def test_bound_83_contradicts_the_normal_forces() -> None:
    """For eta > 1 slip along (pi, pi) would grow below a real bound, but not before the wall would pull, (12)."""
    real = 0
    for p in random_sets(200, top=3.0):
        square = slip_bounds.rr_to_ss(p, -1).zero
        assert (square > 0) == (p.eta > 1)
        if square > 0:
            real += 1
            assert np.all(forces_at_onset(p, np.linspace(0.0, 1.0, 11) * np.sqrt(square), -1).B_x < 0)
    assert real > 50


def test_bound_82_needs_eta_less_than_j() -> None:
    """Where (82) has a bound the floor presses there exactly for eta < j."""
    pressing = 0
    for p in random_sets(300, top=1.5):
        square = slip_bounds.rr_to_ss(p).zero
        if square > 0:
            force = forces_at_onset(p, np.sqrt(square), 1)
            assert (force.A_y > 0) == (p.eta < p.j)
            assert force.B_x > 0
            pressing += p.eta < p.j
            if p.eta < p.j:
                assert np.sqrt(square) == pytest.approx(thresholds(p).omega_01, rel=1e-14)
    assert pressing > 30


# --- NR at any state -------------------------------------------------------------------------------------------


def states_of_nr(p: Parameters, count: int) -> np.ndarray:
    rng = np.random.default_rng(7)
    unit = np.sqrt(p.g / p.R)
    x = rng.normal(size=(count, 6)) * [p.R, np.sqrt(p.g * p.R), 2 * unit, 3 * unit * p.R / p.r, 0, 0]
    x[:, 0] = np.abs(x[:, 0])
    return x


def test_56_at_any_state() -> None:
    """Against the vector field of NS, with v_y, omega_c, slip_x and beta anything."""
    for p in random_sets(20):
        beta = np.linspace(-np.pi, np.pi, 9)
        n = np.stack([np.sin(beta), np.cos(beta)], axis=-1)
        for x in states_of_nr(p, 10):
            growth = slip_stability.gamma(Case.NR, Case.NS, x, n, p)
            orbit, spin = abs(State.of(x).omega_c), abs(State.of(x).slip_x)
            scale = np.abs(slip_bounds.gamma_nr(beta, x, p)).max() + p.g / p.r + orbit * (spin + p.R / p.r * orbit)
            assert np.all(np.abs(slip_bounds.gamma_nr(beta, x, p) - growth) <= 1e-12 * scale / p.j)
    x, beta = states_of_nr(P, 5), np.linspace(0, 6, 7)
    values = slip_bounds.gamma_nr(beta[:, None], x, P)
    assert values.shape == (7, 5)
    assert values[3, 2] == slip_bounds.gamma_nr(beta[3], x[2], P)
    with pytest.raises(InputError, match="slip_z = 1"):
        slip_bounds.gamma_nr(0.0, [0.1, 0, 9.0, 0, 0, 1.0], P)


def test_58_and_59() -> None:
    """(57) vanishes at both, they are the extrema, and (59) is the friction cone, in all of X_NR."""
    p, beta, stable = P.replace(omega_0=20.0, eta=0.5), np.linspace(0, 2 * np.pi, 721), []
    for x in states_of_nr(p, 100):
        _, v_y, omega_c, slip_x, *_ = x
        pull = p.g / p.r + p.c * v_y / p.r + omega_c * slip_x + p.R / p.r * omega_c**2
        first = np.arctan2(p.c * p.R / p.r * (p.omega_0 - omega_c), pull)  # (58)
        second = first + np.pi
        values = slip_bounds.gamma_nr(beta, x, p)
        greatest, least = slip_bounds.gamma_nr(first, x, p), slip_bounds.gamma_nr(second, x, p)
        # A grid of half a degree misses an extremum by (1/2) (0.25 degrees)^2 = 1e-5 of the swing at most.
        swing = greatest - least
        assert greatest >= values.max() - 1e-14 * swing
        assert least <= values.min() + 1e-14 * swing
        assert values.max() >= greatest - 1e-5 * swing
        assert values.min() <= least + 1e-5 * swing
        _, (B_x, B_y, B_z) = contact_forces(Case.NR, x, p)
        assert (greatest < 0 and least < 0) == (np.hypot(B_y, B_z) < p.eta * B_x)
        stable.append(greatest < 0)
    assert 10 < sum(stable) < 90


# --- Filippov --------------------------------------------------------------------------------------------------


def test_69() -> None:
    """f_RR = delta f^- + (1 - delta) f^+, and 0 < delta < 1 exactly where slip dies out on both sides."""
    inside = []
    for p in random_sets(200):
        for outer, row in ((Case.RS, 4), (Case.SR, 3)):
            for omega_c in (0.9 * p.omega_0, 0.2 * p.omega_0):
                x = State(omega_c=omega_c)
                delta = slip_bounds.filippov_share(outer, omega_c, p)
                sides = []
                for side in (-1.0, 1.0):
                    near = np.array(x)
                    near[row] = side * 1e-14 * abs(omega_c)  # (68): a slip that vanishes in round-off
                    sides.append(vector_field(outer, near, p))
                mixed = delta * sides[0] + (1 - delta) * sides[1]
                scale = (abs(delta) + abs(1 - delta)) * np.abs(sides).max()
                expected = vector_field(Case.RR, x, p)
                np.testing.assert_allclose(mixed, expected, atol=1e-12 * scale)
                growth = [float(slip_stability.gamma(Case.RR, outer, x, [side], p)) for side in (-1.0, 1.0)]
                both_die, both_grow = max(growth) < 0, min(growth) > 0
                assert (0 < delta < 1) == (both_die or both_grow)
                assert not both_grow or (outer is Case.SR and p.j * p.R * omega_c**2 > p.g)
                inside.append(0 < delta < 1)
    assert min(sum(inside), len(inside) - sum(inside)) > 50
    with pytest.raises(InputError, match="case SS: RR divides the states of RS and SR only"):
        slip_bounds.filippov_share(Case.SS, 10.0, P)
    assert slip_bounds.filippov_share(Case.RS, 10.0, P.replace(eta=0.0, omega_0=12.0)) == np.inf
