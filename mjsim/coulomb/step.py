"""The law of a step, between MuJoCo's velocities and its solver."""

from __future__ import annotations

import math
from typing import Any

from . import contacts, edges, friction, patches, rigid, rows, turning
from .compiling import kernel
from .engine import datas, mj_fwdAcceleration, mj_fwdActuation, mj_fwdConstraint, models, reals
from .memory import contacts_of, memories, rows_of, rows_of_contact
from .newton import solve_contacts
from .parameters import EARTH, NEXT, OVER, R_LEAST
from .vectors import dot


@kernel
def law_of_a_step(at: int) -> None:
    """Apply Coulomb's law, by the memory at an address: velocities are known, and MuJoCo hasn't
    found the forces yet.

    Rows ask for a step without slip and approach at its end (Moreau), and hold what was borne
    before; normal ones are shifted by the slip times mu (De Saxcé), for which MuJoCo's cone is
    Coulomb's. Slip is predicted from the last step's; where that is in doubt, it is solved for.
    """
    memory = memories(at, 1)[0]
    model, data = models(memory.model, 1)[0], datas(memory.data, 1)[0]
    rows.put_rows_back(data, memory)
    rigid.take_dampers_away(model, data, memory)
    if memory.law.kinetic < 1:
        friction.strengthen(data, memory)
    known, over, since = begin(model, data, memory)
    if data.ncon == 0 and not memory.law.rigid:  # nothing touches: all is MuJoCo's own
        forget_contacts(memory)
        return
    memory.gravity = size_of_gravity(model)
    memory.enough = memory.law.share * memory.gravity
    if memory.law.rigid:
        rigid.add_dampers(model, data, memory)
    moved = not known or not contacts.nothing_moved(model, data, memory)
    update_contacts(model, data, memory, known, over, moved)
    if memory.free_bodies:
        turning.add_gyroscopic_moments(model, data, memory, known, over)
    memory.pending = memory.contacts + memory.dry > 0
    if not memory.pending:
        return
    find_references(model, data, memory, since, moved)
    if friction.predict_slip(model, data, memory) or not known:
        solve(model, data, memory, known)
    elif memory.law.rigid:
        rigid.oppose_slip_at_mid_step(model, memory)
    if memory.law.rigid:
        rigid.write_regularisation(data, memory)
    rows.write_references(data, memory)


@kernel
def update_contacts(
    model: Any, data: Any, memory: Any, known: bool, over: bool, moved: bool
) -> None:
    """Find the contacts and rows of the step; they remember what those before bore."""
    if over:
        keep_forces(memory)
    if not moved:
        contacts.read_gaps(data, memory)
        return
    hand_on(model, data, memory, known)
    added = 0
    if contacts.find(model, data, memory) > memory.least:
        added += patches.put_points_back(model, data, memory)
    if memory.law.rigid:
        added += patches.add_points_below(model, data, memory)
    if added:
        patches.make_rows_anew(memory)
    if added or patches.leave_added_points_out(model, data, memory):
        contacts.find(model, data, memory)
    if edges.leave_inner_edges_out(model, data, memory):
        contacts.find(model, data, memory)
    contacts.copy_jacobians(model, data, memory)
    rows.find_surfaces(model, data, memory)
    contacts.remember_forces(memory)


@kernel
def find_references(model: Any, data: Any, memory: Any, since: float, moved: bool) -> None:
    """Find what rows ask for: MuJoCo's references, mended."""
    rows.read_rows(data, memory)
    if memory.law.rigid:
        rigid.stiffen(model, data, memory)
    elif memory.law.servo:
        rigid.take_depth_away(model, data, memory)
    rows.add_turning(model, data, memory, since, moved)
    if memory.law.kinetic < 1:
        friction.weaken(model, data, memory)
    if memory.law.rigid:
        rigid.share_loads(model, memory)


@kernel
def begin(model: Any, data: Any, memory: Any) -> Any:
    """Whether the last step is known; whether it is over; the time since the last call, s.

    Stages of Runge and Kutta, and `mj_forward`, are calls within a step, which know what it knew as
    it began. A jump of time, as MuJoCo makes it where it resets bad states, ends what is known.
    """
    elapsed, since = data.time - memory.time, data.time - memory.called
    known = 0 <= elapsed <= NEXT * memory.timestep
    over = elapsed > OVER * memory.timestep
    if known and over:
        conclude(model, data, memory)
    if over or not known:
        memory.time, memory.timestep = data.time, model.opt.timestep
        memory.known = known
    known = memory.known != 0
    memory.called = data.time
    start, last = reals(data.qacc_warmstart, model.nv), reals(data.qacc, model.nv)
    touched = memory.law.rigid or data.ncon > 0
    for i in range(model.nv if touched else 0):
        if memory.ncon < 0 or not known:  # of a state that is set MuJoCo keeps qacc_warmstart alone
            last[i] = start[i]
        if abs(start[i]) < memory.law.calm:
            start[i] = 0.0
    if known and over:
        turning.turn_accelerations(model, data, memory, elapsed)
    return known, over, since


