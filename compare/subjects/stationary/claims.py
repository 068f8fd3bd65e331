"""Stationary states: Propositions 1-6 with their forces, and the diagrams of Figs. 9-11."""

import math
from collections.abc import Iterable
from functools import partial

import analytic
from analytic.bifurcation import diagram as bifurcation
from analytic.bifurcation.diagram import Exists
from analytic.mechanics import drag
from analytic.stationary import slipping_branch
from compare.method.record import Measurement, Relation
from compare.method.settling import FORCES, SUMS
from compare.verification.claim import Criterion, Text, When, all_of, claim, criteria, given
from compare.verification.judge import theory
from compare.verification.states import (
    case_of,
    changes_case,
    exists,
    from_floor,
    is_in,
    lasting_cases,
    lifts_first,
    slips_first,
    solution_of,
    thresholds_of,
    value_in,
)
from model import Case, State
from model.drag import SCHILLER_NAUMANN
from model.kinematics import VARIABLES

MOTION = ("omega_c", "slip_x", "slip_y", "slip_z", "v_y")


def case(m: Measurement) -> float:
    """The case detected, if a ball from that start may settle there; else LookupError.

    From the floor it may settle to whatever attracts. High up on the wall it stays where the wall
    carries it, and sinks where not."""
    allowed = lasting_cases(m.parameters)
    if m.at["start"] == "on the wall":
        if case_of(m) is Case.NS and exists(Case.NR, m):
            raise LookupError("NR exists, and yet the ball sinks")
        allowed &= {Case.NR} if Case.NR in allowed else {Case.NS}
    else:
        allowed -= {Case.NS}
    if case_of(m) in allowed:
        return m.value
    if len(allowed) == 1:
        return float(allowed.pop())
    raise LookupError(f"{case_of(m).name} is none of {allowed}")


def rolling(m: Measurement) -> float:
    """RR as long as it exists, (84) and (86); beyond, a case that lasts, which RR is not."""
    t = thresholds_of(m)
    limit = t.omega_01 if slips_first(m) else t.omega_03
    if m.parameters.omega_0 < limit:
        return float(Case.RR)
    # beyond, forces may hold it
    if case_of(m) is Case.RR or (exists(Case.RR, m) and m.parameters.mu < 1):
        raise LookupError("RR has ended")
    return case(m)


def _value_criteria(
    quantities: Iterable[str],
    when: When,
    by: str,
    of: Case | None = None,
    protocol: str = "settled",
) -> tuple[Criterion, ...]:
    """Criteria on values of settled states, in the case `of`, or in that detected."""

    def predict(m: Measurement) -> float:
        state = theory(analytic.solution, m.parameters, of) if of else solution_of(m)
        return value_in(state, m)

    return criteria(protocol, quantities, predict, when=when, by=by)


def _case_criterion(when: When) -> Criterion:
    """A criterion on the case to which a ball settles."""
    return Criterion("settled", "case", case, when=when, by=_STABLE)


def _rolling_criterion(when: When = lambda m: True) -> Criterion:
    """A criterion on balls that start with the fluid: RR up to its threshold."""
    chosen = all_of(given(start="with the fluid"), when)
    return Criterion("settled", "case", rolling, when=chosen, by="analytic.thresholds")


def _sinks_at_reynolds(m: Measurement) -> float:
    """v_y in m/s by Schiller and Naumann's C_D at Re of the measured speed."""
    p, Re = m.parameters, drag.reynolds(abs(m.value), m.parameters)
    more = max(1 + drag.WAKE * Re**drag.EXPONENT, drag.BLUNT * Re / 24)
    return float(-(p.g - p.eta * p.R * p.omega_0**2) / (p.c * more))


def _on_branch(m: Measurement) -> float:
    """A slip or contact force of SS in closed form at the flow, before the fold, SI."""
    p, point = m.parameters, slipping_branch.points_at(m.parameters)[0]
    if m.of in VARIABLES:
        return float(getattr(State.of(slipping_branch.states(point, p)[0]), m.of))
    branch = slipping_branch.branch(point, p)
    loads = {"Ay": branch.A_y, "Bx": branch.B_x, "Az": -branch.drag}
    return float(loads[m.of]) * p.m * p.g


