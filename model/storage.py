"""The HDF5 form of trajectories, flat and whole: one run a file, or the runs of a batch in one.

`save_batch` writes many short runs along a dimension ``run`` where each has a name: ``FILE/NAME``
is read as if it were a file of its own. Readers trust nothing: links that lead out of the file are
refused, and so is a file that is damaged, foreign, or written by a newer version."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

from model.cases import Case
from model.errors import StorageError, check_type
from model.flow import Flow
from model.hdf5 import dataset, reading, writing
from model.parameters import Parameters
from model.trajectory import (
    AXES,
    AXIS_ATTRIBUTES,
    CONVENTIONS,
    FLUID,
    SCHEMA,
    SCHEMA_VERSION,
    Events,
    Header,
    Tabular,
    Trajectory,
    attributes,
    columns,
)
from model.versions import current_versions

BATCH, BATCH_VERSION = "dualball-batch", 1
"""What a file of many runs says of itself."""
_CASE_ENUM = h5py.enum_dtype({case.name: case.value for case in Case}, basetype=np.int8)
_TEXT = h5py.string_dtype()
_PACKED = {"compression": "gzip", "shuffle": True}


def save(run: Trajectory, path: str | Path) -> None:
    """Write a run; raises `StorageError` if that can't be done, leaving nothing behind."""
    check_type("run", run, Trajectory)
    with writing(path) as file:
        scales = _write_common(file, SCHEMA, SCHEMA_VERSION)
        file.attrs.update(run.header.attributes())
        file.create_dataset("mjcf", data=run.header.mjcf, dtype=_TEXT)
        for table, time in ((run, "time"), (run.events, "event_time")):
            for name, meta in _stored_columns(type(table)).items():
                values, shape = getattr(table, name), meta["shape"]
                layout = {"maxshape": (None, *shape), "chunks": (1024, *shape), **_PACKED}
                _create_column(file, meta, (time, "axis"), scales, data=values, **layout)


def save_batch(runs: Mapping[str, Trajectory], path: str | Path) -> None:
    """Write runs by name into one file; raises `StorageError`, leaving nothing behind.

    Columns have shape (run, sample, ...) and (run, event, ...); behind the samples and events that
    a run has they are filled with nan, and cases with -1. What a file of one run says in attributes
    is JSON in `header` (run)."""
    with writing(path) as file:
        scales = _write_common(file, BATCH, BATCH_VERSION)
        title = f"Motions of dual-point contact balls: {len(runs)} runs"
        file.attrs.update(Conventions=CONVENTIONS, title=title)
        file.attrs["versions"] = json.dumps(dict(current_versions()))
        scales["run"] = file.create_dataset("run", data=list(runs), dtype=_TEXT)
        scales["run"].make_scale("run")
        abouts = (run.header for run in runs.values())
        headers = [json.dumps(each.attributes() | {"mjcf": each.mjcf}) for each in abouts]
        file.create_dataset("header", data=headers, dtype=_TEXT).dims[0].attach_scale(scales["run"])
        for dimension, of in (("sample", Trajectory), ("event", Events)):
            tables: list[Any] = [run.events if of is Events else run for run in runs.values()]
            counts = [len(table.time) for table in tables]
            file.create_dataset(f"{dimension}s", data=counts).dims[0].attach_scale(scales["run"])
            scales[dimension] = file.create_dataset(dimension, data=np.arange(max(counts)))
            scales[dimension].make_scale(dimension)
            for name, meta in _stored_columns(of).items():
                empty = -1 if meta["dtype"] is np.int8 else np.nan
                values = np.full((len(runs), max(counts), *meta["shape"]), empty, meta["dtype"])
                for row, count, table in zip(values, counts, tables, strict=True):
                    row[:count] = getattr(table, name)
                sizes = {"compression_opts": 1, **_PACKED} if values.size else {}
                names = ("run", dimension, "axis")
                _create_column(file, meta, names, scales, data=values, **sizes)


def load(path: str | Path) -> Trajectory:
    """Read a trajectory from a file, or from one of many as ``FILE/NAME``.

    Raises `StorageError`, in one line, for a file that isn't one or is damaged."""
    path = Path(path)
    if not path.parent.is_file():
        with reading(path) as file:
            return _read(file)
    try:
        return load_runs(path.parent)[path.name]
    except KeyError as error:
        none = f"{path.parent} holds no run of that name"
        raise StorageError(f"cannot read {path}: {none}") from error


def contents(path: str | Path) -> tuple[str, list[str]]:
    """The version of dualball that wrote a file, and the names of its runs; none of a single run.

    Raises `StorageError` as `load` does."""
    with reading(path) as file:
        version = str(_attribute(file.attrs, "versions", dict).get("dualball"))
        return version, dataset(file, "run").asstr()[...].tolist() if "run" in file else []


def exists(path: str | Path) -> bool:
    """Whether there is a file of a run, be it one of many."""
    return Path(path).is_file() or Path(path).parent.is_file()


