"""Draw the figures of pages that show no measurement of a validation: ``python -m
docs.studies.figures``. Each is written to its place in docs/.

Figs. 2, 3 and 6 are the nine cases, sections of the state space, and transitions to cases of more
freedom."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, FancyArrowPatch, Rectangle

from analytic.slipping.slip_stability import LIFT_ARROWS, SLIP_ARROWS
from compare.figures import drawing, style
from compare.subjects.attractors import figures as attractors
from compare.subjects.attractors.basins import Basins
from model import Case, Contact
from model.cases import TRAITS
from model.files import make_directory

DOCS = Path(__file__).parents[1]
_COLUMNS = "RSN"
_PLACES = {
    Case.RR: (0.0, 0.0),
    Case.RS: (-2.0, 1.15),
    Case.SR: (0.9, 1.15),
    Case.SS: (0.0, 2.2),
    Case.NR: (3.2, 2.2),
    Case.NS: (0.9, 3.5),
}
_REACH = 0.42
"""Radius round a case of Fig. 6 that its arrows leave free."""


def draw_2() -> Figure:
    """Fig. 2, the nine cases. Rows: the contact with the floor; columns: with the wall; nearer ones
    roll."""
    figure = style.figure(6.4, 6.2)
    for row, panels in zip(_COLUMNS, figure.subplots(3, 3), strict=True):
        for column, axes in zip(_COLUMNS, panels, strict=True):
            _sketch(axes, Case[row + column])
    return figure


def _sketch(axes: Axes, case: Case) -> None:
    up, off = (0.22 * (contact is Contact.N) for contact in (case.A, case.B))
    soil: dict[str, Any] = {"hatch": "////", "fc": "0.93", "ec": "0.6", "lw": 0}
    axes.add_patch(Rectangle((0, -0.15), 2.2, 0.15, **soil))
    axes.add_patch(Rectangle((2.2, -0.15), 0.15, 2.3, **soil))
    axes.plot([0, 2.2, 2.2], [0, 0, 2.15], color="black", lw=1.6)
    centre = (1.4 - off, 0.8 + up)
    axes.add_patch(Circle(centre, 0.8, fc="white", ec=style.COLOURS[case], lw=2.2))
    floor, wall = (centre[0], up), (centre[0] + 0.8, centre[1])
    _contact(axes, case.A, floor, (1, 0))
    _contact(axes, case.B, wall, (0, 1))
    look: dict[str, Any] = {"ha": "center", "va": "center"}
    axes.text(floor[0], floor[1] + 0.24, "A", fontsize=8, **look)
    axes.text(wall[0] - 0.24, wall[1], "B", fontsize=8, **look)
    active = TRAITS[case].active
    geometric = len({"y", "h"} & set(active))
    numbers = f"{geometric} + {len(active) - geometric} = {len(active)}"
    axes.text(*centre, f"{case.name}\n{numbers}", fontsize=10, linespacing=1.4, **look)
    axes.set(xlim=(0, 2.4), ylim=(-0.2, 2.2), aspect="equal")
    axes.axis("off")


def _contact(axes: Axes, contact: Contact, at: tuple[float, float], along: tuple[int, int]) -> None:
    if contact is Contact.R:
        axes.plot(*at, "ko", ms=6)
    elif contact is Contact.S:
        # in the ball, clear of the line of floor or wall
        inside = 0.1 * np.array(along[::-1]) * (-1, 1)
        ends = [tuple(np.array(at) + inside + side * 0.34 * np.array(along)) for side in (-1, 1)]
        look: dict[str, Any] = {"mutation_scale": 9, "color": "#B3261E", "lw": 1.6, "zorder": 4}
        axes.add_patch(FancyArrowPatch(*ends, arrowstyle="<|-|>", **look))


def draw_3() -> Figure:
    """Fig. 3, sections of the state space.

    Left: y = v_y = 0 at one omega_c, over the three slips. Right: y = v_y = slip_z = 0."""
    figure = style.figure(9.0, 4.3)
    left: Any = figure.add_subplot(1, 2, 1, projection="3d")
    right: Any = figure.add_subplot(1, 2, 2, projection="3d")
    left.plot([-1, 1], [0, 0], [0, 0], color=style.COLOURS[Case.SR], lw=3)
    left.plot([0, 0], [-1, 1], [0, 0], color=style.COLOURS[Case.RS], lw=3)
    left.plot([0, 0], [0, 0], [-1, 1], color="0.6", lw=0.8, ls=":")
    left.plot([0], [0], [0], color=style.COLOURS[Case.RR], marker="o", ms=9)
    outside = (0.8, 0.8, -0.7)
    places = {Case.RR: (-0.2, 0, 0.16), Case.SR: (0.85, 0, 0.14), Case.RS: (0, 0.8, 0.14)}
    _name(left, places | {Case.SS: outside})
    _axes(left, ("$\\tilde\\omega_x$", "$\\tilde\\omega_y$", "$\\tilde\\omega_z$"))
    left.set_title("$y = v_y = 0$, $\\omega_c$ fixed", fontsize=10)
    across, along = np.meshgrid([-1.0, 1.0], [-1.0, 1.0])
    zero = np.zeros((2, 2))
    right.plot_surface(across, zero, along, color=style.COLOURS[Case.SR], alpha=0.4, shade=False)
    right.plot_surface(zero, across, along, color=style.COLOURS[Case.RS], alpha=0.4, shade=False)
    right.plot([0, 0], [0, 0], [-1, 1], color=style.COLOURS[Case.RR], lw=3)
    places = {Case.RR: (0, 0, 1.1), Case.SR: (0.75, 0, 0.7), Case.RS: (0, -0.75, 0.7)}
    _name(right, places | {Case.SS: outside})
    _axes(right, ("$\\tilde\\omega_x$", "$\\tilde\\omega_y$", "$\\omega_c$"))
    right.set_title("$y = v_y = \\tilde\\omega_z = 0$", fontsize=10)
    return figure


def _name(axes: Any, places: dict[Case, tuple[float, float, float]]) -> None:
    for case, place in places.items():
        axes.text(*place, case.name, color="black", fontsize=11, ha="center", fontweight="bold")


def _axes(axes: Any, names: tuple[str, str, str]) -> None:
    for axis, name in zip("xyz", names, strict=True):
        getattr(axes, f"set_{axis}label")(name, labelpad=-8)
        getattr(axes, f"set_{axis}ticks")([])
    axes.view_init(22, -58)


def draw_6() -> Figure:
    """Fig. 6, transitions to cases of more freedom.

    Solid: slip begins at A; dashed: at B; dotted: the ball leaves the floor. Higher up: more
    freedom."""
    figure = style.figure(6.4, 4.7)
    axes = figure.add_subplot()
    for inner, outer in SLIP_ARROWS:
        at_A, at_B = inner.A is not outer.A, inner.B is not outer.B
        apart = 0.06 * (at_A and at_B)
        if at_A:
            _arrow(axes, inner, outer, "-", apart)
        if at_B:
            _arrow(axes, inner, outer, "--", -apart)
    for inner, outer in LIFT_ARROWS:
        _arrow(axes, inner, outer, ":")
    for case, (x, y) in _PLACES.items():
        box = {"boxstyle": "round,pad=0.45", "fc": "white", "ec": style.COLOURS[case], "lw": 2.2}
        text = f"{case.name}\ndim {len(TRAITS[case].active)}"
        axes.text(x, y, text, ha="center", va="center", fontsize=11, linespacing=1.3, bbox=box)
    lines = {"-": "slip begins at A", "--": "slip begins at B", ":": "leaves the floor at A"}
    for line, text in lines.items():
        axes.plot([], [], color="black", ls=line, lw=1.4, label=text)
    axes.legend(loc="lower right", fontsize=9, frameon=False)
    axes.set(xlim=(-2.5, 3.7), ylim=(-0.45, 3.95), aspect="equal")
    axes.axis("off")
    return figure


def _arrow(axes: Axes, inner: Case, outer: Case, line: str, shift: float = 0.0) -> None:
    """An arrow between two cases, moved sideways by `shift`; its head is solid, whatever its
    line."""
    tail, head = np.array(_PLACES[inner]), np.array(_PLACES[outer])
    along = (head - tail) / np.hypot(*(head - tail))
    sideways = shift * np.array([-along[1], along[0]])
    begin, end = tail + _REACH * along + sideways, head - _REACH * along + sideways
    axes.plot(*np.transpose([begin, end - 0.1 * along]), color="black", ls=line, lw=1.4)
    look: dict[str, Any] = {"color": "black", "lw": 0, "shrinkA": 0, "shrinkB": 0}
    tip = FancyArrowPatch(
        tuple(end - 0.2 * along), tuple(end), arrowstyle="-|>", mutation_scale=13, **look
    )
    axes.add_patch(tip)


def main() -> None:
    """Draw all of them."""
    make_directory(DOCS / "cases")
    for name, draw in (("fig-2", draw_2), ("fig-3", draw_3), ("fig-6", draw_6)):
        drawing.save(draw(), DOCS / "cases" / f"{name}.svg")
    basins = Basins.load(DOCS / "studies" / "data" / "basins.json")
    drawing.save(attractors.draw_basins(basins), DOCS / "records" / "attractors" / "basins.png")


if __name__ == "__main__":
    main()
