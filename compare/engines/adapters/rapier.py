"""Rapier: projected Gauss-Seidel in substeps, contacts as overdamped springs, single precision.

Along which directions friction acts it doesn't tell.

Traps: it expects things the size of a metre, and clamps speeds at 400 times `length_unit`; contacts
are kept while the bodies move less than `normalized_contact_recycle_distance`, also where a wall
was moved; quaternions begin with the scalar; with `FrictionModel.COULOMB` a block on a plane has
hardly any friction."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import rapier3d as engine

from compare.engines.adapters.free import CORNERS, BodyState, Free
from compare.engines.adapters.scene import Scene, Vector, facing
from model.arrays import Array


class Rapier(Free):
    """A free body in Rapier."""

    PRECISION, TURNS = "f32", True
    FEATURES = ("two bodies", "moving surface", "restitution", "tripod", "disc")
    RESOLUTION = 1e-4
    SMALL = 16  # small steps in one, in the best settings: the engine's own, unless a wall moves

    def build(self, scene: Scene, timestep: float) -> None:
        self.small = self.SMALL if self.best and scene.in_cylinder else 1
        self.AHEAD = 0.5 if self.small > 1 else 0.5 / self.SMALL
        super().build(scene, timestep / self.small)

    def step(self, n: int) -> None:
        super().step(n * self.small)

    def make(self) -> None:
        scene = self.scene
        self.world = engine.PhysicsWorld(gravity=(0.0, 0.0, -scene.g))
        settings = self.world.integration_parameters
        multiply = engine.CoefficientCombineRule.MULTIPLY
        settings.dt = self.timestep
        if self.best:
            settings.contact_recycling = False
            settings.num_solver_iterations = self.SMALL // self.small
            # what contacts carried before a landing throws the body off the wall after it
            if self.small > 1:
                settings.num_internal_pgs_iterations, settings.warmstart_coefficient = 20, 0.0
            settings.length_unit, settings.normalized_max_linear_velocity = 0.01, 1e6
            springs = engine.SpringCoefficients(200.0, 10.0)
            settings.contact_softness = settings.static_contact_softness = springs
        for surface, _, point, normal in self.planes():
            moves = surface.turning or any(surface.velocity) or self.goes_along(surface)
            if self.goes_along(surface):
                point, normal = np.zeros(3), np.array([-1.0, 0.0, 0.0])
            kinds = engine.RigidBody
            own = (kinds.kinematic_velocity_based if moves else kinds.fixed)()
            own = own.translation(point.tolist()).angvel((0.0, 0.0, surface.turning))
            own = own.linvel(surface.velocity)
            shape = engine.Collider.halfspace(normal.tolist())
            shape = shape.friction(surface.friction / (scene.between or 1.0))
            shape = shape.friction_combine_rule(multiply).restitution(surface.restitution)
            self.wall = self.world.add_body(own, [shape])  # the last one is the one that moves
        self.bodies = []
        for body, friction in zip(scene.bodies, (1.0, scene.between), strict=False):
            shapes: list[Any] = []
            for at in body.parts.tolist():
                if body.shape == "disc":  # its axis is y
                    shape = engine.Collider.cylinder(*body.size[::-1])
                    shape = shape.rotation((math.pi / 2, 0.0, 0.0))
                elif body.shape == "box":
                    shape = engine.Collider.cuboid(*body.size)
                else:
                    shape = engine.Collider.ball(body.size[0])
                shape = shape.translation(at).density(0.0)
                shape = shape.friction(friction).friction_combine_rule(multiply)
                shapes.append(shape.restitution(1.0).restitution_combine_rule(multiply))
            start = engine.Isometry3(body.position, engine.Quaternion(*body.orientation))
            mass = engine.MassProperties((0, 0, 0), body.mass, body.inertia)
            own = engine.RigidBody.dynamic().position(start).additional_mass_properties(mass)
            own = own.linvel(body.velocity).angvel(body.spin)
            self.bodies.append(self.world.add_body(own, shapes))

    def read(self) -> BodyState:
        own = (self.world.rigid_bodies[body] for body in self.bodies)
        parts = (v for body in own for v in (body.translation, body.linvel, body.angvel))
        return tuple([v.x, v.y, v.z] for v in parts)

    def push(self, force: Vector) -> None:
        body = self.world.rigid_bodies[self.bodies[0]]
        body.reset_forces()
        body.add_force(force)

    def turn(self, point: Array, normal: Array, velocity: Array) -> None:
        wall = self.world.rigid_bodies[self.wall]
        wall.position = engine.Isometry3(point.tolist(), engine.Quaternion(*facing(normal)))
        wall.linvel = velocity.tolist()


defaults = Rapier("rapier-defaults", CORNERS)
best = Rapier(
    "rapier",
    "a body that lands overlaps by up to a step's way, and its spring throws it back",
    "16 small steps in one, springs of 200 Hz, a length unit of 1 cm, no limit to speed",
)
