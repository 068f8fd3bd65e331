"""Patches of contact: points of flat faces that a collider drops by turns, or doesn't take, are put
back; those that it adds are left out."""

from __future__ import annotations

import math
from typing import Any

from .compiling import kernel
from .contacts import (
    SIZE,
    WORDS,
    copy,
    cosine,
    kinds,
    leave_out,
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
    mj_addContact,
    mj_fwdVelocity,
    mj_island,
    mj_makeConstraint,
    mj_projectConstraint,
    mjc_Convex,
    reals,
)
from .memory import NEW, contacts_at, contacts_of
from .parameters import ACROSS, AT_MOST, FARTHEST, FASTER, UNMOVED
from .rigid import depth_kept
from .vectors import cross, dot, plus, times_vector, vector_at


@kernel
def put_points_back(model: Any, data: Any, memory: Any) -> bool:
    """Put back points of flat contacts that the collider has dropped while they overlap.

    Returns whether there were any: the constraint rows are then made anew.
    """
    before, added = contacts_at(memory.before_at, memory.contacts_before), 0
    radius = reals(model.geom_rbound, model.ngeom)
    for i in range(len(before)):
        old = before[i]
        one, other = radius[old.geoms[0]], radius[old.geoms[1]]
        least, far = memory.law.near * max(one, other), FARTHEST * smaller_radius(model, old.geoms)
        near = min(least, far)  # floors may be much larger
        turned = one * spin(model, data, old, 0) + other * spin(model, data, old, 1)
        rolled = min(FASTER * turned * model.opt.timestep, far)
        if not 2 * max(near, rolled) ** 2 < old.moved < math.inf:
            continue
        place_lost_point(model, data, old)
        overlaps = old.gap < 0 and old.moved < (least / 10) ** 2
        if overlaps and is_lost(data, old, near):
            add_point(data, memory, old)
            added += 1
    if added:
        make_rows_anew(memory)
    return added > 0


@kernel
def add_points_below(model: Any, data: Any, memory: Any) -> bool:
    """Add points of faces that the collider hasn't taken: those without margin.

    It takes four of them, however far they are within the margin: a body that tips about two would
    have none where it comes down. Returns whether there were any.
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
    if added:
        make_rows_anew(memory)
    return added > 0


@kernel
def has_flat_faces(model: Any, geoms: Any) -> bool:
    """Whether the points of two geoms are those of two faces of which one may be no rectangle."""
    least, most = kinds(model, geoms)
    return bool(least >= CYLINDER and most <= MESH and not least == most == BOX)


@kernel
def add_points_without_margin(model: Any, data: Any, memory: Any, like: Any) -> int:
    """Add the points that the geoms of a contact have without margin; return how many. The contact
    stands for each of them meanwhile."""
    stride, added = POINT // 8, 0
    points = reals(memory.patch_at, MOST_POINTS * stride)
    radius = reals(model.geom_rbound, model.ngeom)
    near = memory.law.near * max(radius[like.geoms[0]], radius[like.geoms[1]])
    count = mjc_Convex(
        memory.model, memory.data, memory.patch_at, like.geoms[0], like.geoms[1], 0.0
    )
    for k in range(count):
        point = points[k * stride : k * stride + 7]
        like.gap = point[0]
        for j in range(3):
            like.pos[j], like.frame[0, j] = point[1 + j], point[4 + j]
        if like.gap < 0 and not has_near(data, like, near):
            add_point(data, memory, like)
            added += 1
    read_place(like, engine_contacts(data.contact, data.ncon)[like.index])
    return added


@kernel
def leave_added_points_out(model: Any, data: Any, memory: Any) -> bool:
    """Leave out points that the collider adds to a patch whose points are all where they were.

    They are deeper than the bodies can have come in a step: their springs would throw these apart.
    Returns whether there were any.
    """
    contacts, found = contacts_of(memory), engine_contacts(data.contact, data.ncon)
    before, left_out = contacts_at(memory.before_at, memory.contacts_before), False
    velocity = reals(data.efc_vel, data.nefc)
    for i in range(memory.contacts):
        new = contacts[i]
        closing = max(-velocity[new.address], 0.0) * model.opt.timestep
        if new.state != NEW or -new.gap <= UNMOVED + AT_MOST * closing:
            continue
        had, kept = 0, True
        for k in range(len(before)):
            if same_geoms(before[k].geoms, new.geoms):
                had, kept = had + 1, kept and before[k].moved < UNMOVED**2
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
    xpos = reals(data.geom_xpos, (model.ngeom, 3))
    xmat = reals(data.geom_xmat, (model.ngeom, 3, 3))
    normal, along, opened = old.frame[0], old.frame[1], 0.0
    for j in range(3):
        normal[j], old.pos[j], along[j] = 0.0, 0.0, 0.0
        for axis in range(3):
            normal[j] += xmat[old.geoms[0], j, axis] * old.normal[axis]
        for side in range(2):
            place = xpos[old.geoms[side], j]
            for axis in range(3):
                place += xmat[old.geoms[side], j, axis] * old.place[side, axis]
            old.pos[j] += place / 2
            along[j] += place if side else -place
        opened += normal[j] * along[j]
    old.gap += opened
    old.moved = 0.0  # along the surface, square, m2
    for j in range(3):
        old.moved += (along[j] - opened * normal[j]) ** 2


@kernel
def is_lost(data: Any, old: Any, near: float) -> bool:
    """Whether the collider has closed points of these two faces, but none near this one: of the
    corners of a polygon, and of a heightfield, it takes some by turns."""
    found, closed = engine_contacts(data.contact, data.ncon), False
    for i in range(data.ncon):
        if is_of_face(found[i].geom, found[i].frame, old):
            closed, old.index = closed or found[i].dist <= 0, i
    return bool(closed and not has_near(data, old, near))


@kernel
def is_of_face(geoms: Any, normal: Any, old: Any) -> bool:
    """Whether a point is one of the two faces of a contact: those whose normals lie across are of
    inner walls of a heightfield, which come and go."""
    return bool(same_geoms(geoms, old.geoms) and cosine(normal, old.frame[0]) >= ACROSS)


@kernel
def has_near(data: Any, contact: Any, near: float) -> bool:
    """Whether mjData has a point of these two faces near this one."""
    found = engine_contacts(data.contact, data.ncon)
    for i in range(data.ncon):
        square = 0.0
        for j in range(3):
            square += (found[i].pos[j] - contact.pos[j]) ** 2
        if square <= near**2 and is_of_face(found[i].geom, found[i].frame, contact):
            return True
    return False


@kernel
def add_point(data: Any, memory: Any, old: Any) -> None:
    """Add a lost point to mjData, else as the last of its pair of geoms there is."""
    copy(data.contact + SIZE * old.index, memory.point_at, WORDS)
    point = engine_contacts(memory.point_at, 1)[0]
    set_axes(point.frame, vector_at(old.frame[0], 0), vector_at(point.frame, 3))
    point.dist = old.gap
    for j in range(3):
        point.pos[j] = old.pos[j]
    mj_addContact(memory.model, memory.data, memory.point_at)


@kernel
def set_axes(frame: Any, normal: Any, along: Any) -> None:
    """Give a contact of mjData a normal, and tangents of which the first is near to `along`."""
    along = plus(along, -dot(along, normal), normal)
    along = times_vector(1 / math.sqrt(dot(along, along)), along)
    across = cross(normal, along)
    for j in range(3):
        frame[j], frame[3 + j], frame[6 + j] = normal[j], along[j], across[j]
