"""Theory and MuJoCo move under each law of drag by the force of its source, and in no step too long
for it."""

import math

import numpy as np
import pytest

import analytic
import mjsim
from analytic.mechanics import drag
from mjsim import RigidContacts, engine
from mjsim.mid_step import BallConstants
from mjsim.mid_step import resistance as in_mujoco
from model import Flow, InputError, Parameters, State
from model.drag import LAWS
from tests.drag_laws import BALL, BY_LAW, resistance


@pytest.mark.parametrize("law", LAWS)
def test_the_force_in_mujoco_is_that_of_the_law(law):
    p = BY_LAW[law]
    ball = BallConstants.of(p)
    w = np.random.default_rng(3).normal(size=(3, 200)) * 10.0 ** np.linspace(-7, 1, 200)
    speeds = np.linalg.norm(w, axis=0)
    assert np.ptp(np.log10(2 * p.r * speeds / p.nu_f)) > 7
    force = in_mujoco(*w, ball)
    np.testing.assert_allclose(force, p.m * resistance(speeds, p), rtol=1e-13)
    assert [in_mujoco(*one, ball) for one in w.T.tolist()] == pytest.approx(
        force.tolist(), rel=1e-14
    )


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


@pytest.mark.parametrize("ask", [lambda p: drag.coefficient(0.3, p), lambda p: BallConstants.of(p)])
def test_a_law_without_a_formula_is_not_taken_for_another(ask, monkeypatch):
    monkeypatch.setattr("model.drag.LAWS", (*LAWS, "oseen"))
    with pytest.raises(KeyError, match="oseen"):
        ask(BALL.replace(drag="oseen"))


@pytest.mark.parametrize("law", LAWS)
def test_slipping_converges_with_the_square_of_the_step(law):
    """Errors against the event-driven simulation are a tenth, nearly, at a quarter of the step."""
    p, x = BY_LAW[law].replace(mu=0.15, eta=0.15, omega_0=20.0), [0, 0, 13.0, -20.0, -5.0, 22.0]
    exact = analytic.simulate(p, x, 0.08, rtol=1e-12).x[-1]
    coarse, fine = (
        mjsim.simulate(p, x, 0.08, settings=RigidContacts(timestep=h), sample_interval=0.02).x[-1]
        - exact
        for h in (4e-4, 1e-4)
    )
    assert np.abs(coarse[2:6]).max() > 1e-7
    assert np.abs(fine[2:6]).max() < np.abs(coarse[2:6]).max() / 9


def test_a_step_too_long_for_the_drag_is_refused():
    p = BY_LAW["quadratic"].replace(omega_0=1.0, c=5.0)
    stiff = 2 * float(resistance(p.R * p.omega_0, p))
    with pytest.raises(InputError, match=r"must be <= .* half of 1/\(2 c\(R omega_0\)\)"):
        engine.check_timestep(0.51 / stiff, p, Flow.steady(1.0), 1.0, State())
    engine.check_timestep(0.49 / stiff, p, Flow.steady(1.0), 1.0, State())
