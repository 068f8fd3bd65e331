"""Coulomb's law at both contacts at once: the contact problem of one instant, solved by projection.

The unknowns are the impulses P of floor and wall and the velocities u after them (`rigid_body`), or as well forces and
accelerations. A closed contact obeys

    0 <= P_n  perpendicular to  v_n - target >= 0,   P_t in the disk of radius friction * P_n,
    P_t = -friction * P_n * v_t/|v_t| where v_t is not zero.

No case is named: which contact sticks, slips or opens is part of the answer. At one contact of a sphere normal and
tangential impulses do not influence each other, so that each contact alone is solved exactly by a projection, given
the impulse at the other. A sweep does so at A and then at B (projected Gauss-Seidel); what is sought is an impulse at
B that a sweep f reproduces. Sweeps alone may approach it slowly, or swing about it for ever where mu eta > 1. After
some of them, B = f(B) is taken for a place of rest of dB/dt = f(B) - B (pseudo-transient continuation, Kelley & Keyes,
SIAM J. Numer. Anal. 35 (1998) 508). Its linearly implicit Euler steps, (1/span + 1 - f') dB = f(B) - B, are damped
sweeps for small spans and those of the generalised Newton method for large ones: a success lengthens the span, a
setback, a change that rises by more than the attempt allows (`WARY`, `BOLD`), shortens it and makes it grow more
carefully from then on.

A solution exists where mu < 1 or eta < 1 (Acary, Cadoux, Lemarechal & Malick, ZAMM 91 (2011) 155: the ball can
move so that v_n - target > friction * |v_t| at both contacts). Where both are greater, floor and wall can
lock the ball in the corner, so that no impulses meet a target > 0; `unlocked` is for those.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from analytic import rigid_body
from analytic.rigid_body import NOTHING, Forces, Velocities
from model import Parameters
from model.arrays import Array

PLAIN_SWEEPS = 10
"""Sweeps before the continuation takes over: most problems are solved by then."""
ATTEMPT = 100
"""Sweeps after which the continuation starts afresh, from where it is."""
WARY, BOLD = 1.0, 1.3
"""How far the change may rise from one sweep to the next before it counts as a setback, the two in turns from attempt
to attempt. Wary where the sweeps swing; bold where impulses that hardly move the ball have to pile up in the corner
until one of them finds the limit of friction."""
SPAN, GROWTH, LONGEST = 1.0, 8.0, 1e10
"""Length of the first step of the continuation, in sweeps; by which factor steps grow; and the longest, by when a step
is one of Newton's."""
SHORTER, CALMER, LEAST_GROWTH = 20.0, 0.7, 1.1
"""A setback divides the length by the first; the growth is raised to the power of the second, and stays above the
third."""
MAX_SWEEPS = 2000


Impulse = tuple[float, float, float]
"""Of one contact per mass, m s-1: normal, tangential along the normal of the other contact, tangential along z."""


class Closed(NamedTuple):
    """A contact that takes part in the problem."""

    target: float = 0.0
    """Least normal velocity (or acceleration) afterwards."""
    slip: tuple[float, float] | None = None
    """Unit vector along which the contact slips (x, z at A; y, z at B) if that is known beforehand."""


class NotConvergedError(ArithmeticError):
    """The sweeps did not settle; the message gives the last change."""


