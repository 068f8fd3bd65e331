"""Figs. 7 and 8, which stationary solutions exist and where runs ended, and the bifurcation
diagrams of Figs. 9-12.

Those show stationary solutions against the flow, by their spin on the wall (91), with measured
states upon them."""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from scipy import ndimage

from analytic.bifurcation import diagram as bifurcation
from analytic.bifurcation.diagram import Exists
from analytic.stationary import slipping_branch
from compare.figures import style
from compare.figures.branches import (
    check_thresholds,
    fold_state,
    round_with_fluid,
    slipping,
    spin,
    spin_of,
)
from compare.figures.drawing import Diagram, Drawing, Evidence, GapError, diagram, only_where
from compare.figures.style import STABLE, UNSTABLE, LineStyle, Place
from compare.method.record import Measurement
from model import Case, Parameters, State
from model.arrays import Array

_THEORY = Parameters.named("reference")  # shown where nothing was measured
_WIDEST = 0.8  # friction of the wall up to which planes are shown
_SECTIONS = {0.2: "Figs. 9, 10", 0.6: "Figs. 9, 11"}
"""The two typical sections of Fig. 7, by wall friction."""
_BISTABLE = Exists.SS | Exists.SS_BEYOND_FOLD | Exists.SR | Exists.NR
TINTS = {
    Exists.RR | Exists.NS: style.tint(Case.RR),
    Exists.SS | Exists.NS: style.tint(Case.SS),
    _BISTABLE: style.tint(Case.SS, Case.NR),
    Exists.RR | Exists.SR | Exists.NR: style.tint(Case.RR, Case.NR),
    Exists.SR | Exists.NR: style.tint(Case.NR),
}
"""Pale grounds of the regions, by what attracts; lines and names tell them apart without colour."""


def select_plane(evidence: Evidence, figure: str) -> Diagram:
    """The plane of the points of a figure, "fig-7" or "fig-8"; of the first set."""
    checks = evidence.checks.get(figure, ())
    chosen = tuple(c for c in checks if c.measurement.set == checks[0].measurement.set)
    return Diagram(figure, chosen[0].measurement.parameters if chosen else _THEORY, checks=chosen)


def draw_plane(plane: Diagram) -> tuple[Figure, str]:
    """A figure of regions with their names, thresholds between them, and points at which runs
    ended; and its caption.

    Friction of floor and wall are equal in Fig. 8; in Fig. 7 that of the floor is fixed."""
    p, equal = plane.p, plane.figure == "fig-8"
    figure = style.figure(6.4, 4.9)
    axes = figure.add_subplot()
    flows = (c.measurement.parameters.omega_0 for c in plane.checks)
    regions(axes, p, equal, max(flows, default=0.0))
    of_paper = not equal and p.replace(eta=_THEORY.eta) == _THEORY
    for section, text in _SECTIONS.items() if of_paper else ():
        axes.axvline(section, color="0.4", lw=0.7, zorder=1)
        axes.text(section, 0.985, text, rotation=90, ha="right", va="top", fontsize=8, color="0.3",
                  transform=axes.get_xaxis_transform())  # fmt: skip
    engines = style.by_engine(plane.checks, lambda check: check.measurement.engine)
    marks = [(f"{name}, as predicted", own, style.mark_of(name)) for name, own in engines.items()]
    if failed := [check for check in plane.checks if not check.agrees]:
        crossed = {"marker": "x", "color": "#B3261E", "ms": 10, "mew": 2}
        marks.append(("not as predicted", failed, crossed))
    for label, checks, look in marks:
        places = [(c.measurement.parameters.eta, c.measurement.parameters.omega_0) for c in checks]
        axes.plot(*np.transpose(places), ls="none", label=label, **{"ms": 4.5} | look)
    style.legend(figure, loc="outside lower center", ncols=6, handlelength=3.2)
    style.dimensionless(axes, p, y=style.FREE_0)
    fixed = style.named(p, "j", "kappa") if equal else style.named(p, "mu", "j", "kappa")
    caption = (
        f"Which stationary solutions exist over ω₀ and {'η = μ' if equal else 'η'}, for {fixed}. "
        "Lines: the thresholds (84)-(88); dots: where they meet; SS*: the unstable part of SS; "
        "hatched: two stable motions (SS, and SR or NR)."
    )
    if plane.checks:
        caption += f" Marks: the {len(plane.checks)} points at which runs were started; they ended "
        crossed_out = f"not as predicted in {len(failed)} (crossed)."
        caption += crossed_out if failed else "as predicted in all."
    return figure, caption


