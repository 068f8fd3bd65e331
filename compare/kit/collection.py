"""Many runs in one file: what each settled to, as a function of the parameters it ran with.

``collect`` writes one row a run: its parameters, and the mean, uncertainty and case over the last part of the run. The
file opens in xarray with the dimension ``run``, along which the parameters that vary are coordinates.
"""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt
from rich.table import Table

from compare.kit import pages
from compare.kit.statistics import settled_case, settled_mean
from model import Case, InputError, Parameters, StorageError, Trajectory, storage
from model.files import WholeFile, check_writable, dataset, reading
from model.kinematics import UNITS, VARIABLES

SCHEMA = "dualball-collection"
SCHEMA_VERSION = 1
NAMED = 5
"""Most files that can't be gathered, and most runs of a file, that are named one by one."""


def collect(directory: Path, output: Path) -> int:
    """Gather all runs of a directory, whole ones and failed ones, in the order of their names; return their number.

    Raises `StorageError` if there are none, the output can't be written, or, with their names, some can't be read or
    hold the same run twice.
    """
    check_writable(output)
    if not directory.is_dir():
        raise StorageError(f"cannot read {directory}: there is no such directory")
    rows, problems, known = [], [], dict[str, Path]()
    for file in sorted(directory.rglob("*.h5")):
        # The journal of a run that goes on, and the collection of the last time, are no runs.
        if file.parent.suffix == ".journal" or file.resolve() == output.resolve():
            continue
        try:
            runs = storage.load_runs(file)
        except StorageError as error:
            problems.append(str(error))
            continue
        for name, run in runs.items():
            header = dataclasses.asdict(dataclasses.replace(run.header, created="", failure=""))
            header["flow"] = run.header.flow.to_mapping()
            identity = json.dumps(header, sort_keys=True, default=dict)  # all that determines a run
            if (first := known.setdefault(identity, file / name)) != file / name:
                problems.append(f"{first} and {file / name} hold the same run")
            rows.append(_row(run, (file / name).relative_to(directory)))
    if problems:
        more = f"; and {len(problems) - NAMED} more" if len(problems) > NAMED else ""
        raise StorageError("; ".join(problems[:NAMED]) + more)
    if not rows:
        raise StorageError(f"there are no runs in {directory}")
    _write(rows, output)
    return len(rows)


def is_collection(path: Path) -> bool:
    """Whether a file holds many runs: a collection, or a batch of a campaign; raises `StorageError` if unreadable."""
    if path.parent.is_file():  # one run of a batch
        return False
    with reading(path) as file:
        return bool(file.attrs.get("schema") == SCHEMA) or storage.is_batch(file)


def describe(path: Path) -> dict[str, Any]:
    """What a collection or batch holds: names of runs, engines, failures, the range of every column, JSON-able.

    Raises `StorageError` for one that is not whole or of a newer version.
    """
    with reading(path) as file:
        if not storage.is_batch(file):
            version = file.attrs.get("schema_version")
            if not isinstance(version, (int, np.integer)) or not 1 <= version <= SCHEMA_VERSION:
                raise StorageError(f"it is a collection of version {version!r}; this program reads {SCHEMA_VERSION}")
            return described({name: dataset(file, name)[...] for name in file})
    rows = [_row(run, path / name) for name, run in storage.load_runs(path).items()]
    texts = {name for name, value in rows[0].items() if isinstance(value, str)}
    return described(
        {name: np.array([row[name].encode() if name in texts else row[name] for row in rows]) for name in rows[0]}
    )


def described(columns: dict[str, npt.NDArray[Any]]) -> dict[str, Any]:
    """As `describe`, for the columns of a collection by name; `drag` is missing in older ones."""
    numbers = {name: values for name, values in columns.items() if values.dtype.kind == "f"}
    failures = [text.decode() for text in columns["failure"] if text]
    codes, counts = np.unique(columns["case"], return_counts=True)
    finite = {name: values[np.isfinite(values)] for name, values in numbers.items()}
    # Older files have no law of drag.
    varied = [f.name for f in dataclasses.fields(Parameters) if len(set(columns.get(f.name, ()))) > 1]
    return {
        "runs": len(columns["run"]),
        "names": [text.decode() for text in columns["run"]],
        "engines": sorted({text.decode() for text in columns["engine"]}),
        "cases": {Case(code).name: int(count) for code, count in zip(codes, counts, strict=True) if code >= 0},
        "failures": failures,
        "drag": sorted({text.decode() for text in columns.get("drag", ())}),
        "varied": varied,
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
    """A run's parameters, and mean, standard uncertainty and prevailing case over its last part.

    Those are nan, and the case -1, for a run too short for them.
    """
    row: dict[str, Any] = {"run": str(name), "engine": trajectory.header.engine}
    row |= dataclasses.asdict(trajectory.header.parameters)
    row |= {"duration": float(trajectory.time[-1]) if len(trajectory.time) else 0.0}
    row |= {"failure": trajectory.header.failure}
    for variable in VARIABLES:
        try:
            mean = settled_mean(trajectory, getattr(trajectory, variable))
        except InputError:  # too few samples for a mean
            row |= {variable: np.nan, f"{variable}_uncertainty": np.nan}
        else:
            row |= {variable: mean.value, f"{variable}_uncertainty": mean.uncertainty}
    return row | {"case": int(settled_case(trajectory)) if len(trajectory.case) else -1}


def _write(rows: list[dict[str, Any]], output: Path) -> None:
    units = {f.name: f.metadata["unit"] for f in Parameters.quantities()}
    units |= dict(zip(VARIABLES, UNITS, strict=True)) | {"duration": "s"}
    units |= {f"{name}_uncertainty": unit for name, unit in zip(VARIABLES, UNITS, strict=True)}
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    varied = [f.name for f in dataclasses.fields(Parameters) if len(set(columns[f.name])) > 1]
    with WholeFile(output) as whole:
        whole.file.attrs["schema"], whole.file.attrs["schema_version"] = SCHEMA, SCHEMA_VERSION
        for name, values in columns.items():
            kind = h5py.string_dtype() if isinstance(values[0], str) else None
            column = whole.file.create_dataset(name, data=values, dtype=kind)
            if units.get(name):
                column.attrs["units"] = units[name]
            if name == "run":
                column.make_scale("run")
            else:
                column.dims[0].attach_scale(whole.file["run"])
            if varied and name not in ("run", *varied):
                column.attrs["coordinates"] = " ".join(varied)  # the CF convention's way to say what it is over
        whole.finish()
