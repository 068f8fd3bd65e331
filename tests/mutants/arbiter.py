"""60 wrong theories of a referee."""

import math
from dataclasses import replace
import numpy as np
from tests.mutants.exchange import WrongTheory
from analytic.slipping.slip_bounds import SlipBound, HeldBound
from analytic.slipping.slip_stability import SlipStability
from analytic.stationary.solutions import Stability
from analytic.flowmeter.characteristic import End
from analytic.bifurcation.diagram import Exists
from analytic.mechanics.rigid_body import Forces, Velocities
from model import Case, State

L = []


def t(what, module, function, wrong):
    L.append(WrongTheory(what, "analytic." + module, function, wrong))


def times(k):
    return lambda right, *a, **n: k * right(*a, **n)


def field(**ks):
    def wrong(right, *a, **n):
        x = right(*a, **n)
        new = {name: k * getattr(x, name) for name, k in ks.items()}
        return x._replace(**new) if hasattr(x, "_replace") else replace(x, **new)

    return wrong


D = "bifurcation.diagram"


def curve(name, of):
    def wrong(right, j, mu, eta, *a, **n):
        c = dict(right(j, mu, eta, *a, **n))
        c[name] = c[name] * of(j, np.asarray(mu, float), np.asarray(eta, float))
        return c

    return wrong


# thresholds
t(
    "omega_01 by mu without 1 + eta",
    D,
    "curves_without_drag",
    curve("omega_01", lambda j, mu, eta: 1 / np.sqrt(1 + eta)),
)
t("omega_02 1 % low", D, "curves_without_drag", curve("omega_02", lambda j, mu, eta: 0.99))
t("omega_03 2 % high", D, "curves_without_drag", curve("omega_03", lambda j, mu, eta: 1.02))
t("eta_cr 5 % high", "stationary.slipping_branch", "eta_critical", times(1.05))
t(
    "fold placed at the next tenth of ln tan alpha",
    "stationary.slipping_branch",
    "fold",
    lambda right, *a, **n: right(*a, **n) + 0.1,
)
t("two folds where there is one", D, "number_of_folds", lambda right, p: 2 * right(p))
t("critical drag 3 % high", D, "critical_drag", times(1.03))


def dp(right, p, equal=False):
    return [replace(x, eta=x.eta * 1.03) if equal and x.eta < p.j else x for x in right(p, equal)]


t("double point of equal friction 3 % off", D, "double_points", dp)


def cm_ss(right, p, mu, eta, omega_0):
    """SS until omega_02 only"""
    m = right(p, mu, eta, omega_0)
    carried = (m & Exists.SR) > 0
    return np.where(carried, m & ~np.uint8(Exists.SS), m).astype(np.uint8)


t("map: SS ends where the wall carries", D, "case_map", cm_ss)


def cm_ns(right, p, mu, eta, omega_0):
    m = right(p, mu, eta, omega_0)
    rr = (m & Exists.RR) > 0
    rough = (np.asarray(eta, float) >= p.j)[:, None]
    return np.where(rough & rr, m | np.uint8(Exists.NS), m).astype(np.uint8)


t("map: NS lasts as long as RR for eta > j", D, "case_map", cm_ns)
# stationary
S = "stationary.solutions"
t("slip of SS 2 % fast", "stationary.slipping_branch", "branch", field(v_A=1.02))
t(
    "lag of SS 3 % large",
    "stationary.slipping_branch",
    "branch",
    lambda right, *a, **n: (
        lambda b: replace(b, Omega_0=b.Omega_c + 1.03 * (b.Omega_0 - b.Omega_c))
    )(right(*a, **n)),
)
t("wall of SS pressed 2 % more", "mechanics.dynamics", "_ss", field(B_x=1.02, B_y=1.02, B_z=1.02))


def ns_spin(right, p):
    return [
        replace(s, x=np.array(State(*s.x)._replace(slip_x=p.eta / p.j * p.omega_0 * p.R / p.r)))
        for s in right(p)
    ]


