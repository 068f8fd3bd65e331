"""Pictures and films of a run: the MuJoCo scene from outside and from beside the ball, with forces, slip and case.

Everything shown is read from the run's file: the scene from the MJCF it holds (that of its parameters for the engines
that have none), the motion from its samples. What it doesn't hold is how the ball is turned: the ball is shown turned
with the angular velocity it has, from an arbitrary beginning.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib
import mujoco
import numpy as np
from PIL import Image, ImageDraw, ImageFont
from scipy.spatial.transform import Rotation

from compare import opengl
from compare.figures import style
from mjsim import ContactSettings, scene
from model import Case, InputError, Parameters, StorageError, Trajectory
from model.arrays import Array
from model.files import check_writable
from model.kinematics import angular_velocity, frame, slip_velocities

FORCE, SLIP, BALL, INK = "#b3261e", "#6a3d9a", "#f5cc6b", "#1c2430"
"""Colours of arrows, ball and text."""
_WEIGHT = 3.0
"""Length of the arrow of a force m g, in radii of the ball."""
_FASTEST = 3.0
"""Length of the arrow of the fastest slip of the run, in radii of the ball."""
_STEP = 5e-3
"""Longest time between points of the trail and of the rotation, s."""
_SPOTS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / math.sqrt(3)
_LONGEST_TRAIL = 3.0
"""s."""
_TRAIL = 0.6
"""How far back the trail reaches, revolutions."""


@dataclass(frozen=True)
class Moment:
    """A run at one time; vectors in the co-rotating frame."""

    time: float
    theta: float
    x: Array
    """State, shape (8,)."""
    forces: tuple[Array, Array]
    """At A and B, N."""
    case: Case


def picture(run: Trajectory, at: float | None = None, width: int = 960) -> Image.Image:
    """The run at a time in s, its end if None, in 16:10.

    Raises `InputError` for a time outside the run, an empty run, or a machine without OpenGL.
    """
    time = float(run.time[-1]) if at is None and len(run.time) else at or 0.0
    return next(_frames(run, np.array([time]), width))


def film(
    run: Trajectory, output: Path, start: float = 0.0, seconds: float = 6.0, speed: float = 0.25, rate: int = 20,
    width: int = 640,
) -> int:  # fmt: skip
    """Write a GIF of so many seconds, or up to the end of the run, slowed down by `speed`; return the frames in it.

    Raises as `picture`, and `StorageError` if the file can't be written.
    """
    for name, value in (("seconds", seconds), ("speed", speed), ("rate", rate)):
        if not value > 0:
            raise InputError(f"{name} = {value:g} is out of range: must be > 0")
    end = min(start + seconds * speed, float(run.time[-1]) if len(run.time) else 0.0)
    times = np.arange(start, end + 1e-12, speed / rate)
    if len(times) == 0:
        raise InputError(f"from = {start:g} s is out of range: the run ends at {end:g} s")
    images = _frames(run, times, width, f"× {speed:g}")
    first = next(images)
    palette = _palette(first)
    frames = [image.quantize(palette=palette, dither=Image.Dither.NONE) for image in itertools.chain([first], images)]
    _save(frames[0], output, save_all=True, append_images=frames[1:], duration=round(1000 / rate), loop=0)
    return len(frames)


def _palette(image: Image.Image) -> Image.Image:
    """256 colours for all frames, so that none flickers: half from the first, half shades of those that mean something.

    What moves is small, and a palette of the first frame alone would give it the greys of its surroundings.
    """
    seen = image.quantize(120, dither=Image.Dither.NONE).getpalette() or []
    meant = [_rgb(colour) for colour in (*style.COLOURS.values(), FORCE, SLIP, BALL)]
    shades = np.linspace(0.45, 1.0, 6)[:, None, None] * np.array(meant)
    tints = 1 - (1 - np.array(meant)) * np.array([0.25, 0.5, 0.75])[:, None, None]
    chosen = np.concatenate([shades.reshape(-1, 3), tints.reshape(-1, 3)])
    made = Image.new("P", (1, 1))
    made.putpalette([*seen[:360], *np.round(255 * chosen).astype(int).ravel().tolist()])
    return made


def write(run: Trajectory, output: Path, at: float | None = None, width: int | None = None, **film_options: Any) -> str:
    """Write a picture (png) or a film (gif), as the name of the file says; return what was written, in words.

    `film_options` are those of `film`, which a picture has no use for.

    Raises as `picture` and `film`; `InputError` for another kind of file.
    """
    if output.suffix not in (".png", ".gif"):
        raise InputError(f"cannot write {output}: a picture is a .png, a film a .gif")
    check_writable(output)
    if output.suffix == ".gif":
        count = film(run, output, width=width or 640, **film_options)
        return f"{output}: {count} frames"
    image = picture(run, at, width or 960)
    _save(image, output, optimize=True)
    return f"{output}: {image.width} × {image.height}"


def _save(image: Image.Image, output: Path, **options: Any) -> None:
    try:
        image.save(output, **options)
    except OSError as error:
        raise StorageError(f"cannot write {output}: {error.strerror or error}") from error


def _frames(run: Trajectory, times: Array, width: int, note: str = "") -> Iterator[Image.Image]:
    if len(run.time) == 0:
        raise InputError("the run has no samples to show")
    for time in times:
        if not run.time[0] <= time <= run.time[-1]:
            raise InputError(
                f"time = {time:g} s is out of range: the run has samples from {run.time[0]:g} to {run.time[-1]:g} s"
            )
    if not 160 <= width <= 1920:
        raise InputError(f"width = {width} pixels is out of range: must be >= 160 and <= 1920")
    stage = _Stage(run, width)
    try:
        for time in times:
            yield stage.show(float(time), note)
    finally:
        stage.close()


class _Stage:
    """The scene of a run, a context to draw it in, and what depends on the whole run."""

    def __init__(self, run: Trajectory, width: int) -> None:
        self._run, self._p = run, run.header.parameters
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
        self._scene = mujoco.MjvScene(self._model, maxgeom=100 + math.ceil(_LONGEST_TRAIL / _STEP))
        self._scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False
        v_A, v_B = slip_velocities(run.x, self._p)
        self._fastest = max(float(np.abs(v).max()) for v in (v_A, v_B))
        self._turns = _rotations(run)

    def close(self) -> None:
        self._drawing.free()
        self._context.free()

    def show(self, time: float, note: str) -> Image.Image:
        moment = _at(self._run, time)
        p = self._p
        axes = frame(moment.theta)
        rho = p.R - moment.x[6]
        centre = np.array([rho * math.cos(moment.theta), rho * math.sin(moment.theta), p.r + moment.x[0]])
        self._data.geom_xpos[self._ball] = centre
        self._data.geom_xmat[self._ball] = _turned(self._turns, time).as_matrix().ravel()
        outside = _camera(np.array([0.0, 0.0, 0.35 * p.r]), 2.9 * (p.R + p.r), 90.0, -38.0)
        # From behind the ball and a little inwards, so that floor and wall are both seen edge-on.
        beside = _camera(centre, 6.4 * p.r, math.degrees(moment.theta) + 78.0, -14.0)
        image = self._draw(outside, self._size, moment, axes, centre, trail=True)
        small = self._draw(beside, (self._inset, self._inset), moment, axes, centre, trail=False)
        return _composed(image, small, moment, self._run, self._fastest, note)

    def _draw(
        self, camera: Any, size: tuple[int, int], moment: Moment, axes: Array, centre: Array, trail: bool
    ) -> Image.Image:
        option = mujoco.MjvOption()
        everything = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(self._model, self._data, option, None, camera, everything, self._scene)
        if trail:
            self._add_trail(moment.time)
        self._add_spots(centre)
        self._add_arrows(moment, axes, centre)
        # Twice the size, scaled down: smooth edges without support of the driver.
        area = mujoco.MjrRect(0, 0, 2 * size[0], 2 * size[1])
        pixels = np.empty((area.height, area.width, 3), np.uint8)
        mujoco.mjr_render(area, self._scene, self._drawing)
        mujoco.mjr_readPixels(pixels, None, area, self._drawing)
        return Image.fromarray(np.flipud(pixels)).resize(size, Image.Resampling.LANCZOS)

    def _add_trail(self, time: float) -> None:
        """Where the ball touched the floor's height before, in the colours of the cases, fading."""
        run, p = self._run, self._p
        times = np.arange(max(float(run.time[0]), time - _LONGEST_TRAIL), time, _STEP)
        theta, y, h = (np.interp(times, run.time, values) for values in (run.theta, run.y, run.h))
        now = float(np.interp(time, run.time, run.theta))
        age = np.abs(theta - now) / (2 * math.pi * _TRAIL)
        rho = p.R - h
        points = np.stack([rho * np.cos(theta), rho * np.sin(theta), y + 0.08 * p.r], axis=-1)
        for k in range(len(times) - 1):
            if max(age[k], age[k + 1]) < 1:
                rgba = (*_rgb(style.COLOURS[_at(run, float(times[k])).case]), 0.9 * (1 - age[k]))
                self._connect(mujoco.mjtGeom.mjGEOM_CAPSULE, 0.07 * p.r, points[k], points[k + 1], rgba)

    def _add_spots(self, centre: Array) -> None:
        """Spots on the ball that let the eye see it turn."""
        turned = self._data.geom_xmat[self._ball].reshape(3, 3)
        for spot in _SPOTS @ turned.T:
            geom = self._next(mujoco.mjtGeom.mjGEOM_SPHERE, (*_rgb("#8a6d1f"), 1.0))
            geom.size[:] = 0.11 * self._p.r
            geom.pos[:] = centre + 0.95 * self._p.r * spot

    def _add_arrows(self, moment: Moment, axes: Array, centre: Array) -> None:
        p = self._p
        contacts = (centre - p.r * axes[1], centre - p.r * axes[0])
        slips = slip_velocities(moment.x, p)
        # Slip lies in the tangent plane; it's lifted off the surface so as to be seen.
        planes = (np.array([1.0, 0.0, 1.0]), np.array([0.0, 1.0, 1.0]))
        lift = (0.1 * p.r * axes[1], 0.1 * p.r * axes[0])
        for k, force in enumerate(moment.forces):
            arrow = force @ axes * (_WEIGHT * p.r / (p.m * p.g))
            self._arrow(0.16 * p.r, contacts[k], contacts[k] + arrow, FORCE)
            if self._fastest > 0 and np.any(force):
                slip = (planes[k] * slips[k]) @ axes * (_FASTEST * p.r / self._fastest)
                self._arrow(0.13 * p.r, contacts[k] + lift[k], contacts[k] + lift[k] + slip, SLIP)

    def _arrow(self, width: float, begin: Array, end: Array, colour: str) -> None:
        if np.linalg.norm(end - begin) > 2 * width:
            self._connect(mujoco.mjtGeom.mjGEOM_ARROW, width, begin, end, (*_rgb(colour), 1.0))

    def _connect(self, kind: Any, width: float, begin: Array, end: Array, rgba: tuple[float, ...]) -> None:
        mujoco.mjv_connector(self._next(kind, rgba), kind, width, begin, end)

    def _next(self, kind: Any, rgba: tuple[float, ...]) -> Any:
        """Another thing in the scene."""
        geom = self._scene.geoms[self._scene.ngeom]
        mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.eye(3).ravel(), np.array(rgba, np.float32))
        self._scene.ngeom += 1
        return geom


