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
INSIDE = 0.999
"""Share of the cone up to which a contact surely sticks."""
STILL = 1e-9
"""Most that contacts and bodies may move, m or rad, for what depends on their poses to stay as it is."""
WIDTH = 29
"""Numbers remembered of a contact: geoms (2), its place on both in their axes (6), friction on both in their axes (3 of
force and moment each, 12), what each pair of a pyramid's edges bears (5), normal in the axes of the first geom (3), and
gap; m, N, N m."""
CALM = 1e-5
RETURN = 1
CORNER = 1.05 * math.pi
"""Angle without other points of its patch that a corner of the patch sees at least."""
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
        self._near = SAME * model.geom_rbound.min(where=model.geom_rbound > 0, initial=1e9)
        self._kernels = _kernels()
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
        elliptic, recall, retain = model.opt.cone == _ELLIPTIC, self._kernels.recall, self._kernels.retain
        for _ in range(nstep):
            mujoco.mj_step1(model, data)
            if data.time != self._time:  # another state, or one that MuJoCo has reset as it diverged
                self.reset()
            kept, used, moved = recall(model, data, self._kept, elliptic, False)
            if moved > self._near and put_back(model, data, self._kept):
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
    """Put back points that the collider has dropped, corners of patches that have others, if still overlapping."""
    place, geom = data.contact.pos.copy(), before[:, :2].astype(int)
    pair, others = geom @ (model.ngeom, 1), data.contact.geom @ (model.ngeom, 1)
    left, had = ((pair[:, None] == each).sum(axis=1) for each in (others, pair))
    fewer = (left > 0) & (left < had)
    if not fewer.any():
        return False
    before, geom, pair = before[fewer], geom[fewer], pair[fewer]
    axes = data.geom_xmat[geom].reshape(-1, 2, 3, 3)
    first, second = np.moveaxis(data.geom_xpos[geom] + (axes @ before[:, 2:8].reshape(-1, 2, 3, 1))[..., 0], 1, 0)
    normal, apart = (axes[:, 0] @ before[:, 25:28, None])[..., 0], second - first
    opened = (normal * apart).sum(axis=1)
    gap, slip = before[:, 28] + opened, np.hypot.reduce(apart - opened[:, None] * normal, axis=1)
    near, middle = SAME * model.geom_rbound[geom].max(axis=1), (first + second) / 2
    same, away = pair[:, None] == others, place - middle[:, None]
    alone = np.where(same, (away**2).sum(axis=2), math.inf).min(axis=1) > near**2
    for k in np.flatnonzero((gap < 0) & (slip < near / 10) & alone):
        across = np.cross(normal[k], np.eye(3)[abs(normal[k]).argmin()])
        across /= np.hypot.reduce(across)
        frame = np.array([normal[k], across, np.cross(normal[k], across)])
        angles = np.sort(np.arctan2(*(frame[1:] @ away[k, same[k]].T)))
        if np.diff(angles, append=angles[0] + 2 * math.pi).max() > CORNER:
            point = copy.copy(data.contact[same[k].argmax()])
            point.pos, point.dist, point.frame = middle[k], gap[k], frame.ravel()
            mujoco.mj_addContact(model, data, point)
    if data.ncon == len(place):
        return False
    for renew in (mujoco.mj_makeConstraint, mujoco.mj_island, mujoco.mj_projectConstraint, mujoco.mj_fwdVelocity):
        renew(model, data)
    return True


