"""How disturbances of stationary states die out or grow: eigenvalues of Props. 1-6."""

from __future__ import annotations

from functools import partial

import numpy as np

import analytic
from analytic import StationarySolution
from analytic.mechanics import dynamics
from compare.method.record import Measurement
from compare.subjects.stability.measure import natural_size
from compare.verification.claim import Criterion, Text, claim, given
from compare.verification.judge import theory
from compare.verification.states import thresholds_of
from model import Case, Parameters, State
from model.arrays import Array
from model.cases import TRAITS
from model.kinematics import VARIABLES, state_units

_JACOBIAN = "analytic.stationary_solutions: eigenvalues of the exact Jacobian"
_MODES_SR, _LINEAR = "analytic.eigenmodes_SR", "exponential of the exact Jacobian"


def _stationary(m: Measurement) -> StationarySolution:
    """The stationary state of a case, SR also unstable; LookupError without one."""
    p, case = m.parameters, m.case
    found = theory(analytic.stationary_solutions, p)
    those = [s for s in found if s.exists and s.case is case and (s.stable or case is Case.SR)]
    if len(those) != 1:
        raise LookupError(
            f"{case.name} has {len(those)} stationary states at omega_0 = {p.omega_0:g} rad/s"
        )
    return those[0]


def _spectrum(m: Measurement) -> tuple[complex, ...]:
    """The eigenvalues of the stationary state, rad s-1; in NS y is cyclic (48): a zero."""
    state = _stationary(m)
    return (*([0.0] if state.case is Case.NS else []), *map(complex, state.eigenvalues))


def _mode(m: Measurement) -> complex:
    """The eigenvalue of theory for a mode, by its number in order of frequency, rad s-1."""
    values = _spectrum(m)
    real = 1e-9 * max(map(abs, values))  # round-off in the imaginary part of one that is real
    upper = sorted((v.imag if v.imag > real else 0.0, -v.real) for v in values if v.imag >= -real)
    if not (mode := round(m.at["mode"])) <= len(upper):
        raise LookupError(f"theory has {len(upper)} modes")
    frequency, decay = upper[mode - 1]
    return complex(-decay, frequency)


def _mode_size(m: Measurement) -> float:
    """Natural size of decay rate or frequency of a mode, s-1."""
    value = _mode(m)
    parts = (-value.real, value.imag)
    return natural_size(*(parts if m.quantity == "decay_rate" else parts[::-1]), m.parameters)


def _response(m: Measurement) -> float:
    """How a linear motion follows a push, in natural units; of SR by its eigenmodes."""
    p, case, time = m.parameters, (stationary := _stationary(m)).case, m.at["time"]
    names = TRAITS[case].active
    i, j = names.index(m.at["of"]), names.index(m.at["pushed"])
    if case is Case.SR:
        values, rows = theory(analytic.eigenmodes_SR, p)
        moved = (rows.T * np.exp(values * time)) @ np.linalg.inv(rows.T)
    else:
        moved = theory(_propagator, case, tuple(stationary.x), p, time)
    units = state_units(p)[[VARIABLES.index(name) for name in names]]
    return float(moved[i, j].real * units[j] / units[i])


def _propagator(case: Case, x: tuple[float, ...], p: Parameters, time: float) -> Array:
    """How the linear motion about a state carries disturbances on by a time in s, (d, d)."""
    from scipy.linalg import expm  # here, because it takes long to load

    return np.asarray(expm(time * dynamics.jacobian(case, State.of(np.array(x)), p)))


def _criteria(case: Case) -> tuple[Criterion, ...]:
    """Criteria on all eigenvalues of the stationary state of a case."""
    rates = partial(Criterion, "rates", when=given(case=case.name))
    return (
        rates("decay_rate", lambda m: -_mode(m).real, size=_mode_size, by=_JACOBIAN),
        rates("frequency", lambda m: _mode(m).imag, size=_mode_size, by=_JACOBIAN),
        rates("response", _response, by=_MODES_SR if case is Case.SR else _LINEAR),
        rates("slowest_decay", _slowest, by="analytic.slowest_time_constant"),
    )


def _slowest(m: Measurement) -> float:
    """The slowest of the decays, whatever grows or stays besides, s-1."""
    return 1 / analytic.slowest_time_constant(_stationary(m))


_FIRST_OF_SR = given(case="SR", mode=1)


def _leans(m: Measurement) -> float:
    """The slowest decay of SR: its first eigenmode below omega_03, where it grows."""
    decay = -theory(analytic.eigenmodes_SR, m.parameters)[0].real
    return float(decay[0] if m.parameters.omega_0 < thresholds_of(m).omega_03 else min(decay))


CLAIMS = (
    claim(
        "prop-1-rate",
        "Prop. 1, (23)",
        "Rolling at both points, ω_c approaches the flow with the one rate c/(1 + 2j).",
        *_criteria(Case.RR),
    ),
    claim(
        "prop-2",
        "Prop. 2, (24), (33)",
        "In a fluid at rest a ball that spins next to the wall keeps its spin, whatever it is (a "
        "zero eigenvalue). Going round dies out at the rate c/(1 + j).",
        *_criteria(Case.RS),
    ),
    claim(
        "prop-3-rate",
        "Prop. 3, (25), (35)",
        "In SR a load on the floor dies out above ω₀₃ = √(g/jR) and grows "
        "below, at the rates of the eigenvalues of f_SR.",
        *_criteria(Case.SR),
        Criterion("rates", "decay_rate", _leans, when=_FIRST_OF_SR, size=_mode_size, by=_MODES_SR),
        text=Text.CORRECTED,
        reason="With A_y = 0 the state is on the border to NR. The eigenvalues show on the side "
        "where the ball leans on the floor. On the other it lifts off, and its height is then "
        "free. (35) needs ω₀ ≥ √(g/(ηR)), not ≤.",
    ),
    claim(
        "prop-4-rate",
        "Prop. 4, section 5.2",
        "Disturbances of slipping at both points die out, with the four eigenvalues of f_SS.",
        *_criteria(Case.SS),
    ),
    claim(
        "prop-5-rate",
        "Prop. 5, (27), (46)",
        "Carried by the wall alone the ball keeps any height (a zero eigenvalue); it swings about "
        "it with a pair of eigenvalues, and ω_c dies out at c/(1 + j).",
        *_criteria(Case.NR),
    ),
    claim(
        "prop-6-rate",
        "Prop. 6, (28), (48), (49)",
        "The ball that sinks along the wall has a pair of eigenvalues ± iω₀, which never dies out, "
        "a zero for the cyclic y, and else decay only.",
        *_criteria(Case.NS),
    ),
)
SECTIONS = {"Stability": CLAIMS}
