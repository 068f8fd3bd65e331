"""Pictures and films of a run: the MuJoCo scene from outside and from beside the ball, with forces,
slip and case.

Everything shown is read from the run's file: the scene from the MJCF it holds (that of its
parameters for the engines that have none), the motion from its samples. What it doesn't hold is how
the ball is turned: the ball is shown turned with the angular velocity it has, from an arbitrary
beginning."""

from __future__ import annotations

import functools
import importlib
import io
import itertools
import math
import os
import platform
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib
import mujoco
import numpy as np
from matplotlib.colors import to_rgb
from mujoco.rendering.classic import gl_context
from PIL import Image, ImageDraw, ImageFont

from compare.kit import style
from compare.kit.style import BALL, FORCE, INK, SLIP
from compare.view import page
from compare.view.geometry import ARROW, STEP, geometry, resampled
from mjsim import ContactSettings, scene
from model import Case, InputError, Trajectory
from model.arrays import Array
from model.files import check_writable, write_bytes
from model.kinematics import to_world
from model.parameters import NOT_NEGATIVE, POSITIVE, Range, check_number

MOST_FRAMES = 8000
"""Frames of a film or page, of which a page then is smaller than 3 MB."""
WIDTHS = Range(160, 1920)
"""Of pictures, pixels."""
OFFSCREEN = ("egl", "osmesa")
"""Kinds of OpenGL that need no display, the faster first."""
_HIDDEN = 5
"""A group of geoms that isn't drawn."""
_SIDES = 120
"""Of the polygon that is drawn for the wall."""
_SPOTS = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) / math.sqrt(3)
"""Directions of the spots that let the eye see the ball turn."""
_LONGEST_TRAIL = 3.0
"""s."""
_TRAIL = 0.6
"""How far back the trail reaches, revolutions."""


def write(
    run: Trajectory,
    output: Path,
    at: float | None = None,
    width: int | None = None,
    time: float | None = None,
    speed: float | None = None,
    rate: int | None = None,
    **arrows: Any,
) -> str:
    """Write a picture (png), a film (gif, mp4), both in 16:10, or a page (html); return in words
    what was written.

    Parameters
    ----------
    at : the time of a picture, the end for None; where a film or page begins, 0 for None; s
    width : pixels; 960 for a picture and 640 for a film if None
    time, speed, rate : a film or page is slowed down by `speed`, .25 if None, has `rate` frames a
        second, and takes `time` in s, less if the run ends before; 6 s at 20 frames a second, of a
        page 60 s at 60
    arrows : `force_arrow` and `slip_arrow` of `frames`

    Raises `InputError` for what can't be shown, on a machine without OpenGL, or for an mp4 where
    PyAV, an extra, isn't installed; `StorageError` if the file can't be written."""
    kind = output.suffix.lower()
    if kind not in (".png", ".gif", ".mp4", ".html"):
        raise InputError(
            f"cannot write {output}: a picture is a .png, a film a .gif or .mp4, a page to look "
            f"round in an .html"
        )
    check_writable(output)
    unused: dict[str, Any] = {"time": time, "speed": speed, "rate": rate} if kind == ".png" else {}
    for name, value in (unused or {"width": width if kind == ".html" else None}).items():
        if value is not None:
            raise InputError(
                f"a {'page' if kind == '.html' else 'picture'} has no {name}: it would have no "
                f"effect"
            )
    if len(run.time) == 0:
        raise InputError("the run has no samples to show")
    film, end = kind != ".png", float(run.time[-1])
    usual = (60.0, 60) if kind == ".html" else (6.0, 20)
    lasts, rate = usual[0] if time is None else time, usual[1] if rate is None else rate
    speed = 0.25 if speed is None else speed
    begin, width = (0.0 if film else end) if at is None else at, width or (640 if film else 960)
    check_number("at", begin, "s", Range(float(run.time[0]), end), "to be within the run it")
    check_number("width", width, "pixels", WIDTHS)
    for name, value, unit in (("time", lasts, "s"), ("speed", speed, "1"), ("rate", rate, "s-1")):
        check_number(name, value, unit, POSITIVE)
    for name, radii in arrows.items():
        check_number(name, radii, "radii", NOT_NEGATIVE)
    step, until = speed / rate, min(begin + lasts * speed, end)
    if film and (until - begin) / step > MOST_FRAMES:
        raise InputError(
            f"{(until - begin) / step:.4g} frames are more than {MOST_FRAMES}: choose a shorter "
            f"time, or a lower rate"
        )
    times = np.arange(begin, until + 1e-12, step) if film else np.array([begin])
    if kind == ".html":
        moves = page.frames(run, times, **arrows)
        write_bytes(output, page.write(run.header.parameters, speed, moves, run).encode())
        return f"{output}: {len(times)} frames"
    shown, note = resampled(run, times), f"× {speed:.3g}" if film else ""
    slips = bool(np.any(run.slip_speed_A + run.slip_speed_B))
    pairs = frames(run, times, width, **arrows)
    images = (_labelled(*pair, shown, k, note, slips) for k, pair in enumerate(pairs))
    if kind == ".mp4":
        content = _mp4(images, rate)
    elif film:
        content = _gif(images, rate)
    else:
        out = io.BytesIO()
        next(images).save(out, "png", optimize=True)
        content = out.getvalue()
    write_bytes(output, content)
    return f"{output}: {len(times)} frames" if film else f"{output}: {width} × {width * 10 // 16}"


