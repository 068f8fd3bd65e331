"""What a long run has done so far, on disk: killed at any moment, it goes on from there, to the
bit.

A journal is a directory of segments. Each holds the samples since the one before and everything
that the run carries on; it is a whole HDF5 file or not there at all."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

from model.arrays import Array
from model.files import make_directory, remove_leftovers
from model.hdf5 import WholeFile, reading


class Journal:
    """The segments of one run.

    Parameters
    ----------
    directory : where they are; made with the first of them
    interval : least time between two segments, s of real time

    Raises `StorageError` if it can't be read or written.
    """

    def __init__(self, directory: Path, interval: float = 30.0) -> None:
        self._directory, self._interval = directory, interval
        remove_leftovers(directory)
        self._segments = sorted(directory.glob("*.h5"))
        self._waiting: list[npt.NDArray[np.void]] = []
        self._last = time.monotonic()

    def recall(self) -> tuple[Iterator[npt.NDArray[np.void]], dict[str, Array]]:
        """Blocks of samples so far, one at a time, and the state after them, if any.

        Raises `StorageError`, the blocks when they are read, if a segment is damaged.
        """
        blocks = (self._read(path)[0] for path in self._segments)
        return blocks, self._read(self._segments[-1])[1] if self._segments else {}

    def _read(self, path: Path) -> tuple[npt.NDArray[np.void], dict[str, Array]]:
        """The samples of a segment, and the state after them."""
        with reading(path, f"remove {self._directory} to start anew") as file:
            return file["samples"][...], {name: part[...] for name, part in file["state"].items()}

    def note(self, samples: npt.NDArray[np.void], state: dict[str, Array]) -> None:
        """Keep a block of samples and the state after it; written once the interval has passed."""
        self._waiting.append(samples)
        if time.monotonic() - self._last < self._interval:
            return
        make_directory(self._directory)
        path = self._directory / f"{len(self._segments):06d}.h5"
        with WholeFile(path) as whole:
            whole.file["samples"] = np.concatenate(self._waiting)
            for name, values in state.items():
                whole.file[f"state/{name}"] = values
            whole.finish()
        self._segments.append(path)
        self._waiting, self._last = [], time.monotonic()

    def discard(self) -> None:
        """Remove all segments, when the run itself is stored."""
        if self._segments:
            shutil.rmtree(self._directory)
