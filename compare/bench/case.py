"""An exact contact case as data: a rigid body, or one on another, in plain geometry whose motion is known to 1e-10.

SI units, world axes with z up. Contacts are rigid, friction is Coulomb's with one coefficient for stick and slip, and
impacts are plastic unless a surface has a restitution. The body's friction is nothing of its own: the coefficient of a
pair is that of the surface.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from compare.kit.statistics import plain
from model import InputError
from model.arrays import Array
from model.files import reading_json
from model.kinematics import rotated, tangent

Vector = tuple[float, float, float]
VERSION = 2
"""Of the set of cases and their files; a change of any number is another version. 2 has all of 1."""
TIME_STEPS = (4e-3, 2e-3, 1e-3)
"""Time steps at which an engine is asked, s; every sample of a case falls on a step of each."""
TOLERANCE = 1e-2
"""Error, in units of the case's scales, up to which an engine passes at the shortest step. A method of first order is
wrong by about a step divided by the time that the motion takes to change, 1 ms by 0.1 s or more; every wrong answer
that a case must notice is off by several times as much."""
FACETS = 64
"""Planes that stand for a cylinder in MJCF, which has no hollow one."""


@dataclass(frozen=True)
class Surface:
    """A fixed surface: a plane, or the inner side of a vertical cylinder."""

    name: str
    friction: float
    """Coulomb's coefficient of the pair of it and the body."""
    point: Vector = (0.0, 0.0, 0.0)
    """A point of the plane, or of the cylinder's axis, m."""
    normal: Vector = (0.0, 0.0, 1.0)
    """Of the plane, towards the body."""
    radius: float | None = None
    """Of the cylinder, m; None for a plane."""
    turning: float = 0.0
    """Angular velocity of its material about the vertical through `point`, rad/s; a turntable has one."""
    velocity: Vector = (0.0, 0.0, 0.0)
    """Of its material along itself, m/s; a belt has one."""
    restitution: float = 0.0
    """Share of its normal speed with which the body leaves it after a blow."""


@dataclass(frozen=True)
class Body:
    """A rigid body and its start; its centre of mass is the middle of its shape."""

    position: Vector
    """Of the centre at the start, m."""
    velocity: Vector
    """m/s"""
    spin: Vector
    """Angular velocity, rad/s."""
    shape: str
    """``sphere``, ``box`` or ``tripod``: three spheres that are joined, and stand."""
    size: tuple[float, ...]
    """Radius; or the three half edges; or of a tripod's feet the radius, how far from the axis, and how far below the
    centre they are, the first along x; m."""
    mass: float
    """kg"""
    inertia: Vector
    """Principal moments about the centre, kg m2."""
    orientation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    """Unit quaternion, the scalar first."""

    @property
    def parts(self) -> Array:
        """Where the centres of its shapes are, (n, 3), in its own axes, m."""
        if self.shape != "tripod":
            return np.zeros((1, 3))
        _, out, down = self.size
        turns = math.tau / 3 * np.arange(3)
        return np.stack([out * np.cos(turns), out * np.sin(turns), np.full(3, -down)], axis=1)

    def after(self, time: float) -> Body:
        """The body that has moved on freely by a short time, s."""
        spin, rate = np.array(self.spin), math.hypot(*self.spin)
        turn = np.append(math.cos(rate * time / 2), spin / max(rate, 1e-300) * math.sin(rate * time / 2))
        w, *axis = self.orientation
        ours = turn[0] * np.array(axis) + w * turn[1:] + np.cross(turn[1:], axis)
        place = np.array(self.position) + time * np.array(self.velocity)
        orientation = (float(turn[0] * w - turn[1:] @ axis), *ours.tolist())
        return replace(self, position=(*place.tolist(),), orientation=orientation)


