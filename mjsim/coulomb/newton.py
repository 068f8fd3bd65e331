"""The rigid contact problem of a step: one semismooth Newton iteration for each island.

With De Saxcé's shift the projection onto the friction cone is, in closed form,

    f_n = max(0, -r_n / R),   f_t = -r_t / R_t, cut off where it leaves the ellipse of mu f_n,

with r = J a - reference - R held: no shift is left in it. Newton's method solves
M a = q + J' f(a) for the accelerations a (Alart and Curnier 1991; Acary, Brémond, Huber 2018,
Advanced Topics in Nonsmooth Dynamics, 3). Its derivative isn't symmetric, since friction grows with
the normal force. What contacts bear is then held, and solved for again, until R matters no more
(proximal point, augmented Lagrangian); a large R makes each iteration tame.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from .compiling import kernel
from .engine import integers, reals
from .friction import shift
from .islands import find_islands, find_units, in_due_island, number_island
from .memory import (
    DRY,
    ONE_SIDED,
    OPEN,
    SLIDES,
    STICKS,
    contacts_of,
    dofs_of,
    jacobians_of,
    places_of,
    rows_of_contact,
    rows_of_unit,
    units_of,
)
from .parameters import (
    BLOCK,
    DECREASE,
    EXACT,
    FALLING,
    FEWER,
    FORCED,
    NEAR,
    R_FALLS,
    R_LEAST,
    R_RISES,
    ROUGH,
    SHORTEST,
    SOFTER,
    STEPS,
)
from .rows import find_residuals, hold
from .vectors import assign

# -- forces and their derivatives ------------------------------------------------------------------


@kernel
def contact_forces(rows: Any, contact: Any) -> int:
    """Set the forces of a contact's rows from their residuals, by Coulomb's law; return its
    state."""
    square, load = 0.0, max(-rows[0].residual / rows[0].R, 0.0)
    for t in range(contact.dim - 1):
        row = rows[1 + t]
        row.force = -row.residual / row.R
        square += (row.force / contact.mu[t]) ** 2
    rows[0].force, contact.share = load, 1.0
    if load > 0 and square <= load * load:
        return STICKS
    contact.share = load / math.sqrt(square) if square > 0 else 0.0
    for t in range(contact.dim - 1):
        rows[1 + t].force *= contact.share
    return SLIDES if load > 0 else OPEN


@kernel
def row_force(row: Any) -> float:
    """The force of a single row."""
    force = -row.residual / row.R
    if row.kind == DRY:
        return float(min(max(force, -row.limit), row.limit))
    return float(max(force, 0.0) if row.kind == ONE_SIDED else force)


@kernel
def stiffness(rows: Any, contact: Any, r: int, s: int) -> float:
    """Minus the derivative of force r of a closed contact by its residual s, kg."""
    load, row, other = rows[0], rows[r], rows[s]
    own = 1 / row.R if r == s else 0.0
    if contact.state != SLIDES or r == 0:
        return own
    if s == 0:
        return float(row.force / load.force / load.R)
    along = row.force * other.force / (load.force * contact.mu[s - 1]) ** 2
    return float(contact.share * (own - along / other.R))


@kernel
def row_stiffness(row: Any) -> float:
    """Minus the derivative of a single row's force by its residual, kg."""
    slides = row.kind == DRY and abs(row.force) >= row.limit
    return 0.0 if slides or row.force == 0 else 1 / row.R


# -- one island ------------------------------------------------------------------------------------


@kernel
def find_residual(model: Any, data: Any, memory: Any, a: Any) -> float:
    """M a - q - J' f of the island, with all forces; its square in units of M's diagonal."""
    dofs, residual, square = dofs_of(memory), reals(memory.residual_at, memory.size), 0.0
    starts, lengths = integers(model.M_rowadr, model.nv), integers(model.M_rownnz, model.nv)
    columns, inertia = integers(model.M_colind, model.nC), reals(data.M, model.nC)
    smooth = reals(data.qfrc_smooth, model.nv)
    for k in range(memory.size):  # M is a lower triangle, row by row; rows end on the diagonal
        i = dofs[k].dof
        residual[k] = -smooth[i]
        for n in range(starts[i], starts[i] + lengths[i] - 1):
            other = columns[n] - i + k  # those of a tree have successive numbers
            residual[k] += inertia[n] * a[other]
            residual[other] += inertia[n] * a[k]
        residual[k] += inertia[starts[i] + lengths[i] - 1] * a[k]
    for u in units_of(memory):
        subtract_forces(memory, rows_of_unit(memory, u), a, residual)
    for k in range(memory.size):
        i = dofs[k].dof
        square += residual[k] ** 2 / inertia[starts[i] + lengths[i] - 1]
    return square


