"""Shared by the tests of `compare`."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from compare.figures.registry import FIGURES
from compare.report import report


@pytest.fixture(scope="module")
def few_figures() -> Iterator[None]:
    """Reports with two figures, of which one was not measured: each is drawn in the tests of figures."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report, "FIGURES", {name: FIGURES[name] for name in ("ladder", "fig-3")})
        yield
