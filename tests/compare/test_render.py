"""Pages, and the page to play with, show the ball where it is, or say
why they can't."""

import base64
import dataclasses
import io
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import parse_qsl

import numpy as np
import pytest
from PIL import Image

import analytic
import mjsim
from compare.campaign import compiling
from compare.view import explore, geometry, page
from model import Case, InputError, Parameters, State, storage
from tests.commands import refused, started, told

P = Parameters.named("reference")


@pytest.fixture(scope="module")
def run():
    """Two-point slipping, and rolling before."""
    return mjsim.simulate(P.replace(omega_0=25.0), [0, 0, 13.0, 0, 0, 0], 0.8, sample_interval=0.01)


FEW_FRAMES = """const wait = requestAnimationFrame;
requestAnimationFrame = show => setTimeout(() => wait(show), 300);"""
"""Each is drawn without a graphics card, in a large part of a second."""


def shows(tab, where, text):
    """Wait until a part of a page has this in its text: theory may be compiled before."""
    says = "([w, t]) => document.querySelector(w)?.innerText.includes(t)"
    tab.wait_for_function(says, arg=[where, text], timeout=120_000)


def test_a_page_plays_in_a_browser_without_network(tab, run, tmp_path, capsys):
    """Frames, numbers and the case follow the slider; where a contact is open there is no slip to
    tell."""
    pytest.importorskip("nicegui")
    stored, file = tmp_path / "run.h5", tmp_path / "run.html"
    storage.save(run, stored)
    said = told(capsys, f"render {stored} -o {file} --at 0.1 --speed 0.5 --rate 50")
    assert said.endswith(": 71 frames")  # ends of 0.7 s of the run
    assert file.stat().st_size < 3e6
    tab.add_init_script(FEW_FRAMES)
    tab.goto(file.as_uri())
    tab.wait_for_function("document.querySelector('#place').value > 3")  # it plays by itself
    for k, time in ((0, 0.1), (70, 0.8)):
        tab.locator("#place").fill(str(k))
        shows(tab, "#now", f"t = {time:.3f} s")
        now = geometry.resampled(run, np.array([time]))
        assert tab.locator("#case").inner_text() == Case(now.case[0]).name
        assert f"ωc = {now.omega_c[0]:.2f} rad/s" in tab.locator("#numbers").inner_text()
    assert tab.locator("#play").inner_text() == "Play"
    # All of the vessel is seen, however high the ball flies: above it the picture is white.
    flies = analytic.simulate(P, [0.05, 0, 8.0, 0, 0, 0, 0.03, -0.3], 0.05)
    page.save(flies, file)
    tab.goto(file.as_uri())
    shows(tab, "#numbers", "slip: floor –, wall –")
    seen = Image.open(io.BytesIO(tab.locator("#view").screenshot())).convert("RGB")
    edge = np.asarray(seen)[3:6, seen.width // 2 :]
    assert edge[:, :-20].min() == 255
    assert np.asarray(seen)[:, seen.width // 2 :].min() < 255


def test_a_ball_that_rolls_turns_about_its_contacts():
    """Turned the other way, they would go along twice as fast as it."""
    run = mjsim.simulate(P.replace(omega_0=5.0), [0, 0, 5.0, 0, 0, 0], 0.05, sample_interval=0.005)
    seen = geometry.geometry(run, run)
    turned = (seen.turns[1:] * seen.turns[:-1].inv()).as_matrix()
    arms = np.einsum("nab,cnb->cna", turned, (seen.contacts - seen.centres)[:, :-1])
    moved = seen.centres[1:] + arms - seen.contacts[:, :-1]
    # to the second order of the step
    assert np.abs(moved).max() < 0.1 * np.abs(np.diff(seen.centres, axis=0)).max()


def test_a_run_is_shown_between_its_samples(run):
    k = int(np.flatnonzero(np.diff(run.case))[0])
    between = geometry.resampled(run, np.array([0.6 * run.time[k] + 0.4 * run.time[k + 1], 0.8]))
    assert between.omega_c == pytest.approx(
        [0.6 * run.omega_c[k] + 0.4 * run.omega_c[k + 1], run.omega_c[-1]]
    )
    assert between.force_A[1] == pytest.approx(run.force_A[-1])
    assert between.case.tolist() == [run.case[k], run.case[-1]]


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("nowhere/p.html", {}, "there is no directory nowhere"),
        (
            "p.html",
            {"at": 9.0},
            r"at = 9 s is out of range: to be within the run it must be >= 0 and <= 0\.8$",
        ),
        (
            "p.html",
            {"speed": 0.05, "rate": 1000},
            r"1\.6e\+04 frames are more than 8000: choose a shorter time, or",
        ),
        (
            "p.html",
            {"rate": 10},
            r"needs NiceGUI, which has three\.js: pip install 'nicegui>=3.18'",
        ),
    ],
)
def test_what_cannot_be_shown(run, here, monkeypatch, name, options, message):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(InputError, match=message):
        page.save(run, Path(name), **options)
    assert not list(here.iterdir())


