"""The figures of the report; those of the league and of a designed meter belong to their pages.

To add one, write a module with what it selects, how that is drawn, its caption; add a record.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from matplotlib.figure import Figure

from compare.figures import (
    bifurcation_diagrams,
    cases,
    characteristic,
    deviations,
    flow_curve,
    hopping,
    parameter_plane,
    periodic,
    settings,
    slipping,
    unloading,
    unsteady,
)
from compare.figures.drawing import Drawing


def _explaining(title: str, draw: Callable[[object], Figure], text: str) -> Drawing:
    """A figure of the model itself, which depends on no parameter and no result."""
    return Drawing(title=title, select=lambda _: None, draw=draw, caption=lambda _: text, background=True)


def _of(module: Any, title: str, name: str = "", *claims: str) -> Drawing:
    """A figure of a module, which draws several of a kind if there is a name."""
    select = partial(module.select, figure=name) if name else module.select
    return Drawing(title=title, select=select, draw=module.draw, caption=module.caption, claims=claims)


def _of_paper(module: Any, name: str, title: str) -> Drawing:
    """One that stands beside the claim of its own name."""
    return _of(module, title, name, name)


FIGURES: dict[str, Drawing] = {
    "characteristic": _of(characteristic, "Characteristic curves"),
    "ladder": _of(settings, "From a newcomer's settings to the study's", "ladder"),
    "frontier": _of(settings, "Error and cost", "frontier"),
    "fig-2": _explaining(
        "Fig. 2: the nine cases",
        cases.draw_figure_2,
        "The nine kinematic cases: rolling (R), slipping (S) or no contact (N), first at the floor (A), second at the "
        "wall (B). Dot: rolls; arrows: slips. Numbers: variables of position that are needed, plus independent "
        "velocities, make the dimension of the state space. Off the wall (right column) the distance h from it counts.",
    ),
    "fig-3": _explaining(
        "Fig. 3: sections of the state space",
        cases.draw_figure_3,
        "Where the cases are. Left: y = v_y = 0 at one ω_c, over the three components of slip: RR is a point, SR and "
        "RS are lines, SS is all the rest. Right: y = v_y = ω̃_z = 0 over ω_c: SR and RS are planes that meet in the "
        "line RR.",
    ),
    "fig-4": _of(slipping, "Fig. 4: a slip that dies out", "fig-4", "slip-NR-NS"),
    "fig-5": _of(slipping, "Fig. 5: a slip that grows", "fig-5", "slip-NR-NS"),
    "fig-6": _explaining(
        "Fig. 6: transitions to more freedom",
        cases.draw_figure_6,
        "Transitions to cases of more freedom, which are drawn higher up; dim: dimension of the state space. Solid: "
        "slip begins at the floor (A); dashed: at the wall (B); dotted: the ball leaves the floor.",
    ),
    "fig-7": _of_paper(parameter_plane, "fig-7", "Fig. 7: regions over wall friction and flow"),
    "fig-8": _of_paper(parameter_plane, "fig-8", "Fig. 8: regions over equal friction and flow"),
    "fig-9": _of_paper(bifurcation_diagrams, "fig-9", "Fig. 9: off the floor"),
    "fig-10": _of_paper(bifurcation_diagrams, "fig-10", "Fig. 10: on the floor, η < j"),
    "fig-11": _of_paper(bifurcation_diagrams, "fig-11", "Fig. 11: on the floor, η > j"),
    "fig-12": _of_paper(bifurcation_diagrams, "fig-12", "Fig. 12: on the floor, η > j, (12) released"),
    "fig-13-left": _of_paper(flow_curve, "fig-13-left", "Fig. 13, left: hysteresis, η < j"),
    "fig-13-right": _of_paper(flow_curve, "fig-13-right", "Fig. 13, right: η > j"),
    "unloading": _of(unloading, "Section 5.3: the fall at unloading", "", "fig-13-right"),
    "pulsation": Drawing(
        title="Unsteady flow: pulsation",
        select=partial(unsteady.select, figure="pulsation"),
        draw=unsteady.draw_pulsation,
        caption=unsteady.caption_pulsation,
        claims=("pulsation-lag", "pulsation-slip", "pulsation-mean"),
    ),
    "unsteady": Drawing(
        title="Unsteady flow: jumps and ramps",
        select=partial(unsteady.select, figure="unsteady"),
        draw=unsteady.draw_unsteady,
        caption=unsteady.caption_unsteady,
        claims=("jump-slipping", "ramp-fold"),
    ),
    "hopping-orbit": Drawing(
        title="Beyond the paper: a ball that hops for ever",
        select=periodic.select,
        draw=periodic.draw_orbit,
        caption=periodic.caption_orbit,
        claims=("hopping",),
    ),
    "hopping-branch": Drawing(
        title="Beyond the paper: Figs. 9, 10 and 13 with hopping",
        select=periodic.select,
        draw=periodic.draw_branch,
        caption=periodic.caption_branch,
        claims=("hopping-birth",),
    ),
    "hopping": Drawing(
        title="Beyond the paper: where the ball hops for ever",
        select=hopping.where,
        draw=hopping.draw_where,
        caption=hopping.caption_where,
        background=True,
    ),
    "basins": Drawing(
        title="Beyond the paper: basins",
        select=hopping.plane,
        draw=hopping.draw_plane,
        caption=hopping.caption_plane,
        background=True,
    ),
}
"""Every figure by its file name, in the order of the report."""


def figures_of(claim: str) -> dict[str, Drawing]:
    """The figures that stand beside a claim; unless one bears its name, also the deviations of its numbers."""
    own = {name: each for name, each in FIGURES.items() if claim in each.claims}
    return own if claim in own else own | {f"claim-{claim}": deviations.of(claim)}
