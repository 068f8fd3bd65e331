"""Error against cost, of the engines in the league or of other ways to simulate."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure

from compare.bench.league import CASES, COST, CREEP, ROLLING_ENDS, WALL, Entry
from compare.kit import style

COLUMNS = 3
LEAST = 1e-16
"""Smaller errors are drawn here: an error may be zero."""


def draw_league(entries: Sequence[Entry]) -> Figure:
    """A panel for each error of omega_c in the league, a line for each engine."""
    return draw_error_over_cost(entries, {entry.name: style.mark_of(entry.name) for entry in entries})


def draw_error_over_cost(entries: Sequence[Entry], looks: Mapping[str, Mapping[str, Any]]) -> Figure:
    """A panel for each error of omega_c; entries of one name at several time steps are joined, with its looks."""
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
