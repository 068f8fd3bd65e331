"""Drake with a free body: a discrete plant with point contact; its traps: see `compare.kit.adapters.drake`."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pydrake.all as engine

from compare.bench.adapters.free import Free, State
from compare.bench.adapters.simulators import Simulated
from compare.bench.case import Vector
from compare.kit.adapters.drake import DEFAULTS, Plant, Settings
from model.arrays import Array

HEAVY = 1e6
"""Moment of inertia of a table divided by its mass, m2, so that nothing slows it."""


class Drake(Free):
    """As in `Free`."""

    def make(self) -> None:
        case, body = self.case, self.case.body
        most = max(surface.friction for surface in case.surfaces)
        settings = replace(Settings() if self.best else DEFAULTS, timestep=self.timestep)
        self.own = Plant(engine, settings, case.g, most)
        plant = self.own.plant
        moments = engine.UnitInertia(*(np.array(body.inertia) / body.mass))
        ball = plant.AddRigidBody("body", engine.SpatialInertia(body.mass, np.zeros(3), moments))
        for k, (place, shape) in enumerate(self.shapes()):
            self.own.add(ball, place, shape, f"body{k}")
        self.wall, hinges = None, []
        facets = max((surface.radius or 0.0) for surface in case.surfaces) if not self.best else 0.0
        for surface, name, point, normal in self.planes():
            of = plant.world_body()
            if not facets and (surface.radius or surface.turning):
                heavy = engine.UnitInertia(HEAVY, HEAVY, HEAVY)
                of = plant.AddRigidBody(surface.name, engine.SpatialInertia(body.mass, np.zeros(3), heavy))
                frames = plant.world_body().body_frame(), of.body_frame()
                hinges.append((surface, plant.AddJoint(engine.RevoluteJoint(surface.name, *frames, [0.0, 0.0, 1.0]))))
            self.own.plane(of, point, normal, name, surface.friction, 100.0 * facets)
        self.own.build()
        self.force = np.zeros(plant.num_velocities())
        self.q, self.v = ball.floating_positions_start(), plant.num_positions() + ball.floating_velocities_start_in_v()
        self.x = plant.GetPositionsAndVelocities(self.own.context)
        self.x[self.q : self.q + 7] = [*body.orientation, *body.position]
        self.x[self.v : self.v + 6] = [*body.spin, *body.velocity]
        for surface, joint in hinges:
            self.x[plant.num_positions() + joint.velocity_start()] = surface.turning
            if surface.radius:
                joint.Lock(self.own.context)
                self.wall = joint.position_start()

    def shapes(self) -> list[tuple[Any, Any]]:
        """The shape of the body; a box in the best settings is its corners."""
        body = self.case.body
        if body.shape == "sphere" or not self.best:
            whole = engine.Sphere(*body.size) if body.shape == "sphere" else engine.Box(*(2 * np.array(body.size)))
            return [(engine.RigidTransform(), whole)]
        corners = itertools.product(*((-half, half) for half in body.size))
        return [(engine.RigidTransform(np.array(corner)), engine.Sphere(1e-9)) for corner in corners]

    def advance(self) -> None:
        self.x = self.own.after(self.x, self.force)

    def read(self) -> State:
        return self.x[self.q + 4 :][:3], self.x[self.v + 3 :][:3], self.x[self.v :][:3]

    def push(self, force: Vector) -> None:
        self.force[self.v - self.own.plant.num_positions() + 3 :][:3] = force

    def turn(self, point: Array, normal: Array) -> None:
        self.x[self.wall] = math.atan2(-normal[1], -normal[0])


defaults = Drake("drake-defaults", "boxes touch a plane at one point at a time, and tumble from corner to corner")
free = Drake("drake", "", "TAMSI, 1e10 N/m, stiction tolerance 1e-8 m/s; a box touches by its corners")
best = Simulated(
    "drake",
    free,
    "TAMSI, 1e10 N/m, stiction tolerance 1e-8 m/s; a box touches by its corners",
    "a ball that lands overlaps by up to a step's way, and comes out slowly",
)