def _spec(run: Trajectory) -> Any:
    """The scene of the run, dressed up: walls that only serve contact are hidden, the vessel is a ring of glass."""
    p = run.header.parameters
    mjcf = run.header.mjcf or scene.mjcf(p, ContactSettings())
    try:
        spec = mujoco.MjSpec.from_string(mjcf)
    except ValueError as error:
        raise InputError(f"the run holds no valid MJCF: {' '.join(str(error).split())}") from error
    for geom in spec.geoms:
        if geom.name not in ("ball", "floor"):
            geom.group = 5
    if spec.geom("ball") is None:
        raise InputError("the run's MJCF has no geom named 'ball' to show")
    spec.geom("ball").material, spec.geom("ball").rgba = "", (*_rgb(BALL), 0.26)  # arrows stand inside
    floor = spec.geom("floor")
    if floor is not None:
        floor.material, floor.rgba = "", (0.80, 0.82, 0.85, 1.0)
    _add_ring(spec, p)
    return spec


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
    spec.worldbody.add_geom(
        name="ring", type=mujoco.mjtGeom.mjGEOM_MESH, meshname="ring", rgba=(0.45, 0.65, 0.80, 0.22),
        contype=0, conaffinity=0,
    )  # fmt: skip


def _camera(lookat: Array, distance: float, azimuth: float, elevation: float) -> Any:
    camera = mujoco.MjvCamera()
    camera.lookat, camera.distance, camera.azimuth, camera.elevation = lookat, distance, azimuth, elevation
    return camera


