"""Time stepping is exact where it should be, and one run or many; claim two-methods has its limit of no step."""

import math
import os
import subprocess
import sys

import numpy as np
import pytest

from analytic import Settings, simulate, simulate_many
from analytic.simulation.stepping import TOLERANCE, compiled, step
from analytic.simulation.time_stepping import prepared
from model import Case, Flow, InputError, Parameters, SimulationError, State

P = Parameters.named("reference")
SPEED = math.sqrt(P.g * P.R)


@pytest.mark.parametrize(
    ("omega_c", "given"),
    [
        ((-3.9, -3.4), {"r": 0.024, "j": 0.653, "mu": 0.5, "eta": 0.349, "c": 0.42, "omega_0": 59.6}),
        ((5.0, 20.0), {"r": 0.00224, "j": 0.515, "mu": 0.208, "eta": 1.028, "c": 3.59, "omega_0": 41.0}),
    ],
)
def test_a_step_in_which_friction_only_just_holds_the_ball(omega_c, given):
    """Where rolling ends two solutions of Coulomb's law meet: a bisection comes as near to that as numbers go."""
    p, dt, (rolls, slips) = P.replace(**given), 1e-3, omega_c
    while abs(rolls - slips) > 4e-16 * abs(slips):
        middle = (rolls + slips) / 2
        rolling = State(omega_c=middle), 0.0, p, Flow.steady(p.omega_0), Settings(), np.array([0.0, dt])
        ball, _, _, constants = prepared(*rolling)
        after = step(ball, dt, p.omega_0, constants)
        assert after.residual == 0
        rolls, slips = (middle, slips) if after.case == Case.RR else (rolls, middle)


FLOWS = [
    Flow.steady(20.0),
    Flow.ramp(5.0, 25.0, 0.2, 0.1),
    Flow.staircase([10.0, 25.0], 0.1),
    Flow.sampled([0.0, 0.1, 0.3], [20.0, 5.0, 15.0]),
    Flow.sines(15.0, [(8.0, 5.0, 0.0), (2.0, 20.0, 1.0)]),
]


@pytest.mark.parametrize("flow", FLOWS)
def test_both_methods_follow_any_flow(flow):
    """Off the floor, where omega_0 enters by the drag alone: within a step of its effect, c |omega_0| a second."""
    p, x0, dt = P.replace(c=5.0), [0.3, 0.5, 12.0, 10.0, 20.0, 30.0], 5e-4
    events = simulate(p, x0, 0.2, flow, sample_interval=0.01)
    steps = simulate(p, x0, 0.2, flow, method="time-stepping", timestep=dt, sample_interval=0.01)
    assert not len(events.events)
    assert abs(events.omega_c[-1] - simulate(p, x0, 0.2, Flow.steady(0.0), sample_interval=0.2).omega_c[-1]) > 1.0
    np.testing.assert_allclose(steps.omega_c, events.omega_c, atol=p.c * dt * 25.0)
    np.testing.assert_allclose(steps.y, events.y, atol=dt * SPEED)


def test_energy_balance_is_exact():
    """Work at mean velocities balances kinetic energy to what the iteration leaves: 24 TOLERANCE in each step."""
    run = simulate(P.replace(omega_0=25.0), [0, 0, 9.0, 1, 2, 3], 0.5, method="time-stepping", timestep=1e-3)
    assert run.header.settings["energy_residual"] < 500 * 25 * TOLERANCE * run.header.settings["energy_scale"]


def test_no_convergence_keeps_the_samples():
    """A ball that falls through a still fluid gets too fast for quadratic drag, b |w|^2 per mass.

    The iteration over smooth forces contracts by dt/2 times the slope of the drag, 2 b |w|, which has to be less than
    one; where drag carries the weight, it is sqrt(b g) dt.
    """
    b, dt, p = 10 / P.R, 0.4 * math.sqrt(P.R / P.g), P.replace(drag="quadratic", nu_f=1e-6, omega_0=0.0)
    p = p.replace(c=24 * b * p.nu_f / (2 * p.r * p.C_D))
    assert math.sqrt(b * p.g) * dt > 1.2
    with pytest.raises(SimulationError, match=r"a shorter step than 0\.0285") as caught:
        simulate(p, State(y=1.0, h=P.R / 2), 1.0, method="time-stepping", timestep=dt, sample_interval=dt)
    kept = caught.value.trajectory
    assert not kept.complete
    assert len(kept.time) > 1
    assert np.all(np.isfinite(kept.x))
    # Among many at once it leaves the others alone.
    x0, settings = State(y=1.0, h=P.R / 2), Settings(method="time-stepping", timestep=dt)
    many = simulate_many([P, p], x0, 0.2, settings=settings, sample_interval=0.1)
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


