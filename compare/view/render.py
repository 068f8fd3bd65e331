"""Pictures and films of a run: the MuJoCo scene from outside and from beside the ball, with forces, slip and case.

Everything shown is read from the run's file: the scene from the MJCF it holds (that of its parameters for the engines
that have none), the motion from its samples. What it doesn't hold is how the ball is turned: the ball is shown turned
with the angular velocity it has, from an arbitrary beginning.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping
from contextlib import closing
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from matplotlib.colors import to_rgb
from PIL import Image

from compare.figures import style
from compare.figures.style import BALL, FORCE, SLIP
from compare.view.stage import Stage
from model import InputError, StorageError, Trajectory
from model.arrays import Array
from model.files import check_writable
from model.parameters import NOT_NEGATIVE, POSITIVE, Range, check_number

WIDTHS = Range(160, 1920)
"""Of pictures, pixels."""
_IN_RUN = "to be within the run it"


def picture(run: Trajectory, at: float | None = None, width: int = 960, **arrows: Any) -> Image.Image:
    """The run at a time in s, its end if None, in 16:10; `arrows` are `force_arrow` and `slip_arrow` of `Stage`.

    Raises `InputError` for a time outside the run, an empty run, or a machine without OpenGL.
    """
    time = float(run.time[-1]) if at is None and len(run.time) else at or 0.0
    return next(_frames(run, np.array([time]), width, **arrows))


def film(
    run: Trajectory,
    output: Path,
    start: float = 0.0,
    seconds: float = 6.0,
    speed: float = 0.25,
    rate: int = 20,
    width: int = 640,
    **arrows: Any,
) -> int:
    """Write a GIF of so many seconds, or up to the end of the run, slowed down by `speed`; return the frames in it.

    `arrows` as for `picture`.

    Raises as `picture`, and `StorageError` if the file can't be written.
    """
    for name, value, unit in (("seconds", seconds, "s"), ("speed", speed, "1"), ("rate", rate, "s-1")):
        check_number(name, value, unit, POSITIVE)
    check_number("from", start, "s", _within(run), _IN_RUN)
    end = min(start + seconds * speed, float(run.time[-1]))
    images = _frames(run, np.arange(start, end + 1e-12, speed / rate), width, f"× {speed:.3g}", **arrows)
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
    meant = [to_rgb(colour) for colour in (*style.COLOURS.values(), FORCE, SLIP, BALL)]
    shades = np.linspace(0.45, 1.0, 6)[:, None, None] * np.array(meant)
    tints = 1 - (1 - np.array(meant)) * np.array([0.25, 0.5, 0.75])[:, None, None]
    chosen = np.concatenate([shades.reshape(-1, 3), tints.reshape(-1, 3)])
    made = Image.new("P", (1, 1))
    made.putpalette([*seen[:360], *np.round(255 * chosen).astype(int).ravel().tolist()])
    return made


def write(
    run: Trajectory,
    output: Path,
    at: float | None = None,
    width: int | None = None,
    arrows: Mapping[str, Any] = MappingProxyType({}),
    **film_options: Any,
) -> str:
    """Write a picture (png) or a film (gif), as the name of the file says; return what was written, in words.

    `arrows` as for `picture`; `film_options` are those of `film`, which a picture has no use for.

    Raises as `picture` and `film`; `InputError` for another kind of file.
    """
    if output.suffix not in (".png", ".gif"):
        raise InputError(f"cannot write {output}: a picture is a .png, a film a .gif")
    check_writable(output)
    if output.suffix == ".gif":
        count = film(run, output, width=width or 640, **film_options, **arrows)
        return f"{output}: {count} frames"
    image = picture(run, at, width or 960, **arrows)
    _save(image, output, optimize=True)
    return f"{output}: {image.width} × {image.height}"


def _save(image: Image.Image, output: Path, **options: Any) -> None:
    try:
        image.save(output, **options)
    except OSError as error:
        raise StorageError(f"cannot write {output}: {error.strerror or error}") from error


def _within(run: Trajectory) -> Range:
    if len(run.time) == 0:
        raise InputError("the run has no samples to show")
    return Range(float(run.time[0]), float(run.time[-1]))


def _frames(run: Trajectory, times: Array, width: int, note: str = "", **arrows: Any) -> Iterator[Image.Image]:
    check_number("time", times[0], "s", _within(run), _IN_RUN)
    check_number("width", width, "pixels", WIDTHS)
    for name, radii in arrows.items():
        check_number(name, radii, "radii", NOT_NEGATIVE)
    with closing(Stage(run, width, **arrows)) as stage:
        for time in times:
            yield stage.show(float(time), note)
