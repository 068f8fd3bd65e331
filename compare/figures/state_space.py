"""Fig. 3: sections of the state space; Fig. 6: transitions to cases of more freedom."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.axes3d import Axes3D

from analytic.slip_stability import LIFT_ARROWS, SLIP_ARROWS
from compare.figures import style
from model import Case
from model.cases import TRAITS

_PLACES = {
    Case.RR: (0.0, 0.0), Case.RS: (-1.3, 1.0), Case.SR: (0.55, 1.0), Case.SS: (-0.4, 2.0), Case.NR: (1.9, 2.0),
    Case.NS: (0.75, 3.1),
}  # fmt: skip


def draw_figure_3() -> Figure:
    """Left: y = v_y = slip_z = 0. Right: v_y = slip_y = 0 at one omega_c, with the height y."""
    figure = style.figure(9.0, 4.4)
    left, right = (figure.add_subplot(1, 2, k, projection="3d") for k in (1, 2))
    assert isinstance(left, Axes3D)
    assert isinstance(right, Axes3D)
    flat = np.array([[-1.0, 1.0], [-1.0, 1.0]])
    up = np.array([[-1.0, -1.0], [1.0, 1.0]])
    zero = np.zeros((2, 2))
    left.plot_surface(flat, zero, up, color=style.COLOURS[Case.SR], alpha=0.35)
    left.plot_surface(zero, flat, up, color=style.COLOURS[Case.RS], alpha=0.35)
    left.plot([0, 0], [0, 0], [-1, 1], color=style.COLOURS[Case.RR], lw=3)
    for x, y, z, case in (
        (0, 0, 1.12, Case.RR),
        (0.75, 0, 0.75, Case.SR),
        (0, -0.75, 0.75, Case.RS),
        (0.8, 0.8, -0.7, Case.SS),
    ):
        left.text(x, y, z, case.name, color="black", fontsize=11, ha="center", fontweight="bold")
    _axes(left, ("$\\tilde\\omega_x$", "$\\tilde\\omega_y$", "$\\omega_c$"))
    left.set_title("$y = v_y = \\tilde\\omega_z = 0$;  SS fills the space", fontsize=10)
    right.plot_surface(flat, up, zero, color=style.COLOURS[Case.SS], alpha=0.3)
    right.plot_surface(flat, zero, (up + 1) / 2, color=style.COLOURS[Case.NR], alpha=0.35)
    right.plot([-1, 1], [0, 0], [0, 0], color=style.COLOURS[Case.SR], lw=3)
    right.plot([0], [0], [0], color=style.COLOURS[Case.RR], marker="o", ms=8)
    for x, y, z, case in (
        (0.08, 0, 0.1, Case.RR), (0.8, 0, 0.08, Case.SR), (-0.6, -0.7, 0.0, Case.SS), (-0.6, 0, 0.75, Case.NR), (0.7, 0.8, 0.6, Case.NS),
    ):  # fmt: skip
        right.text(x, y, z, case.name, color="black", fontsize=11, ha="center", fontweight="bold")
    _axes(right, ("$\\tilde\\omega_x$", "$\\tilde\\omega_z$", "$y$"))
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
        axes.text(
            x, y, f"{case.name}\n{_dimension(case)}", ha="center", va="center", fontsize=11, linespacing=1.3, color="black",
            bbox={"boxstyle": "round,pad=0.45", "fc": "white", "ec": style.COLOURS[case], "lw": 2.2},
        )  # fmt: skip
    for line, text in (("-", "slip begins at A"), ("--", "slip begins at B"), (":", "leaves the floor at A")):
        axes.plot([], [], color="black", ls=line, lw=1.4, label=text)
    axes.legend(loc="lower right", fontsize=9, frameon=False)
    axes.set_xlim(-2.0, 2.6)
    axes.set_ylim(-0.5, 3.6)
    axes.axis("off")
    return figure


def _arrow(axes: Axes, inner: Case, outer: Case, line: str, shift: float = 0.0) -> None:
    (x0, y0), (x1, y1) = _PLACES[inner], _PLACES[outer]
    length = np.hypot(x1 - x0, y1 - y0)
    across = shift * np.array([y0 - y1, x1 - x0]) / length
    axes.annotate(
        "", (x1 + across[0], y1 + across[1]), (x0 + across[0], y0 + across[1]),
        arrowprops={"arrowstyle": "-|>", "ls": line, "lw": 1.4, "color": "black", "shrinkA": 25, "shrinkB": 25, "mutation_scale": 14},
    )  # fmt: skip


def _dimension(case: Case) -> str:
    return f"dim {TRAITS[case].dimension}"


def _axes(axes: Axes3D, labels: tuple[str, str, str]) -> None:
    axes.set_xlabel(labels[0], labelpad=-8)
    axes.set_ylabel(labels[1], labelpad=-8)
    axes.set_zlabel(labels[2], labelpad=-8)
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set_zticks([])
    axes.view_init(22, -58)
