"""Characteristic curves of the flowmeter: with all settled states, and Fig. 13 with its hysteresis."""

from __future__ import annotations

from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import analytic
from analytic.bifurcation import diagram as bifurcation
from compare.branches import fold_state, slipping
from compare.kit import style
from compare.kit.drawing import Diagram, Drawing, GapError, Material
from compare.kit.engines import NEWCOMER
from compare.kit.record import Measurement
from model import Case, Parameters

SETS = {"fig-13-left": "reference", "fig-13-right": "high-wall-friction"}
"""The parameter set of each panel, eta < j and eta > j."""
_WAYS = {"up": ("^", ", flow raised"), "down": ("v", ", flow lowered")}
_LEAST = 1e-16
"""Smaller deviations are drawn here."""
_SETTLED = frozenset({"settled", "newcomer", "hysteresis"})
"""Protocols whose omega_c is that of a settled state."""


def select(material: Material) -> tuple[Diagram, ...]:
    """The settled states of every engine with the two sets of the paper's kind, without balls that only sink (NS)."""
    settled = [
        m
        for m in material.select("omega_c", "case")
        if m.protocol in _SETTLED and m.parameters.omega_0 > 0 and m.conditions["case"] != "NS"
    ]
    curves = tuple(_diagram(figure, settled) for figure in SETS)
    if not any(curve.states for curve in curves):
        raise GapError("no settled states were measured with its parameter sets")
    return curves


def select_figure_13(material: Material, figure: str) -> Diagram:
    """The settled states of a panel: left, those of a flow that is raised and lowered in held steps."""
    looped = [m for m in material.select("omega_c", "side") if m.conditions["side"] in _WAYS]
    looped += material.select("edge_omega_c")
    settled = [m for m in material.select("omega_c", "case") if m.protocol == "settled"]
    return _diagram(figure, looped if figure == "fig-13-left" else settled)


def _diagram(figure: str, rows: list[Measurement]) -> Diagram:
    name = SETS[figure]
    return Diagram(figure, Parameters.named(name), tuple(m for m in rows if m.set == name))


def caption(curves: tuple[Diagram, ...]) -> str:
    """Of the characteristic curves with all settled states."""
    sets = "; ".join(f"{side}: {style.named(curve.p)}" for side, curve in zip(("left", "right"), curves, strict=True))
    states = [m for curve in curves for m in curve.states]
    own = any(m.engine == NEWCOMER.name for m in states)
    crosses = ", crosses: MuJoCo's own contact parameters from rest" if own else ""
    return (
        f"Angular velocity ω_c of the ball's orbit against that of the fluid, ω₀; {sets}. Lines: closed-form theory, "
        "dashed where unstable; SR and NR lie on one line. Settled states were measured from rest, going round "
        f"with the fluid, and high up on the wall{crosses}. Below: relative deviation from the nearest attracting "
        f"solution; what is below 1e-16 is drawn there.{style.marks(states)}"
    )


def caption_figure_13(of: Diagram) -> str:
    """Of either panel."""
    p = of.p
    text = (
        "Between ω₀₂ and ω₀₄ two motions are stable: which one the ball is in depends on where the flow came from "
        "(arrows)."
        if p.eta < p.j
        else "The curves of RR, SR and NR lie on one line and are drawn side by side, joined by dots where they begin. "
        "Black dot: where a ball that is carried by the wall drops when the flow falls, see the figure of its fall."
    )
    drawn = f"{text}{style.edge(of.states)}{style.marks(of.states)} {style.named(p)}. Dashed: unstable."
    return f"Characteristic curve of the flowmeter. {drawn}"


def draw(curves: tuple[Diagram, ...]) -> Figure:
    """Two columns, one a parameter set: the curve above, deviations below."""
    figure = style.figure(10, 6)
    panels = figure.subplots(2, len(curves), sharex="col", squeeze=False, height_ratios=[3, 1.2])
    for (above, below), curve in zip(panels.T, curves, strict=True):
        p = curve.p
        fastest = max(map(style.omega_0, curve.states), default=_top(p)) * 1.04
        (_fold_curve if p.eta < p.j else _plain_curve)(above, p, fastest)
        above.set_title(f"η = {p.eta:g} {'<' if p.eta < p.j else '>'} j = {p.j:g}", fontsize=11)
        for engine, own in style.by_engine(curve.states, lambda m: m.engine).items():
            near = [(m.value, analytic.stable_solutions(m.parameters)) for m in own]
            off = [min((abs(w / float(s.state.omega_c) - 1) for s in states), default=np.nan) for w, states in near]
            below.plot([*map(style.omega_0, own)], np.maximum(off, _LEAST), ls="none", ms=5, **style.mark_of(engine))
        style.points(above, curve.states)
        above.set(ylim=(0, 1.05 * max([fastest, *(m.value for m in curve.states)])), ylabel=style.OMEGA_C)
        style.legend(above, loc="upper left", frameon=False)
        style.dimensionless(above, p, style.FREE_0)
        below.set(xlabel=style.OMEGA_0, ylabel="$|\\Delta\\omega_c| / \\omega_c$", yscale="log", ylim=(_LEAST / 10, 10))
        for axes in (above, below):
            axes.grid(alpha=0.25)
    return figure


