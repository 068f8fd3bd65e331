"""The bifurcations over omega_0: Table 5, Proposition 7, the branch between attractors."""

import math
from collections.abc import Callable
from functools import partial

import numpy as np
from scipy.optimize import brentq

import analytic
from analytic.bifurcation import diagram as bifurcation
from analytic.mechanics import rolling_forces, roots
from analytic.stationary import slipping_branch
from compare.method.record import Measurement, Relation
from compare.verification.claim import Criterion, When, claim, criteria, given
from compare.verification.judge import theory
from compare.verification.states import SMOOTH_END, changes_case, thresholds_of, value_in
from model import Case, Parameters
from model.arrays import Real

_BY = "analytic.thresholds"
_measured = partial(Criterion, "thresholds")


def _threshold(quantity: str, when: When = changes_case, protocol: str = "thresholds") -> Criterion:
    """A criterion on a threshold, which `analytic.thresholds` predicts."""

    def predict(m: Measurement) -> float:
        return float(getattr(thresholds_of(m), quantity))

    return Criterion(protocol, quantity, predict, when=when, by=f"{_BY}: {quantity}")


def _unstable_quantity(m: Measurement) -> float:
    """A quantity of the unstable SS, which is on the border between two basins."""
    unstable = theory(analytic.solution, m.parameters, Case.SS, stable=False)
    return value_in(unstable, m)


def _greatest_flow(m: Measurement) -> float:
    """The greatest flow along the branch of SS, rad s-1; LookupError unless one maximum."""
    _, flows = slipping_branch.states(np.linspace(-8.0, 8.0, 4001), m.parameters)
    tops = np.flatnonzero((flows[1:-1] > flows[:-2]) & (flows[1:-1] > flows[2:])) + 1
    if len(tops) != 1:
        raise LookupError(f"the flow has {len(tops)} maxima along the branch")
    return float(flows[tops[0]])


_HOLDS: dict[str, Callable[[float, Parameters], float]] = {
    "margin": lambda omega, p: float(rolling_forces.margin(omega, p, omega)),
    "slip_margin": lambda omega, p: float(rolling_forces.slip_margin(omega, p, omega)),
    "least_utilisation": lambda omega, p: (
        1 - float(rolling_forces.least_utilisation(omega, p, omega).utilisation)
    ),
}
"""What changes sign where contacts can no longer hold a ball that rolls with the fluid."""


def _end_of_rolling(name: str, p: Parameters) -> float:
    """The flow up to which forces admit rolling, which is where rolling ends for mu < 1."""
    unit = math.sqrt(p.g / p.R)
    return float(brentq(_HOLDS[name], 0.01 * unit, 100 * unit, args=(p,), rtol=1e-12))


def _holds(name: str, quantity: str) -> Criterion:
    """A criterion on where rolling ends, by one of `_HOLDS`."""

    def predict(m: Measurement) -> float:
        return theory(_end_of_rolling, name, m.parameters.replace(omega_0=1.0))

    by = f"rolling_forces.{name}"
    return _measured(quantity, predict, when=lambda m: m.parameters.mu < 1, by=by)


def _where_lasts(case: Case, p: Parameters, slow: float, fast: float) -> float:
    """The flow between two at which a case begins or ends, with slip that dies out; rad s-1."""

    def lasts(omega_0: Real) -> int:
        found = analytic.stationary_solutions(p.replace(omega_0=float(omega_0)), (case,))
        return 1 if any(s.exists and s.slip_stable for s in found) else -1

    return float(roots.sign_change(lasts, slow, fast))


def _lasting(case: Case, quantity: str, when: When = changes_case) -> Criterion:
    """A criterion on a threshold, where a case begins or ends by its stationary solution."""

    def predict(m: Measurement) -> float:
        p = m.parameters.replace(omega_0=1.0)
        unit = math.sqrt(p.g / p.R)
        slow, fast = 0.01 * unit, 100 * unit
        if case is Case.SS:  # it has two ends; on a smooth wall only the fastest flow is one
            t = thresholds_of(m)
            last = next(end for end in (t.omega_04, t.omega_02, fast) if not math.isnan(end))
            middle = math.sqrt(t.omega_01 * last)
            slow, fast = (slow, middle) if quantity == "omega_01" else (middle, fast)
        return theory(_where_lasts, case, p, slow, fast)

    by = f"analytic.stationary_solutions: {case.name}"
    return _measured(quantity, predict, when=when, by=by)


