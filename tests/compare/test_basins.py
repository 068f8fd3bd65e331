"""Basins are those of theory, are kept, and go on where they stopped."""

import json

import numpy as np
import pytest

from analytic import stable_solutions
from analytic.simulation.ensemble import interval
from compare.campaign.campaign import Campaign
from compare.campaign.sweep import Axis
from compare.subjects.attractors.basins import ATTRACTORS, Basins, basins
from docs.studies.search import BOX, KEPT, confirm, parameters, random_starts, screen
from model import Parameters, StorageError, storage
from tests.commands import refused, told

BISTABLE = Parameters.named("reference").replace(omega_0=40.0)


def test_screen_and_confirmation_tell_hopping_from_rest():
    """A ball hops on in a kept set with drag enough; in the reference set it rests whatever it
    starts with."""
    row = next(
        r
        for r in json.loads(KEPT.read_text("utf-8"))["rows"]
        if r["confirmed"] and r["confirmed"]["landings"] == 1 and r["kappa"] > 0.1
    )
    p = parameters(np.array([row[name] for name in BOX]))
    hops, x, failed = screen(p, random_starts(p, 20, [0]))
    assert failed == 0
    assert hops.any()
    record = confirm(p, x[hops][0])
    assert record is not None
    assert record.period == pytest.approx(row["confirmed"]["period"], rel=1e-3)
    assert 0 < (record.multiplier or 0) < 1
    still = Parameters.named("reference").replace(omega_0=25.0)
    hops, x, _ = screen(still, random_starts(still, 3, [0]))
    assert not hops.any()
    assert confirm(still, x[0]) is None


def test_intervals_of_shares():
    """Against the closed form of no hit in n: 1 - (alpha/2)^(1/n)."""
    assert interval(0, 900)[1] == pytest.approx(1 - 0.025 ** (1 / 900), rel=1e-9)
    assert interval(0, 0) == (0.0, 1.0)


def test_attractors_are_the_stable_solutions_that_theory_has_and_a_map_goes_on_where_it_stopped(
    tmp_path,
):
    """Beyond omega_02 the ball slips on the floor or rides on the wall: both come up, by both
    engines alike."""
    assert {s.case.name for s in stable_solutions(BISTABLE)} == {"SS", "SR", "NR"}
    axes = Axis("omega_c", (5.0, 25.0, 45.0)), Axis("slip_x", (-1.0, 1.0))
    given = BISTABLE, {"y": 0.002}, axes, 2
    seen, maps = [], []
    for _ in range(2):
        with Campaign(
            tmp_path, workers=0, report=lambda what, done, total, failed: seen.append((what, done))
        ) as campaign:
            maps.append(basins(campaign, *given))
        for path in [path for path in tmp_path.glob("*.h5") if len(storage.contents(path)[1]) == 2]:
            path.unlink()  # as if it had been killed before MuJoCo's batch was whole
    # nothing of how long it takes, of which MuJoCo's part isn't known yet
    assert [done for what, done in seen if "theory" in what] == [0, 0, 0, 0]
    runs = [done for what, done in seen if "theory" not in what]
    assert (runs[0], runs[-1], runs.count(0)) == (0, 2, 2)
    for basin in maps:
        assert {ATTRACTORS[k] for k in basin.attractors.ravel()} == {"SS", "off the floor"}
        np.testing.assert_array_equal(basin.mujoco, basin.attractors[::2, ::2])
        assert len(basin.differences()) == 0


def test_a_ball_that_hops_on(tmp_path):
    """From states near the top of the hop."""
    p = Parameters.named("hopping")
    with Campaign(tmp_path, workers=0) as campaign:
        axes = Axis("y", (6.36e-3, 6.4e-3)), Axis("v_y", (0.0, 1e-3))
        basin = basins(campaign, p, {"omega_c": 57.3, "slip_x": -106.0}, axes)
    assert {ATTRACTORS[k] for k in basin.attractors.ravel()} == {"hops"}


def test_basins_count_measure_and_keep_their_points(tmp_path):
    """Two columns of each attractor: columns 1 and 2 lie at the boundary, 0 and 3 a cell farther
    away."""
    axes, attractors = (
        ("omega_c", "slip_x", np.arange(4.0), np.arange(4.0)),
        np.array([[0, 0, 2, 2]] * 4),
    )
    b = Basins(BISTABLE, (0.0,) * 8, *axes, attractors, 2, np.array([[2, 2], [0, 0]]), 1e-3)
    assert b.differences().tolist() == [2.0, 1.0]
    b.mujoco[0, 0] = ATTRACTORS.index("undecided")
    assert (b.differences().tolist(), b.undecided) == ([1.0], 1)
    b.attractors[3] = 2
    assert (b.share("hops"), b.share("RR")) == ((6, 16), (0, 16))
    b.save(tmp_path / "b.json")
    again = Basins.load(tmp_path / "b.json")
    assert (again.parameters, again.start) == (b.parameters, b.start)
    np.testing.assert_array_equal(again.attractors, b.attractors)


def test_a_step_that_is_too_long_for_mujoco_is_no_difference(tmp_path, capsys):
    line = f"basins --across omega_c=0:500:2 --up y=0:.01:2 --mujoco 1 --results {tmp_path / 'b'}"
    assert "half of 1/(2 omega_c)" in refused(capsys, f"{line} --timestep .002 --workers 0 --quiet")
    assert not list(tmp_path.iterdir())


def test_the_command_draws_the_map_or_keeps_its_data(tmp_path, capsys):
    line = (
        f"basins --omega-0 40 --across omega_c=5:45:2 --up slip_x=0:1:2 --results {tmp_path} "
        "--workers 0 --json"
    )
    assert '"shares"' in told(capsys, f"{line} -o {tmp_path / 'map.png'}")
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")
    told(capsys, f"{line} -o {tmp_path / 'map.json'}")
    assert Basins.load(tmp_path / "map.json").parameters.omega_0 == 40.0
    (tmp_path / "map.json").write_text("[]", "utf-8")
    with pytest.raises(StorageError, match="holds no basins: it is no JSON object"):
        Basins.load(tmp_path / "map.json")
