"""What many runs settled to, in one file.

`collect` writes of each run its parameters, the mean over its last quarter, how sure that is, and
its last case. The file opens in xarray. The parameters that vary are the dimensions of a grid, if
the runs are one, each point once; else coordinates along the dimension ``run``. `save_means` writes
the same of a batch whose samples nobody wants."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
from rich.table import Table

import analytic
from analytic.flowmeter import real_fluid
from compare.campaign.workers import processes
from compare.figures import drawing, pages
from compare.method.statistics import settled_case
from compare.view import steady
from model import Case, InputError, Parameters, StorageError, Trajectory, storage, table
from model.files import check_writable
from model.hdf5 import column, dataset, reading, write_columns, writing
from model.kinematics import VARIABLES
from model.trajectory import CONVENTIONS, attributes, columns
from model.versions import current_versions

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SCHEMA, SCHEMA_VERSION = "dualball-collection", 2
MEANS, MEANS_VERSION = "dualball-means", 1
"""What a file of the means of a batch says of itself."""
NAMED = 5
"""Most files that can't be gathered, and most runs of a file, that are named one by one."""
DOUBTED = 16
"""Most runs of a figure that are asked whether the model holds for them."""
Columns = dict[str, npt.NDArray[Any]]
"""By name, an entry a run. Beside those of a collection: whether the flow is `steady`, a digest of
all that determines the run, its `identity`, and one of its `numbers`."""
_HELD = "steady", "identity", "numbers"
_TEXT = "run", "engine", "drag", "failure", "identity", "numbers"


def collect(
    directory: Path,
    output: Path,
    workers: int = 0,
    progress: Callable[[float], None] = lambda done: None,
) -> int:
    """Gather all runs of a directory, ordered by what varies; return their number.

    One that is stored twice is taken once. So many processes read the files; 0 is this one.
    `progress` is called with the share of them that is read.

    Raises `StorageError` if there are none, the output can't be written, or, with their names, some
    can't be read or hold the same run twice."""
    check_writable(output)
    if not directory.is_dir():
        why = "it is no directory" if directory.exists() else "there is no such directory"
        raise StorageError(f"cannot read {directory}: {why}")
    files = list(_files(directory, output))
    parts, problems = list[Columns](), list[str]()
    with processes(workers) as work:
        for k, found in enumerate(work.map(partial(_rows_or_why_not, directory), files), 1):
            progress(k / len(files))
            if isinstance(found, str):
                problems.append(found)
            elif found:
                parts.append(found)
    # one by one, for memory's sake
    names = list(parts[0]) if parts else []
    table = {name: np.concatenate([part.pop(name) for part in parts]) for name in names}
    rows, twofold = _each_once(table, directory)
    problems += twofold
    if problems:
        more = f"; and {len(problems) - NAMED} more" if len(problems) > NAMED else ""
        raise StorageError("; ".join(problems[:NAMED]) + more)
    if not table:
        raise StorageError(f"there are no runs in {directory}")
    _write({name: values[rows] for name, values in table.items() if name not in _HELD}, output)
    return len(rows)


def _files(directory: Path, output: Path) -> Iterator[Path]:
    """The files of a directory that may hold runs; the output is none, and may be overwritten if it
    is the collection of the last time."""
    for file in sorted(directory.rglob("*.h5")):
        if not (output.exists() and file.samefile(output)):
            yield file
            continue
        with reading(output) as before:
            if before.attrs.get("schema") != SCHEMA:
                raise StorageError("it holds runs to be gathered, and can't be the output, too")


def _each_once(table: Columns, directory: Path) -> tuple[npt.NDArray[np.int_], list[str]]:
    """Rows with the first of each run; and which files hold the same run with other numbers."""
    if not table:
        return np.empty(0, int), []
    _, first, which = np.unique(table["identity"], return_index=True, return_inverse=True)
    names = [directory / name for name in table["run"].tolist()]
    different = np.flatnonzero(table["numbers"] != table["numbers"][first[which]]).tolist()
    return np.sort(first), [
        f"{names[first[which[k]]]} and {names[k]} hold the same run with different numbers"
        for k in different
    ]


