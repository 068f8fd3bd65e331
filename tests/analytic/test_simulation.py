"""Both simulators keep the laws at every sample, reflect, refuse what is wrong, and keep what a
stopped run has."""

import itertools
import json
import math
import os
import re
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest

from analytic import Settings, simulate, simulate_many
from analytic.simulation.stepping import step
from analytic.simulation.time_stepping import prepared
from model import Case, Contact, Flow, InputError, Parameters, SimulationError, State
from tests.random_motions import UNIT, random_start

P = Parameters.named("reference")
METHODS = ("event", "time-stepping")
TOLERANCE = 1e-7
"""Of laws, in natural units: a hundred times that of the integrator."""
RUNS = int(os.environ.get("DUALBALL_RANDOM_RUNS", "10000"))
"""Length of the robustness run."""


def assert_lawful(run):
    """Coulomb's inequality, signs of normal forces, gaps, energy: each up to `TOLERANCE` of the
    natural unit."""
    p = run.header.parameters
    weight = p.m * p.g * (1 + np.abs(p.R * run.omega_c**2 / p.g))
    (A_x, A_y, A_z), (B_x, B_y, B_z) = run.force_A.T / weight, run.force_B.T / weight
    assert np.all(np.isfinite(run.x))
    assert np.all(np.minimum(A_y, B_x) >= -TOLERANCE)
    assert np.all(np.hypot(A_x, A_z) <= p.mu * A_y + TOLERANCE)
    assert np.all(np.hypot(B_y, B_z) <= p.eta * B_x + TOLERANCE)
    assert np.all(np.minimum(run.gap_A, run.gap_B) >= -TOLERANCE * p.R)
    for point in "AB":
        columns = (f"gap_{point}", f"slip_speed_{point}", f"force_{point}")
        gap, slip, force = (getattr(run, name) for name in columns)
        state = np.array([getattr(case, point) for case in run.cases])
        assert np.all(gap[state != Contact.N] == 0)
        assert np.all(force[state == Contact.N] == 0)
        rolls = state == Contact.R
        assert np.all(slip[rolls] <= 1e-12 * math.sqrt(p.g * p.R) * (1 + weight[rolls]))
    # Motions much slower than sqrt(g R) are integrated to the absolute tolerance.
    scale = run.header.settings["energy_scale"] + p.m * p.g * p.R
    assert run.header.settings["energy_residual"] <= TOLERANCE * scale


def fault(seed, t_end=5.0):
    """What is wrong with a run of the robustness test; empty if nothing is. Some move into what
    they touch at first."""
    p, x = random_start(seed)
    touching = x._replace(y=x.y * (seed % 5 > 0), h=x.h * (seed % 7 > 0))
    try:
        assert_lawful(simulate(p, touching, t_end, initial_impact=True, sample_interval=0.01))
    except Exception as error:  # whatever it is, the other seeds are to run
        return f"seed {seed}: {type(error).__name__}: {error}"
    return ""


@pytest.mark.parametrize("seed", range(100))
def test_random_states_end_lawfully(seed):
    """Part of the robustness run (below, slow): no exception, no stall, no law violated."""
    assert not fault(seed, 0.5)


@pytest.mark.slow
def test_ten_thousand_random_runs():
    """All seeds run, whatever fails among them."""
    with ProcessPoolExecutor() as pool:
        faults = [line for line in pool.map(fault, range(RUNS), chunksize=20) if line]
    assert not faults, "\n".join(faults)


@pytest.mark.parametrize("seed", [*range(30, 40), 1736, 2340, 6867])
def test_long_random_runs_end(seed):
    """Over 60/c: a hop has some five changes of case. The last three come to rest: no solver crawls
    through round-off, and no ball hops by it."""
    p, x0 = random_start(seed)
    run = simulate(p, x0, 60 / p.c, sample_interval=1 / p.c)
    assert run.header.settings["energy_residual"] <= 1e-6 * run.header.settings["energy_scale"]
    assert len(run.events) < 100 + 5 * 60 / p.c * UNIT


@pytest.mark.parametrize("zeros", list(itertools.product((0, 1), repeat=5)))
def test_laws_hold_where_parameters_vanish(zeros):
    """From states at both contacts, with any of mu, eta, c, omega_0 and the slips zero."""
    mu, eta, c, omega_0, slips = zeros * np.array([0.7, 0.4, 3.0, -22.0, 30.0])
    p = P.replace(mu=mu, eta=eta, omega_0=omega_0, c=c)
    x0 = [0, 0, 11.0, slips, -2 * slips, slips]
    assert_lawful(simulate(p, x0, 0.1, restitution=0.5, sample_interval=2e-3))


