"""Coulomb's law at floor and wall at once, for time stepping: compiled where numba is installed.

Per mass m, the impulse (n, s, t) of a contact (normal, towards the other contact, along k) changes what the other one
needs to meet its target and to rest, were there no limit of friction, by C (n, s, t) = (s, j k n - k s, j k t) with
k = 1/(1+j): the same both ways. Coulomb's law is then

    A = project(a - C B, mu),  B = project(b - C A, eta),

where a and b are what A and B need if the other one gives nothing; `contact_problem` states the law. A sweep computes
A from B and B from that. Newton's method on the change of a sweep settles most steps in one or two, as it starts from
the impulses of the step before; while the ball rolls at both points B is undetermined along one direction, and a little
damping keeps it from drifting there. Where a contact begins to stick, slide or open, Newton's method may end in another
solution than sweeps do: then, and where sweeps may lead away from a solution (mu eta > 1), plain sweeps are taken.
Where these approach slowly or swing, pseudo-transient continuation takes over (see `contact_problem`);
where that fails, it starts again from nothing and from damped sweeps.

**Which solution.** Where mu > 1, sticking and slipping may both obey the law. Taken is the one that continues the last
step's: the ball goes on rolling until no impulses near the present ones hold it. It then slips, whereas the forces
within both cones, far from the present ones, might hold it for longer.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from analytic.compiling import compiled

EAGER, WHOLE = 5, 1e4
"""Most sweeps with Newton's method from the start, and the length of its steps in `_continued`."""
PLAIN_SWEEPS = 6
"""Sweeps before the continuation takes over."""
ATTEMPT = 100
"""Sweeps after which the continuation starts again, from elsewhere."""
DAMPED = 0.5
"""Share of a sweep that is taken in all attempts but the first, before the continuation."""
WARY, BOLD = 1.0, 1.3
"""As in `contact_problem`, and so are the next."""
SPAN, GROWTH, LONGEST = 1.0, 8.0, 1e8
SHORTER, CALMER, LEAST_GROWTH = 20.0, 0.7, 1.1
MAX_SWEEPS = 1000


class Impulse(NamedTuple):
    """Impulse of one contact per mass, m s-1."""

    n: float
    """Normal."""
    s: float
    """Tangential, along the normal of the other contact."""
    t: float
    """Tangential, along k."""


@compiled
def project(n: float, s: float, t: float, friction: float) -> Impulse:
    """The impulse that Coulomb's law allows: friction is the point of its disk next to (s, t)."""
    if n <= 0:
        return Impulse(0.0, 0.0, 0.0)
    size, limit = math.sqrt(s * s + t * t), friction * n
    if size <= limit:
        return Impulse(n, s, t)
    return Impulse(n, s * (limit / size), t * (limit / size))


@compiled
def _held(need: Impulse, friction: float) -> Impulse:
    """Which share of a need `project` meets along the disk, 0 if open, 1 if sticking, and the direction there."""
    if need.n <= 0:
        return Impulse(0.0, 0.0, 0.0)
    size, limit = math.sqrt(need.s * need.s + need.t * need.t), friction * need.n
    return Impulse(limit / size, need.s / size, need.t / size) if size > limit else Impulse(1.0, 0.0, 0.0)


@compiled
def _project_rate(held: Impulse, friction: float, by: Impulse) -> Impulse:
    """Derivative of `project` in the direction `by`, at a need that is so `_held`."""
    share, e_s, e_t = held
    if share == 0 or share == 1:
        return Impulse(share * by.n, share * by.s, share * by.t)
    along = friction * by.n - share * (e_s * by.s + e_t * by.t)
    return Impulse(by.n, share * by.s + along * e_s, share * by.t + along * e_t)


@compiled
def _less(a: Impulse, other: Impulse, k: float) -> Impulse:
    """a - C other: what a contact needs when the other one gives that."""
    return Impulse(a.n - other.s, a.s - (1 - k) * other.n + k * other.s, a.t - (1 - k) * other.t)


@compiled
def _sweep_rate(at_A: Impulse, at_B: Impulse, by: Impulse, mu: float, eta: float, k: float) -> Impulse:
    """How the impulse at B after a sweep changes if that before it changes in the direction `by`."""
    still = Impulse(0.0, 0.0, 0.0)
    return _project_rate(at_B, eta, _less(still, _project_rate(at_A, mu, _less(still, by, k)), k))


@compiled
def _cross(a: Impulse, b: Impulse) -> Impulse:
    return Impulse(a.s * b.t - a.t * b.s, a.t * b.n - a.n * b.t, a.n * b.s - a.s * b.n)


