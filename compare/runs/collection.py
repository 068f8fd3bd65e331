"""Many runs in one file: what each settled to, over the parameters it ran with.

``collect`` writes one row a run: its parameters, and the mean, uncertainty and case over the last part of the run. The
file opens in xarray with the dimension ``run``, along which the parameters that vary are coordinates.
"""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt
from rich.table import Table

from compare import pages
from compare.statistics import settled_case, settled_mean
from model import Case, InputError, Parameters, StorageError, Trajectory, storage
from model.files import WholeFile, check_writable, dataset, reading
from model.kinematics import UNITS, VARIABLES

SCHEMA = "dualball-collection"
SCHEMA_VERSION = 1
NAMED = 5
"""Files that can't be gathered and are named one by one."""


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
            trajectory = storage.load(file)
        except StorageError as error:
            problems.append(str(error))
            continue
        if (first := known.setdefault(_identity(trajectory), file)) is not file:
            problems.append(f"{first} and {file} hold the same run")
        rows.append(_row(trajectory, file.relative_to(directory)))
    if problems:
        more = f"; and {len(problems) - NAMED} more" if len(problems) > NAMED else ""
        raise StorageError("; ".join(problems[:NAMED]) + more)
    if not rows:
        raise StorageError(f"there are no runs in {directory}")
    _write(rows, output)
    return len(rows)


def _identity(trajectory: Trajectory) -> str:
    """All that determines a run, as text."""
    header = dataclasses.asdict(dataclasses.replace(trajectory.header, created="", failure=""))
    header["flow"] = trajectory.header.flow.to_mapping()
    return json.dumps(header, sort_keys=True, default=dict)


def is_collection(path: Path) -> bool:
    """Whether a file is what `collect` writes; raises `StorageError` if it can't be read."""
    with reading(path) as file:
        return bool(file.attrs.get("schema") == SCHEMA)


def describe(path: Path) -> dict[str, Any]:
    """What a collection holds: number of runs, engines, failures, and the range of every column, JSON-able.

    Raises `StorageError` for a collection that is not whole or of a newer version.
    """
    with reading(path) as file:
        version = file.attrs.get("schema_version")
        if not isinstance(version, (int, np.integer)) or not 1 <= version <= SCHEMA_VERSION:
            raise StorageError(f"it is a collection of version {version!r}; this program reads {SCHEMA_VERSION}")
        return described({name: dataset(file, name)[...] for name in file})


def described(columns: dict[str, npt.NDArray[Any]]) -> dict[str, Any]:
    """As `describe`, for the columns of a collection by name; `drag` is missing in older ones."""
    numbers = {name: values for name, values in columns.items() if values.dtype.kind == "f"}
    failures = [text.decode() for text in columns["failure"] if text]
    codes, counts = np.unique(columns["case"], return_counts=True)
    finite = {name: values[np.isfinite(values)] for name, values in numbers.items()}
    return {
        "runs": len(columns["run"]),
        "engines": sorted({text.decode() for text in columns["engine"]}),
        "cases": {Case(code).name: int(count) for code, count in zip(codes, counts, strict=True) if code >= 0},
        "failures": failures,
        "drag": sorted({text.decode() for text in columns.get("drag", ())}),
        "varied": _varied(columns),
        "ranges": {name: [float(v.min()), float(v.max())] for name, v in finite.items() if len(v)},
    }


def _varied(columns: Mapping[str, Iterable[Any]]) -> list[str]:
    """Names of the parameters that are not the same in all runs."""
    names = [f.name for f in dataclasses.fields(Parameters) if f.name in columns]  # older files have no law of drag
    return [name for name in names if len(set(columns[name])) > 1]


def table(about: dict[str, Any]) -> Table:
    """The description for the terminal."""
    ranges = about["ranges"]
    rows = {
        "runs": f"{about['runs']} ({', '.join(about['engines'])}), {len(about['failures'])} failed",
        "cases": ", ".join(f"{name}: {count}" for name, count in about["cases"].items()),
        "varied": "\n".join("{} {:g} … {:g}".format(n, *ranges[n]) for n in about["varied"] if n != "drag"),
        "drag": ", ".join(about["drag"]),
        "omega_c": "{:.9g} … {:.9g} rad s-1".format(*ranges.get("omega_c", [np.nan, np.nan])),
    }
    return pages.pairs(rows)


def _row(trajectory: Trajectory, name: Path) -> dict[str, Any]:
    row: dict[str, Any] = {"run": str(name), "engine": trajectory.header.engine}
    row |= dataclasses.asdict(trajectory.header.parameters)
    row |= {"duration": float(trajectory.time[-1]) if len(trajectory.time) else 0.0}
    row |= {"failure": trajectory.header.failure}
    return row | _settled(trajectory)


def _settled(trajectory: Trajectory) -> dict[str, Any]:
    """Mean, standard uncertainty and prevailing case over the last part of a run; nan for a run too short for it."""
    row: dict[str, Any] = {}
    for name in VARIABLES:
        try:
            mean = settled_mean(trajectory, getattr(trajectory, name))
        except InputError:  # too few samples for a mean
            row |= {name: np.nan, f"{name}_uncertainty": np.nan}
        else:
            row |= {name: mean.value, f"{name}_uncertainty": mean.uncertainty}
    return row | {"case": int(settled_case(trajectory)) if len(trajectory.case) else -1}


def _write(rows: list[dict[str, Any]], output: Path) -> None:
    units = {f.name: f.metadata["unit"] for f in Parameters.quantities()}
    units |= dict(zip(VARIABLES, UNITS, strict=True)) | {"duration": "s"}
    units |= {f"{name}_uncertainty": unit for name, unit in zip(VARIABLES, UNITS, strict=True)}
    columns = {name: [row[name] for row in rows] for name in rows[0]}
    varied = _varied(columns)
    with WholeFile(output) as whole:
        whole.file.attrs["schema"], whole.file.attrs["schema_version"] = SCHEMA, SCHEMA_VERSION
        for name, values in columns.items():
            column = _column(whole.file, name, values, units.get(name, ""))
            if varied and name not in ("run", *varied):
                column.attrs["coordinates"] = " ".join(varied)  # the CF convention's way to say what it is over
        whole.finish()


def _column(file: h5py.File, name: str, values: Sequence[Any], units: str) -> h5py.Dataset:
    if isinstance(values[0], str):
        column = file.create_dataset(name, data=np.array(values, dtype=object), dtype=h5py.string_dtype())
    else:
        column = file.create_dataset(name, data=np.array(values))
    if units:
        column.attrs["units"] = units
    if name == "run":
        column.make_scale("run")
    else:
        column.dims[0].attach_scale(file["run"])
    return column
