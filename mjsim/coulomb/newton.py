"""The rigid contact problem of a step: one semismooth Newton iteration for each island.

With De Saxcé's shift the projection onto the friction cone is, in closed form,

    f_n = max(0, -r_n / R),   f_t = -r_t / R_t, cut off where it leaves the ellipse of mu f_n,

with r = J a - reference - R held: no shift is left in it. Newton's method solves
M a = q + J' f(a) for the accelerations a (Alart and Curnier 1991; Acary, Brémond, Huber 2018,
Advanced Topics in Nonsmooth Dynamics, 3). Its derivative isn't symmetric, since friction grows with
the normal force. What contacts bear is then held, and solved for again, until R matters no more
(proximal point, augmented Lagrangian); a large R makes each iteration tame.

Rows that act together are a unit: a contact, or a single row.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from .compiling import kernel
from .engine import integers, reals
from .friction import shift
from .memory import (
    CONTACT_ROW,
    DRY,
    EQUALITY,
    ONE_SIDED,
    OPEN,
    SLIDES,
    STICKS,
    contacts_of,
    rows_of,
)
from .parameters import DECREASE, FEWER, SHORTEST, STEPS
from .rows import times


class Units(NamedTuple):
    """All units, and their Jacobians without the columns that are zero."""

    contact: Any  # its number; -1: a single row
    address: Any  # its first row
    dim: Any  # how many it has
    first: Any  # where its columns begin, and that of the next one
    columns: Any
    begin: Any  # where its Jacobian begins, row by row
    jacobian: Any


class Island(NamedTuple):
    """What is solved for at once."""

    dofs: Any  # its degrees of freedom
    units: Any  # numbers of its units
    envelope: Any  # the first column of each row of the derivative that is not always zero
    lower: Any  # L below its diagonal of ones
    upper: Any  # U, transposed
    step: Any


# -- forces and their derivatives ------------------------------------------------------------------


@kernel
def contact_forces(rows: Any, contact: Any) -> int:
    """Set a contact's forces from its residuals, by Coulomb's law; return its state."""
    first, square = contact.address, 0.0
    load = max(-rows[first].residual / rows[first].R, 0.0)
    for t in range(contact.dim - 1):
        row = rows[first + 1 + t]
        row.force = -row.residual / row.R
        square += (row.force / contact.mu[t]) ** 2
    rows[first].force = load
    if load > 0 and square <= load * load:
        return STICKS
    share = load / math.sqrt(square) if square > 0 else 0.0
    for t in range(contact.dim - 1):
        rows[first + 1 + t].force *= share
    return SLIDES if load > 0 else OPEN


@kernel
def contact_stiffness(rows: Any, contact: Any, stiffness: Any) -> None:
    """Minus the derivative of a closed contact's forces by its residuals, kg."""
    first, n, square = contact.address, contact.dim, 0.0
    load = rows[first].force
    stiffness[:n, :n] = 0.0
    stiffness[0, 0] = 1 / rows[first].R
    for t in range(n - 1):
        row = rows[first + 1 + t]
        square += (row.residual / row.R / contact.mu[t]) ** 2
    shorter = load / math.sqrt(square) if contact.state == SLIDES else 1.0
    for i in range(1, n):
        row = rows[first + i]
        stiffness[i, i] = shorter / row.R
        for j in range(1, n if contact.state == SLIDES else 0):
            other = rows[first + j]
            along = row.force * other.force / (load * contact.mu[j - 1]) ** 2
            stiffness[i, j] -= shorter * along / other.R
        if contact.state == SLIDES:
            stiffness[i, 0] = row.force / load * stiffness[0, 0]


@kernel
def row_force(row: Any) -> float:
    """The force of a single row."""
    force = -row.residual / row.R
    if row.kind == DRY:
        return float(min(max(force, -row.limit), row.limit))
    if row.kind == ONE_SIDED:
        return float(max(force, 0.0))
    return float(force) if row.kind == EQUALITY else 0.0


@kernel
def row_stiffness(row: Any) -> float:
    """Minus its derivative by the residual, kg."""
    if row.kind == DRY and abs(row.force) >= row.limit:
        return 0.0
    return 1 / row.R if row.force != 0 else 0.0


# -- units and islands -----------------------------------------------------------------------------


