"""Landings within a step are of second order, at any step and place in it; claim impacts has what
they leave."""

import numpy as np
import pytest

import analytic
import mjsim
from mjsim import ContactSettings
from mjsim.free import COARSE
from model import Case, Parameters

HOPS = Parameters.named("hopping")
"""A hop lasts 0.22 s, and the floor is touched for half a millisecond of it."""
START = [0.004068, 0.0822234, 57.2275, -100.0124, 0, 0, 0, 0]
"""Close to it, in the air and rolling up the wall."""
LASTS = 0.6
"""Three landings: at 0.15, 0.37 and 0.60 s; the last one is just ahead of the end."""


def test_motions_through_landings_are_of_second_order_but_for_shorter_steps() -> None:
    """Largest error of height (relative to its range) and omega_c (relative) between the landings.

    A second-order method makes errors of (omega_c h)^2 and the like, shorter steps of a landing of
    omega_c times their length."""
    exact = analytic.simulate(HOPS, START, LASTS, sample_interval=0.02)
    errors = []
    for step in (1e-3, 5e-4, 2.5e-4):
        run = mjsim.simulate(
            HOPS,
            START,
            LASTS,
            settings=ContactSettings.for_problem(HOPS, step),
            sample_interval=0.02,
        )
        height = np.abs(run.y - exact.y).max() / np.ptp(exact.y)
        errors.append(max(height, np.abs(run.omega_c / exact.omega_c - 1).max()))
        angle = HOPS.omega_0 * step
        assert errors[-1] < 2 * angle**2 + 3 * angle / COARSE  # of three landings
    assert errors[-1] < errors[0] / 6


def off(p, x0, lasts, step, initial_impact=False):
    """How far v_y and speeds of turning are off at the end, in units of what forces of the size of
    the weight do in a step, times the angle by which they turn."""
    exact = analytic.simulate(
        p, x0, lasts, sample_interval=lasts, rtol=1e-12, initial_impact=initial_impact
    )
    run = mjsim.simulate(
        p, x0, lasts, settings=ContactSettings.for_problem(p, step), sample_interval=lasts
    )
    speeds = np.abs(run.x[-1] - exact.x[-1])[1:6] * [1, p.R, p.r, p.r, p.r]
    return speeds / (p.g * step * p.omega_0 * step)


def test_a_start_that_comes_down_on_the_floor_lands_at_once() -> None:
    assert off(HOPS, [0, -0.042, *START[2:]], 0.01, 2.5e-4, initial_impact=True).max() < 1


@pytest.mark.parametrize("step", [4e-3, 1e-3])
def test_the_first_step_leaves_a_ball_where_theory_has_it_at_rest(step: float) -> None:
    """An unstable stationary state, slipping at both points: an edge between two attractors shows
    where a run began."""
    p = Parameters(m=0.02, r=0.012, R=0.06, j=0.3, mu=0.45, eta=0.15, g=9.81, c=2.0, omega_0=34.12)
    (x,) = [
        each.x
        for each in analytic.stationary_solutions(p)
        if each.case is Case.SS and not each.stable
    ]
    run = mjsim.simulate(p, x, step, settings=ContactSettings.at(step), sample_interval=step)
    speeds = np.abs(run.x[-1] - x)[1:6] * [1, p.R, p.r, p.r, p.r]
    # What forces of the size of the weight do in a step, times the square of the angle of a shorter
    # one.
    assert speeds.max() < p.g * step * (p.omega_0 * step / COARSE) ** 2


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_a_ball_that_slides_down_the_wall_lands_anywhere_in_a_step(share: float) -> None:
    """Friction is damped less in short steps, which by itself takes a tenth of the load from the
    wall at this speed."""
    p, x0, step = (
        Parameters.named("reference"),
        [0.02, -0.2, 12.0, 30.0, -10.0, 20.0, 0.0, 0.0],
        2.5e-4,
    )
    begin = float(analytic.simulate(p, x0, 0.06, rtol=1e-12).events.time[0]) - (2 + share) * step
    start = analytic.simulate(p, x0, begin, sample_interval=begin, rtol=1e-12).x[-1]
    assert max(off(p, start, n * step, step).max() for n in (1, 2, 3, 4)) < 1


@pytest.mark.parametrize("step", [5e-4, 1.25e-4, 3.125e-5])
def test_a_ball_that_slips_fast_lands_at_any_step(step: float) -> None:
    """On a rough floor, whose contact is too much damped at small steps to be held."""
    p = Parameters.named("reference").replace(mu=2.0, r=0.0055, omega_0=70.0)
    assert off(p, [1e-4, -0.65, 80.0, -400.0, 0.0, 35.0, 0.0, 0.0], 0.5e-3, step)[0] < 1
