"""Beyond the paper: the ball that hops for ever, and Figs. 9, 10 and 13 with the branch of such motions.

The branch along rougher walls takes minutes; it is kept in `compare.runs`, as the command in
docs/attractors/walls.md gives it.
"""

from __future__ import annotations

import functools
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import analytic
from analytic import bifurcation, orbit_branch, orbits
from analytic.orbit_branch import OrbitBranch
from compare.figures import style
from compare.figures.bifurcation_diagrams import Quantity, lifted, slipping, spin, spins
from compare.figures.drawing import Diagram, Material
from model import Case, Parameters, State
from model.files import reading_json

SET = Parameters.named("hopping")
TOP, PERIOD = (6.37e-3, 0.0, 57.3, -106.2, 0.0, 0.0), 0.222
"""About a state and the period of the orbit; Newton's method does the rest."""
LOW, HIGH = 0.9, 1.4
"""Flows shown, in units of omega_02."""
COLOUR = "#7B3294"
Offset = tuple[float, float]
"""Of a name from its curve, in points."""


def select(material: Material) -> Diagram:
    """The measured mean angular velocities of the hopping ball; the orbits are theory's."""
    return Diagram("hopping", SET, tuple(material.select("orbit_omega_c", "period")))


@functools.cache
def _orbit() -> orbits.Orbit:
    return orbits.refine(SET, TOP, PERIOD)


@functools.cache
def _branch() -> OrbitBranch:
    edge = bifurcation.thresholds(SET).omega_02
    return orbit_branch.follow(_orbit(), "omega_0", LOW * edge, HIGH * edge)


def caption_branch(of: Diagram) -> str:
    """Of both diagrams."""
    factors = np.abs([orbit.multipliers[0] for orbit in _branch().orbits])
    return (
        "Stationary motions as in Fig. 13 (left) and Figs. 9 and 10 (right), and the hopping ball (purple): its mean "
        "over a period, shaded from least to greatest. Hops begin with no height at ω₀₂, where NS, NR, SR and the "
        f"unstable SS meet; the largest |multiplier| is {factors.min():.3f} … {factors.max():.3f} here. "
        f"{style.named(of.p)}, r/R = {of.p.r / of.p.R:.3g}. Dashed: unstable.{style.marks(of.states)}"
    )


def draw_branch(of: Diagram) -> Figure:
    """omega_c and the spin on the wall over the flow."""
    p, edge = of.p, bifurcation.thresholds(of.p).omega_02
    figure = style.figure(9.0, 4.2)
    orbit, wall = figure.subplots(1, 2)
    _diagram(orbit, p, lambda slip_x, omega_c: omega_c, (-5, -7), (-5, 7), (-5, 12))
    _diagram(wall, p, functools.partial(spin, p), (-5, 7), (-60, -50), (-18, -80))
    orbit.set(ylabel=style.OMEGA_C, ylim=(0, 1.05 * HIGH * edge))
    wall.set(ylabel=style.OMEGA_X, ylim=(0, 1.6 * lifted(edge, p)))
    style.points(orbit, of.states)
    style.legend(orbit, loc="center right")
    return figure


def _diagram(axes: Axes, p: Parameters, quantity: Quantity, offset: Offset, riding: Offset, hopping: Offset) -> None:
    """The diagram of a quantity; names stand at offsets that are clear of the curves: of SS, SR and NR, hopping."""
    edge = bifurcation.thresholds(p).omega_02
    carried, sinking = np.linspace(edge, HIGH * edge, 100), np.array([LOW, 1 - 1e-9]) * edge
    slipping(axes, p, quantity)
    fast = p.replace(omega_0=0.95 * HIGH * edge)  # the branch goes on far beyond the frame
    for stable, text in ((True, "SS"), (False, "SS, unstable")):
        end = analytic.solution(fast, Case.SS, stable=stable).state
        style.name(axes, fast.omega_0, float(quantity(end.slip_x, end.omega_c)), text, offset, style.COLOURS[Case.SS])
    for case, x, text, place in (
        (Case.NR, carried, "SR, NR", (0.6, riding)),
        (Case.NS, sinking, "NS", (0.5, (-3, 9))),
    ):
        slip = np.asarray(spins(case, x, p)) - p.R / p.r * x
        style.curve(axes, case, x, quantity(slip, x), text, place)
    _hops(axes, quantity, hopping)
    axes.set(xlim=(LOW * edge, HIGH * edge), xlabel=style.OMEGA_0)
    style.guides(axes, {"omega_02": edge})


def _hops(axes: Axes, quantity: Quantity, offset: Offset) -> None:
    """The periodic branch: mean, least and greatest of a quantity over a period."""
    branch = _branch()
    cycles = [quantity(orbit.cycle.slip_x, orbit.cycle.omega_c) for orbit in branch.orbits]
    means = State(*np.transpose([orbit.mean for orbit in branch.orbits]))
    mean = quantity(means.slip_x, means.omega_c)
    low, high = [c.min() for c in cycles], [c.max() for c in cycles]
    axes.fill_between(branch.values, low, high, color=COLOUR, alpha=0.25, lw=0)
    for part, line in ((branch.stable, style.STABLE), (~branch.stable, style.UNSTABLE)):
        axes.plot(branch.values, np.where(part, mean, np.nan), color=COLOUR, ls=line, lw=2)
    style.name(axes, float(branch.values[-3]), float(mean[-3]), "hopping", offset, COLOUR)
    for place in branch.places:
        if place.kind is orbit_branch.Bifurcation.BIRTH:
            born = State(*place.orbit.mean)
            style.mark(axes, place.value, float(quantity(born.slip_x, born.omega_c)), "birth", (-10, -30))


