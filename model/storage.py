"""The HDF5 form of a trajectory: one run a file, flat, whole or not there at all.

`TrajectoryWriter` appends blocks of samples while a simulation runs, to a temporary name that becomes the final one
only when the file is whole. `load` trusts nothing it reads: links that lead out of the file are refused, and so is
a file that is cut short, foreign, or written by a newer version.
"""

from __future__ import annotations

import dataclasses
import functools
import io
import json
import os
import re
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5py
import numpy as np
import numpy.typing as npt

from model.cases import Case
from model.errors import InputError, StorageError
from model.files import WholeFile
from model.flow import Flow
from model.parameters import Parameters
from model.trajectory import AXES, SAMPLE, Events, Header, Trajectory, columns

SCHEMA = "dualball-trajectory"
SCHEMA_VERSION = 1

_CHUNK = 1024
_CASE_ENUM = h5py.enum_dtype({case.name: case.value for case in Case}, basetype=np.int8)
_TEXT = h5py.string_dtype()


def save(trajectory: Trajectory, path: str | Path) -> None:
    """Write a whole trajectory; raises `StorageError` if that can't be done, leaving nothing behind."""
    samples = np.empty(len(trajectory.time), SAMPLE)
    for name in columns(Trajectory):
        samples[name] = getattr(trajectory, name)
    with TrajectoryWriter(path, trajectory.header) as writer:
        writer.append(samples)
        writer.finish(trajectory.events, trajectory.header.failure)


class TrajectoryWriter:
    """Writes a trajectory block by block; use as a context manager and call `finish` at the end.

    Leaving the context without `finish` removes the temporary file, so that `path` exists only when it is whole.
    Every method raises `StorageError`, in one line, when the file can't be written (no such directory, no
    permission, disk full).
    """

    def __init__(self, path: str | Path, header: Header) -> None:
        self._whole = WholeFile(path, _empty())
        self._file = self._whole.file
        try:
            for name, text in _header_attributes(header).items():
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
            dataset = self._file[name]
            n = dataset.shape[0]
            dataset.resize(n + len(samples), axis=0)
            dataset[n:] = samples[name]
        self._whole.flush()

    def finish(self, events: Events, failure: str = "", path: str | Path | None = None) -> None:
        """Write the events and why the run stopped early, if it did; then give the file its name, or `path`."""
        for name in columns(Events):
            values = getattr(events, name)
            dataset = self._file[_event_name(name)]
            dataset.resize(len(values), axis=0)
            dataset[...] = values
        self._file.attrs["failure"] = failure
        self._whole.finish(path)


@functools.cache
def _empty() -> bytes:
    """A trajectory file without samples and header: the same for all, and most of the work of making one."""
    content = io.BytesIO()
    with h5py.File(content, "w", track_order=True) as file:
        file.attrs["schema"] = SCHEMA
        file.attrs["schema_version"] = SCHEMA_VERSION
        axis = file.create_dataset("axis", data=np.array(AXES, dtype="S1"))
        _describe(axis, {"units": "1", "long_name": "axes of the co-rotating frame: x inwards, y up, z along"})
        axis.make_scale("axis")
        for table, scale_name, rename in ((Trajectory, "time", str), (Events, "event_time", _event_name)):
            for name, meta in columns(table).items():
                dataset = _create_column(file, rename(name), meta)
                if rename(name) == scale_name:
                    dataset.make_scale(scale_name)
                else:
                    dataset.dims[0].attach_scale(file[scale_name])
                if meta["shape"]:
                    dataset.dims[1].attach_scale(axis)
    return content.getvalue()


def _create_column(file: h5py.File, name: str, meta: Mapping[str, Any]) -> h5py.Dataset:
    shape = meta["shape"]
    dataset = file.create_dataset(
        name, (0, *shape), _CASE_ENUM if meta.get("dtype") is np.int8 else np.float64,
        maxshape=(None, *shape), chunks=(_CHUNK, *shape), compression="gzip", shuffle=True,
    )  # fmt: skip
    _describe(dataset, meta)
    return dataset


def load(path: str | Path, part: slice = slice(None)) -> Trajectory:
    """Read a trajectory, or a part of its samples: memory then depends on that part alone.

    Raises `StorageError`, in one line, for a file that isn't one or isn't whole.
    """
    if not Path(path).is_file():
        raise StorageError(f"cannot read {path}: there is no such file")
    try:
        with h5py.File(path, "r") as file:
            header = _read_header(file, path)
            samples = {name: _read_column(file, name, meta, path, part) for name, meta in columns(Trajectory).items()}
            events = {name: _read_column(file, _event_name(name), meta, path) for name, meta in columns(Events).items()}
    except StorageError:
        raise
    except InputError as error:
        raise StorageError(f"{path}: {error}") from error
    except (OSError, RuntimeError, KeyError, ValueError, TypeError, MemoryError) as error:
        raise StorageError(f"{path} is not a whole HDF5 file: {_reason(error)}") from error
    for table in (samples, events):
        lengths = {name: len(values) for name, values in table.items()}
        if len(set(lengths.values())) > 1:
            raise StorageError(f"{path} is not whole: its columns differ in length ({lengths})")
    codes = np.concatenate([samples["case"], events["from_case"], events["to_case"]])
    if not np.isin(codes, list(Case)).all():
        raise StorageError(f"{path} holds a case that does not exist")
    return Trajectory(header=header, events=Events(**events), **samples)


