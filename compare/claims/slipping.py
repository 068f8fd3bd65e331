"""Claims about slip: does a slight one grow or die out (sections 3 and 4, Fig. 6)?"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from analytic import slip_bounds, slip_stability
from compare.claims.claim import Bearing, Claim, Outcome, Relation, Text
from compare.measure.field import slip_unit
from compare.measure.record import Measurement, state
from model import Case


def _gamma(m: Measurement) -> float:
    inner, outer = Case[str(m.conditions["inner"])], Case[str(m.conditions["outer"])]
    n = [m.conditions[f"n_{name[-1]}"] for name in slip_stability.normals(inner, outer)]
    return float(slip_stability.gamma(inner, outer, np.array(state(m)), np.array(n, dtype=float), m.parameters))


def _along(inner: Case, outer: Case, by: str = "") -> Callable[[Measurement], bool]:
    def along(m: Measurement) -> bool:
        at = m.conditions
        return (at["inner"], at["outer"], at.get("by", "")) == (inner.name, outer.name, by)

    return along


def _out_of(inner: Case, outer: Case) -> Callable[[Measurement], bool]:
    """Along an arrow, random or dragged; not in the direction that bears on the extrema alone."""
    ways = [_along(inner, outer, by) for by in ("", "dragged")]
    return lambda m: any(along(m) for along in ways)


def _arrow(inner: Case, outer: Case) -> Claim:
    return Claim(
        id=f"slip-{inner.name}-{outer.name}",
        source="(56)-(59)" if inner is Case.NR else "(53), Fig. 6",
        statement=f"Out of any state of {inner.name} a slip along any direction of {outer.name} grows at the rate γ.",
        bearings=(
            Bearing("growth", "gamma", _gamma, when=_out_of(inner, outer), scale=slip_unit, by="slip_stability.gamma"),
            *((_GAMMA_NR,) if inner is Case.NR else ()),
        ),
    )


def _gamma_nr(m: Measurement) -> float:
    beta = math.atan2(float(m.conditions["n_y"]), float(m.conditions["n_z"]))
    return float(slip_bounds.gamma_nr(beta, np.array(state(m)), m.parameters))


_GAMMA_NR = Bearing(
    "growth", "gamma", _gamma_nr, when=_out_of(Case.NR, Case.NS), scale=slip_unit, by="slip_bounds.gamma_nr"
)


def _bound(
    arrow: tuple[Case, Case],
    by: str,
    bound: Callable[[Measurement], slip_bounds.SlipBound | slip_bounds.HeldBound],
    side: int = 0,
    from_rest: bool = False,
) -> tuple[Bearing, ...]:
    """Zero and slope of gamma.

    `side` is the sign of n_z where that makes another bound; `from_rest`: the zero is 0 or nearly so.
    """
    on_line = _along(*arrow, by)

    def when(m: Measurement) -> bool:
        return on_line(m) and (not side or m.conditions["n_z"] == side)

    square = "_square" if by == "stationary" else ""
    return (
        Bearing(
            "bounds",
            f"gamma_zero{square}",
            lambda m: bound(m).zero,
            when=when,
            scale=(lambda p: p.g / p.R) if from_rest else None,
            by="slip_bounds",
        ),
        Bearing("bounds", f"gamma_slope{square}", lambda m: bound(m).slope, when=when, by="slip_bounds"),
    )


def _held(m: Measurement) -> float:
    return float(m.conditions["omega_c"])


def _sign(m: Measurement, name: str) -> int:
    return round(float(m.conditions[name]))


def _claim(id: str, source: str, statement: str, bearings: tuple[Bearing, ...], reason: str = "") -> Claim:
    return Claim(
        id=id,
        source=source,
        statement=statement,
        bearings=bearings,
        text=Text.CORRECTED if reason else Text.PRINTED,
        reason=reason,
    )


_NR_NS, _RR_RS, _RR_SR, _RR_SS = (Case.NR, Case.NS), (Case.RR, Case.RS), (Case.RR, Case.SR), (Case.RR, Case.SS)


def _greatest_as_printed(m: Measurement) -> float:
    n = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    return float(slip_stability.gamma(*_RR_SS, np.array(state(m)), n, m.parameters).max())


def _neutral(quantity: str, case: Case, by: str) -> Bearing:
    def predict(m: Measurement) -> float:
        return slip_stability.neutral_flow(case, m.parameters)

    def when(m: Measurement) -> bool:
        return m.conditions["by"] == by

    return Bearing("thresholds", quantity, predict, when=when, by="slip_stability.neutral_flow")


def _watched(inner: Case, end: str, beyond: Case) -> Bearing:
    """What becomes of slight slips on either side of the flow at which rolling ends; `beyond` it they come to that."""

    def predict(m: Measurement) -> float:
        stable = slip_stability.stability(inner, m.parameters) is slip_stability.SlipStability.STABLE
        return float(inner if stable else beyond)

    return Bearing("watched", "case", predict, when=lambda m: m.conditions["end"] == end, by="slip_stability.stability")


CLAIMS = (
    *(_arrow(inner, outer) for inner, outer in slip_stability.SLIP_ARROWS),
    _claim(
        "eq-58",
        "(58)",
        "Out of rolling on the wall alone, slip grows the most along β₁, whatever the state.",
        (
            Bearing(
                "steepest",
                "steepest",
                lambda m: float(slip_bounds.steepest_nr(np.array(state(m)), m.parameters)),
                scale=lambda p: 1.0,
                by="slip_bounds.steepest_nr",
            ),
        ),
    ),
    _claim(
        "eq-61",
        "(60), (61)",
        "Rolling on the wall alone is stable with respect to slipping above ω₀₂.",
        _bound(_NR_NS, "stationary", lambda m: slip_bounds.nr_to_ns(m.parameters)),
    ),
    _claim(
        "eq-66",
        "(66)",
        "A ball that lags behind the fluid begins to slip at the wall where (66) says.",
        _bound(_RR_RS, "held", lambda m: slip_bounds.rr_to_rs(m.parameters, _held(m), _sign(m, "n_y"))),
        "(66) prints μ; it is the friction of the wall, η, that holds the wall's contact.",
    ),
    _claim(
        "eq-67",
        "(67)",
        "Going round with the fluid, the ball never begins to slip at the wall alone, but at ω₀ = 0.",
        _bound(_RR_RS, "stationary", lambda m: slip_bounds.rr_to_rs_stationary(m.parameters), from_rest=True),
    ),
    _claim(
        "eq-73",
        "(73)",
        "A ball that lags behind the fluid begins to slip at the floor where (73) says.",
        _bound(_RR_SR, "held", lambda m: slip_bounds.rr_to_sr(m.parameters, _held(m), _sign(m, "n_x"))),
    ),
    _claim(
        "eq-74",
        "(74)",
        "Going round with the fluid, the ball doesn't slip at the floor alone below ω₀₃; beyond, it lifts (η > j).",
        (
            *_bound(_RR_SR, "stationary", lambda m: slip_bounds.rr_to_sr_stationary(m.parameters)),
            _watched(Case.RR, "omega_03", Case.NR),
        ),
    ),
    _claim(
        "eq-82",
        "(82)",
        "Slip at both points at once, with directions (0, 0), grows above ω₀₁ and dies out below.",
        (
            *_bound(_RR_SS, "stationary", lambda m: slip_bounds.rr_to_ss(m.parameters, 1), side=1),
            _watched(Case.RR, "omega_01", Case.SS),
        ),
    ),
    _claim(
        "eq-83",
        "(83)",
        "Slip at both points with directions (π, π) dies out: (83) has no bound for η < 1.",
        _bound(_RR_SS, "stationary", lambda m: slip_bounds.rr_to_ss(m.parameters, -1), side=-1, from_rest=True),
    ),
    _claim(
        "fig-4-5",
        "Figs. 4 and 5",
        "Above ω₀₂ a slight slip at the wall dies out and the ball rolls on; below it remains slipping for good.",
        (_watched(Case.NR, "omega_02", Case.NS),),
    ),
    _claim(
        "eq-69",
        "(69)",
        "Rolling at both points is the convex combination of slipping to either side that doesn't slip.",
        (
            Bearing(
                "growth",
                "filippov_share",
                lambda m: slip_bounds.filippov_share(Case[str(m.conditions["outer"])], _held(m), m.parameters),
                scale=lambda p: 1.0,
                by="slip_bounds.filippov_share",
            ),
        ),
    ),
    _claim(
        "definition-3",
        "Definitions 1-3, (67)",
        "Rolling is stable with respect to slipping up to a flow at which it is neutral, and unstable beyond (on the "
        "wall alone the other way round); at rest slip at the wall neither grows nor dies out.",
        (
            Bearing(
                "growth", "gamma", _gamma, when=_along(*_RR_RS, "rest"), scale=slip_unit, by="slip_stability.gamma"
            ),
            _neutral("omega_01", Case.RR, "onset of slip"),
            _neutral("omega_02", Case.NR, "onset of sliding on the wall"),
            _neutral("omega_03", Case.RR, "loss of the floor"),
        ),
    ),
    Claim(
        id="extrema",
        source="after (80)",
        statement="(α, β) = (0, 0) and (π, π) are the global extrema of γ.",
        bearings=(
            Bearing(
                "growth",
                "gamma",
                _greatest_as_printed,
                when=_along(*_RR_SS, "sideways"),
                scale=slip_unit,
                relation=Relation.AT_MOST,
                by="slip_stability.gamma at (0, 0), (π, π)",
            ),
        ),
        expected=Outcome.REFUTED,
        reason=(
            "False for the Euclidean normal (75): γ is larger along other directions. With kinetic energy as the inner "
            "product it is true."
        ),
    ),
)
