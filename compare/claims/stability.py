"""How disturbances of the stationary states die out, or grow: the eigenvalues of Propositions 1-6."""

from __future__ import annotations

import analytic
from analytic import StationarySolution
from compare.claims.claim import Bearing, Claim, Relation, Text
from compare.claims.judge import remembered
from compare.measure.rates import natural_size
from compare.measure.record import Measurement
from model import Case, Parameters

PROTOCOL = "rates"


@remembered
def states(p: Parameters) -> tuple[StationarySolution, ...]:
    """All stationary solutions whose contact forces are admissible."""
    return tuple(s for s in analytic.stationary_solutions(p) if s.exists)


def spectrum(p: Parameters, case: Case) -> tuple[complex, ...]:
    """The eigenvalues of the stationary state of a case, rad s-1; LookupError if theory has none, or no stable one.

    In NS y is cyclic, (48): it adds a zero to the eigenvalues of the reduced field. SR may be unstable.
    """
    those = [s for s in states(p) if s.case is case and (s.stable or case is Case.SR)]
    if len(those) != 1:
        raise LookupError(f"{case.name} has {len(those)} stationary states at omega_0 = {p.omega_0:g} rad/s")
    (state,) = those
    return (*([0.0] if case is Case.NS else []), *(complex(value) for value in state.eigenvalues))


def eigenvalue(m: Measurement) -> complex:
    """The measured eigenvalue to which a decay rate or a frequency belongs, rad s-1."""
    if m.quantity == "decay_rate":
        return complex(-m.value, float(m.conditions["frequency"]))
    return complex(-float(m.conditions["decay_rate"]), m.value)


def nearest(m: Measurement) -> complex:
    """The predicted eigenvalue, of those with Im >= 0, that is nearest to the measured one."""
    one_of_each = [complex(v.real, abs(v.imag)) for v in spectrum(m.parameters, Case[str(m.conditions["case"])])]
    return min(one_of_each, key=lambda value: abs(value - eigenvalue(m)))


def decay_rate(m: Measurement) -> float:
    """- Re of the predicted eigenvalue, s-1."""
    return -nearest(m).real


def frequency(m: Measurement) -> float:
    """Im of the predicted eigenvalue, rad s-1."""
    return nearest(m).imag


def count(m: Measurement) -> float:
    """How many eigenvalues are predicted."""
    return float(len(spectrum(m.parameters, Case[str(m.conditions["case"])])))


def size(m: Measurement) -> float:
    """Natural size of a measured rate, s-1."""
    other = m.conditions["frequency" if m.quantity == "decay_rate" else "decay_rate"]
    return natural_size(m.value, float(other), m.parameters)


def bearings(case: Case) -> tuple[Bearing, ...]:
    """The whole spectrum of the state of a case."""

    def when(m: Measurement) -> bool:
        return m.conditions["case"] == case.name

    by = "analytic.stationary_solutions: eigenvalues of the exact Jacobian"
    return (
        Bearing(PROTOCOL, "decay_rate", decay_rate, when=when, size=size, by=by),
        Bearing(PROTOCOL, "frequency", frequency, when=when, size=size, by=by),
        Bearing(PROTOCOL, "modes", count, when=when, by=by),
    )


def _leaning_rate(m: Measurement) -> float:
    """- Re of the nearest of the modes of a ball that leans on the floor, s-1."""
    values, _ = analytic.leaning_modes(m.parameters)
    nearest_mode = min(values, key=lambda value: abs(complex(value.real, abs(value.imag)) - eigenvalue(m)))
    return -float(nearest_mode.real)


def _leans(m: Measurement) -> bool:
    return m.conditions["case"] == Case.SR.name


def _leaning(grows: bool) -> Bearing:
    """The slowest decay of SR is one above omega_03 and none below."""

    def when(m: Measurement) -> bool:
        slow = bool(m.parameters.omega_0 < analytic.thresholds(m.parameters).omega_03)
        return _leans(m) and m.conditions["mode"] == 1 and slow is grows

    relation, by = Relation.AT_MOST if grows else Relation.AT_LEAST, "analytic.thresholds: omega_03"
    return Bearing(PROTOCOL, "decay_rate", lambda m: 0.0, when=when, size=size, relation=relation, by=by)


CLAIMS = (
    Claim(
        id="prop-1-rate", source="Prop. 1, (23)",
        statement="Rolling at both points, ω_c approaches the flow with the one rate c/(1 + 2j).",
        bearings=bearings(Case.RR),
    ),
    Claim(
        id="prop-2", source="Prop. 2, (24), (33)",
        statement=(
            "In a fluid at rest a ball that spins next to the wall keeps its spin, whatever it is (a zero eigenvalue); "
            "going round dies out at the rate c/(1 + j)."
        ),
        bearings=bearings(Case.RS),
    ),
    Claim(
        id="prop-3-rate", source="Prop. 3, (25), (35)",
        statement=(
            "Where the floor slips and the wall rolls, leaning on the floor dies out above ω₀₃ = √(g/jR) and grows "
            "below, at the rates of the eigenvalues of f_SR."
        ),
        bearings=(
            *bearings(Case.SR), _leaning(False), _leaning(True),
            Bearing(PROTOCOL, "decay_rate", _leaning_rate, size=size, when=_leans, by="analytic.leaning_modes"),
        ),
        text=Text.CORRECTED,
        reason=(
            "With A_y = 0 the state is on the border to NR: the eigenvalues show on the side where the ball leans on "
            "the floor; on the other it lifts off, and its height is then free. (35) needs ω₀ ≥ √(g/(ηR)), not ≤."
        ),
    ),
    Claim(
        id="prop-4-rate", source="Prop. 4, section 5.2",
        statement="Disturbances of slipping at both points die out, with the four eigenvalues of f_SS.",
        bearings=bearings(Case.SS),
    ),
    Claim(
        id="prop-5-rate", source="Prop. 5, (27), (46)",
        statement=(
            "Carried by the wall alone the ball keeps any height (a zero eigenvalue); it swings about it with a pair "
            "of eigenvalues, and ω_c dies out at c/(1 + j)."
        ),
        bearings=bearings(Case.NR),
    ),
    Claim(
        id="prop-6-rate", source="Prop. 6, (28), (48), (49)",
        statement=(
            "The ball that sinks along the wall has a pair of eigenvalues ± iω₀, which never dies out, a zero for the "
            "cyclic y, and else decay only."
        ),
        bearings=bearings(Case.NS),
    ),
)  # fmt: skip
