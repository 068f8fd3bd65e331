"""Shared by the tests of `compare`."""

import dataclasses
import shutil
from collections.abc import Iterator
from typing import Any

import pytest

from compare.gallery import FIGURES
from compare.kit.campaign import Campaign
from compare.kit.drawing import GapError
from compare.kit.engines import EVENT
from compare.kit.lab import Lab
from compare.kit.levels import Level
from compare.report import report


def lacking(_: object) -> None:
    raise GapError("it was not measured")


@pytest.fixture(scope="module")
def few_figures() -> Iterator[None]:
    """Reports with two figures, of which one was not measured: each is drawn in the tests of figures."""
    with pytest.MonkeyPatch.context() as patch:
        fig_9 = FIGURES["fig-9"]
        lost = dataclasses.replace(fig_9, title="The user's own", select=lacking, claims=())
        patch.setattr(report, "FIGURES", {"lost": lost, "fig-9": fig_9})
        yield


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    """Where protocols run the event-driven simulation, the quickest engine, at the quick level."""
    with Campaign(tmp_path_factory.mktemp("runs"), workers=0) as campaign:
        yield Lab(campaign, EVENT, Level.QUICK)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Chromium, without a window; contexts and pages of it may have nothing to complain of."""
    playwright = pytest.importorskip("playwright.sync_api")
    path = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if path is None:
        pytest.skip("no Chromium is installed")
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(
            executable_path=path, args=["--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader"]
        )
        yield chromium
        chromium.close()
