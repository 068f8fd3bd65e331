"""The law as formulas on arrays, for machines without numba; `compiled` says the same in loops, in the same order.

Numbers of rows stand in arrays over all rows of friction: first those of dry joints, then those of the contacts served,
one after the other, so that `reduceat` at the first row of each contact sums over it.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np
import numpy.typing as npt

from . import law
from .law import Array

Whole = npt.NDArray[np.intp]

_BAD = slice(mujoco.mjtWarning.mjWARN_BADQPOS, mujoco.mjtWarning.mjWARN_BADQACC + 1)
_ELLIPTIC, _PGS = mujoco.mjtCone.mjCONE_ELLIPTIC, mujoco.mjtSolver.mjSOL_PGS
_DIAGONAL = "efc_diagA" if hasattr(mujoco.MjData, "efc_diagA") else "efc_diagApprox"
_TINY = 1e-300
_COLUMNS = np.array([2, 4, 1, 3, 5])
"""Where forces along the tangents, and moments about normal and tangents, stand in rows (axis; force, moment)."""


def _spans(begin: Any, length: Any) -> tuple[Whole, Whole]:
    """Of all elements of some spans, one after the other: the number of the span, and where the element stands."""
    of = np.repeat(np.arange(len(length)), length)
    return of, (begin - np.cumsum(length) + length)[of] + np.arange(len(of))


def _among(pairs: Any, wanted: Any) -> tuple[Whole, Whole, Whole]:
    """An order in which equal pairs stand together; where in it each wanted one begins, and how many it has."""
    order = np.argsort(pairs, kind="stable")
    begin, end = (np.searchsorted(pairs[order], wanted, side) for side in ("left", "right"))
    return order, begin, end - begin


def _poses(data: Any) -> Array:
    """What axes and Jacobians depend on; points of flush faces shift by µm."""
    contact = data.contact
    rows = contact.efc_address, contact.friction
    return np.concatenate((contact.pos * 1e-3, contact.frame, data.geom_xpos, data.geom_xmat, *rows), axis=None)


def _gravity(model: Any) -> float:
    """Its acceleration, m s-2; the earth's if there is none."""
    return math.hypot(*model.opt.gravity.tolist()) or 9.81


def _rotated(vectors: Array, turn: Array) -> Array:
    """Vectors turned about axes, each by an angle as long as its axis, rad; all (n, 3)."""
    angle = np.linalg.norm(turn, axis=1, keepdims=True) + _TINY
    across = np.cross(turn, vectors) / angle
    swung: Array = vectors + np.sin(angle) * across + (1 - np.cos(angle)) * np.cross(turn, across) / angle
    return swung