def draw_figure_13(of: Diagram) -> Figure:
    """One panel, with both scales."""
    p, top = of.p, _top(of.p)
    figure = style.figure(6.0, 4.3)
    axes = figure.add_subplot()
    if p.eta < p.j:
        t = _fold_curve(axes, p, top)
        slow = analytic.solution(p.replace(omega_0=t.omega_02 * (1 + 1e-9)), Case.SS)
        look = {"arrowstyle": "-|>", "color": "black", "lw": 1.2, "shrinkA": 2, "shrinkB": 2}
        jumps = (t.omega_04, fold_state(p).omega_c, t.omega_04), (t.omega_02, t.omega_02, slow.state.omega_c)
        for x, begin, end in jumps:
            axes.annotate("", (x, float(end)), (x, float(begin)), arrowprops=look)
        for side, (mark, text) in _WAYS.items():
            style.points(axes, [m for m in of.states if m.conditions.get("side") == side], way=text, marker=mark)
        style.points(axes, [m for m in of.states if m.protocol == "edge"], way=", edge", ms=3.5)
    else:
        lifts = {case: 0.045 * top * k for k, case in enumerate(("RR", "SR", "NR"))}
        _plain_curve(axes, p, top, lifts["SR"])
        own = [m for m in of.states if m.conditions["case"] in lifts]
        style.points(axes, own, y=lambda m: m.value + lifts[str(m.conditions["case"])])
    axes.set(xlim=(0, top), ylim=(0, 1.15 * top), ylabel=style.OMEGA_C, xlabel=style.OMEGA_0)
    style.legend(axes, loc="upper left")
    style.dimensionless(axes, p, style.FREE_0, style.FREE_C)
    return figure


def figure_13(name: str, title: str) -> Drawing:
    """The record of a panel, which stands beside the claim of its name."""
    return Drawing(title, partial(select_figure_13, figure=name), draw_figure_13, caption_figure_13, (name,))


def _top(p: Parameters) -> float:
    """The fastest flow shown, rad s-1."""
    t = bifurcation.thresholds(p)
    return 1.25 * t.omega_04 if p.eta < p.j else 1.6 * t.omega_03


def _fold_curve(axes: Axes, p: Parameters, fastest: float) -> bifurcation.Thresholds:
    """eta < j: rolling, slipping with its fold, and the line of SR and NR; the thresholds."""
    t = bifurcation.thresholds(p)
    _line(axes, Case.RR, 0.0, t.omega_01, "RR", 0.5)
    slipping(axes, p, lambda _, omega_c: omega_c, (0.5, (0, -7)), (0.5, (38, -14)))
    _line(axes, Case.SR, t.omega_02, fastest, "SR, NR", 0.75)
    axes.set_xlim(0, fastest)
    style.guides(axes, {f"omega_0{k}": getattr(t, f"omega_0{k}") for k in (1, 2, 4)})
    return t


def _plain_curve(axes: Axes, p: Parameters, fastest: float, apart: float = 0.0) -> None:
    """eta > j: all lines are one; set apart by `apart` for the eye."""
    t = bifurcation.thresholds(p)
    _line(axes, Case.RR, 0.0, t.omega_03, "RR", 0.4)
    if apart:
        _line(axes, Case.SR, t.omega_02, t.omega_03, "", 0.5, apart, style.UNSTABLE)
        _line(axes, Case.SR, t.omega_03, fastest, "SR", 0.7, apart, offset=(5, -5))
        _line(axes, Case.NR, t.omega_02, fastest, "NR", 0.5, 2 * apart)
        for begin, steps in ((t.omega_02, 2), (t.omega_03, 1)):
            axes.plot([begin, begin], [begin, begin + steps * apart], "k:", lw=1)
        axes.plot([t.omega_02], [t.omega_02 + 2 * apart], **style.POINT)
    else:
        _line(axes, Case.SR, t.omega_03, fastest, "SR, NR", 0.6)
    axes.set_xlim(0, fastest)
    style.guides(axes, {"omega_02": t.omega_02, "omega_03": t.omega_03})


def _line(
    axes: Axes,
    case: Case,
    begin: float,
    end: float,
    text: str,
    at: float,
    lift: float = 0.0,
    line: style.Line = style.STABLE,
    offset: tuple[float, float] = (-5, 5),
) -> None:
    """omega_c = omega_0, drawn higher by `lift`, with its name above or below."""
    style.curve(axes, case, [begin, end], [begin + lift, end + lift], text, (at, offset) if text else None, line)
