"""The coordinates of each case move as the vector field says, by the chain rule and central differences."""

import math

import numpy as np
import pytest

from analytic import contact_forces, vector_field
from analytic.mechanics.rigid_body import energy, velocities
from analytic.simulation import charts, equations, motion
from analytic.simulation.settings import Settings
from model import Case, Contact, Parameters, State
from model.cases import TRAITS
from model.drag import LAWS
from model.kinematics import VARIABLES, slip_velocities
from tests.directions import slip_directions
from tests.drag_laws import resistance

P = Parameters.named("reference").replace(omega_0=17.0, mu=0.3, eta=0.45)
RAMP = motion.Fluid(0.0, P.omega_0, 3.0)


def moment(case, seed):
    """A random state of the case."""
    rng = np.random.default_rng(seed)
    values = dict(zip(VARIABLES, rng.normal(size=8) * [0.1, 0.3, 10, 20, 20, 20, 0, 0.3], strict=True))
    values |= {"y": abs(values["y"]), "h": P.R * rng.uniform(0.1, 0.9)}
    x = [values[name] if name in TRAITS[case].active else 0.0 for name in VARIABLES]
    if case is Case.RN:
        x[5] = -x[7] / P.r
    alpha, beta = slip_directions(np.array(x), P)
    return motion.Moment(
        0.3,
        1.1,
        State(*x),
        float(alpha) if case.A is Contact.S else math.nan,
        float(beta) if case.B is Contact.S else math.nan,
    )


class Chart:
    """The coordinates of a case."""

    def __init__(self, case, at, p):
        z, scale = np.zeros(charts.MOST), np.zeros(charts.MOST)
        self.at = at
        self.k, n = charts.begin(case, at, motion.of_ball(p, RAMP, Settings()), z, scale)
        self.start, self.scale = z[:n], scale[:n]

    def rates(self):
        out = np.zeros(len(self.start))
        equations.rates(self.at.time, self.start.tolist(), self.k, out)
        return out

    def path(self, t, z):
        """Moments at times (n,) from coordinates (k, n), their states (n, 8)."""
        m = charts.moment(t, z, self.at, self.k)
        theta, alpha, beta, work = (np.broadcast_to(each, t.shape) for each in (m.theta, m.alpha, m.beta, m.work))
        return motion.Moment(t, np.unwrap(np.append(self.at.theta, theta))[1:], m.x.stacked(), alpha, beta, work)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("case", list(Case))
def test_rates_are_those_of_the_vector_field(case, law):
    p = P.replace(drag=law, nu_f=1e-5)
    for seed in range(20):
        at = moment(case, seed)
        chart = Chart(case, at, p)
        rate = chart.rates()
        step = 1e-7
        t, z = at.time + step * np.array([-1.0, 0, 1]), chart.start[:, None]
        path = chart.path(t, z + step * rate[:, None] * np.array([-1.0, 0, 1]))
        np.testing.assert_allclose(path.x[1], at.x, rtol=0, atol=1e-14 * np.max(np.abs(at.x)))
        slope = (path.x[2] - path.x[0]) / (2 * step)
        expected = vector_field(case, path.x[1], p, RAMP(at.time))
        # Differences err by round-off/step, and by step^2 times third derivatives; angles turn at some 1e3 rad/s.
        np.testing.assert_allclose(slope, expected, rtol=1e-6, atol=1e-6 * np.max(np.abs(expected)))
        assert (path.theta[2] - path.theta[0]) / (2 * step) == pytest.approx(at.x[2], rel=1e-6)
        change = energy(0.0, velocities(path.x[2], P), P) - energy(0.0, velocities(path.x[0], P), P)
        change += P.m * P.g * (path.x[2][0] - path.x[0][0])
        rho, (_, v_y, omega_c, *_, v_h) = P.R - at.x[6], at.x
        lag = rho * (omega_c - RAMP(at.time))
        power = -P.m * resistance(math.hypot(v_h, v_y, lag), p) * (v_h**2 + v_y**2 + rho * omega_c * lag)
        if case is not Case.RR:
            forces = contact_forces(case, path.x[1], p, RAMP(at.time))
            power += sum(float(np.sum(f * v)) for f, v in zip(forces, slip_velocities(path.x[1], P), strict=True))
        largest = max(abs(power), P.m * P.g * P.R * 10)
        assert (path.work[2] - path.work[0]) / (2 * step) == pytest.approx(power, abs=1e-6 * largest)
        assert change / (2 * step) == pytest.approx(power, abs=1e-6 * largest)


@pytest.mark.parametrize("case", [Case.SS, Case.NS, Case.SN])
def test_vanishing_slip_has_a_direction(case):
    """At the onset the state has no slip; the chart starts with the direction given, and its slip grows from zero."""
    at = moment(case, 3)
    x = at.x
    if case.A is Contact.S:
        x = x._replace(slip_x=0.0, slip_z=-(x.v_h + x.v_y) / P.r)
    if case.B is Contact.S:
        x = x._replace(slip_y=0.0, slip_z=0.0)
    at = motion.Moment(at.time, at.theta, x, at.alpha, at.beta)
    chart = Chart(case, at, P)
    assert charts.least_slip(chart.start, chart.scale, case) == pytest.approx(0.0, abs=1e-15)
    path = chart.path(np.array([at.time]), chart.start[:, None])
    for given, kept in ((at.alpha, path.alpha[0]), (at.beta, path.beta[0])):
        if not math.isnan(given):
            assert math.cos(given - kept) == pytest.approx(1.0, abs=1e-14)
    assert np.all(np.isfinite(chart.rates()))
