"""Which case comes next where a case ends.

Uniqueness. Where Coulomb's law allows the ball to roll on and to slip or lift away, it rolls on only if every slight
slip dies out: at two rolling contacts that is `rolling_forces.slip_margin`, at a single one this means that its cone
holds forces that keep it rolling (docs/theory.md). Case and slip directions are then those of the contact problem of
the accelerations.
"""

from __future__ import annotations

import math

from analytic.mechanics import contact_problem, dynamics, rigid_body, rolling_forces
from analytic.mechanics.contact_problem import Closed, NotConvergedError
from analytic.mechanics.rigid_body import NOTHING, Forces
from analytic.simulation import two_point_rolling
from analytic.simulation.motion import FINER, Moment
from model import Case, Contact, Parameters
from model.drag import STOKES

LEAST_ACCELERATION = 1e-9
"""Acceleration in units of g below which a contact point is at rest, well above what the contact problem leaves."""
AT_ONSET = 1e-7
"""Slip margin up to which slip is at its onset: the accelerations are hardly more than `LEAST_ACCELERATION`."""

EPS = math.ulp(1.0)
AT_REST = 1e-12
"""Slip after an impact, relative to the speeds before it, that counts as none: the contact problem leaves less."""


def choose(at: Moment, p: Parameters, omega_0: float, leave_rolling: str = "slip-stability") -> tuple[Case, Moment]:
    """The case in which a ball goes on, and the moment with the directions of slip filled in.

    Contacts are closed where gap and normal speed are exactly zero, and still where the slip is.
    """
    x = at.x
    slip_x = x.v_h + x.v_y + p.r * x.slip_z
    if abs(slip_x) <= 4 * EPS * abs(x.v_h):  # round-off of a ball that rolls on the floor away from the wall
        slip_x = 0.0
    A = _closed((slip_x, -p.r * x.slip_x)) if x.y == 0 == x.v_y else None
    B = _closed((-p.r * x.slip_z, p.r * x.slip_y)) if x.h == 0 == x.v_h else None
    if not (A == B == Closed()):
        return _by_accelerations(at, A, B, p, omega_0)
    if two_point_rolling.MARGINS[leave_rolling](x.omega_c, p, omega_0) >= 0:
        return Case.RR, at._replace(alpha=math.nan, beta=math.nan)
    return leave(at, p, omega_0)


def leave(at: Moment, p: Parameters, omega_0: float) -> tuple[Case, Moment]:
    """The case that follows RR where slip or lift lasts, and the moment with its slip directions.

    Friction is full where slip sets in and opposes it: forces and rates pass continuously from rolling to slipping.
    Beyond the onset the contact problem may have a solution that rolls, too: one that moves is reached from the forces
    at which rolling gives way.
    """
    share = float(rolling_forces.last_share(at.x.omega_c, p, omega_0))
    last = dynamics.rolling_family(at.x.omega_c, p, omega_0, share * p.m * p.g)
    if rolling_forces.slip_margin(at.x.omega_c, p, omega_0) <= -AT_ONSET:
        return _by_accelerations(at, Closed(), Closed(), p, omega_0, last)
    A_x, A_y, A_z, B_x, B_y, B_z = last
    alpha, beta = math.atan2(A_z, -A_x), math.atan2(-B_z, B_y)
    wall_alone = p.eta * (B_x + B_y) - abs(B_z)  # what its cone has left where it carries no weight
    if wall_alone < p.mu * A_y - math.hypot(A_x, A_z):
        return Case.RS, at._replace(alpha=math.nan, beta=beta)
    if abs(A_x) <= 16 * EPS * B_y:
        return Case.SR, at._replace(alpha=alpha, beta=math.nan)
    return Case.SS, at._replace(alpha=alpha, beta=beta)


def _closed(slip: tuple[float, float]) -> Closed:
    speed = math.hypot(*slip)
    return Closed(0.0, (slip[0] / speed, slip[1] / speed) if speed else None)


