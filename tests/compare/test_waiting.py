"""A command that takes long says that it is at work, how far it is, and that it compiles."""

import time
from contextlib import nullcontext

import numba
import pytest

import analytic
from compare.campaign import compiling, progress, workers
from compare.commands import simulate, waiting
from compare.view import collection
from model import Parameters, table
from tests.commands import carried_out


@pytest.fixture
def soon(monkeypatch):
    """Progress is told at once, and often."""
    monkeypatch.setattr(waiting, "SOON", 0.1)
    monkeypatch.setattr(progress, "INTERVAL", 0.3)
    monkeypatch.setattr(progress, "SURE", 0.1)


def test_only_what_takes_long_says_so(soon, capsys):
    with waiting.told("quick"):
        pass
    assert capsys.readouterr().err == ""
    with waiting.told("slow") as tell:
        tell(0.25)
        time.sleep(1.5)
    said = capsys.readouterr().err.splitlines()
    assert said[0] == "slow"
    assert "s: slow, 25%" in said[1]


def compiles(kept=False):
    """Has numba compile something for two seconds of processor time."""

    @numba.njit(cache=kept)
    def slow(x):
        return x

    @numba.extending.register_jitable
    def waits(x):
        return x

    compiled = slow._compiler.compile

    def compile_slowly(*given):
        works(2.0)
        return compiled(*given)

    slow._compiler.compile = compile_slowly
    slow(1)


def works(seconds):
    """Takes so much processor time."""
    ends = time.process_time() + seconds
    while time.process_time() < ends:
        pass


@pytest.mark.parametrize(("kept", "often"), [(True, compiling.KEPT), (False, compiling.NOT_KEPT)])
def test_compiling_says_so_and_is_no_measure_of_what_is_left(
    kept, often, soon, capsys, tmp_path, monkeypatch
):
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    with waiting.told("it") as tell:
        compiles(kept)
        began = time.monotonic()
        for k in range(1, 11):
            tell(k / 20)
            time.sleep(0.1)
        takes = 2 * (time.monotonic() - began)  # all of it, as half is done
    said = capsys.readouterr().err.splitlines()
    assert any(line.endswith(f"it, {often}") for line in said), said
    left = [float(line.split("about ")[1].split()[0]) for line in said if "to go" in line]
    assert left
    assert left[-1] < takes  # with compiling it would be half as much again


def test_what_a_worker_compiles_is_told(soon, capsys):
    with progress.reporter(), workers.processes(1) as fleet:
        fleet.submit(compiles).result()
    assert f"getting ready, {compiling.NOT_KEPT}" in capsys.readouterr().err


def test_compiling_makes_nothing_late():
    with workers.at_most(0.5):
        compiles()
        works(0.45)
    with pytest.raises(workers.LateError), workers.at_most(0.5):
        works(2.0)


def test_a_table_is_told_as_it_is_written(tmp_path, capsys, monkeypatch):
    told = list[float]()
    monkeypatch.setattr(waiting, "told", lambda what: nullcontext(told.append))
    monkeypatch.setattr(table, "BLOCK", 100)
    run, into = tmp_path / "run.h5", tmp_path / "run.csv"
    line = "simulate --time 1 --sample-interval 0.002 --engine time-stepping --timestep 0.001"
    assert carried_out(capsys, *line.split(), "-o", into)[0] == 0
    assert told == sorted(told)
    assert sum(done >= 1 / (1 + simulate.WRITING / 2) for done in told) > 5
    assert carried_out(capsys, *line.split(), "-o", run)[0] == 0
    told.clear()
    assert carried_out(capsys, "inspect", run, "--table", tmp_path / "again.csv")[0] == 0
    assert len(told) == 6
    assert (tmp_path / "again.csv").read_text() == into.read_text()


def test_attractors_and_collections_say_how_far_they_are(tmp_path, capsys):
    told = list[float]()
    p = Parameters.named("reference")
    analytic.attractors(p, 3, lasting=2.0, progress=told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0
    runs = tmp_path / "runs"
    line = "sweep --vary omega_0=5:10:20 --time 0.01 --engine event --workers 0 --batch 1 --quiet"
    assert carried_out(capsys, *line.split(), "-o", runs)[0] == 0
    told.clear()
    collection.collect(runs, tmp_path / "all.h5", 0, told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0
