"""Deviations of the numbers of a claim, divided by their tolerances: a strip for every quantity."""

from __future__ import annotations

from functools import partial

import numpy as np
from matplotlib.figure import Figure

from compare.kit import style
from compare.kit.check import Check
from compare.kit.drawing import Drawing, GapError, Material
from compare.kit.statistics import COVERAGE

_WIDEST = 1.5
"""Deviations beyond this multiple of the tolerance are drawn at the edge, as arrows."""
_MANY = 100
"""From so many points on, they are drawn as pixels: a page of many figures stays small."""
Checks = tuple[Check, ...]


def of(claim: str) -> Drawing:
    """The figure of a claim that has none of its own."""
    return Drawing(f"Deviations of {claim}", partial(select, claim=claim), draw, (claim,))


def select(material: Material, claim: str) -> Checks:
    """The checks of a claim that have a tolerance; `GapError` if there are none, since counts need no figure."""
    checks = tuple(c for c in material.checks.get(claim, ()) if c.tolerance > 0 and np.isfinite(c.deviation))
    if not checks:
        raise GapError("nothing with a tolerance was measured")
    return checks


def draw(checks: Checks) -> tuple[Figure, str]:
    """As high as there are quantities."""
    names = list(dict.fromkeys(c.measurement.quantity for c in checks))
    engines = list(dict.fromkeys(c.measurement.engine for c in checks))
    strip = 1 / len(engines)
    figure = style.figure(7.0, 0.75 + len(names) * (0.15 + 0.12 * len(engines)) + 0.25 * (len(engines) > 1))
    axes = figure.add_subplot()
    for band, grey in ((1, "0.93"), (1 / COVERAGE, "0.86")):
        axes.axvspan(-band, band, color=grey, lw=0, zorder=0)
    axes.axvline(0, **style.GUIDE)
    for k in range(1, len(names)):
        axes.axhline(k - 0.5, color="white", lw=1.5, zorder=0.5)
    many = len(checks) > _MANY
    row = np.array([names.index(c.measurement.quantity) for c in checks])
    engine = np.array([engines.index(c.measurement.engine) for c in checks])
    # Points are spread vertically against overlap; a single point stays centred.
    kind = row * len(engines) + engine
    spread = np.where(np.bincount(kind)[kind] == 1, 0.0, (np.arange(len(row)) * 0.618 + 0.5) % 1 - 0.5)
    lanes = row + strip * (engine + 0.5 + 0.6 * spread) - 0.5
    ratio = np.array([c.deviation / c.tolerance for c in checks])
    for k, name in enumerate(engines):
        own = (np.abs(ratio) <= _WIDEST) & (engine == k)
        look = style.mark_of(name) | ({"ms": 3, "mfc": "none"} if many else {"ms": 4.5})
        axes.plot(ratio[own], lanes[own], ls="none", label=name, rasterized=many, **look)
    for side, arrow in ((-1, "<"), (1, ">")):
        beyond = side * ratio > _WIDEST
        at = np.full(beyond.sum(), side * _WIDEST)
        axes.plot(at, lanes[beyond], marker=arrow, ms=7, color="#B3261E", ls="none", rasterized=many)
    axes.set_yticks(range(len(names)), [style.symbol(name) for name in names])
    edge = 1.08 * _WIDEST
    axes.set(xlim=(-edge, edge), ylim=(len(names) - 0.5, -0.5), xlabel="(measured − predicted)/tolerance")
    if len(engines) > 1:
        style.legend(figure, loc="outside upper center", ncols=4)
    sets = dict.fromkeys(c.measurement.set for c in checks)
    alone = f"{next(iter(sets))}: {style.named(checks[0].measurement.parameters)}"
    return figure, (
        f"Measured less predicted, divided by the tolerance of each of the {len(checks)} numbers "
        f"({f'{len(sets)} parameter sets' if len(sets) > 1 else alone}), a strip for each quantity, and in it one for "
        "each engine. Shaded: within tolerance, three standard uncertainties; darker: within one; arrows: beyond the "
        "frame."
    )
