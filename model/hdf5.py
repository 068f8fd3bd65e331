"""HDF5 files that are either complete or absent, and that are read only if nothing in them has
changed.

Each ends with the SHA-256 checksum of all that comes before, which HDF5 itself ignores. It is
compared before HDF5 looks at the file: on damaged metadata the library may hang, and give wrong
numbers."""

from __future__ import annotations

import hashlib
import io
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO, Self

import h5py
import numpy as np
import numpy.typing as npt

from model.errors import InputError, StorageError
from model.files import remove, temporary

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_SEAL = b"\ndualball sha256 "
_TRAILER = len(_SEAL) + 64
_BLOCK = 1 << 20
_DAMAGE = (
    OSError,
    RuntimeError,
    LookupError,
    ValueError,
    TypeError,
    AttributeError,
    ArithmeticError,
    MemoryError,
)
"""What reading a file that does not hold what it should may end in."""


class WholeFile:
    """An HDF5 file under construction; a context manager.

    It has a temporary name until `finish`; leaving the context without that removes it. ``file`` is
    the h5py file. Raises `StorageError`, in one line, when it can't be written (no such directory,
    no permission, disk full)."""

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        try:
            self._temporary = temporary(self.path)
            self._disk = _Disk(self._temporary, "w+b")
        except OSError as error:
            raise StorageError(f"cannot write {self.path}: {error.strerror}") from error
        self.file = h5py.File(self._disk, "w", track_order=True)
        self._finished = False

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *error: object) -> None:
        if not self._finished:
            # HDF5 misses what could not be written
            with suppress(*_DAMAGE if self._disk.error else ()):
                self.file.close()
            self._disk.close()
            remove(self._temporary)
            if kind and issubclass(kind, _DAMAGE):
                self._check()

    def flush(self) -> None:
        """Bring what was written to the disk."""
        self.file.flush()
        self._check()

    def finish(self, path: str | Path | None = None) -> None:
        """Close the file, add its checksum and give it its name, or another in the same
        directory."""
        self.file.close()
        self._check()
        try:
            seal(self._disk)
            self._check()
            os.fsync(self._disk.fileno())
            self._disk.close()
            self._temporary.replace(path or self.path)
        except OSError as error:
            raise StorageError(f"cannot write {self.path}: {error.strerror}") from error
        remove(self._temporary)
        self._finished = True

    def _check(self) -> None:
        """Raise `StorageError` if something could not be written."""
        if self._disk.error:
            raise StorageError(
                f"cannot write {self.path}: {self._disk.error.strerror}"
            ) from self._disk.error


class _Disk(io.FileIO):
    """A file that stores the first write error instead of raising it, and keeps what it could not
    write in memory.

    HDF5 neither closes a file that it could not write nor bears that what it wrote isn't there: it
    crashes the process (HDF5 1.14, disk full). So it is told that all is well, and `WholeFile`
    raises the error after each flush."""

    error: OSError | None = None

    def write(self, data: Any) -> int:
        """Write to disk up to the first error, and from then on to memory."""
        view, at, done = memoryview(data).cast("B"), self.tell(), 0
        try:
            while self.error is None and done < len(view):
                done += super().write(view[done:])
        except OSError as error:
            self.error, self._lost = error, list[tuple[int, bytes]]()
        if done < len(view):
            self._lost.append((at + done, bytes(view[done:])))
            self.seek(at + len(view))
        return len(view)

    def readinto(self, buffer: Any) -> int:
        """Read from disk, with what is only in memory laid over it."""
        view, at = memoryview(buffer).cast("B"), self.tell()
        count = super().readinto(view) or 0
        if self.error:
            view[count:] = bytes(len(view) - count)
            for start, lost in self._lost:
                first, last = max(start, at), min(start + len(lost), at + len(view))
                if first < last:
                    view[first - at : last - at] = lost[first - start : last - start]
            count = len(view)
        return count

    def truncate(self, size: int | None = None) -> int:
        """Set the length of the file; an error is stored, as of `write`."""
        try:
            return super().truncate(size)
        except OSError as error:
            self.error = self.error or error
            return size or 0


@contextmanager
def reading(path: str | Path, remedy: str = "", sealed: bool = True) -> Iterator[h5py.File]:
    """An HDF5 file that `WholeFile` wrote, open for reading; or any, if it need not be `sealed` by
    a checksum.

    Raises `StorageError`, in one line that names the file and what to do, the `remedy`, if it is
    missing, damaged, cut, changed, or foreign; an `InputError` or error of HDF5 within the context
    becomes one, too."""
    try:
        if not Path(path).is_file():
            raise StorageError(
                "it is a directory" if Path(path).is_dir() else "there is no such file"
            )
        with Path(path).open("rb") as content:
            if content.read(len(_SIGNATURE)) != _SIGNATURE:
                raise StorageError("it is not an HDF5 file")
            if sealed:
                size = content.seek(0, os.SEEK_END) - _TRAILER
                content.seek(max(size, 0))
                trailer = content.read()
                if not trailer.startswith(_SEAL):
                    raise StorageError(
                        "it is cut short, changed, or not of this program (no checksum at its end)"
                    )
                if trailer != _SEAL + _checksum(content, size):
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
        raise StorageError(f"cannot read {path}: {reason}{remedy and f'; {remedy}'}") from error


def dataset(file: h5py.File, name: str) -> h5py.Dataset:
    """The dataset of that name, stored in this very file: links out of it are not followed.

    Raises `StorageError`, for `reading` to add the name of the file.
    """
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
    """Write columns of numbers or of text; the first ones, `scales`, are the scales of the
    dimensions of the others."""
    written: dict[str, h5py.Dataset] = {}
    for name, values in columns.items():
        is_text = np.size(values) and isinstance(np.ravel(values)[0], str)
        text = h5py.string_dtype() if is_text else None
        written[name] = file.create_dataset(
            name, data=np.asarray(values, object) if text else values, dtype=text
        )
        if name in scales:
            written[name].make_scale(name)
        else:
            for dimension, scale in zip(written[name].dims, scales, strict=True):
                dimension.attach_scale(written[scale])
    return written


def seal(content: BinaryIO) -> None:
    """Add its checksum to an HDF5 file, open for reading and writing, that has none."""
    content.write(_SEAL + _checksum(content, content.seek(0, os.SEEK_END)))


def _checksum(content: BinaryIO, size: int) -> bytes:
    """The checksum of the first `size` bytes of a file."""
    digest = hashlib.sha256()
    content.seek(0)
    for start in range(0, size, _BLOCK):
        digest.update(content.read(min(_BLOCK, size - start)))
    content.seek(size)
    return digest.hexdigest().encode()
