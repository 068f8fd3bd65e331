"""A run is the same alone and among many, and by the integrators of scipy."""

import fcntl

import numpy as np
import pytest

from analytic import Settings, simulate, simulate_many
from analytic.simulation import compiling, hybrid
from analytic.simulation.ensemble import random_starts
from analytic.simulation.integrator import StalledError
from model import Flow, Parameters, SimulationError, State
from model.drag import LAWS
from tests.by_scipy import runs_by_scipy

P = Parameters.named("reference").replace(omega_0=25.0, nu_f=1e-5)
FLOWS = (
    Flow.steady(25.0),
    Flow.staircase([10.0, 40.0, 20.0], 0.7),
    Flow.ramp(5.0, 45.0, 1.5),
    Flow.sine(25.0, 8.0, 1.5),
    Flow.sampled([0.0, 1.0, 2.0], [-10.0, -30.0, -15.0]),
)
STARTS = {
    "at rest": State(),
    "slips at both": State(omega_c=12.0, slip_x=-40.0, slip_y=5.0, slip_z=3.0),
    "on the wall": State(y=0.02, omega_c=44.0, slip_y=3.0),
    "on the floor": State(omega_c=10.0, h=0.01, v_h=0.1, slip_x=5.0),
    "flies": State(y=0.05, v_y=0.3, omega_c=8.0, h=0.02, v_h=-0.3),
}
BALLS = [P.replace(drag=LAWS[k % len(LAWS)]) for k in range(len(FLOWS))]
"""For each flow one, by all laws of drag."""


def assert_same(run, other, tolerance):
    """To a tolerance relative to the size of each variable."""
    assert run.complete
    np.testing.assert_array_equal(run.events.to_case, other.events.to_case)
    np.testing.assert_allclose(run.events.time, other.events.time, rtol=0, atol=tolerance)
    np.testing.assert_allclose(run.events.impulse_B, other.events.impulse_B, rtol=0, atol=tolerance)
    assert np.all(np.abs(run.x - other.x) <= tolerance * (np.abs(other.x).max(axis=0) + 0.01))


def landings(run):
    """How many of its landings count."""
    p, e = run.header.parameters, run.header.settings["restitution"]
    impacts = np.maximum(run.events.impulse_A[:, 1], run.events.impulse_B[:, 0]) / p.m / (1 + e)
    return np.sum(impacts > 1e-3 * np.sqrt(p.g * p.R))


@pytest.mark.parametrize(
    ("start", "restitution", "tolerance"),
    [*((start, 0.0, 1e-6) for start in STARTS), ("flies", 0.5, 1e-5)],
)
def test_event_driven_runs_agree(start, restitution, tolerance):
    """To what errors of 1e-9 in each grow to: chains of landings magnify them."""
    x0, (balls, flows) = STARTS[start], (BALLS[:1], FLOWS[:1]) if restitution else (BALLS, FLOWS)
    settings = Settings(restitution=restitution, initial_impact=True)
    given = {"settings": settings, "sample_interval": 0.1}
    alone = [simulate(p, x0, 1.5, flow, **given) for p, flow in zip(balls, flows, strict=True)]
    many = simulate_many(balls, x0, 1.5, flows, threads=2, **given)
    assert np.all(many.end == 1.5)
    assert not any(many.failure)
    for run, x, case, landed in zip(alone, many.x, many.case, many.landings, strict=True):
        np.testing.assert_allclose(x, run.x, rtol=0, atol=1e-6 * (np.abs(run.x).max() + 0.01))
        np.testing.assert_array_equal(case, run.case)
        assert landed.sum() == landings(run)
    with runs_by_scipy():
        for p, flow, run in zip(balls, flows, alone, strict=True):
            assert_same(simulate(p, x0, 1.5, flow, **given), run, tolerance)


def test_time_stepping_agrees():
    """To round-off, for one step serves both; at the ends of the flow's pieces a step ends, too."""
    settings, x0s = Settings(method="time-stepping", timestep=1e-3), np.array([*STARTS.values()])
    alone = [
        simulate(p, x, 0.75, flow, settings, sample_interval=0.25)
        for p, x, flow in zip(BALLS, x0s, FLOWS, strict=True)
    ]
    many = simulate_many(BALLS, x0s, 0.75, FLOWS, settings, sample_interval=0.25, threads=2)
    for run, x, case in zip(alone, many.x, many.case, strict=True):
        np.testing.assert_allclose(x, run.x, rtol=0, atol=1e-14 * np.abs(run.x).max())
        np.testing.assert_array_equal(case, run.case)


@pytest.mark.parametrize("method", ["event", "time-stepping"])
def test_a_quiet_run_ends(method):
    """A fall of .096 s, then rest: quiet for .25 s at the sample at .4; without drag and flow."""
    p = P.replace(c=0.0, omega_0=0.0)
    x0 = State(y=9.81 / 2 * 0.096**2, h=0.02)
    settings = Settings(method=method, timestep=1e-3)
    run = simulate_many(p, x0.stacked(), 1.0, settings=settings, sample_interval=0.1, quiet=0.25)
    assert run.end[0] == pytest.approx(0.4)
    assert run.landings[0].tolist() == [0, 1, *[0] * 9]
    np.testing.assert_array_equal(run.x[0, 4:], np.tile(run.x[0, 4], (7, 1)))
    assert np.all(run.case >= 0)


def test_where_steps_become_too_short_a_run_ends_with_what_it_has(monkeypatch):
    def breaks_off(stage, k, pieces, rows, *rest):
        rows.x[:2], rows.case[:2], rows.path[:2], rows.taken[:] = 7.0, 0, 0.0, (2, 0)
        raise StalledError("steps become too short")

    monkeypatch.setattr(hybrid, "run_through_flow", breaks_off)
    many = simulate_many(P, random_starts(P, 3, 4), 0.5, threads=1, sample_interval=0.1)
    assert all("steps become too short" in each for each in many.failure)
    assert np.all(np.isfinite(many.x[:, :2]))
    assert np.all(np.isnan(many.x[:, 2:]))
    with pytest.raises(SimulationError, match="steps become too short") as failed:
        simulate(P, State(), 0.5, sample_interval=0.1)
    np.testing.assert_array_equal(failed.value.trajectory.x, np.full((2, 8), 7.0))


def test_a_run_that_round_off_stops_is_tried_once_more():
    """This one hardly leaves the wall as the wall lets go."""
    rough = Parameters.named("reference").replace(omega_0=25.0, mu=1.5, eta=0.4)
    many = simulate_many(rough, random_starts(rough, 400, 2)[290], 2.0, sample_interval=0.5)
    assert many.failure == ("",)


def test_of_processes_one_compiles(monkeypatch):
    asked = []
    monkeypatch.setattr(fcntl, "flock", lambda file, how: asked.append(how))

    @compiling.compiled
    def more(x):
        return x + 1

    assert [more(1), more(2)] == [2, 3]
    assert asked == [fcntl.LOCK_EX]
