"""Linear response and ramps against the event-driven simulator, which knows nothing of either."""

import numpy as np
import pytest

import analytic
from analytic.flowmeter import response
from model import Case, Contact, Flow, InputError, Parameters

P = Parameters.named("reference")
SLIPPING = P.replace(omega_0=25.0)


def pulsating(p: Parameters, case: Case, amplitude: float, frequency: float):
    """Mean shift of omega_c over a period, and omega_c over omega_0 at the frequency, once settled."""
    x = analytic.solution(p, case).x
    slowest = analytic.slowest_time_constant(analytic.solution(p, case))
    count, each = 1 + int(np.ceil(20 * slowest * frequency)), 64
    flow = Flow.sine(p.omega_0, amplitude, frequency)
    run = analytic.simulate(p, x, count / frequency, flow, sample_interval=1 / (each * frequency))
    shift = float(run.theta[-1] - run.theta[-1 - each]) * frequency - x[2]
    wave = np.exp(-2j * np.pi * frequency * run.time[-each:])
    return shift, 2j * np.mean(run.omega_c[-each:] * wave) / amplitude


@pytest.mark.parametrize("frequency", [0.03, 0.3, 3.0])
def test_rolling_is_a_first_order_lag_at_any_amplitude(frequency: float) -> None:
    k = P.c / (1 + 2 * P.j)
    expected = 1 / (1 + 2j * np.pi * frequency / k)
    shift, ratio = pulsating(P, Case.RR, 1.4, frequency)
    assert response.transfer(P, Case.RR, frequency) == pytest.approx(expected, rel=1e-14)
    assert ratio == pytest.approx(expected, rel=1e-7)
    assert abs(shift) < 1e-8
    t = np.array([0.0, 0.1, 1.0, 30.0])
    np.testing.assert_allclose(response.step_response(P, Case.RR, t), -np.expm1(-k * t), rtol=1e-14)
    assert response.peak(P, Case.RR) == (np.inf, 1.0)


@pytest.mark.parametrize("frequency", [0.3, 1.1, 3.0])
def test_slipping_follows_by_its_jacobian(frequency: float) -> None:
    """What the linear theory leaves out goes with the square of the amplitude, and so does the shift of the mean."""
    transfer = response.transfer(SLIPPING, Case.SS, frequency)
    (much, high), (little, low) = (pulsating(SLIPPING, Case.SS, amplitude, frequency) for amplitude in (0.5, 0.25))
    assert abs(low / transfer - 1) < max(0.4 * abs(high / transfer - 1), 1e-6)
    assert little / much == pytest.approx(0.25, rel=1e-2)


def test_slow_pulsations_follow_the_characteristic() -> None:
    def slope(omega_0: float) -> float:
        return analytic.characteristic_slope(P.replace(omega_0=omega_0), Case.SS)

    assert response.transfer(SLIPPING, Case.SS, 0.0) == pytest.approx(slope(25.0), rel=1e-7)


@pytest.mark.parametrize("omega_0", [18.0, 25.0, 35.0])
def test_a_jump(omega_0: float) -> None:
    """The odd part of two small jumps, up and down; its highest point."""
    p, size = P.replace(omega_0=omega_0), 1e-3
    x = analytic.solution(p, Case.SS).x
    up, down = (analytic.simulate(p.replace(omega_0=omega_0 + s), x, 4.0) for s in (size, -size))
    odd = (up.omega_c - down.omega_c) / (2 * size)
    expected = response.step_response(p, Case.SS, up.time)
    np.testing.assert_allclose(odd, expected, atol=1e-3 * np.abs(expected).max())
    time, height = response.peak(p, Case.SS)
    slope = analytic.characteristic_slope(p, Case.SS)
    if np.isinf(time):
        assert height == 1
        assert np.all(odd < 1.001 * slope)
    else:
        assert odd.max() / slope == pytest.approx(height, rel=1e-3)
        assert up.time[odd.argmax()] == pytest.approx(time, abs=0.01)


def test_a_ramp_passes_the_fold_by_the_two_thirds_power_of_its_rate() -> None:
    """Beyond the local law K rate^(2/3) the overshoot has terms rate ln(rate) and rate: three rates show all three."""
    fold, K = analytic.thresholds(P).omega_04, response.ramp_coefficient(P)
    rates = np.array([0.003, 0.01, 0.03])
    passed = []
    for rate in rates:
        before, after = 10 * K * rate ** (2 / 3) / rate, 2 * K * rate ** (2 / 3) / rate
        start, t_end = fold - rate * before, before + after
        x = analytic.solution(P.replace(omega_0=start), Case.SS).x
        run = analytic.simulate(P, x, t_end, Flow.ramp(start, start + rate * t_end, t_end))
        lift = next(t for t, to in zip(run.events.time, run.events.to_case, strict=True) if Case(to).A is Contact.N)
        passed.append(start + rate * lift - fold)
    terms = np.stack([rates ** (2 / 3), rates * np.log(rates), rates], axis=-1)
    assert np.linalg.solve(terms, passed)[0] == pytest.approx(K, rel=0.005)


def test_what_there_is_not() -> None:
    with pytest.raises(InputError, match="there is no fold"):
        response.ramp_coefficient(P.replace(eta=0.02))
    with pytest.raises(InputError, match="case SS has no stable"):
        response.transfer(P, Case.SS, 1.0)


def test_rolling_reads_the_mean_of_a_sine_with_any_law_of_drag_but_not_of_every_wave() -> None:
    """Half a period later a sine is mirrored, and so is the motion; a wave with its second harmonic isn't."""
    p = P.replace(nu_f=1e-5, drag="schiller-naumann")
    errors = []
    for waves in ([(1.2, 0.5, 0.0)], [(1.2, 0.5, 0.0), (0.6, 1.0, 0.0)]):
        run = analytic.simulate(p, [0, 0, 12.0, 0, 0, 0], 40.0, Flow.sines(12.0, waves), sample_interval=2.0)
        assert set(run.cases) == {Case.RR}
        errors.append((run.theta[-1] - run.theta[-2]) / 2.0 - 12.0)
    assert abs(errors[0]) < 1e-6
    assert abs(errors[1]) > 1e-3
