"""Hops are measured to the digits of known motions, and the command says what is undecided."""

import json
import math

import numpy as np
import pytest

from compare.kit.statistics import hops
from compare.kit.trials import with_step_error
from compare.subjects.attractors import measure as attractors
from model import Parameters
from tests.commands import told
from tests.measured import motion

HOPPING = Parameters.named("hopping")


def run_of(time, y, theta):
    return motion(HOPPING, time, y=y, theta=theta, omega_c=np.gradient(theta, time))


def test_undecided_with_what_it_did_last(capsys, tmp_path):
    """JSON, and a page with a row for each set."""
    page = tmp_path / "page.md"
    line = f"attractors --set hopping --start omega_c=20 --time 1 --vary omega_0=60,70 -o {page} --json"
    data = json.loads(told(capsys, line))
    assert [each["omega_0"] for each in data["sets"]] == [60, 70]
    for (only,) in (each["attractors"] for each in data["sets"]):
        assert only["kind"] == "undecided"
        assert only["low"]["omega_c"] <= only["mean"]["omega_c"] <= only["high"]["omega_c"]
    head, _, table = page.read_text("utf-8").partition("| omega_0")
    for words in ("μ = 0.45554, η = 0.072543", "ω₀ = 69.211 rad/s", f"dualball {line}"):
        assert words in head
    assert len([row for row in table.splitlines() if row.startswith("|")]) == 1 + 2


def test_which_balls_hop():
    """Those that come down again and again, but none that swings on the wall, sinks, or hardly leaves the floor."""
    t = np.arange(0, 5, 1e-3)
    hop = 4e-3 * np.abs(np.sin(12 * t))
    assert all(hops(run_of(t, y, t)) for y in (hop, np.exp(-t) * hop))
    assert not any(hops(run_of(t, y, t)) for y in (4e-3 + hop, np.maximum(4e-3 * (4.5 - t), 0.0), hop / 4000))


def test_tops_of_known_hops():
    """Parabolas of one period and height: the tops come out between the samples."""
    period, height = 0.2217, 4e-3
    time = np.arange(0, 5, 1e-3)
    phase = np.mod(time, period) / period - 0.5
    run = run_of(time, height * (1 - 4 * phase**2), 57.0 * time)
    tops = attractors.tops(run, 1.0, 4.0)
    # The parabola through three samples is the hop itself.
    assert tops.values["orbit_period"].value == pytest.approx(period, rel=1e-9)
    assert tops.values["orbit_height"].value == pytest.approx(height, rel=1e-9)
    assert max(value.uncertainty for value in tops.values.values()) < 1e-9
    assert len(attractors.tops(run_of(time, np.zeros_like(time), time), 1.0, 4.0).time) == 0


@pytest.mark.parametrize("size", [0.9, 1.05])
def test_map_from_hop_to_hop(size):
    """States that follow a linear map with a complex pair and a fast root: how they change, and what stays."""
    cos, sin = size * math.cos(0.23), size * math.sin(0.23)
    turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 0.03]])
    mixed = np.array([[1, 0.3, 0.2], [0.1, 1, 0.4], [0.5, -0.2, 1]])
    states, z = np.zeros((12, 8)), np.array([1e-3, 2e-3, 1e-3])
    for state in states:
        state[[0, 2, 3]] = np.array([5e-3, 57.0, -100.0]) + mixed @ z * np.array([0.05, 14.0, 31.0])
        z = turn @ z
    factor, steady = attractors.hop_map(states, HOPPING)
    assert factor == pytest.approx(size, rel=1e-6)
    assert steady == pytest.approx((5e-3, 0, 57.0, -100.0, 0, 0, 0, 0), rel=1e-6)


def test_where_hopping_begins_and_ends():
    """At no height; and where disturbances neither grow nor shrink."""
    flows = (58.0, 56.0, 54.0)
    curved, straight = ([4e-4 * (w - 52) - b * (w - 52) ** 2 for w in flows] for b in (1e-6, 0.0))
    place = with_step_error(attractors.birth(flows, curved).value, attractors.birth(flows, straight))
    assert place.value == pytest.approx(52.0, abs=1e-9)
    assert 0 < place.uncertainty < 0.1
    place = attractors.death([0.08, 0.09, 0.11], [(0.97, 0.96, 0.96), (0.99, 0.98, 0.98), (1.03, 1.02, 1.02)])
    assert (place.value, place.uncertainty) == pytest.approx((0.1, 5e-3))
