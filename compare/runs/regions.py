"""The result of a search as a table: how often the ball hops for ever in each part of the box, with confidence."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from analytic.ensemble import interval
from compare import pages
from compare.runs.search import BOX, LOGARITHMIC, Searched

PARTS = 6
"""Parts of equal width into which the range of a group is cut."""


@dataclass(frozen=True)
class Part:
    """The sets of a search in which one group lies in a part of its range."""

    group: str
    low: float
    high: float
    sets: int
    hopping: int
    """Sets among them with hopping that the event-driven simulation confirms."""


def parts(record: Searched) -> Iterator[Part]:
    """Every part of the range of every group."""
    points = record.search.points(record.sets)
    for k, name in enumerate(BOX):
        low, high = record.search.box[name]
        edges = np.geomspace(low, high, PARTS + 1) if name in LOGARITHMIC else np.linspace(low, high, PARTS + 1)
        all_sets, _ = np.histogram(points[:, k], edges)
        hopping, _ = np.histogram([row[name] for row in record.confirmed], edges)
        for a, b, n, hits in zip(edges, edges[1:], all_sets.tolist(), hopping.tolist(), strict=False):
            yield Part(name, float(a), float(b), n, hits)


def extremes(record: Searched) -> dict[str, tuple[float, float]]:
    """Smallest and largest value of each group with confirmed hopping; empty if there is none."""
    rows = record.confirmed
    return {name: (min(r[name] for r in rows), max(r[name] for r in rows)) for name in BOX} if rows else {}


INTRODUCTION = (
    "# Where the ball hops for ever",
    "A ball hops if it goes on landing on the floor for ever. Sets of parameters fill a box evenly: mu and eta are the "
    "friction of floor and wall, kappa = c√(R/g) and Omega_0 = ω₀√(R/g). "
    "`dualball search --kept docs/studies/data/hopping-*.json --page docs/hopping.md` writes this page.",
)


def page(*searches: Searched) -> str:
    """Results as a page of Markdown."""
    return "\n\n".join([*INTRODUCTION, *(part for each in searches for part in _section(each))]) + "\n"


def _section(record: Searched) -> list[str]:
    count, (low, high) = len(record.confirmed), interval(len(record.confirmed), record.sets)
    periods = [row["confirmed"]["landings"] for row in record.confirmed]
    kinds = [f"{periods.count(n)} with {n}" for n in sorted(set(periods) - {0})]
    kinds += [f"{periods.count(0)} with no period found"] if 0 in periods else []
    landings = f"Sets by landings in a period: {', '.join(kinds)}. " if kinds else ""
    others = f", {len(record.rows) - count} of them not confirmed" if len(record.rows) > count else ""
    broken = f" {record.failed} runs broke down." if record.failed else ""
    box = ", ".join(f"{name} {a:.3g} to {b:.3g}" for name, (a, b) in record.search.box.items())
    least, most = record.search.box["kappa"]
    text = (
        f"The box is {box}. "
        f"Each set was started from {record.search.starts} random states. In {count} sets some start leads to hopping "
        f"that the event-driven simulation confirms: {100 * count / record.sets:.2f} %, or {100 * low:.2f} to "
        f"{100 * high:.2f} % with 95 % confidence. That is what {record.search.starts} starts find: an "
        "attractor with a small basin is missed. "
        f"{landings}By time stepping {len(record.rows)} sets still hopped after 60/c{others}.{broken} "
        "In all other sets every ball stopped landing."
    )
    ends = [[name, f"{least:.3g}", f"{most:.3g}"] for name, (least, most) in extremes(record).items()]
    shares = []
    for part in parts(record):
        low, high = interval(part.hopping, part.sets)
        share = f"{100 * part.hopping / part.sets:.2f}" if part.sets else ""
        numbers = [f"{part.low:.3g}", f"{part.high:.3g}", str(part.sets), str(part.hopping), share]
        shares.append([part.group, *numbers, f"{100 * low:.2f} … {100 * high:.2f}"])
    return [
        f"## Drag from kappa = {least:.3g} to {most:.3g}: {record.sets} sets",
        text,
        pages.markdown([["", "smallest with hopping", "largest"], *ends]),
        pages.markdown([["", "from", "to", "sets", "hopping", "share, %", "95 % interval, %"], *shares]),
    ]
