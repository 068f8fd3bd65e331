"""Figs. 7 and 8: which stationary solutions exist in the plane of wall friction and flow."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from scipy import ndimage

from analytic.bifurcation import (
    DoublePoint,
    Exists,
    case_map,
    double_points,
    double_points_of_equal_friction,
    threshold_curves,
)
from compare.figures import style
from model import Parameters
from model.arrays import Array

ETA_MAX, OMEGA_MAX = 0.8, 90.0
_LINES = {
    "omega_01": ("#0072B2", "-"), "omega_02": ("#009E73", "--"), "omega_03": ("#E69F00", "-."),
    "omega_04": ("#D55E00", "-"),
}  # fmt: skip
_TINTS = {
    Exists.RR | Exists.NS: "#e8f1f8",
    Exists.SS | Exists.NS: "#fbe6dc",
    Exists.SS | Exists.SS_BEYOND_FOLD | Exists.SR | Exists.NR: "#f4e6ef",
    Exists.RR | Exists.SR | Exists.NR: "#fdf3df",
    Exists.SR | Exists.NR: "#e3f3ec",
}
"""Pale grounds of the regions; lines and names tell them apart without colour."""


def draw_figure_7(p: Parameters | None = None) -> Figure:
    """Fixed mu, eta along the axis; the two typical sections of Figs. 9-13 are the thin vertical lines."""
    p = p or Parameters.named("reference")
    figure = style.figure(6.2, 4.6)
    axes = figure.add_subplot()
    eta = np.linspace(0.0, ETA_MAX, 801)
    _plane(axes, p, np.full(eta.shape, p.mu), eta, double_points(p))
    for section in (0.2, 0.6):
        axes.axvline(section, **style.GUIDE)
    axes.set_xlabel(
        f"wall friction $\\eta$   ($\\mu$ = {p.mu:g}, $\\kappa = c\\sqrt{{R/g}}$ = {p.kappa:.3g}, $j$ = {p.j:g})"
    )
    return figure


def draw_figure_8(p: Parameters | None = None) -> Figure:
    """mu = eta, varied together."""
    p = p or Parameters.named("reference")
    figure = style.figure(6.2, 4.6)
    axes = figure.add_subplot()
    eta = np.linspace(0.0, ETA_MAX, 801)
    _plane(axes, p, eta, eta, double_points_of_equal_friction(p))
    axes.set_xlabel(f"friction $\\eta = \\mu$   ($\\kappa = c\\sqrt{{R/g}}$ = {p.kappa:.3g}, $j$ = {p.j:g})")
    return figure


def _plane(axes: Axes, p: Parameters, mu: Array, eta: Array, points: list[DoublePoint]) -> None:
    omega_0 = np.linspace(0.0, OMEGA_MAX, 901)
    plane = case_map(p, mu, eta, omega_0).T
    kinds = np.unique(plane)
    shades = ListedColormap([_TINTS.get(Exists(int(kind)), "#eeeeee") for kind in kinds])
    index = np.searchsorted(kinds, plane)
    axes.imshow(
        index, cmap=shades, vmin=0, vmax=len(kinds) - 1, origin="lower", aspect="auto", interpolation="nearest",
        extent=(eta[0], eta[-1], omega_0[0], omega_0[-1]),
    )  # fmt: skip
    unit = np.sqrt(p.g / p.R)
    for name, curve in threshold_curves(p, mu, eta).items():
        if name in _LINES:
            colour, line = _LINES[name]
            shown = curve * unit
            # omega_03 ends rolling for eta > j only.
            shown = np.where((eta < p.j) & (name == "omega_03"), np.nan, shown)
            axes.plot(eta, shown, color=colour, ls=line, lw=1.8, label=style.THRESHOLD_LABELS[name])
    for kind in kinds:
        _label_regions(axes, plane == kind, eta, omega_0, _names(int(kind)))
    for point in points:
        axes.plot([point.eta], [point.omega_0], **style.POINT)
        axes.axvline(point.eta, ymax=point.omega_0 / OMEGA_MAX, **style.GUIDE)
        name = "$j$" if point.eta == p.j else "$\\eta_{cr}$"
        axes.annotate(name, (point.eta, 0), xytext=(2, 2), textcoords="offset points", fontsize=9)
    axes.set_ylabel(style.OMEGA_0)
    axes.set_xlim(0, ETA_MAX)
    axes.set_ylim(0, OMEGA_MAX)
    axes.legend(loc="upper right", framealpha=0.95, fontsize=9, title="SS*: unstable", title_fontsize=8)
    style.dimensionless_y(axes, p, "$\\Omega_0 = \\omega_0\\sqrt{R/g}$")


def _names(kind: int) -> str:
    names = [flag.name.replace("SS_BEYOND_FOLD", "SS*") for flag in Exists if flag & kind and flag.name]
    return "\n".join(["  ".join(names[:2]), "  ".join(names[2:])]) if len(names) > 2 else "  ".join(names)


def _label_regions(axes: Axes, where: npt.NDArray[np.bool_], eta: Array, omega_0: Array, text: str) -> None:
    """Write the cases at the widest spot of every connected region that has room for them."""
    regions, count = ndimage.label(where)
    for k, box in zip(range(1, count + 1), ndimage.find_objects(regions), strict=True):
        # The frame counts as an edge; text is about three times as wide as high.
        inside = np.pad(regions[box] == k, 1)
        room = ndimage.distance_transform_edt(inside, sampling=(1.0, 0.55))[1:-1, 1:-1]
        row, column = np.unravel_index(np.argmax(room), room.shape)
        if room[row, column] > 14:
            size = 8.5 if room[row, column] > 40 else 7
            place = eta[box[1]][column], omega_0[box[0]][row]
            axes.text(*place, text, ha="center", va="center", fontsize=size, clip_on=True)
