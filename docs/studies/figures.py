"""Draw the figures of pages that show no measurement of a validation: ``python -m
docs.studies.figures``. Each is written to its place in docs/."""

from __future__ import annotations

from pathlib import Path

from compare.figures import drawing
from compare.subjects.attractors import figures as attractors
from compare.subjects.attractors.basins import Basins
from docs.studies import cases
from model.files import make_directory

DOCS = Path(__file__).parents[1]


def main() -> None:
    """Draw all of them."""
    make_directory(DOCS / "cases")
    for name, draw in (("fig-2", cases.draw_2), ("fig-3", cases.draw_3), ("fig-6", cases.draw_6)):
        drawing.save(draw(), DOCS / "cases" / f"{name}.svg")
    basins = Basins.load(DOCS / "studies" / "data" / "basins.json")
    drawing.save(attractors.draw_basins(basins), DOCS / "records" / "attractors" / "basins.png")


if __name__ == "__main__":
    main()
