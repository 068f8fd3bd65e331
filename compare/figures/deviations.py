"""The numbers of a claim, each by how much of its tolerance it is off: a strip for every quantity."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from matplotlib.figure import Figure

from compare.figures import style
from compare.figures.drawing import Drawing, GapError, Material
from compare.measure.check import Check
from compare.measure.quantities import quantity
from compare.statistics import COVERAGE

_WIDEST = 1.5
"""Deviations over tolerance beyond this are drawn at the edge, as arrows."""
_MANY = 100
"""From so many points on, they are drawn as pixels: a page of many figures stays small."""


@dataclass(frozen=True)
class Strips:
    """Checks of one claim that have a tolerance."""

    claim: str
    checks: tuple[Check, ...]


def of(claim: str) -> Drawing:
    """The figure of a claim that has none of its own."""
    title, choose = f"Deviations of {claim}", partial(select, claim=claim)
    return Drawing(title=title, select=choose, draw=draw, caption=caption, claims=(claim,))


def select(material: Material, claim: str) -> Strips:
    """The checks of a claim; `GapError` if none has a tolerance, since counts need no figure."""
    checks = tuple(c for c in material.checks(claim) if c.tolerance > 0 and np.isfinite(c.deviation))
    if not checks:
        raise GapError("nothing with a tolerance was measured")
    return Strips(claim, checks)


def caption(strips: Strips) -> str:
    """What is shown, and with which parameters."""
    sets = dict.fromkeys(c.measurement.set for c in strips.checks)
    p = strips.checks[0].measurement.parameters
    many = f"{len(sets)} parameter sets" if len(sets) > 1 else f"{next(iter(sets))}: {style.named(p)}"
    return (
        f"Measured less predicted, over the tolerance of each of the {len(strips.checks)} numbers ({many}). Shaded: "
        "within tolerance, three standard uncertainties; darker: within one. Arrows: beyond the frame."
    )


def draw(strips: Strips) -> Figure:
    """As high as there are quantities."""
    names = list(dict.fromkeys(c.measurement.quantity for c in strips.checks))
    engines = list(dict.fromkeys(c.measurement.engine for c in strips.checks))
    figure = style.figure(7.0, 0.75 + 0.27 * len(names) + (0.25 if len(engines) > 1 else 0))
    axes = figure.add_subplot()
    for band, grey in ((1, "0.93"), (1 / COVERAGE, "0.86")):
        axes.axvspan(-band, band, color=grey, lw=0, zorder=0)
    axes.axvline(0, **style.GUIDE)
    many = len(strips.checks) > _MANY
    row = np.array([names.index(c.measurement.quantity) for c in strips.checks])
    # Neighbours one above the other, so that few points lie upon each other; one that is alone in the middle.
    alone = np.bincount(row)[row] == 1
    lanes = row + np.where(alone, 0.0, 0.6 * ((np.arange(len(row)) * 0.618 + 0.5) % 1 - 0.5))
    ratio = np.array([c.deviation / c.tolerance for c in strips.checks])
    within = np.abs(ratio) <= _WIDEST
    for engine in engines:
        own = within & [c.measurement.engine == engine for c in strips.checks]
        look = style.mark_of(engine) | ({"ms": 3, "mfc": "none"} if many else {"ms": 4.5})
        axes.plot(ratio[own], lanes[own], ls="none", label=engine, rasterized=many, **look)
    for side, arrow in ((-1, "<"), (1, ">")):
        beyond = side * ratio > _WIDEST
        at = np.full(beyond.sum(), side * _WIDEST)
        axes.plot(at, lanes[beyond], marker=arrow, ms=7, color="#B3261E", ls="none", rasterized=many)
    axes.set_yticks(range(len(names)), [quantity(name).symbol for name in names])
    axes.set(
        ylim=(len(names) - 0.5, -0.5), xlim=(-1.08 * _WIDEST, 1.08 * _WIDEST), xlabel="(measured − predicted)/tolerance"
    )
    if len(engines) > 1:
        handles, labels = axes.get_legend_handles_labels()
        once = dict(zip(labels, handles, strict=True))
        figure.legend(list(once.values()), list(once), loc="outside upper center", ncols=4, fontsize=8, frameon=False)
    return figure
