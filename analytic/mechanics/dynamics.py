"""Contact forces, vector fields and Jacobians of the nine kinematic cases: (20)-(29), and RN, SN,
NN.

The forces follow from the state, case by case (`forces`); the rates follow from the forces by
Newton and Euler (20), the same way in every case (`rates`). Both take floats or arrays and check
nothing, since an integrator calls them in its innermost loop. `contact_forces` and `vector_field`
are the public functions: they take arrays of states and check them against the case. Jacobians come
from complex steps through the vector fields.

Away from the wall the drag (9) is extended by a radial part -m c rho', and the fluid rotates as one
rigid body. c is c(|w|), see `analytic.mechanics.drag`."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from analytic.mechanics import drag, rolling_forces
from analytic.mechanics.rigid_body import Forces as Forces
from model import Case, Contact, InputError, Parameters, State
from model.arrays import Array, Complex, Real
from model.cases import TRAITS
from model.errors import check_type
from model.kinematics import UNITS, VARIABLES

STEP = 1e-100
"""Complex step: its square vanishes beside any state, so that derivatives are exact."""
Direction = tuple[Real, Real]
"""Sine and cosine of a slip direction (8)."""


def vector_field(
    case: Case, x: npt.ArrayLike, p: Parameters, omega_0: npt.ArrayLike | None = None
) -> Array:
    """Rate of change of states x in a case: (23)-(28), and the same for RN, SN, NN.

    Parameters
    ----------
    x : states, shape (..., 6) or (..., 8), see `model.kinematics`
    omega_0 : of the fluid in rad s-1 if it isn't ``p.omega_0``; broadcast against (...)

    Returns
    -------
    Array
        dx/dt, shape of x. Whether forces are admissible is not checked, see `contact_forces`.

    Raises `InputError` if x isn't a state of the case (`check_state`)."""
    case = Case(case)
    state, fluid = _checked(case, x, p, omega_0)
    return rates(case, state, p, fluid).stacked()[..., : np.shape(x)[-1]]


def contact_forces(
    case: Case, x: npt.ArrayLike, p: Parameters, omega_0: npt.ArrayLike | None = None
) -> tuple[Array, Array]:
    """Contact forces F_A, F_B on the ball, N, (..., 3), of a case: (16), (17), (21), (29).

    A negative normal force, or friction beyond Coulomb's, means that the case can't go on. In RR
    the forces are a one-parameter family; this is the member of least friction utilisation
    (`rolling_forces.least_utilisation`).

    Parameters and errors as of `vector_field`; also `InputError` for RR that no forces can hold."""
    case = Case(case)
    state, fluid = _checked(case, x, p, omega_0)
    if case is Case.RR:
        best = rolling_forces.least_utilisation(state.omega_c, p, fluid)
        if np.any(stuck := (best.utilisation > 1) | np.isnan(best.B_y)):
            least = state.omega_c, best.utilisation
            value, need = (np.extract(stuck, np.broadcast_to(a, stuck.shape))[0] for a in least)
            raise InputError(
                f"omega_c = {value:g} rad s-1 cannot be rolled at both points: "
                f"it takes {need:.4g} times the friction there is, the limit is 1"
            )
    components = forces(case, state, p, fluid)
    both = np.stack(np.broadcast_arrays(*components, state.omega_c, fluid)[:6], axis=-1)
    return both[..., :3], both[..., 3:]


def check_state(case: Case, x: npt.ArrayLike, p: Parameters) -> State:
    """States x (..., 6 or 8) as columns; `InputError` if one violates the case (Tables 3 and 4).

    The constraints must hold exactly (v_h + r slip_z to round-off), a slipping contact must slip,
    and an open contact needs a gap of zero or more, less than R at the wall."""
    state = State.of(x)
    columns = state._asdict()
    for name in TRAITS[case].constraints:
        if name in columns:
            _refuse(columns[name] != 0, columns[name], name, f"must be 0 in case {case.name}")
        else:
            slide = state.v_h + p.r * state.slip_z
            wrong = np.abs(slide) > 4 * np.finfo(float).eps * np.abs(state.v_h)
            _refuse(wrong, slide, "v_h + r slip_z", f"must be 0 in case {case.name}")
    if case.A is Contact.N:
        _refuse(state.y < 0, state.y, "y", f"must be >= 0 in case {case.name}")
    if case.B is Contact.N:
        _refuse(state.h < 0, state.h, "h", f"must be >= 0 in case {case.name}")
        _refuse(state.h >= p.R, state.h, "h", f"must be < R = {p.R:g} m")
    contacts = zip("AB", (case.A, case.B), sliding_velocities(state, p), strict=True)
    for point, contact, slide in contacts:
        if contact is Contact.S:
            speed = np.hypot(*slide)
            _refuse(speed == 0, speed, f"slip speed at {point}", f"must be > 0 in case {case.name}")
    return state


