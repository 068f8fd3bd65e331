"""Sweeps: the parameter sets that axes span, and what many runs settled to, in one file.

`collect` writes one row a run: its parameters, the mean over its last quarter, how sure that is, and its last case. The
file opens in xarray with the dimension ``run``, along which the parameters that vary are coordinates.
"""

from __future__ import annotations

import dataclasses
import hashlib
import itertools
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from rich.table import Table

import analytic
from compare.kit import pages
from compare.kit.statistics import settled_case, steady_mean
from model import Case, InputError, Parameters, StorageError, Trajectory, storage
from model.arrays import Array
from model.files import check_writable
from model.hdf5 import WholeFile, column, dataset, reading, write_columns
from model.kinematics import VARIABLES
from model.parameters import ANY, Range, check_names, check_number, parse_number
from model.trajectory import CONVENTIONS, attributes, columns

SCHEMA, SCHEMA_VERSION = "dualball-collection", 1
MOST = 100_000
"""Most runs of a sweep."""
FEWEST = 6
"""Samples of the last quarter of a run below which it has no mean."""
NAMED = 5
"""Most files that can't be gathered, and most runs of a file, that are named one by one."""
FIELDS = {field.name: field.metadata["unit"] for field in Parameters.quantities()}
"""Units of the parameters."""


@dataclass(frozen=True)
class Axis:
    """A quantity and its values in order, or the two ends of its range."""

    name: str
    values: tuple[float, ...]
    between: bool = False
    """Whether no more than the two ends were given."""

    @classmethod
    def parse(cls, text: str, units: Mapping[str, str] = FIELDS, kind: str = "parameter", allowed: Range = ANY) -> Axis:
        """Read ``name=from:to:count``, ``name=from:to`` or ``name=a,b,c``; raises `InputError`."""
        name, _, rest = text.partition("=")
        check_names([name], list(units), kind)
        if ":" not in rest:
            values = tuple(parse_number(name, part, units[name], allowed) for part in rest.split(","))
            if len(set(values)) < len(values):
                raise InputError(f"{name} = {rest} names a value twice")
            return cls(name, values)
        low, high, *count = rest.split(":")
        if len(count) > 1:
            raise InputError(f"{text!r} is no range: write {name}=from:to:count")
        first, last = (parse_number(name, end, units[name], allowed) for end in (low, high))
        if first >= last:
            given = f"{name} = {first:g}:{last:g} {units[name]}"
            raise InputError(f"{given} is in the wrong order: a range runs from low to high")
        if not count:
            return cls(name, (first, last), between=True)
        points = int(parse_number(f"count of {name}", count[0], "points", Range(2, MOST, whole=True)))
        return cls(name, tuple(np.linspace(first, last, points).tolist()))

    @classmethod
    def several(cls, texts: Sequence[str], *kind: Any) -> list[Axis]:
        """Read each as `parse` does; raises `InputError`, for a name that comes twice, too."""
        axes = [cls.parse(text, *kind) for text in texts]
        names = [axis.name for axis in axes]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"{name} is given {names.count(name)} ranges: one is enough")
        return axes

    @property
    def points(self) -> tuple[float, ...]:
        """The values; raises `InputError` if only the ends of a range were given."""
        if self.between:
            raise InputError(f"here {self.name} needs values: write {self.name}=from:to:count or {self.name}=a,b,c")
        return self.values

    @property
    def ends(self) -> tuple[float, float]:
        """Of the range; raises `InputError` if there is none."""
        if len(self.values) != 2:
            raise InputError(f"here {self.name} needs a range: write {self.name}=from:to")
        return self.values[0], self.values[1]


def grid(p: Parameters, axes: Sequence[Axis]) -> Iterator[Parameters]:
    """Every combination of the axes' values, the last axis fastest; `InputError` if there are more than `MOST`."""
    check_number("the grid", math.prod(len(axis.points) for axis in axes), "runs", Range(1, MOST))
    for values in itertools.product(*(axis.points for axis in axes)):
        yield p.replace(**dict(zip((axis.name for axis in axes), values, strict=True)))


def random(p: Parameters, axes: Sequence[Axis], count: int, seed: int) -> Iterator[Parameters]:
    """`count` points that fill the box of the axes' ranges evenly."""
    check_number("random", count, "points", Range(1, MOST, whole=True))
    low, high = np.array([axis.ends for axis in axes]).T
    for row in (low + sobol(len(axes), count, seed) * (high - low)).tolist():
        yield p.replace(**dict(zip((axis.name for axis in axes), row, strict=True)))


