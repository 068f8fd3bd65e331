"""Coulomb's law at both contacts at once: the contact problem of one instant, solved by projection.

The unknowns are the impulses P of floor and wall and the velocities u after them (`rigid_body`), or as well forces and
accelerations. A closed contact obeys

    0 <= P_n  perpendicular to  v_n - target >= 0,   P_t in the disk of radius friction * P_n,
    P_t = -friction * P_n * v_t/|v_t| where v_t is not zero.

No case is named: which contact sticks, slips or opens is part of the answer. At one contact of a sphere normal and
tangential impulses do not influence each other, so that each contact alone is solved exactly by a projection, given
the impulse at the other. To `sweep` is to do so at A and then at B (projected Gauss-Seidel); what is sought is an
impulse at B that a sweep reproduces. Sweeps alone may approach it slowly, or swing about it for ever where
mu eta > 1: `Continuation` then takes over, which ends as Newton's method.

A solution exists where mu < 1 or eta < 1 (Acary, Cadoux, Lemarechal & Malick, ZAMM 91 (2011) 155: the ball can
move so that v_n - target > friction * |v_t| at both contacts). Where both are greater, floor and wall can
lock the ball in the corner, so that no impulses meet a target > 0; `unlocked` is for those.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
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
MAX_SWEEPS = 2000


class Closed(NamedTuple):
    """A contact that takes part in the problem."""

    target: float = 0.0
    """Least normal velocity (or acceleration) afterwards."""
    slip: tuple[float, float] | None = None
    """Unit vector along which the contact slips (x, z at A; y, z at B) if that is known beforehand."""


class NotConvergedError(ArithmeticError):
    """The sweeps did not settle; the message gives the last change."""


def solve(
    free: Velocities,
    A: Closed | None,
    B: Closed | None,
    p: Parameters,
    start: Forces = NOTHING,
    tolerance: float = 4e-15,
    max_sweeps: int = MAX_SWEEPS,
) -> tuple[Velocities, Forces]:
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
    u, P = rigid_body.apply(free, start, p), start
    if A is None or B is None:  # a contact alone is solved exactly
        return sweep(u, P, A, B, p)
    scale = max(map(abs, (*free[:3], *(p.r * o for o in free[3:]))))
    pace, change, enough = Continuation(A, B, p), math.inf, math.inf
    for _ in range(max_sweeps):
        u, new = sweep(u, P, A, B, p)
        change = max(abs(after - before) for after, before in zip(new[3:], P[3:], strict=True)) / p.m
        enough = tolerance * max(scale, max(map(abs, new)) / p.m)
        if change <= enough:
            return rigid_body.apply(free, new, p), new
        P = pace.next(u, P, new, change)
        u = rigid_body.apply(free, P, p)
    raise NotConvergedError(
        f"contact problem: still a change of {change:g} m s-1 after {max_sweeps} sweeps, asked for {enough:g} m s-1"
    )


def sweep(u: Velocities, P: Forces, A: Closed | None, B: Closed | None, p: Parameters) -> tuple[Velocities, Forces]:
    """Solve A for the present impulse at B, then B for that at A; u already contains P, None is an open contact."""
    v_h, v_y, v_k, o_x, o_y, o_z = u
    A_x, A_y, A_z, B_x, B_y, B_z = P
    m, jmr = p.m, p.j * p.m * p.r
    if A is not None:
        n, s, t = _project(*_unlimited_A(u, P, A, p), p.mu, A.slip)
        v_h, v_y, v_k = v_h + (s - A_x) / m, v_y + (n - A_y) / m, v_k + (t - A_z) / m
        o_x, o_z = o_x - (t - A_z) / jmr, o_z + (s - A_x) / jmr
        A_x, A_y, A_z = s, n, t
        u = Velocities(v_h, v_y, v_k, o_x, o_y, o_z)
    if B is not None:
        n, s, t = _project(*_unlimited_B(u, P, B, p), p.eta, B.slip)
        v_h, v_y, v_k = v_h + (n - B_x) / m, v_y + (s - B_y) / m, v_k + (t - B_z) / m
        o_y, o_z = o_y + (t - B_z) / jmr, o_z - (s - B_y) / jmr
        B_x, B_y, B_z = n, s, t
        u = Velocities(v_h, v_y, v_k, o_x, o_y, o_z)
    return u, Forces(A_x, A_y, A_z, B_x, B_y, B_z)


def _unlimited_A(u: Velocities, P: Forces, A: Closed, p: Parameters) -> tuple[float, float, float]:
    """Impulses (normal, along x, along z) that would bring A to its target and to rest, were they not limited."""
    m_t = p.m * p.j / (1 + p.j)  # mass that a tangential impulse feels at the contact point
    (_, v_y, *_), (A_x, A_y, A_z, *_), (slip_x, slip_z) = u, P, rigid_body.slip_at_A(u, p)
    return A_y - p.m * (v_y - A.target), A_x - m_t * slip_x, A_z - m_t * slip_z


def _unlimited_B(u: Velocities, P: Forces, B: Closed, p: Parameters) -> tuple[float, float, float]:
    """The same at B: (normal, along y, along z)."""
    m_t = p.m * p.j / (1 + p.j)
    (v_h, *_), (*_, B_x, B_y, B_z), (slip_y, slip_z) = u, P, rigid_body.slip_at_B(u, p)
    return B_x - p.m * (v_h - B.target), B_y - m_t * slip_y, B_z - m_t * slip_z


def _project(
    n: float, s: float, t: float, friction: float, slip: tuple[float, float] | None
) -> tuple[float, float, float]:
    """The impulses (n, s, t) that Coulomb's law allows: friction is the point of its disk next to (s, t), or opposes a
    known slip."""
    if n <= 0:
        return 0.0, 0.0, 0.0
    limit = friction * n
    if slip is not None:
        return n, -limit * slip[0], -limit * slip[1]
    size = math.hypot(s, t)
    return (n, s, t) if size <= limit else (n, s / size * limit, t / size * limit)


def _projection_rate(n: float, s: float, t: float, friction: float, slip: tuple[float, float] | None) -> Array:
    """Derivative of `_project` by (n, s, t), shape (3, 3)."""
    if n <= 0:
        return np.zeros((3, 3))
    if slip is not None:
        return np.array([[1.0, 0.0, 0.0], [-friction * slip[0], 0.0, 0.0], [-friction * slip[1], 0.0, 0.0]])
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


@dataclass
class Continuation:
    """Pseudo-transient continuation (Kelley & Keyes, SIAM J. Numer. Anal. 35 (1998) 508) of sweeps.

    A sweep takes the impulse b at B to f(b). The solution b = f(b) is a place of rest of db/dt = f(b) - b, whose
    linearly implicit Euler steps, (1/span + 1 - f') db = f(b) - b, are damped sweeps for small spans and those
    of the generalised Newton method for large ones. A success lengthens the span; a setback, a change that rises by
    more than the attempt allows (`WARY`, `BOLD`), shortens it and makes its growth more careful from then on.
    """

    A: Closed
    B: Closed
    p: Parameters
    _span: float = field(init=False, default=1.0)
    _growth: float = field(init=False, default=8.0)
    _last: float = field(init=False, default=math.inf)
    _sweeps: int = field(init=False, default=0)

    def next(self, u: Velocities, before: Forces, after: Forces, change: float) -> Forces:
        """Impulses to start the next sweep from; the last took `before` to `after`, with velocities u."""
        self._sweeps += 1
        if self._sweeps <= PLAIN_SWEEPS:
            return Forces(*after)
        attempt, sweeps = divmod(self._sweeps, ATTEMPT)
        if sweeps == 0:
            self._span, self._growth = 1.0, 8.0
        if change <= self._last * (BOLD if attempt % 2 else WARY):
            self._span = min(self._span * self._growth, 1e10)
        else:
            # The rate of a sweep is of the order of mu eta at most: shorter spans damp no better.
            least = 1 / (10 + self.p.mu * self.p.eta)
            self._span, self._growth = max(self._span / 20, least), max(self._growth**0.7, 1.1)
        self._last = change
        matrix = (1 + 1 / self._span) * np.eye(3) - self._rate(u, after)
        at_B = np.array(before[3:])
        return Forces(*after[:3], *(at_B + np.linalg.solve(matrix, after[3:] - at_B)).tolist())

    def _rate(self, u: Velocities, P: Forces) -> Array:
        """f': how the impulse (n, s, t) at B after a sweep changes with that before it."""
        p = self.p
        # What a contact's unlimited impulses are changed by those (n, s, t) at the other: the same both ways.
        k = 1 / (1 + p.j)
        other = np.array([[0.0, -1.0, 0.0], [-p.j * k, k, 0.0], [0.0, 0.0, -p.j * k]])
        at_A = _projection_rate(*_unlimited_A(u, P, self.A, p), p.mu, self.A.slip)
        at_B = _projection_rate(*_unlimited_B(u, P, self.B, p), p.eta, self.B.slip)
        return np.asarray(at_B @ other @ at_A @ other)
