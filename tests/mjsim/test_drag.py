"""MuJoCo moves under each law of drag by the force of its source, and in no step too long for it."""

import numpy as np
import pytest

import analytic
import mjsim
from mjsim import ContactSettings, engine
from mjsim.corrections import Ball, resistance
from model import Flow, InputError
from model.drag import LAWS
from tests import drag_laws
from tests.drag_laws import BY_LAW


@pytest.mark.parametrize("law", LAWS)
def test_the_force_is_that_of_the_law(law):
    p = BY_LAW[law]
    ball = Ball.of(p, ContactSettings.at(1e-3))
    w = np.random.default_rng(3).normal(size=(3, 200)) * 10.0 ** np.linspace(-7, 1, 200)
    speeds = np.linalg.norm(w, axis=0)
    assert np.ptp(np.log10(2 * p.r * speeds / p.nu_f)) > 7
    force = resistance(*w, ball)
    np.testing.assert_allclose(force, p.m * drag_laws.resistance(speeds, p), rtol=1e-13)
    assert [resistance(*one, ball) for one in w.T.tolist()] == pytest.approx(force.tolist(), rel=1e-14)


def test_a_law_without_a_formula_is_not_taken_for_another(monkeypatch):
    monkeypatch.setattr("model.drag.LAWS", (*LAWS, "oseen"))
    with pytest.raises(KeyError, match="oseen"):
        Ball.of(drag_laws.BALL.replace(drag="oseen"), ContactSettings())


@pytest.mark.parametrize("law", LAWS)
def test_slipping_converges_with_the_square_of_the_step(law):
    """Each variable's error against the event-driven simulation is less than a quarter at half the step."""
    p, x = BY_LAW[law].replace(mu=0.15, eta=0.15, omega_0=20.0), [0, 0, 13.0, -20.0, -5.0, 22.0]
    exact = analytic.simulate(p, x, 0.08, rtol=1e-12).x[-1]
    coarse, fine = (
        mjsim.simulate(p, x, 0.08, settings=ContactSettings.for_problem(p, h), sample_interval=0.02).x[-1] - exact
        for h in (2e-4, 1e-4)
    )
    assert np.all(np.abs(coarse[2:6]) > 1e-7)
    assert np.all(np.abs(fine[2:6]) < np.abs(coarse[2:6]) / 3.8)


def test_a_step_too_long_for_the_drag_is_refused():
    p = BY_LAW["quadratic"].replace(omega_0=1.0, c=5.0)
    stiff = 2 * float(drag_laws.resistance(p.R * p.omega_0, p))
    with pytest.raises(InputError, match=r"must be <= .* half of 1/\(2 c\(R omega_0\)\)"):
        engine.check_timestep(0.51 / stiff, p, Flow.steady(1.0), 1.0)
    engine.check_timestep(0.49 / stiff, p, Flow.steady(1.0), 1.0)
