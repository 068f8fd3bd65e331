"""Which case comes next where a case ends.

Uniqueness. Where Coulomb's law allows the ball to roll on and to slip or lift away, it rolls on
only if every slight slip dies out: at two rolling contacts that is `rolling_forces.slip_margin`, at
a single one this means that its cone holds forces that keep it rolling (docs/theory.md). Case and
slip directions are then those of the contact problem of the accelerations.

All on plain floats, cases and guards by number, and compiled."""

import math

from analytic.mechanics import contact_problem, rigid_body
from analytic.mechanics.contact_problem import ABSENT, EXACT, RESTS, Closed, NotConvergedError
from analytic.mechanics.rigid_body import NOTHING, Forces, Velocities
from analytic.simulation import equations
from analytic.simulation.equations import AWAY, RN, ROLLS, RR, RS, SLIPS, SR, SS, System
from analytic.simulation.motion import HybridState
from model import State

LEAST_ACCELERATION = 1e-9
"""Acceleration in units of g below which a contact rests, above what the contact problem leaves."""
AT_ONSET = 1e-7
"""Slip margin at the onset of slip: accelerations are hardly more than `LEAST_ACCELERATION`."""

EPS = math.ulp(1.0)
AT_REST = 1e-12
"""Slip after an impact, relative to speeds before, that is none: what is solved leaves less."""
UNSETTLED = "the contact problem doesn't settle"


def react(guard: int, case: int, at: HybridState, k: System) -> tuple[int, HybridState, Forces]:
    """What follows when a guard has fired: next case, hybrid state, and impulses of an impact."""
    x, A, B = at.x, case // 3, case % 3
    still = 10 * k.rtol * k.spin  # slip that counts as zero where the other contact has just stuck
    if guard in (equations.A_SLIPS, equations.B_SLIPS):
        # Slip sets in against the friction of the contact that rolls so far.
        if case == RN:
            lag = x.omega_c - equations.fluid(at.time, k)
            alpha = math.atan2((k.R - x.h) * lag, -x.v_h)
            return 3 * SLIPS + B, with_directions(at, x, alpha, at.beta), NOTHING
        A_x, _, A_z, _, B_y, B_z = _forces(case, at, k)
        if guard == equations.A_SLIPS:
            return 3 * SLIPS + B, with_directions(at, x, math.atan2(A_z, -A_x), at.beta), NOTHING
        return 3 * A + SLIPS, with_directions(at, x, at.alpha, math.atan2(-B_z, B_y)), NOTHING
    if guard == equations.A_LIFTS:
        return 3 * AWAY + B, with_directions(at, x, math.nan, at.beta), NOTHING
    if guard == equations.B_OPENS:
        return 3 * A + AWAY, with_directions(at, x, at.alpha, math.nan), NOTHING
    if guard == equations.RR_ENDS:
        after, at = leave(at, k)
        return after, at, NOTHING
    y, v_y, omega_c, slip_x, slip_y, slip_z, h, v_h = x
    if guard == equations.A_STICKS:
        slip_x, slip_z = 0.0, -(v_h + v_y) / k.r
        if B == SLIPS and abs(slip_y) <= still:
            slip_y = 0.0
    elif guard == equations.B_STICKS:
        slip_y = slip_z = 0.0
        if A == SLIPS and abs(slip_x) <= still:
            slip_x = 0.0
    elif guard == equations.A_LANDS:
        y = 0.0
    else:
        h = 0.0
    x = State(y, v_y, omega_c, slip_x, slip_y, slip_z, h, v_h)
    return settle(with_directions(at, x, at.alpha, at.beta), k)


def settle(at: HybridState, k: System) -> tuple[int, HybridState, Forces]:
    """Collide if the ball moves into something it touches, then find the case."""
    x, impulse = at.x, NOTHING
    if (x.y == 0 and x.v_y < 0) or (x.h == 0 and x.v_h < 0):
        at, impulse = collide(at, k)
    case, at = choose(at, k)
    return case, at, impulse


def with_directions(at: HybridState, x: State, alpha: float, beta: float) -> HybridState:
    """The hybrid state with another state and directions of slip."""
    return HybridState(at.time, at.theta, x, alpha, beta, at.work)


