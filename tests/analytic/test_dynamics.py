"""Vector fields and contact forces are what sympy solves Newton-Euler (20) with Table 3 to, to
1e-12.

Both come from nothing but vectors, an origin of the equations of motion that the code doesn't
share: the ball's centre stands at (-rho, r + y, 0) in the co-rotating frame (1), with rho = R - h;
its angular velocity is split by (4), with rho for R. Everything else is differentiation of vectors
in a rotating frame."""

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
import sympy as sp

from analytic import contact_forces, vector_field
from analytic.mechanics import dynamics
from model import Case, Contact, InputError, Parameters
from model.cases import TRAITS
from model.drag import LAWS
from model.kinematics import VARIABLES, slip_velocities
from tests.drag_laws import resistance

P = Parameters.named("reference").replace(omega_0=17.0, mu=0.3, eta=0.45)
N = 2_000
t = sp.Symbol("t")
m, r, R, j, mu, eta, g, c = sp.symbols("m r R j mu eta g c", positive=True)
omega_0, alpha, beta = sp.symbols("omega_0 alpha beta", real=True)
STATE = sp.symbols(VARIABLES, real=True)
RATE = sp.symbols([f"d{name}" for name in VARIABLES], real=True)
FORCE_A, FORCE_B = (sp.Matrix(sp.symbols(f"{F}_x {F}_y {F}_z", real=True)) for F in "AB")
HELD = {case: {x: 0 for x in STATE if x.name in TRAITS[case].constraints} for case in Case}
HELD[Case.RN] |= {STATE[5]: -STATE[7] / r}
"""The constraints of a case."""


def equations(case):
    """(20) with what Table 3 adds, known force components and rates of constraints: each zero,
    linear in both."""
    of_time = [sp.Function(name)(t) for name in VARIABLES]
    y, v_y, omega_c, slip_x, slip_y, slip_z, h, v_h = of_time
    rho, frame = R - h, sp.Matrix([0, omega_c, 0])
    A, B = sp.Matrix([0, -r, 0]), sp.Matrix([-r, 0, 0])
    place = sp.Matrix([-rho, r + y, 0])
    v_C = (place.diff(t) + frame.cross(place)).subs({y.diff(t): v_y, h.diff(t): v_h})
    spin = sp.Matrix([rho * omega_c / r + slip_x, -rho * omega_c / r + slip_y, v_y / r + slip_z])
    v_A, v_B = v_C + spin.cross(A), v_C + spin.cross(B)
    drag, weight = -m * c * (v_C - sp.Matrix([0, 0, rho * omega_0])), sp.Matrix([0, -m * g, 0])
    newton = weight + FORCE_A + FORCE_B + drag - m * (v_C.diff(t) + frame.cross(v_C))
    # omega x J omega vanishes for a sphere
    turning = j * m * r**2 * (spin.diff(t) + frame.cross(spin))
    moments = A.cross(FORCE_A) + B.cross(FORCE_B) - turning
    found = [*newton, *moments, y.diff(t) - v_y, h.diff(t) - v_h]
    found += list(FORCE_A) if case.A is Contact.N else [v_y.diff(t)]
    found += list(FORCE_B) if case.B is Contact.N else [v_h.diff(t)]
    if case.A is Contact.S:  # (14) with dir v_A = (cos alpha, 0, -sin alpha)
        limit = mu * FORCE_A[1]
        found += [FORCE_A[0] + limit * sp.cos(alpha), FORCE_A[2] - limit * sp.sin(alpha)]
    if case.B is Contact.S:  # (15) with dir v_B = (0, -cos beta, sin beta)
        limit = eta * FORCE_B[0]
        found += [FORCE_B[1] - limit * sp.cos(beta), FORCE_B[2] + limit * sp.sin(beta)]
    if case.A is Contact.R:
        found += [v_A[0].diff(t), v_A[2].diff(t)]
    if case.B is Contact.R:
        found += [v_B[1].diff(t), v_B[2].diff(t)]
    symbols = {f.diff(t): rate for f, rate in zip(of_time, RATE, strict=True)}
    symbols |= dict(zip(of_time, STATE, strict=True))
    return [each.subs(symbols).subs(HELD[case]) for each in found]


@cache
def solved(case):
    """Rates (8) and forces (6) of a case but RR as f(m, r, R, j, mu, eta, g, c, omega_0, alpha,
    beta, *state)."""
    unknowns = [*RATE, *FORCE_A, *FORCE_B]
    (solution,) = sp.solve(equations(case), unknowns, dict=True)
    given = [m, r, R, j, mu, eta, g, c, omega_0, alpha, beta, *STATE]
    return sp.lambdify(given, [solution[unknown] for unknown in unknowns])


def random_states(case, n, seed=0):
    """States (n, 8) of a case with entries over several orders of magnitude."""
    rng = np.random.default_rng([seed, int(case)])
    sign = rng.choice([-1.0, 1.0], (n, 8))
    x = sign * 10.0 ** rng.uniform(-3, 2, (n, 8)) * [1, 0.1, 1, 1, 1, 1, 1, 0.1]
    x[:, 0] = rng.uniform(0, 0.1, n)
    x[:, 6] = rng.uniform(0, 0.9 * P.R, n)
    x[:, [name in TRAITS[case].constraints for name in VARIABLES]] = 0.0
    if case is Case.RN:
        x[:, 5] = -x[:, 7] / P.r
    return x


