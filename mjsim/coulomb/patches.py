"""Patches of contact: points of flat faces that a collider drops by turns, or doesn't take, are put
back; those that it adds are left out."""

from __future__ import annotations

import math
from typing import Any

from .compiling import kernel
from .contacts import (
    first_of_pair,
    in_world,
    leave_out,
    pair_of,
    place_of,
    radii,
    read_place,
    same_geoms,
    smaller_radius,
    spin,
)
from .engine import (
    BOX,
    CYLINDER,
    MESH,
    MOST_POINTS,
    POINT,
    engine_contacts,
    integers,
    mj_addContact,
    mj_fwdVelocity,
    mj_island,
    mj_makeConstraint,
    mj_projectConstraint,
    mjc_Convex,
    reals,
)
from .memory import NEW, contacts_at, contacts_of, pairs_at
from .parameters import ACROSS, AT_MOST, FARTHEST, FASTER, UNMOVED
from .rigid import depth_kept
from .vectors import assign, cross, dot, plus, square_between, times_vector, vector_at


@kernel
def put_points_back(model: Any, data: Any, memory: Any) -> int:
    """Put back points of flat contacts that the collider has dropped while they overlap; return how
    many. The constraint rows are then to be made anew."""
    before, added = contacts_at(memory.before_at, memory.contacts_before), 0
    for old in before:
        one, other = radii(model, old.geoms)
        least, far = memory.law.near * max(one, other), FARTHEST * smaller_radius(model, old.geoms)
        near = min(least, far)  # floors may be much larger
        turned = one * spin(model, data, old, 0) + other * spin(model, data, old, 1)
        rolled = min(FASTER * turned * model.opt.timestep, far)
        if not 2 * max(near, rolled) ** 2 < old.moved < math.inf:
            continue
        place_lost_point(model, data, old)
        overlaps = old.gap < 0 and old.moved < (least / 10) ** 2
        if overlaps:
            found_near, closed, last = look_at_faces(model, data, memory, old, near)
            if closed and not found_near:
                add_point(data, memory, old, last)
                added += 1
    return added


@kernel
def add_points_below(model: Any, data: Any, memory: Any) -> int:
    """Add points of faces that the collider hasn't taken, those without margin; return how many.

    It takes four of them, however far they are within the margin: a body that tips about two would
    have none where it comes down. The constraint rows are then to be made anew.
    """
    contacts, first, added = contacts_of(memory), 0, 0
    while first < memory.contacts:
        after, rises = first, False
        while after < memory.contacts and same_geoms(contacts[after].geoms, contacts[first].geoms):
            contact, after = contacts[after], after + 1
            rises = rises or contact.gap > depth_kept(model, memory, contact)
        if rises and after - first >= 4 and has_flat_faces(model, contacts[first].geoms):
            added += add_points_without_margin(model, data, memory, contacts[first])
        first = after
    return added


@kernel
def has_flat_faces(model: Any, geoms: Any) -> bool:
    """Whether the points of two geoms are those of two faces of which one may be no rectangle."""
    types = integers(model.geom_type, model.ngeom)
    one, other = types[geoms[0]], types[geoms[1]]
    flat = CYLINDER <= one <= MESH and CYLINDER <= other <= MESH
    return bool(flat and not one == other == BOX)


