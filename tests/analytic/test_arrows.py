"""Every arrow of Fig. 6 at the stationary solutions, against the closed forms and the thresholds."""

from __future__ import annotations

import numpy as np
import pytest

from analytic import contact_forces, slip_bounds, slip_stability, thresholds
from analytic.arrows import Arrow, stability_along
from model import Case, Parameters
from tests.directions import slip_directions

P = Parameters.named("reference")
FLOWS = [0.0, 5.0, 12.0, 20.0, 35.0, -8.0]


def of(p: Parameters, inner: Case, outer: Case) -> list[Arrow]:
    return [a for a in stability_along(p) if (a.inner, a.outer) == (inner, outer)]


def test_all_arrows_of_figure_6_are_there() -> None:
    asked = {(a.inner, a.outer) for w in FLOWS for a in stability_along(P.replace(omega_0=w))}
    assert asked == {*slip_stability.SLIP_ARROWS, *slip_stability.LIFT_ARROWS}


@pytest.mark.parametrize("omega_0", FLOWS[1:])
def test_slip_out_of_rr_and_nr(omega_0: float) -> None:
    """(60), (67), (74), (82), (83)."""
    p = P.replace(omega_0=omega_0)
    bounds = {
        (Case.RR, Case.RS): [slip_bounds.rr_to_rs_stationary(p)] * 2,
        (Case.RR, Case.SR): [slip_bounds.rr_to_sr_stationary(p)] * 2,
        (Case.RR, Case.SS): [slip_bounds.rr_to_ss(p, side) for side in (1, -1)],
        (Case.NR, Case.NS): [slip_bounds.nr_to_ns(p, side) for side in (1, -1)],
    }
    for (inner, outer), expected in bounds.items():
        growths = [a.growth for a in of(p, inner, outer)]
        np.testing.assert_allclose(growths, [b.gamma(omega_0) for b in expected], rtol=1e-12, atol=1e-9)


def test_slip_out_of_rs() -> None:
    """A ball that spins on the spot is held by the friction of the floor alone: the wall slips, and carries nothing."""
    forward, backward = of(P.replace(omega_0=0.0), Case.RS, Case.SS)
    assert forward.growth == backward.growth == pytest.approx(-P.mu * P.g / (P.j * P.r), rel=1e-12)
    assert forward.closed
    assert not backward.closed, "the floor would push it off the wall"


def test_slip_out_of_sr() -> None:
    """The wall's share of the weight: (g - eta R omega_0^2)/(j r), which changes sign at omega_02 as (61) does."""
    for factor in (0.7, 0.99, 1.01, 1.4):
        p = P.replace(omega_0=factor * thresholds(P).omega_02)
        forward, backward = of(p, Case.SR, Case.SS)
        expected = (p.g - p.eta * p.R * p.omega_0**2) / (p.j * p.r)
        assert forward.growth == pytest.approx(expected, rel=1e-9)
        assert forward.closed == (factor < 1)
        assert backward.growth < 0


@pytest.mark.parametrize("omega_0", FLOWS[1:])
def test_lift(omega_0: float) -> None:
    """RR: (j R omega_0^2 - g)/(1+j). SR: 0. SS: -A_y/m (1 + mu eta cos alpha). RS at rest: -g."""
    p = P.replace(omega_0=omega_0)
    (rr,) = of(p, Case.RR, Case.NR)
    assert rr.lifts
    assert rr.growth == pytest.approx((p.j * p.R * omega_0**2 - p.g) / (1 + p.j), rel=1e-12)
    (sr,) = of(p, Case.SR, Case.NR)
    assert abs(sr.growth) <= 1e-13 * (p.g + p.R * omega_0**2)
    for a in of(p, Case.SS, Case.NS):
        (_, A_y, _), _ = contact_forces(Case.SS, a.x, p)
        alpha, _ = slip_directions(a.x, p)
        expected = -A_y / p.m * (1 + p.mu * p.eta * np.cos(alpha))
        assert a.growth == pytest.approx(expected, rel=1e-9)
    (rs,) = of(P.replace(omega_0=0.0), Case.RS, Case.NS)
    assert rs.growth == -P.g
