"""Laws at every instant, landings, the fluid's drag, the equations of motion (23)-(29)."""

from collections.abc import Callable, Iterator
from functools import partial

from scipy.optimize import brentq

import analytic
from analytic.flowmeter import real_fluid
from analytic.mechanics import drag
from analytic.slipping import slip_stability
from analytic.slipping.slip_stability import SlipStability
from compare.method.quantities import quantity
from compare.method.record import Measurement, state
from compare.method.settling import forces
from compare.method.statistics import Estimate
from compare.subjects.motion import measure as moving
from compare.verification.claim import Criterion, Text, all_of, claim, criteria, given
from compare.verification.judge import RTOL, integrated, simulated, theory
from compare.verification.states import by_stokes, exists
from model import Case, Trajectory
from model.cases import TRAITS
from model.kinematics import TURNING, VARIABLES

_OWN = (
    "The paper has no equations away from the wall: (20), with a drag on radial motion, is this "
    "project's extension."
)
_RUN = "analytic.simulate"
_TORQUE = "analytic.flowmeter.real_fluid.rolling"
_HOLDS = "analytic.slip_stability.stability"


def _sinking(m: Measurement) -> float:
    """v_y in m/s by Stokes' drag, from the properties of fluid and ball."""
    at = m.at
    fluid = {"nu_f": at["nu_f"], "rho_f": at["rho_f"], "rho_b": at["rho_b"]}
    return -drag.sinking_speed(**fluid, r=at["r"], gravity=at["gravity"])


def _fallen(m: Measurement) -> Estimate:
    """Height, m, of a thrown ball at the end, by the depth whose `fall_time` is the time."""
    p, (y, v_y, *_), within = m.parameters, state(m), 1e-12 * m.parameters.R

    def late(fall: float) -> float:
        return drag.fall_time(fall, v_y, p) - m.at["time"]

    return Estimate(y - float(brentq(late, 1e-6 * p.R, 100 * p.R, xtol=within)), within)


def _end_of_motion(m: Measurement) -> Estimate:
    """A state variable of theory's motion at the time at which the measured one ends."""
    flow = moving.late_ramp(m.parameters, m.at["rate"], m.at["time"]) if "rate" in m.at else None
    motion = simulated(m.parameters, state(m), m.at["time"], flow=flow)
    value = float(getattr(motion, m.of)[-1])
    return integrated(value, quantity(m.quantity).size(m.parameters))


def _end_states(*starts: str) -> tuple[Criterion, ...]:
    """Criteria on the state at the end of motions from these starts."""

    def starts_so(m: Measurement) -> bool:
        return m.at["start"] in starts

    ends = [f"end_{name}" for name in VARIABLES]
    return criteria("runs", ends, _end_of_motion, when=starts_so, by=_RUN)


def _is_stable(case: Case, m: Measurement) -> bool:
    """Whether slip out of a case dies out."""
    return slip_stability.stability(case, m.parameters) is SlipStability.STABLE


def _rolls_or_slips(holds: Callable[[Case, Measurement], bool], m: Measurement) -> float:
    """The case along a smooth wall: RS as long as `holds` says that it lasts, SS beyond."""
    return float(Case.RS if holds(Case.RS, m) else Case.SS)


def _braked_rolls(m: Measurement) -> float:
    """RR for a ball whose spin the fluid brakes, if friction suffices; else LookupError."""
    if not real_fluid.rolling(m.parameters).friction < 1:
        raise LookupError("friction doesn't balance the fluid's torque")
    return float(Case.RR)


def _motion(m: Measurement, leave_rolling: str = "slip-stability") -> Trajectory:
    """Theory's motion for the time of the measured one."""
    begun = m.parameters, state(m), m.at["time"]
    return theory(analytic.simulate, *begun, leave_rolling=leave_rolling, rtol=RTOL)


def _rolls_or_motion(m: Measurement) -> float:
    """RR where it is stable; else that of theory's motion, slipping at both points, or lifted."""
    return Case.RR if _is_stable(Case.RR, m) else float(_motion(m).case[-1])