def regions(axes: Axes, p: Parameters, equal: bool, highest: float = 0.0) -> None:
    """Draw which cases exist over friction and flow, at least to `highest`, rad s-1; thresholds."""
    eta = np.linspace(0.0, _WIDEST, 801)
    mu = eta if equal else np.full(eta.shape, p.mu)
    # lower ones set no scale
    doubles = [each for each in bifurcation.double_points(p, equal) if each.eta > 0.01]
    unit = float(np.sqrt(p.g / p.R))
    fastest = 1.15 * max([2.2 * unit, highest, *(point.omega_0 for point in doubles)])
    omega_0 = np.linspace(0.0, fastest, 901)
    plane = bifurcation.case_map(p, mu, eta, omega_0).T
    kinds = np.unique(plane)
    shades = ListedColormap([TINTS.get(Exists(int(kind)), "#eeeeee") for kind in kinds])
    shown, extent = np.searchsorted(kinds, plane), (*eta[[0, -1]], *omega_0[[0, -1]])
    grid: dict[str, Any] = {"origin": "lower", "aspect": "auto", "extent": extent}
    grid |= {"interpolation": "nearest", "zorder": 0}
    axes.imshow(shown, cmap=shades, vmin=0, vmax=len(kinds) - 1, **grid)
    both = (plane == _BISTABLE).astype(float)
    if both.any():
        lines: dict[str, Any] = {"colors": "none", "hatches": ["////"], "zorder": 0.2}
        hatched = axes.contourf(eta, omega_0, both, levels=[0.5, 1.5], **lines)
        hatched.set(edgecolor="0.75", linewidth=0)
    for name, curve in bifurcation.threshold_curves(p, mu, eta).items():
        if name in style.THRESHOLD_LINES:
            colour, line = style.THRESHOLD_LINES[name]
            # omega_03 ends rolling for eta > j only.
            shown = np.where((eta < p.j) & (name == "omega_03"), np.nan, curve * unit)
            axes.plot(eta, shown, color=colour, ls=line, lw=1.8, label=style.THRESHOLD_LABELS[name])
    for kind in kinds:
        _name(axes, plane == kind, eta, omega_0, int(kind))
    for point in doubles:
        axes.plot([point.eta], [point.omega_0], **style.POINT)
        axes.axvline(point.eta, ymax=point.omega_0 / fastest, **style.GUIDE)
        name = "$j$" if point.eta == p.j else "$\\eta_{cr}$"
        axes.annotate(name, (point.eta, 0), xytext=(3, 5), textcoords="offset points", fontsize=9)
    friction = "friction $\\eta = \\mu$" if equal else "wall friction $\\eta$"
    axes.set(xlabel=friction, ylabel=style.OMEGA_0, xlim=(0, _WIDEST), ylim=(0, fastest))


def _name(axes: Axes, where: npt.NDArray[np.bool_], eta: Array, omega_0: Array, kind: int) -> None:
    """Write the cases at the widest spot of every region with room for them.

    The region with two stable motions is narrow: its name stands at the top, with a line."""
    flags = (flag.name for flag in Exists if flag & kind and flag.name)
    names = [name.replace("SS_BEYOND_FOLD", "SS*") for name in flags]
    text = "\n".join("  ".join(row) for row in (names[:2], names[2:]) if row)
    regions, count = ndimage.label(where)
    near = np.any([np.abs(eta - section) < 0.035 for section in _SECTIONS], axis=0)
    for k, box in zip(range(1, count + 1), ndimage.find_objects(regions), strict=True):
        # The frame counts as an edge; text is about three times as wide as high.
        inside = np.pad(regions[box] == k, 1)
        room = ndimage.distance_transform_edt(inside, sampling=(1.0, 0.55))[1:-1, 1:-1]
        room = np.where(near[box[1]][None, :], room / 4, room)
        row, column = np.unravel_index(np.argmax(room), room.shape)
        here = float(eta[box[1]][column]), float(omega_0[box[0]][row])
        if room[row, column] <= 7:
            continue
        if kind == _BISTABLE:
            at: dict[str, Any] = {"textcoords": "axes fraction", "va": "top", "zorder": 6}
            look = style.NAME | at | {"arrowprops": {"arrowstyle": "-", "lw": 0.7, "color": "0.4"}}
            axes.annotate(f"{text}\nbistable", here, (0.31, 0.97), **look)
        else:
            narrow = "\n" in text and room[row, column] < 60
            style.beside(axes, *here, text, (-15, 45) if narrow else (0, 0))


