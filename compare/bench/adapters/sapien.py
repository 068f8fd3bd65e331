"""PhysX as SAPIEN has it, on a processor, in single precision.

Traps: spin is limited to 100 rad/s, and damped; friction is the mean of both bodies' coefficients; the normal of a
plane is the x axis of its pose; planes don't turn.
"""

from __future__ import annotations

import math
import warnings
from typing import Any

from compare.bench.adapters.free import CHORD, CORNERS, Free, State
from compare.bench.case import Vector, upright
from model.arrays import Array

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # that no Vulkan is found: nothing is drawn
    import sapien as engine
physx = engine.physx


class Sapien(Free):
    """As in `Free`."""

    PRECISION = "f32"

    def make(self) -> None:
        case, body = self.case, self.case.body
        config, bodies = physx.PhysxSceneConfig(), physx.PhysxBodyConfig()
        config.gravity = [0.0, 0.0, -case.g]
        if self.best:
            config.enable_tgs, bodies.solver_position_iterations, bodies.solver_velocity_iterations = False, 50, 20
        physx.set_scene_config(config)
        physx.set_body_config(bodies)
        self.scene = engine.Scene([physx.PhysxCpuSystem()])
        self.scene.timestep = self.timestep
        for surface, _, point, normal in self.planes():
            if surface.turning:
                raise NotImplementedError("its planes don't turn")
            self.wall = self.add(physx.PhysxRigidStaticComponent(), pose(point, normal), 2 * surface.friction)
        self.body = physx.PhysxRigidDynamicComponent()
        self.entity = self.add(self.body, engine.Pose(body.position, body.orientation), 0.0, body.size)
        self.body.mass, self.body.inertia, self.body.cmass_local_pose = body.mass, body.inertia, engine.Pose()
        self.body.linear_damping = self.body.angular_damping = 0.0
        if self.best:
            self.body.max_angular_velocity = 1e6
        self.body.set_linear_velocity(body.velocity)
        self.body.set_angular_velocity(body.spin)

    def add(self, component: Any, pose: Any, friction: float, size: tuple[float, ...] = ()) -> Any:
        """A plane, sphere or box, which is told by how many numbers its size has."""
        kinds = {0: physx.PhysxCollisionShapePlane, 1: physx.PhysxCollisionShapeSphere, 3: physx.PhysxCollisionShapeBox}
        material = physx.PhysxMaterial(friction, friction, 0.0)
        component.attach(kinds[len(size)](*(size if len(size) == 1 else [size] * bool(size)), material))
        entity = engine.Entity()
        entity.add_component(component)
        entity.set_pose(pose)
        self.scene.add_entity(entity)
        return entity

    def advance(self) -> None:
        self.scene.step()

    def read(self) -> State:
        return self.entity.pose.p, self.body.linear_velocity, self.body.angular_velocity

    def push(self, force: Vector) -> None:
        self.body.add_force_at_point(force, self.entity.pose.p)

    def turn(self, point: Array, normal: Array) -> None:
        self.wall.set_pose(pose(point, normal))


def pose(point: Array, normal: Array) -> Any:
    """Of a plane: x is turned to z, then z to the normal."""
    (w, x, y, z), half = upright(normal), math.sqrt(0.5)
    return engine.Pose(point, [half * (w + y), half * (x + z), half * (y - w), half * (z - x)])


defaults = Sapien("sapien-defaults", f"spin is limited to 100 rad/s, and {CORNERS}")
best = Sapien(
    "sapien",
    f"worst round the cylinder: {CHORD}; and PGS has friction in two directions of their own, by which what slips "
    "obliquely is wrong by 4 % at every step",
    "PGS with 50 and 20 iterations, no limit to spin",
)
