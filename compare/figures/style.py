"""How figures look: a colour a case, solid for stable, dashed for unstable, a mark an engine."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Text

from compare.engines.study import ENGINES
from compare.method.quantities import QUANTITIES
from compare.method.record import Measurement
from compare.method.runner import coarse_step
from compare.method.statistics import COVERAGE
from model import Case, Parameters, Trajectory
from model.drag import STOKES

T = TypeVar("T")
COLOURS = {
    Case.RR: "#005A96",
    Case.RS: "#2994D4",
    Case.RN: "#898989",
    Case.SR: "#B78000",
    Case.SS: "#C04000",
    Case.SN: "#703A30",
    Case.NR: "#00966C",
    Case.NS: "#C7699D",
    Case.NN: "#000000",
}
"""Okabe and Ito's colours, told apart by colour-blind readers, but darker, so that each has a
contrast of 3 with white; names tell them apart in print."""
HOPPING = "#7B3294"
"""Of a ball that hops for ever, a motion of several cases."""
FORCE, SLIP, BALL = "#b3261e", "#6a3d9a", "#f5cc6b"
"""On pages of motions: arrows of force and slip, the ball."""
LineStyle = str | tuple[object, ...]
"""A line style of matplotlib."""
STABLE, UNSTABLE = "-", (0, (5, 2.5))
_TURN = 4.0
"""How long each colour of a line of several cases is, in widths of the line."""
Offset = tuple[float, float]
"""In points."""
Place = tuple[float, Offset]
"""Where the name of a curve stands: at a share of its length, with an offset in points."""
Name = tuple[str, Place | None]
"""What a curve is called, and where that stands if anywhere."""
GUIDE: dict[str, Any] = {"color": "0.55", "lw": 0.8, "ls": ":", "zorder": 0}
"""Lines that only help the eye."""
POINT: dict[str, Any] = {"color": "black", "marker": "o", "ms": 4.5, "ls": "none", "zorder": 5}
"""A special point."""
HALO: dict[str, Any] = {"boxstyle": "round,pad=0.12", "fc": "white", "ec": "none", "alpha": 0.85}
"""Background of a name that stands on lines."""
NAME: dict[str, Any] = {"textcoords": "offset points", "fontsize": 9, "bbox": HALO}
"""How a name is written beside what it names."""
BARS: dict[str, Any] = {"ms": 5, "capsize": 2.5, "elinewidth": 1, "zorder": 4, "ls": "none"}
"""Measured points, with bars."""
SYMBOLS = {"mu": "μ", "eta": "η", "j": "j", "kappa": "κ", "omega_0": "ω₀"}
THRESHOLD_LINES: dict[str, tuple[str, LineStyle]] = {
    "omega_01": (COLOURS[Case.RR], "-"),
    "omega_02": (COLOURS[Case.NR], "--"),
    "omega_03": (COLOURS[Case.SR], "-."),
    "omega_04": (COLOURS[Case.SS], (0, (1, 1))),
}
"""Each threshold in the colour of the case that ends or begins there."""
THRESHOLD_LABELS = {name: f"$\\omega_{{{name[-2:]}}}$" for name in THRESHOLD_LINES}
FREE_0, FREE_C = "$\\Omega_0 = \\omega_0\\sqrt{R/g}$", "$\\Omega_c = \\omega_c\\sqrt{R/g}$"
FREE_X = "$\\omega_x^0\\sqrt{R/g}$"
LONGEST_BAR = 0.1
"""Longest half of an error bar, in parts of what is drawn along its axis."""
LEAST = 1e-16
"""Smaller relative errors are drawn here: an error may be zero."""


def figure(width: float, height: float) -> Figure:
    """An empty figure in inches, sized for a column of print, with room for all labels."""
    return Figure(figsize=(width, height), layout="constrained")


def panels(
    width: float, height: float, rows: int = 1, columns: int = 1, **layout: Any
) -> tuple[Figure, Any]:
    """A figure in inches and its axes, as `matplotlib.pyplot.subplots` gives them."""
    made = figure(width, height)
    return made, made.subplots(rows, columns, **layout)


_COLUMNS = {"theta": "θ", "h": "h", "v_h": "v_h", "slip_speed_A": "|v_A|", "slip_speed_B": "|v_B|"}
_COLUMNS |= {"gap_A": "gap at the floor", "gap_B": "gap at the wall"}
"""Letters of columns of a motion that nothing measures."""


def symbol(name: str) -> str:
    """A quantity, or a column of a motion, by its name, in letters of the axes."""

    def typeset(match: re.Match[str]) -> str:
        letter, tilde, index, zero = match.groups()
        letter = rf"\tilde{{{letter}}}" if tilde else letter
        return f"${letter}_{{{index}}}{'^0' if zero else ''}$"

    text = QUANTITIES[name].symbol if name in QUANTITIES else _COLUMNS[name]
    return re.sub(r"(\w)(\u0303?)_(\w+?)(⁰?)(?!\w)", typeset, text)


OMEGA_0, OMEGA_C, OMEGA_X = (
    f"{name} (rad/s)" for name in ("$ω_0$", symbol("omega_c"), symbol("wall_spin"))
)


def named(p: Parameters, *names: str) -> str:
    """Dimensionless parameters for a caption, by default without omega_0, and the drag law."""
    names = names or ("mu", "eta", "j", "kappa")
    values = [f"{SYMBOLS[name]} = {getattr(p, name):.3g}" for name in names]
    if p.drag != STOKES:
        Re = 2 * p.r * math.sqrt(p.g * p.R) / p.nu_f
        values.append(f"{p.drag} drag with Re = {Re:.3g} at √(gR)")
    return ", ".join(values)


def caption(p: Parameters, *sentences: str, states: Sequence[Measurement] = ()) -> str:
    """A caption: sentences, the parameters of a set, and what the marks of measured states mean."""
    return " ".join(filter(None, (*sentences, f"{named(p)}."))) + marks(states)


def marks(states: Sequence[Measurement]) -> str:
    """The part of a caption that explains the marks of measured points, if any."""
    if not states:
        return ""
    edge = " On the unstable SS: the edge between two motions, which the engine was made to follow."
    said = edge * any(m.protocol == "edge" for m in states)
    said += f" Marks: measured ({len(states)}); bars: three standard uncertainties, hidden where"
    said += " the mark is larger."
    most = max(abs(m.value) for m in states)
    if any(COVERAGE * m.uncertainty > LONGEST_BAR * most for m in states):
        said += f" Pale: known to no better than {LONGEST_BAR:.0%} of the axis, without a bar."
    if alone := dict.fromkeys(m.engine for m in states if ENGINES[m.engine].divisors != (1,)):
        steps = sorted({500 * coarse_step(m.parameters) for m in states if m.engine in alone})
        at = f"with a time step of {' or '.join(f'{step:g}' for step in steps)} ms"
        said += f" {' and '.join(alone)}: as measured {at}, not in the zero-step limit."
    return said


def dimensionless(axes: Axes, p: Parameters, x: str = "", y: str = "") -> None:
    """Draw second scales, at the top and right if named, in units of sqrt(g/R)."""
    unit = math.sqrt(p.g / p.R)
    scale: Any = (lambda w: w / unit, lambda W: W * unit)
    if x:
        axes.secondary_xaxis("top", functions=scale).set_xlabel(x)
    if y:
        axes.secondary_yaxis("right", functions=scale).set_ylabel(y)


def tint(*cases: Case) -> str:
    """The pale colour of a region in which balls end in these cases."""
    colours = [to_rgb(COLOURS[case]) for case in cases]
    return to_hex(0.86 + 0.14 * np.mean(colours, axis=0))


def curve(
    axes: Axes,
    cases: Case | tuple[Case, ...],
    x: npt.ArrayLike,
    y: npt.ArrayLike,
    name: Name = ("", None),
    line: LineStyle = STABLE,
) -> None:
    """Draw a line of theory (n,) in the colour of its case, where y is finite, and its name if that
    has a place.

    Of several cases that lie on it the colours take turns."""
    text, place = name
    cases = cases if isinstance(cases, tuple) else (cases,)
    label = f"_{text or ', '.join(case.name for case in cases)}"
    for k, case in enumerate(cases):
        turns = (_TURN * k, (_TURN, _TURN * (len(cases) - 1))) if len(cases) > 1 else line
        axes.plot(x, y, color=COLOURS[case], ls=turns, lw=2, label=label)
    if place:
        points, (at, offset) = np.transpose([x, y]), place
        steps = np.nan_to_num(np.hypot(*np.diff(points, axis=0).T))
        way = steps.cumsum()
        if not way[-1]:  # there is nothing to name
            return
        k = int(np.searchsorted(way, at * way[-1]))
        back = (way[k] - at * way[-1]) / steps[k]
        here_x, here_y = points[k + 1] - back * (points[k + 1] - points[k])
        beside(axes, here_x, here_y, text, offset, COLOURS[cases[-1]]).set_label(label)


def mark(axes: Axes, x: float, y: float, text: str, offset: Offset) -> None:
    """Draw a black dot with its name beside it, `offset` in points."""
    axes.plot([x], [y], **POINT)
    beside(axes, x, y, text, offset)


def beside(
    axes: Axes, x: float, y: float, text: str, offset: Offset = (0, 0), colour: str = "k"
) -> Text:
    """Write a name beside a point or curve, `offset` in points; far off with a line."""
    leader = {"arrowstyle": "-", "lw": 0.7, "color": "0.4", "shrinkB": 1}
    ha = "center" if offset[0] == 0 else "left" if offset[0] > 0 else "right"
    va = "center" if offset[1] == 0 else "bottom" if offset[1] > 0 else "top"
    ink = tuple(0.7 * part for part in to_rgb(colour))  # letters need more contrast than lines
    look = NAME | {"color": ink, "zorder": 6, "ha": ha, "va": va}
    arrow = leader if math.hypot(*offset) > 16 else None
    return axes.annotate(text, (x, y), xytext=offset, arrowprops=arrow, **look)


def guides(axes: Axes, values: dict[str, float]) -> None:
    """Draw dotted lines at thresholds, rad s-1, named at the foot, or one line higher."""
    low, high = axes.get_xlim()
    last, step = -math.inf, 0
    look = NAME | {"xytext": (2, 0), "xycoords": ("data", "axes fraction"), "color": "0.25"}
    for key, value in sorted(values.items(), key=lambda item: item[1]):
        if low <= value <= high:
            step = step + 1 if value - last < 0.08 * (high - low) else 0
            last = value
            axes.axvline(value, **GUIDE)
            axes.annotate(THRESHOLD_LABELS[key], (value, 0.02 + 0.07 * step), **look, zorder=0.5)


def mark_of(engine: str) -> dict[str, Any]:
    """Marker of an engine's points: black, since colours are those of cases."""
    given = ENGINES.get(engine)  # theory against theory has none
    return {"marker": given.mark if given else "D", "color": "0.1", "mfc": "white"}


