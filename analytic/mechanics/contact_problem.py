"""Coulomb's law at floor and wall at once: the contact problem of one instant.

The unknowns are the impulses P of floor and wall and the velocities after them, or as well forces
and accelerations. A closed contact obeys

    0 <= P_n  perpendicular to  v_n - target >= 0,   P_t in the disk of radius friction * P_n,
    P_t = -friction * P_n * v_t/|v_t| where v_t is not zero.

No case is named: which contact sticks, slips or opens is part of the answer. At one contact of a
sphere normal and tangential impulses do not influence each other, so that a contact alone is solved
exactly, by a projection. Of two, the impulse (n, s, t) of one per mass changes what the other one
needs by C (n, s, t) = (s, j k n - k s, j k t) with k = 1/(1+j), the same both ways, and Coulomb's
law is

    A = project(a - C B, mu),  B = project(b - C A, eta),

where a and b are what A and B need to meet their targets and rest if the other gives nothing.

A sweep computes A from B and B from that (projected Gauss-Seidel); what is sought is an impulse at
B that a sweep f reproduces. Newton's method on the change of a sweep settles most problems in one
or two steps. While the ball rolls at both points B is undetermined along one direction, and a
little damping keeps it from drifting there. Where a contact begins to stick, slide or open,
Newton's method may end in another solution than sweeps do: then, and where sweeps may lead away
from a solution (mu eta > 1), plain sweeps are taken. If these are slow or oscillate, B = f(B) is
taken for the equilibrium of dB/dt = f(B) - B (pseudo-transient continuation, Kelley & Keyes, SIAM
J. Numer. Anal. 35 (1998) 508). Its linearly implicit Euler steps, (1/span + 1 - f') dB = f(B) - B,
are damped sweeps for small spans and those of the generalised Newton method for large ones: a
success lengthens the span, a setback shortens it and reduces its growth from then on. Where that
fails, it starts again from zero and from damped sweeps.

A solution exists where mu < 1 or eta < 1 (Acary, Cadoux, Lemarechal & Malick, ZAMM 91 (2011) 155:
the ball can move so that v_n - target > friction * |v_t| at both contacts). Where both are greater,
floor and wall can lock the ball in the corner, so that no impulses meet a target > 0, but some a
target of 0. Where mu > 1, sticking and slipping may both obey the law. The solution found is then
the one near the first guess: with the impulses of the last step the ball goes on rolling until no
impulses near the present ones hold it.

All on plain floats, and compiled."""

import math
from typing import Any, NamedTuple

from analytic.mechanics import rigid_body
from analytic.mechanics.rigid_body import Forces, Velocities

EAGER, WHOLE = 5, 1e4
"""Most sweeps with Newton's method from the start, and the span of its steps."""
PLAIN_SWEEPS = 6
"""Sweeps before the continuation takes over."""
ATTEMPT = 100
"""Sweeps after which the continuation starts again: first from zero, then from where it is."""
DAMPED = 0.5
"""Share of a sweep that is taken in all attempts but the first, before the continuation."""
WARY, BOLD = 1.0, 1.3
"""Factor by which the change may rise from one sweep to the next before it counts as a setback, in
even and in odd attempts: the first suits sweeps that oscillate, the second impulses that build up
in the corner until one of them reaches the limit of friction."""
SPAN, GROWTH, LONGEST_SPAN = 1.0, 8.0, 1e8
"""First step of the continuation, in sweeps; how steps grow; the longest, one of Newton's."""
SHORTER, CALMER, LEAST_GROWTH = 20.0, 0.7, 1.1
"""A setback divides the length by the first and raises the growth to the power of the second, down
to the third."""
MAX_SWEEPS = 1000
EXACT = 4e-15
"""Tolerance for impulses as exact as they can be."""


class Closed(NamedTuple):
    """A contact that takes part in the problem."""

    target: float = 0.0
    """Least normal velocity (or acceleration) afterwards."""
    s: float = 0.0
    """Unit vector along which it slips (x, z at A; y, z at B) if that is known beforehand."""
    t: float = 0.0
    closed: bool = True
    """False for one that is open, and takes no part."""


RESTS, ABSENT = Closed(), Closed(closed=False)


class Friction(NamedTuple):
    """Friction of one contact; its slip is along (s, t), or to be found if that is (0, 0)."""

    coefficient: float
    s: float
    t: float


class Impulse(NamedTuple):
    """Impulse of one contact per mass, m s-1."""

    n: float
    """Normal."""
    s: float
    """Tangential, along the normal of the other contact."""
    t: float
    """Tangential, along k."""


NO_IMPULSE = Impulse(0.0, 0.0, 0.0)
Slips = tuple[tuple[float, float], tuple[float, float]]
"""Slip velocities of A and of B, m s-1."""


