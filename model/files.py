"""Files that are whole or not there: written under a temporary name beside theirs."""

import json
import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

from model.errors import StorageError

_SUFFIX = ".part"
_HOST = platform.node().replace(".", "-")
_under_way: set[Path] = set()
"""Temporary files of this process."""


def make_directory(path: Path) -> None:
    """Make a directory where there is none; `StorageError` if that, or writing in it, fails."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        why = "it is a file" if path.is_file() else error.strerror
        raise StorageError(f"cannot write to {path}: {why}") from error
    if not os.access(path, os.W_OK | os.X_OK):
        raise StorageError(f"cannot write to {path}: Permission denied")


def why_no_file(path: str | Path) -> str:
    """Why there is no file of that name to be read; nothing if there is one."""
    of = Path(path)
    if of.is_file():
        return ""
    if of.is_dir():
        return "it is a directory"
    return "it is not a file" if of.exists() else "there is no such file"


def check_ours(path: Path, beside: Path) -> None:
    """Raise `StorageError` if `path` exists without `beside`, which this program writes with it."""
    if path.exists() and not beside.exists():
        raise StorageError(f"{path} is not of this program: choose another directory with --output")


def check_writable(path: str | Path) -> None:
    """Raise `StorageError` if that file could not be written: better before a run than after."""
    folder = Path(path).parent
    try:
        if not folder.is_dir():
            raise StorageError(f"cannot write {path}: there is no directory {folder}")
        if Path(path).is_dir():
            raise StorageError(f"cannot write {path}: it is a directory")
    except OSError as error:  # as of a name that is too long
        raise StorageError(f"cannot write {path}: {error.strerror}") from error
    if not os.access(folder, os.W_OK | os.X_OK):
        raise StorageError(f"cannot write {path}: Permission denied")


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file, whole or not at all; raises `StorageError`, also for what is no file: as the
    superuser a new file would replace /dev/null."""
    try:
        if path.exists() and not path.is_file():
            raise StorageError(f"cannot write {path}: it is not a file")
        end = path.name[-50:]  # what tells files of one program apart; a name has at most 255 bytes
        made = path.with_name(f".{end}.{_HOST}.{os.getpid()}{_SUFFIX}").absolute()
        _under_way.add(made)
        try:
            with made.open("wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            made.replace(path)
        finally:
            made.unlink(missing_ok=True)
            _under_way.discard(made)
    except OSError as error:
        raise StorageError(f"cannot write {path}: {error.strerror}") from error


def write_text(path: Path, text: str) -> None:
    """Write a text as `write_bytes` does; a file name in it that is no UTF-8 stays as it is."""
    write_bytes(path, text.encode("utf-8", "surrogateescape"))


@contextmanager
def reading_json(path: Path, what: str) -> Iterator[Any]:
    """The object that a JSON file holds; an error within the context is a `StorageError` of it."""
    try:
        if not isinstance(content := json.loads(path.read_text("utf-8")), dict):
            raise TypeError("it is no JSON object")
        yield content
    except OSError as error:
        raise StorageError(f"cannot read {path}: {error.strerror}") from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise StorageError(f"{path} holds no {what}: {error}") from error


def remove_leftovers(directory: Path) -> None:
    """Remove the temporary files that writers killed on this machine have left in a directory."""
    for path in directory.glob(f".*{_SUFFIX}"):
        host, process = path.name.removesuffix(_SUFFIX).split(".")[-2:]
        if host == _HOST and process.isdigit():
            try:
                os.kill(int(process), 0)
            except ProcessLookupError:
                path.unlink(missing_ok=True)
            except PermissionError:
                continue  # it lives, and is somebody else's


def leave(code: int) -> NoReturn:
    """End this process at once, whatever its threads do; no temporary file stays."""
    for made in _under_way.copy():
        made.unlink(missing_ok=True)
    os._exit(code)
