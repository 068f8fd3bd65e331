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

import copy
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
WIDTH = 29
"""Numbers remembered of a contact: geoms (2), its place on both in their axes (6), friction on both in their axes (3 of
force and moment each, 12), what each pair of a pyramid's edges bears (5), normal in the axes of the first geom (3), and
gap; m, N, N m."""
SAME = 0.01
"""Share of the larger radius up to which two points of contact count as one."""


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
        near = SAME * model.geom_rbound.min(where=model.geom_rbound > 0, initial=1e9)
        for _ in range(nstep):
            mujoco.mj_step1(model, data)
            if data.time != self._time:  # another state, or one that MuJoCo has reset as it diverged
                self.reset()
            kept, used, moved = recall(model, data, self._kept, elliptic, False)
            if moved > near and put_back(model, data, self._kept):
                kept, used, _ = recall(model, data, self._kept, elliptic, True)
            if self._servo:
                self._lift = self._lifted(data, kept, used, elliptic)
            if dry := data.nf:
                joints, softness, reference = slice(data.ne, data.ne + dry), data.efc_R, data.efc_aref
                if len(self._joints) == dry:
                    reference[joints] += softness[joints] * self._joints
            begin, ncon, nefc = data.time, data.ncon, data.nefc
            mujoco.mj_step2(model, data)
            self._time = data.time
            if self._time <= begin or (data.ncon, data.nefc) != (ncon, nefc):  # reset as it diverged
                self.reset()
                continue
            retain(model, data, kept, used, elliptic)
            self._kept = kept
            if dry:
                asked = np.abs(reference - acceleration(model, data))[joints]
                share = np.clip(2 - asked / (KEPT * softness * data.efc_frictionloss)[joints], 0, 1)
                self._joints = data.efc_force[joints] * share * (data.efc_KBIP[joints, 1] > 0)

    def _lifted(self, data: Any, kept: Array, used: Array, elliptic: bool) -> Array:
        """Servo: move the distances that contacts hold, so that loaded ones come to have no depth; return them, m."""
        contact = data.contact
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


def acceleration(model: Any, data: Any) -> Array:
    """Of all rows."""
    found = np.empty(data.nefc)
    mujoco.mj_mulJacVec(model, data, found, data.qacc)
    return found


def put_back(model: Any, data: Any, before: Array) -> bool:
    """Put back points that the collider has dropped, of pairs that keep others, where bodies overlap as they did."""
    geom = before[:, :2].astype(int)
    axes = data.geom_xmat[geom].reshape(-1, 2, 3, 3)
    first, second = np.moveaxis(data.geom_xpos[geom] + (axes @ before[:, 2:8].reshape(-1, 2, 3, 1))[..., 0], 1, 0)
    normal, apart = (axes[:, 0] @ before[:, 25:28, None])[..., 0], second - first
    opened = (normal * apart).sum(axis=1)
    gap, slip = before[:, 28] + opened, np.hypot.reduce(apart - opened[:, None] * normal, axis=1)
    near, found, place = SAME * model.geom_rbound[geom].max(axis=1), data.contact.geom.copy(), data.contact.pos.copy()
    for k in np.flatnonzero((gap < 0) & (slip < near / 10)):
        others, middle = (found == geom[k]).all(axis=1), (first[k] + second[k]) / 2
        if not 0 < others.sum() < (geom == geom[k]).all(axis=1).sum():
            continue
        if (np.hypot.reduce(place[others] - middle, axis=1) > near[k]).all():
            point = copy.copy(data.contact[others.argmax()])
            across = np.cross(normal[k], np.eye(3)[abs(normal[k]).argmin()])
            across /= np.hypot.reduce(across)
            point.pos, point.dist = middle, gap[k]
            point.frame = np.concatenate([normal[k], across, np.cross(normal[k], across)])
            mujoco.mj_addContact(model, data, point)
    if data.ncon == len(found):
        return False
    for renew in (mujoco.mj_makeConstraint, mujoco.mj_island, mujoco.mj_projectConstraint, mujoco.mj_fwdVelocity):
        renew(model, data)
    return True