@kernel
def forget_contacts(memory: Any) -> None:
    """Forget all contacts."""
    memory.contacts, memory.rows, memory.dry, memory.ncon = 0, 0, 0, 0
    memory.pending, memory.stored = 0, 0


@kernel
def conclude(model: Any, data: Any, memory: Any) -> None:
    """Find the contact forces with which a step has ended, if that wasn't done."""
    if memory.pending:
        memory.pending = 0
        friction.find_forces(model, data, memory)


@kernel
def keep_forces(memory: Any) -> None:
    """Let rows remember the forces of a step that is over."""
    for row in rows_of(memory):
        row.remembered = row.force


@kernel
def hand_on(model: Any, data: Any, memory: Any, known: bool) -> None:
    """Make the contacts of the last step, with what they bore, those before."""
    if known and not memory.stored:
        store(model, data, memory)
    memory.stored = 0
    memory.contacts_before, memory.dry_before = 0, 0
    if known:
        memory.contact_at, memory.before_at = memory.before_at, memory.contact_at
        memory.contacts_before, memory.dry_before = memory.contacts, memory.dry


@kernel
def store(model: Any, data: Any, memory: Any) -> None:
    """Store forces in the axes of bodies, and how contacts part and slip."""
    friction.store_forces(memory)
    rows.store_velocities(model, data, memory)


@kernel
def size_of_gravity(model: Any) -> float:
    """The size of gravity, m s-2; the earth's if there is none."""
    gravity = model.opt.gravity
    return math.sqrt(dot(gravity, gravity)) or EARTH


@kernel
def solve(model: Any, data: Any, memory: Any, known: bool) -> None:
    """Solve the step, until contacts slip as predicted.

    Newton's method does so of rigid contacts. Where it comes to no end, and of soft contacts,
    MuJoCo solves for the slip that it found last.
    """
    start = reals(data.qacc_warmstart, model.nv)
    mj_fwdActuation(memory.model, memory.data)
    mj_fwdAcceleration(memory.model, memory.data)
    memory.solves += 1
    solved = False
    if memory.law.rigid:
        if not known:  # loads that contacts can bear in many ways are shared as MuJoCo has it
            iterate(model, data, memory, start)
        solved = solve_rigid(model, data, memory, start, known)
    if not solved:
        solved = iterate(model, data, memory, start)
    memory.unsolved += not solved


@kernel
def solve_rigid(model: Any, data: Any, memory: Any, start: Any, known: bool) -> bool:
    """Find slip and forces by Newton's method, in islands where a contact is in doubt; friction at
    mid step asks for a solution more, once it is known what slips."""
    for contact in contacts_of(memory):
        contact.solved, contact.due = 0, contact.due or not known
    solved = solve_contacts(model, data, memory, start, 1.0)
    rows.find_residuals(memory, start, False)
    if rigid.oppose_slip_at_mid_step(model, memory):
        for contact in contacts_of(memory):
            contact.due = contact.solved
        solved &= solve_contacts(model, data, memory, start, R_LEAST)
    friction.extrapolate_slip(model, data, memory)
    return bool(solved)


@kernel
def iterate(model: Any, data: Any, memory: Any, start: Any) -> bool:
    """Let MuJoCo solve for the slip that was found last, until it is found again; rigid contacts
    hold the forces that were."""
    acceleration = reals(data.qacc, model.nv)
    if memory.law.rigid:
        rigid.write_regularisation(data, memory)
    for _ in range(memory.law.most):
        rows.write_references(data, memory)
        mj_fwdConstraint(memory.model, memory.data)
        for i in range(model.nv):
            start[i] = acceleration[i]
        worst = friction.find_forces(model, data, memory)
        for contact in contacts_of(memory):
            contact.extrapolated = -1.0
            if memory.law.rigid:
                rows.hold(rows_of_contact(memory, contact))
        if worst <= memory.enough:
            return True
    return False
