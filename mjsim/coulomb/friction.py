"""Coulomb's law: De Saxcé's shift, forces on the friction cone, and how contacts will slip.

MuJoCo's law is convex: slip would lift a contact. De Saxcé's bipotential (1992; Acary and
Brogliato, Numerical Methods for Nonsmooth Dynamical Systems, 2008, 2.3) gives Coulomb's law by the
same cone if the coefficient of friction times the slip is taken off the normal row's reference. The
shift of a step is predicted from the step before; where that is in doubt the step is solved for it.
"""

from __future__ import annotations

import math
from typing import Any

from .compiling import kernel
from .contacts import axis_of, kind_of
from .engine import engine_contacts, reals
from .memory import NEW, OPEN, SLIDES, STICKS, contacts_of, dry_of, dry_rows_of, rows_of_contact
from .parameters import FEEDBACK, SLOWEST, STEADIER
from .rows import find_residuals

# -- static and kinetic ----------------------------------------------------------------------------


@kernel
def strengthen(data: Any, memory: Any) -> None:
    """Give contacts their static friction back, if they are the very ones that were weakened."""
    contacts, found = contacts_of(memory), engine_contacts(data.contact, data.ncon)
    for i in range(memory.contacts if memory.ncon == data.ncon else 0):
        contact, given = contacts[i], found[contacts[i].index]
        if contact.weakened and given.friction[0] == contact.mu[0] and given.mu == contact.cone:
            scale(contact, given, 1 / memory.law.kinetic)


@kernel
def weaken(model: Any, data: Any, memory: Any) -> None:
    """Give contacts that slide kinetic friction, mu_k = `kinetic` mu; what stops holds by mu
    again.

    What sticks gives way in a step in which its friction changes, by h R mu f_n at most; f_n is a
    weight at least, since others may bear it. Faster than that it begins to slide.
    """
    found = engine_contacts(data.contact, data.ncon)
    for contact in contacts_of(memory):
        rows, square, gives_way = rows_of_contact(memory, contact), 0.0, SLOWEST * memory.gravity
        load = max(rows[0].remembered, memory.gravity / rows[0].estimate)
        for t in range(2 if contact.dim > 1 else 0):
            square += rows[1 + t].velocity ** 2
            if not contact.weakened:
                gives_way = max(gives_way, rows[1 + t].R * contact.mu[t] * load)
        slides = contact.state != STICKS and square > (model.opt.timestep * gives_way) ** 2
        contact.weakened = slides
        scale(contact, found[contact.index], memory.law.kinetic if slides else 1.0)


@kernel
def scale(contact: Any, given: Any, factor: float) -> None:
    """Change the friction of a contact, also in mjData."""
    given.mu *= factor
    contact.cone = given.mu
    for j in range(5):
        given.friction[j] *= factor
        contact.mu[j] = given.friction[j]


# -- forces ----------------------------------------------------------------------------------------


@kernel
def project(rows: Any, contact: Any) -> int:
    """Set the forces of a contact's rows: -residual / R, projected onto its cone; return its state.

    This is what MuJoCo's solver has (computation chapter, elliptic cone).
    """
    normal, square = rows[0], 0.0
    for t in range(contact.dim - 1):
        square += (contact.mu[t] * rows[1 + t].residual) ** 2
    across = math.sqrt(square)
    if normal.residual >= across:
        for row in rows:
            row.force = 0.0
        return OPEN
    if contact.cone**2 * normal.residual + across <= 0:
        for row in rows:
            row.force = -row.residual / row.R
        return STICKS
    normal.force = (across - normal.residual) / (normal.R * (1 + contact.cone**2))
    for t in range(contact.dim - 1):
        rows[1 + t].force = -normal.force / across * contact.mu[t] ** 2 * rows[1 + t].residual
    return SLIDES


@kernel
def find_forces(model: Any, data: Any, memory: Any) -> float:
    """Find forces, states and slip from the accelerations; how wrong a prediction was, m s-2."""
    worst = 0.0
    find_residuals(memory, reals(data.qacc, model.nv), True)
    for contact in contacts_of(memory):
        rows = rows_of_contact(memory, contact)
        normal = rows[0]
        normal.residual += contact.predicted
        contact.state = project(rows, contact)
        slip = shift(rows, contact) if contact.state != STICKS else 0.0
        contact.error = abs(slip - contact.predicted)
        if contact.state == OPEN:  # its slip matters if without it the contact would have closed
            approach = normal.residual + normal.R * normal.held - contact.predicted
            contact.error = contact.error if approach < 0 else 0.0
        if memory.law.rigid:
            for row in rows:
                contact.error = max(contact.error, abs(row.R * (row.force - row.remembered)))
        worst = max(worst, contact.error)
        contact.predicted = slip
        learn(memory, contact)
    for row in dry_rows_of(memory):
        row.force = min(max(-row.residual / row.R, -row.limit), row.limit)
    return worst


