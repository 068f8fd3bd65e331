"""What ends the flowmeter's range, and where slip begins in a pulsation, solutions and simulations find again."""

import math

import numpy as np
import pytest

from analytic import (
    characteristic_slope,
    mean_slope,
    operating_limit,
    operating_range,
    reading_range,
    simulate,
    solution,
    stable_solutions,
    thresholds,
    unloading_limit,
)
from analytic.flowmeter import pulsation, response
from analytic.flowmeter.characteristic import End
from model import Case, Flow, InputError, Parameters

P = Parameters.named("reference")
ROUGH = Parameters.named("high-wall-friction")


@pytest.mark.parametrize("trial", range(12))
def test_what_ends_the_operating_range(trial):
    """What else lasts just beyond: slip at both points, or the ride on the wall while the ball still rolls, too."""
    rng = np.random.default_rng(trial)
    p = P.replace(mu=rng.uniform(0.05, 2), eta=rng.uniform(0.05, 1), j=rng.uniform(0.2, 0.66))
    limit = operating_limit(p)
    below, beyond = (
        {s.case for s in stable_solutions(p.replace(omega_0=limit.omega_0 * (1 + side * 1e-6)))} for side in (-1, 1)
    )
    assert below == {Case.RR}
    assert beyond == ({Case.SS} if limit.end is End.SLIP else {Case.RR, Case.NR})
    assert (limit.end is End.SLIP) == (p.eta < p.j)


def test_limits_and_edges():
    """On either side of the unloading limit a ball on the wall can stay, or not; smooth contacts leave no range."""
    limit = unloading_limit(ROUGH)
    assert operating_range(ROUGH) == limit < thresholds(ROUGH).omega_03
    for factor, stays in ((0.999, False), (1.001, True)):
        lasting = stable_solutions(ROUGH.replace(omega_0=factor * limit))
        assert (Case.NR in {s.case for s in lasting}) == stays
    for smooth in ({"mu": 0.0}, {"eta": 0.0}, {"mu": 0.0, "eta": 0.6}):
        p = P.replace(omega_0=0.1, **smooth)
        assert operating_limit(p).end is End.SMOOTH
        assert {s.case for s in stable_solutions(p)} != {Case.RR}
    assert reading_range(ROUGH) == reading_range(P.replace(mu=0.0)) == np.inf
    assert operating_range(P.replace(mu=0.0)) == 0
    assert operating_range(P.replace(c=0.0)) == reading_range(P.replace(c=0.0)) == 0
    assert operating_limit(P.replace(c=0.0)).end is End.NO_DRAG
    assert np.isnan(unloading_limit(P.replace(eta=0.0)))


def test_the_characteristic_has_two_branches_between_omega_02_and_omega_04():
    p = P.replace(omega_0=35.0)
    with pytest.raises(InputError, match="several branches at omega_0 = 35 rad s-1: choose SR, SS, NR"):
        characteristic_slope(p)
    assert characteristic_slope(p, Case.NR) == characteristic_slope(p, Case.SR) == 1.0
    assert characteristic_slope(P.replace(omega_0=-10.0)) == 1.0
    with pytest.raises(InputError, match=r"no motion follows the flow at omega_0 = 12 rad s-1 with c = 0"):
        characteristic_slope(P.replace(c=0.0, omega_0=12.0))


def test_the_mean_of_the_slope_below_eta_cr():
    """What jump and mean are elsewhere claims slope-jump and slope-mean hold."""
    # Below eta_cr SS gains on the fluid again until it meets SR at omega_02.
    p = P.replace(eta=0.5 * thresholds(P).eta_cr)
    t = thresholds(p)
    near = solution(p.replace(omega_0=t.omega_02 * (1 - 1e-10)), Case.SS).state.omega_c
    assert mean_slope(p) == pytest.approx((near - t.omega_01) / (t.omega_02 - t.omega_01), rel=1e-9)
    with pytest.raises(InputError, match=r"eta = 0\.6 is out of range"):
        mean_slope(ROUGH)


# --- linear response -----------------------------------------------------------------------------------------


SLIPPING = P.replace(omega_0=25.0)


def test_rolling_is_a_first_order_lag_and_slow_pulsations_follow_the_characteristic():
    """What SS and RR do in pulsations, jumps and ramps claims show: pulsation-lag, jump-slipping, ramp-law."""
    k, t = P.c / (1 + 2 * P.j), np.array([0.0, 0.1, 1.0, 30.0])
    for frequency in (0.03, 3.0):
        assert response.transfer(P, Case.RR, frequency) == pytest.approx(
            1 / (1 + 2j * np.pi * frequency / k), rel=1e-14
        )
    np.testing.assert_allclose(response.step_response(P, Case.RR, t), -np.expm1(-k * t), rtol=1e-14)
    assert response.peak(P, Case.RR) == (np.inf, 1.0)
    slope = characteristic_slope(SLIPPING, Case.SS)
    assert response.transfer(SLIPPING, Case.SS, 0.0) == pytest.approx(slope, rel=1e-7)


