"""The report says what was found, shows where results are missing, and works in a real browser."""

import base64
import dataclasses
import html
import json
import pickle
import re
import zlib
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pytest
from matplotlib.figure import Figure

from compare import gallery
from compare.claim import Bearing, Claim, Outcome, Text, Verdict
from compare.commands import validate
from compare.gallery import FIGURES
from compare.kit.drawing import Drawing, Evidence, GapError
from compare.kit.levels import Level
from compare.kit.pages import typeset
from compare.kit.record import Check, Missing, Records
from compare.kit.workers import processes
from compare.report import report, results, wording
from compare.report.results import Summary
from model import Parameters, StorageError
from tests.measured import measured

pytestmark = pytest.mark.usefixtures("few_figures")
P = Parameters.named("reference")
RUNS = ("runs/there.h5",)


def claim(name: str, section: str = "Stationary states", **changes: Any) -> Claim:
    bearing = Bearing(protocol="settled", quantity="omega_c", predict=lambda m: 1.0, by="analytic.solution")
    given = {"source": f"Prop. {name}", "statement": f"What {name} states of slip & <roll>.", "bearings": (bearing,)}
    return Claim(id=name, section=section, **(given | changes))


def checks(count: int, deviation: float = 0.0, tolerance: float = 3e-9) -> tuple[Check, ...]:
    """Made-up numbers, each with the same tolerance, the k-th off by k parts of `deviation`."""
    conditions = {"case": "RR", "start": "a start with a name that is rather long", "y": 0.02, "v_y": 0.0}
    sets = [P.replace(omega_0=12.0 + k) for k in range(count)]
    made = [dataclasses.replace(measured("settled", "omega_c", 12.0, 1e-9, p, **conditions), runs=RUNS) for p in sets]
    return tuple(
        Check(measurement=m, predicted=12.0 - deviation * (k + 1) / count, tolerance=tolerance, scale=12.0)
        for k, m in enumerate(made)
    )


VERDICTS = (
    Verdict(claim=claim("good"), outcome=Outcome.CONFIRMED, checks=checks(report.ROWS + 40)),
    Verdict(claim=claim("bad", text=Text.CORRECTED, reason="A sign."), outcome=Outcome.REFUTED, checks=checks(3, 1e-3)),
    Verdict(claim=claim("coarse", "Stability"), outcome=Outcome.INCONCLUSIVE, checks=checks(2, 0.0, 1.0)),
    Verdict(
        claim=claim("broken", "Stability"),
        outcome=Outcome.ERROR,
        error="ValueError: diverged & <so> on",
        missing=(Missing("thresholds", "rough-wall", "no flow <at which> it slips"),),
    ),
    Verdict(claim=claim("doubted", expected=Outcome.REFUTED), outcome=Outcome.REFUTED, checks=checks(2, 1e-3)),
    Verdict(claim=claim("deeper", "Laws and cases"), outcome=Outcome.NOT_RUN),
)
RAN = [verdict for verdict in VERDICTS if verdict.outcome is not Outcome.NOT_RUN]


