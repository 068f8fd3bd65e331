"""Pages say what was found, show where results are missing, and hold pictures that a real browser
plays with."""

import base64
import dataclasses
import html
import json
import re
import zlib
from pathlib import Path
from typing import Any
from unittest import mock
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure

from compare.commands import validate
from compare.commands.bench import LEAGUE_PAGE
from compare.figures.drawing import Drawing, Evidence, GapError
from compare.figures.pages import typeset
from compare.figures.pictures import embedded, plain, svg
from compare.method.conditions import Conditions, state_of
from compare.method.record import Check, Missing, Records
from compare.plan import Level
from compare.report import deviations, gallery, report, results, wording
from compare.report.results import Summary
from compare.verification.claim import Claim, EngineVerdict, Outcome, Text, Verdict
from model import Parameters, StorageError
from tests import measured as made
from tests.commands import ROOT, told

pytestmark = pytest.mark.usefixtures("few_figures")
P = Parameters.named("reference")


def claim(name: str, **others: Any) -> Claim:
    return made.claim(
        name, source=f"Prop. {name}", statement=f"What {name} states of slip & <roll>.", **others
    )


def checks(count: int, deviation: float = 0.0, uncertainty: float = 1e-9) -> tuple[Check, ...]:
    """Made-up numbers, each as uncertain, the k-th off by k parts of `deviation`."""
    conditions = {
        "case": "RR",
        "start": "a start with a name that is rather long",
        "y": 0.02,
        "v_y": 0.0,
    }
    sets = [P.replace(omega_0=12.0 + k) for k in range(count)]
    rows = [
        dataclasses.replace(
            made.measured("settled", "omega_c", 12.0, 1e-9, p, **conditions),
            budget={"solver": 6e-10, "time_step": 8e-10},
        )
        for p in sets
    ]
    return tuple(
        Check(
            measurement=m,
            predicted=12.0 - deviation * (k + 1) / count,
            uncertainty=uncertainty,
            scale=12.0,
        )
        for k, m in enumerate(rows)
    )


def verdict(claim, outcome, checks=(), **others):
    return Verdict(claim=claim, outcome=outcome, checks=checks, **others)


LOST = {
    "error": "ValueError: diverged & <so> on",
    "missing": (Missing("thresholds", "rough-wall", "no flow <at which> it slips"),),
}
VERDICTS = (
    verdict(claim("good"), Outcome.CONFIRMED, checks(report.ROWS + 40)),
    verdict(claim("bad", text=Text.CORRECTED, reason="A sign."), Outcome.REFUTED, checks(3, 1e-3)),
    verdict(claim("coarse", section="Stability"), Outcome.INCONCLUSIVE, checks(2, 0.0, 1.0)),
    verdict(claim("broken", section="Stability"), Outcome.ERROR, **LOST),
    verdict(claim("doubted", expected=Outcome.REFUTED), Outcome.REFUTED, checks(2, 1e-3)),
    verdict(claim("deeper", section="Laws and cases"), Outcome.NOT_RUN),
)
RAN = [verdict for verdict in VERDICTS if verdict.outcome is not Outcome.NOT_RUN]


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory, few_figures: None) -> Path:
    records = Records(tuple(check.measurement for check in VERDICTS[0].checks))
    checks = {verdict.claim.id: verdict.checks for verdict in VERDICTS}
    evidence = Evidence(checks, records, tmp_path_factory.mktemp("results"))
    return report.write(evidence, VERDICTS, Summary.of(VERDICTS, Level.QUICK, {}))


def row(text: str, name: str) -> str:
    """The part of the page that belongs to a claim."""
    return re.split(r'<details class="claim"', text.split(f'id="{name}" data-id')[1])[0]


@pytest.mark.parametrize(
    ("where", "said"),
    [
        (
            "",
            "2 of 5 claims did not come out as expected: bad, broken; 1 of 5 claims can&#39;t be "
            "told",
        ),
        ("", "Not drawn: The user&#39;s own: it was not measured"),
        ("", r"Not part of this run: <code[^>]*>deeper</code>"),
        ("good", "What good states of slip &amp; &lt;roll&gt;."),
        ("", "Out of sight, so that an error of theory there would go unnoticed"),
        ("good", "dualball validate --claim good --quick -o"),
        (
            "good",
            r'title="time step 64 %, solver 36 %">1.0e-09<br><span class="soft">time step 64 %<',
        ),
        ("bad", "Prop. bad, corrected. A sign."),
        ("bad", "Expected: confirmed."),
        ("broken", "ValueError: diverged &amp; &lt;so&gt; on"),
        ("broken", "rough-wall: no flow &lt;at which&gt; it slips"),
        ("coarse", r"\? inconclusive"),
        ("doubted", 'class="verdict other"'),  # a refutation that was expected is no failure
        ("doubted", "^((?!Expected:).)*$"),
    ],
)
def test_what_the_page_says_of_all_and_of_a_claim(page, where, said):
    text = page.read_text("utf-8")
    assert re.search(said, row(text, where) if where else text, re.DOTALL)


