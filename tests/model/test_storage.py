"""A run comes back from its file as it was, and a file that was damaged, cut or is foreign is refused by name."""

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

from model import Case, Events, Flow, Header, InputError, Parameters, StorageError, Trajectory, storage, versions
from model.files import write_text
from model.hdf5 import seal
from model.trajectory import SAMPLE, columns


def make(n=50, events=2, failure=""):
    rng = np.random.default_rng(0)
    samples = np.empty(n, SAMPLE)
    for name in columns(Trajectory):
        samples[name] = rng.normal(size=samples[name].shape) if name != "case" else rng.integers(0, 9, n)
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


@pytest.fixture
def path(tmp_path):
    """A file of a run."""
    storage.save(make(), tmp_path / "run.h5")
    return tmp_path / "run.h5"


@pytest.mark.parametrize(("n", "events"), [(50, 2), (0, 0), (1, 0), (5000, 7)])
def test_what_is_saved_is_loaded(tmp_path, n, events):
    trajectory = make(n, events)
    storage.save(trajectory, tmp_path / "run.h5")
    assert_same(storage.load(tmp_path / "run.h5"), trajectory)
    assert [path.name for path in tmp_path.iterdir()] == ["run.h5"]
    # As a batch it is one of a run without a name.
    assert storage.contents(tmp_path / "run.h5")[1] == []
    assert_same(storage.load_runs(tmp_path / "run.h5")[""], trajectory)


def test_xarray_opens_it_with_axes_units_and_cases(tmp_path):
    trajectory = make()
    storage.save(trajectory, tmp_path / "run.h5")
    with xarray.open_dataset(tmp_path / "run.h5", engine="h5netcdf") as data:
        assert data.omega_c.dims == ("time",)
        assert data.force_A.dims == ("time", "axis")
        assert data.event_from.dims == ("event_time",)
        np.testing.assert_array_equal(data.omega_c, trajectory.omega_c)
        assert data.omega_c.units == "rad s-1"
        assert all({"units", "long_name"} <= set(data[name].attrs) for name in columns(Trajectory))
        names = data.case.flag_meanings.split()
        assert [names[code] for code in data.case.values] == [case.name for case in trajectory.cases]
        parameters = dataclasses.asdict(trajectory.header.parameters)
        assert json.loads(data.parameters) == parameters == {name: data.attrs[name] for name in parameters}
        assert data.title
        assert data.Conventions
        np.testing.assert_array_equal(data.omega_0, trajectory.header.flow(trajectory.time))
    with h5py.File(tmp_path / "run.h5") as file:  # without xarray, too
        assert h5py.check_enum_dtype(file["case"].dtype) == {case.name: case.value for case in Case}
    said = repr(trajectory)
    assert all(part in said for part in ("event: 50 samples", "last y=", trajectory.cases[0].name))


@pytest.mark.parametrize(("n", "events", "failure"), [(50, 2, ""), (0, 0, "diverged"), (1, 0, "")])
def test_in_memory_xarray_sees_what_it_reads_from_the_file(tmp_path, n, events, failure):
    trajectory = make(n, events, failure)
    storage.save(trajectory, tmp_path / "run.h5")
    with xarray.open_dataset(tmp_path / "run.h5", engine="h5netcdf") as stored:
        xarray.testing.assert_identical(trajectory.to_xarray(), stored)
    np.testing.assert_array_equal(trajectory.to_xarray().force_B.sel(axis="y"), trajectory.force_B[:, 1])


def test_without_xarray_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(InputError, match="pip install xarray h5netcdf"):
        make().to_xarray()


def test_a_table_for_pandas_has_a_row_for_each_sample(monkeypatch):
    trajectory = make(50, 2)
    table = trajectory.to_pandas()
    assert len(table) == 50
    assert table.index.name == "time"
    np.testing.assert_array_equal(table.force_By, trajectory.force_B[:, 1])
    np.testing.assert_array_equal(table.omega_0, trajectory.omega_0)
    assert list(table.case) == [case.name for case in trajectory.cases]
    assert table.attrs["mu"] == trajectory.header.parameters.mu
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(InputError, match="pip install pandas"):
        trajectory.to_pandas()