t("NS: spin without the part of rolling", S, "_ns", ns_spin)
t(
    "NS: sinks 2 % faster",
    S,
    "_ns",
    lambda right, p: [
        replace(s, x=np.array(State(*s.x)._replace(v_y=1.02 * s.x[1], slip_z=1.02 * s.x[5])))
        for s in right(p)
    ],
)
t(
    "lifting spin by (1+j) g",
    S,
    "_lifting_spin",
    lambda right, p: right(p) + p.g / (p.omega_0 * p.r),
)
t(
    "wall carries from 5 % more flow on",
    S,
    "_wall_carries",
    lambda right, p: p.eta * p.Omega_0**2 >= 1.05**2,
)
t(
    "RS exists up to (1+j) u = mu",
    S,
    "_rs",
    lambda right, p: [
        replace(s, exists=bool((1 + p.j) * p.R * s.x[2] ** 2 <= p.mu * p.g)) for s in right(p)
    ],
)
t(
    "RR exists at any flow",
    S,
    "_rr",
    lambda right, p: [
        replace(s, exists=True, slip_stability=SlipStability.STABLE) for s in right(p)
    ],
)
t(
    "SS beyond the fold is stable",
    S,
    "_ss",
    lambda right, p: [replace(s, stability=Stability.ASYMPTOTIC) for s in right(p)],
)
t("slowest time constant 2 % long", S, "slowest_time_constant", times(1.02))
t(
    "eigenvalues of SR 2 % fast",
    S,
    "eigenmodes_SR",
    lambda right, p: (lambda v: (1.02 * v[0], v[1]))(right(p)),
)
t(
    "SS rings 2 % faster",
    "stationary.slipping_branch",
    "eigenvalues_at",
    lambda right, s, p: (lambda v: v.real + 1.02j * v.imag)(right(s, p)),
)
# slipping
B = "slipping.slip_bounds"
t(
    "(66) with 1 + j",
    B,
    "rr_to_rs",
    lambda right, p, w, side: (lambda b: replace(b, hold=b.hold * (1 + p.j) / (1 + 2 * p.j)))(
        right(p, w, side)
    ),
)
t(
    "(73) without the lift of the spin",
    B,
    "rr_to_sr",
    lambda right, p, w, side: replace(
        right(p, w, side), hold=p.mu * (1 + 2 * p.j) * p.g / (p.j * (1 + p.j) * p.r)
    ),
)
t(
    "(82) drive without mu eta",
    B,
    "rr_to_ss",
    lambda right, p, side: replace(
        right(p, side), slope=p.R * (side * p.j - p.eta) / (p.j * p.r * (1 + p.mu * p.eta))
    ),
)
t("(61) 2 % flat", B, "nr_to_ns", lambda right, p: field(slope=0.98)(right, p))
t("steepest slip turns the other way", B, "steepest_nr", times(-1))
t("Filippov share of the other side", B, "filippov_share", lambda right, *a: 1 - right(*a))
Y = "slipping.slip_stability"
t(
    "lift 2 % of g late",
    Y,
    "lift_acceleration",
    lambda right, i, o, x, p: right(i, o, x, p) - 0.02 * p.g,
)
t("lift onset 1 % late", Y, "lift_onset", times(1.01))
t(
    "RS needs friction (1+j) u",
    Y,
    "stability",
    lambda right, case, p, omega_c=None: right(
        case, p.replace(mu=p.mu * p.j / (1 + p.j)) if Case(case) is Case.RS else p, omega_c
    ),
)
# mechanics
G = "mechanics.drag"
t("drag of the wake 5 % weak", G, "law", field(wake=0.95))
t("blunt drag 3 % strong", G, "law", field(blunt=1.03))
t(
    "slope of the drag as its secant",
    G,
    "slope",
    lambda right, speed, p: (
        right(speed, p) * 0 + __import__("analytic").mechanics.drag.coefficient(speed, p)
    ),
)
t("fall lasts 1 % longer", G, "fall_time", times(1.01))
M = "mechanics.dynamics"
t("RS: floor along the orbit 3 % weak", M, "_rs", field(A_z=0.97))
t("SR: wall along the orbit 3 % strong", M, "_sr", field(B_z=1.03))
t(
    "NR: gyroscopic wall force without the orbit",
    M,
    "_nr",
    lambda right, x, p, o: (
        lambda f: f._replace(B_y=f.B_y - 0.05 * p.j * p.m * p.R * x[2] ** 2 / (1 + p.j))
    )(right(x, p, o)),
)
t("NS: friction 3 % weaker along the orbit", M, "_ns", field(B_z=0.97))
t(
    "RN: rolls with 1 + 2j",
    M,
    "_rn",
    lambda right, x, p, o: (
        lambda f: f._replace(
            A_x=f.A_x * (1 + p.j) / (1 + 2 * p.j), A_z=f.A_z * (1 + p.j) / (1 + 2 * p.j)
        )
    )(right(x, p, o)),
)
t("SN: floor 3 % rougher across the orbit", M, "_sn", field(A_x=1.03))
t(
    "RR: wall pressed by (1 + 0.97 j) u",
    M,
    "rolling_family",
    lambda right, w, p, o, B: (lambda f: f._replace(B_x=f.B_x - 0.03 * p.j * p.m * p.R * w**2))(
        right(w, p, o, B)
    ),
)
t(
    "Coriolis once, not twice",
    M,
    "newton_euler",
    lambda right, case, x, f, p, o: (
        lambda r: r._replace(omega_c=r.omega_c - x[7] * x[2] / (p.R - x[6]))
    )(right(case, x, f, p, o)),
)
t(
    "the least friction of RR by equal wall force, 2 % off",
    "mechanics.rolling_forces",
    "least_utilisation",
    field(B_y=1.02),
)


