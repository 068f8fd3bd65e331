"""Every claim has a figure, made from the results of the quick validation alone."""

from __future__ import annotations

import io

import pytest

from compare import CLAIMS, Level, results
from compare.figures.claims import FIGURES_OF


@pytest.mark.parametrize("claim", [c for c in CLAIMS if c.level is Level.QUICK], ids=lambda claim: claim.id)
def test_figure_draws(validated, claim) -> None:
    figure = FIGURES_OF[claim.id](results.load(validated.directory), validated.directory)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=40)
    assert buffer.tell() > 1000
    assert figure.axes[0].has_data()
