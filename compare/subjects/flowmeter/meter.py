"""Figures of a designed meter, with captions: characteristic with tolerances, sensitivities, choice of friction."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from analytic.flowmeter import characteristic as flowmeter
from analytic.flowmeter.design import THRESHOLDS, Design
from compare.kit import style
from model import Case

_LABELS = {name: f"$\\{name}$" for name in ("mu", "eta", "rho_b", "rho_f", "nu_f")} | {"gravity": "gravity"}
_FINE = 51
"""Points of the plane of friction along each axis."""


def characteristic(made: Design) -> tuple[Figure, str]:
    """Reading over flow, with the band of the tolerances, the flows to measure and the limits."""
    curve, chosen, request = made.curve, made.choice, made.request
    figure, axes = style.panels(7.0, 4.3)
    flows, low, high, below, above = (np.append(0.0, each) for each in (curve.omega_0, *curve.meant, *curve.band))
    axes.fill_between(flows, below, above, color="0.82", lw=0, label="within the tolerances")
    axes.plot(flows, low, color=style.COLOURS[Case.SS], lw=2, label="nominal, rising flow")
    axes.plot(flows, high, color=style.COLOURS[Case.NR], lw=2, ls="--", label="nominal, falling flow")
    axes.axvspan(request.slowest, request.fastest, color="#0072B2", alpha=0.12, lw=0, label="flows to measure")
    limit: dict[str, Any] = {"color": style.FORCE, "alpha": 0.25, "lw": 1, "label": "limit, from worst to nominal"}
    axes.axvspan(chosen.worst.omega_0, chosen.limit.omega_0, **limit)
    axes.set(xlim=(0, flows[-1]), ylim=(0, None), xlabel=style.OMEGA_0, ylabel=style.OMEGA_C)
    style.guides(axes, {key: getattr(made.thresholds, key) for key in THRESHOLDS})
    style.legend(axes, loc="lower right")
    return figure, (
        "Angular velocity of the ball's orbit, against that of the fluid. Where the lines part, the reading depends on "
        "whether the flow rose or fell. Grey: from the lowest to the highest reading within the tolerances."
    )


def sensitivities(made: Design) -> tuple[Figure, str]:
    """Bars: by how many per cent each threshold changes if a value does by one."""
    figure, axes = style.panels(7.0, 3.6)
    there = [key for key in THRESHOLDS if np.isfinite(getattr(made.thresholds, key))]
    names = list(made.sensitivities[there[0]])
    width = 0.8 / len(there)
    for k, key in enumerate(there):
        values = [made.sensitivities[key][name].value for name in names]
        places = np.arange(len(names)) + (k - (len(there) - 1) / 2) * width
        look: dict[str, Any] = {
            "color": style.THRESHOLD_LINES[key][0],
            "hatch": ("", "//", "..", "xx")[k],
            "ec": "white",
        }
        axes.bar(places, values, width, label=style.THRESHOLD_LABELS[key], **look)
    axes.axhline(0, color="black", lw=0.8)
    axes.set_xticks(range(len(names)), [_LABELS.get(name, f"${name}$") for name in names])
    axes.set_ylabel("% of the threshold per %")
    axes.grid(axis="y", alpha=0.25)
    style.legend(figure, loc="outside upper center", ncols=len(there))
    return figure, "Sensitivities: by how many per cent a threshold changes if a value does by one."


def friction(made: Design) -> tuple[Figure, str]:
    """The operating limit of the chosen ball and vessel over both frictions."""
    chosen = made.choice
    top = {name: max(1.5 * chosen.values[name], 1.25 * chosen.p.j) for name in ("mu", "eta")}
    mu, eta = (np.linspace(top[name] / 50, top[name], _FINE) for name in ("mu", "eta"))
    limits = [[flowmeter.operating_range(chosen.p.replace(mu=float(m), eta=float(e))) for e in eta] for m in mu]
    figure, axes = style.panels(7.0, 4.3)
    shown = axes.contourf(eta, mu, limits, levels=14, cmap="cividis")
    figure.colorbar(shown, label="operating range up to $\\omega_0$ (rad/s)")
    axes.contour(eta, mu, limits, levels=[made.request.fastest], colors="white", linewidths=1.5)
    axes.axvline(chosen.p.j, color="black", lw=1, ls=":")
    x, y = (chosen.values[name] for name in ("eta", "mu"))
    xerr, yerr = (made.request.tolerances.get(name, 0.0) * chosen.values[name] for name in ("eta", "mu"))
    axes.errorbar(x, y, yerr, xerr, fmt="o", color="white", mec="black", ms=7, capsize=4)
    axes.set(xlabel="wall friction $\\eta$", ylabel="floor friction $\\mu$")
    return figure, (
        "How far the operating range reaches over both frictions, with ball, vessel and fluid as chosen. Dot: the "
        "choice, with its tolerances; white line: the fastest flow to measure; dotted: η = j, left of "
        "which slip limits the range, and right of which unloading does."
    )


FIGURES = characteristic, sensitivities, friction
