"""The slip bounds of sections 3.2 and 4 are what Newton and Euler give by algebra."""

import numpy as np
import pytest
import sympy as sp

from analytic.mechanics import dynamics
from analytic.slipping import slip_bounds, slip_stability
from analytic.slipping.slip_bounds import HeldBound, SlipBound
from model import Case, InputError, Parameters, State
from tests.analytic import newton_euler as ne

P = Parameters.named("reference")
w = sp.Symbol("w", positive=True)


def random_sets(count, top=1.0):
    rng = np.random.default_rng(count)
    sets = []
    for _ in range(count):
        R = 10 ** rng.uniform(-2, 0)
        mu, eta, j, r = rng.uniform([0.02, 0.02, 0.1, 0.05 * R], [top, top, 2 / 3, 0.9 * R]).tolist()
        c, m, g = 10 ** rng.uniform(-2, 1), 10 ** rng.uniform(-3, 1), rng.uniform(1, 15)
        omega_0 = rng.uniform(-3, 3) * np.sqrt(9.81 / R)
        sets.append(Parameters(m=m, r=r, R=R, j=j, mu=mu, eta=eta, g=g, c=c, omega_0=omega_0))
    return sets


def equal(left, right):
    return bool(sp.simplify(left - right) == 0)


def test_where_gamma_never_vanishes_the_bound_is_infinite():
    """The zeros themselves claims hold, and gamma of every bound the next test."""
    assert SlipBound(3.0, -2.0).zero == 1.5
    assert SlipBound(3.0, 0.0).zero == HeldBound(P.replace(c=0.0), 1.0, 1, 1.0).zero == np.inf
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


def states_of_nr(p, count):
    rng = np.random.default_rng(7)
    unit = np.sqrt(p.g / p.R)
    x = rng.normal(size=(count, 6)) * [p.R, np.sqrt(p.g * p.R), 2 * unit, 3 * unit * p.R / p.r, 0, 0]
    x[:, 0] = np.abs(x[:, 0])
    return x


def test_56_at_any_state():
    """Against the vector field of NS, with v_y, omega_c, slip_x and beta anything."""
    for p in random_sets(20):
        beta = np.linspace(-np.pi, np.pi, 9)
        n = np.stack([np.sin(beta), np.cos(beta)], axis=-1)
        for x in states_of_nr(p, 10):
            growth = slip_stability.gamma(Case.NR, Case.NS, x, n, p)
            orbit, spin = abs(State.of(x).omega_c), abs(State.of(x).slip_x)
            scale = np.abs(slip_bounds.gamma_nr(beta, x, p)).max() + p.g / p.r + orbit * (spin + p.R / p.r * orbit)
            assert np.all(np.abs(slip_bounds.gamma_nr(beta, x, p) - growth) <= 1e-12 * scale / p.j)
            steepest = slip_bounds.gamma_nr(slip_bounds.steepest_nr(x, p), x, p)  # (58)
            assert np.all(slip_bounds.gamma_nr(np.linspace(-np.pi, np.pi, 99), x, p) <= steepest + 1e-12 * scale / p.j)
    x, beta = states_of_nr(P, 5), np.linspace(0, 6, 7)
    values = slip_bounds.gamma_nr(beta[:, None], x, P)
    assert values.shape == (7, 5)
    assert values[3, 2] == slip_bounds.gamma_nr(beta[3], x[2], P)
    with pytest.raises(InputError, match="slip_z = 1"):
        slip_bounds.gamma_nr(0.0, [0.1, 0, 9.0, 0, 0, 1.0], P)