CLAIMS = (
    claim(
        "table-5-P3",
        "Table 5, P3",
        "At ω₀₁ two-point rolling gives way to slipping at both points, whose slip begins at zero.",
        _threshold("omega_01"),
        _lasting(Case.RR, "omega_01"),
        _lasting(Case.SS, "omega_01"),
    ),
    claim(
        "rolling-holds",
        "(12), (13), (22)",
        "Rolling at both points goes on just as long as forces within both friction cones admit "
        "it, for μ < 1.",
        *(_holds(name, quantity) for name in _HOLDS for quantity in ("omega_01", "omega_03")),
    ),
    claim(
        "table-5-P2",
        "Table 5, P2",
        "At ω₀₂ the sinking state (NS) and the state carried by the wall (NR) meet.",
        _threshold("omega_02"),
        _lasting(Case.NS, "omega_02"),
        _lasting(Case.NR, "omega_02"),
    ),
    claim(
        "table-5-NF2",
        "Table 5, NF2",
        "At ω₀₂ the unstable state of slipping at both points merges with the state carried by the "
        "wall.",
        _threshold("omega_02", protocol="edge"),
    ),
    claim(
        "table-5-NT1",
        "Table 5, NT1",
        "With η > j two-point rolling ends at ω₀₃: below, a ball pressed to the floor settles in "
        "it; above, it leaves it.",
        _threshold("omega_03"),
        _lasting(Case.RR, "omega_03"),
        _measured("lifts", lambda m: math.isnan(thresholds_of(m).omega_01), by=f"{_BY}: omega_01"),
    ),
    claim(
        "table-5-F",
        "Table 5, F",
        "The stable branch of slipping at both points ends in a fold at ω₀₄, where there is one.",
        _threshold("omega_04"),
        _lasting(Case.SS, "omega_04"),
        _measured(
            "folds", lambda m: not math.isnan(thresholds_of(m).omega_04), by=f"{_BY}: omega_04"
        ),
    ),
    claim(
        "sub-branches",
        "Prop. 7, (87)-(90), Fig. 10",
        "Between ω₀₂ and ω₀₄ an unstable state of slipping at both points divides two attractors.",
        *criteria(
            "edge",
            [f"edge_{name}" for name in ("omega_c", "slip_x", "slip_y", "slip_z", "wall_spin")],
            _unstable_quantity,
            by="analytic.solution: SS beyond the fold, (37)-(41)",
        ),
    ),
    claim(
        "eta-critical",
        "(87), Fig. 7",
        "Slipping at both points ends in a fold for η_cr < η < j. For η < η_cr it passes to the "
        "state carried by the wall at ω₀₂, without a jump.",
        _measured(
            "folds", lambda m: m.parameters.eta > thresholds_of(m).eta_cr, by=f"{_BY}: eta_cr"
        ),
        Criterion(
            "birth",
            "critical_drag",
            lambda m: bifurcation.critical_drag(m.parameters),
            by="diagram.critical_drag",
        ),
        _threshold("omega_02", given(by=SMOOTH_END)),
        _lasting(Case.SS, "omega_02", given(by=SMOOTH_END)),
    ),
    claim(
        "one-fold",
        "after Prop. 7",
        "There is only one fold ω₀₄, and it lies above ω₀₁ and ω₀₂.",
        _measured(
            "omega_04",
            lambda m: max(thresholds_of(m).omega_01, thresholds_of(m).omega_02),
            relation=Relation.AT_LEAST,
            by=f"{_BY}: omega_01, omega_02",
        ),
        _measured(
            "folds",
            lambda m: bifurcation.number_of_folds(m.parameters),
            by="diagram.number_of_folds",
        ),
        _measured("omega_04", _greatest_flow, by="slipping_branch.states"),
    ),
)
SECTIONS = {"Bifurcations": CLAIMS}
