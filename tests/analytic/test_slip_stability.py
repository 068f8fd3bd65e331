"""Slip dies out by its energy where forces admit rolling, though the claim after (80) fails; claims
measure gamma."""

import numpy as np
import pytest
from scipy.optimize import minimize

from analytic import stationary_solutions, thresholds
from analytic.mechanics import rolling_forces
from analytic.slipping import slip_stability as slip
from analytic.slipping.slip_bounds import HeldBound, SlipBound
from model import Case, Parameters, State

P = Parameters.named("reference")
RR_SS = Case.RR, Case.SS


def directions():
    """Slips (n, 3) of length 1 along alpha and beta, both in [-pi/2, pi/2] or both in [pi/2, 3
    pi/2]: (75), (76)."""
    angle = ((np.arange(60) + 0.5) / 60 - 0.5) * np.pi
    tan_alpha, tan_beta = np.meshgrid(np.tan(angle), np.tan(angle))
    sheet = np.stack([tan_alpha, tan_beta, np.ones_like(tan_alpha)], axis=-1).reshape(-1, 3)
    sheet = np.append(sheet, [[0.0, 0.0, 1.0]], axis=0)
    return np.concatenate([sheet, -sheet]) / np.tile(np.linalg.norm(sheet, axis=1), 2)[:, None]


def growth_of_energy(x, n, p):
    """gamma out of RR into SS by kinetic energy: the work done on the slip, divided by its size in
    that product.

    The mass matrix of the slip in units of m r^2 is the kinetic energy with what else moves
    eliminated."""
    M = p.j / (1 + 2 * p.j) * np.array([[1 + p.j, p.j, 0], [p.j, 1 + p.j, 0], [0, 0, 1 + 2 * p.j]])
    rates, _, _ = slip.slip_rates(*RR_SS, x, n, p)
    return np.sum(n @ M * rates, axis=-1) / np.sqrt(np.sum(n @ M * n, axis=-1))


def greatest(gamma, x, p, closed=False):
    """The direction of greatest gamma out of RR into SS, and that: the best of a grid, polished.

    With `closed` only of those along which both contacts press: elsewhere the ball would lift
    instead of slipping."""

    def growth(n):
        _, A_y, B_x = slip.slip_rates(*RR_SS, x, n, p)
        return np.where((not closed) | (A_y >= 0) & (B_x >= 0), gamma(x, n, p), -np.inf)

    grid = directions()
    values = growth(grid)
    best, scale = grid[np.argmax(values)], values.max()
    how = {"method": "BFGS", "options": {"gtol": 1e-9}}
    polished = minimize(lambda n: -float(gamma(x, n, p)) / abs(scale), best, **how).x
    best = max(best, polished, key=growth)
    return best / np.linalg.norm(best), float(growth(best))


@pytest.mark.parametrize(("mu", "eta"), [(0.2, 0.2), (0.1, 0.39), (0.9, 0.05), (0.5, 0.3)])
def test_energy_and_forces_agree_on_omega_01(mu, eta):
    """gamma by energy is negative in all directions, and forces are admissible, exactly up to
    (84)."""
    p = P.replace(mu=mu, eta=eta)
    for factor, holds in ((0.5, True), (1 - 1e-6, True), (1 + 1e-6, False)):
        omega = factor * thresholds(p).omega_01
        q, x = p.replace(omega_0=omega), State(omega_c=omega)
        n, value = greatest(growth_of_energy, x, q, closed=True)
        assert (value < 0) == (rolling_forces.margin(omega, q) > 0) == holds
        if factor > 0.9:  # the direction in which it ends
            np.testing.assert_allclose(np.abs(n), [0, 0, 1], atol=1e-3)


def test_counter_example_to_the_claim_after_80():
    """With the normal of (75), (0, 0) is not the global maximum of gamma, and gamma > 0 somewhere
    though RR is stable.

    mu = eta = 0.2 at half of omega_01: gamma(0, 0) < 0, forces exist, and gamma_M < 0 for all n,
    yet the greatest Euclidean gamma is positive: up to 0.61 omega_01."""
    omega = 0.5 * thresholds(P).omega_01

    def euclidean(x, n, p):
        return slip.gamma(*RR_SS, x, n, p)

    p, x = P.replace(omega_0=omega), State(omega_c=omega)
    n, value = greatest(euclidean, x, p)
    assert euclidean(x, [0.0, 0.0, 1.0], p) < 0 < value
    assert greatest(growth_of_energy, x, p, closed=True)[1] < 0
    assert rolling_forces.margin(omega, p, omega) > 0
    # The direction of growth keeps both contacts closed: it isn't excluded by (12).
    _, A_y, B_x = slip.slip_rates(*RR_SS, x, n, p)
    assert A_y > 0
    assert B_x > 0
    for factor, grows in ((0.605, True), (0.615, False)):
        flow = factor * 2 * omega
        assert (greatest(euclidean, State(omega_c=flow), P.replace(omega_0=flow))[1] > 0) == grows


def test_normal_forces_while_a_slip_is_slight():
    """Where the wall alone slips the floor bears the weight, and the wall what turns the spin,
    too."""
    x, n = State(omega_c=5.0), np.array([1.0])
    _, A_y, B_x = slip.slip_rates(Case.RR, Case.RS, x, n, P)
    assert (A_y, B_x) == pytest.approx((P.m * P.g, (1 + P.j) * P.m * P.R * 25.0))


def test_both_consistent_between_73_and_the_cone():
    """Off the stationary point the floor's cone allows more drag than gamma of (73), by 1/sqrt(1 -
    mu^2)."""
    p, omega_c = P.replace(mu=0.9, eta=1e6), 9.0
    T = p.mu * (1 - p.j * p.R * omega_c**2 / p.g)
    lag = T * (1 + 2 * p.j) * p.g / (p.j * p.c * p.R)
    beyond = 1.01 / np.sqrt(1 - p.mu**2)
    table = (0.99, False, True), (1.01, True, True), (beyond, True, False)
    for factor, slips, sticks in table:
        q = p.replace(omega_0=omega_c + factor * lag)
        x = State(omega_c=omega_c)
        growths = [slip.gamma(Case.RR, Case.SR, x, [side], q) for side in (1.0, -1.0)]
        assert (max(growths) > 0) == slips
        assert (rolling_forces.margin(omega_c, q) >= 0) == sticks


def test_bounds_are_infinite_where_gamma_never_vanishes():
    """The zeros themselves claims hold, (56) claim eq-13-gamma."""
    assert SlipBound(3.0, -2.0).zero == 1.5
    assert SlipBound(3.0, 0.0).zero == HeldBound(P.replace(c=0.0), 1.0, 1, 1.0).zero == np.inf


def test_definition_3_without_friction_or_flow():
    """Elsewhere claim definition-3 holds it."""
    stability, SlipStability = slip.stability, slip.SlipStability
    still, slow = P.replace(omega_0=0.0), P.replace(omega_0=5.0)
    assert np.isnan(slip.neutral_flow(Case.NR, P.replace(eta=0.0)))
    assert stationary_solutions(still)[0].slip_stability is SlipStability.NEUTRAL
    for neutral in (still, slow.replace(eta=0.0), slow.replace(eta=0.6, mu=0.0)):
        assert stability(Case.RR, neutral) is SlipStability.NEUTRAL
    for case, p in ((Case.RS, still), (Case.SS, P), (Case.NS, P)):
        assert stability(case, p) is SlipStability.STABLE
