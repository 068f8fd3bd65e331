"""Damaged files: one clear line or the right result, never a traceback, a wrong number or a file elsewhere."""

import shutil
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import analytic
from compare import testing
from compare.commands import cli
from compare.kit import collection, record
from compare.kit.levels import Level
from compare.kit.record import Missing, Records
from compare.report import results
from compare.view import motions
from model import InputError, Parameters, State, StorageError, storage
from model.hdf5 import seal
from tests.measured import measured

ENOUGH = pytest.mark.parametrize("count", [100, pytest.param(2000, marks=pytest.mark.slow)])
"""Mutations of one file."""
P = Parameters.named("reference")
CHUNKS = "in chunks"
"""A run file of several chunks."""
RUNS = ["event", "time-stepping", "mujoco", CHUNKS]
"""Run files: those of other engines differ from MuJoCo's in what their header says of settings."""


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """A few bits flipped, stretches of bytes changed, zeroed, removed or doubled, the end cut off, words inserted.

    Something else, in any case: zeros may be zeroed.
    """
    content = bytearray(data)
    for _ in range(rng.integers(1, 4)):
        at = int(rng.integers(0, len(content) + 1))
        stretch = slice(at, at + int(rng.integers(1, 33)))
        length = len(content[stretch])
        match int(rng.integers(7)):
            case 0:
                content[at : at + 1] = bytes(byte ^ 1 << int(rng.integers(8)) for byte in content[at : at + 1])
            case 1:
                content[stretch] = rng.bytes(length)
            case 2:
                content[stretch] = bytes(length)
            case 3:
                del content[stretch]
            case 4:
                content[at:at] = content[stretch]
            case 5 if rng.integers(4) == 0:
                del content[at:]
            case _:
                content[at:at] = rng.choice([b"=", b"\n", b"nan", b"-", b"1e999", b"[x]", b'"', b"\0", b"\xff", b"inf"])
    return bytes(content) if content != data else mutated(data, rng)


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A file of every kind, by what it is."""
    made = tmp_path_factory.mktemp("whole")
    kept = {name: made / "runs" / f"{name}.h5" for name in RUNS} | {"collection": made / "all.h5"}
    kept |= {
        "measurements": made / "measurements" / "settled.h5",
        "batch": made / "batch.h5",
        "means": made / "means.h5",
    }
    (made / "runs").mkdir()
    (made / "measurements").mkdir()
    for name in RUNS[:3]:
        assert cli.main(["simulate", "--engine", name, "--time", "0.05", "-o", str(kept[name]), "--json"]) == 0
    storage.save(analytic.simulate(P, State(), 5.0, sample_interval=1e-3), kept[CHUNKS])
    collection.collect(made / "runs", kept["collection"])
    runs = {name: storage.load(kept[name]) for name in RUNS[:3]}
    storage.save_batch(runs, kept["batch"])
    collection.save_means(runs, kept["means"])
    values = ("omega_c", 11.9), ("force_Ay", 0.1)
    rows = (measured("settled", *each, 1e-9, case="RR", y=0.1) for each in values)
    record.save(Records(tuple(rows), (Missing("settled", "x", "it never settles"),)), kept["measurements"], {})
    return kept


@contextmanager
def edited(path: Path) -> Iterator[h5py.File]:
    """A file to be changed, which has a checksum that fits afterwards."""
    with h5py.File(path, "r+") as file:
        yield file
    with path.open("r+b") as content:
        seal(content)


def refusals(path: Path, good: bytes, read: Callable[[Path], Any], count: int, seed: int) -> list[str]:
    """What is said where mutations of a file are refused: a line that names a file there; nothing else is written."""
    rng, said, beside = np.random.default_rng(seed), list[str](), sorted(path.parent.iterdir())
    for _ in range(count):
        path.write_bytes(mutated(good, rng))
        try:
            read(path)
        except InputError as error:
            said.append(str(error))
    assert not [line for line in said if str(path.parent) not in line or "\n" in line]
    assert {*path.parent.iterdir()} <= {*beside, path}
    return said


def parts(path: Path) -> list[Any]:
    """A run, read in parts."""
    return list(storage.parts(path, 400))


READERS: list[tuple[str, Callable[[Path], Any]]] = [
    *((name, read) for name in RUNS for read in (storage.load, parts)),
    ("batch", storage.contents),
    ("batch", storage.load_runs),
    ("collection", collection.describe),
    ("means", collection.describe),
    ("means", storage.contents),
    ("measurements", record.load),
]


@ENOUGH
@pytest.mark.parametrize(("kind", "read"), READERS)
def test_damage_is_one_line(tmp_path, files, kind, read, count):
    said = refusals(path := tmp_path / "bad.h5", files[kind].read_bytes(), read, count, seed=2)
    assert len([line for line in said if str(path) in line]) == count


def results_of(measurements: Path) -> Path:
    """A results directory with these measurements, before they are damaged."""
    directory = measurements.parents[1]
    names = [measurements.relative_to(directory).as_posix()]
    results.save(results.Summary.of([], Level.QUICK, {"mujoco": {1: names}}), directory)
    return directory


@pytest.mark.parametrize(
    ("kind", "command"),
    [
        *((name, "inspect FILE") for name in RUNS),
        ("event", "inspect FILE --plot DIRECTORY/plot.png"),
        ("event", "render FILE -o DIRECTORY/picture.png"),
        ("event", "collect RUNS -o DIRECTORY/all.h5"),
        ("batch", "inspect FILE"),
        ("batch", "inspect FILE/event"),
        ("collection", "inspect FILE"),
        ("measurements", "inspect FILE"),
        ("measurements", "judge RESULTS"),
        ("measurements", "judge RESULTS --verbose"),
        ("measurements", "figures --results RESULTS -o DIRECTORY"),
    ],
)
def test_every_command_names_the_damaged_file(tmp_path, files, capsys, kind, command):
    path = tmp_path / "results" / "measurements" / "bad.h5"
    path.parent.mkdir(parents=True)
    content = bytearray(files[kind].read_bytes())
    content[len(content) // 2] ^= 16
    path.write_bytes(content)
    places = {"FILE": path, "DIRECTORY": tmp_path, "RUNS": path.parent, "RESULTS": results_of(path)}
    capsys.readouterr()
    for word, place in places.items():
        command = command.replace(word, str(place))
    assert cli.main(command.split()) == 2
    out, err = capsys.readouterr()
    assert out == ""
    reason = "it is damaged (its content does not match its checksum)"
    assert err == f"dualball: error: cannot read {path}: {reason}\n"


@pytest.mark.parametrize("count", [20, pytest.param(500, marks=pytest.mark.slow)])
@pytest.mark.parametrize("engine", RUNS[:3])
def test_a_header_that_says_something_else(tmp_path: Path, files: dict[str, Path], engine: str, count: int) -> None:
    """With a checksum that fits, so that what the header says is read: it is shown, or refused in one line."""
    good, rng, path = files[engine].read_bytes(), np.random.default_rng(4), tmp_path / "run.h5"
    refusals = []
    for _ in range(count):
        path.write_bytes(good)
        with edited(path) as file:
            name = str(rng.choice(["parameters", "flow", "settings", "versions"]))
            text = mutated(file.attrs[name].encode(), rng).decode("utf-8", "replace")
            file.attrs[name] = text.replace("\0", "?")
        try:
            motions.table(motions.describe(path))
        except StorageError as error:
            refusals.append(str(error))
    assert len(refusals) > count / 4
    assert all(str(path) in message and "\n" not in message for message in refusals)


@pytest.mark.parametrize("count", [30, pytest.param(500, marks=pytest.mark.slow)])
def test_a_damaged_summary_is_one_line(tmp_path, files, count):
    path = tmp_path / "measurements" / "settled.h5"
    path.parent.mkdir()
    path.write_bytes(files["measurements"].read_bytes())
    summary = results_of(path) / results.SUMMARY

    def judged(_):
        stored = results.load(tmp_path)
        results.testimony(tmp_path, stored.measurements)
        # What is not a reference to measurements is made anew by judging.
        named = [name for steps in stored.measurements.values() for names in steps.values() for name in names]
        assert {tmp_path / name for name in named} <= {path}

    assert len(refusals(summary, summary.read_bytes(), judged, count, seed=3)) > count / 2


@ENOUGH
@pytest.mark.parametrize("name", ["reference", "steel-in-water"])
def test_toml(tmp_path, name, count):
    """A file that is read after all says what it says."""

    def read(path):
        p, values = Parameters.load(path), tomllib.loads(path.read_text("utf-8"))
        assert all(getattr(p, name) == values[name] for name in set(values) - {"fluid"})

    good = (Path(__file__).parents[2] / f"model/parameter_sets/{name}.toml").read_bytes()
    assert count / 3 < len(refusals(tmp_path / "bad.toml", good, read, count, seed=1)) < count


def virtual(file, secret):
    layout = h5py.VirtualLayout((51,), float)
    layout[:] = h5py.VirtualSource(secret, "x", (51,))
    file.create_virtual_dataset("y", layout)


def link(file, secret):
    file["y"] = h5py.ExternalLink(secret, "x")


def external(file, secret):
    file.create_dataset("y", (51,), float, external=[(str(secret), 0, 51 * 8)])


@pytest.fixture
def foreign(tmp_path: Path) -> Path:
    """A motion as another program keeps it, without a checksum."""
    path = tmp_path / "foreign.h5"
    with h5py.File(path, "w") as file:
        file["time"], file["omega_c"] = np.linspace(0.0, 1.0, 51), np.linspace(10.0, 11.0, 51)
    return path


def compared(path: Path, capsys: pytest.CaptureFixture[str]) -> str:
    """The line in which `compare` refuses a file."""
    assert cli.main(["compare", str(path), str(path)]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"dualball: error: cannot read {path}: ")
    assert err.count("\n") == 1
    return err


@pytest.mark.parametrize("outside", [virtual, link, external])
def test_nothing_in_a_file_is_followed(tmp_path, files, foreign, capsys, outside):
    """To another file: neither in a run nor in what another program wrote."""
    secret, run = tmp_path / "secret.h5", tmp_path / "run.h5"
    with h5py.File(secret, "w") as file:
        file["x"] = np.arange(51.0)
    shutil.copy(files["event"], run)
    with edited(run) as file:
        del file["y"]
        outside(file, secret)
    assert cli.main(["inspect", str(run)]) == 2
    assert "'y'" in capsys.readouterr().err
    assert cli.main(["compare", str(foreign), str(foreign)]) == 0
    capsys.readouterr()
    with h5py.File(foreign, "r+") as file:
        outside(file, secret)
    assert "'y'" in compared(foreign, capsys)


@pytest.mark.parametrize(
    ("made", "says"),
    [
        (
            {"shape": (4_000_000_000,), "dtype": float, "chunks": (1000,)},
            "'y' has 4e+09 samples, and 1e+07 are the most",
        ),
        ({"data": ["a", "b"]}, "'y' is no column of numbers"),
        ({"data": np.ones((51, 3))}, "'y' is no column of numbers"),
        ({"data": 1.0}, "'y' is no column of numbers"),
    ],
)
def test_what_is_no_column_is_said(foreign, capsys, made, says):
    with h5py.File(foreign, "r+") as file:
        file.create_dataset("y", **made)
    assert foreign.stat().st_size < 20_000
    assert says in compared(foreign, capsys)


@ENOUGH
def test_a_damaged_file_of_another_program_is_read_or_refused_in_a_line(foreign, count):
    assert len(refusals(foreign, foreign.read_bytes(), testing.read, count, seed=5)) > count / 10