@kernel
def subtract_forces(memory: Any, unit: Any, a: Any, residual: Any) -> None:
    """Find the forces of a unit's rows at accelerations `a`, and take J' f off the residual."""
    first = unit[0]
    find_unit_residuals(memory, unit, 0, 1, a)
    if first.contact < 0:
        first.force = row_force(first)
    else:
        if first.residual < 0:  # else it is open, and what else there is of it tells nothing
            find_unit_residuals(memory, unit, 1, len(unit), a)
        contact = contacts_of(memory)[first.contact]
        contact.state = contact_forces(unit, contact)
    if first.force == 0:
        return
    if len(unit) == 3:  # loops of a length that is known are faster
        subtract_unit(memory, unit, 3, residual)
    else:
        subtract_unit(memory, unit, len(unit), residual)


@kernel
def find_unit_residuals(memory: Any, unit: Any, begin: int, end: int, a: Any) -> None:
    """Set the residuals of some rows of a unit, at accelerations `a`."""
    place, jacobian = places_of(memory, unit[0]), jacobians_of(memory, unit[0])
    for r in range(begin, end):
        row, acceleration = unit[r], 0.0
        for n in range(len(place)):
            acceleration += jacobian[r, n] * a[np.uint64(place[n])]
        row.residual = acceleration - row.reference - row.R * row.held


@kernel
def subtract_unit(memory: Any, unit: Any, dim: int, residual: Any) -> None:
    """Take J' f of a unit off the residual."""
    place, jacobian = places_of(memory, unit[0]), jacobians_of(memory, unit[0])
    force = reals(memory.local_at, dim)
    for r in range(dim):
        force[r] = unit[r].force
    for n in range(len(place)):
        whole = 0.0
        for r in range(dim):
            whole += jacobian[r, n] * force[r]
        residual[np.uint64(place[n])] -= whole


@kernel
def assemble(model: Any, data: Any, memory: Any, matrix: Any) -> None:
    """The derivative of the residual of the island."""
    contacts, dofs = contacts_of(memory), dofs_of(memory)
    starts, lengths = integers(model.M_rowadr, model.nv), integers(model.M_rownnz, model.nv)
    columns, inertia = integers(model.M_colind, model.nC), reals(data.M, model.nC)
    for k in range(memory.size):
        for n in range(dofs[k].envelope, dofs[k].reach + 1):
            matrix[k, n] = 0.0
    for k in range(memory.size):
        i = dofs[k].dof
        for n in range(starts[i], starts[i] + lengths[i]):
            other = columns[n] - i + k
            matrix[k, other] = matrix[other, k] = inertia[n]
    for u in units_of(memory):
        unit = rows_of_unit(memory, u)
        if unit[0].force != 0:
            find_stiffness(unit, contacts)
            if len(unit) == 3:
                add_unit(memory, unit, 3, matrix)
            else:
                add_unit(memory, unit, len(unit), matrix)


@kernel
def find_stiffness(unit: Any, contacts: Any) -> None:
    """Set how the forces of a unit depend on its residuals."""
    if unit[0].contact < 0:
        unit[0].stiffness[0] = row_stiffness(unit[0])
        return
    for r in range(len(unit)):
        for s in range(len(unit)):
            unit[r].stiffness[s] = stiffness(unit, contacts[unit[0].contact], r, s)


