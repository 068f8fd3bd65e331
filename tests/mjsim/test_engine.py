"""The engine has the motions of exact forms, the same alone, in batches, on threads, compiled or
not."""

import math

import mujoco
import numpy as np
import pytest

import mjsim
from mjsim import ContactSettings, RigidContacts, recorder, scene
from mjsim.stepping import JointedBall
from model import Case, Flow, Parameters, SimulationError, State, Trajectory
from model.kinematics import frame
from model.trajectory import columns

P = Parameters.named("reference")


def test_a_spin_under_which_the_axes_turn_stays_as_large_as_it_is() -> None:
    """On a smooth wall no moment turns the ball in space; a turn of the fluid takes 31 steps.

    What the first step, whose accelerations are those before its end, leaves of a swing is gone
    after two turns."""
    p = P.replace(eta=0.0, omega_0=100.0)
    x0 = [1e3, -p.g / p.c, 100.0, 30.0, 0, 0]
    run = mjsim.simulate(p, x0, 4.0, settings=RigidContacts(timestep=2e-3))
    spin = np.hypot(run.slip_x + p.R / p.r * run.omega_c, run.slip_z + run.v_y / p.r)
    np.testing.assert_allclose(spin[30:], spin[30], rtol=1e-7)


def test_batch_is_the_single_run() -> None:
    """To the bit; slipping along a ramp, and through landings of both kinds."""
    rough = Parameters.named("high-wall-friction").replace(omega_0=20.0)
    p, slips, settings = P.replace(omega_0=25.0), [0, 0, 12.0, -2, 1, 6], RigidContacts()
    landings = [0.02, -0.2, 12.0, 30, -10, 20, 0, 0], [0.01, 0, 10.0, 1, 2, 3, 0.002, -0.3]
    for sets, x0s, flow, t_end in (
        ([p, rough.replace(r=0.02, m=0.1)], [slips, slips], Flow.ramp(20.0, 25.0, 0.2), 0.3),
        ([P.replace(omega_0=12.0), rough], landings, None, 0.1),
    ):
        many = mjsim.simulate_many(sets, x0s, t_end, flow, settings, sample_interval=1e-3)
        for q, x0, run in zip(sets, x0s, many, strict=True):
            alone = mjsim.simulate(q, x0, t_end, flow, settings, sample_interval=1e-3)
            assert np.any(alone.force_A[:, 1] > 0)
            np.testing.assert_array_equal(run.x, alone.x)
            np.testing.assert_array_equal(run.case, alone.case)


SOFT = ContactSettings()


@pytest.mark.parametrize("settings", [None, SOFT])
def test_a_run_begins_at_the_azimuth_that_is_asked_for(settings) -> None:
    """Later ones are second order in the step: places are brought back by the velocity of the
    sample."""
    p, x0 = P.replace(omega_0=25.0), [0, 0, 12.0, -2, 1, 6]
    run = mjsim.simulate(p, x0, 0.01, settings=settings, theta_0=0.3)
    assert run.theta[0] == pytest.approx(0.3, abs=1e-11)


@pytest.mark.parametrize("settings", [None, SOFT], ids=["rigid", "soft"])
def test_results_are_the_same_to_the_bit_on_any_number_of_threads(settings) -> None:
    """Also of a run that breaks down, beside others; progress is that of all of them."""
    sets = [P.replace(omega_0=omega_0) for omega_0 in (5.0, 12.0, 25.0, 40.0, 60.0)]
    x0s, told = [[0.0, 0, 10.0, 0, 0, 0]] * 4 + [[1e11, 0, 0, 0, 0, 0]], []
    how = {"settings": settings, "sample_interval": 0.01, "progress": told.append}
    one, *others = (mjsim.simulate_many(sets, x0s, 0.1, threads=n, **how) for n in (1, 2, 3, 1000))
    assert min(told) < told[-1] == max(told) == 1.0
    assert not one[-1].complete
    assert one[0].complete
    for many in others:
        for run, exact in zip(many, one, strict=True):
            assert run.header.failure == exact.header.failure
            for name in columns(Trajectory):
                np.testing.assert_array_equal(getattr(run, name), getattr(exact, name))


def test_a_run_goes_on_where_another_one_ended() -> None:
    """Contacts end in it by round-off, or a little more on the bent wall."""
    deep = [-1e-11, 0, 11.0, 0, 0, 0, -5e-5 * P.R, 0]
    assert mjsim.simulate(P, deep, 0.1).cases[-1] is Case.RR


@pytest.mark.parametrize(
    ("settings", "wild"),
    [(None, [1e11, *5 * [0]]), (None, [0, 0, 5.0, 0, 0, 0, 0.01, 12.0]), (SOFT, [1e11, *5 * [0]])],
)
def test_divergence_stops_a_run_and_keeps_what_there_is(settings, wild) -> None:
    with pytest.raises(SimulationError, match=r"diverged by t = .* s") as caught:
        mjsim.simulate(P, wild, 0.1, settings=settings)
    assert caught.value.trajectory.header.failure
    failed, sound = mjsim.simulate_many([P, P], [wild, [0, 0, 1, 0, 0, 0]], 0.1, settings=settings)
    assert not failed.complete
    assert sound.complete
    assert len(sound.time) == 101


