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
_STATE = "place", "force", "load", "joints", "lift", "time"
Kept = tuple[Array, Array, Array]
"""Of each contact the geoms and its place on both in their axes, (n, 8), friction force and moment on both in their
axes, (n, 2, 3, 2), and the normal force, (n,); m, N, N m."""


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
        self._kept: Kept = np.empty((0, 8)), np.empty((0, 2, 3, 2)), np.empty(0)
        self._joints, self._lift = np.empty(0), np.empty(0)
        self._time = math.nan

    def state(self) -> dict[str, Array]:
        """A copy of what is remembered: `Kept`, friction of joints, distances held by the servo, m, and the time, s."""
        values = (*self._kept, self._joints, self._lift, np.array(self._time))
        return {name: value.copy() for name, value in zip(_STATE, values, strict=True)}

    def restore(self, state: Mapping[str, npt.ArrayLike]) -> None:
        """Go on from a `state`."""
        place, force, load, self._joints, self._lift, time = (np.array(state[name], dtype=float) for name in _STATE)
        self._kept, self._time = (place, force, load), float(time)

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
        for _ in range(nstep):
            mujoco.mj_step1(model, data)
            if data.time != self._time:  # another state, or one that MuJoCo has reset as it diverged
                self.reset()
            if data.nefc:
                self._step2(data)
            else:
                mujoco.mj_step2(model, data)
                self.reset()
            self._time = data.time

    def _step2(self, data: Any) -> None:
        model, contact = self.model, data.contact
        geom, frame, dim = contact.geom, contact.frame, contact.dim
        address, friction, axes = contact.efc_address, contact.friction, data.geom_xmat
        softness, reference, elliptic = data.efc_R, data.efc_aref, model.opt.cone == _ELLIPTIC
        used, place = self._recall(
            self._kept, geom, contact.pos, frame, dim, address, friction, data.geom_xpos, axes, data.efc_KBIP,
            softness, reference, elliptic,
        )  # fmt: skip
        if self._servo:
            self._lift = self._lifted(data, used, place)
        joints = slice(data.ne, data.ne + data.nf)
        if 0 < len(self._joints) == data.nf:
            reference[joints] += softness[joints] * self._joints
        begin = data.time
        mujoco.mj_step2(model, data)
        if data.time <= begin or (data.ncon, data.nefc) != (len(dim), len(reference)):  # reset as it diverged
            self.reset()
            return
        acceleration = np.empty(data.nefc)
        mujoco.mj_mulJacVec(model, data, acceleration, data.qacc)
        if data.nf:
            share = np.abs(reference - acceleration)[joints] / (softness * data.efc_frictionloss)[joints]
            self._joints = data.efc_force[joints] * np.clip(2 - share / KEPT, 0, 1) * (data.efc_KBIP[joints, 1] > 0)
        force, load = self._retain(
            used, geom, frame, dim, address, friction, axes, softness, reference, acceleration, data.efc_force, elliptic
        )
        self._kept = place, force, load

    def _lifted(self, data: Any, used: npt.NDArray[np.intp], place: Array) -> Array:
        """Servo: move the distances that contacts hold, so that loaded ones come to have no depth; return them, m."""
        contact = data.contact
        lift: Array = np.zeros(len(place))
        if len(self._lift) and len(place):
            nearest, same = _nearest(place, self._kept[0])
            lift[same] = self._lift[nearest[same]]
        gap, margin, rows = contact.dist[used], contact.includemargin[used], contact.efc_address[used]
        lift = np.clip(lift - self.model.opt.timestep / self._servo * gap, 0, margin)
        spring = data.efc_KBIP[rows, 0] * data.efc_KBIP[rows, 2] * (margin - lift)
        spring[(lift == 0) & (gap > 0)] = _OPEN
        shared = 1 if self.model.opt.cone == _ELLIPTIC else 2 * (contact.dim[used] - 1)
        of = np.repeat(np.arange(len(used)), shared)
        data.efc_aref[rows[of] + np.arange(len(of)) - np.searchsorted(of, of)] -= spring[of]
        return lift


