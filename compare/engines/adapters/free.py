"""What adapters of engines share: free bodies, forces, a plane that goes along for a cylinder."""

from __future__ import annotations

import copy
import dataclasses
import importlib
import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from compare.engines.adapters.scene import FACETS, Scene, Surface, Vector
from model import InputError
from model.arrays import Array
from model.kinematics import tangent
from model.versions import ABSENT, absent, version

CORNERS = (
    "every corner of the facets takes away some of the speed, until the wall no longer carries "
    "the ball"
)
"""Why a ball in facets is slow."""
BodyState = tuple[Any, ...]
"""Position, velocity and spin in world axes; of two bodies those of both."""


@dataclass(frozen=True)
class Library:
    """The package that an engine comes in, which may be missing, and the module of its adapters."""

    name: str  # of the package
    module: str

    @property
    def missing(self) -> str:
        """Why the engine can't be used here, and what to do about it; empty if it can."""
        return absent(self.name) if self.version == ABSENT else ""

    @property
    def version(self) -> str:
        """The version that is installed, or that none is."""
        return version(self.name)

    def load(self, member: str) -> Free:
        """A copy of an adapter by its name; `InputError` if the package can't be loaded."""
        if self.missing:
            raise InputError(self.missing)
        try:
            engine: Free = getattr(importlib.import_module(self.module), member)
        except ImportError as error:
            raise InputError(f"{self.name} can't be imported: {error}") from error
        return copy.copy(engine)


def against(
    place: Any, velocity: Any, spin: Any, ahead: float, R: float, r: float
) -> tuple[float, float]:
    """Surface velocity (inwards, up), m/s, that makes a tangent plane act like the cylinder.

    What is at rest against it is so against the cylinder `ahead` s later, when velocities are where
    the place is now. By then the normal has turned by ahead Omega: of the velocity Omega R along
    the wall the share ahead Omega will point into the plane; and where ball and wall touch the
    turning about the normal will show as ahead Omega r o_n of slip. Without the first the ball
    would lose h Omega^2/2 of its speed a second."""
    x, y = place[0] - ahead * velocity[0], place[1] - ahead * velocity[1]
    rho = math.hypot(x, y)
    out_x, out_y = (x / rho, y / rho) if rho > 0 else (0.0, 0.0)
    rate = (out_x * velocity[1] - out_y * velocity[0]) / R
    return ahead * rate * rate * R, -ahead * rate * r * (out_x * spin[0] + out_y * spin[1])


class Touch(NamedTuple):
    """A contact point of the engine, and what it carried in the last step."""

    surface: int  # which of the scene's surfaces
    force: Array  # on the body, in world axes, shape (3,), N
    gap: float  # m


class BreakdownError(RuntimeError):
    """The engine can't take the next step."""


class Free(ABC):
    """A free body in an engine: in the best settings, or as it comes, with facets."""

    PRECISION = "f64"
    FEATURES: tuple[str, ...] = ()  # of `Scene.needs`, what it can do
    AHEAD = 0.5
    """Share of a step by which positions, where contacts and forces are found, are ahead of
    velocities. Semi-implicit steps are leapfrog, of second order, once one says so: in the best
    settings bodies start so far on, and what is read of them is taken back."""
    RESOLUTION = 1e-9  # the least slip speed that the engine tells from rolling, m/s

    TELLS = TURNS = False
    """Whether the engine tells what contacts carry, and whether its planes turn."""

    def __init__(self, name: str, note: str, best: str = "") -> None:
        """`note`: what is worst, and why; `best` declares settings that aren't its own."""
        self.NAME, self.NOTE, self.best = name, note, bool(best)
        moved = "one plane that goes with the body for a cylinder; positions half a step ahead of "
        moved += f"velocities; {best}"
        self.DECLARED = moved if best else f"{FACETS} planes for a cylinder"
        self.scene: Scene
        self.world: Any
        self.timestep = self.now = self.ahead = 0.0
        self.seen: BodyState | None = None
        self.surfaces: dict[Any, int] = {}  # of the scene, by what the engine calls them

    def build(self, scene: Scene, timestep: float) -> None:
        """Put the scene into the engine; raises `NotImplementedError` if it can't have it."""
        self.ahead = self.now = self.AHEAD * timestep * self.best
        body, under = scene.body.after(self.ahead), scene.under and scene.under.after(self.ahead)
        self.scene, self.timestep = dataclasses.replace(scene, body=body, under=under), timestep
        self.make()
        self.seen = None

    def step(self, n: int) -> None:
        """Take n steps."""
        scene = self.scene
        wall = next((each.radius for each in scene.surfaces if self.goes_along(each)), None)
        for _ in range(n):
            if scene.forced:
                self.push(scene.force(self.now, *self.look()[:2]))
            if wall:
                position, velocity, spin = self.look()
                half, r = self.timestep / 2, scene.body.size[0]
                inwards, up = against(position, velocity, spin, half, wall - r, r)
                point, normal = tangent(wall, math.atan2(position[1], position[0]))
                point[2] = position[2]
                self.turn(point, normal, np.append(inwards * normal[:2], up))
            self.advance()
            self.seen = None
            self.now += self.timestep

    def look(self) -> BodyState:
        """The state as the engine has it, read once a step."""
        if self.seen is None:
            self.seen = self.read()
        return self.seen

    def state(self) -> BodyState:
        """The state now: positions are taken back to where velocities are."""
        parts = [np.array(part, float) for part in self.look()]
        for k in range(0, len(parts), 3):
            parts[k] -= self.ahead * parts[k + 1]
        return tuple(parts)

    def goes_along(self, surface: Surface) -> bool:
        """Whether a surface is a cylinder in whose place one plane goes along with the body."""
        return self.best and surface.radius is not None

    def planes(self) -> Iterator[tuple[Surface, str, Array, Array]]:
        """The planes of `Scene.planes`: a cylinder's are many, or one that moves along."""
        if any(surface.turning for surface in self.scene.surfaces) and not self.TURNS:
            raise NotImplementedError("its planes don't turn")
        return self.scene.planes(1 if self.best else FACETS)

    @abstractmethod
    def make(self) -> None:
        """Make `scene` in the engine, with steps of `timestep`."""

    def advance(self) -> None:
        """Take a step."""
        self.world.step()

    @abstractmethod
    def read(self) -> BodyState:
        """Read the state as the engine has it."""

    @abstractmethod
    def push(self, force: Vector) -> None:
        """Set the force on the centre for the next step, N."""

    def turn(self, point: Array, normal: Array, velocity: Array) -> None:  # noqa: B027
        """Place the plane that stands for a cylinder in best settings, with its velocity, m/s."""

    def touches(self) -> list[Touch]:
        """The contact points of the last step, of an engine that `TELLS`."""
        raise NotImplementedError

    def touch(self, first: Any, second: Any, on_second: Array, gap: float) -> Touch:
        """A contact of the body with a surface, either of which is the first."""
        if first in self.surfaces:
            return Touch(self.surfaces[first], on_second, gap)
        return Touch(self.surfaces[second], -on_second, gap)

    def close(self) -> None:  # noqa: B027
        """Release what the engine holds: most hold nothing."""
