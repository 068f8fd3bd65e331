"""The branch of stationary slipping at both points (SS): (37)-(42), its fold (87)-(90), stability.

The branch is given in the groups of the model: Omega = omega sqrt(R/g), kappa = c sqrt(R/g), forces
in units of m g, speeds in units of sqrt(g R). A point on it is given by ``s = ln|tan alpha|``, from
-inf where the slip ends in RR (alpha = 0) to +inf where it ends in SR (alpha = -pi/2): no digit is
lost at either end. Here omega_c > 0; the other sense of rotation is the mirror image.

Friction and normal forces along the branch don't depend on the law of drag
(`analytic.mechanics.drag`). It says which lag Omega_0 - Omega_c the drag needs to balance friction,
and how much more drag a little more lag brings: `stiffness`, which is kappa for Stokes' law.

Functions take the place s, parameters, and mu and eta if not those of p: floats or arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from analytic.mechanics import drag, dynamics, roots
from model import Case, InputError, Parameters, State
from model.arrays import Array, Complex

END = 80.0
"""|s| at which the ends are reached to round-off: tan alpha = exp(-80) = 2e-35."""


@dataclass(frozen=True)
class BranchPoint:
    """A point of the branch, or many: arrays of one shape, dimensionless."""

    cos: Array
    """cos alpha, > 0."""
    sin: Array
    """|sin alpha|; alpha itself has the sign of eta - j."""
    Omega_c: Array
    Omega_0: Array
    """The flow that belongs to the point (41)."""
    drag: Array
    """The drag that friction holds, in units of m g."""
    stiffness: Array
    """d drag/d Omega_0 at constant Omega_c: kappa for Stokes' law."""
    v_A: Array
    """Slip speed at A in units of sqrt(g R) (39)."""
    A_y: Array
    """Normal force of the floor in units of m g (42)."""
    B_x: Array
    """Normal force of the wall in units of m g (42)."""


def branch(
    s: npt.ArrayLike,
    p: Parameters,
    mu: npt.ArrayLike | None = None,
    eta: npt.ArrayLike | None = None,
) -> BranchPoint:
    """Points s = ln|tan alpha| of the branch (37)-(42); needs mu > 0 and drag.

    For eta > j the branch has A_y < 0: it solves the equations once (12) is released (Fig. 12). It
    is nan where not even then a solution exists."""
    s, mu, eta = np.asarray(s, dtype=float), *_friction(p, mu, eta)
    # each to full relative accuracy
    cos, sin = 1 / np.hypot(1.0, np.exp(s)), 1 / np.hypot(1.0, np.exp(-s))
    den = _denominator(cos, p.j, mu, eta)
    den = np.where(den > 0, den, np.nan)
    Omega_c = np.sqrt(mu * (1 + eta * cos**2) / den)
    slip = mu * np.abs(p.j - eta) * sin / den
    held = cos * slip
    lag = drag.speed_of(p.g * held, p)
    Omega_0, stiffness = Omega_c + lag / np.sqrt(p.g * p.R), drag.slope(lag, p) * np.sqrt(p.R / p.g)
    v_A, A_y, B_x = slip / (p.j * Omega_c), (p.j - eta) * cos / den, mu * (1 + p.j * cos**2) / den
    values = cos, sin, Omega_c, Omega_0, held, stiffness, v_A, A_y, B_x
    return BranchPoint(*np.broadcast_arrays(*values))


def slope(
    s: npt.ArrayLike,
    p: Parameters,
    mu: npt.ArrayLike | None = None,
    eta: npt.ArrayLike | None = None,
) -> Array:
    """A multiple > 0 of d omega_0/d|alpha| (89) for eta < j: its zero is the fold.

    k (1 + 2 mu eta cos - eta cos^2)/(2 Omega_c |sin|) + den/tan^2 - mu eta (1 - j cos^2) with k the
    stiffness, which is d Omega_0/d|alpha| without the factor mu (j - eta) sin^2/(k den^2). For eta
    > j its first term, and with it the slope of Omega_c, changes sign."""
    orbit, lag = _slopes(s, p, mu, eta)
    return np.asarray(orbit + lag)