@kernel
def find_units(model: Any, memory: Any) -> Any:
    """All units but open contacts, in the order of contacts and then of other rows."""
    rows, contacts, count = rows_of(memory), contacts_of(memory), memory.contacts
    most, nonzeros = count + len(rows), 0
    for r in range(len(rows)):
        nonzeros += rows[r].length
    units = Units(
        *(np.empty(most, np.int64), np.empty(most, np.int64), np.empty(most, np.int64)),
        *(np.zeros(most + 1, np.int64), np.empty(6 * nonzeros, np.int64)),
        *(np.zeros(most + 1, np.int64), np.zeros(6 * nonzeros)),
    )
    place, n = np.full(model.nv, -1, np.int64), 0
    for k in range(count):
        if contacts[k].state != OPEN:
            n = add_unit(memory, units, n, contacts[k].address, contacts[k].dim, k, place)
    for r in range(len(rows)):
        if rows[r].kind != CONTACT_ROW:
            n = add_unit(memory, units, n, r, 1, -1, place)
    return n, units


@kernel
def add_unit(
    memory: Any, units: Any, n: int, address: int, dim: int, contact: int, place: Any
) -> int:
    """Add a unit, if it moves anything; return how many there are."""
    rows, begin = rows_of(memory), units.first[n]
    end = begin
    for r in range(address, address + dim):
        column = integers(memory.column_at + 4 * rows[r].first, rows[r].length)
        jacobian = reals(memory.jacobian_at + 8 * rows[r].first, rows[r].length)
        rows[r].force = 0.0
        for k in range(rows[r].length):
            if jacobian[k] != 0 and place[column[k]] < 0:
                place[column[k]], units.columns[end] = end - begin, column[k]
                end += 1
    for r in range(dim):
        row, start = rows[address + r], units.begin[n] + r * (end - begin)
        column = integers(memory.column_at + 4 * row.first, row.length)
        jacobian = reals(memory.jacobian_at + 8 * row.first, row.length)
        for k in range(row.length):
            if jacobian[k] != 0:
                units.jacobian[start + place[column[k]]] = jacobian[k]
    for c in units.columns[begin:end]:
        place[c] = -1
    units.contact[n], units.address[n], units.dim[n] = contact, address, dim
    units.first[n + 1], units.begin[n + 1] = end, units.begin[n] + dim * (end - begin)
    return int(n + (end > begin))


@kernel
def columns_of(units: Any, u: int) -> Any:
    """The degrees of freedom that a unit moves."""
    return units.columns[units.first[u] : units.first[u + 1]]


@kernel
def jacobian_of(units: Any, u: int) -> Any:
    """The Jacobian of a unit, (dim, columns)."""
    width = units.first[u + 1] - units.first[u]
    return units.jacobian[units.begin[u] : units.begin[u + 1]].reshape((units.dim[u], width))


@kernel
def label_islands(model: Any, count: int, units: Any) -> Any:
    """Label degrees of freedom that units or joints connect by the first of each island."""
    parent, label = integers(model.dof_parentid, model.nv), np.empty(model.nv, np.int64)
    for i in range(model.nv):
        label[i] = root(label, parent[i]) if parent[i] >= 0 else i
    for u in range(count):
        columns = columns_of(units, u)
        for c in columns:
            one, other = root(label, columns[0]), root(label, c)
            label[max(one, other)] = min(one, other)
    for i in range(model.nv):
        label[i] = root(label, i)
    return label


@kernel
def root(label: Any, i: int) -> int:
    """The first of an island, followed along labels."""
    while label[i] != i:
        label[i] = label[label[i]]
        i = label[i]
    return i


# -- one island ------------------------------------------------------------------------------------


@kernel
def find_residual(
    model: Any, data: Any, memory: Any, units: Any, island: Any, a: Any, residual: Any
) -> float:
    """M a - q - J' f of an island, with all forces; its square in units of M's diagonal."""
    rows, contacts, smooth = rows_of(memory), contacts_of(memory), reals(data.qfrc_smooth, model.nv)
    starts, lengths = integers(model.M_rowadr, model.nv), integers(model.M_rownnz, model.nv)
    columns, inertia = integers(model.M_colind, model.nC), reals(data.M, model.nC)
    for i in island.dofs:
        residual[i] = -smooth[i]
    for i in island.dofs:  # M is a lower triangle, row by row; rows end on the diagonal
        for n in range(starts[i], starts[i] + lengths[i] - 1):
            residual[i] += inertia[n] * a[columns[n]]
            residual[columns[n]] += inertia[n] * a[i]
        residual[i] += inertia[starts[i] + lengths[i] - 1] * a[i]
    for u in island.units:
        column, jacobian, first = columns_of(units, u), jacobian_of(units, u), units.address[u]
        for r in range(units.dim[u]):
            row = rows[first + r]
            total = -row.reference - row.R * row.held
            for k in range(len(column)):
                total += jacobian[r, k] * a[column[k]]
            row.residual = total
        if units.contact[u] < 0:
            rows[first].force = row_force(rows[first])
        else:
            contact = contacts[units.contact[u]]
            contact.state = contact_forces(rows, contact)
        for r in range(units.dim[u] if rows[first].force != 0 else 0):
            for k in range(len(column)):
                residual[column[k]] -= jacobian[r, k] * rows[first + r].force
    square = 0.0
    for i in island.dofs:
        square += residual[i] ** 2 / inertia[starts[i] + lengths[i] - 1]
    return square


