"""Helpers of the studies, on rows whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from analytic import thresholds
from compare import branches, hysteresis, maps, slip, table_5
from compare.claims import Level
from compare.studies import exponent, growth, straight_line
from mjsim.measurement import Measured
from model import Case

TIME = np.linspace(0.0, 2.0, 401)
STEP = TIME[1]


@pytest.mark.parametrize("rate", [-0.5, 0.3, -12.0])
def test_growth_of_one_exponential(rate: float) -> None:
    d = np.exp(rate * TIME)[:, None] * [1.0, -3.0]
    assert growth(d, STEP, 1, 1 / abs(rate)) == pytest.approx([rate], rel=1e-9)


@pytest.mark.parametrize("rate", [-0.4 + 9j, 12j, 0.1 + 30j])
def test_exponent_of_a_pair(rate: complex) -> None:
    d = np.stack([np.exp(rate * TIME).real, np.exp(rate * TIME).imag], axis=-1)
    value, scatter = exponent(d, STEP, 2, 1 / abs(rate))
    assert value == pytest.approx(rate, rel=1e-9)
    assert scatter < 1e-8 * abs(rate)


def test_exponent_tells_of_a_row_that_is_no_exponential() -> None:
    """Two rates where one is looked for: the halves of the row disagree by about what the answer is off."""
    d = (np.exp(-TIME) + 0.2 * np.exp(-3 * TIME))[:, None]
    value, scatter = exponent(d, STEP, 1, 1.0)
    assert 0.01 < scatter < 1
    assert abs(value.real + 1) < 3 * scatter


def test_straight_line_and_its_uncertainty() -> None:
    """The zero and slope of noisy rows scatter as much as is said: their pulls have unit variance."""
    random, x, pulls = np.random.default_rng(3), np.linspace(1.0, 3.0, 6), []
    for _ in range(400):
        zero, slope = straight_line(x, 2 * (x - 2.2) + 0.01 * random.standard_normal(6), 0.01)
        pulls.append([(zero.value - 2.2) / zero.uncertainty, (slope.value - 2) / slope.uncertainty])
    # Scatter beyond the noise widens the uncertainty, so that pulls are a little narrower than 1.
    assert np.all(np.abs(np.std(pulls, axis=0) - 0.9) < 0.15)


def test_a_line_through_a_point_that_outweighs_all_others() -> None:
    x = np.array([1.0, 2.0, 3.0, 4.0])
    zero, slope = straight_line(x, 3 * (x - 2) + [1e-3, 0, -1e-3, 1e-3], [1e-3, 1e-13, 1e-3, 1e-3])
    assert abs(zero.value - 2) < 1e-12
    assert abs(slope.value - 3) < 3 * slope.uncertainty < 3e-3


def test_what_vanishes_is_extrapolated_to_its_zero() -> None:
    omegas = 7.0 * (1 + np.array([0.01, 0.02, 0.04, 0.08]))
    order = [Measured(float(3 * (w - 7) + 0.2 * (w - 7) ** 2), 0.0) for w in omegas]
    found = table_5.vanishing(omegas, order)
    assert abs(found.value - 7.0) < 3 * found.uncertainty < 1e-2


def test_a_fold_is_the_maximum() -> None:
    s = np.array([0.9, 0.8, 0.6, 0.3, 0.0])
    found = table_5.turning(5 - (s - 1) ** 2 + 0.1 * (s - 1) ** 3, [Measured(float(v), 0.0) for v in s])
    assert abs(found.value - 5.0) <= 3 * found.uncertainty
    assert found.uncertainty < 1e-2


def test_noise_is_carried_over() -> None:
    omegas = np.array([1.1, 1.2, 1.4])
    quiet, noisy = (table_5.vanishing(omegas, [Measured(w - 1, u) for w in omegas]) for u in (0.0, 1e-3))
    assert quiet.uncertainty < 1e-12
    assert 1e-3 < noisy.uncertainty < 1e-2


@pytest.mark.parametrize("figure", ["fig-7", "fig-8"])
def test_points_lie_in_the_plane_and_off_the_curves(figure: str) -> None:
    points = maps.points(figure, 40)
    eta = np.array([point.p.eta for point in points])
    assert len(set(eta)) == 40
    assert maps.ETA[0] <= eta.min() < 0.2 < 0.6 < eta.max() <= maps.ETA[1]
    assert all((point.p.mu == point.p.eta) == (figure == "fig-8") for point in points)
    assert {Case.RR, Case.SS, Case.NR, Case.NS} <= set().union(*(point.predicted for point in points))
    assert [point.p for point in maps.points(figure, 10)] == [point.p for point in points[:10]]


def test_the_loop_is_followed_with_hysteresis() -> None:
    """The same omega_0 between omega_02 and omega_04 belongs to SS on the way up and to NR on the way down."""
    omegas = hysteresis.levels(hysteresis.REFERENCE, 0.01).tolist()
    path = hysteresis.followed(hysteresis.REFERENCE, omegas)
    top = int(np.argmax(omegas))
    middle = [
        k
        for k, omega in enumerate(omegas)
        if omegas.count(omega) == 2 and omega > thresholds(hysteresis.REFERENCE).omega_02
    ]
    assert {path[k][0] for k in middle if k < top} == {Case.SS}
    assert {path[k][0] for k in middle if k > top} == {Case.NR}
    assert path[0][0] is path[-1][0] is Case.RR


def test_lines_pass_from_one_attractor_to_the_other() -> None:
    p = branches.REFERENCE.replace(omega_0=35.0)
    t = thresholds(p)
    stable, lifted, _ = (line.x - line.d for line in branches.lines(p))
    assert stable[2] < t.omega_02 < lifted[2] == pytest.approx(p.omega_0)
    assert stable[5] > 0 == lifted[5]


@pytest.mark.parametrize("count", [6, 24])
def test_directions_are_unit_vectors_all_round(count: int) -> None:
    for directions in (slip._circle(count), slip._sphere(count)):
        assert np.linalg.norm(directions, axis=-1) == pytest.approx(np.ones(count))
        assert np.abs(directions.mean(axis=0)).max() < 2 / count
    assert set(slip.DIRECTIONS) == set(Level)