def _at(run: Trajectory, time: float) -> Moment:
    """Interpolated linearly; the case is that of the last sample."""
    last = max(0, int(np.searchsorted(run.time, time, side="right")) - 1)

    def at(values: Array) -> Array:
        return np.array([np.interp(time, run.time, column) for column in values.T])

    theta = float(np.interp(time, run.time, run.theta))
    return Moment(time, theta, at(run.x), (at(run.force_A), at(run.force_B)), Case(run.case[last]))


def _rotations(run: Trajectory) -> tuple[Array, Rotation]:
    """Times and orientations of the ball, from its angular velocity; the first one upright."""
    steps = max(1, math.ceil((run.time[-1] - run.time[0]) / _STEP))
    times = np.linspace(run.time[0], run.time[-1], steps + 1)
    middle = (times[1:] + times[:-1]) / 2
    x = np.stack([np.interp(middle, run.time, column) for column in run.x.T], axis=-1)
    theta = np.interp(middle, run.time, run.theta)
    world = np.einsum("nab,na->nb", frame(theta), angular_velocity(x, run.header.parameters))
    turned = [Rotation.identity()]
    for step in Rotation.from_rotvec(world * np.diff(times)[:, None]):
        turned.append(step * turned[-1])
    return times, Rotation.concatenate(turned)


