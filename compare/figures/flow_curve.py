"""Fig. 13: the characteristic curve of the flowmeter for eta < j, with its hysteresis, and for eta > j."""

from __future__ import annotations

from dataclasses import dataclass

from matplotlib.axes import Axes
from matplotlib.figure import Figure

import analytic
from analytic import bifurcation
from compare.figures import style
from compare.figures.bifurcation_diagrams import Line, fold_state, slipping
from compare.figures.drawing import Material
from compare.measure.record import Measurement
from model import Case, Parameters

SETS = {"fig-13-left": "reference", "fig-13-right": "high-wall-friction"}
"""The parameter set of each panel."""
_WAYS = {"up": ("^", "flow raised"), "down": ("v", "flow lowered")}


@dataclass(frozen=True)
class Curve:
    """A parameter set, and omega_c measured with it."""

    p: Parameters
    states: tuple[Measurement, ...] = ()


def select(material: Material, figure: str) -> Curve:
    """The settled states of Fig. 13: left, those of a flow that is raised and lowered in held steps."""
    name = SETS[figure]
    if figure == "fig-13-left":
        states = [m for m in material.select("omega_c", side=None) if m.set == name and m.conditions["side"] in _WAYS]
    else:
        states = [m for m in material.select("omega_c", case=None) if m.set == name and m.protocol == "settled"]
    return Curve(Parameters.named(name), tuple(states))


def caption(curve: Curve) -> str:
    """Of either panel."""
    p = curve.p
    text = "Characteristic curve of the flowmeter. " + (
        "Between ω₀₂ and ω₀₄ two motions are stable: which one the ball is in depends on where the flow came from "
        "(arrows). "
        if p.eta < p.j
        else "The curves of RR, SR and NR lie on one line and are drawn side by side, joined by dots where they begin. "
        "Black dot: where a ball that is carried by the wall drops when the flow falls, see the figure of its fall. "
    )
    if curve.states:
        text += f"Marks: {len(curve.states)} measured states, three standard uncertainties smaller than the marks. "
    return f"{text}{style.named(p)}. Dashed: unstable."


def draw(curve: Curve) -> Figure:
    """One panel, with both scales."""
    p = curve.p
    figure = style.figure(6.0, 4.3)
    axes = figure.add_subplot()
    if p.eta < p.j:
        fold_curve(axes, p, top(p), arrows=True)
        for side, (mark, text) in _WAYS.items():
            own = [m for m in curve.states if m.conditions["side"] == side]
            style.points(axes, own, way=f", {text}", marker=mark)
    else:
        apart = 0.045 * top(p)
        plain_curve(axes, p, top(p), apart)
        for steps, case in enumerate(("RR", "SR", "NR")):
            style.points(axes, [m for m in curve.states if m.conditions["case"] == case], steps * apart)
    axes.set(xlim=(0, top(p)), ylim=(0, 1.15 * top(p)), ylabel=style.OMEGA_C, xlabel=style.OMEGA_0)
    style.legend(axes, loc="upper left")
    style.dimensionless_x(axes, p)
    style.dimensionless_y(axes, p, "$\\Omega_c = \\omega_c\\sqrt{R/g}$")
    return figure


def top(p: Parameters) -> float:
    """The fastest flow shown, rad s-1."""
    t = bifurcation.thresholds(p)
    return 1.25 * t.omega_04 if p.eta < p.j else 1.6 * t.omega_03


def fold_curve(axes: Axes, p: Parameters, fastest: float, arrows: bool = False) -> None:
    """eta < j: rolling, slipping with its fold, and the line of SR and NR."""
    t = bifurcation.thresholds(p)
    _line(axes, Case.RR, 0.0, t.omega_01, "RR", 0.5)
    slipping(axes, p, lambda _, omega_c: omega_c, "SS", (0.5, (0, -7)), (0.5, (38, -14)))
    _line(axes, Case.SR, t.omega_02, fastest, "SR, NR", 0.75)
    axes.set_xlim(0, fastest)
    style.guides(axes, {f"omega_0{k}": getattr(t, f"omega_0{k}") for k in (1, 2, 4)})
    if arrows:
        slow = analytic.solution(p.replace(omega_0=t.omega_02 * (1 + 1e-9)), Case.SS)
        jumps = ((t.omega_04, float(fold_state(p)[2]), t.omega_04), (t.omega_02, t.omega_02, float(slow.state.omega_c)))
        for x, begin, end in jumps:
            look = {"arrowstyle": "-|>", "color": "black", "lw": 1.2, "shrinkA": 2, "shrinkB": 2}
            axes.annotate("", (x, end), (x, begin), arrowprops=look)


def plain_curve(axes: Axes, p: Parameters, fastest: float, apart: float = 0.0) -> None:
    """eta > j: all lines are one; set apart by `apart` for the eye."""
    t = bifurcation.thresholds(p)
    _line(axes, Case.RR, 0.0, t.omega_03, "RR", 0.4)
    if apart:
        _line(axes, Case.SR, t.omega_02, t.omega_03, "", 0.5, apart, style.UNSTABLE)
        _line(axes, Case.SR, t.omega_03, fastest, "SR", 0.7, apart)
        _line(axes, Case.NR, t.omega_02, fastest, "NR", 0.5, 2 * apart)
        for begin in (t.omega_02, t.omega_03):
            axes.plot([begin, begin], [begin, begin + (2 if begin == t.omega_02 else 1) * apart], "k:", lw=1)
        axes.plot([t.omega_02], [t.omega_02 + 2 * apart], **style.POINT)
    else:
        _line(axes, Case.SR, t.omega_03, fastest, "SR, NR", 0.6)
    axes.set_xlim(0, fastest)
    style.guides(axes, {"omega_02": t.omega_02, "omega_03": t.omega_03})


def _line(
    axes: Axes, case: Case, begin: float, end: float, text: str, at: float, lift: float = 0.0, line: Line = style.STABLE
) -> None:
    """omega_c = omega_0, drawn higher by `lift`, with its name above or below."""
    axes.plot([begin, end], [begin + lift, end + lift], color=style.COLOURS[case], ls=line, lw=2)
    if text:
        here = begin + at * (end - begin)
        offset = (-5, 5) if lift == 0 or case is Case.NR else (5, -5)
        style.name(axes, here, here + lift, text, offset, style.COLOURS[case])