@pytest.mark.parametrize("method", METHODS)
def test_trajectory_describes_itself(method):
    x0 = [0.02, 0.0, 8.0, 1.0, 2.0, 3.0, 0.01, -0.2]
    chosen = {"method": method, "timestep": 1e-3, "rtol": 1e-7, "restitution": 0.3}
    run = simulate(P, x0, 0.3, settings=Settings(**chosen), sample_interval=0.04, theta_0=2.0)
    assert run.header.engine == method
    np.testing.assert_allclose(run.time, [*0.04 * np.arange(8), 0.3], rtol=1e-14)
    np.testing.assert_allclose(run.x[0], x0, rtol=1e-13)
    assert run.theta[0] == pytest.approx(2.0, rel=1e-14)
    shown = json.loads(json.dumps(dict(run.header.settings)))
    assert shown.items() >= {"x0": x0, **chosen}.items()
    assert np.any(run.events.impulse_A != 0)
    assert Case(run.events.from_case[0]) is run.cases[0]
    by_names = simulate(P, x0, 0.3, **chosen, sample_interval=0.04, theta_0=2.0)
    np.testing.assert_array_equal(by_names.x, run.x)


@pytest.mark.parametrize(
    ("method", "torque"), [("event", 0.0), ("time-stepping", 0.0), ("time-stepping", 3.0)]
)
@pytest.mark.parametrize("x", [[0, 0, 9, 0, 0, 0, 0, 0], [0.01, 0, 20, -30, 10, 20, 0.002, -0.1]])
def test_the_mirrored_motion(method, torque, x):
    """Onsets of slip, landings and the fluid's torque: reflection turns omega_c, slip_x, slip_y and
    omega_0."""
    p, flip = P.replace(fluid_torque=torque), np.array([1, 1, -1, -1, -1, 1, 1, 1])
    there, back = (
        simulate(
            p.replace(omega_0=flow), start, 2.0, method=method, sample_interval=0.1, timestep=1e-3
        )
        for flow, start in ((25.0, x), (-25.0, flip * x))
    )
    assert len(there.events)
    np.testing.assert_array_equal(back.events.to_case, there.events.to_case)
    np.testing.assert_allclose(back.x, flip * there.x, rtol=0, atol=1e-7 * np.abs(there.x).max())


@pytest.mark.parametrize("method", METHODS)
def test_steps_of_a_long_stretch_tell_progress_which_may_end_the_run(method, monkeypatch):
    """Without a change of case or a sample in between; the run has its samples so far."""
    for name, few in (("hybrid.STRIDES", 3), ("hybrid.STEPS", 3), ("time_stepping.AT_ONCE", 10)):
        monkeypatch.setattr(f"analytic.simulation.{name}", few)
    p, x0, seen = P.replace(omega_0=25.0), [0, 0, 13.8, -4, 0.5, 10], []

    def enough(done):
        seen.append(done)
        if done > 0.5:
            raise InterruptedError("enough")

    with pytest.raises(SimulationError, match=r"stopped at t = .* s: enough") as stopped:
        simulate(p, x0, 4.0, method=method, timestep=1e-3, sample_interval=1.9, progress=enough)
    assert len(seen) > 5
    assert seen == sorted(seen)
    run = stopped.value.trajectory
    assert run.time == pytest.approx([0.0, 1.9], rel=1e-14)
    assert run.header.failure == str(stopped.value)
    simulate(p, x0, 0.1, method=method, progress=seen.append)
    assert seen[-1] == 1.0