def _turned(turns: tuple[Array, Rotation], time: float) -> Rotation:
    """The last known orientation before a time."""
    times, rotations = turns
    return rotations[min(int(np.searchsorted(times, time)), len(times) - 1)]


def _rgb(colour: str) -> tuple[float, float, float]:
    return tuple(int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))  # type: ignore[return-value]


def _composed(
    image: Image.Image, small: Image.Image, moment: Moment, run: Trajectory, fastest: float, note: str
) -> Image.Image:
    """The picture from outside with the one from beside the ball in a corner, the case, numbers, and a legend."""
    width, height = image.size
    unit = width / 960
    margin, size = round(22 * unit), small.width
    draw = ImageDraw.Draw(image)
    large, text = _font(round(34 * unit)), _font(round(17 * unit))
    left, top = width - size - margin, margin
    image.paste(small, (left, top))
    draw.rectangle((left - 1, top - 1, left + size, top + size), outline="#8a94a3", width=max(1, round(1.5 * unit)))
    # The case, as a sign in its colour.
    name = moment.case.name
    box = draw.textbbox((0, 0), name, font=large)
    pad = 14 * unit
    right, bottom = margin + box[2] + 2 * pad, margin + box[3] + 1.2 * pad
    draw.rounded_rectangle((margin, margin, right, bottom), 8 * unit, fill=style.COLOURS[moment.case])
    draw.text((margin + pad, margin + 0.5 * pad), name, "white", font=large)
    words = f"floor: {moment.case.A.value}\nwall: {moment.case.B.value}"
    draw.multiline_text((right + pad, margin + 2 * unit), words, INK, font=text, spacing=5 * unit)
    p = run.header.parameters
    v_A, v_B = slip_velocities(moment.x, p)
    lines = (
        f"t = {moment.time:.3f} s   {note}",
        f"ω₀ = {float(run.header.flow(moment.time)):.2f} rad/s",
        f"ω_c = {moment.x[2]:.2f} rad/s",
        f"slip: floor {math.hypot(v_A[0], v_A[2]):.3f} m/s, wall {math.hypot(v_B[1], v_B[2]):.3f} m/s",
    )
    draw.multiline_text((margin, bottom + 14 * unit), "\n".join(lines), INK, font=text, spacing=6 * unit)
    legend = [(FORCE, "contact force")] + ([(SLIP, "slip velocity")] if fastest > 0 else [])
    for k, (colour, label) in enumerate(legend):
        y = height - margin - (10 + 26 * k) * unit
        draw.line((margin, y, margin + 30 * unit, y), fill=colour, width=max(2, round(5 * unit)))
        draw.text((margin + 40 * unit, y), label, INK, font=text, anchor="lm")
    return image


def _font(size: int) -> ImageFont.FreeTypeFont:
    return ImageFont.truetype(Path(matplotlib.get_data_path()) / "fonts/ttf/DejaVuSans.ttf", size)
