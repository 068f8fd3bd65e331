"""Where in parameter space the ball hops for ever: ``python -m docs.studies.search --save
found.json``.

A search screens random starts of sets, the points of a scrambled Sobol sequence over mu, eta, j,
r/R, kappa = c sqrt(R/g) and Omega_0 = omega_0 sqrt(R/g); a ball that still hops after 60/c is
looked at until its hopping closes, goes on, or ends. A chunk of sets is a file, named by the hash
of all that determines it: a search goes on where it stopped, and a longer one contains the shorter
ones. `docs.studies.figures` makes the page of what was found."""

from __future__ import annotations

import argparse
import dataclasses
import hashlib
import json
import math
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import numpy as np
import numpy.typing as npt

from analytic import simulate, simulate_many
from analytic.orbits.attractors import periodic_limit
from analytic.orbits.periodic import landings
from analytic.simulation.ensemble import interval
from compare.kit import pages, progress
from compare.kit.engines import EVENT
from compare.kit.progress import Show
from compare.kit.sweep import Axis, sobol
from compare.kit.tasks import sources
from compare.kit.workers import Workers, processes
from compare.subjects.attractors.measure import with_groups
from model import Parameters, SimulationError, State
from model.arrays import Array
from model.files import make_directory, reading_json, write_text
from model.parameters import POSITIVE

CHUNK = 50
"""Sets in a file."""
BOX = {
    "mu": (0.03, 3.0),
    "eta": (0.03, 2.0),
    "j": (0.1, 2 / 3),
    "r/R": (0.02, 0.6),
    "kappa": (0.005, 1.0),
    "Omega_0": (0.3, 6.0),
}
"""The box that is searched, unless another one is named."""
SYMBOLS = {"mu": "μ", "eta": "η", "kappa": "κ", "Omega_0": "Ω₀"}
"""How groups are written whose names are not their symbols."""
LOGARITHMIC = ("mu", "eta", "r/R", "kappa")
"""Groups that are spread evenly in their logarithm."""

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


@dataclass(frozen=True)
class AttractorSearch:
    """A search: its box, how many starts a set, and the seed of both sets and starts."""

    box: Mapping[str, tuple[float, float]] = field(default_factory=lambda: dict(BOX))
    starts: int = 5
    seed: int = 0

    def key(self, chunk: int) -> str:
        """Hash of all that determines a chunk: the search, and the sources of screen and
        confirmation."""
        own = Path(__file__).read_text("utf-8")
        text = json.dumps(
            [dataclasses.asdict(self), LOGARITHMIC, chunk, CHUNK, own, sources(*EVENT.sources)]
        )
        return hashlib.sha256(text.encode()).hexdigest()[:24]

    def points(self, count: int) -> Array:
        """The first `count` points, shape (count, 6), in the order of `BOX`."""
        low, high = np.array([self.box[name] for name in BOX]).T
        log = np.array([name in LOGARITHMIC for name in BOX])
        low, high = np.where(log, np.log(low), low), np.where(log, np.log(high), high)
        spread = low + sobol(len(BOX), count, self.seed) * (high - low)
        return np.asarray(np.where(log, np.exp(spread), spread))


