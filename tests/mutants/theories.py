"""Wrong theories: each has one fault of the size that slips into a derivation or a program.

Most change the answer of the right function, or the parameters of the ball it is given."""

import functools
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from analytic.bifurcation import diagram as bifurcation
from analytic.bifurcation.diagram import Exists
from analytic.mechanics import rolling_forces
from analytic.mechanics.drag import DragLaw
from analytic.simulation.equations import System
from analytic.slipping import slip_bounds
from compare.plan import Level
from model import Case, Flow, Parameters, State
from model.drag import STOKES
from tests.mutants.exchange import Fault, Function, WrongTheory, faulty

Change = Callable[[Any], Any]


def answer(change: Change) -> Fault:
    """Its answer is changed."""
    return lambda right, *args, **named: change(right(*args, **named))


def scaled(factor: float, *entries: int) -> Fault:
    """Its answer is `factor` times too large: all of it, or these entries."""
    return answer(times(factor, *entries))


def of_case(case: Case | None, change: Change) -> Fault:
    """Of its list of solutions those of a case are changed, all for None."""
    return answer(lambda solutions: [change(s) if case in (None, s.case) else s for s in solutions])


def without(case: Case) -> Fault:
    """Its list of solutions lacks a case."""
    return answer(lambda solutions: [s for s in solutions if s.case is not case])


Ball = Parameters | System
"""The parameters of a ball, as they are given or as plain numbers."""


def given(change: Change) -> Fault:
    """It takes other parameters for those of the ball, which are made once for each motion."""
    last: list[Any] = [None, None]

    def changed(p: Ball) -> Any:
        if last[0] is not p:
            last[:] = p, change(p)
        return last[1]

    return lambda right, *args, **named: right(
        *(changed(a) if isinstance(a, Ball) else a for a in args), **named
    )


def replaced(p: Ball, **values: Any) -> Ball:
    """The parameters with some of them changed."""
    if isinstance(p, Parameters):
        return p.replace(**values)
    law = DragLaw(*(term * (values.get("c", p.c) / p.c if p.c else 1.0) for term in p.law))
    return p._replace(law=law, **values)


def other(**factors: float) -> Fault:
    """It takes a ball some of whose parameters are multiplied."""
    return given(
        lambda p: replaced(
            p, **{name: getattr(p, name) * factor for name, factor in factors.items()}
        )
    )


swapped = given(lambda p: replaced(p, mu=p.eta, eta=p.mu))
"""It takes the friction of the floor for that of the wall, and the other way round."""


def where(test: Change, fault: Fault) -> Fault:
    """The fault shows only where the first argument passes a test."""
    return lambda right, first, *rest, **named: (faulty(right, fault) if test(first) else right)(
        first, *rest, **named
    )


def in_case(fault: Fault, *cases: Case) -> Fault:
    """The fault shows only where the first argument is one of these cases."""
    return where(cases.__contains__, fault)


def fields(**changes: Change) -> Change:
    """A dataclass or named tuple with some of its fields changed."""

    def change(record: Any) -> Any:
        put = {name: each(getattr(record, name)) for name, each in changes.items()}
        return record._replace(**put) if hasattr(record, "_replace") else replace(record, **put)

    return change


def entries(**changes: Change) -> Change:
    """A mapping with some of its entries changed."""
    return lambda mapping: (
        mapping | {name: change(mapping[name]) for name, change in changes.items()}
    )


def times(factor: float, *entries: int) -> Change:
    """A number or array multiplied, or some entries of a sequence."""

    def change(values: Any) -> Any:
        if not entries:
            return factor * values
        parts = [factor * part if k in entries else part for k, part in enumerate(values)]
        if isinstance(values, np.ndarray):
            return np.array(parts)
        return type(values)(*parts) if hasattr(values, "_fields") else type(values)(parts)

    return change


def _rolls_up_to(p: Parameters) -> float:
    t = bifurcation.thresholds(p)
    return t.omega_01 if p.eta < p.j else t.omega_03


def _by_stokes(p: Parameters) -> Parameters:
    """The parameters with Stokes' law of drag."""
    return p.replace(drag=STOKES)


def _exist(right: Function, p: Parameters) -> list[Any]:
    """Solutions that exist everywhere."""
    return [replace(s, exists=True) for s in right(p)]


def _end_early(right: Function, p: Parameters) -> list[Any]:
    """Solutions only where there are some in a flow 1 % faster, too."""
    return right(p) if right(p.replace(omega_0=1.01 * p.omega_0)) else []


