"""Drake: a discrete `MultibodyPlant` with point contact, normal forces implicit, friction regularised below a speed.

TAMSI solves the step by Newton's method, with friction mu v/v_s up to the stiction tolerance v_s: a contact that should
roll creeps at a part of v_s, and a ball sinks in by its load divided by the stiffness. Both can be made small, as far
as Newton's method converges. The convex solvers (SAP, its variants "similar" and "lagged") have a softer friction of
their own, and creep.

Traps: friction is the harmonic mean 2 a b/(a + b) of both bodies' coefficients, stiffness k1 k2/(k1 + k2); without
`SetUseSampledOutputPorts(False)` there is no update to be evaluated by itself; a plane has to be a half space, since
boxes are less exact, but one among a dozen of other shapes crashes the engine.
"""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from compare.kit.adapters import adapter
from compare.kit.adapters.adapter import BreakdownError, Floats, Touch
from model import Parameters
from model.arrays import Array
from model.kinematics import tangent

_SIZE = 100.0
"""Edge of the cubes of which a vessel of many facets is made, in units of its radius."""


@dataclass(frozen=True, kw_only=True)
class Settings(adapter.Settings):
    """The engine's settings: by default the best known, massless joints, TAMSI, stiff contacts and a low v_s."""

    facets: int = 1
    """Planes that make up the wall."""
    approximation: str = "tamsi"
    """`discrete_contact_approximation`: ``tamsi``, ``sap``, ``lagged`` or ``similar``."""
    stiffness: float | None = 1e10
    """Of ball, floor and wall, N/m; None for what the engine takes from its `penetration_allowance` of 1 mm."""
    dissipation: float | None = 100.0
    """Of each of them, s/m; None for the engine's own. A ball that has landed comes out of its overlap at up to the
    reciprocal: with less it is thrown back, with more it stays sunk in for long."""
    stiction: float = 1e-8
    """`stiction_tolerance` v_s, m s-1. With a hundredth of it TAMSI fails when a ball that rolls on both contacts lifts
    off the floor, and so it does at the first step with a ten times larger v_s and stiffness."""

    @property
    def resolution(self) -> float:
        """The stiction tolerance."""
        return self.stiction


DEFAULTS = Settings(
    coordinates="free", facets=64, approximation="lagged", stiction=1e-4, stiffness=None, dissipation=None
)
"""The engine's own settings: a free ball in a prism of 64 boxes."""


class Plant:
    """A discrete plant with point contact: it is given bodies and shapes, built, and stepped."""

    def __init__(self, engine: Any, settings: Settings, g: float, most: float) -> None:
        """`most` is the largest friction of a pair."""
        logging.getLogger("drake").setLevel(logging.ERROR)  # it warns that half spaces don't meet deformable bodies
        self.engine, self.most, self.stiction = engine, most, settings.stiction
        springs = {"dissipation": settings.dissipation, "point_stiffness": settings.stiffness}
        self.springs = {name: value for name, value in springs.items() if value is not None}
        self.builder = engine.DiagramBuilder()
        self.plant, _ = engine.AddMultibodyPlantSceneGraph(self.builder, engine.MultibodyPlant(settings.timestep))
        self.plant.set_contact_model(engine.ContactModel.kPoint)
        chosen = getattr(engine.DiscreteContactApproximation, f"k{settings.approximation.capitalize()}")
        self.plant.set_discrete_contact_approximation(chosen)
        self.plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, -g])
        self.plant.SetUseSampledOutputPorts(False)

    def add(self, of: Any, pose: Any, shape: Any, name: str, friction: float | None = None) -> Any:
        """A shape of what moves, or of what it touches, with the friction of the pair."""
        material, mu = self.engine.ProximityProperties(), self.most
        if friction is not None:  # the harmonic mean of both is the pair's
            mu = mu * friction / (2 * mu - friction) if friction else 0.0
        coefficient = self.engine.CoulombFriction(mu, mu)
        self.engine.AddContactMaterial(**self.springs, friction=coefficient, properties=material)
        return self.plant.RegisterCollisionGeometry(of, pose, shape, name, material)

    def plane(self, of: Any, point: Array, normal: Array, name: str, friction: float, size: float = 0.0) -> Any:
        """A half space, or one side of a cube: a half space among a dozen of shapes crashes the engine."""
        pose, shape = self.engine.HalfSpace.MakePose(normal, point), self.engine.HalfSpace()
        if size:
            turn = self.engine.RotationMatrix.MakeFromOneVector(normal, 2)
            pose = self.engine.RigidTransform(turn, point - size / 2 * normal)
            shape = self.engine.Box(size, size, size)
        return self.add(of, pose, shape, name, friction)

    def build(self) -> None:
        """Nothing can be added after this."""
        self.plant.Finalize()
        self.plant.set_stiction_tolerance(self.stiction)
        self.diagram = self.builder.Build()
        self.root = self.diagram.CreateDefaultContext()
        self.context = self.plant.GetMyMutableContextFromRoot(self.root)

    def after(self, x: Array, force: Floats | Array) -> Array:
        """Positions and velocities a step after x, under generalised forces."""
        self.plant.get_applied_generalized_force_input_port().FixValue(self.context, force)
        self.plant.SetPositionsAndVelocities(self.context, x)
        x = self.plant.EvalUniquePeriodicDiscreteUpdate(self.context).get_vector(0).CopyToVector()
        return x


