"""Where in parameter space the ball hops for ever: ``python -m docs.studies.search 10000`` searches
so many sets, in half an hour, keeps those that hop, and writes the page and the picture of them.

Sets are the points of a scrambled Sobol sequence over mu, eta, j, r/R, kappa = c sqrt(R/g) and
Omega_0 = omega_0 sqrt(R/g). Random starts of each are screened; a ball that still hops after 60/c
is looked at until its hopping closes, goes on, or ends."""

import argparse
import dataclasses
import json
import math
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure

from analytic import simulate, simulate_many
from analytic.orbits.attractors import periodic_limit
from analytic.orbits.periodic import landings
from analytic.simulation.ensemble import interval
from compare.campaign.sweep import sobol
from compare.figures import pages, style
from compare.subjects.attractors.measure import with_groups
from model import Parameters, SimulationError, State, Trajectory
from model.arrays import Array
from model.files import write_text

RECORDS = Path(__file__).parents[1] / "records"
KEPT = Path(__file__).parent / "data" / "hopping.json"
BOX = {
    "mu": (0.03, 3.0),
    "eta": (0.03, 2.0),
    "j": (0.1, 2 / 3),
    "r/R": (0.02, 0.6),
    "kappa": (0.005, 1.0),
    "Omega_0": (0.3, 6.0),
}
"""The box that is searched."""
SYMBOLS = style.SYMBOLS | {"Omega_0": "Ω₀"}
LOGARITHMIC = ("mu", "eta", "r/R", "kappa")
"""Groups that are spread evenly in their logarithm."""
STARTS = 5
"""Random starts of a set."""

DURATION = 60.0
"""How long the screen follows a ball, in 1/c: transients decay as exp(-c t) at the slowest, but
near folds."""
QUIET, LOOKS = 3.0, 12
"""Without a landing for this long, in 1/c, a ball has settled; how often that is looked for in this
time."""
SEEN, SEEN_SAMPLES = 25.0, 4000
"""How long the ball is watched for a period, in sqrt(R/g): twice the longest that is looked for;
and samples."""
CONFIRMING = 12.0
"""How long a ball with no period is followed, in 1/c, or four times `SEEN`; the last third of it
counts."""
Row = Mapping[str, Any]
"""A set in which some start hops by the screen: its groups, "hops", how many starts do, and
"confirmed", the fields of `Hopping` or None."""


def _edges(name: str, count: int) -> Array:
    """Of equal parts of the range of a group."""
    even = np.geomspace if name in LOGARITHMIC else np.linspace
    return np.asarray(even(*BOX[name], count + 1))


def points(count: int) -> Array:
    """The first `count` points, shape (count, 6), in the order of `BOX`."""
    log = np.array([name in LOGARITHMIC for name in BOX])
    low, high = (np.where(log, np.log(end), end) for end in np.array(list(BOX.values())).T)
    spread = low + sobol(len(BOX), count, 0) * (high - low)
    return np.asarray(np.where(log, np.exp(spread), spread))


def parameters(point: Array) -> Parameters:
    """The set at a point; R, g and m are those of the reference, and don't matter."""
    p = Parameters.named("reference")
    mu, eta, j, ratio, kappa, Omega_0 = point.tolist()
    return with_groups(p, kappa, Omega_0, mu=mu, eta=eta, j=j, r=ratio * p.R)


def random_starts(p: Parameters, count: int, seed: Sequence[int]) -> Array:
    """States (count, 8): orbits from half backwards to twice omega_0, any spin, every other ball
    off the floor.

    Nearly twice as many of these come to a hop as of `ensemble.random_starts`, which throw balls
    and turn them back."""
    rng = np.random.default_rng(seed)
    y = rng.uniform(0, p.R, count) * rng.integers(0, 2, count)
    omega_c = p.omega_0 * rng.uniform(-0.5, 2, count)
    slips = p.omega_0 * p.R / p.r * rng.uniform(-2, 2, (count, 3))
    return State(y, 0.0, omega_c, *slips.T).stacked()


