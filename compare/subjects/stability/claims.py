"""How disturbances of the stationary states die out, or grow: the eigenvalues of Propositions 1-6."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import analytic
from compare.claim import Bearing, Claim, Text, When, every, given
from compare.judge import theory
from compare.kit.check import Relation
from compare.kit.record import Measurement
from compare.subjects.stability.measure import natural_size
from model import Case

_JACOBIAN = "analytic.stationary_solutions: eigenvalues of the exact Jacobian"


def _spectrum(m: Measurement) -> tuple[complex, ...]:
    """The eigenvalues of the stationary state of a case, rad s-1; LookupError if theory has none, or no stable one.

    In NS y is cyclic, (48): it adds a zero to the eigenvalues of the reduced field. SR may be unstable.
    """
    p, case = m.parameters, Case[str(m.conditions["case"])]
    found = theory(analytic.stationary_solutions, p)
    those = [s for s in found if s.exists and s.case is case and (s.stable or case is Case.SR)]
    if len(those) != 1:
        raise LookupError(f"{case.name} has {len(those)} stationary states at omega_0 = {p.omega_0:g} rad/s")
    return (*([0.0] if case is Case.NS else []), *(complex(value) for value in those[0].eigenvalues))


def _other(m: Measurement) -> float:
    """The other part of the measured eigenvalue: the frequency of a decay rate, the decay rate of a frequency."""
    return float(m.conditions["frequency" if m.quantity == "decay_rate" else "decay_rate"])


def _size(m: Measurement) -> float:
    return natural_size(m.value, _other(m), m.parameters)


def _rate(
    quantity: str, when: When, eigenvalues: Callable[[Measurement], Iterable[complex]] = _spectrum, by: str = _JACOBIAN
) -> Bearing:
    """Decay rates or frequencies, by that eigenvalue with Im >= 0 which is nearest to the measured one."""

    def predict(m: Measurement) -> float:
        measured = complex(-m.value, _other(m)) if quantity == "decay_rate" else complex(-_other(m), m.value)
        nearest = min((complex(v.real, abs(v.imag)) for v in eigenvalues(m)), key=lambda value: abs(value - measured))
        return -nearest.real if quantity == "decay_rate" else nearest.imag

    return Bearing("rates", quantity, predict, when=when, size=_size, by=by)


def _bearings(case: Case) -> tuple[Bearing, ...]:
    """The whole spectrum of the state of a case."""
    when = given(case=case.name)
    count = Bearing("rates", "modes", lambda m: float(len(_spectrum(m))), when=when, by=_JACOBIAN)
    return _rate("decay_rate", when), _rate("frequency", when), count


def _slowest(grows: bool) -> Bearing:
    """The slowest decay of SR is one above omega_03 and none below."""

    def there(m: Measurement) -> bool:
        return bool(m.parameters.omega_0 < theory(analytic.thresholds, m.parameters).omega_03) is grows

    when = every(given(case="SR", mode=1), there)
    relation, by = Relation.AT_MOST if grows else Relation.AT_LEAST, "analytic.thresholds: omega_03"
    return Bearing("rates", "decay_rate", lambda m: 0.0, when=when, size=_size, relation=relation, by=by)


CLAIMS = (
    Claim(
        "prop-1-rate",
        "Prop. 1, (23)",
        "Rolling at both points, ω_c approaches the flow with the one rate c/(1 + 2j).",
        _bearings(Case.RR),
    ),
    Claim(
        "prop-2",
        "Prop. 2, (24), (33)",
        "In a fluid at rest a ball that spins next to the wall keeps its spin, whatever it is (a zero eigenvalue); "
        "going round dies out at the rate c/(1 + j).",
        _bearings(Case.RS),
    ),
    Claim(
        "prop-3-rate",
        "Prop. 3, (25), (35)",
        "Where the floor slips and the wall rolls, leaning on the floor dies out above ω₀₃ = √(g/jR) and grows "
        "below, at the rates of the eigenvalues of f_SR.",
        (
            *_bearings(Case.SR),
            _slowest(grows=False),
            _slowest(grows=True),
            _rate(
                "decay_rate",
                given(case="SR"),
                lambda m: theory(analytic.leaning_modes, m.parameters)[0],
                "analytic.leaning_modes",
            ),
        ),
        text=Text.CORRECTED,
        reason="With A_y = 0 the state is on the border to NR: the eigenvalues show on the side where the ball leans "
        "on the floor; on the other it lifts off, and its height is then free. (35) needs ω₀ ≥ √(g/(ηR)), not ≤.",
    ),
    Claim(
        "prop-4-rate",
        "Prop. 4, section 5.2",
        "Disturbances of slipping at both points die out, with the four eigenvalues of f_SS.",
        _bearings(Case.SS),
    ),
    Claim(
        "prop-5-rate",
        "Prop. 5, (27), (46)",
        "Carried by the wall alone the ball keeps any height (a zero eigenvalue); it swings about it with a pair "
        "of eigenvalues, and ω_c dies out at c/(1 + j).",
        _bearings(Case.NR),
    ),
    Claim(
        "prop-6-rate",
        "Prop. 6, (28), (48), (49)",
        "The ball that sinks along the wall has a pair of eigenvalues ± iω₀, which never dies out, a zero for the "
        "cyclic y, and else decay only.",
        _bearings(Case.NS),
    ),
)
SECTIONS = {"Stability": CLAIMS}
