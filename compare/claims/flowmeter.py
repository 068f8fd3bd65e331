"""The ball as a flowmeter (section 5.3): slope and range of its characteristic curve, hysteresis (Fig. 13)."""

from __future__ import annotations

from collections.abc import Callable

import analytic
from compare.claims.claim import Bearing, Claim, Text
from compare.claims.judge import remembered
from compare.claims.stationary import cases, detected, lasting
from compare.measure.record import Measurement
from compare.measure.settling import scale
from model import Case, Parameters


@remembered
def _slope(p: Parameters, case: Case) -> float:
    return analytic.characteristic_slope(p, case)


def slope(m: Measurement) -> float:
    """Slope of the characteristic curve in the case that was detected."""
    return _slope(m.parameters, detected(m))


def _slopes(by: str, predict: Callable[[Measurement], float], function: str, *cases: Case) -> Bearing:
    """Slopes measured in one way, in units of the slope of rolling."""

    def when(m: Measurement) -> bool:
        return m.conditions["by"] == by and detected(m) in cases

    return Bearing("slope", "slope", predict, when=when, scale=lambda p: 1.0, by=f"analytic.{function}")


def _settled(quantity: str, predict: Callable[[Measurement], float], when: Callable[[Measurement], bool]) -> Bearing:
    return Bearing(
        "settled", quantity, predict, when=when, scale=None if quantity == "case" else lambda p: scale(quantity, p)
    )


def _only_rolling(m: Measurement) -> float:
    """Within the operating range RR, whatever the start on the floor or, as long as it lasts there, on the wall."""
    if m.parameters.omega_0 < analytic.operating_range(m.parameters):
        return float(Case.RR)
    if m.conditions["start"] == _telling(m.parameters) and detected(m) is Case.RR:
        raise LookupError("beyond the range, rolling is not the only motion that lasts")
    return m.value


def _telling(p: Parameters) -> str:
    """The start from which it shows that the range has ended: the ball slips on the floor, or stays on the wall."""
    return "rest" if p.eta < p.j else "on the wall"


def _reads_flow(m: Measurement) -> float:
    """omega_0 within the reading range; beyond it, less on the floor."""
    p = m.parameters
    if p.omega_0 < analytic.reading_range(p) or detected(m) is Case.NR:
        return p.omega_0
    if m.value > p.omega_0 - 3 * m.uncertainty:
        raise LookupError("beyond the range a ball on the floor lags")
    return m.value


def _unloads(m: Measurement) -> float:
    """A ball on the wall stays above the limit of unloading, and sinks below."""
    return float(Case.NR if m.parameters.omega_0 > analytic.unloading_limit(m.parameters) else Case.NS)


def followed(m: Measurement) -> float:
    """Case at a level of the hysteresis loop: that of the branch it comes from while it attracts, else of the other."""
    return float(_branch(m))


def _branch(m: Measurement) -> Case:
    states = cases(m.parameters) - {Case.NS}
    lifted = m.conditions["before"] == Case.NR.name
    here = {case for case in states if (case is Case.NR) == lifted}
    if len(here or states) != 1:
        raise LookupError(f"no single state lasts at omega_0 = {m.parameters.omega_0:g}")
    return next(iter(here or states))


def _reading(m: Measurement) -> float:
    case = _branch(m)
    return next(float(s.state.omega_c) for s in lasting(m.parameters) if s.case is case)


def _on_floor(m: Measurement) -> bool:
    return m.conditions["start"] in ("rest", "with the fluid") and m.parameters.omega_0 > 0


def _on_wall(m: Measurement) -> bool:
    return m.conditions["start"] == "on the wall"


CLAIMS = (
    Claim(
        id="slope-rolling",
        source="Section 5.3",
        statement="Rolling at both points, or carried by the wall alone, the ball reads the flow: dω_c/dω₀ = 1.",
        bearings=(_slopes("neighbours", slope, "characteristic_slope", Case.RR, Case.NR),),
    ),
    Claim(
        id="slope-slipping",
        source="Section 5.3, (38), (41)",
        statement="While the ball slips at both points its reading rises by (38), (41), at first hardly at all.",
        bearings=(_slopes("neighbours", slope, "characteristic_slope", Case.SS),),
    ),
    Claim(
        id="slope-jump",
        source="Section 5.3",
        statement="At ω₀₁ the slope of the characteristic curve jumps: from 1 to 0, as the equations have it.",
        bearings=(_slopes("jump", lambda m: analytic.slope_jump(m.parameters), "slope_jump", Case.SS),),
    ),
    Claim(
        id="slope-mean",
        source="Section 5.3",
        statement=(
            "Between ω₀₁ and ω₀₂ the slope is small: what is measured on average from end to end is what theory says, "
            "a few hundredths for the reference."
        ),
        bearings=(_slopes("mean", lambda m: analytic.mean_slope(m.parameters), "mean_slope", Case.SS),),
    ),
    Claim(
        id="operating-range",
        source="Section 5.3",
        statement=(
            "Up to ω₀₁ (η < j) rolling is the only motion that lasts, up to ω₀₂ for η > j; beyond, from rest the ball "
            "slips (η < j), and on the wall it stays (η > j)."
        ),
        bearings=(
            _settled("case", _only_rolling, lambda m: _on_floor(m) and m.parameters.eta < m.parameters.j),
            _settled(
                "case",
                _only_rolling,
                lambda m: m.parameters.omega_0 > 0 and detected(m) is not Case.NS and m.parameters.eta > m.parameters.j,
            ),
            _settled("omega_c", _reads_flow, lambda m: m.parameters.omega_0 > 0 and detected(m) is not Case.NS),
        ),
    ),
    Claim(
        id="unloading-limit",
        source="Section 5.3, (85)",
        statement="The wall carries the ball at flows above ω₀₂, the limit at unloading; below, it slips and sinks.",
        bearings=(
            _settled("case", _unloads, _on_wall),
            Bearing(
                "thresholds",
                "omega_02",
                lambda m: analytic.unloading_limit(m.parameters),
                when=lambda m: m.conditions["side"] == "from above",
                by="analytic.unloading_limit",
            ),
        ),
    ),
    Claim(
        id="fig-13-left",
        source="Fig. 13, left",
        statement="For η < j the ball jumps up to ω₀ above ω₀₄, down below ω₀₂, and keeps to its branch in between.",
        bearings=(
            Bearing("hysteresis", "case", followed, by="analytic.stable_solutions"),
            Bearing("hysteresis", "omega_c", _reading, scale=lambda p: scale("omega_c", p), by="(32), (38), (46)"),
        ),
        text=Text.CORRECTED,
        reason="Section 5.3 prints that the flow can be read again above ω₀₂; on the way up that is above ω₀₄.",
    ),
)
