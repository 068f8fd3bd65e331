"""Coulomb's law at two contacts: the conditions that define the solution, and a contact alone in closed form."""

from __future__ import annotations

import math
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analytic.contact_problem import Closed, NotConvergedError, solve
from analytic.rigid_body import contact_work, energy, mean, slip_at_A, slip_at_B, state, turned, velocities
from model import Parameters
from model.kinematics import slip_velocities

P = Parameters.named("reference")
TOLERANCE = 1e-13
"""What is asked of the solver here, relative to the velocities; the sweeps may leave some hundred times that."""

speeds = st.tuples(*[st.floats(-2, 2)] * 3, *[st.floats(-200, 200)] * 3)
frictions = st.floats(0.0, 0.9)
inertias = st.floats(0.1, 2 / 3)


def assert_obeys(P_n, v_n, target, P_t, v_t, friction, tiny):
    """0 <= P_n, v_n >= target, one of them tight; friction in its disk, and against the slip if there is one."""
    slip, limit = math.hypot(*v_t), friction * P_n
    assert P_n >= 0
    assert v_n >= target - tiny
    assert P_n / P.m * (v_n - target) <= tiny * (1 + P_n / P.m)
    assert math.hypot(*P_t) <= limit * (1 + 1e-15) + sys.float_info.min  # below that, digits are lost
    # Maximal dissipation: P_t . v_t = -limit |v_t|.
    assert P_t[0] * v_t[0] + P_t[1] * v_t[1] == pytest.approx(-limit * slip, abs=tiny * (P.m * slip + limit))


@given(speeds, frictions, frictions, inertias, st.floats(0, 1))
@settings(max_examples=200, deadline=None)
def test_both_contacts_obey_coulomb(u, mu, eta, j, e):
    p = P.replace(mu=mu, eta=eta, j=j)
    A, B = Closed(max(0.0, -e * u[1])), Closed(max(0.0, -e * u[0]))
    after, impulse = solve(u, A, B, p, tolerance=TOLERANCE)
    scale = max(map(abs, (*u[:3], *(p.r * o for o in u[3:]))))
    tiny = 1e3 * TOLERANCE * scale + 1e-300
    assert_obeys(impulse[1], after[1], A.target, impulse[::2][:2], slip_at_A(after, p), mu, tiny)
    assert_obeys(impulse[3], after[0], B.target, impulse[4:], slip_at_B(after, p), eta, tiny)
    if e == 0:
        assert energy(0.0, after, p) <= energy(0.0, u, p) * (1 + 1e-12)


@given(speeds, st.floats(0, 2), st.floats(0, 1))
@settings(max_examples=100, deadline=None)
def test_impact_on_the_floor_alone(u, mu, e):
    """Normal and tangential impulses decouple: p_n = (1+e) m |v_n|, p_t = min(mu p_n, m_t |slip|) against the slip."""
    p = P.replace(mu=mu)
    u = (u[0], -abs(u[1]), *u[2:])
    after, impulse = solve(u, Closed(-e * u[1]), None, p)
    slip = np.array(slip_at_A(u, p))
    size = math.hypot(*slip)
    p_n = (1 + e) * p.m * abs(u[1])
    p_t = min(mu * p_n, p.m * p.j / (1 + p.j) * size)
    assert impulse[1] == pytest.approx(p_n, rel=1e-14)
    np.testing.assert_allclose(
        impulse[::2][:2], -p_t * slip / size if size else 0 * slip, atol=1e-14 * p.m * (size + 1)
    )
    assert impulse[3:] == (0, 0, 0)
    assert after[1] == pytest.approx(-e * u[1], abs=1e-14 * abs(u[1]))


def test_a_ball_that_rolls_into_the_wall_hops():
    """The wall meets a ball that rolls towards it with a spin that climbs: B_y = min(eta m v, m_t v) upwards."""
    v = 0.3
    u = (-v, 0.0, 0.0, 0.0, 0.0, v / P.r)
    after, impulse = solve(u, Closed(), Closed(), P)
    assert slip_at_A(u, P) == (0.0, 0.0)
    assert impulse[4] == pytest.approx(min(P.eta, P.j / (1 + P.j)) * P.m * v, rel=1e-12)
    assert after[1] > 0
    assert impulse[:3] == (0.0, 0.0, 0.0)


@given(speeds, speeds, frictions, frictions)
@settings(max_examples=50, deadline=None)
def test_work_of_impulses_is_the_change_of_energy(u, guess, mu, eta):
    p = P.replace(mu=mu, eta=eta)
    after, impulse = solve(u, Closed(), Closed(), p)
    before_J, after_J = energy(0.0, u, p), energy(0.0, after, p)
    work = contact_work(mean(u, after), impulse, p)
    assert after_J - before_J == pytest.approx(work, abs=1e-13 * (before_J + after_J))


def test_giving_up_says_so():
    with pytest.raises(NotConvergedError, match="after 1 sweeps"):
        solve((-1.0, -1.0, 0.3, 10.0, -20.0, 5.0), Closed(), Closed(), P, max_sweeps=1)


@given(speeds, st.floats(-4, 4), st.floats(0, 0.04))
@settings(max_examples=50, deadline=None)
def test_velocities_and_state_are_inverse(u, angle, h):
    x = state(0.1, h, u, P)
    np.testing.assert_allclose(velocities(x, P), u, atol=1e-12 * 200)
    v_A, v_B = slip_velocities(np.array(x), P)
    np.testing.assert_allclose(np.array(slip_at_A(u, P)), v_A[[0, 2]], atol=1e-12)
    np.testing.assert_allclose(np.array(slip_at_B(u, P)), v_B[[1, 2]], atol=1e-12)
    np.testing.assert_allclose(turned(turned(u, angle), -angle), u, atol=1e-12 * 200)
