"""What ways of setting MuJoCo reach: errors along the ladder of settings, and error against cost."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from matplotlib.figure import Figure

from compare.figures import style
from compare.figures.drawing import GapError, Material, Score

_LEAST = 1e-16
"""Smaller errors are drawn here: an error may be zero."""
COLUMNS = 3
_MARKS = "os^vDP*X"
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8C564B")
_OF_STATES = (
    "the stationary states named (case and ω₀ in rad/s; RR and SS with μ = η = 0.2, NR with η = 0.6; j = 0.4, "
    "κ = 0.0714)"
)


@dataclass(frozen=True)
class Comparison:
    """The scores of a figure."""

    figure: str
    scores: tuple[Score, ...]


def select(material: Material, figure: str) -> Comparison:
    """The scores of the "ladder", or those of the "frontier", which have a cost; `GapError` if there are none."""
    scores = material.ladder if figure == "ladder" else material.frontier
    if not scores:
        raise GapError(f"{'the ladder of settings' if figure == 'ladder' else 'error against cost'} was not measured")
    return Comparison(figure, scores)


def caption(of: Comparison) -> str:
    """Of either figure."""
    if of.figure == "ladder":
        return (
            f"Relative error of ω_c in {_OF_STATES} and, as root mean square, in a transient, under settings that each "
            "have one thing more than those above them, from what a newcomer writes to those of this study (ours). "
            "What is below 1e-16 is drawn there; a run that diverged has no mark."
        )
    return (
        f"Relative error of ω_c over the processor time that a simulated second takes, in {_OF_STATES} and in a "
        "transient. Marks of one kind: one method at several time steps, joined. What is below 1e-16 is drawn there."
    )


def draw(of: Comparison) -> Figure:
    """Either figure."""
    return (_ladder if of.figure == "ladder" else _frontier)(of)


def _ladder(of: Comparison) -> Figure:
    """Rows of settings, a mark for each state."""
    methods = list(dict.fromkeys(score.method for score in of.scores))
    figure = style.figure(9, 1.1 + 0.33 * len(methods))
    axes = figure.add_subplot()
    for k, quantity in enumerate(dict.fromkeys(score.quantity for score in of.scores)):
        own = [s for s in of.scores if s.quantity == quantity and math.isfinite(s.error)]
        x, y = [max(s.error, _LEAST) for s in own], [methods.index(s.method) for s in own]
        axes.plot(x, y, f"{_MARKS[k]}-", color=_COLOURS[k], mfc="white", lw=0.6, label=quantity)
    axes.set_yticks(range(len(methods)), methods, fontsize=8.5)
    axes.invert_yaxis()
    axes.set(xscale="log", xlabel="$|\\Delta\\omega_c|/\\omega_c$")
    axes.grid(alpha=0.3)
    figure.legend(loc="outside upper center", ncols=5, fontsize=8, frameon=False)
    return figure


def _frontier(of: Comparison) -> Figure:
    """A panel for each state and one for the transient."""
    quantities = list(dict.fromkeys(score.quantity for score in of.scores))
    rows = -(-len(quantities) // COLUMNS)
    figure = style.figure(11, 0.8 + 3.1 * rows)
    panels = figure.subplots(rows, COLUMNS, sharex=True, sharey=True, squeeze=False).ravel()
    looks = _looks(of.scores)
    for axes, quantity in zip(panels, quantities, strict=False):
        for method, look in looks.items():
            own = [s for s in of.scores if (s.method, s.quantity) == (method, quantity)]
            own.sort(key=lambda score: score.cost)
            axes.plot([s.cost for s in own], [max(s.error, _LEAST) for s in own], label=method, ms=5, lw=1, **look)
        axes.set(xscale="log", yscale="log")
        axes.set_title(quantity, fontsize=10)
        axes.grid(alpha=0.3)
    for axes in panels[len(quantities) :]:
        axes.set_visible(False)
    for axes in panels[::COLUMNS]:
        axes.set_ylabel("$|\\Delta\\omega_c|/\\omega_c$")
    for axes in panels[max(0, len(quantities) - COLUMNS) : len(quantities)]:
        axes.set_xlabel("processor time per simulated time")
        axes.tick_params(labelbottom=True)
    figure.legend(
        *panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=3, fontsize=8, frameon=False
    )
    return figure


def _looks(scores: Sequence[Score]) -> dict[str, dict[str, str]]:
    """Mark and colour of each method."""
    names = list(dict.fromkeys(score.method for score in scores))
    return {name: {"marker": _MARKS[k % 8], "color": _COLOURS[k % 8], "mfc": "white"} for k, name in enumerate(names)}
