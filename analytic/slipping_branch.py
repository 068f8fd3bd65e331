"""The branch of stationary solutions in which the ball slips at both points (SS): (37)-(42), and its fold (87)-(90).

The branch is given in the groups of the model: Omega = omega sqrt(R/g), kappa = c sqrt(R/g), forces in units of m g,
speeds in units of sqrt(g R). A point on it is given by ``s = ln|tan alpha|``, from -inf where the slip ends in RR
(alpha = 0) to +inf where it ends in SR (alpha = -pi/2): no digit is lost at either end. Here omega_c > 0; the other
sense of rotation is the mirror image. All functions take floats or arrays and broadcast them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from analytic import roots
from model.arrays import Array

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
    v_A: Array
    """Slip speed at A in units of sqrt(g R) (39)."""
    A_y: Array
    """Normal force of the floor in units of m g (42)."""
    B_x: Array
    """Normal force of the wall in units of m g (42)."""


def branch(s: npt.ArrayLike, j: float, mu: npt.ArrayLike, eta: npt.ArrayLike, kappa: float) -> BranchPoint:
    """Points s = ln|tan alpha| of the branch (37)-(42); needs mu > 0 and kappa > 0.

    For eta > j the branch has A_y < 0: it solves the equations once (12) is released (Fig. 12). It is nan where
    not even then a solution exists.
    """
    cos, sin = _cos_sin(s)
    mu, eta = np.asarray(mu), np.asarray(eta)
    den = _denominator(cos, j, mu, eta)
    den = np.where(den > 0, den, np.nan)
    Omega_c = np.sqrt(mu * (1 + eta * cos**2) / den)
    slip = mu * np.abs(j - eta) * sin / den
    Omega_0, A_y, B_x = Omega_c + cos * slip / kappa, (j - eta) * cos / den, mu * (1 + j * cos**2) / den
    return BranchPoint(*np.broadcast_arrays(cos, sin, Omega_c, Omega_0, slip / (j * Omega_c), A_y, B_x))


def slope(s: npt.ArrayLike, j: float, mu: npt.ArrayLike, eta: npt.ArrayLike, kappa: npt.ArrayLike) -> Array:
    """A multiple > 0 of d omega_0/d|alpha| (89) for eta < j: its zero is the fold.

    kappa (1 + 2 mu eta cos - eta cos^2)/(2 Omega_c |sin|) + den/tan^2 - mu eta (1 - j cos^2), which is
    d omega_0/d|alpha| without the factor mu (j - eta) sin^2/(kappa den^2). For eta > j its first term, and with it
    the slope of Omega_c, changes sign.
    """
    orbit, lag = _slopes(s, j, mu, eta, kappa)
    return np.asarray(orbit + lag)


def characteristic_slope(
    s: npt.ArrayLike, j: float, mu: npt.ArrayLike, eta: npt.ArrayLike, kappa: npt.ArrayLike
) -> Array:
    """d omega_c/d omega_0 along the branch: 0 at the end in RR, infinite at the fold, negative beyond it."""
    orbit, lag = _slopes(s, j, mu, eta, kappa)
    return np.asarray(orbit / (orbit + lag))


def _slopes(
    s: npt.ArrayLike, j: float, mu: npt.ArrayLike, eta: npt.ArrayLike, kappa: npt.ArrayLike
) -> tuple[Array, Array]:
    """d Omega_c/d|alpha|, and that of the lag Omega_0 - Omega_c, both without the factor that `slope` leaves out."""
    cos, sin = _cos_sin(s)
    mu, eta = np.asarray(mu), np.asarray(eta)
    den = _denominator(cos, j, mu, eta)
    Omega_c = np.sqrt(mu * (1 + eta * cos**2) / den)
    orbit = np.sign(j - eta) * kappa * (1 + 2 * mu * eta * cos - eta * cos**2) / (2 * Omega_c * sin)
    return np.asarray(orbit), np.asarray(den * (cos / sin) ** 2 - mu * eta * (1 - j * cos**2))


def eta_critical(mu: npt.ArrayLike, kappa: npt.ArrayLike) -> Array:
    """eta_cr (87): the fold exists for larger eta only; inf for mu = 0 with drag, nan without either."""
    mu, kappa = np.asarray(mu, dtype=float), np.asarray(kappa, dtype=float)
    ratio = np.where(mu > 0, kappa / np.where(mu > 0, 2 * mu, 1.0), np.where(kappa > 0, np.inf, np.nan))
    return np.asarray(ratio**2)


def fold(j: float, mu: npt.ArrayLike, eta: npt.ArrayLike, kappa: float, released: bool = False) -> Array:
    """The place s of the fold (88) by a bracketed root of `slope`; nan where there is none.

    It exists for eta_cr < eta < j (87) and kappa > 0, and is then unique; with (12) `released` also for eta > j, as
    long as the whole branch exists.
    """
    mu, eta = np.broadcast_arrays(np.asarray(mu, dtype=float), np.asarray(eta, dtype=float))
    exists = (eta > eta_critical(mu, kappa)) & (eta < j) & (kappa > 0)
    if released:
        lowest = np.clip((eta - j) / np.where(mu * eta > 0, 2 * j * mu * eta, 1.0), 0.0, 1.0)
        exists = exists | (eta > j) & (mu > 0) & (kappa > 0) & (_denominator(lowest, j, mu, eta) > 0)
    # Any valid numbers where there is no fold: the root there is thrown away.
    safe_mu, safe_eta = np.where(exists, mu, 1.0), np.where(exists, eta, j / 2)
    safe_kappa = np.where(exists, kappa, 0.0)
    places = roots.bisected(lambda s: slope(s, j, safe_mu, safe_eta, safe_kappa), -END, END)
    return np.where(exists, places, np.nan)


def sign_changes(j: float, mu: float, eta: float, kappa: float, points: int = 20_001) -> int:
    """How often `slope` changes sign along the whole branch: the number of folds, by a search that assumes nothing."""
    values = slope(np.linspace(-END, END, points), j, mu, eta, kappa)
    return int(np.sum(np.sign(values[1:]) != np.sign(values[:-1])))


def points_at(Omega_0: float, j: float, mu: float, eta: float, kappa: float) -> list[float]:
    """All places s of the branch that belong to a flow Omega_0 > 0, in the order of |alpha|; [] if none.

    The first part of the branch, from RR to the fold, rises with Omega_0, the second falls; each gives at most one.
    """
    if not (mu > 0 and kappa > 0 and eta < j):
        return []
    turning = float(fold(j, mu, eta, kappa))
    parts = [(-END, END)] if np.isnan(turning) else [(-END, turning), (turning, END)]

    def excess(s: Array) -> Array:
        return branch(s, j, mu, eta, kappa).Omega_0 - Omega_0

    places = []
    for part in parts:
        low, high = (float(excess(np.asarray(end))) for end in part)
        if low * high < 0:
            places.append(float(roots.bisected(excess, *part)))
    return places


def _cos_sin(s: npt.ArrayLike) -> tuple[Array, Array]:
    """cos alpha and |sin alpha| from s = ln|tan alpha|, each to full relative accuracy."""
    s = np.asarray(s, dtype=float)
    return 1 / np.hypot(1.0, np.exp(s)), 1 / np.hypot(1.0, np.exp(-s))


def _denominator(cos: Array, j: float, mu: Array, eta: Array) -> Array:
    return np.asarray((1 + j * cos**2) * mu * eta + (j - eta) * cos)
