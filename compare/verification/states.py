"""What theory says of a settled state, as claims of several subjects ask for it."""

import analytic
from analytic import StationarySolution
from analytic.bifurcation import diagram as bifurcation
from compare.method.record import Measurement
from compare.method.settling import forces, physical_case
from compare.verification.claim import When
from compare.verification.judge import theory
from model import Case, Parameters
from model.drag import STOKES
from model.kinematics import VARIABLES


def solutions(p: Parameters) -> list[StationarySolution]:
    """The stationary solutions that a ball may settle to: attractors, and sinking."""
    return theory(analytic.stable_solutions, p, sinking=True)


def lasting_cases(p: Parameters) -> set[Case]:
    """Cases of the solutions that a ball may settle to; SR is NR on an unloaded floor."""
    return {s.case for s in solutions(p)} - {Case.SR}


def exists(case: Case, m: Measurement) -> bool:
    """Whether theory has a stationary state of a case, for which friction suffices."""
    return any(s.exists for s in theory(analytic.stationary_solutions, m.parameters, (case,)))


def case_of(m: Measurement) -> Case:
    """The case of the state that was measured; contacts that carry nothing count as none.

    SR is counted as NR, with an unloaded floor, and RN as RS, with an unloaded wall."""
    case = physical_case(m.case)
    return Case.RS if case is Case.RN else case


def solution_of(m: Measurement) -> StationarySolution:
    """The solution of the detected case that lasts; LookupError if there is none."""
    for state in solutions(m.parameters):
        if state.case is case_of(m):
            return state
    raise LookupError(f"no state of case {case_of(m).name} lasts")


def thresholds_of(m: Measurement) -> analytic.Thresholds:
    """The thresholds of a set by theory: independent of the flow of a measurement."""
    return theory(analytic.thresholds, m.parameters.replace(omega_0=1.0))


def value_in(s: StationarySolution, m: Measurement) -> float:
    """The value of the variable, or force, that was measured, in a stationary solution."""
    if m.of == "wall_spin":
        return float(bifurcation.wall_spin(s.state, m.parameters))
    if m.of in VARIABLES:
        return float(getattr(s.state, m.of))
    return float(forces(s.force_A, s.force_B)[m.of])


def is_in(*cases: Case) -> When:
    """A filter of measurements: whether the settled state is in one of these cases."""
    return lambda m: case_of(m) in cases


def slips_first(m: Measurement) -> bool:
    """Whether eta < j: slip ends rolling."""
    return m.parameters.eta < m.parameters.j


def lifts_first(m: Measurement) -> bool:
    """Whether eta > j: the floor is lost before slip begins."""
    return m.parameters.eta > m.parameters.j


SMOOTH_END = "floor force of settled slipping → 0"
"""How omega_02 is measured where slipping ends without a fold."""


def changes_case(m: Measurement) -> bool:
    """Whether a threshold is one at which a ball changes its case."""
    return m.at["by"] != SMOOTH_END


def by_stokes(m: Measurement) -> bool:
    """Whether drag is by Stokes' law."""
    return m.parameters.drag == STOKES


def from_floor(m: Measurement) -> bool:
    """Whether the ball started on the floor."""
    return m.at["start"] in ("rest", "with the fluid")
