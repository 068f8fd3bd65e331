"""Error against cost: of all engines in the league, or of ways of setting one."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from matplotlib.figure import Figure

from compare.figures import style
from compare.scorecard.league import CASES, COST, CREEP, ROLLING_ENDS, WALL, Entry

COLUMNS = 3
LEAST = 1e-16
"""Smaller errors are drawn here: an error may be zero."""


def draw(entries: Sequence[Entry]) -> Figure:
    """A panel for each error of omega_c in the league."""
    looks = {entry.name: style.mark_of(entry.name) for entry in entries}
    return error_over_cost(entries, looks, leave_out=(CREEP, ROLLING_ENDS, WALL, CASES))


def error_over_cost(
    entries: Sequence[Entry], looks: Mapping[str, Mapping[str, Any]], leave_out: Sequence[str] = ()
) -> Figure:
    """A panel for each discipline; marks of one name at several time steps are joined, with the looks of that name."""
    shown = [name for name in dict.fromkeys(n for e in entries for n in e.scores) if name not in (*leave_out, COST)]
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
