"""An exact contact case as data: a scene whose motion is known to 1e-10, and its error."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from compare.engines.adapters.scene import TIME_STEPS, Body, Scene, in_body_axes
from compare.method.statistics import plain
from model.arrays import Array

VERSION = 3  # of the set of cases and their files; a change of any number is another version
TOLERANCE = 1e-2
"""Error, in units of the case's scales, up to which an engine passes at the shortest step. A method
of first order is wrong by about a step divided by the time that the motion takes to change, 1 ms by
0.1 s or more; every wrong answer that a case must notice is off by several times as much."""


@dataclass(frozen=True, kw_only=True)
class ContactCase(Scene):
    """A scene and its exact motion."""

    about: str  # what happens, in a sentence
    times: Array = field(repr=False)  # of the samples, (n,), s
    exact: Array = field(repr=False)
    """(n, 9): position, velocity and spin at those times; (n, 18) with those of `under`."""
    contacts: tuple[str, ...] = field(repr=False)
    """For each sample a letter a surface: R sticks or rolls, S slips, N does not touch, T stands on
    an edge of a body that turns; then one for what is `between` two bodies, or for a joint."""
    bound: float  # of the error of `exact`, in units of `scales`
    source: str  # where `exact` is from
    scales: tuple[float, float, float]
    """Of position (m), velocity (m/s) and spin (rad/s); infinite: not compared."""
    wrong: Mapping[str, Array] = field(default_factory=dict, repr=False)
    """Answers that the case must notice: what is wrong, and `exact` as it would then be."""
    motion: Any = field(default=None, repr=False)
    """Of a ball in the study's vessel: its `model.Parameters` and `model.State` at the start."""

    @property
    def kind(self) -> str:
        """Landing if a contact closes, else sticking, sliding or rolling."""
        alike = zip(*self.contacts, strict=True)
        if (
            "restitution" in self.needs
            or ("T" in self.contacts and self.body.shape == "box")
            or any("N" in letters and set(letters) != {"N"} for letters in alike)
        ):
            return "landing"
        if (abs(self.exact[:, 3:]).max(axis=1) == 0).any():
            return "sticking"
        return "sliding" if any("S" in letters for letters in self.contacts) else "rolling"

    def compared(self, states: Array) -> Array:
        """Position, velocity and spin of states (n, 9 or 18) as they are compared, (n, 3 or 6, 3).

        In a cylinder each is turned about the z axis until the body stands at azimuth zero: a small
        error of its speed grows into any error of the azimuth."""
        parts = states.reshape(len(states), -1, 3)
        if not self.in_cylinder:
            return parts
        x, y, _ = parts[:, 0].T
        cos, sin, zero = x / np.hypot(x, y), y / np.hypot(x, y), 0 * x
        turn = np.array([[cos, sin, zero], [-sin, cos, zero], [zero, zero, zero + 1]])
        return np.asarray(np.einsum("ijn,nkj->nki", turn, parts))

    def error(self, states: Array) -> float:
        """The largest error of states (n, 9 or 18): of a vector, divided by its scale."""
        off = np.linalg.norm(self.compared(states) - self.compared(self.exact), axis=2)
        off /= np.tile(self.scales, len(self.bodies))
        return float(off.max())

    def touching(self, states: Array) -> tuple[Array, Array]:
        """Gap (m) and slip speed (m/s) of states (n, 9 or 18) at each contact, (n, contacts); only
        spheres turn.

        A soft contact touches halfway between the body's own surface and the other."""
        body = self.bodies[-1]
        position, velocity, spin = np.split(states[:, -9:], 3, axis=1)
        found = list[tuple[Array, Array, Array]]()  # gap, slip and normal
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
            turns = np.cross(spin, arm) if body.shape == "sphere" else 0
            found.append((gap, velocity + turns - moves, normal))
        if self.under:
            apart = states[:, :3] - position
            gap = np.sum(apart * normal, axis=1) - reach(self.body, normal) - reach(body, normal)
            found.append((gap, states[:, 3:6] - velocity, normal))
        if self.joint:
            found.append((np.zeros(len(states)), velocity, np.zeros(3)))
        gaps = [gap for gap, _, _ in found]
        slips = [slip - np.sum(slip * n, axis=1)[:, None] * n for _, slip, n in found]
        speeds = [np.linalg.norm(slip, axis=1) for slip in slips]
        return np.stack(gaps, axis=1), np.stack(speeds, axis=1)

    def in_contact(self, letters: str) -> Array:
        """Where contacts of the exact motion are in one of these states; (n, surfaces)."""
        return np.array([[letter in letters for letter in sample] for sample in self.contacts])

    def to_mapping(self) -> dict[str, Any]:
        """The case without its MJCF as JSON-able data; scales that are infinite are None."""
        wrong = {name: self.error(states) for name, states in self.wrong.items()}
        data = vars(self) | {"schema": "dualball-case", "version": VERSION, "steps": TIME_STEPS}
        data |= {"tolerance": TOLERANCE, "turned": self.in_cylinder, "wrong": wrong}
        del data["motion"]
        return dict(plain(data))


def reach(body: Body, normal: Array) -> Array:
    """How far a body in its first orientation extends from its centre against normals (n, 3), m."""
    if body.shape == "disc":
        along = np.abs(in_body_axes(body.orientation, normal)[..., 2])
        across = np.sqrt(np.maximum(1 - along**2, 0.0))
        return np.asarray(body.size[0] * across + body.size[1] * along)
    if body.shape == "box":
        return np.asarray(np.abs(in_body_axes(body.orientation, normal)) @ np.array(body.size))
    return np.full(len(normal), body.size[0] + (body.size[2] if body.shape == "tripod" else 0.0))
