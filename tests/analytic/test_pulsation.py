"""Slip under pulsation against the event-driven simulator, and its limits in closed form."""

import math

import numpy as np
import pytest

from analytic import simulate, thresholds
from analytic.flowmeter import pulsation, response
from analytic.stationary import solutions as stationary
from model import Case, Flow, Parameters

REFERENCE = Parameters.named("reference")
SETS = {
    "slips at both": REFERENCE.replace(omega_0=12.0),
    "slow": REFERENCE.replace(omega_0=4.0),
    "slips at the floor": Parameters.named("high-wall-friction").replace(omega_0=20.0),
    "wake": REFERENCE.replace(omega_0=11.0, nu_f=5e-5, drag="schiller-naumann"),
    "quadratic": REFERENCE.replace(omega_0=11.0, nu_f=2e-5, drag="quadratic"),
}


def rolling_rate(p: Parameters) -> float:
    """With Stokes' law; some rate of this order with others."""
    return p.c / (1 + 2 * p.j)


def slips(p: Parameters, amplitude: float, frequency: float) -> bool:
    """Whether the ball, rolling in the rhythm of the flow, slips within a period."""
    x0 = [0, 0, float(pulsation.swing(p, amplitude, frequency, 0.0)[0]), 0, 0, 0]
    run = simulate(p, x0, 1.1 / frequency, Flow.sine(p.omega_0, amplitude, frequency))
    return any(Case(to) is not Case.RR for to in run.events.to_case)


@pytest.mark.parametrize("p", SETS.values(), ids=SETS)
@pytest.mark.parametrize("pace", [0.3, 2.0, 10.0, 60.0])
def test_onset(p: Parameters, pace: float) -> None:
    """Found again by simulations that stop at the end of RR, to a part of ten thousand."""
    frequency = pace * rolling_rate(p) / (2 * math.pi)
    onset = pulsation.slip_onset(p, frequency)
    assert not slips(p, 0.9999 * onset, frequency)
    assert slips(p, 1.0003 * onset, frequency)  # the simulator looks 256 times a period


def test_forces_may_allow_more_on_a_rough_floor() -> None:
    """Between (73) and the cone of the floor, see docs/theory.md, section 7; elsewhere both ends of RR are one."""
    p = SETS["slips at both"]
    assert pulsation.slip_onset(p, 1.0, "infeasible") == pytest.approx(pulsation.slip_onset(p, 1.0), rel=1e-9)
    rough = p.replace(mu=0.92, eta=0.4, j=0.66)
    assert pulsation.slip_onset(rough, 100.0, "infeasible") > 1.05 * pulsation.slip_onset(rough, 100.0)


@pytest.mark.parametrize("frequency", [0.1, 1.0])
@pytest.mark.parametrize("name", ["slips at both", "wake", "quadratic"])
def test_the_first_harmonic_is_that_of_the_simulation(name: str, frequency: float) -> None:
    p, amplitude = SETS[name], 0.8 * pulsation.slip_onset(SETS[name], frequency)
    x0 = [0, 0, float(pulsation.swing(p, amplitude, frequency, 0.0)[0]), 0, 0, 0]
    flow = Flow.sine(p.omega_0, amplitude, frequency)
    run = simulate(p, x0, 1 / frequency, flow, sample_interval=1 / (256 * frequency))
    ratio = 2j * np.mean((run.omega_c * np.exp(-2j * np.pi * frequency * run.time))[:-1]) / amplitude
    assert pulsation.first_harmonic(p, amplitude, frequency) == pytest.approx(ratio, rel=1e-5)
    if name == "slips at both":
        assert ratio == pytest.approx(response.transfer(p, Case.RR, frequency), rel=1e-7)
    else:  # the stronger the pulsation, the more closely it is followed
        assert abs(ratio / pulsation.first_harmonic(p, amplitude / 2, frequency)) > 1.02


@pytest.mark.parametrize("p", SETS.values(), ids=SETS)
def test_limits_of_the_onset(p: Parameters) -> None:
    k = rolling_rate(p)
    assert pulsation.slip_onset(p, 1e5 * k) == pytest.approx(pulsation.fast_onset(p), rel=1e-6)
    slow = [abs(pulsation.slip_onset(p, f * k) / pulsation.slow_onset(p) - 1) for f in (1e-4, 1e-5)]
    assert slow[1] < 0.5 * slow[0] or slow[1] < 1e-8
    assert slow[1] < 1e-3