@dataclass(frozen=True)
class Case:
    """A body, what it touches, what acts on it, and its exact motion."""

    name: str
    about: str
    """What happens, in a sentence."""
    body: Body
    surfaces: tuple[Surface, ...]
    times: Array = field(repr=False)
    """Of the samples, (n,), s."""
    exact: Array = field(repr=False)
    """(n, 9): position, velocity and spin of the body at those times; (n, 18) with those of `under`."""
    contacts: tuple[str, ...] = field(repr=False)
    """For each sample a letter a surface: R sticks or rolls, S slips, N does not touch, T stands on an edge of a body
    that turns; then one for what is `between` two bodies, or for a joint."""
    bound: float
    """Of the error of `exact`, in units of `scales`."""
    source: str
    """Where `exact` is from."""
    scales: tuple[float, float, float]
    """By what errors of position (m), velocity (m/s) and spin (rad/s) are divided; infinite: not compared."""
    wrong: Mapping[str, Array] = field(default_factory=dict, repr=False)
    """Answers that the case must notice: what is wrong, and `exact` as it would then be."""
    g: float = 9.81
    """Gravity, along -z, m/s2."""
    pull: Vector = (0.0, 0.0, 0.0)
    """A constant force at the centre, N."""
    growth: Vector = (0.0, 0.0, 0.0)
    """A force at the centre that grows with time, N/s."""
    drag: float = 0.0
    """c of a fluid's drag -m c (v - u), 1/s."""
    flow: float = 0.0
    """Angular velocity of that fluid about the z axis: u = flow (-y, x, 0), rad/s."""
    spring: float = 0.0
    """Stiffness of a spring that draws the centre to the origin, N/m."""
    joint: Vector | None = None
    """The way that a joint leaves to the body, which doesn't turn then; None: it is free."""
    dry: float = 0.0
    """Dry friction in that joint, N."""
    under: Body | None = None
    """A second body, on which the first one stands. It alone touches the surfaces."""
    between: float = 0.0
    """Coulomb's coefficient of the two bodies."""
    motion: Any = field(default=None, repr=False)
    """Of a ball in the study's vessel: its `model.Parameters` and `model.State` at the start."""

    @property
    def kind(self) -> str:
        """Landing if a contact closes, else sticking if the body rests, sliding if it slips, or rolling."""
        alike = zip(*self.contacts, strict=True)
        if (
            "restitution" in self.needs
            or "T" in self.contacts
            or any("N" in letters and set(letters) != {"N"} for letters in alike)
        ):
            return "landing"
        if (abs(self.exact[:, 3:]).max(axis=1) == 0).any():
            return "sticking"
        return "sliding" if any("S" in letters for letters in self.contacts) else "rolling"

    def force(self, t: float, position: Any, velocity: Any) -> Vector:
        """All that acts at the body's centre at a time in s but gravity and contacts, N; engines set it every step."""
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
        """What version 1 of the cases had not: an engine that takes it says so in `FEATURES`."""
        asked = {
            "two bodies": self.under,
            "moving surface": any(any(surface.velocity) for surface in self.surfaces),
            "restitution": any(surface.restitution for surface in self.surfaces),
            "dry joint": self.joint,
            "tripod": self.body.shape == "tripod",
        }
        return tuple(name for name, needed in asked.items() if needed)

    def compared(self, states: Array) -> Array:
        """Position, velocity and spin of states (n, 9 or 18) as they are compared, (n, 3 or 6, 3).

        In a cylinder each is turned about the z axis until the body stands at azimuth zero: a small error of its speed
        grows into any error of the azimuth.
        """
        parts = states.reshape(len(states), -1, 3)
        if not self.round:
            return parts
        x, y, _ = parts[:, 0].T
        cos, sin, zero = x / np.hypot(x, y), y / np.hypot(x, y), 0 * x
        turn = np.array([[cos, sin, zero], [-sin, cos, zero], [zero, zero, zero + 1]])
        return np.asarray(np.einsum("ijn,nkj->nki", turn, parts))

    @property
    def round(self) -> bool:
        """Whether the body is in a cylinder about the z axis."""
        return any(surface.radius is not None for surface in self.surfaces)

    def error(self, states: Array) -> float:
        """The largest error of states (n, 9 or 18): the length of a difference of vectors divided by its scale."""
        off = np.linalg.norm(self.compared(states) - self.compared(self.exact), axis=2)
        off /= np.tile(self.scales, len(self.bodies))
        return float(off.max())

    def touching(self, states: Array) -> tuple[Array, Array]:
        """Gap (m) and slip speed (m/s) of states (n, 9 or 18) at each contact, (n, contacts); only spheres turn.

        Where a soft contact lets the body sink in, it touches halfway between its own surface and the other.
        """
        body = self.bodies[-1]
        position, velocity, spin = np.split(states[:, -9:], 3, axis=1)
        gaps, slips = [np.zeros((0, len(states)))], [np.zeros((0, len(states)))]

        def meet(gap: Array, slip: Array, normal: Array) -> None:
            gaps.append(gap[None])
            slips.append(np.linalg.norm(slip - np.sum(slip * normal, axis=1)[:, None] * normal, axis=1)[None])

        for surface in self.surfaces:
            away = position - surface.point
            if surface.radius is None:
                normal = np.broadcast_to(surface.normal, away.shape)
                height = np.sum(away * normal, axis=1)
            else:
                rho = np.hypot(away[:, 0], away[:, 1])
                normal = -away * [1, 1, 0] / rho[:, None]
                height = surface.radius - rho
            gap = height - reach(body, normal)
            arm = -(reach(body, normal) + np.minimum(gap, 0.0) / 2)[:, None] * normal
            moves = surface.velocity + surface.turning * np.cross([0.0, 0.0, 1.0], away + arm)
            meet(gap, velocity + (np.cross(spin, arm) if body.shape == "sphere" else 0) - moves, normal)
        if self.under:
            apart = states[:, :3] - position
            height = np.sum(apart * normal, axis=1)
            meet(height - reach(self.body, normal) - reach(body, normal), states[:, 3:6] - velocity, normal)
        if self.joint:
            meet(np.zeros(len(states)), velocity, np.zeros(3))
        return np.concatenate(gaps).T, np.concatenate(slips).T

    def planes(self, facets: int) -> Iterator[tuple[Surface, str, Array, Array]]:
        """Each surface with a name, a point and the normal of a plane; a cylinder's are so many."""
        for surface in self.surfaces:
            if surface.radius is None:
                yield surface, surface.name, np.array(surface.point), np.array(surface.normal)
            else:
                for k in range(facets):
                    yield surface, f"{surface.name}{k}", *tangent(surface.radius, math.tau * k / facets)

    def in_contact(self, letters: str) -> Array:
        """Where the exact motion has one of these letters, (n, surfaces)."""
        return np.array([[letter in letters for letter in sample] for sample in self.contacts])

    def mjcf(self, timestep: float = 1e-3) -> str:
        """The scene for MuJoCo with all of its contact parameters as they come; it lacks `force` and restitution."""
        parts: list[str] = []
        qpos: list[float] = []
        qvel: list[float] = []
        for surface, name, point, normal in self.planes(FACETS):
            moves = (*_into(upright(normal), np.array(surface.velocity)), 0.0, 0.0, surface.turning)
            pose = f'pos="{_text(point)}" quat="{_text(upright(normal))}"'
            belt = f'surfacevel="{_text(moves)}" ' if any(moves) else ""
            parts.append(
                f'<geom name="{name}" type="plane" size="0 0 1" {pose} {belt}friction="{surface.friction} 0 0"/>'
            )
        for name, body in reversed([*zip(("body", "under"), self.bodies, strict=False)]):
            joint = f'<joint type="slide" axis="{_text(self.joint)}" frictionloss="{self.dry}"/>' if self.joint else ""
            shape, size = ("sphere", body.size[:1]) if body.shape == "tripod" else (body.shape, body.size)
            geoms = [
                f'<geom name="{name}{k or ""}" type="{shape}" size="{_text(size)}" pos="{_text(at)}" friction="0 0 0"/>'
                for k, at in enumerate(body.parts)
            ]
            parts.append(f"""<body name="{name}" pos="{_text(body.position)}" quat="{_text(body.orientation)}">
      {joint or "<freejoint/>"}
      <inertial pos="0 0 0" mass="{body.mass}" diaginertia="{_text(body.inertia)}"/>
      {(chr(10) + "      ").join(geoms)}
    </body>""")
            # MuJoCo counts the spin of a free body in its own axes.
            free = [*body.position, *body.orientation], [*body.velocity, *_into(body.orientation, body.spin)]
            start = ([0.0], [float(np.dot(self.joint, body.velocity))]) if self.joint else free
            qpos, qvel = qpos + start[0], qvel + start[1]
        pair = (
            f'<pair geom1="under" geom2="body" friction="{self.between} {self.between} 0 0 0"/>' if self.under else ""
        )
        return f"""<mujoco model="{self.name}">
  <option timestep="{timestep}" gravity="0 0 {-self.g}"/>
  <worldbody>
    {(chr(10) + "    ").join(parts)}
  </worldbody>
  <contact>{pair}</contact>
  <keyframe><key name="start" qpos="{_text(qpos)}" qvel="{_text(qvel)}"/></keyframe>
</mujoco>
"""

    def to_mapping(self) -> dict[str, Any]:
        """All of it but the MJCF as JSON-able data; scales that are infinite are None."""
        data = vars(self) | {"schema": "dualball-case", "version": VERSION, "steps": TIME_STEPS, "tolerance": TOLERANCE}
        data |= {"turned": self.round, "wrong": {name: self.error(states) for name, states in self.wrong.items()}}
        del data["motion"]
        return dict(plain(data))


