"""An exact contact case as data: one free rigid body in plain geometry whose motion is known to 1e-10.

SI units, world axes with z up. Contacts are rigid, friction is Coulomb's with one coefficient for stick and slip, and
impacts are plastic (no restitution). The body's friction is nothing of its own: the coefficient of a pair is that of
the surface.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from compare.kit.statistics import plain
from model.arrays import Array
from model.kinematics import rotated, tangent

Vector = tuple[float, float, float]
VERSION = 1
"""Of the set of cases; a change of any number in it is another version."""
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
    """``sphere`` or ``box``."""
    size: tuple[float, ...]
    """Radius, or the three half edges, m."""
    mass: float
    """kg"""
    inertia: Vector
    """Principal moments about the centre, kg m2."""
    orientation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    """Unit quaternion, the scalar first."""


class Answers(NamedTuple):
    """The exact motion of a case, and wrong ones."""

    times: Array
    """Of the samples, (n,), s."""
    exact: Array
    """(n, 9): position, velocity and spin of the body at those times."""
    contacts: tuple[str, ...]
    """For each sample a letter a surface: R sticks or rolls, S slips, N does not touch."""
    wrong: Mapping[str, Array]
    """Answers that the case must notice: what is wrong, and `exact` as it would then be."""


@dataclass(frozen=True)
class Case:
    """A body, what it touches, what acts on it, and its exact motion."""

    name: str
    about: str
    """What happens, in a sentence."""
    kind: str
    """Landing if a contact closes, else sticking if the body rests, else sliding if it slips, or rolling."""
    body: Body
    surfaces: tuple[Surface, ...]
    work_out: Callable[[], Answers] = field(repr=False)
    """Called when one of the `answers` is first asked for: a list of the cases needs none."""
    bound: float
    """Of the error of `exact`, in units of `scales`."""
    source: str
    """Where `exact` is from."""
    scales: tuple[float, float, float]
    """By what errors of position (m), velocity (m/s) and spin (rad/s) are divided; infinite: not compared."""
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
    motion: Any = field(default=None, repr=False)
    """Of a ball in the study's vessel: its `model.Parameters` and `model.State` at the start."""

    @cached_property
    def answers(self) -> Answers:
        """The exact motion and wrong ones."""
        return self.work_out()

    @property
    def times(self) -> Array:
        """As of `Answers`, and so the next three."""
        return self.answers.times

    @property
    def exact(self) -> Array:
        return self.answers.exact

    @property
    def contacts(self) -> tuple[str, ...]:
        return self.answers.contacts

    @property
    def wrong(self) -> Mapping[str, Array]:
        return self.answers.wrong

    def __getstate__(self) -> dict[str, Any]:
        """For another process: with the answers, not with what works them out."""
        return vars(self) | {"answers": self.answers, "work_out": None}

    def force(self, t: float, position: Any, velocity: Any) -> Vector:
        """All that acts at the body's centre at a time in s but gravity and contacts, N; engines set it every step."""
        (x, y, *_), (v_x, v_y, v_z), mc = position, velocity, self.body.mass * self.drag
        relative = (v_x + self.flow * y, v_y - self.flow * x, v_z)
        a, b, c = (p + t * q - mc * w for p, q, w in zip(self.pull, self.growth, relative, strict=True))
        return float(a), float(b), float(c)

    @property
    def forced(self) -> bool:
        """Whether `force` is ever other than zero."""
        return any((*self.pull, *self.growth, self.drag))

    def compared(self, states: Array) -> Array:
        """Position, velocity and spin of states (n, 9) as they are compared, (n, 3, 3).

        In a cylinder each is turned about the z axis until the body stands at azimuth zero: a small error of its speed
        grows into any error of the azimuth.
        """
        parts = states.reshape(-1, 3, 3)
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
        """The largest error of states (n, 9): the length of a difference of vectors divided by its scale."""
        off = np.linalg.norm(self.compared(states) - self.compared(self.exact), axis=2) / self.scales
        return float(off.max())

    def touching(self, states: Array) -> tuple[Array, Array]:
        """Gap (m) and slip speed (m/s) of states (n, 9) at each surface, (n, surfaces); a box doesn't turn.

        Where a soft contact lets the body sink in, it touches halfway between its own surface and the other.
        """
        position, velocity, spin = np.split(states, 3, axis=1)
        gaps, slips = [], []
        for surface in self.surfaces:
            away = position - surface.point
            if surface.radius is None:
                normal = np.broadcast_to(surface.normal, away.shape)
                height = np.sum(away * normal, axis=1)
            else:
                rho = np.hypot(away[:, 0], away[:, 1])
                normal = -away * [1, 1, 0] / rho[:, None]
                height = surface.radius - rho
            gap = height - self.reach(normal)
            arm = -(self.reach(normal) + np.minimum(gap, 0.0) / 2)[:, None] * normal
            moves = surface.turning * np.cross([0.0, 0.0, 1.0], away + arm)
            slip = velocity + (np.cross(spin, arm) if self.body.shape == "sphere" else 0) - moves
            slips.append(np.linalg.norm(slip - np.sum(slip * normal, axis=1)[:, None] * normal, axis=1))
            gaps.append(gap)
        return np.stack(gaps, axis=1), np.stack(slips, axis=1)

    def reach(self, normal: Array) -> Array:
        """How far the body reaches from its centre against normals (n, 3), m."""
        if self.body.shape == "sphere":
            return np.full(len(normal), self.body.size[0])
        return np.asarray(np.abs(_into(self.body.orientation, normal)) @ np.array(self.body.size))

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
        """The scene for MuJoCo with all of its contact parameters as they come; `force` is not in it."""
        body, parts = self.body, []
        for surface, name, point, normal in self.planes(FACETS):
            friction = f'friction="{surface.friction} 0 0"'
            if surface.turning:  # a plane can't turn: a disc so heavy that the body doesn't slow it
                parts.append(
                    f'<body name="{surface.name}" pos="{_text(surface.point)}"><joint name="table" axis="0 0 1" '
                    f'armature="1e6"/><geom name="{surface.name}" type="cylinder" size="5 0.5" pos="0 0 -0.5" mass="1" '
                    f"{friction}/></body>"
                )
            else:
                pose = f'pos="{_text(point)}" zaxis="{_text(normal)}"'
                parts.append(f'<geom name="{name}" type="plane" size="0 0 1" {pose} {friction}/>')
        turns = [surface.turning for surface in self.surfaces if surface.turning]
        inwards = _into(body.orientation, body.spin)  # MuJoCo counts the spin of a free body in its own axes
        qpos = [*[0.0] * len(turns), *body.position, *body.orientation]
        qvel = [*turns, *body.velocity, *inwards]
        return f"""<mujoco model="{self.name}">
  <option timestep="{timestep}" gravity="0 0 {-self.g}"/>
  <worldbody>
    {(chr(10) + "    ").join(parts)}
    <body name="body" pos="{_text(body.position)}" quat="{_text(body.orientation)}">
      <freejoint/>
      <inertial pos="0 0 0" mass="{body.mass}" diaginertia="{_text(body.inertia)}"/>
      <geom name="body" type="{body.shape}" size="{_text(body.size)}" friction="0 0 0"/>
    </body>
  </worldbody>
  <keyframe><key name="start" qpos="{_text(qpos)}" qvel="{_text(qvel)}"/></keyframe>
</mujoco>
"""

    def to_mapping(self) -> dict[str, Any]:
        """All of it but the MJCF as JSON-able data; scales that are infinite are None."""
        own = {each.name: getattr(self, each.name) for each in fields(self)}
        data = (
            own
            | self.answers._asdict()
            | {"schema": "dualball-case", "version": VERSION, "steps": TIME_STEPS, "tolerance": TOLERANCE}
        )
        data |= {"turned": self.round, "wrong": {name: self.error(states) for name, states in self.wrong.items()}}
        del data["motion"], data["work_out"]
        return dict(plain(data))


def _text(numbers: Any) -> str:
    return " ".join(repr(float(number) + 0.0) for number in numbers)  # no negative zero


def _into(orientation: tuple[float, ...], vectors: Any) -> Array:
    """Vectors of the world, (3,) or (n, 3), in the axes of a body."""
    w, *axis = orientation
    return rotated(np.array([w, *(-a for a in axis)]), np.array(vectors))
