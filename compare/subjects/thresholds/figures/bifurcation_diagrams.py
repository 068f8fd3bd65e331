"""Figs. 9-12: stationary solutions over the flow, by their spin on the wall (91), with measured states upon them."""

from __future__ import annotations

from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analytic.bifurcation import diagram as bifurcation
from analytic.stationary import slipping_branch
from compare.branches import fold_state, lifted, slipping, spin, spins
from compare.kit import style
from compare.kit.drawing import Diagram, Material
from compare.kit.style import UNSTABLE, Place
from model import Case, Parameters, State

RELEASED = Parameters.named("reference").replace(eta=0.43)
"""eta so little over j that the branch of SS, with (12) released, is whole."""
SETS = {
    "fig-9": ("reference", ("NS", "NR")),
    "fig-10": ("reference", ("RR", "SS", "SR", "NR")),
    "fig-11": ("high-wall-friction", ("RR", "SR", "NR")),
}
"""The parameter set of each figure that shows measured states, and their cases."""
_SHOWN = {
    "fig-9": "off the floor, where y is free: sinking along the wall (NS) passes over to riding it (NR) at P2",
    "fig-10": "on the floor, for η < j: rolling (RR) passes over to slipping (SS) at P3, SS turns back at the fold "
    "F and ends in SR at NF2",
    "fig-11": "on the floor, for η > j: SR appears at ω₀₂, and RR ends at ω₀₃ where it meets SR",
    "fig-12": "as Fig. 11, but with the floor allowed to pull (A_y < 0), which is formal: the branch of SS and its "
    "bifurcations P3, F and NF2 reappear, and RR and SR exchange stability at NT1",
}


def select(material: Material, figure: str) -> Diagram:
    """The measured spins on the wall, by case and set."""
    if figure == "fig-12":
        return Diagram(figure, RELEASED)
    name, cases = SETS[figure]
    measured = [*material.select("wall_spin", "case"), *material.select("edge_wall_spin", "case")]
    own = tuple(m for m in measured if m.set == name and m.conditions["case"] in cases)
    return Diagram(figure, Parameters.named(name), own)


def caption(of: Diagram) -> str:
    """Of Figs. 9-12, with their parameters."""
    p = of.p
    text = f"Stationary solutions {_SHOWN[of.figure]}; {style.named(p)}, r/R = {p.r / p.R:g}. Dashed: unstable."
    if of.figure == "fig-12" and slipping_branch.hopf_places(p):
        text += " H: a Hopf point of SS, beyond which an oscillation grows, too."
    if of.states and of.figure in ("fig-10", "fig-11"):
        text += " A ball on the wall (NR) has the spin of SR, also where SR is unstable."
    return text + style.edge(of.states) + style.marks(of.states)


