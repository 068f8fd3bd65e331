"""The HDF5 form of a trajectory: one run a file, flat, whole or not there at all.

`TrajectoryWriter` appends blocks of samples while a simulation runs, to a temporary name that becomes the final one
only when the file is whole. `save` writes a short trajectory at once, into the bytes of an empty file of its length:
campaigns write thousands of those. `load` and `parts` trust nothing they read: links that lead out of the file are
refused, and so is a file that is damaged, foreign, or written by a newer version.
"""

from __future__ import annotations

import dataclasses
import functools
import io
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5py
import numpy as np
import numpy.typing as npt

from model.cases import Case
from model.errors import StorageError
from model.files import WholeFile, dataset, reading
from model.flow import Flow
from model.parameters import Parameters
from model.trajectory import (
    AXES,
    AXIS_ATTRIBUTES,
    SAMPLE,
    SCHEMA,
    SCHEMA_VERSION,
    Events,
    Header,
    Trajectory,
    attributes,
    columns,
    event_name,
)

_CHUNK = 1024
_AT_ONCE = 4096
"""Most samples that are stored without chunks and compression: those pay from there on."""
_CASE_ENUM = h5py.enum_dtype({case.name: case.value for case in Case}, basetype=np.int8)
_TEXT = h5py.string_dtype()


def save(trajectory: Trajectory, path: str | Path) -> None:
    """Write a whole trajectory; raises `StorageError` if that can't be done, leaving nothing behind."""
    count = len(trajectory.time)
    content, places = _empty(count if count <= _AT_ONCE else None)
    image = bytearray(content)
    for name, place in places.items():
        values = np.ascontiguousarray(getattr(trajectory, name)).tobytes()
        image[place : place + len(values)] = values
    with TrajectoryWriter(path, trajectory.header, bytes(image)) as writer:
        if not places:
            samples = np.empty(count, SAMPLE)
            for name in columns(Trajectory):
                samples[name] = getattr(trajectory, name)
            writer.append(samples)
        writer.finish(trajectory.events, trajectory.header.failure)


class TrajectoryWriter:
    """Writes a trajectory block by block; use as a context manager and call `finish` at the end.

    Leaving the context without `finish` removes the temporary file, so that `path` exists only when it is whole.
    Every method raises `StorageError`, in one line, when the file can't be written (no such directory, no
    permission, disk full). `template` is an empty file of another layout than that of many samples.
    """

    def __init__(self, path: str | Path, header: Header, template: bytes = b"") -> None:
        self._whole = WholeFile(path, template or _empty(None)[0])
        self._file = self._whole.file
        try:
            for name, text in header.attributes().items():
                self._file.attrs[name] = text
            self._file.create_dataset("mjcf", data=header.mjcf, dtype=_TEXT)
            self._whole.flush()
        except BaseException as error:
            self.__exit__(type(error), error, error.__traceback__)
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._whole.__exit__(kind, error, traceback)

    def append(self, samples: npt.NDArray[np.void]) -> None:
        """Add a block of samples, a structured array of dtype `model.trajectory.SAMPLE`, and flush it."""
        for name in columns(Trajectory):
            column = self._file[name]
            n = column.shape[0]
            column.resize(n + len(samples), axis=0)
            column[n:] = samples[name]
        self._whole.flush()

    def finish(self, events: Events, failure: str = "", path: str | Path | None = None) -> None:
        """Write the events and why the run stopped early, if it did; then give the file its name, or `path`."""
        for name in columns(Events) if len(events) else ():
            column = self._file[event_name(name)]
            column.resize(len(events), axis=0)
            column[...] = getattr(events, name)
        self._file.attrs["failure"] = failure
        self._whole.finish(path)


@functools.lru_cache(32)
def _empty(count: int | None) -> tuple[bytes, Mapping[str, int]]:
    """A trajectory file without header, for any number of samples, or `count` that are all zero.

    The same for all, and most of the work of making one. Also where the numbers of each such column begin.
    """
    content = io.BytesIO()
    with h5py.File(content, "w", track_order=True) as file:
        file.attrs["schema"] = SCHEMA
        file.attrs["schema_version"] = SCHEMA_VERSION
        axis = file.create_dataset("axis", data=AXES, dtype=_TEXT)
        axis.attrs.update(AXIS_ATTRIBUTES)
        axis.make_scale("axis")
        for name, meta in columns(Trajectory).items():
            _create_column(file, name, meta, "time", count)
        for name, meta in columns(Events).items():
            _create_column(file, event_name(name), meta, "event_time")
        places = {} if not count else {name: file[name].id.get_offset() for name in columns(Trajectory)}
    return content.getvalue(), places


