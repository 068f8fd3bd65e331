"""Exact Jacobians of the vector fields, by complex steps through them, and their eigenvalues."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from analytic import dynamics
from model import Case, Contact, Parameters, State
from model.arrays import Array, Real
from model.cases import TRAITS

STEP = 1e-100
"""Complex step: its square vanishes beside any state, so that the derivative is exact to round-off."""


def jacobian(case: Case, x: npt.ArrayLike, p: Parameters) -> Array:
    """Exact Jacobians of the vector field at states x (..., 6 or 8), shape (..., d, d), rad s-1.

    Rows and columns are the active variables of the case, ``TRAITS[case].active``; in RN slip_z moves with v_h.
    """
    state = dynamics.check_state(case, x, p)
    active = TRAITS[case].active
    columns = []
    for name in active:
        z = State(*(np.asarray(column, dtype=complex) for column in state))
        z = z._replace(**{name: getattr(z, name) + 1j * STEP})
        if case is Case.RN:
            z = z._replace(slip_z=-z.v_h / p.r)
        rates = _complex_rates(case, z, p, p.omega_0)
        rows = (np.imag(getattr(rates, row)) / STEP for row in active)
        columns.append(np.stack(np.broadcast_arrays(*rows), axis=-1))
    return np.stack(np.broadcast_arrays(*columns), axis=-1)


def eigenvalues(matrix: Array) -> npt.NDArray[np.complex128]:
    """Eigenvalues (..., d) of matrices (..., d, d), rightmost first."""
    # From stiff slip to slow orbit: graded downwards, which keeps the small ones accurate.
    values: npt.NDArray[np.complex128] = np.linalg.eigvals(matrix[..., ::-1, ::-1].astype(complex))
    order = np.lexsort((values.imag, -values.real), axis=-1)
    return np.take_along_axis(values, order, axis=-1)


def _complex_rates(case: Case, x: State, p: Parameters, fluid: Real) -> State:
    """`dynamics.rates` with slip directions that are analytic in x."""
    if case is Case.RR:
        return dynamics.rates(case, x, p, fluid)
    directions = {}
    for name, contact, (sine, cosine) in zip(
        ("slip_A", "slip_B"), (case.A, case.B), dynamics.slides(x, p), strict=True
    ):
        if contact is Contact.S:
            size = np.maximum(np.abs(sine), np.abs(cosine))
            speed = size * np.sqrt((sine / size) ** 2 + (cosine / size) ** 2)
            directions[name] = (sine / speed, cosine / speed)
    return dynamics.newton_euler(case, x, dynamics.forces(case, x, p, fluid, **directions), p, fluid)
