"""MuJoCo with free bodies in a case's MJCF: as it comes, with settings, or under Coulomb's law."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

import mjsim
from compare.engines.adapters.free import CORNERS, BodyState, Free, Touch
from compare.engines.adapters.scene import FACETS, Scene, Vector, facing
from model.arrays import Array

FEATURES = ("two bodies", "moving surface", "dry joint", "tripod", "disc", "anisotropic friction")
_HEAVY = 1e6  # mass of a wall that moves divided by that of the body, which it doesn't feel
_SOLIMP = 0.999
"""Impedance of dry friction in joints: an engine's own bears a share 1 - d less than it should."""
_PARTS = 16  # steps in one in which something lands
_WALL = 2.0
"""Half edges of the piece of wall that goes with the body, in radii: what rolls on a wall of the
size of the body is told from what stays where it is."""


class Bodies(Free):
    """MuJoCo as it comes, or with a function that sets options and contacts of a scene."""

    TELLS = TURNS = True
    FEATURES: tuple[str, ...] = FEATURES

    def __init__(
        self,
        name: str,
        note: str,
        best: str = "",
        tune: Callable[[Any, Scene, float], None] | None = None,
        declared: str = "",
    ) -> None:
        """`tune` is that function; `declared` is for what `best` doesn't declare."""
        super().__init__(name, note, best)
        self.tune, self.DECLARED = tune, declared or self.DECLARED

    def make(self) -> None:
        spec = mujoco.MjSpec.from_string(self.scene.mjcf(self.timestep))
        if self.tune:
            self.tune(spec, self.scene, self.timestep)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        named = {surface.name: k for k, surface in enumerate(self.scene.surfaces)}
        names = (self.model.geom(k).name.rstrip("0123456789") for k in range(self.model.ngeom))
        self.surfaces = {k: named[name] for k, name in enumerate(names) if name in named}
        mujoco.mj_resetDataKeyframe(self.model, self.data, 0)
        self.bodies = [self.data.body(name) for name in ("body", "under")[: len(self.scene.bodies)]]

    def advance(self) -> None:
        mujoco.mj_step(self.model, self.data)

    def read(self) -> BodyState:
        for update in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_comVel):
            update(self.model, self.data)
        found, rate, kind = [], np.empty(6), mujoco.mjtObj.mjOBJ_BODY
        for body in self.bodies:
            mujoco.mj_objectVelocity(self.model, self.data, kind, body.id, rate, 0)
            found += [body.xpos, rate[3:].copy(), rate[:3].copy()]
        return tuple(found)

    def push(self, force: Vector) -> None:
        self.bodies[0].xfrc_applied[:3] = force

    def touches(self) -> list[Touch]:
        shown, force, contact = [], np.empty(6), self.data.contact
        for k, (one, other) in enumerate(contact.geom.tolist()):
            mujoco.mj_contactForce(self.model, self.data, k, force)  # on the second geom
            on_second = force[:3] @ contact.frame[k].reshape(3, 3)
            shown.append(self.touch(one, other, on_second, float(contact.dist[k])))
        return shown


class Lawful(Bodies):
    """Rigid contacts under Coulomb's law; of a cylinder a piece of wall that goes with the body.

    An impact takes two steps, in which what bore a body may let go: steps are short round it."""

    FEATURES = (*FEATURES, "restitution")

    def make(self) -> None:
        super().make()
        bounce = max((surface.restitution for surface in self.scene.surfaces), default=0.0)
        self.law = mjsim.Coulomb(self.model, rigid=True, restitution=bounce)
        self.whole = self.timestep

    def step(self, n: int) -> None:
        model, data = self.model, self.data
        slow = 2 * self.whole * float(np.linalg.norm(model.opt.gravity))
        for _ in range(n):
            mujoco.mj_step1(model, data)
            contact, seen = data.contact, data.contact.efc_address >= 0
            speed, gap = data.efc_vel[contact.efc_address[seen]], contact.dist[seen]
            # Whether a contact closes in this step or by the middle of the next, where a whole one
            # would see it.
            lands = ((speed < -slow) & (gap + 1.5 * self.whole * speed < 0)).any()
            parts = _PARTS if lands else 1
            # positions are half a step ahead of velocities
            if change := (self.whole / parts - self.timestep) / 2:
                mujoco.mj_integratePos(model, data.qpos, data.qvel, change)
                self.timestep = model.opt.timestep = self.whole / parts
                self.ahead, self.now = self.ahead + change, self.now + change
                self.law.reset()
                self.seen = None
            super().step(parts)

    def advance(self) -> None:
        self.law.step(self.data)

    def turn(self, point: Array, normal: Array, velocity: Array) -> None:
        wall = self.model.body("wall")
        wall.pos, wall.quat = point, facing(normal)
        # From the opposite velocity on, so that in the middle of the step, which friction looks at,
        # it has none.
        self.data.qpos[-2:], self.data.qvel[-2:] = 0.0, (-velocity @ normal, -velocity[2])
        push = self.model.dof_M0[-2:] * 2 / self.timestep
        self.data.qfrc_applied[-2:] = push * (velocity @ normal, velocity[2])


