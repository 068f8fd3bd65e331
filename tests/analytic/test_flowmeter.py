"""Ranges, slopes and onsets of slip have limits where no ball can be measured, and say where there
are none."""

import math

import numpy as np
import pytest

import analytic
from analytic.flowmeter import pulsation, response
from analytic.flowmeter.characteristic import End
from model import Case, Flow, Parameters, State

P = Parameters.named("reference")
ROUGH = Parameters.named("high-wall-friction")


def test_contacts_and_fluids_that_leave_no_range():
    """What the limits are elsewhere claims operating-range and unloading-limit hold."""
    for smooth in ({"mu": 0.0}, {"eta": 0.0}, {"mu": 0.0, "eta": 0.6}):
        p = P.replace(omega_0=0.1, **smooth)
        assert analytic.operating_limit(p).end is End.SMOOTH
        assert {s.case for s in analytic.stable_solutions(p)} != {Case.RR}
    assert analytic.operating_range(P.replace(mu=0.0)) == 0
    assert analytic.operating_limit(P.replace(c=0.0)).end is End.NO_DRAG
    undamped = P.replace(c=0.0)
    assert analytic.operating_range(undamped) == analytic.reading_range(undamped) == 0
    assert analytic.reading_range(ROUGH) == analytic.reading_range(P.replace(mu=0.0)) == np.inf
    assert np.isnan(analytic.unloading_limit(P.replace(eta=0.0)))


def test_the_characteristic_has_two_branches_between_omega_02_and_omega_04():
    p = P.replace(omega_0=35.0)
    assert [analytic.characteristic_slope(p, case) for case in (Case.NR, Case.SR)] == [1.0, 1.0]
    assert analytic.characteristic_slope(P.replace(omega_0=-10.0)) == 1.0


def test_the_mean_of_the_slope_below_eta_cr():
    """What jump and mean are elsewhere claims slope-jump and slope-mean hold."""
    # Below eta_cr SS gains on the fluid again until it meets SR at omega_02.
    p = P.replace(eta=0.5 * analytic.thresholds(P).eta_cr)
    t = analytic.thresholds(p)
    near = analytic.solution(p.replace(omega_0=t.omega_02 * (1 - 1e-10)), Case.SS).state.omega_c
    slope = (near - t.omega_01) / (t.omega_02 - t.omega_01)
    assert analytic.mean_slope(p) == pytest.approx(slope, rel=1e-9)


def test_a_peak_lies_between_the_points_of_a_grid():
    """Where drag is weak the response lasts a thousand times as long as its first peak."""
    p = P.replace(c=0.01, omega_0=20.0)
    at, height = response.peak(p, Case.SS)
    t = at * (1 + np.array([-1e-3, 0.0, 1e-3]))
    y = response.step_response(p, Case.SS, t) / np.real(response.transfer(p, Case.SS, 0.0))
    assert y.argmax() == 1
    assert y[1] == pytest.approx(height, rel=1e-12)


def test_a_pulsation_may_need_a_larger_amplitude_than_a_fast_one():
    """In thick oil."""
    p = Parameters.named("plastic-in-oil")
    p = p.replace(omega_0=0.85 * analytic.thresholds(p).omega_01)
    slow, middle = (pulsation.slip_onset(p, times * p.c) for times in (0.1, 0.9))
    assert slow < pulsation.fast_onset(p) < 0.995 * middle


def test_forces_may_allow_more_on_a_rough_floor():
    """Between (73) and the cone of the floor, see docs/theory.md, section 7; elsewhere both ends of
    RR are one."""
    onset, p = pulsation.slip_onset, P.replace(omega_0=12.0)
    assert onset(p, 1.0, "infeasible") == pytest.approx(onset(p, 1.0), rel=1e-9)
    rough = p.replace(mu=0.92, eta=0.4, j=0.66)
    assert onset(rough, 100.0, "infeasible") > 1.05 * onset(rough, 100.0)
    # No pulsation ends rolling without drag, any does beyond omega_01 and from rest.
    assert onset(P.replace(c=0.0), 1.0) == math.inf
    assert [onset(P.replace(omega_0=flow), 1.0) for flow in (14.0, 0.0)] == [0.0, 0.0]


@pytest.mark.parametrize(
    ("name", "share", "times", "case"),
    [
        ("reference", 0.4, 4.0, Case.RS),
        ("reference", 0.75, 4.0, Case.SS),
        ("high-wall-friction", 0.6, 3.8, Case.SR),
    ],
)
def test_a_mean_is_off_by_the_spin_about_the_tangent(name, share, times, case):
    """From the balances of (20): c D = -omega_c' + j r/R (omega_y' - omega_x' - omega_c omega_z).

    In a periodic motion the mean of D is -j r/(c R) that of omega_c omega_z: none where only the
    floor or only the wall slips, negative where both do. Samples on either side of a change of case
    are joined by a line: half a sample."""
    p = Parameters.named(name)
    t = analytic.thresholds(p)
    p = p.replace(omega_0=share * (t.omega_01 if p.eta < p.j else t.omega_03))
    f, samples = 0.5, 4000
    flow = Flow.sine(p.omega_0, times * p.omega_0, f)
    start = analytic.simulate(p, State(omega_c=p.omega_0), 20 / f, flow, sample_interval=1 / f)
    run = analytic.simulate(p, start.x[-1], 1 / f, flow, sample_interval=1 / f / samples)
    x = State.of(run.x)
    o_z = x.slip_z + x.v_y / p.r
    lag = p.c * np.trapezoid(x.omega_c - flow(run.time), run.time)
    turned = p.j * p.r / p.R * np.trapezoid(x.omega_c * o_z, run.time)
    spin = x.slip_y - x.slip_x - 2 * p.R / p.r * x.omega_c  # omega_y - omega_x by (4)
    ends = p.j * p.r / p.R * (spin[-1] - spin[0]) - (x.omega_c[-1] - x.omega_c[0])
    assert lag == pytest.approx(ends - turned, abs=5 * np.abs(x.omega_c).max() / samples)
    assert case in run.cases
    error = pulsation.mean_error(p, times * p.omega_0, f)
    if case is Case.SS:
        assert error == pytest.approx(-turned * f / p.c, rel=1e-3)
        assert error < -0.01 * p.omega_0
    else:
        assert {name for each in run.cases for name in each.name} == {"R", "S"}
        assert Case.SS not in run.cases
        assert abs(error) < 1e-6 * p.omega_0
