"""Error against cost of all engines in the league."""

from __future__ import annotations

import math
from collections.abc import Sequence

from matplotlib.figure import Figure

from compare.figures import style
from compare.runs.engines import ENGINES
from compare.scorecard.league import CASES, COST, CREEP, DISCIPLINES, ROLLING_ENDS, WALL, Entry

COLUMNS = 3
_LEAST = 1e-16
"""Smaller errors are drawn here: an error may be zero."""


def draw(entries: Sequence[Entry]) -> Figure:
    """A panel for each error; marks of an engine at several time steps are joined."""
    left_out = {CREEP, ROLLING_ENDS, WALL, CASES}
    shown = [d.name for d in DISCIPLINES if d.name not in left_out and any(d.name in e.scores for e in entries)]
    lines = -(-len(shown) // COLUMNS)
    figure = style.figure(11, 0.9 + 3.0 * lines)
    panels = figure.subplots(lines, COLUMNS, sharex=True, sharey=True, squeeze=False).ravel()
    for axes, discipline in zip(panels, shown, strict=False):
        for name in dict.fromkeys(entry.name for entry in entries):
            own = [e for e in entries if e.name == name and math.isfinite(e.scores.get(discipline, math.nan))]
            own.sort(key=lambda entry: entry.scores[COST])
            x, y = [e.scores[COST] for e in own], [max(e.scores[discipline], _LEAST) for e in own]
            engine = ENGINES[name]
            axes.plot(x, y, marker=engine.mark, color=engine.colour, mfc="white", ms=6, lw=1, label=name)
        axes.set(xscale="log", yscale="log")
        axes.set_title(discipline, fontsize=10)
        axes.grid(alpha=0.3)
    for axes in panels[len(shown) :]:
        axes.set_visible(False)
    for axes in panels[::COLUMNS]:
        axes.set_ylabel("relative error")
    for axes in panels[max(0, len(shown) - COLUMNS) : len(shown)]:
        axes.set_xlabel("processor time per simulated time")
        axes.tick_params(labelbottom=True)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize=8, frameon=False)
    return figure
