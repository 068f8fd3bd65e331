"""The planes of Figs. 7 and 8: the set of cases in which the ball ends, at points of eta and omega_0.

Points are spread evenly first; more are put where neighbours differ, each kind of border in turn, and among rare ones.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from itertools import islice, zip_longest

import numpy as np
from scipy.spatial import Delaunay
from scipy.stats import qmc

from compare.kit.lab import Lab, time_unit
from compare.kit.record import Measurement, Missing, Records, measurement
from compare.kit.settling import LOOSE, begin, family, settle_groups
from model import Parameters
from model.arrays import Array

PROTOCOL = "plane"
DRAG = 1.25
"""Drag c, s-1: states settle within seconds, and slipping still lasts beyond the flow at which the wall can carry."""
FIGURES = ("fig-7", "fig-8")
"""mu as it is, and mu = eta."""
ETA, OMEGA = (0.02, 0.8), (0.45, 3.6)
"""Ranges of eta and of omega_0 sqrt(R/g)."""


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Bit masks of the cases reached, SR counted as NR; a point of which a run does not settle is left out."""
    plane = sets["reference"].replace(c=DRAG)
    points = {figure: spread(lab.effort("plane.spread"), 7 + k) for k, figure in enumerate(FIGURES)}
    seen: dict[str, list[tuple[Array, int]]] = {figure: [] for figure in FIGURES}
    tried: dict[str, set[tuple[float, ...]]] = {figure: set() for figure in FIGURES}
    for count in (*lab.effort("plane.added"), 0):
        chosen = [(figure, u) for figure in FIGURES for u in points[figure]]
        starts = []
        for figure, u in chosen:
            eta, flow = (low + float(part) * (high - low) for part, (low, high) in zip(u, (ETA, OMEGA), strict=True))
            p = plane.replace(eta=eta, omega_0=flow / time_unit(plane))
            p = p.replace(mu=eta) if figure == "fig-8" else p
            starts.append([begin(figure, p, how) for how in ("rest", "half as fast", "with the fluid", "on the wall")])
        for (figure, u), states in zip(chosen, settle_groups(lab, starts, span=20.0, loose=LOOSE), strict=True):
            if not any(each.failure for each in states):
                mask = sum(1 << case for case in {family(each.case) for each in states})
                seen[figure].append((u, mask))
                p, tasks = states[0].start.p, [each.task for each in states]
                yield measurement(lab, PROTOCOL, "reference", p, "cases", mask, tasks, figure=figure)
        for figure in FIGURES:
            tried[figure] |= {tuple(u.tolist()) for u in points[figure]}
            fresh = (u for u in added(seen[figure]) if tuple(u.tolist()) not in tried[figure])
            points[figure] = list(islice(fresh, count))
    for figure in FIGURES:
        if out := len(tried[figure]) - len(seen[figure]):
            total = len(tried[figure])
            reason = f"{figure}: {out} of {total} points are left out, too close to a change of case to settle"
            yield Missing(PROTOCOL, "reference", reason)


def spread(count: int, seed: int) -> list[Array]:
    """Points (2,) of the unit square, evenly spread."""
    return list(qmc.Halton(2, seed=seed).random(count))


def added(seen: Sequence[tuple[Array, int]]) -> list[Array]:
    """Midpoints between neighbours that differ, each kind of border in turn, the longest first; and among rare ones.

    A set of cases is rare if it was seen less than half as often as if all were seen equally often.
    """
    if len(seen) < 4:
        return []
    places, masks = np.array([u for u, _ in seen]), [m for _, m in seen]
    often = Counter(masks)
    rare = {m for m, number in often.items() if number < 0.5 * len(masks) / len(often)}
    borders: dict[tuple[int, ...], list[tuple[float, int, int]]] = {}
    for a, b in {tuple(sorted((int(t[i]), int(t[i - 1])))) for t in Delaunay(places).simplices for i in range(3)}:
        if masks[a] != masks[b] or masks[a] in rare:
            length = float(np.hypot(*(places[a] - places[b])))
            borders.setdefault(tuple(sorted((masks[a], masks[b]))), []).append((-length, a, b))
    rows = zip_longest(*(sorted(edges) for _, edges in sorted(borders.items())))
    turns = [edge for row in rows for edge in row if edge]
    return [(places[a] + places[b]) / 2 for _, a, b in turns]
