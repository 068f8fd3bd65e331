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
from compare.kit.adapters.adapter import BreakdownError, Floats, Touch
from model import Parameters
from model.arrays import Array
from model.kinematics import tangent


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
    """Whether friction obeys Coulomb's cone, as it does where nothing is said; a pyramid otherwise."""
    slop: float = 0.0
    """`contactSlop`, overlap that is left alone, in the engine's length unit."""
    breaking: float = 0.2
    """`contactBreakingThreshold`, distance up to which contacts are prepared for, in the engine's length unit."""

    @property
    def resolution(self) -> float:
        """The speed to which the solver goes."""
        return math.sqrt(self.residual) / self.scale


DEFAULTS = Settings(
    timestep=1 / 240,
    coordinates="free",
    facets=64,
    scale=1.0,
    iterations=50,
    residual=1e-7,
    slop=1e-5,
    breaking=0.02,
)
"""The engine's own settings: a free ball in a prism of 64 planes, SI units."""


class Server:
    """A physics server of its own with fixed planes and what touches them; lengths given to it are in m."""

    def __init__(self, engine: Any, settings: Settings, g: float) -> None:
        self.engine, self.scale = engine, settings.scale
        self.here = {"physicsClientId": engine.connect(engine.DIRECT)}
        if self.here["physicsClientId"] < 0:
            raise BreakdownError("PyBullet has no more servers")
        engine.setPhysicsEngineParameter(
            fixedTimeStep=settings.timestep,
            numSolverIterations=settings.iterations,
            solverResidualThreshold=settings.residual,
            enableConeFriction=int(settings.cone),
            contactSlop=settings.slop,
            contactBreakingThreshold=settings.breaking,
            **self.here,
        )
        engine.setGravity(0, 0, -g * self.scale, **self.here)

    def plane(self, point: Array, normal: Array, friction: float) -> int:
        """A fixed plane with the friction of the pair."""
        shape = self.engine.createCollisionShape(self.engine.GEOM_PLANE, planeNormal=normal.tolist(), **self.here)
        body: int = self.engine.createMultiBody(0, shape, basePosition=(point * self.scale).tolist(), **self.here)
        self.engine.changeDynamics(body, -1, lateralFriction=friction, restitution=0, **self.here)
        return body

    def shape(self, size: Floats) -> int:
        """A sphere of a radius, or a box of three half edges."""
        own = [each * self.scale for each in size]
        kind = {"radius": own[0]} if len(own) == 1 else {"halfExtents": own}
        types = self.engine.GEOM_SPHERE if len(own) == 1 else self.engine.GEOM_BOX
        shape: int = self.engine.createCollisionShape(types, **kind, **self.here)
        return shape

    def loosen(self, body: int, link: int, inertia: Floats) -> None:
        """Free a link (-1: the body) of damping and limits; moments of inertia in kg and the scale's length."""
        free = {"linearDamping": 0, "angularDamping": 0, "jointDamping": 0, "maxJointVelocity": 1e9}
        self.engine.changeDynamics(body, link, localInertiaDiagonal=inertia, **free, **self.here)
        self.engine.changeDynamics(body, link, lateralFriction=1, restitution=0, **self.here)

    def put(self, body: int, place: Any, orientation: Any, velocity: Any = (0, 0, 0), spin: Any = (0, 0, 0)) -> None:
        """A free body, or a plane, somewhere; the orientation has the scalar last."""
        place, velocity = ([each * self.scale for each in part] for part in (place, velocity))
        self.engine.resetBasePositionAndOrientation(body, place, orientation, **self.here)
        self.engine.resetBaseVelocity(body, velocity, spin, **self.here)

    def push(self, body: int, force: Floats) -> None:
        """A free body's centre, in the next step."""
        place, _ = self.engine.getBasePositionAndOrientation(body, **self.here)
        pull = [each * self.scale for each in force]
        self.engine.applyExternalForce(body, -1, pull, place, self.engine.WORLD_FRAME, **self.here)

    def state(self, body: int) -> tuple[list[float], list[float], Floats]:
        """Place, velocity and spin of a free body."""
        place, _ = self.engine.getBasePositionAndOrientation(body, **self.here)
        velocity, spin = self.engine.getBaseVelocity(body, **self.here)
        return [each / self.scale for each in place], [each / self.scale for each in velocity], spin

    def close(self) -> None:
        """End it."""
        self.engine.disconnect(**self.here)