def _without_drag_on_y(
    right: Function, case: Case, x: Any, f: Any, p: Parameters, omega_0: Any
) -> Any:
    """(20) without the drag on the vertical motion."""
    rate = right(case, x, f, p, omega_0)
    return rate._replace(v_y=rate.v_y + p.c * State(*x).v_y) if case.A.name == "N" else rate


def _mu_for_eta(right: Function, p: Parameters, mu: Any, eta: Any, *rest: Any, **named: Any) -> Any:
    """omega_01 with 1 + mu where 1 + eta belongs."""
    wrong = np.sqrt((1 + np.asarray(mu)) / (1 + np.asarray(eta)))
    return entries(omega_01=times(wrong))(right(p, mu, eta, *rest, **named))


def _fold_everywhere(curves: dict[str, Any]) -> dict[str, Any]:
    """A fold at omega_02 where there is none."""
    folds, instead = curves["omega_04"], 1.2 * np.nan_to_num(curves["omega_02"])
    return curves | {"omega_04": np.where(np.isnan(folds), instead, folds)}


def _without(flag: Exists, there: int = 0) -> Fault:
    """A plane of parameters without a label, where another one is."""
    return answer(lambda plane: np.where((plane & there) == there, plane & ~np.uint8(flag), plane))


def _jams(right: Function, case: Case, p: Parameters, omega_c: float | None = None) -> Any:
    """Definitions 1-3 with RR stable wherever forces within both cones exist."""
    known = right(case, p, omega_c)
    forces = rolling_forces.margin(p.omega_0 if omega_c is None else omega_c, p) >= 0
    return type(known).STABLE if case is Case.RR and p.mu > 1 and forces else known


def _ramped(
    right: Function, p: Parameters, x0: Any, t_end: float, flow: Flow | None = None, **named: Any
) -> Any:
    """Simulations with 5 % more drag where the flow is a ramp."""
    return right(
        p.replace(c=1.05 * p.c) if flow and flow.kind == "ramp" else p, x0, t_end, flow, **named
    )


def _rolls_for_ever(right: Function, p: Parameters, mu: Any, eta: Any, omega_0: Any) -> Any:
    """A plane with RR at every flow on walls rougher than j."""
    plane = right(p, mu, eta, omega_0)
    return np.where((np.asarray(eta) > p.j)[:, None], plane | np.uint8(Exists.RR), plane)


def _one_cone(right: Function, p: Parameters) -> float:
    """The amplitude of a fast pulsation at which the cone of wall or floor alone is full."""
    return min(
        abs(bound(p, p.omega_0, 1).zero - p.omega_0)
        for bound in (slip_bounds.rr_to_rs, slip_bounds.rr_to_sr)
    )


def _reads_low(right: Function, p: Parameters, *pulsation: float) -> float:
    """A mean reading that is low wherever the ball slips."""
    error = float(right(p, *pulsation))
    return error if abs(error) > 1e-3 * p.omega_0 else -0.01 * p.omega_0


