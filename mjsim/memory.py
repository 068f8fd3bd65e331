"""A memory for friction: contacts of any MuJoCo model that stick instead of creeping.

The friction rows of a contact obey ``a + R f = -b v``, inside the friction cone. A contact that bears the steady
friction f therefore creeps at v = R f/b for ever. With the force f_last of the last step,

    a + R (f - f_last) = -b v,

the steady state has v = 0: a round of an augmented Lagrangian in each step. In mechanical terms a spring of stiffness
b/(R h) with a damper 1/(R h) stands at the contact, and a slider at the edge of the cone. MuJoCo's solver projects each
new f on the cone, so what is remembered never exceeds Coulomb's limit. What a contact that slides remembers would only
press on its normal row, so memory fades out where ten to twenty times the cone would be needed to hold it (`KEPT`).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt
from scipy.spatial.distance import cdist

from model import InputError
from model.arrays import Array
from model.parameters import Range, check_number

KEPT = 10.0
"""Times Coulomb's limit that may be needed to hold a contact which keeps all; with twice as much it keeps nothing."""
_ROWS = np.arange(5)
_COLUMNS = np.array([2, 4, 1, 3, 5])
"""Where forces along the tangents, and moments about normal and tangents, stand in rows (axis; force, moment)."""
_APART = np.array([1e6, 1e6, 1, 1, 1, 1, 1, 1])
"""Keeps contacts of different geoms apart, m."""
_OPEN = 1e9
"""Approach that a contact allows which is open, m s-2."""
_ELLIPTIC = int(mujoco.mjtCone.mjCONE_ELLIPTIC)
WIDTH = 21
"""Numbers remembered of a contact: geoms (2), its place on both in their axes (6), friction on both in their axes (3 of
force and moment each, 12), normal force; m, N, N m."""