class Formulas:
    """What contacts remember, by formulas on arrays. What depends on poses alone is kept while nothing moves.

    Friction of the rows of a contact is one number in each, of elliptic cones: (rows,); of a pyramid two edges bear it:
    (2, rows).
    """

    def __init__(self) -> None:
        self._kept, self._poses = np.empty((0, WIDTH)), np.empty(0)

    def recall(
        self, model: Any, data: Any, before: Array, elliptic: bool, scattered: bool
    ) -> tuple[Array, npt.NDArray[np.intp], float]:
        """Add to the reference accelerations what contacts remember; return what is known of them, with no forces yet.

        Also which contacts they are, and how far they have moved on the bodies, at most, m; 0 if no pair has fewer.

        Parameters
        ----------
        before : what is remembered of the last step, (n, `WIDTH`)
        elliptic : whether cones are elliptic
        scattered : whether contacts of a pair may stand apart
        """
        contact, moved = data.contact, 0.0
        places = contact.pos * 1e-3, contact.frame, data.geom_xpos, data.geom_xmat  # points of flush faces shift by µm
        rows = contact.geom, contact.dim, contact.efc_address, contact.friction, data.efc_KBIP[:, 1]
        poses = np.concatenate((*places, *rows), axis=None)
        then = self._poses
        if not (before is self._kept and len(poses) == len(then) and abs(poses - then).max(initial=0) < STILL):
            self._poses = poses
            self._find(data, elliptic)
            moved = self._hand_on(before)
        forces = self._forces
        if not elliptic:
            mean = np.bincount(self._of, forces.sum(axis=0), len(self._used)) / (2 * self._own.sum(axis=1))
            forces = forces - mean[self._of]
        data.efc_aref[self._rows] += data.efc_R[self._rows] * forces
        return self._kept, self._used, moved

    def _find(self, data: Any, elliptic: bool) -> None:
        """Contacts that have friction, their places, axes and rows."""
        contact = data.contact
        used = np.flatnonzero((contact.efc_address >= 0) & (contact.dim > 1) & (contact.geom >= 0).all(axis=1))
        self._used = used = used[data.efc_KBIP[contact.efc_address[used] + 1, 1] > 0]
        geom, self._address = contact.geom[used], contact.efc_address[used]
        axes = data.geom_xmat[geom].reshape(-1, 2, 3, 3).swapaxes(2, 3)
        arm = contact.pos[used][:, None] - data.geom_xpos[geom]
        turn = axes @ contact.frame[used].reshape(-1, 1, 3, 3).swapaxes(2, 3)
        self._turn = turn.reshape(-1, 6, 3)
        self._kept = np.zeros((len(used), WIDTH))
        self._kept[:, :2], self._kept[:, 2:8] = geom, (axes @ arm[..., None]).reshape(-1, 6)
        self._kept[:, 25:28], self._kept[:, 28] = self._turn[:, :3, 0], contact.dist[used]
        self._own = contact.dim[used][:, None] - 1 > _ROWS
        self._of, row = np.nonzero(self._own)
        self._place, self._friction = 6 * self._of + _COLUMNS[row], contact.friction[used][self._own]
        first = self._address[self._of]
        self._rows = first + 1 + row if elliptic else first + 2 * row + np.array([[0], [1]])

    def _hand_on(self, before: Array) -> float:
        """Give what is remembered to the contacts found; return how far they have moved where there are fewer, m."""
        moved, carried = 0.0, np.zeros((len(self._used), 17))
        if len(before) and len(self._used):
            nearest, same = _nearest(before, self._kept)
            nearest, before = nearest[same], before[same]
            if np.bincount(nearest, minlength=1).max() > 1:
                moved = np.hypot.reduce(before[:, 2:8] - self._kept[nearest, 2:8], axis=1).max() / math.sqrt(2)
            np.add.at(carried, nearest, before[:, 8:25])
        turned = self._turn.swapaxes(1, 2) @ carried[:, :12].reshape(-1, 6, 2)
        self._forces = turned.ravel()[self._place] / 2
        if self._rows.ndim == 2:
            lean = self._forces / self._friction
            self._forces = (np.maximum(carried[:, 12:][self._own], abs(lean)) + lean * np.array([[1], [-1]])) / 2
        return float(moved)

    def retain(self, model: Any, data: Any, kept: Array, used: npt.NDArray[np.intp], elliptic: bool) -> None:
        """Remember the friction that the step came to, and what pairs of edges bear."""
        of, count, forces = self._of, len(used), data.efc_force[self._rows]
        if elliptic:
            load = data.efc_force[self._address]
            sticks = np.bincount(of, (forces / self._friction) ** 2, count) <= (INSIDE * load) ** 2
        else:
            load, sticks = np.bincount(of, forces.sum(axis=0), count), forces > 0
        if not sticks.all():  # a row that isn't limited has what it asks for
            asked = ((data.efc_aref - acceleration(model, data)) / data.efc_R)[self._rows]
            if elliptic:
                asked = np.sqrt(np.bincount(of, (asked / self._friction) ** 2, count))
            else:
                asked = np.bincount(of, abs(asked[0] - asked[1]), count)
            forces *= np.clip(2 - asked / np.maximum(KEPT * load, 1e-300), 0, 1)[of]
        self._forces, along = forces, np.zeros(6 * count)
        along[self._place] = forces if elliptic else self._friction * (forces[0] - forces[1])
        kept[:, 8:20] = (self._turn @ along.reshape(-1, 3, 2)).reshape(-1, 12)
        if not elliptic:
            kept[:, 20:25][self._own] = forces.sum(axis=0)
        start = data.qacc_warmstart
        start[abs(start) < CALM] = 0.0


def _nearest(kept: Array, others: Array) -> tuple[npt.NDArray[np.intp], npt.NDArray[np.bool_]]:
    """Which of the others is nearest to each contact, and whether it is of the same geoms."""
    place, others = kept[:, :8], others[:, :8]
    nearest = cdist(place * _APART, others * _APART, "sqeuclidean").argmin(axis=1)
    return nearest, (place[:, :2] == others[nearest, :2]).all(axis=1)


def _kernels() -> Any:
    """`recall` and `retain`, compiled if numba is installed."""
    try:
        from mjsim import compiled_memory
    except ImportError:
        return Formulas()
    return compiled_memory
