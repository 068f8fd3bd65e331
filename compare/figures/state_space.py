"""Fig. 3: sections of the state space; Fig. 6: transitions to cases of more freedom."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analytic.slip_stability import LIFT_ARROWS, SLIP_ARROWS
from compare.figures import style
from model import Case
from model.cases import TRAITS

_PLACES = {
    Case.RR: (0.0, 0.0), Case.RS: (-1.6, 1.0), Case.SR: (0.4, 1.0), Case.SS: (-1.1, 2.3), Case.NR: (2.2, 2.0),
    Case.NS: (0.75, 3.2),
}  # fmt: skip


def draw_figure_3() -> Figure:
    """Left: y = v_y = slip_z = 0. Right: v_y = slip_y = 0 at one omega_c, with the height y."""
    figure = style.figure(9.0, 4.4)
    left: Any = figure.add_subplot(1, 2, 1, projection="3d")
    right: Any = figure.add_subplot(1, 2, 2, projection="3d")
    across, along, zero = np.array([[-1.0, 1.0], [-1.0, 1.0]]), np.array([[-1.0, -1.0], [1.0, 1.0]]), np.zeros((2, 2))
    left.plot_surface(across, zero, along, color=style.COLOURS[Case.SR], alpha=0.4, shade=False)
    left.plot_surface(zero, across, along, color=style.COLOURS[Case.RS], alpha=0.4, shade=False)
    left.plot([0, 0], [0, 0], [-1, 1], color=style.COLOURS[Case.RR], lw=3)
    _name(left, {Case.RR: (0, 0, 1.12), Case.SR: (0.75, 0, 0.75), Case.RS: (0, -0.75, 0.75), Case.SS: (0.8, 0.8, -0.7)})
    _label(left, ("$\\tilde\\omega_x$", "$\\tilde\\omega_y$", "$\\omega_c$"))
    left.set_title("$y = v_y = \\tilde\\omega_z = 0$;  SS fills the space", fontsize=10)
    right.plot_surface(across, along, zero, color=style.COLOURS[Case.SS], alpha=0.35, shade=False)
    right.plot_surface(across, zero, (along + 1) / 2, color=style.COLOURS[Case.NR], alpha=0.4, shade=False)
    right.plot([-1, 1], [0, 0], [0, 0], color=style.COLOURS[Case.SR], lw=3)
    right.plot([0], [0], [0], color=style.COLOURS[Case.RR], marker="o", ms=8)
    on_floor = {Case.RR: (0.08, 0, 0.1), Case.SR: (0.8, 0, 0.08), Case.SS: (-0.6, -0.7, 0)}
    _name(right, on_floor | {Case.NR: (-0.6, 0, 0.75), Case.NS: (0.7, 0.8, 0.6)})
    _label(right, ("$\\tilde\\omega_x$", "$\\tilde\\omega_z$", "$y$"))
    right.set_zlim(0, 1)
    right.set_title("$v_y = \\tilde\\omega_y = 0$, $\\omega_c$ fixed;  NS fills the space", fontsize=10)
    return figure


def draw_figure_6() -> Figure:
    """Solid: slip begins at A; dashed: at B; dotted: the ball leaves the floor. Higher up: more freedom."""
    figure = style.figure(5.6, 4.8)
    axes = figure.add_subplot()
    for inner, outer in SLIP_ARROWS:
        at_A, at_B = inner.A is not outer.A, inner.B is not outer.B
        if at_A and at_B:
            _arrow(axes, inner, outer, "-", 0.05)
            _arrow(axes, inner, outer, "--", -0.05)
        else:
            _arrow(axes, inner, outer, "-" if at_A else "--")
    for inner, outer in LIFT_ARROWS:
        _arrow(axes, inner, outer, ":")
    for case, (x, y) in _PLACES.items():
        box = {"boxstyle": "round,pad=0.45", "fc": "white", "ec": style.COLOURS[case], "lw": 2.2}
        text = f"{case.name}\ndim {TRAITS[case].dimension}"
        axes.text(x, y, text, ha="center", va="center", fontsize=11, linespacing=1.3, bbox=box)
    for line, text in (("-", "slip begins at A"), ("--", "slip begins at B"), (":", "leaves the floor at A")):
        axes.plot([], [], color="black", ls=line, lw=1.4, label=text)
    axes.legend(loc="lower right", fontsize=9, frameon=False)
    axes.set_xlim(-2.2, 2.8)
    axes.set_ylim(-0.5, 3.6)
    axes.axis("off")
    return figure


def _arrow(axes: Axes, inner: Case, outer: Case, line: str, shift: float = 0.0) -> None:
    """An arrow between two cases, moved sideways by `shift`."""
    tail, head = np.array(_PLACES[inner]), np.array(_PLACES[outer])
    along = head - tail
    sideways = shift * np.array([-along[1], along[0]]) / np.hypot(*along)
    look = {
        "arrowstyle": "-|>",
        "ls": line,
        "lw": 1.4,
        "shrinkA": 25,
        "shrinkB": 25,
        "mutation_scale": 14,
        "fc": "black",
    }
    axes.annotate("", tuple(head + sideways), tuple(tail + sideways), arrowprops=look)


def _name(axes: Any, places: dict[Case, tuple[float, float, float]]) -> None:
    for case, place in places.items():
        axes.text(*place, case.name, color="black", fontsize=11, ha="center", fontweight="bold")


def _label(axes: Any, names: tuple[str, str, str]) -> None:
    for axis, name in zip("xyz", names, strict=True):
        getattr(axes, f"set_{axis}label")(name, labelpad=-8)
        getattr(axes, f"set_{axis}ticks")([])
    axes.view_init(22, -58)