class FrictionMemory:
    """Steps a simulation as `mj_step` does, with contacts that remember their friction.

    Parameters
    ----------
    model : any `mujoco.MjModel` with integrator Euler, implicit or implicitfast
    servo : time in which contacts with friction lose their depth, s; None: they sink in as MuJoCo has them. It needs
        geoms with a `margin`, more than bodies sink in, of which an open contact then takes no notice; and it must be
        slower than the contact, best five times the time constant of `solref`.

    The memory belongs to one simulation: make one for each `MjData`. It takes part in the state of that, so save and
    restore both. Joints and tendons with `frictionloss` hold as well. Contacts of flexes, and those without friction
    (condim 1) or without damping of friction, are left as they are.

    Raises
    ------
    InputError
        If the integrator gives no access between a step's reference accelerations and its forces, or the servo is
        faster than a step.
    """

    def __init__(self, model: Any, servo: float | None = None) -> None:
        self.model, self._servo = model, servo
        if servo is not None:
            check_number("servo", servo, "s", Range(float(model.opt.timestep)), "to be no faster than a step it")
        self._check_integrator()
        self._recall, self._retain = _kernels()
        self.reset()

    def _check_integrator(self) -> None:
        name = mujoco.mjtIntegrator(self.model.opt.integrator).name.removeprefix("mjINT_")
        if name not in ("EULER", "IMPLICIT", "IMPLICITFAST"):
            anew = "computes the reference accelerations anew after the place where memory enters"
            why = "solves for contact forces four times a step" if name == "RK4" else anew
            raise InputError(f"integrator = {name} {why}; a friction memory needs Euler, implicit or implicitfast")

    def reset(self) -> None:
        """Forget all, as after `mj_resetData`."""
        self._kept = np.empty((0, WIDTH))
        self._joints, self._lift = np.empty(0), np.empty(0)
        self._time = math.nan

    def state(self) -> dict[str, Array]:
        """A copy of what is remembered: contacts, (n, `WIDTH`), friction of joints, distances held by the servo, m, and
        the time, s."""
        values = {"contacts": self._kept, "joints": self._joints, "lift": self._lift, "time": np.array(self._time)}
        return {name: value.copy() for name, value in values.items()}

    def restore(self, state: Mapping[str, npt.ArrayLike]) -> None:
        """Go on from a `state`."""
        self._kept, self._joints, self._lift = (np.array(state[name], float) for name in ("contacts", "joints", "lift"))
        self._time = float(np.asarray(state["time"]))

    def step(self, data: Any, nstep: int = 1) -> None:
        """Advance by `nstep` steps.

        Raises
        ------
        InputError
            If the data belong to another model, or its integrator was changed to one that is refused.
        """
        model = self.model
        if data.model is not model:
            raise InputError("data belong to another MjModel than this friction memory")
        self._check_integrator()
        elliptic, recall, retain = model.opt.cone == _ELLIPTIC, self._recall, self._retain
        for _ in range(nstep):
            mujoco.mj_step1(model, data)
            begin, ncon, nefc = data.time, data.ncon, data.nefc
            if begin != self._time:  # another state, or one that MuJoCo has reset as it diverged
                self.reset()
            kept = recall(model, data, self._kept, elliptic)
            if self._servo:
                self._lift = self._lifted(data, kept, elliptic)
            if dry := data.nf:
                joints, softness, reference = slice(data.ne, data.ne + dry), data.efc_R, data.efc_aref
                if len(self._joints) == dry:
                    reference[joints] += softness[joints] * self._joints
            mujoco.mj_step2(model, data)
            self._time = data.time
            if self._time <= begin or (data.ncon, data.nefc) != (ncon, nefc):  # reset as it diverged
                self.reset()
                continue
            retain(model, data, kept, elliptic)
            self._kept = kept
            if dry:
                asked = np.abs(reference - acceleration(model, data))[joints]
                share = np.clip(2 - asked / (KEPT * softness * data.efc_frictionloss)[joints], 0, 1)
                self._joints = data.efc_force[joints] * share * (data.efc_KBIP[joints, 1] > 0)

    def _lifted(self, data: Any, kept: Array, elliptic: bool) -> Array:
        """Servo: move the distances that contacts hold, so that loaded ones come to have no depth; return them, m."""
        contact, used = data.contact, remembering(data)
        lift: Array = np.zeros(len(kept))
        if len(self._lift) and len(kept):
            nearest, same = _nearest(kept, self._kept)
            lift[same] = self._lift[nearest[same]]
        gap, margin, rows = contact.dist[used], contact.includemargin[used], contact.efc_address[used]
        lift = np.clip(lift - self.model.opt.timestep / self._servo * gap, 0, margin)
        spring = data.efc_KBIP[rows, 0] * data.efc_KBIP[rows, 2] * (margin - lift)
        spring[(lift == 0) & (gap > 0)] = _OPEN
        of = np.repeat(np.arange(len(used)), 1 if elliptic else 2 * (contact.dim[used] - 1))
        data.efc_aref[rows[of] + np.arange(len(of)) - np.searchsorted(of, of)] -= spring[of]
        return lift


def remembering(data: Any) -> npt.NDArray[np.intp]:
    """Which contacts have a memory: those of geoms, with friction that is damped."""
    contact = data.contact
    used = np.flatnonzero((contact.efc_address >= 0) & (contact.dim > 1) & (contact.geom >= 0).all(axis=1))
    damped: npt.NDArray[np.bool_] = data.efc_KBIP[contact.efc_address[used] + 1, 1] > 0
    return used[damped]


def acceleration(model: Any, data: Any) -> Array:
    """Of all rows."""
    found = np.empty(data.nefc)
    mujoco.mj_mulJacVec(model, data, found, data.qacc)
    return found


