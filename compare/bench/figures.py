"""Error against cost of the engines in the league."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from compare.bench.case import TOLERANCE
from compare.bench.exact import cases
from compare.bench.league import KINDS, kind
from compare.bench.runner import Result
from compare.kit import style

LEAST = 1e-11
"""Smaller errors are drawn here."""
MARKS, COLOURS = (
    "osv^DPX*<>phd",
    ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8C564B"),
)


def draw_league(league: Mapping[str, Sequence[Result]]) -> Figure:
    """A panel for each kind of case: the median of an engine's errors over that of its costs, its steps joined."""
    kinds = {case.name: kind(case) for case in cases()}
    figure, panels = style.panels(7.6, 8.8, 2, 2, sharex=True, sharey=True)
    tried = {name: [r for r in results if r.errors] for name, results in league.items()}
    families = list(dict.fromkeys(name.removesuffix("-defaults") for name, own in tried.items() if own))
    for axes, each in zip(panels.ravel(), KINDS, strict=True):
        for name, results in tried.items():
            own = np.array([[r.costs, r.errors] for r in results if kinds[r.case] == each])
            if not len(own):
                continue
            known = np.isfinite(own[:, 1]).mean(0) > 0.5  # where the median is
            cost, error = np.nanmedian(np.where(np.isfinite(own[:, 1:]), own, np.nan)[..., known], axis=0)
            number = families.index(name.removesuffix("-defaults"))
            look = {"marker": MARKS[number % len(MARKS)], "color": COLOURS[number % len(COLOURS)], "ms": 6, "lw": 1}
            look |= {"mfc": "white", "ls": ":"} if name.endswith("-defaults") else {}
            axes.plot(cost, np.maximum(error, LEAST), label=name, **look)
        axes.axhline(TOLERANCE, color="0.5", lw=0.8)
        axes.set(xscale="log", yscale="log", title=each)
        axes.grid(alpha=0.3)
    for axes in panels[:, 0]:
        axes.set_ylabel("error, in units of the case's scales")
    for axes in panels[1]:
        axes.set_xlabel("processor time divided by simulated time")
    style.legend(figure, loc="outside lower center", ncols=3)
    return figure
