"""What ways of setting MuJoCo reach: errors along the ladder of settings, and error against cost."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from matplotlib.figure import Figure

from compare.figures import league, style
from compare.figures.drawing import GapError, Material
from compare.scorecard.league import OPEN, Entry

_MARKS = "os^vDP*X"
_COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8C564B")
_OF_STATES = (
    "the stationary states named (case and ω₀ in rad/s; RR and SS with μ = η = 0.2, NR with η = 0.6; j = 0.4, "
    "κ = 0.0714)"
)


@dataclass(frozen=True)
class Comparison:
    """The entries of a figure."""

    figure: str
    entries: tuple[Entry, ...]


def select(material: Material, figure: str) -> Comparison:
    """The entries of the "ladder", or those of the "frontier", which have a cost; `GapError` if there are none."""
    entries = material.ladder if figure == "ladder" else material.frontier
    if not entries:
        raise GapError(f"{'the ladder of settings' if figure == 'ladder' else 'error against cost'} was not measured")
    return Comparison(figure, entries)


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
    looks = [{"marker": mark, "color": colour, "mfc": "white"} for mark, colour in zip(_MARKS, _COLOURS, strict=True)]
    if of.figure == "ladder":
        return _ladder(of, looks)
    names = dict.fromkeys(entry.name for entry in of.entries)
    return league.error_over_cost(of.entries, dict(zip(names, itertools.cycle(looks), strict=False)))


def _ladder(of: Comparison, looks: Sequence[Mapping[str, Any]]) -> Figure:
    """Rows of settings, a mark for each state."""
    methods = [entry.name for entry in of.entries]
    figure = style.figure(9, 1.1 + 0.33 * len(methods))
    axes = figure.add_subplot()
    shown = [name for name in of.entries[0].scores if name != OPEN]
    for name, look in zip(shown, looks, strict=False):
        own = [(k, e.scores[name]) for k, e in enumerate(of.entries) if math.isfinite(e.scores[name])]
        x, y = [max(error, league.LEAST) for _, error in own], [k for k, _ in own]
        axes.plot(x, y, "-", lw=0.6, label=name, **look)
    axes.set_yticks(range(len(methods)), methods, fontsize=8.5)
    axes.invert_yaxis()
    axes.set(xscale="log", xlabel="$|\\Delta\\omega_c|/\\omega_c$")
    axes.grid(alpha=0.3)
    figure.legend(loc="outside upper center", ncols=5, fontsize=8, frameon=False)
    return figure