@compiled
def _dot(a: Impulse, b: Impulse) -> float:
    return a.n * b.n + a.s * b.s + a.t * b.t


@compiled
def _continued(at_A: Impulse, at_B: Impulse, step: Impulse, span: float, mu: float, eta: float, k: float) -> Impulse:
    """An implicit Euler step of length `span` of dB/dt = f(B) - B, where a sweep f takes B on by `step`."""
    at_A, at_B = _held(at_A, mu), _held(at_B, eta)
    x = _sweep_rate(at_A, at_B, Impulse(1.0, 0.0, 0.0), mu, eta, k)
    y = _sweep_rate(at_A, at_B, Impulse(0.0, 1.0, 0.0), mu, eta, k)
    z = _sweep_rate(at_A, at_B, Impulse(0.0, 0.0, 1.0), mu, eta, k)
    d = 1 + 1 / span
    x, y, z = Impulse(d - x.n, -x.s, -x.t), Impulse(-y.n, d - y.s, -y.t), Impulse(-z.n, -z.s, d - z.t)
    yz = _cross(y, z)
    size = _dot(x, yz)
    return Impulse(_dot(step, yz) / size, _dot(x, _cross(step, z)) / size, _dot(x, _cross(y, step)) / size)


@compiled
def _sense(need: Impulse, given: Impulse) -> int:
    """0 if a contact that needs an impulse and is given another is open, 1 if it sticks, 2 if it slides."""
    if given.n == 0:
        return 0
    return 1 if given.s == need.s and given.t == need.t else 2


@compiled
def _quickly(
    a: Impulse, b: Impulse, start: Impulse, mu: float, eta: float, k: float, enough: float
) -> tuple[Impulse, Impulse, float]:
    """`both` by Newton's method, as long as no contact begins to stick, slide or open; else the change is inf."""
    B, before = start, -1
    for _ in range(EAGER):
        need_A = _less(a, B, k)
        A = project(need_A.n, need_A.s, need_A.t, mu)
        need_B = _less(b, A, k)
        after = project(need_B.n, need_B.s, need_B.t, eta)
        sense = 3 * _sense(need_A, A) + _sense(need_B, after)
        if before not in (-1, sense):
            break
        step = Impulse(after.n - B.n, after.s - B.s, after.t - B.t)
        change = abs(step.n) + abs(step.s) + abs(step.t)
        if change <= enough:
            return A, after, change
        step, before = _continued(need_A, need_B, step, WHOLE, mu, eta, k), sense
        B = Impulse(B.n + step.n, B.s + step.s, B.t + step.t)
    return start, start, math.inf


@compiled
def both(
    a: Impulse, b: Impulse, start: Impulse, mu: float, eta: float, j: float, enough: float
) -> tuple[Impulse, Impulse, float]:
    """Impulses of A and B that obey Coulomb's law, from a first guess of B; and by how much they still changed.

    That is at most `enough` (m s-1) unless `MAX_SWEEPS` were not enough.
    """
    k = 1 / (1 + j)
    if mu * eta < 1:
        A, B, change = _quickly(a, b, start, mu, eta, k, enough)
        if change <= enough:
            return A, B, change
    A, B = start, start
    change, last, span, growth = math.inf, math.inf, SPAN, GROWTH
    for count in range(MAX_SWEEPS):
        attempt, sweeps = count // ATTEMPT, count % ATTEMPT
        if sweeps == 0:
            last, span, growth = math.inf, SPAN, GROWTH
            B = Impulse(0.0, 0.0, 0.0) if attempt == 1 else B
        need_A = _less(a, B, k)
        A = project(need_A.n, need_A.s, need_A.t, mu)
        need_B = _less(b, A, k)
        after = project(need_B.n, need_B.s, need_B.t, eta)
        step = Impulse(after.n - B.n, after.s - B.s, after.t - B.t)
        change = abs(step.n) + abs(step.s) + abs(step.t)
        if change <= enough:
            return A, after, change
        pace = DAMPED if attempt else 1.0
        if sweeps >= PLAIN_SWEEPS * (1 + attempt):
            if change <= last * (BOLD if attempt % 2 else WARY):
                span = min(span * growth, LONGEST)
            else:  # the rate of a sweep is of the order of mu eta at most: shorter spans damp no better
                span, growth = max(span / SHORTER, 1 / (10 + mu * eta)), max(growth**CALMER, LEAST_GROWTH)
            step, pace = _continued(need_A, need_B, step, span, mu, eta, k), 1.0
        last = change
        B = Impulse(B.n + pace * step.n, B.s + pace * step.s, B.t + pace * step.t)
    return A, B, change
