"""Wrong theories: each has one fault of the size that slips into a derivation or a program."""

from __future__ import annotations

from typing import Any

import numpy as np

from compare.mutants.exchange import (
    Function,
    WrongTheory,
    answer,
    each,
    fields,
    given,
    in_case,
    other,
    scaled,
    swapped,
    times,
)
from model import Case, Flow, Parameters, State
from model.drag import STOKES


def _gone(solution: Any) -> None:
    return None


def _stationary(what: str, change: Any) -> WrongTheory:
    return WrongTheory(what, "analytic.stationary", "stationary_solutions", answer(change))


def _without_drag_on_y(right: Function) -> Function:
    """(20) without the drag on the vertical motion."""

    def function(case: Case, x: Any, f: Any, p: Parameters, omega_0: Any) -> Any:
        rate = right(case, x, f, p, omega_0)
        return rate._replace(v_y=rate.v_y + p.c * State(*x).v_y) if case.A.name == "N" else rate

    return function


def _mu_for_eta(right: Function) -> Function:
    """omega_01 with 1 + mu where 1 + eta belongs."""

    def function(p: Parameters, mu: Any, eta: Any, *rest: Any, **named: Any) -> Any:
        curves = right(p, mu, eta, *rest, **named)
        return curves | {"omega_01": curves["omega_01"] * np.sqrt((1 + np.asarray(mu)) / (1 + np.asarray(eta)))}

    return function


def _curve(name: str, factor: float) -> Any:
    return answer(lambda curves: curves | {name: curves[name] * factor})


def _mirrored(right: Function) -> Function:
    """A slip direction taken to the other side."""
    return lambda beta, *rest: right(-np.asarray(beta), *rest)


def _fold_everywhere(right: Function) -> Function:
    """A fold at omega_02 where there is none."""

    def function(p: Parameters, *rest: Any, **named: Any) -> Any:
        curves = right(p, *rest, **named)
        missing = np.isnan(curves["omega_04"])
        return curves | {"omega_04": np.where(missing, 1.2 * np.nan_to_num(curves["omega_02"]), curves["omega_04"])}

    return function


def _by_stokes(p: Parameters) -> Parameters:
    """The parameters with Stokes' law of drag."""
    return p.replace(drag=STOKES)


def _without_lag(right: Function) -> Function:
    """A pulsating ball whose acceleration takes no friction: the fluid goes round as the ball does."""

    def function(*given: Any) -> Any:
        omega_c, _ = right(*given)
        return omega_c, omega_c

    return function


def _ramped(right: Function) -> Function:
    """Simulations with 5 % more drag where the flow is a ramp."""

    def function(p: Parameters, x0: Any, t_end: float, flow: Flow | None = None, **named: Any) -> Any:
        return right(other(c=1.05)(p) if flow and flow.kind == "ramp" else p, x0, t_end, flow, **named)

    return function


