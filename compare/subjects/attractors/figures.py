"""Beyond the paper: the ball that hops for ever, the branch of such motions, basins."""

from __future__ import annotations

import functools
from operator import methodcaller
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

import analytic
from analytic.bifurcation import diagram as bifurcation
from analytic.orbits import orbit_branch
from analytic.orbits import periodic as orbits
from analytic.orbits.orbit_branch import Bifurcation
from compare.branches import Drawn, check_thresholds, round_with_fluid, slipping, spin, spin_of
from compare.kit import style
from compare.kit.drawing import Diagram, GapError, diagram
from compare.subjects.attractors.basins import ATTRACTORS, Basins
from model import Case, Contact, Parameters, State

SET = Parameters.named("hopping")
LOWEST_FLOW, HIGHEST_FLOW = 0.9, 1.4
"""Flows shown, in units of omega_02, farther if the set's own is."""
LEAST_WALL, MOST_WALL = 0.4, 2.0
"""Friction of the wall that is shown, in units of the set's own."""
_SHORT, _UNNAMED = {Bifurcation.BIRTH: "birth"}, Bifurcation.PERSISTENCE
STARTS = 20
"""Random starts from which hops of one's own set are looked for."""


@functools.cache
def _hopping_orbit(p: Parameters) -> orbits.Orbit | None:
    """The orbit of a ball that hops for ever, from a guess or a random start, if any."""
    if p == SET:
        return orbits.refine(p, (6.37e-3, 0.0, 57.3, -106.2, 0.0, 0.0), 0.222)
    found = (each.limit.orbit for each in analytic.attractors(p, STARTS, seed=0))
    return next(
        (o for o in found if o and {case.A is Contact.N for case in o.cases} == {True, False}), None
    )


def _orbit_or_gap(p: Parameters) -> orbits.Orbit:
    """The orbit of a ball that hops for ever; `GapError` if none is found."""
    if orbit := _hopping_orbit(p):
        return orbit
    raise GapError(
        f"no ball hops for ever that starts in one of {STARTS} random states at ω₀ = {p.omega_0:g} "
        f"rad/s"
    )


