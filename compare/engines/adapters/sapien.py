"""PhysX as SAPIEN has it, on a processor, in single precision.

What friction carries it doesn't tell.

Traps: spin is limited to 100 rad/s, and damped; friction is the mean of both bodies' coefficients;
the normal of a plane is the x axis of its pose; planes don't turn."""

from __future__ import annotations

import math
import warnings
from typing import Any

from compare.engines.adapters.free import CORNERS, BodyState, Free
from compare.engines.adapters.scene import Vector, upright
from model.arrays import Array

with warnings.catch_warnings(action="ignore"):  # that no Vulkan is found: nothing is drawn
    import sapien as engine
physx = engine.physx

WALL = 3.0  # half edge of the box whose face is the wall that goes with the body, in radii


class Sapien(Free):
    """A free body in PhysX."""

    PRECISION = "f32"
    RESOLUTION = 1e-4

    def make(self) -> None:
        scene, body = self.scene, self.scene.body
        config, bodies = physx.PhysxSceneConfig(), physx.PhysxBodyConfig()
        config.gravity = [0.0, 0.0, -scene.g]
        if self.best:
            config.enable_tgs = False
            bodies.solver_position_iterations = 50
            bodies.solver_velocity_iterations = 20
        physx.set_scene_config(config)
        physx.set_body_config(bodies)
        self.world = engine.Scene([physx.PhysxCpuSystem()])
        self.world.timestep = self.timestep
        for surface, _, point, normal in self.planes():
            size: tuple[float, ...] = ()
            own = physx.PhysxRigidStaticComponent()
            if self.goes_along(surface):  # planes have no velocity
                own, size = physx.PhysxRigidDynamicComponent(), (WALL * body.size[0],) * 3
                own.kinematic, self.half = True, size[0]
            self.wall = self.add(own, pose(point, normal), 2 * surface.friction, size)
            self.face = own
        self.body = physx.PhysxRigidDynamicComponent()
        start = engine.Pose(body.position, body.orientation)
        self.entity = self.add(self.body, start, 0.0, body.size)
        self.body.mass, self.body.inertia = body.mass, body.inertia
        self.body.cmass_local_pose = engine.Pose()
        self.body.linear_damping = self.body.angular_damping = 0.0
        if self.best:
            self.body.max_angular_velocity = 1e6
        self.body.set_linear_velocity(body.velocity)
        self.body.set_angular_velocity(body.spin)

    def add(self, component: Any, pose: Any, friction: float, size: tuple[float, ...] = ()) -> Any:
        """Attach a plane, sphere or box with a friction: its size has 0, 1 or 3 numbers."""
        material = physx.PhysxMaterial(friction, friction, 0.0)
        if not size:
            component.attach(physx.PhysxCollisionShapePlane(material))
        elif len(size) == 1:
            component.attach(physx.PhysxCollisionShapeSphere(*size, material))
        else:
            component.attach(physx.PhysxCollisionShapeBox(size, material))
        entity = engine.Entity()
        entity.add_component(component)
        entity.set_pose(pose)
        self.world.add_entity(entity)
        return entity

    def read(self) -> BodyState:
        return self.entity.pose.p, self.body.linear_velocity, self.body.angular_velocity

    def push(self, force: Vector) -> None:
        self.body.add_force_at_point(force, self.entity.pose.p)

    def turn(self, point: Array, normal: Array, velocity: Array) -> None:
        begin = pose(point - self.half * normal, normal)
        self.wall.set_pose(begin)
        self.face.set_kinematic_target(engine.Pose(begin.p + self.timestep * velocity, begin.q))


def pose(point: Array, normal: Array) -> Any:
    """The pose of a plane, which has x as its normal: x is turned to z, then z to the normal."""
    (w, x, y, z), half = upright(normal), math.sqrt(0.5)
    return engine.Pose(point, [half * (w + y), half * (x + z), half * (y - w), half * (z - x)])


defaults = Sapien("sapien-defaults", f"spin is limited to 100 rad/s, and {CORNERS}")
best = Sapien(
    "sapien",
    "PGS has friction in two directions of their own, by which what slips obliquely is wrong by 4 "
    "% at every step",
    "PGS with 50 and 20 iterations, no limit to spin",
)