class Scene(Server, adapter.Scene):
    """The ball on joints, or free."""

    def __init__(self, engine: Any, p: Parameters, settings: Settings) -> None:
        super().__init__(engine, settings, p.g)
        self._joints = settings.coordinates == "joints"
        self._floor = self.plane(np.zeros(3), np.array([0.0, 0.0, 1.0]), p.mu)
        for k in range(settings.facets):
            self.plane(*tangent(p.R + p.r, math.tau * k / settings.facets), p.eta)
        sphere = self.shape([p.r])
        self._body = self._on_joints(sphere, p) if self._joints else engine.createMultiBody(p.m, sphere, **self.here)
        for link, mass in enumerate((0, 0, 0, p.m)) if self._joints else [(-1, p.m)]:
            self.loosen(self._body, link, [p.j * mass * (p.r * self.scale) ** 2] * 3)

    def _on_joints(self, sphere: int, p: Parameters) -> int:
        """A ball on massless joints without motors."""
        engine, count = self.engine, 4
        body: int = engine.createMultiBody(
            baseMass=0,
            basePosition=[0, 0, p.r * self.scale],
            linkMasses=[0, 0, 0, p.m],
            linkCollisionShapeIndices=[-1, -1, -1, sphere],
            linkVisualShapeIndices=[-1] * count,
            linkPositions=[[0, 0, 0], [p.R * self.scale, 0, 0], [0, 0, 0], [0, 0, 0]],
            linkOrientations=[_UPRIGHT] * count,
            linkInertialFramePositions=[[0, 0, 0]] * count,
            linkInertialFrameOrientations=[_UPRIGHT] * count,
            linkParentIndices=range(count),
            linkJointTypes=[engine.JOINT_REVOLUTE, *[engine.JOINT_PRISMATIC] * 2, engine.JOINT_SPHERICAL],
            linkJointAxis=[[0, 0, 1], [-1, 0, 0], [0, 0, 1], [0, 0, 1]],
            **self.here,
        )
        for joint in range(3):
            engine.setJointMotorControl2(body, joint, engine.VELOCITY_CONTROL, force=0, **self.here)
        still = {"targetPosition": _UPRIGHT, "positionGain": 0, "velocityGain": 0, "force": [0, 0, 0]}
        engine.setJointMotorControlMultiDof(body, 3, engine.POSITION_CONTROL, **still, **self.here)
        return body

    def start(self, place: Floats, velocity: Floats) -> None:
        if not self._joints:
            self.put(self._body, place, _UPRIGHT, velocity[:3], velocity[3:])
            return
        for joint, gap, rate in zip((1, 2), place[1:], velocity[1:3], strict=True):
            self.engine.resetJointState(self._body, joint, gap * self.scale, rate * self.scale, **self.here)
        self._turn_back(velocity[0], velocity[3:])

    def _turn_back(self, rate: float, spin: Floats) -> None:
        """Set azimuth and orientation back to zero, at these velocities."""
        self.engine.resetJointState(self._body, 0, 0.0, rate, **self.here)
        self.engine.resetJointStateMultiDof(self._body, 3, _UPRIGHT, spin, **self.here)

    def advance(self, force: Floats) -> tuple[Floats, Floats]:
        engine, body, scale = self.engine, self._body, self.scale
        if not self._joints:
            self.push(body, force)
            engine.stepSimulation(**self.here)
            place, velocity, spin = self.state(body)
            return place, [*velocity, *spin]
        forces = [force[0] * scale * scale, force[1] * scale, force[2] * scale]
        engine.setJointMotorControlArray(body, (0, 1, 2), engine.TORQUE_CONTROL, forces=forces, **self.here)
        engine.stepSimulation(**self.here)
        states = engine.getJointStatesMultiDof(body, (0, 1, 2, 3), **self.here)
        ((angle,), (rate,), *_), ((h,), (v_h,), *_), ((y,), (v_y,), *_), (_, spin, *_) = states
        self._turn_back(rate, spin)
        return (angle, h / scale, y / scale), (rate, v_h / scale, v_y / scale, *spin)

    def touches(self) -> list[Touch]:
        shown = []
        for point in self.engine.getContactPoints(self._body, **self.here):
            if point[9] > 0:  # force, direction of the normal; the same of both tangents
                force = sum(point[k] * np.array(point[way]) for k, way in ((9, 7), (10, 11), (12, 13)))
                shown.append(Touch(int(point[2] != self._floor), force / self.scale, point[8] / self.scale))
        return shown


_UPRIGHT = (0.0, 0.0, 0.0, 1.0)