@kernel
def add_points_without_margin(model: Any, data: Any, memory: Any, like: Any) -> int:
    """Add the points that the geoms of a contact have without margin; return how many. The contact
    stands for each of them meanwhile."""
    near, added = memory.law.near * max(radii(model, like.geoms)), 0
    points = reals(memory.patch_at, (MOST_POINTS, POINT // 8))
    count = mjc_Convex(
        memory.model, memory.data, memory.patch_at, like.geoms[0], like.geoms[1], 0.0
    )
    for k in range(count):
        like.gap = points[k, 0]
        assign(like.pos, vector_at(points[k], 1))
        assign(like.frame[0], vector_at(points[k], 4))
        if like.gap < 0 and not look_at_faces(model, data, memory, like, near)[0]:
            add_point(data, memory, like, like.index)
            added += 1
    read_place(like, engine_contacts(data.contact, data.ncon)[like.index])
    return added


@kernel
def leave_added_points_out(model: Any, data: Any, memory: Any) -> bool:
    """Leave out points that the collider adds to a patch whose points are all where they were.

    They are deeper than the bodies can have come in a step: their springs would throw these apart.
    Returns whether there were any.
    """
    found = engine_contacts(data.contact, data.ncon)
    before, left_out = contacts_at(memory.before_at, memory.contacts_before), False
    velocity = reals(data.efc_vel, data.nefc)
    for new in contacts_of(memory):
        closing = max(-velocity[new.address], 0.0) * model.opt.timestep
        if new.state != NEW or -new.gap <= UNMOVED + AT_MOST * closing:
            continue
        had, kept = 0, True
        for old in before:
            if same_geoms(old.geoms, new.geoms):
                had, kept = had + 1, kept and old.moved < UNMOVED**2
        if kept and had > 2:
            leave_out(data, found[new.index])
            left_out = True
    return left_out


@kernel
def make_rows_anew(memory: Any) -> None:
    """Let MuJoCo make the constraint rows of the contacts that there are now."""
    mj_makeConstraint(memory.model, memory.data)
    mj_island(memory.model, memory.data)
    mj_projectConstraint(memory.model, memory.data)
    mj_fwdVelocity(memory.model, memory.data)


@kernel
def place_lost_point(model: Any, data: Any, old: Any) -> None:
    """Where a contact before would be now: its normal, its place, and the gap that has opened."""
    normal = in_world(model, data, old.geoms[0], old.normal)
    one, other = place_on(model, data, old, 0), place_on(model, data, old, 1)
    way = plus(other, -1.0, one)
    opened = dot(normal, way)
    old.gap += opened
    along = plus(way, -opened, normal)
    old.moved = dot(along, along)
    assign(old.frame[0], normal)
    assign(old.pos, plus(one, 0.5, way))


@kernel
def place_on(model: Any, data: Any, contact: Any, side: int) -> Any:
    """Where the place of a contact on one of its bodies is now, m."""
    geom = contact.geoms[side]
    return plus(place_of(model, data, geom), 1.0, in_world(model, data, geom, contact.place[side]))


@kernel
def look_at_faces(model: Any, data: Any, memory: Any, contact: Any, near: float) -> Any:
    """Of the points of two faces that there are now: whether one is near a contact, whether one is
    closed, and the number of the last. Of the corners of a polygon, and of a heightfield, the
    collider takes some by turns."""
    found, contacts = engine_contacts(data.contact, data.ncon), contacts_of(memory)
    pair, pairs = pair_of(model, contact), pairs_at(memory.pair_at, memory.contacts)
    begin, end = first_of_pair(memory, pair), first_of_pair(memory, pair + 1)
    found_near, closed, last = False, False, -1
    for i in range(begin, end + data.ncon - memory.ncon):
        # after them those that the law has added in this step
        number = contacts[pairs[i].contact].index if i < end else memory.ncon + i - end
        point = found[number]
        if is_of_face(point, contact):
            found_near |= square_between(point.pos, contact.pos) <= near**2
            closed, last = closed or point.dist <= 0, number
    return found_near, closed, last


@kernel
def is_of_face(point: Any, contact: Any) -> bool:
    """Whether a point of mjData is one of the two faces of a contact: those whose normals lie
    across are of inner walls of a heightfield, which come and go."""
    across = dot(point.frame, contact.frame[0]) < ACROSS
    return bool(same_geoms(point.geom, contact.geoms) and not across)


@kernel
def add_point(data: Any, memory: Any, old: Any, like: int) -> None:
    """Add a lost point to mjData, else as one of its pair of geoms that there is."""
    points = engine_contacts(memory.point_at, 1)
    points[0] = engine_contacts(data.contact, data.ncon)[like]
    point = points[0]
    set_axes(point.frame, old.frame[0], vector_at(point.frame, 3))
    point.dist = old.gap
    assign(point.pos, old.pos)
    mj_addContact(memory.model, memory.data, memory.point_at)


@kernel
def set_axes(frame: Any, normal: Any, along: Any) -> None:
    """Give a contact of mjData a normal, and tangents of which the first is near to `along`."""
    along = plus(along, -dot(along, normal), normal)
    along = times_vector(1 / math.sqrt(dot(along, along)), along)
    across = cross(normal, along)
    for j in range(3):
        frame[j], frame[3 + j], frame[6 + j] = normal[j], along[j], across[j]
