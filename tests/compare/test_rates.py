"""Spectra from pushes are exact on linear motions and honest on bent ones."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.linalg import block_diag, expm

from compare.kit.fits import exponents, matched, propagator
from compare.kit.lab import coarse_step
from compare.kit.trials import Start
from compare.subjects.stability import measure as rates
from model import Case, Parameters

P = Parameters.named("reference")
EPS = float(np.finfo(float).eps)


def linear(J, interval, count=200):
    """D(t) = exp(J t) at `count` samples."""
    return np.stack([expm(J * interval * k) for k in range(count)])


def mixed(*values):
    """A matrix with these eigenvalues, none of its variables by itself; of a pair, one is given."""
    blocks = [[[v.real, v.imag], [-v.imag, v.real]] if v.imag else [[v.real]] for v in map(complex, values)]
    J = block_diag(*blocks)
    V = np.random.default_rng(1).normal(size=J.shape)
    return np.asarray(V @ J @ np.linalg.inv(V))


@pytest.mark.parametrize(
    "values", [(-0.5,), (0.0, -0.7), (-400.0, -30.0, -0.3 + 7j), (0.0, 20j, -0.2, -1.0, -6.0), (3.0, -1.0)]
)
def test_all_exponents_of_a_linear_motion_are_measured(values):
    J, interval = mixed(*values), 1e-3
    D = linear(J, interval)
    rates = exponents(lambda lag: propagator(D, lag), interval, len(D) // 3)
    wanted = np.linalg.eigvals(J).astype(complex)
    # The normal equations square the condition of the record; the least logarithm is over one interval.
    rounding = EPS * np.linalg.cond(np.concatenate(D, axis=1)) ** 2 / interval
    assert np.abs(matched(wanted, rates) - rates).max() <= 10 * rounding


def test_a_long_lag_makes_slow_exponents_sharper():
    D = linear(mixed(-0.5, -20.0), 1e-3, 400)
    D = D + 1e-7 * np.random.default_rng(2).normal(size=D.shape)
    short, long = (np.abs(exponents(lambda lag: propagator(D, lag), 1e-3, k) + 0.5).min() for k in (1, 128))
    assert long < short


def test_what_depends_on_the_size_of_the_push_and_on_the_step_is_extrapolated():
    leaning = rates.Pushed(Start("mine", P, "settled", np.zeros(8)), Case.SR)
    lasts, samples = rates.RECORD
    interval, step = lasts * coarse_step(P) / samples, coarse_step(P) / 16
    J, other = mixed(-1.0, -5.0), mixed(2.0, 1.0)
    bent = 0.05

    def answer(size, h):
        return linear(J + (bent * size + (5.0 * h) ** 2) * other, interval)

    coarse, large, small = (answer(size, h) for size, h in zip((0.05, 0.1, 0.05), (2 * step, step, step), strict=True))
    values, uncertainty = rates.spectrum(leaning, (coarse, large, small), step)
    wanted = matched(np.linalg.eigvals(J).astype(complex), values)
    plain = np.linalg.eigvals(J + bent * 0.05 * other).astype(complex)
    assert np.all(np.abs(values - wanted) <= 3 * uncertainty)
    assert np.abs(values - wanted).max() < np.abs(matched(plain, values) - wanted).max() / 10


def test_a_run_counts_up_to_where_the_ball_leaves_the_case(lab):
    slow = P.replace(omega_0=1.0)
    (run,) = lab.campaign.run([lab.task(slow, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, P.R / 2, -0.5], 0.2, 1e-3)])
    first = run.cases[1]
    assert first in (Case.RN, Case.SN)
    assert len(set(run.cases)) > 1
    assert all(case is first for case in run.cases[1 : rates.stays(run, first)])
    assert run.cases[rates.stays(run, first)] is not first


def test_a_ball_that_bounces_on_an_unloaded_floor_has_left_it():
    floor = np.zeros((6, 3))
    floor[:, 1] = 1.0, 1.0, 0.5, 0.0, 0.8, 0.0
    run = SimpleNamespace(case=np.full(6, int(Case.SR)), force_A=floor)
    assert rates.stays(run, Case.SR) == 3
