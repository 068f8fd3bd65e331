"""The report page: what it says, what it shows where results are missing, and how it behaves in a real browser."""

from __future__ import annotations

import base64
import functools
import itertools
import json
import re
import shutil
import subprocess
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from matplotlib.figure import Figure

from compare import CLAIMS, cli, pictures, report, results
from compare.claims import Check, Level, Outcome, Verdict
from compare.figures import claims, gallery
from compare.results import Summary

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-dev-shm-usage",
    "--disable-background-networking", "--disable-component-update", "--disable-sync", "--hide-scrollbars",
    "--remote-debugging-port=0", "--remote-allow-origins=*",
)  # fmt: skip
PATIENCE = 120.0
"""How long to wait for the browser, s: long, since machines differ."""


def numbers(count: int, run: str = "") -> tuple[Check, ...]:
    """Made-up numbers that agree."""
    return tuple(
        Check(
            quantity="ω_c", unit="rad/s", witness="mujoco", parameters="reference", omega_0=12.0 + k,
            condition="2 % off, from a start with a name that is rather long", predicted=12.0 + k,
            measured=12.0 + k + 1e-9, uncertainty=1e-9, tolerance=3e-9, case_predicted="RR", case_found="RR", run=run,
        )
        for k in range(count)
    )  # fmt: skip


@pytest.fixture(scope="module")
def directory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of every claim but the last: one failed, one without its run file, one stopped by an error."""
    made = tmp_path_factory.mktemp("results")
    (made / "runs").mkdir()
    (made / "runs" / "there.h5").touch()
    found = []
    for k, claim in enumerate(CLAIMS[:-1]):
        checks = numbers(40 if k == 0 else 3, "runs/lost.h5" if k == 1 else "runs/there.h5")
        outcome = Outcome.NOT_REPRODUCED if k == 2 else claim.expected
        error = "diverged by t = 3 s & <so> on" if k == 3 else ""
        found.append(Verdict(claim=claim, outcome=outcome, checks=checks, error=error))
    results.save(Summary().with_verdicts("DEFAULT", found), made)
    return made


@pytest.fixture(scope="module")
def page(directory: Path) -> Path:
    """The report, with the figure for numbers of any kind at every claim: the others need real results."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report, "FIGURES_OF", {c.id: functools.partial(claims.deviations, c.id) for c in CLAIMS})
        patch.setattr(report, "STORED", {"characteristic": gallery.STORED["characteristic"]})
        return report.write(directory)


def test_what_the_page_says(page: Path) -> None:
    text = page.read_text("utf-8")
    assert page.stat().st_size < 5e6
    assert f"1 of {len(CLAIMS) - 1} claims did not come out as expected: {CLAIMS[2].id}" in text
    assert "diverged by t = 3 s &amp; &lt;so&gt; on" in text
    assert f"dualball validate --claim {CLAIMS[0].id} -o" in text
    # Nothing is fetched from anywhere.
    assert not re.search(r'(?:src|href)="(?!#|data:|runs/|https://doi\.org)', text)
    assert "@import" not in text


def test_gaps_are_shown_with_the_command_that_fills_them(page: Path) -> None:
    text = page.read_text("utf-8")
    assert "A run file is missing" in text
    assert re.search(rf"Not run yet\. Fill the gap with <code>dualball validate --claim {CLAIMS[-1].id}", text)


def test_a_figure_without_its_run_file_is_a_gap(tmp_path: Path) -> None:
    claim = next(claim for claim in CLAIMS if claim.id == "fig-13-left")
    (tmp_path / "runs").mkdir()
    results.save(
        Summary().with_verdicts(
            "QUICK", [Verdict(claim=claim, outcome=claim.expected, checks=numbers(1, "runs/no.h5"))]
        ),
        tmp_path,
    )
    text = report.write(tmp_path).read_text("utf-8")
    assert re.search(r"The figure can.{1,5}t be drawn: .*no\.h5.*dualball validate --claim fig-13-left --quick", text)


def test_claims_of_a_deeper_level_are_not_missing(tmp_path: Path) -> None:
    quick = [claim for claim in CLAIMS if claim.level is Level.QUICK]
    found = [Verdict(claim=claim, outcome=claim.expected, checks=()) for claim in quick]
    results.save(Summary().with_verdicts("QUICK", found), tmp_path)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report, "STORED", {})
        text = report.write(tmp_path).read_text("utf-8")
    assert "not run" not in text.lower()
    assert f"claims as expected, {len(CLAIMS) - len(quick)} more at level default" in text
    assert f"dualball: {len(quick)} of {len(quick)} claims as expected" in text