def by_engine(rows: Iterable[T], engine: Callable[[T], str]) -> dict[str, list[T]]:
    """Rows by the name of their engine."""
    sorted_out: dict[str, list[T]] = {}
    for row in rows:
        sorted_out.setdefault(engine(row), []).append(row)
    return sorted_out


def omega_0(m: Measurement) -> float:
    """The flow at which something was measured, rad s-1."""
    return m.parameters.omega_0


def points(
    axes: Axes,
    rows: Iterable[Measurement],
    x: Callable[[Measurement], float] = omega_0,
    y: Callable[[Measurement], float] = lambda m: m.value,
    unit: float = 1.0,
    way: str = "",
    **look: Any,
) -> None:
    """Draw measured values times `unit`, by engine, with bars; pale where too long."""
    rows = list(rows)
    for m in rows:
        axes.update_datalim([(x(m), unit * y(m))])
    longest = LONGEST_BAR * axes.dataLim.height
    for engine, own in by_engine(rows, lambda m: m.engine).items():
        for pale in (False, True):
            shown = [m for m in own if (COVERAGE * unit * m.uncertainty > longest) == pale]
            bars = [math.nan if pale else COVERAGE * unit * m.uncertainty for m in shown]
            named = not pale or len(shown) == len(own)
            usual = mark_of(engine) | BARS | {"label": f"{'' if named else '_'}{engine}{way}"}
            usual |= {"alpha": 0.4} if pale else {}
            if shown:
                places = [x(m) for m in shown], [unit * y(m) for m in shown]
                axes.errorbar(*places, bars, **usual | look)


