"""A search covers its box evenly, goes on where it stopped, and says what it knows with its confidence."""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np
import pytest

from analytic import hopping
from analytic.ensemble import interval
from compare.commands import cli
from compare.runs import regions, search
from compare.runs.search import BOX, Search, Searched, carry_out, parameters, random_starts
from compare.runs.workers import processes
from docs.studies.figures import SEARCHES
from model import Parameters, StorageError

QUICK = Search({**BOX, "kappa": (0.5, 1.0)}, starts=2)


def hopping_set() -> tuple[Parameters, float]:
    """A set of the kept search with drag enough that its ball hops soon, and the period it has there."""
    row = next(r for r in Searched.load(SEARCHES[0]).confirmed if r["confirmed"]["landings"] == 1 and r["kappa"] > 0.1)
    return parameters(np.array([row[name] for name in BOX])), row["confirmed"]["period"]


def test_points_fill_the_box_and_a_longer_search_contains_the_shorter():
    points = Search().points(64)
    low, high = np.array(list(BOX.values())).T
    assert np.all((points >= low) & (points <= high))
    np.testing.assert_array_equal(Search().points(1000)[:64], points)
    halves = points[:, 0] < math.sqrt(low[0] * high[0])
    assert halves.sum() == 32  # a Sobol sequence puts equally many into each half, here of log mu


def test_the_groups_of_a_point_are_those_of_its_parameters():
    point = Search().points(1)[0]
    p = parameters(point)
    np.testing.assert_allclose([p.mu, p.eta, p.j, p.r / p.R, p.kappa, p.Omega_0], point)


def test_a_search_goes_on_where_it_stopped(tmp_path):
    """A chunk that is there is read, not computed: nothing is left for the workers to do."""
    points = QUICK.points(search.CHUNK)[:, :]
    path = tmp_path / f"{QUICK.key(0)}.json"
    rows = [{"hops": 0, "failed": 0}] * (search.CHUNK - 1) + [{"hops": 1, "failed": 1, "x": [], "confirmed": None}]
    path.write_text(json.dumps({"chunk": 0, "rows": rows}), "utf-8")
    seen = []
    record = search.run(tmp_path, QUICK, 10, processes(1), lambda *now: seen.append(now))
    assert seen == [("search", search.CHUNK, search.CHUNK, 0)]
    assert (record.sets, record.failed, len(record.rows), record.confirmed) == (search.CHUNK, 1, 1, [])
    assert record.rows[0]["mu"] == points[-1, 0]


def test_a_chunk_is_the_same_whoever_computes_it(tmp_path):
    points = QUICK.points(search.CHUNK)[:3]
    for name in ("a", "b"):
        carry_out(QUICK, 0, points, tmp_path / name)
    assert (tmp_path / "a").read_text() == (tmp_path / "b").read_text()
    assert len(json.loads((tmp_path / "a").read_text())["rows"]) == 3


def test_screen_and_confirmation_tell_hopping_from_rest():
    """A ball hops on in a kept set; in the reference set it comes to rest whatever it starts with."""
    p, period = hopping_set()
    x0s = random_starts(p, 20, [0])
    hops, x, failed = hopping.screen(p, x0s)
    assert failed == 0
    assert hops.any()
    record = hopping.confirm(p, x[hops][0])
    assert record is not None
    assert record.period == pytest.approx(period, rel=1e-3)
    assert 0 < (record.multiplier or 0) < 1
    still = Parameters.named("reference").replace(omega_0=25.0)
    hops, x, _ = hopping.screen(still, random_starts(still, 3, [0]))
    assert not hops.any()
    assert hopping.confirm(still, x[0]) is None


def test_intervals_of_shares():
    """Against the closed form of no hit in n: 1 - (alpha/2)^(1/n)."""
    assert interval(0, 900)[1] == pytest.approx(1 - 0.025 ** (1 / 900), rel=1e-9)
    assert interval(0, 0) == (0.0, 1.0)


def test_the_parts_of_a_range_are_all_of_it():
    record = Searched.load(SEARCHES[0])
    for name in BOX:
        own = [part for part in regions.parts(record) if part.group == name]
        assert sum(part.sets for part in own) == record.sets
        assert sum(part.hopping for part in own) == len(record.confirmed)


@pytest.mark.parametrize("path", SEARCHES, ids=lambda path: path.stem)
def test_kept_searches_are_whole(path, tmp_path):
    record = Searched.load(path)
    rows = record.search.points(record.sets)
    assert record.failed <= 1e-5 * record.sets * record.search.starts
    for row in record.rows:
        assert np.min(np.abs(rows - [row[group] for group in BOX]).sum(axis=1)) < 1e-9
    record.save(tmp_path / "again.json")
    assert dataclasses.asdict(Searched.load(tmp_path / "again.json")) == dataclasses.asdict(record)


def test_a_file_that_is_no_search(tmp_path):
    (tmp_path / "no.json").write_text("{}", "utf-8")
    with pytest.raises(StorageError, match="holds no search"):
        Searched.load(tmp_path / "no.json")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--range", "mo=1:2"], "unknown group 'mo'"),
        (["--range", "mu=2:1"], "wrong order"),
        (["--range", "mu=2"], "write mu=from:to"),
        (["--range", "mu=-1:1"], "mu = -1"),
        (["--sets", "0"], "sets = 0"),
        (["--workers", "-1"], "workers = -1"),
    ],
)
def test_bad_input(words, message, capsys):
    assert cli.main(["search", *words]) == 2
    assert message in capsys.readouterr().err
