"""Constraint rows: their Jacobians times a vector, and what is left of what they ask for."""

from __future__ import annotations

import math
from typing import Any

from .compiling import kernel
from .engine import reals
from .memory import STICKS, columns_of, contacts_of, jacobian_of, rows_of, rows_of_contact
from .vectors import NONE, dot, plus


@kernel
def times(memory: Any, row: Any, vector: Any) -> float:
    """A row of the Jacobian times a vector of all degrees of freedom."""
    column, jacobian, total = columns_of(memory, row), jacobian_of(memory, row), 0.0
    for n in range(len(column)):
        total += jacobian[n] * vector[column[n]]
    return total


@kernel
def find_residuals(memory: Any, accelerations: Any, holding: bool) -> None:
    """Set the residuals of all rows: the Jacobian times the accelerations, less the reference; and
    less R times what they hold, if they are `holding`. There are no forces yet."""
    for row in rows_of(memory):
        held = row.held if holding else 0.0
        row.residual = times(memory, row, accelerations) - row.reference - row.R * held
        row.force = 0.0


@kernel
def hold(rows: Any) -> float:
    """Let rows hold their forces; by how much R made them give way, m s-2."""
    most = 0.0
    for row in rows:
        most = max(most, row.R * abs(row.force - row.held))
        row.held = row.remembered = row.force
    return most


@kernel
def find_surfaces(model: Any, data: Any, memory: Any) -> None:
    """Find how fast surfaces move on their bodies: MuJoCo has it in its velocities alone."""
    rows, velocity = rows_of(memory), reals(data.qvel, model.nv)
    speed = reals(data.efc_vel, data.nefc)
    for r in range(len(rows)):
        rows[r].surface = speed[r] - times(memory, rows[r], velocity)


@kernel
def read_rows(data: Any, memory: Any) -> None:
    """Read what MuJoCo has of all rows. They hold what they remember, but for the loads of soft
    contacts."""
    rows = rows_of(memory)
    R, reference = reals(data.efc_R, data.nefc), reals(data.efc_aref, data.nefc)
    velocity, estimate = reals(data.efc_vel, data.nefc), reals(data.efc_diagA, data.nefc)
    for r in range(len(rows)):
        row = rows[r]
        row.velocity, row.estimate = velocity[r], estimate[r]
        row.R = row.given_R = R[r]
        row.reference = row.given_reference = reference[r]
        row.held = row.remembered
    if not memory.law.rigid:
        for contact in contacts_of(memory):
            rows[contact.address].held = 0.0


@kernel
def put_rows_back(data: Any, memory: Any) -> None:
    """Make rows MuJoCo's again that are still as it was told: in a call in which it skips the stage
    that makes them."""
    rows = rows_of(memory)
    R, D = reals(data.efc_R, data.nefc), reals(data.efc_D, data.nefc)
    reference = reals(data.efc_aref, data.nefc)
    for r in range(len(rows) if memory.told and len(rows) == data.nefc else 0):
        if reference[r] == rows[r].told and R[r] == rows[r].R:
            reference[r], R[r] = rows[r].given_reference, rows[r].given_R
            D[r] = 1 / R[r]
    memory.told = 0


@kernel
def write_references(data: Any, memory: Any) -> None:
    """Tell MuJoCo reference accelerations that hold what is remembered, less De Saxcé's shift."""
    rows, reference = rows_of(memory), reals(data.efc_aref, data.nefc)
    for r in range(len(rows)):
        reference[r] = rows[r].reference + rows[r].R * rows[r].held
    for contact in contacts_of(memory):
        reference[contact.address] -= contact.predicted
    for r in range(len(rows)):
        rows[r].told = reference[r]
    memory.told = 1


@kernel
def store_velocities(model: Any, data: Any, memory: Any) -> None:
    """Store how contacts part and slip, by the last Jacobians and the velocities now."""
    velocity = reals(data.qvel, model.nv)
    for contact in contacts_of(memory):
        rows, total = rows_of_contact(memory, contact), NONE
        contact.belt = 0.0
        for axis in range(min(contact.dim, 3)):
            speed = times(memory, rows[axis], velocity) + rows[axis].surface
            contact.belt += abs(rows[axis].surface)
            total = plus(total, speed, contact.frame[axis])
        for j in range(3):
            contact.velocity[j] = total[j]


@kernel
def add_turning(model: Any, data: Any, memory: Any, since: float, moved: bool) -> None:
    """Let contacts that stick turn along with their bodies, or roll: rows leave out that Jacobians
    change. A call at the time of the last one, `since` 0 s, adds the same."""
    for contact in contacts_of(memory):
        if since != 0:
            known = moved and contact.dim > 1 and contact.velocity[0] < math.inf
            find_turning(model, data, memory, contact, since, known)
        rows = rows_of_contact(memory, contact)
        for axis in range(min(contact.dim, 3)):
            rows[axis].reference -= contact.turned[axis]


@kernel
def find_turning(
    model: Any, data: Any, memory: Any, contact: Any, since: float, known: bool
) -> None:
    """Find -dJ/dt v of a contact, less half of the share that a row loses of its velocity in a
    step: then friction does no work, before the turning or after it. Rigid contacts lose all, and a
    disc that precesses keeps its energy.

    Of what slides softly there is none, unless friction could end that within the contact's time:
    else that would never end on a turntable.
    """
    rigid, sticks = memory.law.rigid, contact.state == STICKS
    rows = rows_of_contact(memory, contact)
    damping = reals(data.efc_KBIP, (data.nefc, 4))[contact.address + 1, 1] if known else 0.0
    lost = 1.0 if rigid else min(model.opt.timestep * damping, 1.0)
    slip = math.hypot(rows[1].velocity, rows[2].velocity) if known else 0.0
    stops = contact.mu[0] * contact.load * rows[0].estimate
    known = known and (rigid or sticks or slip * damping < stops)
    for axis in range(3):
        contact.turned[axis] = 0.0
        if known and (axis > 0 or (rigid and sticks and contact.load > 0)):
            change = rows[axis].velocity - dot(contact.frame[axis], contact.velocity)
            contact.turned[axis] = change * (1 - lost / 2) / since
