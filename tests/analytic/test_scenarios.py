"""The trajectories of sections 3 and 5.3, by what the paper says of them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from analytic.simulation import simulator
from model import Case, Parameters

ROUGH = Parameters.named("high-wall-friction")
LIMIT = math.sqrt(ROUGH.g / (ROUGH.eta * ROUGH.R))
"""omega_0 at which NR's stationary orbit loses its stability with respect to slipping (61)."""


def test_figure_4_slip_dies_out():
    run = simulator.slip_perturbation(ROUGH.replace(omega_0=1.2 * LIMIT), 1.0, 0.9, 0.1)
    assert [Case(code) for code in run.events.to_case] == [Case.NR]
    assert run.cases[0] is Case.NS
    # (60): the slowest direction loses slip at (1+j)/(r j) (eta R omega_0^2 - g).
    rate = (1 + ROUGH.j) / (ROUGH.r * ROUGH.j) * ROUGH.g * (1.2**2 - 1)
    assert run.events.time[0] <= 1.0 / rate


def test_figure_5_slip_grows():
    run = simulator.slip_perturbation(ROUGH.replace(omega_0=0.9 * LIMIT), 1.0, 0.9, 0.1)
    assert set(run.cases) == {Case.NS}
    assert np.all(np.diff(run.slip_speed_B[len(run.time) // 2 :]) > 0)


def test_unloading_ends_in_two_point_rolling_after_impacts():
    run = simulator.unloading(ROUGH, hold=20.0)
    visited = [Case(code) for code in run.events.to_case]
    assert visited[0] is Case.NS
    assert visited[-1] is Case.RR
    assert run.events.time[0] > 3 * 20.0  # only below omega_02
    assert np.any(run.events.impulse_A[:, 1] > 0)
    last = 0.98 * LIMIT
    start = abs(run.omega_c[run.time > run.events.time[-1]][0] - last)
    left = math.exp(-(80.0 - run.events.time[-1]) / (1 + 2 * ROUGH.j))
    assert run.omega_c[-1] == pytest.approx(last, abs=1.1 * start * left)