RELEASED = _THEORY.replace(eta=0.43)
"""eta so little above j that the branch of SS, with (12) released, is whole."""
_SHOWN = {
    "fig-9": "off the floor, where y is free: sinking along the wall (NS) passes over to riding it "
    "(NR) at P2",
    "fig-10": "on the floor, for η < j: rolling (RR) passes over to slipping (SS) at P3, SS turns "
    "back at the fold F and ends in SR at NF2",
    "fig-11": "on the floor, for η > j: SR appears at ω₀₂, and RR ends at ω₀₃ where it meets SR "
    "(dots)",
    "fig-12": "as Fig. 11, but with the floor allowed to pull (A_y < 0), formally. The branch of "
    "SS and its bifurcations P3, F and NF2 reappear, and RR and SR exchange stability at NT1",
}


def draw_diagram(of: Diagram) -> tuple[Figure, str]:
    """A bifurcation diagram, spin on the wall over flow, both scales; and its caption."""
    figure, p = style.figure(5.8, 4.1), of.p
    if of.figure != "fig-9":
        only_where(p, of.figure == "fig-10")
    check_thresholds(p)
    axes, t = figure.add_subplot(), bifurcation.thresholds(p)
    guides, flows = _draw_branches(axes, p, of.figure)
    axes.set(xlim=flows, ylim=(0, 1.12 * axes.get_ylim()[1]))
    axes.set(xlabel=style.OMEGA_0, ylabel=style.OMEGA_X)
    if of.figure == "fig-12":
        axes.set_ylim(0.75 * t.omega_03 * p.R / p.r, 1.15 * guides["omega_01"] * p.R / p.r)
    style.points(axes, of.states)
    style.guides(axes, guides)
    style.legend(axes, loc="upper left")
    style.dimensionless(axes, p, style.FREE_0, style.FREE_X)
    caption = (
        f"Stationary solutions {_SHOWN[of.figure]}; {style.named(p)}, r/R = {p.r / p.R:g}. "
        "Dashed: unstable."
    )
    if of.figure == "fig-12" and slipping_branch.hopf_places(p):
        caption += " H: a Hopf point of SS, beyond which an oscillation grows, too."
    if of.states and of.figure in ("fig-10", "fig-11"):
        caption += " A ball on the wall (NR) has the spin of SR, also where SR is unstable."
    return figure, caption + style.marks(of.states)