@contextmanager
def served():
    """The address of a server of its own, which Ctrl-C must end."""
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
        try:
            yield f"http://{explore.HOST}:{port}/"
        finally:
            server.send_signal(signal.SIGINT)
        _, error = server.communicate(timeout=20)
        assert server.returncode == 130
        assert "Traceback" not in error


@pytest.fixture(scope="module")
def address():
    with served() as found:
        yield found


@pytest.mark.slow
def test_a_page_whose_motion_waits_for_numba_says_so(browser, tmp_path, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    with served() as address:
        page = browser.new_page()
        page.goto(address)
        shows(page, ".steady", f"The motion waits: {compiling.KEPT}.")
        shows(page, ".steady", "After 10 s: ")
        page.close()


def test_what_is_moved_clicked_and_typed_shows_and_is_saved(browser, address, tmp_path):
    expect = pytest.importorskip("playwright.sync_api").expect
    expect.set_options(timeout=60_000)  # until theory is compiled
    page, other = (browser.new_page(viewport={"width": 1500, "height": 900}) for _ in range(2))
    for each in (page, other):
        each.add_init_script(FEW_FRAMES)
    other.goto(address)
    # A run is saved that is not simulated yet: two files are asked for at once, as soon as there
    # are buttons.
    with (
        other.expect_download(lambda each: each.suggested_filename == "run.h5", timeout=60_000),
        other.expect_download(lambda each: each.suggested_filename == "set.toml", timeout=60_000),
    ):
        other.get_by_text("Run as HDF5").click()
        other.get_by_text("Set as TOML").click()
    page.goto(address)
    for tab in (page, other):
        tab.wait_for_selector(".map .nsewdrag", timeout=60_000)

    def click(where, x, y, tab=page):
        box = tab.locator(where).bounding_box()
        place = box["x"] + box["width"] * x, box["y"] + box["height"] * y
        tab.mouse.move(*place)
        tab.wait_for_timeout(300)  # plotly looks for the point below when the pointer rests
        tab.mouse.click(*place)

    shows(page, ".said", "RR at ωc = 12")
    click("[aria-label=omega_0]", 25 / 80, 0.5)
    shows(page, ".said", "SS at ωc = ")
    click(".map .nsewdrag", 0.5, 0.5)  # eta = 0.6, omega_0 = 40
    shows(page, ".said", "NR at ωc = 40")
    click(".curve .nsewdrag", 0.75, 0.25)  # omega_0 = 60, from omega_c = 60
    shows(page, ".said", "NR at ωc = 60")
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


def test_a_link_is_a_setting_and_a_telephone_shows_all(browser, address):
    page = browser.new_page(viewport={"width": 390, "height": 844})
    page.add_init_script(FEW_FRAMES)
    page.goto(f"{address}?omega_0=25&eta=0.25&start=5")
    shows(page, ".said", "SS at ωc = ")
    shows(page, ".about", "Left out are rolling resistance")
    shows(page, ".cases", "NR is off the floor, rolls on the wall")
    shows(page, ".steady", "After 10 s: ")
    assert page.locator(".cases svg").count() == len(Case)
    assert page.evaluate("document.documentElement.scrollWidth") == 390
    number = page.locator("input[type=number]").last
    number.fill("12")
    number.press("Tab")
    page.wait_for_function("location.search == '?eta=0.25&omega_0=12&start=5'")
    page.goto(f"{address}?mu=-3")
    page.wait_for_selector("text=The address can't be followed: mu = -3 is out of range")
    shows(page, ".said", "RR at ωc = 12")
    page.close()


@pytest.mark.slow
def test_a_browser_that_is_busy_keeps_its_set(browser, address):
    """As one that draws in 3-D without a graphics card on a busy machine: its connection is lost
    meanwhile."""
    page = browser.new_page()
    page.goto(address)
    shows(page, ".said", "RR")
    number = page.locator("input[type=number]").last
    number.fill("25")
    shows(page, ".said", "SS")
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


@pytest.mark.parametrize("path", ["", "motion", "_nicegui_ws/socket.io/?EIO=4&transport=polling"])
def test_pages_of_other_sites_are_not_answered(address, path):
    own, foreign = address.strip("/"), ("http://example.org", "null", "http://127.0.0.1:1")
    for origin, answer in [(own, 200), *((each, 403) for each in foreign)]:
        asked = urllib.request.Request(address + path, headers={"Origin": origin})
        try:
            got = urllib.request.urlopen(asked, timeout=10)
        except urllib.error.HTTPError as error:
            got = error
        with got:
            assert got.status == answer, origin
            assert answer == 200 or "access-control-allow-origin" not in got.headers
    upgrade = {"Connection": "Upgrade", "Upgrade": "websocket", "Origin": "http://example.org"}
    upgrade |= {"Sec-WebSocket-Version": "13", "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA=="}
    url = f"{address}_nicegui_ws/socket.io/?EIO=4&transport=websocket"
    with pytest.raises(urllib.error.HTTPError, match="403") as refusal:
        urllib.request.urlopen(urllib.request.Request(url, headers=upgrade), timeout=10)
    refusal.value.close()


@pytest.mark.slow
def test_who_is_slow_with_headers_is_not_waited_for(address):
    guard = pytest.importorskip("compare.view.guard")
    port = int(address.strip("/").rsplit(":", 1)[1])
    with socket.create_connection(("127.0.0.1", port), timeout=3 * guard.HEADERS) as slow:
        slow.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n")
        assert slow.recv(100) == b""  # closed


def test_without_the_extra_it_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "nicegui", None)
    with pytest.raises(InputError, match=r"pip install 'nicegui>=3.18'"):
        explore.serve(P, 8080, show=False)


