"""All figures as files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from matplotlib.figure import Figure

from compare.figures.drawing import GapError, Material
from compare.figures.registry import FIGURES
from model.errors import InputError, StorageError
from model.files import make_directory, write_text

FORMATS = ("svg", "pdf", "png")
CAPTIONS = "captions.txt"


def write(output: Path, material: Material, formats: tuple[str, ...] = ("svg",)) -> Iterator[tuple[str, str]]:
    """Write all figures to a directory, and their captions; yield the name of each, and why it wasn't drawn if so.

    Raises `InputError` for an unknown format, `StorageError` if a file can't be written.
    """
    for suffix in formats:
        if suffix not in FORMATS:
            raise InputError(f"no figure can be written as {suffix!r}; there are {', '.join(FORMATS)}")
    make_directory(output)
    captions = []
    for name, drawing in FIGURES.items():
        try:
            data = drawing.select(material)
            figure = drawing.draw(data)
        except (GapError, StorageError) as gap:
            yield name, f"not drawn: {gap}"
            continue
        for suffix in formats:
            save(figure, output / f"{name}.{suffix}")
        captions.append(f"{name}\n{drawing.title}. {drawing.caption(data)}\n")
        yield name, ""
    write_text(output / CAPTIONS, "\n".join(captions))


def save(figure: Figure, path: Path) -> None:
    """Write a figure to a file, in the format that its name says; equal figures make equal files.

    Raises `StorageError` if it can't be written or the name says no format.
    """
    try:
        figure.savefig(path, dpi=200, metadata=_TIMELESS.get(path.suffix, {}))
    except OSError as error:
        raise StorageError(f"cannot write {path}: {error.strerror}") from error
    except ValueError as error:
        raise StorageError(f"cannot write {path}: {str(error).splitlines()[0]}") from error


_TIMELESS: Mapping[str, dict[str, None]] = {".svg": {"Date": None}, ".pdf": {"CreationDate": None}}
