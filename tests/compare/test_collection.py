"""What was measured comes back from its files; collections have what varies as coordinates, and
name what they lack."""

import csv
import dataclasses
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import xarray

import analytic
from compare.campaign.campaign import Campaign
from compare.campaign.tasks import Task, carry_out, failed_path
from compare.method import record
from compare.method.record import Missing, Records
from compare.testing import assert_tracks
from compare.view import collection
from model import Flow, InputError, Parameters, StorageError, storage
from model.hdf5 import column, dataset, reading
from tests.commands import carried_out, refused, told
from tests.measured import measured

P = Parameters.named("reference")
OMEGAS, ETAS = (5.0, 7.5, 10.0), (0.1, 0.3)


def ran(directory, sets, batch=64, **changes):
    """A directory with runs of these sets."""
    tasks = [
        Task(**{"engine": "event", "parameters": p, "x0": (0.0,) * 8, "t_end": 0.1} | changes)
        for p in sets
    ]
    with Campaign(directory, workers=0, batch=batch) as campaign:
        assert not campaign.complete(tasks)
    return directory


@pytest.fixture(scope="module")
def grid(tmp_path_factory):
    """The runs of a grid, a batch each."""
    sets = [P.replace(omega_0=omega, eta=eta) for omega in OMEGAS for eta in ETAS]
    return ran(tmp_path_factory.mktemp("grid"), sets, batch=1)


@pytest.fixture
def runs(grid, tmp_path):
    """A copy of them, to be damaged."""
    return Path(shutil.copytree(grid, tmp_path / "runs"))


def test_the_varied_parameters_of_a_grid_are_dimensions(grid, tmp_path):
    assert collection.collect(grid, tmp_path / "all.h5") == 6
    with xarray.open_dataset(tmp_path / "all.h5", engine="h5netcdf") as data:
        assert dict(data.sizes) == {"eta": 2, "omega_0": 3}
        assert data.omega_c.dims == ("eta", "omega_0")
        assert data.omega_0.units == "rad s-1"
        assert all(data[name].long_name for name in data.variables)
        np.testing.assert_array_equal(data.omega_0, OMEGAS)
        np.testing.assert_array_equal(data.eta, ETAS)
        file, _, key = str(data.run.sel(eta=ETAS[1], omega_0=OMEGAS[0]).values).partition("/")
        run = storage.load(grid / file / key)
        assert (run.header.parameters.eta, run.header.parameters.omega_0) == (ETAS[1], OMEGAS[0])
        assert data.omega_c.sel(eta=ETAS[1], omega_0=OMEGAS[0]) == pytest.approx(
            np.mean(run.omega_c[751:]), rel=1e-2
        )
        assert np.isfinite(data.omega_c).all()
        assert set(data.mu.values.flat) == {P.mu}
    about = collection.describe(collection.read(tmp_path / "all.h5"))
    assert about["varied"] == ["eta", "omega_0"]
    assert about["ranges"]["omega_0"] == [min(OMEGAS), max(OMEGAS)]
    assert len(about["names"]) == 6


def test_the_varied_parameters_of_other_runs_are_coordinates(runs, tmp_path):
    """Of a grid in which a point is missing."""
    min(runs.glob("*.h5")).unlink()
    assert collection.collect(runs, tmp_path / "all.h5") == 5
    with xarray.open_dataset(tmp_path / "all.h5", engine="h5netcdf") as data:
        assert set(data.coords) == {"run", "omega_0", "eta"}
        assert data.omega_0.dims == ("run",)
        pairs = list(zip(data.eta.values.tolist(), data.omega_0.values.tolist(), strict=True))
        assert pairs == sorted(pairs)  # whatever the files are called
    assert collection.describe(collection.read(tmp_path / "all.h5"))["varied"] == ["eta", "omega_0"]


def test_the_law_of_drag_is_kept(tmp_path):
    runs = ran(tmp_path / "runs", [P, P.replace(drag="quadratic", nu_f=1e-6)])
    collection.collect(runs, tmp_path / "all.h5")
    about = collection.describe(collection.read(tmp_path / "all.h5"))
    assert (about["drag"], about["varied"]) == (["quadratic", "stokes"], ["nu_f", "drag"])
    assert collection.shown(about).row_count == 7


def test_theory_stands_beside_what_was_measured(tmp_path):
    """For a ball that slips at both points; its height is free on the wall, and in a flow that
    changes all is."""
    for name, omega_0, height, flow in (
        ("SS", 25.0, 0.0, None), ("NR", 40.0, 0.01, None),
        ("NR", 41.0, 0.0, Flow.staircase([41.0, 42.0], 0.5))
    ):  # fmt: skip
        p = P.replace(omega_0=omega_0)
        x0 = analytic.solution(p, name).state._replace(y=height)
        ran(tmp_path / "runs" / f"{omega_0}", [p], x0=x0, t_end=1.0, flow=flow)
    collection.collect(tmp_path / "runs", tmp_path / "all.h5")
    with xarray.open_dataset(tmp_path / "all.h5", engine="h5netcdf") as data:
        data = data.sortby("omega_0")
        np.testing.assert_allclose(data.slip_z[:2], data.slip_z_theory[:2], atol=1e-8)
        np.testing.assert_array_equal(
            np.isnan([data.slip_z_theory, data.y_theory]), [[0, 0, 1], [0, 1, 1]]
        )


