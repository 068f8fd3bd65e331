"""Stability along the branch of slipping at both points (SS), between its ends in RR and SR."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from analytic.mechanics import dynamics, jacobian, roots
from analytic.stationary import slipping_branch
from model import Case, InputError, Parameters, State
from model.arrays import Array


def states(s: npt.ArrayLike, p: Parameters) -> tuple[Array, Array]:
    """States (..., 8) of SS at places s of its branch (`slipping_branch`), and their flows omega_0 (37), (41)."""
    b = slipping_branch.branch(s, p)
    unit, w = np.sqrt(p.g / p.R), b.v_A * np.sqrt(p.g * p.R) / p.r
    turn = np.sign(p.eta - p.j) * b.sin
    return State(omega_c=b.Omega_c * unit, slip_x=w * turn, slip_z=w * b.cos).stacked(), b.Omega_0 * unit


def eigenvalues_at(s: npt.ArrayLike, p: Parameters) -> npt.NDArray[np.complex128]:
    """Eigenvalues (..., 4) of SS at places s of its branch, rad s-1, rightmost first.

    Those of `jacobian.jacobian`, from the coordinates omega_c, v_A/r, alpha and slip_y/slip_z instead: near the
    ends, where slip vanishes and two directions stiffen like 1/v_A, the others would drown in its round-off.
    """
    b = slipping_branch.branch(s, p)
    unit = np.sqrt(p.g / p.R)
    omega_c, fluid, q = b.Omega_c * unit, b.Omega_0 * unit, b.v_A * np.sqrt(p.g * p.R) / p.r
    sin, cos = np.sign(p.eta - p.j) * b.sin, b.cos
    columns = []
    for d_omega, d_q, d_alpha, d_t in np.eye(4) * 1j * jacobian.STEP:
        sine, cosine = sin + d_alpha * cos, cos - d_alpha * sin
        slip_x, slip_z = (q + d_q) * sine, (q + d_q) * cosine
        x = State(omega_c=omega_c + d_omega, slip_x=slip_x, slip_y=d_t * slip_z, slip_z=slip_z)
        force = dynamics.forces(Case.SS, x, p, fluid, (sine, cosine), (d_t, 1.0))
        _, _, orbit, f_x, f_y, f_z, _, _ = dynamics.newton_euler(Case.SS, x, force, p, fluid)
        # At the solution itself all rates vanish, so that the frame may be held fixed.
        rates = (orbit, sin * f_x + cos * f_z, (cos * f_x - sin * f_z) / q, f_y / (q * cos))
        columns.append(np.stack([np.imag(rate) / jacobian.STEP for rate in rates], axis=-1))
    return jacobian.eigenvalues(np.stack(columns, axis=-1))


def hopf_places(p: Parameters) -> list[float]:
    """Places s of the branch at which a complex pair crosses the imaginary axis (Hopf).

    For eta < j none but for large mu. For eta > j, with (12) released, there is one in Fig. 12. `InputError` if the
    branch has a gap, as far beyond j.
    """
    s = np.linspace(-30.0, 30.0, 1201)
    if not np.all(np.isfinite(slipping_branch.branch(s, p).Omega_c)):
        raise InputError(f"eta = {p.eta:g} is out of range: SS has no whole branch, so far beyond j = {p.j:g}")

    def pair_sums(s: npt.ArrayLike) -> Array:
        """Product of the sums of all pairs of eigenvalues: zero where lambda_i = -lambda_k."""
        values = eigenvalues_at(s, p)
        product = np.ones(values.shape[:-1], dtype=complex)
        for i, k in zip(*np.triu_indices(4, 1), strict=True):
            total = values[..., i] + values[..., k]
            product = product * total / (1 + np.abs(total))  # bounded, the zeros stay
        return np.asarray(product.real)

    values, places = pair_sums(s), []
    for k in np.flatnonzero(np.sign(values[1:]) * np.sign(values[:-1]) < 0):
        place = float(roots.bisected(pair_sums, s[k], s[k + 1]))
        pair = eigenvalues_at(place, p)
        if np.any((np.abs(pair.real) < 1e-6 * np.abs(pair.imag)) & (pair.imag > 0)):
            places.append(place)
    return places