def test_rolling_at_both_points_symbolically():
    """RR has one equation too few: all forces follow from B_y, all rates are free of it (23)."""
    # dv_y = 0 follows from A, dslip_z = 0 from both contacts: the doubled equation is what leaves a
    # force free.
    (solution,) = sp.solve(equations(Case.RR), [*RATE, *FORCE_A, FORCE_B[0], FORCE_B[2]], dict=True)
    plain = SimpleNamespace(m=m, r=r, R=R, j=j, mu=mu, eta=eta, g=g, c=c, drag="stokes")
    family = dynamics.rolling_family(STATE[2], plain, omega_0, FORCE_B[1])
    state = [HELD[Case.RR].get(x, x) for x in STATE]
    rates = dynamics.newton_euler(Case.RR, state, family, plain, omega_0)
    for name, mine in zip([*FORCE_A, *FORCE_B, *RATE], [*family, *rates], strict=True):
        assert sp.simplify(mine - solution.get(name, name)) == 0, str(name)


@pytest.mark.parametrize("case", [case for case in Case if case is not Case.RR])
def test_rates_and_forces_at_random_states(case):
    """Off the wall, too, by all laws of drag."""
    contacts = (0.3, 0.45, 17.0), (0.01, 0.9, 17.0), (0.9, 0.01, -17.0)
    off = {(law, given): furthest_off(case, law, *given) for law in LAWS for given in contacts}
    assert not {at: error for at, error in off.items() if error > 1e-12}


def furthest_off(case, law, mu, eta, omega_0):
    """Errors are measured against the sum of all accelerations that enter, as round-off is."""
    x, p = random_states(case, N), P.replace(drag=law, nu_f=1e-5, mu=mu, eta=eta, omega_0=omega_0)
    _, v_y, omega_c, *slips, h, v_h = x.T
    rho, fastest = p.R - h, np.abs(slips).sum(axis=0)
    c = resistance(np.sqrt(v_h**2 + v_y**2 + (rho * (omega_c - p.omega_0)) ** 2), p)
    (A_x, _, A_z), (_, B_y, B_z) = (v.T for v in slip_velocities(x, p))
    # alpha and beta (8), not used where nothing slips
    angles = np.arctan2(-A_z, A_x), np.arctan2(B_z, -B_y)
    known = solved(case)(p.m, p.r, p.R, p.j, mu, eta, p.g, c, p.omega_0, *angles, *x.T)
    expected = np.stack(np.broadcast_arrays(*known, x[:, 0]), axis=-1)[:, :14]
    drag = c * (np.abs(v_y) + np.abs(v_h) + rho * (np.abs(omega_c) + abs(omega_0)))
    turning = np.abs(omega_c) * (rho * np.abs(omega_c) + np.abs(v_y) + np.abs(v_h) + p.r * fastest)
    load = (p.g + drag + turning)[:, None]
    mine = np.concatenate([vector_field(case, x, p), *contact_forces(case, x, p)], axis=1)
    scale = np.array([1, 1, 1 / (p.R / 10), *[1 / p.r / p.j] * 3, 1, 1, *[p.m] * 6]) * load
    scale[:, [0, 6]] += np.abs(x[:, [1, 7]])
    return np.max(np.abs(mine - expected) / scale)


@pytest.mark.parametrize("case", list(Case))
def test_shapes_and_a_flow_of_its_own(case):
    """Six entries mean a closed wall."""
    x = random_states(case, 6).reshape(2, 3, 8)
    fluid = np.array([1.0, 2.0, 3.0])
    rate = vector_field(case, x, P, fluid)
    assert rate.shape == (2, 3, 8)
    single = vector_field(case, x[1, 2], P.replace(omega_0=3.0))
    np.testing.assert_allclose(rate[1, 2], single, rtol=1e-14)
    if case is not Case.RR:
        assert [f.shape for f in contact_forces(case, x, P, fluid)] == [(2, 3, 3)] * 2
    if case.B is not Contact.N:
        six = vector_field(case, x[..., :6], P)
        np.testing.assert_array_equal(six, vector_field(case, x, P)[..., :6])


@pytest.mark.parametrize(
    ("case", "x", "message"),
    [
        (Case.RS, [0, 0, 1, 1, 1, 0], "slip_x = 1 rad s-1 must be 0 in case RS"),
        (Case.SS, [0, 0, 1, 0, 1, 0], "slip speed at A = 0 m s-1 must be > 0 in case SS"),
        (Case.NS, [0, 0, 1, 1, 0, 0], "slip speed at B = 0 m s-1 must be > 0 in case NS"),
        (Case.NR, [-1, 0, 1, 1, 0, 0], "y = -1 m must be >= 0 in case NR"),
        (Case.NR, [0, 0, 1, 1, 0, 0, 0.01, 0], "h = 0.01 m must be 0 in case NR"),
        (Case.NN, [0, 0, 1, 1, 0, 0, -1, 0], "h = -1 m must be >= 0 in case NN"),
        (Case.NN, [0, 0, 1, 1, 0, 0, 0.05, 0], "h = 0.05 m must be < R = 0.05 m"),
        (
            Case.RN,
            [0, 0, 1, 0, 0, 1, 0.01, 0],
            r"v_h \+ r slip_z = 0.01 m s-1 must be 0 in case RN",
        ),
    ],
)
def test_states_of_another_case_are_refused_by_name(case, x, message):
    for function in (vector_field, contact_forces):
        with pytest.raises(InputError, match=message):
            function(case, x, P)