def _gif(images: Iterator[Image.Image], rate: int) -> bytes:
    """A film in 256 colours for all frames, so that none flickers.

    Half are from the first, half are shades of those that mean something, since what moves is
    small, and a palette of the first frame alone would make it grey."""
    first = next(images)
    seen = first.quantize(120, dither=Image.Dither.NONE).getpalette() or []
    meant = np.array([to_rgb(colour) for colour in (*style.COLOURS.values(), FORCE, SLIP, BALL)])
    shades = np.linspace(0.45, 1.0, 6)[:, None, None] * meant
    tints = 1 - (1 - meant) * np.array([0.25, 0.5, 0.75])[:, None, None]
    chosen = np.concatenate([shades.reshape(-1, 3), tints.reshape(-1, 3)])
    palette = Image.new("P", (1, 1))
    palette.putpalette([*seen[:360], *np.round(255 * chosen).astype(int).ravel().tolist()])
    all_ = itertools.chain([first], images)
    first, *rest = (each.quantize(palette=palette, dither=Image.Dither.NONE) for each in all_)
    out, duration = io.BytesIO(), round(1000 / rate)
    first.save(
        out, "gif", optimize=True, save_all=True, append_images=rest, duration=duration, loop=0
    )
    return out.getvalue()


def _mp4(images: Iterator[Image.Image], rate: int) -> bytes:
    """A film in H.264, of even width and height as that needs. Raises `InputError` if PyAV, an
    extra, isn't there."""
    try:
        av = importlib.import_module("av")
    except ImportError as error:
        raise InputError("an mp4 needs PyAV: pip install 'dualball[film]'") from error
    out, first = io.BytesIO(), next(images)
    with av.open(out, "w", format="mp4") as film:
        stream = film.add_stream("h264", rate=rate, options={"crf": "18"})
        stream.width, stream.height, stream.pix_fmt = (
            first.width // 2 * 2,
            first.height // 2 * 2,
            "yuv420p",
        )
        for image in itertools.chain([first], images):
            even = image.crop((0, 0, stream.width, stream.height))
            film.mux(stream.encode(av.VideoFrame.from_image(even)))
        film.mux(stream.encode())
    return out.getvalue()


def _labelled(
    image: Image.Image, small: Image.Image, run: Trajectory, k: int, note: str, slips: bool
) -> Image.Image:
    """The picture from outside with that from beside the ball in its corner, labelled with time,
    case and note.

    Written over it are the case and numbers of sample k of the run, a note beside the time, and a
    legend, with slip velocities if there are any."""
    unit, case = image.width / 960, Case(run.case[k])
    margin, pad = round(22 * unit), 14 * unit
    font = Path(matplotlib.get_data_path()) / "fonts/ttf/DejaVuSans.ttf"
    large, text = (ImageFont.truetype(font, round(size * unit)) for size in (34, 17))
    draw = ImageDraw.Draw(image)
    left = image.width - small.width - margin
    image.paste(small, (left, margin))
    frame = (left - 1, margin - 1, left + small.width, margin + small.height)
    draw.rectangle(frame, outline="#8a94a3", width=max(1, round(1.5 * unit)))
    _, _, width, height = draw.textbbox((0, 0), case.name, font=large)
    right, bottom = margin + width + 2 * pad, margin + height + 1.2 * pad
    draw.rounded_rectangle((margin, margin, right, bottom), 8 * unit, fill=style.COLOURS[case])
    draw.text((margin + pad, margin + 0.5 * pad), case.name, "white", font=large)
    words = f"floor: {case.A.value}\nwall: {case.B.value}"
    draw.multiline_text((right + pad, margin + 2 * unit), words, INK, font=text, spacing=5 * unit)
    speeds = run.slip_speed_A[k], run.slip_speed_B[k]
    slip = [
        "–" if contact == "N" else f"{v:.3f} m/s"
        for contact, v in zip(case.name, speeds, strict=True)
    ]
    lines = (
        f"t = {run.time[k]:.3f} s   {note}",
        f"ω₀ = {float(run.header.flow(run.time[k])):.2f} rad/s",
        f"ω_c = {run.omega_c[k]:.2f} rad/s",
        f"slip: floor {slip[0]}, wall {slip[1]}",
    )
    draw.multiline_text((margin, bottom + pad), "\n".join(lines), INK, font=text, spacing=6 * unit)
    legend = [(FORCE, "contact force")] + ([(SLIP, "slip velocity")] if slips else [])
    for row, (colour, label) in enumerate(legend):
        y = image.height - margin - (10 + 26 * row) * unit
        draw.line((margin, y, margin + 30 * unit, y), fill=colour, width=max(2, round(5 * unit)))
        draw.text((margin + 40 * unit, y), label, INK, font=text, anchor="lm")
    return image