def draw_branch(of: Diagram) -> tuple[Figure, str]:
    """A figure of hops over the flow: omega_c and the spin on the wall; and its caption."""
    p, hop = of.p, _orbit_or_gap(of.p)
    check_thresholds(p)
    edge = bifurcation.thresholds(p).omega_02
    top = max(HIGHEST_FLOW * edge, 1.05 * p.omega_0)
    branch = orbit_branch.follow(hop, "omega_0", LOWEST_FLOW * edge, top)
    figure, (orbit, wall) = style.panels(9.0, 4.2, 1, 2)
    fast = p.replace(omega_0=0.95 * top)  # the branch of SS goes on far beyond the frame
    means = State(*np.transpose([each.mean for each in branch.orbits]))
    # What is drawn, and where names stand, in points from the curves of SS, SR and NR, and hopping.
    shown: tuple[tuple[Axes, Drawn, tuple[tuple[float, float], ...]], ...] = (
        (orbit, lambda slip_x, omega_c: omega_c, ((-5, -7), (-5, 7), (-5, 12))),
        (wall, functools.partial(spin, p), ((-5, 7), (-60, -50), (-18, -80))),
    )
    for axes, quantity, (slips, rides, hops) in shown:
        slipping(axes, p, quantity)
        for stable, text in ((True, "SS"), (False, "SS, unstable")):
            end = analytic.solution(fast, Case.SS, stable=stable).state
            height = float(quantity(end.slip_x, end.omega_c))
            style.beside(axes, fast.omega_0, height, text, slips, style.COLOURS[Case.SS])
        slip_x, flows = round_with_fluid(p, Case.NR, edge, top)
        style.curve(
            axes, (Case.SR, Case.NR), flows, quantity(slip_x, flows), ("SR, NR", (0.6, rides))
        )
        slip_x, flows = round_with_fluid(p, Case.NS, LOWEST_FLOW * edge, (1 - 1e-9) * edge)
        style.curve(axes, Case.NS, flows, quantity(slip_x, flows), ("NS", (0.5, (-3, 9))))
        cycles = [quantity(each.cycle.slip_x, each.cycle.omega_c) for each in branch.orbits]
        mean = quantity(means.slip_x, means.omega_c)
        low, high = [c.min() for c in cycles], [c.max() for c in cycles]
        axes.fill_between(branch.values, low, high, color=style.HOPPING, alpha=0.25, lw=0)
        for part, line in ((branch.stable, style.STABLE), (~branch.stable, style.UNSTABLE)):
            axes.plot(
                branch.values, np.where(part, mean, np.nan), color=style.HOPPING, ls=line, lw=2
            )
        style.beside(
            axes, float(branch.values[-2]), float(mean[-2]), "hopping", hops, style.HOPPING
        )
        for special in branch.places:
            if special.kind is Bifurcation.BIRTH:
                born = State(*special.orbit.mean)
                style.mark(
                    axes,
                    special.value,
                    float(quantity(born.slip_x, born.omega_c)),
                    "birth",
                    (-10, -30),
                )
        axes.set(xlim=(LOWEST_FLOW * edge, top), xlabel=style.OMEGA_0)
        style.guides(axes, {"omega_02": edge})
    orbit.set(ylabel=style.OMEGA_C, ylim=(0, 1.05 * top))
    wall.set(ylabel=style.OMEGA_X, ylim=(0, 1.6 * spin_of(Case.NR, edge, p)))
    style.points(orbit, of.states)
    style.legend(orbit, loc="center right")
    factors = np.abs([each.multipliers[0] for each in branch.orbits])
    return figure, style.caption(
        p,
        "Stationary motions as in Fig. 13 (left) and Figs. 9 and 10 (right), and the hopping ball "
        "(purple): its mean over a period, shaded from least to greatest. Hops begin with no "
        "height at ω₀₂, where NS, NR, SR and the unstable SS meet; the largest |multiplier| is "
        f"{factors.min():.3f} … {factors.max():.3f} here. Dashed: unstable. r/R = {p.r / p.R:.3g},",
        states=of.states,
    )


def draw_orbit(of: Diagram) -> tuple[Figure, str]:
    """A figure of one hop: height over time, over its rate, and over the slip; and its caption."""
    orbit = _orbit_or_gap(of.p)
    cycle = orbit.cycle
    figure, axes = style.panels(9.0, 3.2, 1, 3, sharey=True)
    shown = {
        "$t$ (ms)": 1e3 * cycle.time,
        "$v_y$ (m/s)": cycle.v_y,
        "$\\tilde\\omega_x$ (rad/s)": cycle.slip_x,
    }
    for ax, (label, x) in zip(axes, shown.items(), strict=True):
        for case in dict.fromkeys(cycle.cases):
            own, look = cycle.case == case, {"color": style.COLOURS[case], "label": case.name}
            ax.plot(x[own], 1e3 * cycle.y[own], ".", ms=2.5, rasterized=True, **look)
        ax.set_xlabel(label)
    axes[0].set_ylabel("$y$ (mm)")
    style.legend(axes[0], loc="lower right", markerscale=4)
    named = style.named(of.p, "mu", "eta", "j", "kappa", "omega_0")
    return figure, (
        f"The hopping ball over one period of {orbit.period:.5g} s: height, and the orbit in two "
        "planes of the state space, coloured by case: "
        f"{', '.join(case.name for case in dict.fromkeys(cycle.cases))}; a gap at the impact. It "
        f"rises to {1e3 * cycle.y.max():.3g} mm. Largest |Floquet multiplier| "
        f"{abs(orbit.multipliers[0]):.4g}; {named} rad/s."
    )