def _write(collected: Columns, output: Path) -> None:
    """Write runs in the order of what varies: as a grid if they are each point of one once."""
    coordinates, about, count = varied_parameters(collected), _attributes(), len(collected["run"])
    order = np.lexsort([collected[name] for name in ("run", *reversed(coordinates))])
    collected = {name: values[order] for name, values in collected.items()}
    dimensions, axes = ["run"], {name: np.unique(collected[name]) for name in coordinates}
    shape = [len(values) for values in axes.values()]
    if axes and math.prod(shape) == count:
        places = [np.searchsorted(values, collected[name]) for name, values in axes.items()]
        if np.array_equal(np.ravel_multi_index(places, shape), np.arange(count)):
            dimensions = coordinates
            collected = axes | {
                name: v.reshape(shape) for name, v in collected.items() if name not in axes
            }
    with writing(output) as file:
        title = f"What {count} balls settled to, measured over the last part of each run"
        file.attrs.update(
            Conventions=CONVENTIONS, title=title, schema=SCHEMA, schema_version=SCHEMA_VERSION
        )
        for name, stored in write_columns(file, collected, *dimensions).items():
            stored.attrs.update(about[name])
            if dimensions == ["run"] and coordinates and name not in ("run", *coordinates):
                stored.attrs["coordinates"] = " ".join(coordinates)  # of the CF convention


def _rows_or_why_not(directory: Path, file: Path) -> Columns | str:
    """The columns of all runs of a file, named by its path; or why it can't be read."""
    try:
        return _rows(file, file.relative_to(directory))
    except StorageError as error:
        return str(error)


def _rows(path: Path, shown: Path) -> Columns:
    """The columns of all runs of a file, whose name in the collection begins with `shown`; of a
    collection, which holds no run, none."""
    with reading(path) as file:
        schema, version = file.attrs.get("schema"), file.attrs.get("schema_version")
        if schema == SCHEMA:
            return {}
        if schema == MEANS and version != MEANS_VERSION:
            raise StorageError(
                f"it holds means of another version; this program reads {MEANS_VERSION}"
            )
        found: Columns = {}
        if schema == MEANS:
            measured = [name for name in _attributes() if not name.endswith("_theory")]
            stored = {name: column(dataset(file, name)) for name in file}
            found = _checked(stored, [*measured, *_HELD])
    found = {n: v.astype(str) if v.dtype.kind == "O" else v for n, v in found.items()}
    found = found or _means(storage.load_runs(path))
    theory = np.full((len(VARIABLES), len(found["run"])), math.nan)
    for k in np.flatnonzero((found["case"] >= 0) & found["steady"]).tolist():
        p = _parameters(found, k)
        with suppress(InputError):  # the case has no stable stationary solution, or not one
            solution = analytic.solution(p, Case(found["case"][k]))
            known = [name not in solution.family for name in VARIABLES]
            theory[:, k] = np.where(known, solution.state, math.nan)
    found |= {f"{name}_theory": values for name, values in zip(VARIABLES, theory, strict=True)}
    return found | {"run": np.array([str(shown / name) for name in found["run"].tolist()])}


def _checked(found: Columns, names: Collection[str]) -> Columns:
    """The columns of these names, also of a grid; `StorageError` unless each has an entry a run, of
    its kind."""
    for name in names:
        is_text, of = name in _TEXT, found[name]
        if of.shape != found["run"].shape or (of.dtype.kind in "OU") != is_text:
            raise StorageError(f"{name!r} is not {'a text' if is_text else 'a number'} a run")
    return {name: of.ravel() for name, of in found.items() if name in names}


def save_means(runs: Mapping[str, Trajectory], path: Path) -> None:
    """Write what runs settled to, by name, without samples; raises `StorageError`."""
    with writing(path) as file:
        file.attrs.update(
            schema=MEANS,
            schema_version=MEANS_VERSION,
            versions=json.dumps(dict(current_versions())),
        )
        write_columns(file, _means(runs), "run")


