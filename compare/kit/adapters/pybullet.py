"""PyBullet: projected Gauss-Seidel on the velocities of a multibody (Featherstone), contacts rigid within tolerances.

Traps: its margins are absolute lengths and its solver stops at an absolute residual, both made for things the size of
a man; joints have damping, motors and a velocity limit unless they are switched off; friction and inertia given in one
call of `changeDynamics` leave friction at 0.5; friction is the product of both bodies' coefficients.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from compare.kit.adapters import adapter
from compare.kit.adapters.adapter import BreakdownError, Floats, Touch, tangents
from model import Parameters
from model.arrays import Array


@dataclass(frozen=True, kw_only=True)
class Settings(adapter.Settings):
    """The engine's settings: by default the best known, massless joints and contacts solved to round-off."""

    facets: int = 1
    """Planes that make up the wall."""
    scale: float = 100.0
    """Length unit of the engine, in 1/m: its tolerances are absolute lengths."""
    iterations: int = 200
    """Most iterations of the contact solver."""
    residual: float = 1e-24
    """`solverResidualThreshold`, the change of velocity in an iteration, squared, at which the solver stops."""
    cone: bool = True
    """Whether friction obeys Coulomb's cone; a pyramid otherwise."""
    slop: float = 0.0
    """`contactSlop`, overlap that is left alone, in the engine's length unit."""
    breaking: float = 0.2
    """`contactBreakingThreshold`, distance up to which contacts are prepared for, in the engine's length unit."""

    @property
    def resolution(self) -> float:
        """The speed to which the solver goes."""
        return math.sqrt(self.residual) / self.scale


DEFAULTS = {
    "coordinates": "free",
    "facets": 64,
    "scale": 1.0,
    "iterations": 50,
    "residual": 1e-7,
    "cone": False,
    "slop": 1e-5,
    "breaking": 0.02,
}
"""The engine's own settings: a free ball in a prism of 64 planes, SI units."""


