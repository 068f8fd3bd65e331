"""Every figure there is: those that theory alone can draw, and those that need stored results."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from compare import ablation, frontier, results
from compare.figures import characteristic, mujoco
from compare.figures.paper import FIGURES
from compare.results import Summary
from model.errors import InputError, StorageError


@dataclass(frozen=True)
class Stored:
    """A figure made from stored results; `draw` raises `StorageError`, naming the command, where they are missing."""

    title: str
    caption: str
    draw: Callable[[Summary], Figure]


STORED = {
    "characteristic": Stored("Characteristic curves", characteristic.CAPTION, characteristic.draw),
    "frontier": Stored("Error and cost", mujoco.CAPTIONS[frontier.ID], mujoco.draw_frontier),
    "ablation": Stored("What a newcomer's settings get wrong", mujoco.CAPTIONS[ablation.ID], mujoco.draw_ablation),
}
"""By file name, in the order of the report."""
FORMATS = ("svg", "pdf", "png")


def write(output: Path, stored: Path, formats: tuple[str, ...] = ("svg",)) -> Iterator[tuple[str, str]]:
    """Write every figure to a directory; yield for each its name and the gap, empty if it was written.

    `stored` is the results directory. Raises `InputError` for an unknown format, `StorageError` if a file can't be
    written.
    """
    for suffix in formats:
        if suffix not in FORMATS:
            raise InputError(f"no figure can be written as {suffix!r}; there are {', '.join(FORMATS)}")
    try:
        output.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(f"cannot write {output}: {error.strerror}") from error
    for name, draw in FIGURES.items():
        _save(draw(), output, name, formats)
        yield name, ""
    try:
        summary = results.load(stored)
    except StorageError as error:
        for name in STORED:
            yield name, f"skipped: {error}"
        return
    for name, wanted in STORED.items():
        try:
            figure = wanted.draw(summary)
        except StorageError as error:
            yield name, f"skipped: {error}"
            continue
        _save(figure, output, name, formats)
        yield name, ""


def _save(figure: Figure, output: Path, name: str, formats: tuple[str, ...]) -> None:
    for suffix in formats:
        path = output / f"{name}.{suffix}"
        try:
            figure.savefig(path, dpi=200, metadata=_METADATA[suffix])
        except OSError as error:
            raise StorageError(f"cannot write {path}: {error.strerror}") from error


_METADATA: Mapping[str, dict[str, None]] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}, "png": {}}
"""Without the time of writing, equal figures make equal files."""