def test_xarray_reads_a_table_with_a_row_for_each_sample(tmp_path):
    """By the entry point, which it looks up where dualball is installed."""
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]
    backend = EntryPoint("dualball", project["entry-points"]["xarray.backends"]["dualball"], "").load()
    trajectory = make(50, 2)
    storage.save(trajectory, tmp_path / "run.h5")
    storage.save_batch({"KEY": trajectory}, tmp_path / "batch.h5")
    (tmp_path / "text.h5").write_text("time,omega_c")
    for path in ("run.h5", "batch.h5/KEY"):
        with xarray.open_dataset(tmp_path / path, engine=backend) as run:
            table, expected = run.to_dataframe(), trajectory.to_pandas()
            assert run.force_Ay.units == "N"
            assert run.attrs["mu"] == trajectory.header.parameters.mu
            run.to_netcdf(tmp_path / "copy.nc")
        pandas.testing.assert_frame_equal(table, expected.astype({"case": table.case.dtype})[table.columns])
    with xarray.open_dataset(tmp_path / "run.h5", engine=backend, drop_variables="theta") as run:
        assert "theta" not in run
    for path, message in (("text.h5", "text.h5"), ("none.h5", "none.h5"), ("batch.h5", "name one of them")):
        with pytest.raises(StorageError, match=message):
            xarray.open_dataset(tmp_path / path, engine=backend)
    with pytest.raises(InputError, match="by its name, not a BytesIO"):
        xarray.open_dataset(io.BytesIO(), engine=backend)


def test_chunks_arrive_while_the_run_goes_on(tmp_path):
    trajectory = make(300)
    samples = np.empty(300, SAMPLE)
    for name in columns(Trajectory):
        samples[name] = getattr(trajectory, name)
    path = tmp_path / "run.h5"
    with storage.TrajectoryWriter(path, trajectory.header) as writer:
        for block in np.array_split(samples, 7):
            writer.append(block)
            assert not path.exists()
        writer.end(trajectory.events)
    assert_same(storage.load(path), trajectory)


def test_a_run_that_breaks_off_leaves_nothing(tmp_path):
    def break_off():
        with storage.TrajectoryWriter(tmp_path / "run.h5", make().header) as writer:
            writer.append(np.zeros(10, SAMPLE))
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        break_off()
    assert list(tmp_path.iterdir()) == []


FULL = """
import resource, sys
from tests.model.test_storage import make
from model import StorageError, storage
path, hard = sys.argv[1], resource.getrlimit(resource.RLIMIT_FSIZE)[1]
for size in (0, 40, 900, 3000, 20_000, 60_000, 90_000):
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    for write in (lambda: storage.save(make(2000), path), lambda: storage.save_batch({"a": make(400)}, path)):
        try:
            write()
        except StorageError as error:
            print(error)
"""


def test_a_disk_that_fills_at_any_moment(tmp_path):
    """In a process of its own, since HDF5 might crash it; a limit on the size of files plays the disk."""
    program, here = [sys.executable, "-c", FULL, str(tmp_path / "run.h5")], Path(__file__).parents[2]
    answer = subprocess.run(program, cwd=here, capture_output=True, text=True, check=True)
    assert answer.stderr == ""
    assert answer.stdout.splitlines() == [f"cannot write {tmp_path / 'run.h5'}: File too large"] * 14
    assert list(tmp_path.iterdir()) == []


def test_no_directory_to_write_to(tmp_path):
    with pytest.raises(StorageError, match=r"^cannot write .*: No such file or directory$"):
        storage.save(make(), tmp_path / "absent" / "run.h5")
    with pytest.raises(StorageError, match=r"^cannot read .*: there is no such file$"):
        storage.load(tmp_path / "absent.h5")


def edit(path, change):
    """Change what a file holds, and give it a checksum that fits."""
    with h5py.File(path, "r+") as file:
        change(file)
    with path.open("r+b") as content:
        seal(content)


def replace(file, name, value):
    del file[name]
    file[name] = value