def _means(runs: Mapping[str, Trajectory]) -> Columns:
    """Parameters, means with drifts, last case of runs; nan and -1 if short."""
    rows, unknown = [], [math.nan] * len(VARIABLES)
    for name, run in runs.items():
        about = run.header
        row: dict[str, Any] = {"run": name, "engine": about.engine}
        row |= dataclasses.asdict(about.parameters)
        row["duration"] = float(run.time[-1]) if len(run.time) else 0.0
        row["failure"] = about.failure
        means = steady.last_quarter(run) or (unknown, unknown)
        for variable, mean, drift in zip(VARIABLES, *means, strict=True):
            row |= {variable: mean, f"{variable}_uncertainty": drift}
        row["case"] = int(settled_case(run)) if len(run.case) else -1
        row["steady"] = about.flow.is_steady
        determined_by = about.attributes() | {"mjcf": about.mjcf, "created": "", "failure": ""}
        row["identity"] = _digest(json.dumps(determined_by, sort_keys=True).encode())
        row["numbers"] = _digest(*(getattr(run, each).tobytes() for each in columns(Trajectory)))
        rows.append(row)
    return {name: np.array([row[name] for row in rows]) for name in rows[0]}


def _digest(*parts: bytes) -> str:
    """A hash of bytes, 32 hexadecimal digits."""
    digest = hashlib.sha256()
    for part in parts:  # joined they would take the memory of a run once more
        digest.update(part)
    return digest.hexdigest()[:32]


def _attributes() -> dict[str, dict[str, Any]]:
    """Of each column of a collection: units, long_name, and of the case its flags."""
    about: dict[str, dict[str, Any]] = {
        f.name: {"units": f.metadata["unit"], "long_name": f.metadata["meaning"]}
        for f in Parameters.quantities()
    }
    about["run"] = {"long_name": "file and name of the run"}
    about["engine"] = {"long_name": "engine"}
    about["drag"] = {"long_name": "law of drag"}
    about["failure"] = {"long_name": "why it broke down"}
    about["duration"] = {"units": "s", "long_name": "duration of the run"}
    stored = columns(Trajectory)
    told = {
        "": "mean",
        "_uncertainty": "uncertainty of the mean",
        "_theory": "stationary solution of the case",
    }
    for name in VARIABLES:
        units, meaning = stored[name]["units"], stored[name]["long_name"]
        for ending, what in told.items():
            about[name + ending] = {"units": units, "long_name": f"{meaning}, {what}"}
    about["case"] = attributes(stored["case"])  # -1: none prevails
    return about


def varied_parameters(of: Mapping[str, npt.NDArray[Any]]) -> list[str]:
    return [f.name for f in dataclasses.fields(Parameters) if len(np.unique(of[f.name])) > 1]


def read(path: Path) -> Columns:
    """The columns of a collection or batch, a row a run; none of a file that holds a single run.

    Raises `StorageError` for one that is not whole or of another version."""
    if path.parent.is_file():  # one run of a batch
        return {}
    with reading(path) as file:
        schema, version = (file.attrs.get(name) for name in ("schema", "schema_version"))
        if schema == SCHEMA:
            if version != SCHEMA_VERSION:
                held = f"it is a collection of version {version!r}"
                raise StorageError(f"{held}; this program reads {SCHEMA_VERSION}")
            of, run = {name: column(dataset(file, name)) for name in file}, dataset(file, "run")
            if not run.is_scale:  # a grid
                names = [next(iter(dimension.keys()), "run") for dimension in run.dims]
                places = np.meshgrid(*(of[name] for name in names), indexing="ij")
                of |= dict(zip(names, places, strict=True))
            return _checked(of, _attributes())
    if schema not in (MEANS, storage.BATCH):
        return {}
    return {name: values for name, values in _rows(path, path).items() if name not in _HELD}


def labelled(of: Columns) -> dict[str, Sequence[Any]]:
    """The columns as a table has them: units in their labels, cases by name."""
    about, names = _attributes(), {case.value: case.name for case in Case}
    rows = {table.label(name, about[name].get("units", "1")): of[name].tolist() for name in of}
    return rows | {"case": [names.get(code, "") for code in rows["case"]]}


