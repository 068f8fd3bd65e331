"""Newton-Euler (20) from nothing but vectors, in sympy: an origin of the equations of motion the code doesn't share.

The ball's centre stands at (-rho, r + y, 0) in the co-rotating frame (1), with rho = R - h; its angular velocity is
split by (4), with rho for R. Everything else is differentiation of vectors in a rotating frame.
"""

from collections.abc import Callable
from functools import cache
from types import SimpleNamespace

import sympy as sp

from model.cases import TRAITS, Case, Contact

t = sp.Symbol("t")
m, r, R, j, mu, eta, g, c = sp.symbols("m r R j mu eta g c", positive=True)
omega_0, alpha, beta = sp.symbols("omega_0 alpha beta", real=True)
PARAMETERS = SimpleNamespace(m=m, r=r, R=R, j=j, mu=mu, eta=eta, g=g, c=c, drag="stokes")
"""Stands for `Parameters`: forces, rates and bounds are plain arithmetic."""
NAMES = ("y", "v_y", "omega_c", "slip_x", "slip_y", "slip_z", "h", "v_h")
STATE = sp.symbols(NAMES, real=True)
RATE = sp.symbols([f"d{name}" for name in NAMES], real=True)
FORCE_A = sp.Matrix(sp.symbols("A_x A_y A_z", real=True))
FORCE_B = sp.Matrix(sp.symbols("B_x B_y B_z", real=True))

_OF_T = [sp.Function(name)(t) for name in NAMES]
_TO_SYMBOLS = {sp.diff(f, t): rate for f, rate in zip(_OF_T, RATE, strict=True)} | dict(zip(_OF_T, STATE, strict=True))


def _symbols(expression):
    return expression.subs(_TO_SYMBOLS)


def _vectors():
    """Velocities of C, A, B and the spin, as functions of time."""
    y, _, omega_c, w_x, w_y, w_z, h, _ = _OF_T
    rho = R - h
    frame = sp.Matrix([0, omega_c, 0])
    position = sp.Matrix([-rho, r + y, 0])
    kinematic = {sp.diff(y, t): _OF_T[1], sp.diff(h, t): _OF_T[7]}
    v_C = (position.diff(t) + frame.cross(position)).subs(kinematic)
    spin = sp.Matrix([rho * omega_c / r + w_x, -rho * omega_c / r + w_y, _OF_T[1] / r + w_z])
    v_A = v_C + spin.cross(sp.Matrix([0, -r, 0]))
    v_B = v_C + spin.cross(sp.Matrix([-r, 0, 0]))
    return frame, v_C, spin, v_A, v_B, rho


def balance() -> list[sp.Expr]:
    """The six equations (20), each zero, linear in rates and forces, and the two kinematic ones."""
    frame, v_C, spin, _, _, rho = _vectors()
    a_C = v_C.diff(t) + frame.cross(v_C)
    epsilon = spin.diff(t) + frame.cross(spin)
    fluid = sp.Matrix([0, 0, rho * omega_0])
    drag = -m * c * (v_C - fluid)
    newton = sp.Matrix([0, -m * g, 0]) + FORCE_A + FORCE_B + drag - m * a_C
    torque = sp.Matrix([0, -r, 0]).cross(FORCE_A) + sp.Matrix([-r, 0, 0]).cross(FORCE_B)
    euler = torque - j * m * r**2 * epsilon  # omega x J omega vanishes for a sphere
    return [_symbols(e) for e in (*newton, *euler)] + [RATE[0] - STATE[1], RATE[6] - STATE[7]]


def closure(case: Case) -> list[sp.Expr]:
    """What Table 3 adds in a case: known force components, and the rates of the constraints, each zero."""
    _, _, _, v_A, v_B, _ = _vectors()
    equations: list[sp.Expr] = []
    if case.A is Contact.N:
        equations += list(FORCE_A)
    else:
        equations.append(RATE[1])
    if case.B is Contact.N:
        equations += list(FORCE_B)
    else:
        equations.append(RATE[7])
    if case.A is Contact.S:  # (14) with dir v_A = (cos alpha, 0, -sin alpha)
        equations += [FORCE_A[0] + mu * FORCE_A[1] * sp.cos(alpha), FORCE_A[2] - mu * FORCE_A[1] * sp.sin(alpha)]
    if case.B is Contact.S:  # (15) with dir v_B = (0, -cos beta, sin beta)
        equations += [FORCE_B[1] - eta * FORCE_B[0] * sp.cos(beta), FORCE_B[2] + eta * FORCE_B[0] * sp.sin(beta)]
    if case.A is Contact.R:
        equations += [_symbols(v_A[0].diff(t)), _symbols(v_A[2].diff(t))]
    if case.B is Contact.R:
        equations += [_symbols(v_B[1].diff(t)), _symbols(v_B[2].diff(t))]
    return equations


def held(case: Case) -> dict[sp.Symbol, sp.Expr]:
    """The constraints of a case as substitutions."""
    names = dict(zip(NAMES, STATE, strict=True))
    values = {names[name]: sp.Integer(0) for name in TRAITS[case].constraints if name in names}
    return values | ({names["slip_z"]: -names["v_h"] / r} if case is Case.RN else {})


@cache
def solved(case: Case) -> Callable[..., list]:
    """Rates (8) and forces (6) of a case but RR as f(m, r, R, j, mu, eta, g, c, omega_0, alpha, beta, *state)."""
    unknowns = [*RATE, *FORCE_A, *FORCE_B]
    (solution,) = sp.solve([e.subs(held(case)) for e in balance() + closure(case)], unknowns, dict=True)
    given = [m, r, R, j, mu, eta, g, c, omega_0, alpha, beta, *STATE]
    return sp.lambdify(given, [solution[unknown] for unknown in unknowns])
