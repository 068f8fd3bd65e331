"""What the contacts of a settled model measurably do: how fast they slip, what they bear, how they bounce."""

from __future__ import annotations

import copy
import math
from typing import Any

import mujoco
import numpy as np

from compare.bench.contact_law import MEETING, Array, Contacts
from compare.bench.settled import WINDOW_STEPS, Advance, mean_velocities


def step_to_most_contacts(model: Any, data: Any, step: Advance) -> None:
    """Advance to the moment of a window at which most pairs of geoms bear a load: what rattles comes and goes."""
    most = 0
    for _ in range(WINDOW_STEPS):
        step(model, data, 1)
        mujoco.mj_forward(model, data)
        if len(loads(model, data)) > most:
            most, best = len(loads(model, data)), copy.copy(data)
    if most:
        mujoco.mj_copyData(data, model, best)


def loads(model: Any, data: Any) -> dict[tuple[int, int], Array]:
    """What each pair of geoms bears, summed over its contacts: load, N, depth, m, number, and friction (3), N."""
    found: dict[tuple[int, int], Array] = {}
    force = np.zeros(6)
    for k, (geoms, depth) in enumerate(zip(data.contact.geom.tolist(), -data.contact.dist, strict=True)):
        mujoco.mj_contactForce(model, data, k, force)
        if force[0] > 0:
            friction = force[1:3] @ data.contact.frame[k, 3:].reshape(2, 3)
            found[tuple(geoms)] = found.get(tuple(geoms), 0) + np.array([force[0], depth, 1, *friction])
    return found


def noting_loads(step: Advance, history: list[dict[tuple[int, int], Array]]) -> Advance:
    """A law of stepping that notes what pairs of geoms bear in each step."""

    def one_by_one(model: Any, data: Any, nstep: int) -> None:
        for _ in range(nstep):
            step(model, data, 1)
            history.append(loads(model, data))

    return one_by_one


def measured_slip(model: Any, data: Any, c: Contacts, number: Array, step: Advance, time: float) -> dict[str, Array]:
    """How deep each contact is, and how fast its two bodies slip past each other and turn, in the mean of a window."""
    found = data.contact
    depth, drift, frames = -found.dist[number], found.surfacevel[number, :2], found.frame[number].reshape(-1, 3, 3)
    bodies = model.geom_bodyid[c.geoms]
    lever = found.pos[number][:, None] - data.xipos[bodies]
    velocity = mean_velocities(model, data, step, time)[bodies]
    (first, second), turning = np.moveaxis(velocity, 1, 0)[..., :3], np.diff(velocity[..., 3:], axis=1)[:, 0]
    arms = np.cross(velocity[..., 3:], lever)
    slip = np.einsum("nij,nj->ni", frames[:, 1:], second + arms[:, 1] - first - arms[:, 0]) + drift
    return {
        "depth_measured": depth,
        "creep_measured": np.where(c.dim > 1, np.hypot(*slip.T), np.nan),
        "turning_measured": np.where(c.dim > 3, np.hypot.reduce(turning, 1), np.nan),
    }


def rebound(model: Any, data: Any, c: Contacts, number: Array, speed: float) -> float:
    """Share of its speed with which a pair parts; it meets anew, without other contacts, weight or forces of joints.

    nan if normal forces alone don't end its approach.
    """
    twin, state = copy.copy(model), mujoco.MjData(model)
    mujoco.mj_copyData(state, model, data)
    mujoco.mj_forward(model, state)
    mass, bit = np.zeros((model.nv, model.nv)), mujoco.mjtDisableBit
    mujoco.mj_fullM(model, state, mass)
    approach = c.approach()
    if np.isnan(approach).any():
        return math.nan
    way = np.linalg.solve(np.linalg.cholesky(mass).T, approach)
    for name in ("GRAVITY", "SPRING", "DAMPER", "ACTUATION", "FRICTIONLOSS", "LIMIT", "EQUALITY"):
        twin.opt.disableflags |= getattr(bit, f"mjDSBL_{name}")
    others = ~np.isin(np.arange(model.ngeom), c.geoms[0])
    for kind, which in (("geom", others), ("flex", slice(None))):
        for mask in ("contype", "conaffinity"):
            getattr(twin, f"{kind}_{mask}")[which] = 0
    explicit = np.column_stack([twin.pair_geom1, twin.pair_geom2])
    twin.pair_margin[~np.isin(explicit, c.geoms[0]).all(1)] = -1e3
    gap = float(np.mean(state.contact.dist[number] - c.margin))
    mujoco.mj_integratePos(model, state.qpos, way, -gap - model.opt.timestep * speed / 2)
    state.qvel[:], state.qfrc_applied[:], state.xfrc_applied[:] = -speed * way, 0, 0
    for _ in range(round(MEETING / model.opt.timestep)):
        mujoco.mj_step(twin, state)
        if not (state.nefc and state.efc_force.any()):
            break
    return float(way @ mass @ state.qvel) / float(approach @ approach) / speed
