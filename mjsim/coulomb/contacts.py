"""The contacts of a step: found, and matched with those of the step before.

Each contact of the step before hands on its state, load and friction to the one that is now nearest
to it on both bodies; friction turns with these, and what several hand on adds up.
"""

from __future__ import annotations

import math
from typing import Any

from .compiling import kernel
from .engine import engine_contacts, integers, mj_isSparse, reals, words
from .memory import (
    CONTACT,
    CONTACT_ROW,
    DRY,
    EQUALITY,
    FORCE,
    IDLE,
    MOMENT,
    NEW,
    ONE_SIDED,
    STICKS,
    contacts_at,
    contacts_of,
    dry_of,
    dry_rows_of,
    make_room,
    pairs_at,
    rows_of,
    rows_of_contact,
)
from .parameters import ACROSS, ALIKE, APART, FARTHEST, FLUSH, STILL, UNMOVED
from .vectors import applied, assign, dot, plus, square_between, vector_at

WORDS = CONTACT.itemsize // 8


@kernel
def radii(model: Any, geoms: Any) -> Any:
    """The radii of two geoms, m; planes have none."""
    radius = reals(model.geom_rbound, model.ngeom)
    return radius[geoms[0]], radius[geoms[1]]


@kernel
def smaller_radius(model: Any, geoms: Any) -> float:
    """The smaller radius of two geoms, m, of which one may be a plane."""
    both = radii(model, geoms)
    return float(min(both) or max(both))


@kernel
def place_of(model: Any, data: Any, geom: int) -> Any:
    """Where a geom is, m."""
    return vector_at(reals(data.geom_xpos, 3 * model.ngeom), 3 * geom)


@kernel
def axes_of(model: Any, data: Any, geom: int) -> Any:
    """The axes of a geom."""
    turn = reals(data.geom_xmat, (model.ngeom, 9))[geom]
    return (turn[0], turn[3], turn[6]), (turn[1], turn[4], turn[7]), (turn[2], turn[5], turn[8])


@kernel
def in_world(model: Any, data: Any, geom: int, vector: Any) -> Any:
    """A vector that is in the axes of a geom, in those of the world."""
    return applied(reals(data.geom_xmat, (model.ngeom, 3, 3))[geom], vector)


@kernel
def same_geoms(one: Any, other: Any) -> bool:
    """Whether two contacts are of the same geoms."""
    return bool(one[0] == other[0] and one[1] == other[1])


@kernel
def leave_out(data: Any, given: Any) -> None:
    """Let a contact of mjData bear nothing: it allows any approach."""
    given.exclude = 1
    reals(data.efc_aref, data.nefc)[given.efc_address] = -APART


# -- nothing has moved -----------------------------------------------------------------------------


@kernel
def store_poses(model: Any, data: Any, memory: Any) -> None:
    """Store where bodies and contacts are, on which axes and Jacobians depend."""
    places, axes = 3 * model.nbody, 9 * model.nbody
    assign(reals(memory.xpos_at, places), reals(data.xpos, places))
    assign(reals(memory.xmat_at, axes), reals(data.xmat, axes))
    assign(engine_contacts(memory.pose_at, data.ncon), engine_contacts(data.contact, data.ncon))


@kernel
def stayed(one: Any, other: Any, most: float) -> bool:
    """Whether numbers are what they were, but for so much at most."""
    still = True
    for i in range(len(one)):
        still &= abs(one[i] - other[i]) <= most
    return still


@kernel
def nothing_moved(model: Any, data: Any, memory: Any) -> bool:
    """Whether bodies and contacts are where they were when their poses were stored."""
    if memory.ncon != data.ncon or memory.rows != data.nefc or memory.dry != data.nf:
        return False
    places, axes = 3 * model.nbody, 9 * model.nbody
    still = stayed(reals(data.xpos, places), reals(memory.xpos_at, places), STILL)
    still = still and stayed(reals(data.xmat, axes), reals(memory.xmat_at, axes), STILL)
    found = engine_contacts(data.contact, data.ncon)
    poses = engine_contacts(memory.pose_at, data.ncon)
    for i in range(data.ncon):
        still = still and is_where_it_was(model, found[i], poses[i])
    return bool(still)


@kernel
def is_where_it_was(model: Any, contact: Any, pose: Any) -> bool:
    """Whether a contact of mjData is what it was when its pose was stored, but for its gap."""
    return bool(
        same_geoms(contact.geom, pose.geom)
        and contact.dim == pose.dim
        and contact.efc_address == pose.efc_address
        and stayed(contact.frame, pose.frame, STILL)
        and stayed(contact.friction, pose.friction, STILL)
        and stayed(contact.pos, pose.pos, FLUSH * smaller_radius(model, contact.geom))
    )