def test_a_peak_lies_between_the_points_of_a_grid():
    """Where drag is weak the response lasts a thousand times as long as its first peak."""
    p = P.replace(c=0.01, omega_0=20.0)
    at, height = response.peak(p, Case.SS)
    t = at * (1 + np.array([-1e-3, 0.0, 1e-3]))
    y = response.step_response(p, Case.SS, t) / np.real(response.transfer(p, Case.SS, 0.0))
    assert y.argmax() == 1
    assert y[1] == pytest.approx(height, rel=1e-12)


def test_what_there_is_not():
    with pytest.raises(InputError, match="there is no fold"):
        response.ramp_coefficient(P.replace(eta=0.02))
    with pytest.raises(InputError, match="case SS has no stable"):
        response.transfer(P, Case.SS, 1.0)
    with pytest.raises(InputError, match="at one rate with Stokes' drag only"):
        response.rolling_rate(PULSATING["wake"])


# --- slip under pulsation against the event-driven simulator, and its limits in closed form ------------------


PULSATING = {
    "slips at both": P.replace(omega_0=12.0),
    "slow": P.replace(omega_0=4.0),
    "slips at the floor": Parameters.named("high-wall-friction").replace(omega_0=20.0),
    "wake": P.replace(omega_0=11.0, nu_f=5e-5, drag="schiller-naumann"),
    "quadratic": P.replace(omega_0=11.0, nu_f=2e-5, drag="quadratic"),
    "fills both cones": P.replace(omega_0=12.0, mu=0.6),
}


def rolling_rate(p):
    """With Stokes' law; some rate of this order with others."""
    return p.c / (1 + 2 * p.j)


def slips(p, amplitude, frequency):
    """Whether the ball, rolling in the rhythm of the flow, slips within a period."""
    x0 = [0, 0, float(pulsation.swing(p, amplitude, frequency, 0.0)[0]), 0, 0, 0]
    run = simulate(p, x0, 1.1 / frequency, Flow.sine(p.omega_0, amplitude, frequency))
    return any(Case(to) is not Case.RR for to in run.events.to_case)


@pytest.mark.parametrize("p", PULSATING.values(), ids=PULSATING)
@pytest.mark.parametrize("pace", [0.3, 2.0, 10.0, 60.0])
def test_onset(p, pace):
    """Found again by simulations that stop at the end of RR, to a part of ten thousand."""
    frequency = pace * rolling_rate(p) / (2 * math.pi)
    onset = pulsation.slip_onset(p, frequency)
    assert not slips(p, 0.9999 * onset, frequency)
    assert slips(p, 1.0003 * onset, frequency)  # the simulator looks 256 times a period


@pytest.mark.parametrize("p", PULSATING.values(), ids=PULSATING)
def test_slow_and_fast_pulsations_have_the_limits_in_closed_form(p):
    rate = rolling_rate(p) / (2 * math.pi)
    assert pulsation.slip_onset(p, 1e-4 * rate) == pytest.approx(pulsation.slow_onset(p), rel=1e-3)
    assert pulsation.slip_onset(p, 1e4 * rate) == pytest.approx(pulsation.fast_onset(p), rel=1e-5)


def test_the_mean_of_a_pulsation_is_that_of_the_thirtieth_period():
    p = PULSATING["slips at both"]
    frequency = rolling_rate(p) / math.pi
    amplitude = 1.3 * pulsation.slip_onset(p, frequency)
    flow = Flow.sine(p.omega_0, amplitude, frequency)
    run = simulate(p, [0, 0, p.omega_0, 0, 0, 0], 30 / frequency, flow, sample_interval=1 / frequency)
    shift = (run.theta[-1] - run.theta[-2]) * frequency - p.omega_0
    assert shift < -0.1
    assert pulsation.mean_error(p, amplitude, frequency) == pytest.approx(shift, rel=1e-5)
    assert pulsation.mean_error(p, 0.7 * amplitude, frequency) == 0  # rolls on


def test_forces_may_allow_more_on_a_rough_floor():
    """Between (73) and the cone of the floor, see docs/theory.md, section 7; elsewhere both ends of RR are one."""
    p = PULSATING["slips at both"]
    assert pulsation.slip_onset(p, 1.0, "infeasible") == pytest.approx(pulsation.slip_onset(p, 1.0), rel=1e-9)
    rough = p.replace(mu=0.92, eta=0.4, j=0.66)
    assert pulsation.slip_onset(rough, 100.0, "infeasible") > 1.05 * pulsation.slip_onset(rough, 100.0)
    # No pulsation ends rolling without drag, any does beyond omega_01 and from rest.
    for changes, onset in (({"c": 0.0}, math.inf), ({"omega_0": 14.0}, 0.0), ({"omega_0": 0.0}, 0.0)):
        assert pulsation.slip_onset(P.replace(**changes), 1.0) == onset
