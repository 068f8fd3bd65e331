"""A memory for friction: contacts of any MuJoCo model that stick instead of creeping.

The friction rows of a contact obey ``a + R f = -b v``, inside the friction cone. A contact that bears the steady
friction f therefore creeps at v = R f/b for ever. With the force f_last of the last step,

    a + R (f - f_last) = -b v,

the steady state has v = 0: a round of an augmented Lagrangian in each step. In mechanical terms a spring of stiffness
b/(R h) with a damper 1/(R h) stands at the contact, and a slider at the edge of the cone. MuJoCo's solver projects each
new f on the cone, so what is remembered never exceeds Coulomb's limit. What a contact that slides remembers would only
press on its normal row, so memory fades out between two and three times the cone (`_KEPT`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt
from scipy.spatial.distance import cdist

from model import InputError
from model.arrays import Array

_KEPT = 3.0
"""A contact that only more than this many times Coulomb's limit would hold keeps nothing; with one less, all."""
_ROWS = np.arange(5)
_COLUMNS = np.array([2, 4, 1, 3, 5])
"""Where forces along the tangents, and moments about normal and tangents, stand in rows (axis; force, moment)."""
_APART = 1e6
"""Distance between contacts of different pairs of geoms, m, so that none is the nearest of another pair's."""
_SPLIT = mujoco.mjtIntegrator.mjINT_EULER, mujoco.mjtIntegrator.mjINT_IMPLICIT, mujoco.mjtIntegrator.mjINT_IMPLICITFAST