def choose(at: HybridState, k: System) -> tuple[int, HybridState]:
    """The case in which a ball goes on, and the hybrid state with the directions of slip.

    Contacts are closed where gap and normal speed are exactly zero, and still where the slip is."""
    x = at.x
    slip_x = x.v_h + x.v_y + k.r * x.slip_z
    # round-off of a ball that rolls on the floor away from the wall
    if abs(slip_x) <= 4 * EPS * abs(x.v_h):
        slip_x = 0.0
    A = _contact(x.y == 0 and x.v_y == 0, slip_x, -k.r * x.slip_x)
    B = _contact(x.h == 0 and x.v_h == 0, -k.r * x.slip_z, k.r * x.slip_y)
    slips = A.s != 0 or A.t != 0 or B.s != 0 or B.t != 0
    if slips or not (A.closed and B.closed):
        return _by_accelerations(at, A, B, NOTHING, k)
    if equations.rolls_on(x.omega_c, at.time, k) >= 0:
        return RR, with_directions(at, x, math.nan, math.nan)
    return leave(at, k)


def leave(at: HybridState, k: System) -> tuple[int, HybridState]:
    """The case that follows RR where slip or lift lasts, and the hybrid state with its directions.

    Friction is full where slip sets in and opposes it: forces and rates pass continuously from
    rolling to slipping. Beyond the onset the contact problem may have a solution that rolls, too:
    one that moves is reached from the forces at which rolling gives way."""
    u, z = equations.loads(at.x.omega_c, at.time, k)
    B_y = equations.last_share(u, z, k) * k.m * k.g
    A_x, A_y, A_z, B_x, _, B_z = _forces(RR, at, k)
    A_x, A_y, B_x = A_x + B_y, A_y - B_y, B_x - B_y
    if equations.slip_margin(u, z, k) <= -AT_ONSET:
        return _by_accelerations(at, RESTS, RESTS, Forces(A_x, A_y, A_z, B_x, B_y, B_z), k)
    alpha, beta = math.atan2(A_z, -A_x), math.atan2(-B_z, B_y)
    wall_alone = k.eta * (B_x + B_y) - abs(B_z)  # what its cone has left where it carries no weight
    if wall_alone < k.mu * A_y - math.hypot(A_x, A_z):
        return RS, with_directions(at, at.x, math.nan, beta)
    if abs(A_x) <= 16 * EPS * B_y:
        return SR, with_directions(at, at.x, alpha, math.nan)
    return SS, with_directions(at, at.x, alpha, beta)


def _forces(case: int, at: HybridState, k: System) -> tuple[float, ...]:
    """Forces of floor and wall in a case at the wall, as `equations.forces`, N."""
    x, lag = at.x, at.x.omega_c - equations.fluid(at.time, k)
    s_A, c_A = math.sin(at.alpha), math.cos(at.alpha)
    s_B, c_B = math.sin(at.beta), math.cos(at.beta)
    c = equations.drag_rate(x.v_h, x.v_y, k.R * lag, k)
    return equations.forces(case, x.omega_c, x.v_y, x.slip_x, c, lag, s_A, c_A, s_B, c_B, k)


def _contact(closed: bool, s: float, t: float) -> Closed:
    """A contact for the contact problem, from whether it is closed and its slip, m s-1."""
    speed = math.hypot(s, t)
    if not closed:
        return ABSENT
    return Closed(0.0, s / speed, t / speed, True) if speed > 0 else RESTS


def _by_accelerations(
    at: HybridState, A: Closed, B: Closed, start: Forces, k: System
) -> tuple[int, HybridState]:
    """Case and slip directions by the contact problem of accelerations, from the forces `start`."""
    free = equations.smooth_rates(rigid_body.velocities(at.x, k), at.x.h, at.time, k)
    rates, force, settled = contact_problem.solve(free, A, B, k, start, LEAST_ACCELERATION / 1e4)
    if not settled:
        raise NotConvergedError(UNSETTLED)
    (s_A, t_A), (s_B, t_B) = rigid_body.slip_at_A(rates, k), rigid_body.slip_at_B(rates, k)
    contact_A, s_A, t_A = _contact_after(A, force.A_y, rates.v_y, s_A, t_A, k)
    contact_B, s_B, t_B = _contact_after(B, force.B_x, rates.v_h, s_B, t_B, k)
    alpha = math.atan2(-t_A, s_A) if contact_A == SLIPS else math.nan
    beta = math.atan2(t_B, -s_B) if contact_B == SLIPS else math.nan
    return 3 * contact_A + contact_B, with_directions(at, at.x, alpha, beta)


