"""Rigid contacts: Moreau and Jean's time stepping in MuJoCo's rows.

A closed contact asks for the velocity at the end of the step: none, or Newton's share of that
before an impact (Moreau 1988; Jean 1999, Comput. Methods Appl. Mech. Eng. 177). One that is open
may close its gap. Friction of what slides on opposes its slip in the middle of the step.
"""

from __future__ import annotations

import math
from typing import Any

from .compiling import kernel
from .contacts import smaller_radius
from .engine import integers, mj_factorM, mj_fwdActuation, mjd_smooth_vel, reals
from .friction import shift
from .memory import (
    CONTACT_ROW,
    DRY,
    OPEN,
    SLIDES,
    contacts_of,
    dry_rows_of,
    rows_of,
    rows_of_contact,
)
from .parameters import ALIGNED, APART, BOUNCES, NARROW, STUCK, USUAL_STEP
from .rows import times
from .vectors import NONE, applied, cross, dot, plus, times_vector

# -- contacts --------------------------------------------------------------------------------------


@kernel
def stiffen(model: Any, data: Any, memory: Any) -> None:
    """Make contacts and dry friction stiff, and let them ask for velocities at the end of the
    step."""
    h = model.opt.timestep
    for contact in contacts_of(memory):
        rows = rows_of_contact(memory, contact)
        goal = velocity_to_ask_for(model, memory, contact, rows[0])
        if memory.bounces:
            goal = bounced(model, data, memory, contact, goal)
        factor = memory.law.regularisation * rows[0].estimate / rows[0].R
        for row in rows:
            row.R *= factor
            row.reference = -row.velocity / h
        rows[0].reference = (goal - rows[0].velocity) / h
    for row in dry_rows_of(memory):
        row.R = memory.law.regularisation * row.estimate
        row.reference = -row.velocity / h


@kernel
def is_moved_by_hand(model: Any, contact: Any) -> bool:
    """Whether a body in contact is a mocap body, or joined to one.

    MuJoCo knows no velocity of these, so that depth is all that tells of it.
    """
    bodies = integers(model.geom_bodyid, model.ngeom)
    mocaps = integers(model.body_mocapid, model.nbody)
    roots = integers(model.body_rootid, model.nbody)
    one, other = roots[bodies[contact.geoms[0]]], roots[bodies[contact.geoms[1]]]
    return bool(max(mocaps[one], mocaps[other]) >= 0)


@kernel
def depth_kept(model: Any, memory: Any, contact: Any) -> float:
    """Depth that a rigid contact keeps, m."""
    scale = (model.opt.timestep / USUAL_STEP) ** 2
    return float(memory.law.depth * scale * smaller_radius(model, contact.geoms))


@kernel
def velocity_to_ask_for(model: Any, memory: Any, contact: Any, normal: Any) -> float:
    """Velocity of a contact's normal row that closes a gap in the step, or takes a share of a depth
    away, m s-1.

    Of the gap of a contact that has borne something, and would close under that and a weight, it
    takes the same share: closed at once, that would be an impact. (Points of contact jump by the
    length of a cell of a heightfield, and hand on what they bear: one that is far off still mustn't
    bear it.)
    """
    h, law = model.opt.timestep, memory.law
    if contact.gap > 0:
        closing = h * (memory.gravity + normal.estimate * contact.load) - normal.velocity
        closes = contact.gap < h * closing
        return float(-contact.gap / h * (law.push if closes and contact.load > 0 else 1.0))
    kept = depth_kept(model, memory, contact)
    fastest = math.inf if is_moved_by_hand(model, contact) else h * memory.gravity
    if normal.estimate * normal.remembered > STUCK * memory.gravity:
        fastest = 0.0
    return float(min(law.push * max(-contact.gap - kept, 0.0) / h, fastest))


@kernel
def bounced(model: Any, data: Any, memory: Any, contact: Any, goal: float) -> float:
    """Normal velocity that a contact which may bounce asks for, m s-1; `goal` if it doesn't bounce.

    What an impact makes touch, or touch again, bounces in the next step.
    """
    given, h = reals(memory.restitution_at, memory.bounces), model.opt.timestep
    share = max(given[contact.geoms[0]], given[contact.geoms[1]])
    if share == 0:
        return goal
    free = reals(data.qacc_smooth, model.nv)  # of the last step, without impacts
    normal = rows_of_contact(memory, contact)[0]
    speed, fall = normal.velocity, h * max(-times(memory, normal, free), 0.0)
    parts = speed > BOUNCES * h * memory.gravity
    comes = contact.load == 0 and contact.gap + h * (speed - fall) > 0
    if parts or comes:
        return float(-APART * h)
    return float(max(goal, rebound(share, contact.gap, speed, fall, h)))


