"""Pictures and films of a run: the MuJoCo scene from outside and from beside the ball, with forces, slip and case.

Everything shown is read from the run's file: the scene from the MJCF it holds (that of its parameters for the engines
that have none), the motion from its samples. What it doesn't hold is how the ball is turned: the ball is shown turned
with the angular velocity it has, from an arbitrary beginning.
"""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.colors import to_rgb
from PIL import Image, ImageDraw, ImageFont

from compare.kit import style
from compare.kit.style import BALL, FORCE, INK, SLIP
from compare.view import stage
from model import Case, InputError, StorageError, Trajectory
from model.files import check_writable
from model.parameters import NOT_NEGATIVE, POSITIVE, Range, check_number

WIDTHS = Range(160, 1920)
"""Of pictures, pixels."""


def write(
    run: Trajectory,
    output: Path,
    at: float | None = None,
    width: int | None = None,
    start: float = 0.0,
    seconds: float = 6.0,
    speed: float = 0.25,
    rate: int = 20,
    **arrows: Any,
) -> str:
    """Write a picture (png) or a film (gif), as the name of the file says, in 16:10; return in words what was written.

    Parameters
    ----------
    at : the time of a picture, s; the end for None
    width : pixels; 960 for a picture and 640 for a film if None
    start, seconds, speed, rate : a film begins at `start` in s, is slowed down by `speed`, has `rate` frames a second,
        and takes so many seconds, fewer if the run ends before
    arrows : `force_arrow` and `slip_arrow` of `stage.frames`

    Raises `InputError` for what can't be shown, or on a machine without OpenGL; `StorageError` if the file can't be
    written.
    """
    if output.suffix not in (".png", ".gif"):
        raise InputError(f"cannot write {output}: a picture is a .png, a film a .gif")
    check_writable(output)
    if len(run.time) == 0:
        raise InputError("the run has no samples to show")
    film, end = output.suffix == ".gif", float(run.time[-1])
    name, begin, width = ("from", start, width or 640) if film else ("time", end if at is None else at, width or 960)
    check_number(name, begin, "s", Range(float(run.time[0]), end), "to be within the run it")
    check_number("width", width, "pixels", WIDTHS)
    for name, value, unit in (("seconds", seconds, "s"), ("speed", speed, "1"), ("rate", rate, "s-1")):
        check_number(name, value, unit, POSITIVE)
    for name, radii in arrows.items():
        check_number(name, radii, "radii", NOT_NEGATIVE)
    times = np.arange(begin, min(begin + seconds * speed, end) + 1e-12, speed / rate) if film else np.array([begin])
    shown, note = stage.resampled(run, times), f"× {speed:.3g}" if film else ""
    slips = bool(np.any(run.slip_speed_A + run.slip_speed_B))
    pairs = stage.frames(run, times, width, **arrows)
    images = (_labelled(*pair, shown, k, note, slips) for k, pair in enumerate(pairs))
    first, options = next(images), dict[str, Any](optimize=True)
    if film:
        # 256 colours for all frames, so that none flickers: half from the first, half shades of those that mean
        # something, since what moves is small, and a palette of the first frame alone would make it grey.
        seen = first.quantize(120, dither=Image.Dither.NONE).getpalette() or []
        meant = np.array([to_rgb(colour) for colour in (*style.COLOURS.values(), FORCE, SLIP, BALL)])
        shades = np.linspace(0.45, 1.0, 6)[:, None, None] * meant
        tints = 1 - (1 - meant) * np.array([0.25, 0.5, 0.75])[:, None, None]
        chosen = np.concatenate([shades.reshape(-1, 3), tints.reshape(-1, 3)])
        palette = Image.new("P", (1, 1))
        palette.putpalette([*seen[:360], *np.round(255 * chosen).astype(int).ravel().tolist()])
        frames = [each.quantize(palette=palette, dither=Image.Dither.NONE) for each in itertools.chain([first], images)]
        first = frames[0]
        options = {"save_all": True, "append_images": frames[1:], "duration": round(1000 / rate), "loop": 0}
    try:
        first.save(output, **options)
    except OSError as error:
        raise StorageError(f"cannot write {output}: {error.strerror or error}") from error
    return f"{output}: {len(times)} frames" if film else f"{output}: {width} × {first.height}"


def _labelled(image: Image.Image, small: Image.Image, run: Trajectory, k: int, note: str, slips: bool) -> Image.Image:
    """The picture from outside, changed in place, with the one from beside the ball in its corner.

    Written over it are the case and numbers of sample k of the run, a note beside the time, and a legend, with slip
    velocities if there are any.
    """
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
    lines = (
        f"t = {run.time[k]:.3f} s   {note}",
        f"ω₀ = {float(run.header.flow(run.time[k])):.2f} rad/s",
        f"ω_c = {run.omega_c[k]:.2f} rad/s",
        f"slip: floor {run.slip_speed_A[k]:.3f} m/s, wall {run.slip_speed_B[k]:.3f} m/s",
    )
    draw.multiline_text((margin, bottom + pad), "\n".join(lines), INK, font=text, spacing=6 * unit)
    legend = [(FORCE, "contact force")] + ([(SLIP, "slip velocity")] if slips else [])
    for row, (colour, label) in enumerate(legend):
        y = image.height - margin - (10 + 26 * row) * unit
        draw.line((margin, y, margin + 30 * unit, y), fill=colour, width=max(2, round(5 * unit)))
        draw.text((margin + 40 * unit, y), label, INK, font=text, anchor="lm")
    return image
