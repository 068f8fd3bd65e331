"""A ball hops if it comes down again and again, and the command says what is undecided."""

import json

import numpy as np

from compare.commands.cli import main
from compare.kit.statistics import hops
from model import Parameters
from tests.measured import motion

HOPPING = Parameters.named("hopping")


def run_of(time, y, theta):
    return motion(HOPPING, time, y=y, theta=theta, omega_c=np.gradient(theta, time))


def test_undecided_with_what_it_did_last(capsys, tmp_path):
    """JSON, and a page with a row for each set."""
    page = tmp_path / "page.md"
    given = ["--set", "hopping", "--start", "omega_c=20", "--time", "1", "--vary", "omega_0=60,70", "-o", str(page)]
    assert main(["attractors", *given, "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert [each["omega_0"] for each in data["sets"]] == [60, 70]
    for (only,) in (each["attractors"] for each in data["sets"]):
        assert only["kind"] == "undecided"
        assert only["low"]["omega_c"] <= only["mean"]["omega_c"] <= only["high"]["omega_c"]
    head = page.read_text("utf-8").split("| omega_0", 1)[0]
    command = f"dualball attractors {' '.join(given)} --json"
    for words in ("μ = 0.45554, η = 0.072543", "ω₀ = 69.211 rad s-1", command):
        assert words in head
    rows = [line for line in page.read_text("utf-8").splitlines() if line.startswith("|")]
    assert len(rows) == 2 + 2
    assert len({row.replace("\\|", "").count("|") for row in rows}) == 1


def test_which_balls_hop():
    """Those that come down again and again, but none that swings on the wall, sinks, or hardly leaves the floor."""
    t = np.arange(0, 5, 1e-3)
    hop = 4e-3 * np.abs(np.sin(12 * t))
    assert all(hops(run_of(t, y, t)) for y in (hop, np.exp(-t) * hop))
    assert not any(hops(run_of(t, y, t)) for y in (4e-3 + hop, np.maximum(4e-3 * (4.5 - t), 0.0), hop / 4000))
