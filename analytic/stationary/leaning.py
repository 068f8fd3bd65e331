"""SR near its stationary solution, where the floor carries nothing: A_y = 0 is the border to NR (Proposition 3).

The eigenvalues of f_SR show only on the side where the ball leans on the floor, A_y > 0; on the other it lifts off.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from analytic.mechanics import drag, jacobian
from analytic.stationary import solutions as stationary
from model import Case, InputError, Parameters


def leaning_modes(p: Parameters) -> tuple[npt.NDArray[np.complex128], npt.NDArray[np.complex128]]:
    """Eigenvalues (2,) in rad s-1 of f_SR at its stationary solution, and unit vectors (2, 2), one a row.

    The first is that of leaning on the floor, which decays for omega_0 > omega_03 and grows below; the second that
    of the orbit, the one closer to -c/(1+j). Vectors are over (omega_c, slip_x) and lead to A_y > 0. With s the sign
    of slip_x the sum of the two is -(c + mu s (g/(R omega_0) - (1+j) omega_0))/(1+j), their product
    -mu s c omega_0/(1+j), where c is that of a vanishing lag.

    Raises `InputError` if SR has no stationary solution that leans: for mu = 0, omega_0 = 0, and at omega_03, where
    slip_x = 0.
    """
    leaning = [s.state for s in stationary.stationary_solutions(p, (Case.SR,)) if p.mu > 0]
    if not leaning:
        raise InputError(
            f"omega_0 = {p.omega_0:g} rad s-1, mu = {p.mu:g}: SR has no stationary solution that leans on the floor"
        )
    (x,) = leaning
    values, vectors = np.linalg.eig(jacobian.jacobian(Case.SR, x, p).astype(complex))
    first = int(np.argmax(np.abs(values + drag.coefficient(0.0, p) / (1 + p.j))))
    order = [first, 1 - first]
    # How A_y falls with omega_c and slip_x.
    falls = np.array([2 * p.R * x.omega_c + p.r * x.slip_x, p.r * x.omega_c])
    rows = vectors.T[order]
    return values[order], rows * np.where((rows @ falls).real > 0, -1.0, 1.0)[:, None]