def caption_orbit(of: Diagram) -> str:
    """Of the orbit."""
    orbit = _orbit()
    return (
        f"The hopping ball over one period of {orbit.period:.5g} s: height, and the orbit in two planes of the state "
        "space, coloured by case. It lands, slips at both points for some 0.5 ms, slips up the wall (NS), sticks "
        f"to it (NR), rises to {1e3 * orbit.cycle.y.max():.3g} mm and falls. Largest |Floquet multiplier| "
        f"{abs(orbit.multipliers[0]):.4g}; {style.named(of.p, 'mu', 'eta', 'j', 'kappa', 'omega_0')} rad/s."
    )


def draw_orbit(of: Diagram) -> Figure:
    """Height over time, height over its rate, and height over the slip."""
    cycle = _orbit().cycle
    figure = style.figure(9.0, 3.2)
    axes = figure.subplots(1, 3, sharey=True)
    shown = {"t (ms)": 1e3 * cycle.time, "$v_y$ (m/s)": cycle.v_y, "$\\tilde\\omega_x$ (rad/s)": cycle.slip_x}
    for ax, (label, x) in zip(axes, shown.items(), strict=True):
        for case in dict.fromkeys(cycle.cases):
            own, look = cycle.case == case, {"color": style.COLOURS[case], "label": case.name}
            ax.plot(x[own], 1e3 * cycle.y[own], ".", ms=2.5, rasterized=True, **look)
        ax.set_xlabel(label)
    axes[0].set_ylabel("y (mm)")
    style.legend(axes[0], loc="lower right", markerscale=4)
    return figure


def walls() -> dict[str, Any]:
    """The kept branch of hops over the friction of the wall."""
    path = Path(str(resources.files("compare.runs"))) / "hopping-walls.json"
    with reading_json(path, "branch") as data:
        branch: dict[str, Any] = data["sets"][0]["branches"][0]
        return branch


def select_walls(material: Material) -> Diagram:
    """The measured end of hopping."""
    return Diagram("hopping-walls", SET, tuple(material.select("orbit_death")))


def draw_walls(of: Diagram) -> Figure:
    """Height and mean omega_c of the hops over the friction of the wall."""
    branch = walls()
    orbits, places = branch["orbits"], branch["places"]
    for k, beside in ((0, orbits[:2]), (-1, orbits[:-3:-1])):  # hops of no height are none: both ends are extrapolated
        if places[k]["kind"] == "nonsmooth birth":
            end = places[k]["orbit"] = _at(places[k]["value"], *beside)
            orbits.insert(len(orbits) if k else 0, end)
    figure = style.figure(9.0, 3.8)
    shown = {"height": ("height of the hops (mm)", 1e3), "omega_c": ("mean " + style.OMEGA_C, 1.0)}
    for axes, (quantity, (label, unit)) in zip(figure.subplots(1, 2), shown.items(), strict=True):
        for rows, line in ((orbits, style.UNSTABLE), ([row for row in orbits if row["stable"]], style.STABLE)):
            axes.plot([r["eta"] for r in rows], [unit * r[quantity] for r in rows], color=COLOUR, ls=line, lw=2)
        for place in places:
            axes.plot(place["value"], unit * place["orbit"][quantity], **style.POINT)
        for kind, (name, offset) in _NAMED.items():
            place = next(place for place in places if place["kind"] == kind)
            style.name(axes, place["value"], unit * place["orbit"][quantity], name, offset)
        for m in of.states:
            low, high = m.value - 3 * m.uncertainty, m.value + 3 * m.uncertainty
            axes.axvspan(low, high, color=style.mark_of(m.engine)["color"], alpha=0.4, label=f"{m.engine}: hops end")
        axes.set(xlabel="η", ylabel=label)
        axes.margins(0.2, 0.1)
    style.legend(figure.axes[0], loc="upper left")
    return figure


def _at(eta: float, one: dict[str, Any], other: dict[str, Any]) -> dict[str, Any]:
    """Where the line through two orbits is at another wall."""
    share = (eta - one["eta"]) / (other["eta"] - one["eta"])
    quantities = {name: one[name] + share * (other[name] - one[name]) for name in ("height", "omega_c")}
    return {"eta": eta, "stable": one["stable"], **quantities}


_NAMED = {"torus": ("torus", (8.0, 4.0)), "fold": ("fold", (8.0, 4.0)), "nonsmooth birth": ("birth", (-8.0, 5.0))}
"""Names of places, and where they stand, in points."""


def caption_walls(of: Diagram) -> str:
    """What happens along the branch."""
    places = "; ".join(f"{place['kind']} at η = {place['value']:.4g}" for place in walls()["places"])
    mark = " Shaded: the wall from which hops don't last, as measured." if of.states else ""
    groups = style.named(of.p, "mu", "j", "kappa", "omega_0")
    what = f"Height and mean ω_c of the hopping ball over the friction of the wall: {places}"
    return f"{what}. {groups} rad/s. Dashed: unstable.{mark}"