def test_the_worst_numbers_come_first_no_section_is_empty_and_nothing_is_fetched(page, tmp_path):
    text = page.read_text("utf-8")
    assert row(text, "good").count("<td>settled</td>") == report.ROWS
    worst = [float(value) for value in re.findall(r"<td>([-+][\d.e-]+)</td>", row(text, "bad"))]
    assert worst == sorted(worst, reverse=True)
    assert "<h3>Laws and cases</h3>" not in text
    assert not re.search(r'(?:src|href)="(?!#|data:|runs/|https://doi\.org)', text)
    empty = report.write(Evidence(directory=tmp_path), [], Summary.of([], Level.QUICK, {}))
    assert "Nothing has been checked yet" in empty.read_text("utf-8")


def test_every_number_is_on_the_page():
    both = *checks(1), *checks(1, 0.5)
    m = dataclasses.replace(both[0].measurement, value=12.3456789, uncertainty=2.3e-4)
    alone = dataclasses.replace(
        m, quantity="case", value=1.0, uncertainty=0.0, at={"start": "rest"}
    )
    check, far = (dataclasses.replace(each, measurement=m) for each in both)
    again = dataclasses.replace(m)  # a copy, as another process returns it
    columns = report.columns(Records((again, alone)), {"good": (check,), "bad": (far,)})
    assert columns["claim"] == ["good", "bad", ""]
    assert columns["measured"] == [12.34568, 12.34568, "RS"]  # rounded to what is known
    assert columns["predicted"] == [12.0, 11.5, ""]
    assert columns["mark"] == ["fail", "fail", ""]
    assert columns["quantity"] == ["ω_c rad/s"] * 2 + ["case"]
    packed = json.loads(zlib.decompress(base64.b64decode(report.packed(columns))))
    assert packed.pop("typeset")["ω_c rad/s"] == "ω<sub>c</sub> rad/s"
    assert packed == columns


def test_a_claim_has_one_line_of_a_terminal():
    for verdict in (*VERDICTS, dataclasses.replace(RAN[0], checks=(), error="it broke " * 30)):
        shown = validate.line(verdict).plain
        assert len(shown) <= validate.WIDTH
        assert "\n" not in shown
        assert verdict.claim.id in shown
    assert len(validate.head().plain) <= validate.WIDTH


def test_the_first_screen_answers_what_engines_get_right():
    def by(engine: str, outcome: Outcome) -> EngineVerdict:
        return EngineVerdict(engine=engine, outcome=outcome, deviations=(0.01,))

    right, wrong = (
        dataclasses.replace(RAN[0], claim=claim(name), engines=(by("mujoco-plain", outcome),))
        for name, outcome in (("good", Outcome.CONFIRMED), ("bad", Outcome.REFUTED))
    )
    first = wording.answers([right, wrong])[0]
    assert first["question"] == wording.QUESTIONS["mujoco-plain"]
    assert (first["confirmed"], first["asked"]) == ("1", "2")
    assert [each.id for each in first["wrong"]] == ["bad"]
    assert first["subjects"] == ["Stationary states 1/2"]
    false = dataclasses.replace(wrong, claim=claim("bad", expected=Outcome.REFUTED))
    (as_it_should,) = wording.answers([false])
    assert (as_it_should["wrong"], as_it_should["due"]) == ([], 1)


