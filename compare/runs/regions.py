"""The result of a search as a table: how often the ball hops for ever in each part of the box, with confidence."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

import numpy as np

from compare.runs.search import BOX, LOGARITHMIC, Searched

PARTS = 6
"""Parts of equal width into which the range of a group is cut."""
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Part:
    """The sets of a search in which one group lies in a part of its range."""

    group: str
    low: float
    high: float
    sets: int
    hopping: int
    """Sets among them with hopping that the event-driven simulation confirms."""

    @property
    def interval(self) -> tuple[float, float]:
        """Confidence interval of their share (Clopper-Pearson)."""
        return interval(self.hopping, self.sets)


def interval(hits: int, of: int) -> tuple[float, float]:
    """Confidence interval of a share (Clopper-Pearson); all of [0, 1] if nothing was tried."""
    from scipy.stats import binomtest  # slow to import

    if of == 0:
        return 0.0, 1.0
    low, high = binomtest(hits, of).proportion_ci(CONFIDENCE)
    return float(low), float(high)


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


KEPT = ("hopping-box.json", "hopping-strong-drag.json")
"""Searches that are kept beside this module: over the whole box, and beyond its largest kappa."""


def kept(name: str = KEPT[0]) -> Searched:
    """A search that is kept."""
    return Searched.load(Path(str(resources.files("compare.runs"))) / name)


def page(*searches: Searched) -> str:
    """Results as a page of Markdown."""
    return "\n".join(["# Where the ball hops for ever", "", *(line for each in searches for line in _section(each))])


def _section(record: Searched) -> list[str]:
    count, (low, high) = len(record.confirmed), interval(len(record.confirmed), record.sets)
    periods = [row["confirmed"]["landings"] for row in record.confirmed]
    kinds = [f"{periods.count(n)} with {n} landing{'s' * (n > 1)} a period" for n in sorted(set(periods) - {0})]
    box = ", ".join(f"{name} {a:.3g} to {b:.3g}" for name, (a, b) in record.search.box.items())
    lines = [
        f"## {record.sets} sets in {box}",
        "",
        f"Each was started from {record.search.starts} random states. In {count} sets some start leads to hopping that "
        f"the event-driven simulation confirms: {100 * count / record.sets:.2f} %, or {100 * low:.2f} to "
        f"{100 * high:.2f} % with {CONFIDENCE:.0%} confidence. That is what {record.search.starts} starts find: an "
        "attractor with a small basin is missed. "
        f"Of them {', '.join([*kinds, f'{periods.count(0)} without a period of up to 16 landings'])}. "
        f"By time stepping {len(record.rows)} sets still hopped after 60/c; {record.failed} runs broke down. In all "
        "other sets every ball stopped landing.",
        "",
    ]  # fmt: skip
    lines += ["| | smallest with hopping | largest |", "| :-- | --: | --: |"]
    lines += [f"| {name} | {least:.3g} | {most:.3g} |" for name, (least, most) in extremes(record).items()]
    lines += ["", "| | from | to | sets | hopping | share, % | 95 % interval, % |"]
    lines += ["| :-- | --: | --: | --: | --: | --: | --: |"]
    for part in parts(record):
        low, high = part.interval
        share = f"{100 * part.hopping / part.sets:.2f}" if part.sets else ""
        lines.append(
            f"| {part.group} | {part.low:.3g} | {part.high:.3g} | {part.sets} | {part.hopping} | {share} "
            f"| {100 * low:.2f} … {100 * high:.2f} |"
        )
    return [*lines, ""]
