"""What is written over a picture: the case, numbers, a legend, and the view from beside the ball in a corner."""

from __future__ import annotations

from pathlib import Path

import matplotlib
from PIL import Image, ImageDraw, ImageFont

from compare.figures import style
from compare.figures.style import FORCE, INK, SLIP
from compare.view.motion import Moment
from model import Case, Parameters, State
from model.kinematics import slip_speeds


def compose(
    image: Image.Image, small: Image.Image, moment: Moment, p: Parameters, slips: bool, note: str
) -> Image.Image:
    """The picture from outside, changed in place, with the small one from beside the ball in its corner.

    `slips` says whether the run has slip velocities to explain in the legend; `note` is put beside the time.
    """
    unit = image.width / 960
    margin = round(22 * unit)
    draw = ImageDraw.Draw(image)
    _paste(image, small, draw, margin, unit)
    (case,) = moment.cases
    right, bottom = _sign(draw, case, margin, unit)
    text = _font(round(17 * unit))
    words = f"floor: {case.A.value}\nwall: {case.B.value}"
    draw.multiline_text((right, margin + 2 * unit), words, INK, font=text, spacing=5 * unit)
    floor, wall = slip_speeds(moment.x, p)
    lines = (
        f"t = {moment.time:.3f} s   {note}",
        f"ω₀ = {float(moment.run.header.flow(moment.time)):.2f} rad/s",
        f"ω_c = {State.of(moment.x).omega_c:.2f} rad/s",
        f"slip: floor {floor:.3f} m/s, wall {wall:.3f} m/s",
    )
    draw.multiline_text((margin, bottom), "\n".join(lines), INK, font=text, spacing=6 * unit)
    legend = [(FORCE, "contact force")] + ([(SLIP, "slip velocity")] if slips else [])
    for k, (colour, label) in enumerate(legend):
        y = image.height - margin - (10 + 26 * k) * unit
        draw.line((margin, y, margin + 30 * unit, y), fill=colour, width=max(2, round(5 * unit)))
        draw.text((margin + 40 * unit, y), label, INK, font=text, anchor="lm")
    return image


def _paste(image: Image.Image, small: Image.Image, draw: ImageDraw.ImageDraw, margin: int, unit: float) -> None:
    left, top = image.width - small.width - margin, margin
    image.paste(small, (left, top))
    frame = (left - 1, top - 1, left + small.width, top + small.height)
    draw.rectangle(frame, outline="#8a94a3", width=max(1, round(1.5 * unit)))


def _sign(draw: ImageDraw.ImageDraw, case: Case, margin: int, unit: float) -> tuple[float, float]:
    """The case, as a sign in its colour; return where text to the right of it and below it may begin."""
    font, pad = _font(round(34 * unit)), 14 * unit
    _, _, width, height = draw.textbbox((0, 0), case.name, font=font)
    right, bottom = margin + width + 2 * pad, margin + height + 1.2 * pad
    draw.rounded_rectangle((margin, margin, right, bottom), 8 * unit, fill=style.COLOURS[case])
    draw.text((margin + pad, margin + 0.5 * pad), case.name, "white", font=font)
    return right + pad, bottom + pad


def _font(size: int) -> ImageFont.FreeTypeFont:
    return ImageFont.truetype(Path(matplotlib.get_data_path()) / "fonts/ttf/DejaVuSans.ttf", size)