def test_a_vessel_beyond_all_numbers_ends_a_run_and_not_the_patience() -> None:
    """Its wall has no direction, by which the law told contacts apart for ever."""
    with pytest.raises(SimulationError, match="diverged"):
        mjsim.simulate(P.replace(R=1e16), [0] * 6, 0.1)


@pytest.mark.parametrize("miss", [3e-4, 3e-3])
def test_a_ball_that_passes_the_axis_goes_on(miss) -> None:
    """Without friction a straight line past the axis; of an azimuth that turns by phi in a step,
    1/6 phi^2 is more than is lost."""
    p = P.replace(omega_0=0.0, c=0.0, mu=0.0, eta=0.0)
    a, v = 0.8 * p.R, 0.2
    rho = math.hypot(a, miss)
    x0 = [0, 0, v * miss / rho**2, 0, 0, 0, p.R - rho, v * a / rho]
    still, how = [0, 0, 0, 0, 0, 0, 0.2 * p.R, 0], {"sample_interval": 0.01}
    together = mjsim.simulate_many([p, p], [x0, still], 0.35, settings=RigidContacts(), **how)
    alone = mjsim.simulate(p, x0, 0.35, settings=RigidContacts(), **how)
    for run in (alone, together[0]):
        exact = np.hypot(miss, a - v * run.time)
        np.testing.assert_allclose(p.R - run.h, exact, rtol=0, atol=1 / 6 / 32**2 * p.R)
        assert run.theta[-1] == pytest.approx(math.pi, abs=2 * miss / exact[-1] + 3e-3)
    assert np.all(together[1].h == 0.2 * p.R)


@pytest.mark.parametrize("omega_c", [0.0, 1e-3])
def test_a_ball_that_comes_to_the_axis_ends_its_run(omega_c) -> None:
    """Where the coordinates end."""
    p, x = P.replace(omega_0=0.0, c=0.0, mu=0.0, eta=0.0), [0, 0, omega_c, 0, 0, 0, 0.2 * P.R, 0.2]
    with pytest.raises(SimulationError, match=r"diverged by t = 0.2 s, after .* h = 0.048 m,"):
        mjsim.simulate(p, x, 0.35, sample_interval=0.01)


@pytest.mark.parametrize("step", [1e-3, 4e-3])
def test_a_ball_that_slides_down_the_wall_as_fast_as_drag_lets_it_stays_on_it(step) -> None:
    """Its load on the wall is a fifth of the weight, its slip 10 m/s; it falls as drag says."""
    p = P.replace(m=0.02, r=0.004, R=0.03, j=0.35, mu=0.15, eta=0.7, g=9.1, c=0.8, omega_0=7.489)
    x0 = [100.0, -9.7, 7.489, 0, 0, 0]
    run = mjsim.simulate(p, x0, 2.0, settings=RigidContacts(timestep=step))
    assert set(run.cases[len(run.time) // 2 :]) == {Case.NS}
    # Friction of the wall, eta R omega_c^2 upwards, slows it: less than the weight, which drag
    # balances in the end.
    slowed = -(p.g - p.eta * p.R * p.omega_0**2) / p.c
    assert -p.g / p.c < run.v_y[-1] < slowed * (1 - math.exp(-p.c * 2.0))


def test_how_a_ball_slides_round_on_its_pole_does_not_depend_on_the_step() -> None:
    """It touches the floor where it hardly moves on the ball, which spins upright, so that this
    contact turns along with it; slip goes round by a tenth of a turn in six steps of 4 ms."""
    p = P.replace(m=0.034, r=0.0055, R=0.043, j=0.6, mu=0.055, eta=0.06, g=6.4, c=1.2, omega_0=30.0)
    ends = []
    for step in (4e-3, 2e-3):
        run = mjsim.simulate(p, [0.0] * 8, 60.0, settings=RigidContacts(timestep=step))
        last = run.time > 40.0
        assert run.cases[-1] is Case.SS
        ends.append([run.omega_c[last].mean(), run.slip_z[last].mean()])
    np.testing.assert_allclose(*ends, rtol=1e-7)


@pytest.mark.parametrize("settings", [RigidContacts(), SOFT], ids=["rigid", "soft"])
def test_contacts_have_the_axes_in_which_forces_are_read(settings) -> None:
    ball = JointedBall(scene.build(P, settings)[0], P, settings)
    ball.start(State.one([0, 0, 12.0, -2, 1, 6]), 2.0)
    ball.advance(np.full(20, 20.0), np.empty((20, recorder.COLUMNS)))
    assert ball.body.azimuth > 2.1
    for contact, axes in zip(ball.data.contact, recorder.FRAMES.values(), strict=True):
        given = contact.frame.reshape(3, 3) @ frame(0.0).T
        np.testing.assert_allclose(given, axes, rtol=0, atol=1e-15)


def test_file_opens_as_it_is_and_holds_the_reference() -> None:
    model = mujoco.MjModel.from_xml_path(str(scene.SCENE))
    built, mjcf = scene.build(P, RigidContacts())
    of_bodies, others = "mass inertia pos", ("jnt_pos", "geom_size", "geom_pos", "pair_solref")
    for name in (*(f"body_{each}" for each in of_bodies.split()), *others):
        for made in (built, mujoco.MjModel.from_xml_string(mjcf)):
            assert getattr(made, name) == pytest.approx(getattr(model, name)), name