# --- many runs at once are the same runs one by one; the step settles and chooses where it once did not ------


STEPPING = Settings(method="time-stepping", timestep=1e-3)


def groups(mu, eta, j, kappa, Omega_0):
    unit = math.sqrt(P.R / P.g)
    return P.replace(mu=mu, eta=eta, j=j, c=kappa / unit, omega_0=Omega_0 / unit)


def test_the_same_runs_as_one_by_one():
    """To the bit: one step serves both."""
    sets = [P.replace(omega_0=omega_0) for omega_0 in (12.0, 25.0, 35.0)]
    x0s = np.array([[0.0, 0, 9, 1, 2, 3, 0, 0], [0.01, 0, 30, 1, 2, 3, 0.02, 0], [0.02, 0.1, 5, 0, 0, 0, 0, 0]])
    flows = [Flow.steady(12.0), Flow.ramp(25.0, 15.0, 0.1, 0.1), Flow.staircase([35.0, 20.0], 0.15)]
    many = simulate_many(sets, x0s, 0.3, flows, STEPPING, sample_interval=0.1, threads=2)
    assert many.failure == ("", "", "")
    for k, (p, x0, flow) in enumerate(zip(sets, x0s, flows, strict=True)):
        # At the ends of the flow's pieces a step ends, too.
        one = simulate(p, x0, 0.3, flow, STEPPING, sample_interval=0.1)
        np.testing.assert_array_equal(many.time, one.time)
        np.testing.assert_array_equal(many.x[k], one.x)
        np.testing.assert_array_equal(many.case[k, 1:], one.case[1:])


@pytest.mark.parametrize(
    ("sets", "x0s", "message"),
    [
        ([P, P], np.zeros((3, 6)), "2 parameter sets, 3 starts"),
        ([P], [[-0.01, 0, 0, 0, 0, 0]], "y = -0.01 m"),
        ([P], [[0, 0, 0, 0, 0, 0, 0.06, 0]], "h = 0.06 m"),
    ],
)
def test_bad_input(sets, x0s, message):
    with pytest.raises(InputError, match=message):
        simulate_many(sets, x0s, 0.1)


def test_settles_on_random_sets():
    """Friction up to 3, any drag and inertia: every step of 200 runs converges."""
    rng = np.random.default_rng(5)
    low, high = np.log([0.03, 0.03, 0.1, 0.01, 0.3]), np.log([3.0, 2.0, 2 / 3, 3.0, 6.0])
    sets = [groups(*each) for each in np.exp(rng.uniform(low, high, (200, 5)))]
    x0s = np.zeros((200, 8))
    x0s[:, 0] = rng.uniform(0, P.R, 200) * rng.integers(0, 2, 200)
    x0s[:, 2] = [p.omega_0 * rng.uniform(-2, 2) for p in sets]
    x0s[:, 3:6] = [p.omega_0 * p.R / p.r * rng.uniform(-2, 2, 3) for p in sets]
    many = simulate_many(sets, x0s, 0.5, sample_interval=0.5)
    assert many.failure == ("",) * 200


SCRIPT = """
import sys, numpy as np
from analytic import Settings, simulate_many
from model import Parameters
p = Parameters.named("reference")
sets = [p.replace(omega_0=12.0), p.replace(omega_0=25.0, eta=0.6), p.replace(mu=1.5, omega_0=40.0)]
x0 = [0.005, 0, 20, 10, 20, 30, 0.001, 0]
settings = Settings(method="time-stepping", timestep=2e-4)
np.save(sys.argv[1], simulate_many(sets, x0, 0.05, settings=settings, sample_interval=0.05).x)
"""


def test_compiled_and_not_are_the_same(tmp_path):
    """Without numba the source itself runs; results may differ by rounding only."""
    assert compiled(lambda x: x + 1)(1) == 2
    pytest.importorskip("numba")
    results = []
    for switch in ("0", "1"):
        file = tmp_path / f"{switch}.npy"
        subprocess.run([sys.executable, "-c", SCRIPT, file], check=True, env=os.environ | {"NUMBA_DISABLE_JIT": switch})
        results.append(np.load(file))
    np.testing.assert_allclose(results[0], results[1], rtol=1e-9, atol=1e-12)
