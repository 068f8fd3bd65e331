"""Simulations have the rates of vector fields and the motions and events of closed forms,
event-driven ones to 1e-9."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from analytic import contact_forces, simulate
from analytic.mechanics import rolling_forces
from model import Case, Flow, Parameters
from model.cases import TRAITS
from model.kinematics import VARIABLES

P = Parameters.named("reference")
RTOL = 1e-9


def changes(run):
    """(before, after) of every event."""
    codes = zip(run.events.from_case, run.events.to_case, strict=True)
    return [(Case(before), Case(after)) for before, after in codes]


def test_bounces_come_to_rest():
    """Bounces on the spot without drag: t_k = t_0 (1 + 2 e + … + 2 e^k), and rest at t_0
    (1+e)/(1-e)."""
    p, y, e = P.replace(c=0.0, omega_0=0.0), 0.04, 0.6
    run = simulate(p, [y, 0, 0, 0, 0, 0, 0.02, 0], 1.0, restitution=e, sample_interval=0.1)
    t_0, m_v = math.sqrt(2 * y / p.g), p.m * math.sqrt(2 * p.g * y)
    count = len(run.events)
    expected = t_0 * (1 + 2 * np.cumsum(np.append(0.0, e ** np.arange(1, count))))
    np.testing.assert_allclose(run.events.time, expected, rtol=RTOL)
    impulses = m_v * (1 + e) * e ** np.arange(count)
    np.testing.assert_allclose(run.events.impulse_A[:, 1], impulses, rtol=1e-6, atol=1e-12)
    assert run.events.time[-1] == pytest.approx(t_0 * (1 + e) / (1 - e), rel=RTOL)
    assert changes(run)[-1] == (Case.NN, Case.RN)


def test_rolling_ends_where_no_forces_are_left():
    """Where the margin of the cones is zero; SS sets in smoothly, its slip like (t - end)^2."""
    p = P.replace(omega_0=25.0)
    end = simulate(p, [0, 0, 9.0, 0, 0, 0], 1.0).events.time[0]
    run = simulate(p, [0, 0, 9.0, 0, 0, 0], end + 2e-3, sample_interval=end / 2 + 1e-3)
    assert changes(run) == [(Case.RR, Case.SS)]
    omega_c = 25 - 16 * math.exp(-p.c * end / (1 + 2 * p.j))
    assert rolling_forces.margin(omega_c, p) == pytest.approx(0.0, abs=RTOL)
    sooner = simulate(p, [0, 0, 9.0, 0, 0, 0], end + 1e-3).slip_z[-1]
    assert run.slip_z[-1] / sooner == pytest.approx(4.0, rel=0.05)


# the square of its step
@pytest.mark.parametrize(("method", "error"), [("event", 1e-9), ("time-stepping", 4e-6)])
@pytest.mark.parametrize(
    "flow",
    [
        Flow.ramp(8.0, 12.0, 1.0, 0.5),
        Flow.staircase([8.0, 10.0], 1.0),
        Flow.sampled([0.0, 1.0, 2.0], [8.0, 12.0, 10.0]),
        Flow.sines(8.0, [(2.0, 0.5, 0.0), (1.0, 3.0, 1.0)]),
    ],
    ids=lambda flow: getattr(flow, "kind", ""),
)
def test_rolling_follows_any_flow(flow, method, error):
    """By its linear equation (23)."""
    how = {"method": method, "timestep": 2e-3, "sample_interval": 0.05}
    run = simulate(P, [0, 0, 8.0, 0, 0, 0], 3.0, flow, **how)
    given = (lambda t, w: -P.c * (w - flow(t)) / (1 + 2 * P.j)), (0, 3), [8.0]
    expected = solve_ivp(*given, rtol=1e-11, atol=1e-12, max_step=0.01, t_eval=run.time)
    np.testing.assert_allclose(run.omega_c, expected.y[0], rtol=error)
    assert run.header.settings["energy_residual"] < RTOL * run.header.settings["energy_scale"]


def test_near_the_axis_is_an_ordinary_place():
    """A flight that passes 1e-7 m from the axis is a straight line (no drag), though omega_c is
    huge there."""
    p, miss, v, rho = P.replace(c=0.0), 1e-7, 0.2, 0.02
    radial, along = v * math.sqrt(1 - (miss / rho) ** 2), v * miss / rho
    x0 = [0.03, 0, along / rho, 0, 0, 0, p.R - rho, radial]
    run = simulate(p, x0, 0.07, sample_interval=0.001, theta_0=0.4)
    place, turn = (p.R - run.h) * np.exp(1j * run.theta), np.exp(0.4j)
    np.testing.assert_allclose(place, turn * (rho + (-radial + 1j * along) * run.time), atol=1e-11)


DRAGGED = P.replace(c=5.0, omega_0=0.0)
ROUGH = DRAGGED.replace(eta=0.6)


@pytest.mark.parametrize(
    ("p", "x", "flow", "before", "after", "left"),
    [
        (DRAGGED, [0, 0, 6.4, 20, 30, -150], Flow.steady(0.0), Case.SS, Case.SN, "B_x"),
        (
            DRAGGED,
            [0, 0, 0, 0, 3.0, 0, 0.03, 0],
            Flow.ramp(0, 100, 0.05),
            Case.RN,
            Case.SN,
            "friction of the floor",
        ),
        (
            ROUGH,
            [0.1, 0, 30, -100, 0, 0],
            Flow.ramp(30, -60, 0.2),
            Case.NR,
            Case.NS,
            "friction of the wall",
        ),
        (
            ROUGH.replace(mu=0.05),
            [0, 0, 22, -40, 0, 0],
            Flow.ramp(22, 60, 0.1),
            Case.SR,
            Case.NR,
            "A_y",
        ),
    ],
)
def test_a_case_ends_where_its_forces_do(p, x, flow, before, after, left):
    """Against the clock, too: a normal force that vanishes, or friction that is full, by
    `contact_forces`."""
    run = simulate(p, x, 0.3, flow, sample_interval=0.3)
    assert changes(run)[0] == (before, after)
    end = run.events.time[0]
    last = simulate(p, x, end, flow, sample_interval=end).x[-1]
    moves = VARIABLES if before is Case.RN else (*VARIABLES[:3], *TRAITS[before].active)
    kept = [name in moves for name in VARIABLES]
    (A_x, A_y, A_z), (B_x, B_y, B_z) = contact_forces(before, last * kept, p, flow(end))
    loads = {"A_y": A_y, "B_x": B_x}
    loads["friction of the floor"] = p.mu * A_y - math.hypot(A_x, A_z)
    loads["friction of the wall"] = p.eta * B_x - math.hypot(B_y, B_z)
    assert loads[left] == pytest.approx(0.0, abs=1e-7 * p.m * p.g)
