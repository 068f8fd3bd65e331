"""What is written over a picture: the case, numbers, a legend, and the view from beside the ball in a corner."""

from __future__ import annotations

from pathlib import Path

import matplotlib
from PIL import Image, ImageDraw, ImageFont

from compare.figures import style
from compare.figures.style import FORCE, INK, SLIP
from model import Case, Trajectory


def compose(image: Image.Image, small: Image.Image, run: Trajectory, k: int, note: str, slips: bool) -> Image.Image:
    """The picture from outside, changed in place, with the small one from beside the ball in its corner.

    What is written is that of sample k of the run; `note` is put beside the time; `slips` says whether the legend has
    to explain slip velocities.
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
