"""Claims about the bifurcations over omega_0: Table 5, Proposition 7, and the branch that divides two attractors."""

from __future__ import annotations

import math
from collections.abc import Callable

import analytic
from analytic import StationarySolution, bifurcation
from compare.claims.claim import Bearing, Claim
from compare.claims.judge import remembered
from compare.measure.record import Measurement
from compare.measure.settling import rotation_scale
from model import Case, Parameters
from model.kinematics import VARIABLES

THRESHOLDS, EDGE = "thresholds", "edge"


@remembered
def _thresholds(p: Parameters) -> analytic.Thresholds:
    return analytic.thresholds(p)


def _at(quantity: str, protocol: str = THRESHOLDS, side: str | None = None, of: str | None = None) -> Bearing:
    """A threshold as measured from a side; `of` names what was extrapolated, or every bearing counts."""

    def when(m: Measurement) -> bool:
        by = str(m.conditions["by"])
        return side in (None, m.conditions["side"]) and (by.startswith(of) if of else not by.startswith(SLIPPING))

    return Bearing(
        protocol,
        quantity,
        lambda m: float(getattr(_thresholds(m.parameters), quantity)),
        when=when,
        by=f"analytic.thresholds: {quantity}",
    )


SLIPPING = "floor force of settled slipping"
"""How omega_02 is measured where slipping at both points ends without a fold: that is a claim of its own."""


@remembered
def _unstable(p: Parameters) -> StationarySolution:
    return analytic.solution(p, Case.SS, stable=False)


def _edge(name: str) -> Bearing:
    def spin(m: Measurement) -> float:
        return bifurcation.wall_spin(_unstable(m.parameters), m.parameters)

    def variable(m: Measurement) -> float:
        return float(_unstable(m.parameters).x[VARIABLES.index(name)])

    predict: Callable[[Measurement], float] = spin if name == "wall_spin" else variable
    return Bearing(
        EDGE,
        f"edge_{name}",
        predict,
        scale=rotation_scale if name == "omega_c" else lambda p: rotation_scale(p) * p.R / p.r,
        by="analytic.solution: SS beyond the fold, (37)-(41)",
    )


def _folds(m: Measurement) -> float:
    """1 where theory has a fold in reach, by (87); LookupError where it has no branch of slipping."""
    p = m.parameters
    if not p.eta < p.j:
        raise LookupError("no branch of slipping at both points for eta > j")
    return float(p.eta > _thresholds(p).eta_cr)


def _has_fold(m: Measurement) -> float:
    return float(math.isfinite(_thresholds(m.parameters).omega_04))


def _claim(bifurcation: str, statement: str, *bearings: Bearing) -> Claim:
    return Claim(
        id=f"table-5-{bifurcation}",
        source=f"Table 5, {bifurcation}",
        statement=statement,
        bearings=bearings,
    )


CLAIMS = (
    _claim(
        "P3",
        "At ω₀₁ two-point rolling gives way to slipping at both points, whose slip begins at zero.",
        _at("omega_01"),
    ),
    _claim(
        "P2",
        "At ω₀₂ the sinking state (NS) and the state carried by the wall (NR) meet.",
        _at("omega_02"),
    ),
    _claim(
        "NF2",
        "At ω₀₂ the unstable state of slipping at both points merges with the state carried by the wall.",
        _at("omega_02", EDGE),
    ),
    _claim(
        "NT1",
        "With η > j two-point rolling ends at ω₀₃: below, it takes in a ball pressed to the floor; above, it is lost.",
        _at("omega_03", side="from below"),
        _at("omega_03", side="from above"),
    ),
    _claim(
        "F",
        "The stable branch of slipping at both points ends in a fold at ω₀₄, where there is one.",
        _at("omega_04"),
        Bearing(THRESHOLDS, "folds", _has_fold, by="analytic.thresholds: omega_04"),
    ),
    Claim(
        id="sub-branches",
        source="Prop. 7, (87)-(90), Fig. 10",
        statement="Between ω₀₂ and ω₀₄ an unstable state of slipping at both points divides two attractors.",
        bearings=tuple(_edge(name) for name in ("omega_c", "slip_x", "slip_y", "slip_z", "wall_spin")),
    ),
    Claim(
        id="eta-critical",
        source="(87), Fig. 7",
        statement=(
            "Slipping at both points ends in a fold for η_cr < η < j; for η < η_cr it passes to the state carried by "
            "the wall at ω₀₂, without a jump."
        ),
        bearings=(
            Bearing(THRESHOLDS, "folds", _folds, by="analytic.thresholds: eta_cr"),
            Bearing(
                "birth",
                "critical_drag",
                lambda m: bifurcation.critical_drag(m.parameters),
                by="analytic.bifurcation.critical_drag",
            ),
            _at("omega_02", of=SLIPPING),
        ),
    ),
    Claim(
        id="one-fold",
        source="after Prop. 7",
        statement="There is only one fold ω₀₄, and it lies above ω₀₁ and ω₀₂.",
        bearings=(
            Bearing(
                THRESHOLDS,
                "folds",
                lambda m: float(bifurcation.number_of_folds(m.parameters)),
                by="analytic.bifurcation.number_of_folds",
            ),
        ),
    ),
)