@dataclass(frozen=True)
class Searched:
    """What a search has found: the sets among its first `sets` in which some start still hops by
    time stepping."""

    search: AttractorSearch
    sets: int
    rows: tuple[Mapping[str, Any], ...]
    """The groups of each; "hops", how many starts do; "confirmed", the fields of `Hopping` or
    None."""
    failed: int
    """Runs that broke down."""

    @property
    def confirmed(self) -> list[Mapping[str, Any]]:
        """The rows whose hopping the event-driven simulation confirms."""
        return [row for row in self.rows if row["confirmed"]]

    def save(self, path: Path) -> None:
        """Write it as JSON."""
        write_text(path, json.dumps(dataclasses.asdict(self), indent=0))

    @classmethod
    def load(cls, path: Path) -> Self:
        """Inverse of `save`; raises `StorageError` if the file can't be read, or is none of
        these."""
        with reading_json(path, "search") as data:
            box = {name: tuple(ends) for name, ends in data["search"].pop("box").items()}
            return cls(
                AttractorSearch(box, **data["search"]),
                data["sets"],
                tuple(data["rows"]),
                data["failed"],
            )


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

    One thread; p.c must be positive.
    """
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
    """The hopping that a state leads to by the event-driven simulation; None if it ends.

    That is a stable periodic motion near it if there is one; else the ball is followed for
    `CONFIRMING`. Raises `SimulationError` if the simulation can't go on."""
    unit = math.sqrt(p.R / p.g)
    seen = simulate(p, x, SEEN * unit, sample_interval=SEEN * unit / SEEN_SAMPLES)
    if not any(landings(zip(seen.events.from_case, seen.events.to_case, strict=True))):
        return None
    limit = periodic_limit(seen)
    if limit and limit.orbit and (count := sum(landings(limit.orbit.changes))):
        orbit = limit.orbit
        omega_c, height = State.of(orbit.mean).omega_c / p.omega_0, float(orbit.cycle.y.max()) / p.R
        return Hopping(
            int(count), orbit.period / unit, omega_c, height, float(np.abs(orbit.multipliers).max())
        )
    lasts = max(CONFIRMING / p.c, 4 * SEEN * unit)
    run = simulate(p, seen.x[-1], lasts, sample_interval=lasts / SEEN_SAMPLES)
    last = run.time > run.time[-1] * 2 / 3
    times = run.events.time[landings(zip(run.events.from_case, run.events.to_case, strict=True))]
    times = times[times > run.time[-1] * 2 / 3]
    if len(times) < 3 or run.time[-1] - times[-1] > 3 * np.max(np.diff(times)):
        return None
    between, omega_c = float(np.mean(np.diff(times))), float(np.mean(run.omega_c[last]))
    return Hopping(0, between / unit, omega_c / p.omega_0, float(run.y[last].max()) / p.R)


def carry_out(search: AttractorSearch, chunk: int, points: Array, path: Path) -> None:
    """Search the sets of a chunk and write its file.

    Confirmed is the first hopping state that can be; if none can, "broken" says where the
    simulation broke down."""
    rows = []
    for k, point in enumerate(points):
        p = parameters(point)
        hop, x, failed = screen(
            p, random_starts(p, search.starts, [search.seed, chunk * CHUNK + k])
        )
        row: dict[str, Any] = {"hops": int(hop.sum()), "failed": failed}
        if hop.any():
            row |= {"x": x[hop][0].tolist(), "confirmed": None, "broken": ""}
        for state in x[hop]:
            try:
                if confirmed := confirm(p, state):
                    row["confirmed"] = dataclasses.asdict(confirmed)
                    del row["broken"]
                    break
            except SimulationError as error:
                row["broken"] = str(error)
        rows.append(row)
    write_text(path, json.dumps({"chunk": chunk, "rows": rows}))


def run(
    directory: Path, search: AttractorSearch, count: int, workers: Workers, show: Show
) -> Searched:
    """Search `count` sets, rounded up to whole chunks; finished chunks are read."""
    make_directory(directory)
    points = search.points(math.ceil(count / CHUNK) * CHUNK)
    chunks = points.reshape(-1, CHUNK, len(BOX))
    paths = [directory / f"{search.key(chunk)}.json" for chunk in range(len(chunks))]
    todo = [chunk for chunk, path in enumerate(paths) if not path.exists()]
    show("search", len(points) - len(todo) * CHUNK, len(points), 0)
    with workers:
        running = [workers.submit(carry_out, search, k, chunks[k], paths[k]) for k in todo]
        for left, future in zip(reversed(range(len(todo))), as_completed(running), strict=True):
            future.result()
            show("search", len(points) - left * CHUNK, len(points), 0)
    rows = [row for path in paths for row in json.loads(path.read_text("utf-8"))["rows"]]
    sets = [dict(zip(BOX, point, strict=True)) for point in points.tolist()]
    found = tuple(groups | row for groups, row in zip(sets, rows, strict=True) if row["hops"])
    return Searched(search, len(rows), found, sum(row["failed"] for row in rows))