def _region(m: Measurement) -> Exists:
    """The region of Fig. 7 or 8 in which a measurement lies: which stationary solutions exist."""
    p = m.parameters
    return Exists(int(bifurcation.case_map(p, [p.mu], [p.eta], [p.omega_0])[0, 0]))


_LASTING = {
    Exists.RR: {Case.RR},
    Exists.SS: {Case.SS},
    Exists.SS_BEYOND_FOLD: {Case.SS, Case.NR},
    Exists.NR: {Case.NR},
    Exists.NS: {Case.NS},
}
"""What a ball can settle in where a state exists, SR counted as NR: one, or both."""


def _cases_in_region(m: Measurement) -> float:
    """The bit mask of the cases in which a ball can settle, by the labels of the region."""
    region = _region(m)
    return _mask(set[Case]().union(*(_LASTING[flag] for flag in _LASTING if flag in region)))


def _mask(cases: Iterable[Case]) -> float:
    """Cases as one number, a bit each."""
    return float(sum(1 << case for case in cases))


def _omega_c_beyond_fold(m: Measurement) -> float:
    """omega_c of the unstable SS; LookupError without it, or what it divides."""
    if Exists.SS | Exists.SS_BEYOND_FOLD | Exists.NR not in _region(m):
        raise LookupError("the region lacks SS, SS beyond the fold, or NR")
    return float(theory(analytic.solution, m.parameters, Case.SS, stable=False).state.omega_c)


def _decay_leaning(m: Measurement) -> float:
    """The slowest decay of a ball that leans on the floor, s-1; LookupError without SR."""
    if Exists.SR not in _region(m):
        raise LookupError("the region lacks SR")
    decays = -theory(analytic.eigenmodes_SR, m.parameters)[0].real
    return float(decays[decays > 0].min())


def _on_surface(m: Measurement) -> float:
    """A threshold by the surface of Fig. 7 or 8 at the friction of floor and wall, rad s-1."""
    p = m.parameters
    surfaces = bifurcation.threshold_curves(p, p.mu, p.eta)
    return float(surfaces[m.quantity]) * math.sqrt(p.g / p.R)


def _drag_at_birth(m: Measurement, equal: bool = False) -> float:
    """The drag c, s-1, at which the fold is born at eta, which is proportional to c^2.

    Where friction is `equal`, as in Fig. 8, to c^(2/3). Computed from that point at half the
    measured drag, since at the set's own there may be no fold for any eta below j."""
    p = m.parameters.replace(c=m.value / 2)
    born = bifurcation.double_points(p, equal)[0]
    if born.meets != ("omega_02", "omega_04"):
        raise LookupError("no fold is born")
    return float(p.c * (p.eta / born.eta) ** (1.5 if equal else 0.5))


def _where_all_meet(m: Measurement) -> float:
    """The flow at which all thresholds are one, rad s-1."""
    return bifurcation.double_points(m.parameters)[-1].omega_0


def _equal_friction(m: Measurement) -> bool:
    """Whether floor and wall are equally rough, as in Fig. 8."""
    return m.parameters.mu == m.parameters.eta


def _slip_along_alpha(m: Measurement) -> float:
    """A component of slip of SS by the speed and the direction alpha of its solution, rad s-1."""
    solution = solution_of(m)
    part = math.sin if m.quantity == "slip_x" else math.cos
    return math.hypot(solution.state.slip_x, solution.state.slip_z) * part(solution.alpha)