def test_the_same_run_is_taken_once_and_refused_by_name_where_its_numbers_differ(runs, tmp_path):
    first, copy = min(runs.glob("*.h5")), runs / "copies" / "copy.h5"
    ((key, run),) = storage.load_runs(first).items()
    copy.parent.mkdir()
    shutil.copy(first, copy)
    assert collection.collect(runs, tmp_path / "all.h5") == 6
    storage.save_batch({key: dataclasses.replace(run, y=run.y + 1e-300)}, copy)
    (tmp_path / "all.h5").unlink()
    with pytest.raises(StorageError) as caught:
        collection.collect(runs, tmp_path / "all.h5")
    same = "hold the same run with different numbers"
    assert str(caught.value) == f"{copy / key} and {first / key} {same}"
    assert not (tmp_path / "all.h5").exists()


def test_what_is_no_run_is_left_out(runs):
    """The collection of the last time."""
    assert collection.collect(runs, runs / "all.h5") == 6
    assert collection.collect(runs, runs / "all.h5") == 6


def test_a_batch_is_described_like_a_collection_and_its_runs_are_named(tmp_path, capsys):
    (file,) = ran(tmp_path / "runs", [P.replace(omega_0=omega) for omega in OMEGAS]).iterdir()
    about = json.loads(told(capsys, f"inspect {file} --json"))
    assert about["varied"] == ["omega_0"]
    assert about["ranges"]["omega_0"] == [min(OMEGAS), max(OMEGAS)]
    for name, omega_0 in zip(about["names"], OMEGAS, strict=True):
        of_one = json.loads(told(capsys, f"inspect {name} --json"))
        assert of_one["parameters"]["omega_0"] == omega_0
    assert collection.collect(tmp_path / "runs", tmp_path / "all.h5") == 3
    names = collection.describe(collection.read(tmp_path / "all.h5"))["names"]
    assert [str(tmp_path / "runs" / name) for name in names] == about["names"]


def test_means_alone_make_the_same_collection_in_any_number_of_processes(tmp_path, capsys):
    """In less than a third of the space; what is done is not done again."""
    sweep = (
        "sweep --vary omega_0=5:10:6 --vary eta=0.1,0.3 --time 0.2 --batch 4 --workers 0 --quiet"
    )
    sizes, found = [], set()
    for name, more in (("whole", ""), ("means", "--means-only")):
        where, before = tmp_path / name, None
        for _ in range(2):
            told(capsys, f"{sweep} {more} -o {where}")
            files = {path: path.stat().st_mtime_ns for path in where.glob("*.h5")}
            assert before in (None, files)
            before = files
        sizes.append(sum(path.stat().st_size for path in files))
        for workers in (0, 2):
            output = tmp_path / f"{name}-{workers}.h5"
            assert collection.collect(where, output, workers) == 12
            with reading(output) as file:  # nan, too
                found.add(repr({each: column(dataset(file, each)).tolist() for each in file}))
    assert len(found) == 1
    assert sizes[1] < sizes[0] / 3
    assert collection.describe(collection.read(min(files)))["varied"] == ["eta", "omega_0"]
    said = refused(capsys, f"{sweep} -o {tmp_path / 'means'}")
    assert "holds another sweep (means_only = True, not False)" in said


def test_a_sweep_is_sampled_as_often_as_asked(tmp_path, capsys):
    sweep = f"sweep --vary omega_0=5,6 --time 0.2 --workers 0 --quiet -o {tmp_path / 's'}"
    sweep += " --sample-interval"
    for wrong, why in (("0.5", "within this run"), ("1e-5", "to hold a time step")):
        assert f"out of range: {why} it must be" in refused(capsys, f"{sweep} {wrong}")
    assert not (tmp_path / "s").exists()
    told(capsys, f"{sweep} 0.05")
    (file,) = (tmp_path / "s").glob("*.h5")
    assert {len(run.time) for run in storage.load_runs(file).values()} == {5}


BLUNT = P.replace(drag="quadratic", nu_f=1e-6, C_D=0.5, density_ratio=0.125)
MEASURED = (
    dataclasses.replace(
        measured("settled", "omega_c", 11.9, 1e-9, case="RR"),
        runs=("runs/a.h5", "runs/b.h5"),
        budget={"drift": 8e-10, "solver": 6e-10},
    ),
    measured("settled", "force_Ay", 0.1, case="SS", y=0.25),
    measured("settled", "case", 4),
    measured("settled", "slip_x", np.float64(0.1), 1e-9, BLUNT, mode=1),
)