def sobol(dimensions: int, count: int, seed: int) -> Array:
    """The first `count` points (count, dimensions) of a scrambled Sobol sequence in the unit cube."""
    from scipy.stats import qmc  # slow to import

    unit = qmc.Sobol(dimensions, rng=np.random.default_rng(seed)).random(2 ** math.ceil(math.log2(count)))
    return np.asarray(unit[:count])


def levels(axes: Sequence[Axis], direction: str) -> list[float]:
    """omega_0 as one run visits it: up, down, or up and down again."""
    if len(axes) != 1 or axes[0].name != "omega_0":
        raise InputError(f"direction = {direction!r} sweeps omega_0 within one run: vary omega_0 and nothing else")
    up = sorted(axes[0].points)
    return {"up": up, "down": up[::-1], "both": up + up[-2::-1]}[direction]


def collect(directory: Path, output: Path) -> int:
    """Gather all runs of a directory, whole ones and failed ones, in the order of their names; return their number.

    One that is stored twice is taken once.

    Raises `StorageError` if there are none, the output can't be written, or, with their names, some can't be read or
    hold the same run twice.
    """
    check_writable(output)
    if not directory.is_dir():
        raise StorageError(f"cannot read {directory}: there is no such directory")
    rows, problems, known = [], [], dict[bytes, tuple[Path, bytes]]()
    for file in sorted(directory.rglob("*.h5")):
        if file.parent.suffix == ".journal":  # of a run that goes on
            continue
        try:
            if output.exists() and file.samefile(output):
                _check_collection(file)
                continue
            runs = storage.load_runs(file)
        except StorageError as error:
            problems.append(str(error))
            continue
        for name, run in runs.items():
            header = dataclasses.asdict(dataclasses.replace(run.header, created="", failure=""))
            header["flow"] = run.header.flow.to_mapping()
            identity = _digest(json.dumps(header, sort_keys=True, default=dict).encode())  # all that determines a run
            numbers = _digest(*(getattr(run, name).tobytes() for name in columns(Trajectory)))
            first, same = known.setdefault(identity, (file / name, numbers))
            if numbers != same:
                problems.append(f"{first} and {file / name} hold the same run with different numbers")
            if first == file / name:
                rows.append(_row(run, first.relative_to(directory)))
    if problems:
        more = f"; and {len(problems) - NAMED} more" if len(problems) > NAMED else ""
        raise StorageError("; ".join(problems[:NAMED]) + more)
    if not rows:
        raise StorageError(f"there are no runs in {directory}")
    table = {name: [row[name] for row in rows] for name in rows[0]}
    coordinates, about = varied(table), _attributes()
    with WholeFile(output) as whole:
        title = f"What {len(rows)} balls settled to, measured over the last part of each run"
        whole.file.attrs.update(Conventions=CONVENTIONS, title=title, schema=SCHEMA, schema_version=SCHEMA_VERSION)
        for name, stored in write_columns(whole.file, table, "run").items():
            stored.attrs.update(about[name])
            if coordinates and name not in ("run", *coordinates):
                stored.attrs["coordinates"] = " ".join(coordinates)  # of the CF convention
        whole.finish()
    return len(rows)


def _digest(*parts: bytes) -> bytes:
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part)
    return digest.digest()


def _check_collection(output: Path) -> None:
    """Raise `StorageError` if what is to be overwritten isn't the collection of the last time."""
    with reading(output) as file:
        if file.attrs.get("schema") != SCHEMA:
            raise StorageError("it holds runs to be gathered, and can't be the output, too")


def _attributes() -> dict[str, dict[str, Any]]:
    """Of each column of a collection: units, long_name, and of the case its flags."""
    about: dict[str, dict[str, Any]] = {
        f.name: {"units": f.metadata["unit"], "long_name": f.metadata["meaning"]} for f in Parameters.quantities()
    }
    texts = {"run": "file and name of the run", "engine": "engine", "drag": "law of drag"}
    about |= {name: {"long_name": text} for name, text in (texts | {"failure": "why it broke down"}).items()}
    about["duration"] = {"units": "s", "long_name": "duration of the run"}
    stored = columns(Trajectory)
    for name in VARIABLES:
        units, meaning = (stored[name][key] for key in ("units", "long_name"))
        about[name] = {"units": units, "long_name": f"{meaning}, mean"}
        about[f"{name}_uncertainty"] = {"units": units, "long_name": f"{meaning}, uncertainty of the mean"}
        about[f"{name}_theory"] = {"units": units, "long_name": f"{meaning}, stationary solution of the case"}
    about["case"] = attributes(stored["case"])  # -1: none prevails
    return about


