"""Coulomb's law at both contacts at once: the contact problem of one instant, solved by projection.

The unknowns are the impulses P of floor and wall and the velocities u after them (`rigid_body`), or as well forces and
accelerations. A closed contact obeys

    0 <= P_n  perpendicular to  v_n - target >= 0,   P_t in the disk of radius friction * P_n,
    P_t = -friction * P_n * v_t/|v_t| where v_t is not zero.

No case is named: which contact sticks, slips or opens is part of the answer. At one contact of a sphere normal and
tangential impulses do not influence each other, so that each contact alone is solved exactly; the two are swept in turn
(projected Gauss-Seidel) until nothing changes.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from analytic.rigid_body import NOTHING, Six, apply, mean
from model import Parameters

PLAIN_SWEEPS = 200
"""Sweeps after which steps are halved: those that converge at all by themselves mostly have by then."""


class Closed(NamedTuple):
    """A contact that takes part in the problem."""

    target: float = 0.0
    """Least normal velocity (or acceleration) afterwards."""
    slip: tuple[float, float] | None = None
    """Unit vector along which the contact slips (x, z at A; y, z at B) if that is known beforehand."""


class NotConvergedError(ArithmeticError):
    """The sweeps did not settle; the message gives the last change."""


def solve(
    free: Six, A: Closed | None, B: Closed | None, p: Parameters,
    start: Six = NOTHING, tolerance: float = 4e-15, max_sweeps: int = 20_000,
) -> tuple[Six, Six]:  # fmt: skip
    """Velocities and impulses that obey Coulomb's law at both contacts.

    Parameters
    ----------
    free : velocities (m s-1 and rad s-1) that the ball would have without any impulse
    A, B : the closed contacts; None for an open one
    start : first guess of the impulses in N s
    tolerance : the largest change in a sweep at which to stop, relative to the velocities of the problem, those that
        the impulses cause among them; a sweep rounds a dozen times, so that less than some eps may never be reached

    Raises
    ------
    NotConvergedError
        After `max_sweeps`.
    """
    u, P = apply(free, start, p), start
    if A is None or B is None:  # a contact alone is solved exactly
        return sweep(u, P, A, B, p)
    scale = max(map(abs, (*free[:3], *(p.r * o for o in free[3:]))))
    change = enough = math.inf
    for k in range(max_sweeps):
        u, new = sweep(u, P, A, B, p)
        change = max(abs(a - b) for a, b in zip(new, P, strict=True)) / p.m
        if k >= PLAIN_SWEEPS and change > enough:
            # Each normal force moves the other by friction: where mu eta > 1 the plain sweeps may swing for ever about
            # the solution. Going half the way has the same solution, and the cones, being convex, contain it.
            new = mean(P, new)
            u = apply(free, new, p)
        P = new
        enough = tolerance * max(scale, max(map(abs, P)) / p.m)
        if change <= enough:
            return apply(free, P, p), P
    raise NotConvergedError(
        f"contact problem: still a change of {change:g} m s-1 after {max_sweeps} sweeps, asked for {enough:g} m s-1"
    )


def sweep(u: Six, P: Six, A: Closed | None, B: Closed | None, p: Parameters) -> tuple[Six, Six]:
    """Solve A for the present impulse at B, then B for that at A; u already contains P, None is an open contact."""
    v_h, v_y, v_k, o_x, o_y, o_z = u
    A_x, A_y, A_z, B_x, B_y, B_z = P
    m, jmr = p.m, p.j * p.m * p.r
    m_t = m * p.j / (1 + p.j)  # mass that a tangential impulse feels at the contact point
    if A is not None:
        n = max(0.0, A_y - m * (v_y - A.target))
        s, t = _friction(A_x - m_t * (v_h + p.r * o_z), A_z - m_t * (v_k - p.r * o_x), p.mu * n, A.slip)
        v_h, v_y, v_k = v_h + (s - A_x) / m, v_y + (n - A_y) / m, v_k + (t - A_z) / m
        o_x, o_z = o_x - (t - A_z) / jmr, o_z + (s - A_x) / jmr
        A_x, A_y, A_z = s, n, t
    if B is not None:
        n = max(0.0, B_x - m * (v_h - B.target))
        s, t = _friction(B_y - m_t * (v_y - p.r * o_z), B_z - m_t * (v_k + p.r * o_y), p.eta * n, B.slip)
        v_h, v_y, v_k = v_h + (n - B_x) / m, v_y + (s - B_y) / m, v_k + (t - B_z) / m
        o_y, o_z = o_y + (t - B_z) / jmr, o_z - (s - B_y) / jmr
        B_x, B_y, B_z = n, s, t
    return (v_h, v_y, v_k, o_x, o_y, o_z), (A_x, A_y, A_z, B_x, B_y, B_z)


def _friction(s: float, t: float, limit: float, slip: tuple[float, float] | None) -> tuple[float, float]:
    """Project the friction that would stop the slip onto the disk, or oppose the known slip."""
    if slip is not None:
        return -limit * slip[0], -limit * slip[1]
    size = math.hypot(s, t)
    return (s, t) if size <= limit else (s / size * limit, t / size * limit)
