"""Slip: does a slight one grow, where does the ball lift off (sections 3 and 4, Fig. 6)?"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

import analytic
from analytic.slipping import slip_bounds, slip_stability
from analytic.slipping.slip_bounds import HeldBound, SlipBound
from analytic.slipping.slip_stability import SlipStability
from compare.method.record import Measurement, Relation, state
from compare.verification.claim import Criterion, Outcome, Text, When, all_of, claim, given
from compare.verification.judge import simulated
from model import Case
from model.arrays import Array
from model.kinematics import SLIP_XYZ, VARIABLES

_NR_NS, _RR_RS = (Case.NR, Case.NS), (Case.RR, Case.RS)
_RR_SR, _RR_SS = (Case.RR, Case.SR), (Case.RR, Case.SS)
_STABILITY = "slip_stability.stability"


def _state(m: Measurement) -> Array:
    """The state (8,) at which something was measured."""
    return np.array(state(m))


def _arrow(m: Measurement) -> tuple[Case, Case]:
    """The case out of which, and into which, a ball slips or lifts off."""
    return Case[m.at["inner"]], Case[m.at["outer"]]


def _along(arrow: tuple[Case, Case], *by: str) -> When:
    """True for slips along an arrow that were measured in one of some ways."""
    return lambda m: _arrow(m) == arrow and m.at.get("by", "") in by


def _direction(m: Measurement) -> Array:
    """The direction of a push (3,)."""
    return np.array([m.at["n_x"], m.at["n_y"], m.at["n_z"]])


def _gamma(m: Measurement) -> float:
    """gamma (53) along the measured direction of slip, rad s-2."""
    along = dict(zip(VARIABLES[SLIP_XYZ], _direction(m), strict=True))
    n = [along[name] for name in slip_stability.normals(*_arrow(m))]
    return float(slip_stability.gamma(*_arrow(m), _state(m), np.array(n), m.parameters))


def _following_case(m: Measurement) -> float:
    """The case that follows where a slip doesn't last."""
    x = _state(m)
    x[SLIP_XYZ] += m.at["slip"] * _direction(m)
    return float(simulated(m.parameters, tuple(x.tolist()), m.at["time"]).case[-1])


def _gamma_nr(m: Measurement) -> float:
    """gamma (56) in the measured direction of slip, rad s-2."""
    beta = math.atan2(m.at["n_y"], m.at["n_z"])
    return float(slip_bounds.gamma_nr(beta, _state(m), m.parameters))


def _by_forces(m: Measurement) -> float:
    """gamma from the forces of NR: friction that rolling needs along the slip, less eta B_x."""
    p = m.parameters
    _, (B_x, B_y, B_z) = analytic.contact_forces(Case.NR, _state(m), p)
    needed = B_y * m.at["n_z"] - B_z * m.at["n_y"] - p.eta * B_x
    return float((1 + p.j) / (p.j * p.m * p.r) * needed)


def _neutral(m: Measurement) -> float:
    """gamma of a case that is neutral with respect to slipping, 0; LookupError of another."""
    if slip_stability.stability(_arrow(m)[0], m.parameters) is not SlipStability.NEUTRAL:
        raise LookupError("slip grows or dies out")
    return 0.0


def _steepest(m: Measurement) -> float:
    """beta_1 (58) in the measured state, rad."""
    return float(slip_bounds.steepest_nr(_state(m), m.parameters))


def _greatest_as_printed(m: Measurement) -> float:
    """The larger of gamma at the two directions that the paper takes for its extrema, rad s-2."""
    n = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    return float(slip_stability.gamma(*_RR_SS, _state(m), n, m.parameters).max())


def _held(m: Measurement) -> tuple[float, int]:
    """The held omega_c, rad s-1, and to which side a ball slips at one contact."""
    return m.at["omega_c"], round(m.at["n_x"] + m.at["n_y"])


def _bounds(
    arrow: tuple[Case, Case],
    bound: Callable[[Measurement], SlipBound | HeldBound],
    by: str = "stationary",
    side: int = 0,
    from_rest: bool = False,
) -> tuple[Criterion, Criterion]:
    """Criteria on the zero and slope of gamma over the flow, by a bound of the paper.

    `side`: the sign of n_z, if that makes another bound; `from_rest`: the zero is about 0."""
    when = all_of(_along(arrow, by), given(n_z=side)) if side else _along(arrow, by)
    power = "_square" if by == "stationary" else ""
    size = (lambda m: m.parameters.g / m.parameters.R) if from_rest else None
    bounds = partial(Criterion, "bounds", when=when, by="slip_bounds")
    return (
        bounds(f"gamma_zero{power}", lambda m: bound(m).zero, size=size),
        bounds(f"gamma_slope{power}", lambda m: bound(m).slope),
    )


