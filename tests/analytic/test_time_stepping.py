"""Time stepping settles in every step, or says that it doesn't; claim two-methods has its limit of no step."""

import math

import numpy as np
import pytest

from analytic import Settings, simulate, simulate_many
from analytic.simulation.stepping import step
from analytic.simulation.time_stepping import prepared
from model import Case, Flow, InputError, Parameters, SimulationError, State
from tests.random_motions import random_start

P = Parameters.named("reference")


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
        ball, _, constants = prepared(*rolling)
        after = step(ball, dt, p.omega_0, constants)
        assert after.residual == 0
        rolls, slips = (middle, slips) if after.case == Case.RR else (rolls, middle)


def test_settles_on_random_sets():
    """Every step of 200 runs converges."""
    sets, x0s = zip(*map(random_start, range(200)), strict=True)
    many = simulate_many(sets, x0s, 0.5, settings=Settings(method="time-stepping"), sample_interval=0.5)
    assert many.failure == ("",) * 200


def test_no_convergence_keeps_the_samples():
    """A ball that falls through a still fluid gets too fast for quadratic drag, b |w|^2 per mass.

    The iteration over smooth forces contracts by dt/2 times the slope of the drag, 2 b |w|, which has to be less than
    one; where drag carries the weight, it is sqrt(b g) dt.
    """
    b, dt, p = 10 / P.R, 0.4 * math.sqrt(P.R / P.g), P.replace(drag="quadratic", nu_f=1e-6, omega_0=0.0)
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
