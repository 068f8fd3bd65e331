"""Figs. 9-12: stationary solutions over the flow, by their spin on the wall (91); Fig. 13: characteristic curves."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analytic import branch_stability, slipping_branch
from analytic.bifurcation import threshold_curves, thresholds
from compare.figures import style
from model import Case, Parameters
from model.arrays import Array

_SPIN = "$\\omega_x^0\\sqrt{R/g}$"
Quantity = Callable[[Array, Array], Array]
"""What is drawn, of slip_x and omega_c."""


def draw_figure_9(p: Parameters | None = None) -> Figure:
    """Cases NS and NR, off the floor."""
    p = p or Parameters.named("reference")
    figure, axes = _diagram(p)
    t = thresholds(p)
    top = 2 * t.omega_02
    below, above = np.linspace(0.0, t.omega_02, 100), np.linspace(t.omega_02, top, 200)
    axes.plot(below, p.eta / p.j * below * p.R / p.r, color=style.COLOURS[Case.NS], lw=2, label="NS")
    axes.plot(above, _lifted(above, p), color=style.COLOURS[Case.NR], lw=2, label="NR")
    style.mark(axes, t.omega_02, float(_lifted(np.array(t.omega_02), p)), "P2", (0, 8))
    _finish(axes, {"omega_02": t.omega_02}, top)
    return figure


def draw_figure_10(p: Parameters | None = None) -> Figure:
    """Cases RR, SS and SR for eta < j."""
    p = p or Parameters.named("reference")
    figure, axes = _diagram(p)
    t = thresholds(p)
    top = 1.25 * t.omega_04
    _rolling(axes, p, 0.0, t.omega_01, style.STABLE)
    _slipping(axes, p, _spin(p))
    _lifting(axes, p, t.omega_02, top, style.STABLE)
    style.mark(axes, t.omega_01, t.omega_01 * p.R / p.r, "P3", (6, 4))
    style.mark(axes, t.omega_02, float(_lifted(np.array(t.omega_02), p)), "NF2", (2, 8))
    fold = _state_of_fold(p)
    style.mark(axes, t.omega_04, float(fold[3] + fold[2] * p.R / p.r), "F", (6, 0))
    _finish(axes, {f"omega_0{k}": getattr(t, f"omega_0{k}") for k in (1, 2, 4)}, top, legend="center")
    return figure


def draw_figure_11(p: Parameters | None = None) -> Figure:
    """Cases RR and SR for eta > j."""
    p = p or Parameters.named("high-wall-friction")
    figure, axes = _diagram(p)
    t = thresholds(p)
    top = 1.6 * t.omega_03
    _rolling(axes, p, 0.0, t.omega_03, style.STABLE)
    _lifting(axes, p, t.omega_02, t.omega_03, style.UNSTABLE)
    _lifting(axes, p, t.omega_03, top, style.STABLE)
    axes.plot([t.omega_02], [_lifted(np.array(t.omega_02), p)], **style.POINT)
    axes.plot([t.omega_03], [t.omega_03 * p.R / p.r], **style.POINT)
    _finish(axes, {"omega_02": t.omega_02, "omega_03": t.omega_03}, top)
    return figure


def draw_figure_12(p: Parameters | None = None) -> Figure:
    """The same with (12) released (A_y < 0 allowed), for eta so little over j that the branch of SS is whole."""
    p = p or Parameters.named("reference").replace(eta=0.43)
    figure, axes = _diagram(p)
    t = thresholds(p)
    unit = np.sqrt(p.g / p.R)
    released = {name: float(v * unit) for name, v in threshold_curves(p, p.mu, p.eta, released=True).items()}
    omega_01, omega_04 = released["omega_01"], released["omega_04"]
    top, bottom = omega_04 + 0.35 * (omega_04 - t.omega_02), t.omega_02 - 0.5 * (omega_04 - t.omega_02)
    _rolling(axes, p, bottom, t.omega_03, style.STABLE)
    _rolling(axes, p, t.omega_03, omega_01, style.UNSTABLE, label="RR, virtual")
    _slipping(axes, p, _spin(p))
    _lifting(axes, p, t.omega_02, t.omega_03, style.UNSTABLE)
    _lifting(axes, p, t.omega_03, top, style.STABLE)
    style.mark(axes, omega_01, omega_01 * p.R / p.r, "P3", (0, 6))
    style.mark(axes, t.omega_03, t.omega_03 * p.R / p.r, "NT1", (-6, -2))
    style.mark(axes, t.omega_02, float(_lifted(np.array(t.omega_02), p)), "NF2", (-4, 4))
    fold = _state_of_fold(p, released=True)
    style.mark(axes, omega_04, float(fold[3] + fold[2] * p.R / p.r), "F", (6, 0))
    names = {"omega_01": omega_01, "omega_02": t.omega_02, "omega_03": t.omega_03, "omega_04": omega_04}
    axes.set_ylim(top=1.3 * released["omega_01"] * p.R / p.r)
    _finish(axes, names, top, bottom, "upper right")
    return figure


def draw_figure_13(p: Parameters | None = None, q: Parameters | None = None) -> Figure:
    """Characteristic curves of the flowmeter: left eta < j with its hysteresis, right eta > j."""
    p, q = p or Parameters.named("reference"), q or Parameters.named("high-wall-friction")
    figure = style.figure(9.0, 4.2)
    left, right = figure.subplots(1, 2)
    t = thresholds(p)
    top = 1.25 * t.omega_04
    _orbit(left, Case.RR, 0.0, t.omega_01)
    _slipping(left, p, lambda _, omega_c: omega_c)
    _orbit(left, Case.SR, t.omega_02, top, label="SR, NR")
    fold = _state_of_fold(p)
    for x, low, high in (
        (t.omega_04, float(fold[2]), t.omega_04),
        (t.omega_02, t.omega_02, _slipping_speed(p, t.omega_02)),
    ):
        left.annotate(
            "",
            (x, high),
            (x, low),
            arrowprops={"arrowstyle": "-|>", "color": "black", "lw": 1.2, "shrinkA": 2, "shrinkB": 2},
        )
    _finish(left, {f"omega_0{k}": getattr(t, f"omega_0{k}") for k in (1, 2, 4)}, top)
    left.set_title(f"$\\eta$ = {p.eta:g} < $j$", fontsize=10)
    t = thresholds(q)
    top = 1.6 * t.omega_03
    _orbit(right, Case.RR, 0.0, t.omega_03)
    # The curves of SR and NR lie on the same line; each is shown beside it, joined by dots where it begins.
    shift = 0.04 * top
    for case, steps, begin, line in (
        (Case.SR, 1, t.omega_02, style.UNSTABLE), (Case.SR, 1, t.omega_03, style.STABLE),
        (Case.NR, 2, t.omega_02, style.STABLE),
    ):  # fmt: skip
        end = t.omega_03 if line is style.UNSTABLE else top
        label = f"{case.name}{', unstable' if line is style.UNSTABLE else ''}"
        right.plot(
            [begin, end],
            [begin + steps * shift, end + steps * shift],
            color=style.COLOURS[case],
            ls=line,
            lw=2,
            label=label,
        )
    for begin in (t.omega_02, t.omega_03):
        right.plot([begin, begin], [begin, begin + 2 * shift], color="black", ls=":", lw=1)
    right.plot([t.omega_02], [t.omega_02 + 2 * shift], **style.POINT)
    _finish(right, {"omega_02": t.omega_02, "omega_03": t.omega_03}, top)
    right.set_title(f"$\\eta$ = {q.eta:g} > $j$   (SR, NR: same line, set apart)", fontsize=10)
    for axes, of in ((left, p), (right, q)):
        axes.set_ylabel(style.OMEGA_C)
        style.dimensionless_x(axes, of)
        style.dimensionless_y(axes, of, "$\\Omega_c = \\omega_c\\sqrt{R/g}$")
    return figure


def _diagram(p: Parameters) -> tuple[Figure, Axes]:
    figure = style.figure(5.4, 3.9)
    axes = figure.add_subplot()
    axes.set_ylabel(style.OMEGA_X)
    style.dimensionless_x(axes, p)
    style.dimensionless_y(axes, p, _SPIN)
    return figure, axes


def _finish(axes: Axes, values: dict[str, float], top: float, bottom: float = 0.0, legend: str = "upper left") -> None:
    last, step = -np.inf, 0
    for name, value in sorted(values.items(), key=lambda item: item[1]):
        step = 1 - step if value - last < 0.08 * (top - bottom) else 0  # names side by side would overlap
        last = value
        axes.axvline(value, **style.GUIDE)
        axes.annotate(
            style.THRESHOLD_LABELS[name], (value, 0.02 + 0.06 * step), xycoords=("data", "axes fraction"),
            xytext=(2, 0), textcoords="offset points", fontsize=9, color="0.25",
        )  # fmt: skip
    axes.set_xlim(bottom, top)
    if bottom == 0:
        axes.set_ylim(0, 1.08 * axes.get_ylim()[1])
    axes.set_xlabel(style.OMEGA_0)
    handles, labels = axes.get_legend_handles_labels()
    once = dict(zip(labels, handles, strict=True))
    place: Any = legend
    axes.legend(
        list(once.values()), list(once), fontsize=8.5, loc=place, framealpha=0.95, ncols=2 if len(once) > 4 else 1
    )


def _lifted(omega_0: Array, p: Parameters) -> Array:
    """omega_x^0 of SR and NR (35), (46)."""
    return np.asarray(p.g / (p.j * omega_0 * p.r))


def _spin(p: Parameters) -> Quantity:
    return lambda slip_x, omega_c: slip_x + p.R / p.r * omega_c


def _rolling(
    axes: Axes, p: Parameters, begin: float, end: float, line: str | tuple[object, ...], label: str = "RR"
) -> None:
    omega = np.array([begin, end])
    axes.plot(omega, omega * p.R / p.r, color=style.COLOURS[Case.RR], ls=line, lw=2, label=label)


def _lifting(axes: Axes, p: Parameters, begin: float, end: float, line: str | tuple[object, ...]) -> None:
    omega = np.linspace(begin, end, 200)
    label = "SR" if line == style.STABLE else "SR, unstable"
    axes.plot(omega, _lifted(omega, p), color=style.COLOURS[Case.SR], ls=line, lw=2, label=label)


def _slipping(axes: Axes, p: Parameters, quantity: Quantity) -> None:
    """The branch of SS, its line by its eigenvalues."""
    s = np.linspace(-16.0, 16.0, 1601)
    states, omega_0 = branch_stability.states(s, p)
    unstable = branch_stability.eigenvalues_at(s, p).real.max(axis=-1) > 0
    values = quantity(states[:, 3], states[:, 2])
    for part, line, label in ((~unstable, style.STABLE, "SS"), (unstable, style.UNSTABLE, "SS, unstable")):
        shown = np.where(part, values, np.nan)
        if part.any():
            axes.plot(omega_0, shown, color=style.COLOURS[Case.SS], ls=line, lw=2, label=label)


def _orbit(axes: Axes, case: Case, begin: float, end: float, label: str = "") -> None:
    axes.plot([begin, end], [begin, end], color=style.COLOURS[case], lw=2, label=label or case.name)


def _state_of_fold(p: Parameters, released: bool = False) -> Array:
    s = slipping_branch.fold(p.j, p.mu, p.eta, p.kappa, released)
    return branch_stability.states(s, p)[0]


def _slipping_speed(p: Parameters, omega_0: float) -> float:
    """omega_c on the stable part of the branch."""
    (s, *_) = slipping_branch.points_at(p.replace(omega_0=omega_0 * (1 + 1e-9)).Omega_0, p.j, p.mu, p.eta, p.kappa)
    return float(branch_stability.states(s, p)[0][2])