def box(right, w, p, o=None):
    from analytic.mechanics import rolling_forces as rf

    u, z = rf._loads(w, p, o)
    s = rf._last_share(u, z, p)
    return np.asarray(
        np.minimum(p.eta * (1 + p.j) * u - z, p.mu * (1 - s) - np.maximum(np.abs(p.j * u - s), z))
    )


t("end of RR by a friction box", "mechanics.rolling_forces", "slip_margin", box)
# simulation
E = "simulation.equations"
t(
    "simulated RR ends with 2 % less friction at the floor",
    E,
    "slip_margin",
    lambda right, u, z, k: right(u, z, k._replace(mu=0.98 * k.mu)),
)


def clip(right, need, friction):
    n, s, tt = need
    if n <= 0 or friction.s != 0 or friction.t != 0:
        return right(need, friction)
    lim = friction.coefficient * n
    return type(need)(n, min(max(s, -lim), lim), min(max(tt, -lim), lim))


t("impacts and onsets with a friction box", "mechanics.contact_problem", "project", clip)


def down(right, case, omega_c, v_y, w_x, c, lag, s_A, c_A, s_B, c_B, k):
    f = list(right(case, omega_c, v_y, w_x, c, lag, s_A, c_A, s_B, c_B, k))
    if case in (4, 7) and c_B > 0:
        f[4] *= 1.03
    return tuple(f)


t("directional wall: 3 % rougher downwards", E, "forces", down)


def sn(right, tt, z, k, out):
    right(tt, z, k, out)
    if k.case == 5:
        out[4] += 0.03 * k.mu * k.g * (1 + 1 / k.j)


t("SN: slip dies out 3 % slowly", E, "_rates_away", sn)


def landing(right, at, k):
    after, P = right(at, k)
    x = after.x
    if P.B_x > 0 and P.A_y > 0:
        after = (
            after._replace(x=x._replace(omega_c=x.omega_c * 1.01))
            if hasattr(after, "_replace")
            else replace(after, x=x._replace(omega_c=x.omega_c * 1.01))
        )
    return after, P


t("corner impact leaves 1 % more orbit", "simulation.transitions", "collide", landing)
# flowmeter
C = "flowmeter.characteristic"
t("slope of SS 3 % steep", "stationary.slipping_branch", "characteristic_slope", times(1.03))
t("mean slope up to omega_04", C, "mean_slope", lambda right, p: right(p) * 0.95)


def op(right, p):
    from analytic.bifurcation import diagram

    got = right(p)
    return replace(got, omega_0=diagram.thresholds(p).omega_03) if got.end is End.UNLOADING else got