@kernel
def read_gaps(data: Any, memory: Any) -> None:
    """Read the gaps of contacts that haven't moved otherwise; those left out still are."""
    found = engine_contacts(data.contact, data.ncon)
    for contact in contacts_of(memory):
        given = found[contact.index]
        contact.gap, contact.margin = given.dist, given.includemargin
    poses = engine_contacts(memory.pose_at, data.ncon)
    for i in range(data.ncon):
        if poses[i].exclude and found[i].efc_address >= 0:
            leave_out(data, found[i])


# -- found -----------------------------------------------------------------------------------------


@kernel
def find(model: Any, data: Any, memory: Any) -> float:
    """Find the contacts of a step, and let them inherit from those before; how far one has moved on
    its bodies at most, m."""
    nonzeros = jacobian_length(model, data, memory)
    if (
        data.ncon > memory.room_contacts
        or data.nefc > memory.room_rows
        or nonzeros > memory.room_jacobian
    ):
        make_room(memory.address, data.ncon, data.nefc, nonzeros)
    store_poses(model, data, memory)
    memory.rows, memory.ncon = data.nefc, data.ncon
    memory.first_dry, memory.dry = data.ne, data.nf
    read_contacts(model, data, memory)
    sort_pairs(model, memory)
    return float(match(model, data, memory))


@kernel
def read_contacts(model: Any, data: Any, memory: Any) -> None:
    """Read the contacts of mjData, of which nothing else is known.

    Those of flexes, and soft ones without friction or damping, are MuJoCo's own.
    """
    found = engine_contacts(data.contact, data.ncon)
    contacts = contacts_at(memory.contact_at, data.ncon)
    damping = reals(data.efc_KBIP, (data.nefc, 4))
    clear(words(memory.contact_at, data.ncon * WORDS))
    memory.contacts = 0
    for i in range(data.ncon):
        given, address = found[i], found[i].efc_address
        if address < 0 or given.exclude or given.geom[0] < 0 or given.geom[1] < 0:
            continue
        if not memory.law.rigid and (given.dim == 1 or damping[address + 1, 1] <= 0):
            continue
        contact = contacts[memory.contacts]
        contact.index, contact.address, contact.dim = i, address, given.dim
        contact.margin, contact.cone = given.includemargin, given.mu
        contact.velocity[0] = math.inf
        assign(contact.mu, given.friction)
        read_place(contact, given)
        place_on_bodies(model, data, contact, given)
        memory.contacts += 1


@kernel
def clear(contacts: Any) -> None:
    """Make them new contacts, of which nothing is known: all words are zero, `NEW` as well."""
    for n in range(len(contacts)):
        contacts[n] = NEW


@kernel
def read_place(contact: Any, given: Any) -> None:
    """Read gap, place and axes of a contact."""
    contact.gap = given.dist
    assign(contact.pos, given.pos)
    for of in range(3):
        assign(contact.frame[of], vector_at(given.frame, 3 * of))


@kernel
def place_on_bodies(model: Any, data: Any, contact: Any, given: Any) -> None:
    """Find where a contact is on both bodies, and its axes in those of their geoms."""
    assign(contact.geoms, given.geom)
    for side in range(2):
        geom = given.geom[side]
        axes, way = axes_of(model, data, geom), plus(given.pos, -1.0, place_of(model, data, geom))
        assign(contact.place[side], applied(axes, way))
        for axis in range(3):
            assign(contact.axes[side, axis], applied(contact.frame, axes[axis]))
    for axis in range(3):
        contact.normal[axis] = contact.axes[0, axis, 0]


@kernel
def jacobian_length(model: Any, data: Any, memory: Any) -> int:
    """How many numbers the Jacobian of all rows has in mjData."""
    if not mj_isSparse(memory.model):
        return int(data.nefc * model.nv)
    if data.nefc == 0:
        return 0
    last, lengths = data.nefc - 1, integers(data.efc_J_rownnz, data.nefc)
    return int(integers(data.efc_J_rowadr, data.nefc)[last] + lengths[last])