@kernel
def learn(memory: Any, contact: Any) -> None:
    """Learn from the slip of a rigid contact how wrong its prediction was, or would have been in a
    step that was solved; from a jump, which is in one step alone, nothing."""
    if not memory.law.rigid or contact.state != SLIDES or contact.extrapolated < 0:
        contact.bias, contact.shortfall = 0.0, 0.0
        return
    expected, found = max(contact.extrapolated + contact.bias, 0.0), contact.predicted
    contact.error = max(contact.error, abs(found - expected))
    before, contact.shortfall = contact.shortfall, found - contact.extrapolated
    most = min(abs(before), abs(contact.shortfall)) if before * contact.shortfall > 0 else 0.0
    contact.bias = min(max((contact.bias + contact.shortfall) / 2, -most), most)


@kernel
def store_forces(memory: Any) -> None:
    """Store the forces that rows remember, in the axes of geoms."""
    for contact in contacts_of(memory):
        rows = rows_of_contact(memory, contact)
        contact.load = rows[0].remembered
        for t in range(contact.dim - 1):
            for side in range(2):
                for axis in range(3):
                    along = contact.axes[side, axis, axis_of(t)]
                    contact.friction[side, axis, kind_of(t)] += along * rows[1 + t].remembered
    dry, rows = dry_of(memory, memory.dry), dry_rows_of(memory)
    for i in range(len(dry)):
        dry[i] = rows[i].remembered


# -- slip ------------------------------------------------------------------------------------------


@kernel
def shift(rows: Any, contact: Any) -> float:
    """De Saxcé's shift: the coefficients of friction times the slip of a contact, m s-2."""
    square = 0.0
    for t in range(contact.dim - 1):
        row = rows[1 + t]
        square += (contact.mu[t] * (row.residual + row.R * row.force)) ** 2
    return math.sqrt(square)


@kernel
def feedback(rows: Any, contact: Any) -> float:
    """How strongly the load of a contact that slides acts on its slip, through friction: mu^2 by
    MuJoCo's estimate, which is alike for all directions, and divides friction's by impratio."""
    return float(contact.mu[0] ** 2 * rows[1].estimate / rows[0].estimate)


@kernel
def predict_slip(model: Any, data: Any, memory: Any) -> bool:
    """Predict slip, as if accelerations stayed those of the last step; whether that is in doubt: it
    makes islands due."""
    doubt, rigid = 0, memory.law.rigid
    find_residuals(memory, reals(data.qacc, model.nv), False)
    for contact in contacts_of(memory):
        rows = rows_of_contact(memory, contact)
        slip, normal = shift(rows, contact), rows[0].residual
        contact.predicted, contact.extrapolated = slip, -1.0
        if contact.state == NEW or contact.state == OPEN:
            contact.due = normal < 0 and (rigid or slip > memory.enough)
            doubt |= contact.due
            continue
        if contact.state == STICKS or power(rows) >= 0:  # it stops
            contact.predicted = 0.0
            contact.due = slip > memory.enough and not would_hold(rows, contact)
        else:
            contact.extrapolated = slip
            contact.predicted = max(slip + contact.bias, 0.0)
            surely = STEADIER if rigid and feedback(rows, contact) > FEEDBACK else 1.0
            contact.due = contact.error > memory.enough * surely
        # the force of a rigid contact will change by a weight
        changes = abs(normal) > memory.gravity or (contact.predicted == 0 and slip > memory.gravity)
        contact.due |= rigid and changes
        doubt |= contact.due
    return bool(doubt)


@kernel
def extrapolate_slip(model: Any, data: Any, memory: Any) -> None:
    """Find what would have been predicted of a step that was solved: the next one need not be, if
    that was right."""
    find_residuals(memory, reals(data.qacc, model.nv), False)
    for contact in contacts_of(memory):
        contact.extrapolated = shift(rows_of_contact(memory, contact), contact)


@kernel
def power(rows: Any) -> float:
    """Friction that a contact remembers times what it is asked to give way to; negative while it
    slides."""
    total = 0.0
    for r in range(1, len(rows)):
        total += rows[r].remembered * rows[r].residual
    return total


@kernel
def would_hold(rows: Any, contact: Any) -> bool:
    """Whether a contact would stick: the forces for it, from it alone, are within the cone."""
    load, square = 0.0, 0.0
    for k in range(contact.dim):
        row = rows[k]
        lacks = row.residual + row.R * (row.remembered - row.held)
        force = row.remembered - lacks / (row.estimate + row.R)
        if k == 0:
            load = force
        else:
            square += (force / contact.mu[k - 1]) ** 2
    return bool(load > 0 and square <= load**2)
