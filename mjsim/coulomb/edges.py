"""Inner edges of floors in pieces, and of heightfields: at these what slides from one piece to the
next, or one cell, would stop. Contacts with them are left out, or turned to the cells around.

A convex geom lies above all of a contact that it has. What reaches no higher than this contact, the
geom can't run against: a contact with it that has another normal is one of an inner edge. A
heightfield has no normal that leans farther to one side than its cells around.
"""

from __future__ import annotations

import math
from typing import Any

from .compiling import kernel
from .contacts import axes_of, leave_out, place_of, same_geoms, smaller_radius
from .engine import HEIGHTFIELD, engine_contacts, integers, reals, singles
from .memory import contacts_of
from .parameters import ALIGNED, AT_MOST, EDGE, LEVEL
from .patches import make_rows_anew, set_axes
from .vectors import applied, dot, plus, times_vector


@kernel
def leave_inner_edges_out(model: Any, data: Any, memory: Any) -> bool:
    """Leave out contacts with inner edges of what is at rest; those with a heightfield are turned
    to its cells if they are needed: on one point alone what isn't round would fall over.

    Returns whether there were any.
    """
    found, left_out, turned = engine_contacts(data.contact, data.ncon), False, False
    find_pieces(model, data, memory)
    contacts, first = contacts_of(memory), integers(memory.first_at, model.ngeom)
    for edge in contacts:
        hill = on_hill(model, edge)
        if edge.piece < 0 or not (edge.steeper if hill else closes(model, data, memory, edge)):
            continue
        needed, others, k = 2 if hill else 1, 0, first[edge.geoms[1 - edge.piece]]
        while k >= 0 and others < needed:
            if not found[contacts[k].index].exclude:
                others += makes_inner(model, data, edge, contacts[k], hill)
            k = contacts[k].next
        if others == needed:
            leave_out(data, found[edge.index])
            left_out = True
        elif hill:
            turn_to_cells(model, data, edge, found[edge.index])
            turned = True
    if turned:
        make_rows_anew(memory)
    return left_out or turned


@kernel
def find_pieces(model: Any, data: Any, memory: Any) -> None:
    """Find the contacts of each moving geom with what is at rest, and which lean too far."""
    contacts, first = contacts_of(memory), integers(memory.first_at, model.ngeom)
    for contact in contacts:
        contact.piece = piece_of(model, contact)
        contact.steeper = on_hill(model, contact) and is_steeper(model, data, contact)
        if contact.piece >= 0:
            first[contact.geoms[1 - contact.piece]] = -1
    for k in range(len(contacts) - 1, -1, -1):
        contact = contacts[k]
        if contact.piece >= 0:
            other = contact.geoms[1 - contact.piece]
            contact.next, first[other] = first[other], k


@kernel
def makes_inner(model: Any, data: Any, edge: Any, floor: Any, hill: bool) -> bool:
    """Whether a contact with the floor tells that another one is with an inner edge."""
    if hill:
        return bool(same_geoms(edge.geoms, floor.geoms) and not floor.steeper)
    return bool((floor.load > 0 or floor.gap <= 0) and lies_below(model, data, edge, floor))


@kernel
def on_hill(model: Any, contact: Any) -> bool:
    """Whether what is at rest in a contact is a heightfield."""
    types = integers(model.geom_type, model.ngeom)
    return bool(contact.piece >= 0 and types[contact.geoms[contact.piece]] == HEIGHTFIELD)


@kernel
def closes(model: Any, data: Any, memory: Any, edge: Any) -> bool:
    """Whether a contact is about to close, or a soft one is closed. What bears a rigid body is no
    inner edge."""
    h, velocity = model.opt.timestep, reals(data.efc_vel, data.nefc)
    closing = max(-velocity[edge.address], 0.0) + h * memory.gravity
    holds = memory.law.rigid and edge.load > 0
    return bool(not holds and edge.gap < AT_MOST * h * closing)


@kernel
def piece_of(model: Any, contact: Any) -> int:
    """Which of two geoms in contact is at rest, if one is and the other isn't; else -1."""
    bodies = integers(model.geom_bodyid, model.ngeom)
    welded, piece = integers(model.body_weldid, model.nbody), -1
    for side in range(2):
        if welded[bodies[contact.geoms[side]]] == 0 and welded[bodies[contact.geoms[1 - side]]]:
            piece = side
    return piece


