"""The result of a search as a table: how often the ball hops for ever in each part of the box, with confidence."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

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


def parts(found: Searched) -> Iterator[Part]:
    """Every part of the range of every group."""
    points = found.search.points(found.sets)
    for k, name in enumerate(BOX):
        low, high = found.search.box[name]
        edges = np.geomspace(low, high, PARTS + 1) if name in LOGARITHMIC else np.linspace(low, high, PARTS + 1)
        all_sets, _ = np.histogram(points[:, k], edges)
        hopping, _ = np.histogram([row[name] for row in found.confirmed], edges)
        for a, b, n, hits in zip(edges, edges[1:], all_sets.tolist(), hopping.tolist(), strict=False):
            yield Part(name, float(a), float(b), n, hits)


def extremes(found: Searched) -> dict[str, tuple[float, float]]:
    """Smallest and largest value of each group with confirmed hopping; empty if there is none."""
    rows = found.confirmed
    return {name: (min(r[name] for r in rows), max(r[name] for r in rows)) for name in BOX} if rows else {}


def page(found: Searched) -> str:
    """The result as a page of Markdown."""
    count, rows = len(found.confirmed), found.rows
    low, high = interval(count, found.sets)
    lines = [
        "# Where the ball hops for ever",
        "",
        f"Of {found.sets} sets, each started from {found.search.starts} random states, {count} have a hopping "
        "attractor that was reached and that the event-driven simulation confirms: "
        f"{100 * count / found.sets:.2f} % "
        f"({100 * low:.2f} to {100 * high:.2f} % with {CONFIDENCE:.0%} confidence; an attractor with a small basin is "
        "missed, so that this is what five starts find and a lower bound of what there is). "
        f"By time stepping {len(rows)} sets still hopped after 60/c. {found.failed} runs broke down. "
        "The rest came to rest in a stationary state, or at least did not land any more.",
        "",
        "| of those confirmed | sets |", "| :-- | --: |",
    ]  # fmt: skip
    periods = [row["confirmed"]["landings"] for row in found.confirmed]
    for landings in sorted(set(periods) - {0}):
        lines.append(f"| {landings} landing{'s' * (landings > 1)} a period | {periods.count(landings)} |")
    lines += [f"| no period of up to 16 landings | {periods.count(0)} |", ""]
    lines += ["| | smallest with hopping | largest | searched |", "| :-- | --: | --: | --: |"]
    for name, (least, most) in extremes(found).items():
        a, b = found.search.box[name]
        lines.append(f"| {name} | {least:.3g} | {most:.3g} | {a:.3g} to {b:.3g} |")
    lines += ["", "| | from | to | sets | hopping | share, % | 95 % interval, % |"]
    lines += ["| :-- | --: | --: | --: | --: | --: | --: |"]
    for part in parts(found):
        low, high = part.interval
        share = f"{100 * part.hopping / part.sets:.2f}" if part.sets else ""
        lines.append(
            f"| {part.group} | {part.low:.3g} | {part.high:.3g} | {part.sets} | {part.hopping} | {share} "
            f"| {100 * low:.2f} … {100 * high:.2f} |"
        )
    return "\n".join([*lines, ""])
