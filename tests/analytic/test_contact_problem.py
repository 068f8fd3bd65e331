"""A solver of the contact problem obeys Coulomb's law at both contacts, also where friction locks
the ball."""

import math
import sys

import numpy as np
import pytest

from analytic.mechanics.contact_problem import EXACT, Closed, solve
from analytic.mechanics.rigid_body import NOTHING, Velocities, energy, slip_at_A, slip_at_B
from model import Parameters

P = Parameters.named("reference")
EPS = sys.float_info.epsilon


def assert_obeys(P_n, v_n, target, P_t, v_t, friction, tiny):
    """0 <= P_n, v_n >= target, one of them tight; friction in its disk, and against the slip
    (maximal dissipation)."""
    # below which digits are lost
    slip, limit, least = math.hypot(*v_t), friction * P_n, sys.float_info.min
    assert P_n >= 0
    assert v_n >= target - tiny
    assert P_n == 0 or v_n <= target + tiny
    assert math.hypot(*P_t) <= limit * (1 + 4 * EPS) + least
    # P_t . v_t = -limit |v_t|, in which v_t is uncertain.
    assert abs(np.dot(P_t, v_t) + limit * slip) <= limit * (2 * tiny + 4 * EPS * slip) + least


def assert_solves(u, A, B, p):
    """Solve, and check the conditions at both contacts."""
    after, impulse, settled = solve(Velocities(*u), A, B, p, NOTHING, EXACT)
    assert settled
    size = max(*map(abs, u[:3]), *(p.r * abs(o) for o in u[3:]), *(abs(P) / p.m for P in impulse))
    # What B still changes in the last sweep moves A by 1 + 1/j times that at most; and a dozen
    # roundings.
    tiny = (2 * (1 + 1 / p.j) * EXACT + 12 * EPS) * size
    assert_obeys(impulse[1], after[1], A.target, impulse[::2][:2], slip_at_A(after, p), p.mu, tiny)
    assert_obeys(impulse[3], after[0], B.target, impulse[4:], slip_at_B(after, p), p.eta, tiny)
    return after, impulse


@pytest.mark.parametrize(
    ("largest", "restitution"), [(0.9, 0.0), (20.0, 0.0), (0.999, 1.0), (1.5, 1.0)]
)
def test_a_thousand_random_problems(largest, restitution):
    """Any friction without restitution, and restitution wherever mu < 1 or eta < 1; speeds over
    three decades."""
    rng = np.random.default_rng(1)
    for _ in range(1000):
        mu, eta = rng.uniform(0, largest, 2)
        if restitution and min(mu, eta) >= 1:
            continue
        p = P.replace(mu=mu, eta=eta, j=rng.uniform(0.1, 2 / 3))
        u = tuple(
            (rng.normal(size=6) * 10 ** rng.uniform(-2, 1, 6) / ([1] * 3 + [p.r] * 3)).tolist()
        )
        e = rng.uniform(0, restitution)
        after, _ = assert_solves(u, Closed(max(0.0, -e * u[1])), Closed(max(0.0, -e * u[0])), p)
        assert e > 0 or energy(0.0, after, p) <= energy(0.0, u, p) * (1 + 1e-12)


def test_locked_in_the_corner():
    """Both frictions above one, and a fall into the corner along its bisector without spin.

    After a rebound both contacts would slip away from the corner, and friction pull the ball into
    it with mu P_n at each, more than the P_n that push it out. Rest needs no such thing. Frictions
    just below one lock the ball nearly: sweeps alone creep, for the impulses at both contacts all
    but balance each other."""
    p = P.replace(mu=0.993, eta=0.989, j=0.538)
    assert_solves((0.0, -0.0839, 0.1367, 27.66, -6.504, 9.0227), Closed(), Closed(), p)
    p, e, v = P.replace(mu=1.3, eta=1.3), 0.5, 0.4
    u = (-v, -v, 0.0, 0.0, 0.0, 0.0)
    assert not solve(Velocities(*u), Closed(e * v), Closed(e * v), p, NOTHING, EXACT)[2]
    after, _ = assert_solves(u, Closed(), Closed(), p)
    np.testing.assert_allclose(np.multiply(after, [1.0] * 3 + [p.r] * 3), 0.0, atol=4 * EPS)
