"""Shared by the tests of `compare`."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from compare.figures.registry import FIGURES
from compare.measure.lab import Lab
from compare.measure.levels import Level
from compare.report import report
from compare.runs.campaign import Campaign
from compare.runs.engines import MUJOCO


@pytest.fixture(scope="module")
def few_figures() -> Iterator[None]:
    """Reports with two figures, of which one was not measured: each is drawn in the tests of figures."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report, "FIGURES", {name: FIGURES[name] for name in ("ladder", "fig-9")})
        yield


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    """Where protocols run MuJoCo at the quick level."""
    with Campaign(tmp_path_factory.mktemp("runs"), workers=0) as campaign:
        yield Lab(campaign, MUJOCO, Level.QUICK)
