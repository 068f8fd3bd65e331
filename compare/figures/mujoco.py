"""How well MuJoCo does: cases told, error against cost, and what each of the settings takes away."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from compare import ablation, confusion, frontier
from compare.figures import style
from compare.results import Summary
from model import Case
from model.errors import StorageError

CAPTIONS = {
    confusion.ID: "Cases told from MuJoCo's forces and slip speeds (columns) against those of the event-driven "
    "simulation (rows), as shares of each row, outside the dead times.",
    frontier.ID: "Relative error of the orbital angular velocity over the processor time that a simulated second "
    "takes; what is below 1e-16 is drawn there. Points of one mark: one method at several steps. Hollow: other "
    "engines, measured once, elsewhere.",
    ablation.ID: "Relative error of the orbital angular velocity under settings that each have one thing more than "
    "those above them, from MuJoCo's defaults to the project's.",
}
_FLOOR = 1e-16
"""What is smaller is drawn here: an error may be zero."""


def draw_confusion(summary: Summary) -> Figure:
    """The matrix of the nine cases."""
    names = [case.name for case in Case]
    shares = np.zeros((len(names), len(names)))
    for check in _checks(summary, confusion.ID):
        row, told = check["condition"].split(",")[0].split(" told as ")
        shares[names.index(row), names.index(told)] = check["measured"]
    figure = style.figure(5.2, 4.6)
    axes = figure.subplots()
    image = axes.imshow(np.where(shares > 0, shares, np.nan), norm=LogNorm(1e-3, 1), cmap="Blues")
    for (i, k), share in np.ndenumerate(shares):
        if share > 0:
            axes.text(k, i, f"{share:.3g}", ha="center", va="center", fontsize=8, color="white" if share > 0.1 else "k")
    axes.set_xticks(range(len(names)), names)
    axes.set_yticks(range(len(names)), names)
    axes.set_xlabel("told from MuJoCo")
    axes.set_ylabel("event-driven simulation")
    figure.colorbar(image, label="share of the row")
    return figure


def draw_frontier(summary: Summary) -> Figure:
    """A panel for each state and one for the transient."""
    points: dict[str, dict[str, tuple[list[float], list[float]]]] = {}
    spent = {c["condition"]: c["measured"] for c in _checks(summary, frontier.ID) if c["quantity"] == frontier.COST}
    for check in _checks(summary, frontier.ID):
        if check["quantity"] in (*frontier.STATES, frontier.TRANSIENT):
            name = check["condition"].split(";")[0]
            x, y = points.setdefault(check["quantity"], {}).setdefault(name, ([], []))
            x.append(spent[check["condition"]])
            y.append(max(check["measured"], _FLOOR))
    figure = style.figure(10, 7)
    panels = figure.subplots(2, 2, sharex=True, sharey=True)
    marks = dict(zip(dict.fromkeys(name for of in points.values() for name in of), "os^vDP*", strict=False))
    for axes, quantity in zip(panels.flat, [*frontier.STATES, frontier.TRANSIENT], strict=True):
        for name, (x, y) in points.get(quantity, {}).items():
            axes.plot(x, y, f"{marks[name]}-", ms=4.5, lw=1, label=name)
        for (name, found), marker in zip(frontier.ELSEWHERE.items(), "sD^", strict=True):
            error, step, time = found[quantity]
            axes.plot(time / step, error, marker, mfc="none", color="0.4", label=name)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_title(quantity if quantity == frontier.TRANSIENT else f"{quantity} rad/s", fontsize=10)
        axes.grid(alpha=0.3)
    for axes in panels[:, 0]:
        axes.set_ylabel("$|\\Delta\\omega_c|/\\omega_c$")
    for axes in panels[1]:
        axes.set_xlabel("processor time per simulated time")
    figure.legend(*panels[0, 0].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=8)
    return figure


def draw_ablation(summary: Summary) -> Figure:
    """Rows of settings, a mark for each state."""
    names = list(ablation.LADDER)
    figure = style.figure(9, 3.8)
    axes = figure.subplots()
    for quantity, marker in zip([*frontier.STATES, frontier.TRANSIENT], "os^D", strict=True):
        found = {c["condition"]: c["measured"] for c in _checks(summary, ablation.ID) if c["quantity"] == quantity}
        rows = [k for k, name in enumerate(names) if name in found]
        axes.plot([max(found[names[k]], _FLOOR) for k in rows], rows, f"{marker}-", lw=0.6, label=quantity)
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()
    axes.set_xscale("log")
    axes.set_xlabel("$|\\Delta\\omega_c|/\\omega_c$")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, frameon=False)
    return figure


def _checks(summary: Summary, claim: str) -> list[Mapping[str, Any]]:
    if claim not in summary.verdicts:
        raise StorageError(f"no results of the claim {claim!r}; run 'dualball validate --claim {claim}'")
    found: list[Mapping[str, Any]] = summary.verdicts[claim]["checks"]
    return found


FIGURES_OF: dict[str, Callable[[Summary, Path], Figure]] = {
    confusion.ID: lambda summary, _: draw_confusion(summary),
    frontier.ID: lambda summary, _: draw_frontier(summary),
    ablation.ID: lambda summary, _: draw_ablation(summary),
}
"""The figure of each claim, by its id: called with the summary and the results directory."""