def recall(model: Any, data: Any, before: Array, elliptic: bool) -> Array:
    """Add to the reference accelerations what contacts remember; return their geoms and places, and no forces yet.

    Parameters
    ----------
    before : what is remembered of the last step, (n, `WIDTH`)
    elliptic : whether cones are elliptic
    """
    contact, used, reference, softness = data.contact, remembering(data), data.efc_aref, data.efc_R
    geom, frame, friction = contact.geom[used], contact.frame[used].reshape(-1, 3, 3), contact.friction[used]
    address, axes = contact.efc_address[used], data.geom_xmat[geom].reshape(-1, 2, 3, 3)
    arm = contact.pos[used][:, None] - data.geom_xpos[geom]
    kept, world = np.zeros((len(used), WIDTH)), np.zeros((len(used), 3, 2))
    kept[:, :2], kept[:, 2:8] = geom, (arm[:, :, None] @ axes).reshape(-1, 6)
    load = np.zeros(len(used))
    if len(before) and len(used):
        nearest, same = _nearest(before, kept)
        nearest, forces = nearest[same], before[same, 8:20].reshape(-1, 2, 3, 2)
        np.add.at(world, nearest, (axes[nearest] @ forces).sum(axis=1) / 2)
        np.add.at(load, nearest, before[same, 20])
    force = (frame @ world).reshape(-1, 6)[:, _COLUMNS]
    own = contact.dim[used][:, None] - 1 > _ROWS
    if elliptic:
        rows = (address[:, None] + 1 + _ROWS)[own]
        reference[rows] += softness[rows] * force[own]
    else:
        rows = (address[:, None] + 2 * _ROWS)[own]
        for side, share in enumerate(edges(force, load, friction, own)):
            reference[rows + side] += softness[rows + side] * share[own]
    return kept


def retain(model: Any, data: Any, kept: Array, elliptic: bool) -> None:
    """Remember friction of contacts on both geoms in their axes, and normal forces, that the step came to."""
    contact, forces, used = data.contact, data.efc_force, remembering(data)
    address, friction, own = contact.efc_address[used], contact.friction[used], contact.dim[used][:, None] - 1 > _ROWS
    holding = (data.efc_aref - acceleration(model, data)) / data.efc_R
    force, asked = np.zeros(own.shape), np.zeros(own.shape)
    if elliptic:
        rows = (address[:, None] + 1 + _ROWS)[own]
        force[own], asked[own], load = forces[rows], holding[rows], forces[address]
        share = np.sqrt(((asked / friction) ** 2).sum(axis=1))
    else:
        rows = (address[:, None] + 2 * _ROWS)[own]
        asked[own] = np.abs(holding[rows] - holding[rows + 1])
        share = asked.sum(axis=1)
        asked[own], force[own] = forces[rows] + forces[rows + 1], forces[rows] - forces[rows + 1]
        load = asked.sum(axis=1)
        force *= friction
    along = np.zeros((len(used), 6))
    along[:, _COLUMNS] = force * np.clip(2 - share / np.maximum(KEPT * load, 1e-300), 0, 1)[:, None]
    world = contact.frame[used].reshape(-1, 3, 3).transpose(0, 2, 1) @ along.reshape(-1, 3, 2)
    axes = data.geom_xmat[contact.geom[used]].reshape(-1, 2, 3, 3).transpose(0, 1, 3, 2)
    kept[:, 8:20], kept[:, 20] = (axes @ world[:, None]).reshape(-1, 12), load


def _nearest(kept: Array, others: Array) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.bool_]]:
    """Which of the others is nearest to each contact, and whether it is of the same geoms."""
    place, others = kept[:, :8], others[:, :8]
    nearest = cdist(place * _APART, others * _APART, "sqeuclidean").argmin(axis=1)
    return nearest, (place[:, :2] == others[nearest, :2]).all(axis=1)


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


@functools.cache
def _kernels() -> tuple[Any, Any]:
    """`recall` and `retain`, compiled if numba is installed."""
    try:
        from mjsim import compiled_memory
    except ImportError:
        return recall, retain
    return compiled_memory.recall, compiled_memory.retain
