"""A run comes back from its file as it was, and a file that was damaged, cut or is foreign is
refused by name."""

import dataclasses
import io
import json
import os
import subprocess
import sys
import tomllib
from importlib.metadata import EntryPoint
from pathlib import Path

import h5py
import numpy as np
import pandas
import pytest
import xarray

from model import Case, Events, Flow, Header, Parameters, Trajectory, storage, versions
from model.errors import InputError, StorageError
from model.files import write_text
from model.hdf5 import sealed
from model.trajectory import SAMPLE, columns


def make(n=50, events=2, failure=""):
    rng = np.random.default_rng(0)
    samples = np.empty(n, SAMPLE)
    for name in columns(Trajectory):
        shape = samples[name].shape
        samples[name] = rng.integers(0, 9, n) if name == "case" else rng.normal(size=shape)
    header = Header(
        engine="event",
        parameters=Parameters.named("steel-in-water").replace(drag="quadratic", C_D=0.5),
        flow=Flow.ramp(10, 20, 3),
        settings={"rtol": 1e-9, "method": "event"},
        mjcf="<mujoco/>",
        failure=failure,
        created="2026-01-01T00:00:00+00:00",
    )
    happened = Events(
        time=np.arange(events, dtype=float),
        from_case=np.full(events, Case.RR, np.int8),
        to_case=np.full(events, Case.SS, np.int8),
        impulse_A=rng.normal(size=(events, 3)),
        impulse_B=np.zeros((events, 3)),
    )
    return Trajectory.from_blocks(header, [samples[: n // 3], samples[n // 3 :]], happened)


def assert_same(a, b):
    for name in columns(Trajectory):
        np.testing.assert_array_equal(getattr(a, name), getattr(b, name))
    for name in columns(Events):
        np.testing.assert_array_equal(getattr(a.events, name), getattr(b.events, name))
    one, two = dataclasses.asdict(a.header), dataclasses.asdict(b.header)
    assert one.pop("flow")["value"].tolist() == two.pop("flow")["value"].tolist()
    assert one == two


@pytest.mark.parametrize(("n", "events"), [(50, 2), (0, 0), (1, 0), (5000, 7)])
def test_what_is_saved_is_loaded(tmp_path, n, events):
    trajectory, path = make(n, events), tmp_path / "run.h5"
    storage.save(trajectory, path)
    assert_same(storage.load(path), trajectory)
    assert [path.name for path in tmp_path.iterdir()] == ["run.h5"]
    # As a batch it is one of a run without a name.
    assert storage.contents(path)[1] == []
    assert_same(storage.load_runs(path)[""], trajectory)


@pytest.mark.parametrize(("n", "events", "failure"), [(50, 2, ""), (0, 0, "diverged"), (1, 0, "")])
def test_xarray_sees_axes_units_and_cases_in_a_file_and_in_memory(tmp_path, n, events, failure):
    trajectory = make(n, events, failure)
    storage.save(trajectory, tmp_path / "run.h5")
    data = trajectory.to_xarray()
    with xarray.open_dataset(tmp_path / "run.h5", engine="h5netcdf") as stored:
        xarray.testing.assert_identical(data, stored)
    assert data.omega_c.dims == ("time",)
    assert data.event_from.dims == ("event_time",)
    np.testing.assert_array_equal(data.omega_c, trajectory.omega_c)
    np.testing.assert_array_equal(data.force_B.sel(axis="y"), trajectory.force_B[:, 1])
    np.testing.assert_array_equal(data.omega_0, trajectory.header.flow(trajectory.time))
    assert data.omega_c.units == "rad s-1"
    assert all({"units", "long_name"} <= set(data[name].attrs) for name in columns(Trajectory))
    names = data.case.flag_meanings.split()
    assert [names[code] for code in data.case.values] == [case.name for case in trajectory.cases]
    parameters = dataclasses.asdict(trajectory.header.parameters)
    assert json.loads(data.parameters) == parameters
    assert {name: data.attrs[name] for name in parameters} == parameters
    with h5py.File(tmp_path / "run.h5") as file:  # without xarray, too
        assert h5py.check_enum_dtype(file["case"].dtype) == {case.name: case.value for case in Case}


@pytest.mark.parametrize(
    ("library", "needed"), [("xarray", "xarray h5netcdf"), ("pandas", "pandas")]
)
def test_without_the_library_it_is_named(monkeypatch, library, needed):
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(InputError, match=f"pip install {needed}"):
        getattr(make(), f"to_{library}")()


def test_a_table_has_a_row_for_each_sample_in_pandas_and_in_xarray(tmp_path):
    """Which reads it by the entry point that it looks up where dualball is installed."""
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    place = project["entry-points"]["xarray.backends"]["dualball"]
    backend = EntryPoint("dualball", place, "").load()
    trajectory = make(50, 2)
    expected = trajectory.to_pandas()
    assert expected.index.name == "time"
    np.testing.assert_array_equal(expected.force_By, trajectory.force_B[:, 1])
    np.testing.assert_array_equal(expected.omega_0, trajectory.omega_0)
    assert list(expected.case) == [case.name for case in trajectory.cases]
    assert expected.attrs["mu"] == trajectory.header.parameters.mu
    storage.save(trajectory, tmp_path / "run.h5")
    storage.save_batch({"KEY": trajectory}, tmp_path / "batch.h5")
    (tmp_path / "text.h5").write_text("time,omega_c")
    for path in ("run.h5", "batch.h5/KEY"):
        with xarray.open_dataset(tmp_path / path, engine=backend) as run:
            table = run.to_dataframe()
            assert run.force_Ay.units == "N"
            assert run.attrs["mu"] == trajectory.header.parameters.mu
            run.to_netcdf(tmp_path / "copy.nc")
        alike = expected.astype({"case": table.case.dtype})[table.columns]
        pandas.testing.assert_frame_equal(table, alike)
    with xarray.open_dataset(tmp_path / "run.h5", engine=backend, drop_variables="theta") as run:
        assert "theta" not in run
    said = {"text.h5": "text.h5", "none.h5": "none.h5", "batch.h5": "name one of them"}
    for path, message in said.items():
        with pytest.raises(StorageError, match=message):
            xarray.open_dataset(tmp_path / path, engine=backend)
    with pytest.raises(InputError, match="by its name, not a BytesIO"):
        xarray.open_dataset(io.BytesIO(), engine=backend)


FULL = """
import resource, sys
from tests.model.test_storage import make
from model import StorageError, storage
path, hard = sys.argv[1], resource.getrlimit(resource.RLIMIT_FSIZE)[1]
for size in (0, 40, 900, 3000, 20_000, 60_000, 90_000):
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    for write in (
        lambda: storage.save(make(2000), path),
        lambda: storage.save_batch({"a": make(400)}, path),
    ):
        try:
            write()
        except StorageError as error:
            print(error)
"""


def test_a_disk_that_fills_at_any_moment(tmp_path):
    """In a process of its own, which HDF5 might crash; a limit on the size of files plays the
    disk."""
    path, here = tmp_path / "run.h5", Path(__file__).parents[2]
    program = [sys.executable, "-c", FULL, str(path)]
    answer = subprocess.run(program, cwd=here, capture_output=True, text=True, check=True)
    assert answer.stderr == ""
    assert answer.stdout.splitlines() == [f"cannot write {path}: File too large"] * 14
    assert list(tmp_path.iterdir()) == []


def edit(path, change):
    """Change what a file holds, and give it a checksum that fits."""
    with h5py.File(path, "r+") as file:
        change(file)
    path.write_bytes(sealed(path.read_bytes()))


def replace(file, name, value):
    del file[name]
    file[name] = value


def test_a_file_from_before_the_flow_was_a_column_is_read(tmp_path):
    def age(file):
        del file["omega_0"], file.attrs["Conventions"], file.attrs["title"], file.attrs["mu"]

    storage.save(make(), tmp_path / "run.h5")
    edit(tmp_path / "run.h5", age)
    assert_same(storage.load(tmp_path / "run.h5"), make())


BATCH = {"a": make(50, 2), "b": make(0, 0, "diverged"), "c": make(7, 9)}


def test_the_runs_of_a_batch_are_one_file(tmp_path):
    """Of any numbers of samples and events; each is read as if it had a file of its own."""
    path = tmp_path / "batch.h5"
    storage.save_batch(BATCH, path)
    assert [each.name for each in tmp_path.iterdir()] == ["batch.h5"]
    assert storage.contents(path) == (versions.current_versions()["dualball"], ["a", "b", "c"])
    loaded = storage.load_runs(path)
    for name, run in BATCH.items():
        assert_same(loaded[name], run)
        assert_same(storage.load(path / name), run)
    assert [storage.exists(each / "a") for each in (path, tmp_path / "other")] == [True, False]
    with xarray.open_dataset(path, engine="h5netcdf") as data:
        assert data.force_A.dims == ("run", "sample", "axis")
        assert data.event_from.dims == ("run", "event")
        assert data.omega_c.units == "rad s-1"
        assert data.samples.values.tolist() == [50, 0, 7]
        np.testing.assert_array_equal(data.omega_c.sel(run="c")[:7], BATCH["c"].omega_c)
    for name, says in (("", "name one of them, as FILE/NAME"), ("d", "holds no run of that name")):
        with pytest.raises(StorageError, match=says):
            storage.load(path / name)


def attribute(name, value):
    return lambda file: file.attrs.__setitem__(name, value)


def column(name, value):
    return lambda file: replace(file, name, value)


@pytest.mark.parametrize(
    ("name", "change", "says"),
    [
        ("run.h5", attribute("schema", "other"), "not a dualball-trajectory"),
        ("run.h5", attribute("schema_version", 99), "newer dualball: its schema version is 99"),
        ("run.h5", attribute("schema_version", "x"), "no valid schema version"),
        ("run.h5", lambda f: f.attrs.__delitem__("engine"), "attribute 'engine' is missing"),
        ("run.h5", attribute("flow", "{"), "attribute 'flow' is not JSON"),
        ("run.h5", attribute("settings", "[]"), "attribute 'settings' is not a table"),
        ("run.h5", attribute("parameters", '{"m": -1}'), "missing parameter"),
        ("run.h5", lambda f: f.__delitem__("omega_c"), "no dataset 'omega_c'"),
        ("run.h5", column("omega_c", h5py.SoftLink("/y")), "no dataset 'omega_c' of its own"),
        ("run.h5", column("force_A", np.zeros(50)), "'force_A' has shape"),
        ("run.h5", column("y", np.zeros(49)), "differ in length"),
        ("run.h5", column("y", np.array([b"a"] * 50)), "'y' has type"),
        ("run.h5", column("case", np.full(50, 9, np.int8)), "case that does not exist"),
        ("batch.h5/a", attribute("schema_version", 2), "newer dualball: its schema version is 2"),
        ("batch.h5/a", column("header", ["{"] * 3), "attribute 'header' is not JSON"),
        ("batch.h5/a", column("samples", [50, 0]), "does not hold what it should"),
        ("batch.h5/a", lambda f: f["case"].__setitem__((0, 0), 9), "case that does not exist"),
    ],
)
def test_a_foreign_or_damaged_file_is_refused(tmp_path, name, change, says):
    storage.save(make(), tmp_path / "run.h5")
    storage.save_batch(BATCH, tmp_path / "batch.h5")
    file = tmp_path / name.partition("/")[0]
    edit(file, change)
    with pytest.raises(StorageError, match=says) as caught:
        storage.load(tmp_path / name)
    assert str(file) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_where_nothing_is_read_or_written(tmp_path):
    """What is no file is not replaced: as the superuser, renaming one to /dev/null would take it
    from everyone."""
    with pytest.raises(StorageError, match=r"^cannot write .*: No such file or directory$"):
        storage.save(make(), tmp_path / "absent" / "run.h5")
    with pytest.raises(StorageError, match=r"^cannot read .*: there is no such file$"):
        storage.load(tmp_path / "absent.h5")
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(StorageError, match="pipe: it is not a file"):
        write_text(tmp_path / "pipe", "")
    with pytest.raises(StorageError, match="pipe: it is not a file"):
        storage.save(make(), tmp_path / "pipe")