def characteristic_slope(s: npt.ArrayLike, p: Parameters) -> Array:
    """d omega_c/d omega_0 along the branch: 0 at the end in RR, infinite at the fold, then < 0."""
    orbit, lag = _slopes(s, p)
    return np.asarray(orbit / (orbit + lag))


def _slopes(
    s: npt.ArrayLike,
    p: Parameters,
    mu: npt.ArrayLike | None = None,
    eta: npt.ArrayLike | None = None,
) -> tuple[Array, Array]:
    """d Omega_c/d|alpha| and d(Omega_0 - Omega_c)/d|alpha|, without the factor as in `slope`."""
    at = branch(s, p, mu, eta)
    mu, eta = _friction(p, mu, eta)
    turned = 1 + 2 * mu * eta * at.cos - eta * at.cos**2
    orbit = np.sign(p.j - eta) * at.stiffness * turned / (2 * at.Omega_c * at.sin)
    den = _denominator(at.cos, p.j, mu, eta)
    lag = den * (at.cos / at.sin) ** 2 - mu * eta * (1 - p.j * at.cos**2)
    return np.asarray(orbit), np.asarray(lag)


def light_drag(p: Parameters) -> float:
    """The stiffness where the lag vanishes, at both ends: kappa, but 0 for the quadratic law."""
    return float(drag.coefficient(0.0, p)) * float(np.sqrt(p.R / p.g))


def eta_critical(mu: npt.ArrayLike, p: Parameters) -> Array:
    """eta_cr (87): the fold needs larger eta; inf for mu = 0 with drag, nan without either.

    The fold is born in SR, where the lag vanishes: for every law the drag of a slight lag decides.
    """
    mu, light = np.asarray(mu, dtype=float), light_drag(p)
    ratio = np.where(mu > 0, light / np.where(mu > 0, 2 * mu, 1.0), np.inf if p.c > 0 else np.nan)
    return np.asarray(ratio**2)


def fold(
    p: Parameters,
    mu: npt.ArrayLike | None = None,
    eta: npt.ArrayLike | None = None,
    released: bool = False,
) -> Array:
    """The place s of the fold (88) by a bracketed root of `slope`; nan where there is none.

    It exists for eta_cr < eta < j (87) and drag, and is then unique for every law whose drag force
    grows ever faster with the lag, as those of `model.drag` do (docs/theory.md); with (12)
    `released` also for eta > j, as long as the whole branch exists."""
    mu, eta = np.broadcast_arrays(*_friction(p, mu, eta))
    exists = (eta > eta_critical(mu, p)) & (eta < p.j) & (p.c > 0)
    if released:
        lowest = np.clip((eta - p.j) / np.where(mu * eta > 0, 2 * p.j * mu * eta, 1.0), 0.0, 1.0)
        whole = _denominator(lowest, p.j, mu, eta) > 0
        exists = exists | (eta > p.j) & (mu > 0) & (p.c > 0) & whole
    if not np.any(exists):
        return np.full(mu.shape, np.nan)
    # Valid numbers where there is no fold; the root there is discarded.
    safe_mu, safe_eta = np.where(exists, mu, 1.0), np.where(exists, eta, p.j / 2)
    places = roots.sign_change(lambda s: slope(s, p, safe_mu, safe_eta), -END, END)
    return np.where(exists, places, np.nan)


def points_at(p: Parameters) -> list[float]:
    """Places s of the branch in the flow p.omega_0 > 0, in the order of |alpha|; [] if none.

    The branch rises with Omega_0 from RR to the fold, then falls: at most one of each part."""
    if not (p.mu > 0 and p.c > 0 and p.eta < p.j):
        return []
    turning = float(fold(p))
    parts = [(-END, END)] if np.isnan(turning) else [(-END, turning), (turning, END)]

    def excess(s: Array) -> Array:
        return branch(s, p).Omega_0 - p.Omega_0

    places = [float(roots.sign_change(excess, *part)) for part in parts]
    return [s for s in places if not np.isnan(s)]