@pytest.mark.parametrize("method", METHODS)
def test_a_speed_into_a_closed_contact(method):
    """A collision at the very start changes the state before the first sample, and is an event."""
    x0 = [0, -0.1, 10, 0, 0, 0]
    with pytest.raises(InputError, match=r"v_y = -0.1 m s-1 .* floor .*initial_impact"):
        simulate(P, x0, 0.1, method=method)
    run = simulate(P, x0, 0.1, method=method, initial_impact=True, restitution=0.5, timestep=1e-4)
    assert run.v_y[1] > 0 or run.cases[1].A is not Contact.N
    if method == "event":
        assert run.events.time[0] == 0.0
        assert run.events.impulse_A[0, 1] == pytest.approx(1.5 * P.m * 0.1, rel=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_a_ball_locked_in_the_corner_does_not_rebound(method):
    """Where mu, eta > 1 a fall into the corner has no impulses that meet restitution at both
    contacts."""
    p = P.replace(mu=1.3, eta=1.3)
    given = {"restitution": 0.5, "initial_impact": True, "timestep": 1e-3}
    run = simulate(p, [0, -0.4, 0, 0, 0, 40, 0, -0.4], 0.05, method=method, **given)
    assert np.all(run.x[1:, [0, 1, 6, 7]] == 0)


@pytest.mark.parametrize(
    ("flow", "says"),
    [
        (None, "omega_0 = -1e+09 rad s-1 is out of range: for a run of 1 s it must be >= -50000"),
        (Flow.sine(5, 1, 1e9), "f = 1e+09 Hz is out of range: for a run of 1 s it must be <= 159"),
    ],
)
def test_more_of_a_huge_flow_than_can_be_computed_is_refused(flow, says):
    """It would take hours; the first moments of it don't."""
    p = P.replace(omega_0=-1e9)
    for method in METHODS:
        with pytest.raises(InputError, match=re.escape(says)):
            simulate(p, [0] * 6, 1.0, flow, method=method)
        assert simulate(p, [0] * 6, 1e-8, flow, method=method).complete
    with pytest.raises(InputError, match=re.escape(says)):
        simulate_many(p, [0] * 6, 1.0, flow)


def test_drag_of_a_fast_flow_is_no_reason_to_refuse_a_run():
    p = P.replace(drag="quadratic", nu_f=1e-6, omega_0=400.0)
    assert simulate(p, [0] * 6, 10.0).omega_c[-1] == pytest.approx(400.0, abs=0.1)


def test_the_end_is_always_a_sample():
    """Also where a stretch that ends there begins at a time from which the end can't be reached to
    the last digit."""
    p, frequency = P.replace(omega_0=11.5), 6.550213947459355
    flow = Flow.sine(11.5, 8.0 * (1 + 2 * frequency), frequency)
    period = 1 / frequency
    run = simulate(p, [0, 0, 11.8, 0, 0, 0], period, flow, rtol=1e-6, sample_interval=period)
    assert run.time.tolist() == [0.0, period]


@pytest.mark.parametrize(
    ("omega_c", "values"),
    [
        ((-3.9, -3.4), (0.024, 0.653, 0.5, 0.349, 0.42, 59.6)),
        ((5.0, 20.0), (0.00224, 0.515, 0.208, 1.028, 3.59, 41.0)),
    ],
)
def test_a_step_in_which_friction_only_just_holds_the_ball(omega_c, values):
    """Where rolling ends two solutions of Coulomb's law meet: a bisection comes as near to that as
    numbers go."""
    given = dict(zip(("r", "j", "mu", "eta", "c", "omega_0"), values, strict=True))
    p, dt, (rolls, slips) = P.replace(**given), 1e-3, omega_c
    while abs(rolls - slips) > 4e-16 * abs(slips):
        middle = (rolls + slips) / 2
        flow, times = Flow.steady(p.omega_0), np.array([0.0, dt])
        ball, _, constants = prepared(State(omega_c=middle), 0.0, p, flow, Settings(), times)
        after = step(ball, dt, p.omega_0, constants)
        assert after.residual == 0
        rolls, slips = (middle, slips) if after.case == Case.RR else (rolls, middle)


def test_settles_on_random_sets():
    """Every step of 200 runs converges."""
    sets, x0s = zip(*map(random_start, range(200)), strict=True)
    settings = Settings(method="time-stepping")
    many = simulate_many(sets, x0s, 0.5, settings=settings, sample_interval=0.5)
    assert many.failure == ("",) * 200


def test_no_convergence_keeps_the_samples():
    """A ball that falls through a still fluid gets too fast for quadratic drag, b |w|^2 per mass.

    The iteration over smooth forces contracts by dt/2 times the slope of the drag, 2 b |w|, which
    has to be less than one; where drag carries the weight, it is sqrt(b g) dt."""
    b, dt = 10 / P.R, 0.4 * math.sqrt(P.R / P.g)
    p = P.replace(drag="quadratic", nu_f=1e-6, omega_0=0.0)
    p = p.replace(c=24 * b * p.nu_f / (2 * p.r * p.C_D))
    assert math.sqrt(b * p.g) * dt > 1.2
    x0, settings = State(y=1.0, h=P.R / 2), Settings(method="time-stepping", timestep=dt)
    with pytest.raises(SimulationError, match=r"a shorter step than 0\.0285") as caught:
        simulate(p, x0, 1.0, settings=settings, sample_interval=dt)
    kept = caught.value.trajectory
    assert not kept.complete
    assert len(kept.time) > 1
    assert np.all(np.isfinite(kept.x))
    # Among many at once it leaves the others alone.
    sets = P.replace(omega_0=5.0), p
    many = simulate_many(sets, x0, 0.2, settings=settings, sample_interval=0.1)
    assert many.failure[0] == ""
    assert "a shorter step" in many.failure[1]
    assert np.all(np.isfinite(many.x[0]))
    assert np.all(np.isnan(many.x[1, 1:]))


def test_where_no_step_is_given_it_fits_the_problem():
    """At c = 1e4 a five hundredth of sqrt(R/g) is too long."""
    problem = P.replace(c=1e4), [0.01, 0, 10, 1, 2, 30], 0.01
    assert simulate(*problem, method="time-stepping", sample_interval=1e-3).complete
    with pytest.raises(InputError, match="must be <= 5e-05 s, half of 1/c"):
        simulate(*problem, method="time-stepping", timestep=1e-3)
