"""Basins: what each start of a plane comes to, and where two engines differ about it."""

from __future__ import annotations

import numpy as np
import pytest

from analytic import stable_solutions
from compare.commands import cli
from compare.runs.basins import FATES, Basins, basins
from compare.runs.campaign import Campaign
from compare.runs.sweep import Axis
from model import InputError, Parameters, StorageError, storage

BISTABLE = Parameters.named("reference").replace(omega_0=40.0)


def made_up(fates, mujoco=((0, 0), (0, 0)), coarse=2) -> Basins:
    return Basins(
        BISTABLE,
        (0.0,) * 8,
        "omega_c",
        "slip_x",
        np.arange(4.0),
        np.arange(4.0),
        np.array(fates),
        coarse,
        np.array(mujoco),
        1e-3,
    )


def test_fates_are_the_stable_solutions_that_theory_has_and_a_map_goes_on_where_it_stopped(tmp_path):
    """Beyond omega_02 the ball slips on the floor or rides on the wall: both come up, by both engines alike."""
    assert {s.case.name for s in stable_solutions(BISTABLE)} == {"SS", "SR", "NR"}
    given = BISTABLE, {"y": 0.002}, Axis("omega_c", (5.0, 25.0, 45.0)), Axis("slip_x", (-1.0, 1.0)), 2
    seen, maps = [], []
    for _ in range(2):
        with Campaign(tmp_path, workers=0, report=lambda what, done, total, failed: seen.append(done)) as campaign:
            maps.append(basins(campaign, *given))
        for path in [path for path in tmp_path.glob("*.h5") if len(storage.contents(path)[1]) == 2]:
            path.unlink()  # as if it had been killed before MuJoCo's batch was whole
    assert (seen[0], seen[-2:]) == (0, [6, 8])
    for basin in maps:
        assert {FATES[k] for k in basin.fates.ravel()} == {"SS", "off the floor"}
        np.testing.assert_array_equal(basin.mujoco, basin.fates[::2, ::2])
        assert len(basin.differences()) == 0


def test_a_ball_that_hops_on(tmp_path):
    """From states near the top of the hop."""
    p = Parameters.named("hopping")
    with Campaign(tmp_path, workers=0) as campaign:
        axes = Axis("y", (6.36e-3, 6.4e-3)), Axis("v_y", (0.0, 1e-3))
        basin = basins(campaign, p, {"omega_c": 57.3, "slip_x": -106.0}, *axes)
    assert {FATES[k] for k in basin.fates.ravel()} == {"hops"}


def test_distance_from_a_boundary_in_cells():
    """Two columns of each fate: columns 1 and 2 lie at the boundary, 0 and 3 a cell farther away."""
    b = made_up([[0, 0, 2, 2]] * 4, [[2, 2], [0, 0]])
    assert b.differences().tolist() == [2.0, 1.0]


def test_shares():
    b = made_up([[0, 0, 2, 2]] * 3 + [[2] * 4])
    assert b.share("hops") == (6, 16)
    assert b.share("RR") == (0, 16)


def test_kept_as_a_file(tmp_path):
    b = made_up([[0, 0, 2, 2]] * 4)
    b.save(tmp_path / "b.json")
    again = Basins.load(tmp_path / "b.json")
    assert again.parameters == b.parameters
    assert again.start == b.start
    np.testing.assert_array_equal(again.fates, b.fates)
    (tmp_path / "b.json").write_text("[]", "utf-8")
    with pytest.raises(StorageError, match="holds no basins"):
        Basins.load(tmp_path / "b.json")


@pytest.mark.parametrize(
    ("changes", "start", "message"),
    [
        ({"c": 0.0}, {}, "there are no basins"),
        ({}, {"omega": 1.0}, "unknown state variable 'omega'"),
        ({}, {"h": 0.06}, "h = 0.06 m"),
    ],
)
def test_bad_input(changes, start, message, tmp_path):
    with pytest.raises(InputError, match=message), Campaign(tmp_path, workers=0) as campaign:
        basins(campaign, BISTABLE.replace(**changes), start, Axis("omega_c", (0, 1)), Axis("slip_x", (0, 1)))


def test_command(capsys, tmp_path):
    to = ["--output", str(tmp_path), "--workers", "0"]
    across = ["--omega-0", "40", "--across", "omega_c=5:45:2", "--up", "slip_x=0:1:2"]
    assert cli.main(["basins", *across, *to, "--json"]) == 0
    assert '"shares"' in capsys.readouterr().out
    assert cli.main(["basins", *to, "--across", "omega=5:45:2", "--up", "slip_x=0:1:2"]) == 2
    assert "unknown state variable 'omega'" in capsys.readouterr().err