@pytest.fixture(scope="module")
def directory(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("results")
    (made / "runs").mkdir()
    (made / "runs" / "there.h5").touch()
    return made


@pytest.fixture(scope="module")
def page(directory: Path, few_figures: None) -> Path:
    records = Records(tuple(check.measurement for check in VERDICTS[0].checks))
    evidence = Evidence({verdict.claim.id: verdict.checks for verdict in VERDICTS}, records, directory)
    return report.write(evidence, VERDICTS, Summary.of(VERDICTS, Level.QUICK, {}))


def row(text: str, name: str) -> str:
    """The part of the page that belongs to a claim."""
    return re.split(r'<details class="claim"', text.split(f'id="{name}" data-id')[1])[0]


def test_what_the_page_says(page, tmp_path):
    text = page.read_text("utf-8")
    good, bad, broken = (row(text, name) for name in ("good", "bad", "broken"))
    assert page.stat().st_size < 4e6
    for part, said in (
        (text, "2 of 5 claims did not come out as expected: bad, broken; 1 of 5 claims can&#39;t be told"),
        (text, '<a href="#doubted">doubted</a> (refuted, as expected)'),
        (text, "What good states of slip &amp; &lt;roll&gt;."),
        (text, "Not drawn: The user&#39;s own: it was not measured"),
        (broken, "ValueError: diverged &amp; &lt;so&gt; on"),
        (broken, "rough-wall: no flow &lt;at which&gt; it slips"),
        (good, "dualball validate --claim good --quick -o"),
        (good, "analytic.solution"),
        (good, "a relative error of 2.5e-10 in <i>ω</i><sub>c</sub>"),  # resolving power: 3e-9 and 1, divided by 12
        (row(text, "coarse"), "a relative error of 0.083 in <i>ω</i><sub>c</sub>"),
        (row(text, "coarse"), "? inconclusive"),
        (bad, "Prop. bad, corrected. A sign."),
        (bad, "Expected: confirmed."),
        (row(text, "doubted"), 'class="verdict other"'),  # a refutation that was expected is no failure
        (good, f"The {report.ROWS} numbers nearest to failing"),
        (good, f'<a href="#numbers" data-claim="good">all {report.ROWS + 40}</a>'),
    ):
        assert said in part
    assert "Expected:" not in row(text, "doubted")
    assert not re.search(r'(?:src|href)="(?!#|data:|runs/|https://doi\.org)', text)  # nothing is fetched
    assert good.count("<td>settled</td>") == good.count('<tr class="pass">') == report.ROWS
    worst = [float(value) for value in re.findall(r"<td>([-+][\d.e-]+)</td>", bad)]
    assert worst == sorted(worst, reverse=True)
    # What was not run is named once, outside the sections, and no section is empty.
    assert "<h3>Laws and cases</h3>" not in text
    assert re.search(r"Not part of this run: <code[^>]*>deeper</code>", text)
    empty = report.write(Evidence(directory=tmp_path), [], Summary.of([], Level.QUICK, {}))
    assert "Nothing has been checked yet" in empty.read_text("utf-8")


def test_every_number_is_on_the_page() -> None:
    (check,), far = checks(1), checks(1, 0.5)[0]
    m = check.measurement
    alone = dataclasses.replace(m, quantity="case", value=1.0, uncertainty=0.0, conditions={"start": "rest"})
    again = dataclasses.replace(m)  # a copy, as another process returns it
    columns = report.columns(Records((again, alone)), {"good": (check,), "bad": (far,)})
    assert columns["claim"] == ["good", "bad", ""]
    assert columns["omega_0"] == [12.0] * 3
    assert columns["measured"] == [12.0, 12.0, "RS"]
    assert columns["predicted"] == [12.0, 11.5, ""]
    assert columns["deviation"] == [0.0, 0.5, ""]
    assert columns["mark"] == ["pass", "fail", ""]
    assert columns["quantity"] == ["ω_c rad/s"] * 2 + ["case"]
    shown = {"ω_c rad/s": "<i>ω</i><sub>c</sub> rad/s", "case": "case"}
    packed = json.loads(zlib.decompress(base64.b64decode(report.packed(columns))))
    assert packed.pop("typeset").items() >= shown.items()
    assert packed == columns
    coarse = report.columns(Records((dataclasses.replace(m, value=1.23456789, uncertainty=2.3e-4),)), {})
    assert (coarse["measured"], coarse["uncertainty"]) == ([1.23457], [2.3e-4])  # rounded to what is known


def test_verdicts_are_said_alike_in_the_terminal_and_on_the_page(page: Path) -> None:
    text = html.unescape(page.read_text("utf-8"))
    for verdict in RAN:
        line = validate.line(verdict).plain
        for heading, found in wording.findings(verdict).items():
            assert f"{heading.lower()} {found}" in line
            assert f"<dt>{heading}</dt>" in row(text, verdict.claim.id)
            assert html.unescape(typeset(found)) in row(text, verdict.claim.id)
    summary = validate.summary(VERDICTS).plain
    assert wording.headline(RAN) in summary
    assert wording.missing(RAN) in summary
    assert wording.missing(RAN) in text
    for count, what in wording.totals(RAN):
        assert f"{count} {what}" in summary
        assert f"<b>{count}</b>{what}" in text
    equal = dataclasses.replace(checks(1)[0].measurement, quantity="case")
    same = Check(measurement=equal, predicted=12.0, tolerance=0.0, scale=1.0)
    for predicted, said in ((12.0, "none: all equal"), (1.0, "not equal: case, reference")):
        verdict = dataclasses.replace(RAN[0], checks=(dataclasses.replace(same, predicted=predicted),))
        assert wording.findings(verdict) == {"Largest deviation": said}


def test_a_figure_of_several_claims_is_drawn_once_or_is_a_gap(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(_: object) -> Figure:
        raise GapError("the run <is> lost")

    figures = {
        "fall": Drawing("A fall", lambda _: None, lambda _: (Figure(figsize=(1, 1)), ""), ("good", "bad")),
        "gap": Drawing("A gap", lambda _: None, refuse, ("good",)),
    }
    monkeypatch.setattr(report, "FIGURES", {})
    monkeypatch.setattr(report, "figures_of", lambda claim: {n: f for n, f in figures.items() if claim in f.claims})
    page = report.write(Evidence(directory=tmp_path), VERDICTS[:2], Summary.of([], Level.QUICK, {}))
    text = page.read_text("utf-8")
    assert text.count('<figure class="plot"') == 1
    assert '<a href="#figure-fall">A fall</a>: see good.' in row(text, "bad")
    assert "A gap is not drawn: the run &lt;is&gt; lost" in row(text, "good")


def test_summary_is_read_back(page: Path, directory: Path) -> None:
    summary = results.load(directory)
    assert summary.level == "QUICK"
    bad = summary.verdicts["bad"]
    assert (bad["id"], bad["verdict"], bad["passed"], bad["expected"]) == ("bad", "refuted", False, "confirmed")
    assert (bad["checks"], bad["agrees"]) == (len(VERDICTS[1].checks), sum(c.agrees for c in VERDICTS[1].checks))
    assert results.described(VERDICTS[1])["checks"][0]["conditions"]["y"] == 0.02
    assert summary.verdicts["broken"]["worst"] is None
    assert "NaN" not in (directory / results.SUMMARY).read_text("utf-8")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: "{", "holds no summary that this program reads: Expecting"),
        (lambda text: "[]", "holds no summary that this program reads: list"),
        (lambda text: text.replace('"schema_version": 5', '"schema_version": 4'), "in another format"),
        (lambda text: re.sub(r'"dualball": "[^"]*"', '"dualball": "0.0.0"', text), "holds results of dualball 0.0.0"),
    ],
    ids=["cut", "other", "old", "version"],
)
def test_a_foreign_summary_is_refused_in_one_line(tmp_path: Path, change: Any, message: str) -> None:
    results.save(Summary.of([], Level.QUICK, {}), tmp_path)
    path = tmp_path / results.SUMMARY
    path.write_text(change(path.read_text("utf-8")))
    with pytest.raises(StorageError, match=message) as refusal:
        results.open_directory(tmp_path)
    assert "\n" not in str(refusal.value)


