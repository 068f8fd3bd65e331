"""Draw the figures of pages that show no measurement of a validation: ``python -m
docs.studies.figures``.

Each is written to its place in docs/, and what its caption should say is printed.
"""

from __future__ import annotations

from pathlib import Path

from compare.kit import drawing
from compare.subjects.attractors import figures as attractors
from compare.subjects.attractors.basins import Basins
from docs.studies import cases, hopping
from docs.studies.search import Searched
from model.files import make_directory, write_text

DOCS = Path(__file__).parents[1]
DATA = DOCS / "studies" / "data"
SEARCHES = DATA / "hopping-box.json", DATA / "hopping-strong-drag.json"
"""Searches over the whole box, and beyond its largest kappa."""


def main() -> None:
    """Draw all of them."""
    make_directory(DOCS / "cases")
    for name, draw in (("fig-2", cases.draw_2), ("fig-3", cases.draw_3), ("fig-6", cases.draw_6)):
        drawing.save(draw(), DOCS / "cases" / f"{name}.svg")
    search, *others = map(Searched.load, SEARCHES)
    write_text(DOCS / "records" / "hops.md", hopping.page(search, *others))
    basins = Basins.load(DATA / "basins.json")
    hopping.draw_where(search).savefig(DOCS / "records" / "attractors" / "where.png", dpi=110)
    drawing.save(attractors.draw_basins(basins), DOCS / "records" / "attractors" / "basins.png")
    print(hopping.caption_where(search), hopping.caption_plane(basins), sep="\n")


if __name__ == "__main__":
    main()
