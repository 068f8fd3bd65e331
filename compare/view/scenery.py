"""The MuJoCo scene of a run, dressed up for pictures."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
from matplotlib.colors import to_rgb

from compare.figures.style import BALL
from mjsim import ContactSettings, scene
from model import InputError, Parameters, Trajectory

HIDDEN = 5
"""A group of geoms that isn't drawn."""


def spec(run: Trajectory) -> Any:
    """The scene as an `mujoco.MjSpec`: what only serves contact is hidden, the vessel is a ring of glass.

    It is that of the MJCF which the run holds, or of its parameters if it holds none. Raises `InputError` if the MJCF
    is not valid or has no ball.
    """
    p = run.header.parameters
    mjcf = run.header.mjcf or scene.build(p, ContactSettings())[1]
    try:
        made = mujoco.MjSpec.from_string(mjcf)
    except ValueError as error:
        raise InputError(f"the run holds no valid MJCF: {' '.join(str(error).split())}") from error
    for geom in made.geoms:
        if geom.name not in ("ball", "floor"):
            geom.group = HIDDEN
    if made.geom("ball") is None:
        raise InputError("the run's MJCF has no geom named 'ball' to show")
    made.geom("ball").material, made.geom("ball").rgba = "", (*to_rgb(BALL), 0.26)  # arrows stand inside
    floor = made.geom("floor")
    if floor is not None:
        floor.material, floor.rgba = "", (0.80, 0.82, 0.85, 1.0)
    _add_ring(made, p)
    return made


def _add_ring(spec: Any, p: Parameters, sides: int = 120) -> None:
    """The vessel's wall, as high as the ball, as a mesh."""
    angle = np.linspace(0.0, 2 * math.pi, sides, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros(sides)], axis=-1)
    inside, outside = p.R + p.r, p.R + 1.15 * p.r
    up = np.array([0.0, 0.0, 2.2 * p.r])
    corners = np.concatenate([inside * circle, inside * circle + up, outside * circle + up, outside * circle])
    this = np.arange(sides)
    other = (this + 1) % sides
    faces = []
    for k in range(4):
        a, b = k * sides, (k + 1) % 4 * sides
        faces += [np.stack([a + this, a + other, b + this], -1), np.stack([a + other, b + other, b + this], -1)]
    mesh = spec.add_mesh(name="ring", uservert=corners.ravel(), userface=np.concatenate(faces).ravel())
    mesh.smoothnormal = False
    glass = {"rgba": (0.45, 0.65, 0.80, 0.22), "contype": 0, "conaffinity": 0}
    spec.worldbody.add_geom(name="ring", type=mujoco.mjtGeom.mjGEOM_MESH, meshname="ring", **glass)