class Scene(adapter.Scene):
    """The ball in a plant of its own."""

    def __init__(self, engine: Any, p: Parameters, settings: Settings) -> None:
        self._joints = settings.coordinates == "joints"
        own = Plant(engine, settings, p.g, max(p.mu, p.eta))
        turning = engine.UnitInertia(*[p.j * p.r**2] * 3)
        ball = own.plant.AddRigidBody("ball", engine.SpatialInertia(p.m, [0.0, 0.0, 0.0], turning))
        if self._joints:
            _hang(engine, own.plant, ball, p)
        size = _SIZE * (p.R + p.r) if settings.facets > 1 else 0.0
        own.add(ball, engine.RigidTransform(), engine.Sphere(p.r), "ball")
        world = own.plant.world_body()
        self._floor = own.plane(world, np.zeros(3), np.array([0.0, 0.0, 1.0]), "floor", p.mu, size)
        for k in range(settings.facets):
            own.plane(world, *tangent(p.R + p.r, math.tau * k / settings.facets), f"wall{k}", p.eta, size)
        own.build()
        self._plant, self._ball, self._state = own, ball.index(), np.empty(0)

    def start(self, place: Floats, velocity: Floats) -> None:
        if self._joints:
            self._state = np.array([*place, 0.0, 0.0, 0.0, *velocity])
        else:
            self._state = np.array([1.0, 0.0, 0.0, 0.0, *place, *velocity[3:], *velocity[:3]])

    def advance(self, force: Floats) -> tuple[Floats, Floats]:
        if self._joints:
            self._state[0], self._state[3:6], forces = 0.0, 0.0, [*force, 0.0, 0.0, 0.0]
        else:
            forces = [0.0, 0.0, 0.0, *force]
        try:
            self._state = self._plant.after(self._state, forces)
        except RuntimeError as error:
            raise BreakdownError(f"could not go on ({' '.join(str(error).split())[:80]})") from error
        numbers = self._state.tolist()
        if self._joints:
            return numbers[:3], numbers[6:]
        return numbers[4:7], [*numbers[10:], *numbers[7:10]]

    def touches(self) -> list[Touch]:
        results = self._plant.plant.get_contact_results_output_port().Eval(self._plant.context)
        shown = []
        for info in (results.point_pair_contact_info(k) for k in range(results.num_point_pair_contacts())):
            pair, sign = info.point_pair(), 1 if info.bodyB_index() == self._ball else -1  # it acts on the second body
            contact = int(self._floor not in (pair.id_A, pair.id_B))
            shown.append(Touch(contact, sign * info.contact_force(), -pair.depth))
        return shown

    def close(self) -> None:
        del self._plant


def _hang(engine: Any, plant: Any, ball: Any, p: Parameters) -> None:
    """Join the ball to the world by an azimuth hinge, an inward and an upward slide, and a ball joint."""
    nothing = engine.SpatialInertia(0.0, [0.0, 0.0, 0.0], engine.UnitInertia(0.0, 0.0, 0.0), skip_validity_check=True)
    hinge, inward, upward = (plant.AddRigidBody(name, nothing) for name in ("hinge", "in", "up"))
    up, frame = [0.0, 0.0, 1.0], plant.world_body().body_frame()
    plant.AddJoint(engine.RevoluteJoint("azimuth", frame, hinge.body_frame(), up, 0.0))
    place = engine.FixedOffsetFrame("place", hinge.body_frame(), engine.RigidTransform([p.R, 0.0, p.r]))
    start = plant.AddFrame(place)
    plant.AddJoint(engine.PrismaticJoint("inward", start, inward.body_frame(), [-1.0, 0.0, 0.0], damping=0.0))
    plant.AddJoint(engine.PrismaticJoint("upward", inward.body_frame(), upward.body_frame(), up, damping=0.0))
    plant.AddJoint(engine.BallRpyJoint("spin", upward.body_frame(), ball.body_frame(), 0.0))
