"""Many event-driven runs, each of them one compiled call, come to what single runs come to."""

import numpy as np
import pytest

from analytic import Settings, simulate, simulate_many
from analytic.simulation import hybrid
from analytic.simulation.ensemble import random_starts
from analytic.simulation.integrator import StalledError
from model import Parameters, State
from model.drag import LAWS
from model.errors import InputError
from tests.analytic.test_solvers import FLOWS, STARTS

P = Parameters.named("reference").replace(omega_0=25.0)


@pytest.fixture(params=["compiled", "plain"])
def way(request, monkeypatch):
    """Compiled runs, or those in plain Python."""
    if request.param == "compiled":
        pytest.importorskip("numba")
    else:
        monkeypatch.setattr(hybrid, "compiled", lambda: None)
    return request.param


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_runs_are_those_of_simulate(way, restitution):
    """All laws of drag, flows and starts at once: to what errors of 1e-9 in each grow to (`test_solvers`)."""
    laws = [P.replace(drag=law, nu_f=1e-5) for law in LAWS]
    given = [(p, x0, flow) for p in laws for x0 in STARTS.values() for flow in FLOWS.values()]
    if restitution:
        given = [(p, x0._replace(h=0.02), flow) for p, x0, flow in given if x0.y or x0.h][::5]
    elif way == "plain":  # is slow: each law, start and flow in some of them
        given = given[::7]
    sets, x0s, flows = zip(*given, strict=True)
    settings = Settings(restitution=restitution, initial_impact=True)
    many = simulate_many(sets, x0s, 1.0, flows, settings, sample_interval=0.1, threads=2)
    for n, (p, x0, flow) in enumerate(given):
        one = simulate(p, x0, 1.0, flow, settings, sample_interval=0.1)
        np.testing.assert_allclose(many.x[n], one.x, rtol=0, atol=1e-6 * (np.abs(one.x).max() + 0.01))
        assert np.array_equal(many.case[n], one.case)
        hard = np.maximum(one.events.impulse_A[:, 1], one.events.impulse_B[:, 0]) / p.m / (1 + restitution)
        assert many.landings[n].sum() == np.sum(hard > 1e-3 * np.sqrt(p.g * p.R))
    assert np.all(many.end == 1.0)
    assert not any(many.failure)


def test_the_number_of_threads_changes_nothing(way):
    x0s = random_starts(P, 12, 3)
    one, two = (simulate_many(P, x0s, 1.0, sample_interval=0.25, threads=threads) for threads in (1, 2))
    np.testing.assert_array_equal(one.x, two.x)
    np.testing.assert_array_equal(one.landings, two.landings)


@pytest.mark.parametrize("method", ["event", "time-stepping"])
def test_a_quiet_run_ends(way, method):
    """A fall of .096 s, then rest: quiet for .25 s at the sample at .4; without drag and flow."""
    p = P.replace(c=0.0, omega_0=0.0)
    x0 = State(y=9.81 / 2 * 0.096**2, h=0.02)
    settings = Settings(method=method, timestep=1e-3)
    run = simulate_many(p, x0.stacked(), 1.0, settings=settings, sample_interval=0.1, quiet=0.25)
    assert run.end[0] == pytest.approx(0.4)
    assert run.landings[0].tolist() == [0, 1, *[0] * 9]
    np.testing.assert_array_equal(run.x[0, 4:], np.tile(run.x[0, 4], (7, 1)))
    assert np.all(run.case[0, 1:] >= 0)


def test_where_compiled_steps_become_too_short_plain_python_takes_over(monkeypatch):
    x0, given = random_starts(P, 3, 4), {"sample_interval": 0.1}
    many, one = simulate_many(P, x0, 0.5, threads=1, **given), simulate(P, x0[0], 0.5, **given)

    def breaks_off(stage, k, pieces, rows, *most):
        rows.x[:2], rows.landings[:], rows.taken[:] = 7.0, 7, (2, len(rows.events) > 0)
        raise StalledError

    monkeypatch.setattr(hybrid, "compiled", lambda: breaks_off)
    plain, single = simulate_many(P, x0, 0.5, threads=1, **given), simulate(P, x0[0], 0.5, **given)
    np.testing.assert_allclose(plain.x, many.x, rtol=0, atol=1e-7 * np.abs(many.x).max())
    np.testing.assert_array_equal(plain.landings, many.landings)
    np.testing.assert_allclose(single.x, one.x, rtol=0, atol=1e-7 * np.abs(one.x).max())
    assert len(single.events) == len(one.events)


def test_a_torque_of_the_fluid_is_for_time_stepping():
    with pytest.raises(InputError, match="fluid_torque = 1 s-1: the event-driven simulation"):
        simulate_many(P.replace(fluid_torque=1.0), np.zeros(6), 0.1)
    stepping = Settings(method="time-stepping")
    assert simulate_many(P.replace(fluid_torque=1.0), np.zeros(6), 0.1, settings=stepping).end[0] == 0.1


@pytest.mark.parametrize("threads", [0, -1, 1_000_000, 1.5])
def test_threads_that_there_cannot_be(threads):
    with pytest.raises(InputError, match="threads = "):
        simulate_many(P, np.zeros(6), 0.1, threads=threads)