def _by_accelerations(
    at: Moment, A: Closed | None, B: Closed | None, p: Parameters, omega_0: float, start: Forces = NOTHING
) -> tuple[Case, Moment]:
    """Case and slip directions by the contact problem of the accelerations, solved from the forces `start`."""
    free = rigid_body.smooth_rates(rigid_body.velocities(at.x, p), at.x.h, omega_0, p)
    rates, force = contact_problem.solve(free, A, B, p, start, tolerance=LEAST_ACCELERATION / 1e4)
    contact_A, along_A = _contact(A, force.A_y, rates.v_y, rigid_body.slip_at_A(rates, p), p)
    contact_B, along_B = _contact(B, force.B_x, rates.v_h, rigid_body.slip_at_B(rates, p), p)
    alpha = math.atan2(-along_A[1], along_A[0]) if contact_A is Contact.S else math.nan
    beta = math.atan2(along_B[1], -along_B[0]) if contact_B is Contact.S else math.nan
    return Case.of(contact_A, contact_B), at._replace(alpha=alpha, beta=beta)


def _contact(
    contact: Closed | None, load: float, rise: float, slip_rate: tuple[float, float], p: Parameters
) -> tuple[Contact, tuple[float, float]]:
    """State of a contact from its force and accelerations, and the direction in which it slips if it does."""
    still = LEAST_ACCELERATION * p.g
    if contact is None or (load <= 0 and rise > still):
        return Contact.N, (0.0, 0.0)
    if contact.slip:
        return Contact.S, contact.slip
    return (Contact.S, slip_rate) if math.hypot(*slip_rate) > still else (Contact.R, (0.0, 0.0))


def collide(at: Moment, p: Parameters, omega_0: float, restitution: float, rtol: float) -> tuple[Moment, Forces]:
    """The moment after an impact, and its impulses: all contacts that touch at once, by Newton's restitution.

    Friction opposes the slip that is left. A single contact of a sphere obeys p_n = (1+e) m |v_n| and
    p_t = min(friction p_n, m_t |slip|) against the slip; two contacts are solved together, without a rebound if
    friction locks the ball (`contact_problem`). Bounces accumulate: a rebound whose hops would come to rest (by the
    geometric series 2 v_n/a/(1 - e)) within rtol sqrt(R/g) where they are known, of a ball that touches the floor only,
    and elsewhere as soon as the tolerance `rtol` of the integrator resolves their height, stays in contact.
    """
    x, before = at.x, rigid_body.velocities(at.x, p)
    A = Closed(max(0.0, -restitution * x.v_y)) if x.y == 0 else None
    B = Closed(max(0.0, -restitution * x.v_h)) if x.h == 0 else None
    try:
        u, P = contact_problem.solve(before, A, B, p)
    except NotConvergedError:
        if p.mu < 1 or p.eta < 1:
            raise
        A = B = Closed()  # friction locks the ball in the corner: no rebound
        u, P = contact_problem.solve(before, A, B, p)
    work = at.work + rigid_body.contact_work(rigid_body.mean(before, u), P, p)
    v_h, v_y = B.target if B and P.B_x > 0 else u.v_h, A.target if A and P.A_y > 0 else u.v_y
    # Accelerations that bring it back to floor and wall if it leaves them, each while it stays on the other.
    free = rigid_body.smooth_rates(u, x.h, omega_0, p)
    on_B, _ = contact_problem.solve(free, None, Closed() if B and u.v_h <= 0 else None, p)
    on_A, _ = contact_problem.solve(free, Closed() if A and u.v_y <= 0 else None, None, p)
    # A hop that lasts T rises by g T^2/8, well above the tolerance of lengths.
    unit, integrated = math.sqrt(p.R / p.g), math.sqrt(8 * rtol / FINER * p.R / p.g)
    if A and 2 * v_y <= (integrated if B or p.drag != STOKES else rtol * unit) * -on_B.v_y * (1 - restitution):
        v_y = 0.0
    if B and 2 * v_h <= integrated * -on_A.v_h * (1 - restitution):
        v_h = 0.0
    y = rigid_body.state(x.y, x.h, u._replace(v_h=v_h, v_y=v_y), p)
    still = AT_REST * math.hypot(*before[:3], *(p.r * o for o in before[3:]))
    if A and P.A_y > 0 and math.hypot(*rigid_body.slip_at_A(u, p)) <= still:
        y = y._replace(slip_x=0.0, slip_z=-(v_h + v_y) / p.r)
    if B and P.B_x > 0 and math.hypot(*rigid_body.slip_at_B(u, p)) <= still:
        y = y._replace(slip_y=0.0, slip_z=0.0)
    return at._replace(x=y, alpha=math.nan, beta=math.nan, work=work), P