def test_verdicts_are_said_alike_in_the_terminal_on_the_page_and_in_the_summary(page):
    text = html.unescape(page.read_text("utf-8"))
    summary = validate.summary(VERDICTS, Path("report.html")).plain
    for verdict in RAN:
        for heading, found in wording.findings(verdict).items():
            assert f"{heading.lower()} {found}" in validate.detail(verdict).plain
            assert f"<dt>{heading}</dt>" in row(text, verdict.claim.id)
            assert html.unescape(typeset(found)) in row(text, verdict.claim.id)
    totals = map(" ".join, wording.totals(RAN))
    for said in (wording.headline(RAN), wording.coarse_and_missing(RAN), *totals):
        assert said in summary
        assert said in re.sub("</?b>", " ", text)
    m = dataclasses.replace(checks(1)[0].measurement, quantity="case")
    # Counts have no tolerance.
    for predicted, said in ((12.0, "none: all equal"), (1.0, "not equal: case, reference")):
        check = Check(measurement=m, predicted=predicted, uncertainty=0.0, scale=1.0)
        found = wording.findings(dataclasses.replace(RAN[0], checks=(check,)))
        assert found == {"Largest deviation": said}
    bad = results.load(page.parent).verdicts["bad"]
    assert [bad[name] for name in ("id", "verdict", "expected")] == ["bad", "refuted", "confirmed"]
    assert bad["passed"] is False
    assert (bad["checks"], bad["agrees"]) == (len(VERDICTS[1].checks), 0)
    assert results.described(VERDICTS[1])["checks"][0]["conditions"]["y"] == 0.02


def test_a_figure_of_several_claims_is_drawn_once_or_is_a_gap(tmp_path, monkeypatch):
    fall, lost = lambda _: (Figure(figsize=(1, 1)), ""), GapError("the run <is> lost")
    figures = {
        "fall": Drawing("A fall", lambda _: None, fall, ("good", "bad")),
        "gap": Drawing("A gap", lambda _: None, mock.Mock(side_effect=lost), ("good",)),
    }

    def figures_of(claim):
        return {name: each for name, each in figures.items() if claim in each.claims}

    monkeypatch.setattr(report, "FIGURES", {})
    monkeypatch.setattr(report, "figures_of", figures_of)
    page = report.write(Evidence(directory=tmp_path), VERDICTS[:2], Summary.of([], Level.QUICK, {}))
    text = page.read_text("utf-8")
    assert text.count('<figure class="plot"') == 1
    assert '<a href="#figure-fall">A fall</a>: see good.' in row(text, "bad")
    assert "A gap is not drawn: the run &lt;is&gt; lost" in row(text, "good")


@pytest.mark.parametrize(
    ("part", "other", "message"),
    [
        (
            '"schema_version": 6',
            '"schema_version": 4',
            "holds no summary that this program reads: .* another format",
        ),
        ('"dualball": "[^"]*"', '"dualball": "0.0.0"', "holds results of dualball 0.0.0"),
    ],
)
def test_a_foreign_summary_is_refused_in_one_line(tmp_path, part, other, message):
    results.save(Summary.of([], Level.QUICK, {}), tmp_path)
    path = tmp_path / results.SUMMARY
    path.write_text(re.sub(part, other, path.read_text("utf-8"), count=1, flags=re.DOTALL))
    with pytest.raises(StorageError, match=message) as refusal:
        results.open_directory(tmp_path)
    assert "\n" not in str(refusal.value)


def test_a_picture_is_drawn_once(tmp_path):
    drawing = Drawing("t", lambda _: None, lambda data: (Figure(figsize=(1, 1)), f"<&> {data}"))
    given = path, _, data = tmp_path / "made.svg", drawing, ("a", 1.0)
    assert gallery.kept(*given) is None
    first = gallery.drawn(given)
    ElementTree.parse(path)
    assert first["picture"].startswith("<svg")
    assert first["caption"] == f"<&> {data}"
    assert "desc" not in first["picture"]
    assert gallery.kept(*given) == first
    assert gallery.kept(path, drawing, ("a", 2.0)) is None
    with mock.patch.object(gallery, "sources", return_value="the program changes"):
        assert gallery.kept(*given) is None
    path.write_text("something else")
    assert gallery.kept(*given) is None


def test_errata_are_the_documented_ones():
    text, documented = report.errata(), (ROOT / "docs" / "errata.md").read_text("utf-8")
    assert text.count("<tr>") == sum(line.startswith("|") for line in documented.splitlines()) - 1
    assert "<a href" not in re.sub(r'<a href="https?:', "", text)
    assert "<h1>" not in text


OPEN = (
    "document.querySelectorAll('details').forEach(row => { row.open = true; }); "
    "document.documentElement.scrollWidth"
)
CONTRAST = """(() => {
    const light = colour => {
        const [r, g, b] = colour.match(/[\\d.]+/g).map(Number).map(v => v / 255)
        .map(v => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
        return 0.2126 * r + 0.7152 * g + 0.0722 * b; };
    const ground = light(getComputedStyle(document.body).backgroundColor);
    const shown = ["body", ".soft", ".verdict.pass", ".verdict.fail", ".verdict.other", "dt", "a"];
    return Math.min(...shown.map(name => {
        const ink = light(getComputedStyle(document.querySelector(name)).color);
        return (Math.max(ink, ground) + 0.05) / (Math.min(ink, ground) + 0.05); }));
})()"""