@pytest.mark.parametrize(
    ("changes", "wanted"), [({"c": 0.0}, math.inf), ({"omega_0": 14.0}, 0.0), ({"omega_0": 0.0}, 0.0)]
)
def test_no_onset(changes: dict[str, float], wanted: float) -> None:
    assert pulsation.slip_onset(REFERENCE.replace(**changes), 1.0) == wanted


@pytest.mark.parametrize("name", ["slips at both", "wake", "quadratic"])
def test_finer_predictions_are_the_same(name: str) -> None:
    """Twice as many harmonics, and a motion that is integrated and repeats itself more exactly, change little."""
    p, frequency = SETS[name], 1.0
    amplitude = 1.5 * pulsation.slip_onset(p, frequency)
    exact = 1 + 1j * pulsation.lag_harmonics(p, amplitude, frequency, 2 * pulsation.FINE)[0] / amplitude
    assert pulsation.first_harmonic(p, amplitude, frequency) == pytest.approx(exact, rel=1e-6)
    exact = pulsation.mean_error(p, amplitude, frequency, settled=1e-9, rtol=1e-10)
    assert pulsation.mean_error(p, amplitude, frequency) == pytest.approx(exact, rel=2e-5)


def test_mean_error_of_fast_pulsations() -> None:
    """None as long as the ball rolls; beyond, as Moreau's time stepping has it, which knows no cases."""
    p, frequency = SETS["slips at both"], 1.5
    onset = pulsation.slip_onset(p, frequency)
    assert pulsation.mean_error(p, 0.99 * onset, frequency) == 0.0
    expected = pulsation.mean_error(p, 1.5 * onset, frequency)
    x0, flow = [0, 0, p.omega_0 + expected, 0, 0, 0], Flow.sine(p.omega_0, 1.5 * onset, frequency)
    run = simulate(p, x0, 20 / frequency, flow, method="time-stepping", timestep=1e-3, sample_interval=1 / frequency)
    assert expected < -0.1
    assert (run.theta[-1] - run.theta[-2]) * frequency - p.omega_0 == pytest.approx(expected, rel=0.01)


def test_a_ball_may_slip_all_the_time() -> None:
    """In SS throughout, with no change of case, the mean is that of the characteristic as long as it is straight."""
    p = SETS["slips at both"].replace(omega_0=25.0)
    assert pulsation.mean_error(p, 1e-3, 1.0) == pytest.approx(stationary.solution(p, Case.SS).x[2] - 25.0, rel=1e-5)


def test_mean_error_of_slow_pulsations() -> None:
    """They tend to the mean of the characteristic along the wave, of which SS has the part beyond omega_01."""
    p = SETS["slips at both"]
    flows = p.omega_0 + 3.0 * np.sin(np.pi * (np.arange(500) + 0.5) / 500)  # what is below the mean reads the flow
    beyond = flows[flows > thresholds(p).omega_01].tolist()
    limit = sum(stationary.solution(p.replace(omega_0=w), Case.SS).state.omega_c - w for w in beyond) / 1000
    near, far = (abs(pulsation.mean_error(p, 3.0, f * rolling_rate(p)) - limit) for f in (1e-2, 4e-2))
    assert near < 0.3 * far
    assert near < 1e-2 * abs(limit)


def test_both_witnesses_of_the_azimuth() -> None:
    """The mean of omega_c, sampled densely, is what the azimuth says."""
    p, amplitude, frequency = SETS["slips at both"], 8.0, 0.5
    x0 = [0, 0, float(pulsation.swing(p, amplitude, frequency, 0.0)[0]), 0, 0, 0]
    run = simulate(p, x0, 40.0, Flow.sine(p.omega_0, amplitude, frequency), sample_interval=2e-3)
    last = run.time >= 38.0
    mean = np.trapezoid(run.omega_c[last], run.time[last]) / 2.0
    assert mean - p.omega_0 == pytest.approx(pulsation.mean_error(p, amplitude, frequency), rel=1e-4)