def test_a_missing_summary_names_the_command(tmp_path: Path) -> None:
    with pytest.raises(StorageError, match="run 'dualball validate -o"):
        results.load(tmp_path)
    results.open_directory(tmp_path / "new")
    (tmp_path / "file").touch()
    with pytest.raises(StorageError, match="cannot write to"):
        results.open_directory(tmp_path / "file")


def test_a_picture_is_drawn_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawing = Drawing("t", lambda _: None, lambda data: (Figure(figsize=(1, 1)), f"<&> {data}"))
    path = tmp_path / "made.svg"
    assert gallery.kept(path, drawing, ("a", 1.0)) is None
    first = gallery.drawn((path, drawing, ("a", 1.0)))
    ElementTree.parse(path)
    assert first["picture"].startswith("<svg")
    assert first["caption"] == "<&> ('a', 1.0)"
    assert "desc" not in first["picture"]
    assert gallery.kept(path, drawing, ("a", 1.0)) == first
    assert gallery.kept(path, drawing, ("a", 2.0)) is None
    monkeypatch.setattr(gallery, "sources", lambda *packages: " ".join(packages))  # the program changes
    assert gallery.kept(path, drawing, ("a", 1.0)) is None
    path.write_text("something else")
    assert gallery.kept(path, drawing, ("a", 1.0)) is None