class _Hop(NamedTuple):
    """What is drawn of an orbit over the friction of the wall: the height of the hops in m, mean
    omega_c in rad/s."""

    eta: float
    height: float
    omega_c: float
    stable: bool


def _wall_branch(p: Parameters) -> tuple[list[_Hop], list[tuple[Bifurcation, _Hop]]]:
    """The branch of hops over the friction of the wall, and what happens on it: both lie on the
    line.

    Hops of no height are none: ends of the branch are extrapolated from the last two orbits.
    """

    def hop(orbit: orbits.Orbit, eta: float) -> _Hop:
        return _Hop(
            eta, float(orbit.cycle.y.max()), float(State(*orbit.mean).omega_c), orbit.stable
        )

    branch = orbit_branch.follow(_orbit_or_gap(p), "eta", LEAST_WALL * p.eta, MOST_WALL * p.eta)
    rows = [hop(orbit, orbit.p.eta) for orbit in branch.orbits]
    places = list[tuple[Bifurcation, _Hop]]()
    for place in branch.places:
        if place.kind is Bifurcation.BIRTH:
            at, (one, two) = (
                (len(rows), rows[:-3:-1]) if place is branch.places[-1] else (0, rows[:2])
            )
            share = (place.value - one.eta) / (two.eta - one.eta)
            eta, height, omega_c = (
                a + share * (b - a) for a, b in zip(one[:3], two[:3], strict=True)
            )
            row = _Hop(eta, height, omega_c, one.stable)
        else:  # where the line is bent least by it
            row = hop(place.orbit, place.value)
            x = np.array([(r.eta / p.eta, r.height / p.r) for r in (*rows, row)])
            detour = np.hypot(*(x[:-1] - x[-1]).T)
            at = 1 + int(np.argmin(detour[:-1] + detour[1:] - np.hypot(*np.diff(x[:-1], axis=0).T)))
            row = row._replace(stable=rows[at - 1].stable)
        if place.kind is not Bifurcation.RANGE:
            rows.insert(at, row)
            places.append((place.kind, row))
    return rows, places


def draw_walls(of: Diagram) -> tuple[Figure, str]:
    """A figure of height and mean omega_c of hops over the friction of the wall; and its
    caption."""
    if of.p.eta == 0:
        raise GapError("its wall has no friction that could grow")
    rows, places = _wall_branch(of.p)
    figure, panels = style.panels(9.0, 3.8, 1, 2)
    shown = ("height", "height of the hops (mm)", 1e3), ("omega_c", "mean " + style.OMEGA_C, 1.0)
    eta, stable = np.array([row.eta for row in rows]), np.array([row.stable for row in rows])
    offsets = {Bifurcation.TORUS: (0, -20), Bifurcation.FOLD: (8, 4), Bifurcation.BIRTH: (-8, 5)}
    for axes, (quantity, label, unit) in zip(panels, shown, strict=True):
        values = unit * np.array([getattr(row, quantity) for row in rows])
        for part, line in ((np.ones_like(stable), style.UNSTABLE), (stable, style.STABLE)):
            axes.plot(eta, np.where(part, values, np.nan), color=style.HOPPING, ls=line, lw=2)
        named = {_UNNAMED}
        for kind, row in places:
            at = row.eta, unit * getattr(row, quantity)
            axes.plot(*at, **style.POINT)
            if kind not in named:
                style.beside(axes, *at, _SHORT.get(kind, str(kind)), offsets.get(kind, (8, 4)))
            named.add(kind)
        for m in of.states:
            low, high = m.value - 3 * m.uncertainty, m.value + 3 * m.uncertainty
            axes.axvspan(low, high, color="0.3", alpha=0.4, label=f"{m.engine}: hops end")
        axes.set(xlabel="wall friction $\\eta$", ylabel=label)
        axes.margins(0.2, 0.1)
    style.legend(panels[0], loc="upper left")
    mark = (
        " Shaded: the least wall friction at which hops don't last, as measured."
        if of.states
        else ""
    )
    told = ", ".join(
        f"{_SHORT.get(kind, kind)} η = {row.eta:.4g}"
        for kind, row in places
        if kind is not _UNNAMED
    )
    return figure, (
        "Height and mean ω_c of the hopping ball against the friction of the wall, from "
        f"{LEAST_WALL:g} to {MOST_WALL:g} times its own. Named along the branch: "
        f"{told or 'nothing'}. At a birth hops have no height; at a torus bifurcation they lose "
        "stability, in a fold the branch turns back. Dots without names: the sequence of cases "
        f"changes. Dashed: unstable. {style.named(of.p, 'mu', 'j', 'kappa', 'omega_0')} "
        f"rad/s.{mark}"
    )


