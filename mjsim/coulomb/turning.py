"""Bodies that turn freely: gyroscopic moments, and accelerations that turn along with them."""

from __future__ import annotations

from typing import Any

import mujoco

from .compiling import kernel
from .engine import integers, reals
from .memory import bodies_at
from .parameters import ITERATIONS
from .vectors import NONE, applied, cross, dot, plus, rotated, times_vector, vector_at

FREE, SLIDE = int(mujoco.mjtJoint.mjJNT_FREE), int(mujoco.mjtJoint.mjJNT_SLIDE)


@kernel
def turn_accelerations(model: Any, data: Any, memory: Any, elapsed: float) -> None:
    """Turn the angular accelerations of the last step, of so many seconds, along with the bodies,
    in whose axes they are."""
    types, dofs = integers(model.jnt_type, model.njnt), integers(model.jnt_dofadr, model.njnt)
    velocity = reals(data.qvel, model.nv)
    for i in range(model.njnt if memory.law.rigid else 0):
        if types[i] >= SLIDE:
            continue
        first = dofs[i] + 3 if types[i] == FREE else dofs[i]
        back = times_vector(-elapsed, vector_at(velocity, first))
        for of in (reals(data.qacc, model.nv), reals(data.qacc_warmstart, model.nv)):
            turned = rotated(vector_at(of, first), back)
            for j in range(3):
                of[first + j] = turned[j]


@kernel
def add_gyroscopic_moments(model: Any, data: Any, memory: Any, known: bool, over: bool) -> None:
    """Gyroscopic moments of free bodies by the implicit midpoint rule, with those of the last step.

    A body that turns freely keeps its energy and the size of its angular momentum; and its centre
    of mass keeps its velocity where it is not the body's origin.
    """
    bodies = bodies_at(memory.body_at, memory.free_bodies)
    for i in range(len(bodies)):
        add_moment_of(model, data, bodies[i], known, over)


@kernel
def add_moment_of(model: Any, data: Any, free: Any, known: bool, over: bool) -> None:
    """The gyroscopic moment of a free body, in its own axes, and the force on its origin."""
    bias, h = reals(data.qfrc_bias, model.nv), model.opt.timestep
    mass, inertia, axes, spin, arm = motion_of(model, data, free.body)
    momentum, pushed = applied(inertia, spin), NONE
    if known and over:
        gained = plus(momentum, -1.0, applied(axes, vector_at(free.coasting, 0)))
        pushed = rotated(gained, times_vector(-h, spin))
    elif known:
        pushed = vector_at(free.pushed, 0)
    change, after = turned_freely(inertia, momentum, spin, pushed, h)
    force, moment = of_the_origin(mass, arm, spin, after, h)
    moment = plus(plus(moment, -1 / h, change), -1.0, cross(spin, momentum))
    coasting = plus(momentum, 1.0, change)
    for j in range(3):
        column = axes[0][j], axes[1][j], axes[2][j]
        bias[free.dof + j] += force[j]
        for k in range(3):
            bias[free.dof + 3 + j] += column[k] * moment[k]
        free.pushed[j], free.coasting[j] = pushed[j], dot(column, coasting)


@kernel
def motion_of(model: Any, data: Any, b: int) -> Any:
    """Mass of a free body, its inertia about the centre of mass, its axes, spin, and the way from
    its origin to the centre of mass."""
    n = model.nbody
    of, axes, spins = reals(data.crb, (n, 10))[b], reals(data.xmat, 9 * n), reals(data.cvel, 6 * n)
    centres, origins = reals(data.subtree_com, 3 * n), reals(data.xpos, 3 * n)
    return (
        of[9],
        ((of[0], of[3], of[4]), (of[3], of[1], of[5]), (of[4], of[5], of[2])),
        (vector_at(axes, 9 * b), vector_at(axes, 9 * b + 3), vector_at(axes, 9 * b + 6)),
        vector_at(spins, 6 * b),
        plus(vector_at(centres, 3 * b), -1.0, vector_at(origins, 3 * b)),
    )


@kernel
def turned_freely(inertia: Any, momentum: Any, spin: Any, pushed: Any, h: float) -> Any:
    """Change of angular momentum in a step, without what pushes, in axes of the body, N m s.

    Implicit midpoint: with the turn of half a step, t = h/2 middle, the momentum L + p/2 + c
    there obeys c = (p/2 + L_half x t - t² L + (t L_half) t) / (1 + t²). Also the spin after it.
    """
    x, y, z = inertia
    volume, inverse = dot(x, cross(y, z)), (cross(y, z), cross(z, x), cross(x, y))
    half, middle, change = plus(momentum, 0.5, pushed), spin, pushed
    for _ in range(ITERATIONS):
        turn = times_vector(h / 2, middle)
        square = dot(turn, turn)
        change = plus(plus(cross(half, turn), 0.5, pushed), -square, momentum)
        change = times_vector(1 / (1 + square), plus(change, dot(turn, half), turn))
        last, middle = middle, plus(spin, 1 / volume, applied(inverse, change))
        moved = plus(middle, -1.0, last)
        if dot(moved, moved) <= 1e-32 * dot(middle, middle):  # soon of a body that is round
            break
    change = plus(change, 1.0, plus(change, -1.0, pushed))
    return change, plus(middle, 1.0, plus(middle, -1.0, spin))


@kernel
def of_the_origin(mass: float, arm: Any, spin: Any, after: Any, h: float) -> Any:
    """Force and moment that keep the velocity of a centre of mass which is off the origin, N, N
    m."""
    across = cross(after, arm)
    swung = plus(rotated(across, times_vector(h, after)), -1.0, across)
    force = plus(times_vector(mass / h, swung), -mass, cross(spin, cross(spin, arm)))
    return force, cross(arm, force)