class Simulation:
    """What one simulation remembers."""

    def __init__(self, model: Any, numbers: law.Law) -> None:
        self._law = numbers
        self._least = numbers.near * model.geom_rbound.min(where=model.geom_rbound > 0, initial=1e9)
        self._free = law.free_bodies(model) if numbers.rigid else np.empty((0, 2), int)
        self.reset()

    def reset(self) -> None:
        self.restore(np.empty((0, law.WIDTH)), np.empty(0), np.zeros((len(self._free), 6)), np.full(2, math.nan))

    def restore(self, contacts: Array, joints: Array, spins: Array, time: Array) -> None:
        self._twist, self._coasting = np.hsplit(spins, 2)
        self._kept, self._dry, (self._moment, self._lasted) = contacts.T.copy(), joints.copy(), time.tolist()
        self._called = self._moment
        self._turned, self._pending, self._resets = True, None, b""
        self._poses, self._counts = np.empty(0), (-1, -1)
        self._memory = self._found = np.empty(0)
        self._data: Any = None

    def state(self) -> dict[str, Array]:
        if self._pending is not None:
            self.retain(None, self._pending)
        if not self._turned:  # what goes on from here does as what is restored
            self._convert(self._found)
            self._carry_on(self._data)
            self._turned, self._counts = True, (-1, -1)
        time = np.array([self._moment, self._lasted])
        spins = np.hstack((self._twist, self._coasting))
        return {"contacts": self._kept.T.copy(), "joints": self._dry.copy(), "spins": spins, "time": time}

    def serve(self, data: int) -> Simulation:
        """This, for the simulation at an address."""
        return self

    def advance(self, model: Any, data: Any, nstep: int) -> None:
        """So many steps."""
        for _ in range(nstep):
            mujoco.mj_step1(model, data)
            self.control(model, data)
            mujoco.mj_step2(model, data)
            self.retain(model, data)

    def retain(self, model: Any, data: Any) -> None:
        """Find the forces that the step came to."""
        if self._pending is not None:
            self._pending = None
            self._weigh(data)

    def control(self, model: Any, data: Any) -> None:
        """Between the reference accelerations of a step and its forces: see `law`."""
        elapsed, since = data.time - self._moment, data.time - self._called
        numbers, resets = self._law, data.warning.number[_BAD].tobytes()
        known = 0 <= elapsed <= 1.5 * self._lasted and self._resets in (resets, b"")
        over = elapsed > 0.75 * self._lasted  # not in the stages of a Runge-Kutta step, nor in a second call
        if known and over:
            self.retain(model, data)
        if over or not known:
            self._moment, self._lasted, self._resets = data.time, model.opt.timestep, resets
        self._called, self._data = data.time, data
        start, poses = data.qacc_warmstart, _poses(data)
        start[abs(start) < numbers.calm] = 0.0
        if known and over and len(self._free):  # accelerations of free bodies are in their axes, which have turned
            turning = self._free[:, 1:] + (3, 4, 5)
            back = -model.opt.timestep * data.qvel[turning]
            for accelerations in (data.qacc, start):
                accelerations[turning] = _rotated(accelerations[turning], back)
        still = known and self._still(data, poses)
        if still:
            if over:
                self._memory = self._found
            self._kept[law.GAP] = data.contact.dist[self._used]
        else:
            before = self._turn_in(data, known, over)
            self._find(model, data, poses)
            if self._hand_on(model, data, *before) > self._least and self._put_back(model, data, before[0]):
                self._find(model, data, _poses(data))
                self._hand_on(model, data, *before)
            self._copy_rows(model, data)
        if len(self._free):
            self._gyrate(model, data, known, over)
        if not len(self._rows):
            self._pending, self._found = None, self._memory
            return
        self._pending = data
        self._soft, self._reference = data.efc_R[self._rows], data.efc_aref[self._rows]
        acceleration = self._multiply(data.qacc)
        if numbers.rigid:
            self._stiffen(model, data, acceleration)
        elif numbers.servo:
            self._lift(model, data)
        if since > 0 and known and not still:
            self._turn_rows(data, since)
        self._hold()
        enough = numbers.share * _gravity(model)
        residual = acceleration - self._reference
        if self._foresee(model, data, residual, enough) or not known:
            self._solve(model, data, enough)
        elif numbers.rigid:
            self._slide_on(model, data, residual, acceleration)
        self._refer(data)

    def _solve(self, model: Any, data: Any, enough: float) -> None:
        """Solve the step until slip is as foreseen, to `enough`, m s-2."""
        mujoco.mj_fwdActuation(model, data)
        mujoco.mj_fwdAcceleration(model, data)
        last, slides = math.inf, self._law.rigid
        for _ in range(self._law.most):
            self._kept[law.GUESS] = -1.0  # what a blow does says nothing of the next step
            self._refer(data)
            mujoco.mj_fwdConstraint(model, data)
            data.qacc_warmstart[:] = data.qacc
            self._weigh(data)
            self._take_over()
            worst = self._kept[law.ERROR].max(initial=0.0)
            if worst <= 1e-6 * enough or (worst <= enough and (not self._law.rigid or worst > 0.1 * last)):
                acceleration = self._multiply(data.qacc)
                if not slides or not self._slide_on(model, data, acceleration - self._reference, acceleration):
                    break
                slides, worst = False, math.inf
            last = worst

    # -- contacts and their rows ---------------------------------------------------------------------------------------

    def _still(self, data: Any, poses: Array) -> bool:
        """Whether bodies and contacts are where their axes and Jacobians were taken last."""
        then = self._poses
        counts = len(poses), data.nf, data.nefc
        return counts == (len(then), *self._counts) and bool(abs(poses - then).max(initial=0.0) < law.STILL)

    def _turn_in(self, data: Any, known: bool, over: bool) -> tuple[Array, Array]:
        """What contacts, friction in the axes of both bodies, and dry joints bore."""
        if not self._turned and known:
            self._convert(self._found if over else self._memory)
            self._carry_on(data)
        self._turned = False
        return (self._kept, self._dry) if known else (np.empty((law.WIDTH, 0)), np.empty(0))

    def _convert(self, forces: Array) -> None:
        """Keep what rows bear as what contacts bear, friction in the axes of both bodies."""
        kept, plus, along = self._kept, self._plus, np.zeros(6 * len(self._used))
        kept[law.LOAD], self._dry = forces[self._first], forces[: self._first[0] if len(self._first) else None]
        along[self._place] = forces[plus]
        if not self._elliptic:
            kept[law.LOAD : law.FORCE].T[self._own] = forces[plus] + forces[plus + 1]
            along[self._place] = self._friction * (forces[plus] - forces[plus + 1])
        kept[law.FORCE : law.SPEED] = (self._turn @ along.reshape(-1, 3, 2)).reshape(-1, 12).T

    def _find(self, model: Any, data: Any, poses: Array) -> None:
        """Contacts, their places on both bodies and their rows."""
        contact, dry, elliptic = data.contact, data.nf, model.opt.cone == _ELLIPTIC
        self._poses, self._counts, self._elliptic = poses, (dry, data.nefc), elliptic
        used = np.flatnonzero((contact.efc_address >= 0) & (contact.geom >= 0).all(axis=1))
        if not self._law.rigid:
            used = used[contact.dim[used] > 1]
            used = used[data.efc_KBIP[contact.efc_address[used] + 1, 1] > 0]
        self._used, geom, dim = used, contact.geom[used], contact.dim[used]
        axes = data.geom_xmat[geom].reshape(-1, 2, 3, 3).swapaxes(2, 3)
        arm = contact.pos[used][:, None] - data.geom_xpos[geom]
        self._frame, self._tangents = contact.frame[used].reshape(-1, 3, 3)[:, 1:], contact.friction[used, :2].T
        self._turn = (axes @ contact.frame[used].reshape(-1, 1, 3, 3).swapaxes(2, 3)).reshape(-1, 6, 3)
        self._kept = kept = np.zeros((law.WIDTH, len(used)))
        kept[law.GEOMS : law.PLACE], kept[law.GAP], kept[law.SPEED :] = geom.T, contact.dist[used], math.inf
        kept[law.PLACE : law.NORMAL] = (axes @ arm[..., None]).reshape(-1, 6).T
        kept[law.NORMAL : law.GAP] = self._turn[:, :3, 0].T

        length = dim if elliptic else np.maximum(2 * (dim - 1), 1)
        self._length, self._first = length, dry + np.cumsum(length) - length
        self._of, rows = _spans(contact.efc_address[used], length)
        self._rows = np.append(data.ne + np.arange(dry), rows)
        self._own = dim[:, None] - 1 > np.arange(5)
        of, row = np.nonzero(self._own)  # of each direction of friction
        self._place, self._friction = 6 * of + _COLUMNS[row], contact.friction[used][self._own]
        if elliptic:
            self._plus, self._normals, self._normals_of = self._first[of] + 1 + row, self._first, np.arange(len(used))
            self._mu, self._slide = np.where(dim > 1, contact.mu[used], 1.0), np.zeros(len(self._rows))
            self._slide[self._plus] = self._friction
        else:
            self._plus, self._normals, self._normals_of = (
                self._first[of] + 2 * row,
                dry + np.arange(len(rows)),
                self._of,
            )
            self._other = np.arange(len(self._rows))
            self._other[self._plus], self._other[self._plus + 1] = self._plus + 1, self._plus

    def _hand_on(self, model: Any, data: Any, before: Array, dry: Array) -> float:
        """Give what is remembered to the nearest contact of the same geoms; how far those have moved whose pair has
        fewer, m."""
        kept, carried, moved = self._kept, np.zeros((law.SPEED - law.LOAD, len(self._used))), 0.0
        now, then = (np.array([model.ngeom, 1]) @ contacts[law.GEOMS : law.PLACE] for contacts in (kept, before))
        order, begin, count = _among(now, then)
        old, nearest = _spans(begin, count)
        nearest, place = order[nearest], slice(law.PLACE, law.NORMAL)
        square = ((kept[place, nearest] - before[place, old]) ** 2).sum(axis=0)
        square[(nearest == old) & (square < law.UNMOVED**2)] = -1.0
        best = np.lexsort((square, old))[(np.cumsum(count) - count)[count > 0]]
        best = best[np.argsort(nearest[best], kind="stable")]
        if len(best):
            (to, first), old = np.unique(nearest[best], return_index=True), old[best]
            strongest = slice(law.LIFT, law.SLIP)
            kept[strongest, to] = np.maximum.reduceat(before[strongest, old], first, axis=1)
            carried[:, to] = np.add.reduceat(before[law.LOAD : law.SPEED, old], first, axis=1)
            source, alone = before[:, old[first]], np.diff(first, append=len(best)) == 1
            geoms = source[law.GEOMS : law.PLACE].astype(int)
            turning = np.linalg.norm(data.cvel[model.geom_bodyid[geoms], :3], axis=2).max(axis=0)
            creep = np.where(source[law.STATE] == law.STICKS, np.linalg.norm(source[law.SPEED :], axis=0), 0.0)
            reach = model.opt.timestep * (self._law.fixed * turning * self._smaller(model, geoms) + creep)
            fixed = alone & (square[best][first] <= 2 * reach**2)
            kept[law.SPEED :, to] = np.where(fixed, source[law.SPEED :], math.inf)
            kept[law.MISS, to] = np.where(alone, source[law.MISS], 0.0)
            moved = math.sqrt(max(square[best].max() / 2, 0.0)) if len(to) < len(best) else 0.0
        load, friction = carried[: law.FORCE - law.LOAD].T, carried[law.FORCE - law.LOAD :].T.reshape(-1, 6, 2)
        along = (self._turn.swapaxes(1, 2) @ friction).ravel()[self._place] / 2
        self._memory = np.zeros(len(self._rows))
        if len(dry) == self._counts[0]:
            self._memory[: len(dry)] = dry
        self._memory[self._first] = load[:, 0]
        if self._elliptic:
            self._memory[self._plus] = along
        else:
            lean = along / self._friction
            pair = np.maximum(load[self._own], abs(lean))
            self._memory[self._plus], self._memory[self._plus + 1] = (pair + lean) / 2, (pair - lean) / 2
        return moved

    def _smaller(self, model: Any, geoms: Any) -> Array:
        """The smaller radius of the geoms (2, n) of contacts, m."""
        bound = model.geom_rbound[geoms]  # planes have none
        smaller: Array = np.where(bound.min(axis=0) > 0, bound.min(axis=0), bound.max(axis=0))
        return smaller

    def _put_back(self, model: Any, data: Any, before: Array) -> bool:
        """Put back points that the collider has dropped, corners of patches that have others, if still overlapping."""
        count, place, geom = data.ncon, data.contact.pos.copy(), before[law.GEOMS : law.PLACE].T.astype(int)
        pair, others = geom @ (model.ngeom, 1), data.contact.geom @ (model.ngeom, 1)
        order, begin, left = _among(others, pair)
        axes = data.geom_xmat[geom].reshape(-1, 2, 3, 3)
        arm = axes @ before[law.PLACE : law.NORMAL].T.reshape(-1, 2, 3, 1)
        first, second = np.moveaxis(data.geom_xpos[geom] + arm[..., 0], 1, 0)
        normal, apart = (axes[:, 0] @ before[law.NORMAL : law.GAP].T[..., None])[..., 0], second - first
        opened = (normal * apart).sum(axis=1)
        gap, slip = before[law.GAP] + opened, np.hypot.reduce(apart - opened[:, None] * normal, axis=1)
        near, middle = self._law.near * model.geom_rbound[geom].max(axis=1), (first + second) / 2
        fewer = (left > 0) & (left < _among(pair, pair)[2])
        for k in np.flatnonzero(fewer & (gap < 0) & (slip < near / 10)):
            same = order[begin[k] : begin[k] + left[k]]
            away = place[same] - middle[k]
            if np.hypot.reduce(away, axis=1).min() <= near[k]:
                continue
            across = np.cross(normal[k], np.eye(3)[abs(normal[k]).argmin()])
            across /= math.hypot(*across)
            frame = np.array([normal[k], across, np.cross(normal[k], across)])
            angles = np.sort(np.arctan2(*(frame[:0:-1] @ away.T)))
            if np.diff(angles, append=angles[0] + 2 * math.pi).max() > law.CORNER:
                point = copy.copy(data.contact[same[-1]])
                point.pos, point.dist, point.frame = middle[k], gap[k], frame.ravel()
                mujoco.mj_addContact(model, data, point)
        if data.ncon == count:
            return False
        for renew in (mujoco.mj_makeConstraint, mujoco.mj_island, mujoco.mj_projectConstraint, mujoco.mj_fwdVelocity):
            renew(model, data)
        return True

    def _copy_rows(self, model: Any, data: Any) -> None:
        """Keep the Jacobians: the engine's own are gone when the next step wants to know what forces there were."""
        self._limit = data.efc_frictionloss[self._rows[: self._counts[0]]]
        if mujoco.mj_isSparse(model):
            self._line, at = _spans(data.efc_J_rowadr[self._rows], data.efc_J_rownnz[self._rows])
            self._jacobian, self._columns = data.efc_J.ravel()[at], data.efc_J_colind.ravel()[at]
        else:
            self._jacobian, self._columns = data.efc_J.reshape(-1, model.nv)[self._rows], None

    # -- the law -------------------------------------------------------------------------------------------------------

    def _multiply(self, vector: Any) -> Array:
        """J times a vector, of all rows."""
        if self._columns is None:
            return np.dot(self._jacobian, vector)  # type: ignore[no-any-return]
        return np.bincount(self._line, self._jacobian * vector[self._columns], len(self._rows))  # type: ignore[return-value]

    def _tangential(self, values: Array) -> Array:
        """What rows have along the tangents of their contacts, (2, n); 0 where there is no friction."""
        rows = self._first[None] + (np.array([[1], [2]]) if self._elliptic else np.array([[0], [2]]))
        rows = np.where(self._length > 1, rows, 0)
        along = values[rows] if self._elliptic else (values[rows] - values[self._other[rows]]) / (2 * self._tangents)
        return np.where(self._length > 1, along, 0.0)

    def _carry_on(self, data: Any) -> None:
        """The velocity that the last Jacobian gives to the present speeds, along its last axes."""
        if len(self._used):
            along = self._tangential(self._multiply(data.qvel))
            self._kept[law.SPEED :] = np.einsum("tn,ntj->jn", along, self._frame)

    def _turn_rows(self, data: Any, elapsed: float) -> None:
        """Add to the reference accelerations of what is fixed on bodies that turn what the rows leave out: of soft
        contacts that stick -dJ/dt v; of rigid ones, which lose the velocity that turning shows, half of it."""
        speed, share = self._kept[law.SPEED :], 0.5 if self._law.rigid else 1.0
        turns = np.isfinite(speed[0]) & (self._length > 1)
        turns &= self._law.rigid | (self._kept[law.STATE] == law.STICKS)
        if not turns.any():
            return
        before = np.einsum("ntj,jn->tn", self._frame, np.where(turns, speed, 0.0))
        change = np.where(turns, self._tangential(self._multiply(data.qvel)) - before, 0.0) * (share / elapsed)
        for t in range(2):
            rows = self._first[turns] + (1 + t if self._elliptic else 2 * t)
            own = change[t, turns] * (1.0 if self._elliptic else self._tangents[t, turns])
            self._reference[rows] -= own
            if not self._elliptic:
                self._reference[rows + 1] += own

    def _normal(self, values: Array) -> Array:
        """Of each contact, the number of its normal, or the mean of its first pair of edges."""
        first: Array = values[self._first]
        return first if self._elliptic else (first + values[self._other[self._first]]) / 2

    def _stiffen(self, model: Any, data: Any, acceleration: Array) -> None:
        """Rows of rigid contacts: as stiff as `Law.softness`, with the velocities that Moreau and Jean's time stepping
        asks."""
        numbers, h, kept, dry = self._law, model.opt.timestep, self._kept, self._counts[0]
        gap = kept[law.GAP]
        rows, velocity, slow = self._rows[dry:], data.efc_vel[self._rows], h * _gravity(model)
        speed, fall = self._normal(velocity), h * np.maximum(-self._normal(acceleration), 0.0)
        first = self._rows[self._first]
        estimate, load = getattr(data, _DIAGONAL)[first], self._memory[self._first]
        if not self._elliptic:
            load = load + np.where(self._length > 1, self._memory[self._other[self._first]], 0.0)
        smaller = self._smaller(model, kept[law.GEOMS : law.PLACE].astype(int))
        deep = np.maximum(-gap - numbers.depth * (h / law.USUAL) ** 2 * smaller, 0.0)
        lasting, kept[law.BORE] = np.minimum(load, kept[law.BORE]), load  # not the force of a blow
        push = np.minimum(numbers.push * deep / h, np.maximum(slow, h * estimate * lasting))
        goal = np.where(gap > 0, -gap / h, push)
        blow = (gap + h * (speed - fall) < 0) & (speed < -2 * slow) & (numbers.restitution > 0)
        if blow.any():  # Euler's method keeps v²/2 + gz - hgv/2 in flight
            above = fall / h * np.maximum(gap, 0.0)
            energy = speed * (speed - fall) / 2 + above
            square = fall**2 / 4 + 2 * (numbers.restitution**2 * energy - above)
            goal[blow] = np.maximum(goal, np.sqrt(np.maximum(square, 0.0)) - fall / 2)[blow]
        self._soft[dry:] *= (numbers.softness * estimate / self._soft[self._first])[self._of]
        velocity[self._normals] -= goal[self._normals_of]
        self._reference[dry:] = -velocity[dry:] / h
        data.efc_R[rows], data.efc_D[rows] = self._soft[dry:], 1 / self._soft[dry:]
        if getattr(data, "nisland", 0):  # they have copies
            place = data.map_efc2iefc[rows]
            data.iefc_R[place], data.iefc_D[place] = self._soft[dry:], 1 / self._soft[dry:]
        if model.opt.solver == _PGS:  # it has it in its matrix
            mujoco.mj_projectConstraint(model, data)

    def _lift(self, model: Any, data: Any) -> None:
        """Servo: move the distances that contacts hold, so that loaded ones come to have no depth."""
        kept, gap, stiffness = self._kept, self._kept[law.GAP], data.efc_KBIP[self._rows[self._first]]
        margin = data.contact.includemargin[self._used]
        kept[law.LIFT] = lift = np.clip(kept[law.LIFT] - model.opt.timestep / self._law.servo * gap, 0.0, margin)
        spring = np.where((lift > 0) | (gap <= 0), stiffness[:, 0] * stiffness[:, 2] * (margin - lift), law.APART)
        self._reference[self._normals] -= spring[self._normals_of]

    def _gyrate(self, model: Any, data: Any, known: bool, over: bool) -> None:
        """Gyroscopic forces on free bodies by the implicit midpoint rule, under the moments of the step before.

        A body that turns freely keeps its energy and the size of its angular momentum; and its centre of mass keeps its
        velocity where it is not the body's origin.
        """
        (body, dof), h = self._free.T, model.opt.timestep
        mass, inertia = data.crb[body, 9:], data.crb[body][:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)
        arm, axes = data.subtree_com[body] - data.xpos[body], data.xmat[body].reshape(-1, 3, 3)
        spin = data.cvel[body, :3]
        momentum, mobility = np.einsum("nij,nj->ni", inertia, spin), np.linalg.inv(inertia)
        if not known:
            self._twist = np.zeros((len(body), 3))
        elif over:
            self._twist = _rotated(momentum - np.einsum("nij,nj->ni", axes, self._coasting), -h * spin)
        pushed, middle = momentum + self._twist / 2, spin
        for _ in range(law.ITERATIONS):
            turn = h / 2 * middle
            square, along = (turn**2).sum(1, keepdims=True), (turn * pushed).sum(1, keepdims=True)
            change = (self._twist / 2 + along * turn - np.cross(turn, pushed) - square * momentum) / (1 + square)
            middle = spin + np.einsum("nij,nj->ni", mobility, change)
        change = 2 * change - self._twist
        self._coasting = np.einsum("nij,ni->nj", axes, momentum + change)
        after = 2 * middle - spin
        across = np.cross(after, arm)
        force = mass * ((_rotated(across, h * after) - across) / h - np.cross(spin, np.cross(spin, arm)))
        moment = np.cross(arm, force) - change / h - np.cross(spin, momentum)
        data.qfrc_bias[dof[:, None] + range(6)] += np.hstack((force, np.einsum("nij,ni->nj", axes, moment)))

    def _hold(self) -> None:
        """What memory adds: of soft contacts friction, of pyramids what differs from the mean."""
        self._held = self._memory
        if not self._law.rigid:
            self._held = self._memory.copy()
            if self._elliptic:
                self._held[self._first] = 0.0
            else:
                mean = np.add.reduceat(self._memory, self._first) / self._length
                self._held[self._normals] -= mean[self._of]

    def _slip(self, values: Array) -> Array:
        """By how much slip lifts contacts in the engine's convex law, from their rows' accelerations, m s-2."""
        if self._elliptic:
            return np.sqrt(np.add.reduceat((self._slide * values) ** 2, self._first))
        return np.maximum.reduceat(abs(values - values[self._other]), self._first) / 2

    def _foresee(self, model: Any, data: Any, residual: Array, enough: float) -> bool:
        """Foresee slip from the velocities now and the accelerations of the last step; whether that is in doubt."""
        kept, rigid, slip = self._kept, self._law.rigid, self._slip(residual)
        state, much, doubt = kept[law.STATE], slip > enough, False
        stops = state == law.STICKS
        if not stops.all():
            new, closing = state <= law.OPEN, self._normal(residual) < 0
            stops |= (state == law.SLIDES) & (self._ahead(residual) >= 0)
            doubt = bool(np.where(new, closing & (rigid | much), ~stops & (kept[law.ERROR] > enough)).any())
        kept[law.GUESS] = np.where((state > law.OPEN) & ~stops, slip, -1.0)
        guessed = kept[law.GUESS] >= 0
        kept[law.SLIP] = np.where(guessed, np.maximum(slip + kept[law.MISS], 0.0), slip * ~stops)
        if not doubt and much.any():
            doubt = bool((much & stops & ~self._holds(data, residual)).any())
        if not doubt and rigid:  # forces will change by a weight
            most = np.maximum(abs(self._normal(residual)), slip * stops)
            doubt = bool(((most > _gravity(model)) & (state > law.OPEN)).any())
        return doubt

    def _slide_on(self, model: Any, data: Any, residual: Array, acceleration: Array) -> bool:
        """Friction of what slides on opposes its slip in the middle of the step, see `Law.fast`; whether anything
        does."""
        kept, h, velocity = self._kept, model.opt.timestep, data.efc_vel[self._rows]
        speed, change = (self._sizes(values) for values in (velocity, acceleration))
        fast = (kept[law.STATE] == law.SLIDES) & (kept[law.SLIP] > 0) & (speed > self._law.fast * h * change)
        if fast.any():
            slip = velocity.copy()
            slip[self._normals] -= self._normal(velocity)[self._normals_of]
            more = np.zeros(len(self._rows))
            more[self._counts[0] :] = (slip[self._counts[0] :] / h) * fast[self._of]
            self._reference = self._reference - more
            kept[law.GUESS, fast] = self._slip(residual + more)[fast]
            kept[law.SLIP, fast] = np.maximum(kept[law.GUESS, fast] + kept[law.MISS, fast], 0.0)
        return bool(fast.any())

    def _sizes(self, values: Array) -> Array:
        """Of each contact, what its rows have along all directions of friction, times its coefficients."""
        if self._elliptic:
            return self._slip(values)
        apart = np.where(self._length > 1, 1.0, 0.0)[self._of] * (values - values[self._other])[self._counts[0] :]
        return np.sqrt(np.add.reduceat(apart**2, self._first - self._counts[0]))

    def _ahead(self, residual: Array) -> Array:
        """Power of friction against slip: positive of contacts that stop."""
        if self._elliptic:
            return np.add.reduceat(self._memory * residual * (self._slide > 0), self._first)
        lean, slip = (values - values[self._other] for values in (self._memory, residual))
        return np.add.reduceat(lean * slip, self._first)

    def _holds(self, data: Any, residual: Array) -> npt.NDArray[np.bool_]:
        """Whether the forces of contacts would stay inside the cone if they alone did what accelerations lack to hold
        them."""
        lacks = residual + self._soft * (self._memory - self._held)
        forces = self._memory - lacks / (getattr(data, _DIAGONAL)[self._rows] + self._soft)
        if not self._elliptic:
            return np.minimum.reduceat(forces, self._first) >= 0
        share = np.zeros(len(forces))
        share[self._plus] = forces[self._plus] / self._friction
        load = forces[self._first]
        inside: npt.NDArray[np.bool_] = (load > 0) & (np.add.reduceat(share**2, self._first) <= load**2)
        return inside

    def _refer(self, data: Any) -> None:
        """Reference accelerations with memory, less slip in the normal direction."""
        self._target = self._reference + self._soft * self._held
        self._target[self._normals] -= self._kept[law.SLIP][self._normals_of]
        data.efc_aref[self._rows] = self._target

    def _weigh(self, data: Any) -> None:
        """Forces and slip that follow from the accelerations, and by how much what was foreseen is wrong, m s-2."""
        kept, dry, acceleration = self._kept, self._counts[0], self._multiply(data.qacc)
        residual = acceleration - self._target
        self._found = forces = -residual / self._soft
        if self._share(residual, forces):
            kept[law.STATE], kept[law.ERROR], kept[law.SEEN] = law.STICKS, kept[law.SLIP], 0.0
        else:
            state = kept[law.STATE]
            kept[law.SEEN] = self._slip(residual + self._soft * forces) * (state != law.STICKS)
            apart = (state == law.OPEN) & (self._normal(acceleration - self._reference) >= 0)
            # the slip of open contacts matters if without it they would have closed
            kept[law.ERROR] = np.where(apart, 0.0, abs(kept[law.SEEN] - kept[law.SLIP]))
        if self._law.rigid:
            guessed = (kept[law.STATE] == law.SLIDES) & (kept[law.GUESS] >= 0)
            kept[law.MISS] = np.where(guessed, (kept[law.MISS] + kept[law.SEEN] - kept[law.GUESS]) / 2, 0.0)
            missed = np.maximum.reduceat(abs(self._soft * (forces - self._memory)), self._first)
            np.maximum(kept[law.ERROR], missed, out=kept[law.ERROR])
        if dry:
            forces[:dry] = np.clip(-residual[:dry] / self._soft[:dry], -self._limit, self._limit)

    def _share(self, residual: Array, forces: Array) -> bool:
        """Limit forces of contacts, and find their states, as the engine's solver does; whether all stick."""
        first, state = self._first, self._kept[law.STATE]
        if not self._elliptic:
            np.maximum(forces, 0.0, out=forces)
            if (sticks := np.minimum.reduceat(forces, first) > 0).all():
                return True
            opened = np.maximum.reduceat(forces, first) == 0
        else:
            tangent, normal, mu = self._slip(residual), residual[first], self._mu
            if (sticks := mu * mu * normal + tangent < 0).all():
                return True
            opened = normal >= tangent
            load = np.where(opened, 0.0, (tangent - normal) / (self._soft[first] * (1 + mu * mu)))
            pull = (load / np.maximum(tangent, 1e-300))[self._of] * self._slide[-len(self._of) :] ** 2
            loose = ~sticks[self._of]
            forces[-len(loose) :][loose] = (-pull * residual[-len(loose) :])[loose]
            forces[first[~sticks]] = load[~sticks]
        state[:] = np.where(sticks, law.STICKS, np.where(opened, law.OPEN, law.SLIDES))
        return False

    def _take_over(self) -> None:
        """What was found is what is foreseen next: slip, and the forces of rigid contacts."""
        self._kept[law.SLIP] = self._kept[law.SEEN]
        if self._law.rigid:
            self._memory = np.append(self._memory[: self._counts[0]], self._found[self._counts[0] :])
            self._held = self._memory


# -- doors -------------------------------------------------------------------------------------------------------------

_simulations: dict[tuple[int, int], Any] = {}
"""By the addresses of model and data; those that are left alone, too."""


def callback(find: Callable[[int, int], Any]) -> Callable[[Any, Any], None]:
    """A control callback that asks `find` for a simulation which it sees for the first time; 0: none.

    `find` is a function of the addresses of model and data.
    """

    def serve(model: Any, data: Any) -> None:
        key = model._address, data._address
        simulation = _simulations[key] if key in _simulations else find(*key)
        if simulation:
            simulation.control(model, data)

    return serve


def remember(m: int, d: int, simulation: Any) -> None:
    """Know a simulation of the callback by its addresses."""
    _simulations[m, d] = simulation


def forget_all() -> None:
    """Ask again for every simulation of the callback."""
    _simulations.clear()
