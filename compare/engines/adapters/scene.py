"""A body in plain geometry, or one on another, and what acts on it: what an engine is to build.

SI units, world axes with z up. Contacts are rigid, friction is Coulomb's with one coefficient for
stick and slip, and impacts are plastic unless a surface has a restitution. The body's friction is
nothing of its own: the coefficient of a pair is that of the surface."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from model.arrays import Array
from model.kinematics import rotated, tangent

Vector = tuple[float, float, float]
TIME_STEPS = (4e-3, 2e-3, 1e-3)
"""Time steps at which an engine is asked, s; every sample of a case falls on a step of each."""
FACETS = 64  # planes that stand for a cylinder in MJCF, which has no hollow one


@dataclass(frozen=True)
class Surface:
    """A fixed surface: a plane, or the inner side of a vertical cylinder."""

    name: str
    friction: float  # Coulomb's coefficient of the pair of it and the body
    point: Vector = (0.0, 0.0, 0.0)  # a point of the plane, or of the cylinder's axis, m
    normal: Vector = (0.0, 0.0, 1.0)  # of the plane, towards the body
    radius: float | None = None  # of the cylinder, m; None for a plane
    turning: float = 0.0
    """Angular velocity of its material about the vertical through `point`, rad/s; a turntable has
    one."""
    velocity: Vector = (0.0, 0.0, 0.0)  # of its material along itself, m/s; a belt has one
    restitution: float = 0.0
    """Share of its normal speed with which the body leaves it after an impact."""
    across: float | None = None
    """Coulomb's coefficient along y on a level plane whose `friction` is that along x: the force is
    within an ellipse, and the one in it that takes the most power. None: the same in every
    direction."""


@dataclass(frozen=True)
class Body:
    """A rigid body and its start; its centre of mass is the middle of its shape."""

    position: Vector  # of the centre at the start, m
    velocity: Vector  # m/s
    spin: Vector  # angular velocity, rad/s
    shape: str  # ``sphere``, ``box``, ``disc``, round its z axis, or ``tripod``: three spheres
    size: tuple[float, ...]
    """Radius; or the three half edges; or radius and half the thickness; or of a tripod's feet the
    radius, how far from the axis, and how far below the centre they are, the first along x; m."""
    mass: float  # kg
    inertia: Vector  # principal moments about the centre, kg m2
    orientation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    """Unit quaternion, the scalar first."""

    @property
    def parts(self) -> Array:
        """Centres (n, 3) of the shapes that it is made of, in its own axes, m."""
        if self.shape != "tripod":
            return np.zeros((1, 3))
        _, out, down = self.size
        turns = math.tau / 3 * np.arange(3)
        return np.stack([out * np.cos(turns), out * np.sin(turns), np.full(3, -down)], axis=1)

    def after(self, time: float) -> Body:
        """The body that has moved on freely by a short time, s."""
        spin, rate = np.array(self.spin), math.hypot(*self.spin)
        half = rate * time / 2
        cos, turn = math.cos(half), spin / max(rate, 1e-300) * math.sin(half)
        w, *axis = self.orientation
        ours = cos * np.array(axis) + w * turn + np.cross(turn, axis)
        place = np.array(self.position) + time * np.array(self.velocity)
        orientation = (float(cos * w - turn @ axis), *ours.tolist())
        return replace(self, position=(*place.tolist(),), orientation=orientation)


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A body, what it touches and what acts on it."""

    name: str
    body: Body
    surfaces: tuple[Surface, ...]
    g: float = 9.81  # gravity, along -z, m/s2
    pull: Vector = (0.0, 0.0, 0.0)  # a constant force at the centre, N
    growth: Vector = (0.0, 0.0, 0.0)  # a force at the centre that grows with time, N/s
    drag: float = 0.0  # c of a fluid's drag -m c (v - u), 1/s
    flow: float = 0.0  # angular velocity of that fluid about the z axis: u = flow (-y, x, 0), rad/s
    spring: float = 0.0  # stiffness of a spring that draws the centre to the origin, N/m
    joint: Vector | None = None
    """The way that a joint leaves to the body, which doesn't turn then; None: it is free."""
    dry: float = 0.0  # dry friction in that joint, N
    under: Body | None = None
    """A second body, on which the first one stands. It alone touches the surfaces."""
    between: float = 0.0  # Coulomb's coefficient of the two bodies

    def force(self, t: float, position: Any, velocity: Any) -> Vector:
        """All that acts at the body's centre at a time but gravity and contacts, N."""
        (x, y, *_), (v_x, v_y, v_z), mc = position, velocity, self.body.mass * self.drag
        relative = (v_x + self.flow * y, v_y - self.flow * x, v_z)
        pulls = zip(self.pull, self.growth, relative, position, strict=True)
        a, b, c = (p + t * q - mc * w - self.spring * s for p, q, w, s in pulls)
        return float(a), float(b), float(c)

    @property
    def forced(self) -> bool:
        """Whether `force` is ever other than zero."""
        return any((*self.pull, *self.growth, self.drag, self.spring))

    @property
    def bodies(self) -> tuple[Body, ...]:
        """The body, and the one under it if there is one."""
        return (self.body, self.under) if self.under else (self.body,)

    @property
    def needs(self) -> tuple[str, ...]:
        """Features that not every engine has; one that does names them in `FEATURES`."""
        asked = {
            "two bodies": self.under,
            "moving surface": any(any(surface.velocity) for surface in self.surfaces),
            "restitution": any(surface.restitution for surface in self.surfaces),
            "dry joint": self.joint,
            "tripod": self.body.shape == "tripod",
            "disc": self.body.shape == "disc",
            "anisotropic friction": any(surface.across for surface in self.surfaces),
        }
        return tuple(name for name, needed in asked.items() if needed)

    @property
    def in_cylinder(self) -> bool:
        """Whether the body is in a cylinder about the z axis."""
        return any(surface.radius is not None for surface in self.surfaces)

    def planes(self, facets: int) -> Iterator[tuple[Surface, str, Array, Array]]:
        """Each surface with a name, a point and the normal of a plane; a cylinder's are so many."""
        for surface in self.surfaces:
            if surface.radius is None:
                yield surface, surface.name, np.array(surface.point), np.array(surface.normal)
            else:
                for k in range(facets):
                    plane = tangent(surface.radius, math.tau * k / facets)
                    yield surface, f"{surface.name}{k}", *plane

    def mjcf(self, timestep: float = 1e-3) -> str:
        """The scene for MuJoCo, as it comes; it lacks `force` and restitution."""
        named = reversed([*zip(("body", "under"), self.bodies, strict=False)])
        bodies, *start = zip(*(self._body_mjcf(name, body) for name, body in named), strict=True)
        parts = "\n    ".join([*self._surfaces_mjcf(), *bodies])
        qpos, qvel = (_text(itertools.chain(*each)) for each in start)
        return f"""<mujoco model="{self.name}">
  <option timestep="{timestep}" gravity="0 0 {-self.g}"/>
  <worldbody>
    {parts}
  </worldbody>
  <contact>{"".join(self._pairs_mjcf())}</contact>
  <keyframe><key name="start" qpos="{qpos}" qvel="{qvel}"/></keyframe>
</mujoco>
"""

    def _surfaces_mjcf(self) -> Iterator[str]:
        """Planes, as elements of MJCF."""
        for surface, name, point, normal in self.planes(FACETS):
            turn = upright(normal)
            along = in_body_axes(turn, np.array(surface.velocity))
            moves = (*along, 0.0, 0.0, surface.turning)
            belt = f'surfacevel="{_text(moves)}" ' if any(moves) else ""
            yield (
                f'<geom name="{name}" type="plane" size="0 0 1" pos="{_text(point)}" '
                f'quat="{_text(turn)}" {belt}friction="{surface.friction} 0 0"/>'
            )

    def _body_mjcf(self, name: str, body: Body) -> tuple[str, list[float], list[float]]:
        """A body as an element of MJCF; its coordinates and velocities at the start."""
        joint, shape = "<freejoint/>", {"tripod": "sphere", "disc": "cylinder"}.get(body.shape)
        # MuJoCo counts the spin of a free body in its own axes.
        spin = in_body_axes(body.orientation, body.spin)
        qpos, qvel = [*body.position, *body.orientation], [*body.velocity, *spin]
        if self.joint:
            joint = f'<joint type="slide" axis="{_text(self.joint)}" frictionloss="{self.dry}"/>'
            qpos, qvel = [0.0], [float(np.dot(self.joint, body.velocity))]
        size = body.size[:1] if body.shape == "tripod" else body.size
        look = f'type="{shape or body.shape}" size="{_text(size)}"'
        geoms = [
            f'<geom name="{name}{k or ""}" {look} pos="{_text(at)}" friction="0 0 0"/>'
            for k, at in enumerate(body.parts)
        ]
        at = f'pos="{_text(body.position)}" quat="{_text(body.orientation)}"'
        element = f"""<body name="{name}" {at}>
      {joint}
      <inertial pos="0 0 0" mass="{body.mass}" diaginertia="{_text(body.inertia)}"/>
      {_INDENT.join(geoms)}
    </body>"""
        return element, qpos, qvel

    def _pairs_mjcf(self) -> Iterator[str]:
        """Contact pairs whose friction isn't that of a surface, as elements of MJCF."""
        lowest = ("body", "under")[len(self.bodies) - 1]
        frictions = [("under", "body", self.between, self.between)] if self.under else []
        # The engine's first direction on a level plane is y, its second one x.
        for surface in self.surfaces:
            if surface.across:
                frictions.append((surface.name, lowest, surface.across, surface.friction))
        for one, other, first, second in frictions:
            yield f'<pair geom1="{one}" geom2="{other}" friction="{first} {second} 0 0 0"/>'


_INDENT = "\n      "


def _text(numbers: Any) -> str:
    """Numbers as an MJCF attribute."""
    return " ".join(repr(float(number) + 0.0) for number in numbers)  # no negative zero


def in_body_axes(orientation: tuple[float, ...], vectors: Any) -> Array:
    """Vectors (3,) or (n, 3) in world axes, in the axes of a body (a unit quaternion)."""
    w, *axis = orientation
    return rotated(np.array([w, *(-a for a in axis)]), np.array(vectors))


def facing(normal: Any) -> tuple[float, float, float, float]:
    """The turn about z, a unit quaternion, that takes -x to a horizontal normal."""
    half = math.atan2(-normal[1], -normal[0]) / 2
    return math.cos(half), 0.0, 0.0, math.sin(half)


def upright(normal: Any) -> tuple[float, float, float, float]:
    """The shortest turn, a unit quaternion, that takes z to a normal."""
    x, y, z = normal
    if z < -1 + 1e-12:
        return 0.0, 1.0, 0.0, 0.0
    w = math.sqrt((1 + z) / 2)
    return w, -y / (2 * w), x / (2 * w), 0.0
