"""The figures of the paper that theory alone can draw, by number; each with default parameters."""

from __future__ import annotations

from collections.abc import Callable

from matplotlib.figure import Figure

from compare.figures import bifurcation_diagrams, parameter_plane, state_space

FIGURES: dict[str, Callable[..., Figure]] = {
    "fig03": state_space.draw_figure_3,
    "fig06": state_space.draw_figure_6,
    "fig07": parameter_plane.draw_figure_7,
    "fig08": parameter_plane.draw_figure_8,
    "fig09": bifurcation_diagrams.draw_figure_9,
    "fig10": bifurcation_diagrams.draw_figure_10,
    "fig11": bifurcation_diagrams.draw_figure_11,
    "fig12": bifurcation_diagrams.draw_figure_12,
    "fig13": bifurcation_diagrams.draw_figure_13,
}
