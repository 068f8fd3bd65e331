"""Figs. 9-12: stationary solutions over the flow, by their spin on the wall (91), with measured states upon them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analytic import bifurcation, branch_stability, slipping_branch
from compare.figures import style
from compare.figures.drawing import Material
from compare.measure.record import Measurement
from model import Case, Parameters
from model.arrays import Array

SETS = {"fig-9": "reference", "fig-10": "reference", "fig-11": "high-wall-friction", "fig-12": ""}
"""The parameter set of each figure; of Fig. 12 see `RELEASED`."""
RELEASED = Parameters.named("reference").replace(eta=0.43)
"""eta so little over j that the branch of SS, with (12) released, is whole."""
_CASES = {"fig-9": ("NS", "NR"), "fig-10": ("RR", "SS", "SR", "NR"), "fig-11": ("RR", "SR", "NR")}
Quantity = Callable[[Array, Array], Array]
"""What is drawn, of slip_x and omega_c."""
Line = str | tuple[object, ...]
"""A line style."""
Place = tuple[float, tuple[float, float]]
"""Where the name of a curve stands: at a share of the curve, with an offset in points."""


@dataclass(frozen=True)
class Diagram:
    """A parameter set, and the states measured with it."""

    figure: str
    p: Parameters
    states: tuple[Measurement, ...] = ()


def select(material: Material, figure: str) -> Diagram:
    """The measured spins on the wall, by case and set."""
    if figure == "fig-12":
        return Diagram(figure, RELEASED)
    spins = [m for m in material.select("wall_spin", case=None) if m.set == SETS[figure]]
    return Diagram(
        figure, Parameters.named(SETS[figure]), tuple(m for m in spins if m.conditions["case"] in _CASES[figure])
    )


def caption(of: Diagram) -> str:
    """Of Figs. 9-12, with their parameters."""
    p = of.p
    what = {
        "fig-9": "off the floor, where y is free: sinking along the wall (NS) passes over to riding it (NR) at P2",
        "fig-10": "on the floor, for η < j: rolling (RR) passes over to slipping (SS) at P3, SS turns back at the fold "
        "F and ends in SR at NF2",
        "fig-11": "on the floor, for η > j: SR appears at ω₀₂, and RR ends at ω₀₃ where it meets SR",
        "fig-12": "as Fig. 11, but with the floor allowed to pull (A_y < 0), which is formal: the branch of SS and its "
        "bifurcations P3, F and NF2 reappear, and RR and SR exchange stability at NT1",
    }[of.figure]
    text = f"Stationary solutions {what}; {style.named(p)}, r/R = {p.r / p.R:g}. Dashed: unstable."
    if of.figure == "fig-12" and len(_hopf(p)):
        text += " H: a Hopf point of SS, beyond which an oscillation grows, too."
    if of.states:
        text += f" Marks: {len(of.states)} measured states; three standard uncertainties are smaller than the marks."
        if of.figure in ("fig-10", "fig-11"):
            text += " A ball on the wall (NR) has the spin of SR, also where SR is unstable."
    return text


def draw(of: Diagram) -> Figure:
    """One diagram, with both scales."""
    figure = style.figure(5.8, 4.1)
    axes = figure.add_subplot()
    figures = {"fig-9": _figure_9, "fig-10": _figure_10, "fig-11": _figure_11, "fig-12": _figure_12}
    values = figures[of.figure](axes, of.p)
    style.points(axes, of.states)
    axes.set(xlabel=style.OMEGA_0, ylabel=style.OMEGA_X)
    style.guides(axes, values)
    if of.states:
        style.legend(axes, loc="upper left")
    style.dimensionless_x(axes, of.p)
    style.dimensionless_y(axes, of.p, "$\\omega_x^0\\sqrt{R/g}$")
    return figure


def _figure_9(axes: Axes, p: Parameters) -> dict[str, float]:
    t = bifurcation.thresholds(p)
    below, above = np.linspace(0.0, t.omega_02, 100), np.linspace(t.omega_02, 2 * t.omega_02, 200)
    _curve(axes, Case.NS, below, p.eta / p.j * below * p.R / p.r, (0.35, (-4, 6)))
    _curve(axes, Case.NR, above, lifted(above, p), (0.5, (4, 6)))
    style.mark(axes, t.omega_02, float(lifted(t.omega_02, p)), "P2", (0, 8))
    _frame(axes, 0.0, 2 * t.omega_02)
    return {"omega_02": t.omega_02}


def _figure_10(axes: Axes, p: Parameters) -> dict[str, float]:
    t = bifurcation.thresholds(p)
    top = 1.25 * t.omega_04
    _rolling(axes, p, 0.0, t.omega_01)
    slipping(axes, p, _spin(p), "SS", (0.5, (0, -7)), (0.4, (6, 6)))
    _lifting(axes, p, t.omega_02, top, (0.85, (-5, -5)))
    style.mark(axes, t.omega_01, t.omega_01 * p.R / p.r, "P3", (-6, 4))
    style.mark(axes, t.omega_02, float(lifted(t.omega_02, p)), "NF2", (-4, -6))
    style.mark(axes, t.omega_04, _spin_of(fold_state(p), p), "F", (7, 0))
    _frame(axes, 0.0, top)
    return {name: getattr(t, name) for name in ("omega_01", "omega_02", "omega_04")}


def _figure_11(axes: Axes, p: Parameters) -> dict[str, float]:
    t = bifurcation.thresholds(p)
    top = 1.6 * t.omega_03
    _rolling(axes, p, 0.0, t.omega_03)
    _lifting(axes, p, t.omega_02, t.omega_03, (0.4, (6, 4)), style.UNSTABLE, "SR, unstable")
    _lifting(axes, p, t.omega_03, top, (0.5, (4, 6)))
    axes.plot([t.omega_02], [lifted(t.omega_02, p)], **style.POINT)
    axes.plot([t.omega_03], [t.omega_03 * p.R / p.r], **style.POINT)
    _frame(axes, 0.0, top)
    return {"omega_02": t.omega_02, "omega_03": t.omega_03}


def _figure_12(axes: Axes, p: Parameters) -> dict[str, float]:
    t, unit = bifurcation.thresholds(p), np.sqrt(p.g / p.R)
    curves = bifurcation.threshold_curves(p, p.mu, p.eta, released=True)
    omega_01, omega_04 = (float(curves[name] * unit) for name in ("omega_01", "omega_04"))
    top, bottom = omega_04 + 0.35 * (omega_04 - t.omega_02), t.omega_02 - 0.5 * (omega_04 - t.omega_02)
    _rolling(axes, p, bottom, t.omega_03)
    virtual = np.array([t.omega_03, omega_01])
    _curve(axes, Case.RR, virtual, virtual * p.R / p.r, (0.6, (-4, 4)), style.UNSTABLE, "RR, virtual")
    slipping(axes, p, _spin(p), "SS", (0.5, (0, 7)), (0.35, (0, 7)))
    _lifting(axes, p, t.omega_02, t.omega_03, (0.5, (-20, 60)), style.UNSTABLE, "SR, unstable")
    _lifting(axes, p, t.omega_03, top, (0.35, (-5, -5)))
    style.mark(axes, omega_01, omega_01 * p.R / p.r, "P3", (-6, 0))
    style.mark(axes, t.omega_03, t.omega_03 * p.R / p.r, "NT1", (0, -8))
    style.mark(axes, t.omega_02, float(lifted(t.omega_02, p)), "NF2", (-6, 4))
    style.mark(axes, omega_04, _spin_of(fold_state(p, released=True), p), "F", (7, 0))
    for s in _hopf(p):
        x, omega_0 = branch_stability.states(s, p)
        style.mark(axes, float(omega_0), _spin_of(x, p), "H", (5, -6))
    _frame(axes, bottom, top)
    axes.set_ylim(0.75 * t.omega_03 * p.R / p.r, 1.15 * omega_01 * p.R / p.r)
    return {"omega_01": omega_01, "omega_02": t.omega_02, "omega_03": t.omega_03, "omega_04": omega_04}


def _spin(p: Parameters) -> Quantity:
    return lambda slip_x, omega_c: slip_x + p.R / p.r * omega_c


def _spin_of(x: Array, p: Parameters) -> float:
    return float(x[3] + x[2] * p.R / p.r)


def _frame(axes: Axes, bottom: float, top: float) -> None:
    axes.set(xlim=(bottom, top), ylim=(0, 1.12 * axes.get_ylim()[1]))


def _hopf(p: Parameters) -> Array:
    return np.asarray(branch_stability.hopf_places(p), dtype=float)


def _curve(axes: Axes, case: Case, x: Array, y: Array, place: Place, line: Line = style.STABLE, text: str = "") -> None:
    axes.plot(x, y, color=style.COLOURS[case], ls=line, lw=2)
    at, offset = place
    along = at * (len(x) - 1)
    here_x, here_y = (float(np.interp(along, range(len(x)), values)) for values in (x, y))
    style.name(axes, here_x, here_y, text or case.name, offset, style.COLOURS[case])


def lifted(omega_0: Array | float, p: Parameters) -> Array:
    """omega_x^0 of SR and NR (35), (46), rad s-1."""
    return np.asarray(p.g / (p.j * omega_0 * p.r))


def _rolling(axes: Axes, p: Parameters, begin: float, end: float) -> None:
    omega = np.array([begin, end])
    _curve(axes, Case.RR, omega, omega * p.R / p.r, (0.5, (-5, 5)))


def _lifting(
    axes: Axes, p: Parameters, begin: float, end: float, place: Place, line: Line = style.STABLE, text: str = ""
) -> None:
    omega = np.linspace(begin, end, 200)
    _curve(axes, Case.SR, omega, lifted(omega, p), place, line, text)


def slipping(axes: Axes, p: Parameters, quantity: Quantity, name: str, stable: Place, unstable: Place) -> None:
    """The branch of SS, its line by its eigenvalues; a name at each part."""
    s = np.linspace(-16.0, 16.0, 1601)
    states, omega_0 = branch_stability.states(s, p)
    grows = branch_stability.eigenvalues_at(s, p).real.max(axis=-1) > 0
    values = quantity(states[:, 3], states[:, 2])
    for part, line, text, (at, offset) in (
        (~grows, style.STABLE, name, stable),
        (grows, style.UNSTABLE, f"{name}, unstable", unstable),
    ):
        if part.any():
            axes.plot(omega_0, np.where(part, values, np.nan), color=style.COLOURS[Case.SS], ls=line, lw=2)
            way = np.cumsum(np.hypot(np.gradient(omega_0), np.gradient(values)) * part)
            k = int(np.searchsorted(way, at * way[-1]))
            style.name(axes, float(omega_0[k]), float(values[k]), text, offset, style.COLOURS[Case.SS])


def fold_state(p: Parameters, released: bool = False) -> Array:
    """The state of SS at the fold, shape (8,)."""
    s = slipping_branch.fold(p, released=released)
    return branch_stability.states(s, p)[0]