def load_runs(path: str | Path) -> dict[str, Trajectory]:
    """Runs of a file by name, which of a single one is empty. Raises `StorageError` as `load`."""
    with reading(path) as file:
        if file.attrs.get("schema") != BATCH:
            return {"": _read(file)}
        _check_schema(file, BATCH, BATCH_VERSION)
        names, headers = (dataset(file, name).asstr()[...].tolist() for name in ("run", "header"))
        counts = (dataset(file, name)[...].tolist() for name in ("samples", "events"))
        tables = _table(file, Trajectory, 2), _table(file, Events, 2)
        runs = {}
        for k, (name, header, *sizes) in enumerate(zip(names, headers, *counts, strict=True)):
            own = (
                {c: each[k, :n].copy() for c, each in table.items()}
                for table, n in zip(tables, sizes, strict=True)
            )
            runs[name] = _trajectory(_attribute({"header": header}, "header", dict), *own)
        return runs


def _write_common(file: h5py.File, schema: str, version: int) -> dict[str, h5py.Dataset]:
    """Write schema and axes, which all files have; return the dimension scales by name."""
    file.attrs.update(schema=schema, schema_version=version)
    axis = file.create_dataset("axis", data=AXES, dtype=_TEXT)
    axis.attrs.update(AXIS_ATTRIBUTES)
    axis.make_scale("axis")
    return {"axis": axis}


def _stored_columns(of: Tabular) -> dict[str, Mapping[str, Any]]:
    """The columns of a table, with the flow, which isn't read back."""
    return columns(of) | ({"omega_0": FLUID} if of is Trajectory else {})


def _create_column(
    file: h5py.File,
    meta: Mapping[str, Any],
    dimensions: Sequence[str],
    scales: dict[str, h5py.Dataset],
    **layout: Any,
) -> None:
    """Create a column along these dimensions; it becomes the scale of one that has none yet."""
    column = file.create_dataset(
        meta["name"], dtype=_CASE_ENUM if meta["dtype"] is np.int8 else np.float64, **layout
    )
    column.attrs.update(attributes(meta))
    for dimension, scale in zip(column.dims, dimensions, strict=False):
        if scale in scales:
            dimension.attach_scale(scales[scale])
        else:
            scales[scale] = column
            column.make_scale(scale)


def _read(file: h5py.File) -> Trajectory:
    """Read a file of one run."""
    if file.attrs.get("schema") == BATCH:
        raise StorageError("it holds the runs of a batch: name one of them, as FILE/NAME")
    _check_schema(file, SCHEMA, SCHEMA_VERSION)
    texts = dict(file.attrs) | {"mjcf": dataset(file, "mjcf").asstr()[()]}
    return _trajectory(texts, _table(file, Trajectory, 1), _table(file, Events, 1))


def _check_schema(file: h5py.File, name: str, newest: int) -> None:
    """Raise `StorageError` unless a file is of the schema `name`, in a version up to `newest`."""
    schema, version = file.attrs.get("schema"), file.attrs.get("schema_version")
    if schema != name:
        raise StorageError(f"it is an HDF5 file, but not a {name}")
    if not isinstance(version, (int, np.integer)) or version < 1:
        raise StorageError(f"it has no valid schema version: {version!r}")
    if version > newest:
        other = f"its schema version is {version}, this program reads up to {newest}"
        raise StorageError(f"it was written by a newer dualball: {other}")


def _trajectory(
    texts: Mapping[str, Any],
    samples: Mapping[str, npt.NDArray[Any]],
    events: Mapping[str, npt.NDArray[Any]],
) -> Trajectory:
    """A run from the texts of its header and its columns."""
    tables = ("parameters", "flow", "settings", "versions")
    values = {f.name: _attribute(texts, f.name, str) for f in dataclasses.fields(Header)}
    values |= {name: _attribute(texts, name, dict) for name in tables}
    values["parameters"] = Parameters.from_mapping(values["parameters"])
    values["flow"] = Flow.from_mapping(values["flow"])
    codes = np.concatenate([samples["case"], events["from_case"], events["to_case"]])
    if not np.isin(codes, list(Case)).all():
        raise StorageError("it holds a case that does not exist")
    return Trajectory(header=Header(**values), events=Events(**events), **samples)


def _attribute(texts: Mapping[str, Any], name: str, kind: type) -> Any:
    """The attribute `name` of a file: a str, or a dict from JSON; else raises `StorageError`."""
    value = texts.get(name)
    if not isinstance(value, str):
        raise StorageError(f"its attribute {name!r} is missing")
    if kind is str:
        return value
    try:
        value = json.loads(value)
    except (json.JSONDecodeError, RecursionError) as error:
        raise StorageError(f"its attribute {name!r} is not JSON") from error
    if not isinstance(value, dict):
        raise StorageError(f"its attribute {name!r} is not a table")
    return value


def _table(file: h5py.File, of: Tabular, leading: int) -> dict[str, npt.NDArray[Any]]:
    """Read and check all columns of a table of `leading` dimensions before those of one entry."""
    values = {}
    for column, meta in columns(of).items():
        name, stored, shape = meta["name"], dataset(file, meta["name"]), meta["shape"]
        if len(stored.shape or ()) != leading + len(shape) or stored.shape[leading:] != shape:
            raise StorageError(f"{name!r} has shape {stored.shape}")
        if stored.dtype.kind != np.dtype(meta["dtype"]).kind:
            raise StorageError(f"{name!r} has type {stored.dtype}")
        values[column] = np.asarray(stored[...], dtype=meta["dtype"])
    lengths = {name: column.shape[:leading] for name, column in values.items()}
    if len(set(lengths.values())) > 1:
        raise StorageError(f"its columns differ in length ({lengths})")
    return values
