"""Rapier in single precision."""

from __future__ import annotations

from typing import Any

import rapier3d as engine

from compare.bench.adapters.free import Free, State
from compare.bench.case import Vector
from model.arrays import Array


class Rapier(Free):
    """Substeps of projected Gauss-Seidel, contacts as stiff damped springs."""

    KNOWN = "rapier3d 0.36.1"

    def make(self) -> None:
        """As in `Free`."""
        case, body = self.case, self.case.body
        self.world = engine.PhysicsWorld(gravity=(0.0, 0.0, -case.g))
        settings = self.world.integration_parameters
        settings.dt = self.timestep
        if self.best:
            self.tune(settings)
        for surface, point, normal in self.planes():
            kind = engine.RigidBody.kinematic_velocity_based() if surface.turning else engine.RigidBody.fixed()
            shape = engine.Collider.halfspace(normal.tolist()).friction(surface.friction)
            shape = shape.friction_combine_rule(engine.CoefficientCombineRule.MULTIPLY)
            self.wall = self.world.add_body(
                kind.translation(point.tolist()).angvel((0.0, 0.0, surface.turning)), [shape]
            )
        shape = engine.Collider.ball(*body.size) if body.shape == "sphere" else engine.Collider.cuboid(*body.size)
        shape = shape.density(0.0).friction(1.0).friction_combine_rule(engine.CoefficientCombineRule.MULTIPLY)
        start = engine.RigidBody.dynamic().position(engine.Isometry3(body.position, engine.Quaternion(*body.orientation)))
        start = start.linvel(body.velocity).angvel(body.spin)
        start = start.additional_mass_properties(engine.MassProperties((0, 0, 0), body.mass, body.inertia))
        self.body = self.world.add_body(start, [shape])

    def tune(self, settings: Any) -> None:
        pass

    def advance(self) -> None:
        """As in `Free`."""
        self.world.step()

    def state(self) -> State:
        """As in `Free`."""
        body = self.world.rigid_bodies[self.body]
        return tuple([v.x, v.y, v.z] for v in (body.translation, body.linvel, body.angvel))

    def push(self, force: Vector) -> None:
        """As in `Free`."""
        body = self.world.rigid_bodies[self.body]
        body.reset_forces()
        body.add_force(force)


defaults = Rapier("rapier-defaults")
best = Rapier("rapier", "")