def recall(
    kept: Kept, geom: Array, pos: Array, frame: Array, dim: Array, address: Array, friction: Array,
    xpos: Array, xmat: Array, damping: Array, softness: Array, reference: Array, elliptic: bool,
) -> tuple[npt.NDArray[np.intp], Array]:  # fmt: skip
    """Add to the reference accelerations what contacts remember; return which have a memory, and their places.

    Parameters
    ----------
    kept : what is remembered of the last step
    geom, pos, frame, dim, address, friction : contacts, as `MjData.contact` has them
    xpos, xmat, damping, softness, reference : `geom_xpos`, `geom_xmat`, `efc_KBIP`, `efc_R`, `efc_aref`
    elliptic : whether cones are elliptic
    """
    used = np.flatnonzero((address >= 0) & (dim > 1) & (geom >= 0).all(axis=1))
    used = used[damping[address[used] + 1, 1] > 0]
    geom, frame, friction, address = geom[used], frame[used].reshape(-1, 3, 3), friction[used], address[used]
    axes = xmat[geom].reshape(-1, 2, 3, 3)
    arm = pos[used][:, None] - xpos[geom]
    place = np.concatenate([geom, (arm[:, :, None] @ axes).reshape(-1, 6)], axis=1)
    world, load = np.zeros((len(used), 3, 2)), np.zeros(len(used))
    before, forces, loads = kept
    if len(before) and len(used):
        nearest, same = _nearest(before, place)
        nearest = nearest[same]
        np.add.at(world, nearest, (axes[nearest] @ forces[same]).sum(axis=1) / 2)
        np.add.at(load, nearest, loads[same])
    force = (frame @ world).reshape(-1, 6)[:, _COLUMNS]
    own = dim[used][:, None] - 1 > _ROWS
    if elliptic:
        rows = (address[:, None] + 1 + _ROWS)[own]
        reference[rows] += softness[rows] * force[own]
    else:
        rows = (address[:, None] + 2 * _ROWS)[own]
        for side, share in enumerate(edges(force, load, friction, own)):
            reference[rows + side] += softness[rows + side] * share[own]
    return used, place


def retain(
    used: npt.NDArray[np.intp], geom: Array, frame: Array, dim: Array, address: Array, friction: Array, xmat: Array,
    softness: Array, reference: Array, acceleration: Array, forces: Array, elliptic: bool,
) -> tuple[Array, Array]:  # fmt: skip
    """Friction of contacts on both geoms in their axes, (n, 2, 3, 2), and normal forces, (n,), to remember.

    Parameters as for `recall`, and the accelerations ``J qacc`` and `efc_force` that the step came to.
    """
    address, own = address[used], dim[used][:, None] - 1 > _ROWS
    holding = (reference - acceleration) / softness
    force, asked = np.zeros(own.shape), np.zeros(own.shape)
    if elliptic:
        rows = (address[:, None] + 1 + _ROWS)[own]
        force[own], asked[own], load = forces[rows], holding[rows], forces[address]
        share = np.sqrt(((asked / friction[used]) ** 2).sum(axis=1))
    else:
        rows = (address[:, None] + 2 * _ROWS)[own]
        asked[own] = np.abs(holding[rows] - holding[rows + 1])
        share = asked.sum(axis=1)
        asked[own], force[own] = forces[rows] + forces[rows + 1], forces[rows] - forces[rows + 1]
        load = asked.sum(axis=1)
        force *= friction[used]
    along = np.zeros((len(used), 6))
    along[:, _COLUMNS] = force * np.clip(2 - share / np.maximum(KEPT * load, 1e-300), 0, 1)[:, None]
    world = frame[used].reshape(-1, 3, 3).transpose(0, 2, 1) @ along.reshape(-1, 3, 2)
    return xmat[geom[used]].reshape(-1, 2, 3, 3).transpose(0, 1, 3, 2) @ world[:, None], load


def _nearest(place: Array, others: Array) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.bool_]]:
    """Which of the others is nearest to each place, and whether it is of the same geoms."""
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
