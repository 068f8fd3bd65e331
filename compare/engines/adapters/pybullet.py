"""PyBullet: projected Gauss-Seidel on velocities of a multibody, contacts rigid within tolerances.

Traps: its margins are absolute lengths and its solver stops at an absolute residual, both made for
things the size of a man, but where a length unit is so small that things move by 0.4 of it in a
step, friction is gone; bodies have damping and a limit of velocity unless they are switched off;
friction and inertia given in one call of `changeDynamics` leave friction at 0.5; friction is the
product of both bodies' coefficients."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pybullet as engine

from compare.engines.adapters.free import CORNERS, BodyState, Free, Touch
from compare.engines.adapters.scene import Vector, upright
from model.arrays import Array


class PyBullet(Free):
    """A free body in PyBullet."""

    TELLS = True
    FEATURES = ("disc",)
    SCALE = 10.0
    """In the best settings its length unit in 1/m, since its tolerances are absolute lengths."""
    here: Mapping[str, int] = {}

    def make(self) -> None:
        self.close()
        scene, body, self.scale = self.scene, self.scene.body, self.SCALE if self.best else 1.0
        self.here = here = {"physicsClientId": engine.connect(engine.DIRECT)}
        if here["physicsClientId"] < 0:
            raise RuntimeError("PyBullet has no more servers")
        settings: dict[str, Any] = {"fixedTimeStep": self.timestep, "enableConeFriction": 1}
        # the solver to round-off, no overlap left alone, contacts prepared for from 2 cm on
        if self.best:
            settings |= {"numSolverIterations": 200, "solverResidualThreshold": 1e-24}
            settings |= {"contactSlop": 0.0, "contactBreakingThreshold": 0.2}
        engine.setPhysicsEngineParameter(**settings, **here)
        engine.setGravity(0, 0, -scene.g * self.scale, **here)
        self.surfaces = {}
        for surface, _, point, normal in self.planes():
            shape = engine.createCollisionShape(engine.GEOM_PLANE, planeNormal=[0, 0, 1], **here)
            # the last one is the one that moves
            self.wall = engine.createMultiBody(0, shape, **here)
            self.surfaces[self.wall] = scene.surfaces.index(surface)
            mu = surface.friction
            engine.changeDynamics(self.wall, -1, lateralFriction=mu, restitution=0, **here)
            # boxes rock on a plane that isn't turned, but has another normal than z
            self.turn(point, normal)
        size = [each * self.scale for each in body.size]
        kinds: dict[str, tuple[int, dict[str, Any]]] = {
            "sphere": (engine.GEOM_SPHERE, {"radius": size[0]}),
            "box": (engine.GEOM_BOX, {"halfExtents": size}),
            "disc": (engine.GEOM_CYLINDER, {"radius": size[0], "height": 2 * size[-1]}),
        }
        kind, given = kinds[body.shape]
        shape = engine.createCollisionShape(kind, **given, **here)
        self.body = engine.createMultiBody(body.mass, shape, **here)
        free = {"linearDamping": 0, "angularDamping": 0, "jointDamping": 0, "maxJointVelocity": 1e9}
        inertia = [each * self.scale**2 for each in body.inertia]
        engine.changeDynamics(self.body, -1, localInertiaDiagonal=inertia, **free, **here)
        engine.changeDynamics(self.body, -1, lateralFriction=1, restitution=0, **here)
        self.put(self.body, body.position, body.orientation, body.velocity, body.spin)

    def put(
        self, body: int, place: Any, orientation: Any, velocity: Any, spin: Any = (0, 0, 0)
    ) -> None:
        """Set place, orientation (scalar first), velocity and spin of a body or a plane."""
        (w, *axis) = orientation
        (place, velocity) = ([each * self.scale for each in part] for part in (place, velocity))
        engine.resetBasePositionAndOrientation(body, place, [*axis, w], **self.here)
        engine.resetBaseVelocity(body, velocity, spin, **self.here)

    def advance(self) -> None:
        engine.stepSimulation(**self.here)

    def read(self) -> BodyState:
        place, _ = engine.getBasePositionAndOrientation(self.body, **self.here)
        velocity, spin = engine.getBaseVelocity(self.body, **self.here)
        return [each / self.scale for each in place], [each / self.scale for each in velocity], spin

    def push(self, force: Vector) -> None:
        place, _ = engine.getBasePositionAndOrientation(self.body, **self.here)
        pull = [each * self.scale for each in force]
        engine.applyExternalForce(self.body, -1, pull, place, engine.WORLD_FRAME, **self.here)

    def turn(self, point: Array, normal: Array, velocity: Any = (0, 0, 0)) -> None:
        self.put(self.wall, point, upright(normal), velocity)

    def touches(self) -> list[Touch]:
        shown = []
        for point in engine.getContactPoints(self.body, **self.here):
            if point[9] > 0:
                # where force and direction of the normal are, then those of both tangents
                ways = (9, 7), (10, 11), (12, 13)
                force = sum(point[k] * np.array(point[way]) for k, way in ways) / self.scale
                shown.append(Touch(self.surfaces[point[2]], force, point[8] / self.scale))
        return shown

    def close(self) -> None:
        if self.here:
            engine.disconnect(**self.here)
            self.here = {}


defaults = PyBullet("pybullet-defaults", CORNERS)
best = PyBullet(
    "pybullet",
    "a landing is late by up to a step",
    "lengths in dm, 200 iterations to round-off, Coulomb's cone",
)
