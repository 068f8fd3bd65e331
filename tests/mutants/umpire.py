"""Wrong theories by a second referee, who had read the paper, `analytic` and `model`, the form of the first one's list,
and neither claims nor `theories`, tests or what the first one's list missed.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from analytic.bifurcation import diagram
from analytic.flowmeter.real_fluid import Rolling
from analytic.flowmeter.response import AIRY_ZERO
from analytic.mechanics import drag, dynamics, rigid_body, rolling_forces, roots
from analytic.mechanics.contact_problem import Friction
from analytic.mechanics.rigid_body import Forces, Velocities
from analytic.mechanics.rolling_forces import LeastUtilisation
from analytic.orbits import fates
from analytic.simulation import equations
from analytic.slipping import slip_bounds, slip_stability
from analytic.slipping.slip_stability import SlipStability
from analytic.stationary import slipping_branch
from model import Case, Contact, State
from model.cases import TRAITS
from model.drag import QUADRATIC, SCHILLER_NAUMANN, STOKES
from model.kinematics import VARIABLES, state_units
from tests.mutants.exchange import Fault, Function, WrongTheory, answer, fields, scaled, times

Wrong = tuple[str, str, Fault]


def instead(put: Function) -> Fault:
    """Another function, which is given the right one first."""
    return lambda right: lambda *args, **named: put(right, *args, **named)


# --- mechanics ---


def _law(right: Function, p: Any) -> drag.Law:
    found = right(p)
    return found._replace(blunt=found.blunt * 0.4 / 0.44) if p.drag == SCHILLER_NAUMANN else found


def _rs(right: Function, x: Any, p: Any, omega_0: Any, slip_B: Any) -> Forces:
    u, (sine, _) = p.m * p.R * x[2] ** 2, slip_B
    B_z = -p.eta * u * sine
    A_z = p.j * (p.m * p.R * dynamics._drag(x, p, omega_0) * (x[2] - omega_0) - B_z) / (1 + p.j)
    return Forces(0.0 * u, p.m * p.g, A_z, u, 0.0, B_z)


def _ss(right: Function, x: Any, p: Any, omega_0: Any, slip_A: Any, slip_B: Any) -> Forces:
    f, coupling = right(x, p, omega_0, slip_A, slip_B), p.mu * p.eta * slip_A[1] * slip_B[1]
    return Forces(*(each * (1 + coupling) / (1 - coupling) for each in f))


def _orbit_of_R(right: Function, case: Case, x: Any, f: Any, p: Any, omega_0: Any) -> State:
    rate = right(case, x, f, p, omega_0)
    if case.B is not Contact.N:
        return rate
    more = x[6] * x[2] ** 2
    slip_z = rate.slip_z + more / p.r if case is Case.RN else rate.slip_z
    return rate._replace(v_h=rate.v_h - more, slip_z=slip_z)


def _axis_not_turned_by_fall(right: Function, case: Case, x: Any, f: Any, p: Any, omega_0: Any) -> State:
    rate = right(case, x, f, p, omega_0)
    return rate._replace(slip_x=rate.slip_x + x[2] * x[1] / p.r) if "slip_x" in TRAITS[case].active else rate


def _slip_turned_back(right: Function, case: Case, x: Any, f: Any, p: Any, omega_0: Any) -> State:
    rate = right(case, x, f, p, omega_0)
    turns = "slip_z" in TRAITS[case].active
    return rate._replace(slip_z=rate.slip_z - 2 * x[2] * x[3]) if turns else rate


def _moment_turned_round(right: Function, omega_c: Any, p: Any, omega_0: Any, B_y: Any) -> Forces:
    u = p.m * p.R * omega_c**2
    return right(omega_c, p, omega_0, B_y)._replace(A_x=B_y + p.j * u, B_x=(1 - p.j) * u - B_y)


def _like_one_contact(right: Function, omega_c: Any, p: Any, omega_0: Any, B_y: Any) -> Forces:
    f, factor = right(omega_c, p, omega_0, B_y), (1 + 2 * p.j) / (1 + p.j)
    return f._replace(A_z=f.A_z * factor, B_z=f.B_z * factor)


def _frozen_drag(right: Function, case: Case, x: Any, p: Any) -> Any:
    if p.drag == STOKES or np.ndim(x) > 1:
        return right(case, x, p)
    c = float(dynamics._drag(State.of(x), p, p.omega_0))
    return right(case, x, p.replace(drag=STOKES, c=c))


def _idle_wall(right: Function, omega_c: Any, p: Any, omega_0: Any = None) -> LeastUtilisation:
    u, z = np.broadcast_arrays(*rolling_forces._loads(omega_c, p, omega_0))
    at_A = rolling_forces._ratio(np.hypot(p.j * u, z), np.full_like(u, p.mu))
    at_B = rolling_forces._ratio(z, p.eta * (1 + p.j) * u)
    return LeastUtilisation(0.0 * u, np.maximum(at_A, at_B))


def _floor_without_drag(right: Function, omega_c: Any, p: Any, omega_0: Any = None) -> Any:
    u, z = rolling_forces._loads(omega_c, p, omega_0)
    share = rolling_forces._last_share(u, z, p)
    return np.minimum(p.eta * (1 + p.j) * u - z, p.mu * (1 - share) - np.abs(p.j * u - share))


_MECHANICS: dict[str, list[Wrong]] = {
    "analytic.mechanics.drag": [
        ("a blunt sphere has C_D = 0.4 in Schiller and Naumann's law", "law", instead(_law)),
        (
            "the quadratic law with C_D = 0.47, whatever is given",
            "law",
            instead(lambda f, p: f(p.replace(C_D=0.47) if p.drag == QUADRATIC else p)),
        ),
        (
            "Schiller and Naumann's drag and that of a constant C_D added up",
            "rate",
            instead(lambda f, w, law: law.linear + law.wake * w**drag.EXPONENT + law.blunt * w),
        ),
        (
            "a flight ends as if nothing braked it",
            "fall_time",
            instead(lambda f, y, v_y, p: (v_y + math.sqrt(v_y**2 + 2 * p.g * y)) / p.g),
        ),
        (
            "a fall keeps the acceleration of its start",
            "fall_speed",
            instead(lambda f, t, v_y, p: v_y - (p.c * v_y + p.g) * t),
        ),
        ("Reynolds' number by the radius", "reynolds", scaled(0.5)),
    ],
    "analytic.mechanics.rigid_body": [
        (
            "energy without the spin about the vertical",
            "energy",
            instead(lambda f, y, u, p: f(y, u._replace(o_y=0.0 * u.o_y), p)),
        ),
        (
            "the lowest point slips as if the centre didn't move inwards",
            "slip_at_A",
            instead(lambda f, u, p: (p.r * u.o_z, f(u, p)[1])),
        ),
        (
            "the wall's friction turns the ball the other way about the vertical",
            "apply",
            instead(lambda f, u, P, p: f(u, P, p)._replace(o_y=u[4] - P[5] / (p.j * p.m * p.r))),
        ),
    ],
    "analytic.mechanics.dynamics": [
        ("the spin axis of RS needs no moment to turn with the orbit", "_rs", instead(_rs)),
        (
            "the wall of SR bears the gyroscopic moment as in RR",
            "_sr",
            instead(lambda f, x, p, *rest: (F := f(x, p, *rest))._replace(B_x=(1 + p.j) * F.B_x)),
        ),
        ("1 - mu eta for 1 + mu eta in SS", "_ss", instead(_ss)),
        (
            "the wall's friction on a ball that sinks acts along the axis alone",
            "_ns",
            answer(fields(B_z=times(0.0))),
        ),
        (
            "1 + 2j for 1 + j in the friction along the orbit of NR",
            "_nr",
            instead(lambda f, x, p, *rest: (F := f(x, p, *rest))._replace(B_z=F.B_z * (1 + p.j) / (1 + 2 * p.j))),
        ),
        (
            "a ball that rolls on the floor alone rolls like one in the corner",
            "_rn",
            instead(lambda f, x, p, *rest: Forces(*times((1 + p.j) / (1 + 2 * p.j), 0, 2)(tuple(f(x, p, *rest))))),
        ),
        ("the centrifugal force of a ball away from the wall by R", "newton_euler", instead(_orbit_of_R)),
        ("(5) without omega_c v_y/r", "newton_euler", instead(_axis_not_turned_by_fall)),
        ("(5) with + omega_c slip_x", "newton_euler", instead(_slip_turned_back)),
        ("the gyroscopic moment of RR with the other sign", "rolling_family", instead(_moment_turned_round)),
        ("friction in RR as at one contact, by 1 + j", "rolling_family", instead(_like_one_contact)),
        ("the Jacobian with the drag's coefficient held", "jacobian", instead(_frozen_drag)),
    ],
    "analytic.mechanics.rolling_forces": [
        ("the wall bears none of the weight in RR", "least_utilisation", instead(_idle_wall)),
        ("drag takes none of the floor's friction as RR ends", "slip_margin", instead(_floor_without_drag)),
    ],
    "analytic.mechanics.contact_problem": [
        (
            "friction at one contact relieves the other instead of loading it",
            "_less",
            instead(lambda f, a, other, k: f(a, other, k)._replace(n=a.n + other.s)),
        ),
        (
            "friction opposes what would slip, not what slips",
            "project",
            instead(lambda f, need, friction: f(need, Friction(friction.coefficient, 0.0, 0.0))),
        ),
    ],
}

# --- stationary ---


def _each(change: Function) -> Fault:
    """Every solution of a list changed, given the parameters."""
    return instead(lambda right, p, *rest: [change(s, p) for s in right(p, *rest)])


def _with(x: Any, **values: float) -> Any:
    return State.of(x)._replace(**values).stacked()


def _free_fall(s: Any, p: Any) -> Any:
    v_y = -float(drag.speed_of(p.g, p))
    return replace(s, x=_with(s.x, v_y=v_y, slip_z=-v_y / p.r))


def _mirrored(right: Function, *args: Any) -> tuple[Any, Any]:
    x, flows = right(*args)
    return np.where(np.arange(8) == VARIABLES.index("slip_x"), -x, x), flows


def _orbit_of_rr(right: Function, s: Any, p: Any, mu: Any = None, eta: Any = None) -> Any:
    b, (_, wall) = right(s, p, mu, eta), slipping_branch._friction(p, mu, eta)
    Omega_c = b.Omega_c * np.sqrt((1 + wall) / (1 + wall * b.cos**2))
    return replace(b, Omega_c=Omega_c, Omega_0=b.Omega_0 - b.Omega_c + Omega_c)


_STATIONARY: dict[str, list[Wrong]] = {
    "analytic.stationary.solutions": [
        (
            "the spin that carries the weight with the sign of rolling turned round",
            "_lifting_spin",
            instead(lambda f, p: p.g / (p.j * p.omega_0 * p.r) + p.omega_0 * p.R / p.r),
        ),
        (
            "SR up to omega_02, as (35) is printed",
            "_sr",
            _each(lambda s, p: replace(s, exists=p.eta * p.Omega_0**2 <= 1) if p.mu else s),
        ),
        ("RR whatever friction it takes", "_rr", _each(lambda s, p: replace(s, exists=True))),
        ("a ball sinks by its weight, unbraked by the wall", "_ns", _each(_free_fall)),
        ("a half-life for a time constant", "slowest_time_constant", scaled(math.log(2))),
    ],
    "analytic.stationary.slipping_branch": [
        ("SS leans the other way", "states", instead(_mirrored)),
        (
            "(39) without j",
            "branch",
            instead(lambda f, s, p, *rest: (b := f(s, p, *rest)) and replace(b, v_A=p.j * b.v_A)),
        ),
        ("(38) with 1 + eta for 1 + eta cos^2", "branch", instead(_orbit_of_rr)),
        ("(87) without the 4", "eta_critical", scaled(4.0)),
    ],
}

# --- slipping ---


def _with_friction_of_floor(right: Function, case: Case, p: Any, omega_c: Any = None) -> SlipStability:
    return right(case, p.replace(eta=p.mu) if case in (Case.SR, Case.NR) else p, omega_c)


def _rough_walls_never_slip(right: Function, case: Case, p: Any, omega_c: Any = None) -> SlipStability:
    return SlipStability.STABLE if case is Case.RR and p.eta >= p.j else right(case, p, omega_c)


def _onset_of_one_spin(right: Function, inner: Case, outer: Case, x: Any, p: Any) -> float:
    state = dynamics.check_state(inner, x, p)

    def rise(omega_c: float) -> float:
        there = state._replace(omega_c=omega_c)
        flow = p.replace(omega_0=p.omega_0 * omega_c / state.omega_c)
        return slip_stability.lift_acceleration(inner, outer, there, flow)

    return float(roots.crossing(np.vectorize(rise), 0.1 * state.omega_c, 10 * state.omega_c))


_SLIPPING: dict[str, list[Wrong]] = {
    "analytic.slipping.slip_bounds": [
        (
            "(66) with mu, as it is printed",
            "rr_to_rs",
            instead(
                lambda f, p, omega_c, side: replace(
                    f(p, omega_c, side), hold=p.mu * (1 + 2 * p.j) * p.R * omega_c**2 / (p.j * p.r)
                )
            ),
        ),
        (
            "(73) with g + j R omega_c^2",
            "rr_to_sr",
            instead(
                lambda f, p, omega_c, side: replace(
                    f(p, omega_c, side),
                    hold=p.mu * (1 + 2 * p.j) * (p.g + p.j * p.R * omega_c**2) / (p.j * (1 + p.j) * p.r),
                )
            ),
        ),
        (
            "(60) without 1 + j",
            "nr_to_ns",
            instead(
                lambda f, p, side=1: (
                    (b := f(p, side)) and replace(b, offset=b.offset / (1 + p.j), slope=b.slope / (1 + p.j))
                )
            ),
        ),
        (
            "(56) without omega_c slip_x",
            "_nr_terms",
            instead(lambda f, x, p: (g := f(x, p)) and (g[0] - State.of(x).omega_c * State.of(x).slip_x, *g[1:])),
        ),
    ],
    "analytic.slipping.slip_stability": [
        ("the floor's friction holds a ball on the wall", "stability", instead(_with_friction_of_floor)),
        ("RR lasts for ever where eta > j", "stability", instead(_rough_walls_never_slip)),
        ("a ball lifts out of SR with the slip it has now", "lift_onset", instead(_onset_of_one_spin)),
    ],
}

# --- bifurcation ---


def _of_83(right: Function, j: float, mu: Any, eta: Any, released: bool = False) -> dict[str, Any]:
    curves, (mu, eta) = right(j, mu, eta, released), (np.asarray(a, dtype=float) for a in np.broadcast_arrays(mu, eta))
    Omega = np.sqrt(mu * (1 + eta) / (mu * eta * (1 + j) + j + eta))
    return curves | {"omega_01": np.where(np.isnan(curves["omega_01"]), np.nan, Omega)}


def _carried_by_mu(right: Function, j: float, mu: Any, eta: Any, released: bool = False) -> dict[str, Any]:
    mu = np.broadcast_arrays(np.asarray(mu, dtype=float), eta)[0]
    return right(j, mu, eta, released) | {"omega_02": np.where(mu > 0, 1 / np.sqrt(np.where(mu > 0, mu, 1.0)), np.nan)}


def _by_square_root(right: Function, p: Any, equal: bool = False) -> list[Any]:
    points = right(p, equal)
    if not equal or len(points) < 2:
        return points
    eta = slipping_branch.light_drag(p) / 2
    return [replace(points[0], eta=eta, omega_0=math.sqrt(p.g / (p.R * eta))), *points[1:]]


def _sr_by_spin(right: Function, p: Any, mu: Any, eta: Any, omega_0: Any) -> Any:
    carried = p.j * p.R / p.g * np.asarray(omega_0, dtype=float) ** 2 >= 1
    plane = right(p, mu, eta, omega_0)
    return (plane & np.uint8(255 - diagram.Exists.SR)) | np.where(carried, np.uint8(diagram.Exists.SR), np.uint8(0))


def _inertia_keeps_spin(right: Function, p: Any) -> dict[str, float]:
    curves = diagram.curves_without_drag(p.j, p.mu, p.eta)
    return {name: float(curves[name] * np.sqrt(p.g / (1 - p.density_ratio) / p.R)) for name in diagram.SHIFTED}


_BIFURCATION: dict[str, list[Wrong]] = {
    "analytic.bifurcation.diagram": [
        ("(84) with j + eta for j - eta", "curves_without_drag", instead(_of_83)),
        ("the floor's friction for the wall's in (85)", "curves_without_drag", instead(_carried_by_mu)),
        (
            "eta_cr in proportion to c",
            "critical_drag",
            instead(lambda f, p: f(p) ** 2 / p.c),
        ),
        ("the square root for the cube root where mu = eta", "double_points", instead(_by_square_root)),
        ("SR from omega_03 on", "case_map", instead(_sr_by_spin)),
        ("the fluid's inertia leaves j as it is", "thresholds_with_inertia", instead(_inertia_keeps_spin)),
    ],
}

# --- flowmeter ---


def _chord(right: Function, s: Any, p: Any) -> Any:
    b = slipping_branch.branch(s, p)
    return b.Omega_c / b.Omega_0


def _chord_from_rest(right: Function, p: Any) -> float:
    slope, t = right(p), diagram.thresholds(p)
    return slope if math.isnan(t.omega_04) else (t.omega_01 + slope * (t.omega_02 - t.omega_01)) / t.omega_02


def _only_floor_slips(right: Function, p: Any) -> float:
    return abs(slip_bounds.rr_to_sr(p, p.omega_0, 1).zero - p.omega_0)


def _fluid_turns_back(right: Function, p: Any, layer: bool = True) -> Rolling:
    found = right(p, layer)
    if not (p.fluid_torque and p.drag == STOKES and p.c):
        return found
    shift = (p.c + p.j * p.fluid_torque * p.r / p.R) / (p.c + 2 * p.j * p.fluid_torque) - 1
    return replace(found, omega_c=p.omega_0 * (1 + shift), shift=shift)


_FLOWMETER: dict[str, list[Wrong]] = {
    "analytic.stationary.slipping_branch": [
        ("the slope of SS by its chord from zero", "characteristic_slope", instead(_chord)),
    ],
    "analytic.flowmeter.characteristic": [
        (
            "a rough wall reads up to omega_03 only",
            "reading_range",
            instead(lambda f, p: diagram.thresholds(p).omega_03 if p.eta >= p.j and p.mu and p.c else f(p)),
        ),
        (
            "the wall drops the ball at omega_03",
            "unloading_limit",
            instead(lambda f, p: diagram.thresholds(p).omega_03),
        ),
        ("the mean slope from rest, not from omega_01", "mean_slope", instead(_chord_from_rest)),
    ],
    "analytic.flowmeter.design": [
        (
            "a tolerance is the whole width",
            "corners",
            instead(lambda f, make, at, tolerances: f(make, at, {name: t / 2 for name, t in tolerances.items()})),
        ),
        (
            "sensitivities of the square of a threshold",
            "sensitivities",
            answer(
                lambda found: {
                    key: {name: replace(s, value=2 * s.value) for name, s in row.items()} for key, row in found.items()
                }
            ),
        ),
        (
            "the margin of the meter as it is meant to be",
            "choice",
            instead(
                lambda f, make, values, tolerances, fastest: (
                    (c := f(make, values, tolerances, fastest)) and replace(c, margin=c.limit.omega_0 / fastest)
                )
            ),
        ),
    ],
    "analytic.flowmeter.response": [
        (
            "frequencies in rad s-1",
            "transfer",
            instead(lambda f, p, case, frequency: f(p, case, np.asarray(frequency) / (2 * math.pi))),
        ),
        (
            "(a b)^(-2/3) for (a b)^(-1/3) in the ramp past the fold",
            "ramp_coefficient",
            instead(lambda f, p: f(p) ** 2 / AIRY_ZERO),
        ),
    ],
    "analytic.flowmeter.pulsation": [
        ("the first harmonic of the lag for that of omega_c", "first_harmonic", answer(lambda gain: gain - 1)),
        (
            "a slow pulsation may come to rest",
            "slow_onset",
            instead(
                lambda f, p: max(
                    0.0, getattr(diagram.thresholds(p), ("omega_01", "omega_03")[p.eta >= p.j]) - p.omega_0
                )
            ),
        ),
        ("in a fast pulsation only the floor slips", "fast_onset", instead(_only_floor_slips)),
        ("the mean error with the other sign", "mean_error", scaled(-1.0)),
    ],
    "analytic.flowmeter.real_fluid": [
        (
            "the fluid's torque on a ball with j = 1",
            "torque_rate",
            instead(lambda f, spin, p, layer=True: f(spin, p, layer) * (1.0 if p.fluid_torque else p.j)),
        ),
        ("the fluid turns with the ball's spin, not against it", "rolling", instead(_fluid_turns_back)),
    ],
}

# --- orbits ---


def _nearest_state(right: Function, last: Any, solutions: Any) -> Any:
    size = state_units(last.header.parameters)

    def distance(of: Any) -> float:
        bound = [k for k, name in enumerate(VARIABLES) if name not in of.family]
        return float((np.abs(last.x[-1] - of.x) / size)[bound].max())

    return min((each for each in solutions if distance(each) <= fates.NEAR), key=distance, default=None)


def _wald(right: Function, hits: int, of: int) -> tuple[float, float]:
    if of == 0:
        return 0.0, 1.0
    share = hits / of
    half = 1.96 * math.sqrt(share * (1 - share) / of)
    return max(0.0, share - half), min(1.0, share + half)


_ORBITS: dict[str, list[Wrong]] = {
    "analytic.orbits.periodic": [
        (
            "multipliers of the defect for those of the return",
            "close",
            answer(fields(derivative=lambda d: d - np.eye(len(d)))),
        ),
        (
            "orbits land without a rebound",
            "_simulated",
            instead(lambda f, p, x, duration, samples, restitution: f(p, x, duration, samples, 0.0)),
        ),
    ],
    "analytic.orbits.fates": [
        (
            "exponents per natural time",
            "lyapunov",
            instead(lambda f, p, *rest, **named: times(math.sqrt(p.R / p.g))(np.array(f(p, *rest, **named)))),
        ),
        ("of two motions in one state the first, whatever the case", "_nearest", instead(_nearest_state)),
    ],
    "analytic.simulation.ensemble": [
        ("a share's interval by the normal distribution", "interval", instead(_wald)),
    ],
}

# --- simulation ---


def _wall_of_nr(right: Function, case: int, *args: Any) -> Any:
    f = right(case, *args)
    return (*f[:4], (1 + args[-1].j) * f[4], f[5]) if case == Case.NR else f


def _axis_not_turned_by_slip(right: Function, t: float, z: Any, k: Any, out: Any) -> None:
    right(t, z, k, out)
    if k.case == Case.NS:
        out[4] += z[3] * z[5] * math.cos(z[6])


def _slip_without_centre(right: Function, t: float, z: Any, k: Any, out: Any) -> None:
    right(t, z, k, out)
    if k.case == Case.SN:
        out[4] += k.mu * k.g


def _resting_fluid(right: Function, t: float, z: Any, rise: float, k: Any) -> Any:
    V = complex(z[2], z[3])
    return V, V, equations.resistance(V.real, rise, V.imag, k)


def _rn_slips_by_drag(right: Function, t: float, z: Any, k: Any, out: Any) -> None:
    right(t, z, k, out)
    if k.case == Case.RN:
        out[0] = k.mu - (k.mu - out[0]) * (1 + k.j) / k.j


def _turned_back(right: Function, u: Velocities, h: float, t: float, k: Any) -> Velocities:
    rates = right(u, h, t, k)
    return rates._replace(o_x=-rates.o_x, o_z=-rates.o_z)


def _load_of_fluid(right: Function, omega_c: float, t: float, k: Any) -> tuple[float, float]:
    return k.R / k.g * equations.fluid(t, k) ** 2, right(omega_c, t, k)[1]


def _mirrored_onset(right: Function, at: Any, k: Any) -> tuple[int, Any]:
    case, after = right(at, k)
    return case, after._replace(alpha=-after.alpha, beta=-after.beta)


def _soft_wall(right: Function, at: Any, k: Any) -> Any:
    return right(at, k._replace(restitution=0.0) if at.x.h == 0 and at.x.v_h < 0 else k)


def _what_rests_sticks(right: Function, guard: int, case: int, at: Any, k: Any) -> Any:
    after, then, impulse = right(guard, case, at, k)
    if guard == equations.A_STICKS and after // 3 != equations.AWAY:
        after = 3 * equations.ROLLS + after % 3
    if guard == equations.B_STICKS and after % 3 != equations.AWAY:
        after = 3 * (after // 3) + equations.ROLLS
    return after, then, impulse


def _spin_taken_from_speed(right: Function, case: int, at: Any, k: Any, z: Any, scale: Any) -> Any:
    found = right(case, at, k, z, scale)
    if case == Case.SN:
        u, turn = rigid_body.velocities(at.x, k), np.exp(1j * at.theta)
        z[4] = abs(complex(z[2], z[3]) - 1j * k.r * turn * complex(-u.o_x, u.o_z))
    return found


_SIMULATION: dict[str, list[Wrong]] = {
    "analytic.simulation.equations": [
        (
            "a ramp counts from the start of the run",
            "fluid",
            instead(lambda f, t, k: f(t, k) + k.line.slope * k.line.start),
        ),
        ("friction of NR without 1/(1 + j)", "forces", instead(_wall_of_nr)),
        ("the axis of a sinking ball isn't turned by slip_z", "_rates_at_wall", instead(_axis_not_turned_by_slip)),
        ("sliding away from the wall slows the spin alone", "_rates_away", instead(_slip_without_centre)),
        ("the fluid rests away from the wall", "_pull", instead(_resting_fluid)),
        ("a ball on the floor slips where drag exceeds mu g", "_guards_away", instead(_rn_slips_by_drag)),
        ("the axes turn the spin the other way as a case is chosen", "smooth_rates", instead(_turned_back)),
        ("the load of RR by the fluid's speed", "loads", instead(_load_of_fluid)),
    ],
    "analytic.simulation.transitions": [
        ("RR is left towards the other side", "leave", instead(_mirrored_onset)),
        (
            "friction of an impact by the speed before it alone",
            "collide",
            instead(lambda f, at, k: f(at, k._replace(mu=k.mu / (1 + k.restitution), eta=k.eta / (1 + k.restitution)))),
        ),
        ("the wall doesn't throw a ball back", "collide", instead(_soft_wall)),
        ("what comes to rest sticks, whatever that takes", "react", instead(_what_rests_sticks)),
    ],
    "analytic.simulation.charts": [
        ("a ball slides by its speed less its spin", "_away_from_wall", instead(_spin_taken_from_speed)),
    ],
}


def _listed(*parts: dict[str, list[Wrong]]) -> list[WrongTheory]:
    return [
        WrongTheory(what, module, function, wrong)
        for part in parts
        for module, rows in part.items()
        for what, function, wrong in rows
    ]


THEORIES = _listed(_MECHANICS, _STATIONARY, _SLIPPING, _BIFURCATION, _FLOWMETER, _ORBITS, _SIMULATION)