def frames(
    run: Trajectory, times: Array, width: int, force_arrow: float = ARROW, slip_arrow: float = ARROW
) -> Iterator[tuple[Image.Image, Image.Image]]:
    """Pictures of a run at times (n,) in s: from outside, in 16:10, and from beside the ball, a
    small square.

    Raises `InputError` if there is no OpenGL, or the run holds no scene with a ball.
    """
    p, now = run.header.parameters, resampled(run, times)
    seen = geometry(run, now, force_arrow, slip_arrow)
    past = seen.past

    height = width * 10 // 16
    inset = height * 5 // 12
    model = _model(run, 2 * width, 2 * height)
    data, ball, most = (
        mujoco.MjData(model),
        model.geom("ball").id,
        100 + math.ceil(_LONGEST_TRAIL / STEP),
    )
    mujoco.mj_forward(model, data)
    choose_opengl()
    above, behind = mujoco.MjvCamera(), mujoco.MjvCamera()
    above.lookat, above.distance = (0.0, 0.0, 0.35 * p.r), 2.9 * (p.R + p.r)
    above.azimuth, above.elevation = 90.0, -38.0
    behind.distance, behind.elevation = 6.4 * p.r, -14.0
    with (  # twice the size, scaled down: smooth edges without support of the driver
        mujoco.Renderer(model, 2 * height, 2 * width, most) as outside,
        mujoco.Renderer(model, 2 * inset, 2 * inset, most) as beside,
    ):
        for k, centre in enumerate(seen.centres):
            data.geom_xpos[ball], data.geom_xmat[ball] = centre, seen.turns[k].as_matrix().ravel()
            # From behind the ball and a little inwards, so that floor and wall are both seen
            # edge-on.
            behind.lookat, behind.azimuth = centre, math.degrees(now.theta[k]) + 78.0
            outside.update_scene(data, above)
            beside.update_scene(data, behind)
            # The trail: where the ball touched the floor's height before, in the colours of the
            # cases, fading.
            some = (past.time > now.time[k] - _LONGEST_TRAIL) & (past.time < now.time[k])
            age = np.abs(past.theta[some] - now.theta[k]) / (2 * math.pi * _TRAIL)
            points = to_world(past.x[some], past.theta[some], p).position - [0.0, 0.0, 0.92 * p.r]
            for i, case in enumerate(past.case[some][:-1]):
                if max(age[i], age[i + 1]) < 1:
                    colour, alpha = style.COLOURS[Case(case)], 0.9 * (1 - age[i])
                    geom = _add(outside.scene, mujoco.mjtGeom.mjGEOM_CAPSULE, colour, alpha)
                    mujoco.mjv_connector(
                        geom, mujoco.mjtGeom.mjGEOM_CAPSULE, 0.07 * p.r, points[i], points[i + 1]
                    )
            arrows = []
            for normal, contact, force, slip in zip(
                seen.normals[:, k],
                seen.contacts[:, k],
                seen.forces[:, k],
                seen.slips[:, k],
                strict=True,
            ):
                arrows.append((0.16 * p.r, contact, force, FORCE))
                arrows.append((0.13 * p.r, contact + 0.1 * p.r * normal, slip, SLIP))
            images = []
            for renderer in (outside, beside):
                for spot in seen.turns[k].apply(_SPOTS):
                    geom = _add(renderer.scene, mujoco.mjtGeom.mjGEOM_SPHERE, "#8a6d1f")
                    geom.size[:], geom.pos[:] = 0.11 * p.r, centre + 0.95 * p.r * spot
                for thick, begin, arrow, colour in arrows:
                    if np.linalg.norm(arrow) > 2 * thick:
                        geom = _add(renderer.scene, mujoco.mjtGeom.mjGEOM_ARROW, colour)
                        mujoco.mjv_connector(
                            geom, mujoco.mjtGeom.mjGEOM_ARROW, thick, begin, begin + arrow
                        )
                renderer.scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = False
                size = (renderer.width // 2, renderer.height // 2)
                images.append(
                    Image.fromarray(renderer.render()).resize(size, Image.Resampling.LANCZOS)
                )
            yield images[0], images[1]


def _add(drawn: Any, kind: Any, colour: str, alpha: float = 1.0) -> Any:
    """Add a thing of a colour to MuJoCo's scene, and return it."""
    geom = drawn.geoms[drawn.ngeom]
    rgba = np.array([*to_rgb(colour), alpha], np.float32)
    mujoco.mjv_initGeom(geom, kind, np.zeros(3), np.zeros(3), np.eye(3).ravel(), rgba)
    drawn.ngeom += 1
    return geom


def _model(run: Trajectory, width: int, height: int) -> Any:
    """The scene to be drawn in pixels: what only serves contact is hidden, the vessel is a ring of
    glass.

    It is that of the MJCF which the run holds, or of its parameters if it holds none. Raises
    `InputError` if the MJCF is not valid or has no ball."""
    p = run.header.parameters
    mjcf = run.header.mjcf or scene.build(p, ContactSettings())[1]
    try:
        made = mujoco.MjSpec.from_string(mjcf)
    except ValueError as error:
        raise InputError(f"the run holds no valid MJCF: {' '.join(str(error).split())}") from error
    ball, floor = made.geom("ball"), made.geom("floor")
    if ball is None:
        raise InputError("the run's MJCF has no geom named 'ball' to show")
    for geom in made.geoms:
        if geom.name not in ("ball", "floor"):
            geom.group = _HIDDEN
    ball.material, ball.rgba = "", (*to_rgb(BALL), 0.26)  # arrows stand inside
    if floor is not None:
        floor.material, floor.rgba = "", (0.80, 0.82, 0.85, 1.0)
    made.visual.global_.offwidth, made.visual.global_.offheight = width, height
    made.visual.quality.offsamples, made.visual.quality.shadowsize = 0, 2048
    # The vessel's wall, a little higher than the ball, as a mesh.
    angle = np.linspace(0.0, 2 * math.pi, _SIDES, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros(_SIDES)], axis=-1)
    inside, outside = (p.R + p.r) * circle, (p.R + 1.15 * p.r) * circle
    up = np.array([0.0, 0.0, 2.2 * p.r])
    corners = np.concatenate([inside, inside + up, outside + up, outside])
    here = np.arange(4 * _SIDES).reshape(4, _SIDES)
    beside, above = np.roll(here, -1, axis=1), np.roll(here, -1, axis=0)
    faces = [here, beside, above], [beside, np.roll(above, -1, axis=1), above]
    triangles = np.concatenate([np.stack(corner, axis=-1).reshape(-1, 3) for corner in faces])
    mesh = made.add_mesh(name="ring", uservert=corners.ravel(), userface=triangles.ravel())
    mesh.smoothnormal = False
    glass = {"rgba": (0.45, 0.65, 0.80, 0.22), "contype": 0, "conaffinity": 0}
    made.worldbody.add_geom(name="ring", type=mujoco.mjtGeom.mjGEOM_MESH, meshname="ring", **glass)
    return made.compile()


