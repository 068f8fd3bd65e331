"""MuJoCo against the event-driven simulation through landings, slip, stick and lift-off: both at first order."""

from __future__ import annotations

import numpy as np
import pytest

import analytic
import mjsim
from mjsim import ContactSettings
from model import Parameters, Trajectory

P = Parameters.named("reference")
MOTIONS = {
    "slides down the wall, lands, slips at both points, sticks": [0.02, -0.2, 12.0, 30, -10, 20, 0, 0],
    "slides on the floor, hits the wall, is lifted, lands, sticks": [0, 0, 10.0, 1, 2, 3, 0.002, -0.3],
    "falls, rolls on the floor, hits the wall, hops, slips, rolls": [0.01, 0, 3.0, 0, 0, 0, 0.02, 0],
}
LASTS = 0.7


def follow(x0: list[float], timestep: float) -> Trajectory:
    settings = ContactSettings.at(timestep)
    return mjsim.simulate(P, x0, LASTS, settings=settings, sample_interval=timestep)


@pytest.mark.parametrize("motion", MOTIONS)
def test_the_motion_converges(motion: str) -> None:
    exact = analytic.simulate(P, MOTIONS[motion], LASTS, sample_interval=0.01)
    # A jump is a step early or late: that is what the next test is about.
    away = np.abs(exact.time[:, None] - exact.events.time).min(axis=1) > 2e-3
    errors = []
    for timestep in (5e-4, 5e-5):
        run = follow(MOTIONS[motion], timestep)
        error = run.omega_c[np.round(exact.time / timestep).astype(int)] - exact.omega_c
        errors.append(float(np.sqrt(np.mean(error[away] ** 2))))
    # First order would divide the error by ten; where in a step a landing falls makes it half or twice that.
    assert errors[1] < errors[0] / 5
    assert errors[1] < 1e-3


@pytest.mark.parametrize("timestep", [2.5e-4, 1e-4])
@pytest.mark.parametrize("motion", list(MOTIONS)[:2])
def test_changes_of_case_are_told_to_a_few_steps(motion: str, timestep: float) -> None:
    exact = analytic.simulate(P, MOTIONS[motion], LASTS).events
    found = follow(MOTIONS[motion], timestep).events
    assert found.to_case.tolist() == exact.to_case.tolist()
    # The landing is known to a step, friction builds up in another, and a slip ends within one.
    assert np.abs(found.time - exact.time).max() <= 3 * timestep