def share(hits: int, of: int) -> tuple[float, float, float]:
    """How many of all, in %, and the ends of the 95 % interval; a share of nothing is nan."""
    low, high = interval(hits, of)
    return (100 * hits / of if of else math.nan), 100 * low, 100 * high


def table(record: Searched) -> pages.Rows:
    """Each sixth of the range of each group, with the number of sets in it, and of those with
    confirmed hopping."""
    points, rows = record.search.points(record.sets), []
    for k, name in enumerate(BOX):
        edges = (np.geomspace if name in LOGARITHMIC else np.linspace)(*record.search.box[name], 7)
        symbol = SYMBOLS.get(name, name)
        sets, _ = np.histogram(points[:, k], edges)
        hopping, _ = np.histogram([row[name] for row in record.confirmed], edges)
        for low, high, n, hits in zip(
            edges, edges[1:], sets.tolist(), hopping.tolist(), strict=False
        ):
            part, least, most = (f"{value:.2f}" for value in share(hits, n))
            rows.append(
                [symbol, f"{low:.3g}", f"{high:.3g}", str(n), str(hits), part, f"{least} … {most}"]
            )
    return [["", "from", "to", "sets", "hopping", "share, %", "95 % interval, %"], *rows]


def summary(record: Searched) -> str:
    """What a search has found in all, with confidence."""
    count, broken = (
        len(record.confirmed),
        f" {record.failed} runs broke down." if record.failed else "",
    )
    periods = Counter(row["confirmed"]["landings"] for row in record.confirmed)
    kinds = [
        f"{periods[n]} with {n or 'no period found'}"
        for n in sorted(periods, key=lambda n: (n == 0, n))
    ]
    box = ", ".join(
        f"{SYMBOLS.get(name, name)} {a:.3g} to {b:.3g}"
        for name, (a, b) in record.search.box.items()
    )
    return (
        f"The box is {box}. In {count} of {record.sets} sets some of {record.search.starts} random "
        f"starts lead to "
        "hopping that the event-driven simulation confirms: {:.2f} %, or {:.2f} to {:.2f} % with "
        "95 % confidence. "
        f"Sets by landings in a period: {', '.join(kinds) or 'none'}. By the screen "
        f"{len(record.rows)} sets still "
        f"hopped after 60/c; in all others every ball stopped landing.{broken}"
    ).format(*share(count, record.sets))


def main() -> None:
    """Search, and print what was found."""
    parser = argparse.ArgumentParser(description="Where in parameter space the ball hops for ever.")
    parser.add_argument("--sets", type=int, default=500)
    parser.add_argument("--starts", type=int, default=5, help="random starts of each")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--range", nargs="*", default=[], metavar="NAME=FROM:TO", help=f"of {', '.join(BOX)}"
    )
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument(
        "-o", "--output", type=Path, default=Path("search"), help="directory of the chunks"
    )
    parser.add_argument("--save", type=Path, help="write the sets with hopping as JSON")
    args = parser.parse_args()
    axes = Axis.several(args.range, dict.fromkeys(BOX, "1"), "group", POSITIVE)
    asked = AttractorSearch(BOX | {axis.name: axis.ends for axis in axes}, args.starts, args.seed)
    with progress.reporter(False) as show:
        found = run(args.output, asked, args.sets, processes(args.workers), show)
    if args.save:
        found.save(args.save)
    print(summary(found), pages.markdown(table(found)), sep="\n\n")


if __name__ == "__main__":
    main()
