"""Drake: a discrete `MultibodyPlant` with point contact, normal forces implicit, friction
regularised below a speed.

TAMSI solves the step by Newton's method, with friction mu v/v_s up to the stiction tolerance v_s: a
contact that should roll creeps at a part of v_s, and a ball sinks in by its load divided by the
stiffness. Both can be made small, as far as Newton's method converges. The convex solvers (SAP, its
variants "similar" and "lagged") have a softer friction of their own, and creep.

Traps: friction is the harmonic mean 2 a b/(a + b) of both bodies' coefficients, stiffness k1 k2/(k1
+ k2); without `SetUseSampledOutputPorts(False)` there is no update to be evaluated by itself; a
plane has to be a half space, since boxes are less exact, but one among a dozen of other shapes
crashes the engine; two half spaces that may meet are refused."""

from __future__ import annotations

import itertools
import logging
from typing import Any

import numpy as np
import pydrake.all as engine

from compare.engines.adapters.free import BodyState, Free, Touch
from compare.engines.adapters.scene import Surface, Vector, facing
from model.arrays import Array

STIFFNESS, DISSIPATION, STICTION = 1e7, 100.0, 1e-8
"""N/m and s/m of body and surfaces, and v_s in m/s. A body that has landed comes out of its overlap
at up to the reciprocal of the dissipation: with less it is thrown back, with more it stays sunk in
for long. Where the wall is placed anew before each step a hundred times the stiffness makes the
contact chatter, and TAMSI fail."""
HEAVY = 1e6  # mass of a wall that moves, divided by the body's: nothing slows it
ROUND = 1e6  # moment of inertia of a surface that moves, divided by its mass, m2: nothing turns it
SIZE = 100.0  # edge of the cubes of which a vessel of many facets is made, in units of its radius

# it warns that half spaces don't meet deformable bodies
logging.getLogger("drake").setLevel(logging.ERROR)


