"""``dualball calibrate`` tells what a meter reads, in its user's words, and what to doubt."""

import csv
import json
import math

import numpy as np
import pytest

import analytic
from model import Parameters
from tests.commands import refused, told


def columns(path):
    """The columns of a table that was written."""
    rows = list(csv.reader(path.read_text("utf-8").splitlines()))
    return dict(zip(rows[0], zip(*rows[1:], strict=True), strict=True))


def test_the_curve_is_the_stable_motions_and_its_jumps_are_the_thresholds(tmp_path, capsys):
    path = tmp_path / "curve.csv"
    said = told(capsys, f"calibrate --swirl 5e4 --count 9 -o {path} --plot {tmp_path / 'c.png'}")
    p, found = Parameters.named("reference"), columns(path)
    t = analytic.thresholds(p)
    flows, rising, falling = (
        np.array(found[f"{name} (rad/s)"], float)
        for name in ("omega_0", "omega_c rising", "omega_c falling")
    )
    for k, flow in enumerate(flows):
        there = analytic.stable_solutions(p.replace(omega_0=flow))
        there = [float(each.state.omega_c) for each in there]
        assert (rising[k], falling[k]) == pytest.approx((min(there), max(there)), rel=1e-6)
    apart = flows[falling - rising > 1e-9]
    assert (apart[0], apart[-1]) == pytest.approx((t.omega_02, t.omega_04), rel=2e-6)
    assert np.array(found["Q (m3/s)"], float) == pytest.approx(flows / 5e4)
    factor = np.array(found["K rising (pulses/m3)"], float)
    rolls = np.array(found["motion rising"]) == "rolls"
    assert factor[rolls] == pytest.approx(5e4 / (2 * math.pi))
    assert rolls.tolist() == (flows < t.omega_01).tolist()
    assert factor[~rolls].min() < 0.5 * factor[0]
    assert f"up to Q = {t.omega_01 / 5e4:.4g} m³/s" in said
    assert "K-factor: 7958 pulses per m³" in said
    assert "the flow rises it is up to 59 % less" in said
    assert (tmp_path / "c.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("--slowest 2", "from --slowest on it is 6.781 : 1"),
        ("--slowest 20", "--slowest is beyond the range"),
        ("--set high-wall-friction", "Repeatability: one flow has one reading"),
        ("--set high-wall-friction", "reads right, too, but for the ball's fall"),
        ("--eta 0.02", "right again from ω₀ = 99.05 rad/s on"),  # without a fold
        ("--set steel-in-water", "it is off by up to 5"),
        ("", "give nu_f and density_ratio to have their share"),
    ],
)
def test_in_a_meters_words(capsys, given, said):
    assert said in told(capsys, f"calibrate {given}")


def test_what_the_model_leaves_out_stands_beside_each_flow(tmp_path, capsys):
    path = tmp_path / "curve.csv"
    data = json.loads(told(capsys, f"calibrate --set glass-in-water --count 3 --json -o {path}"))
    share = np.array(columns(path)["model error (%)"], float)
    assert data["curve"]["model error (%)"] == pytest.approx(share)
    flows = np.array(columns(path)["omega_0 (rad/s)"], float)
    p = Parameters.named("glass-in-water").replace(omega_0=float(flows[0]))
    shift = analytic.flowmeter.real_fluid.rolling(p).shift
    assert share[0] == pytest.approx(-100 * shift)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("--eta 0", "eta = 0, c = 1 1/s: a ball without friction or drag measures no flow"),
        ("--c 0", "measures no flow"),
        ("--omega-0 3", "--omega-0 has no effect"),
        ("--fastest 3 --slowest 4", "--fastest 3 rad/s is out of range: must be > --slowest 4"),
        ("--swirl 5e4 --fastest 3e-5 --slowest 4e-5", "--fastest 3e-05 m³/s is out of range"),
        ("--slowest 0", "--slowest: 0 rad/s or m³/s is out of range: it must be >= 1e-12"),
        ("--swirl 1e12 --fastest 1e12", "--fastest times --swirl = 1e+24 rad/s is out of range"),
    ],
)
def test_what_has_no_curve_is_refused(capsys, given, said):
    assert said in refused(capsys, f"calibrate {given}")
