"""DART: semi-implicit Euler, and a contact problem on velocities in each step, in double precision.

Traps: commands to joints are forgotten after each step; of the collision detectors only that of ODE places the contacts
of a box on a plane so that it neither rocks nor sinks in; friction is the lesser of both bodies' coefficients.
"""

from __future__ import annotations

from typing import Any

import dartpy as engine
import numpy as np

from compare.bench.adapters.free import CHORD, Free, State
from compare.bench.case import Vector
from model.arrays import Array
from model.kinematics import rotated


class Dart(Free):
    """As in `Free`."""

    def make(self) -> None:
        case, body, bodies = self.case, self.case.body, engine.dynamics
        self.world = engine.simulation.World()
        self.world.setTimeStep(self.timestep)
        self.world.setGravity([0.0, 0.0, -case.g])
        if self.best:
            solver, self.cone = self.world.getConstraintSolver(), engine.constraint.NsgsFrictionSolver()
            self.world.setCollisionDetector(engine.collision.OdeCollisionDetector())
            solver.setBoxedLcpSolver(self.cone)
            solver.setSplitImpulseEnabled(True)
        self.tables: list[tuple[Any, float]] = []
        for surface, name, point, normal in self.planes():
            skeleton = bodies.Skeleton(name)
            if surface.turning:
                joint, node = skeleton.createRevoluteJointAndBodyNodePair()
                joint.setAxis([0.0, 0.0, 1.0])
                joint.setActuatorType(bodies.ActuatorType.VELOCITY)
                self.tables.append((joint, surface.turning))
            else:
                _, node = skeleton.createWeldJointAndBodyNodePair()
            self.wall = bodies.PlaneShape(normal, point)  # the last one is the one that moves
            self.add(skeleton, node, self.wall, surface.friction)
        skeleton = bodies.Skeleton("body")
        joint, self.node = skeleton.createFreeJointAndBodyNodePair()
        pose = np.eye(4)
        pose[:3, :3] = rotated(np.array(body.orientation), np.eye(3)).T
        pose[:3, 3] = body.position
        joint.setTransform(engine.math.Isometry3(pose))
        joint.setLinearVelocity(body.velocity)
        joint.setAngularVelocity(body.spin)
        self.node.setInertia(bodies.Inertia(body.mass, np.zeros(3), np.diag(body.inertia)))
        size = np.array(body.size)
        self.add(
            skeleton, self.node, bodies.SphereShape(*size) if body.shape == "sphere" else bodies.BoxShape(2 * size)
        )

    def add(self, skeleton: Any, node: Any, shape: Any, friction: float = 1e3) -> None:
        """A shape that touches others."""
        frame = node.createShapeNode(shape)
        frame.createCollisionAspect()
        frame.createDynamicsAspect().setFrictionCoeff(friction)
        self.world.addSkeleton(skeleton)

    def advance(self) -> None:
        for joint, turning in self.tables:
            joint.setCommand(0, turning)
        self.world.step()

    def read(self) -> State:
        return self.node.getCOM(), self.node.getLinearVelocity(), self.node.getAngularVelocity()

    def push(self, force: Vector) -> None:
        self.node.setExtForce(force, np.zeros(3), False, True)

    def turn(self, point: Array, normal: Array) -> None:
        self.wall.setNormalAndPoint(normal, point)


defaults = Dart("dart-defaults", "boxes rock and creep, since FCL places their contacts anew in every step")
best = Dart(
    "dart",
    f"of first order in everything, worst round the cylinder: {CHORD}",
    "contacts by ODE's collision detector, Coulomb's cone by NSGS, overlaps taken out by split impulses",
)
