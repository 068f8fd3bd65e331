"""Stationary solutions, fold and branch are right under every law of drag, by brute force; claims
hold their rates.

The law and the branch of SS are written out here again: nothing of `analytic.mechanics.drag` or
`slipping_branch` is used for what is expected. The equations of motion are those of
`test_dynamics`."""

import numpy as np
import pytest

import analytic
from analytic.bifurcation.diagram import number_of_folds
from analytic.stationary import slipping_branch as sb
from model import Case, Parameters
from model.drag import LAWS, QUADRATIC, SCHILLER_NAUMANN, STOKES
from tests.drag_laws import resistance

P = Parameters.named("reference").replace(nu_f=2e-4)
LIGHT = {STOKES: 1.0, SCHILLER_NAUMANN: 1.0, QUADRATIC: 0.0}
"""The drag of a vanishing lag over Stokes'."""
NOT_STOKES = [law for law in LAWS if law != STOKES]


def lag_of(needed, p):
    """The lag in m/s whose drag is `needed`, m/s2: by bisection of its logarithm."""
    low, high = np.full_like(needed, 1e-40), np.full_like(needed, 1e10)
    for _ in range(70):
        middle = np.sqrt(low * high)
        enough = resistance(middle, p) * middle > needed
        low, high = np.where(enough, low, middle), np.where(enough, middle, high)
    return high


def flow_at(angle, p):
    """omega_0 of SS at |alpha| from (38), (39), with the lag whose drag balances friction, (41)."""
    cos, sin = np.cos(angle), np.sin(angle)
    den = (1 + p.j * cos**2) * p.mu * p.eta + (p.j - p.eta) * cos
    omega_c = np.sqrt(p.g / p.R * p.mu * (1 + p.eta * cos**2) / den)
    return omega_c + lag_of(p.g * p.mu * (p.j - p.eta) * cos * sin / den, p) / p.R


def random_set(law, rng):
    """With a fold, mostly; Re along the branch from 1 to 1e4."""
    j, mu = rng.uniform(0.1, 2 / 3), 10 ** rng.uniform(-1.5, 0.5)
    kappa, nu_f = 10 ** rng.uniform(-3, 0.5), 10 ** rng.uniform(-5.5, -2)
    eta, c = j * rng.uniform(0.001, 0.999), kappa * np.sqrt(P.g / P.R)
    return P.replace(j=j, mu=mu, eta=eta, c=c, nu_f=nu_f, drag=law, C_D=rng.uniform(0.3, 1.0))


def scanned(p):
    """The greatest omega_0 of the branch inside its ends, by ever finer scans, and how many extrema
    the first saw."""
    first, middle = np.geomspace(1e-9, 0.1, 100), np.linspace(0.1, np.pi / 2 - 0.1, 400)[1:]
    angles = np.concatenate([first, middle, np.pi / 2 - np.geomspace(1e-9, 0.1, 200)[::-1][1:]])
    flows = flow_at(angles, p)
    rises = np.sign(np.diff(flows))
    turns = int(np.sum(rises[1:] != rises[:-1]))
    for _ in range(8):
        top = int(np.clip(np.argmax(flows), 1, len(angles) - 2))
        angles = np.linspace(angles[top - 1], angles[top + 1], 21)
        flows = flow_at(angles, p)
    return float(flows.max()), turns


@pytest.mark.parametrize("law", LAWS)
def test_fold_against_a_scan(law):
    """omega_04 to 1e-10, one fold beyond eta_cr and none before; omega_01, omega_02, omega_03 are
    those of Stokes."""
    folds, rng = [], np.random.default_rng([12, LAWS.index(law)])
    for p in (random_set(law, rng) for _ in range(12)):
        t, stokes = analytic.thresholds(p), analytic.thresholds(p.replace(drag=STOKES))
        for name in ("omega_01", "omega_02", "omega_03"):
            assert getattr(t, name) == getattr(stokes, name)
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
    """With C_D constant beyond Re = 989 the drag grows faster at once: for 1e-6 and 5e-6 the fold
    is that corner."""
    p = P.replace(c=0.07, nu_f=nu_f, drag=SCHILLER_NAUMANN)
    top, turns = scanned(p)
    assert number_of_folds(p) == turns == 1
    assert abs(analytic.thresholds(p).omega_04 / top - 1) <= 1e-10
    point = sb.branch(sb.fold(p), p)
    lag = float(point.Omega_0 - point.Omega_c) * np.sqrt(p.g * p.R)
    assert (abs(2 * p.r * lag / nu_f - 988.95) < 0.01) == (nu_f < 8e-6)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("eta", [0.02, 0.2, 0.39, 0.6])
@pytest.mark.parametrize("omega_0", [0.5, 5.0, 13.0, 14.0, 22.0, 31.5, 33.0, 60.0])
def test_solutions_are_zeros_of_the_equations(law, omega_0, eta):
    """To round-off of the largest acceleration.

    NS sinks, which is its only rate (48): the drag alone balances the weight that the wall doesn't
    carry."""
    p = P.replace(drag=law, omega_0=omega_0, eta=eta)
    scale = (p.g + p.R * (omega_0**2 + p.c * omega_0)) / (p.j * p.r)
    for s in analytic.stationary_solutions(p):
        sinking = np.array([s.state.v_y, *[0.0] * 7])
        off = np.abs(analytic.vector_field(s.case, s.x, p) - sinking).max()
        assert off <= 100 * np.finfo(float).eps * scale, s.case
        if s.case is not Case.RR:
            forces = analytic.contact_forces(s.case, s.x, p)
            np.testing.assert_array_equal([s.force_A, s.force_B], forces)
        if s.case is Case.NS:
            assert s.moves
            sinks = -s.state.v_y
            assert sinks > 0
            left = p.g - p.eta * p.R * omega_0**2
            assert resistance(sinks, p) * sinks == pytest.approx(left, rel=1e-12)


@pytest.mark.parametrize("law", NOT_STOKES)
@pytest.mark.parametrize("omega_0", [5.0, 25.0, 40.0])
def test_where_the_fluid_takes_the_ball_along_a_slight_lag_decides(law, omega_0):
    """RR, SR, NR: the eigenvalues of Stokes' drag, or those without drag under the quadratic law,
    said so."""
    p = P.replace(drag=law, omega_0=omega_0, eta=0.6)
    same = p.replace(drag=STOKES, c=LIGHT[law] * p.c)
    for case in (Case.RR, Case.SR, Case.NR):
        sets = p, p.replace(drag=STOKES), same
        ((s,), (stokes,), (expected,)) = (analytic.stationary_solutions(q, (case,)) for q in sets)
        mine, right = (np.sort_complex(each.eigenvalues) for each in (s, expected))
        np.testing.assert_allclose(mine, right, atol=1e-12 * omega_0)
        for name in ("exists", "slip_stability", "family"):
            assert getattr(s, name) == getattr(stokes, name)
        exponential = law != QUADRATIC or stokes.stability is not analytic.Stability.ASYMPTOTIC
        assert s.stability is (stokes.stability if exponential else analytic.Stability.ALGEBRAIC)
        assert s.stable == stokes.stable
        if s.stability is analytic.Stability.ALGEBRAIC:
            assert analytic.slowest_time_constant(s) == np.inf
    # the first mode of SR is that of the load; the other dies out like a slight lag does
    if omega_0 == 40.0:
        expected, _ = analytic.eigenmodes_SR(p.replace(drag=STOKES, c=LIGHT[law] * p.c + 1e-12))
        np.testing.assert_allclose(analytic.eigenmodes_SR(p)[0], expected, atol=1e-10)