def test_a_file_from_before_the_flow_was_a_column_is_read(path):
    def age(file):
        del file["omega_0"], file.attrs["Conventions"], file.attrs["title"], file.attrs["mu"]

    edit(path, age)
    assert_same(storage.load(path), make())


@pytest.mark.parametrize("size", [1, 7, 50, 51])
def test_a_run_is_read_in_parts(tmp_path, size):
    trajectory = make(50, 2)
    storage.save(trajectory, tmp_path / "run.h5")
    parts = list(storage.parts(tmp_path / "run.h5", size))
    assert {len(part.time) for part in parts[:-1]} <= {size}
    assert all(len(part.events) == 2 for part in parts)
    for name in columns(Trajectory):
        joined = np.concatenate([getattr(part, name) for part in parts])
        np.testing.assert_array_equal(joined, getattr(trajectory, name))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda f: f.attrs.__setitem__("schema", "other"), "not a dualball-trajectory"),
        (lambda f: f.attrs.__setitem__("schema_version", 99), "newer dualball: its schema version is 99"),
        (lambda f: f.attrs.__setitem__("schema_version", "x"), "no valid schema version"),
        (lambda f: f.attrs.__delitem__("engine"), "attribute 'engine' is missing"),
        (lambda f: f.attrs.__setitem__("flow", "{"), "attribute 'flow' is not JSON"),
        (lambda f: f.attrs.__setitem__("settings", "[]"), "attribute 'settings' is not a table"),
        (lambda f: f.attrs.__setitem__("parameters", '{"m": -1}'), "missing parameter"),
        (lambda f: f.__delitem__("omega_c"), "no dataset 'omega_c'"),
        (lambda f: replace(f, "omega_c", h5py.SoftLink("/y")), "no dataset 'omega_c' of its own"),
        (lambda f: replace(f, "force_A", np.zeros(50)), "'force_A' has shape"),
        (lambda f: replace(f, "y", np.zeros(49)), "differ in length"),
        (lambda f: replace(f, "y", np.array([b"a"] * 50)), "'y' has type"),
        (lambda f: replace(f, "case", np.full(50, 9, np.int8)), "case that does not exist"),
    ],
)
def test_a_foreign_or_damaged_file_is_refused(path, change, says):
    edit(path, change)
    with pytest.raises(StorageError, match=says) as caught:
        storage.load(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


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
        (part,) = storage.parts(path / name, 10)
        assert_same(part, run)
    assert [storage.exists(each / "a") for each in (path, tmp_path / "other")] == [True, False]
    with xarray.open_dataset(path, engine="h5netcdf") as data:
        assert data.force_A.dims == ("run", "sample", "axis")
        assert data.event_from.dims == ("run", "event")
        assert data.omega_c.units == "rad s-1"
        assert data.samples.values.tolist() == [50, 0, 7]
        np.testing.assert_array_equal(data.omega_c.sel(run="c")[:7], BATCH["c"].omega_c)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda f: f.attrs.__setitem__("schema_version", 2), "newer dualball: its schema version is 2"),
        (lambda f: replace(f, "header", ["{"] * 3), "attribute 'header' is not JSON"),
        (lambda f: replace(f, "samples", [50, 0]), "does not hold what it should"),
        (lambda f: f["case"].__setitem__((0, 0), 9), "case that does not exist"),
    ],
)
def test_a_foreign_or_damaged_batch_is_refused(tmp_path, change, says):
    path = tmp_path / "batch.h5"
    storage.save_batch(BATCH, path)
    with pytest.raises(StorageError, match="name one of them, as FILE/NAME"):
        storage.load(path)
    with pytest.raises(StorageError, match="holds no run of that name"):
        storage.load(path / "d")
    edit(path, change)
    with pytest.raises(StorageError, match=says) as caught:
        storage.load(path / "a")
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_is_no_file_is_not_replaced(tmp_path):
    """As the superuser, renaming a whole file to /dev/null would take it from everyone."""
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(StorageError, match="pipe: it is not a file"):
        write_text(tmp_path / "pipe", "")
    with pytest.raises(StorageError, match="pipe: it is not a file"):
        storage.save(make(), tmp_path / "pipe")