_SHADES = (style.HOPPING, *(style.COLOURS[case] for case in (Case.RR, Case.SS, Case.NR, Case.NN)))
"""Of `ATTRACTORS`."""
_VARIABLES = {
    "omega_c": style.OMEGA_C,
    **{f"slip_{axis}": f"$\\tilde\\omega_{axis}$ (rad/s)" for axis in "xyz"},
    **{"y": "y (m)", "v_y": "$v_y$ (m/s)", "h": "h (m)", "v_h": "$v_h$ (m/s)"},
}


def draw_basins(basins: Basins) -> Figure:
    """The map of basins as a figure."""
    figure = style.figure(6.2, 4.4)
    fill_basins(figure.add_subplot(), basins)
    return figure


def fill_basins(axes: Axes, basins: Basins) -> None:
    """Draw the map of basins by theory, and a point for each run of MuJoCo."""
    look: dict[str, Any] = {
        "cmap": ListedColormap(_SHADES),
        "vmin": -0.5,
        "vmax": len(ATTRACTORS) - 0.5,
        "alpha": 0.55,
    }
    axes.pcolormesh(
        basins.x, basins.y, basins.attractors, shading="nearest", rasterized=True, **look
    )
    present = set(np.unique(basins.attractors)) | set(np.unique(basins.mujoco))
    handles: list[object] = [
        Patch(color=_SHADES[k], alpha=0.55, label=ATTRACTORS[k]) for k in sorted(present)
    ]
    if basins.coarse:
        x, y = np.meshgrid(basins.x[:: basins.coarse], basins.y[:: basins.coarse])
        for k in sorted(set(basins.mujoco.ravel().tolist())):
            own = basins.mujoco == k
            axes.plot(x[own], y[own], "o", ms=4, color=_SHADES[k], mec="k", mew=0.4)
        differ = basins.mujoco != basins.attractors[:: basins.coarse, :: basins.coarse]
        if np.any(differ):
            handles += axes.plot(x[differ], y[differ], "kx", ms=9, mew=1.3, label="MuJoCo differs")
        handles += axes.plot([], [], "o", ms=4, color="white", mec="k", mew=0.6, label="MuJoCo")
    axes.set(
        xlabel=f"{_VARIABLES[basins.across]} at the start",
        ylabel=f"{_VARIABLES[basins.up]} at the start",
    )
    axes.legend(
        handles=handles,
        fontsize=8,
        loc="lower center",
        bbox_to_anchor=(0.5, 1.0),
        ncols=len(handles),
        frameon=False,
    )


FIGURES = {
    name: diagram(
        name,
        f"Beyond the paper: {title}",
        "hopping",
        draw,
        (claim,),
        methodcaller("select", quantity, "period"),
    )
    for name, title, quantity, draw, claim in (
        ("hopping-orbit", "a ball that hops for ever", "orbit_omega_c", draw_orbit, "hopping"),
        (
            "hopping-branch",
            "Figs. 9, 10 and 13 with hopping",
            "orbit_omega_c",
            draw_branch,
            "hopping-birth",
        ),
        ("hopping-walls", "hops along rougher walls", "orbit_death", draw_walls, "hopping-death"),
    )
}
