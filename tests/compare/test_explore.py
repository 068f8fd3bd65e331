"""The page to play with follows sliders and clicks in a real browser, saves what it shows, and serves nobody else."""

import base64
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request

import pytest

from compare.view import explore
from model import InputError, Parameters, State, storage
from tests.commands import refused, started

P = Parameters.named("reference")


@pytest.fixture(scope="module")
def address():
    """Of a server of its own, which Ctrl-C must end."""
    pytest.importorskip("nicegui")
    with socket.socket() as free:
        free.bind((explore.HOST, 0))
        port = free.getsockname()[1]
    with started("explore", "--no-browser", "--port", port, stderr=subprocess.PIPE) as server:
        assert server.stdout
        assert f"http://{explore.HOST}:{port}" in server.stdout.readline()
        for _ in range(100):
            with socket.socket() as tried:
                if tried.connect_ex((explore.HOST, port)) == 0:
                    break
            signal.sigtimedwait([], 0.1)
        yield f"http://{explore.HOST}:{port}/"
        server.send_signal(signal.SIGINT)
        _, error = server.communicate(timeout=20)
        assert server.returncode == 130
        assert "Traceback" not in error


def test_what_is_moved_clicked_and_typed_shows_and_is_saved(browser, address, tmp_path):
    expect = pytest.importorskip("playwright.sync_api").expect
    expect.set_options(timeout=60_000)  # until theory is compiled
    page, other = (browser.new_page(viewport={"width": 1500, "height": 900}) for _ in range(2))
    for tab in (page, other):
        tab.goto(address)
        tab.wait_for_selector(".map .nsewdrag", timeout=60_000)

    def shows(text):
        page.wait_for_function("t => document.querySelector('.said').innerText.includes(t)", arg=text)

    def click(where, x, y, tab=page):
        box = tab.locator(where).bounding_box()
        place = box["x"] + box["width"] * x, box["y"] + box["height"] * y
        tab.mouse.move(*place)
        tab.wait_for_timeout(300)  # plotly looks for the point below when the pointer rests
        tab.mouse.click(*place)

    shows("RR at ωc = 12")
    click("[aria-label=omega_0]", 25 / 80, 0.5)
    shows("SS at ωc = ")
    click(".map .nsewdrag", 0.5, 0.5)  # eta = 0.6, omega_0 = 40
    shows("NR at ωc = 40")
    click(".curve .nsewdrag", 0.75, 0.25)  # omega_0 = 60, from omega_c = 60
    shows("NR at ωc = 60")
    moving = page.frame_locator(".motion")
    expect(moving.locator("#case")).to_have_text("NR")
    place = moving.locator("#place").input_value()
    expect(moving.locator("#place")).not_to_have_value(place)  # it plays
    for button, name in (("Set as TOML", "set.toml"), ("Run as HDF5", "run.h5")):
        with page.expect_download() as saved:
            page.get_by_text(button).click()
        saved.value.save_as(tmp_path / name)
    number = page.locator("input[type=number]").first
    number.fill("-3")
    number.press("Tab")
    page.wait_for_selector("text=mu = -3 is out of range")
    expect(number).to_have_value("0.2")
    assert "RR at ωc = 12" in other.inner_text(".said")
    click(".curve .nsewdrag", 0.75, 0.25, other)
    other.close()  # in the middle of a run, of which the server says nothing in the end
    page.close()
    p, run = Parameters.load(tmp_path / "set.toml"), storage.load(tmp_path / "run.h5")
    assert (p.eta, p.omega_0) == (pytest.approx(0.6, abs=0.02), pytest.approx(60, abs=1.5))
    assert run.header.parameters == p
    assert run.omega_c[0] == pytest.approx(60, abs=1.5)


def test_a_run_is_saved_that_is_not_simulated_yet(browser, address):
    """Two files are asked for at once, as soon as there are buttons: both come."""
    page, saved = browser.new_page(), []
    page.on("download", lambda each: saved.append(each.suggested_filename))
    page.goto(address)
    for text in ("Run as HDF5", "Set as TOML"):
        page.get_by_text(text).click()
    for _ in range(600):
        if len(saved) == 2:
            break
        page.wait_for_timeout(100)
    assert sorted(saved) == ["run.h5", "set.toml"]
    page.close()


@pytest.mark.slow
def test_a_browser_that_is_busy_keeps_its_set(browser, address):
    """As one that draws in 3-D without a graphics card on a busy machine: its connection is lost meanwhile."""
    page = browser.new_page()
    page.goto(address)
    page.wait_for_function("document.querySelector('.said')?.innerText.includes('RR')")
    number = page.locator("input[type=number]").last
    number.fill("25")
    page.wait_for_function("document.querySelector('.said').innerText.includes('SS')")
    page.evaluate("const end = Date.now() + 14e3; while (Date.now() < end);")
    page.wait_for_timeout(3000)
    assert number.input_value() == "25"
    page.close()


def test_nobody_else_is_served(address, capsys):
    asked = urllib.request.Request(address, headers={"Host": "example.org"})
    with pytest.raises(urllib.error.HTTPError, match="400"):
        urllib.request.urlopen(asked, timeout=10)
    port = address.strip("/").rsplit(":", 1)[1]
    said = refused(capsys, f"explore --no-browser --port {port}")
    assert f"port {port} is in use; choose another one by --port" in said


def test_without_the_extra_it_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "nicegui", None)
    with pytest.raises(InputError, match=r"pip install 'dualball\[explore\]'"):
        explore.serve(P, 8080, show=False)


@pytest.mark.parametrize("changes", [{}, {"eta": 0.6}, {"mu": 0.0, "eta": 0.0}, {"c": 0.0}, {"drag": "quadratic"}])
def test_every_set_has_its_figures_and_a_motion(changes):
    p = P
    for name, value in changes.items():
        p = explore.with_value(p, name, value)
    curve, plane = explore.characteristic(p, 0.0, 80.0), explore.regions(p, 80.0)
    assert "Settles to: " in explore.in_words(p)
    assert curve["data"][0]["type"] == plane["data"][0]["type"] == "heatmap"
    cells = base64.b64decode(plane["data"][0]["z"]["bdata"])
    assert len(cells) == len(plane["data"][0]["x"]) * len(plane["data"][0]["y"])
    assert max(cells) < plane["data"][0]["zmax"]
    assert explore.simulated(p, State(omega_c=5.0)).complete


def test_a_slider_changes_the_set():
    assert explore.with_value(P, "kappa", 0.5).kappa == pytest.approx(0.5)
    assert explore.with_value(P, "drag", "schiller-naumann").nu_f == explore.OIL
    with pytest.raises(InputError, match="j = 2"):
        explore.with_value(P, "j", 2.0)