def varied(of: Mapping[str, Any]) -> list[str]:
    """The parameters that have several values; older files have no law of drag."""
    return [f.name for f in dataclasses.fields(Parameters) if len(set(of.get(f.name, ()))) > 1]


def describe(path: Path) -> dict[str, Any]:
    """What a collection or batch holds: names of runs, engines, failures, the range of every column, JSON-able.

    Empty for a file that holds a single run. Raises `StorageError` for one that is not whole or of a newer version.
    """
    if path.parent.is_file():  # one run of a batch
        return {}
    with reading(path) as file:
        if file.attrs.get("schema") != SCHEMA and not storage.is_batch(file):
            return {}
        if not storage.is_batch(file):
            version = file.attrs.get("schema_version")
            if not isinstance(version, (int, np.integer)) or not 1 <= version <= SCHEMA_VERSION:
                raise StorageError(f"it is a collection of version {version!r}; this program reads {SCHEMA_VERSION}")
            return described({name: column(dataset(file, name)) for name in file})
    rows = [_row(run, path / name) for name, run in storage.load_runs(path).items()]
    return described({name: np.array([row[name] for row in rows]) for name in rows[0]})


def described(of: dict[str, npt.NDArray[Any]]) -> dict[str, Any]:
    """As `describe`, for the columns of a collection by name; `drag` is missing in older ones."""
    codes, counts = np.unique(of["case"], return_counts=True)
    finite = {name: values[np.isfinite(values)] for name, values in of.items() if values.dtype.kind == "f"}
    return {
        "runs": len(of["run"]),
        "names": of["run"].tolist(),
        "engines": sorted(set(of["engine"].tolist())),
        "cases": {Case(code).name: int(count) for code, count in zip(codes, counts, strict=True) if code >= 0},
        "failures": [text for text in of["failure"].tolist() if text],
        "drag": sorted(set(of["drag"].tolist())) if "drag" in of else [],
        "varied": varied(of),
        "ranges": {name: [float(v.min()), float(v.max())] for name, v in finite.items() if len(v)},
    }


def table(about: dict[str, Any]) -> Table:
    """The description for the terminal."""
    ranges, names = about["ranges"], about["names"]
    more = f"\n… and {len(names) - NAMED} more" if len(names) > NAMED else ""
    rows = {
        "runs": f"{about['runs']} ({', '.join(about['engines'])}), {len(about['failures'])} failed",
        "named": "\n".join(names[:NAMED]) + more,
        "cases": ", ".join(f"{name}: {count}" for name, count in about["cases"].items()),
        "varied": "\n".join("{} {:g} … {:g}".format(n, *ranges[n]) for n in about["varied"] if n != "drag"),
        "drag": ", ".join(about["drag"]),
        "omega_c": "{:.9g} … {:.9g} rad s-1".format(*ranges.get("omega_c", [np.nan, np.nan])),
    }
    return pages.pairs(rows)


def _row(trajectory: Trajectory, name: Path) -> dict[str, Any]:
    """A run's parameters, mean over its last quarter with its uncertainty by drift, and last case, beside theory.

    Those are nan, and the case -1, for a run too short for them; theory, the stable stationary solution of the case, is
    nan where there is none, where it is free, and in unsteady flow.
    """
    row: dict[str, Any] = {"run": str(name), "engine": trajectory.header.engine}
    row |= dataclasses.asdict(trajectory.header.parameters)
    row["duration"] = float(trajectory.time[-1]) if len(trajectory.time) else 0.0
    row["failure"] = trajectory.header.failure
    length = len(trajectory.time) // 4
    means, drifts = steady_mean(trajectory.x.T, length) if length >= FEWEST else np.full((2, len(VARIABLES)), math.nan)
    for variable, mean, drift in zip(VARIABLES, means.tolist(), drifts.tolist(), strict=True):
        row |= {variable: mean, f"{variable}_uncertainty": drift}
    row |= dict.fromkeys((f"{name}_theory" for name in VARIABLES), math.nan)
    case = int(settled_case(trajectory)) if len(trajectory.case) else -1
    if case >= 0 and trajectory.header.flow.is_steady:
        with suppress(InputError):  # the case has no stable stationary solution, or not one
            of = analytic.solution(trajectory.header.parameters, Case(case))
            row |= {f"{n}_theory": float(x) for n, x in of.state._asdict().items() if n not in of.family}
    return row | {"case": case}
