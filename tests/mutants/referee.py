"""Wrong theories by a referee, who had read `analytic` and the paper, and neither `theories` nor any claim.

Judged once, before anything was changed: the share that is noticed says more than that of a list claims grew with.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from analytic.mechanics import drag, rolling_forces
from analytic.mechanics.contact_problem import Impulse
from analytic.simulation import two_point_rolling
from analytic.slipping import slip_stability
from analytic.stationary import slipping_branch
from model import Case, State
from model.drag import QUADRATIC, SCHILLER_NAUMANN, STOKES
from tests.mutants.exchange import Fault, Function, WrongTheory, answer, entries, fields, given, scaled, times

Wrong = tuple[str, str, Fault]


def instead(put: Function) -> Fault:
    """Another function, which is given the right one first."""
    return lambda right: lambda *args, **named: put(right, *args, **named)


def of_law(name: str, fault: Fault) -> Fault:
    """The fault shows under one law of drag, that of the parameters given last."""
    return instead(lambda right, *args: (fault(right) if args[-1].drag == name else right)(*args))


# --- mechanics ---


def _by_largest_term(right: Function, acceleration: Any, p: Any) -> Any:
    given, powers = np.asarray(acceleration, dtype=float), (1.0, 1.0 + drag.EXPONENT, 2.0)
    alone = [(given / term) ** (1 / n) for term, n in zip(drag.law(p), powers, strict=True) if term > 0]
    return np.minimum.reduce(alone) if alone else right(acceleration, p)


def _fall_without_its_drag(right: Function, t: Any, y: float, v_y: float, p: Any) -> Any:
    return y + v_y * t - p.g * t**2 * drag.ramp_lag(p.c * t), drag.fall_speed(t, v_y, p)


def _rs_floor(right: Function, x: Any, p: Any, omega_0: Any, slip_B: Any) -> Any:
    f, lag = right(x, p, omega_0, slip_B), x[2] - omega_0
    return f._replace(A_z=p.j * p.m * p.R * drag.of_velocity(0.0, 0.0, p.R * lag, p) * lag / (1 + p.j))


def _sr_without_slip(right: Function, x: Any, p: Any, omega_0: Any, slip_A: Any) -> Any:
    return right((*x[:3], 0.0, *x[4:]), p, omega_0, slip_A)


def _ss_uncoupled(right: Function, x: Any, p: Any, omega_0: Any, slip_A: Any, slip_B: Any) -> Any:
    f, B_x, (s, c) = right(x, p, omega_0, slip_A, slip_B), p.m * p.R * x[2] ** 2, slip_B
    return f._replace(B_x=B_x, B_y=p.eta * B_x * c, B_z=-p.eta * B_x * s)


def _nr_without_drag(right: Function, x: Any, p: Any, omega_0: Any) -> Any:
    B_y = p.j * p.m * (p.g + p.R * x[2] ** 2 + p.r * x[2] * x[3]) / (1 + p.j)
    return right(x, p, omega_0)._replace(B_y=B_y)


def _single_coriolis(right: Function, case: Case, x: Any, f: Any, p: Any, omega_0: Any) -> Any:
    rate = right(case, x, f, p, omega_0)
    return rate._replace(omega_c=rate.omega_c - x[7] * x[2] / (p.R - x[6]))


def _sinking_keeps_spin(right: Function, case: Case, x: Any, f: Any, p: Any, omega_0: Any) -> Any:
    rate = right(case, x, f, p, omega_0)
    return rate._replace(slip_z=rate.slip_z + rate.v_y / p.r) if case is Case.NS else rate


def _by_fluid_speed(right: Function, omega_c: Any, p: Any, omega_0: Any, B_y: Any) -> Any:
    f, c = right(omega_c, p, omega_0, B_y), drag.of_velocity(0.0, 0.0, p.R * np.real(omega_0), p)
    z = p.j * p.m * p.R * c * (omega_c - omega_0) / (1 + 2 * p.j)
    return f._replace(A_z=z, B_z=z)


def _without_overlap(right: Function, omega_c: Any, p: Any, omega_0: Any = None) -> Any:
    u, z = rolling_forces._loads(omega_c, p, omega_0)
    pairs = (1 - p.j * u, p.mu), ((1 + p.j) * u, p.eta)
    return np.minimum(*(f * np.hypot(d, z) - np.where(d >= 0, z, np.hypot(d, z)) for d, f in pairs))


def _wall_without_gyroscope(right: Function, omega_c: Any, p: Any, omega_0: Any = None) -> Any:
    u, z = rolling_forces._loads(omega_c, p, omega_0)
    return np.minimum(right(omega_c, p, omega_0), p.eta * u - z)


def _idle_wall(right: Function, omega_c: Any, p: Any, omega_0: Any = None) -> Any:
    u, z = rolling_forces._loads(omega_c, p, omega_0)
    return np.minimum(p.eta * (1 + p.j) * u - z, p.mu - np.hypot(p.j * u, z))


def _all_share(right: Function, u: Any, z: Any, p: Any) -> Any:
    k = (1 + p.j) * u
    return np.maximum(k - rolling_forces._normal_forces(k, z, p.eta)[0], 0.0)


def _square(right: Function, need: Impulse, friction: Any) -> Any:
    given = right(need, friction)
    if need.n <= 0 or friction.s != 0 or friction.t != 0:
        return given
    limit = friction.coefficient * need.n
    return Impulse(need.n, *(min(max(part, -limit), limit) for part in (need.s, need.t)))


_MECHANICS: dict[str, list[Wrong]] = {
    "analytic.mechanics.drag": [
        ("the drag's speed without the vertical velocity", "speed", instead(lambda f, h, y, k: f(h, 0.0 * y, k))),
        ("the slope of the quadratic drag is c, not 2 c", "slope", of_law(QUADRATIC, scaled(0.5))),
        (
            "Reynolds' number of Schiller and Naumann's law by the radius",
            "law",
            of_law(SCHILLER_NAUMANN, answer(fields(wake=times(0.5**0.687), blunt=times(0.5)))),
        ),
        (
            "a sinking sphere without buoyancy",
            "sinking_speed",
            instead(lambda f, **at: f(**at) * at["rho_b"] / (at["rho_b"] - at["rho_f"])),
        ),
        ("the drag of the first speed left out of the height of a fall", "fall", instead(_fall_without_its_drag)),
        ("the lag behind a ramp 1 % too great", "ramp_lag", scaled(1.01)),
        ("the speed of a drag by its largest term alone", "speed_of", instead(_by_largest_term)),
    ],
    "analytic.mechanics.rigid_body": [
        (
            "the slip at the wall without the fall of the centre",
            "slip_at_B",
            instead(lambda f, u, p: (f(u, p)[0] - u.v_y, f(u, p)[1])),
        ),
    ],
    "analytic.mechanics.dynamics": [
        ("friction at the floor in RS without that at the wall", "_rs", instead(_rs_floor)),
        ("the wall's share of the weight in SR without slip_x", "_sr", instead(_sr_without_slip)),
        ("the wall of SS doesn't feel the floor's friction", "_ss", instead(_ss_uncoupled)),
        ("the wall of NR doesn't feel the drag of v_y", "_nr", instead(_nr_without_drag)),
        ("no radial friction in RN", "_rn", answer(fields(A_x=times(0.0)))),
        ("Coriolis' force once instead of twice", "newton_euler", instead(_single_coriolis)),
        ("slip_z of NS without the change of v_y", "newton_euler", instead(_sinking_keeps_spin)),
        ("rows and columns of the Jacobian exchanged", "jacobian", answer(lambda J: np.swapaxes(J, -1, -2))),
        ("friction in RR by the drag of the fluid's speed", "rolling_family", instead(_by_fluid_speed)),
    ],
    "analytic.mechanics.rolling_forces": [
        ("RR lasts while either cone alone can hold it", "margin", instead(_without_overlap)),
        ("the wall's friction in RR without 1 + j", "slip_margin", instead(_wall_without_gyroscope)),
        ("the wall of RR carries none of the weight as slip sets in", "slip_margin", instead(_idle_wall)),
        ("the wall of RR carries all that its cone allows", "_last_share", instead(_all_share)),
    ],
    "analytic.mechanics.contact_problem": [
        ("friction in a square instead of a disk", "project", instead(_square)),
        (
            "1/(1+2j) for 1/(1+j) where floor and wall feel each other",
            "_less",
            instead(lambda f, a, other, k: f(a, other, 1 / (2 / k - 1))),
        ),
    ],
}

# --- stationary ---


def _each(change: Function) -> Fault:
    """Every solution of a list changed, given the parameters."""
    return instead(lambda right, p, *rest: [change(s, p) for s in right(p, *rest)])


def _with(x: Any, **values: float) -> Any:
    return State.of(x)._replace(**values).stacked()


def _smooth_rs(s: Any, p: Any) -> Any:
    return replace(s, exists=p.R * s.state.omega_c**2 <= p.mu * p.g)


def _smooth_sr(s: Any, p: Any) -> Any:
    return replace(s, x=_with(s.x, slip_x=-s.state.slip_x)) if p.mu == 0 else s


def _ns_by_stokes(s: Any, p: Any) -> Any:
    v_y = -(p.g - p.eta * p.R * p.omega_0**2) / p.c
    return replace(s, x=_with(s.x, v_y=v_y, slip_z=-v_y / p.r))


def _mirrored_slip_z(s: Any, p: Any) -> Any:
    return replace(s, x=_with(s.x, slip_z=-s.state.slip_z)) if p.omega_0 < 0 else s


_STATIONARY: dict[str, list[Wrong]] = {
    "analytic.stationary.solutions": [
        ("RS on a smooth wall: the floor's limit without j", "_rs", _each(_smooth_rs)),
        ("SR on a smooth floor spins the other way", "_sr", _each(_smooth_sr)),
        ("NR begins at omega_03", "_nr", _each(lambda s, p: replace(s, exists=p.j * p.Omega_0**2 >= 1))),
        (
            "a ball that sinks doesn't roll about the radius",
            "_ns",
            _each(lambda s, p: replace(s, x=_with(s.x, slip_x=-p.omega_0 * p.R / p.r))),
        ),
        ("a ball sinks by Stokes' law under every law", "_ns", _each(_ns_by_stokes)),
        ("slip_z mirrored where omega_0 < 0", "stationary_solutions", _each(_mirrored_slip_z)),
        ("a ball that sinks counts as stable", "stable_solutions", instead(lambda f, p, sinking=False: f(p, True))),
        ("modes of leaning and orbit exchanged", "leaning_modes", answer(lambda m: (m[0][::-1], m[1][::-1]))),
        (
            "the quickest disturbance for the slowest",
            "slowest_time_constant",
            instead(lambda f, of: 1 / float(np.max(-of.eigenvalues.real)) if np.isfinite(f(of)) else f(of)),
        ),
    ],
    "analytic.stationary.slipping_branch": [
        (
            "B_x of SS without j cos^2",
            "branch",
            instead(lambda f, s, p, *rest: (b := f(s, p, *rest)) and replace(b, B_x=b.B_x / (1 + p.j * b.cos**2))),
        ),
        (
            "the lag of SS 1 % too great",
            "branch",
            answer(lambda b: replace(b, Omega_0=b.Omega_c + 1.01 * (b.Omega_0 - b.Omega_c))),
        ),
        (
            "the stiffness of SS by the drag of no lag",
            "branch",
            instead(
                lambda f, s, p, *rest: (
                    (b := f(s, p, *rest)) and replace(b, stiffness=0 * b.cos + slipping_branch.light_drag(p))
                )
            ),
        ),
        (
            "the slope of SS without that of the orbit in its divisor",
            "characteristic_slope",
            instead(lambda f, s, p: np.divide(*slipping_branch._slopes(s, p))),
        ),
        ("no second point of SS beyond the fold", "points_at", answer(lambda places: places[:1])),
    ],
}

# --- slipping ---


def _alike_for_all(right: Function, case: Case, p: Any, omega_c: Any = None) -> Any:
    if case is not Case.RR or p.eta < p.j:
        return right(case, p, omega_c)
    Omega2 = p.R / p.g * (p.omega_0 if omega_c is None else omega_c) ** 2
    return slip_stability._sign(Omega2 * (p.mu * p.eta * (1 + p.j) + p.j - p.eta), p.mu * (1 + p.eta))


def _rs_without_j(right: Function, case: Case, p: Any, omega_c: Any = None) -> Any:
    if case is not Case.RS:
        return right(case, p, omega_c)
    return slip_stability._sign(p.R / p.g * (p.omega_0 if omega_c is None else omega_c) ** 2, p.mu)


_SLIPPING: dict[str, list[Wrong]] = {
    "analytic.slipping.slip_bounds": [
        ("(73) for the other side", "rr_to_sr", instead(lambda f, p, omega_c, side: f(p, omega_c, -side))),
        (
            "(83) without the sign of eta in its offset",
            "rr_to_ss",
            instead(lambda f, p, side=1: replace(b := f(p, side), offset=b.offset * (1 + p.eta) / (1 + side * p.eta))),
        ),
        ("the sides of Filippov's combination exchanged", "filippov_share", answer(lambda share: 1 - share)),
        ("sine and cosine of (58) exchanged", "steepest_nr", answer(lambda beta: math.pi / 2 - beta)),
        ("friction in (56) without 1/j", "_nr_terms", instead(lambda f, x, p: times(p.j, 2)(f(x, p)))),
    ],
    "analytic.slipping.slip_stability": [
        ("(82) ends RR for eta > j, too", "stability", instead(_alike_for_all)),
        ("RS holds by its floor without j", "stability", instead(_rs_without_j)),
        ("a ball lifts twice as fast", "lift_acceleration", scaled(2.0)),
        ("normal forces of floor and wall exchanged", "slip_rates", answer(lambda rates: (rates[0], *rates[:0:-1]))),
    ],
}

# --- bifurcation ---


def _beyond_fold_from_rr(right: Function, p: Any, mu: Any, eta: Any, omega_0: Any) -> Any:
    plane = right(p, mu, eta, omega_0)
    return np.where(plane & 2, plane | 4, plane)


def _inertia_without_g(right: Function, p: Any) -> Any:
    return {name: value * math.sqrt(1 - p.density_ratio) for name, value in right(p).items()}


_BIFURCATION: dict[str, list[Wrong]] = {
    "analytic.bifurcation.diagram": [
        ("omega_03 half a per cent too low", "curves_without_drag", answer(entries(omega_03=times(0.995)))),
        (
            "eta_cr for equal friction is that for one mu",
            "double_points",
            instead(lambda f, p, equal=False: [*f(p)[:-1], f(p, equal)[-1]]),
        ),
        ("the unstable SS from omega_01 on", "case_map", instead(_beyond_fold_from_rr)),
        (
            "the spin on the wall by the rolling of the floor",
            "wall_spin",
            instead(lambda f, state, p: 2 * state.slip_x - f(state, p)),
        ),
        ("the fluid's inertia leaves the weight as it is", "thresholds_with_inertia", instead(_inertia_without_g)),
        (
            "added mass by 1 + j",
            "inertia_shifts",
            instead(lambda f, p: f(p) | {"rolling_rate": (1 + p.j) / (1 + p.j + p.density_ratio / 2) - 1}),
        ),
    ],
}

# --- flowmeter ---


def _mean_slope_to_fold(right: Function, p: Any) -> Any:
    turn = slipping_branch.fold(p)
    if np.isnan(turn):
        return right(p)
    b, start = slipping_branch.branch(turn, p), slipping_branch.branch(-slipping_branch.END, p)
    return float((b.Omega_c - start.Omega_c) / (b.Omega_0 - start.Omega_0))


def _one_reading(right: Function, p: Any, omega_0: Any) -> Any:
    low, _ = right(p, omega_0)
    return low, low


def _follows_like_rolling(right: Function, p: Any, case: Any, t: Any) -> Any:
    return -np.expm1(-p.c / (1 + 2 * p.j) * np.asarray(t))


def _layer_alone(right: Function, spin: Any, p: Any, layer: bool = True) -> Any:
    if p.fluid_torque or not p.nu_f or not layer:
        return right(spin, p, layer)
    stokes = right(spin, p, False)
    return stokes * np.maximum(1.0, 6.45 * np.sqrt(spin * p.r**2 / p.nu_f) / (16 * math.pi))


def _fluid_without_spin(right: Function, p: Any, layer: bool = True) -> Any:
    found = right(p, layer)
    if not (p.fluid_torque and p.drag == STOKES and p.c):
        return found
    omega_c = p.omega_0 / (1 + 2 * p.j * p.fluid_torque / p.c)
    return replace(found, omega_c=omega_c, shift=omega_c / p.omega_0 - 1)


_FLOWMETER: dict[str, list[Wrong]] = {
    "analytic.flowmeter.characteristic": [
        (
            "the range ends at omega_03 for eta > j",
            "operating_limit",
            instead(
                lambda f, p: (
                    replace(f(p), omega_0=math.sqrt(p.g / (p.j * p.R))) if p.eta >= p.j and p.c and p.mu else f(p)
                )
            ),
        ),
        (
            "the ball reads the flow up to omega_02",
            "reading_range",
            instead(lambda f, p: math.sqrt(p.g / (p.eta * p.R)) if p.c and p.mu and 0 < p.eta < p.j else f(p)),
        ),
        ("the mean slope is that up to the fold", "mean_slope", instead(_mean_slope_to_fold)),
        ("the wall drops the ball 1 % later", "unloading_limit", scaled(0.99)),
    ],
    "analytic.flowmeter.design": [
        ("no hysteresis: the reading of a falling flow is that of a rising one", "readings", instead(_one_reading)),
        (
            "the ball answers within (1 + j)/c",
            "response_time",
            instead(lambda f, p: f(p) * (1 + p.j) / (1 + 2 * p.j)),
        ),
    ],
    "analytic.flowmeter.pulsation": [
        ("a rolling ball leads a pulsation", "lag_harmonics", answer(lambda lag: -np.conj(lag))),
        (
            "1 + j for 1 + 2j in a pulsation",
            "lag_harmonics",
            given(lambda p: p.replace(c=p.c * (1 + 2 * p.j) / (1 + p.j))),
        ),
        (
            "a slow pulsation rolls up to omega_02",
            "slow_onset",
            instead(lambda f, p: max(0.0, min(math.sqrt(p.g / (p.eta * p.R)) - abs(p.omega_0), abs(p.omega_0)))),
        ),
        (
            "in a fast pulsation only the wall slips",
            "fast_onset",
            instead(
                lambda f, p: float(drag.speed_of(p.eta * (1 + p.j) * (1 + 2 * p.j) * p.R * p.omega_0**2 / p.j, p) / p.R)
            ),
        ),
    ],
    "analytic.flowmeter.response": [
        ("a small pulsation is led, not followed", "transfer", answer(np.conj)),
        ("every motion answers a jump as RR does", "step_response", instead(_follows_like_rolling)),
        (
            "the ramp past the fold by the zero of the derivative of Ai",
            "ramp_coefficient",
            scaled(1.018792971647471 / 2.338107410459767),
        ),
    ],
    "analytic.flowmeter.real_fluid": [
        ("the torque of the boundary layer without its second term", "torque_rate", instead(_layer_alone)),
        ("the fluid's torque as if the fluid didn't turn", "rolling", instead(_fluid_without_spin)),
    ],
}

# --- orbits ---

_ORBITS: dict[str, list[Wrong]] = {
    "analytic.orbits.periodic": [
        (
            "a departure from the floor counts as a landing",
            "landings",
            instead(lambda f, changes: f([(b, a) for a, b in changes])),
        ),
        ("disturbances of two periods for those of one", "close", answer(fields(derivative=lambda d: d @ d))),
    ],
    "analytic.orbits.fates": [
        ("exponents to the base of ten", "lyapunov", scaled(1 / math.log(10), 0, 1)),
    ],
}

# --- simulation ---


def _turned(right: Function, case: int, at: Any, k: Any) -> Any:
    alpha, beta = right(case, at, k)
    return alpha + math.pi, beta + math.pi


def _transient_of_waves(right: Function, t: Any, at: Any, p: Any, omega_0: Any) -> Any:
    k = p.c / (1 + 2 * p.j)
    return right(t, at, p, omega_0) + two_point_rolling._forced(at.time, k, omega_0) * (np.exp(-k * (t - at.time)) - 1)


def _waves_in_phase(right: Function, t: Any, k: float, omega_0: Any) -> Any:
    swing = 0.0 * t
    for amplitude, omega, phase in omega_0.waves:
        swing = swing + amplitude * k / math.hypot(k, omega) * np.sin(omega * t + phase)
    return swing


def _torque_of(factor: float) -> Fault:
    return answer(lambda given: (*given[:-1], given[-1]._replace(k=factor * given[-1].k)))


def _ss_floor(right: Function, case: int, *args: Any) -> Any:
    f, k = right(case, *args), args[-1]
    if case != Case.SS:
        return f
    G, s_A, c_A = k.m * k.g, args[5], args[6]
    return (-k.mu * G * c_A, G, k.mu * G * s_A, *f[3:])


def _rolls_like_sliding(right: Function, t: float, z: Any, k: Any, out: Any) -> Any:
    right(t, z, k, out)
    if k.case == Case.RN:
        out[2], out[3] = out[2] * (1 + k.j), out[3] * (1 + k.j)


_SIMULATION: dict[str, list[Wrong]] = {
    "analytic.simulation.transitions": [
        ("slip sets in along the friction", "_held", instead(_turned)),
        (
            "e is the share of the energy",
            "collide",
            instead(lambda f, at, k: f(at, k._replace(restitution=math.sqrt(k.restitution)))),
        ),
        ("no friction while the ball lands", "collide", instead(lambda f, at, k: f(at, k._replace(mu=0.0, eta=0.0)))),
    ],
    "analytic.simulation.two_point_rolling": [
        ("the transient of waves doesn't die out", "omega_c", instead(_transient_of_waves)),
        ("waves are followed without a lag", "_forced", instead(_waves_in_phase)),
        ("RR lasts for ever", "end", instead(lambda f, *args: None)),
    ],
    "analytic.simulation.time_stepping": [
        ("the fluid's torque 5 % too great", "prepared", _torque_of(1.05)),
    ],
    "analytic.simulation.hybrid": [
        ("a jump of the flow ends no case", "pieces", answer(lambda rows: [[*row[:-1], 0.0] for row in rows])),
    ],
}

_COMPILED: dict[str, list[Wrong]] = {
    "analytic.simulation.equations": [
        ("the floor of SS carries all of the weight", "forces", instead(_ss_floor)),
        ("a ball that rolls away from the wall goes like one that slides", "_rates_away", instead(_rolls_like_sliding)),
    ],
}
"""Within stretches of one case numba's form of these is used: to be believed with NUMBA_DISABLE_JIT=1 alone."""


def _listed(*parts: dict[str, list[Wrong]]) -> list[WrongTheory]:
    return [
        WrongTheory(what, module, function, wrong)
        for part in parts
        for module, rows in part.items()
        for what, function, wrong in rows
    ]


COMPILED = _listed(_COMPILED)
THEORIES = [
    *_listed(_MECHANICS, _STATIONARY, _SLIPPING, _BIFURCATION, _FLOWMETER, _ORBITS, _SIMULATION),
    *COMPILED,
]