def _create_column(file: h5py.File, name: str, meta: Mapping[str, Any], scale: str, count: int | None = None) -> None:
    shape, dtype = meta["shape"], _CASE_ENUM if meta["dtype"] is np.int8 else np.float64
    if count:
        column = file.create_dataset(name, data=np.zeros((count, *shape), dtype), dtype=dtype)
    else:
        layout = {"maxshape": (None, *shape), "chunks": (_CHUNK, *shape), "compression": "gzip", "shuffle": True}
        column = file.create_dataset(name, (0, *shape), dtype, **layout)
    column.attrs.update(attributes(meta))
    if name == scale:
        column.make_scale(scale)
    else:
        column.dims[0].attach_scale(file[scale])
    if shape:
        column.dims[1].attach_scale(file["axis"])


def load(path: str | Path) -> Trajectory:
    """Read a trajectory.

    Raises `StorageError`, in one line, for a file that isn't one or is damaged.
    """
    with reading(path) as file:
        return _read(file, slice(None))


def parts(path: str | Path, size: int) -> Iterator[Trajectory]:
    """Read a trajectory `size` samples at a time, so that it may be larger than memory; at least one part.

    Each part has the header and all events. Raises `StorageError` as `load` does.
    """
    with reading(path) as file:
        for start in range(0, max(len(dataset(file, "time")), 1), size):
            yield _read(file, slice(start, start + size))


def _read(file: h5py.File, part: slice) -> Trajectory:
    header = _read_header(file)
    samples = {name: _read_column(file, name, meta, part) for name, meta in columns(Trajectory).items()}
    events = {name: _read_column(file, event_name(name), meta) for name, meta in columns(Events).items()}
    for table in (samples, events):
        lengths = {name: len(values) for name, values in table.items()}
        if len(set(lengths.values())) > 1:
            raise StorageError(f"its columns differ in length ({lengths})")
    codes = np.concatenate([samples["case"], events["from_case"], events["to_case"]])
    if not np.isin(codes, list(Case)).all():
        raise StorageError("it holds a case that does not exist")
    return Trajectory(header=header, events=Events(**events), **samples)


def _read_header(file: h5py.File) -> Header:
    schema, version = file.attrs.get("schema"), file.attrs.get("schema_version")
    if schema != SCHEMA:
        raise StorageError(f"it is an HDF5 file, but not a {SCHEMA}")
    if not isinstance(version, (int, np.integer)) or version < 1:
        raise StorageError(f"it has no valid schema version: {version!r}")
    if version > SCHEMA_VERSION:
        raise StorageError(
            f"it was written by a newer dualball: its schema version is {version}, this program reads up to "
            f"{SCHEMA_VERSION}"
        )
    values: dict[str, Any] = {f.name: _text(file, f.name) for f in dataclasses.fields(Header) if f.name != "mjcf"}
    values |= {name: _json(values[name], name) for name in ("parameters", "flow", "settings", "versions")}
    values["parameters"] = Parameters.from_mapping(values["parameters"])
    values["flow"] = Flow.from_mapping(values["flow"])
    return Header(**values, mjcf=dataset(file, "mjcf").asstr()[()])


def _text(file: h5py.File, name: str) -> str:
    value = file.attrs.get(name)
    if not isinstance(value, str):
        raise StorageError(f"its attribute {name!r} is missing")
    return value


def _json(text: str, name: str) -> dict[str, Any]:
    try:
        value = json.loads(text)
    except (json.JSONDecodeError, RecursionError) as error:
        raise StorageError(f"its attribute {name!r} is not JSON") from error
    if not isinstance(value, dict):
        raise StorageError(f"its attribute {name!r} is not a table")
    return value


def _read_column(file: h5py.File, name: str, meta: Mapping[str, Any], part: slice = slice(None)) -> npt.NDArray[Any]:
    column = dataset(file, name)
    if column.shape is None or column.shape[1:] != meta["shape"] or len(column.shape) != 1 + len(meta["shape"]):
        raise StorageError(f"{name!r} has shape {column.shape}")
    if column.dtype.kind != np.dtype(meta["dtype"]).kind:
        raise StorageError(f"{name!r} has type {column.dtype}")
    return np.asarray(column[part], dtype=meta["dtype"])