def screen(p: Parameters, x0s: npt.ArrayLike) -> tuple[npt.NDArray[np.bool_], Array, int]:
    """Which of the starts (n, 8) still hop after 60/c; their states then (n, 8); how many runs
    failed.

    One thread; p.c must be positive."""
    lasts, quiet = DURATION / p.c, QUIET / p.c
    runs = simulate_many(p, x0s, lasts, sample_interval=quiet / LOOKS, quiet=quiet, threads=1)
    failed = np.array([bool(each) for each in runs.failure])
    hops = np.any(runs.landings[:, -LOOKS:] > 0, axis=1) & ~failed
    return hops, runs.x[:, -1], int(failed.sum())


@dataclass(frozen=True)
class Hopping:
    """A motion that hops on, in natural units."""

    landings: int
    """Landings on the floor in a period; 0 if no periodic motion was found near it."""
    period: float
    """In sqrt(R/g); with no period found the mean time between landings."""
    omega_c: float
    """Mean omega_c/omega_0."""
    height: float
    """Greatest height y/R."""
    multiplier: float | None = None
    """Largest modulus of the Floquet multipliers; None without a period."""


def confirm(p: Parameters, x: npt.ArrayLike) -> Hopping | None:
    """The hopping that a state leads to; None if it ends.

    That is a stable periodic motion near it if there is one; else the ball is followed for
    `CONFIRMING`. Raises `SimulationError` if the simulation can't go on."""
    unit = math.sqrt(p.R / p.g)
    seen = simulate(p, x, SEEN * unit, sample_interval=SEEN * unit / SEEN_SAMPLES)
    if not any(_lands(seen)):
        return None
    limit = periodic_limit(seen)
    if limit and (orbit := limit.orbit) and (count := sum(landings(orbit.changes))):
        return Hopping(
            landings=int(count),
            period=orbit.period / unit,
            omega_c=State.of(orbit.mean).omega_c / p.omega_0,
            height=float(orbit.cycle.y.max()) / p.R,
            multiplier=float(np.abs(orbit.multipliers).max()),
        )
    lasts = max(CONFIRMING / p.c, 4 * SEEN * unit)
    run = simulate(p, seen.x[-1], lasts, sample_interval=lasts / SEEN_SAMPLES)
    from_then_on = run.time[-1] * 2 / 3
    last, times = run.time > from_then_on, run.events.time[_lands(run)]
    times = times[times > from_then_on]
    apart = np.diff(times)
    if len(times) < 3 or run.time[-1] - times[-1] > 3 * np.max(apart):
        return None
    omega_c, height = np.mean(run.omega_c[last]) / p.omega_0, run.y[last].max() / p.R
    return Hopping(0, float(np.mean(apart)) / unit, float(omega_c), float(height))


def _lands(run: Trajectory) -> npt.NDArray[np.bool_]:
    """Which of its events are landings."""
    return landings(zip(run.events.from_case, run.events.to_case, strict=True))


def look(numbered: tuple[int, Array]) -> Row:
    """What starts of a set come to: the first hopping state that can be confirmed is."""
    k, point = numbered
    p = parameters(point)
    hop, x, failed = screen(p, random_starts(p, STARTS, [0, k]))
    confirmed = None
    for state in x[hop]:
        try:
            confirmed = confirmed or confirm(p, state)
        except SimulationError:
            failed += 1
    shown = dataclasses.asdict(confirmed) if confirmed else None
    groups = dict(zip(BOX, point.tolist(), strict=True))
    return groups | {"hops": int(hop.sum()), "failed": failed, "confirmed": shown}


def share(hits: int, of: int) -> str:
    """In per cent, with the 95 % interval."""
    least, most = interval(hits, of)
    return f"{100 * hits / of:.2f} ({100 * least:.2f} … {100 * most:.2f})"