class Drake(Free):
    """A free body in Drake."""

    TELLS = TURNS = True
    RESOLUTION = STICTION

    def make(self) -> None:
        scene, body = self.scene, self.scene.body
        self.most = max(surface.friction for surface in scene.surfaces)
        builder, plant = engine.DiagramBuilder(), engine.MultibodyPlant(self.timestep)
        self.plant, graph = engine.AddMultibodyPlantSceneGraph(builder, plant)
        plant.set_contact_model(engine.ContactModel.kPoint)
        solver = engine.DiscreteContactApproximation
        plant.set_discrete_contact_approximation(solver.kTamsi if self.best else solver.kLagged)
        plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, -scene.g])
        plant.SetUseSampledOutputPorts(False)
        moments = engine.UnitInertia(*(np.array(body.inertia) / body.mass))
        ball = plant.AddRigidBody("body", engine.SpatialInertia(body.mass, np.zeros(3), moments))
        for k, (place, shape) in enumerate(self.shapes()):
            self.add(ball, place, shape, f"body{k}")
        moving = [each for each in scene.surfaces if self.goes_along(each) or each.turning]
        walls = {surface.name: self.moving_body(surface) for surface in moving}
        self.surfaces = {}
        for surface, name, point, normal in self.planes():
            of = walls.get(surface.name, plant.world_body())
            if self.goes_along(surface):
                point, normal = np.zeros(3), np.array([-1.0, 0.0, 0.0])
            number = self.plane(of, point, normal, name, surface)
            self.surfaces[number] = scene.surfaces.index(surface)
        fixed, filters = engine.GeometrySet([*self.surfaces]), engine.CollisionFilterDeclaration()
        graph.collision_filter_manager().Apply(filters.ExcludeWithin(fixed))
        plant.Finalize()
        if self.best:
            plant.set_stiction_tolerance(STICTION)
        self.diagram = builder.Build()  # which, as its context, must outlive the plant's
        self.root = self.diagram.CreateDefaultContext()
        self.context = plant.GetMyMutableContextFromRoot(self.root)
        self.force = np.zeros(plant.num_velocities())
        self.x = plant.GetPositionsAndVelocities(self.context)
        self.ball = self.wall = self.state_slices(ball)
        self.x[self.ball[0]] = [*body.orientation, *body.position]
        self.x[self.ball[1]] = [*body.spin, *body.velocity]
        for surface in moving:
            if surface.turning:
                turns = plant.GetJointByName(surface.name)
                self.x[plant.num_positions() + turns.velocity_start()] = surface.turning
            else:
                self.wall = self.state_slices(walls[surface.name])

    def moving_body(self, surface: Surface) -> Any:
        """The body of a surface that moves: a turntable on its hinge, or one that floats."""
        plant, own = self.plant, self.plant.AddModelInstance(surface.name)
        plant.set_gravity_enabled(own, False)
        # the engine's own stiffness is by mass
        mass = self.scene.body.mass * (1.0 if surface.turning else HEAVY)
        inertia = engine.SpatialInertia(mass, np.zeros(3), engine.UnitInertia(ROUND, ROUND, ROUND))
        body = plant.AddRigidBody(surface.name, own, inertia)
        if surface.turning:
            frames = plant.world_body().body_frame(), body.body_frame()
            plant.AddJoint(engine.RevoluteJoint(surface.name, *frames, [0.0, 0.0, 1.0]))
        return body

    def shapes(self) -> list[tuple[Any, Any]]:
        """Shapes of the body with their poses; a box in the best settings is its corners."""
        body = self.scene.body
        if body.shape == "sphere":
            return [(engine.RigidTransform(), engine.Sphere(*body.size))]
        if not self.best:
            return [(engine.RigidTransform(), engine.Box(*(2 * np.array(body.size))))]
        corners = map(np.array, itertools.product(*((-half, half) for half in body.size)))
        return [(engine.RigidTransform(corner), engine.Sphere(1e-9)) for corner in corners]

    def add(self, of: Any, pose: Any, shape: Any, name: str, friction: float | None = None) -> Any:
        """Register a shape; `friction` is that of the pair of a surface, None for the body."""
        material, mu = engine.ProximityProperties(), self.most
        if friction is not None:  # the harmonic mean of both is the pair's
            mu = mu * friction / (2 * mu - friction) if friction else 0.0
        given = {"dissipation": DISSIPATION, "point_stiffness": STIFFNESS} if self.best else {}
        given |= {"friction": engine.CoulombFriction(mu, mu), "properties": material}
        engine.AddContactMaterial(**given)
        return self.plant.RegisterCollisionGeometry(of, pose, shape, name, material)

    def plane(self, of: Any, point: Array, normal: Array, name: str, surface: Surface) -> Any:
        """Register a plane: a half space, or a side of a cube: many half spaces crash it."""
        if self.best or not self.scene.in_cylinder:
            pose, shape = engine.HalfSpace.MakePose(normal, point), engine.HalfSpace()
        else:
            size = SIZE * max(each.radius or 0.0 for each in self.scene.surfaces)
            turn = engine.RotationMatrix.MakeFromOneVector(normal, 2)
            pose = engine.RigidTransform(turn, point - size / 2 * normal)
            shape = engine.Box(size, size, size)
        return self.add(of, pose, shape, name, surface.friction)

    def state_slices(self, body: Any) -> tuple[slice, slice]:
        """Slices of the state: orientation and place of a free body, and its spin and velocity."""
        at = body.floating_positions_start()
        rate = self.plant.num_positions() + body.floating_velocities_start_in_v()
        return slice(at, at + 7), slice(rate, rate + 6)

    def advance(self) -> None:
        self.plant.get_applied_generalized_force_input_port().FixValue(self.context, self.force)
        self.plant.SetPositionsAndVelocities(self.context, self.x)
        after = self.plant.EvalUniquePeriodicDiscreteUpdate(self.context)
        self.x = after.get_vector(0).CopyToVector()

    def read(self) -> BodyState:
        pose, rate = (self.x[part] for part in self.ball)
        return pose[4:], rate[3:], rate[:3]

    def push(self, force: Vector) -> None:
        first = self.ball[1].start - self.plant.num_positions()
        self.force[first + 3 : first + 6] = force

    def turn(self, point: Array, normal: Array, velocity: Array) -> None:
        self.x[self.wall[0]] = [*facing(normal), *point]
        self.x[self.wall[1]] = [0.0, 0.0, 0.0, *velocity]

    def touches(self) -> list[Touch]:
        results = self.plant.get_contact_results_output_port().Eval(self.context)
        shown = []
        for k in range(results.num_point_pair_contacts()):
            info = results.point_pair_contact_info(k)
            pair = info.point_pair()
            shown.append(self.touch(pair.id_A, pair.id_B, info.contact_force(), -pair.depth))
        return shown


defaults = Drake(
    "drake-defaults", "boxes touch a plane at one point at a time, and tumble from corner to corner"
)
best = Drake(
    "drake",
    "a body that lands overlaps by up to a step's way, and comes out slowly",
    f"TAMSI, {STIFFNESS:.0e} N/m, stiction tolerance {STICTION:g} m/s; a box touches by its "
    "corners",
)
