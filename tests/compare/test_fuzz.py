"""Damaged files: one clear line or the right result, never a traceback, a wrong number or a file
elsewhere."""

import re
import shutil
import tomllib
from contextlib import contextmanager
from pathlib import Path

import h5py
import numpy as np
import pytest

import analytic
from compare import testing
from compare.method import record
from compare.report import results
from compare.view import collection, motions
from model import InputError, Parameters, State, storage
from model.hdf5 import sealed
from tests.commands import refused, told

P = Parameters.named("reference")
SAMPLES = 1001
"""Of a run, as it comes."""
ENOUGH = pytest.mark.parametrize("count", [100, pytest.param(2000, marks=pytest.mark.slow)])
"""Mutants of a file."""


def mutated(data, rng):
    """A few stretches of bytes changed, zeroed, removed, doubled or replaced by a word, rarely the
    end cut off."""
    content = bytearray(data)
    for _ in range(rng.integers(1, 4)):
        at, length = int(rng.integers(len(content) + 1)), int(rng.integers(1, 33))
        old = content[at : at + length]
        word = rng.choice(
            [b"=", b"\n", b"nan", b"-", b"1e999", b"[x]", b'"', b"\0", b"\xff", b"inf"]
        )
        new = [
            bytes(byte ^ 1 for byte in old[:1]) + old[1:],
            rng.bytes(len(old)),
            bytes(len(old)),
            b"",
            2 * old,
            word,
        ]
        content[at : at + length] = new[rng.integers(len(new))]
        if rng.random() < 0.03:
            del content[at:]
    return bytes(content) if content != data else mutated(data, rng)


@pytest.fixture(scope="module")
def files(tmp_path_factory, stocked):
    """A file of every kind, by what it is; the run of theory has several chunks."""
    made = tmp_path_factory.mktemp("whole")
    kept = {
        name: made / f"{name}.h5" for name in ("theory", "mujoco", "batch", "collection", "means")
    }
    theory = analytic.simulate(P, State(), 5.0, sample_interval=1e-3)
    runs = {"a": theory, "b": analytic.simulate(P.replace(mu=0.3), State(), 1.0)}
    storage.save(theory, kept["theory"])
    storage.save_batch(runs, kept["batch"])
    collection.save_means(runs, kept["means"])
    (made / "runs").mkdir()
    shutil.copy(kept["batch"], made / "runs")
    collection.collect(made / "runs", kept["collection"])
    return kept | {"measurements": stocked / "results" / "measurements" / "settled.h5"}


@contextmanager
def edited(path):
    """A file to be changed, which has a checksum that fits afterwards."""
    with h5py.File(path, "r+") as file:
        yield file
    path.write_bytes(sealed(path.read_bytes()))


def refusals(path, mutants, read):
    """What is said where damaged contents of a file are refused: a line that names a file there;
    nothing is left."""
    said, beside = [], sorted(path.parent.iterdir())
    for content in mutants:
        path.write_bytes(content)
        try:
            read(path)
        except InputError as error:
            said.append(str(error))
    assert not [line for line in said if str(path.parent) not in line or "\n" in line]
    assert {*path.parent.iterdir()} <= {*beside, path}
    return said


def mutants(good, seed, count):
    rng = np.random.default_rng(seed)
    return (mutated(good, rng) for _ in range(count))


def described(path):
    gathered = collection.read(path)
    return collection.describe(gathered) if gathered else {}


@ENOUGH
@pytest.mark.parametrize(
    ("kind", "read"),
    [
        ("theory", storage.load),
        ("batch", storage.contents),
        ("batch", storage.load_runs),
        ("collection", described),
        ("means", described),
        ("means", storage.contents),
        ("measurements", record.load),
    ],
)
def test_all_damage_is_noticed(tmp_path, files, kind, read, count):
    said = refusals(path := tmp_path / "bad.h5", mutants(files[kind].read_bytes(), 2, count), read)
    assert len([line for line in said if str(path) in line]) == count