def studied(spec: Any, scene: Scene, timestep: float) -> None:
    """Set an elliptic cone, stiff friction, and normal rows soft enough for blocks on four points.

    b_f h is a tenth, so that contacts don't hover at 2 m/s; impratio 1e4 leaves a creep of some
    micrometres a second. That needs a pair of each surface and what touches it: where there is
    none, one is added with the surface's friction."""
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio, spec.option.tolerance = 1e4, 1e-12
    there = {(pair.geomname1, pair.geomname2): pair for pair in spec.pairs}
    shapes: dict[str, list[str]] = {}
    for geom in spec.geoms:
        shapes.setdefault(geom.name.rstrip("0123456789"), []).append(geom.name)
    lowest = shapes["under" if scene.under else "body"]
    for surface in scene.surfaces:
        for geom, part in itertools.product(shapes[surface.name], lowest):
            if not (pair := there.get((geom, part))):
                pair = spec.add_pair(geomname1=geom, geomname2=part, condim=3)
                pair.friction = (surface.friction, surface.friction, 0.0, 0.0, 0.0)
            pair.solref, pair.solreffriction = (6 * timestep, 1.0), (100 * timestep, 1.0)
            pair.solimp = (0.2, 0.2, 1e-4, 0.5, 2.0)


def rigid(spec: Any, scene: Scene, timestep: float) -> None:
    """Set an elliptic cone, dry joints that stop within a step, a wall that moves."""
    spec.option.cone, spec.option.tolerance = mujoco.mjtCone.mjCONE_ELLIPTIC, 1e-12
    for joint in spec.joints:
        joint.solref_friction = (-1.0, -_SOLIMP / timestep)
        joint.solimp_friction = (_SOLIMP, _SOLIMP, 1.0, 0.5, 2.0)
    for surface in scene.surfaces:
        if not surface.radius:
            continue
        for k in range(FACETS):
            spec.delete(spec.geom(f"{surface.name}{k}"))
        spec.option.tolerance /= _HEAVY  # the engine multiplies it by the mean inertia
        own, half = spec.worldbody.add_body(name=surface.name), _WALL * scene.body.size[0]
        slide, box = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtGeom.mjGEOM_BOX
        for axis in ([-1, 0, 0], [0, 0, 1]):
            own.add_joint(type=slide, axis=axis, armature=_HEAVY * scene.body.mass)
        geom = own.add_geom(name=surface.name, type=box, size=[half] * 3, pos=[half, 0, 0])
        geom.friction, geom.mass = [surface.friction, 0.0, 0.0], 1e-9
        spec.add_exclude(bodyname1="world", bodyname2=surface.name)
        key = spec.key("start")
        key.qpos, key.qvel = [*key.qpos, 0.0, 0.0], [*key.qvel, 0.0, 0.0]


defaults = Bodies("mujoco-defaults", CORNERS)
best = Lawful(
    "mujoco",
    "of second order where bodies slide or roll, and of first where something lands",
    f"rigid contacts under Coulomb's law (mjsim.Coulomb); a step in which something lands is "
    f"divided by {_PARTS}",
    rigid,
)
