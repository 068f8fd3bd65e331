"""Characteristic curves with settled states, Fig. 13, the fall at unloading; a design."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Annotation

import analytic
from analytic.bifurcation import diagram as bifurcation
from analytic.flowmeter.design import THRESHOLDS, Design
from analytic.simulation import simulator
from compare.engines.study import EVENT
from compare.figures import style
from compare.figures.branches import check_thresholds, fold_state, slipping, stable_ends
from compare.figures.drawing import (
    Diagram,
    Drawing,
    Evidence,
    GapError,
    diagram,
    only_where,
    warn_of,
)
from compare.method.record import Measurement
from compare.subjects.flowmeter.measure import UNLOADED
from model import Case, Contact, Parameters

SETS = {"fig-13-left": "reference", "fig-13-right": "high-wall-friction"}
"""The parameter set of each panel, eta < j and eta > j."""
_WAYS = {"up": ("^", ", flow raised"), "down": ("v", ", flow lowered")}


def select_curves(evidence: Evidence) -> tuple[Diagram, ...]:
    """The settled states of every engine with two sets, without balls that only sink."""
    measured = (m for m in evidence.select("omega_c", "case") if m.parameters.omega_0 > 0)
    protocols = ("settled", "hysteresis")
    settled = [m for m in measured if m.protocol in protocols and m.at["case"] != "NS"]
    curves = tuple(
        Diagram(figure, Parameters.named(name), tuple(m for m in settled if m.set == name))
        for figure, name in SETS.items()
    )
    if not any(curve.states for curve in curves):
        raise GapError("no settled states were measured with its parameter sets")
    return curves


def draw_curves(curves: tuple[Diagram, ...]) -> tuple[Figure, str]:
    """A figure of two sets: characteristic curve, and deviations from it; its caption."""

    def nearest_prediction(m: Measurement) -> float:
        omega_c = [float(s.state.omega_c) for s in analytic.stable_solutions(m.parameters)]
        return min(omega_c, key=lambda w: abs(m.value / w - 1), default=np.nan)

    figure, panels = style.panels(10, 6, 2, len(curves), sharex="col", height_ratios=[3, 1.2])
    for (above, below), curve in zip(panels.T, curves, strict=True):
        p = curve.p
        fastest = max(map(style.omega_0, curve.states), default=top_flow(p)) * 1.04
        theory(above, p, fastest)
        above.set_title(f"η = {p.eta:g} {'<' if p.eta < p.j else '>'} j = {p.j:g}", fontsize=11)
        style.points(above, curve.states)
        highest = max([fastest, *(m.value for m in curve.states)])
        above.set(ylim=(0, 1.05 * highest), ylabel=style.OMEGA_C)
        style.legend(above, loc="upper left", frameon=False)
        style.dimensionless(above, p, style.FREE_0)
        above.grid(alpha=0.25)
        style.deviations(below, curve.states, nearest_prediction)
        below.set(xlabel=style.OMEGA_0)
    names_within(*panels[0])
    sides = zip(("left", "right"), curves, strict=True)
    sets = "; ".join(f"{side}: {style.named(curve.p)}" for side, curve in sides)
    states = [m for curve in curves for m in curve.states]
    return figure, (
        f"Angular velocity ω_c of the ball's orbit against that of the fluid, ω₀; {sets}. Lines: "
        "closed-form theory, dashed where unstable; of cases that lie on one line the colours take "
        "turns. Settled states were measured from rest, going round with the fluid, and high up on "
        "the wall. Below: relative deviation from the nearest attracting solution; what is below "
        f"1e-16 is drawn there.{style.marks(states)}"
    )


def draw_figure_13(of: Diagram) -> tuple[Figure, str]:
    """A panel of Fig. 13: the characteristic curve and measured states; its caption."""
    p, rises = of.p, of.figure == "fig-13-left"
    only_where(p, folds=rises)
    figure, axes = style.panels(6.0, 4.3)
    top = top_flow(p)
    t = theory(axes, p, top)
    if rises:
        said = (
            "Between ω₀₂ and ω₀₄ two motions are stable: which one the ball is in depends on where "
            "the flow came from (arrows). Dashed: unstable."
        )
        _jumps(axes, p, t)
        for side, (mark, text) in _WAYS.items():
            own = [m for m in of.states if m.at.get("side") == side]
            style.points(axes, own, way=text, marker=mark)
        style.points(axes, [m for m in of.states if m.protocol == "edge"], way=", edge", ms=3.5)
    else:
        said = (
            "RR, SR and NR lie on one line, in which their colours take turns; between ω₀₂ and ω₀₃ "
            "SR is on it, too, and unstable. Black dot: where a ball that is carried by the wall "
            "drops when the flow falls, see the figure of its fall."
        )
        axes.plot([t.omega_02], [t.omega_02], **style.POINT)
        style.points(axes, [m for m in of.states if m.at["case"] in ("RR", "SR", "NR")], ms=4)
    axes.set(xlim=(0, top), ylim=(0, 1.15 * top), ylabel=style.OMEGA_C, xlabel=style.OMEGA_0)
    style.legend(axes, loc="upper left")
    style.dimensionless(axes, p, style.FREE_0, style.FREE_C)
    names_within(axes)
    said = f"Characteristic curve of the flowmeter. {said}"
    return figure, style.caption(p, said, states=of.states)


def _jumps(axes: Axes, p: Parameters, t: bifurcation.Thresholds) -> None:
    """Draw as arrows where the reading jumps while the flow rises, and while it falls."""
    slow = analytic.solution(p.replace(omega_0=t.omega_02 * (1 + 1e-9)), Case.SS)
    look = {"arrowstyle": "-|>", "color": "black", "lw": 1.2, "shrinkA": 2, "shrinkB": 2}
    up = t.omega_04, fold_state(p).omega_c, t.omega_04
    for x, begin, end in (up, (t.omega_02, t.omega_02, slow.state.omega_c)):
        axes.annotate("", (x, float(end)), (x, float(begin)), arrowprops=look)


_PLAINLY = {Case.RR: "RR: rolls", Case.SS: "SS: slips, reads low", Case.NR: "SR, NR: on the wall"}
"""Cases of the curve for those who don't know the paper's names."""


def draw_calibration(
    p: Parameters, fastest: float, swirl: float | None = None, off: float = 0.0
) -> Figure:
    """A figure of the calibration curve of a set up to a flow, rad s-1, its range shaded; the
    volume flow above, by the swirl constant in rad m-3; and a warning if the model is `off` by too
    much."""
    figure, axes = style.panels(7.0, 4.8)
    limit = min(analytic.operating_range(p), fastest)
    axes.axvspan(0, limit, color="#0072B2", alpha=0.1, lw=0, label="operating range")
    t = theory(axes, p, fastest)
    if p.eta < p.j and t.omega_04 < fastest:
        _jumps(axes, p, t)
    for case in (Case.RR, Case.SS, Case.NR)[:: 1 if p.eta < p.j else 2]:
        axes.plot([], [], color=style.COLOURS[case], label=_PLAINLY[case])
    axes.set(xlim=(0, fastest), ylim=(0, 1.1 * fastest), xlabel=style.OMEGA_0, ylabel=style.OMEGA_C)
    if swirl:
        scale: Any = (lambda w: w / swirl, lambda Q: Q * swirl)
        axes.secondary_xaxis("top", functions=scale).set_xlabel("volume flow (m³/s)")
    warn_of(figure, off)
    style.legend(axes, loc="upper left")
    names_within(axes)
    return figure


def top_flow(p: Parameters) -> float:
    """The fastest flow shown, rad s-1; raises `InputError` where the set has no thresholds."""
    check_thresholds(p)
    t = bifurcation.thresholds(p)
    return 1.25 * t.omega_04 if p.eta < p.j else 1.6 * t.omega_03


def theory(axes: Axes, p: Parameters, fastest: float) -> bifurcation.Thresholds:
    """Draw stationary solutions up to a flow, but unstable SR; return the thresholds."""
    t, folds, (rolls, rides) = bifurcation.thresholds(p), p.eta < p.j, stable_ends(p)
    spans: list[tuple[tuple[Case, ...], tuple[float, float], float]] = [
        ((Case.RR,), (0.0, rolls if folds else t.omega_02), 0.45),
        ((Case.SR, Case.NR), (rides, fastest), 0.7),
    ]
    if folds:
        slipping(axes, p, lambda _, omega_c: omega_c, (0.5, (0, -7)), (0.5, (38, -14)))
    else:
        spans.append(((Case.RR, Case.NR), (t.omega_02, rolls), 0.5))
    for cases, span, at in spans:
        name = ", ".join(case.name for case in cases)
        style.curve(axes, cases, span, span, (name, (at, (-5, 5))))
    axes.set_xlim(0, fastest)
    shown = [f"omega_0{k}" for k in ((1, 2, 4) if folds else (2, 3))]
    style.guides(axes, {name: getattr(t, name) for name in shown})
    return t


def names_within(*panels: Axes) -> None:
    """Move names of curves that would stick out of axes of a figure, once these have limits."""
    if figure := panels[0].get_figure(root=True):
        figure.draw_without_rendering()
    for axes in panels:
        low, high = axes.get_window_extent().get_points()
        for name in axes.findobj(Annotation):
            begin, end = name.get_window_extent().get_points()
            inwards = np.maximum(low - begin, 0) - np.maximum(end - high, 0)
            name.xyann = name.xyann + inwards * 72 / axes.figure.dpi


def draw_fall(of: Diagram) -> tuple[Figure, str]:
    """A figure of a fall from the wall, and 20 ms about the landing; and its caption.

    The measured one with the finest step, if its file is there, else that of the event-driven
    simulation, whose flows are held for 5 s each: longer ones are sampled less densely."""
    only_where(of.p, folds=False)
    check_thresholds(of.p)
    run = of.motions[-1].load() if of.motions else simulator.unloading(of.p, 5.0)
    on_floor = np.array([Case(to).A is not Contact.N for to in run.events.to_case], bool)
    if not on_floor.any():
        raise GapError("the ball never landed")
    lands = run.events.time[on_floor][0]
    leaves = run.events.time[(run.events.from_case == Case.NR) & (run.events.time <= lands)]
    left = leaves[-1] if len(leaves) else run.time[0]
    figure, panels = style.panels(9, 6, 3, 2, sharex="col", width_ratios=[1.7, 1])
    whole, close = panels.T
    near = max(0.02, 12 * float(np.median(np.diff(run.time))))
    around, landing = (left - 0.3, left + 1.7), (lands - near, lands + near)
    # Span of time, its origin, and the units of time and gaps, in parts of a second and of a metre.
    views = (whole, around, left, 1.0, 1e3), (close, landing, lands, 1e3, 1e6)
    for column, span, origin, unit, size in views:
        k = np.flatnonzero((run.time > span[0]) & (run.time < span[1]))
        k = k[:: max(1, len(k) // 1500)]
        t = unit * (run.time[k] - origin)
        gaps, speed, slip = column
        dots: dict[str, Any] = {"color": "black", "marker": "" if column is whole else ".", "ms": 3}
        gaps.plot(t, size * run.y[k], label="$y$ (floor)", **dots)
        gaps.plot(t, size * run.h[k], color=style.FORCE, ls="--", label="$h$ (wall)")
        if column is whole:
            gaps.set_ylabel("gap (mm)")
            speed.plot(t, run.omega_c[k], color="black", label="$\\omega_c$")
            speed.plot(t, run.header.flow(run.time[k]), color="0.5", ls="--", label="$\\omega_0$")
            speed.set_ylabel("$\\omega_c$, $\\omega_0$ (rad/s)")
            slip.set_xlabel("$t$ after the end of NR (s)")
        else:
            hops = run.y[k][run.v_y[k] > 0].max(initial=0.0)
            highest = 1e6 * max(float(run.h[k].max()), float(hops), 1e-7)
            gaps.set(ylim=(-0.4 * highest, 1.4 * highest), ylabel="gap (µm)")
            speed.plot(t, 1e3 * run.v_y[k], **dots)
            speed.set_ylabel("$v_y$ (mm/s)")
            slip.set_xlabel("$t$ after the landing (ms)")
        for point, value, line in (("A", run.slip_speed_A, "-"), ("B", run.slip_speed_B, "--")):
            touches = [case for case in Case if getattr(case, point) is not Contact.N]
            shown = np.where(np.isin(run.case[k], touches), value[k], np.nan)
            slip.plot(t, shown, ls=line, label=f"$|v_{point}|$", **dots)
        begin, end = (unit * (time - origin) for time in span)
        slip.set(ylabel="slip speed (m/s)", xlim=(begin, end))
        for axes in column:
            style.ground(axes, run, span, unit, origin, named=axes is gaps)
            axes.axvline(unit * (lands - origin), color="0.3", lw=0.8)
            if column is whole:
                style.legend(axes, frameon=False)
    return figure, style.caption(
        of.p,
        "The fall of a ball that the wall carries, once ω₀ has fallen below ω₀₂. It slips at the "
        "wall (NS), sinks, hits the floor, slips at both points (SS), at the floor (SR), and rolls "
        "(RR). Right: the impact at t = 0, magnified in time and height (dots: samples). It stops "
        "the sinking at once. A hop would show as a gap, a depth as a negative one. Background: "
        f"the case, by name above; engine: {of.motions[-1].engine if of.motions else EVENT.name}.",
    )


def _loop(evidence: Evidence) -> Iterator[Measurement]:
    """Settled states of a flow that rises and falls in steps, and those on the edge."""
    yield from (m for m in evidence.select("omega_c", "side") if m.at["side"] in _WAYS)
    yield from evidence.select("edge_omega_c")


def _settled(evidence: Evidence) -> Iterator[Measurement]:
    """Settled states from fixed starts."""
    return (m for m in evidence.select("omega_c", "case") if m.protocol == "settled")


def _falls(evidence: Evidence) -> Iterator[Measurement]:
    """What was measured of the fall that is kept."""
    return evidence.records.select("unloading", where=lambda m: m.at["start"] == UNLOADED)


FIGURES = {"characteristic": Drawing("Characteristic curves", select_curves, draw_curves)} | {
    name: diagram(name, title, SETS[claim], draw, (claim,), measured)
    for name, title, claim, draw, measured in (
        ("fig-13-left", "Fig. 13, left: hysteresis, η < j", "fig-13-left", draw_figure_13, _loop),
        ("fig-13-right", "Fig. 13, right: η > j", "fig-13-right", draw_figure_13, _settled),
        ("unloading", "Section 5.3: the fall at unloading", "fig-13-right", draw_fall, _falls),
    )
}


def draw_readings(made: Design) -> tuple[Figure, str]:
    """A figure of a design: reading over flow, band and limits; and its caption."""
    curve, chosen, request = made.curve, made.choice, made.request
    figure, axes = style.panels(7.0, 4.3)
    flows, low, high, below, above = (
        np.append(0.0, each) for each in (curve.omega_0, *curve.meant, *curve.band)
    )
    axes.fill_between(flows, below, above, color="0.82", lw=0, label="within the tolerances")
    axes.plot(flows, low, color=style.COLOURS[Case.SS], lw=2, label="nominal, rising flow")
    falls = style.COLOURS[Case.NR]
    axes.plot(flows, high, color=falls, lw=2, ls="--", label="nominal, falling flow")
    wanted = request.slowest, request.fastest
    axes.axvspan(*wanted, color="#0072B2", alpha=0.12, lw=0, label="flows to measure")
    limit = chosen.worst.omega_0, chosen.limit.omega_0
    axes.axvspan(*limit, color=style.FORCE, alpha=0.25, lw=1, label="limit, from worst to nominal")
    axes.set(xlim=(0, flows[-1]), ylim=(0, None), xlabel=style.OMEGA_0, ylabel=style.OMEGA_C)
    style.guides(axes, {key: getattr(made.thresholds, key) for key in THRESHOLDS})
    style.legend(axes, loc="lower right")
    return figure, (
        "Angular velocity of the ball's orbit, against that of the fluid. Where the lines part, "
        "the reading depends on whether the flow rose or fell. Grey: from the lowest to the "
        "highest reading within the tolerances."
    )


def draw_friction(made: Design) -> tuple[Figure, str]:
    """A map of the operating limit of a chosen meter over frictions; and its caption."""
    chosen = made.choice
    top = {name: max(1.5 * chosen.values[name], 1.25 * chosen.p.j) for name in ("mu", "eta")}
    mu, eta = (np.linspace(top[name] / 50, top[name], 51) for name in ("mu", "eta"))
    sets = [[chosen.p.replace(mu=float(m), eta=float(e)) for e in eta] for m in mu]
    limits = [[analytic.operating_range(p) for p in row] for row in sets]
    figure, axes = style.panels(7.0, 4.3)
    shown = axes.contourf(eta, mu, limits, levels=14, cmap="cividis")
    figure.colorbar(shown, label="operating range up to $\\omega_0$ (rad/s)")
    axes.contour(eta, mu, limits, levels=[made.request.fastest], colors="white", linewidths=1.5)
    axes.axvline(chosen.p.j, color="black", lw=1, ls=":")
    (x, xerr), (y, yerr) = (
        (chosen.values[name], made.request.tolerances.get(name, 0.0) * chosen.values[name])
        for name in ("eta", "mu")
    )
    axes.errorbar(x, y, yerr, xerr, fmt="o", color="white", mec="black", ms=7, capsize=4)
    axes.set(xlabel="wall friction $\\eta$", ylabel="floor friction $\\mu$")
    return figure, (
        "How far the operating range reaches over both frictions, with ball, vessel and fluid as "
        "chosen. Dot: the choice, with its tolerances; white line: the fastest flow to measure; "
        "dotted: η = j, left of which slip limits the range, and right of which unloading does."
    )


OF_A_METER = draw_readings, draw_friction  # the figures of a design's page