class FrictionMemory:
    """Steps a simulation as `mj_step` does, with contacts that remember their friction.

    Parameters
    ----------
    model : any `mujoco.MjModel` with integrator Euler, implicit or implicitfast

    The memory belongs to one simulation: make one for each `MjData`. It takes part in the state of that, so save and
    restore both. Contacts of flexes, without friction (condim 1) or without damping of friction are left as they are.

    Raises
    ------
    InputError
        If the integrator gives no access between a step's reference accelerations and its forces.
    """

    def __init__(self, model: Any) -> None:
        self.model = model
        integrator = mujoco.mjtIntegrator(model.opt.integrator)
        if integrator not in _SPLIT:
            why = {
                mujoco.mjtIntegrator.mjINT_RK4: "solves for contact forces four times a step",
            }.get(integrator, "computes the reference accelerations anew after the place where memory enters")
            name = integrator.name.removeprefix("mjINT_")
            raise InputError(f"integrator = {name} {why}; a friction memory needs Euler, implicit or implicitfast")
        self.reset()

    def reset(self) -> None:
        """Forget all, as after `mj_resetData`."""
        self._place, self._force, self._load = np.empty((0, 7)), np.empty((0, 2, 3, 2)), np.empty(0)
        self._time = math.nan

    def state(self) -> dict[str, Array]:
        """A copy of what is remembered: place and force of each contact on both of its geoms, and its normal force."""
        return {
            "place": self._place.copy(),
            "force": self._force.copy(),
            "load": self._load.copy(),
            "time": np.array(self._time),
        }

    def restore(self, state: Mapping[str, npt.ArrayLike]) -> None:
        """Go on from a `state`."""
        self._place, self._force, self._load = (np.array(state[name], float) for name in ("place", "force", "load"))
        self._time = float(np.asarray(state["time"]))

    def step(self, data: Any, nstep: int = 1) -> None:
        """Advance by `nstep` steps.

        Raises
        ------
        InputError
            If the data belong to another model.
        """
        model = self.model
        if data.model is not model:
            raise InputError("data belong to another MjModel than this friction memory")
        if data.time != self._time:
            self.reset()
        for _ in range(nstep):
            mujoco.mj_step1(model, data)
            if data.ncon == 0:
                mujoco.mj_step2(model, data)
                self.reset()
            else:
                self._step_in_contact(data)
        self._time = data.time

    def _step_in_contact(self, data: Any) -> None:
        model, contact = self.model, data.contact
        address, dim, geom = contact.efc_address, contact.dim, contact.geom
        used = (address >= 0) & (dim > 1) & (geom[:, 0] >= 0) & (geom[:, 1] >= 0)
        used[used] = data.efc_KBIP[address[used] + 1, 1] > 0
        address, dim, geom = address[used], dim[used], geom[used]
        frame, friction = contact.frame[used].reshape(-1, 3, 3), contact.friction[used]
        axes = data.geom_xmat[geom].reshape(-1, 2, 3, 3)

        # Where contacts are on both geoms, and what they remember, as of the mean of both.
        arm = contact.pos[used][:, None] - data.geom_xpos[geom]
        place = np.empty((len(geom), 7))
        place[:, 0] = _APART * (geom[:, 0] * model.ngeom + geom[:, 1])
        place[:, 1:] = (arm[:, :, None] @ axes).reshape(-1, 6)
        remembered, load = np.zeros((len(geom), 3, 2)), np.zeros(len(geom))
        if len(self._place) and len(place):
            nearest = cdist(self._place, place, "sqeuclidean").argmin(axis=1)
            kept = self._place[:, 0] == place[nearest, 0]
            nearest = nearest[kept]
            np.add.at(remembered, nearest, (axes[nearest] @ self._force[kept]).sum(axis=1) / 2)
            np.add.at(load, nearest, self._load[kept])
        force = (frame @ remembered).reshape(-1, 6)[:, _COLUMNS]

        own = dim[:, None] - 1 > _ROWS
        softness, reference = data.efc_R, data.efc_aref
        if model.opt.cone == mujoco.mjtCone.mjCONE_ELLIPTIC:
            rows = (address[:, None] + 1 + _ROWS)[own]
            reference[rows] += softness[rows] * force[own]
        else:
            rows = (address[:, None] + 2 * _ROWS)[own]
            for side, shares in zip((0, 1), edges(force, load, friction, own), strict=True):
                reference[rows + side] += softness[rows + side] * shares[own]

        mujoco.mj_step2(model, data)
        acceleration = np.empty(data.nefc)
        mujoco.mj_mulJacVec(model, data, acceleration, data.qacc)
        holding = (reference - acceleration) / softness
        forces, asked = data.efc_force, np.zeros(force.shape)
        force = np.zeros(force.shape)
        if model.opt.cone == mujoco.mjtCone.mjCONE_ELLIPTIC:
            force[own], asked[own] = forces[rows], holding[rows]
            load = forces[address]
            share = np.sqrt(((asked / friction) ** 2).sum(axis=1))
        else:
            force[own], asked[own] = forces[rows] - forces[rows + 1], np.abs(holding[rows] - holding[rows + 1])
            force *= friction
            share = asked.sum(axis=1)
            asked[own] = forces[rows] + forces[rows + 1]
            load = asked.sum(axis=1)
        force *= np.clip(_KEPT - share / np.maximum(load, 1e-300), 0, 1)[:, None]
        along = np.zeros((len(geom), 6))
        along[:, _COLUMNS] = force
        world = frame.transpose(0, 2, 1) @ along.reshape(-1, 3, 2)
        self._place, self._force, self._load = place, axes.transpose(0, 1, 3, 2) @ world[:, None], load


def edges(force: Array, load: Array, friction: Array, own: npt.NDArray[np.bool_]) -> tuple[Array, Array]:
    """Forces of a pyramidal cone's edges, along +mu and -mu of each row, less their mean.

    Of the edge forces that give the normal force and the row forces, those nearest to their mean: pairs of opposite
    edges share the normal force evenly, but for pairs that need more to bear what is along them.

    Parameters
    ----------
    force, friction, own : row forces, their coefficients, and which rows a contact has, shape (n, 5)
    load : normal forces, (n,)
    """
    lean, count = np.where(own, force / friction, 0.0), own.sum(axis=1)[:, None]
    needed = np.abs(lean)
    lean *= np.minimum(1, load / np.maximum(needed.sum(axis=1), 1e-300))[:, None]
    needed = np.abs(lean)
    largest = -np.sort(-needed, axis=1)
    rest = (load[:, None] - np.cumsum(largest, axis=1) + largest) / np.maximum(count - _ROWS, 1)
    level = np.where(own, rest, np.inf).min(axis=1)[:, None]
    pair, mean = np.maximum(needed, level) / 2, load[:, None] / (2 * count)
    return pair + lean / 2 - mean, pair - lean / 2 - mean
