"""Whole spectra from pushes: exact on linear motions, honest on bent ones, and judged."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import product
from typing import Any

import numpy as np
import pytest
from scipy.linalg import block_diag, expm

import analytic
from analytic.mechanics import dynamics
from compare.claim import Outcome
from compare.judge import judge
from compare.kit.fits import exponents, matched, propagator
from compare.kit.lab import Lab, coarse_step, state_units, time_unit
from compare.kit.record import Records
from compare.kit.trials import Start
from compare.subjects.stability import claims as stability
from compare.subjects.stability import measure as rates
from model import Case, Parameters
from model.arrays import Array
from model.cases import TRAITS
from model.kinematics import VARIABLES
from tests.measured import measured, unnoticed

P = Parameters.named("reference")
EPS = float(np.finfo(float).eps)


def linear(J: Array, interval: float, count: int = 200) -> Array:
    """D(t) = exp(J t) at `count` samples."""
    return np.stack([expm(J * interval * k) for k in range(count)])


def mixed(*values: complex) -> Array:
    """A matrix with these eigenvalues, none of its variables by itself; of a pair, one is given."""
    blocks = [[[v.real, v.imag], [-v.imag, v.real]] if v.imag else [[v.real]] for v in map(complex, values)]
    J = block_diag(*blocks)
    V = np.random.default_rng(1).normal(size=J.shape)
    return np.asarray(V @ J @ np.linalg.inv(V))


@pytest.mark.parametrize(
    "values", [(-0.5,), (0.0, -0.7), (-400.0, -30.0, -0.3 + 7j), (0.0, 20j, -0.2, -1.0, -6.0), (3.0, -1.0)]
)
def test_all_exponents_of_a_linear_motion_are_measured(values: tuple[complex, ...]) -> None:
    J, interval = mixed(*values), 1e-3
    D = linear(J, interval)
    rates = exponents(lambda lag: propagator(D, lag), interval, len(D) // 3)
    wanted = np.linalg.eigvals(J).astype(complex)
    # The normal equations square the condition of the record; the least logarithm is over one interval.
    rounding = EPS * np.linalg.cond(np.concatenate(D, axis=1)) ** 2 / interval
    assert np.abs(matched(wanted, rates) - rates).max() <= 10 * rounding


def test_a_long_lag_makes_slow_exponents_sharper() -> None:
    D = linear(mixed(-0.5, -20.0), 1e-3, 400)
    D = D + 1e-7 * np.random.default_rng(2).normal(size=D.shape)
    short, long = (np.abs(exponents(lambda lag: propagator(D, lag), 1e-3, k) + 0.5).min() for k in (1, 128))
    assert long < short


def test_what_depends_on_the_size_of_the_push_and_on_the_step_is_extrapolated() -> None:
    leaning = rates.Pushed(Start("mine", P, "settled", np.zeros(8)), Case.SR)
    lasts, samples = rates.RECORD
    interval, step = lasts * coarse_step(P) / samples, coarse_step(P) / 16
    J, other = mixed(-1.0, -5.0), mixed(2.0, 1.0)
    bent = 0.05

    def answer(size: float, h: float) -> Array:
        return linear(J + (bent * size + (5.0 * h) ** 2) * other, interval)

    coarse, large, small = (answer(size, h) for size, h in zip((0.05, 0.1, 0.05), (2 * step, step, step), strict=True))
    values, uncertainty = rates.spectrum(leaning, (coarse, large, small), step)
    wanted = matched(np.linalg.eigvals(J).astype(complex), values)
    plain = np.linalg.eigvals(J + bent * 0.05 * other).astype(complex)
    assert np.all(np.abs(values - wanted) <= 3 * uncertainty)
    assert np.abs(values - wanted).max() < np.abs(matched(plain, values) - wanted).max() / 10


def test_a_run_counts_up_to_where_the_ball_leaves_the_case(lab: Lab) -> None:
    slow = P.replace(omega_0=1.0)
    (run,) = lab.run([lab.task(slow, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, P.R / 2, -0.5], 0.2, 1e-3)])
    first = run.cases[1]
    assert first in (Case.RN, Case.SN)
    assert len(set(run.cases)) > 1
    assert all(case is first for case in run.cases[1 : rates.stays(run, first)])
    assert run.cases[rates.stays(run, first)] is not first


@pytest.fixture(scope="module")
def spectra() -> Records:
    """What a perfect engine would measure."""
    rough, rows = Parameters.named("high-wall-friction"), []
    flows = {
        Case.RR: (8.0,),
        Case.RS: (0.0,),
        Case.SR: (18.5, 28.0),
        Case.SS: (20.0,),
        Case.NR: (28.0,),
        Case.NS: (15.0,),
    }
    for case, omega_0 in ((case, flow) for case, own in flows.items() for flow in own):
        base = rough if case in (Case.SR, Case.NR) else P
        p = base.replace(omega_0=omega_0)
        (solution,) = (s for s in analytic.stationary_solutions(p) if s.case is case and (s.stable or case is Case.SR))
        values = [*solution.eigenvalues, *([0.0j] if case is Case.NS else [])]
        row = partial(measured, "rates", p=p, set="mine", case=case.name)
        rows.append(row("modes", len(values), 0.0))
        values = [complex(v.real, v.imag if abs(v.imag) > 1e-9 * abs(v) else 0.0) for v in values]
        in_order = sorted((v for v in values if v.imag >= 0), key=lambda v: (v.imag, -v.real))
        for mode, value in enumerate(in_order, start=1):
            sure = 1e-4 * (abs(value) or 1.0)
            rows.append(row("decay_rate", -value.real, sure, mode=mode))
            rows.append(row("frequency", value.imag, sure, mode=mode))
        slowest = 1 / analytic.slowest_time_constant(solution)
        rows.append(row("slowest_decay", slowest, 1e-4 * slowest))
        units, J = state_units(p), dynamics.jacobian(case, solution.state, p)
        moved, names = expm(0.02 * J), TRAITS[case].active
        for (i, of), (j, by) in product(enumerate(names), enumerate(names)):
            scale = units[VARIABLES.index(by)] / units[VARIABLES.index(of)]
            rows.append(row("response", moved[i, j] * scale, 1e-4, time=0.02, of=of, pushed=by))
    return Records(tuple(rows))


def test_the_right_theory_is_confirmed(spectra: Records) -> None:
    for verdict in judge(stability.CLAIMS, spectra):
        assert verdict.outcome is Outcome.CONFIRMED, verdict.claim.id


@pytest.mark.parametrize(
    "change",
    [
        lambda s: replace(s, eigenvalues=s.eigenvalues[:-1]),
        lambda s: replace(s, eigenvalues=np.append(s.eigenvalues, s.eigenvalues[-1])),
        lambda s: replace(s, stability=analytic.Stability.UNSTABLE),
    ],
)
def test_wrong_spectra_are_noticed(
    spectra: Records, monkeypatch: pytest.MonkeyPatch, change: Callable[..., Any]
) -> None:
    """One eigenvalue too few or too many; a state that theory calls unstable."""
    right = analytic.stationary_solutions
    monkeypatch.setattr(analytic, "stationary_solutions", lambda p: [change(s) for s in right(p)])
    refuted = {each.claim.id for each in judge(stability.CLAIMS, spectra) if each.outcome is Outcome.REFUTED}
    assert "prop-4-rate" in refuted


def test_wrong_rates_and_exchanged_modes_are_noticed(spectra: Records) -> None:
    assert not unnoticed(stability.CLAIMS, spectra, "eigenvalues_at", "eigenvalues", "leaning_modes")


def test_the_rate_of_rolling_and_of_spinning_is_measured_with_mujoco(lab: Lab) -> None:
    p = P.replace(omega_0=0.6 / time_unit(P))
    values = {name: p.omega_0 if name == "omega_c" else 0.0 for name in VARIABLES[1:6]}
    before = [measured("settled", name, w, p=p, set="mine", case="RR", start="rest") for name, w in values.items()]
    records = Records.of(rates.measure(lab, {"mine": P}, Records(tuple(before))))
    verdicts = {verdict.claim.id: verdict for verdict in judge(stability.CLAIMS, records)}
    for name, quantities in (("prop-1-rate", 5), ("prop-2", 10)):
        assert verdicts[name].outcome is Outcome.CONFIRMED
        assert len(verdicts[name].checks) == quantities
    assert verdicts["prop-4-rate"].outcome is Outcome.NOT_RUN
    assert any("SS" in each.reason for each in verdicts["prop-4-rate"].missing)