class Scene(adapter.Scene):
    """The ball in a physics server of its own."""

    def __init__(self, engine: Any, p: Parameters, settings: Settings) -> None:
        self._engine, self._p, self._scale = engine, p, settings.scale
        self._joints = settings.coordinates == "joints"
        self._here = {"physicsClientId": engine.connect(engine.DIRECT)}
        if self._here["physicsClientId"] < 0:
            raise BreakdownError("PyBullet has no more servers")
        engine.setPhysicsEngineParameter(
            fixedTimeStep=settings.timestep,
            numSolverIterations=settings.iterations,
            solverResidualThreshold=settings.residual,
            enableConeFriction=int(settings.cone),
            contactSlop=settings.slop,
            contactBreakingThreshold=settings.breaking,
            **self._here,
        )
        engine.setGravity(0, 0, -p.g * self._scale, **self._here)
        self._floor = self._plane(np.zeros(3), np.array([0.0, 0.0, 1.0]), p.mu)
        for place, normal in tangents(p, settings.facets):
            self._plane(place, normal, p.eta)
        sphere = engine.createCollisionShape(engine.GEOM_SPHERE, radius=p.r * self._scale, **self._here)
        self._body = self._on_joints(sphere) if self._joints else engine.createMultiBody(p.m, sphere, **self._here)
        free = {"linearDamping": 0, "angularDamping": 0, "jointDamping": 0, "maxJointVelocity": 1e9}
        for link, mass in enumerate((0, 0, 0, p.m)) if self._joints else [(-1, p.m)]:
            inertia = [p.j * mass * (p.r * self._scale) ** 2] * 3
            engine.changeDynamics(self._body, link, localInertiaDiagonal=inertia, **free, **self._here)
            engine.changeDynamics(self._body, link, lateralFriction=1, restitution=0, **self._here)

    def _plane(self, place: Array, normal: Array, friction: float) -> int:
        shape = self._engine.createCollisionShape(self._engine.GEOM_PLANE, planeNormal=normal.tolist(), **self._here)
        where = (place * self._scale).tolist()
        body: int = self._engine.createMultiBody(0, shape, basePosition=where, **self._here)
        self._engine.changeDynamics(body, -1, lateralFriction=friction, restitution=0, **self._here)
        return body

    def _on_joints(self, sphere: int) -> int:
        """A ball on massless joints without motors."""
        engine, count = self._engine, 4
        body: int = engine.createMultiBody(
            baseMass=0,
            basePosition=[0, 0, self._p.r * self._scale],
            linkMasses=[0, 0, 0, self._p.m],
            linkCollisionShapeIndices=[-1, -1, -1, sphere],
            linkVisualShapeIndices=[-1] * count,
            linkPositions=[[0, 0, 0], [self._p.R * self._scale, 0, 0], [0, 0, 0], [0, 0, 0]],
            linkOrientations=[_UPRIGHT] * count,
            linkInertialFramePositions=[[0, 0, 0]] * count,
            linkInertialFrameOrientations=[_UPRIGHT] * count,
            linkParentIndices=range(count),
            linkJointTypes=[engine.JOINT_REVOLUTE, *[engine.JOINT_PRISMATIC] * 2, engine.JOINT_SPHERICAL],
            linkJointAxis=[[0, 0, 1], [-1, 0, 0], [0, 0, 1], [0, 0, 1]],
            **self._here,
        )
        for joint in range(3):
            engine.setJointMotorControl2(body, joint, engine.VELOCITY_CONTROL, force=0, **self._here)
        still = {"targetPosition": _UPRIGHT, "positionGain": 0, "velocityGain": 0, "force": [0, 0, 0]}
        engine.setJointMotorControlMultiDof(body, 3, engine.POSITION_CONTROL, **still, **self._here)
        return body

    def start(self, place: Floats, velocity: Floats) -> None:
        engine, body, scale = self._engine, self._body, self._scale
        if self._joints:
            for joint, gap, rate in zip((1, 2), place[1:], velocity[1:3], strict=True):
                engine.resetJointState(body, joint, gap * scale, rate * scale, **self._here)
            self._turn_back(velocity[0], velocity[3:])
        else:
            self._place, linear = ([value * scale for value in part] for part in (place, velocity[:3]))
            engine.resetBasePositionAndOrientation(body, self._place, _UPRIGHT, **self._here)
            engine.resetBaseVelocity(body, linear, velocity[3:], **self._here)

    def _turn_back(self, rate: float, spin: Floats) -> None:
        """Set azimuth and orientation back to zero, at these velocities."""
        self._engine.resetJointState(self._body, 0, 0.0, rate, **self._here)
        self._engine.resetJointStateMultiDof(self._body, 3, _UPRIGHT, spin, **self._here)

    def advance(self, force: Floats) -> tuple[Floats, Floats]:
        engine, body, scale = self._engine, self._body, self._scale
        if self._joints:
            forces = [force[0] * scale * scale, force[1] * scale, force[2] * scale]
            engine.setJointMotorControlArray(body, (0, 1, 2), engine.TORQUE_CONTROL, forces=forces, **self._here)
            engine.stepSimulation(**self._here)
            states = engine.getJointStatesMultiDof(body, (0, 1, 2, 3), **self._here)
            ((angle,), (rate,), *_), ((h,), (v_h,), *_), ((y,), (v_y,), *_), (_, spin, *_) = states
            self._turn_back(rate, spin)
            return (angle, h / scale, y / scale), (rate, v_h / scale, v_y / scale, *spin)
        pull = [each * scale for each in force]
        engine.applyExternalForce(body, -1, pull, self._place, engine.WORLD_FRAME, **self._here)
        engine.stepSimulation(**self._here)
        self._place, _ = engine.getBasePositionAndOrientation(body, **self._here)
        linear, spin = engine.getBaseVelocity(body, **self._here)
        return [each / scale for each in self._place], [*(each / scale for each in linear), *spin]

    def touches(self) -> list[Touch]:
        shown = []
        for point in self._engine.getContactPoints(self._body, **self._here):
            if point[9] > 0:  # force, direction of the normal; the same of both tangents
                force = sum(point[k] * np.array(point[way]) for k, way in ((9, 7), (10, 11), (12, 13)))
                shown.append(Touch(int(point[2] != self._floor), force / self._scale, point[8] / self._scale))
        return shown

    def close(self) -> None:
        self._engine.disconnect(**self._here)


_UPRIGHT = (0.0, 0.0, 0.0, 1.0)
