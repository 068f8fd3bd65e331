"""Pictures on pages hold series and scales, and a browser makes of them what a reader can play with."""

import re
from xml.etree import ElementTree

import pytest
from matplotlib.figure import Figure

from compare.commands.bench import LEAGUE_PAGE
from compare.kit.pictures import embedded, plain, svg
from tests.commands import told


def made():
    figure = Figure(figsize=(4, 3))
    axes = figure.add_subplot()
    axes.plot([1.0, 10.0], [0.0, 4.0], label="_a line")
    axes.errorbar([1.0, 10.0], [1.0, 3.0], [0.1, 0.2], ls="none", marker="o", label="$ω_0$ marks")
    axes.set(xscale="log", xlabel="$\\omega_0$ (rad/s)", ylabel="height", xlim=(0.5, 20), ylim=(-1, 5))
    return figure


def test_series_and_scales_are_in_the_picture():
    text = svg(made())
    assert text == svg(made())  # equal figures give equal text
    series = re.findall('data-series="([^"]*)"', text)
    assert series.count("a line") == 1
    assert series.count("&lt;i&gt;ω&lt;/i&gt;&lt;sub&gt;0&lt;/sub&gt; marks") == 2  # and bars
    (axes,) = re.findall('data-axes="([^"]*)"', text)
    assert "&lt;i&gt;ω&lt;/i&gt;&lt;sub&gt;0&lt;/sub&gt; (rad/s)" in axes
    ElementTree.fromstring(text)


def test_marks_that_look_alike_are_one_path():
    figure = Figure(figsize=(2, 2))
    figure.add_subplot().plot(range(30), range(30), "o", label="many")
    text = svg(figure)
    (way,) = re.findall('data-series="many">.*?<path d="(M[^"]*)" fill="none"', text)
    assert len(way.split()) == 1 + 2 * 30
    assert text.count("<use") < 20  # of ticks


def test_pictures_of_a_page_share_letters_and_nothing_else():
    pictures, letters = embedded({"a": svg(made()), "b": svg(made())})
    of = {name: set(re.findall('id="([^"]*)"', text)) for name, text in pictures.items()}
    there = set(re.findall('id="([^"]*)"', letters))
    assert of["a"]
    assert there
    assert not of["a"] & of["b"]
    for name, text in pictures.items():
        assert set(re.findall(r'(?:url\(|href=")#([\w-]+)', text)) <= of[name] | there


@pytest.mark.parametrize(
    ("label", "read"),
    [("$\\tilde{ω}_{x}$ (rad/s)", "ω̃_x (rad/s)"), ("$\\Omega_0 = \\omega_0\\sqrt{R/g}$", "Ω_0 = ω_0√(R/g)")],
)
def test_labels_are_read_without_tex(label, read):
    assert plain(label) == read


@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_the_league_page_answers(browser, tab, tmp_path, capsys):
    """Values under the pointer, a series switched off, zoom; without scripts the picture."""
    names = [f"tests.compare.test_runner:{name}" for name in ("EXACT", "ROUGH")]
    told(capsys, f"league --quick --engine {names[0]} --engine {names[1]} --workers 1 --quiet -o {tmp_path}")
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