@kernel
def rebound(restitution: float, gap: float, speed: float, fall: float, h: float) -> float:
    """Speed after an impact that keeps Newton's share of the energy with which a fall ends, m s-1.

    `fall` is what the step adds to the speed. Euler's method keeps v²/2 + gz - hgv/2 in flight.
    """
    if gap + h * (speed - fall) >= 0 or speed >= -BOUNCES * fall:
        return -math.inf
    above = max(gap, 0.0)
    energy = speed * (speed - fall) / 2 + fall / h * above
    square = fall**2 / 4 + 2 * (restitution**2 * energy - fall / h * above)
    return math.sqrt(square) - fall / 2 if square > 0 else -math.inf  # it wouldn't come so high


@kernel
def share_loads(model: Any, memory: Any) -> None:
    """Let points at which a body slides over another hold loads which lie on a plane, if they are
    more than three.

    What else of their loads there is, no motion tells; errors of predicted slip would pile up,
    until one of them bears nothing.
    """
    contacts, first = contacts_of(memory), 0
    while first < memory.contacts:
        after, slides = first + 1, slides_on(model, memory, contacts[first])
        while after < memory.contacts and same_face(model, contacts[first], contacts[after]):
            slides = slides and slides_on(model, memory, contacts[after])
            after += 1
        if slides and after > first + 3:
            hold_on_a_plane(model, memory, first, after)
        first = after


@kernel
def slides_on(model: Any, memory: Any, contact: Any) -> bool:
    """Whether a contact slides, or bears nothing just now, within the depth that is kept."""
    touches = contact.state == OPEN and contact.gap <= depth_kept(model, memory, contact)
    return bool(contact.state == SLIDES or touches)


@kernel
def same_face(model: Any, one: Any, other: Any) -> bool:
    """Whether two contacts are of the same bodies, with the same normal."""
    bodies = integers(model.geom_bodyid, model.ngeom)
    same = bodies[one.geoms[0]] == bodies[other.geoms[0]]
    same = same and bodies[one.geoms[1]] == bodies[other.geoms[1]]
    return bool(same and dot(one.frame[0], other.frame[0]) > 1 - ALIGNED)


@kernel
def hold_on_a_plane(model: Any, memory: Any, first: int, after: int) -> None:
    """Hold the loads p (1, x, y) that are nearest to those of contacts, by their normal equations;
    gaps within the depth that is kept count as closed."""
    contacts, rows = contacts_of(memory), rows_of(memory)
    ones, along, across, loads = NONE, NONE, NONE, NONE
    for i in range(first, after):
        place, load = in_plane(contacts[first], contacts[i]), rows[contacts[i].address].remembered
        ones, loads = plus(ones, 1.0, place), plus(loads, load, place)
        along, across = plus(along, place[1], place), plus(across, place[2], place)
    volume = dot(ones, cross(along, across))
    spread = along[1] + across[2] - (ones[1] ** 2 + ones[2] ** 2) / ones[0]
    if volume <= NARROW * ones[0] * spread**2:  # they lie on a line
        return
    inverse = cross(along, across), cross(across, ones), cross(ones, along)
    plane = times_vector(1 / volume, applied(inverse, loads))
    for i in range(first, after):
        rows[contacts[i].address].held = dot(plane, in_plane(contacts[first], contacts[i]))
        leave_gap(model, memory, contacts[i])


@kernel
def leave_gap(model: Any, memory: Any, contact: Any) -> None:
    """Let a contact keep its gap, as far as it is within the depth that is kept."""
    gap = min(max(contact.gap, 0.0), depth_kept(model, memory, contact))
    closes = memory.law.push if contact.load > 0 else 1.0  # share of it in a step
    rows_of(memory)[contact.address].reference += closes * gap / model.opt.timestep**2


@kernel
def in_plane(one: Any, other: Any) -> Any:
    """One, and where a contact is in the tangents of another one, m."""
    way = plus(other.pos, -1.0, one.pos)
    return 1.0, dot(one.frame[1], way), dot(one.frame[2], way)


