"""PyBullet with a free body, in double precision; its traps: see `compare.kit.adapters.pybullet`.

One more: where a length unit is so small that things move by 0.4 of it in a step, friction is gone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pybullet as engine

from compare.bench.adapters.free import CORNERS, Free, State
from compare.bench.adapters.simulators import Simulated
from compare.bench.case import Vector, upright
from compare.kit.adapters.pybullet import DEFAULTS, Server, Settings
from model.arrays import Array


class PyBullet(Free):
    """As in `Free`."""

    own: Server

    def make(self) -> None:
        if hasattr(self, "own"):
            self.own.close()
        case, body = self.case, self.case.body
        settings = Settings(scale=10.0) if self.best else DEFAULTS
        self.own = own = Server(engine, replace(settings, timestep=self.timestep), case.g)
        for surface, _, point, normal in self.planes():
            if surface.turning:
                raise NotImplementedError("its planes don't turn")
            self.wall = own.plane(point, np.array([0.0, 0.0, 1.0]), surface.friction)
            self.turn(point, normal)  # boxes rock on a plane that isn't turned, but has another normal than z
        self.body = engine.createMultiBody(body.mass, own.shape(body.size), **own.here)
        own.loosen(self.body, -1, [each * own.scale**2 for each in body.inertia])
        w, *axis = body.orientation
        own.put(self.body, body.position, [*axis, w], body.velocity, body.spin)

    def advance(self) -> None:
        engine.stepSimulation(**self.own.here)

    def read(self) -> State:
        return self.own.state(self.body)

    def push(self, force: Vector) -> None:
        self.own.push(self.body, force)

    def turn(self, point: Array, normal: Array) -> None:
        w, *axis = upright(normal)
        self.own.put(self.wall, point, [*axis, w])


defaults = PyBullet("pybullet-defaults", CORNERS)
free = PyBullet("pybullet", "", "lengths in dm, 200 iterations to round-off, Coulomb's cone")
best = Simulated(
    "pybullet",
    free,
    "lengths in cm there and dm elsewhere, 200 iterations to round-off, Coulomb's cone",
    "a landing is late by up to a step, and forces are those at a step's beginning",
)
