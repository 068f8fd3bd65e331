"""The figures of the report, as the subjects list them; those of the league and of a designed meter are its pages'."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from compare import subjects
from compare.kit import deviations, drawing
from compare.kit.drawing import Figures, GapError, Material
from model import InputError, StorageError
from model.files import make_directory, write_text

FORMATS = ("svg", "pdf", "png")
CAPTIONS = "captions.txt"
FIGURES: Figures = {name: each for part in subjects.parts("figures") for name, each in part.FIGURES.items()}
"""Every figure, in the order of the report."""


def figures_of(claim: str) -> Figures:
    """The figures that stand beside a claim; unless one bears its name, also the deviations of its numbers."""
    own = {name: each for name, each in FIGURES.items() if claim in each.claims}
    return own if claim in own else own | {f"claim-{claim}": deviations.of(claim)}


def write(output: Path, material: Material, formats: Sequence[str] = ("svg",)) -> Iterator[tuple[str, str]]:
    """Write all figures to a directory, and their captions; yield the name of each, and why it wasn't drawn if so.

    Raises `InputError` for an unknown format, `StorageError` if a file can't be written.
    """
    for suffix in formats:
        if suffix not in FORMATS:
            raise InputError(f"no figure can be written as {suffix!r}; there are {', '.join(FORMATS)}")
    make_directory(output)
    captions = []
    for name, each in FIGURES.items():
        try:
            data = each.select(material)
            figure, caption = each.draw(data)
        except (GapError, StorageError) as gap:
            yield name, f"not drawn: {gap}"
            continue
        for suffix in formats:
            drawing.save(figure, output / f"{name}.{suffix}")
        captions.append(f"{name}\n{each.title}. {caption}\n")
        yield name, ""
    write_text(output / CAPTIONS, "\n".join(captions))
