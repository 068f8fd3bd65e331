"""Each law of drag has the coefficient of its source, and time stepping moves by it as the event-driven simulation."""

import math

import numpy as np
import pytest

from analytic import simulate
from analytic.mechanics import drag
from model import Case, Parameters
from model.drag import LAWS
from tests.drag_laws import BALL, BY_LAW, resistance


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("Re", [1e-6, 0.3, 50.0, 800.0, 985.0, 1200.0, 1e5])
def test_the_drag_is_that_of_its_coefficient(law, Re):
    p = BY_LAW[law]
    speed = Re * p.nu_f / (2 * p.r)
    force = p.m * float(resistance(speed, p)) * speed
    assert p.m * drag.coefficient(speed, p) * speed == pytest.approx(force, rel=1e-12)
    assert drag.reynolds(speed, p) == pytest.approx(Re, rel=1e-14)
    assert drag.speed_of(force / p.m, p) == pytest.approx(speed, rel=1e-12)
    step = 1e-100  # derivatives by complex steps, exact
    whole = np.complex128(speed + 1j * step)
    assert drag.slope(speed, p) == pytest.approx((drag.coefficient(whole, p) * whole).imag / step, rel=1e-12)


def test_the_drag_is_half_the_dynamic_pressure_times_area_and_coefficient():
    """And the speed relative to the fluid has three components; Stokes' law is what it was."""
    for zero in (0.0, np.array([0.0])):
        assert drag.speed(zero + 2.0, zero + 3.0, zero + 6.0) == 7.0
    assert drag.coefficient(0.3, BALL) == drag.rate(0.3, drag.law(BALL)) == BALL.c
    assert drag.speed_of(0.3, BALL) == 0.3 / BALL.c
    assert math.isnan(drag.reynolds(0.3, Parameters.named("reference")))
    p, rho_f, speed = BY_LAW["quadratic"], 998.2, 0.7
    force = rho_f / 2 * speed**2 * math.pi * p.r**2 * p.C_D
    assert p.m * drag.coefficient(speed, p) * speed == pytest.approx(force, rel=1e-13)


@pytest.mark.parametrize("law", LAWS)
def test_arrays_and_floats_agree_and_rest_has_no_drag(law):
    p, speeds = BY_LAW[law], np.array([0.0, 1e-9, 0.01, 0.5])
    for function in (drag.coefficient, drag.slope):
        each = [function(speed, p) for speed in speeds.tolist()]
        assert np.broadcast_to(function(speeds, p), 4) == pytest.approx(each, rel=1e-15)
    assert drag.speed_of(0.0, p) == 0.0
    assert drag.speed_of(drag.coefficient(speeds, p) * speeds, p) == pytest.approx(speeds, rel=1e-14)
    assert drag.speed_of([0.0, 1.0], p.replace(c=0.0)).tolist() == [0.0, math.inf]


def test_a_law_without_a_formula_is_not_taken_for_another(monkeypatch):
    monkeypatch.setattr("model.drag.LAWS", (*LAWS, "oseen"))
    with pytest.raises(KeyError, match="oseen"):
        drag.coefficient(0.3, BALL.replace(drag="oseen"))


@pytest.mark.parametrize(("nu_f", "rho_f", "rho_b", "r"), [(1e-6, 998.0, 7850.0, 5e-3), (1e-3, 1260.0, 2500.0, 8e-3)])
def test_a_ball_with_the_drag_10_sinks_at_stokes_speed(nu_f, rho_f, rho_b, r):
    speed = drag.sinking_speed(nu_f=nu_f, rho_f=rho_f, rho_b=rho_b, r=r, gravity=9.81)
    p = Parameters.from_fluid(nu_f=nu_f, rho_f=rho_f, rho_b=rho_b, r=r, R=5 * r, mu=0.2, eta=0.2, gravity=9.81)
    assert p.m * p.c * speed == pytest.approx(p.m * p.g, rel=1e-14)
    assert 6 * math.pi * nu_f * rho_f * r * speed == pytest.approx(p.m * p.g, rel=1e-14)


@pytest.mark.parametrize("law", LAWS)
def test_slipping_converges_with_the_square_of_the_step(law):
    """SS without a change of case: errors of two steps, four to one, against the event-driven simulation."""
    p = BY_LAW[law].replace(mu=0.15, eta=0.15, omega_0=20.0)
    start, t_end = [0, 0, 13.0, -20.0, -5.0, 22.0], 0.08
    exact = simulate(p, start, t_end, rtol=1e-12)
    assert set(exact.cases) == {Case.SS}
    errors = [
        simulate(p, start, t_end, method="time-stepping", timestep=step, sample_interval=0.01).omega_c[-1]
        - exact.omega_c[-1]
        for step in (1e-3, 5e-4)
    ]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)
