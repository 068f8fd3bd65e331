"""DART: semi-implicit Euler, and a contact problem on velocities in each step, in double precision.

Traps: commands to joints are forgotten after each step; of the collision detectors only that of ODE
places the contacts of a box on a plane so that it neither rocks nor sinks in; friction is the
lesser of both bodies' coefficients."""

from __future__ import annotations

import itertools
import math
from typing import Any

import dartpy as engine
import numpy as np

from compare.engines.adapters.free import BodyState, Free, Touch
from compare.engines.adapters.scene import Vector
from model.arrays import Array
from model.kinematics import rotated


class Dart(Free):
    """A free body in DART."""

    TELLS = TURNS = True
    FEATURES = ("two bodies", "moving surface", "restitution", "tripod", "disc")

    def make(self) -> None:
        scene, bodies = self.scene, engine.dynamics
        self.world = engine.simulation.World()
        self.world.setTimeStep(self.timestep)
        self.world.setGravity([0.0, 0.0, -scene.g])
        if self.best:
            solver = self.world.getConstraintSolver()
            self.cone = engine.constraint.NsgsFrictionSolver()
            self.world.setCollisionDetector(engine.collision.OdeCollisionDetector())
            solver.setBoxedLcpSolver(self.cone)
            solver.setSplitImpulseEnabled(True)
        self.driven: list[tuple[Any, float]] = []
        self.surfaces = {}
        for surface, name, point, normal in self.planes():
            skeleton = bodies.Skeleton(name)
            self.surfaces[name] = scene.surfaces.index(surface)
            if self.goes_along(surface):
                self.wall, node = skeleton.createTranslationalJointAndBodyNodePair()
                self.wall.setActuatorType(bodies.ActuatorType.VELOCITY)
                node.setGravityMode(False)
            elif surface.turning:
                joint, node = skeleton.createRevoluteJointAndBodyNodePair()
                self.drive(joint, [0.0, 0.0, 1.0], surface.turning)
            elif speed := math.hypot(*surface.velocity):
                joint, node = skeleton.createPrismaticJointAndBodyNodePair()
                self.drive(joint, np.array(surface.velocity) / speed, speed)
            else:
                _, node = skeleton.createWeldJointAndBodyNodePair()
            self.plane = bodies.PlaneShape(normal, point)  # the last one is the one that moves
            self.add(node, self.plane, surface.friction, surface.restitution)
            self.world.addSkeleton(skeleton)
        self.nodes: list[Any] = []
        for body, friction in zip(scene.bodies, (1e3, scene.between), strict=False):
            skeleton = bodies.Skeleton(f"body{len(self.nodes)}")
            joint, node = skeleton.createFreeJointAndBodyNodePair()
            pose = translation(body.position)
            pose[:3, :3] = rotated(np.array(body.orientation), np.eye(3)).T
            joint.setTransform(engine.math.Isometry3(pose))
            joint.setLinearVelocity(body.velocity)
            joint.setAngularVelocity(body.spin)
            node.setInertia(bodies.Inertia(body.mass, np.zeros(3), np.diag(body.inertia)))
            size = np.array(body.size)
            for at in body.parts:
                if body.shape == "disc":
                    shape = bodies.CylinderShape(size[0], 2 * size[1])
                elif body.shape == "box":
                    shape = bodies.BoxShape(2 * size)
                else:
                    shape = bodies.SphereShape(size[0])
                self.add(node, shape, friction, 1.0, at)
            self.world.addSkeleton(skeleton)
            self.nodes.append(node)

    def add(
        self, node: Any, shape: Any, friction: float, restitution: float, at: Any = (0, 0, 0)
    ) -> None:
        """Give a body a shape with friction and restitution, at a place in its axes."""
        frame = node.createShapeNode(shape)
        frame.setRelativeTransform(engine.math.Isometry3(translation(at)))
        frame.createCollisionAspect()
        dynamics = frame.createDynamicsAspect()
        dynamics.setFrictionCoeff(friction)
        dynamics.setRestitutionCoeff(restitution)

    def drive(self, joint: Any, axis: Any, rate: float) -> None:
        """Let a joint of one axis go at a rate, m/s or rad/s."""
        joint.setAxis(axis)
        joint.setActuatorType(engine.dynamics.ActuatorType.VELOCITY)
        self.driven.append((joint, rate))

    def advance(self) -> None:
        for joint, rate in self.driven:
            joint.setCommand(0, rate)
        super().advance()

    def read(self) -> BodyState:
        own = ((n.getCOM(), n.getLinearVelocity(), n.getAngularVelocity()) for n in self.nodes)
        return tuple(itertools.chain.from_iterable(own))

    def push(self, force: Vector) -> None:
        self.nodes[0].setExtForce(force, np.zeros(3), False, True)

    def turn(self, point: Array, normal: Array, velocity: Array) -> None:
        self.plane.setNormalAndPoint(normal, point)
        self.wall.setPositions(np.zeros(3))
        self.wall.setVelocities(velocity)
        self.wall.setCommands(velocity)

    def touches(self) -> list[Touch]:
        shown = []
        for contact in self.world.getLastCollisionResult().getContacts():
            first, second = (
                each.getShapeFrame().asShapeNode().getSkeleton().getName()
                for each in (contact.collisionObject1, contact.collisionObject2)
            )
            on_first, gap = np.array(contact.force), -contact.penetrationDepth
            shown.append(self.touch(second, first, on_first, gap))
        return shown


def translation(position: Any) -> Array:
    """The pose (4, 4) of a place without a turn."""
    pose = np.eye(4)
    pose[:3, 3] = position
    return pose


defaults = Dart(
    "dart-defaults", "boxes rock and creep, since FCL places their contacts anew in every step"
)
best = Dart(
    "dart",
    "a landing is late by up to a step, and its overlap is taken out slowly",
    "contacts by ODE's collision detector, Coulomb's cone by NSGS, overlaps taken out by split "
    "impulses",
)