def test_processes_draw_every_figure(tmp_path: Path) -> None:
    """They draw what this process would, and nothing is drawn again."""
    for name, drawing in FIGURES.items():
        assert pickle.loads(pickle.dumps(drawing)).title == drawing.title, name
    summary, pages = Summary.of(VERDICTS, Level.QUICK, {}), []
    with processes(2) as work:
        for name, how in (("there", work.map), ("here", map)):
            evidence = Evidence({v.claim.id: v.checks for v in VERDICTS}, directory=tmp_path / name)
            (evidence.directory / gallery.PICTURES).mkdir(parents=True)
            pages.append(report.render(evidence, VERDICTS, summary, how))
    assert pages[0].replace("-o there", "-o here") == pages[1]
    assert pages[1].count('<figure class="plot"') > 1
    assert report.render(evidence, VERDICTS, summary, lambda one, new: iter(())) == pages[1]  # has room for no new one


def test_errata_are_the_documented_ones() -> None:
    text = report.errata()
    documented = (Path(__file__).parents[2] / "docs" / "errata.md").read_text("utf-8")
    assert text.count("<tr>") == sum(line.startswith("|") for line in documented.splitlines()) - 1
    assert "<a href" not in re.sub(r'<a href="https?:', "", text)
    assert "<h1>" not in text


# --- in a real browser ---------------------------------------------------------------------------------------


ROWS = "[...document.querySelectorAll('details.claim')]"
SHOWN = f"{ROWS}.filter(row => !row.hidden).map(row => row.id)"
FOUND = "[...document.querySelectorAll('#numbers-found tr')].map(row => [...row.cells].map(cell => cell.textContent))"
TYPED = "words.dispatchEvent(new Event('input'))"
SORT = "document.querySelector('[data-sort=id]').click()"
EVERY = sum(len(verdict.checks) for verdict in RAN)
FILTERED = (
    (f"{ROWS}.length", len(RAN)),
    (
        "document.title",
        "dualball: 5 claims: 1 confirmed by measurement, 1 refuted as expected, 2 not as expected, 1 inconclusive",
    ),
    (f"find.value = 'slip PROP. bro'; find.dispatchEvent(new Event('input')); {SHOWN}", ["broken"]),
    ("document.getElementById('shown').textContent", "1 of 5 shown"),
    ("find.value = ''; outcome.value = 'inconclusive'; outcome.dispatchEvent(new Event('change'))", True),
    (SHOWN, ["coarse"]),
    (
        "[...document.querySelectorAll('main section')].filter(part => !part.hidden)"
        ".map(part => part.firstElementChild.textContent)",
        ["Stability"],
    ),
    (f"outcome.value = ''; outcome.dispatchEvent(new Event('change')); {SHOWN}.length", len(RAN)),
    (f"{SORT}; {SORT}; {SHOWN}", ["good", "doubted", "bad", "coarse", "broken"]),  # within each section
    (f"{SORT}; {SHOWN}", ["bad", "doubted", "good", "broken", "coarse"]),
)
NUMBERS = (
    ("document.getElementById('found').textContent", f"{EVERY} of {EVERY}"),
    (f"flow.value = '13.02'; {TYPED}; {FOUND}.map(cells => cells[1])", ["13"] * 4),
    (f"flow.value = '13.4'; words.value = 'good'; {TYPED}; {FOUND}.map(cells => cells[1])", ["13"]),  # the nearest
    (f"flow.value = ''; words.value = 'good RR'; {TYPED}; {FOUND}.length", report.ROWS + 40),
    (f"words.value = 'good SS'; {TYPED}; {FOUND}.length", 0),
    (f"document.querySelector('[data-claim=good]').click(); {FOUND}.length", report.ROWS + 40),
    (f"{FOUND}[0].toSpliced(3, 1).join()", "reference,12,ωc rad/s,mujoco,12,1e-9, 12,0,3e-9,good"),
)
OPEN = "document.querySelectorAll('details').forEach(row => { row.open = true; }); document.documentElement.scrollWidth"
CONTRAST = """(() => {
    const light = colour => { const [r, g, b] = colour.match(/[\\d.]+/g).map(Number).map(v => v / 255)
        .map(v => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
        return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
    const ground = light(getComputedStyle(document.body).backgroundColor);
    return Math.min(...["body", ".soft", ".verdict.pass", ".verdict.fail", ".verdict.other", "dt", "a"].map(name => {
        const ink = light(getComputedStyle(document.querySelector(name)).color);
        return (Math.max(ink, ground) + 0.05) / (Math.min(ink, ground) + 0.05); }));
})()"""