@kernel
def add_unit(memory: Any, unit: Any, dim: int, matrix: Any) -> None:
    """Add J' K J of a unit, K being its stiffness, row by row."""
    place, jacobian = places_of(memory, unit[0]), jacobians_of(memory, unit[0])
    factor = reals(memory.local_at, dim)
    for n in range(len(place)):
        own = matrix[place[n]]
        for s in range(dim):
            factor[s] = 0.0
            for r in range(dim):
                factor[s] += jacobian[r, n] * unit[r].stiffness[s]
        for k in range(len(place)):
            added = 0.0
            for s in range(dim):
                added += factor[s] * jacobian[s, k]
            own[np.uint64(place[k])] += added


@kernel
def factorise(matrix: Any, dofs: Any) -> None:
    """L and U in the matrix's place. No pivots are chosen: a large R keeps diagonals large."""
    for i in range(len(matrix)):
        own, together = matrix[i], i - i % BLOCK
        for k in range(dofs[i].envelope, together, BLOCK):
            subtract_block(matrix, own, k, dofs[k].reach)
        for k in range(together, i):
            other = matrix[k]
            own[k] /= other[k]
            for j in range(np.uint64(k + 1), np.uint64(dofs[k].reach + 1)):
                own[j] -= own[k] * other[j]


@kernel
def subtract_block(matrix: Any, own: Any, k: int, reach: int) -> None:
    """Take multiples of `BLOCK` rows off another one, in which their diagonals' columns are then
    factors of L."""
    a, b, c, d = matrix[k], matrix[k + 1], matrix[k + 2], matrix[k + 3]
    x = own[k] / a[k]
    y = (own[k + 1] - x * a[k + 1]) / b[k + 1]
    z = (own[k + 2] - x * a[k + 2] - y * b[k + 2]) / c[k + 2]
    w = (own[k + 3] - x * a[k + 3] - y * b[k + 3] - z * c[k + 3]) / d[k + 3]
    own[k], own[k + 1], own[k + 2], own[k + 3] = x, y, z, w
    # numbers without a sign: numba then needs no look at negative ones
    for j in range(np.uint64(k + 4), np.uint64(reach + 1)):
        own[j] -= x * a[j] + y * b[j] + z * c[j] + w * d[j]


@kernel
def substitute(matrix: Any, dofs: Any, x: Any) -> None:
    """Solve L U x = x."""
    for i in range(len(matrix)):
        for k in range(dofs[i].envelope, i):
            x[i] -= matrix[i, k] * x[k]
    for i in range(len(matrix) - 1, -1, -1):
        for k in range(i + 1, dofs[i].reach + 1):
            x[i] -= matrix[i, k] * x[k]
        x[i] /= matrix[i, i]


@kernel
def solve_island(model: Any, data: Any, memory: Any, exactness: float) -> bool:
    """Newton's method for the accelerations of the island, to a part of the forces without
    contacts; whether it came to an end, else they are what they were."""
    dofs, size, forced = dofs_of(memory), memory.size, 0
    matrix, step = reals(memory.matrix_at, (size, size)), reals(memory.step_at, size)
    a, tried = reals(memory.island_at, size), reals(memory.tried_at, size)
    residual, begin = reals(memory.residual_at, size), reals(memory.begin_at, size)
    assign(begin, a)
    enough = exactness * forces_without_contacts(model, data, memory)
    square = find_residual(model, data, memory, a)
    for _ in range(STEPS):
        if square <= enough**2:
            return True
        assemble(model, data, memory, matrix)
        factorise(matrix, dofs)
        for k in range(size):
            step[k] = -residual[k]
        substitute(matrix, dofs, step)
        share, before = 1.0, square
        while True:
            for k in range(size):
                tried[k] = a[k] + share * step[k]
            square = find_residual(model, data, memory, tried)
            if square <= (1 - DECREASE * share) ** 2 * before or share < SHORTEST:
                break
            share *= FEWER
        assign(a, tried)
        forced += share < SHORTEST
        if forced > FORCED:
            break
    assign(a, begin)
    return False