def recall(model: Any, data: Any, before: Array, elliptic: bool, scattered: bool) -> tuple[Array, Array, float]:
    """Add to the reference accelerations what contacts remember; return what is known of them, with no forces yet.

    Also which contacts they are, and how far they have moved on the bodies, at most, m.

    Parameters
    ----------
    before : what is remembered of the last step, (n, `WIDTH`)
    elliptic : whether cones are elliptic
    scattered : whether contacts of a pair may stand apart
    """
    contact, reference, softness = data.contact, data.efc_aref, data.efc_R
    used = np.flatnonzero((contact.efc_address >= 0) & (contact.dim > 1) & (contact.geom >= 0).all(axis=1))
    used = used[data.efc_KBIP[contact.efc_address[used] + 1, 1] > 0]
    geom, frame, friction = contact.geom[used], contact.frame[used].reshape(-1, 3, 3), contact.friction[used]
    address, axes = contact.efc_address[used], data.geom_xmat[geom].reshape(-1, 2, 3, 3)
    arm = contact.pos[used][:, None] - data.geom_xpos[geom]
    kept, world, moved = np.zeros((len(used), WIDTH)), np.zeros((len(used), 3, 2)), 0.0
    kept[:, :2], kept[:, 2:8] = geom, (arm[:, :, None] @ axes).reshape(-1, 6)
    kept[:, 25:28], kept[:, 28] = (frame[:, :1] @ axes[:, 0])[:, 0], contact.dist[used]
    pairs = np.zeros((len(used), 5))
    if len(before) and len(used):
        nearest, same = _nearest(before, kept)
        moved = np.hypot.reduce(before[same, 2:8] - kept[nearest[same], 2:8], axis=1).max(initial=0.0) / math.sqrt(2)
        nearest, forces = nearest[same], before[same, 8:20].reshape(-1, 2, 3, 2)
        np.add.at(world, nearest, (axes[nearest] @ forces).sum(axis=1) / 2)
        np.add.at(pairs, nearest, before[same, 20:25])
    force = (frame @ world).reshape(-1, 6)[:, _COLUMNS]
    own = contact.dim[used][:, None] - 1 > _ROWS
    if elliptic:
        rows = (address[:, None] + 1 + _ROWS)[own]
        reference[rows] += softness[rows] * force[own]
    else:
        rows = (address[:, None] + 2 * _ROWS)[own]
        lean = np.where(own, force / friction, 0.0)
        pairs = np.maximum(pairs, np.abs(lean))
        pairs -= pairs.sum(axis=1, keepdims=True) / own.sum(axis=1, keepdims=True)
        for side, sign in enumerate((1, -1)):
            reference[rows + side] += softness[rows + side] * ((pairs + sign * lean) / 2)[own]
    return kept, used, moved


def retain(model: Any, data: Any, kept: Array, used: Array, elliptic: bool) -> None:
    """Remember the friction that the step came to, and what pairs of edges bear."""
    contact, forces = data.contact, data.efc_force
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
    kept_share = np.clip(2 - share / np.maximum(KEPT * load, 1e-300), 0, 1)[:, None]
    along = np.zeros((len(used), 6))
    along[:, _COLUMNS] = force * kept_share
    world = contact.frame[used].reshape(-1, 3, 3).transpose(0, 2, 1) @ along.reshape(-1, 3, 2)
    axes = data.geom_xmat[contact.geom[used]].reshape(-1, 2, 3, 3).transpose(0, 1, 3, 2)
    kept[:, 8:20] = (axes @ world[:, None]).reshape(-1, 12)
    if not elliptic:
        kept[:, 20:25] = asked * kept_share


def _nearest(kept: Array, others: Array) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.bool_]]:
    """Which of the others is nearest to each contact, and whether it is of the same geoms."""
    place, others = kept[:, :8], others[:, :8]
    nearest = cdist(place * _APART, others * _APART, "sqeuclidean").argmin(axis=1)
    return nearest, (place[:, :2] == others[nearest, :2]).all(axis=1)


@functools.cache
def _kernels() -> tuple[Any, Any]:
    """`recall` and `retain`, compiled if numba is installed."""
    try:
        from mjsim import compiled_memory
    except ImportError:
        return recall, retain
    return compiled_memory.recall, compiled_memory.retain
