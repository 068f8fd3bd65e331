"""Engines beside each other: grades of a person's settings, the league, and the figures of both."""

from __future__ import annotations

from compare.bench import figures
from compare.kit.drawing import Drawing

FIGURES = {
    "ladder": Drawing(
        "From a newcomer's settings to the study's",
        figures.select_ladder,
        figures.draw_ladder,
        figures.caption_ladder,
    ),
    "frontier": Drawing("Error and cost", figures.select_frontier, figures.draw_frontier, figures.caption_frontier),
}