@kernel
def forces_without_contacts(model: Any, data: Any, memory: Any) -> float:
    """The size of the forces on the island without contacts, in units of M's diagonal."""
    starts, lengths = integers(model.M_rowadr, model.nv), integers(model.M_rownnz, model.nv)
    inertia, smooth, square = reals(data.M, model.nC), reals(data.qfrc_smooth, model.nv), 1e-12
    dofs = dofs_of(memory)
    for k in range(memory.size):
        i = dofs[k].dof
        square += smooth[i] ** 2 / inertia[starts[i] + lengths[i] - 1]
    return math.sqrt(square)


@kernel
def hold_forces(memory: Any) -> float:
    """Let the contacts of the island hold their forces; by how much R made them give way, m s-2."""
    worst = 0.0
    for u in units_of(memory):
        unit = rows_of_unit(memory, u)
        if unit[0].contact >= 0:
            worst = max(worst, hold(unit))
    return worst


@kernel
def solve_contacts(model: Any, data: Any, memory: Any, a: Any, scale: float) -> bool:
    """Solve for the accelerations `a` of islands that contacts make due, with contacts that close,
    until none closes that was open; each island begins with `scale` times R.

    Slip that is predicted, and forces that are held, are those that it comes to. Returns whether it
    came to an end.
    """
    find_residuals(memory, a, True)
    for contact in contacts_of(memory):
        normal = rows_of_contact(memory, contact)[0]
        contact.closed = normal.residual < 0 or normal.held > 0
    for _ in range(memory.law.most):
        if not solve_closed(model, data, memory, a, scale):
            return False
        find_residuals(memory, a, True)
        some = False
        for contact in contacts_of(memory):
            rows, was_open, contact.due = rows_of_contact(memory, contact), not contact.closed, 0
            if not in_due_island(memory, contact):
                continue
            contact.state = contact_forces(rows, contact)
            contact.closed = contact.state != OPEN
            contact.due = was_open and contact.closed
            contact.predicted = shift(rows, contact) if contact.state != STICKS else 0.0
            contact.extrapolated = -1.0
            some = some or contact.due
        if not some:
            return True
    return False


@kernel
def solve_closed(model: Any, data: Any, memory: Any, a: Any, scale: float) -> bool:
    """Solve for the accelerations of islands that are due; whether all came to an end. Their
    contacts become softer, once in a step: in a solution they come to hold what they bear."""
    find_units(memory)
    find_islands(model, memory)
    for contact in contacts_of(memory):
        if in_due_island(memory, contact) and not contact.solved:
            contact.solved = 1
            for row in rows_of_contact(memory, contact):
                row.R *= SOFTER
    dofs, own, solved = dofs_of(memory), reals(memory.island_at, memory.nv), True
    for first in range(model.nv):
        if solved and dofs[first].label == first and dofs[first].due:
            number_island(model, memory, first)
            for k in range(memory.size):
                own[k] = a[dofs[k].dof]
            solved = solve_rigid_island(model, data, memory, scale)
            for k in range(memory.size):
                a[dofs[k].dof] = own[k]
    return solved


@kernel
def solve_rigid_island(model: Any, data: Any, memory: Any, scale: float) -> bool:
    """Solve an island until R makes its contacts give way no more, m s-2: proximal point method.

    R, first `scale` times what it is, falls from solution to solution, so that they come near
    sooner (Rockafellar 1976); it grows where Newton's method comes to no end. Then it is again what
    it was.
    """
    gives_way, last, solved, least = math.inf, math.inf, True, False
    multiply_R(memory, scale)
    for _ in range(memory.law.most):
        if least and solved and gives_way <= memory.enough and gives_way >= FALLING * last:
            break
        least |= scale <= R_LEAST
        solved = solve_island(model, data, memory, EXACT if least else ROUGH)
        factor = R_RISES
        if solved:
            last, gives_way = gives_way, hold_forces(memory)
            factor = R_LEAST / scale
            if gives_way > NEAR * memory.enough:
                factor = max(R_FALLS, factor)
        scale *= factor
        multiply_R(memory, factor)
    multiply_R(memory, 1 / scale)
    return solved and gives_way <= memory.enough


@kernel
def multiply_R(memory: Any, factor: float) -> None:
    """Multiply R of the contacts of the island."""
    for u in units_of(memory):
        unit = rows_of_unit(memory, u)
        if unit[0].contact >= 0:
            for row in unit:
                row.R *= factor
