"""A directory that one program at a time fills."""

import os
import platform
import sys
from datetime import UTC, datetime
from pathlib import Path

from model import StorageError

if sys.platform != "win32":
    import fcntl


class Lock:
    """Held until `release` or the end of the process; a file in the directory says by whom.

    Raises `StorageError`, which names the owner, while another has it. On Windows there is none."""

    def __init__(self, directory: Path) -> None:
        self._path = directory / ".lock"
        while sys.platform != "win32":
            try:
                self._file = self._path.open("a+b", buffering=0)
            except OSError as error:
                raise StorageError(f"cannot write to {directory}: {error.strerror}") from error
            try:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                self._file.seek(0)
                owner = self._file.read().decode() or "another program"
                self._file.close()
                how = "wait for it, or choose another directory with --output"
                raise StorageError(f"{directory} is in use by {owner}: {how}") from error
            except OSError as error:  # a file system that has no locks
                why = f"{directory} can't be locked ({error.strerror})"
                print(f"dualball: {why}: start no second program there", file=sys.stderr)
            try:
                if self._path.stat().st_ino == os.fstat(self._file.fileno()).st_ino:
                    owner = (
                        f"process {os.getpid()} on {platform.node()}, since "
                        f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC"
                    )
                    self._file.truncate(0)
                    self._file.write(owner.encode())
                    return
            except FileNotFoundError:
                pass
            except OSError as error:
                self.release()
                raise StorageError(f"cannot write to {directory}: {error.strerror}") from error
            self._file.close()  # its last owner has just removed the file

    def release(self) -> None:
        """Release the lock: others may have the directory."""
        if sys.platform != "win32":
            self._path.unlink(missing_ok=True)
            self._file.close()