def test_a_picture_is_drawn_once(tmp_path: Path) -> None:
    drawn = []

    def draw() -> Figure:
        drawn.append(Figure(figsize=(1, 1)))
        return drawn[-1]

    path = tmp_path / "made.svg"
    first = pictures.kept(path, {"a": 1.0}, draw)
    assert pictures.kept(path, {"a": 1.0}, draw) == first
    assert len(drawn) == 1
    path.write_text("something else")
    assert pictures.kept(path, {"a": 1.0}, draw)[:30] == first[:30] == "data:image/svg+xml;base64,PD94"
    pictures.kept(path, {"a": 2.0}, draw)
    assert len(drawn) == 3
    ElementTree.parse(path)


def test_errata_are_the_documented_ones() -> None:
    text = report.errata()
    documented = (Path(__file__).parents[2] / "docs" / "errata.md").read_text("utf-8")
    assert text.count("<tr>") == sum(line.startswith("|") for line in documented.splitlines()) - 1
    assert "<a href" not in re.sub(r'<a href="https?:', "", text)
    assert "<h1>" not in text


def test_an_empty_summary_is_a_page_too(tmp_path: Path) -> None:
    results.save(Summary().with_verdicts("QUICK", []), tmp_path)
    assert "Nothing has been checked yet" in report.write(tmp_path).read_text("utf-8")


def test_figures_are_written_and_gaps_told(tmp_path: Path, directory: Path, monkeypatch, capsys) -> None:
    monkeypatch.setattr(gallery, "FIGURES", {"fig99": lambda: Figure()})
    stored = gallery.Stored("A title", "a caption", lambda summary: Figure())
    monkeypatch.setattr(gallery, "STORED", {"made": stored})
    argv = ["figures", "-o", str(tmp_path / "figures"), "--format", "svg", "--format", "png"]
    assert cli.main([*argv, "--results", str(directory)]) == 0
    assert sorted(path.name for path in (tmp_path / "figures").iterdir()) == [
        "fig99.png", "fig99.svg", "made.png", "made.svg"
    ]  # fmt: skip
    capsys.readouterr()
    assert cli.main([*argv, "--results", str(tmp_path / "nowhere")]) == 0
    assert f"run 'dualball validate -o {tmp_path / 'nowhere'}'" in capsys.readouterr().out
    assert cli.main([*argv, "--format", "bmp"]) == 2