def _neutral_flow(quantity: str, case: Case, by: str) -> Criterion:
    """A criterion on a threshold: the flow at which a case is neutral with respect to slipping."""

    def predict(m: Measurement) -> float:
        return slip_stability.neutral_flow(case, m.parameters.replace(omega_0=1.0))

    when = given(by=by)
    return Criterion("thresholds", quantity, predict, when=when, by="slip_stability.neutral_flow")


def _filippov_share(m: Measurement) -> float:
    """The weight delta in (69)."""
    return slip_bounds.filippov_share(_arrow(m)[1], m.at["omega_c"], m.parameters)


def _case_on_wall(m: Measurement) -> float:
    """NR where it is stable with respect to slipping, else NS."""
    holds = slip_stability.stability(Case.NR, m.parameters)
    return float(Case.NR if holds is SlipStability.STABLE else Case.NS)


_gammas = partial(Criterion, "growth", "gamma")  # a criterion on how fast slips grow


def _growth(arrow: tuple[Case, Case]) -> Iterator[Criterion]:
    """Criteria on slips along an arrow, at random or dragged, and on what follows them."""
    when = _along(arrow, "", "dragged")
    yield _gammas(_gamma, when=when, by="slip_stability.gamma")
    if arrow == _NR_NS:
        yield _gammas(_gamma_nr, when=when, by="slip_bounds.gamma_nr")
    for protocol, ways in (
        ("growth", ("", "dragged", "sideways")),  # at rest RS and RN look the same
        ("bounds", ("held", "stationary")),
    ):
        when = _along(arrow, *ways)
        yield Criterion(protocol, "case", _following_case, when=when, by="analytic.simulate")


def _lift(inner: Case, outer: Case) -> Iterator[Criterion]:
    """Criteria on whether the wall alone would accelerate a ball upwards out of a case, from where
    on, and on what the floor carries of it."""

    def lifts(m: Measurement) -> float:
        return slip_stability.lift_acceleration(inner, outer, _state(m), m.parameters) > 0

    def onset(m: Measurement) -> float:
        return slip_stability.lift_onset(inner, outer, _state(m), m.parameters)

    def force(m: Measurement) -> float:
        return float(analytic.contact_forces(inner, _state(m), m.parameters)[0][1])

    lift = partial(Criterion, "lift", when=given(inner=inner.name))
    yield lift("lifts", lifts, by="slip_stability: lift")
    if inner is not Case.RS:
        yield lift("lift_onset", onset, by="slip_stability: lift")
    if inner is not Case.RR:
        yield lift("moving_force_Ay", force, by="analytic.contact_forces")


