"""Error against cost, of the engines in the league or of ways to set MuJoCo; and error along the ladder of settings."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure

from compare.bench.league import CASES, COST, CREEP, OPEN, ROLLING_ENDS, WALL, Entry
from compare.kit import style
from compare.kit.drawing import GapError, Material

Entries = tuple[Entry, ...]
_MARKS = "os^vDP*X"
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8C564B")
_LOOKS: list[dict[str, Any]] = [
    {"marker": mark, "color": colour, "mfc": "white"} for mark, colour in zip(_MARKS, _COLOURS, strict=True)
]
_OF_STATES = (
    "the stationary states named (case and ω₀ in rad/s; RR and SS with μ = η = 0.2, NR with η = 0.6; j = 0.4, "
    "κ = 0.0714)"
)
COLUMNS = 3
LEAST = 1e-16
"""Smaller errors are drawn here: an error may be zero."""


def select_ladder(material: Material) -> Entries:
    """The entries of the ladder."""
    if not material.ladder:
        raise GapError("the ladder of settings was not measured")
    return material.ladder


def caption_ladder(entries: Entries) -> str:
    """Of the ladder."""
    return (
        f"Relative error of ω_c in {_OF_STATES} and, as root mean square, in a transient, under settings that each "
        "have one thing more than those above them, from what a newcomer writes to those of this study (ours). "
        "What is below 1e-16 is drawn there; a run that diverged has no mark."
    )


def select_frontier(material: Material) -> Entries:
    """The entries that have a cost."""
    if not material.frontier:
        raise GapError("error against cost was not measured")
    return material.frontier


def caption_frontier(entries: Entries) -> str:
    """Of error against cost."""
    return (
        f"Relative error of ω_c against processor time divided by simulated time, in {_OF_STATES} and in a "
        "transient. Marks of one kind: one method at several time steps, joined. What is below 1e-16 is drawn there."
    )


def draw_ladder(entries: Entries) -> Figure:
    """Rows of settings, a mark for each state."""
    methods = [entry.name for entry in entries]
    figure = style.figure(9, 1.1 + 0.33 * len(methods))
    axes = figure.add_subplot()
    for name, look in zip((name for name in entries[0].scores if name != OPEN), _LOOKS, strict=False):
        own = [(max(e.scores[name], LEAST), k) for k, e in enumerate(entries) if math.isfinite(e.scores[name])]
        axes.plot([x for x, _ in own], [k for _, k in own], "-", lw=0.6, label=name, **look)
    axes.set_yticks(range(len(methods)), methods, fontsize=8.5)
    axes.invert_yaxis()
    axes.set(xscale="log", xlabel="$|\\Delta\\omega_c|/\\omega_c$")
    axes.grid(alpha=0.3)
    style.legend(figure, loc="outside upper center", ncols=5)
    return figure


def draw_frontier(entries: Entries) -> Figure:
    """A panel for each state, a line for each method."""
    names = dict.fromkeys(entry.name for entry in entries)
    return _error_over_cost(entries, dict(zip(names, itertools.cycle(_LOOKS), strict=False)))


def draw_league(entries: Sequence[Entry]) -> Figure:
    """A panel for each error of omega_c in the league, a line for each engine."""
    return _error_over_cost(entries, {entry.name: style.mark_of(entry.name) for entry in entries})


def _error_over_cost(entries: Sequence[Entry], looks: Mapping[str, Mapping[str, Any]]) -> Figure:
    """Marks of one name at several time steps are joined, with the looks of that name."""
    other = (CREEP, ROLLING_ENDS, WALL, CASES, COST)  # no errors of omega_c
    shown = [name for name in dict.fromkeys(n for e in entries for n in e.scores) if name not in other]
    lines = -(-len(shown) // COLUMNS)
    figure = style.figure(11, 0.9 + 3.0 * lines)
    panels = figure.subplots(lines, COLUMNS, sharex=True, sharey=True, squeeze=False).ravel()
    for axes, discipline in zip(panels, shown, strict=False):
        for name, look in looks.items():
            own = [e for e in entries if e.name == name and math.isfinite(e.scores.get(discipline, math.nan))]
            own.sort(key=lambda entry: entry.scores[COST])
            x, y = [e.scores[COST] for e in own], [max(e.scores[discipline], LEAST) for e in own]
            axes.plot(x, y, ms=6, lw=1, label=name, **look)
        axes.set(xscale="log", yscale="log")
        axes.set_title(discipline, fontsize=10)
        axes.grid(alpha=0.3)
    for k, axes in enumerate(panels):
        axes.set_visible(k < len(shown))
        if k % COLUMNS == 0:
            axes.set_ylabel("relative error")
        if k >= len(shown) - COLUMNS:
            axes.set_xlabel("processor time divided by simulated time")
            axes.tick_params(labelbottom=True)
    style.legend(figure, loc="outside lower center", ncols=4)
    return figure
