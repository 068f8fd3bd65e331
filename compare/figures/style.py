"""How every figure looks: a colour and a mark for each case, solid for stable, dashed for unstable, two scales."""

from __future__ import annotations

import math
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from model import Case, Parameters

COLOURS = {
    Case.RR: "#0072B2", Case.RS: "#56B4E9", Case.RN: "#999999", Case.SR: "#E69F00", Case.SS: "#D55E00",
    Case.SN: "#8C564B", Case.NR: "#009E73", Case.NS: "#CC79A7", Case.NN: "#000000",
}  # fmt: skip
"""Okabe and Ito's colours, told apart by colour-blind readers."""
MARKERS = {
    Case.RR: "o", Case.RS: "v", Case.RN: "<", Case.SR: "s", Case.SS: "^", Case.SN: ">", Case.NR: "D", Case.NS: "P",
    Case.NN: "x",
}  # fmt: skip
STABLE, UNSTABLE = "-", (0, (5, 2.5))
"""Line styles."""
GUIDE: dict[str, Any] = {"color": "0.55", "lw": 0.8, "ls": ":", "zorder": 0}
"""Lines that only help the eye."""
POINT: dict[str, Any] = {"color": "black", "marker": "o", "ms": 4.5, "ls": "none", "zorder": 5}
"""A special point."""
OMEGA_0, OMEGA_C, OMEGA_X = "$\\omega_0$ (rad/s)", "$\\omega_c$ (rad/s)", "$\\omega_x^0$ (rad/s)"
THRESHOLD_LABELS = {name: f"$\\omega_{{{name[-2:]}}}$" for name in ("omega_01", "omega_02", "omega_03", "omega_04")}


def figure(width: float = 5.0, height: float = 3.6) -> Figure:
    """An empty figure in inches, sized for a column of print, with room for all labels."""
    return Figure(figsize=(width, height), layout="constrained")


def dimensionless_x(axes: Axes, p: Parameters, label: str = "$\\Omega_0 = \\omega_0\\sqrt{R/g}$") -> None:
    """A second scale at the top: angular velocity in units of sqrt(g/R)."""
    axes.secondary_xaxis("top", functions=_scale(p)).set_xlabel(label)


def dimensionless_y(axes: Axes, p: Parameters, label: str) -> None:
    """A second scale on the right: angular velocity in units of sqrt(g/R)."""
    axes.secondary_yaxis("right", functions=_scale(p)).set_ylabel(label)


def _scale(p: Parameters) -> tuple[Any, Any]:
    unit = math.sqrt(p.g / p.R)
    return lambda w: w / unit, lambda W: W * unit


def mark(axes: Axes, x: float, y: float, text: str, offset: tuple[float, float] = (6, 6)) -> None:
    """A black dot with its name beside it, `offset` in points."""
    axes.plot([x], [y], **POINT)
    halo = {"boxstyle": "round,pad=0.12", "fc": "white", "ec": "none", "alpha": 0.8}
    axes.annotate(
        text, (x, y), xytext=offset, textcoords="offset points", fontsize=9, bbox=halo, zorder=6,
        ha="left" if offset[0] >= 0 else "right", va="bottom" if offset[1] >= 0 else "top",
    )  # fmt: skip
