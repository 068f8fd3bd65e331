"""A motion that hasn't settled says so, and by how much it may change yet."""

import numpy as np
import pytest

import analytic
from compare.view import steady
from model import Parameters, State
from tests.commands import carried_out, told

SLOW = Parameters.named("steel-in-water").replace(omega_0=5.0)
"""Rolls, and is taken along with a time constant of 78 s."""


@pytest.mark.parametrize("lasts", [5.0, 30.0, 100.0, 300.0, 900.0])
def test_the_drift_tells_how_far_the_limit_is(lasts):
    run = analytic.simulate(SLOW, State(), lasts)
    means, drifts = steady.last_quarter(run)
    error = abs(means[2] - SLOW.omega_0)
    assert error / 1.5 < drifts[2] < 5 * error
    share = steady.share(np.array(means[2]), np.array(drifts[2]), np.array(SLOW.omega_0))
    assert (share > steady.DRIFT) == (error > steady.DRIFT * SLOW.omega_0)


def test_what_is_proposed_is_enough():
    p = SLOW.replace(omega_0=10.0)
    lasts, slowest = steady.enough([SLOW, p])
    assert slowest == pytest.approx((1 + 2 * p.j) / p.c)
    for each in (SLOW, p):
        run = analytic.simulate(each, State(), lasts)
        means, _ = steady.last_quarter(run)
        assert means[2] == pytest.approx(each.omega_0, rel=steady.DRIFT)


def test_a_sweep_that_is_too_short_says_so(here, capsys):
    line = "sweep --set steel-in-water --vary omega_0=5,8 --engine event --workers 0 --quiet"
    code, _, said = carried_out(capsys, line)
    assert (code, said.count("\n")) == (0, 2)
    assert "warning: the paper's model doesn't hold for this fluid" in said
    assert "has a time constant of 78.3 s, and --time 730 brings it to within 0.1 %" in said
    code, _, said = carried_out(capsys, "collect sweep")
    assert code == 0
    assert "2 of 2 runs have not settled: their omega_c may change by up to 8" in said
    assert "2 of 2 runs have not settled" in told(capsys, "inspect sweep.h5")
    code, _, said = carried_out(capsys, f"{line} --time 730 -o long")
    assert "time constant" not in said
    assert carried_out(capsys, "collect long -o long.h5")[2] == ""
    assert "settled all runs" in told(capsys, "inspect long.h5")
    shown = told(capsys, "simulate --set steel-in-water --omega-0 5 --time 30 --engine event")
    assert "not settled: omega_c = 4.67 ± 0.4 rad/s" in shown
    shown = told(capsys, "simulate --ramp 5 6 20 --time 10 --engine event")
    assert "none: the flow still changes" in shown
    shown = told(capsys, "simulate --omega-0 0 --time 3")
    assert "steady value omega_c = 0.000000000 ±" in shown