_SMOOTH, _ROUGH = (given(start=start) for start in moving.AT_A_BORDER)


def _motion_either(m: Measurement) -> Trajectory:
    """Theory's motion, or the one that rolls as long as forces admit it, as measured.

    Where both agree with theory the internal force between floor and wall decides, which the state
    doesn't contain (docs/theory.md, 7)."""
    case, leaves = m.case, _motion(m)
    if leaves.case[-1] == case:
        return leaves
    stays = _motion(m, "infeasible")
    return stays if stays.case[-1] == case else leaves


def _end_in_case(m: Measurement) -> Estimate:
    """A variable of theory's motion at its end, by the name of the measured one."""
    value = float(getattr(_motion_either(m), m.of)[-1])
    return integrated(value, quantity(m.quantity).size(m.parameters))


def _ratio(contact: str, coefficient: Callable[[Measurement], float]) -> Criterion:
    """A criterion on the friction of a contact that slips, divided by its load."""
    when = given(contact=contact)
    return Criterion("laws", "friction_ratio", coefficient, when=when, by="(14), (15)")


LAW_CLAIMS = (
    claim(
        "table-3",
        "Table 3, (12)-(17)",
        "A contact that rolls doesn't slip, and one that is closed has no gap. Where it slips, "
        "friction is mu or eta times the normal force and opposes the slip. (That contacts press, "
        "and that friction stays within its limit, (12) and (13), is built into any solver of "
        "friction cones: it is not counted.)",
        Criterion("laws", "law_in_motion", lambda m: 0.0, by="Table 3, (14)-(17)"),
        _ratio("A", lambda m: m.parameters.mu),
        _ratio("B", lambda m: m.parameters.eta),
    ),
    claim(
        "eq-10",
        "(9), (10)",
        "A ball sinks freely at the speed at which Stokes' drag balances its weight less buoyancy.",
        Criterion("laws", "v_y", _sinking, by="analytic.mechanics.drag.sinking_speed"),
        text=Text.CORRECTED,
        reason="Table 1 gives the unit of m·c as kg m/s; it is kg/s.",
    ),
    claim(
        "cases",
        "Fig. 2, Table 3",
        "Slip speeds and normal forces tell all nine kinematic cases apart; the ball passes "
        "through them as the equations of motion say.",
        Criterion("motions", "case", lambda m: float(_motion_either(m).case[-1]), by=_RUN),
        *criteria("motions", [f"end_{name}" for name in VARIABLES[TURNING]], _end_in_case, by=_RUN),
    ),
    claim(
        "flight",
        "extension, (9), (20)",
        "A ball that is thrown flies on under gravity and drag, past the axis of the vessel, and "
        "keeps its spin.",
        *_end_states(*moving.THROWN, moving.BLUNTER),
        Criterion(
            "runs",
            "end_y",
            _fallen,
            when=all_of(given(start="thrown"), by_stokes),
            by="analytic.mechanics.drag.fall_time",
        ),
        reason=_OWN,
    ),
    claim(
        "opening",
        "(12), section 1.1",
        "The wall contact opens where it carries no load, or where friction at the floor pulls the "
        "ball inwards more than its orbit needs. The ball then leaves the wall as the equations "
        "say.",
        *_end_states(*moving.PULLED_OFF),
    ),
    claim(
        "sliding",
        "(20), (23)-(29)",
        "A ball that slips or rolls at one contact or both moves on from case to case as the "
        "equations say, also while the flow rises or falls.",
        *_end_states(*moving.SLIDING, *moving.IN_RAMPS),
    ),
    claim(
        "smooth-wall",
        "Prop. 2, Definitions 1-3",
        "Along a wall without friction a ball goes round with the fluid, rolls on the floor and "
        "spins about its axis, as long as slip at the floor dies out, and friction suffices. "
        "Faster, it slips.",
        *(
            Criterion("runs", "case", partial(_rolls_or_slips, holds), when=_SMOOTH, by=by)
            for holds, by in ((_is_stable, _HOLDS), (exists, "analytic.stationary_solutions"))
        ),
        Criterion("runs", "end_omega_c", _end_of_motion, when=_SMOOTH, by=_RUN),
    ),
    claim(
        "definition-1-2",
        "Definitions 1 and 2, (82)",
        "On a floor so rough, μ > 1, that a ball could jam between floor and wall and roll on "
        "beyond ω₀₁, a slight slip dies out at once below ω₀₁, and lasts above.",
        Criterion("runs", "case", _rolls_or_motion, when=_ROUGH, by=_HOLDS),
        Criterion("runs", "end_omega_c", _end_of_motion, when=_ROUGH, by=_RUN),
    ),
    claim(
        "fluid-torque",
        "extension",
        "A fluid that brakes the spin of a ball makes it roll slower than the fluid goes round, at "
        "first order in the torque.",
        Criterion("torque", "case", _braked_rolls, by=_TORQUE),
        Criterion(
            "torque", "omega_c", lambda m: real_fluid.rolling(m.parameters).omega_c, by=_TORQUE
        ),
        reason="The paper leaves the torque out; so does all else here, unless parameters give it.",
    ),
    claim(
        "impacts",
        "extension",
        "A ball that lands does not rebound, and friction acts on it during the impact by "
        "Coulomb's law for impulses.",
        Criterion("impacts", "rebounds", lambda m: 0.0, by="Newton's law with restitution 0"),
        *criteria("impacts", [f"after_{name}" for name in moving.LANDED], _end_of_motion, by=_RUN),
        reason="Impacts are not in the paper: Newton's law with restitution 0, and Coulomb's for "
        "the impulses.",
    ),
)
_SOURCES = {
    Case.RR: "(23)",
    Case.RS: "(24)",
    Case.SR: "(25), (29)",
    Case.SS: "(26), (29)",
    Case.NR: "(27)",
    Case.NS: "(28), (29)",
}
_CORRECTED = {
    Case.SS: "The last row of (26) has the wrong sign before w̃_z A_z/(w̃_x jmr), and A_z and B_z "
    "of (29) are damaged.",
    Case.NS: "(28) divides by w̃_x where it should by w̃_y, and its last row has -(c v_y + g)/r "
    "for +(c v_y + g)/r.",
}
_FORCES = ("Ax", "Ay", "Az", "Bx", "By", "Bz", "Ax-By", "Ay+By", "Bx+By")
"""Where both contacts roll only A_z, B_z and the sums are determined, and measured."""