def _draw_branches(
    axes: Axes, p: Parameters, figure: str
) -> tuple[dict[str, float], tuple[float, float]]:
    """Draw branches and special points; return thresholds and flows shown, rad s-1."""
    t, rolls, mark = bifurcation.thresholds(p), p.R / p.r, partial(style.mark, axes)
    guides = {name: getattr(t, name) for name in ("omega_01", "omega_02", "omega_03", "omega_04")}

    def draw(
        case: Case, begin: float, end: float, name: str, place: Place, line: LineStyle = STABLE
    ) -> None:
        slip_x, flows = round_with_fluid(p, case, begin, end)  # the ball goes round with the fluid
        style.curve(axes, case, flows, spin(p, slip_x, flows), (name, place), line)

    if figure == "fig-9":
        draw(Case.NS, 1e-3 * t.omega_02, (1 - 1e-9) * t.omega_02, "NS", (0.35, (-4, 6)))
        draw(Case.NR, t.omega_02, 2 * t.omega_02, "NR", (0.5, (4, 6)))
        mark(t.omega_02, spin_of(Case.NR, t.omega_02, p), "P2", (0, 8))
        return {"omega_02": t.omega_02}, (0.0, 2 * t.omega_02)
    if figure == "fig-10":
        del guides["omega_03"]
        draw(Case.RR, 0.0, t.omega_01, "RR", (0.5, (-5, 5)))
        slipping(axes, p, partial(spin, p), (0.5, (0, -7)), (0.4, (6, 6)))
        draw(Case.SR, t.omega_02, 1.25 * t.omega_04, "SR", (0.85, (-5, -5)))
        mark(t.omega_01, t.omega_01 * rolls, "P3", (-6, 4))
        mark(t.omega_02, spin_of(Case.NR, t.omega_02, p), "NF2", (-4, -6))
        mark(t.omega_04, float(bifurcation.wall_spin(fold_state(p), p)), "F", (4, -6))
        return guides, (0.0, 1.25 * t.omega_04)
    if figure == "fig-11":
        draw(Case.RR, 0.0, t.omega_03, "RR", (0.5, (-5, 5)))
        draw(Case.SR, t.omega_02, t.omega_03, "SR, unstable", (0.02, (9, 3)), UNSTABLE)
        draw(Case.SR, t.omega_03, 1.6 * t.omega_03, "SR", (0.5, (4, 6)))
        for w in (t.omega_02, t.omega_03):
            axes.plot([w], [spin_of(Case.NR, w, p)], **style.POINT)
        return {"omega_02": t.omega_02, "omega_03": t.omega_03}, (0.0, 1.6 * t.omega_03)
    if not np.isfinite(slipping_branch.states(np.linspace(-16.0, 16.0, 99), p)[1]).all():
        why = "with (12) released its branch of SS isn't whole: that needs an η nearer to j"
        raise GapError(f"{why} than {p.eta:g}")
    curves = bifurcation.threshold_curves(p, p.mu, p.eta, released=True)
    guides |= {name: float(curves[name] * np.sqrt(p.g / p.R)) for name in ("omega_01", "omega_04")}
    omega_01, omega_04 = guides["omega_01"], guides["omega_04"]
    bottom = t.omega_02 - 0.5 * (omega_04 - t.omega_02)
    top = omega_04 + 0.35 * (omega_04 - t.omega_02)
    draw(Case.RR, bottom, t.omega_03, "RR", (0.5, (-5, 5)))
    draw(Case.RR, t.omega_03, omega_01, "RR, virtual", (0.6, (-4, 4)), UNSTABLE)
    slipping(axes, p, partial(spin, p), (0.5, (0, 7)), (0.35, (0, 7)))
    draw(Case.SR, t.omega_02, t.omega_03, "SR, unstable", (0.5, (-30, -14)), UNSTABLE)
    draw(Case.SR, t.omega_03, top, "SR", (0.35, (-5, -5)))
    mark(omega_01, omega_01 * rolls, "P3", (-6, 0))
    mark(t.omega_03, t.omega_03 * rolls, "NT1", (7, 0))
    mark(t.omega_02, spin_of(Case.NR, t.omega_02, p), "NF2", (-6, 4))
    mark(omega_04, float(bifurcation.wall_spin(fold_state(p, released=True), p)), "F", (7, 0))
    for s in slipping_branch.hopf_places(p):
        x, omega_0 = slipping_branch.states(s, p)
        mark(float(omega_0), float(bifurcation.wall_spin(State.of(x), p)), "H", (5, -6))
    return guides, (bottom, top)


def _spins(cases: tuple[str, ...], evidence: Evidence) -> list[Measurement]:
    """Measured spins on the wall in some cases."""
    measured = [*evidence.select("wall_spin", "case"), *evidence.select("edge_wall_spin", "case")]
    return [m for m in measured if m.at["case"] in cases]


def _select_released(_: Evidence) -> Diagram:
    """Fig. 12, with (12) released: theory alone, since nothing measured can pull.

    A function with a name, for other processes draw: no lambda can be sent to them."""
    return Diagram("fig-12", RELEASED)


FIGURES = {
    name: Drawing(
        title, partial(select_plane, figure=name), draw_plane, (name,), partial(Diagram, name)
    )
    for name, title in (
        ("fig-7", "Fig. 7: regions over wall friction and flow"),
        ("fig-8", "Fig. 8: regions over equal friction and flow"),
    )
}
FIGURES |= {
    name: diagram(name, title, set, draw_diagram, (name,), partial(_spins, cases))
    for name, title, set, cases in (
        ("fig-9", "Fig. 9: off the floor", "reference", ("NS", "NR")),
        ("fig-10", "Fig. 10: on the floor, η < j", "reference", ("RR", "SS", "SR", "NR")),
        ("fig-11", "Fig. 11: on the floor, η > j", "high-wall-friction", ("RR", "SR", "NR")),
    )
}
_TITLE = "Fig. 12: on the floor, η > j, (12) released"
FIGURES["fig-12"] = Drawing(
    _TITLE, _select_released, draw_diagram, of_set=partial(Diagram, "fig-12")
)
