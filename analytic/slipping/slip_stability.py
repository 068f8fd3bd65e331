"""Stability with respect to slipping (section 3): does a slight slip, or lift, die out or grow?

From a state x* of a case Y the ball is pushed along n into a case Z of more freedom (the arrows of
Fig. 6, and NR->NS); gamma(x*, n) = lim f_Z(x* + eps n) . n (53), in the paper's Euclidean product,
says whether it is driven further. Over all directions its maximum may be positive though no slip
can last, since with two or more directions to slip the slip turns while it grows (docs/errata.md);
then the work done on the slip or the forces decide, `stability`."""

from __future__ import annotations

from enum import Enum

import numpy as np
import numpy.typing as npt

from analytic.mechanics import dynamics, roots
from model import Case, Contact, Parameters, State
from model.arrays import Array, Real
from model.cases import TRAITS

SLIP_ARROWS = (
    (Case.RR, Case.RS),
    (Case.RR, Case.SR),
    (Case.RR, Case.SS),
    (Case.RS, Case.SS),
    (Case.SR, Case.SS),
    (Case.NR, Case.NS),
)
"""The arrows of Fig. 6 along which a contact begins to slip."""
LIFT_ARROWS = ((Case.RR, Case.NR), (Case.RS, Case.NS), (Case.SR, Case.NR), (Case.SS, Case.NS))
"""The arrows of Fig. 6 along which the ball leaves the floor."""
_SLIPS = ("slip_x", "slip_y", "slip_z")


class SlipStability(Enum):
    """Definitions 1-3, by gamma over all directions along which the contacts stay closed."""

    STABLE = "stable"
    """gamma < 0 in all of them, or nothing rolls."""
    NEUTRAL = "neutral"
    """gamma = 0 in one, > 0 in none."""
    UNSTABLE = "unstable"
    """gamma > 0 in one."""


def normals(inner: Case, outer: Case) -> tuple[str, ...]:
    """Names of the slips that `outer` frees and `inner` holds at zero; they span W (51)."""
    held, free = TRAITS[inner].active, TRAITS[outer].active
    return tuple(name for name in _SLIPS if name in free and name not in held)


def slip_rates(
    inner: Case, outer: Case, x: npt.ArrayLike, n: npt.ArrayLike, p: Parameters
) -> tuple[Array, Array, Array]:
    """Rates (..., d) of slips that begin along n (52), and the normal forces A_y, B_x in N (...).

    x is one state of `inner`, n directions (..., d) over `normals`, of any length. A negative
    normal force means that the contact opens instead of slipping that way."""
    state = dynamics.check_state(inner, x, p)
    names = normals(inner, outer)
    n = np.asarray(n, dtype=float)
    push = State(**dict(zip(names, np.moveaxis(n, -1, 0), strict=True)))
    old_slips, new_slips = (dynamics.sliding_velocities(each, p) for each in (state, push))
    contacts = zip((inner.A, inner.B), (outer.A, outer.B), old_slips, new_slips, strict=True)
    slip_A, slip_B = (
        dynamics.direction(*(old if before is Contact.S else new)) if after is Contact.S else None
        for before, after, old, new in contacts
    )
    force = dynamics.forces(outer, state, p, p.omega_0, slip_A, slip_B)
    rates = dynamics.newton_euler(outer, state, force, p, p.omega_0)
    values = *(getattr(rates, name) for name in names), force.A_y, force.B_x
    *along, A_y, B_x = (np.broadcast_to(value, n.shape[:-1]) for value in values)
    return np.stack(along, axis=-1), A_y, B_x


def gamma(inner: Case, outer: Case, x: npt.ArrayLike, n: npt.ArrayLike, p: Parameters) -> Array:
    """gamma of (53) in rad s-2 along directions n (..., d) of any length."""
    n = np.asarray(n, dtype=float)
    rates, _, _ = slip_rates(inner, outer, x, n, p)
    return np.asarray(np.sum(n * rates, axis=-1) / np.linalg.norm(n, axis=-1))