@kernel
def copy_jacobians(model: Any, data: Any, memory: Any) -> None:
    """Copy the Jacobians of all rows, without zeros: MuJoCo's own are gone when the next step asks
    for forces. Those of a contact keep the same columns."""
    find_kinds(data, memory)
    rows, sparse = rows_of(memory), mj_isSparse(memory.model)
    lengths, begins = integers(data.efc_J_rownnz, data.nefc), integers(data.efc_J_rowadr, data.nefc)
    size, total, u = jacobian_length(model, data, memory), 0, 0
    given, columns = reals(data.efc_J, size), integers(data.efc_J_colind, size)
    jacobian, column = reals(memory.jacobian_at, size), integers(memory.column_at, size)
    while u < len(rows):
        dim, length = rows[u].dim, lengths[u] if sparse else model.nv
        begin, first = begins[u] if sparse else u * length, total
        for n in range(begin, begin + length):
            if moves(given, n, dim, length):
                column[total] = n
                total += 1
        count = total - first
        for r in range(dim - 1, -1, -1):  # the first row, whose columns say where, is the last
            rows[u + r].first, rows[u + r].length = first + r * count, count
            for k in range(count):
                n, at = column[first + k], first + r * count + k
                jacobian[at] = given[n + r * length]
                column[at] = columns[n] if sparse else n - begin
        u, total = u + dim, first + dim * count


@kernel
def moves(given: Any, n: int, dim: int, length: int) -> bool:
    """Whether one of `dim` rows, each of this length, moves the column of number n."""
    size = 0.0
    for r in range(dim):
        size += abs(given[n + r * length])
    return size > 0


@kernel
def find_kinds(data: Any, memory: Any) -> None:
    """Find what each row is, and how many belong to a contact."""
    rows, limit = rows_of(memory), reals(data.efc_frictionloss, data.nefc)
    found = engine_contacts(data.contact, data.ncon)
    for r in range(len(rows)):
        row = rows[r]
        row.kind, row.dim, row.remembered, row.limit = EQUALITY, 1, 0.0, limit[r]
        if r >= data.ne:
            row.kind = DRY if r < data.ne + data.nf else ONE_SIDED
    for i in range(data.ncon):
        first = found[i].efc_address
        if first >= 0:  # a contact beyond its margin has no rows
            rows[first].dim = found[i].dim
            for r in range(first + 1, first + found[i].dim):
                rows[r].kind = IDLE
    for contact in contacts_of(memory):
        for row in rows_of_contact(memory, contact):
            row.kind = CONTACT_ROW


# -- matched ---------------------------------------------------------------------------------------


@kernel
def square_apart(one: Any, other: Any) -> float:
    """Square of how far apart two contacts are on their bodies, m2; infinite for other geoms."""
    if not same_geoms(one.geoms, other.geoms):
        return math.inf
    first = square_between(one.place[0], other.place[0])
    return float(first + square_between(one.place[1], other.place[1]))


@kernel
def sort_pairs(model: Any, memory: Any) -> None:
    """Sort the contacts by their pairs of geoms; those of one pair keep their order.

    They nearly are: MuJoCo goes through pairs of bodies in their order.
    """
    contacts, pairs = contacts_of(memory), pairs_at(memory.pair_at, memory.contacts)
    for i in range(memory.contacts):
        key, place = pair_of(model, contacts[i]), i
        while place > 0 and pairs[place - 1].geoms > key:
            pairs[place] = pairs[place - 1]
            place -= 1
        pairs[place].geoms, pairs[place].contact = key, i


@kernel
def pair_of(model: Any, contact: Any) -> int:
    """The pair of geoms of a contact, as one number: by the first body, then the second geom."""
    first, second = min(contact.geoms), max(contact.geoms)
    body = integers(model.geom_bodyid, model.ngeom)[first]
    return int((body * model.ngeom + second) * model.ngeom + first)


@kernel
def first_of_pair(memory: Any, pair: int) -> int:
    """Where the contacts of a pair of geoms begin among those that are sorted."""
    pairs, low, high = pairs_at(memory.pair_at, memory.contacts), 0, memory.contacts
    while low < high:
        middle = (low + high) // 2
        if pairs[middle].geoms < pair:
            low = middle + 1
        else:
            high = middle
    return int(low)


@kernel
def nearest(model: Any, memory: Any, old: Any) -> Any:
    """The contact of this step nearest to one before of these geoms, and the square of how far that
    has moved, m2; -1 and infinity if there is none. One whose normal lies across isn't the same:
    inner walls of heightfields would inherit what cells bear."""
    contacts, pairs = contacts_of(memory), pairs_at(memory.pair_at, memory.contacts)
    pair, best, least = pair_of(model, old), -1, math.inf
    for i in range(first_of_pair(memory, pair), first_of_pair(memory, pair + 1)):
        contact = contacts[pairs[i].contact]
        square = square_apart(contact, old)
        if square < least and dot(contact.normal, old.normal) >= ACROSS:
            best, least = pairs[i].contact, square
    return best, least


