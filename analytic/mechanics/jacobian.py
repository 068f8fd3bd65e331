"""Exact Jacobians of the vector fields, by complex steps through them, and their eigenvalues."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from analytic.mechanics import dynamics
from model import Case, Parameters, State
from model.arrays import Array
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
        rates = dynamics.rates(case, z, p, p.omega_0)
        rows = (np.imag(getattr(rates, row)) / STEP for row in active)
        columns.append(np.stack(np.broadcast_arrays(*rows), axis=-1))
    return np.stack(np.broadcast_arrays(*columns), axis=-1)


def eigenvalues(matrix: Array) -> npt.NDArray[np.complex128]:
    """Eigenvalues (..., d) of matrices (..., d, d), rightmost first."""
    # From stiff slip to slow orbit: graded downwards, which keeps the small ones accurate.
    values: npt.NDArray[np.complex128] = np.linalg.eigvals(matrix[..., ::-1, ::-1].astype(complex))
    order = np.lexsort((values.imag, -values.real), axis=-1)
    return np.take_along_axis(values, order, axis=-1)