def _motion_criteria(case: Case) -> Iterator[Criterion]:
    """Criteria on rates of change and forces of a moving ball in a case."""

    def rate(m: Measurement) -> float:
        rates = theory(analytic.vector_field, case, state(m), m.parameters)
        return float(rates[VARIABLES.index(m.of)])

    def force(m: Measurement) -> float:
        both = theory(analytic.contact_forces, case, state(m), m.parameters)
        return float(forces(*both)[m.of])

    def lift(m: Measurement) -> float:
        return slip_stability.lift_acceleration(case, case, state(m), m.parameters)

    field = partial(Criterion, "field", when=given(case=case.name))
    if case in (Case.NR, Case.NS):  # into which a ball lifts off
        yield field("rate_v_y", lift, by="analytic.slip_stability.lift_acceleration")
    for name in TRAITS[case].active:
        if name not in ("y", "h"):
            yield field(f"rate_{name}", rate, by="analytic.vector_field")
    for name in _FORCES:
        yield field(f"moving_force_{name}", force, by="analytic.contact_forces")


EQUATIONS = tuple(
    claim(
        f"motion-{case.name}",
        _SOURCES.get(case, "(20)"),
        f"In case {case.name} the accelerations and contact forces are those of the equations of "
        f"motion.",
        *_motion_criteria(case),
        text=Text.CORRECTED if case in _CORRECTED else Text.PRINTED,
        reason=_CORRECTED.get(case, "" if case in _SOURCES else _OWN),
    )
    for case in Case
)
SECTIONS = {"Laws and cases": LAW_CLAIMS, "Equations of motion": EQUATIONS}