_DYNAMICS, _BOUNDS, _STATIONARY = "analytic.dynamics", "analytic.slip_bounds", "analytic.stationary"
THEORIES: tuple[WrongTheory, ...] = (
    # Forces and equations of motion, (20)-(29)
    WrongTheory("B_x of RS 1 % large", _DYNAMICS, "_rs", scaled(1.01, 3)),
    WrongTheory("A_z of RS 2 % large", _DYNAMICS, "_rs", scaled(1.02, 2)),
    WrongTheory("B_z of RS with the wrong sign", _DYNAMICS, "_rs", scaled(-1.0, 5)),
    WrongTheory("A_y of SR 1 % large", _DYNAMICS, "_sr", scaled(1.01, 1)),
    WrongTheory("B_z of SR 2 % large", _DYNAMICS, "_sr", scaled(1.02, 5)),
    WrongTheory("forces of SS with μ and η exchanged", _DYNAMICS, "_ss", given(swapped)),
    WrongTheory("A_y of SS 1 % large", _DYNAMICS, "_ss", scaled(1.01, 1)),
    WrongTheory("B_y of NR 1 % large", _DYNAMICS, "_nr", scaled(1.01, 4)),
    WrongTheory("B_z of NR 2 % large", _DYNAMICS, "_nr", scaled(1.02, 5)),
    WrongTheory("B_y of NS 1 % large", _DYNAMICS, "_ns", scaled(1.01, 4)),
    WrongTheory("B_z of NS with the wrong sign", _DYNAMICS, "_ns", scaled(-1.0, 5)),
    WrongTheory("friction of RN 2 % large", _DYNAMICS, "_rn", scaled(1.02, 0, 2)),
    WrongTheory("friction of SN 1 % large", _DYNAMICS, "_sn", scaled(1.01, 0, 2)),
    WrongTheory("A_z, B_z of RR 2 % large", _DYNAMICS, "rolling_family", scaled(1.02, 2, 5)),
    WrongTheory("B_x of RR 1 % large", _DYNAMICS, "rolling_family", scaled(1.01, 3)),
    WrongTheory("ω_c' of RR 2 % large", _DYNAMICS, "newton_euler", in_case(Case.RR, scaled(1.02, 2))),
    WrongTheory("row of ω̃_x of SR 1 % large", _DYNAMICS, "newton_euler", in_case(Case.SR, scaled(1.01, 3))),
    WrongTheory("row of ω̃_z of SS 1 % large", _DYNAMICS, "newton_euler", in_case(Case.SS, scaled(1.01, 5))),
    WrongTheory("row of ω̃_y of SN 2 % large", _DYNAMICS, "newton_euler", in_case(Case.SN, scaled(1.02, 4))),
    WrongTheory("row of ω_c of NN 2 % large", _DYNAMICS, "newton_euler", in_case(Case.NN, scaled(1.02, 2))),
    WrongTheory("no drag on the vertical motion", _DYNAMICS, "newton_euler", _without_drag_on_y),
    # Stationary solutions, Propositions 1-6
    _stationary("stationary forces 2 % large", each(None, fields(force_A=times(1.02), force_B=times(1.02)))),
    _stationary("stationary wall force of NR 5 % large", each(Case.NR, fields(force_B=times(1.05)))),
    _stationary("SR exists nowhere", each(Case.SR, _gone)),
    _stationary("NR exists nowhere", each(Case.NR, _gone)),
    _stationary("SS lags 0.5 % too little", each(Case.SS, fields(x=times(1.005, 2)))),
    _stationary("spin of SS on the floor 1 % large", each(Case.SS, fields(x=times(1.01, 3)))),
    _stationary("NS sinks 2 % too fast", each(Case.NS, fields(x=times(1.02, 1)))),
    _stationary("RR is unstable", each(Case.RR, fields(slip_stability=lambda s: type(s).UNSTABLE))),
    WrongTheory("SS with μ and η exchanged", _STATIONARY, "_ss", given(swapped)),
    WrongTheory("SS of a ball with 1 % more inertia", _STATIONARY, "_ss", given(other(j=1.01))),
    WrongTheory("SS in a fluid with 1 % more drag", _STATIONARY, "_ss", given(other(c=1.01))),
    WrongTheory("spin of SR and NR with 1 % more weight", _STATIONARY, "_lifting_spin", given(other(g=1.01))),
    WrongTheory("(35) with the sign as printed", _STATIONARY, "_wall_carries", answer(lambda carries: not carries)),
    WrongTheory("eigenvalues of SS 3 % large", "analytic.branch_stability", "eigenvalues_at", scaled(1.03)),
    WrongTheory("eigenvalues of RR, RS, NR, NS 3 % large", "analytic.jacobian", "eigenvalues", scaled(1.03)),
    WrongTheory("leaning rate of SR 5 % large", "analytic.leaning", "leaning_modes", scaled(1.05, 0)),
    WrongTheory("a ball on the wall is no attractor", _STATIONARY, "stable_solutions", answer(each(Case.NR, _gone))),
    # Bifurcations, (84)-(90)
    WrongTheory("ω₀₁ with 1 + μ for 1 + η", "analytic.bifurcation", "threshold_curves", _mu_for_eta),
    WrongTheory("ω₀₁ 0.5 % high", "analytic.bifurcation", "threshold_curves", _curve("omega_01", 1.005)),
    WrongTheory("ω₀₂ 0.5 % high", "analytic.bifurcation", "threshold_curves", _curve("omega_02", 1.005)),
    WrongTheory("ω₀₃ 0.5 % high", "analytic.bifurcation", "threshold_curves", _curve("omega_03", 1.005)),
    WrongTheory("ω₀₄ 0.5 % high", "analytic.bifurcation", "threshold_curves", _curve("omega_04", 1.005)),
    WrongTheory("a fold below η_cr", "analytic.bifurcation", "threshold_curves", _fold_everywhere),
    WrongTheory("η_cr 4 % high", "analytic.slipping_branch", "eta_critical", scaled(1.04)),
    # Stability with respect to slipping, (53)-(83)
    WrongTheory("γ 3 % large", "analytic.slip_stability", "gamma", scaled(1.03)),
    WrongTheory("γ with μ and η exchanged", "analytic.slip_stability", "slip_rates", given(swapped)),
    WrongTheory("(56) with 3 % more drag", _BOUNDS, "gamma_nr", given(other(c=1.03))),
    WrongTheory("(56) with 3 % more wall friction", _BOUNDS, "gamma_nr", given(other(eta=1.03))),
    WrongTheory("(56) with sin β of the wrong sign", _BOUNDS, "gamma_nr", _mirrored),
    WrongTheory("(58) with 5 % more drag", _BOUNDS, "steepest_nr", given(other(c=1.05))),
    WrongTheory("lift out of RR, SR and SS with 2 % more inertia", "analytic.slip_stability", "lift_acceleration",
                given(other(j=1.02))),
    WrongTheory("lift with 2 % more wall friction", "analytic.slip_stability", "lift_acceleration",
                given(other(eta=1.02))),
    WrongTheory("Definitions 1-3 with 1 % more wall friction", "analytic.slip_stability", "stability",
                lambda right: lambda case, p, *rest: right(case, other(eta=1.01)(p), *rest)),
    WrongTheory("(61) with 3 % more wall friction", _BOUNDS, "nr_to_ns", given(other(eta=1.03))),
    WrongTheory("(66) with μ, as printed", _BOUNDS, "rr_to_rs", given(swapped)),
    WrongTheory("(67) with 3 % more wall friction", _BOUNDS, "rr_to_rs_stationary", given(other(eta=1.03))),
    WrongTheory("(73) with 3 % more floor friction", _BOUNDS, "rr_to_sr", given(other(mu=1.03))),
    WrongTheory("(74) with 3 % more inertia", _BOUNDS, "rr_to_sr_stationary", given(other(j=1.03))),
    WrongTheory("(82), (83) with μ and η exchanged", _BOUNDS, "rr_to_ss", given(swapped)),
    # Laws of drag
    WrongTheory("SS lags as under Stokes' drag", _STATIONARY, "_ss", given(_by_stokes)),
    WrongTheory("NS sinks as under Stokes' drag", _STATIONARY, "_ns", given(_by_stokes)),
    WrongTheory("ω₀₄ as under Stokes' drag", "analytic.bifurcation", "threshold_curves", given(_by_stokes)),
    WrongTheory("the drag's slope left out of the eigenvalues", "analytic.drag", "of_velocity", answer(np.real)),
    WrongTheory("Schiller and Naumann's wake 5 % strong", "analytic.drag", "law",
                answer(lambda law: law._replace(wake=1.05 * law.wake))),
    WrongTheory("quadratic drag 5 % strong", "analytic.drag", "law",
                answer(lambda law: law._replace(blunt=1.05 * law.blunt))),
    # The flowmeter, section 5.3
    WrongTheory("operating range up to ω₀₂", "analytic.flowmeter", "operating_range",
                lambda right: lambda p: _unloading(p)),
    WrongTheory("slope of the characteristic 5 % large", "analytic.flowmeter", "characteristic_slope", scaled(1.05)),
    WrongTheory("unloading 2 % too high", "analytic.flowmeter", "unloading_limit", scaled(1.02)),
    # Motions
    WrongTheory("motions of a ball with 2 % more inertia", "analytic.simulation", "simulate", given(other(j=1.02))),
    WrongTheory("motions with 2 % more wall friction", "analytic.simulation", "simulate", given(other(eta=1.02))),
    # Beyond the paper
    WrongTheory("rolling goes on while forces allow it", "analytic.simulation", "simulate",
                lambda right: lambda *given, **named: right(*given, **named | {"leave_rolling": "infeasible"})),
    WrongTheory("hops with 10 % more floor friction", "analytic.orbits", "refine", given(other(mu=1.1))),
    # Unsteady flow
    WrongTheory("a rolling ball follows the flow at the rate c", "analytic.response", "rolling_rate",
                lambda right: lambda p: p.c),
    WrongTheory("response to a pulsation 2 % large", "analytic.response", "transfer", scaled(1.02)),
    WrongTheory("pulsation takes no friction", "analytic.pulsation", "_swing", _without_lag),
    WrongTheory("slip begins 3 % late in a pulsation", "analytic.pulsation", "slip_onset", scaled(1.03)),
    WrongTheory("slip begins 3 % early in a pulsation", "analytic.pulsation", "slip_onset", scaled(0.97)),
    WrongTheory("rolling follows a pulsation as under Stokes' drag", "analytic.pulsation", "_lag", given(_by_stokes)),
    WrongTheory("mean reading of a pulsation with 2 % more floor friction", "analytic.pulsation", "mean_error",
                given(other(mu=1.02))),
    WrongTheory("ringing after a jump in a fluid with 5 % more drag", "analytic.response", "step_response",
                given(other(c=1.05))),
    WrongTheory("a ramp in a fluid with 5 % more drag", "analytic.simulation", "simulate", _ramped),
)  # fmt: skip


def _unloading(p: Parameters) -> float:
    from analytic import bifurcation

    return bifurcation.thresholds(p).omega_02
