"""Compiled runs and those in plain Python come to the same, in all cases, drag laws and flows, with restitution."""

import fcntl

import numpy as np
import pytest

from analytic import simulate
from analytic.simulation import compiling, hybrid
from model import Case, Flow, Parameters, State
from model.drag import LAWS

pytest.importorskip("numba")
P = Parameters.named("reference")
FLOWS = {
    "steady": Flow.steady(25.0),
    "staircase": Flow.staircase([10.0, 40.0, 20.0], 0.7),
    "ramp": Flow.ramp(5.0, 45.0, 1.5),
    "sine": Flow.sine(25.0, 8.0, 1.5),
    "backwards": Flow.sampled([0.0, 1.0, 2.0], [-10.0, -30.0, -15.0]),
}
STARTS = {
    "at rest": State(),
    "slips at both": State(omega_c=12.0, slip_x=-40.0, slip_y=5.0, slip_z=3.0),
    "on the wall": State(y=0.02, omega_c=44.0, slip_y=3.0),
    "on the floor": State(omega_c=10.0, h=0.01, v_h=0.1, slip_x=5.0),
    "flies": State(y=0.05, v_y=0.3, omega_c=8.0, h=0.02, v_h=-0.3),
}


def both(monkeypatch, *given, **settings):
    """Compiled runs and those in plain Python."""
    compiled = simulate(*given, **settings)
    with monkeypatch.context() as patch:
        patch.setattr(hybrid, "compiled", lambda: None)
        return compiled, simulate(*given, **settings)


def check_same(one, other, tolerance):
    assert one.complete
    np.testing.assert_array_equal(one.events.to_case, other.events.to_case)
    np.testing.assert_allclose(one.events.time, other.events.time, rtol=0, atol=tolerance)
    scale = np.abs(other.x).max(axis=0) + 0.01
    assert np.abs((one.x - other.x) / scale).max() < tolerance
    assert np.abs(one.events.impulse_B - other.events.impulse_B).max(initial=0.0) < tolerance


@pytest.mark.parametrize("flow", FLOWS)
@pytest.mark.parametrize("start", STARTS)
def test_runs_agree(monkeypatch, start, flow):
    """To what errors of 1e-9 in each grow to: chains of landings magnify them. Each law meets each start and flow."""
    law = list(LAWS)[([*STARTS].index(start) + [*FLOWS].index(flow)) % len(LAWS)]
    p = P.replace(drag=law, nu_f=1e-5, omega_0=25.0)
    x0 = STARTS[start].stacked()
    check_same(*both(monkeypatch, p, x0, 2.0, FLOWS[flow], sample_interval=0.05, initial_impact=True), 1e-6)


@pytest.mark.parametrize("leave", ["slip-stability", "infeasible"])
def test_the_end_of_rolling_agrees(monkeypatch, leave):
    p = P.replace(drag="quadratic", nu_f=1e-5)
    one, other = both(monkeypatch, p, np.zeros(8), 3.0, Flow.ramp(0.0, 60.0, 3.0), leave_rolling=leave)
    assert Case.RR in one.case
    assert len(set(one.case.tolist())) > 1
    check_same(one, other, 1e-6)


def test_rebounds_agree(monkeypatch):
    x0 = State(y=0.05, omega_c=5.0, h=0.01, v_h=-0.2).stacked()
    check_same(*both(monkeypatch, P.replace(omega_0=15.0), x0, 0.6, restitution=0.5, sample_interval=0.02), 1e-5)


def test_of_processes_one_compiles(monkeypatch):
    asked = []
    monkeypatch.setattr(fcntl, "flock", lambda file, how: asked.append(how))

    @compiling.compiled("of_a_test")
    def more(x):
        return x + 1

    assert [more(1), more(2)] == [2, 3]
    assert asked == [fcntl.LOCK_EX]