@pytest.mark.parametrize("rows", [MEASURED, ()])
def test_a_file_gives_back_what_was_saved(rows, tmp_path):
    records = Records(rows, (Missing("settled", "reference", "it never settles"),))
    path = tmp_path / "settled.h5"
    record.save(records, path, {"level": "QUICK"})
    assert record.load(path) == records
    with xarray.open_dataset(path, engine="h5netcdf") as data:
        table = data.to_dataframe()
    assert list(table.quantity) == [m.quantity for m in rows]
    assert list(table.omega_0) == [P.omega_0] * len(rows)
    assert [table.unit[1], np.isnan(table.at_y[0])] == ["N", True] if rows else table.empty


def test_a_missing_file_is_named_and_an_unknown_quantity_refused(tmp_path):
    with pytest.raises(StorageError, match="no such file"):
        record.load(tmp_path / "nothing.h5")
    with pytest.raises(InputError, match="omega_c"):
        measured("settled", "omega_d", 1.0)


def test_runs_and_collections_as_tables_and_a_collection_drawn(here, capsys):
    """What is written has units in its head, and is read again."""
    ran(here / "runs", [P.replace(omega_0=10.0), P.replace(omega_0=20.0), P])
    told(capsys, "collect runs -o all.h5 --workers 0")
    told(capsys, "inspect all.h5 --table all.csv --plot curve.svg")
    head, *rows = csv.reader((here / "all.csv").read_text("utf-8").splitlines())
    assert {"run", "omega_0 (rad/s)", "omega_c_uncertainty (rad/s)", "eta", "case"} <= {*head}
    with reading(here / "all.h5") as file:
        flows = sorted(dataset(file, "omega_0")[...].tolist())
    assert sorted(float(row[head.index("omega_0 (rad/s)")]) for row in rows) == flows
    assert "theory" in (here / "curve.svg").read_text("utf-8")
    told(capsys, "simulate --time 0.1 --engine event -o run.h5")
    told(capsys, "inspect run.h5 --table run.csv")
    head = (here / "run.csv").read_text("utf-8")
    assert head.startswith("time (s),theta (rad),y (m),v_y (m/s)")
    assert_tracks("run.csv", "run.h5", rms=1e-15)
    ran(here / "one", [P])
    told(capsys, "collect one -o one.h5 --workers 0")
    assert "only a collection in which" in refused(capsys, "inspect one.h5 --plot x.png")


def test_commands_write_csv_where_the_name_says_so(here, monkeypatch, capsys):
    line = "simulate --time 0.1 --engine event -o"
    told(capsys, f"{line} run.h5")
    assert "written to run.CSV" in told(capsys, f"{line} run.CSV")
    assert_tracks("run.CSV", "run.h5", rms=1e-15)
    monkeypatch.setattr("compare.commands.simulate.store", broke_down)
    assert carried_out(capsys, f"{line} run.csv")[2].endswith("are kept in run.failed.csv\n")
    assert (here / "run.failed.csv").read_text("utf-8").startswith("time (s),")
    assert not (here / "run.csv").exists()

    ran(here / "runs", [P.replace(omega_0=10.0), P.replace(omega_0=20.0)])
    told(capsys, "collect runs -o all.csv --workers 0")
    told(capsys, "collect runs -o all.h5 --workers 0")
    told(capsys, "inspect all.h5 --table again.csv")
    assert Path("all.csv").read_text("utf-8") == Path("again.csv").read_text("utf-8")
    told(capsys, "collect runs -o runs/all.h5 --workers 0")
    told(capsys, "collect runs -o more.csv --workers 0")  # beside a collection
    assert Path("all.csv").read_text("utf-8") == Path("more.csv").read_text("utf-8")

    data = json.loads(told(capsys, "predict --omega-0 25 --json -o cases.csv"))
    rows = list(csv.DictReader(Path("cases.csv").read_text("utf-8").splitlines()))
    assert [row["case"] for row in rows] == [each["case"] for each in data["solutions"]]
    for row, each in zip(rows, data["solutions"], strict=True):
        assert float(row["omega_c (rad/s)"]) == each["x"]["omega_c"]
        assert float(row["force_Ay (N)"]) == each["force_A"][1]
        assert float(row["omega_01 (rad/s)"]) == data["thresholds"]["omega_01"]
        assert row["slip_stable"] == str(each["slip_stable"])


def broke_down(task, path, **_):
    """What `store` does of a run that breaks down at its end."""
    storage.save(carry_out(task), failed_path(path))
    return "broke down"


def test_what_has_not_settled_is_ringed(here, capsys):
    for lasts, ringed in ((2.0, True), (60.0, False)):
        sets = [P.replace(omega_0=omega_0) for omega_0 in (8.0, 10.0)]
        ran(here / f"{lasts:g}s", sets, t_end=lasts)
        carried_out(capsys, f"collect {lasts:g}s -o all.h5 --workers 0")
        told(capsys, "inspect all.h5 --plot curve.svg")
        assert ("not settled: 2" in Path("curve.svg").read_text("utf-8")) == ringed
