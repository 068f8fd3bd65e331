"""Figs. 7 and 8: which stationary solutions exist in the plane of wall friction and flow, and where runs ended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from scipy import ndimage

from analytic.bifurcation import diagram as bifurcation
from analytic.bifurcation.diagram import Exists
from compare.kit import style
from compare.kit.check import Check
from compare.kit.drawing import Material
from model import Parameters
from model.arrays import Array

_THEORY = Parameters.named("reference")
"""Shown where nothing was measured."""
_WIDEST = 0.8
_SECTIONS = {0.2: "Figs. 9, 10", 0.6: "Figs. 9, 11"}
"""The two typical sections of Fig. 7, by wall friction."""
_LINES = {
    "omega_01": ("#0072B2", "-"),
    "omega_02": ("#009E73", "--"),
    "omega_03": ("#E69F00", "-."),
    "omega_04": ("#D55E00", (0, (1, 1))),
}
_BISTABLE = Exists.SS | Exists.SS_BEYOND_FOLD | Exists.SR | Exists.NR
_TINTS = {
    Exists.RR | Exists.NS: "#e8f1f8",
    Exists.SS | Exists.NS: "#fbe6dc",
    _BISTABLE: "#f4e6ef",
    Exists.RR | Exists.SR | Exists.NR: "#fdf3df",
    Exists.SR | Exists.NR: "#e3f3ec",
}
"""Pale grounds of the regions; lines and names tell them apart without colour."""


@dataclass(frozen=True)
class Plane:
    """A plane of parameters, and where runs ended in it."""

    p: Parameters
    equal: bool
    """Whether mu = eta (Fig. 8) or fixed (Fig. 7)."""
    checks: tuple[Check, ...]


def select(material: Material, figure: str) -> Plane:
    """The plane of the measured points of a figure, "fig-7" or "fig-8"; of several sets the first."""
    checks = material.checks.get(figure, ())
    chosen = tuple(c for c in checks if c.measurement.set == checks[0].measurement.set)
    return Plane(chosen[0].measurement.parameters if chosen else _THEORY, figure == "fig-8", chosen)


def caption(plane: Plane) -> str:
    """Of either figure."""
    p, runs = plane.p, len(plane.checks)
    fixed = style.named(p, "j", "kappa") if plane.equal else style.named(p, "mu", "j", "kappa")
    text = (
        f"Which stationary solutions exist over ω₀ and {'η = μ' if plane.equal else 'η'}, for {fixed}. Lines: the "
        "thresholds (84)-(88); dots: where they meet; SS*: the unstable part of SS; hatched: two stable motions (SS, "
        "and SR or NR)."
    )
    if runs:
        failed = sum(not check.agrees for check in plane.checks)
        text += f" Marks: the {runs} points at which runs were started; {failed or 'none'} crossed, not as predicted."
    return text


def draw(plane: Plane) -> Figure:
    """Regions with their names, the thresholds between them, measured points by what was reached there."""
    p = plane.p
    figure = style.figure(6.4, 4.9)
    axes = figure.add_subplot()
    eta = np.linspace(0.0, _WIDEST, 801)
    mu = eta if plane.equal else np.full(eta.shape, p.mu)
    doubles = bifurcation.double_points(p, plane.equal)
    highest = [point.omega_0 for point in doubles] + [c.measurement.parameters.omega_0 for c in plane.checks]
    fastest = 1.15 * max([2.2 * float(np.sqrt(p.g / p.R)), *highest])
    _regions(axes, p, mu, eta, np.linspace(0.0, fastest, 901))
    for point in doubles:
        axes.plot([point.eta], [point.omega_0], **style.POINT)
        axes.axvline(point.eta, ymax=point.omega_0 / fastest, **style.GUIDE)
        name = "$j$" if point.eta == p.j else "$\\eta_{cr}$"
        axes.annotate(name, (point.eta, 0), xytext=(3, 5), textcoords="offset points", fontsize=9)
    for section, text in () if plane.equal else _SECTIONS.items():
        axes.axvline(section, color="0.4", lw=0.7, zorder=1)
        axes.text(section, 0.985 * fastest, text, rotation=90, ha="right", va="top", fontsize=8, color="0.3")
    for engine, own in style.by_engine(plane.checks, lambda check: check.measurement.engine).items():
        axes.plot(*_places(own), ls="none", ms=4.5, label=f"{engine}, as predicted", **style.mark_of(engine))
    if failed := [check for check in plane.checks if not check.agrees]:
        axes.plot(*_places(failed), "x", color="#B3261E", ms=10, mew=2, label="not as predicted")
    friction = "friction $\\eta = \\mu$" if plane.equal else "wall friction $\\eta$"
    axes.set(xlabel=friction, ylabel=style.OMEGA_0, xlim=(0, _WIDEST), ylim=(0, fastest))
    style.legend(figure, loc="outside lower center", ncols=6, handlelength=2.6)
    style.dimensionless(axes, p, y=style.FREE_0)
    return figure


def _regions(axes: Axes, p: Parameters, mu: Array, eta: Array, omega_0: Array) -> None:
    plane = bifurcation.case_map(p, mu, eta, omega_0).T
    kinds = np.unique(plane)
    shades = ListedColormap([_TINTS.get(Exists(int(kind)), "#eeeeee") for kind in kinds])
    grid: dict[str, Any] = {"origin": "lower", "aspect": "auto", "extent": (*eta[[0, -1]], *omega_0[[0, -1]])}
    shown = np.searchsorted(kinds, plane)
    axes.imshow(shown, cmap=shades, vmin=0, vmax=len(kinds) - 1, interpolation="nearest", zorder=0, **grid)
    both = (plane == _BISTABLE).astype(float)
    if both.any():
        hatched = axes.contourf(eta, omega_0, both, levels=[0.5, 1.5], colors="none", hatches=["////"], zorder=0.2)
        hatched.set(edgecolor="0.75", linewidth=0)
    unit = np.sqrt(p.g / p.R)
    for name, curve in bifurcation.threshold_curves(p, mu, eta).items():
        if name in _LINES:
            colour, line = _LINES[name]
            # omega_03 ends rolling for eta > j only.
            shown = np.where((eta < p.j) & (name == "omega_03"), np.nan, curve * unit)
            axes.plot(eta, shown, color=colour, ls=line, lw=1.8, label=style.THRESHOLD_LABELS[name])
    for kind in kinds:
        _name(axes, plane == kind, eta, omega_0, int(kind))


def _name(axes: Axes, where: npt.NDArray[np.bool_], eta: Array, omega_0: Array, kind: int) -> None:
    """Write the cases at the widest spot of every connected region that has room for them, clear of sections.

    The region with two stable motions is too narrow: its name stands at the top, with a line to where it belongs.
    """
    names = [flag.name.replace("SS_BEYOND_FOLD", "SS*") for flag in Exists if flag & kind and flag.name]
    text = "\n".join(["  ".join(names[:2]), "  ".join(names[2:])]) if len(names) > 2 else "  ".join(names)
    regions, count = ndimage.label(where)
    near = np.any([np.abs(eta - section) < 0.035 for section in _SECTIONS], axis=0)
    for k, box in zip(range(1, count + 1), ndimage.find_objects(regions), strict=True):
        # The frame counts as an edge; text is about three times as wide as high.
        inside = np.pad(regions[box] == k, 1)
        room = ndimage.distance_transform_edt(inside, sampling=(1.0, 0.55))[1:-1, 1:-1]
        room = np.where(near[box[1]][None, :], room / 4, room)
        row, column = np.unravel_index(np.argmax(room), room.shape)
        here = float(eta[box[1]][column]), float(omega_0[box[0]][row])
        if room[row, column] > 7 and kind == _BISTABLE:
            look: dict[str, Any] = {"bbox": style.HALO, "arrowprops": {"arrowstyle": "-", "lw": 0.7, "color": "0.4"}}
            at: dict[str, Any] = {"xytext": (0.31, 0.97), "textcoords": "axes fraction", "va": "top"}
            axes.annotate(f"{text}\nbistable", here, **at, **look, fontsize=9, zorder=6)
        elif room[row, column] > 7:
            style.name(axes, *here, text, (-15, 45) if "\n" in text and room[row, column] < 60 else (0, 0))


def _places(checks: Sequence[Check]) -> Array:
    return np.transpose([(c.measurement.parameters.eta, c.measurement.parameters.omega_0) for c in checks])