t("range for eta > j up to omega_03", C, "operating_limit", op)
t("unloading 2 % late", C, "unloading_limit", times(0.98))
t("first harmonic 1 % weak", "flowmeter.pulsation", "first_harmonic", times(0.99))
t(
    "peak of the response 2 % late",
    "flowmeter.response",
    "peak",
    lambda right, p, case: (lambda r: (1.02 * r[0], r[1]))(right(p, case)),
)
t(
    "torque of the fluid on the floor only",
    "flowmeter.real_fluid",
    "rolling",
    lambda right, p, layer=True: (
        lambda r: replace(
            r,
            omega_c=r.omega_c
            + p.j * p.fluid_torque * p.r * p.omega_0 / (p.R * (p.c + 2 * p.j * p.fluid_torque)),
        )
    )(right(p, layer)),
)
# orbits
t("orbit gains 0.5 % more azimuth", "orbits.periodic", "refine", field(turn=1.005))
t("multipliers 5 % large", "orbits.periodic", "refine", field(derivative=1.05))
MINE = L
assert len(L) == 60 or print(len(L))

# -- a subtler list ------------------------------------------------------------------------------

"""A second, subtler list: faults in one corner only, or of a per cent."""
import math
from dataclasses import replace
import numpy as np
from tests.mutants.exchange import WrongTheory
from analytic.slipping.slip_stability import SlipStability
from analytic.stationary.solutions import Stability
from analytic.flowmeter.characteristic import End
from analytic.bifurcation.diagram import Exists
from model import Case, State
from model.drag import QUADRATIC, SCHILLER_NAUMANN, STOKES
import analytic
from mine import times, field, curve

L = []


def t(what, module, function, wrong):
    L.append(WrongTheory(what, "analytic." + module, function, wrong))


def st(**ks):
    """scale variables of the states of solutions, or set by function"""

    def wrong(right, p):
        return [
            replace(
                s,
                x=np.array(
                    State(*s.x)._replace(**{n: k * getattr(State(*s.x), n) for n, k in ks.items()})
                ),
            )
            for s in right(p)
        ]

    return wrong


D, S, SB, Y, B, M, G, C = (
    "bifurcation.diagram",
    "stationary.solutions",
    "stationary.slipping_branch",
    "slipping.slip_stability",
    "slipping.slip_bounds",
    "mechanics.dynamics",
    "mechanics.drag",
    "flowmeter.characteristic",
)
E, T = "simulation.equations", "simulation.transitions"
# thresholds
t("2 omega_01 0.5 % high", D, "curves_without_drag", curve("omega_01", lambda j, mu, eta: 1.005))
t("2 omega_02 0.5 % high", D, "curves_without_drag", curve("omega_02", lambda j, mu, eta: 1.005))
t("2 omega_03 0.5 % low", D, "curves_without_drag", curve("omega_03", lambda j, mu, eta: 0.995))


def four(right, p):
    got = right(p)
    return replace(got, omega_04=got.omega_04 * (1.02 if p.drag == SCHILLER_NAUMANN else 1))


t("2 fold under Schiller and Naumann 2 % high", D, "thresholds", four)
t("2 fold 0.5 % high", D, "thresholds", field(omega_04=1.005))
t(
    "2 eta_cr under quadratic drag not zero",
    SB,
    "light_drag",
    lambda right, p: 0.05 if p.drag == QUADRATIC else right(p),
)
t(
    "2 no fold is looked for below 1.2 eta_cr",
    SB,
    "fold",
    lambda right, p, mu=None, eta=None, released=False: np.where(
        np.asarray(p.eta if eta is None else eta)
        < 1.2 * analytic.stationary.slipping_branch.eta_critical(p.mu if mu is None else mu, p),
        np.nan,
        right(p, mu, eta, released),
    ),
)
t(
    "2 omega_0 of double points 2 % low",
    D,
    "double_points",
    lambda right, *a, **n: [replace(x, omega_0=0.98 * x.omega_0) for x in right(*a, **n)],
)
t(
    "2 three curves meet at eta = j",
    D,
    "double_points",
    lambda right, *a, **n: [
        replace(x, meets=tuple(m for m in x.meets if m != "omega_01")) for x in right(*a, **n)
    ],
)
t(
    "2 map: RR ends at omega_03 for every eta",
    D,
    "case_map",
    lambda right, p, mu, eta, o: np.where(
        (np.abs(np.asarray(o)) <= np.sqrt(p.g / p.j / p.R))[None, :],
        right(p, mu, eta, o) | np.uint8(1),
        right(p, mu, eta, o),
    ).astype(np.uint8),
)


