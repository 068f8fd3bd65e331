"""Figures show theory by itself where nothing is measured, say their parameters, and put points on
curves."""

import dataclasses
import functools
import io
import pickle
import re
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from matplotlib.colors import to_rgb

import analytic
from analytic.orbits import orbit_branch
from compare import plot
from compare.bench import league
from compare.figures import style
from compare.figures.drawing import Diagram, DrawnMotion, Evidence, GapError
from compare.method.record import Check, Records
from compare.report import gallery as registry
from compare.report.gallery import FIGURES, figures_of
from compare.subjects.attractors import figures as attractors
from compare.subjects.catalogue import CLAIMS
from compare.subjects.flowmeter import figures as flowmeter
from compare.subjects.unsteady import figures as unsteady
from compare.view import collection, explore, motions
from model import InputError, Parameters, State, StorageError, storage
from tests.commands import refused, told
from tests.measured import measured

DEPENDS = dict.fromkeys(FIGURES, "μηjκ") | {"fig-7": "μjκ", "fig-8": "jκ"}


def contrast(a: str, b: str) -> float:
    """Of two colours, as WCAG 2 has it."""
    parts = np.array([to_rgb(a), to_rgb(b)])
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    dark, light = sorted(linear @ [0.2126, 0.7152, 0.0722])
    return (light + 0.05) / (dark + 0.05)


def test_what_is_drawn_can_be_seen():
    drawn = [*style.COLOURS.values(), *league.ENTRY_COLOURS, style.FORCE, style.SLIP]
    assert min(contrast(colour, "white") for colour in drawn) > 3


def test_what_is_written_on_pages_can_be_read():
    assert contrast(explore.BUTTONS, "white") > 4.5
    source = (resources.files("compare.figures") / "pages/templates/base.html").read_text("utf-8")
    for root in re.findall(":root {(.*?)}", source):
        colours = dict(re.findall(r"--(\w+):(#\w+)", root))
        for text in ("ink", "soft", "good", "bad", "warn", "link"):
            assert min(contrast(colours[text], colours[on]) for on in ("paper", "wash")) > 4.5