def _text(numbers: Any) -> str:
    return " ".join(repr(float(number) + 0.0) for number in numbers)  # no negative zero


def _into(orientation: tuple[float, ...], vectors: Any) -> Array:
    """Vectors of the world, (3,) or (n, 3), in the axes of a body."""
    w, *axis = orientation
    return rotated(np.array([w, *(-a for a in axis)]), np.array(vectors))


def reach(body: Body, normal: Array) -> Array:
    """How far a body reaches from its centre against normals (n, 3), m; a box or a tripod as it stood at the start."""
    if body.shape == "box":
        return np.asarray(np.abs(_into(body.orientation, normal)) @ np.array(body.size))
    return np.full(len(normal), body.size[0] + (body.size[2] if body.shape == "tripod" else 0.0))


def upright(normal: Any) -> tuple[float, float, float, float]:
    """The shortest turn, a unit quaternion, that takes z to a normal."""
    x, y, z = normal
    if z < -1 + 1e-12:
        return 0.0, 1.0, 0.0, 0.0
    w = math.sqrt((1 + z) / 2)
    return w, -y / (2 * w), x / (2 * w), 0.0


def read(path: Path) -> Case:
    """A case from a file that `dualball cases -o` wrote, of this version or version 1; without its wrong answers.

    Raises
    ------
    StorageError
        If the file can't be read, or lacks something.
    InputError
        If it is of another schema or version.
    """
    with reading_json(path, "exact case") as data:
        if (schema := data["schema"]) != "dualball-case":
            raise InputError(f"{path} is no exact case: its schema is {schema!r}, not 'dualball-case'")
        if (written := data["version"]) not in range(1, VERSION + 1):
            raise InputError(f"{path} is of version {written!r} of the exact cases; this program reads 1 to {VERSION}")
        own = {each.name: data[each.name] for each in fields(Case) if each.name in data and each.name != "wrong"}
        own["scales"] = [math.inf if scale is None else scale for scale in own["scales"]]
        own["surfaces"] = [Surface(**_tuples(surface)) for surface in own["surfaces"]]
        own |= {name: Body(**_tuples(own[name])) for name in ("body", "under") if own.get(name)}
        return Case(**_tuples(own) | {name: np.array(own[name], float) for name in ("times", "exact")})


def _tuples(data: Mapping[str, Any]) -> dict[str, Any]:
    return {name: tuple(value) if isinstance(value, list) else value for name, value in data.items()}