class Tab:
    """A page in a browser, driven through its debugging protocol."""

    def __init__(self, socket: Any) -> None:
        self._socket, self._ids, self.events = socket, itertools.count(1), []
        for domain in ("Runtime", "Log", "Page"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Call a method of the protocol, wait for its answer, and keep the events before it."""
        number = next(self._ids)
        self._socket.send(json.dumps({"id": number, "method": method, "params": parameters}))
        while (message := json.loads(self._socket.recv(PATIENCE))).get("id") != number:
            self.events.append(message)
        assert "error" not in message, message
        return message["result"]

    def open(self, url: str) -> None:
        self.call("Page.navigate", url=url)
        while not any(event["method"] == "Page.loadEventFired" for event in self.events):
            self.events.append(json.loads(self._socket.recv(PATIENCE)))

    def value(self, expression: str) -> Any:
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True)
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def press(self, key: str, code: int) -> None:
        text = {"Enter": "\r", " ": " "}.get(key, "")
        self.call("Input.dispatchKeyEvent", type="keyDown", key=key, windowsVirtualKeyCode=code, text=text)
        self.call("Input.dispatchKeyEvent", type="keyUp", key=key, windowsVirtualKeyCode=code)

    @property
    def complaints(self) -> list[Any]:
        """Errors and warnings that the page has caused."""
        return [
            event
            for event in self.events
            if event["method"] == "Runtime.exceptionThrown"
            or (event["method"] == "Runtime.consoleAPICalled" and event["params"]["type"] in ("error", "warning"))
            or (event["method"] == "Log.entryAdded" and event["params"]["entry"]["level"] in ("error", "warning"))
        ]


@pytest.fixture(scope="module")
def tab(page: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    client = pytest.importorskip("websockets.sync.client")
    if BROWSER is None:
        pytest.skip("no Chromium is installed")
    profile = tmp_path_factory.mktemp("profile")
    browser = subprocess.Popen(
        [BROWSER, *FLAGS, f"--user-data-dir={profile}", "about:blank"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        told, limit = profile / "DevToolsActivePort", time.monotonic() + PATIENCE
        while not (told.exists() and told.read_text().count("\n")):
            if browser.poll() is not None or time.monotonic() > limit:
                pytest.skip("Chromium does not start here")
            time.sleep(0.1)
        port = told.read_text().split("\n")[0]
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/json", timeout=PATIENCE) as answer:
            (target, *_) = [target for target in json.load(answer) if target["type"] == "page"]
        with client.connect(target["webSocketDebuggerUrl"], max_size=None, open_timeout=PATIENCE) as socket:
            made = Tab(socket)
            made.open(page.as_uri())
            yield made
    finally:
        browser.terminate()
        browser.wait(PATIENCE)


SHOWN = "[...document.querySelectorAll('#list > details')].filter(row => !row.hidden).map(row => row.id)"


def test_the_page_loads_without_complaint(tab: Tab) -> None:
    assert tab.complaints == []
    assert tab.value("document.querySelectorAll('#list > details').length") == len(CLAIMS)
    assert tab.value("document.title").startswith("dualball: ")


def test_filter(tab: Tab) -> None:
    tab.value("find.value = 'slip PROP.'; find.dispatchEvent(new Event('input'))")
    texts = {c.id: " ".join((c.id, c.source, c.statement, c.expected)).lower() for c in CLAIMS}
    wanted = [name for name, text in texts.items() if "slip" in text and "prop." in text]
    assert 0 < len(wanted) < len(CLAIMS)
    assert tab.value(SHOWN) == wanted
    assert tab.value("document.getElementById('shown').textContent") == f"{len(wanted)} of {len(CLAIMS)} shown"
    tab.value("find.value = ''; outcome.value = 'not reproduced'; outcome.dispatchEvent(new Event('change'))")
    assert tab.value(SHOWN) == [CLAIMS[2].id]
    tab.value("outcome.value = ''; outcome.dispatchEvent(new Event('change'))")
    assert len(tab.value(SHOWN)) == len(CLAIMS)


def test_sort(tab: Tab) -> None:
    before = tab.value(SHOWN)
    for _ in range(2):
        tab.value("document.querySelector('[data-sort=outcome]').click()")
    verdicts = tab.value("[...document.querySelectorAll('#list > details')].map(row => row.dataset.outcome)")
    assert verdicts == sorted(verdicts, reverse=True)
    tab.value("document.querySelector('[data-sort=id]').click()")
    assert sorted(before) == sorted(tab.value(SHOWN))


def test_rows_open_by_keyboard(tab: Tab) -> None:
    tab.value("document.querySelector('#list summary').focus()")
    first = "document.querySelector('#list > details').open"
    tab.press("Enter", 13)
    assert tab.value(first) is True
    tab.press(" ", 32)
    assert tab.value(first) is False
    # The next stop of the Tab key is the next row.
    tab.press("Tab", 9)
    assert tab.value("document.activeElement.parentElement.previousElementSibling.id") == tab.value(SHOWN)[0]


def test_an_address_opens_its_row(tab: Tab) -> None:
    tab.value(f"location.hash = '#{CLAIMS[0].id}'")
    deadline = time.monotonic() + PATIENCE
    while not tab.value(f"document.getElementById('{CLAIMS[0].id}').open") and time.monotonic() < deadline:
        time.sleep(0.05)
    assert tab.value(f"document.getElementById('{CLAIMS[0].id}').open")


@pytest.mark.parametrize("width", [390, 1200])
def test_nothing_runs_over_the_side(tab: Tab, width: int) -> None:
    """All rows open; what is wide scrolls in a box of its own."""
    tab.call("Emulation.setDeviceMetricsOverride", width=width, height=844, deviceScaleFactor=1, mobile=width < 600)
    tab.value("document.querySelectorAll('details').forEach(row => { row.open = true; })")
    assert tab.value("document.documentElement.scrollWidth") <= width
    tab.call("Emulation.clearDeviceMetricsOverride")


def test_dark_mode_is_legible(tab: Tab) -> None:
    """Text against its ground has at least the contrast 4.5 of WCAG AA, light and dark."""
    contrast = """(() => {
        const light = colour => { const [r, g, b] = colour.match(/[\\d.]+/g).map(Number).map(v => v / 255)
            .map(v => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
            return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
        const ground = light(getComputedStyle(document.body).backgroundColor);
        return ['body', '.soft', '.verdict.pass', '.verdict.fail', '.verdict.other', 'dt', 'a'].map(name => {
            const ink = light(getComputedStyle(document.querySelector(name)).color);
            return (Math.max(ink, ground) + 0.05) / (Math.min(ink, ground) + 0.05); });
    })()"""
    for scheme in ("light", "dark"):
        tab.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        assert min(tab.value(contrast)) >= 4.5, scheme
    tab.call("Emulation.setEmulatedMedia", features=[])


def test_it_prints(tab: Tab) -> None:
    printed = base64.b64decode(tab.call("Page.printToPDF", printBackground=True)["data"])
    assert printed.startswith(b"%PDF")
    assert printed.count(b"/Type /Page\n") + printed.count(b"/Type /Page ") + printed.count(b"/Type/Page") > 1
    assert tab.complaints == []