@kernel
def lies_below(model: Any, data: Any, edge: Any, floor: Any) -> bool:
    """Whether the piece to which an edge belongs lies below a contact of its moving geom with
    another piece, with another normal. What rolls over the rim of a piece needs both contacts."""
    parallel = abs(dot(edge.frame[0], floor.frame[0])) >= 1 - ALIGNED
    if parallel or same_geoms(edge.geoms, floor.geoms):
        return False
    up = times_vector(1.0 if floor.piece == 0 else -1.0, floor.frame[0])  # out of the floor
    height = height_above(model, data, edge.geoms[edge.piece], floor.pos, up)
    return bool(height <= EDGE * smaller_radius(model, edge.geoms) + max(-floor.gap, 0.0))


@kernel
def height_above(model: Any, data: Any, piece: int, point: Any, up: Any) -> float:
    """How far a piece, with its bounding box, reaches beyond a point along a unit vector, m."""
    box = reals(model.geom_aabb, (model.ngeom, 6))[piece]
    height = dot(up, plus(place_of(model, data, piece), -1.0, point))
    leans = applied(axes_of(model, data, piece), up)
    for axis in range(3):
        height += leans[axis] * box[axis] + abs(leans[axis]) * box[3 + axis]
    return float(height)


@kernel
def is_steeper(model: Any, data: Any, edge: Any) -> bool:
    """Whether a contact with a heightfield leans farther to one side than all cells around; not at
    its border."""
    normal, _ = of_cells(model, data, edge)
    return bool(abs(dot(normal, edge.frame[0])) < 1 - ALIGNED)


@kernel
def turn_to_cells(model: Any, data: Any, edge: Any, given: Any) -> None:
    """Turn a contact with an inner wall of a heightfield to the cells around it."""
    normal, given.dist = of_cells(model, data, edge)
    set_axes(given.frame, normal, axes_of(model, data, edge.geoms[edge.piece])[0])


@kernel
def of_cells(model: Any, data: Any, edge: Any) -> Any:
    """The normal that cells around a contact with a heightfield have nearest to its own, and how
    high the point of the other body is above them, m."""
    piece, own = edge.geoms[edge.piece], edge.frame[0]
    axes, place = axes_of(model, data, piece), place_of(model, data, piece)
    point = plus(plus(edge.pos, edge.gap / 2, own), -1.0, place)
    point, leans = applied(axes, point), applied(axes, own)
    level, field = max(leans[2], LEVEL), integers(model.geom_dataid, model.ngeom)[piece]
    slopes = -leans[0] / level, -leans[1] / level
    along, across, height = nearest_cells(model, field, point, slopes)
    length = math.sqrt(1 + along**2 + across**2)
    normal = plus(plus(axes[2], -along, axes[0]), -across, axes[1])
    return times_vector(1 / length, normal), (point[2] - height) / length


@kernel
def nearest_cells(model: Any, field: int, point: Any, slopes: Any) -> Any:
    """Of the slopes along and across that the four cells of a heightfield about its point next to
    another one have, those nearest to given ones, and the height there; these themselves at its
    border."""
    rows = integers(model.hfield_nrow, model.nhfield)[field]
    columns = integers(model.hfield_ncol, model.nhfield)[field]
    size = reals(model.hfield_size, (model.nhfield, 4))[field]
    first = integers(model.hfield_adr, model.nhfield)[field]
    heights = singles(model.hfield_data + 4 * first, (rows, columns))
    wide, long = 2 * size[0] / (columns - 1), 2 * size[1] / (rows - 1)
    column, row = round((point[0] + size[0]) / wide), round((point[1] + size[1]) / long)
    if not (0 < row < rows - 1 and 0 < column < columns - 1):
        return slopes[0], slopes[1], 0.0
    about = heights[row - 1 : row + 2, column - 1 : column + 2]
    along = nearest_slope(about, size[2] / wide, slopes[0])
    across = nearest_slope(about.T, size[2] / long, slopes[1])
    height = size[2] * heights[row, column] + along * (point[0] + size[0] - wide * column)
    return along, across, height + across * (point[1] + size[1] - long * row)


@kernel
def nearest_slope(heights: Any, scale: float, slope: float) -> float:
    """Of the slopes along rows of heights, which differences are times `scale`, that nearest to a
    given one; they have all between the least and the most."""
    least, most = math.inf, -math.inf
    for i in range(len(heights)):
        for k in range(len(heights) - 1):
            own = scale * (heights[i, k + 1] - heights[i, k])
            least, most = min(least, own), max(most, own)
    return float(min(max(slope, least), most))