@np.errstate(invalid="ignore", over="ignore")  # sweeps that run away don't settle, which is an error of its own
def solve(
    free: Velocities,
    A: Closed | None,
    B: Closed | None,
    p: Parameters,
    start: Forces = NOTHING,
    tolerance: float = 4e-15,
) -> tuple[Velocities, Forces]:
    """Velocities and impulses that obey Coulomb's law at both contacts.

    Parameters
    ----------
    free : velocities (m s-1 and rad s-1) that the ball would have without any impulse
    A, B : the closed contacts; None for an open one
    start : first guess of the impulses in N s; only those of B matter
    tolerance : the largest change in a sweep at which to stop, relative to the velocities of the problem, those that
        the impulses cause among them; a sweep rounds a dozen times, so that less than some eps may never be reached

    Raises
    ------
    NotConvergedError
        After `MAX_SWEEPS`.
    """
    a, b = _needs(free, A, B, p)
    if A is None or B is None:  # a contact alone is solved exactly
        at_A, at_B = (
            _project(need, friction, contact.slip) if contact else (0.0, 0.0, 0.0)
            for need, friction, contact in ((a, p.mu, A), (b, p.eta, B))
        )
        return _after(free, at_A, at_B, p)
    k = 1 / (1 + p.j)
    coupling = np.array([[0.0, 1.0, 0.0], [1 - k, -k, 0.0], [0.0, 0.0, 1 - k]])  # of `_left`
    scale = max(map(abs, (*free[:3], *(p.r * o for o in free[3:]))))
    *_, n, s, t = start
    at_B = n / p.m, s / p.m, t / p.m
    last, span, growth = math.inf, SPAN, GROWTH
    for count in range(1, MAX_SWEEPS + 1):
        at_A = _project(_left(a, at_B, k), p.mu, A.slip)
        need_B = _left(b, at_A, k)
        swept = _project(need_B, p.eta, B.slip)
        change = max(abs(after - before) for after, before in zip(swept, at_B, strict=True))
        enough = tolerance * max(scale, *map(abs, at_A), *map(abs, swept))
        if change <= enough < math.inf:
            return _after(free, at_A, swept, p)
        attempt, sweeps = divmod(count, ATTEMPT)
        if count <= PLAIN_SWEEPS:
            at_B = swept
            continue
        if sweeps == 0:
            span, growth = SPAN, GROWTH
        if change <= last * (BOLD if attempt % 2 else WARY):
            span = min(span * growth, LONGEST)
        else:  # the rate of a sweep is of the order of mu eta at most: shorter spans damp no better
            span, growth = max(span / SHORTER, 1 / (10 + p.mu * p.eta)), max(growth**CALMER, LEAST_GROWTH)
        last = change
        rate_A = _projection_rate(_left(a, swept, k), p.mu, A.slip)
        rate = _projection_rate(need_B, p.eta, B.slip) @ coupling @ rate_A @ coupling
        step = np.linalg.solve((1 + 1 / span) * np.eye(3) - rate, np.subtract(swept, at_B))
        n, s, t = (at_B + step).tolist()
        at_B = n, s, t
    raise NotConvergedError(
        f"contact problem: still a change of {change:g} m s-1 after {MAX_SWEEPS} sweeps, asked for {enough:g} m s-1"
    )


def _needs(free: Velocities, A: Closed | None, B: Closed | None, p: Parameters) -> tuple[Impulse, Impulse]:
    """Impulses that would bring A and B alone to their targets and to rest, were they not limited."""
    share = p.j / (1 + p.j)  # of the mass, that a tangential impulse feels at the contact point
    (v_h, v_y, *_), (s_A, t_A), (s_B, t_B) = free, rigid_body.slip_at_A(free, p), rigid_body.slip_at_B(free, p)
    to_A, to_B = A.target if A else 0.0, B.target if B else 0.0
    return (to_A - v_y, -share * s_A, -share * t_A), (to_B - v_h, -share * s_B, -share * t_B)


def _left(need: Impulse, other: Impulse, k: float) -> Impulse:
    """What a contact still needs if the other one gives an impulse: the same both ways."""
    n, s, t = other
    return need[0] - s, need[1] - (1 - k) * n + k * s, need[2] - (1 - k) * t


def _after(free: Velocities, at_A: Impulse, at_B: Impulse, p: Parameters) -> tuple[Velocities, Forces]:
    """Velocities after impulses per mass, and these impulses."""
    (A_y, A_x, A_z), (B_x, B_y, B_z) = at_A, at_B
    P = Forces(*(p.m * each for each in (A_x, A_y, A_z, B_x, B_y, B_z)))
    return rigid_body.apply(free, P, p), P


def _project(need: Impulse, friction: float, slip: tuple[float, float] | None) -> Impulse:
    """The impulse that Coulomb's law allows: friction is the point of its disk next to what is needed, or opposes a
    known slip."""
    n, s, t = need
    if n <= 0:
        return 0.0, 0.0, 0.0
    limit = friction * n
    if slip is not None:
        return n, -limit * slip[0], -limit * slip[1]
    size = math.hypot(s, t)
    return need if size <= limit else (n, s / size * limit, t / size * limit)


def _projection_rate(need: Impulse, friction: float, slip: tuple[float, float] | None) -> Array:
    """Derivative of `_project` by (n, s, t), shape (3, 3)."""
    n, s, t = need
    if n <= 0:
        return np.zeros((3, 3))
    if slip is not None:
        return np.outer([1.0, -friction * slip[0], -friction * slip[1]], [1.0, 0.0, 0.0])
    size = math.hypot(s, t)
    if size <= friction * n:
        return np.eye(3)
    a, b, turn = s / size, t / size, friction * n / size
    sideways = -turn * a * b
    return np.array([[1.0, 0.0, 0.0], [friction * a, turn * b * b, sideways], [friction * b, sideways, turn * a * a]])


def unlocked(error: NotConvergedError, p: Parameters) -> Closed:
    """What a contact can aim at when no impulses make both rebound: to stay closed.

    Raises the error again if friction can't have locked the ball.
    """
    if p.mu < 1 or p.eta < 1:
        raise error
    return Closed()
