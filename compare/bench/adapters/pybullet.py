"""PyBullet with a free body, in double precision; its traps: see `compare.kit.adapters.pybullet`.

One more: where a length unit is so small that things move by 0.4 of it in a step, friction is gone.
"""

from __future__ import annotations

from typing import Any

import pybullet as engine

from compare.bench.adapters.free import CHORD, Free, State, upright
from compare.bench.adapters.simulators import Simulated
from compare.bench.case import Vector
from model.arrays import Array


class PyBullet(Free):
    """As in `Free`."""

    NOTE = (
        "as it comes worst with a ball in facets, whose every corner takes away some of its speed; set well of first "
        f"order, and worst round the cylinder: {CHORD}"
    )

    def make(self) -> None:
        case, body = self.case, self.case.body
        if engine.isConnected():
            engine.disconnect()
        engine.connect(engine.DIRECT)
        self.scale = 10.0 if self.best else 1.0
        engine.setPhysicsEngineParameter(fixedTimeStep=self.timestep)
        if self.best:
            engine.setPhysicsEngineParameter(
                numSolverIterations=200,
                solverResidualThreshold=1e-24,
                enableConeFriction=1,
                contactSlop=0.0,
                contactBreakingThreshold=0.2,
            )
        engine.setGravity(0, 0, -case.g * self.scale)
        for surface, point, normal in self.planes():
            if surface.turning:
                raise NotImplementedError("its planes don't turn")
            shape = engine.createCollisionShape(engine.GEOM_PLANE, planeNormal=[0, 0, 1])
            self.wall = engine.createMultiBody(0, shape)
            self.place(self.wall, point, upright(normal))
            engine.changeDynamics(self.wall, -1, lateralFriction=surface.friction, restitution=0)
        size = [each * self.scale for each in body.size]
        if body.shape == "sphere":
            shape = engine.createCollisionShape(engine.GEOM_SPHERE, radius=size[0])
        else:
            shape = engine.createCollisionShape(engine.GEOM_BOX, halfExtents=size)
        self.body = engine.createMultiBody(body.mass, shape)
        free = {"linearDamping": 0, "angularDamping": 0}
        inertia = [each * self.scale**2 for each in body.inertia]
        engine.changeDynamics(self.body, -1, localInertiaDiagonal=inertia, **free)
        engine.changeDynamics(self.body, -1, lateralFriction=1, restitution=0, **free)
        self.place(self.body, body.position, body.orientation)
        engine.resetBaseVelocity(self.body, [each * self.scale for each in body.velocity], body.spin)

    def place(self, body: int, position: Any, orientation: Any) -> None:
        """Put a body somewhere."""
        w, *axis = orientation
        engine.resetBasePositionAndOrientation(body, [each * self.scale for each in position], [*axis, w])

    def advance(self) -> None:
        engine.stepSimulation()

    def state(self) -> State:
        position, _ = engine.getBasePositionAndOrientation(self.body)
        velocity, spin = engine.getBaseVelocity(self.body)
        return [each / self.scale for each in position], [each / self.scale for each in velocity], spin

    def push(self, force: Vector) -> None:
        where, _ = engine.getBasePositionAndOrientation(self.body)
        engine.applyExternalForce(self.body, -1, [each * self.scale for each in force], where, engine.WORLD_FRAME)

    def turn(self, point: Array, normal: Array) -> None:
        self.place(self.wall, point, upright(normal))


defaults = PyBullet("pybullet-defaults")
free = PyBullet("pybullet", "lengths in dm, 200 iterations to round-off, Coulomb's cone")
best = Simulated(
    "pybullet",
    free,
    "lengths in cm there and dm elsewhere, 200 iterations to round-off, Coulomb's cone",
    "a landing is late by up to a step, and forces are those at a step's beginning",
)
