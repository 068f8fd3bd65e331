"""Contact forces of two-point rolling (RR): a one-parameter family; which are admissible.

Rolling at A and B leaves one force free, say B_y: A_x = B_y - j u, A_y = G - B_y, B_x = (1+j) u -
B_y, with u = m R omega_c^2, G = m g, and A_z = B_z = z given by (23). RR can go on only if some B_y
puts both forces into their Coulomb cones (12), (13). With s the normal force of one contact, either
cone reads (d - s)^2 + z^2 <= f^2 s^2, s >= 0, where d = G - j u, f = mu at A and d = (1+j) u, f =
eta at B: a convex problem in one unknown. Loads are kept in units of G inside; all functions take
floats or arrays and broadcast them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from analytic.mechanics import drag, roots
from model import Parameters
from model.arrays import Array


@dataclass(frozen=True)
class LeastUtilisation:
    """The member of the family with the least larger utilisation; arrays of one shape."""

    B_y: Array
    """Its free component, N; where the least is only approached as the forces grow without bound,
    since the ball can jam, the greatest that is admissible, and nan if none is."""
    utilisation: Array
    """max(|friction at A|/(mu A_y), |friction at B|/(eta B_x)); RR lasts where <= 1, B_y finite."""


def admissible_interval(
    omega_c: npt.ArrayLike, p: Parameters, omega_0: npt.ArrayLike | None = None
) -> tuple[Array, Array]:
    """Least and greatest admissible B_y, N; nan for none, -inf if it can jam (mu, eta > 1)."""
    least, greatest = _interval(*_loads(omega_c, p, omega_0), p)
    exists = (least <= greatest) & (greatest > -np.inf) & (margin(omega_c, p, omega_0) >= 0)
    low, high = (np.where(exists, p.m * p.g * end, np.nan) for end in (least, greatest))
    return low, high


def margin(omega_c: npt.ArrayLike, p: Parameters, omega_0: npt.ArrayLike | None = None) -> Array:
    """How far RR is from its end: >= 0 exactly where both cones can hold, continuous through 0.

    The least of three, in units of m g: slack of either cone alone, overlap of both intervals."""
    u, z = _loads(omega_c, p, omega_0)
    least, greatest = _interval(u, z, p)
    unbounded = np.isneginf(greatest)
    overlap = np.where(unbounded, -np.inf, np.where(unbounded, 0.0, greatest) - least)
    slacks = [
        friction * np.hypot(d, z) - np.where(d >= 0, z, np.hypot(d, z))
        for d, friction in ((1 - p.j * u, p.mu), ((1 + p.j) * u, p.eta))
    ]
    return np.asarray(np.minimum(np.minimum(*slacks), overlap))


def slip_margin(
    omega_c: npt.ArrayLike, p: Parameters, omega_0: npt.ArrayLike | None = None
) -> Array:
    """How far RR is from the onset of a slip that lasts, in units of m g: >= 0 where slip dies out.

    Two slacks: of the wall's friction that must drive the spin (66), and of the floor's cone once
    the wall carries `_last_share` of the weight. Continuous; never beyond the zero of `margin`.
    docs/theory.md derives it."""
    u, z = _loads(omega_c, p, omega_0)
    share = _last_share(u, z, p)
    of_floor = p.mu * (1 - share) - np.hypot(p.j * u - share, z)
    return np.asarray(np.minimum(p.eta * (1 + p.j) * u - z, of_floor))


def _last_share(u: Array, z: Array, p: Parameters) -> Array:
    """B_y in units of m g at which RR ends: what the wall's cone allows, up to j u.

    0 where the cone has nothing left, beyond (66)."""
    k = (1 + p.j) * u
    return np.asarray(np.minimum(np.maximum(k - _normal_forces(k, z, p.eta)[0], 0.0), p.j * u))


def least_utilisation(
    omega_c: npt.ArrayLike, p: Parameters, omega_0: npt.ArrayLike | None = None
) -> LeastUtilisation:
    """The forces of RR whose larger friction utilisation is the least over the family.

    Each utilisation falls and then rises along B_y, so that the least maximum is at the lowest
    point of one of them or at their only crossing in between. The search runs in q = 1/(1 + A_y/G),
    which is finite for all A_y >= 0."""
    u, z = np.broadcast_arrays(*_loads(omega_c, p, omega_0))
    a, k = 1 - p.j * u, (1 + p.j) * u
    hyp2 = a**2 + z**2
    q_A = np.where(a > 0, _ratio(a, a + hyp2), np.where(hyp2 > 0, 0.0, 1.0))
    q_B = np.where(k + z > 0, _ratio(k, 2 * k + z**2), 0.5)

    def friction(q: Array) -> tuple[Array, Array, Array, Array]:
        """Friction at A and its limit, the same at B, in one unit."""
        sideways = (z * q) ** 2
        at_A = np.sqrt(((a + 1) * q - 1) ** 2 + sideways)
        at_B = np.sqrt((2 * q - 1) ** 2 + sideways)
        return at_A, p.mu * (1 - q), at_B, p.eta * np.maximum((k - 2) * q + 1, 0.0)

    def excess_of_A(q: Array) -> Array:
        """What is positive where the utilisation of A is larger."""
        at_A, limit_A, at_B, limit_B = friction(q)
        return np.asarray(at_A * limit_B - at_B * limit_A)

    A_binds = excess_of_A(q_A) >= 0
    B_alone = ~A_binds & (excess_of_A(q_B) <= 0)
    crossing = roots.sign_change(excess_of_A, q_A, q_B)
    q = np.where(A_binds, q_A, np.where(B_alone, q_B, crossing))
    at_A, limit_A, at_B, limit_B = friction(q)
    use_A, use_B = _ratio(at_A, limit_A), _ratio(at_B, limit_B)
    if np.any(A_binds):
        use_A = np.where(A_binds, _least_utilisation_alone(a, z, p.mu), use_A)
    if np.any(B_alone):
        use_B = np.where(B_alone, _least_utilisation_alone(k, z, p.eta), use_B)
    jams = q == 0
    B_y = np.asarray(p.m * p.g * (2 - 1 / np.where(jams, 1.0, q)))
    if np.any(jams):
        B_y = np.where(jams, admissible_interval(omega_c, p, omega_0)[1], B_y)
    return LeastUtilisation(B_y, np.maximum(use_A, use_B))


def _loads(
    omega_c: npt.ArrayLike, p: Parameters, omega_0: npt.ArrayLike | None
) -> tuple[Array, Array]:
    """Centrifugal load u and common friction |z| of (23), in units of G."""
    omega_c = np.asarray(omega_c, dtype=float)
    fluid = np.asarray(p.omega_0 if omega_0 is None else omega_0)
    u, lag = p.R / p.g * omega_c**2, np.abs(omega_c - fluid)
    z = p.j * drag.coefficient(p.R * lag, p) * p.R / p.g * lag / (1 + 2 * p.j)
    return np.asarray(u), np.asarray(z)


def _interval(u: Array, z: Array, p: Parameters) -> tuple[Array, Array]:
    """Least and greatest B_y/G that both cones allow; least > greatest if none."""
    k = (1 + p.j) * u
    low_A, high_A = _normal_forces(1 - p.j * u, z, p.mu)
    low_B, high_B = _normal_forces(k, z, p.eta)
    return np.maximum(1 - high_A, k - high_B), np.minimum(1 - low_A, k - low_B)


def _normal_forces(d: Array, z: Array, friction: float) -> tuple[Array, Array]:
    """Roots s of (d - s)^2 + z^2 = friction^2 s^2, which bound the normal forces of a contact.

    Where none is admissible the discriminant is taken as 0, or both are inf: there `margin` < 0."""
    hyp2 = d**2 + z**2
    top = d + np.sqrt(np.maximum((friction - 1) * (friction + 1) * z**2 + (friction * d) ** 2, 0.0))
    low = np.where(hyp2 == 0, 0.0, np.where(top > 0, hyp2 / np.where(top > 0, top, 1.0), np.inf))
    high = top / (1 - friction**2) if friction < 1 else np.full_like(low, np.inf)
    return low, high


def _least_utilisation_alone(d: Array, z: Array, friction: float) -> Array:
    """Least utilisation of one contact's friction over the family, whatever the other's."""
    hyp = np.hypot(d, z)
    needed = np.where(d > 0, _ratio(z, hyp), np.where(hyp > 0, 1.0, 0.0))
    return _ratio(needed, np.asarray(friction))


def _ratio(load: Array, limit: Array) -> Array:
    """load/limit, 0 for 0/0: a contact without friction force has no utilisation."""
    safe = np.where(limit == 0, 1.0, limit)
    return np.where(load == 0, 0.0, np.where(limit == 0, np.inf, load / safe))
