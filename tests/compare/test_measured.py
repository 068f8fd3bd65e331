"""``dualball compare curve.csv`` gives back what a measured curve was made of, and no more than it
tells."""

import json
import math

import numpy as np
import pytest

from analytic.bifurcation import diagram
from analytic.flowmeter import design, measured
from model import InputError, Parameters
from tests.commands import refused, told

P = Parameters.named("reference")
T = diagram.thresholds(P)
OTHERS = P.replace(mu=0.3, eta=0.1, c=1.5)
"""What is known of the meter before: nothing of friction and drag."""
SWIRL = 5e4
"""omega_0 over volume flow, rad m-3."""


def readings(p, reach, seed, noise=0.01):
    """Flows omega_0 up to so many times omega_01, and what is read of them while they rise and
    fall, with noise."""
    flows = np.linspace(0.1, reach, 40) * diagram.thresholds(p).omega_01
    read = np.concatenate(design.readings(p, flows))
    scatter = np.random.default_rng(seed).standard_normal(len(read))
    return np.tile(flows, 2), read * (1 + noise * scatter)


@pytest.fixture
def curve(tmp_path):
    """Writes a curve as `dualball calibrate -o` does."""

    def write(flows, read, label="Q (m3/s)", unit=SWIRL):
        path = tmp_path / "curve.csv"
        rows = zip(flows / unit, *np.split(read, 2), strict=False)
        lines = [f"{label},omega_c rising (rad/s),omega_c falling (rad/s)"]
        path.write_text("\n".join([*lines, *(f"{a:.9g},{b:.9g},{c:.9g}" for a, b, c in rows)]))
        return path

    return write


@pytest.mark.parametrize("name", ["reference", "plastic-in-oil"])  # with a fold, and without
def test_a_curve_that_reaches_far_gives_friction_and_drag_back_within_their_uncertainty(name):
    p, names, off = Parameters.named(name), ("mu", "eta", "c"), []
    for seed in range(2):
        flows, read = readings(p, 3.0, seed)
        best = measured.fits(p.replace(mu=0.3, eta=0.1, c=1.5 * p.c), flows / SWIRL, read)[-1]
        assert best.told
        found = [getattr(best.p, each) / getattr(p, each) for each in names]
        found += [best.factor / SWIRL, best.kink * SWIRL / diagram.thresholds(p).omega_01]
        u = [best.u[each] for each in (*names, "factor", "kink")]
        assert max(u) < 0.25
        off += (np.log(found) / u).tolist()
        assert np.sqrt(np.mean(best.off**2)) == pytest.approx(0.01, rel=0.3)
    assert 0.4 < np.sqrt(np.mean(np.square(off))) < 1.6  # as if uncertainties were what they say
    assert np.abs(off).max() < 4


def test_a_curve_that_ends_near_its_kink_tells_one_parameter_if_the_others_are_given():
    flows, read = readings(P, 1.5, 1)
    one, two, three = measured.fits(P, flows, read)
    assert (one.told, three.told) == (True, False)
    assert abs(math.log(one.p.mu / P.mu)) < 3 * one.u["mu"] < 0.03
    for each in (one, two, three):  # the combination is as sure with any
        assert abs(math.log(each.kink / T.omega_01)) < 3 * each.u["kink"] < 0.03


def test_in_words(capsys, curve, tmp_path):
    path, drawn = curve(*readings(P, 3.0, 1)), tmp_path / "fit.png"
    said = told(capsys, f"compare {path} --set reference --plot {drawn}")
    assert "Told: μ, η, c." in said
    assert "beyond. Fits:" in said
    assert drawn.stat().st_size > 10_000
    data = json.loads(told(capsys, f"compare {path} --set reference --json"))
    assert data["best"]["factor"] == pytest.approx(SWIRL, rel=0.01)
    path = curve(*readings(P, 1.5, 1), "omega_0 (rad/s)", 1.0)
    said = told(capsys, f"compare {path} --set reference")
    assert "Told: μ, if η and c are as given." in said
    assert "times ω₀, by theory 1." in said
    assert "not told not told not told" in said


@pytest.mark.parametrize("factor", [1.0, 0.84])
def test_a_curve_without_a_kink_says_so(capsys, curve, factor):
    flows, read = readings(P, 0.95, 1)
    said = told(capsys, f"compare {curve(flows, factor * read)} --set reference")
    assert "No kink: 80 readings up to Q = 0.0002577 m³/s" in said
    assert "tells nothing of friction and drag" in said
    assert "Told" not in said


def test_a_curve_without_any_scatter_has_no_kink(capsys, curve):
    flows = np.arange(1.0, 12.0)
    path = curve(flows, np.tile(3 * flows, 2), "omega_0 (rad/s)", 1.0)
    said = told(capsys, f"compare {path} --set reference")
    assert "ω_c is 3 times ω₀, by theory 1, within 0 %" in said


@pytest.mark.parametrize(
    ("text", "given", "said"),
    [
        ("Q (l/s),omega_c\n1,2\n", "--set reference", "Q must be in m3/s, not in l/s"),
        ("omega_0,omega_c\n1,2\n0,1\n", "--set reference", "line 3: omega_0 = 0 rad s-1"),
        ("flow,omega_c\n1,2\n", "--set reference", "no column is called omega_0 (rad/s) or Q"),
        ("1,2\n2,3\n", "--set reference", "curve.csv: too few readings: 2, where 8"),
        ("1,2\n2,1\n" * 5, "--set reference", "curve.csv: the readings follow no curve of theory"),
        ("1,2\n2,3\n", "--set high-wall-friction", "eta = 0.6 is out of range"),
        ("1,2\n2,3\n", "", "needs its meter, --set NAME or --parameters FILE"),
        ("1,2\n2,3\n", "curve.csv --set reference", "are for a measured curve, without OTHER"),
    ],
)
def test_what_is_no_curve_is_refused(capsys, here, text, given, said):
    (here / "curve.csv").write_text(text)
    assert said in refused(capsys, f"compare curve.csv {given}")


def test_a_kink_at_the_end_of_a_curve_is_not_fitted():
    flows, read = readings(P, 1.2, 1, noise=1e-4)
    few = (flows < T.omega_01) | (flows > 1.18 * T.omega_01)
    with pytest.raises(Exception, match="beyond, where 4 are needed on each side"):
        measured.fits(P, flows[few], read[few])


def test_a_set_whose_curve_has_no_kink_is_refused():
    flows = np.linspace(1.0, 40.0, 40)
    with pytest.raises(InputError, match=r"eta = 0\.6 is out of range"):
        measured.fits(Parameters.named("high-wall-friction"), flows, 0.9 * flows)
