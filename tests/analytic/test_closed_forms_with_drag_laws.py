"""Stationary solutions, fold and branch are right under every law of drag, by brute force; claims hold their rates.

The law, the branch of SS and the equations of motion are written out here again: nothing of `analytic.mechanics.drag`,
`slipping_branch` or `dynamics` is used for what is expected.
"""

import numpy as np
import pytest
from scipy.optimize import brentq

from analytic import (
    Stability,
    contact_forces,
    leaning_modes,
    slowest_time_constant,
    stationary_solutions,
    thresholds,
    vector_field,
)
from analytic.bifurcation.diagram import number_of_folds
from analytic.stationary import slipping_branch as sb
from analytic.stationary.slipping_branch import eigenvalues_at
from model import Case, Contact, Parameters
from model.drag import LAWS, QUADRATIC, SCHILLER_NAUMANN, STOKES
from tests import drag_laws
from tests.analytic import newton_euler as ne

P = Parameters.named("reference").replace(nu_f=2e-4)
LIGHT = {STOKES: 1.0, SCHILLER_NAUMANN: 1.0, QUADRATIC: 0.0}
"""The drag of a vanishing lag over Stokes'."""
NOT_STOKES = [law for law in LAWS if law != STOKES]


def resistance(speed, p):
    """Drag per mass, m s-2."""
    return float(drag_laws.resistance(speed, p)) * speed if speed else 0.0


def at_angle(angle, p):
    """omega_c and omega_0 of SS at |alpha| from (38), (39), with the lag whose drag balances friction, (41)."""
    cos, sin = np.cos(angle), np.sin(angle)
    den = (1 + p.j * cos**2) * p.mu * p.eta + (p.j - p.eta) * cos
    omega_c = np.sqrt(p.g / p.R * p.mu * (1 + p.eta * cos**2) / den)
    needed = p.g * p.mu * (p.j - p.eta) * cos * sin / den
    top = 1.0
    while resistance(top, p) < needed:
        top *= 2
    lag = brentq(lambda speed: resistance(speed, p) - needed, 0.0, top, xtol=1e-300, rtol=9e-16)
    return omega_c, omega_c + lag / p.R


def random_sets(law, count):
    """With folds for the most; Re along the branch from 1 to 1e4."""
    rng = np.random.default_rng([count, LAWS.index(law)])
    sets = []
    for _ in range(count):
        j, mu = rng.uniform(0.1, 2 / 3), 10 ** rng.uniform(-1.5, 0.5)
        kappa, nu_f = 10 ** rng.uniform(-3, 0.5), 10 ** rng.uniform(-5.5, -2)
        eta = j * rng.uniform(0.001, 0.999)
        c = kappa * np.sqrt(P.g / P.R)
        sets.append(P.replace(j=j, mu=mu, eta=eta, c=c, nu_f=nu_f, drag=law, C_D=rng.uniform(0.3, 1.0)))
    return sets


def scanned(p):
    """The greatest omega_0 of the branch inside its ends, by ever finer scans, and how many extrema the first saw."""
    angles = np.concatenate([np.geomspace(1e-9, 0.1, 100), np.linspace(0.1, np.pi / 2 - 0.1, 400)[1:]])
    angles = np.concatenate([angles, np.pi / 2 - np.geomspace(1e-9, 0.1, 200)[::-1][1:]])
    flows = np.array([at_angle(angle, p)[1] for angle in angles])
    rises = np.sign(np.diff(flows))
    turns = int(np.sum(rises[1:] != rises[:-1]))
    for _ in range(8):
        top = int(np.clip(np.argmax(flows), 1, len(angles) - 2))
        angles = np.linspace(angles[top - 1], angles[top + 1], 21)
        flows = np.array([at_angle(angle, p)[1] for angle in angles])
    return float(flows.max()), turns


@pytest.mark.parametrize("law", LAWS)
def test_fold_against_a_scan(law):
    """omega_04 to 1e-10, one fold beyond eta_cr and none before; omega_01, omega_02, omega_03 are those of Stokes."""
    folds = []
    for p in random_sets(law, 12):
        t, stokes = thresholds(p), thresholds(p.replace(drag=STOKES))
        assert (t.omega_01, t.omega_02, t.omega_03) == (stokes.omega_01, stokes.omega_02, stokes.omega_03)
        assert t.eta_cr == LIGHT[law] * stokes.eta_cr
        top, turns = scanned(p)
        assert number_of_folds(p) == (p.eta > t.eta_cr) == turns == np.isfinite(t.omega_04)
        folds.append(turns)
        if turns:
            assert abs(t.omega_04 / top - 1) <= 1e-10
            assert t.omega_04 > t.omega_02 > t.omega_01
    assert law == QUADRATIC or 3 <= sum(folds) <= 11


@pytest.mark.parametrize("nu_f", [1e-6, 5e-6, 1e-5, 1e-4])
def test_fold_where_the_drag_bends(nu_f):
    """With C_D constant beyond Re = 989 the drag grows faster at once: for 1e-6 and 5e-6 the fold is that corner."""
    p = P.replace(c=0.07, nu_f=nu_f, drag=SCHILLER_NAUMANN)
    top, turns = scanned(p)
    assert number_of_folds(p) == turns == 1
    assert abs(thresholds(p).omega_04 / top - 1) <= 1e-10
    point = sb.branch(sb.fold(p), p)
    lag = float(point.Omega_0 - point.Omega_c) * np.sqrt(p.g * p.R)
    assert (abs(2 * p.r * lag / nu_f - 988.95) < 0.01) == (nu_f < 8e-6)


# --- stationary solutions and their eigenvalues ----------------------------------------------------------------


