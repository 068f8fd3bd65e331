"""The scene of a run drawn at any time: from outside and from beside the ball, with forces, slips and a trail."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
from matplotlib.colors import to_rgb
from PIL import Image

from compare.figures import style
from compare.figures.style import FORCE, SLIP
from compare.view import opengl, overlay, scenery
from compare.view.motion import STEP, Moment, Turning, moment
from model import Case, Trajectory
from model.arrays import Array
from model.kinematics import frame, slip_velocities

_WEIGHT = 3.0
"""Length of the arrow of a force m g, in radii of the ball."""
_FASTEST = 3.0
"""Length of the arrow of the fastest slip of the run, in radii of the ball."""
_SPOTS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / math.sqrt(3)
_LONGEST_TRAIL = 3.0
"""s."""
_TRAIL = 0.6
"""How far back the trail reaches, revolutions."""


class Stage:
    """The scene of a run, a context to draw it in, and what depends on the whole run; pictures are 16:10.

    Raises `InputError` if there is no OpenGL, or the run holds no scene with a ball.
    """

    def __init__(self, run: Trajectory, width: int) -> None:
        self._run, self._p = run, run.header.parameters
        self._size = (width, width * 10 // 16)
        self._inset = self._size[1] * 5 // 12
        spec = scenery.spec(run)
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
        now = moment(self._run, time)
        p = self._p
        axes = frame(now.theta)
        rho = p.R - now.x[6]
        centre = np.array([rho * math.cos(now.theta), rho * math.sin(now.theta), p.r + now.x[0]])
        self._data.geom_xpos[self._ball] = centre
        self._data.geom_xmat[self._ball] = self._turns.at(time).as_matrix().ravel()
        outside = _camera(np.array([0.0, 0.0, 0.35 * p.r]), 2.9 * (p.R + p.r), 90.0, -38.0)
        # From behind the ball and a little inwards, so that floor and wall are both seen edge-on.
        beside = _camera(centre, 6.4 * p.r, math.degrees(now.theta) + 78.0, -14.0)
        image = self._draw(outside, self._size, now, axes, centre, trail=True)
        small = self._draw(beside, (self._inset, self._inset), now, axes, centre, trail=False)
        return overlay.compose(image, small, now, p, self._run.header.flow, self._fastest > 0, note)

    def _draw(
        self, camera: Any, size: tuple[int, int], now: Moment, axes: Array, centre: Array, trail: bool
    ) -> Image.Image:
        option = mujoco.MjvOption()
        everything = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(self._model, self._data, option, None, camera, everything, self._scene)
        if trail:
            self._add_trail(now.time)
        self._add_spots(centre)
        self._add_arrows(now, axes, centre)
        # Twice the size, scaled down: smooth edges without support of the driver.
        area = mujoco.MjrRect(0, 0, 2 * size[0], 2 * size[1])
        pixels = np.empty((area.height, area.width, 3), np.uint8)
        mujoco.mjr_render(area, self._scene, self._drawing)
        mujoco.mjr_readPixels(pixels, None, area, self._drawing)
        return Image.fromarray(np.flipud(pixels)).resize(size, Image.Resampling.LANCZOS)

    def _add_trail(self, time: float) -> None:
        """Where the ball touched the floor's height before, in the colours of the cases, fading."""
        run, p = self._run, self._p
        times = np.arange(max(float(run.time[0]), time - _LONGEST_TRAIL), time, STEP)
        theta, y, h = (np.interp(times, run.time, values) for values in (run.theta, run.y, run.h))
        now = float(np.interp(time, run.time, run.theta))
        age = np.abs(theta - now) / (2 * math.pi * _TRAIL)
        rho = p.R - h
        points = np.stack([rho * np.cos(theta), rho * np.sin(theta), y + 0.08 * p.r], axis=-1)
        cases = run.case[np.searchsorted(run.time, times, side="right") - 1]
        for k in range(len(times) - 1):
            if max(age[k], age[k + 1]) < 1:
                rgba = (*to_rgb(style.COLOURS[Case(cases[k])]), 0.9 * (1 - age[k]))
                self._connect(mujoco.mjtGeom.mjGEOM_CAPSULE, 0.07 * p.r, points[k], points[k + 1], rgba)

    def _add_spots(self, centre: Array) -> None:
        """Spots on the ball that let the eye see it turn."""
        turned = self._data.geom_xmat[self._ball].reshape(3, 3)
        for spot in _SPOTS @ turned.T:
            geom = self._next(mujoco.mjtGeom.mjGEOM_SPHERE, (*to_rgb("#8a6d1f"), 1.0))
            geom.size[:] = 0.11 * self._p.r
            geom.pos[:] = centre + 0.95 * self._p.r * spot

    def _add_arrows(self, now: Moment, axes: Array, centre: Array) -> None:
        p = self._p
        contacts = (centre - p.r * axes[1], centre - p.r * axes[0])
        slips = slip_velocities(now.x, p)
        # Slip lies in the tangent plane; it's lifted off the surface so as to be seen.
        planes = (np.array([1.0, 0.0, 1.0]), np.array([0.0, 1.0, 1.0]))
        lift = (0.1 * p.r * axes[1], 0.1 * p.r * axes[0])
        for k, force in enumerate(now.forces):
            arrow = force @ axes * (_WEIGHT * p.r / (p.m * p.g))
            self._arrow(0.16 * p.r, contacts[k], contacts[k] + arrow, FORCE)
            if self._fastest > 0 and np.any(force):
                slip = (planes[k] * slips[k]) @ axes * (_FASTEST * p.r / self._fastest)
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