def rates(case: Case, x: Sequence[Real], p: Parameters, omega_0: Real) -> State:
    """Rates of the eight state variables by (20) under the forces of the case; x is not checked."""
    _, _, omega_c, *_ = x
    rolls = case is Case.RR
    f = rolling_family(omega_c, p, omega_0, 0.0) if rolls else forces(case, x, p, omega_0)
    return newton_euler(case, x, f, p, omega_0)


def newton_euler(
    case: Case, x: Sequence[Real], f: Sequence[Real], p: Parameters, omega_0: Real
) -> State:
    """Rates of the eight variables under forces f, (20); what the case holds at zero is zero.

    For h = 0 this is (21). Off the wall, with rho = R - h and the spin o of the ball in the
    co-rotating frame: m(v_h' + rho omega_c^2) = A_x + B_x - m c v_h, m(rho omega_c' - 2 v_h
    omega_c) = A_z + B_z - m c rho D, j m r(o_x' + omega_c o_z) = -A_z, j m r o_y' = B_z, j m r(o_z'
    - omega_c o_x) = A_x - B_y."""
    _, v_y, omega_c, w_x, _, w_z, h, v_h = x
    A_x, A_y, A_z, B_x, B_y, B_z = f
    rho, jmr, c = p.R - h, p.j * p.m * p.r, _drag_rate(x, p, omega_0)
    push = (A_z + B_z) / p.m - c * rho * (omega_c - omega_0)
    dv_y = (A_y + B_y) / p.m - p.g - c * v_y
    dv_h = (A_x + B_x) / p.m - c * v_h - rho * omega_c**2
    droll = (push + v_h * omega_c) / p.r  # (rho omega_c)'/r, the rate of the rolling part (4)
    dw_x = -A_z / jmr - omega_c * (v_y / p.r + w_z) - droll
    dw_z = (A_x - B_y) / jmr + omega_c * (rho * omega_c / p.r + w_x) - dv_y / p.r
    if case is Case.RN:
        dw_z = -dv_h / p.r  # v_h + r slip_z stays 0
    rate = [v_y, dv_y, (push + 2 * v_h * omega_c) / rho, dw_x, B_z / jmr + droll, dw_z, v_h, dv_h]
    for k in _HELD[case]:
        rate[k] = 0.0
    return State(*rate)


def forces(
    case: Case,
    x: Sequence[Real],
    p: Parameters,
    omega_0: Real,
    slip_A: Direction | None = None,
    slip_B: Direction | None = None,
) -> Forces:
    """The forces in a case; x is eight variables, not checked.

    In RR those of least friction utilisation, or with B_y = 0 where none can hold it. Sine and
    cosine of the slip directions alpha, beta (8) are taken from x; give `slip_A`, `slip_B` for the
    limit of vanishing slip in a direction (53)."""
    if case is Case.RR:
        _, _, omega_c, *_ = x
        B_y = rolling_forces.least_utilisation(omega_c, p, omega_0).B_y
        return rolling_family(omega_c, p, omega_0, np.where(np.isnan(B_y), 0.0, B_y))
    given = zip((case.A, case.B), (slip_A, slip_B), sliding_velocities(x, p), strict=True)
    slips = (slip or direction(*slide) for contact, slip, slide in given if contact is Contact.S)
    return FORCES[case](x, p, omega_0, *slips)