def map_sr(right, p, mu, eta, o):
    m = right(p, mu, eta, o)
    return np.where(
        (m & Exists.RR > 0) & (np.asarray(eta) > p.j)[:, None],
        m & ~np.uint8(Exists.NR | Exists.SR),
        m,
    ).astype(np.uint8)


t("2 map: wall does not carry while RR rolls, eta > j", D, "case_map", map_sr)
t(
    "2 spin on the wall of ball radius only",
    D,
    "wall_spin",
    lambda right, x, p: x.slip_x + (p.R / p.r - 1) * x.omega_c,
)
# stationary
t("2 SS: second solution is lost", SB, "points_at", lambda right, p: right(p)[:1])
t(
    "2 SS: alpha of the other sense",
    S,
    "_ss",
    lambda right, p: [replace(s, alpha=-s.alpha) for s in right(p)],
)
t(
    "2 SS: slip_x of the other sense",
    SB,
    "states",
    lambda right, s, p: (lambda g: (g[0] * np.array([1, 1, 1, -1, 1, 1, 1, 1.0]), g[1]))(
        right(s, p)
    ),
)
t("2 SS: branch force of the floor 1 % high", SB, "branch", field(A_y=1.01))
t("2 SS: omega_c 0.3 % slow", SB, "branch", field(Omega_c=0.997))
t(
    "2 SS beyond fold rings 1 % more damped",
    SB,
    "eigenvalues_at",
    lambda right, s, p: 1.01 * right(s, p).real + 1j * right(s, p).imag,
)
t(
    "2 RR is neutral under quadratic drag",
    S,
    "_rr",
    lambda right, p: [
        replace(s, stability=Stability.NEUTRAL) if s.stability is Stability.ALGEBRAIC else s
        for s in right(p)
    ],
)
t(
    "2 NR stable asymptotically",
    S,
    "_nr",
    lambda right, p: [
        replace(s, stability=Stability.ASYMPTOTIC) if s.stability is Stability.NEUTRAL else s
        for s in right(p)
    ],
)
t(
    "2 NR unstable below omega_03",
    S,
    "_nr",
    lambda right, p: [
        replace(s, stability=Stability.UNSTABLE) if p.j * p.Omega_0**2 < 1 else s for s in right(p)
    ],
)
t(
    "2 NS: any member of a smooth wall spins",
    S,
    "_ns",
    lambda right, p: [replace(s, family=("y",)) for s in right(p)],
)
t(
    "2 SR of a smooth floor spins with the orbit",
    S,
    "_sr",
    lambda right, p: [
        replace(s, x=s.x * np.array([1, 1, 1, 0.98 if p.mu == 0 else 1, 1, 1, 1, 1]))
        for s in right(p)
    ],
)
t(
    "2 RS exists whatever the flow on a smooth wall",
    S,
    "_rs",
    lambda right, p: [replace(s, exists=True) for s in right(p)],
)
t(
    "2 mirrored solution keeps the spin",
    S,
    "stationary_solutions",
    lambda right, p, cases=tuple(Case): [
        replace(s, x=s.x * np.array([1, 1, 1, -1, 1, 1, 1, 1.0])) if p.omega_0 < 0 else s
        for s in right(p, cases)
    ],
)
t(
    "2 mirrored solution keeps the forces",
    S,
    "stationary_solutions",
    lambda right, p, cases=tuple(Case): [
        replace(
            s,
            force_A=s.force_A * np.array([1, 1, -1.0]),
            force_B=s.force_B * np.array([1, 1, -1.0]),
        )
        if p.omega_0 < 0
        else s
        for s in right(p, cases)
    ],
)
t(
    "2 stationary force of the wall 1 % high in NR",
    S,
    "_nr",
    lambda right, p: [replace(s, force_B=1.01 * s.force_B) for s in right(p)],
)
t(
    "2 least decay of SR: orbit 2 % slow",
    S,
    "eigenmodes_SR",
    lambda right, p: (lambda v: (v[0] * np.array([1, 0.98]), v[1]))(right(p)),
)


def turned(right, p):
    v, rows = right(p)
    rows = rows + 0.05 * np.array([[0, 1], [0, 0]]) * np.sign(rows[0, 1].real)
    return v, rows / np.linalg.norm(rows, axis=1)[:, None]