def draw(of: Diagram) -> Figure:
    """One diagram, with both scales."""
    figure, p = style.figure(5.8, 4.1), of.p
    axes, t = figure.add_subplot(), bifurcation.thresholds(of.p)
    guides = {name: getattr(t, name) for name in ("omega_01", "omega_02", "omega_03", "omega_04")}
    bottom, top = 0.0, 2 * t.omega_02
    if of.figure == "fig-9":
        guides = {"omega_02": t.omega_02}
        _branch(axes, p, Case.NS, 1e-3 * t.omega_02, (1 - 1e-9) * t.omega_02, "NS", (0.35, (-4, 6)))
        _branch(axes, p, Case.NR, t.omega_02, top, "NR", (0.5, (4, 6)))
        style.mark(axes, t.omega_02, lifted(t.omega_02, p), "P2", (0, 8))
    elif of.figure == "fig-10":
        del guides["omega_03"]
        top = 1.25 * t.omega_04
        _branch(axes, p, Case.RR, 0.0, t.omega_01)
        slipping(axes, p, partial(spin, p), (0.5, (0, -7)), (0.4, (6, 6)))
        _branch(axes, p, Case.SR, t.omega_02, top, "SR", (0.85, (-5, -5)))
        style.mark(axes, t.omega_01, t.omega_01 * p.R / p.r, "P3", (-6, 4))
        style.mark(axes, t.omega_02, lifted(t.omega_02, p), "NF2", (-4, -6))
        style.mark(axes, t.omega_04, float(bifurcation.wall_spin(fold_state(p), p)), "F", (4, -6))
    elif of.figure == "fig-11":
        guides = {"omega_02": t.omega_02, "omega_03": t.omega_03}
        top = 1.6 * t.omega_03
        _branch(axes, p, Case.RR, 0.0, t.omega_03)
        _branch(axes, p, Case.SR, t.omega_02, t.omega_03, "SR, unstable", (0.4, (6, 4)), UNSTABLE)
        _branch(axes, p, Case.SR, t.omega_03, top, "SR", (0.5, (4, 6)))
        for w in (t.omega_02, t.omega_03):
            axes.plot([w], [lifted(w, p)], **style.POINT)
    else:
        curves = bifurcation.threshold_curves(p, p.mu, p.eta, released=True)
        guides |= {name: float(curves[name] * np.sqrt(p.g / p.R)) for name in ("omega_01", "omega_04")}
        omega_01, omega_04 = guides["omega_01"], guides["omega_04"]
        bottom, top = (edge + part * (omega_04 - t.omega_02) for edge, part in ((t.omega_02, -0.5), (omega_04, 0.35)))
        _branch(axes, p, Case.RR, bottom, t.omega_03)
        _branch(axes, p, Case.RR, t.omega_03, omega_01, "RR, virtual", (0.6, (-4, 4)), UNSTABLE)
        slipping(axes, p, partial(spin, p), (0.5, (0, 7)), (0.35, (0, 7)))
        _branch(axes, p, Case.SR, t.omega_02, t.omega_03, "SR, unstable", (0.5, (-20, 60)), UNSTABLE)
        _branch(axes, p, Case.SR, t.omega_03, top, "SR", (0.35, (-5, -5)))
        style.mark(axes, omega_01, omega_01 * p.R / p.r, "P3", (-6, 0))
        style.mark(axes, t.omega_03, t.omega_03 * p.R / p.r, "NT1", (0, -8))
        style.mark(axes, t.omega_02, lifted(t.omega_02, p), "NF2", (-6, 4))
        style.mark(axes, omega_04, float(bifurcation.wall_spin(fold_state(p, released=True), p)), "F", (7, 0))
        for s in slipping_branch.hopf_places(p):
            x, omega_0 = slipping_branch.states(s, p)
            style.mark(axes, float(omega_0), float(bifurcation.wall_spin(State.of(x), p)), "H", (5, -6))
    axes.set(xlim=(bottom, top), ylim=(0, 1.12 * axes.get_ylim()[1]), xlabel=style.OMEGA_0, ylabel=style.OMEGA_X)
    if of.figure == "fig-12":
        axes.set_ylim(0.75 * t.omega_03 * p.R / p.r, 1.15 * guides["omega_01"] * p.R / p.r)
    style.points(axes, of.states)
    style.guides(axes, guides)
    style.legend(axes, loc="upper left")
    style.dimensionless(axes, p, style.FREE_0, style.FREE_X)
    return figure


def _branch(
    axes: Axes,
    p: Parameters,
    case: Case,
    begin: float,
    end: float,
    text: str = "RR",
    place: Place = (0.5, (-5, 5)),
    line: style.Line = style.STABLE,
) -> None:
    """The spin on the wall in RR, SR, NR or NS from one flow to another, with its name."""
    flows = np.linspace(begin, end, 200)
    values = flows * p.R / p.r if case is Case.RR else spins(Case.NR if case is Case.SR else case, flows, p)
    style.curve(axes, case, flows, values, text, place, line)