def rolling_family(omega_c: Real, p: Parameters, omega_0: Real, B_y: Real) -> Forces:
    """The forces of RR with the one free component B_y in N: (21) with (23)."""
    u = p.m * p.R * omega_c**2
    c = drag.of_velocity(0.0, 0.0, p.R * (omega_c - omega_0), p)
    z = p.j * p.m * p.R * c * (omega_c - omega_0) / (1 + 2 * p.j)
    return Forces(B_y - p.j * u, p.m * p.g - B_y, z, (1 + p.j) * u - B_y, B_y, z)


def _drag_rate(x: Sequence[Real], p: Parameters, omega_0: Real) -> Real:
    """The rate c(|w|) of drag in a state, s-1."""
    _, v_y, omega_c, _, _, _, h, v_h = x
    return drag.of_velocity(v_h, v_y, (p.R - h) * (omega_c - omega_0), p)


def _rs(x: Sequence[Real], p: Parameters, omega_0: Real, slip_B: Direction) -> Forces:
    """Forces of RS (24): w_z stays 0 without B_y, so that A_x alone turns the spin axis."""
    (_, _, omega_c, *_), (sine, _) = x, slip_B
    u = p.m * p.R * omega_c**2
    B_x = (1 + p.j) * u
    B_z = -p.eta * B_x * sine
    A_z = p.j * (p.m * p.R * _drag_rate(x, p, omega_0) * (omega_c - omega_0) - B_z) / (1 + p.j)
    return Forces(-p.j * u, p.m * p.g, A_z, B_x, 0.0, B_z)


def _sr(x: Sequence[Real], p: Parameters, omega_0: Real, slip_A: Direction) -> Forces:
    """Forces of SR: (25), (29)."""
    (_, _, omega_c, w_x, *_), (sine, _) = x, slip_A
    B_y = p.j * p.m * (p.R * omega_c**2 + p.r * omega_c * w_x)
    A_y = p.m * p.g - B_y
    A_z = p.mu * A_y * sine
    B_z = p.j * (p.m * p.R * _drag_rate(x, p, omega_0) * (omega_c - omega_0) - A_z) / (1 + p.j)
    return Forces(0.0, A_y, A_z, p.m * p.R * omega_c**2, B_y, B_z)


def _ss(
    x: Sequence[Real], p: Parameters, omega_0: Real, slip_A: Direction, slip_B: Direction
) -> Forces:
    """Forces of SS: (26), (29)."""
    _, _, omega_c, *_ = x
    u, G = p.m * p.R * omega_c**2, p.m * p.g
    (sA, cA), (sB, cB) = slip_A, slip_B
    determinant = 1 + p.mu * p.eta * cA * cB
    A_y = (G - p.eta * cB * u) / determinant
    B_x = (u + p.mu * cA * G) / determinant
    return Forces(-p.mu * A_y * cA, A_y, p.mu * A_y * sA, B_x, p.eta * B_x * cB, -p.eta * B_x * sB)


def _nr(x: Sequence[Real], p: Parameters, omega_0: Real) -> Forces:
    """Forces of NR: (27)."""
    (_, v_y, omega_c, w_x, *_), c = x, _drag_rate(x, p, omega_0)
    B_y = p.j * p.m * (p.g + c * v_y + p.R * omega_c**2 + p.r * omega_c * w_x) / (1 + p.j)
    B_z = p.j * p.m * p.R * c * (omega_c - omega_0) / (1 + p.j)
    return Forces(0.0, 0.0, 0.0, p.m * p.R * omega_c**2, B_y, B_z)


def _ns(x: Sequence[Real], p: Parameters, omega_0: Real, slip_B: Direction) -> Forces:
    """Forces of NS: (28), (29)."""
    (_, _, omega_c, *_), (sine, cosine) = x, slip_B
    u = p.m * p.R * omega_c**2
    return Forces(0.0, 0.0, 0.0, u, p.eta * u * cosine, -p.eta * u * sine)


def _rn(x: Sequence[Real], p: Parameters, omega_0: Real) -> Forces:
    """Forces of a ball that rolls on the floor off the wall: drag alone drives the friction."""
    _, _, omega_c, _, _, _, h, v_h = x
    share = p.j * p.m * _drag_rate(x, p, omega_0) / (1 + p.j)
    return Forces(share * v_h, p.m * p.g, share * (p.R - h) * (omega_c - omega_0))


