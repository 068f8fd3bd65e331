"""What adapters of engines share: free bodies, planes for walls, the force set before each step."""

from __future__ import annotations

import dataclasses
import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from typing import Any

import numpy as np

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
State = tuple[Any, ...]
"""Position, velocity and spin in world axes; of two bodies those of both."""


class Free(ABC):
    """A free body in an engine: in the best settings, with a wall that moves along, or as it comes, with facets."""

    PRECISION = "f64"
    FEATURES: tuple[str, ...] = ()
    """Of `Case.needs`, what it can do."""
    AHEAD = 0.5
    """Share of a step by which positions, where contacts and forces are found, are ahead of velocities. Semi-implicit
    steps are leapfrog, of second order, once one says so: in the best settings bodies start so far on, and what is read
    of them is taken back."""

    def __init__(self, name: str, note: str, best: str = "") -> None:
        """`note`: what is worst, and why; `best` declares settings other than the engine's own; empty for those."""
        self.NAME, self.NOTE, self.best = name, note, bool(best)
        moved = "one plane, set tangent before each step, for a cylinder; positions half a step ahead of velocities"
        self.DECLARED = "; ".join(filter(None, (moved if best else f"{FACETS} planes for a cylinder", best)))
        self.case: Case
        self.timestep = self.now = self.ahead = 0.0

    def build(self, case: Case, timestep: float) -> None:
        """The scene at its start; raises `NotImplementedError` for one that the engine can't have."""
        self.ahead = self.now = self.AHEAD * timestep * self.best
        body, under = case.body.after(self.ahead), case.under and case.under.after(self.ahead)
        self.case, self.timestep = dataclasses.replace(case, body=body, under=under), timestep
        self.make()

    def step(self, n: int) -> None:
        """Take n steps."""
        case = self.case
        turns = self.best and any(surface.radius for surface in case.surfaces)
        for _ in range(n):
            if case.forced or turns:
                position, velocity, *_ = self.read()
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

    def state(self) -> State:
        """As it is now: positions are taken back to where velocities are."""
        parts = [np.array(part, float) for part in self.read()]
        for k in range(0, len(parts), 3):
            parts[k] -= self.ahead * parts[k + 1]
        return tuple(parts)

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
    def read(self) -> State:
        """As the engine has it."""

    def push(self, force: Vector) -> None:
        """Set the force on the centre for the next step, N."""
        raise NotImplementedError("it takes no forces")

    def turn(self, point: Array, normal: Array) -> None:
        """Move the plane that stands for the cylinder."""
        raise NotImplementedError("its planes can't be moved")
