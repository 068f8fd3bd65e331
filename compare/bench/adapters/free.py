"""What adapters of engines share: one free body, planes for walls, the force set before each step."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Any

from compare.bench.case import FACETS, Case, Surface, Vector
from model.arrays import Array
from model.kinematics import tangent

CHORD = (
    "each step ends along a chord, and the next one takes away what then points into the wall, omega^2 h/2 of the "
    "speed a second"
)
"""Why every engine with velocities in world axes slows a body that goes round in a cylinder."""
CORNERS = "every corner of the facets takes away some of the speed, until the wall no longer carries the ball"
"""Why a ball in facets is slower still."""
State = tuple[Any, Any, Any]
"""Position, velocity and spin in world axes."""


class Free(ABC):
    """A free body in an engine: in the best settings, with a wall that moves along, or as it comes, with facets."""

    PRECISION = "f64"

    def __init__(self, name: str, note: str, best: str = "") -> None:
        """`note`: what is worst, and why; `best` declares settings other than the engine's own; empty for those."""
        self.NAME, self.NOTE, self.best = name, note, bool(best)
        wall = "one plane, set tangent before each step, for a cylinder" if best else f"{FACETS} planes for a cylinder"
        self.DECLARED = "; ".join(filter(None, (wall, best)))
        self.case: Case
        self.timestep = self.now = 0.0

    def build(self, case: Case, timestep: float) -> None:
        """The scene at its start; raises `NotImplementedError` for one that the engine can't have."""
        self.case, self.timestep, self.now = case, timestep, 0.0
        self.make()

    def step(self, n: int) -> None:
        """Take n steps."""
        case = self.case
        turns = self.best and any(surface.radius for surface in case.surfaces)
        for _ in range(n):
            if case.forced or turns:
                position, velocity, _ = self.state()
                if case.forced:
                    self.push(case.force(self.now, position, velocity))
                for surface in case.surfaces if turns else ():
                    if surface.radius:
                        # Halfway through the step: then its way is a chord of the cylinder.
                        x, y = (
                            at + self.timestep / 2 * rate for at, rate in zip(position[:2], velocity[:2], strict=True)
                        )
                        self.turn(*tangent(surface.radius, math.atan2(y, x)))
            self.advance()
            self.now += self.timestep

    def planes(self) -> Iterator[tuple[Surface, str, Array, Array]]:
        """As `Case.planes`: a cylinder's are many, or the one that moves along."""
        return self.case.planes(1 if self.best else FACETS)

    @abstractmethod
    def make(self) -> None:
        """The scene of `case`, with steps of `timestep`."""

    @abstractmethod
    def advance(self) -> None:
        """Take a step."""

    @abstractmethod
    def state(self) -> State:
        """As it is now."""

    def push(self, force: Vector) -> None:
        """Set the force on the centre for the next step, N."""
        raise NotImplementedError("it takes no forces")

    def turn(self, point: Array, normal: Array) -> None:
        """Move the plane that stands for the cylinder."""
        raise NotImplementedError("its planes can't be moved")


def upright(normal: Any) -> tuple[float, float, float, float]:
    """The shortest turn, a unit quaternion, that takes z to a normal."""
    x, y, z = normal
    if z < -1 + 1e-12:
        return 0.0, 1.0, 0.0, 0.0
    w = math.sqrt((1 + z) / 2)
    return w, -y / (2 * w), x / (2 * w), 0.0
