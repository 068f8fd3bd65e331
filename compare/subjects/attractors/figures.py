"""Beyond the paper: the ball that hops for ever, the branch of such motions, basins."""

import functools
from operator import methodcaller
from typing import Any

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
from compare.figures import style
from compare.figures.branches import (
    Drawn,
    check_thresholds,
    round_with_fluid,
    slipping,
    spin,
    spin_of,
)
from compare.figures.drawing import Diagram, GapError, diagram
from compare.subjects.attractors.basins import ATTRACTORS, Basins
from model import Case, Contact, Parameters, State

SET = Parameters.named("hopping")
LOWEST_FLOW, HIGHEST_FLOW = 0.9, 1.4
"""Flows shown, in units of omega_02, farther if the set's own is."""
STARTS = 20  # random starts from which hops of one's own set are looked for


@functools.cache
def _hopping_orbit(p: Parameters) -> orbits.Orbit | None:
    """The orbit of a ball that hops for ever, from a guess or a random start, if any."""
    if p == SET:
        return orbits.refine(p, (6.37e-3, 0.0, 57.3, -106.2, 0.0, 0.0), 0.222)
    found = (each.limit.orbit for each in analytic.attractors(p, STARTS, seed=0))
    for orbit in found:
        if orbit and len({case.A is Contact.N for case in orbit.cases}) == 2:
            return orbit
    return None


def _orbit_or_gap(p: Parameters) -> orbits.Orbit:
    """The orbit of a ball that hops for ever; `GapError` if none is found."""
    if orbit := _hopping_orbit(p):
        return orbit
    tried = f"one of {STARTS} random states at ω₀ = {p.omega_0:g} rad/s"
    raise GapError(f"no ball hops for ever that starts in {tried}")


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
        name = "SR, NR", (0.6, rides)
        style.curve(axes, (Case.SR, Case.NR), flows, quantity(slip_x, flows), name)
        slip_x, flows = round_with_fluid(p, Case.NS, LOWEST_FLOW * edge, (1 - 1e-9) * edge)
        style.curve(axes, Case.NS, flows, quantity(slip_x, flows), ("NS", (0.5, (-3, 9))))
        cycles = [quantity(each.cycle.slip_x, each.cycle.omega_c) for each in branch.orbits]
        mean = quantity(means.slip_x, means.omega_c)
        low, high = [c.min() for c in cycles], [c.max() for c in cycles]
        purple = style.HOPPING
        axes.fill_between(branch.values, low, high, color=purple, alpha=0.25, lw=0)
        for part, line in ((branch.stable, style.STABLE), (~branch.stable, style.UNSTABLE)):
            axes.plot(branch.values, np.where(part, mean, np.nan), color=purple, ls=line, lw=2)
        style.beside(axes, float(branch.values[-2]), float(mean[-2]), "hopping", hops, purple)
        for special in branch.places:
            if special.kind is Bifurcation.BIRTH:
                born = State(*special.orbit.mean)
                height = float(quantity(born.slip_x, born.omega_c))
                style.mark(axes, special.value, height, "birth", (-10, -30))
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
    shades, most = ListedColormap(_SHADES), len(ATTRACTORS) - 0.5
    look: dict[str, Any] = {"cmap": shades, "vmin": -0.5, "vmax": most, "alpha": 0.55}
    look |= {"shading": "nearest", "rasterized": True}
    axes.pcolormesh(basins.x, basins.y, basins.attractors, **look)
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
    across, up = (f"{_VARIABLES[name]} at the start" for name in (basins.across, basins.up))
    axes.set(xlabel=across, ylabel=up)
    above: dict[str, Any] = {"loc": "lower center", "bbox_to_anchor": (0.5, 1.0), "frameon": False}
    axes.legend(handles=handles, fontsize=8, ncols=len(handles), **above)


_HOPS = methodcaller("select", "orbit_omega_c", "period")
FIGURES = {
    name: diagram(name, f"Beyond the paper: {title}", "hopping", draw, (claim,), _HOPS)
    for name, title, draw, claim in (
        ("hopping-orbit", "a ball that hops for ever", draw_orbit, "hopping"),
        ("hopping-branch", "Figs. 9, 10 and 13 with hopping", draw_branch, "hopping-birth"),
    )
}
