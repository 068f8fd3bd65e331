"""Shared by the tests of `compare`."""

import dataclasses
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import analytic
from compare.campaign.campaign import Campaign
from compare.engines.study import EVENT
from compare.figures.drawing import GapError
from compare.method import record
from compare.method.record import Missing, Origin, Records
from compare.method.runner import Runner
from compare.plan import Level
from compare.report import report, results
from compare.report.gallery import FIGURES
from compare.report.results import Summary
from model import Parameters, storage
from tests.commands import METER, SCENE
from tests.measured import measured


def lacking(_: object) -> None:
    raise GapError("it was not measured")


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A fresh directory, which is the current one."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def few_figures() -> Iterator[None]:
    """Reports with two figures, of which one was not measured: each is drawn in the tests of
    figures."""
    with pytest.MonkeyPatch.context() as patch:
        fig_9 = FIGURES["fig-9"]
        lost = dataclasses.replace(fig_9, title="The user's own", select=lacking, claims=())
        patch.setattr(report, "FIGURES", {"lost": lost, "fig-9": fig_9})
        yield


@pytest.fixture(scope="session")
def stocked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with what commands read, to be copied."""
    made = tmp_path_factory.mktemp("stocked")
    p = Parameters.named("reference").replace(omega_0=25.0)
    for name, mu in (("run", p.mu), ("runs/one", p.mu), ("runs/other", 0.3)):
        (made / name).parent.mkdir(exist_ok=True)
        storage.save(analytic.simulate(p.replace(mu=mu), [0] * 6, 1.0), made / f"{name}.h5")
    Parameters.named("steel-in-water").save(made / "set.toml")
    (made / "flow.csv").write_text("time (s); omega_0 (rad/s)\n0; 10,5\n1; 20\n")
    (made / "scene.xml").write_text(SCENE)
    (made / "meter.toml").write_text(METER)
    file = made / "results" / "measurements" / "settled.h5"
    file.parent.mkdir(parents=True)
    rows = (
        measured("settled", "omega_c", 11.9, 1e-9, y=0.1),
        measured("settled", "force_Ay", 0.1, 1e-9),
    )
    origin = Origin(
        protocol="settled",
        engine="mujoco",
        by="mujoco",
        step=1,
        level=Level.QUICK.name,
        plan=file.parent.name,
    )
    missing = (Missing("settled", "x", "it never settles"),)
    record.save(Records(rows, missing), file, dataclasses.asdict(origin))
    results.save(
        Summary.of([], Level.QUICK, {"mujoco": {1: ["measurements/settled.h5"]}}), made / "results"
    )
    return made


@pytest.fixture(scope="module")
def runner(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Runner]:
    """Where protocols run the event-driven simulation, the quickest engine, at the quick level."""
    with Campaign(tmp_path_factory.mktemp("runs"), workers=0) as campaign:
        yield Runner(campaign, EVENT, Level.QUICK)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Chromium, without a window."""
    playwright = pytest.importorskip("playwright.sync_api")
    path = next(
        filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
    )
    if path is None:
        pytest.skip("no Chromium is installed")
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(
            executable_path=path,
            args=["--no-sandbox", "--disable-gpu", "--enable-unsafe-swiftshader"],
        )
        yield chromium
        chromium.close()


@pytest.fixture
def tab(browser: Any) -> Iterator[Any]:
    """A page that may have nothing to complain of and asks the network for nothing."""
    page, wrong = browser.new_page(viewport={"width": 1200, "height": 844}), list[str]()
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on(
        "request",
        lambda request: wrong.append(request.url) if request.url.startswith("http") else None,
    )
    yield page
    page.close()
    assert not wrong
