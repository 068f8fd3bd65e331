"""How every figure looks: a colour for each case, solid for stable, dashed for unstable, a mark for each engine."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from compare.measure.record import Measurement
from compare.runs.engines import ENGINES
from model import Case, Parameters
from model.drag import STOKES

COLOURS = {
    Case.RR: "#0072B2",
    Case.RS: "#56B4E9",
    Case.RN: "#999999",
    Case.SR: "#E69F00",
    Case.SS: "#D55E00",
    Case.SN: "#8C564B",
    Case.NR: "#009E73",
    Case.NS: "#CC79A7",
    Case.NN: "#000000",
}
"""Okabe and Ito's colours, told apart by colour-blind readers; names beside the curves tell them apart in print."""
FORCE, SLIP, BALL, INK = "#b3261e", "#6a3d9a", "#f5cc6b", "#1c2430"
"""Of pictures and films: arrows of force and slip, the ball, text."""
STABLE, UNSTABLE = "-", (0, (5, 2.5))
"""Line styles."""
GUIDE: dict[str, Any] = {"color": "0.55", "lw": 0.8, "ls": ":", "zorder": 0}
"""Lines that only help the eye."""
POINT: dict[str, Any] = {"color": "black", "marker": "o", "ms": 4.5, "ls": "none", "zorder": 5}
"""A special point."""
HALO: dict[str, Any] = {"boxstyle": "round,pad=0.12", "fc": "white", "ec": "none", "alpha": 0.85}
"""Ground of a name that stands on lines."""
_TEXT: dict[str, Any] = {"fontsize": 9, "bbox": HALO}
OMEGA_0, OMEGA_C, OMEGA_X = "$\\omega_0$ (rad/s)", "$\\omega_c$ (rad/s)", "$\\omega_x^0$ (rad/s)"
UP_TO_UNITS = "$\\Omega_0 = \\omega_0\\sqrt{R/g}$"
THRESHOLD_LABELS = {name: f"$\\omega_{{{name[-2:]}}}$" for name in ("omega_01", "omega_02", "omega_03", "omega_04")}
SYMBOLS = {"mu": "μ", "eta": "η", "j": "j", "kappa": "κ", "c": "c", "omega_0": "ω₀"}


def figure(width: float = 5.0, height: float = 3.6) -> Figure:
    """An empty figure in inches, sized for a column of print, with room for all labels."""
    return Figure(figsize=(width, height), layout="constrained")


def named(p: Parameters, *names: str) -> str:
    """The dimensionless parameters as a caption gives them, all but omega_0 if none is named, and the law of drag."""
    values = [f"{SYMBOLS[name]} = {getattr(p, name):.3g}" for name in names or ("mu", "eta", "j", "kappa")]
    if p.drag != STOKES:
        values.append(f"{p.drag} drag with Re = {2 * p.r * math.sqrt(p.g * p.R) / p.nu_f:.3g} at √(gR)")
    return ", ".join(values)


def dimensionless_x(axes: Axes, p: Parameters) -> None:
    """A second scale at the top: angular velocity in units of sqrt(g/R)."""
    axes.secondary_xaxis("top", functions=_scale(p)).set_xlabel(UP_TO_UNITS)


def dimensionless_y(axes: Axes, p: Parameters, label: str) -> None:
    """A second scale on the right: angular velocity in units of sqrt(g/R)."""
    axes.secondary_yaxis("right", functions=_scale(p)).set_ylabel(label)


def _scale(p: Parameters) -> tuple[Any, Any]:
    unit = math.sqrt(p.g / p.R)
    return lambda w: w / unit, lambda W: W * unit


def mark(axes: Axes, x: float, y: float, text: str, offset: tuple[float, float] = (6, 6)) -> None:
    """A black dot with its name beside it, `offset` in points."""
    axes.plot([x], [y], **POINT)
    name(axes, x, y, text, offset)


def name(axes: Axes, x: float, y: float, text: str, offset: tuple[float, float] = (0, 0), colour: str = "k") -> None:
    """A name beside a point or a curve, `offset` in points; one that is far off has a line to it."""
    leader = {"arrowstyle": "-", "lw": 0.7, "color": "0.4", "shrinkB": 1} if math.hypot(*offset) > 16 else None
    ha = "center" if offset[0] == 0 else "left" if offset[0] > 0 else "right"
    va = "center" if offset[1] == 0 else "bottom" if offset[1] > 0 else "top"
    look: dict[str, Any] = {"color": colour, "arrowprops": leader, "zorder": 6, "ha": ha, "va": va}
    axes.annotate(text, (x, y), xytext=offset, textcoords="offset points", **_TEXT | look)


def guides(axes: Axes, values: dict[str, float]) -> None:
    """Dotted lines at thresholds by name, rad s-1, named at the foot; names side by side would overlap."""
    low, high = axes.get_xlim()
    last, step = -math.inf, 0
    for key, value in sorted(values.items(), key=lambda item: item[1]):
        if not low <= value <= high:
            continue
        step = 1 - step if value - last < 0.08 * (high - low) else 0
        last = value
        axes.axvline(value, **GUIDE)
        place: dict[str, Any] = {"xycoords": ("data", "axes fraction"), "xytext": (2, 0), "textcoords": "offset points"}
        axes.annotate(THRESHOLD_LABELS[key], (value, 0.02 + 0.07 * step), **place, **_TEXT, color="0.25", zorder=0.5)


def mark_of(engine: str) -> dict[str, Any]:
    """The mark of what an engine gave."""
    given = ENGINES.get(engine)  # theory against theory has none
    return {"marker": given.mark if given else "D", "color": given.colour if given else "0.3", "mfc": "white"}


def points(axes: Axes, states: Sequence[Measurement], lift: float = 0.0, way: str = "", **look: Any) -> None:
    """Measured values over omega_0 by engine, drawn higher by `lift`; capped bars of three standard uncertainties."""
    for engine in dict.fromkeys(m.engine for m in states):
        own = [m for m in states if m.engine == engine]
        omegas, values = [m.parameters.omega_0 for m in own], [m.value + lift for m in own]
        bars = [3 * m.uncertainty for m in own]
        usual = {"ms": 5, "label": engine + way, "capsize": 2.5, "elinewidth": 1, "zorder": 4}
        axes.errorbar(omegas, values, yerr=bars, ls="none", **mark_of(engine) | usual | look)


def legend(axes: Axes, **where: Any) -> None:
    """A legend that names everything once, if there is anything to name."""
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    if once:
        given: dict[str, Any] = {"fontsize": 8.5, "framealpha": 0.95} | where
        axes.legend(list(once.values()), list(once), **given)