@pytest.fixture(autouse=True, scope="module")
def few_points():
    """A few orbits of the branch of hops, frequencies of pulsation and starts of hops: theory takes
    long for each."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(attractors, "STARTS", 2)
        patch.setattr(orbit_branch, "follow", functools.partial(orbit_branch.follow, most=2))
        patch.setattr(unsteady, "FREQUENCIES", 3)
        yield


@functools.cache
def alone(name):
    """A figure of theory alone, and its caption."""
    return FIGURES[name].draw(FIGURES[name].select(Evidence()))


@pytest.mark.parametrize("name", [name for name in FIGURES if name != "characteristic"])
def test_every_figure_is_drawn_of_theory_alone_and_says_its_parameters(name):
    """With what is measured a validation draws them."""
    figure, caption = alone(name)
    figure.savefig(io.BytesIO(), format="png", dpi=40)
    assert caption.endswith(".")
    for symbol in DEPENDS[name]:
        assert f"{symbol} = " in caption


def test_figures_of_a_real_fluid_warn_where_the_model_does_not_hold(here, capsys):
    water, warning = Parameters.named("steel-in-water"), "Warning: the paper's model doesn't hold"
    figure, caption = FIGURES["fig-13-left"].draw(Diagram("fig-13-left", water))
    assert warning in caption
    assert warning in " ".join(figure.get_suptitle().split())
    assert warning not in alone("fig-13-left")[1]
    told(capsys, "simulate --set steel-in-water --time 1 --engine event -o run.h5")
    line = "sweep --set steel-in-water --vary omega_0=5,8 --time 1 --engine event --workers 0"
    told(capsys, f"{line} --quiet")
    told(capsys, "collect sweep --workers 0")
    drawn = motions.draw(storage.load("run.h5")), collection.draw(collection.read(Path("sweep.h5")))
    for each in drawn:
        assert warning in " ".join(each.get_suptitle().split())


@pytest.mark.parametrize("name", ["fig-9", "fig-10", "fig-11", "fig-12"])
def test_special_points_lie_on_curves(name):
    """Every black dot is the end of a curve, or on one, within a thousandth of the frame."""
    for axes in alone(name)[0].axes:
        frame = np.array([np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim())])
        dots = [line.get_xydata()[0] / frame for line in axes.lines if line.get_marker() == "o"]
        curves = [line.get_xydata() / frame for line in axes.lines if line.get_linewidth() == 2]
        curves = [xy[np.isfinite(xy).all(axis=1)] for xy in curves]
        assert dots
        begin = np.concatenate([xy[:-1] for xy in curves])
        step = np.concatenate([np.diff(xy, axis=0) for xy in curves])
        for dot in dots:
            along = np.clip(
                np.sum((dot - begin) * step, 1) / np.maximum(np.sum(step**2, 1), 1e-300), 0, 1
            )
            assert np.linalg.norm(begin + along[:, None] * step - dot, axis=1).min() < 1e-3


def check(omega_0, predicted, uncertainty=1e-9, quantity="omega_c", **conditions):
    """A number that was measured at a flow, its value too."""
    p = Parameters.named("reference").replace(omega_0=omega_0)
    m = measured("settled", quantity, omega_0, 1e-9, p, **conditions)
    return Check(measurement=m, predicted=predicted, uncertainty=uncertainty, scale=1.0)


@pytest.mark.parametrize(("name", "wrong"), [("fig-7", [10.0]), ("fig-8", [])])
def test_the_bistable_region_is_named_and_points_not_as_predicted_are_crossed(name, wrong):
    plane = [check(omega_0, 8.0, 0.0, "cases", figure="fig-7") for omega_0 in (8.0, 10.0)]
    made = Evidence({"fig-7": plane}, Records(tuple(each.measurement for each in plane)))
    figure, caption = FIGURES[name].draw(FIGURES[name].select(made))
    (axes,) = figure.axes
    assert any("bistable" in text.get_text() for text in axes.texts)
    crosses = [line for line in axes.lines if line.get_label() == "not as predicted"]
    assert [float(x) for line in crosses for x in line.get_ydata()] == wrong
    assert ("not as predicted in 1 (crossed)" in caption) == bool(wrong)


@pytest.mark.parametrize("name", ["air", "glass-in-water", "hopping", "reference"])
def test_names_of_curves_stay_within_the_axes(name):
    axes = plot.characteristic(Parameters.named(name))
    axes.figure.draw_without_rendering()
    low, high = axes.get_window_extent().get_points()
    for text in axes.texts:
        begin, end = text.get_window_extent().get_points()
        assert (begin > low - 1).all(), text
        assert (end < high + 1).all(), text


def test_deviations_are_drawn_over_tolerance():
    near, far, equal, count = (
        check(10.0, predicted) for predicted in (10.0 - 1.5e-9, 9.0, 10.0, 10.0)
    )
    count = dataclasses.replace(count, uncertainty=0.0)
    drawing = figures_of("x")["claim-x"]
    figure, caption = drawing.draw(drawing.select(Evidence({"x": (near, far, equal, count)})))
    (axes,) = figure.axes
    points = {line.get_color(): line.get_xdata() for line in axes.lines if line.get_marker() == "o"}
    assert points.pop(style.FORCE) == pytest.approx([10.0])  # not as predicted
    (good,) = points.values()
    assert good == pytest.approx([0.5, 1e-6], rel=1e-6)
    assert "4 numbers of mujoco, of which 3 have a tolerance" in caption
    with pytest.raises(GapError):
        drawing.select(Evidence({"x": (count,)}))


def test_a_fall_that_did_not_happen_is_a_gap():
    p = Parameters.named("high-wall-friction")
    run = analytic.simulate(p, [0, 0, p.omega_0, 0, 0, 0], 0.1)
    with pytest.raises(GapError, match="never landed"):
        flowmeter.draw_fall(
            Diagram("unloading", p, motions=(DrawnMotion("rolling", "event", p, lambda: run),))
        )


def test_claims_have_their_own_figures_or_deviations():
    assert list(figures_of("slip-NR-NS")) == ["fig-4", "fig-5", "claim-slip-NR-NS"]
    assert list(figures_of("fig-13-right")) == ["fig-13-right", "unloading"]
    named = {name for drawing in FIGURES.values() for name in drawing.claims}
    assert named <= {claim.id for claim in CLAIMS}
    pickle.dumps(FIGURES)  # other processes draw them for the report


def test_figures_are_written_and_gaps_named(tmp_path, monkeypatch):
    chosen = {name: FIGURES[name] for name in ("fig-9", "characteristic")}
    monkeypatch.setattr(registry, "FIGURES", chosen)
    assert dict(registry.write(tmp_path, registry.of_results(Evidence()), ("svg", "png"))) == {
        "fig-9": "",
        "characteristic": "not drawn: no settled states were measured with its parameter sets",
    }
    there = {path.name for path in tmp_path.iterdir()}
    assert there == {"captions.txt", "fig-9.png", "fig-9.svg"}
    assert "Stationary solutions off the floor" in (tmp_path / "captions.txt").read_text("utf-8")
    with pytest.raises(InputError, match="bmp"):
        list(registry.write(tmp_path, registry.of_results(Evidence()), ("bmp",)))
    (tmp_path / "file").touch()
    with pytest.raises(StorageError):
        list(registry.write(tmp_path / "file", registry.of_results(Evidence())))


def test_figures_of_a_set_of_ones_own(tmp_path, capsys, monkeypatch):
    """All that theory alone can draw, by the friction of its wall, and why the others aren't
    drawn."""
    # Half of the time is that of writing.
    monkeypatch.setattr("compare.figures.drawing.save", lambda figure, path: path.touch())
    drawn = {*"fig-4 fig-5 fig-7 fig-8 fig-9 fig-11 fig-13-right unloading pulsation".split()}
    said = told(capsys, f"figures --set high-wall-friction -o {tmp_path / 'rough'}")
    assert {path.stem for path in (tmp_path / "rough").glob("*.svg")} == drawn
    known = registry.of_set(Parameters.named("reference"))
    assert said.count(": not drawn: ") == len(known) - len(drawn)
    Parameters.named("reference").replace(mu=0.0, eta=0.0).save(tmp_path / "slick.toml")
    said = told(capsys, f"figures --parameters {tmp_path / 'slick.toml'} -o {tmp_path / 'slick'}")
    assert said.count("has not all thresholds") >= 5
    assert said.count(": written") == 2  # Figs. 7 and 8
    line = f"figures --parameters {tmp_path / 'slick.toml'} --figure fig-9 -o {tmp_path / 'none'}"
    assert "fig-9: not drawn: a set with mu = 0, " in refused(capsys, line)
    assert not (tmp_path / "none").exists()


def test_functions_draw_into_axes_that_are_given_or_new():
    p = Parameters.named("reference")
    axes, plane = plot.characteristic(p), plot.regions(p, equal=True)
    assert (axes.get_xlabel(), axes.get_ylabel()) == (style.OMEGA_0, style.OMEGA_C)
    assert plane.get_xlabel().startswith("friction")
    assert axes.get_title() == plane.get_title() == ""  # no warning
    assert plot.figure("fig-10", p).axes[0].get_xlabel() == style.OMEGA_0
    kept = Path(__file__).parents[2] / "docs" / "studies" / "data" / "basins.json"
    assert "at the start" in plot.basins(kept).get_xlabel()
    run = analytic.simulate(p.replace(omega_0=25.0), State(y=0.003, omega_c=5.0), 2.0)
    mine = style.figure(3, 3).add_subplot()
    assert plot.motion(run, "slip_x", "slip_z", axes=mine) is mine
    np.testing.assert_array_equal(mine.get_lines()[1].get_ydata(), run.slip_z)
    of_file = plot.motion(run.to_xarray(), "force_Ay")
    np.testing.assert_array_equal(of_file.get_lines()[0].get_ydata(), run.force_A[:, 1])
    assert "N" in of_file.get_ylabel()


def test_functions_warn_of_a_fluid_for_which_the_model_does_not_hold():
    spun = Parameters.named("reference")
    spun = spun.replace(fluid_torque=spun.c)  # as fast as drag
    for draw in (plot.characteristic, plot.regions):
        assert "doesn't hold for this fluid" in " ".join(draw(spun).get_title().split())


@pytest.mark.parametrize(
    ("draw", "said"),
    [
        (
            lambda p, run: plot.figure("fig-11", p),
            "fig-11 can't be drawn of this set: it is for η > j",
        ),
        (lambda p, run: plot.motion(run, "y", "omega_c"), "different units"),
        (lambda p, run: plot.motion(run, "force_A"), "unknown quantity of a motion"),
        (lambda p, run: plot.motion(run.to_xarray().drop_dims("axis")), "makes a table of it"),
    ],
)
def test_what_has_nothing_to_draw_is_said(draw, said):
    p = Parameters.named("reference")
    with pytest.raises(InputError, match=said):
        draw(p, analytic.simulate(p, State(), 0.1))


def test_one_figure_is_drawn_where_one_is_named(tmp_path, capsys):
    told(capsys, f"figures --set reference --figure fig-9 --format png -o {tmp_path / 'one'}")
    twice = f"figures --set reference --figure fig-9 {2 * '--format svg '}-o {tmp_path / 'two'}"
    assert told(capsys, twice).count("written") == 1
    said = refused(capsys, f"figures --results {tmp_path} -o {tmp_path / 'none'}")
    assert "summary.json: No such file" in said
    assert {each.name for each in (tmp_path / "one").iterdir()} == {"fig-9.png", "captions.txt"}
    named = "figures --set reference --figure fig-99"
    assert "fig-99" in refused(capsys, named)
