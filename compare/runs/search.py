"""Where in parameter space does the ball hop for ever? A resumable search that fills the space of its groups evenly.

Every set is a point of a scrambled Sobol sequence over mu, eta, j, r/R, kappa = c sqrt(R/g) and Omega_0 =
omega_0 sqrt(R/g), and is started from a few random states. What still hops by time stepping is confirmed by the
event-driven simulation (`analytic.hopping`).

A chunk of sets is a file, named by the hash of all that determines it; it appears only when it is whole. Starting a
search again does what is missing, and a longer search contains the shorter ones.
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from concurrent.futures import as_completed
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import numpy as np

from analytic import hopping
from compare.runs.engines import EVENT
from compare.runs.progress import Show
from compare.runs.sweep import sobol
from compare.runs.tasks import sources
from compare.runs.workers import Workers
from model import Parameters, SimulationError, State
from model.arrays import Array
from model.files import make_directory, reading_json, write_text

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
LOGARITHMIC = ("mu", "eta", "r/R", "kappa")
"""Groups that are spread evenly in their logarithm."""


@dataclass(frozen=True)
class Search:
    """A search: its box, how many starts a set, and the seed of both sets and starts."""

    box: Mapping[str, tuple[float, float]] = field(default_factory=lambda: dict(BOX))
    starts: int = 5
    seed: int = 0

    def key(self, chunk: int) -> str:
        """Hash of all that determines a chunk: the search, and the sources of screen and confirmation."""
        text = json.dumps([dataclasses.asdict(self), LOGARITHMIC, chunk, CHUNK, sources(*EVENT.sources)])
        return hashlib.sha256(text.encode()).hexdigest()[:24]

    def points(self, count: int) -> Array:
        """The first `count` points, shape (count, 6), in the order of `BOX`."""
        low, high = np.array([self.box[name] for name in BOX]).T
        log = np.array([name in LOGARITHMIC for name in BOX])
        low, high = np.where(log, np.log(low), low), np.where(log, np.log(high), high)
        spread = low + sobol(len(BOX), count, self.seed) * (high - low)
        return np.asarray(np.where(log, np.exp(spread), spread))


def parameters(point: Array) -> Parameters:
    """The set at a point; R, g and m are those of the reference, and don't matter."""
    p = Parameters.named("reference")
    mu, eta, j, size, kappa, Omega_0 = point.tolist()
    unit = math.sqrt(p.R / p.g)
    return p.replace(mu=mu, eta=eta, j=j, r=size * p.R, c=kappa / unit, omega_0=Omega_0 / unit)


def random_starts(p: Parameters, count: int, seed: Sequence[int]) -> Array:
    """States (count, 8): orbits from half backwards to twice omega_0, any spin, every other ball off the floor.

    Nearly twice as many of these come to a hop as of `ensemble.random_starts`, which throw balls and turn them back.
    """
    rng = np.random.default_rng(seed)
    y = rng.uniform(0, p.R, count) * rng.integers(0, 2, count)
    omega_c = p.omega_0 * rng.uniform(-0.5, 2, count)
    slips = p.omega_0 * p.R / p.r * rng.uniform(-2, 2, (count, 3))
    return State(y, 0.0, omega_c, *slips.T).stacked()


def carry_out(search: Search, chunk: int, points: Array, path: Path) -> None:
    """Search the sets of a chunk and write its file."""
    rows = []
    for k, point in enumerate(points):
        p = parameters(point)
        starts = random_starts(p, search.starts, [search.seed, chunk * CHUNK + k])
        hops, x, failed = hopping.screen(p, starts)
        row: dict[str, Any] = {"hops": int(hops.sum()), "failed": failed}
        if hops.any():
            row |= {"x": x[hops][0].tolist()} | _confirmed(p, x[hops])
        rows.append(row)
    write_text(path, json.dumps({"chunk": chunk, "rows": rows}))


def _confirmed(p: Parameters, states: Array) -> dict[str, Any]:
    """What the event-driven simulation says of the first of the states that it confirms."""
    broken = ""
    for x in states:
        try:
            if hops := hopping.confirm(p, x):
                return {"confirmed": dataclasses.asdict(hops)}
        except SimulationError as error:
            broken = str(error)
    return {"confirmed": None, "broken": broken}


@dataclass(frozen=True)
class Searched:
    """What a search has found: the sets among its first `sets` in which some start still hops by time stepping."""

    search: Search
    sets: int
    rows: tuple[Mapping[str, Any], ...]
    """The groups of each, "hops": how many starts hop, "confirmed": the fields of `analytic.hopping.Hopping` by the
    event-driven simulation, or None."""
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
        """Inverse of `save`; raises `StorageError` if the file can't be read, or is none of these."""
        with reading_json(path, "search") as data:
            box = {name: tuple(ends) for name, ends in data["search"].pop("box").items()}
            return cls(Search(box, **data["search"]), data["sets"], tuple(data["rows"]), data["failed"])


def run(directory: Path, search: Search, count: int, workers: Workers, show: Show) -> Searched:
    """Search `count` sets, rounded up to whole chunks; finished chunks are read."""
    make_directory(directory)
    chunks = math.ceil(count / CHUNK)
    points = search.points(chunks * CHUNK).reshape(chunks, CHUNK, -1)
    paths = [directory / f"{search.key(chunk)}.json" for chunk in range(chunks)]
    todo = [chunk for chunk in range(chunks) if not paths[chunk].exists()]
    done = chunks - len(todo)
    show("search", done * CHUNK, chunks * CHUNK, 0)
    executor, at_once = workers.start(), True
    try:
        for future in as_completed(executor.submit(carry_out, search, k, points[k], paths[k]) for k in todo):
            future.result()
            done += 1
            show("search", done * CHUNK, chunks * CHUNK, 0)
        at_once = False
    finally:
        workers.stop(executor, at_once)
    return searched(search, paths, points)


def searched(search: Search, paths: Sequence[Path], points: Array) -> Searched:
    """What finished chunks hold, up to the first that isn't."""
    sets, failed, rows = 0, 0, []
    for path, chunk in zip(paths, points.tolist(), strict=True):
        if not path.exists():
            break
        for row, point in zip(json.loads(path.read_text("utf-8"))["rows"], chunk, strict=True):
            sets, failed = sets + 1, failed + row["failed"]
            if row["hops"]:
                rows.append(dict(zip(BOX, point, strict=True)) | row)
    return Searched(search, sets, tuple(rows), failed)