@kernel
def write_regularisation(data: Any, memory: Any) -> None:
    """Tell the R of contacts and dry friction to all places where MuJoCo keeps it: D, islands."""
    R, D = reals(data.efc_R, data.nefc), reals(data.efc_D, data.nefc)
    island_R, island_D = reals(data.iefc_R, data.nefc), reals(data.iefc_D, data.nefc)
    place, rows = integers(data.map_efc2iefc, data.nefc), rows_of(memory)
    for r in range(len(rows)):
        if rows[r].kind == DRY or rows[r].kind == CONTACT_ROW:
            R[r], D[r] = rows[r].R, 1 / rows[r].R
            if data.nisland > 0:
                island_R[place[r]], island_D[place[r]] = R[r], D[r]


@kernel
def take_depth_away(model: Any, data: Any, memory: Any) -> None:
    """Baumgarte stabilisation: move the distance that a soft contact holds, until under its load it
    has no depth."""
    rows, spring = rows_of(memory), reals(data.efc_KBIP, (data.nefc, 4))
    for contact in contacts_of(memory):
        lift = contact.lift - model.opt.timestep / memory.law.servo * contact.gap
        contact.lift = min(max(lift, 0.0), contact.margin)
        stiffness = spring[contact.address, 0] * spring[contact.address, 2]
        closed = contact.lift > 0 or contact.gap <= 0
        push = stiffness * (contact.margin - contact.lift) if closed else APART
        rows[contact.address].reference -= push


@kernel
def oppose_slip_at_mid_step(model: Any, memory: Any) -> bool:
    """Let friction of what slides fast oppose its slip at mid step; whether there is any.

    That is of second order, by the Jacobian of where bodies are: velocities lie half a step to
    either side. Where slip may end within the step, it must oppose that at the end, and in an
    impact, where a load changes by more than a weight, that after it (Moreau).
    """
    h, some = model.opt.timestep, False
    for contact in contacts_of(memory):
        rows = rows_of_contact(memory, contact)
        gained = rows[0].remembered - contact.load
        impact = abs(gained) * rows[0].estimate > memory.gravity
        if contact.state != SLIDES or contact.predicted == 0 or impact:
            continue
        speed, change = 0.0, 0.0
        for t in range(contact.dim - 1):
            row = rows[1 + t]
            speed += (contact.mu[t] * row.velocity) ** 2
            change += (contact.mu[t] * (row.residual + row.reference)) ** 2
        if speed <= (memory.law.fast * h) ** 2 * change:
            continue
        for t in range(contact.dim - 1):
            row = rows[1 + t]
            more = row.velocity / h - (contact.turned[1 + t] if t < 2 else 0.0)
            row.reference -= more
            row.residual += more
        contact.extrapolated = shift(rows, contact)
        contact.predicted = max(contact.extrapolated + contact.bias, 0.0)
        some = True
    return some


# -- dampers ---------------------------------------------------------------------------------------


@kernel
def add_dampers(model: Any, data: Any, memory: Any) -> None:
    """Let all that brakes act at the velocity after the step: M - h dF/dv, as `implicitfast` does.

    MuJoCo knows which dampers, servos and muscles act, from the forces of actuators.
    """
    if model.nu > 0:
        mj_fwdActuation(memory.model, memory.data)
    mjd_smooth_vel(memory.model, memory.data, 0)
    derivative, place = reals(data.qDeriv, model.nD), integers(model.mapD2M, model.nC)
    inertia, free = reals(data.M, model.nC), reals(memory.inertia_at, model.nC)
    for k in range(model.nC):
        free[k] = inertia[k]
        inertia[k] -= model.opt.timestep * derivative[place[k]]
        if inertia[k] != free[k]:
            memory.braked, memory.braked_is = k, inertia[k]
    if memory.braked >= 0:
        mj_factorM(memory.model, memory.data)


@kernel
def take_dampers_away(model: Any, data: Any, memory: Any) -> None:
    """Make M that of the bodies again, unless MuJoCo has done so: for whoever reads it between
    steps, and for a call in which MuJoCo skips that stage."""
    inertia, free = reals(data.M, model.nC), reals(memory.inertia_at, model.nC)
    ours = memory.braked >= 0 and inertia[memory.braked] == memory.braked_is
    for k in range(model.nC if ours else 0):
        inertia[k] = free[k]
    memory.braked = -1
