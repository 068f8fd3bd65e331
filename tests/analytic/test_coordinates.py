"""Rates, forces and margins of simulations, scalar and in coordinates of their own, are those of
the formulas for arrays of states."""

import cmath
import math

import numpy as np
import pytest

from analytic.mechanics import drag, dynamics, rigid_body, rolling_forces
from analytic.simulation import coordinates, equations, motion
from analytic.simulation.motion import HybridState
from analytic.simulation.settings import Settings
from model import Case, Contact, Flow, Parameters
from model.drag import LAWS
from model.kinematics import slip_velocities
from tests.random_motions import random_state

P = Parameters.named("reference").replace(omega_0=17.0, mu=0.3, eta=0.45, nu_f=1e-5)
FLOW = Flow.sine(17.0, 4.0, 1.5)
TIME = 0.3
SHARE = 1e-4
"""By how much coordinates change, relative to their size, for a derivative: by five points, which
leave its fourth power."""


def moments(case, p):
    """Moments with random states of a case."""
    rng = np.random.default_rng(int(case))
    for _ in range(20):
        x = random_state(case, rng, p)
        (A_x, _, A_z), (_, B_y, B_z) = slip_velocities(x.stacked(), p)
        alpha = math.atan2(-A_z, A_x) if case.A is Contact.S else math.nan
        beta = math.atan2(B_z, -B_y) if case.B is Contact.S else math.nan
        yield HybridState(TIME, rng.uniform(-3, 3), x, alpha, beta)


def begun(case, at, p):
    """The constants of a motion, its coordinates and their rates."""
    k = motion.of_ball(p, FLOW, Settings())
    z, scale = np.empty((2, coordinates.MOST))
    k, n = coordinates.begin(int(case), at, k, z, scale)
    rates = np.empty(n)
    equations.rates(TIME, z[:n], k, rates)
    return k, z[:n], scale[:n], rates


def derivative(of, span):
    """Of a function of time at 0."""
    return (8 * (of(span) - of(-span)) - (of(2 * span) - of(-2 * span))) / (12 * span)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("case", list(Case))
def test_rates_in_all_coordinates(case, law):
    """Also of the azimuth, and of the work of drag and friction, which is what energy changes
    by."""
    p = P.replace(drag=law)
    for at in moments(case, p):
        k, z, scale, rates = begun(case, at, p)

        def moved(t, at=at, k=k, z=z, rates=rates):
            return coordinates.hybrid_state(TIME + t, z + t * rates, at, k)

        def energy(t, moved=moved):
            x = moved(t).x
            return rigid_body.energy(x.y, rigid_body.velocities(x, p), p)

        span = SHARE / np.abs(rates / (scale + np.abs(z))).max()
        found = derivative(lambda t, moved=moved: moved(t).x.stacked(), span)
        expected = dynamics.vector_field(case, at.x.stacked(), p, FLOW(TIME))
        size = np.array([k.R, k.R / k.unit, 1 / k.unit, *[k.spin] * 3, k.R, k.R / k.unit])
        most = (size + np.abs(at.x.stacked())) * SHARE / span
        np.testing.assert_allclose((found - expected) / most, 0, atol=1e-9)
        turned = derivative(lambda t, moved=moved: cmath.exp(1j * moved(t).theta), span)
        azimuth = (turned / (1j * cmath.exp(1j * at.theta))).real
        assert azimuth == pytest.approx(at.x.omega_c, rel=1e-8)
        power = derivative(energy, span)
        assert rates[-1] == pytest.approx(power, rel=1e-8, abs=1e-8 * energy(0.0) * SHARE / span)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("case", [case for case in Case if case.B is not Contact.N])
def test_forces_at_the_wall(case, law):
    p, omega_0 = P.replace(drag=law), FLOW(TIME)
    for at in moments(case, p):
        k, *_ = begun(case, at, p)
        x, slips = at.x, [(math.sin(angle), math.cos(angle)) for angle in (at.alpha, at.beta)]
        c = equations.drag_rate(x.v_h, x.v_y, k.R * (x.omega_c - omega_0), k)
        assert c == pytest.approx(drag.of_velocity(x.v_h, x.v_y, k.R * (x.omega_c - omega_0), p))
        given = int(case), x.omega_c, x.v_y, x.slip_x, c, x.omega_c - omega_0
        mine = equations.forces(*given, *slips[0], *slips[1], k)
        if case is Case.RR:
            expected = dynamics.rolling_family(x.omega_c, p, omega_0, 0.0)
        else:
            expected = dynamics.forces(case, x, p, omega_0, *slips)
        error = 1e-12 * max(map(abs, mine))
        np.testing.assert_allclose(mine, np.array(expected, float), rtol=1e-12, atol=error)


@pytest.mark.parametrize(
    ("mu", "eta"), [(0.2, 0.6), (0.6, 0.2), (1.5, 0.3), (0.3, 1.5), (2.0, 2.0)]
)
@pytest.mark.parametrize("leaves", ["slip-stability", "infeasible"])
def test_where_rolling_at_both_points_ends(mu, eta, leaves):
    rng, p = np.random.default_rng(3), P.replace(mu=mu, eta=eta)
    k = motion.of_ball(p, FLOW, Settings(leave_rolling=leaves))
    margin = rolling_forces.margin if leaves == "infeasible" else rolling_forces.slip_margin
    omega_c = rng.uniform(-40, 40, 300)
    mine = [equations.rolls_on(each, TIME, k) for each in omega_c.tolist()]
    np.testing.assert_allclose(mine, margin(omega_c, p, FLOW(TIME)), rtol=1e-12, atol=1e-12)
