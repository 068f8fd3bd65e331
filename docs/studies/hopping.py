"""Where the ball hops for ever, and the basins of its attractors: drawn from what
`docs.studies.search` and `dualball basins` saved."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from compare.kit import pages, style
from compare.subjects.attractors.basins import ATTRACTORS, Basins
from docs.studies.search import LOGARITHMIC, Searched, share, summary, table
from model.kinematics import UNITS, VARIABLES

_PAIRS = (("mu", "eta"), ("kappa", "Omega_0"), ("j", "Omega_0"))
_CELLS = 8
_AXES, _SYMBOLS = style.SYMBOLS | {"Omega_0": style.FREE_0}, style.SYMBOLS | {"Omega_0": "Ω₀"}


def draw_where(record: Searched) -> Figure:
    """Sets with hopping over pairs of groups, on the share of sets that have it."""
    figure = style.figure(10.5, 3.5)
    points = dict(zip(record.search.box, record.search.points(record.sets).T, strict=True))
    for axes, (a, b) in zip(figure.subplots(1, len(_PAIRS)), _PAIRS, strict=True):
        edges = [_edges(name, *record.search.box[name]) for name in (a, b)]
        rows = record.confirmed
        tried, *_ = np.histogram2d(points[a], points[b], edges)
        hopping, *_ = np.histogram2d([r[a] for r in rows], [r[b] for r in rows], edges)
        with np.errstate(invalid="ignore"):
            ground = 100 * (hopping / tried).T
        share = axes.pcolormesh(*edges, ground, cmap="Blues", vmin=0, zorder=0, rasterized=True)
        figure.colorbar(share, ax=axes, label="sets that hop, %")
        for simple, mark, colour in ((True, ".", "#D55E00"), (False, "^", "#000000")):
            own = [r for r in rows if (r["confirmed"]["landings"] == 1) is simple]
            label = "one landing a period" if simple else "several, or no period"
            look: dict[str, Any] = {
                "ms": 2.2,
                "mew": 0.5,
                "mfc": "none",
                "color": colour,
                "rasterized": True,
            }
            axes.plot([r[a] for r in own], [r[b] for r in own], mark, label=label, **look)
        x, y = ("log" if name in LOGARITHMIC else "linear" for name in (a, b))
        axes.set(xlabel=_AXES[a], ylabel=_AXES[b], xscale=x, yscale=y)
    style.legend(figure.axes[0], loc="upper left", fontsize=7.5, markerscale=2)
    return figure


def _edges(name: str, low: float, high: float) -> np.ndarray:
    return (np.geomspace if name in LOGARITHMIC else np.linspace)(low, high, _CELLS + 1)


def caption_where(record: Searched) -> str:
    """What was found, and the share with its confidence."""
    count, search = len(record.confirmed), record.search
    box = ", ".join(
        f"{_SYMBOLS.get(name, name)} {a:g} … {b:.3g}" for name, (a, b) in search.box.items()
    )
    return (
        f"Sets in which the ball hops for ever from some of {search.starts} random starts, found "
        f"by time "
        f"stepping and confirmed by the event-driven simulation: {count} of {record.sets} sets, "
        f"{_share(count, record.sets)}. Box: {box}. r/R plays no part, as it drops out of the "
        f"equations."
    )


def _share(hits: int, of: int) -> str:
    return "{:.2f} % ({:.2f} to {:.2f} % with 95 % confidence)".format(*share(hits, of))


def page(*searches: Searched) -> str:
    """The page on searches: how often the ball hops for ever in each part of the box."""
    text = [
        "# Where the ball hops for ever",
        "A ball hops if it goes on landing on the floor for ever. Sets of parameters fill a box "
        "evenly: μ and η are "
        "the friction of floor and wall, κ = c√(R/g) and Ω₀ = ω₀√(R/g). An attractor with a small "
        "basin is "
        "missed by a few starts. `python -m docs.studies.figures` writes this page from what "
        "`python -m docs.studies.search --save` kept.",
        "What is kept was screened by time stepping; the search now screens by event-driven "
        "simulation, in a fifth of "
        "the time, which found hopping in two of the first 526 sets in which time stepping had "
        "none.",
    ]
    for record in searches:
        least, most = record.search.box["kappa"]
        text += [
            f"## Drag from κ = {least:.3g} to {most:.3g}",
            summary(record),
            pages.markdown(table(record)),
        ]
    return "\n\n".join(text) + "\n"


def caption_plane(basins: Basins) -> str:
    """The parameters, the other variables, shares with confidence, and where the two engines
    differ."""
    p = basins.parameters
    rest = ((n, v, unit) for n, v, unit in zip(VARIABLES, basins.start, UNITS, strict=True) if v)
    fixed = ", ".join(
        f"{n} = {v:.3g} {unit}" for n, v, unit in rest if n not in (basins.across, basins.up)
    )
    shares = "; ".join(
        f"{attractor} {_share(*basins.share(attractor))}"
        for attractor in ATTRACTORS
        if basins.share(attractor)[0]
    )
    text = (
        f"What becomes of a ball that starts on a plane of states ({fixed}; all others zero). "
        f"{style.named(p)}, Ω₀ = {p.Omega_0:.3g}. "
        f"Ground: the event-driven simulation, {basins.attractors.size} starts: {shares}."
    )
    if not basins.coarse:
        return text
    far = basins.differences()
    text += (
        f" Dots: MuJoCo at {1e3 * basins.timestep:g} ms; {len(far)} of {basins.mujoco.size} differ"
    )
    if len(far):
        text += (
            ", next to a boundary"
            if far.max() <= 1
            else f", up to {far.max():g} cells from a boundary"
        )
    return text + "."