CLAIMS = (
    *(
        claim(
            f"slip-{arrow[0].name}-{arrow[1].name}",
            "(56)-(59)" if arrow == _NR_NS else "(53), Fig. 6",
            f"Out of {arrow[0].name} a slight slip in any direction that {arrow[1].name} allows "
            "grows at the rate γ while forces admit it. Else the ball passes into another case, as "
            "the equations of motion say.",
            *_growth(arrow),
        )
        for arrow in slip_stability.SLIP_ARROWS
    ),
    claim(
        "eq-58",
        "(58)",
        "A ball that rolls on the wall alone begins to slip the fastest in the direction β₁, "
        "whatever its state.",
        Criterion("steepest", "steepest", _steepest, by="slip_bounds.steepest_nr"),
    ),
    claim(
        "eq-13-gamma",
        "3.2, last paragraph",
        "On the wall alone slip in a direction grows in proportion to the friction that rolling "
        "needs in it, less what Coulomb's law allows. So γ < 0 in all directions exactly where "
        "(13) holds.",
        _gammas(_by_forces, when=_along(_NR_NS, "", "dragged"), by="analytic.contact_forces, (13)"),
    ),
    claim(
        "eq-61",
        "(60), (61)",
        "Rolling on the wall alone is stable with respect to slipping above ω₀₂.",
        *_bounds(_NR_NS, lambda m: slip_bounds.nr_to_ns(m.parameters)),
    ),
    claim(
        "eq-66",
        "(66)",
        "A ball that rolls round slower than the fluid begins to slip at the wall once the "
        "difference exceeds (66).",
        *_bounds(_RR_RS, lambda m: slip_bounds.rr_to_rs(m.parameters, *_held(m)), "held"),
        text=Text.CORRECTED,
        reason="(66) prints μ; it is the friction of the wall, η, that holds the wall's contact.",
    ),
    claim(
        "eq-67",
        "(67)",
        "Going round with the fluid, the ball never begins to slip at the wall alone, but at ω₀ = "
        "0.",
        *_bounds(_RR_RS, lambda m: slip_bounds.rr_to_rs_stationary(m.parameters), from_rest=True),
    ),
    claim(
        "eq-73",
        "(73)",
        "A ball that rolls round slower than the fluid begins to slip at the floor once the "
        "difference exceeds (73).",
        *_bounds(_RR_SR, lambda m: slip_bounds.rr_to_sr(m.parameters, *_held(m)), "held"),
    ),
    claim(
        "eq-74",
        "(74)",
        "Going round with the fluid, the ball doesn't slip at the floor alone below ω₀₃; beyond, "
        "it lifts (η > j).",
        *_bounds(_RR_SR, lambda m: slip_bounds.rr_to_sr_stationary(m.parameters)),
        _neutral_flow("omega_03", Case.RR, "loss of the floor"),
    ),
    claim(
        "eq-82",
        "(82)",
        "Slip at both points at once, in the directions α = β = 0, grows above ω₀₁ and dies out "
        "below.",
        *_bounds(_RR_SS, lambda m: slip_bounds.rr_to_ss(m.parameters, 1), side=1),
    ),
    claim(
        "eq-83",
        "(83)",
        "Slip at both points in the directions α = β = π dies out: (83) has no bound for η < 1.",
        *_bounds(_RR_SS, lambda m: slip_bounds.rr_to_ss(m.parameters, -1), side=-1, from_rest=True),
    ),
    claim(
        "fig-4-5",
        "Figs. 4 and 5",
        "Above ω₀₂ a slight slip at the wall dies out and the ball rolls on; below, the ball keeps "
        "slipping.",
        *_bounds(_NR_NS, lambda m: slip_bounds.nr_to_ns(m.parameters)),
        Criterion("settled", "case", _case_on_wall, when=given(start="on the wall"), by=_STABILITY),
    ),
    claim(
        "eq-69",
        "(69)",
        "Rolling moves as the mean of slipping to one side and to the other, weighted so that no "
        "slip is left.",
        Criterion("growth", "filippov_share", _filippov_share, by="slip_bounds.filippov_share"),
    ),
    claim(
        "definition-3",
        "Definitions 1-3, (67)",
        "Rolling is stable with respect to slipping up to a flow at which it is neutral, and "
        "unstable beyond (on the wall alone the other way round). At rest slip at the wall neither "
        "grows nor dies out.",
        _gammas(_gamma, when=_along(_RR_RS, "rest"), by="slip_stability.gamma"),
        _gammas(_neutral, when=_along(_RR_RS, "rest"), by=_STABILITY),
        _neutral_flow("omega_01", Case.RR, "onset of slip"),
        _neutral_flow("omega_02", Case.NR, "onset of sliding on the wall"),
        _neutral_flow("omega_03", Case.RR, "loss of the floor"),
    ),
    claim(
        "extrema",
        "after (80)",
        "Out of RR into SS γ has its global extrema along (α, β) = (0, 0) and (π, π).",
        _gammas(
            _greatest_as_printed,
            when=_along(_RR_SS, "sideways"),
            relation=Relation.AT_MOST,
            by="slip_stability.gamma at (0, 0), (π, π)",
        ),
        expected=Outcome.REFUTED,
        reason="False for the Euclidean normal (75): γ is larger along other directions. With "
        "kinetic energy as the inner product it is true.",
    ),
    *(
        claim(
            f"lift-{inner.name}-{outer.name}",
            "Fig. 6, dotted",
            f"Out of {inner.name} the ball never lifts off the floor: whatever its orbit, the "
            "floor carries its weight."
            if inner is Case.RS
            else f"Out of {inner.name} the ball lifts off the floor once the wall alone, in "
            f"{outer.name}, would accelerate it upwards.",
            *_lift(inner, outer),
        )
        for inner, outer in slip_stability.LIFT_ARROWS
    ),
)
SECTIONS = {"Slipping": CLAIMS}
