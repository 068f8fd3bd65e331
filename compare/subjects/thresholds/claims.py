"""Claims about the bifurcations over omega_0: Table 5, Proposition 7, and the branch that divides two attractors."""

from __future__ import annotations

import math
from collections.abc import Callable

import analytic
from analytic.bifurcation import diagram as bifurcation
from compare.claim import Bearing, Claim, When, given
from compare.judge import theory
from compare.kit.record import Measurement
from compare.kit.settling import scale
from compare.settled import number
from compare.subjects.thresholds import formal
from model import Case

SLIPPING = "floor force of settled slipping → 0"
"""How omega_02 is measured where slipping at both points ends without a fold: that is a claim of its own."""


def _at(quantity: str, when: When = lambda m: m.conditions["by"] != SLIPPING, protocol: str = "thresholds") -> Bearing:
    """A threshold."""

    def predict(m: Measurement) -> float:
        return float(getattr(theory(analytic.thresholds, m.parameters), quantity))

    return Bearing(protocol, quantity, predict, when=when, by=f"analytic.thresholds: {quantity}")


def _edge(name: str) -> Bearing:
    """A quantity of the unstable state."""

    def predict(m: Measurement) -> float:
        unstable = theory(analytic.solution, m.parameters, Case.SS, stable=False)
        return number(name, unstable, m.parameters)

    size, by = (lambda m: scale(name, m.parameters)), "analytic.solution: SS beyond the fold, (37)-(41)"
    return Bearing("edge", f"edge_{name}", predict, size=size, by=by)


def _folds(m: Measurement) -> float:
    """1 where theory has a fold in reach, by (87); LookupError where it has no branch of slipping."""
    p = m.parameters
    if not p.eta < p.j:
        raise LookupError("no branch of slipping at both points for eta > j")
    return float(p.eta > theory(analytic.thresholds, p).eta_cr)


def _number_of_folds(predict: Callable[[Measurement], float], by: str) -> Bearing:
    return Bearing("thresholds", "folds", lambda m: float(predict(m)), by=by)


CLAIMS = (
    Claim(
        "table-5-P3",
        "Table 5, P3",
        "At ω₀₁ two-point rolling gives way to slipping at both points, whose slip begins at zero.",
        (_at("omega_01"),),
    ),
    Claim(
        "table-5-P2",
        "Table 5, P2",
        "At ω₀₂ the sinking state (NS) and the state carried by the wall (NR) meet.",
        (_at("omega_02"),),
    ),
    Claim(
        "table-5-NF2",
        "Table 5, NF2",
        "At ω₀₂ the unstable state of slipping at both points merges with the state carried by the wall.",
        (_at("omega_02", protocol="edge"),),
    ),
    Claim(
        "table-5-NT1",
        "Table 5, NT1",
        "With η > j two-point rolling ends at ω₀₃: below, it takes in a ball pressed to the floor; above, it is lost.",
        (_at("omega_03", given(side="from below")), _at("omega_03", given(side="from above"))),
    ),
    Claim(
        "table-5-F",
        "Table 5, F",
        "The stable branch of slipping at both points ends in a fold at ω₀₄, where there is one.",
        (
            _at("omega_04"),
            _number_of_folds(
                lambda m: math.isfinite(theory(analytic.thresholds, m.parameters).omega_04),
                "analytic.thresholds: omega_04",
            ),
        ),
    ),
    Claim(
        "sub-branches",
        "Prop. 7, (87)-(90), Fig. 10",
        "Between ω₀₂ and ω₀₄ an unstable state of slipping at both points divides two attractors.",
        tuple(_edge(name) for name in ("omega_c", "slip_x", "slip_y", "slip_z", "wall_spin")),
    ),
    Claim(
        "eta-critical",
        "(87), Fig. 7",
        "Slipping at both points ends in a fold for η_cr < η < j; for η < η_cr it passes to the state carried by "
        "the wall at ω₀₂, without a jump.",
        (
            _number_of_folds(_folds, "analytic.thresholds: eta_cr"),
            Bearing(
                "birth",
                "critical_drag",
                lambda m: bifurcation.critical_drag(m.parameters),
                by="analytic.bifurcation.diagram.critical_drag",
            ),
            _at("omega_02", given(by=SLIPPING)),
        ),
    ),
    Claim(
        "one-fold",
        "after Prop. 7",
        "There is only one fold ω₀₄, and it lies above ω₀₁ and ω₀₂.",
        (
            _number_of_folds(
                lambda m: bifurcation.number_of_folds(m.parameters), "analytic.bifurcation.diagram.number_of_folds"
            ),
        ),
    ),
)
SECTIONS = {"Bifurcations": CLAIMS, "Formal": formal.CLAIMS}