@kernel
def assemble(
    model: Any, data: Any, memory: Any, units: Any, island: Any, local: Any, work: Any
) -> None:
    """The derivative of the residual: its lower triangle, and its upper one transposed."""
    rows, contacts, lower, upper = rows_of(memory), contacts_of(memory), island.lower, island.upper
    starts, lengths = integers(model.M_rowadr, model.nv), integers(model.M_rownnz, model.nv)
    columns, inertia = integers(model.M_colind, model.nC), reals(data.M, model.nC)
    for i in range(len(island.dofs)):
        lower[i, island.envelope[i] : i + 1] = 0.0
        upper[i, island.envelope[i] : i + 1] = 0.0
        start = starts[island.dofs[i]]
        for n in range(start, start + lengths[island.dofs[i]]):
            lower[i, local[columns[n]]] += inertia[n]
            upper[i, local[columns[n]]] += inertia[n]
    for u in island.units:
        first, dim, column = units.address[u], units.dim[u], columns_of(units, u)
        if rows[first].force == 0:
            continue
        stiffness, product, jacobian = work[0], work[1], jacobian_of(units, u)
        if units.contact[u] < 0:
            stiffness[0, 0] = row_stiffness(rows[first])
        else:
            contact_stiffness(rows, contacts[units.contact[u]], stiffness)
        for r in range(dim):
            for k in range(len(column)):
                product[r, k] = 0.0
                for s in range(dim):
                    product[r, k] += stiffness[r, s] * jacobian[s, k]
        for n in range(len(column)):
            i = local[column[n]]
            for k in range(len(column)):
                j, entry = local[column[k]], 0.0
                for r in range(dim):
                    entry += jacobian[r, n] * product[r, k]
                if j <= i:
                    lower[i, j] += entry
                if j >= i:
                    upper[j, i] += entry


@kernel
def factorise(lower: Any, upper: Any, envelope: Any) -> None:
    """L and U within their envelope. No pivots are chosen: a large R keeps diagonals large."""
    for i in range(len(envelope)):
        own_lower, own_upper = lower[i], upper[i]
        for j in range(envelope[i], i):
            other_lower, other_upper, below, above = lower[j], upper[j], 0.0, 0.0
            # numbers without a sign: numba then needs no look at negative ones
            for k in range(np.uint64(max(envelope[i], envelope[j])), np.uint64(j)):
                below += own_lower[k] * other_upper[k]
                above += own_upper[k] * other_lower[k]
            own_lower[j] = (own_lower[j] - below) / other_upper[j]
            own_upper[j] -= above
        total = 0.0
        for k in range(np.uint64(envelope[i]), np.uint64(i)):
            total += own_lower[k] * own_upper[k]
        own_upper[i] -= total


@kernel
def substitute(lower: Any, upper: Any, envelope: Any, x: Any) -> None:
    """Solve L U x = x."""
    for i in range(len(envelope)):
        total = 0.0
        for k in range(envelope[i], i):
            total += lower[i, k] * x[k]
        x[i] -= total
    for i in range(len(envelope) - 1, -1, -1):
        x[i] /= upper[i, i]
        for k in range(envelope[i], i):
            x[k] -= upper[i, k] * x[i]


@kernel
def make_island(model: Any, units: Any, dofs: Any, own: Any, local: Any) -> Any:
    """An island, with room for its derivative; `local` becomes the places of its dofs in it."""
    starts, columns = integers(model.M_rowadr, model.nv), integers(model.M_colind, model.nC)
    size = len(dofs)
    envelope = np.empty(size, np.int64)
    for i in range(size):
        local[dofs[i]] = i
        envelope[i] = local[columns[starts[dofs[i]]]]
    for u in own:
        least = size
        for c in columns_of(units, u):
            least = min(least, local[c])
        for c in columns_of(units, u):
            envelope[local[c]] = min(envelope[local[c]], least)
    lower, upper = np.empty((size, size)), np.empty((size, size))
    return Island(dofs, own, envelope, lower, upper, np.empty(size))