def test_claims_are_found_and_sorted_and_numbers_found(tab, page):
    tab.goto(f"{page.as_uri()}#good")

    def shown():
        return tab.locator("details.claim:visible").evaluate_all("rows => rows.map(row => row.id)")

    tab.fill("#find", "slip PROP. bro")
    assert shown() == ["broken"]
    tab.fill("#find", "")
    tab.select_option("#outcome", "inconclusive")
    assert shown() == ["coarse"]
    tab.select_option("#outcome", "")
    for order in (
        ["bad", "doubted", "good", "broken", "coarse"],
        ["good", "doubted", "bad", "coarse", "broken"],
    ):
        tab.click("[data-sort=id]")
        assert shown() == order  # within each section

    def found(flow, words):
        tab.fill("#flow", flow)
        tab.fill("#words", words)
        return [line.split("\t") for line in tab.locator("#numbers-found tr").all_inner_texts()]

    assert [cells[1] for cells in found("13.02", "")] == ["13"] * 4
    assert [cells[1] for cells in found("13.4", "good")] == ["13"]  # the nearest
    assert found("", "good SS") == []
    assert len(found("", "good RR")) == report.ROWS + 40
    tab.click("[data-claim=good]")
    assert tab.input_value("#words") == "good"
    first = found("", "good")[0]
    assert first[:3] + first[4:] == [
        "reference",
        "12",
        "ωc rad/s",
        "mujoco",
        "12",
        "1e-9",
        "12",
        "0",
        "3e-9",
        "good",
    ]


def test_an_address_opens_its_row_nothing_runs_over_the_side_and_the_page_is_legible_and_prints(
    tab, page
):
    """All rows open, on a phone, too; text against its ground has the contrast 4.5 of WCAG AA,
    light and dark."""
    tab.goto(f"{page.as_uri()}#good")
    assert tab.locator("details.claim[open]").evaluate_all("rows => rows.map(row => row.id)") == [
        "good"
    ]
    for width in (390, 1200):
        tab.set_viewport_size({"width": width, "height": 844})
        assert tab.evaluate(OPEN) <= width
    contrast = set()
    for scheme in ("light", "dark"):
        tab.emulate_media(color_scheme=scheme)
        contrast.add(tab.evaluate(CONTRAST))
    assert min(contrast) >= 4.5
    assert len(contrast) == 2
    printed = tab.pdf()
    assert printed.startswith(b"%PDF")
    assert len(re.findall(rb"/Type ?/Page\b[^s]", printed)) > 1


def test_conditions_are_said_with_their_units_and_a_state_without_what_is_zero():
    at = Conditions(case="RS", side="from above", time=0.25, rate=-2.0, mode=2.0)
    said = "case RS, from above, t = 0.25 s, rate = -2 rad/s², mode = 2"
    state = state_of(np.array([0.0, 0.0, 12.5, 0.0, 0.0, 0.0, 0.02, 0.0]))
    assert wording.conditions(at | state) == f"{said}, ω_c = 12.5 rad/s, h = 0.02 m"
    assert wording.conditions(Conditions(nu_f=1e-6, rho_b=7850.0)) == (
        "nu f = 1e-06 m²/s, rho b = 7850 kg/m³"
    )


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("ω̃_x, ω₀₂ > A_z, v_y", "ω̃<sub>x</sub>, ω₀₂ &gt; A<sub>z</sub>, v<sub>y</sub>"),
        ("(g - Rω₀²)/c, 8πρ_fνr/(jm)", "(g − Rω₀²)/c, 8πρ<sub>f</sub>νr/(jm)"),
        ("y = -3 m, it doesn't, K ρ^(2/3)", "y = −3 m, it doesn&#39;t, K ρ<sup>2/3</sup>"),
        (
            "slip_x of run_of(m), test_j, RR, kg/m³, 2 cm",
            "slip_x of run_of(m), test_j, RR, kg/m³, 2 cm",
        ),
    ],
)
def test_indices_are_set_below_and_names_of_programs_are_not(text, shown):
    assert typeset(text) == shown


def figure_of_two():
    figure = Figure(figsize=(4, 3))
    axes = figure.add_subplot()
    axes.plot([1.0, 10.0], [0.0, 4.0], label="_a line")
    axes.errorbar([1.0, 10.0], [1.0, 3.0], [0.1, 0.2], ls="none", marker="o", label="$ω_0$ marks")
    axes.set(
        xscale="log", xlabel="$\\omega_0$ (rad/s)", ylabel="height", xlim=(0.5, 20), ylim=(-1, 5)
    )
    return figure


