"""Beyond the paper: the ball that hops for ever, and Figs. 9, 10 and 13 with the branch of such motions."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import analytic
from analytic import bifurcation, orbit_branch, orbits
from analytic.orbit_branch import OrbitBranch
from compare.figures import style
from compare.figures.bifurcation_diagrams import lifted, slipping
from compare.figures.drawing import Material
from compare.measure.record import Measurement
from model import Case, Parameters
from model.arrays import Array

SET = Parameters.named("hopping")
TOP, PERIOD = (6.37e-3, 0.0, 57.3, -106.2, 0.0, 0.0), 0.222
"""About a state and the period of the orbit; Newton's method does the rest."""
LOW, HIGH = 0.9, 1.4
"""Flows shown, in units of omega_02."""


@dataclass(frozen=True)
class Hopping:
    """Measured hops; the orbits are theory's and follow from the parameter set."""

    p: Parameters
    states: tuple[Measurement, ...] = ()


def select(material: Material) -> Hopping:
    """The measured mean angular velocities of the hopping ball."""
    return Hopping(SET, tuple(material.select("orbit_omega_c", period=None)))


@functools.cache
def _orbit() -> orbits.Orbit:
    return orbits.refine(SET, TOP, PERIOD)


@functools.cache
def _branch() -> OrbitBranch:
    edge = bifurcation.thresholds(SET).omega_02
    return orbit_branch.follow(_orbit(), "omega_0", LOW * edge, HIGH * edge)


def caption_branch(of: Hopping) -> str:
    """Of both diagrams."""
    factors = np.abs([orbit.multipliers[0] for orbit in _branch().orbits])
    text = (
        "Stationary motions as in Fig. 13 (left) and Figs. 9 and 10 (right), and the hopping ball (purple): its mean "
        "over a period, shaded from least to greatest. Hops begin with no height at ω₀₂, where NS, NR, SR and the "
        f"unstable SS meet; the largest |multiplier| is {factors.min():.3f} … {factors.max():.3f} here. "
        f"{style.named(of.p)}, r/R = {of.p.r / of.p.R:.3g}. Dashed: unstable."
    )
    return text + (f" Marks: {len(of.states)} measured motions." if of.states else "")


def draw_branch(of: Hopping) -> Figure:
    """omega_c and the spin on the wall over the flow."""
    p, t = of.p, bifurcation.thresholds(of.p)
    figure = style.figure(9.0, 4.2)
    orbit, spin = figure.subplots(1, 2)
    flows = np.array([LOW, HIGH]) * t.omega_02
    carried = np.linspace(t.omega_02, flows[1], 100)
    sinking = np.array([flows[0], t.omega_02])
    for axes, ratio in ((orbit, 0.0), (spin, p.R / p.r)):
        slipping(axes, p, functools.partial(_spin, ratio), "", (0.5, (0, 0)), (0.5, (0, 0)))
        riding = lifted(carried, p) if ratio else carried
        sunk = p.eta / p.j * sinking * p.R / p.r if ratio else sinking
        axes.plot(carried, riding, color=style.COLOURS[Case.NR], lw=2)
        axes.plot(sinking, sunk, color=style.COLOURS[Case.NS], lw=2)
        style.name(axes, float(carried[60]), float(riding[60]), "SR, NR", (-5, 5), style.COLOURS[Case.NR])
        style.name(axes, float(sinking[0]), float(sunk[0]), "NS", (6, 5), style.COLOURS[Case.NS])
        for stable, label in ((True, "SS"), (False, "SS, unstable")):
            x = analytic.solution(p.replace(omega_0=0.97 * float(flows[1])), Case.SS, stable=stable).x
            at = float(_spin(ratio, x[3], x[2]))
            style.name(axes, 0.97 * float(flows[1]), at, label, (-5, -5), style.COLOURS[Case.SS])
        _hops(axes, ratio)
        axes.set_xlim(*flows)
        axes.set_xlabel(style.OMEGA_0)
        style.guides(axes, {"omega_02": t.omega_02})
    orbit.set_ylabel(style.OMEGA_C)
    orbit.set_ylim(0, 1.05 * flows[1])
    spin.set_ylim(0, 1.6 * float(lifted(np.array(t.omega_02), p)))
    spin.set_ylabel(style.OMEGA_X)
    style.points(orbit, of.states)
    style.legend(orbit, loc="center left")
    return figure


def _hops(axes: Axes, ratio: float) -> None:
    """The periodic branch: omega_c, or with the ratio R/r the spin on the wall."""
    branch, colour = _branch(), "#7B3294"
    column = [_spin(ratio, orbit.cycle.slip_x, orbit.cycle.omega_c) for orbit in branch.orbits]
    mean = np.array([_spin(ratio, orbit.mean[3], orbit.mean[2]) for orbit in branch.orbits])
    axes.fill_between(
        branch.values, [c.min() for c in column], [c.max() for c in column], color=colour, alpha=0.25, lw=0
    )
    for part, line in ((branch.stable, style.STABLE), (~branch.stable, style.UNSTABLE)):
        axes.plot(branch.values, np.where(part, mean, np.nan), color=colour, ls=line, lw=2)
    style.name(axes, float(branch.values[-3]), float(mean[-3]), "hopping", (0, -8), colour)
    for place in branch.places:
        if place.kind is orbit_branch.Bifurcation.BIRTH:
            style.mark(
                axes, place.value, float(_spin(ratio, place.orbit.mean[3], place.orbit.mean[2])), "birth", (-6, -8)
            )


def _spin(ratio: float, slip_x: Array, omega_c: Array) -> Array:
    """The spin on the wall with the ratio R/r, omega_c without."""
    return np.asarray(slip_x + ratio * omega_c if ratio else omega_c)


def caption_orbit(of: Hopping) -> str:
    """Of the orbit."""
    orbit = _orbit()
    return (
        f"The hopping ball over one period of {orbit.period:.5g} s: height, and the orbit in two planes of the state "
        "space, coloured by case. It lands, slips at both points for some 0.5 ms, slips up the wall (NS), sticks "
        f"to it (NR), rises to {1e3 * orbit.cycle.y.max():.3g} mm and falls. Largest |Floquet multiplier| "
        f"{abs(orbit.multipliers[0]):.4g}; {style.named(of.p, 'mu', 'eta', 'j', 'kappa', 'omega_0')}."
    )


def draw_orbit(of: Hopping) -> Figure:
    """Height over time, height over its rate, and height over the slip."""
    cycle = _orbit().cycle
    figure = style.figure(9.0, 3.2)
    axes = figure.subplots(1, 3, sharey=True)
    for ax, x, label in zip(
        axes,
        (1e3 * cycle.time, cycle.v_y, cycle.slip_x),
        ("t (ms)", "$v_y$ (m/s)", "$\\tilde\\omega_x$ (rad/s)"),
        strict=True,
    ):
        for case in dict.fromkeys(cycle.cases):
            part = cycle.case == case
            ax.plot(
                x[part],
                1e3 * cycle.y[part],
                ".",
                ms=2.5,
                rasterized=True,
                color=style.COLOURS[case],
                label=case.name,
            )
        ax.set_xlabel(label)
    axes[0].set_ylabel("y (mm)")
    style.legend(axes[0], loc="lower right", markerscale=4)
    return figure
