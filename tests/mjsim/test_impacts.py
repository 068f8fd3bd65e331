"""Landings: no rebound, the impulse of friction, and the other contact's answer, all within the step of the impact."""

import numpy as np
import pytest

import mjsim
from mjsim import ContactSettings
from model import Flow, Parameters

P = Parameters.named("reference").replace(omega_0=0.0, c=0.0)
STILL = Flow.steady(0.0)
HEIGHTS = 0.02 * np.linspace(1.0, 1.05, 8)
"""Falls that end at all phases of a time step."""


def after_landing(x0: list[float], timestep: float) -> tuple[float, np.ndarray]:
    """Speed at which the floor is hit from x0, by energy, and the states from a step after that on."""
    speed = np.sqrt(2 * P.g * x0[0] + x0[1] ** 2)
    lands = (speed + x0[1]) / P.g
    run = mjsim.simulate(P, x0, lands + 0.02, STILL, ContactSettings.at(timestep), sample_interval=timestep)
    return float(speed), run.x[run.time > lands + 1.5 * timestep]


@pytest.mark.parametrize("timestep", [1e-3, 2.5e-4])
@pytest.mark.parametrize("height", HEIGHTS)
def test_a_ball_that_falls_on_the_floor_stays_there(height: float, timestep: float) -> None:
    _, x = after_landing([height, 0, 0, 0, 0, 0, 0.02, 0], timestep)
    assert np.abs(x[:, 1]).max() < P.g * timestep  # m s-1: what gravity does in a step
    assert np.abs(x[:, 0]).max() < P.g * timestep**2


@pytest.mark.parametrize("height", HEIGHTS)
def test_friction_takes_its_share_of_the_impulse(height: float) -> None:
    """A spin too fast to be stopped: mu times the normal impulse pushes the ball and brakes the spin by 1/j as much."""
    timestep = 1e-3
    spin = 400.0
    speed, x = after_landing([height, 0, 0, 0, 0, spin, 0.02, 0], timestep)
    # Since the landing friction has acted for up to three steps, and the impulse is known to a step of gravity.
    slack = 4 * P.mu * P.g * timestep
    assert x[0, 7] == pytest.approx(-P.mu * speed, abs=slack)
    assert P.r * x[0, 5] == pytest.approx(P.r * spin - P.mu * speed / P.j, abs=slack / P.j)


@pytest.mark.parametrize("height", HEIGHTS)
def test_the_wall_answers_in_the_same_step(height: float) -> None:
    """Friction of the landing drives the ball into the wall, which it touches: no speed is left at either contact."""
    timestep = 1e-3
    speed, x = after_landing([height, 0, 0, 0, 0, 100.0, 0.0, 0], timestep)
    assert P.mu * speed > 0.1  # m s-1: what the wall would see a step late
    assert np.abs(x[:, [1, 7]]).max() < 2 * P.g * timestep


def test_the_batch_lands_as_a_single_run_does() -> None:
    sets = [P.replace(omega_0=12.0, c=1.0), Parameters.named("high-wall-friction").replace(omega_0=20.0)]
    x0s = [[0.02, -0.2, 12.0, 30, -10, 20, 0, 0], [0.01, 0, 10.0, 1, 2, 3, 0.002, -0.3]]
    settings = ContactSettings()
    many = mjsim.simulate_many(sets, x0s, 0.1, settings=settings, sample_interval=1e-3)
    for p, x0, run in zip(sets, x0s, many, strict=True):
        alone = mjsim.simulate(p, x0, 0.1, settings=settings, sample_interval=1e-3)
        assert np.any(alone.force_A[:, 1] > 0)
        np.testing.assert_allclose(run.x, alone.x, rtol=0, atol=1e-7)