_ROLLS, _SLIPS, _LIFTED, _SINKS = (is_in(each) for each in (Case.RR, Case.SS, Case.NR, Case.NS))
_LEANS = all_of(_LIFTED, from_floor)
_STATE = (*MOTION, *FORCES)
_slipping = partial(criteria, "settled", when=_SLIPS)
"""Criteria on balls that have settled slipping at both points."""
_DOUBLE = "analytic.bifurcation.diagram.double_points"
_STABLE = "analytic.stable_solutions"
CLAIMS = (
    claim(
        "prop-1",
        "Prop. 1, (30)-(32)",
        "Rolling at both points, the ball goes round exactly with the fluid: ω_c = ω₀, no slip; of "
        "its forces (31) fixes A_z = B_z = 0 and three sums. It does so at every flow below ω₀₁ (η "
        "< j) or ω₀₃ (η > j).",
        *_value_criteria((*MOTION, *SUMS), _ROLLS, "(31), (32)"),
        _case_criterion(_ROLLS),
        _rolling_criterion(),
    ),
    claim(
        "prop-1-rough",
        "Prop. 1, (83), (86)",
        "With η > j the ball rolls at both points up to ω₀₃ = √(g/jR), beyond ω₀₂.",
        *_value_criteria(("omega_c",), all_of(lifts_first, _ROLLS), "(32)"),
        _rolling_criterion(lifts_first),
    ),
    claim(
        "prop-2-forces",
        "Prop. 2, (33), (34)",
        "In a fluid at rest the ball spins on the spot; the floor carries its weight and nothing "
        "else acts.",
        *_value_criteria(
            ("omega_c", "slip_x", "slip_z", "v_y", *FORCES), is_in(Case.RS), "(33), (34)", Case.RS
        ),
    ),
    claim(
        "prop-3-5",
        "Props. 3 and 5, (35), (36), (46), (47)",
        "Carried by the wall alone the ball keeps ω_c = ω₀ and spins on it, ω̃_x = g/(jω₀r) - "
        "ω₀R/r, at any height; B_x = mRω₀², B_y = mg. Where it touches a floor that carries "
        "nothing, SR has the same state as NR.",
        *_value_criteria(_STATE, _LIFTED, "(46), (47)"),
        *_value_criteria(_STATE, _LEANS, "(35), (36)", Case.SR),
        _case_criterion(_LIFTED),
        text=Text.CORRECTED,
        reason="(35) is printed with ≤; the wall carries the ball at fast flows, ω₀ ≥ √(g/(ηR)), "
        "as (46) has it.",
    ),
    claim(
        "prop-4",
        "Prop. 4, (37)-(42)",
        "Above ω₀₁ the ball slips at both points and lags behind the fluid, by (38)-(41); "
        "its contact forces are (42)-(44).",
        *_value_criteria(_STATE, _SLIPS, "(37)-(44)"),
        _case_criterion(_SLIPS),
    ),
    claim(
        "eq-40",
        "(40), (44)",
        "A ball that has settled slipping at both points slips inwards at the floor and up the "
        "wall, cos α > 0, and backwards, sin α < 0. No such motion has cos α < 0.",
        *(
            Criterion("settled", slip, lambda m: 0.0, when=_SLIPS, relation=relation, by="(40)")
            for slip, relation in (("slip_z", Relation.AT_LEAST), ("slip_x", Relation.AT_MOST))
        ),
        *_slipping(("slip_z", "slip_x"), _on_branch, by="slipping_branch.states"),
        *_slipping(("slip_z", "slip_x"), _slip_along_alpha, by="analytic.stable_solutions: alpha"),
    ),
    claim(
        "eq-42",
        "(42), (43)",
        "Slipping at both points, the normal forces at floor and wall are the closed forms in α, "
        "and friction holds the ball back along its orbit.",
        *_slipping(("force_Ay", "force_Bx", "force_Az"), _on_branch, by="slipping_branch.branch"),
    ),
    claim(
        "prop-6",
        "Prop. 6, (49), (50)",
        "Below ω₀₂ a ball high up on the wall slips and sinks at the constant speed (g - ηRω₀²)/c, "
        "going round with the fluid; B_x = mRω₀², B_y = ηmRω₀².",
        *_value_criteria(_STATE, _SINKS, "(49), (50)"),
        Criterion(
            "settled",
            "v_y",
            _sinks_at_reynolds,
            when=all_of(_SINKS, lambda m: m.parameters.drag == SCHILLER_NAUMANN),
            by="analytic.mechanics.drag.reynolds",
        ),
        _case_criterion(given(start="on the wall")),
        text=Text.CORRECTED,
        reason="(49) lost a row: the second of its five is ω_c = ω₀.",
    ),
    claim(
        "mirrored",
        "Props. 1, 4 and 5",
        "In a flow the other way round the ball settles in the mirror images of the same states.",
        *_value_criteria(
            _STATE, is_in(Case.SS, Case.NR), "(37)-(47), mirrored", protocol="mirrored"
        ),
        *_value_criteria((*MOTION, *SUMS), _ROLLS, "(31), (32), mirrored", protocol="mirrored"),
        Criterion("mirrored", "case", case, by=_STABLE),
    ),
)
DIAGRAMS = (
    claim(
        "fig-9",
        "Fig. 9",
        "Off the floor, the spin on the wall rises with ω₀ up to ω₀₂ (NS) and falls above (NR).",
        *_value_criteria(("wall_spin",), is_in(Case.NS, Case.NR), "(91)"),
    ),
    claim(
        "fig-10",
        "Fig. 10",
        "For η < j the spins on the wall of the ball that rolls, slips, or is carried by the wall "
        "lie on the curves of Fig. 10.",
        *_value_criteria(("wall_spin",), all_of(slips_first, is_in(Case.RR, Case.SS)), "(91)"),
        *_value_criteria(("wall_spin",), all_of(slips_first, _LEANS), "(91)", Case.SR),
    ),
    claim(
        "fig-11",
        "Fig. 11",
        "For η > j rolling ends at ω₀₃, where it meets SR, whose spin on the wall falls like 1/ω₀.",
        *_value_criteria(("wall_spin",), all_of(lifts_first, _ROLLS), "(91)"),
        *_value_criteria(("wall_spin",), all_of(lifts_first, _LEANS), "(91)", Case.SR),
        _rolling_criterion(lifts_first),
    ),
    *(
        claim(
            figure,
            f"Fig. {figure[-1]}",
            f"ω₀₁ … ω₀₄ divide the plane of {axis} and ω₀ into regions. At each point the ball "
            "settles in every case whose stationary state attracts, or sinks, and in no other. (SR "
            "on an unloaded floor counts as NR.)",
            Criterion(
                "plane",
                "cases",
                lambda m: _mask(lasting_cases(m.parameters)),
                when=given(figure=figure),
                by=_STABLE,
            ),
            *criteria(
                "thresholds",
                [f"omega_0{k}" for k in (1, 2, 3, 4)],
                _on_surface,
                when=all_of(changes_case, on_plane),
                by="analytic.bifurcation.diagram.threshold_curves",
            ),
        )
        for figure, axis, on_plane in (
            ("fig-7", "η", lambda m: True),
            ("fig-8", "μ = η", _equal_friction),
        )
    ),
    claim(
        "regions",
        "Figs. 7 and 8, (84)-(90)",
        "In every region of Figs. 7 and 8 the stationary states of its label exist. Balls settle "
        "in the attracting ones and in NS, SS beyond the fold divides two basins, and in SR a ball "
        "leans on the floor.",
        Criterion("plane", "cases", _cases_in_region, by="analytic.bifurcation.diagram.case_map"),
        Criterion("edge", "edge_omega_c", _omega_c_beyond_fold, by="case_map, analytic.solution"),
        Criterion("rates", "slowest_decay", _decay_leaning, when=given(case="SR"), by="case_map"),
    ),
    claim(
        "double-points",
        "Figs. 7 and 8, black dots",
        "The fold is born at η_cr, where ω₀₂ and ω₀₄ meet; at η = j all thresholds are √(g/(jR)), "
        "and rolling ends.",
        Criterion("birth", "critical_drag", _drag_at_birth, by=_DOUBLE),
        Criterion(
            "birth",
            "critical_drag",
            partial(_drag_at_birth, equal=True),
            when=_equal_friction,
            by=f"{_DOUBLE}, equal friction",
        ),
        Criterion("thresholds", "omega_03", _where_all_meet, by=_DOUBLE),
    ),
)
SECTIONS = {"Stationary states": CLAIMS, "Bifurcations": DIAGRAMS}