def _sn(x: Sequence[Real], p: Parameters, omega_0: Real, slip_A: Direction) -> Forces:
    """Forces of a ball that slips on the floor away from the wall."""
    G, (sine, cosine) = p.m * p.g, slip_A
    return Forces(-p.mu * G * cosine, G, p.mu * G * sine)


FORCES: dict[Case, Callable[..., Forces]] = {
    Case.RS: _rs,
    Case.SR: _sr,
    Case.SS: _ss,
    Case.NR: _nr,
    Case.NS: _ns,
    Case.RN: _rn,
    Case.SN: _sn,
    Case.NN: lambda x, p, omega_0: Forces(),
}
"""Forces of each case but RR from x, p, omega_0 and the directions of its slips, A before B."""

_HELD = {
    case: [VARIABLES.index(name) for name in traits.constraints if name in VARIABLES]
    for case, traits in TRAITS.items()
}
"""Indices of the variables that a case holds at zero."""


def sliding_velocities(x: Sequence[Real], p: Parameters) -> tuple[Direction, Direction]:
    """Sliding speeds, m s-1, at A, B along sine and cosine of alpha, beta: (6), (8)."""
    _, v_y, _, w_x, w_y, w_z, _, v_h = x
    return (p.r * w_x, v_h + v_y + p.r * w_z), (p.r * w_y, p.r * w_z)


def direction(along_sine: Real, along_cosine: Real) -> Direction:
    """Sine and cosine of the direction of a slip; analytic in complex components."""
    if np.iscomplexobj(along_sine):
        size = np.maximum(np.abs(along_sine), np.abs(along_cosine))
        speed = size * np.sqrt((along_sine / size) ** 2 + (along_cosine / size) ** 2)
    else:
        hypot = math.hypot if isinstance(along_sine, float) else np.hypot
        speed = hypot(along_sine, along_cosine)
    return along_sine / speed, along_cosine / speed


def _checked(
    case: Case, x: npt.ArrayLike, p: Parameters, omega_0: npt.ArrayLike | None
) -> tuple[State, Array]:
    """States, as columns, and the flow, rad s-1; `InputError` if one of them violates the case."""
    check_type("p", p, Parameters)
    state = check_state(case, x, p)
    fluid = np.asarray(p.omega_0 if omega_0 is None else omega_0, dtype=float)
    _refuse(~np.isfinite(fluid), fluid, "omega_0", "must be finite", "rad s-1")
    return state, fluid


def _refuse(wrong: Real, values: Real, name: str, rule: str, unit: str | None = None) -> None:
    """Raise `InputError` with the first of the values that is wrong."""
    if np.any(wrong):
        value = np.extract(wrong, values)[0]
        unit = unit or dict(zip(VARIABLES, UNITS, strict=True)).get(name, "m s-1")
        raise InputError(f"{name} = {value:g} {unit} {rule}")


def jacobian(case: Case, x: npt.ArrayLike, p: Parameters) -> Array:
    """Exact Jacobians of the vector field at states x (..., 6 or 8), shape (..., d, d), rad s-1.

    Rows and columns are ``TRAITS[case].active``; in RN slip_z moves with v_h."""
    state = check_state(case, x, p)
    active = TRAITS[case].active
    columns = []
    for name in active:
        z = State(*(np.asarray(column, dtype=complex) for column in state))
        z = z._replace(**{name: getattr(z, name) + 1j * STEP})
        if case is Case.RN:
            z = z._replace(slip_z=-z.v_h / p.r)
        dx = rates(case, z, p, p.omega_0)
        rows = (np.imag(getattr(dx, row)) / STEP for row in active)
        columns.append(np.stack(np.broadcast_arrays(*rows), axis=-1))
    return np.stack(np.broadcast_arrays(*columns), axis=-1)


def eigenvalues(matrix: Array) -> Complex:
    """Eigenvalues (..., d) of matrices (..., d, d), rightmost first."""
    # From stiff slip to slow orbit: graded downwards, which keeps the small ones accurate.
    values: Complex = np.linalg.eigvals(matrix[..., ::-1, ::-1].astype(complex))
    order = np.lexsort((values.imag, -values.real), axis=-1)
    return np.take_along_axis(values, order, axis=-1)
