"""A free ball under Coulomb's law for any model is right in the limit of no step, and wrong where
it must be."""

import numpy as np
import pytest

import analytic
import mjsim
from compare.kit.engines import COULOMB
from mjsim.contact_settings import FORESEEN
from mjsim.coulomb.parameters import Law
from model import Case, Parameters, State

P = Parameters.named("reference")
STEPS = np.array([2e-3, 1e-3, 5e-4])


def rigid(step):
    return COULOMB.at(step, P)


def omega_c(p, settings, lasts=10.0):
    """After a start 2 % off the stationary state, over that of theory."""
    case = Case.RR if p.omega_0 < 13 else Case.SS
    known = analytic.solution(p, case.name)
    run = mjsim.simulate(p, 0.98 * np.array(known.x, float), lasts, settings=settings)
    return run.x[-1, 2] / known.state.omega_c, run


@pytest.mark.parametrize(("omega_0", "order", "off"), [(12.0, 3.0, 1e-6), (25.0, 2.0, 1e-6)])
def test_stationary_states_are_right_in_the_limit(omega_0, order, off) -> None:
    p = P.replace(omega_0=omega_0)
    coarse, middle, fine = (omega_c(p, rigid(step), 30.0)[0] - 1 for step in STEPS)
    # In sliding a contact may be as deep as `Law.depth` allows, which falls with the square of the
    # step, or less.
    assert np.log2((coarse - middle) / (middle - fine)) == pytest.approx(order, abs=0.6)
    assert (coarse - 6 * middle + 8 * fine) / 3 == pytest.approx(0.0, abs=off)


@pytest.mark.parametrize("spin", [-3.0, -60.0])
def test_landing_gives_the_impulses_of_impact(spin) -> None:
    """Normal impulses come to m g t whenever the ball lands; friction is μ times that, or what ends
    slip.

    In the step of the landing friction acts half a gap below the ball, which changes its lever by
    up to h v/(2 r)."""
    p, t_end = P.replace(c=0.0, omega_0=0.0), 0.06
    x = State(y=0.01, slip_x=spin, h=0.02)
    run = mjsim.simulate(p, x, t_end, settings=rigid(3e-5))
    stops = p.j / (1 + p.j) * p.r * abs(spin)
    slides = p.mu * p.g * t_end
    assert run.v_y[-1] == pytest.approx(0.0, abs=1e-6)
    assert np.hypot((p.R - run.h[-1]) * run.omega_c[-1], run.v_h[-1]) == pytest.approx(
        min(slides, stops), rel=1e-3
    )


def test_rolling_shows_next_to_no_slip() -> None:
    run = omega_c(P.replace(omega_0=12.0), rigid(1e-3))[1]
    assert set(run.cases) == {Case.RR}
    assert max(run.slip_speed_A[-1], run.slip_speed_B[-1]) < 5e-5
    assert np.abs(run.h[-100:]).max() < 2e-6 > np.abs(run.y[-100:]).max()


@pytest.mark.parametrize("step", [6e-5, 4e-5, 1e-5])
def test_what_rolls_on_the_wall_and_slides_on_the_floor_goes_on_in_short_steps(step) -> None:
    """However little a contact moves in a step, one that rolls is not fixed on its bodies; else the
    law chattered."""
    p = Parameters(m=0.03, r=0.01, R=0.05, j=0.4, mu=0.2, eta=0.6, g=9.81, c=1.0, omega_0=20.5)
    run = mjsim.simulate(
        p, State(omega_c=18.77, slip_x=29.37), 20 * step, settings=rigid(step), sample_interval=step
    )
    assert set(run.cases) == {Case.SR}
    assert run.force_A[:, 1] == pytest.approx(run.force_A[-1, 1], rel=1e-2)


def test_what_a_step_foresees_of_slip_is_the_number_of_the_law() -> None:
    assert pytest.approx(FORESEEN) == Law.share / 5


def test_a_ball_of_a_moment_of_inertia_just_beyond_the_least() -> None:
    """MuJoCo takes none below 1e-15 kg m²; the wall that goes with a ball of .2 mm must not be what
    it refuses."""
    p = P.replace(m=8e-8, r=2e-4, R=0.01)
    assert mjsim.simulate(p, State(), 0.01, settings=rigid(1e-3)).omega_c[-1] > 0