def _friction(
    p: Parameters, mu: npt.ArrayLike | None, eta: npt.ArrayLike | None
) -> tuple[Array, Array]:
    """The given coefficients, or those of p."""
    mu, eta = p.mu if mu is None else mu, p.eta if eta is None else eta
    return np.asarray(mu, dtype=float), np.asarray(eta, dtype=float)


def _denominator(cos: Array, j: float, mu: Array, eta: Array) -> Array:
    """N, by which the closed forms (38)-(42) are divided."""
    return np.asarray((1 + j * cos**2) * mu * eta + (j - eta) * cos)


def states(s: npt.ArrayLike, p: Parameters) -> tuple[Array, Array]:
    """States (..., 8) of SS at places s of its branch, and their flows omega_0 (37), (41)."""
    b = branch(s, p)
    unit, w = np.sqrt(p.g / p.R), b.v_A * np.sqrt(p.g * p.R) / p.r
    turn = np.sign(p.eta - p.j) * b.sin
    x = State(omega_c=b.Omega_c * unit, slip_x=w * turn, slip_z=w * b.cos)
    return x.stacked(), b.Omega_0 * unit


def eigenvalues_at(s: npt.ArrayLike, p: Parameters) -> Complex:
    """Eigenvalues (..., 4) of SS at places s of its branch, rad s-1, rightmost first.

    Those of `dynamics.jacobian`, from the coordinates omega_c, v_A/r, alpha and slip_y/slip_z
    instead: near the ends, where slip vanishes, two of them, like 1/v_A, would drown the others."""
    b = branch(s, p)
    unit = np.sqrt(p.g / p.R)
    omega_c, fluid, q = b.Omega_c * unit, b.Omega_0 * unit, b.v_A * np.sqrt(p.g * p.R) / p.r
    sin, cos = np.sign(p.eta - p.j) * b.sin, b.cos
    columns = []
    for d_omega, d_q, d_alpha, d_t in np.eye(4) * 1j * dynamics.STEP:
        sine, cosine = sin + d_alpha * cos, cos - d_alpha * sin
        slip_x, slip_z = (q + d_q) * sine, (q + d_q) * cosine
        x = State(omega_c=omega_c + d_omega, slip_x=slip_x, slip_y=d_t * slip_z, slip_z=slip_z)
        force = dynamics.forces(Case.SS, x, p, fluid, (sine, cosine), (d_t, 1.0))
        _, _, orbit, f_x, f_y, f_z, _, _ = dynamics.newton_euler(Case.SS, x, force, p, fluid)
        # At the solution itself all rates vanish, so that the directions may be held fixed.
        rates = (orbit, sin * f_x + cos * f_z, (cos * f_x - sin * f_z) / q, f_y / (q * cos))
        columns.append(np.stack([np.imag(rate) / dynamics.STEP for rate in rates], axis=-1))
    return dynamics.eigenvalues(np.stack(columns, axis=-1))


def hopf_places(p: Parameters) -> list[float]:
    """Places s of the branch at which a complex pair crosses the imaginary axis (Hopf).

    For eta < j none but for large mu. For eta > j, with (12) released, there is one in Fig. 12.
    `InputError` if the branch has a gap, as far beyond j."""
    s = np.linspace(-30.0, 30.0, 1201)
    if not np.all(np.isfinite(branch(s, p).Omega_c)):
        raise InputError(
            f"eta = {p.eta:g} is out of range: SS has no whole branch, so far beyond j = {p.j:g}"
        )

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
        place = float(roots.sign_change(pair_sums, s[k], s[k + 1]))
        pair = eigenvalues_at(place, p)
        if np.any((np.abs(pair.real) < 1e-6 * np.abs(pair.imag)) & (pair.imag > 0)):
            places.append(place)
    return places