def page(sets: int, rows: Sequence[Row], note: str = "") -> str:
    """How often the ball hops for ever in each third of the range of each group, and in all."""
    confirmed = [row for row in rows if row["confirmed"]]
    table = [["", "from", "to", "sets", "hopping", "share, % (95 % interval)"]]
    for name, tried in zip(BOX, points(sets).T, strict=True):
        edges, own = _edges(name, 3), [row[name] for row in confirmed]
        counts = (np.histogram(each, edges)[0].tolist() for each in (tried, own))
        for low, high, n, hits in zip(edges, edges[1:], *counts, strict=False):
            cells = f"{low:.3g}", f"{high:.3g}", str(n), str(hits), share(hits, n)
            table.append([SYMBOLS.get(name, name), *cells])
    periods = sorted(Counter(row["confirmed"]["landings"] for row in confirmed).items())
    kinds = ", ".join(f"{n} with {k or 'no period found'}" for k, n in periods)
    return f"""# Where the ball hops for ever

A ball hops if it goes on landing on the floor for ever. Sets of parameters fill a box evenly: μ and
η are the friction of floor and wall, κ = c√(R/g) and Ω₀ = ω₀√(R/g). An attractor with a small basin
is missed by a few starts. Written by `python -m docs.studies.search {sets}`. {note}

In {len(confirmed)} of {sets} sets some of {STARTS} random starts lead to hopping that stays:
{share(len(confirmed), sets)} %. Sets by landings in a period: {kinds}. {len(rows)} sets still
hopped after 60/c; in all others every ball stopped landing.

{pages.markdown(table)}
"""


def draw(sets: int, rows: Sequence[Row]) -> Figure:
    """Sets with hopping over pairs of groups, on the share of sets that have it."""
    figure, tried = style.figure(10.5, 3.5), dict(zip(BOX, points(sets).T, strict=True))
    symbols = style.SYMBOLS | {"Omega_0": style.FREE_0}
    pairs = ("mu", "eta"), ("kappa", "Omega_0"), ("j", "Omega_0")
    for axes, (a, b) in zip(figure.subplots(1, len(pairs)), pairs, strict=True):
        edges = [_edges(a, 8), _edges(b, 8)]
        x, y = ([row[name] for row in rows if row["confirmed"]] for name in (a, b))
        of_all, *_ = np.histogram2d(tried[a], tried[b], edges)
        hopping, *_ = np.histogram2d(x, y, edges)
        ground = 100 * (hopping / np.maximum(of_all, 1)).T
        shown = axes.pcolormesh(*edges, ground, cmap="Blues", vmin=0, zorder=0)
        figure.colorbar(shown, ax=axes, label="sets that hop, %")
        axes.plot(x, y, ".", ms=1.5, color="#D55E00")
        across, up = ("log" if name in LOGARITHMIC else "linear" for name in (a, b))
        axes.set(xlabel=symbols[a], ylabel=symbols[b], xscale=across, yscale=up)
    return figure


def show(kept: Mapping[str, Any]) -> None:
    """Write the page, and draw the picture, of what a search kept."""
    sets, rows = kept["sets"], kept["rows"]
    write_text(RECORDS / "hops.md", page(sets, rows, kept["note"]))
    draw(sets, rows).savefig(RECORDS / "attractors" / "where.png", dpi=110)


def main(sets: int) -> None:
    """Search, keep what was found, and show it."""
    with ProcessPoolExecutor(os.cpu_count()) as pool:
        looked = pool.map(look, enumerate(points(sets)), chunksize=50)
        rows = [row for row in looked if row["hops"]]
    kept = {"sets": sets, "note": "", "rows": rows}
    write_text(KEPT, json.dumps(kept, indent=0))
    show(kept)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Where in parameter space the ball hops for ever.")
    parser.add_argument("sets", type=int, help="how many are searched")
    main(parser.parse_args().sets)