@kernel
def solve_island(
    model: Any, data: Any, memory: Any, units: Any, island: Any, local: Any, a: Any, enough: float
) -> None:
    """Newton's method for the accelerations of an island, to `enough`."""
    residual, tried, step = np.zeros(model.nv), np.zeros(model.nv), island.step
    work = np.empty((2, 6, model.nv + 6))
    square = find_residual(model, data, memory, units, island, a, residual)
    for _ in range(STEPS):
        if square <= enough**2:
            return
        assemble(model, data, memory, units, island, local, work)
        factorise(island.lower, island.upper, island.envelope)
        memory.factorisations += 1
        for i in range(len(step)):
            step[i] = -residual[island.dofs[i]]
        substitute(island.lower, island.upper, island.envelope, step)
        share, before = 1.0, square
        while True:
            for i in range(len(step)):
                tried[island.dofs[i]] = a[island.dofs[i]] + share * step[i]
            square = find_residual(model, data, memory, units, island, tried, residual)
            if square <= (1 - DECREASE * share) ** 2 * before or share < SHORTEST:
                break
            share *= FEWER
        for i in island.dofs:
            a[i] = tried[i]


@kernel
def forces_without_contacts(model: Any, data: Any, dofs: Any) -> float:
    """The size of the forces on an island without contacts, in units of M's diagonal."""
    starts, lengths = integers(model.M_rowadr, model.nv), integers(model.M_rownnz, model.nv)
    inertia, smooth, square = reals(data.M, model.nC), reals(data.qfrc_smooth, model.nv), 1e-12
    for i in dofs:
        square += smooth[i] ** 2 / inertia[starts[i] + lengths[i] - 1]
    return math.sqrt(square)


@kernel
def hold_forces(memory: Any, units: Any, island: Any) -> float:
    """Let contacts hold their forces; by how much R made them give way, m s-2."""
    rows, worst = rows_of(memory), 0.0
    for u in island.units:
        for r in range(units.address[u], units.address[u] + units.dim[u]):
            row = rows[r]
            if units.contact[u] >= 0:
                worst = max(worst, row.R * abs(row.force - row.held))
                row.held = row.remembered = row.force
    return worst


@kernel
def solve_contacts(
    model: Any, data: Any, memory: Any, a: Any, accuracy: float, enough: float
) -> None:
    """Solve for the accelerations `a` with contacts that close, until none closes that was open.

    `accuracy`: of forces, in units of those without contacts; `enough`: acceleration by which R may
    make contacts give way, m s-2. Forces, states and residuals of rows are those that it comes to.
    """
    contacts, rows = contacts_of(memory), rows_of(memory)
    find_residuals(model, memory, a)
    for k in range(memory.contacts):
        normal = rows[contacts[k].address]
        contacts[k].state = STICKS if normal.residual < 0 or normal.held > 0 else OPEN
    closes = np.full(memory.contacts, True)
    for _ in range(memory.law.most):
        solve_closed(model, data, memory, a, closes, accuracy, enough)
        find_residuals(model, memory, a)
        for k in range(memory.contacts):
            was_open = contacts[k].state == OPEN
            contacts[k].state = contact_forces(rows, contacts[k])
            closes[k] = was_open and contacts[k].state != OPEN
            slip = shift(rows, contacts[k]) if contacts[k].state != STICKS else 0.0
            contacts[k].predicted = slip
        if not closes.any():
            return


@kernel
def find_residuals(model: Any, memory: Any, a: Any) -> None:
    """Set the residuals of all contacts."""
    contacts, rows = contacts_of(memory), rows_of(memory)
    for k in range(memory.contacts):
        for r in range(contacts[k].address, contacts[k].address + contacts[k].dim):
            row = rows[r]
            row.residual = times(model, memory, row, a) - row.reference - row.R * row.held


@kernel
def solve_closed(
    model: Any, data: Any, memory: Any, a: Any, closes: Any, accuracy: float, enough: float
) -> None:
    """Solve for the accelerations of all islands of closed contacts of which one `closes` just now."""
    count, units = find_units(model, memory)
    label = label_islands(model, count, units)
    of_unit, local = np.empty(count, np.int64), np.empty(model.nv, np.int64)
    for u in range(count):
        of_unit[u] = label[columns_of(units, u)[0]]
    dofs, own = np.argsort(label, kind="mergesort"), np.argsort(of_unit, kind="mergesort")
    i, k = 0, 0
    while k < count:
        here, until = of_unit[own[k]], k
        while until < count and of_unit[own[until]] == here:
            until += 1
        while label[dofs[i]] != here:
            i += 1
        last = i
        while last < model.nv and label[dofs[last]] == here:
            last += 1
        some = False
        for u in own[k:until]:
            some = some or (units.contact[u] >= 0 and closes[units.contact[u]])
        if some:
            island = make_island(model, units, dofs[i:last], own[k:until], local)
            small = accuracy * forces_without_contacts(model, data, island.dofs)
            for _ in range(memory.law.most):
                solve_island(model, data, memory, units, island, local, a, small)
                if hold_forces(memory, units, island) <= enough:
                    break
        i, k = last, until
