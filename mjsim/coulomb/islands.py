"""Units of constraint rows, the islands that they connect, and their numbers in Newton's method.

Rows that act together are a unit, known by the first of them: a contact, or a single row. An island
is known by its first degree of freedom, from which lists go through its others and its units.
"""

from __future__ import annotations

from typing import Any

from .compiling import kernel
from .engine import integers
from .memory import CONTACT_ROW, columns_of, contacts_of, dofs_of, places_of, rows_of
from .parameters import BLOCK


@kernel
def find_units(memory: Any) -> None:
    """Make contacts and other rows units."""
    rows, contacts = rows_of(memory), contacts_of(memory)
    for r in range(len(rows)):
        row = rows[r]
        row.dim, row.contact, row.force = row.kind < CONTACT_ROW, -1, 0.0
    for k in range(memory.contacts):
        unit = rows[contacts[k].address]
        unit.dim, unit.contact = contacts[k].dim, k


@kernel
def find_islands(model: Any, memory: Any) -> None:
    """Find the islands of degrees of freedom that units or joints connect, and those that contacts
    make due.

    Open contacts connect none, but belong to the island in which they are, if it is one.
    """
    rows, contacts, dofs = rows_of(memory), contacts_of(memory), dofs_of(memory)
    parent = integers(model.dof_parentid, model.nv)
    for i in range(model.nv):
        dofs[i].label = root(dofs, parent[i]) if parent[i] >= 0 else i
        dofs[i].tree = dofs[parent[i]].tree if parent[i] >= 0 else i
        dofs[i].next, dofs[i].unit, dofs[i].due = -1, -1, 0
    for row in rows:
        column = columns_of(memory, row)
        connects = row.dim > 0 and (row.contact < 0 or contacts[row.contact].closed)
        for n in range(len(column) if connects else 0):
            one, other = root(dofs, column[0]), root(dofs, column[n])
            dofs[max(one, other)].label = min(one, other)
    for i in range(model.nv - 1, -1, -1):
        first = root(dofs, i)
        dofs[i].label = first
        if first != i:
            dofs[i].next, dofs[first].next = dofs[first].next, i
    for u in range(len(rows) - 1, -1, -1):
        column = columns_of(memory, rows[u])
        if rows[u].dim > 0 and in_one_island(dofs, column):
            island = dofs[dofs[column[0]].label]
            rows[u].next, island.unit = island.unit, u
    for contact in contacts:
        column = columns_of(memory, rows[contact.address])
        if contact.due and len(column) > 0:  # the first and the last are of both bodies
            dofs[dofs[column[0]].label].due = dofs[dofs[column[-1]].label].due = 1


@kernel
def in_due_island(memory: Any, contact: Any) -> bool:
    """Whether one of the islands that a contact moves is to be solved."""
    dofs, column = dofs_of(memory), columns_of(memory, rows_of(memory)[contact.address])
    if len(column) == 0:
        return False
    return bool(dofs[dofs[column[0]].label].due or dofs[dofs[column[-1]].label].due)


@kernel
def in_one_island(dofs: Any, column: Any) -> bool:
    """Whether degrees of freedom, if there are any, belong to the same island."""
    same = len(column) > 0
    for c in column:
        same = same and dofs[c].label == dofs[column[0]].label
    return same


@kernel
def root(dofs: Any, i: int) -> int:
    """The first of an island, followed along labels."""
    while dofs[i].label != i:
        dofs[i].label = dofs[dofs[i].label].label
        i = dofs[i].label
    return i


@kernel
def number_island(model: Any, memory: Any, first: int) -> None:
    """Number an island's degrees of freedom, tree by tree, so that rows of its derivative are short
    (Cuthill and McKee 1969); where they begin, and how far they reach; list its units."""
    starts, columns = integers(model.M_rowadr, model.nv), integers(model.M_colind, model.nC)
    rows, dofs, size, units = rows_of(memory), dofs_of(memory), 0, 0
    last = find_levels(memory, first, find_levels(memory, first, first))
    for level in range(dofs[last].level, -1, -1):
        i = first
        while i >= 0:
            if dofs[dofs[i].tree].level == level:
                dofs[i].place, dofs[size].dof = size, i
                dofs[size].envelope, dofs[size].reach = dofs[columns[starts[i]]].place, size
                size += 1
            i = dofs[i].next
    unit, u = integers(memory.unit_at, len(rows)), dofs[first].unit
    while u >= 0:
        column, place, least = columns_of(memory, rows[u]), places_of(memory, rows[u]), size
        for n in range(len(place)):
            place[n] = dofs[column[n]].place
            least = min(least, place[n])
        for k in place:
            dofs[k].envelope = min(dofs[k].envelope, least)
        unit[units], units, u = u, units + 1, rows[u].next
    for k in range(size):
        dofs[k].envelope -= dofs[k].envelope % BLOCK
        begin = dofs[dofs[k].envelope]
        begin.reach = max(begin.reach, k)
    for k in range(1, size):
        dofs[k].reach = max(dofs[k].reach, dofs[k - 1].reach)
    memory.size, memory.units = size, units


@kernel
def find_levels(memory: Any, first: int, start: int) -> int:
    """Find how many units each tree of an island is away from the one that starts there; return one
    of the farthest."""
    rows, dofs, i, last, level = rows_of(memory), dofs_of(memory), first, start, 0
    while i >= 0:
        dofs[i].level, i = -1, dofs[i].next
    dofs[start].level = 0
    while dofs[last].level == level:
        u, level = dofs[first].unit, level + 1
        while u >= 0:
            column, near = columns_of(memory, rows[u]), False
            for c in column:
                near = near or dofs[dofs[c].tree].level == level - 1
            for c in column:
                if near and dofs[dofs[c].tree].level < 0:
                    dofs[dofs[c].tree].level, last = level, dofs[c].tree
            u = rows[u].next
    return last
