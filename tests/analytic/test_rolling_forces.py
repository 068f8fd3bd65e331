"""No force of the family of RR does better than the one that is said to, by brute force over its
parameter."""

import numpy as np
import pytest

from analytic import contact_forces
from analytic.mechanics import rolling_forces
from analytic.mechanics.dynamics import rolling_family
from model import Case, Parameters

P = Parameters.named("reference")
EQUAL = [(friction, friction) for friction in (0.2, 0.4, 1.0, 2.0)]
FRICTION = [*EQUAL, (0.2, 0.6), (0.6, 0.2), (1.5, 0.3), (0.3, 1.5)]
RNG = np.random.default_rng(7)
OMEGA_C = RNG.uniform(-40, 40, 300)
OMEGA_0 = OMEGA_C + RNG.normal(0, 60, 300)


def utilisation(omega_c, p, omega_0, B_y):
    """The larger utilisation at given B_y, inf where a contact would have to pull."""
    A_x, A_y, A_z, B_x, B_y, B_z = rolling_family(omega_c, p, omega_0, B_y)
    with np.errstate(divide="ignore", invalid="ignore"):
        A = np.where(A_y > 0, np.hypot(A_x, A_z) / (p.mu * A_y), np.inf)
        B = np.where(B_x > 0, np.hypot(B_y, B_z) / (p.eta * B_x), np.inf)
    return np.maximum(A, B)


@pytest.mark.parametrize(("mu", "eta"), FRICTION)
def test_least_utilisation_interval_and_margin_agree(mu, eta):
    """No B_y of a dense scan does better, the member itself attains what is claimed, and the ends
    of the interval 1."""
    p = P.replace(mu=mu, eta=eta)
    best = rolling_forces.least_utilisation(OMEGA_C, p, OMEGA_0)
    scan = p.m * p.g * (1 - np.geomspace(1e-4, 1e4, 4000))
    low = utilisation(OMEGA_C[:, None], p, OMEGA_0[:, None], scan).min(axis=1)
    assert np.all(best.utilisation <= low * (1 + 1e-12))
    finite = np.isfinite(best.B_y)
    assert finite.any()
    attained = utilisation(OMEGA_C, p, OMEGA_0, best.B_y)[finite]
    # The root of the crossing is known to round-off of q, which the steepest utilisation amplifies.
    reached = np.isclose(attained, best.utilisation[finite], rtol=1e-10, atol=0)
    jams = min(mu, eta) > 1  # where it is only approached, and there is always a force
    assert np.all(reached | (attained <= 1 + 1e-9) & jams)
    least, greatest = rolling_forces.admissible_interval(OMEGA_C, p, OMEGA_0)
    holds = np.isfinite(greatest)
    assert holds.any()
    assert holds.all() == jams
    np.testing.assert_array_equal(rolling_forces.margin(OMEGA_C, p, OMEGA_0) >= 0, holds)
    np.testing.assert_array_equal((best.utilisation <= 1)[finite], holds[finite])
    for ends in (least, greatest):
        end = holds & np.isfinite(ends)
        np.testing.assert_allclose(utilisation(OMEGA_C, p, OMEGA_0, ends)[end], 1, rtol=1e-9)


@pytest.mark.parametrize(("mu", "eta"), [(1.5, 0.3), (1.2, 0.1), (3.0, 0.5)])
def test_stationary_rolling_jams_for_mu_over_1(mu, eta):
    """omega_0^2 <= (g/R) mu(1 - eta)/(j + eta - mu eta(1 + j)) if that is positive, without end if
    not."""
    p = P.replace(mu=mu, eta=eta)
    divisor = p.j + eta - mu * eta * (1 + p.j)
    if divisor > 0:
        edge = np.sqrt(p.g / p.R * mu * (1 - eta) / divisor)
        ends = edge * np.array([1 - 1e-12, 1 + 1e-12])
        assert list(rolling_forces.margin(ends, p, ends) >= 0) == [True, False]
    else:
        ends = np.array([50.0, 500.0])
        assert np.all(rolling_forces.margin(ends, p, ends) >= 0)


def test_at_rest_and_without_friction():
    """B_x = 0 at omega_c = 0: in a driving flow spin-up begins in RS (eta <= 1)."""
    assert rolling_forces.margin(0.0, P, 1.0) < 0
    assert rolling_forces.margin(0.0, P, 0.0) >= 0
    assert rolling_forces.least_utilisation(0.0, P, 0.0).utilisation == 0
    for mu, eta, holds in (
        (0.0, 0.6, True),  # B_y alone keeps the spin axis turning: eta (1 + j - j) >= j
        (0.0, 0.3, False),
        (0.2, 0.0, True),  # A_x alone does, up to omega_0^2 = mu g/(j R)
        (0.0, 0.0, False),
    ):
        p = P.replace(mu=mu, eta=eta)
        assert (rolling_forces.least_utilisation(8.0, p, 8.0).utilisation <= 1) == holds


def test_public_forces_are_the_member_of_least_utilisation_where_there_is_one():
    x = np.array([[0, 0, omega_c, 0, 0, 0] for omega_c in (5.0, 12.0)])
    _, F_B = contact_forces(Case.RR, x, P, x[:, 2])
    best = rolling_forces.least_utilisation(x[:, 2], P, x[:, 2])
    np.testing.assert_array_equal(F_B[:, 1], best.B_y)