def field(case, x, p):
    """Rates of a state on the wall under the drag of the law."""
    _, v_y, omega_c, w_x, w_y, w_z, *_ = x
    speed = float(np.hypot(v_y, p.R * (omega_c - p.omega_0)))
    c = resistance(speed, p) / speed if speed else LIGHT[p.drag] * p.c
    alpha = np.arctan2(p.r * w_x, v_y + p.r * w_z) if case.A is Contact.S else 0.0
    beta = np.arctan2(w_y, w_z) if case.B is Contact.S else 0.0
    solved = ne.solved(case)(p.m, p.r, p.R, p.j, p.mu, p.eta, p.g, c, p.omega_0, alpha, beta, *x)
    return np.array(solved[:8], dtype=float)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("eta", [0.02, 0.2, 0.39, 0.6])
@pytest.mark.parametrize("omega_0", [0.5, 1.0, 5.0, 8.0, 13.0, 14.0, 20.0, 22.0, 28.0, 31.0, 31.5, 33.0, 41.0, 60.0])
def test_solutions_are_zeros_of_the_equations(law, omega_0, eta):
    """Of those of the simulators to round-off of the largest acceleration, of those written out here to 1e-12 of it.

    NS sinks, which is its only rate (48): the drag alone balances the weight that the wall doesn't carry.
    """
    p = P.replace(drag=law, omega_0=omega_0, eta=eta)
    scale = (p.g + p.R * (omega_0**2 + p.c * omega_0)) / (p.j * p.r)
    for s in stationary_solutions(p):
        sinking = np.array([s.state.v_y, *[0.0] * 7])
        assert np.abs(vector_field(s.case, s.x, p) - sinking).max() <= 100 * np.finfo(float).eps * scale, s.case
        if s.case is not Case.RR:
            assert np.abs(field(s.case, s.x, p) - sinking).max() <= 1e-12 * scale, s.case
            np.testing.assert_array_equal([s.force_A, s.force_B], contact_forces(s.case, s.x, p))
        if s.case is Case.NS:
            assert s.moves
            assert s.state.v_y < 0
            assert resistance(-s.state.v_y, p) == pytest.approx(p.g - p.eta * p.R * omega_0**2, rel=1e-12)


@pytest.mark.parametrize("law", NOT_STOKES)
@pytest.mark.parametrize("omega_0", [5.0, 25.0, 40.0])
def test_where_the_fluid_takes_the_ball_along_a_slight_lag_decides(law, omega_0):
    """RR, SR, NR: the eigenvalues of Stokes' drag, or those without drag under the quadratic law, said so."""
    p = P.replace(drag=law, omega_0=omega_0, eta=0.6)
    same = p.replace(drag=STOKES, c=LIGHT[law] * p.c)
    for case in (Case.RR, Case.SR, Case.NR):
        (s,) = (s for s in stationary_solutions(p) if s.case is case)
        (stokes,) = (s for s in stationary_solutions(p.replace(drag=STOKES)) if s.case is case)
        (expected,) = (s for s in stationary_solutions(same) if s.case is case)
        np.testing.assert_allclose(
            np.sort_complex(s.eigenvalues), np.sort_complex(expected.eigenvalues), atol=1e-12 * omega_0
        )
        assert (s.exists, s.slip_stability, s.family) == (stokes.exists, stokes.slip_stability, stokes.family)
        exponential = law != QUADRATIC or stokes.stability is not Stability.ASYMPTOTIC
        assert s.stability is (stokes.stability if exponential else Stability.ALGEBRAIC)
        assert s.stable == stokes.stable
        assert s.stability is not Stability.ALGEBRAIC or slowest_time_constant(s) == np.inf
    if omega_0 == 40.0:  # the first mode of SR is that of leaning; the other dies out like a slight lag does
        expected, _ = leaning_modes(p.replace(drag=STOKES, c=LIGHT[law] * p.c + 1e-12))
        np.testing.assert_allclose(leaning_modes(p)[0], expected, atol=1e-10)


@pytest.mark.parametrize(("mu", "eta", "c"), [(0.2, 0.2, 1.0), (0.2, 0.02, 1.0), (0.7, 0.35, 0.01), (1.5, 0.1, 5.0)])
@pytest.mark.parametrize("law", LAWS)
def test_ends_of_the_branch(mu, eta, c, law):
    """The finite eigenvalues tend to closed forms with the c of a vanishing lag.

    In RR (omega_01) lambda^2 + c lambda/(1+2j) + 2 (g/R) mu (1+eta)/((1+mu eta)(1+2j)) = 0; in SR (omega_02)
    (2 mu eta omega_02 - c)/(1+j), which is positive exactly if there is a fold (87), and +-i omega_02. Under Stokes'
    law linearly in the distance exp(-|s|) from the end.
    """
    p = P.replace(drag=law, mu=mu, eta=eta, c=c)
    c, omega_02 = LIGHT[law] * c, np.sqrt(p.g / (eta * p.R))
    stiffness = 2 * p.g / p.R * mu * (1 + eta) / ((1 + mu * eta) * (1 + 2 * p.j))
    at_rr = np.roots([1.0, c / (1 + 2 * p.j), stiffness])
    at_sr = np.array([(2 * mu * eta * omega_02 - c) / (1 + p.j), 1j * omega_02, -1j * omega_02])
    for expected, sign in ((at_rr, -1), (at_sr, 1)):
        size = np.abs(expected).max()
        for distance in (18.0, 25.0) if law == STOKES else (25.0,):
            allowed = 1e4 * np.exp(-distance) * max(size, 1) if law == STOKES else 1e-3 * size
            values = eigenvalues_at(sign * distance, p)
            assert max(np.abs(values - value).min() for value in expected) <= allowed
    assert (at_sr[0].real > 0) == (eta > c**2 * p.R / (4 * p.g * mu**2))
