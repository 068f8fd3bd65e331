"""HDF5 files that are complete or absent, and read only if nothing in them has changed.

Each ends with the SHA-256 checksum of all that comes before, which HDF5 itself ignores. It is
compared before HDF5 looks at the file: on damaged metadata the library may hang, and give wrong
numbers."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt

from model.errors import InputError, StorageError
from model.files import why_no_file, write_bytes

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_SEAL = b"\ndualball sha256 "
_TRAILER = len(_SEAL) + 64
_DAMAGE = (
    *(OSError, RuntimeError, LookupError, ValueError, TypeError),
    *(AttributeError, ArithmeticError, MemoryError),
)
"""What reading a file that does not hold what it should may end in."""


@contextmanager
def writing(path: str | Path) -> Iterator[h5py.File]:
    """A new HDF5 file to fill; as the context ends it is written, with its checksum.

    Until then it is in memory: HDF5 1.14 crashes the process where a disk fills. Raises
    `StorageError`, in one line, when it can't be written."""
    content = io.BytesIO()
    with h5py.File(content, "w", track_order=True) as file:
        yield file
    write_bytes(Path(path), sealed(content.getvalue()))


def sealed(content: bytes) -> bytes:
    """The content of an HDF5 file with its checksum."""
    return content + _SEAL + hashlib.sha256(content).hexdigest().encode()


@contextmanager
def reading(path: str | Path, ours: bool = True) -> Iterator[h5py.File]:
    """An HDF5 file of `writing`, open for reading; or any, without a checksum, if not `ours`.

    Raises `StorageError`, in one line that names the file, if it is missing, damaged, cut, changed,
    or foreign; an `InputError` or error of HDF5 within the context becomes one, too."""
    try:
        if why := why_no_file(path):
            raise StorageError(why)
        with Path(path).open("rb") as stored:
            content = stored.read(-1 if ours else len(_SIGNATURE))
        if not content.startswith(_SIGNATURE):
            raise StorageError("it is not an HDF5 file")
        if ours and content[-_TRAILER:-64] != _SEAL:
            why = "cut short, changed, or not of this program (no checksum at its end)"
            raise StorageError(f"it is {why}")
        if ours and content != sealed(content[:-_TRAILER]):
            raise StorageError("it is damaged (its content does not match its checksum)")
        with h5py.File(path, "r") as file:
            yield file
    except _DAMAGE as error:
        reason = (str(error).strip() or type(error).__name__).splitlines()[0]
        if isinstance(error, OSError):
            reason = error.strerror or reason
            if "synchronously" in reason:  # the library tells its own functions
                reason = "HDF5 finds it damaged"
        elif not isinstance(error, InputError):
            reason = f"it does not hold what it should ({reason})"
        raise StorageError(f"cannot read {path}: {reason}") from error


def dataset(file: h5py.File, name: str) -> h5py.Dataset:
    """The dataset of that name, stored in this very file: links out of it are not followed.

    Raises `StorageError`, for `reading` to add the name of the file."""
    if not isinstance(file.get(name, getlink=True), h5py.HardLink):
        raise StorageError(f"it has no dataset {name!r} of its own")
    stored = file[name]
    if not isinstance(stored, h5py.Dataset) or stored.external or stored.is_virtual:
        raise StorageError(f"{name!r} is not a dataset of its own")
    return stored


def column(stored: h5py.Dataset) -> npt.NDArray[Any]:
    """Read all of a dataset: numbers, or text as `str`."""
    return np.asarray((stored.asstr() if h5py.check_string_dtype(stored.dtype) else stored)[...])


def write_columns(
    file: h5py.File, columns: Mapping[str, Sequence[Any] | npt.NDArray[Any]], *scales: str
) -> dict[str, h5py.Dataset]:
    """Write columns of numbers or text; the first, `scales`, are the scales of the others."""
    written: dict[str, h5py.Dataset] = {}
    for name, values in columns.items():
        if np.size(values) and isinstance(np.ravel(values)[0], str):
            text, kind = np.asarray(values, object), h5py.string_dtype()
            written[name] = file.create_dataset(name, data=text, dtype=kind)
        else:
            written[name] = file.create_dataset(name, data=values)
        if name in scales:
            written[name].make_scale(name)
        else:
            for dimension, scale in zip(written[name].dims, scales, strict=True):
                dimension.attach_scale(written[scale])
    return written
