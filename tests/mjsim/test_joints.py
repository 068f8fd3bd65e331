"""The ball on joints under the general law: settled states are those of the closed form."""

from __future__ import annotations

import numpy as np
import pytest

import analytic
import mjsim
from analytic.slipping.slip_stability import lift_onset
from mjsim.contact_settings import PREDICTED, YIELDS
from mjsim.coulomb.parameters import Law
from mjsim.stepping import SHARE
from model import Case, Parameters, State

P = Parameters.named("reference")
SINKS = Parameters(m=0.029, r=0.013, R=0.042, j=0.57, mu=0.5, eta=0.8, g=8.4, c=4.0, omega_0=7.2)


@pytest.mark.parametrize(
    ("case", "omega_0", "eta"), [("RR", 9, 0.2), ("SS", 20, 0.2), ("NR", 25, 0.6)]
)
def test_a_settled_state_is_that_of_the_closed_form(case, omega_0, eta):
    p = P.replace(omega_0=float(omega_0), eta=eta)
    exact = State.one(analytic.solution(p, case).state)
    run = mjsim.simulate(p, exact, 8.0, sample_interval=1e-3)
    # Friction that is remembered must not turn with the ball, which rolls or slides.
    assert run.omega_c[-1] == pytest.approx(exact.omega_c, rel=1e-13)
    assert {Case(code) for code in run.case[10:]} == {Case[case]}
    # The depth that rigid contacts keep by default is a lever: RR would seem to slip by 1e-6 rad/s.
    for slip in ("slip_x", "slip_y", "slip_z"):
        assert getattr(run, slip)[-1] == pytest.approx(getattr(exact, slip), abs=3e-7)


def test_floor_and_wall_share_the_weight_until_the_wall_alone_lifts_the_ball():
    """In RR they can do so in many ways; rough solutions moved load to the floor."""
    p = Parameters.named("high-wall-friction").replace(omega_0=20.0)
    onset = lift_onset(Case.RR, Case.NR, State(omega_c=20.0), p)
    squares, loads = np.array([0.98, 0.99]) * onset**2, []
    for omega in np.sqrt(squares):
        run = mjsim.simulate(p.replace(omega_0=omega), State(omega_c=omega), 4e-3)
        loads.append(run.force_A[0, 1])
    vanishes = squares[1] + loads[1] * (squares[1] - squares[0]) / (loads[0] - loads[1])
    assert np.sqrt(vanishes) == pytest.approx(onset, rel=3e-5)


def test_what_rolls_doesnt_slip_while_it_settles():
    p = P.replace(omega_0=12.0)
    x = State(omega_c=11.0)
    run = mjsim.simulate(p, x, 4.0)
    assert run.cases[-1] is Case.RR
    rolls = run.case == Case.RR
    assert max(run.slip_speed_A[rolls][5:].max(), run.slip_speed_B[rolls][5:].max()) < 1e-7


@pytest.mark.parametrize("step", [4e-3, 2e-3])
@pytest.mark.parametrize("p", [P.replace(omega_0=7.0, eta=0.8), SINKS])
def test_loads_are_steady_however_much_friction_lifts(p, step) -> None:
    """A ball that sinks along a rough wall: there errors of the slip that is predicted grow from
    step to step, until a step is solved, and loads went to and fro by 4e-4. Its axis goes round
    with the fluid for ever, and its slip with it, so that what is predicted of that is always a
    little wrong; solved for in every other step alone, loads went up and down by 4 %."""
    exact = State.one(analytic.solution(p, "NS").state)._replace(y=1e3)
    run = mjsim.simulate(p, exact, 10.0, settings=mjsim.RigidContacts(timestep=step))
    load = p.m * (p.R * exact.omega_c**2)
    assert run.force_B[len(run.time) // 2 :, 0] == pytest.approx(load, abs=3 * SHARE * p.m * p.g)


@pytest.mark.parametrize("step", [6e-5, 4e-5, 1e-5])
def test_what_rolls_on_the_wall_and_slides_on_the_floor_goes_on_in_short_steps(step) -> None:
    """However little a contact moves in a step, one that rolls is not fixed on its bodies; else the
    law chattered."""
    p = Parameters(m=0.03, r=0.01, R=0.05, j=0.4, mu=0.2, eta=0.6, g=9.81, c=1.0, omega_0=20.5)
    settings = mjsim.RigidContacts(timestep=step)
    x = State(omega_c=18.77, slip_x=29.37)
    run = mjsim.simulate(p, x, 20 * step, settings=settings, sample_interval=step)
    assert set(run.cases) == {Case.SR}
    assert run.force_A[:, 1] == pytest.approx(run.force_A[-1, 1], rel=1e-2)


def test_what_counts_as_slip_follows_from_numbers_of_the_law() -> None:
    assert pytest.approx(PREDICTED) == 2 * Law.regularisation
    assert pytest.approx(YIELDS) == Law.regularisation / 100


def test_a_ball_of_a_moment_of_inertia_just_beyond_the_least() -> None:
    """MuJoCo takes none below 1e-15 kg m²."""
    p = P.replace(m=8e-8, r=2e-4, R=0.01)
    assert mjsim.simulate(p, State(), 0.01).omega_c[-1] > 0


def test_a_ball_that_stops_sliding_rolls_on_with_its_weight() -> None:
    """Friction turns round in the step in which slip ends: Newton's method comes to no end there,
    and loads would be wrong by a hundredth."""
    p = P.replace(omega_0=22.6, mu=0.5)
    x = State(omega_c=5.07, slip_x=24.6, slip_y=9.91, slip_z=-39.1)
    run = mjsim.simulate(p, x, 0.06, settings=mjsim.RigidContacts(timestep=1e-3))
    loads = run.force_A[run.case == Case.RN, 1]
    assert loads[1:] == pytest.approx(p.m * p.g, rel=3e-5)
    assert len(loads) > 20


def test_floor_and_wall_share_the_weight_alike_at_all_orbits() -> None:
    """Rolling at both, they can bear it in many ways; in any other case it is known."""
    p = Parameters(m=0.04, r=0.01, R=0.055, j=0.35, mu=0.3, eta=0.8, g=7.0, c=3.0, omega_0=1.0)
    orbits = np.linspace(10, 18, 15)
    settings = mjsim.RigidContacts(timestep=1.25e-4)
    loads = [
        mjsim.simulate(p.replace(omega_0=w), State(omega_c=w), 1e-3, settings=settings).force_A[-1]
        for w in orbits.tolist()
    ]
    line = np.polynomial.Polynomial.fit(orbits**2, np.array(loads)[:, 1], 1)
    assert np.array(loads)[:, 1] == pytest.approx(line(orbits**2), abs=1e-4 * p.m * p.g)