@functools.cache
def choose_opengl() -> None:
    """Let `mujoco.Renderer` draw with the kind of OpenGL that MUJOCO_GL names, else with one that
    works.

    Raises `InputError` if there is none.
    """
    chosen = os.environ.get("DUALBALL_GL", os.environ.get("MUJOCO_GL", "")).strip().lower()
    working = platform.system() != "Linux" or next(
        filter(works, [chosen] if chosen else OFFSCREEN), None
    )
    if not working:
        remedy = "on Debian and Ubuntu: apt-get install libegl1 libgl1-mesa-dri (or libosmesa6)"
        if chosen:
            remedy = f"unset MUJOCO_GL = {chosen!r}, or set it to one of {', '.join(OFFSCREEN)}"
        raise InputError(f"there is no OpenGL to draw with; {remedy}")
    if isinstance(
        working, str
    ):  # MuJoCo chose none when it was imported, or one that needs a display
        gl_context.GLContext = importlib.import_module(f"mujoco.{working}").GLContext


def works(kind: str) -> bool:
    """Whether a kind of OpenGL works, tried in a process of its own.

    A library that is missing or has no driver may end the process, or leave it unable to load
    another one."""
    # OSMesa's context can't be freed while Python shuts down: the process ends at once, without
    # cleaning up.
    code = "import mujoco, os; mujoco.Renderer(mujoco.MjModel.from_xml_string('<mujoco/>'), 8, 8); os._exit(0)"
    environment = os.environ | {"MUJOCO_GL": kind}
    tried = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, timeout=60, check=False
    )
    return tried.returncode == 0
