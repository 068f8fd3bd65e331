"""The event-driven simulation has the motions and events of closed forms, to its tolerance of 1e-9."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from analytic import contact_forces, simulate
from analytic.mechanics import rolling_forces
from analytic.simulation import hybrid, integrator
from model import Case, Flow, Parameters, SimulationError
from model.cases import TRAITS
from model.kinematics import VARIABLES

P = Parameters.named("reference")
RTOL = 1e-9


def states_of(trajectory):
    """(from, to) of every event."""
    return [(Case(a), Case(b)) for a, b in zip(trajectory.events.from_case, trajectory.events.to_case, strict=True)]


def balance(trajectory):
    return trajectory.header.settings["energy_residual"] / trajectory.header.settings["energy_scale"]


# --- closed forms -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("method", "slack"), [("event", 0.0), ("time-stepping", 1.01e-4)])
def test_sliding_ball_on_the_floor(method, slack):
    """Without fluid a ball that slides with v rolls with v/(1+j) after v/(mu g (1 + 1/j)) seconds, within a step."""
    p, v, h = P.replace(c=0.0), 0.05, 0.03
    x0 = [0, 0, v / (p.R - h), -v / p.r, v / p.r, 0, h, 0]  # no spin at all, along k
    run = simulate(p, x0, 0.2, method=method, timestep=1e-4, sample_interval=1e-3)
    assert states_of(run)[0] == (Case.SN, Case.RN)
    assert run.events.time[0] == pytest.approx(v / (p.mu * p.g * (1 + 1 / p.j)), rel=RTOL, abs=slack)
    speed = np.hypot((p.R - run.h) * run.omega_c, run.v_h)[run.time > run.events.time[0] + slack]
    np.testing.assert_allclose(speed, v / (1 + p.j), rtol=1e-11 if slack else RTOL)
    assert balance(run) < RTOL


def test_bounces_come_to_rest():
    """Bounces on the spot without drag: t_k = t_0 (1 + 2 e + … + 2 e^k), and rest at t_0 (1+e)/(1-e)."""
    p, y, e = P.replace(c=0.0, omega_0=0.0), 0.04, 0.6
    run = simulate(p, [y, 0, 0, 0, 0, 0, 0.02, 0], 1.0, restitution=e, sample_interval=0.1)
    t_0, m_v = math.sqrt(2 * y / p.g), p.m * math.sqrt(2 * p.g * y)
    count = len(run.events)
    expected = t_0 * (1 + 2 * np.cumsum(np.append(0.0, e ** np.arange(1, count))))
    np.testing.assert_allclose(run.events.time, expected, rtol=RTOL)
    np.testing.assert_allclose(run.events.impulse_A[:, 1], m_v * (1 + e) * e ** np.arange(count), rtol=1e-6, atol=1e-12)
    assert run.events.time[-1] == pytest.approx(t_0 * (1 + e) / (1 - e), rel=RTOL)
    assert states_of(run)[-1] == (Case.NN, Case.RN)
    assert balance(run) < RTOL


def test_spin_up_from_rest():
    """From rest the ball slips at the wall while it rolls on the floor; (24) is a Riccati equation.

    With a = c/(1+j): omega_c = phi'/(eta phi), phi = exp(-a t/2)(cosh(q t/2) + a/q sinh(q t/2)), q^2 = a^2 +
    4 eta a omega_0; w_y = R/r (omega_c - eta (1+j)/j int omega_c^2), eta omega_c^2 = a (omega_0 - omega_c) - omega_c'.
    """
    p = P.replace(omega_0=12.0)
    a = p.c / (1 + p.j)
    q = math.sqrt(a**2 + 4 * p.eta * a * p.omega_0)

    def omega_c(t):
        return 2 * a * p.omega_0 * math.tanh(q * t / 2) / (q + a * math.tanh(q * t / 2))

    def w_y(t):
        log_phi = -a * t / 2 + math.log(math.cosh(q * t / 2) + a / q * math.sinh(q * t / 2))
        eta_square = a * (p.omega_0 * t - log_phi / p.eta) - omega_c(t)
        return p.R / p.r * (omega_c(t) - (1 + p.j) / p.j * eta_square)

    run = simulate(p, np.zeros(6), 1.5, sample_interval=0.01)
    assert states_of(run) == [(Case.RS, Case.RR)]
    end = brentq(w_y, 0.3, 2.0, xtol=1e-15)
    assert run.events.time[0] == pytest.approx(end, rel=RTOL)
    slipping = run.time < end
    np.testing.assert_allclose(run.omega_c[slipping], [omega_c(t) for t in run.time[slipping]], atol=RTOL * 12)
    np.testing.assert_allclose(run.slip_y[slipping], [w_y(t) for t in run.time[slipping]], atol=RTOL * 60)
    assert balance(run) < RTOL


def test_rolling_ends_where_no_forces_are_left():
    """RR: omega_c by its exponential up to the event, where the margin of the cones is zero; SS sets in smoothly."""
    p = P.replace(omega_0=25.0)
    run = simulate(p, [0, 0, 9.0, 0, 0, 0], 1.0, sample_interval=0.01)
    assert states_of(run) == [(Case.RR, Case.SS)]
    end = run.events.time[0]
    omega_c = 25.0 - 16.0 * math.exp(-p.c * end / (1 + 2 * p.j))
    assert rolling_forces.margin(omega_c, p) == pytest.approx(0.0, abs=RTOL)
    before = run.time < end
    np.testing.assert_allclose(run.omega_c[before], 25 - 16 * np.exp(-run.time[before] / 1.8), rtol=RTOL)
    # Just after the end slip grows from zero: its second derivative is finite, so w_z is of order (t - end)^2.
    soon = simulate(p, [0, 0, 9.0, 0, 0, 0], end + 2e-3, sample_interval=1e-3).slip_z[-1]
    sooner = simulate(p, [0, 0, 9.0, 0, 0, 0], end + 1e-3, sample_interval=1e-3).slip_z[-1]
    assert soon / sooner == pytest.approx(4.0, rel=0.05)


DRAGGED = P.replace(c=5.0, omega_0=0.0)
LIMITS = {
    "the wall opens": (DRAGGED, [0, 0, 6.4, 20, 30, -150], None, Case.SS, Case.SN),
    "the floor slips off the wall": (DRAGGED, [0, 0, 0, 0, 3.0, 0, 0.03, 0], Flow.ramp(0, 100, 0.05), Case.RN, Case.SN),
    "the wall slips": (DRAGGED.replace(eta=0.6), [0.1, 0, 30, -100, 0, 0], Flow.ramp(30, -60, 0.2), Case.NR, Case.NS),
    "the floor lets go": (
        DRAGGED.replace(eta=0.6, mu=0.05),
        [0, 0, 22, -40, 0, 0],
        Flow.ramp(22, 60, 0.1),
        Case.SR,
        Case.NR,
    ),
}


@pytest.mark.parametrize("name", LIMITS)
def test_a_case_ends_where_its_forces_do(name):
    """Against the clock, too: a normal force that vanishes, or friction that is full, by `contact_forces`."""
    p, x, flow, before, after = LIMITS[name]
    flow = flow or Flow.steady(p.omega_0)
    end = simulate(p, x, 0.3, flow, sample_interval=0.3).events.time[0]
    run = simulate(p, x, end, flow, sample_interval=end)
    assert states_of(run)[:1] in ([(before, after)], [])
    last = run.x[-1] * [
        name in VARIABLES[:3] or name in TRAITS[before].active or before is Case.RN for name in VARIABLES
    ]
    (A_x, A_y, A_z), (B_x, B_y, B_z) = contact_forces(before, last, p, flow(end))
    left = {"A": p.mu * A_y - math.hypot(A_x, A_z), "B": p.eta * B_x - math.hypot(B_y, B_z)}
    load = {"the wall opens": B_x, "the floor lets go": A_y}.get(name, left["A" if before is Case.RN else "B"])
    assert load == pytest.approx(0.0, abs=1e-7 * p.m * p.g)


# --- stationary solutions, flows, solvers ------------------------------------------------------------------


def test_flows_of_several_pieces():
    """RR through two levels and ramps, and through waves: omega_c follows its linear equation; a jump at its moment."""
    p = P.replace(omega_0=0.0)
    for flow in (Flow.sampled([0.0, 1.0, 2.0], [8.0, 12.0, 10.0]), Flow.sines(8.0, [(2.0, 0.5, 0.0), (1.0, 3.0, 1.0)])):
        run = simulate(p, [0, 0, 8.0, 0, 0, 0], 3.0, flow, sample_interval=0.05)
        given = (lambda t, w, flow=flow: -p.c * (w - flow(t)) / (1 + 2 * p.j)), (0, 3), [8.0]
        plain = solve_ivp(*given, rtol=1e-11, atol=1e-12, max_step=0.01, t_eval=run.time)
        np.testing.assert_allclose(run.omega_c, plain.y[0], rtol=1e-8)
    assert balance(run) < RTOL
    stairs = simulate(p, [0, 0, 10.0, 0, 0, 0], 3.0, Flow.staircase([10.0, 25.0], 1.0), sample_interval=0.05)
    assert np.all(stairs.omega_c[stairs.time <= 1] == 10.0)
    assert stairs.omega_c[-1] > 12


def test_a_jump_of_the_flow_ends_rolling_at_once():
    """When the fluid jumps so far that no forces can hold RR, slip sets in at the jump itself."""
    p = P.replace(c=5.0, omega_0=10.0)
    run = simulate(p, [0, 0, 10.0, 0, 0, 0], 1.0, Flow.staircase([10.0, 60.0], 0.5), sample_interval=0.01)
    assert rolling_forces.margin(10.0, p, 60.0) < 0
    assert run.events.time[0] == 0.5
    assert run.events.from_case[0] == Case.RR


def test_near_the_axis_is_an_ordinary_place():
    """A flight that passes 1e-7 m from the axis is a straight line (no drag), though omega_c is huge there."""
    p = P.replace(c=0.0)
    miss, v = 1e-7, 0.2
    rho = 0.02
    radial, along = v * math.sqrt(1 - (miss / rho) ** 2), v * miss / rho
    x0 = [0.03, 0, along / rho, 0, 0, 0, p.R - rho, radial]
    run = simulate(p, x0, 0.07, sample_interval=0.001, theta_0=0.4)
    place = (p.R - run.h) * np.exp(1j * run.theta)
    start = rho * np.exp(0.4j)
    velocity = np.exp(0.4j) * (-radial + 1j * along)
    np.testing.assert_allclose(place, start + velocity * run.time, atol=1e-11)


def failing(method, at):
    """A solver of scipy that breaks off at some steps."""

    class Fails(method):
        steps = 0

        def step(self):
            Fails.steps += 1
            if Fails.steps in at:
                self.status = "failed"
                return "step size below spacing of numbers"
            return super().step()

    return Fails


@pytest.mark.parametrize("name", ["BDF", "LSODA"])
def test_a_solver_that_fails_gives_way_to_the_other(name, monkeypatch):
    """The same motion, through RR and the onset of SS; where both fail for ever, the run ends."""
    given = P.replace(omega_0=25.0), [0, 0, 9.0, 0, 0, 0], 1.5
    right, solvers = (
        simulate(*given, sample_interval=0.1),
        {each: getattr(integrator, each) for each in ("BDF", "LSODA")},
    )
    monkeypatch.setattr(hybrid, "compiled", lambda: None)
    with monkeypatch.context() as patch:
        patch.setattr(integrator, name, fails := failing(solvers[name], (10, 30, 31, 60)))
        run = simulate(*given, sample_interval=0.1)
        assert fails.steps >= 10
        np.testing.assert_allclose(run.x, right.x, rtol=0, atol=1e-7 * 25.0)
    for each, solver in solvers.items():
        monkeypatch.setattr(integrator, each, failing(solver, range(10**9)))
    with pytest.raises(SimulationError, match="steps become too short"):
        simulate(given[0], [0, 0, 9.0, 3, 2, -3], 1.5)