@kernel
def match(model: Any, data: Any, memory: Any) -> float:
    """Let contacts inherit from those before; how far one has moved on its bodies at most, m."""
    contacts, before = contacts_of(memory), contacts_at(memory.before_at, memory.contacts_before)
    farthest = 0.0
    for i in range(len(before)):
        old = before[i]
        if i < len(contacts) and square_apart(contacts[i], old) < UNMOVED**2:
            k, old.moved = i, 0.0
        else:
            k, old.moved = nearest(model, memory, old)
        if k >= 0:
            farthest = max(farthest, old.moved)
            inherit(model, data, memory, contacts[k], old)
    return math.sqrt(farthest / 2)


@kernel
def inherit(model: Any, data: Any, memory: Any, contact: Any, old: Any) -> None:
    """Take over what a contact before remembers; of several their loads and friction add up.

    Friction turns with its bodies, most with the one that turns less: where one rolls on another
    that is at rest, friction stays as it is.
    """
    alone, spins = contact.state == NEW, (spin(model, data, old, 0), spin(model, data, old, 1))
    both = spins[0] + spins[1]
    contact.bias, contact.shortfall = (old.bias, old.shortfall) if alone else (0.0, 0.0)
    known = alone and (
        is_fixed(model, memory, old, max(spins)) or rolls(model, memory, contact, old)
    )
    for axis in range(3):  # one that wanders over its bodies, or is made of several, has none
        contact.velocity[axis] = old.velocity[axis] if known else math.inf
        contact.turned[axis] = old.turned[axis] if alone else 0.0
    contact.state = max(contact.state, old.state)
    contact.weakened = max(contact.weakened, old.weakened)
    contact.error, contact.lift = max(contact.error, old.error), max(contact.lift, old.lift)
    contact.load += old.load
    for side in range(2):
        share = spins[1 - side] / both if both > 0 else 0.5
        for axis in range(3):
            for of in range(3):
                part = share * contact.axes[side, axis, of]
                for kind in range(2):
                    contact.carried[of, kind] += part * old.friction[side, axis, kind]


@kernel
def spin(model: Any, data: Any, contact: Any, side: int) -> float:
    """How fast one of the bodies in contact turns, rad/s."""
    body = integers(model.geom_bodyid, model.ngeom)[contact.geoms[side]]
    velocity = vector_at(reals(data.cvel, 6 * model.nbody), 6 * body)
    return math.sqrt(dot(velocity, velocity))


@kernel
def is_fixed(model: Any, memory: Any, old: Any, turning: float) -> bool:
    """Whether a contact has moved on its bodies by no more than it creeps, or a belt carries it,
    and they don't roll."""
    creep = math.sqrt(dot(old.velocity, old.velocity)) if old.state == STICKS else 0.0
    rolled = memory.law.fixed * turning * smaller_radius(model, old.geoms)
    way = model.opt.timestep * (rolled + old.belt + creep)
    return bool(old.moved <= 2 * way**2)


@kernel
def rolls(model: Any, memory: Any, contact: Any, old: Any) -> bool:
    """Whether a contact has rolled: as far over one of its bodies as over the other."""
    if old.state != STICKS:
        return False
    one = math.sqrt(square_between(contact.place[0], old.place[0]))
    other = math.sqrt(square_between(contact.place[1], old.place[1]))
    alike = abs(one - other) <= ALIKE * max(one, other)
    return bool(alike and max(one, other) <= FARTHEST * smaller_radius(model, old.geoms))


@kernel
def remember_forces(memory: Any) -> None:
    """Give the rows of contacts and of dry friction the forces that are remembered."""
    for contact in contacts_of(memory):
        rows = rows_of_contact(memory, contact)
        rows[0].remembered = contact.load
        for t in range(contact.dim - 1):
            rows[1 + t].remembered = contact.carried[axis_of(t), kind_of(t)]
    known, dry = memory.dry_before == memory.dry, dry_of(memory, memory.dry)
    rows = dry_rows_of(memory)
    for i in range(len(rows)):
        rows[i].remembered = dry[i] if known else 0.0


@kernel
def axis_of(t: int) -> int:
    """Axis of a kind of friction: sliding along 1 and 2, spin about 0, rolling about 1 and 2."""
    return t + 1 if t < 2 else t - 2


@kernel
def kind_of(t: int) -> int:
    """Whether a kind of friction is a force or a moment."""
    return FORCE if t < 2 else MOMENT
