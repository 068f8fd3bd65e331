"""The scene of a run drawn at any time: from outside and from beside the ball, with forces, slips and a trail."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
from matplotlib.colors import to_rgb
from PIL import Image

from compare.figures import style
from compare.figures.style import BALL, FORCE, SLIP
from compare.view import opengl, overlay
from compare.view.motion import STEP, Moment, Turning
from mjsim import ContactSettings, scene
from model import InputError, Parameters, Trajectory
from model.arrays import Array
from model.kinematics import frame, slip_velocities

_HIDDEN = 5
"""A group of geoms that isn't drawn."""
ARROW = 3.0
"""Length of the arrows of a force m g and of the fastest slip of the run, in radii of the ball, unless said."""
_SPOTS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / math.sqrt(3)
_LONGEST_TRAIL = 3.0
"""s."""
_TRAIL = 0.6
"""How far back the trail reaches, revolutions."""


class Stage:
    """The scene of a run, a context to draw it in, and what depends on the whole run; pictures are 16:10.

    Raises `InputError` if there is no OpenGL, or the run holds no scene with a ball.
    """

    def __init__(self, run: Trajectory, width: int, force_arrow: float = ARROW, slip_arrow: float = ARROW) -> None:
        self._run, self._p = run, run.header.parameters
        self._force_arrow, self._slip_arrow = force_arrow, slip_arrow
        self._size = (width, width * 10 // 16)
        self._inset = self._size[1] * 5 // 12
        spec = _spec(run)
        spec.visual.global_.offwidth, spec.visual.global_.offheight = (2 * n for n in self._size)
        spec.visual.quality.offsamples, spec.visual.quality.shadowsize = 0, 2048
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        mujoco.mj_forward(self._model, self._data)
        self._ball = self._model.geom("ball").id
        self._context = opengl.context(*(2 * n for n in self._size))
        self._drawing = mujoco.MjrContext(self._model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._drawing)
        self._scene = mujoco.MjvScene(self._model, maxgeom=100 + math.ceil(_LONGEST_TRAIL / STEP))
        self._scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False
        v_A, v_B = slip_velocities(run.x, self._p)
        self._fastest = max(float(np.abs(v).max()) for v in (v_A, v_B))
        self._turns = Turning.of(run)

    def close(self) -> None:
        """Give the context back."""
        self._drawing.free()
        self._context.free()

    def show(self, time: float, note: str) -> Image.Image:
        """The run at a time in s, with a note beside the time."""
        now, p = Moment(self._run, np.asarray(time)), self._p
        self._data.geom_xpos[self._ball] = now.centre
        self._data.geom_xmat[self._ball] = self._turns.at(time).as_matrix().ravel()
        outside = _camera(np.array([0.0, 0.0, 0.35 * p.r]), 2.9 * (p.R + p.r), 90.0, -38.0)
        # From behind the ball and a little inwards, so that floor and wall are both seen edge-on.
        beside = _camera(now.centre, 6.4 * p.r, math.degrees(now.theta) + 78.0, -14.0)
        image = self._draw(outside, self._size, now, trail=True)
        small = self._draw(beside, (self._inset, self._inset), now, trail=False)
        return overlay.compose(image, small, now, p, self._fastest > 0, note)

    def _draw(self, camera: Any, size: tuple[int, int], now: Moment, trail: bool) -> Image.Image:
        option = mujoco.MjvOption()
        everything = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(self._model, self._data, option, None, camera, everything, self._scene)
        if trail:
            self._add_trail(now)
        self._add_spots(now.centre)
        self._add_arrows(now)
        # Twice the size, scaled down: smooth edges without support of the driver.
        area = mujoco.MjrRect(0, 0, 2 * size[0], 2 * size[1])
        pixels = np.empty((area.height, area.width, 3), np.uint8)
        mujoco.mjr_render(area, self._scene, self._drawing)
        mujoco.mjr_readPixels(pixels, None, area, self._drawing)
        return Image.fromarray(np.flipud(pixels)).resize(size, Image.Resampling.LANCZOS)

    def _add_trail(self, now: Moment) -> None:
        """Where the ball touched the floor's height before, in the colours of the cases, fading."""
        p, end = self._p, float(now.time)
        before = Moment(self._run, np.arange(max(float(self._run.time[0]), end - _LONGEST_TRAIL), end, STEP))
        age = np.abs(before.theta - now.theta) / (2 * math.pi * _TRAIL)
        points = before.centre - [0.0, 0.0, 0.92 * p.r]
        for k, case in enumerate(before.cases[:-1]):
            if max(age[k], age[k + 1]) < 1:
                rgba = (*to_rgb(style.COLOURS[case]), 0.9 * (1 - age[k]))
                self._connect(mujoco.mjtGeom.mjGEOM_CAPSULE, 0.07 * p.r, points[k], points[k + 1], rgba)

    def _add_spots(self, centre: Array) -> None:
        """Spots on the ball that let the eye see it turn."""
        turned = self._data.geom_xmat[self._ball].reshape(3, 3)
        for spot in _SPOTS @ turned.T:
            geom = self._next(mujoco.mjtGeom.mjGEOM_SPHERE, (*to_rgb("#8a6d1f"), 1.0))
            geom.size[:] = 0.11 * self._p.r
            geom.pos[:] = centre + 0.95 * self._p.r * spot

    def _add_arrows(self, now: Moment) -> None:
        p, centre, axes = self._p, now.centre, frame(now.theta)
        contacts = (centre - p.r * axes[1], centre - p.r * axes[0])
        slips = slip_velocities(now.x, p)
        # Slip lies in the tangent plane; it's lifted off the surface so as to be seen.
        planes = (np.array([1.0, 0.0, 1.0]), np.array([0.0, 1.0, 1.0]))
        lift = (0.1 * p.r * axes[1], 0.1 * p.r * axes[0])
        for k, force in enumerate(now.forces):
            arrow = force @ axes * (self._force_arrow * p.r / (p.m * p.g))
            self._arrow(0.16 * p.r, contacts[k], contacts[k] + arrow, FORCE)
            if self._fastest > 0 and np.any(force):
                slip = (planes[k] * slips[k]) @ axes * (self._slip_arrow * p.r / self._fastest)
                self._arrow(0.13 * p.r, contacts[k] + lift[k], contacts[k] + lift[k] + slip, SLIP)

    def _arrow(self, width: float, begin: Array, end: Array, colour: str) -> None:
        if np.linalg.norm(end - begin) > 2 * width:
            self._connect(mujoco.mjtGeom.mjGEOM_ARROW, width, begin, end, (*to_rgb(colour), 1.0))

    def _connect(self, kind: Any, width: float, begin: Array, end: Array, rgba: tuple[float, ...]) -> None:
        mujoco.mjv_connector(self._next(kind, rgba), kind, width, begin, end)

    def _next(self, kind: Any, rgba: tuple[float, ...]) -> Any:
        """Another thing in the scene."""
        geom = self._scene.geoms[self._scene.ngeom]
        mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.eye(3).ravel(), np.array(rgba, np.float32))
        self._scene.ngeom += 1
        return geom


def _camera(lookat: Array, distance: float, azimuth: float, elevation: float) -> Any:
    camera = mujoco.MjvCamera()
    camera.lookat, camera.distance, camera.azimuth, camera.elevation = lookat, distance, azimuth, elevation
    return camera


def _spec(run: Trajectory) -> Any:
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
            geom.group = _HIDDEN
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