class NotConvergedError(ArithmeticError):
    """The sweeps did not settle."""


def solve(
    free: Velocities, A: Closed, B: Closed, p: Any, start: Forces, tolerance: float
) -> tuple[Velocities, Forces, bool]:
    """Velocities and impulses that obey Coulomb's law at both contacts; whether sweeps settled.

    Parameters
    ----------
    free : velocities (m s-1 and rad s-1) that the ball would have without any impulse
    p : anything with the names of `model.Parameters`
    start : first guess of the impulses in N s; only those of B matter
    tolerance : the largest change in a sweep at which to stop, relative to the velocities of the
        problem, those that the impulses cause among them; a sweep rounds a dozen times, so that
        less than `EXACT` may never be reached"""
    a, b = needs(free, A.target, B.target, ((0.0, 0.0), (0.0, 0.0)), p)
    at_A = at_B = NO_IMPULSE
    mu, eta, settled = Friction(p.mu, A.s, A.t), Friction(p.eta, B.s, B.t), True
    if A.closed and B.closed:
        v_h, v_y, v_k, o_x, o_y, o_z = free
        scale = max(abs(v_h), abs(v_y), abs(v_k), p.r * abs(o_x), p.r * abs(o_y), p.r * abs(o_z))
        guess = Impulse(start.B_x / p.m, start.B_y / p.m, start.B_z / p.m)
        at_A, at_B, change = solve_pair(a, b, guess, mu, eta, p.j, tolerance * scale)
        largest = max(abs(at_A.n), abs(at_A.s), abs(at_A.t), abs(at_B.n), abs(at_B.s), abs(at_B.t))
        settled = change <= tolerance * max(scale, largest) < math.inf
    elif A.closed:
        at_A = project(a, mu)
    elif B.closed:
        at_B = project(b, eta)
    P = impulses(at_A, at_B, p.m)
    return rigid_body.apply(free, P, p), P, settled


def needs(
    free: Velocities, to_A: float, to_B: float, before: Slips, p: Any
) -> tuple[Impulse, Impulse]:
    """What A and B need to meet their normal velocities to_A, to_B and to undo their slips, with
    those `before` added, if the other one gives nothing."""
    share = p.j / (1 + p.j)  # of the mass, that a tangential impulse feels at the contact point
    (s_A, t_A), (s_B, t_B) = rigid_body.slip_at_A(free, p), rigid_body.slip_at_B(free, p)
    (more_s_A, more_t_A), (more_s_B, more_t_B) = before
    a = Impulse(to_A - free.v_y, -share * (s_A + more_s_A), -share * (t_A + more_t_A))
    b = Impulse(to_B - free.v_h, -share * (s_B + more_s_B), -share * (t_B + more_t_B))
    return a, b


def impulses(A: Impulse, B: Impulse, m: float) -> Forces:
    """Impulses of both contacts along the paper's axes, N s."""
    return Forces(m * A.s, m * A.n, m * A.t, m * B.n, m * B.s, m * B.t)


def project(need: Impulse, friction: Friction) -> Impulse:
    """The nearest impulse by Coulomb's law: friction in its disk, or against known slip."""
    n, s, t = need
    if n <= 0:
        return NO_IMPULSE
    limit = friction.coefficient * n
    if friction.s != 0 or friction.t != 0:
        return Impulse(n, -limit * friction.s, -limit * friction.t)
    size = math.sqrt(s * s + t * t)
    if size == 0:
        return Impulse(n, 0.0, 0.0)
    return need if size <= limit else Impulse(n, s * (limit / size), t * (limit / size))


def _share_met(need: Impulse, friction: Friction) -> Impulse:
    """Share of the need that `project` grants: 1 sticking, 0 open; and its direction (s, t)."""
    if need.n <= 0:
        return NO_IMPULSE
    if friction.s != 0 or friction.t != 0:
        return Impulse(0.0, -friction.s, -friction.t)
    size, limit = math.sqrt(need.s * need.s + need.t * need.t), friction.coefficient * need.n
    if size <= limit:
        return Impulse(1.0, 0.0, 0.0)
    return Impulse(limit / size, need.s / size, need.t / size)


def _project_rate(held: Impulse, friction: Friction, by: Impulse) -> Impulse:
    """Derivative of `project` in the direction `by`, where `_share_met` gave `held`."""
    share, e_s, e_t = held
    if share == 1 or (e_s == 0 and e_t == 0):
        return Impulse(share * by.n, share * by.s, share * by.t)
    along = friction.coefficient * by.n - share * (e_s * by.s + e_t * by.t)
    return Impulse(by.n, share * by.s + along * e_s, share * by.t + along * e_t)


