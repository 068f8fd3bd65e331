"""Which case comes next: the rules by which the motion goes on from a moment at which a case ends.

Uniqueness. Where Coulomb's law allows more than one continuation, rolling is preferred to slipping: a contact that
rolls, or whose slip has just died out, rolls on if forces within its cone allow it. For RR, whose forces aren't
determined, that means until no admissible forces exist (or until the bound that the settings name). Otherwise case and
onset direction are those of the contact problem of the accelerations, found from zero forces.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from analytic import contact_problem, rigid_body, two_point_rolling
from analytic.contact_problem import Closed, NotConvergedError
from analytic.motion import Moment
from analytic.rigid_body import Place, Six
from model import Case, Contact, Parameters

STILL = 1e-9
"""Acceleration in units of g below which a contact point is at rest, well above what the contact problem leaves."""

EPS = math.ulp(1.0)
AT_REST = 1e-12
"""Slip relative to the speeds before an impact that counts as none after it: the contact problem leaves less."""


def choose(at: Moment, p: Parameters, omega_0: float, leave_rolling: str = "infeasible") -> tuple[Case, Moment]:
    """The case in which a ball goes on, and the moment with the directions of slip filled in.

    Contacts are closed where gap and normal speed are exactly zero, and still where the slip is.
    """
    x, u = at.x, rigid_body.velocities(at.x, p)
    closed_A, closed_B = x[0] == 0 == x[1], x[6] == 0 == x[7]
    slip_x = x[7] + x[1] + p.r * x[5]
    if abs(slip_x) <= 4 * EPS * abs(x[7]):  # round-off of a ball that rolls on the floor away from the wall
        slip_x = 0.0
    slip_A, slip_B = (slip_x, -p.r * x[3]), (-p.r * x[5], p.r * x[4])
    if closed_A and closed_B and not any(slip_A) and not any(slip_B):
        if two_point_rolling.holds(x[2], p, omega_0, leave_rolling):
            return Case.RR, replace(at, alpha=math.nan, beta=math.nan)
        if two_point_rolling.holds(x[2], p, omega_0, "infeasible") or two_point_rolling.onset(x[2], p, omega_0):
            return two_point_rolling.leave(at, p, omega_0)
    A, B = _closed(closed_A, slip_A), _closed(closed_B, slip_B)
    free = rigid_body.smooth_rates(u, Place(x[6] - p.R, 0.0, x[2]), omega_0, p)
    rates, force = contact_problem.solve(free, A, B, p, tolerance=STILL / 1e4)
    still = STILL * p.g
    contact_A, new_A = _contact(A, force[1], rates[1], rigid_body.slip_at_A(rates, p), still)
    contact_B, new_B = _contact(B, force[3], rates[0], rigid_body.slip_at_B(rates, p), still)
    alpha = math.atan2(-new_A[1], new_A[0]) if contact_A is Contact.S else math.nan
    beta = math.atan2(new_B[1], -new_B[0]) if contact_B is Contact.S else math.nan
    return Case.of(contact_A, contact_B), replace(at, alpha=alpha, beta=beta)


def _closed(closed: bool, slip: tuple[float, float]) -> Closed | None:
    if not closed:
        return None
    speed = math.hypot(*slip)
    return Closed(0.0, (slip[0] / speed, slip[1] / speed) if speed else None)


def _contact(
    contact: Closed | None, load: float, rise: float, slip_rate: tuple[float, float], still: float
) -> tuple[Contact, tuple[float, float]]:
    """State of a contact from its force and accelerations, and the direction in which it slips if it does."""
    if contact is None or (load <= 0 and rise > still):
        return Contact.N, (0.0, 0.0)
    if contact.slip:
        return Contact.S, contact.slip
    return (Contact.S, slip_rate) if math.hypot(*slip_rate) > still else (Contact.R, (0.0, 0.0))


@dataclass(frozen=True)
class Impact:
    """What an impact makes of a moment."""

    after: Moment
    impulse: Six


def collide(at: Moment, p: Parameters, omega_0: float, restitution: float, shortest: tuple[float, float]) -> Impact:
    """Impact of all contacts that touch, at once, with Newton's restitution; friction opposes the slip that is left.

    A single contact of a sphere obeys p_n = (1+e) m |v_n| and p_t = min(friction p_n, m_t |slip|) against the slip;
    two contacts are solved together, without a rebound if friction locks the ball (`contact_problem`). Bounces
    accumulate: a rebound whose hops would come to rest within `shortest` seconds (by the geometric series
    2 v_n/a/(1 - e)) stays in contact. The first of the two times is for a ball that touches the floor only, whose hops
    are known in closed form, the second for all others.
    """
    x, before = at.x, rigid_body.velocities(at.x, p)
    A = Closed(max(0.0, -restitution * x[1])) if x[0] == 0 else None
    B = Closed(max(0.0, -restitution * x[7])) if x[6] == 0 else None
    try:
        u, P = contact_problem.solve(before, A, B, p)
    except NotConvergedError as error:
        A = B = contact_problem.unlocked(error, p)
        u, P = contact_problem.solve(before, A, B, p)
    work = at.work + rigid_body.contact_work(rigid_body.mean(before, u), P, p)
    v_h, v_y = B.target if B and P[3] > 0 else u[0], A.target if A and P[1] > 0 else u[1]
    fall, fly_in = _returns(x, u, A is not None, B is not None, p, omega_0)
    if A and 2 * v_y <= shortest[0 if B is None else 1] * fall * (1 - restitution):
        v_y = 0.0
    if B and 2 * v_h <= shortest[1] * fly_in * (1 - restitution):
        v_h = 0.0
    y = list(rigid_body.state(x[0], x[6], (v_h, v_y, u[2], u[3], u[4], u[5]), p))
    still = AT_REST * math.hypot(*before[:3], *(p.r * o for o in before[3:]))
    if A and P[1] > 0 and math.hypot(*rigid_body.slip_at_A(u, p)) <= still:
        y[3], y[5] = 0.0, -(v_h + v_y) / p.r
    if B and P[3] > 0 and math.hypot(*rigid_body.slip_at_B(u, p)) <= still:
        y[4], y[5] = 0.0, 0.0
    return Impact(replace(at, x=y, alpha=math.nan, beta=math.nan, work=work), P)


def _returns(
    x: list[float], u: Six, touches_A: bool, touches_B: bool, p: Parameters, omega_0: float
) -> tuple[float, float]:
    """Accelerations that bring a ball back to floor and wall if it leaves them, each while it stays on the other."""
    free = rigid_body.smooth_rates(u, Place(x[6] - p.R, 0.0, u[2] / (p.R - x[6])), omega_0, p)
    on_B, _ = contact_problem.solve(free, None, Closed() if touches_B and u[0] <= 0 else None, p)
    on_A, _ = contact_problem.solve(free, Closed() if touches_A and u[1] <= 0 else None, None, p)
    return -on_B[1], -on_A[0]