t("2 mode of the load turned", S, "eigenmodes_SR", turned)
# slipping
t(
    "2 (83) by the floor of (82)",
    B,
    "rr_to_ss",
    lambda right, p, side: (
        right(p, side) if side > 0 else replace(right(p, side), offset=right(p, 1).offset)
    ),
)
t(
    "2 (67) has an offset",
    B,
    "rr_to_rs_stationary",
    lambda right, p: replace(right(p), slope=right(p).slope * (1 + p.j) / (1 + 2 * p.j)),
)
t(
    "2 (74) 1 % steep",
    B,
    "rr_to_sr_stationary",
    lambda right, p: replace(right(p), slope=1.01 * right(p).slope),
)
t(
    "2 (56) drag against the fall left out",
    B,
    "gamma_nr",
    lambda right, beta, x, p: right(beta, x, p) - np.cos(beta) * p.c * State.of(x).v_y / p.r,
)
t(
    "2 gamma of SR to SS 1 % high",
    Y,
    "slip_rates",
    lambda right, i, o, x, n, p: (lambda r: (r[0] * (1.01 if Case(i) is Case.SR else 1), *r[1:]))(
        right(i, o, x, n, p)
    ),
)
t(
    "2 floor force of a beginning slip 1 % low",
    Y,
    "slip_rates",
    lambda right, *a: (lambda r: (r[0], 0.99 * r[1], r[2]))(right(*a)),
)
t(
    "2 wall force of a beginning slip 1 % low",
    Y,
    "slip_rates",
    lambda right, *a: (lambda r: (r[0], r[1], 0.99 * r[2]))(right(*a)),
)
t(
    "2 RR on a rough wall slips at omega_01",
    Y,
    "stability",
    lambda right, case, p, w=None: right(
        case, p.replace(mu=0.97 * p.mu) if Case(case) is Case.RR else p, w
    ),
)
t("2 neutral flow 0.5 % high", Y, "neutral_flow", times(1.005))
# drag
t("2 drag by the horizontal speed", G, "speed", lambda right, h, y, k: right(h, 0.0 * y, k))
t("2 Reynolds number by the radius", G, "reynolds", times(0.5))
t(
    "2 Reynolds number of a state without the fall",
    G,
    "reynolds_of",
    lambda right, x, p: right(x._replace(v_y=0.0), p),
)
t("2 sinking speed without buoyancy of 1 %", G, "sinking_speed", times(1.01))
t(
    "2 speed of a given drag 1 % high for the wake",
    G,
    "speed_of",
    lambda right, a, p: right(a, p) * (1.01 if p.drag == SCHILLER_NAUMANN else 1),
)
t(
    "2 blunt drag taken up at half the Reynolds number",
    G,
    "law",
    lambda right, p: (
        lambda l: l._replace(blunt=1.1 * l.blunt) if p.drag == SCHILLER_NAUMANN else l
    )(right(p)),
)
# forces and motion
t("2 SS: friction of the floor turned by 1 %", M, "_ss", field(A_x=0.99))
t(
    "2 NN: drag across the orbit only",
    M,
    "newton_euler",
    lambda right, case, x, f, p, o: (
        lambda r: r._replace(v_h=r.v_h + 0.02 * p.c * x[7]) if case is Case.NN else r
    )(right(case, x, f, p, o)),
)
t(
    "2 SN: spin about the vertical is braked",
    M,
    "newton_euler",
    lambda right, case, x, f, p, o: (
        lambda r: r._replace(slip_y=1.01 * r.slip_y) if case is Case.SN else r
    )(right(case, x, f, p, o)),
)
t(
    "2 margin of feasible rolling by 1 % of mu",
    "mechanics.rolling_forces",
    "margin",
    lambda right, w, p, o=None: right(w, p.replace(mu=0.99 * p.mu), o),
)
t(
    "2 utilisation 1 % high",
    "mechanics.rolling_forces",
    "least_utilisation",
    lambda right, *a: (lambda b: replace(b, utilisation=1.01 * b.utilisation))(right(*a)),
)
# simulation
t(
    "2 restitution 2 % low",
    T,
    "collide",
    lambda right, at, k: right(at, k._replace(restitution=0.98 * k.restitution)),
)
t(
    "2 landing friction by 0.97 eta",
    T,
    "collide",
    lambda right, at, k: right(at, k._replace(eta=0.97 * k.eta)),
)
t(
    "2 landing friction by 0.97 mu",
    T,
    "collide",
    lambda right, at, k: right(at, k._replace(mu=0.97 * k.mu)),
)
t(
    "2 RS where SS follows RR",
    T,
    "leave",
    lambda right, at, k: (lambda g: (1, g[1]._replace(alpha=math.nan)) if g[0] == 4 else g)(
        right(at, k)
    ),
)
t(
    "2 smooth rates without the turning of axes",
    E,
    "smooth_rates",
    lambda right, *a: right(*a)._replace(o_x=0.0),
)
t(
    "2 simulated wall in NR 1 % stronger",
    E,
    "forces",
    lambda right, case, *a: (lambda f: (*f[:4], 1.01 * f[4], f[5]) if case == 6 else f)(
        right(case, *a)
    ),
)
t(
    "2 simulated slip at the wall in RS 1 % stronger",
    E,
    "forces",
    lambda right, case, *a: (lambda f: (*f[:5], 1.01 * f[5]) if case == 1 else f)(right(case, *a)),
)
# flowmeter
t("2 slope jumps to 0.02", C, "slope_jump", lambda right, p: right(p) + 0.02)
t(
    "2 reading range for eta > j up to omega_03",
    C,
    "reading_range",
    lambda right, p: min(right(p), 1.001 * math.sqrt(p.g / p.j / p.R)),
)
t(
    "2 operating range of a smooth wall",
    C,
    "operating_limit",
    lambda right, p: (
        replace(right(p), omega_0=math.sqrt(p.g / p.j / p.R))
        if right(p).end is End.SMOOTH
        else right(p)
    ),
)
t(
    "2 response lags 1 degree more",
    "flowmeter.response",
    "transfer",
    lambda right, *a: right(*a) * np.exp(-1j * math.pi / 180),
)
t(
    "2 overshoot 2 % higher",
    "flowmeter.response",
    "peak",
    lambda right, *a: (lambda r: (r[0], 1.02 * r[1]))(right(*a)),
)
t("2 ramp coefficient 10 % high", "flowmeter.response", "ramp_coefficient", times(1.1))
t("2 slip onset of pulsation 2 % high", "flowmeter.pulsation", "slip_onset", times(1.02))
t("2 slow onset 5 % high", "flowmeter.pulsation", "slow_onset", times(1.05))
t("2 fast onset 5 % high", "flowmeter.pulsation", "fast_onset", times(1.05))
t("2 mean error 5 % high", "flowmeter.pulsation", "mean_error", times(1.05))
t(
    "2 harmonics of the lag 1 % high in the third",
    "flowmeter.pulsation",
    "lag_harmonics",
    lambda right, *a, **n: (lambda h: h * np.where(np.arange(len(h)) == 1, 1.05, 1.0))(
        right(*a, **n)
    ),
)
t(
    "2 readings of a design 0.5 % low",
    "flowmeter.design",
    "readings",
    lambda right, p, o: (lambda r: (0.995 * r[0], 0.995 * r[1]))(right(p, o)),
)
t("2 response time of a design 3 % long", "flowmeter.design", "response_time", times(1.03))
t("2 torque of a layer 5 % strong", "flowmeter.real_fluid", "torque_rate", times(1.05))
t(
    "2 orbit's period 0.3 % long",
    "orbits.periodic",
    "refine",
    lambda right, *a, **n: (
        lambda o: replace(o, loop=replace(o.loop, period=1.003 * o.loop.period))
    )(right(*a, **n)),
)
t(
    "2 branch of orbits dies 2 % early",
    "orbits.orbit_branch",
    "follow",
    lambda right, *a, **n: (
        lambda b: replace(b, places=tuple(replace(q, value=0.98 * q.value) for q in b.places))
    )(right(*a, **n)),
)
t(
    "2 simulate: friction of SR 1 % stronger on the floor",
    E,
    "forces",
    lambda right, case, *a: (lambda f: (*f[:2], 1.01 * f[2], *f[3:]) if case == 3 else f)(
        right(case, *a)
    ),
)
MINE = L