def _header_attributes(header: Header) -> dict[str, str]:
    return {
        "engine": header.engine,
        "parameters": json.dumps(dataclasses.asdict(header.parameters)),
        "flow": json.dumps(header.flow.to_mapping()),
        "settings": json.dumps(dict(header.settings)),
        "versions": json.dumps(dict(header.versions)),
        "commit": header.commit,
        "created": header.created,
        "failure": header.failure,
    }


def _read_header(file: h5py.File, path: str | Path) -> Header:
    schema, version = file.attrs.get("schema"), file.attrs.get("schema_version")
    if schema != SCHEMA:
        raise StorageError(f"{path} is an HDF5 file, but not a {SCHEMA}")
    if not isinstance(version, (int, np.integer)) or version < 1:
        raise StorageError(f"{path} has no valid schema version: {version!r}")
    if version > SCHEMA_VERSION:
        raise StorageError(
            f"{path} was written by a newer dualball: its schema version is {version}, this program reads up to "
            f"{SCHEMA_VERSION}"
        )
    text = {name: _text(file, name, path) for name in _ATTRIBUTES}
    parsed = {name: _json(text[name], name, path) for name in ("parameters", "flow", "settings", "versions")}
    return Header(
        engine=text["engine"],
        parameters=Parameters.from_mapping(parsed["parameters"]),
        flow=Flow.from_mapping(parsed["flow"]),
        settings=parsed["settings"],
        mjcf=_dataset(file, "mjcf", path).asstr()[()],
        failure=text["failure"],
        versions=parsed["versions"],
        commit=text["commit"],
        created=text["created"],
    )


_ATTRIBUTES = ("engine", "parameters", "flow", "settings", "versions", "commit", "created", "failure")


def _text(file: h5py.File, name: str, path: str | Path) -> str:
    value = file.attrs.get(name)
    if not isinstance(value, str):
        raise StorageError(f"{path} is not whole: its attribute {name!r} is missing")
    return value


def _json(text: str, name: str, path: str | Path) -> dict[str, Any]:
    try:
        value = json.loads(text)
    except (json.JSONDecodeError, RecursionError) as error:
        raise StorageError(f"{path} is not whole: its attribute {name!r} is not JSON") from error
    if not isinstance(value, dict):
        raise StorageError(f"{path} is not whole: its attribute {name!r} is not a table")
    return value


def _dataset(file: h5py.File, name: str, path: str | Path) -> h5py.Dataset:
    """The dataset of that name, stored in this very file: links out of it are not followed."""
    if not isinstance(file.get(name, getlink=True), h5py.HardLink):
        raise StorageError(f"{path} is not whole: it has no dataset {name!r} of its own")
    dataset = file[name]
    if not isinstance(dataset, h5py.Dataset) or dataset.external or dataset.is_virtual:
        raise StorageError(f"{path} is not whole: {name!r} is not a dataset of its own")
    return dataset


def _read_column(
    file: h5py.File, name: str, meta: Mapping[str, Any], path: str | Path, part: slice = slice(None)
) -> npt.NDArray[Any]:
    dataset = _dataset(file, name, path)
    if dataset.shape is None or dataset.shape[1:] != meta["shape"] or len(dataset.shape) != 1 + len(meta["shape"]):
        raise StorageError(f"{path} is not whole: {name!r} has shape {dataset.shape}")
    dtype = meta.get("dtype", np.float64)
    if dataset.dtype.kind != np.dtype(dtype).kind:
        raise StorageError(f"{path} is not whole: {name!r} has type {dataset.dtype}")
    return np.asarray(dataset[part], dtype=dtype)


def _describe(dataset: h5py.Dataset, meta: Mapping[str, Any]) -> None:
    for key in ("units", "long_name", "equation"):
        if meta.get(key):
            dataset.attrs[key] = meta[key]
    if meta.get("dtype") is np.int8:  # the CF convention's names of the codes, for readers that drop the HDF5 enum
        dataset.attrs["flag_values"] = np.array([case.value for case in Case], np.int8)
        dataset.attrs["flag_meanings"] = " ".join(case.name for case in Case)


def _event_name(column: str) -> str:
    return "event_" + column.removesuffix("_case")


def _reason(error: BaseException) -> str:
    """What went wrong as a person would say it, from an error of Python or of the HDF5 library."""
    text = str(error).strip() or type(error).__name__
    number = re.search(r"errno = (\d+)", text)  # HDF5 hides the operating system's reason in a long sentence
    if number:
        return os.strerror(int(number[1]))
    if "truncated file" in text:
        return "it is cut short"
    if "signature not found" in text:
        return "it is in another format"
    return error.strerror if isinstance(error, OSError) and error.strerror else text.splitlines()[0]