def legend(of: Axes | Figure, **where: Any) -> None:
    """Draw a legend that names everything once; of a figure outside the panels."""
    once: dict[str, Any] = {}
    for axes in of.axes if isinstance(of, Figure) else [of]:
        handles, labels = axes.get_legend_handles_labels()
        once |= dict(zip(labels, handles, strict=True))
    if once:
        outside = isinstance(of, Figure)
        usual: dict[str, Any] = {"frameon": False} if outside else {"framealpha": 0.95}
        usual["fontsize"] = 8 if outside else 8.5
        of.legend(list(once.values()), list(once), **usual | where)


def ground(
    axes: Axes,
    run: Trajectory,
    span: tuple[float, float],
    unit: float = 1.0,
    origin: float = 0.0,
    named: bool = True,
) -> None:
    """Shade each stretch of a span of time in the colour of its case, and name it above where there
    is room, else in the legend."""
    cases = [run.cases[0], *map(Case, run.events.to_case)]
    bounds = [run.time[0], *run.events.time, run.time[-1]]
    for case, (first, last) in zip(cases, pairwise(bounds), strict=True):
        low, high = max(first, span[0]), min(last, span[1])
        if low < high:
            x = unit * (np.array([low, high]) - origin)
            wide = high - low > 0.04 * (span[1] - span[0])
            name = case.name if named and not wide else None
            axes.axvspan(*x, color=COLOURS[case], alpha=0.15, lw=0, label=name)
            if named and wide:
                above: dict[str, Any] = {"transform": axes.get_xaxis_transform(), "ha": "center"}
                axes.text(x.mean(), 1.02, case.name, **above, fontsize=8)


def deviations(
    axes: Axes, rows: Iterable[Measurement], predicted: Callable[[Measurement], float]
) -> None:
    """Draw relative deviations of measured values, by engine, on a logarithmic axis."""
    for engine, own in by_engine(rows, lambda m: m.engine).items():
        off = [max(abs(m.value / predicted(m) - 1), LEAST) for m in own]
        axes.plot(list(map(omega_0, own)), off, ls="none", ms=5, **mark_of(engine))
    axes.set(yscale="log", ylim=(LEAST / 10, 10), ylabel="relative deviation")
    axes.grid(alpha=0.25)
