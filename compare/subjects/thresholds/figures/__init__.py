"""Figs. 7 to 12: regions of the parameters, and bifurcation diagrams."""

from __future__ import annotations

from compare.kit.drawing import figure_of
from compare.subjects.thresholds.figures import bifurcation_diagrams, parameter_plane

FIGURES = {
    "fig-7": figure_of("Fig. 7: regions over wall friction and flow", parameter_plane, "fig-7"),
    "fig-8": figure_of("Fig. 8: regions over equal friction and flow", parameter_plane, "fig-8"),
    "fig-9": figure_of("Fig. 9: off the floor", bifurcation_diagrams, "fig-9"),
    "fig-10": figure_of("Fig. 10: on the floor, η < j", bifurcation_diagrams, "fig-10"),
    "fig-11": figure_of("Fig. 11: on the floor, η > j", bifurcation_diagrams, "fig-11"),
    "fig-12": figure_of("Fig. 12: on the floor, η > j, (12) released", bifurcation_diagrams, "fig-12"),
}