_backwards = functools.partial(where, lambda p: p.omega_0 < 0)
_FAULTS: dict[str, dict[str, Fault]] = {
    # Forces and equations of motion, (20)-(29)
    "mechanics.dynamics._rs": {
        "B_x of RS 1 % large": scaled(1.01, 3),
        "A_z of RS 2 % large": scaled(1.02, 2),
        "B_z of RS with the wrong sign": scaled(-1.0, 5),
        "the wall of RS doesn't turn the spin axis": lambda right, x, p, *rest: times(
            1 / (1 + p.j), 3
        )(right(x, p, *rest)),
    },
    "mechanics.dynamics._sr": {
        "A_y of SR 1 % large": scaled(1.01, 1),
        "B_z of SR 2 % large": scaled(1.02, 5),
    },
    "mechanics.dynamics._ss": {
        "forces of SS with μ and η exchanged": swapped,
        "A_y of SS 1 % large": scaled(1.01, 1),
    },
    "mechanics.dynamics._nr": {
        "B_y of NR 1 % large": scaled(1.01, 4),
        "B_z of NR 2 % large": scaled(1.02, 5),
    },
    "mechanics.dynamics._ns": {
        "B_y of NS 1 % large": scaled(1.01, 4),
        "B_z of NS with the wrong sign": scaled(-1.0, 5),
    },
    "mechanics.dynamics._rn": {"friction of RN 2 % large": scaled(1.02, 0, 2)},
    "mechanics.dynamics._sn": {"friction of SN 1 % large": scaled(1.01, 0, 2)},
    "mechanics.dynamics.rolling_family": {
        "A_z, B_z of RR 2 % large": scaled(1.02, 2, 5),
        "B_x of RR 1 % large": scaled(1.01, 3),
    },
    "mechanics.dynamics.newton_euler": {
        "ω_c' of RR 2 % large": in_case(scaled(1.02, 2), Case.RR),
        "row of ω̃_x of SR 1 % large": in_case(scaled(1.01, 3), Case.SR),
        "row of ω̃_z of SS 1 % large": in_case(scaled(1.01, 5), Case.SS),
        "row of ω̃_y of SN 2 % large": in_case(scaled(1.02, 4), Case.SN),
        "row of ω_c of NN 2 % large": in_case(scaled(1.02, 2), Case.NN),
        "no drag on the vertical motion": _without_drag_on_y,
    },
    # Stationary solutions, Propositions 1-6
    "stationary.solutions.stationary_solutions": {
        "stationary forces 2 % large": of_case(
            None, fields(force_A=times(1.02), force_B=times(1.02))
        ),
        "stationary wall force of NR 5 % large": of_case(Case.NR, fields(force_B=times(1.05))),
        "SR exists nowhere": without(Case.SR),
        "NR exists nowhere": without(Case.NR),
        "SS lags 0.5 % too little": of_case(Case.SS, fields(x=times(1.005, 2))),
        "spin of SS on the floor 1 % large": of_case(Case.SS, fields(x=times(1.01, 3))),
        "NS sinks 2 % too fast": of_case(Case.NS, fields(x=times(1.02, 1))),
        "in a flow the other way round the ball spins as before": _backwards(
            of_case(None, fields(x=times(-1.0, 3)))
        ),
        "in a flow the other way round friction along the orbit is as before": _backwards(
            of_case(None, fields(force_A=times(-1.0, 2)))
        ),
        "RR is unstable": of_case(Case.RR, fields(slip_stability=lambda s: type(s).UNSTABLE)),
    },
    "stationary.solutions._ss": {
        "SS with μ and η exchanged": swapped,
        "SS of a ball with 1 % more inertia": other(j=1.01),
        "SS in a fluid with 1 % more drag": other(c=1.01),
        "SS lags as under Stokes' drag": given(_by_stokes),
        "α of SS with the wrong sign": of_case(None, fields(alpha=times(-1.0))),
        "SS ends 1 % before the fold": _end_early,
    },
    "stationary.solutions._ns": {
        "NS sinks as under Stokes' drag": given(_by_stokes),
        "NS ends 1 % before ω₀₂": _end_early,
    },
    "stationary.solutions._lifting_spin": {"spin of SR and NR with 1 % more weight": other(g=1.01)},
    "stationary.solutions._wall_carries": {
        "(35) with the sign as printed": answer(lambda carries: not carries),
        "the wall carries a ball from 5 % more flow on": other(omega_0=1 / 1.05),
    },
    "stationary.solutions.stable_solutions": {
        "a ball on the wall is no attractor": without(Case.NR)
    },
    "stationary.slipping_branch.branch": {
        "A_y along SS in closed form 2 % large": answer(fields(A_y=times(1.02))),
        "B_x along SS in closed form 2 % large": answer(fields(B_x=times(1.02))),
    },
    "stationary.slipping_branch.eigenvalues_at": {"eigenvalues of SS 3 % large": scaled(1.03)},
    "mechanics.dynamics.eigenvalues": {"eigenvalues of RR, RS, NR, NS 3 % large": scaled(1.03)},
    "stationary.solutions.eigenmodes_SR": {
        "growth rate of SR 5 % large": scaled(1.05, 0),
        "the eigenmodes of SR exchange their rates": answer(
            lambda modes: (modes[0][::-1], modes[1])
        ),
        "the eigenmodes of SR exchange their directions": answer(
            lambda modes: (modes[0], modes[1][::-1])
        ),
        "eigenmodes of SR in the other order": answer(
            lambda modes: (modes[0][::-1], modes[1][::-1])
        ),
        "first eigenmode of SR mirrored": answer(lambda modes: (modes[0], modes[1] * [1, -1])),
        "first eigenmode of SR at half the slope": answer(
            lambda modes: (modes[0], modes[1] * [1, 0.5])
        ),
    },
    "mechanics.dynamics.jacobian": {
        "Jacobians transposed": answer(lambda matrix: np.swapaxes(matrix, -1, -2))
    },
    "stationary.solutions._rr": {"RR exists at any flow": _exist},
    "stationary.solutions._rs": {
        "RS on a smooth wall takes friction as if j were 1": lambda right, p: [
            replace(s, exists=p.R * s.state.omega_c**2 <= p.mu * p.g) for s in right(p)
        ],
        "RS in a fluid that moves": lambda right, p: right(p.replace(omega_0=0.0)),
    },
    "stationary.solutions._nr": {"NR at any flow": _exist},
    "stationary.slipping_branch.points_at": {
        "SS beyond the fold for that before it": answer(lambda s: s[::-1])
    },
    "stationary.slipping_branch.fold": {
        "the fold a little further along the branch": answer(lambda s: s + 0.5)
    },
    "stationary.slipping_branch.light_drag": {"a slight lag's drag 3 % large": scaled(1.03)},
    # Bifurcations, (84)-(90)
    "bifurcation.diagram.threshold_curves": {
        "ω₀₁ with 1 + μ for 1 + η": _mu_for_eta,
        "ω₀₁ 0.5 % high": answer(entries(omega_01=times(1.005))),
        "ω₀₂ 0.5 % high": answer(entries(omega_02=times(1.005))),
        "ω₀₃ 0.5 % high": answer(entries(omega_03=times(1.005))),
        "ω₀₄ 0.5 % high": answer(entries(omega_04=times(1.005))),
        "ω₀₃ doubled": answer(entries(omega_03=times(2.0))),
        "ω₀₄ doubled": answer(entries(omega_04=times(2.0))),
        "a fold below η_cr": answer(_fold_everywhere),
        "ω₀₄ as under Stokes' drag": given(_by_stokes),
    },
    "bifurcation.diagram.case_map": {
        "regions in which SS ends at ω₀₂": _without(Exists.SS, Exists.NR),
        "regions without SS beyond the fold": _without(Exists.SS_BEYOND_FOLD),
        "regions without SR": _without(Exists.SR),
        "regions in which the ball sinks at any flow": answer(lambda plane: plane | Exists.NS),
        "regions in which RR never ends for η > j": _rolls_for_ever,
        "regions with SS beyond the fold from ω₀₁ on": answer(
            lambda plane: np.where(plane & Exists.SS, plane | Exists.SS_BEYOND_FOLD, plane)
        ),
    },
    "bifurcation.diagram.double_points": {
        "the fold is born at 5 % more η": answer(
            lambda points: [replace(x, eta=1.05 * x.eta) for x in points]
        ),
        "double points at 1 % more flow": answer(
            lambda points: [replace(x, omega_0=1.01 * x.omega_0) for x in points]
        ),
        "for equal friction the fold is born at η_cr of the set": lambda right, p, equal=False: (
            right(p)[:1] + right(p, equal)[1:]
        ),
    },
    "stationary.slipping_branch.eta_critical": {
        "η_cr 4 % high": scaled(1.04),
        "η_cr four times as large": scaled(4.0),
    },
    "bifurcation.diagram.critical_drag": {"drag at which a fold is born 3 % high": scaled(1.03)},
    "bifurcation.diagram.wall_spin": {
        "spin on the wall about the ball's own radius": lambda right, x, p: right(x, p) - x.omega_c,
    },
    "bifurcation.diagram.curves_without_drag": {
        "ω₀₃ without the inertia's root": answer(entries(omega_03=lambda w: w * w))
    },
    "bifurcation.diagram.number_of_folds": {
        "two folds": answer(lambda n: 2 * n),
        "a fold where there is none, none where there is one": answer(lambda n: 1 - n),
    },
    # Stability with respect to slipping, (53)-(83)
    "slipping.slip_stability.gamma": {"γ 3 % large": scaled(1.03)},
    "slipping.slip_stability.slip_rates": {"γ with μ and η exchanged": swapped},
    "slipping.slip_bounds.gamma_nr": {
        "(56) with 3 % more drag": other(c=1.03),
        "(56) with 3 % more wall friction": other(eta=1.03),
        "(56) with sin β of the wrong sign": lambda right, beta, *rest: right(
            -np.asarray(beta), *rest
        ),
    },
    "slipping.slip_bounds.steepest_nr": {"(58) with 5 % more drag": other(c=1.05)},
    "slipping.slip_stability.lift_acceleration": {
        "lift out of RR, SR and SS with 2 % more inertia": other(j=1.02),
        "lift with 2 % more wall friction": other(eta=1.02),
        "a ball lifts twice as fast": scaled(2.0),
    },
    "slipping.slip_stability.lift_onset": {
        "a fluid that leads makes it lift 2 % early": lambda right, inner, outer, x, p: (
            right(inner, outer, x, p) * (0.98 if p.omega_0 > 1.01 * State.of(x).omega_c else 1.0)
        ),
        "lift begins 2 % late": scaled(1.02),
    },
    "slipping.slip_stability.neutral_flow": {"slip is neutral at 1 % more flow": scaled(1.01)},
    "slipping.slip_stability.stability": {
        "RS in a moving fluid with 3 % more inertia": in_case(other(j=1.03), Case.RS),
        "rolling lasts while forces can jam it": _jams,
        "Definitions 1-3 with 1 % more wall friction": other(eta=1.01),
    },
    "slipping.slip_stability._by_sign": {
        "what is driven is held": lambda right, drive, hold: right(hold, drive),
        "nothing is neutral": lambda right, drive, hold: right(drive, hold + 1e-9),
    },
    "slipping.slip_bounds._nr_terms": {"(56)-(59) with 2 % more inertia": other(j=1.02)},
    "slipping.slip_bounds.nr_to_ns": {"(61) with 3 % more wall friction": other(eta=1.03)},
    "slipping.slip_bounds.rr_to_rs": {"(66) with μ, as printed": swapped},
    "slipping.slip_bounds.rr_to_rs_stationary": {
        "(67) with 3 % more wall friction": other(eta=1.03)
    },
    "slipping.slip_bounds.rr_to_sr": {"(73) with 3 % more floor friction": other(mu=1.03)},
    "slipping.slip_bounds.rr_to_sr_stationary": {"(74) with 3 % more inertia": other(j=1.03)},
    "slipping.slip_bounds.filippov_share": {"share of the sheets in (69) 5 % large": scaled(1.05)},
    "slipping.slip_bounds.rr_to_ss": {"(82), (83) with μ and η exchanged": swapped},
    "flowmeter.real_fluid.torque_rate": {"the fluid's torque 2 % strong": scaled(1.02)},
    "mechanics.drag.fall": {"flight with 2 % more drag on the fall": other(c=1.02)},
    # Laws of drag
    "mechanics.drag.sinking_speed": {"(10) 1 % large": scaled(1.01)},
    "mechanics.drag.of_velocity": {"the drag's slope left out of the eigenvalues": answer(np.real)},
    "mechanics.drag.law": {
        "Schiller and Naumann's wake 5 % strong": answer(fields(wake=times(1.05))),
        "quadratic drag 5 % strong": answer(fields(blunt=times(1.05))),
        "Schiller and Naumann's drag at any Reynolds number": answer(
            lambda law: law._replace(blunt=0.0) if law.wake else law
        ),
        "the quadratic law's C_D is always 0.44": given(lambda p: p.replace(C_D=0.44)),
        "C_D = 0.47 beyond Schiller and Naumann": answer(
            lambda law: law._replace(blunt=law.blunt * 0.47 / 0.44) if law.wake else law
        ),
    },
    "mechanics.drag.slope": {"a little more lag brings 3 % more drag": scaled(1.03)},
    "mechanics.drag.speed_of": {"the lag that a force needs 1 % large": scaled(1.01)},
    "mechanics.drag.fall_speed": {"falls with 5 % more drag": other(c=1.05)},
    "mechanics.drag.fall_time": {
        "a fall ends as if nothing braked it": lambda right, y, v_y, p: (
            (v_y + (v_y**2 + 2 * p.g * y) ** 0.5) / p.g
        )
    },
    "mechanics.drag.reynolds": {"Reynolds' number by the radius": scaled(0.5)},
    "mechanics.drag.ramp_lag": {"a fall begins 2 % fast": scaled(1.02)},
    # The flowmeter, section 5.3
    "flowmeter.characteristic.operating_limit": {
        "slip ends the range of every meter": answer(fields(end=lambda end: type(end).SLIP))
    },
    "flowmeter.characteristic.operating_range": {
        "operating range up to ω₀₂": lambda right, p: bifurcation.thresholds(p).omega_02,
    },
    "flowmeter.characteristic.characteristic_slope": {
        "slope of the characteristic 5 % large": scaled(1.05)
    },
    "flowmeter.characteristic.slope_jump": {"the slope jumps by 3 % more": scaled(1.03)},
    "flowmeter.characteristic.unloading_limit": {"unloading 2 % too high": scaled(1.02)},
    "flowmeter.design.choice": {
        "a design takes slip for the end of every range": (
            lambda right, make, values, tolerances, fastest: replace(
                right(make, values, tolerances, fastest),
                margin=bifurcation.thresholds(make(**values)).omega_01,
            )
        ),
        "a design's margin without its tolerances": (
            lambda right, make, values, tolerances, fastest: right(make, values, {}, fastest)
        ),
    },
    "flowmeter.design.corners": {
        "tolerances that only add": lambda right, make, at, tolerances: [
            make(**{**at, **{name: at[name] * (1 + t) for name, t in tolerances.items()}})
        ],
        "tolerances are whole widths": lambda right, make, at, tolerances: right(
            make, at, {name: t / 2 for name, t in tolerances.items()}
        ),
    },
    "flowmeter.design.threshold_spread": {
        "thresholds spread half as far": answer(
            lambda ends: {name: (low, (low + high) / 2) for name, (low, high) in ends.items()}
        )
    },
    "flowmeter.design.readings": {
        "a falling flow is read like a rising one": answer(lambda ends: (ends[0], ends[0])),
        "readings of a design 0.5 % high": answer(lambda ends: (1.005 * ends[0], 1.005 * ends[1])),
    },
    "flowmeter.design.sensitivities": {
        "sensitivities 2 % large": answer(
            lambda all_: {
                key: {name: replace(s, value=1.02 * s.value) for name, s in own.items()}
                for key, own in all_.items()
            }
        )
    },
    "flowmeter.design.response_time": {
        "a design's response as in RS": lambda right, p: (1 + p.j) / p.c
    },
    "stationary.solutions.slowest_time_constant": {
        "the slowest time constant 3 % long": scaled(1.03)
    },
    "flowmeter.characteristic.mean_slope": {"the mean slope 3 % large": scaled(1.03)},
    "flowmeter.characteristic.reading_range": {
        "the reading range ends with rolling": lambda right, p: _rolls_up_to(p)
    },
    "flowmeter.response.peak": {
        "the peak after a jump 3 % late": scaled(1.03, 0),
        "the peak 3 % high": scaled(1.03, 1),
    },
    "flowmeter.pulsation.first_harmonic": {"rolling is ahead of a pulsation": answer(np.conj)},
    # Motions
    "simulation.transitions.collide": {
        "landings rebound by a tenth": lambda right, at, k: right(at, k._replace(restitution=0.1)),
        "landings with 5 % more floor friction": other(mu=1.05),
        "landings on the wall with 5 % more friction": where(
            lambda at: at.x.h == 0, other(eta=1.05)
        ),
    },
    "simulation.transitions.choose": {"after an event μ and η are exchanged": swapped},
    "simulation.coordinates._begin_on_wall": {
        "motions at the wall have 2 % more inertia": other(j=1.02),
        "one contact slips with 3 % more floor friction": in_case(other(mu=1.03), Case.RS, Case.SR),
        "two-point rolling with 5 % more drag": in_case(other(c=1.05), Case.RR),
        "both contacts slip with 3 % more wall friction": in_case(other(eta=1.03), Case.SS),
        "off the floor there is 3 % more drag": in_case(other(c=1.03), Case.NR, Case.NS),
    },
    "simulation.coordinates._begin_off_wall": {
        "rolling off the wall with 5 % more drag": in_case(other(c=1.05), Case.RN),
        "slipping off the wall with 3 % more friction": in_case(other(mu=1.03), Case.SN),
        "flight with 5 % more drag": in_case(other(c=1.05), Case.NN),
        "flight with 1 % less weight": in_case(other(g=0.99), Case.NN),
    },
    "simulation.equations.fluid": {
        "ramps begin with the run": lambda right, t, k: right(
            t, k._replace(line=k.line._replace(start=0.0))
        )
    },
    "simulation.equations.rolls_on": {
        "two-point rolling ends with 5 % more floor friction": other(mu=1.05)
    },
    "mechanics.rolling_forces.margin": {
        "forces admit rolling with 5 % more wall friction": other(eta=1.05)
    },
    "mechanics.rolling_forces.slip_margin": {
        "slip begins with 3 % more floor friction": other(mu=1.03)
    },
    "mechanics.rolling_forces.least_utilisation": {
        "rolling is feasible with 5 % more floor friction": other(mu=1.05)
    },
    "simulation.simulator.simulate": {
        "motions of a ball with 2 % more inertia": other(j=1.02),
        "motions with 2 % more wall friction": other(eta=1.02),
        "rolling goes on while forces allow it": lambda right, *args, **named: right(
            *args, **named | {"leave_rolling": "infeasible"}
        ),
        "a ramp in a fluid with 5 % more drag": _ramped,
    },
    "orbits.periodic.refine": {"hops with 10 % more floor friction": other(mu=1.1)},
    # Unsteady flow
    "flowmeter.response.rolling_rate": {
        "a rolling ball follows the flow at the rate c": lambda right, p: p.c
    },
    "flowmeter.response.transfer": {"response to a pulsation 2 % large": scaled(1.02)},
    "flowmeter.response.step_response": {
        "ringing after a jump in a fluid with 5 % more drag": other(c=1.05)
    },
    # The fluid goes round as the ball does, and its acceleration takes no friction.
    "flowmeter.pulsation._swing": {
        "pulsation takes no friction": answer(lambda swing: (swing[0], swing[0]))
    },
    "flowmeter.pulsation.lag_harmonics": {
        "rolling follows a pulsation as under Stokes' drag": given(_by_stokes)
    },
    "flowmeter.pulsation.slip_onset": {
        "slip begins 3 % late in a pulsation": scaled(1.03),
        "slip begins 3 % early in a pulsation": scaled(0.97),
    },
    "flowmeter.pulsation.slow_onset": {
        "slow pulsations make it slip 0.1 % late": scaled(1.001),
        "a slow pulsation never falls to rest": lambda right, p: _rolls_up_to(p) - abs(p.omega_0),
    },
    "flowmeter.pulsation.mean_error": {
        "mean reading of a pulsation with 2 % more floor friction": other(mu=1.02),
        "a pulsation that makes the wall slip reads low by 1 %": _reads_low,
        "strong pulsations read 5 % less low": lambda right, p, amplitude, *rest: (
            (0.95 if amplitude > 3 * p.omega_0 else 1.0) * right(p, amplitude, *rest)
        ),
    },
}
"""By function of `analytic`, and what is wrong with it."""
_FAULTS_OF_ATTRACTORS: dict[str, dict[str, Fault]] = {
    "orbits.periodic.refine": {
        "a swing with 0.1 % more floor friction": where(lambda p: p.mu > 1, other(mu=1.001)),
        "hops without restitution": lambda right, p, x, period, restitution=0.0: right(
            p, x, period
        ),
        "Floquet multipliers of two periods": answer(
            fields(derivative=lambda derivative: derivative @ derivative)
        ),
    },
    "bifurcation.diagram.thresholds": {
        "hopping begins 1 % late": where(
            lambda p: p == Parameters.named("hopping"), answer(fields(omega_02=times(1.01)))
        )
    },
    "orbits.orbit_branch.follow": {
        "hopping ends 2 % late": answer(
            fields(
                places=lambda places: tuple(
                    replace(each, value=1.02 * each.value) for each in places
                )
            )
        )
    },
    "simulation.simulator.simulate": {
        "strong drag in minutes": where(lambda p: p.kappa > 2, other(c=1 / 60))
    },
}
"""The same, of what is measured from the default level on."""
_FAULTS_FOR_TESTS: dict[str, dict[str, Fault]] = {
    "mechanics.rigid_body.energy": {
        "energy without the spin about the vertical": lambda right, y, u, p: right(
            y, u._replace(o_y=0.0 * u.o_y), p
        )
    },
    "mechanics.rigid_body.slip_at_A": {
        "the lowest point slips as if the centre didn't move inwards": lambda right, u, p: (
            p.r * u.o_z,
            right(u, p)[1],
        )
    },
    "simulation.equations.smooth_rates": {
        "as a case is chosen the axes turn the spin the other way": answer(
            fields(o_x=times(-1.0), o_z=times(-1.0))
        )
    },
    "mechanics.dynamics.newton_euler": {
        "row of ω̃_z of RN 2 % large": in_case(scaled(1.02, 5), Case.RN)
    },
    "stationary.solutions.stationary_solutions": {
        "on a smooth floor the ball lags by 1 %": where(
            lambda p: p.mu == 0, of_case(Case.SR, fields(x=times(0.99, 2)))
        )
    },
    "bifurcation.diagram.inertia_shifts": {
        "the fluid adds all of the displaced mass": lambda right, p: (
            right(p) | {"rolling_rate": 1 / (1 + p.density_ratio / (1 + 2 * p.j)) - 1}
        )
    },
    "stationary.slipping_branch.eta_critical": {
        "η_cr of the quadratic law as under Stokes' drag": lambda right, mu, p: right(
            mu, _by_stokes(p)
        )
    },
    "slipping.slip_stability.slip_rates": {
        "normal forces of floor and wall exchanged": answer(lambda rates: (rates[0], *rates[:0:-1]))
    },
    "bifurcation.diagram.thresholds_with_inertia": {
        "the fluid's inertia leaves j as it is": lambda right, p: {
            name: w / np.sqrt(1 - p.density_ratio)
            for name, w in vars(bifurcation.thresholds(p)).items()
        }
    },
    "flowmeter.real_fluid.rolling": {
        "the fluid's torque takes 2 % more friction": answer(fields(friction=times(1.02))),
    },
    "flowmeter.design.best": {
        "a design takes less friction at the wall than it may": (
            lambda right, make, bounds, *wanted: right(
                make, {**bounds, "eta": (0.05, 0.2)}, *wanted
            )
        )
    },
    "stationary.slipping_branch.hopf_places": {
        "SS begins to swing a little later": answer(
            lambda places: [place + 1e-3 for place in places]
        )
    },
    "simulation.time_stepping.carry_out": {"time stepping with 0.1 % more inertia": other(j=1.001)},
    "simulation.transitions.collide": {
        "rebounds with nine tenths of the restitution": lambda right, at, k: right(
            at, k._replace(restitution=0.9 * k.restitution)
        )
    },
    "flowmeter.response.ramp_coefficient": {"slow ramps pass the fold by 5 % more": scaled(1.05)},
    "flowmeter.pulsation.fast_onset": {
        "fast pulsations make it slip 0.1 % late": scaled(1.001),
        "a fast pulsation never fills both cones": _one_cone,
    },
    "orbits.attractors.lyapunov": {"exponents to the base of ten": scaled(1 / np.log(10), 0, 1)},
    "flowmeter.real_fluid.torque_rate": {
        "the fluid's torque as in creeping flow": lambda right, spin, p, layer=True: right(
            spin, p, False
        ),
        "the fluid's torque as if j were 1": lambda right, spin, p, layer=True: (
            right(spin, p, layer) * (1.0 if p.fluid_torque else p.j)
        ),
    },
}
"""The same, of what no measurement can show."""
_SEEN_BY = {
    "mechanics.rigid_body.energy": "hybrid::test_rolling_follows_any_flow",
    "mechanics.rigid_body.slip_at_A": "choice::test_a_single_rolling_contact_holds_or_gives_way",
    "simulation.equations.smooth_rates": "choice::test_a_single_rolling_contact_holds_or_gives_way",
    "mechanics.dynamics.newton_euler": "dynamics::test_rates_and_forces_at_random_states",
    "stationary.solutions.stationary_solutions": "stationary::test_vanishing_parameters",
    "bifurcation.diagram.inertia_shifts": (
        "bifurcation::test_the_fluid_that_comes_along_slows_the_answer"
    ),
    "stationary.slipping_branch.eta_critical": (
        "closed_forms_with_drag_laws::test_fold_against_a_scan"
    ),
    "slipping.slip_stability.slip_rates": (
        "slip_stability::test_normal_forces_while_a_slip_is_slight"
    ),
    "bifurcation.diagram.thresholds_with_inertia": (
        "other_ways::test_the_inertia_of_the_fluid_shifts_thresholds"
    ),
    "flowmeter.real_fluid.rolling": (
        "other_ways::test_the_least_friction_that_rolls_against_the_torque_of_the_fluid"
    ),
    "flowmeter.design.best": "other_ways::"
    "test_the_best_design_has_a_wall_as_rough_as_the_inertia_and_the_smallest_ball",
    "stationary.slipping_branch.hopf_places": "other_ways::test_the_hopf_point_of_figure_12",
    "simulation.time_stepping.carry_out": "other_ways::test_two_methods_end_in_the_same_state",
    "simulation.transitions.collide": "other_ways::test_two_methods_end_in_the_same_state",
    "flowmeter.response.ramp_coefficient": "other_ways::"
    "test_a_slow_ramp_passes_the_fold_as_its_normal_form_does",
    "flowmeter.pulsation.fast_onset": "other_ways::"
    "test_onsets_of_slip_in_very_slow_and_very_fast_pulsations",
    "orbits.attractors.lyapunov": "orbits::test_lyapunov_exponent_of_a_known_growth",
    "flowmeter.real_fluid.torque_rate": (
        "real_fluid::test_the_torque_is_of_the_order_of_the_drag_for_every_ball"
    ),
}
"""The tests of `analytic` that see them."""


def _listed(
    faults: Mapping[str, Mapping[str, Fault]], level: Level, tests: Mapping[str, str]
) -> list[WrongTheory]:
    return [
        WrongTheory(what, f"analytic.{module}", function, wrong, level, tests.get(name, ""))
        for name, own in faults.items()
        for module, _, function in [name.rpartition(".")]
        for what, wrong in own.items()
    ]


THEORIES = (*_listed(_FAULTS, Level.QUICK, {}), *_listed(_FAULTS_OF_ATTRACTORS, Level.DEFAULT, {}))
FOR_TESTS = (*_listed(_FAULTS_FOR_TESTS, Level.QUICK, _SEEN_BY),)