def _need(a: Impulse, other: Impulse, k: float) -> Impulse:
    """The impulse that a contact needs once the other one gives `other`: a - C other."""
    return Impulse(a.n - other.s, a.s - (1 - k) * other.n + k * other.s, a.t - (1 - k) * other.t)


def _sweep_rate(
    at_A: Impulse, at_B: Impulse, by: Impulse, A: Friction, B: Friction, k: float
) -> Impulse:
    """How the impulse at B after a sweep changes if that before changes in the direction `by`."""
    by_A = _project_rate(at_A, A, _need(NO_IMPULSE, by, k))
    return _project_rate(at_B, B, _need(NO_IMPULSE, by_A, k))


def _cross(a: Impulse, b: Impulse) -> Impulse:
    return Impulse(a.s * b.t - a.t * b.s, a.t * b.n - a.n * b.t, a.n * b.s - a.s * b.n)


def _dot(a: Impulse, b: Impulse) -> float:
    return a.n * b.n + a.s * b.s + a.t * b.t


def _implicit_step(
    need_A: Impulse, need_B: Impulse, step: Impulse, span: float, A: Friction, B: Friction, k: float
) -> Impulse:
    """An implicit Euler step of dB/dt = f(B) - B over `span`; a sweep f takes B on by `step`."""
    at_A, at_B = _share_met(need_A, A), _share_met(need_B, B)
    x = _sweep_rate(at_A, at_B, Impulse(1.0, 0.0, 0.0), A, B, k)
    y = _sweep_rate(at_A, at_B, Impulse(0.0, 1.0, 0.0), A, B, k)
    z = _sweep_rate(at_A, at_B, Impulse(0.0, 0.0, 1.0), A, B, k)
    d = 1 + 1 / span
    x = Impulse(d - x.n, -x.s, -x.t)
    y = Impulse(-y.n, d - y.s, -y.t)
    z = Impulse(-z.n, -z.s, d - z.t)
    yz, n, s = _cross(y, z), _cross(step, z), _cross(y, step)
    size = _dot(x, yz)
    return Impulse(_dot(step, yz) / size, _dot(x, n) / size, _dot(x, s) / size)


def _contact_state(need: Impulse, given: Impulse) -> int:
    """State of a contact by the impulses needed and given: 0 open, 1 sticking, 2 sliding."""
    if given.n == 0:
        return 0
    return 1 if given.s == need.s and given.t == need.t else 2


def solve_pair(
    a: Impulse, b: Impulse, start: Impulse, A: Friction, B: Friction, j: float, enough: float
) -> tuple[Impulse, Impulse, float]:
    """Impulses of two closed contacts by Coulomb's law, from a guess at B; their last change.

    That is at most `enough` (m s-1) unless `MAX_SWEEPS` were not enough. Sweeps with Newton's
    method count from -`EAGER` up to 0, those after it from 0 on."""
    k, rough, before = 1 / (1 + j), A.coefficient * B.coefficient, -1
    at_A, at_B, count = start, start, -EAGER if rough < 1 else 0
    change, last, span, growth = math.inf, math.inf, SPAN, GROWTH
    while count < MAX_SWEEPS:
        attempt, sweeps = count // ATTEMPT, count % ATTEMPT
        if count >= 0 and sweeps == 0:
            last, span, growth = math.inf, SPAN, GROWTH
            at_B = start if attempt == 0 else NO_IMPULSE if attempt == 1 else at_B
        need_A = _need(a, at_B, k)
        at_A = project(need_A, A)
        need_B = _need(b, at_A, k)
        after = project(need_B, B)
        step = Impulse(after.n - at_B.n, after.s - at_B.s, after.t - at_B.t)
        change = abs(step.n) + abs(step.s) + abs(step.t)
        pace = DAMPED if attempt > 0 else 1.0
        if count < 0:
            sense = 3 * _contact_state(need_A, at_A) + _contact_state(need_B, after)
            if before != -1 and sense != before:  # a contact begins to stick, slide or open
                count = 0
                continue
            before = sense
        if change <= enough:
            return at_A, after, change
        if count < 0:
            step = _implicit_step(need_A, need_B, step, WHOLE, A, B, k)
        elif sweeps >= PLAIN_SWEEPS * (1 + attempt):
            if change <= last * (BOLD if attempt % 2 else WARY):
                span = min(span * growth, LONGEST_SPAN)
            # the rate of a sweep is of the order of mu eta at most: shorter spans damp no better
            else:
                span = max(span / SHORTER, 1 / (10 + rough))
                growth = max(growth**CALMER, LEAST_GROWTH)
            step, pace = _implicit_step(need_A, need_B, step, span, A, B, k), 1.0
        last = change
        at_B = Impulse(at_B.n + pace * step.n, at_B.s + pace * step.s, at_B.t + pace * step.t)
        count += 1
    return at_A, at_B, change