@pytest.mark.parametrize(
    ("kind", "command"),
    [
        ("theory", "inspect FILE"),
        ("theory", "inspect FILE --plot DIRECTORY/plot.png"),
        ("theory", "compare FILE FILE"),
        ("theory", "render FILE -o DIRECTORY/page.html"),
        ("theory", "collect RUNS -o DIRECTORY/all.h5"),
        ("batch", "inspect FILE"),
        ("batch", "inspect FILE/a"),
        ("collection", "inspect FILE"),
        ("measurements", "judge RESULTS"),
        ("measurements", "figures --results RESULTS -o DIRECTORY"),
    ],
)
def test_every_command_names_the_damaged_file(tmp_path, stocked, files, capsys, kind, command):
    directory = shutil.copytree(stocked / "results", tmp_path / "results")
    path = directory / "measurements" / "settled.h5"
    content = bytearray(files[kind].read_bytes())
    content[len(content) // 2] ^= 16
    path.write_bytes(content)
    places = {"FILE": path, "DIRECTORY": tmp_path, "RUNS": path.parent, "RESULTS": directory}
    for word, place in places.items():
        command = command.replace(word, str(place))
    reason = "it is damaged (its content does not match its checksum)"
    assert refused(capsys, command) == f"dualball: error: cannot read {path}: {reason}\n"


@pytest.mark.parametrize("count", [20, pytest.param(500, marks=pytest.mark.slow)])
@pytest.mark.parametrize("engine", ["theory", "mujoco"])
def test_a_header_that_says_something_else_is_shown_or_refused(
    tmp_path, files, capsys, engine, count
):
    """With a checksum that fits, so that what the header says is read."""
    if engine == "mujoco":
        told(capsys, f"simulate --time 0.05 -o {files[engine]}")
    rng, path = np.random.default_rng(4), tmp_path / "run.h5"

    def headers():
        for _ in range(count):
            shutil.copy(files[engine], path)
            with edited(path) as file:
                name = str(rng.choice(["parameters", "flow", "settings", "versions"]))
                text = mutated(file.attrs[name].encode(), rng).decode("utf-8", "replace")
                file.attrs[name] = text.replace("\0", "?")
            yield path.read_bytes()

    refused = refusals(path, headers(), lambda path: motions.table(motions.describe(path)))
    assert len(refused) > count / 4


@pytest.mark.parametrize("count", [30, pytest.param(500, marks=pytest.mark.slow)])
def test_a_damaged_summary_is_one_line(tmp_path, stocked, count):
    directory = shutil.copytree(stocked / "results", tmp_path / "results")
    summary = directory / results.SUMMARY

    def judged(_):
        kept = results.load(directory).measurements
        results.load_measurements(directory, "QUICK", kept, {})
        # What is not a reference to measurements is made anew by judging.
        assert {name for steps in kept.values() for names in steps.values() for name in names} <= {
            "measurements/settled.h5"
        }

    assert len(refusals(summary, mutants(summary.read_bytes(), 3, count), judged)) > count / 2


@ENOUGH
@pytest.mark.parametrize("name", ["reference", "steel-in-water"])
def test_a_set_that_is_read_after_all_says_what_it_says(tmp_path, name, count):
    def read(path):
        p, values = Parameters.load(path), tomllib.loads(path.read_text("utf-8"))
        assert all(getattr(p, name) == values[name] for name in set(values) - {"fluid"})

    good = (Path(__file__).parents[2] / f"model/parameter_sets/{name}.toml").read_bytes()
    assert count / 3 < len(refusals(tmp_path / "bad.toml", mutants(good, 1, count), read)) < count


@pytest.fixture
def foreign(tmp_path):
    """A motion as another program keeps it, without a checksum."""
    path = tmp_path / "foreign.h5"
    with h5py.File(path, "w") as file:
        file["time"] = np.linspace(0.0, 1.0, SAMPLES)
        file["omega_c"] = np.linspace(10.0, 11.0, SAMPLES)
    return path


@ENOUGH
def test_a_damaged_file_of_another_program_is_read_or_refused_in_a_line(foreign, count):
    refused = refusals(foreign, mutants(foreign.read_bytes(), 5, count), testing.read)
    assert len(refused) > count / 10


def virtual(file, secret):
    layout = h5py.VirtualLayout((SAMPLES,), float)
    layout[:] = h5py.VirtualSource(secret, "y", (SAMPLES,))
    file.create_virtual_dataset("y", layout)


def link(file, secret):
    file["y"] = h5py.ExternalLink(secret, "y")


def external(file, secret):
    file.create_dataset("y", (SAMPLES,), float, external=[(str(secret), 0, SAMPLES * 8)])


@pytest.mark.parametrize("outside", [virtual, link, external])
def test_nothing_in_a_run_is_followed_to_another_file(tmp_path, stocked, capsys, outside):
    run = tmp_path / "run.h5"
    shutil.copy(stocked / "run.h5", run)
    with edited(run) as file:
        del file["y"]
        outside(file, stocked / "runs" / "one.h5")
    assert "'y'" in refused(capsys, f"inspect {run}")


@pytest.mark.parametrize(
    ("add", "says"),
    [
        *((outside, "'y'") for outside in (virtual, link, external)),
        (
            lambda file, _: file.create_dataset("y", (4 * 10**9,), float, chunks=(1000,)),
            "4e+09 samples, and 1e+07 are",
        ),
        *((lambda file, _, data=data: file.create_dataset("y", data=data), "'y' is no column of "
                                                                           "numbers")
          for data in (["a", "b"], np.ones((SAMPLES, 3)), 1.0)),
    ],
)  # fmt: skip
def test_what_is_no_column_of_a_foreign_file_is_said(foreign, stocked, capsys, add, says):
    told(capsys, f"compare {foreign} {foreign}")
    with h5py.File(foreign, "r+") as file:
        add(file, stocked / "runs" / "one.h5")
    assert re.search(
        f"cannot read {foreign}: .*{re.escape(says)}",
        refused(capsys, f"compare {foreign} {foreign}"),
    )


@pytest.mark.parametrize("means", ["", "--means-only"])
@pytest.mark.parametrize("values", [None, ["a", "b"], [1.0], [[1.0, 2.0]], 1.0])
@pytest.mark.parametrize("name", ["omega_c", "case", "run", "failure", "C_D"])
def test_what_is_no_column_of_a_collection_is_said(tmp_path, capsys, means, values, name):
    sweep = f"sweep --vary omega_0=1,2 --time 0.05 --engine event --workers 0 {means}"
    told(capsys, f"{sweep} --quiet -o {tmp_path / 'runs'}")
    path = next((tmp_path / "runs").glob("*.h5")) if means else tmp_path / "sweep.h5"
    told(capsys, f"collect {tmp_path / 'runs'} -o {tmp_path / 'sweep.h5'} --workers 0")
    with edited(path) as file:
        del file[name]
        if values:
            file[name] = values
    if name not in ("run", "failure") or values != ["a", "b"]:
        assert name in refused(capsys, f"inspect {path} --table {tmp_path / 'new.csv'}")
