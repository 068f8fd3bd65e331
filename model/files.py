"""Files that are whole or not there at all."""

from __future__ import annotations

import io
import os
import socket
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5py

from model.errors import StorageError

_SUFFIX = ".part"


class WholeFile:
    """An HDF5 file under construction; a context manager.

    It has a temporary name until `finish`; leaving the context without that removes it. ``file`` is the h5py file,
    empty or as in `template`, the bytes of an HDF5 file.
    Raises `StorageError`, in one line, when it can't be written (no such directory, no permission, disk full).
    """

    def __init__(self, path: str | Path, template: bytes = b"") -> None:
        self.path = Path(path)
        self._temporary = _temporary(self.path)
        try:
            self._disk = _Disk(self._temporary, "w+b")
        except OSError as error:
            raise StorageError(f"cannot write {self.path}: {error.strerror}") from error
        self._disk.write(template)
        if self._disk.refusal:
            self._disk.close()
            self._temporary.unlink(missing_ok=True)
            self._check()
        self.file = h5py.File(self._disk, "r+" if template else "w", track_order=True)
        self._finished = False

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if not self._finished:
            self.file.close()
            self._disk.close()
            self._temporary.unlink(missing_ok=True)

    def flush(self) -> None:
        """Bring what was written to the disk."""
        self.file.flush()
        self._check()

    def finish(self, path: str | Path | None = None) -> None:
        """Close the file and give it its name, or another in the same directory."""
        self.file.close()
        self._check()
        try:
            os.fsync(self._disk.fileno())
            self._disk.close()
            self._temporary.replace(path or self.path)
        except OSError as error:
            raise StorageError(f"cannot write {self.path}: {error.strerror}") from error
        self._finished = True

    def _check(self) -> None:
        if self._disk.refusal:
            raise StorageError(f"cannot write {self.path}: {self._disk.refusal.strerror}") from self._disk.refusal


class _Disk(io.FileIO):
    """A file that remembers the first refusal of the operating system instead of raising it.

    HDF5 can't close a file that it could not write: it crashes the process (HDF5 1.14, disk full). So it never
    hears of the refusal; the writer asks for it after each flush.
    """

    refusal: OSError | None = None

    def write(self, data: Any) -> int:
        view = memoryview(data).cast("B")
        done = 0
        try:
            while self.refusal is None and done < len(view):
                done += super().write(view[done:])
        except OSError as error:
            self.refusal = error
        return len(view)

    def truncate(self, size: int | None = None) -> int:
        try:
            return super().truncate(size)
        except OSError as error:
            self.refusal = self.refusal or error
            return size or 0


def check_writable(path: str | Path) -> None:
    """Raise `StorageError` if a file of that name could not be written: better before a long run than after."""
    folder = Path(path).parent
    if not folder.is_dir():
        raise StorageError(f"cannot write {path}: there is no directory {folder}")
    if Path(path).is_dir():
        raise StorageError(f"cannot write {path}: it is a directory")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise StorageError(f"cannot write {path}: Permission denied")


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all; raises `StorageError`."""
    temporary = _temporary(path)
    try:
        temporary.write_text(text, "utf-8")
        temporary.replace(path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise StorageError(f"cannot write {path}: {error.strerror}") from error


def remove_leftovers(directory: Path) -> None:
    """Remove the temporary files that writers killed on this machine have left in a directory."""
    for path in directory.glob(f".*{_SUFFIX}"):
        host, process = path.name.removesuffix(_SUFFIX).split(".")[-2:]
        if host == _host() and process.isdigit() and not _alive(int(process)):
            path.unlink(missing_ok=True)


def _temporary(path: Path) -> Path:
    """A name beside a file's that tells whose it is."""
    return path.with_name(f".{path.name}.{_host()}.{os.getpid()}{_SUFFIX}")


def _host() -> str:
    return socket.gethostname().replace(".", "-")


def _alive(process: int) -> bool:
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except PermissionError:  # it lives, and is somebody else's
        return True
    return True