def lift_acceleration(inner: Case, outer: Case, x: npt.ArrayLike, p: Parameters) -> float:
    """v_y', m s-2, of the case without the floor at a state with it: the ball lifts if it is > 0.

    This is (53) for the dotted arrows of Fig. 6, with n along v_y."""
    return float(dynamics.rates(outer, dynamics.check_state(inner, x, p), p, p.omega_0).v_y)


def lift_onset(inner: Case, outer: Case, x: npt.ArrayLike, p: Parameters) -> float:
    """omega_c, rad s-1, at which the ball begins to lift, else as in x, in as much faster a flow.

    Out of SR slip_x is in proportion to omega_c. Looked for between a tenth and ten times omega_c
    of x; nan where it lifts at both or at none."""
    state = dynamics.check_state(inner, x, p)

    def lift_at(omega_c: float) -> float:
        slip_x = state.slip_x * omega_c / state.omega_c if inner is Case.SR else state.slip_x
        there = state._replace(omega_c=omega_c, slip_x=slip_x)
        q = p.replace(omega_0=p.omega_0 * omega_c / state.omega_c)
        return lift_acceleration(inner, outer, there, q)

    return float(roots.sign_change(np.vectorize(lift_at), 0.1 * state.omega_c, 10 * state.omega_c))


def stability(case: Case, p: Parameters, omega_c: float | None = None) -> SlipStability:
    """Slip stability of the stationary solution of a case at omega_c, p.omega_0 if None.

    RR: (67), and (82) if eta < j, else (74): beyond omega_03 slip at A alone would need A_y < 0,
    and so would slip at both if eta > j, so that for eta < j, mu > 1 rolling goes on beyond
    omega_03, to omega_01 (`slip_margin`). SR and NR: (61). RS: the friction j m R omega_c^2 that
    its floor must supply. These are the signs of the work done on a slight slip, over all
    directions along which the contacts stay closed; on a threshold, to round-off, it is neutral."""
    Omega2 = p.R / p.g * (p.omega_0 if omega_c is None else omega_c) ** 2
    match case:
        case Case.RR:
            slip = p.mu * p.j * Omega2, p.mu
            if p.eta < p.j:
                slip = Omega2 * (p.mu * p.eta * (1 + p.j) + p.j - p.eta), p.mu * (1 + p.eta)
            kinds = {_by_sign(0.0, p.eta * Omega2), _by_sign(*slip)}
        case Case.SR | Case.NR:
            # the floor then carries the weight, the wall nothing
            smooth_floor = case is Case.SR and p.mu == 0
            kinds = {_by_sign(0.0 if smooth_floor else 1.0, p.eta * Omega2)}
        case Case.RS:
            kinds = {_by_sign(p.j * Omega2, p.mu)}
        case _:
            kinds = set()
    worst_first = SlipStability.UNSTABLE, SlipStability.NEUTRAL
    return next((kind for kind in worst_first if kind in kinds), SlipStability.STABLE)


def neutral_flow(case: Case, p: Parameters) -> float:
    """Flow, rad s-1, at which a stationary motion is neutral (Definition 3).

    Looked for between a thousandth and a thousand times sqrt(g/R), by bisection down to round-off;
    nan if it is the same at both. p.omega_0 plays no part."""
    unit, order = float(np.sqrt(p.g / p.R)), list(SlipStability)

    def stability_at(flow: Real) -> int:
        return order.index(stability(case, p.replace(omega_0=float(flow)))) - 1

    return float(roots.sign_change(stability_at, 1e-3 * unit, 1e3 * unit))


def _by_sign(drive: float, hold: float) -> SlipStability:
    """Unstable if drive > hold, stable if less, neutral within round-off; both are >= 0."""
    if abs(drive - hold) <= 8 * np.finfo(float).eps * max(drive, hold):
        return SlipStability.NEUTRAL
    return SlipStability.UNSTABLE if drive > hold else SlipStability.STABLE
