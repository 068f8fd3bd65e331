"""Shared by the tests of `compare`."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from compare.gallery import FIGURES
from compare.kit.campaign import Campaign
from compare.kit.engines import MUJOCO
from compare.kit.lab import Lab
from compare.kit.levels import Level
from compare.report import report


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
