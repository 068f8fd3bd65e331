"""The slip bounds of sections 3.2 and 4 are what Newton and Euler give by algebra."""

import numpy as np
import pytest
import sympy as sp

from analytic.mechanics import dynamics
from analytic.slipping import slip_bounds
from analytic.slipping.slip_bounds import HeldBound, SlipBound
from model import Case, InputError, Parameters
from tests.analytic import newton_euler as ne

P = Parameters.named("reference")
w = sp.Symbol("w", positive=True)


def equal(left, right):
    return bool(sp.simplify(left - right) == 0)


def test_where_gamma_never_vanishes_the_bound_is_infinite():
    """The zeros themselves claims hold, (56) claim eq-13-gamma, and gamma of every other bound the next test."""
    assert SlipBound(3.0, -2.0).zero == 1.5
    assert SlipBound(3.0, 0.0).zero == HeldBound(P.replace(c=0.0), 1.0, 1, 1.0).zero == np.inf
    with pytest.raises(InputError, match="slip_z = 1"):
        slip_bounds.gamma_nr(0.0, [0.1, 0, 9.0, 0, 0, 1.0], P)
    with pytest.raises(InputError, match="RR divides the states of RS and SR only"):
        slip_bounds.filippov_share(Case.SS, 9.0, P)


@pytest.mark.parametrize("side", [1, -1])
def test_from_newton_and_euler(side):
    """gamma of every bound is the rate of the slip itself, with the forces of the case it leads to."""
    p = ne.PARAMETERS
    omega_0 = ne.omega_0
    spin = p.g / (p.j * omega_0 * p.r) - omega_0 * p.R / p.r
    table = [
        (slip_bounds.rr_to_rs(p, w, side), Case.RS, w, 0, 4, [(side, 0)]),
        (slip_bounds.rr_to_rs_stationary(p), Case.RS, omega_0, 0, 4, [(side, 0)]),
        (slip_bounds.rr_to_sr(p, w, side), Case.SR, w, 0, 3, [(side, 0)]),
        (slip_bounds.rr_to_sr_stationary(p), Case.SR, omega_0, 0, 3, [(side, 0)]),
        (slip_bounds.rr_to_ss(p, side), Case.SS, omega_0, 0, 5, [(0, side)] * 2),
        (slip_bounds.nr_to_ns(p, side), Case.NS, omega_0, spin, 5, [(0, side)]),
    ]
    for bound, outer, omega_c, slip_x, row, directions in table:
        x = [0, 0, omega_c, slip_x, 0, 0, 0, 0]
        rate = dynamics.newton_euler(outer, x, dynamics.FORCES[outer](x, p, omega_0, *directions), p, omega_0)[row]
        if isinstance(bound, HeldBound):
            gamma = bound.side * p.c * p.R * (omega_0 - w) / ((1 + p.j) * p.r) - bound.hold
        else:
            gamma = bound.offset + bound.slope * omega_0**2
        assert equal(gamma, side * rate), outer