def draw(of: Columns) -> Figure:
    """A figure of omega_c over what varies first, the flow if it does, by case, with theory."""
    from compare.figures import style  # here, because drawing takes a second to load

    varied = [name for name in varied_parameters(of) if name != "drag"]
    if not varied:
        raise InputError("only a collection in which a parameter varies can be drawn")
    name = "omega_0" if "omega_0" in varied else varied[0]
    about = {f.name: f.metadata for f in Parameters.quantities()}[name]
    unit = pages.readable(about["unit"])
    x, label = of[name], about["symbol"] + f" ({unit})" * bool(unit)
    figure = style.figure(7, 4.6)
    axes = figure.add_subplot()
    axes.plot(x, of["omega_c_theory"], "x", color="0.6", label="theory")
    off = steady.share(of["omega_c"], of["omega_c_uncertainty"], of["omega_0"]) > steady.DRIFT
    for case in Case:
        own = of["case"] == case
        if own.any():
            look: dict[str, Any] = {"color": style.COLOURS[case], "label": case.name}
            y, bars = of["omega_c"][own], of["omega_c_uncertainty"][own]
            axes.errorbar(x[own], y, bars, fmt="o", ms=4, **look)
    if off.any():
        ring = f"not settled: {off.sum()}"
        axes.plot(x[off], of["omega_c"][off], "o", ms=8, mfc="none", color="black", label=ring)
    axes.set(xlabel=label, ylabel=f"{style.symbol('omega_c')} (rad/s)")
    axes.grid(alpha=0.3)
    style.legend(axes)
    some = range(0, len(x), math.ceil(len(x) / DOUBTED))
    drawing.warn_of(figure, max(real_fluid.model_error(_parameters(of, k)) for k in some))
    return figure


def _parameters(of: Columns, k: int) -> Parameters:
    names = (f.name for f in dataclasses.fields(Parameters))
    return Parameters(**{name: of[name][k : k + 1].tolist()[0] for name in names})


def describe(of: Columns) -> dict[str, Any]:
    """What a collection or batch holds: names of runs, engines, failures, the range of every
    column, JSON-able."""
    counts, floats = Counter(of["case"].tolist()), [n for n in of if of[n].dtype.kind == "f"]
    finite = {name: of[name][np.isfinite(of[name])] for name in floats}
    off = steady.share(of["omega_c"], of["omega_c_uncertainty"], of["omega_0"])
    return {
        "runs": len(of["run"]),
        "names": of["run"].tolist(),
        "engines": sorted(set(of["engine"].tolist())),
        "cases": {case.name: counts[case] for case in Case if counts[case]},
        "unsettled": int((off > steady.DRIFT).sum()),
        "drift": float(np.nanmax(off, initial=0.0)),
        "failures": [text for text in of["failure"].tolist() if text],
        "drag": sorted(set(of["drag"].tolist())),
        "varied": varied_parameters(of),
        "ranges": {name: [float(v.min()), float(v.max())] for name, v in finite.items() if len(v)},
    }


def unsettled(about: dict[str, Any]) -> str:
    """Says of what `describe` gives how many runs haven't settled; empty if all have."""
    if not about["unsettled"]:
        return ""
    return (
        f"{about['unsettled']} of {about['runs']} runs have not settled: their omega_c may change "
        f"by up to {steady.percent(about['drift'])} % yet"
    )


def shown(about: dict[str, Any]) -> Table:
    """What `describe` gives as a table for the terminal."""
    ranges, names = about["ranges"], about["names"]
    more = f"\n… and {len(names) - NAMED} more" if len(names) > NAMED else ""
    rows = {
        "runs": f"{about['runs']} ({', '.join(about['engines'])}), {len(about['failures'])} failed",
        "named": "\n".join(names[:NAMED]) + more,
        "cases": ", ".join(f"{name}: {count}" for name, count in about["cases"].items()),
        "varied": "\n".join(
            "{} {:g} … {:g}".format(n, *ranges[n]) for n in about["varied"] if n != "drag"
        ),
        "drag": ", ".join(about["drag"]),
        "settled": unsettled(about) or "all runs",
        "omega_c": "{:.9g} … {:.9g} rad s-1".format(*ranges.get("omega_c", [np.nan, np.nan])),
    }
    return pages.pairs(rows)
