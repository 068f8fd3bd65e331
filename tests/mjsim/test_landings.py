"""Landings are the law's: within a step, at any place in it, velocities after them right to first
order."""

import numpy as np
import pytest

import analytic
import mjsim
from mjsim import RigidContacts
from model import Case, Parameters

REFERENCE, HOPS = Parameters.named("reference"), Parameters.named("hopping")
"""Of the second a hop lasts 0.22 s, and the floor is touched for half a millisecond of it."""
HOPPING = [0.004068, 0.0822234, 57.2275, -100.0124, 0, 0, 0, 0]
"""Close to its cycle, in the air and rolling up the wall."""


def off(p, x0, lasts, step, initial_impact=False):
    """How far v_y and speeds of turning are off at the end, in units of the weight's impulse in a
    step or, where that is more, the angle of a step times the speed."""
    exact = analytic.simulate(
        p, x0, lasts, sample_interval=lasts, rtol=1e-12, initial_impact=initial_impact
    ).x[-1]
    run = mjsim.simulate(p, x0, lasts, settings=RigidContacts(timestep=step), sample_interval=lasts)
    sizes = np.array([1, p.R, p.r, p.r, p.r])
    speed = float(np.abs(exact[1:6] * sizes).max())
    return np.abs(run.x[-1] - exact)[1:6] * sizes / (step * max(p.g, p.omega_0 * speed))


@pytest.mark.parametrize("step", [1e-3, 5e-4, 2.5e-4, 1.25e-4, 6.25e-5])
def test_hops_are_right(step: float) -> None:
    """After four landings. In half a millisecond after each slip all but ends at the wall and goes
    on another way: with steps that weren't divided as long as that lasts, the shorter ones were off
    by a tenth to a half."""
    assert off(HOPS, HOPPING, 1.0, step).max() < 0.05


def test_a_ball_that_is_dropped_rolls_on_as_fast_to_half_a_percent() -> None:
    """At a step of 1 ms, just after it has landed."""
    p, x0 = REFERENCE.replace(omega_0=45.0), [0.01, 0, 20.0, 0, 0, 0, 0, 0]
    exact = analytic.simulate(p, x0, 0.065, sample_interval=0.005)
    run = mjsim.simulate(p, x0, 0.065, sample_interval=0.005)
    assert exact.cases[-1] is run.cases[-1] is Case.SS
    for name in ("omega_c", "slip_x", "slip_z"):
        assert getattr(run, name)[-1] == pytest.approx(getattr(exact, name)[-1], rel=5e-3)


def test_a_start_that_comes_down_on_the_floor_lands_at_once() -> None:
    assert off(HOPS, [0, -0.042, *HOPPING[2:]], 0.01, 2.5e-4, initial_impact=True).max() < 1


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_a_ball_that_slides_down_the_wall_lands_anywhere_in_a_step(share: float) -> None:
    p, x0, step = REFERENCE, [0.02, -0.2, 12.0, 30.0, -10.0, 20.0, 0.0, 0.0], 2.5e-4
    begin = float(analytic.simulate(p, x0, 0.06, rtol=1e-12).events.time[0]) - (2 + share) * step
    start = analytic.simulate(p, x0, begin, sample_interval=begin, rtol=1e-12).x[-1]
    assert max(off(p, start, n * step, step).max() for n in (1, 2, 4, 6)) < 1


@pytest.mark.parametrize("spin", [-3.0, -60.0])
def test_landing_gives_the_impulses_of_impact(spin) -> None:
    """Normal impulses come to m g t whenever the ball lands; friction is μ times that, or what ends
    slip."""
    p, t_end = REFERENCE.replace(c=0.0, omega_0=0.0), 0.06
    x = [0.01, 0, 0, spin, 0, 0, 0.02, 0]
    run = mjsim.simulate(p, x, t_end, settings=RigidContacts(timestep=1e-4))
    stops, slides = p.j / (1 + p.j) * p.r * abs(spin), p.mu * p.g * t_end
    assert run.v_y[-1] == pytest.approx(0.0, abs=1e-6)
    speed = np.hypot((p.R - run.h[-1]) * run.omega_c[-1], run.v_h[-1])
    assert speed == pytest.approx(min(slides, stops), rel=1e-3)


def test_in_an_impact_all_friction_opposes_the_slip_after_it() -> None:
    """A ball that slides along the wall comes down and slides on on both: when the wall's friction
    opposed its slip in the middle of the step, that came out 0.09 rad/s wrong at any step."""
    p = REFERENCE.replace(omega_0=12.0461)
    x0, lasts = [2.761e-4, -0.1112, 5.819, -16.39, -12.29, 59.02, 0, 0], 5e-3
    exact = analytic.simulate(p, x0, lasts, sample_interval=lasts, rtol=1e-12)
    step = RigidContacts(timestep=1.25e-4)
    run = mjsim.simulate(p, x0, lasts, settings=step, sample_interval=lasts)
    assert run.cases[-1] is exact.cases[-1] is Case.SS
    assert run.x[-1] == pytest.approx(exact.x[-1], abs=1e-3)


@pytest.mark.parametrize("step", [4e-3, 1e-3])
def test_a_ball_stays_where_theory_has_it_at_rest(step: float) -> None:
    """An unstable stationary state, slipping at both points: an edge between two attractors shows
    where a run began."""
    p = Parameters(m=0.02, r=0.012, R=0.06, j=0.3, mu=0.45, eta=0.15, g=9.81, c=2.0, omega_0=34.12)
    states = (each for each in analytic.stationary_solutions(p) if not each.stable)
    (x,) = (each.x for each in states if each.case is Case.SS)
    run = mjsim.simulate(p, x, step, settings=RigidContacts(timestep=step), sample_interval=step)
    speeds = np.abs(run.x[-1] - x)[1:6] * [1, p.R, p.r, p.r, p.r]
    # what forces of the size of the weight do in a step, times the square of its angle, and of the
    # part of them that gives way
    assert speeds.max() < 1e-3 * p.g * step