@pytest.fixture
def tab(browser, page):
    """The page, which may have nothing to complain of and fetches nothing."""
    opened, wrong = browser.new_page(viewport={"width": 1200, "height": 844}), []
    opened.on("pageerror", lambda error: wrong.append(str(error)))
    opened.on("console", lambda message: wrong.append(message.text))
    opened.on("request", lambda request: wrong.append(request.url) if request.url.startswith("http") else None)
    opened.goto(f"{page.as_uri()}#good")
    yield opened
    opened.close()
    assert not wrong


@pytest.mark.parametrize("table", [FILTERED, NUMBERS], ids=["claims", "numbers"])
def test_claims_and_numbers_are_found(tab, table):
    tab.wait_for_function("document.getElementById('found').textContent")
    for asked, expected in table:
        assert tab.evaluate(asked) == expected, asked


@pytest.mark.parametrize("width", [390, 1200])
def test_nothing_runs_over_the_side_and_text_is_legible(tab, width):
    """All rows open, on a phone, too; text against its ground has the contrast 4.5 of WCAG AA, light and dark."""
    tab.set_viewport_size({"width": width, "height": 844})
    assert tab.evaluate(OPEN) <= width
    contrast = set()
    for scheme in ("light", "dark"):
        tab.emulate_media(color_scheme=scheme)
        contrast.add(tab.evaluate(CONTRAST))
    assert min(contrast) >= 4.5
    assert len(contrast) == 2


def test_an_address_opens_its_row_and_the_page_prints(tab):
    assert tab.evaluate(f"{ROWS}.filter(row => row.open).map(row => row.id)") == ["good"]
    printed = tab.pdf()
    assert printed.startswith(b"%PDF")
    assert len(re.findall(rb"/Type ?/Page\b[^s]", printed)) > 1


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("ω_c < A_z", "<i>ω</i><sub>c</sub> &lt; <i>A</i><sub>z</sub>"),
        ("ω̃_x, ω₀₂", "<i>ω̃</i><sub>x</sub>, <i>ω</i><sub>02</sub>"),
        ("η > j, ω_x⁰", "<i>η</i> &gt; <i>j</i>, <i>ω</i><sub>x</sub>⁰"),
        ("mRω₀², ρ_fν", "<i>mR</i><i>ω</i><sub>0</sub>², <i>ρ</i><sub>f</sub><i>ν</i>"),
        ("(g - Rω₀²)/c", "(<i>g</i> − <i>R</i><i>ω</i><sub>0</sub>²)/<i>c</i>"),
        ("r = 0.2 m, 8πρ_fνr/(jm)", "<i>r</i> = 0.2 m, 8<i>π</i><i>ρ</i><sub>f</sub><i>ν</i><i>r</i>/(<i>jm</i>)"),
        ("y = -3 m, it doesn't, K ρ^(2/3)", "<i>y</i> = −3 m, it doesn&#39;t, <i>K</i> <i>ρ</i><sup>2/3</sup>"),
        ("slip_x of run_of(m), test_j, RR, kg/m³, 2 cm", "slip_x of run_of(m), test_j, RR, kg/m³, 2 cm"),
        ("it rolls (R); A. R. Champneys", "it rolls (R); A. R. Champneys"),
    ],
)
def test_symbols_are_typeset_and_names_of_programs_are_not(text: str, shown: str) -> None:
    assert typeset(text) == shown