@pytest.mark.parametrize(
    "changes", [{}, {"eta": 0.6}, {"mu": 0.0, "eta": 0.0}, {"c": 0.0}, {"drag": "quadratic"}]
)
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
    assert explore.with_value(p, "kappa", 0.5).kappa == pytest.approx(0.5)
    assert explore.with_value(p, "drag", "schiller-naumann").nu_f == explore.OIL
    with pytest.raises(InputError, match="j = 2"):
        explore.with_value(p, "j", 2.0)


def test_an_address_tells_a_setting():
    """Whatever set another page began with."""
    water = Parameters.named("steel-in-water").replace(mu=0.3)
    for p in (P, water, P.replace(omega_0=25.0, nu_f=1e-6, drag="quadratic")):
        said = explore.address(explore.Tab(p, State(omega_c=5.0)))
        tab = explore.Tab(Parameters.named("hopping"))
        explore.set_from(tab, dict(parse_qsl(said[2:])) | {"other": "1"})
        for name, value in dataclasses.asdict(p).items():
            exact = value if name == "drag" else pytest.approx(value, rel=1e-11)
            assert getattr(tab.p, name) == exact
        assert tab.start.omega_c == 5.0
    for name, value in (("mu", "x"), ("mu", "-1"), ("start", "nan"), ("drag", "mine")):
        with pytest.raises(InputError, match=name):
            explore.set_from(explore.Tab(P), {name: value})


def test_explore_says_where_the_model_does_not_hold():
    doubt = "Warning: the paper's model doesn't hold for this fluid: it is off by"
    assert explore.in_words(Parameters.named("steel-in-water")).startswith(doubt)
    assert doubt not in explore.in_words(P)