def test_series_and_scales_are_in_the_picture_and_letters_are_shared():
    text = svg(figure_of_two())
    assert text == svg(figure_of_two())  # equal figures give equal text
    assert plain("$\\tilde{ω}_{x}$ (rad/s)") == "ω̃_x (rad/s)"
    assert plain("$\\Omega_0 = \\omega_0\\sqrt{R/g}$") == "Ω_0 = ω_0√(R/g)"
    series = re.findall('data-series="([^"]*)"', text)
    assert series.count("a line") == 1
    assert series.count("ω&lt;sub&gt;0&lt;/sub&gt; marks") == 2  # and bars
    (axes,) = re.findall('data-axes="([^"]*)"', text)
    assert "ω&lt;sub&gt;0&lt;/sub&gt; (rad/s)" in axes
    ElementTree.fromstring(text)
    figure = Figure(figsize=(2, 2))
    figure.add_subplot().plot(range(30), range(30), "o", label="many")
    text = svg(figure)  # marks that look alike are one path
    (way,) = re.findall('data-series="many">.*?<path d="(M[^"]*)" fill="none"', text)
    assert len(way.split()) == 1 + 2 * 30
    assert text.count("<use") < 20  # of ticks
    # Pictures of a page share letters and nothing else.
    pictures, letters = embedded({"a": svg(figure_of_two()), "b": svg(figure_of_two())})
    of = {name: set(re.findall('id="([^"]*)"', text)) for name, text in pictures.items()}
    there = set(re.findall('id="([^"]*)"', letters))
    assert of["a"]
    assert there
    assert not of["a"] & of["b"]
    for name, text in pictures.items():
        assert set(re.findall(r'(?:url\(|href=")#([\w-]+)', text)) <= of[name] | there


@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_the_league_page_answers(browser, tab, tmp_path, capsys):
    """Values under the pointer, a series switched off, zoom; without scripts the picture."""
    names = [f"tests.exact_engine:{name}" for name in ("EXACT", "ROUGH")]
    told(
        capsys,
        f"league --quick --engine {names[0]} --engine {names[1]} --workers 1 --quiet -o {tmp_path}",
    )
    page = tmp_path / LEAGUE_PAGE
    assert "Copyright Timmy Willison" in page.read_text("utf-8")  # of what zooms
    tab.goto(page.as_uri())
    figure = tab.locator("figure.plot")
    figure.scroll_into_view_if_needed()
    figure.locator(".series label").first.wait_for()  # a figure answers from when it is first seen
    assert figure.locator(".series label").all_inner_texts() == names
    mark = figure.locator(f'[data-series="{names[1]}"] use').first
    place = mark.bounding_box()
    tab.mouse.move(place["x"] + place["width"] / 2, place["y"] + place["height"] / 2)
    assert figure.locator("output").inner_text().startswith(names[1])
    figure.get_by_label(names[1]).uncheck()
    assert not mark.is_visible()
    figure.get_by_label("closer").click()
    tab.wait_for_timeout(300)
    assert "scale(1" in figure.locator("svg").evaluate("picture => picture.style.transform")
    dumb = browser.new_context(java_script_enabled=False).new_page()
    dumb.goto(page.as_uri())
    assert dumb.locator("figure.plot svg").bounding_box()["height"] > 100
    dumb.context.close()


def test_deviations_are_told_in_uncertainties_by_engine_and_quantity_each_number_once():
    first, *others = checks(4, 4.4e-9)
    by_solver = dataclasses.replace(first.measurement, budget={"drift": 1e-9, "solver": 2e-9})
    own = (dataclasses.replace(first, measurement=by_solver), *others)
    said = EngineVerdict(engine="mujoco", outcome=Outcome.REFUTED, checks=own)
    twice = [
        Verdict(claim=claim(name), outcome=Outcome.REFUTED, checks=own, engines=(said,))
        for name in ("one", "two")
    ]
    whole, solved, shown, of_orbits = deviations.distribution(twice)
    assert (whole.engine, whole.quantity, of_orbits.quantity) == ("mujoco", "", "ω_c")
    assert whole.sizes == of_orbits.sizes == pytest.approx([1.1, 2.2, 3.3, 4.4], rel=1e-5)
    assert (solved.quantity, solved.sizes) == (deviations.LIMITED, whole.sizes[:1])
    assert (shown.quantity, shown.sizes) == (deviations.OTHERS, whole.sizes[1:])
    assert [whole.beyond(n) for n in (1, 2, 3)] == [1.0, 0.75, 0.5]