def _contact_after(
    contact: Closed, load: float, rise: float, s: float, t: float, k: System
) -> tuple[int, float, float]:
    """State of a contact from its force and accelerations, and the direction of its slip."""
    still = LEAST_ACCELERATION * k.g
    if not contact.closed or (load <= 0 and rise > still):
        return AWAY, 0.0, 0.0
    if contact.s != 0 or contact.t != 0:
        return SLIPS, contact.s, contact.t
    return (SLIPS, s, t) if math.hypot(s, t) > still else (ROLLS, 0.0, 0.0)


def collide(at: HybridState, k: System) -> tuple[HybridState, Forces]:
    """Hybrid state after an impact, and impulses: all contacts at once, by Newton's restitution.

    Friction opposes the slip that is left. A single contact of a sphere obeys p_n = (1+e) m |v_n|
    and p_t = min(friction p_n, m_t |slip|) against the slip; two contacts are solved together,
    without a rebound if friction locks the ball (`contact_problem`). Bounces accumulate: a rebound
    whose hops would come to rest (by the geometric series 2 v_n/a/(1 - e)) within rtol sqrt(R/g)
    where they are known, of a ball that touches the floor only, and elsewhere as soon as the
    tolerance `rtol` of the integrator resolves their height, stays in contact."""
    x, before, e = at.x, rigid_body.velocities(at.x, k), k.restitution
    A = Closed(max(0.0, -e * x.v_y), 0.0, 0.0, x.y == 0)
    B = Closed(max(0.0, -e * x.v_h), 0.0, 0.0, x.h == 0)
    u, P, settled = contact_problem.solve(before, A, B, k, NOTHING, EXACT)
    if not settled and k.mu >= 1 and k.eta >= 1:
        A = B = RESTS  # friction locks the ball in the corner: no rebound
        u, P, settled = contact_problem.solve(before, A, B, k, NOTHING, EXACT)
    if not settled:
        raise NotConvergedError(UNSETTLED)
    work = at.work + rigid_body.contact_work(rigid_body.mean(before, u), P, k)
    v_h = B.target if B.closed and P.B_x > 0 else u.v_h
    v_y = A.target if A.closed and P.A_y > 0 else u.v_y
    # Accelerations that bring it back to floor and wall if it leaves them, each while it stays on
    # the other.
    free = equations.smooth_rates(u, x.h, at.time, k)
    on_B, _, _ = contact_problem.solve(
        free, ABSENT, RESTS if B.closed and u.v_h <= 0 else ABSENT, k, NOTHING, EXACT
    )
    on_A, _, _ = contact_problem.solve(
        free, RESTS if A.closed and u.v_y <= 0 else ABSENT, ABSENT, k, NOTHING, EXACT
    )
    # A hop that lasts T rises by g T^2/8, well above the tolerance of lengths.
    integrated = math.sqrt(8 * k.rtol / equations.FINER * k.R / k.g)
    known = integrated if B.closed or not k.stokes else k.rtol * k.unit
    if A.closed and 2 * v_y <= known * -on_B.v_y * (1 - e):
        v_y = 0.0
    if B.closed and 2 * v_h <= integrated * -on_A.v_h * (1 - e):
        v_h = 0.0
    left = Velocities(v_h, v_y, u.v_k, u.o_x, u.o_y, u.o_z)
    y, v_y, omega_c, slip_x, slip_y, slip_z, h, v_h = rigid_body.state(x.y, x.h, left, k)
    spin = k.r * k.r * (before.o_x * before.o_x + before.o_y * before.o_y + before.o_z * before.o_z)
    speed = before.v_h * before.v_h + before.v_y * before.v_y + before.v_k * before.v_k
    still = AT_REST * math.sqrt(speed + spin)
    (s_A, t_A), (s_B, t_B) = rigid_body.slip_at_A(u, k), rigid_body.slip_at_B(u, k)
    if A.closed and P.A_y > 0 and math.hypot(s_A, t_A) <= still:
        slip_x, slip_z = 0.0, -(v_h + v_y) / k.r
    if B.closed and P.B_x > 0 and math.hypot(s_B, t_B) <= still:
        slip_y = slip_z = 0.0
    after = State(y, v_y, omega_c, slip_x, slip_y, slip_z, h, v_h)
    return HybridState(at.time, at.theta, after, math.nan, math.nan, work), P
