"""Mutated files: a clear error or the right result each time, never a traceback, a hang or a file elsewhere."""

from __future__ import annotations

import tomllib
from pathlib import Path

import h5py
import numpy as np
import pytest

from compare.commands import cli
from model import InputError, Parameters, StorageError, storage
from model.trajectory import Trajectory, columns

MUTATIONS = 2000


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """A few bytes changed, removed, repeated or inserted."""
    content = bytearray(data)
    for _ in range(rng.integers(1, 6)):
        at = int(rng.integers(0, len(content) + 1))
        kind = rng.integers(4)
        length = int(rng.integers(1, 9))
        if kind == 0:
            content[at : at + 1] = rng.bytes(1)
        elif kind == 1:
            del content[at : at + length]
        elif kind == 2:
            content[at:at] = content[at : at + length]
        else:
            content[at:at] = rng.choice(
                [b"=", b"\n", b"nan", b"-", b"1e999", b"[x]", b'"', b"\x00", b"\xff", b"0x", b"inf"]
            )
    return bytes(content)


def test_toml(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    Parameters.named("reference").save(tmp_path / "good.toml")
    good = (tmp_path / "good.toml").read_bytes()
    fluid = (Path(__file__).parents[2] / "model/parameter_sets/steel-in-water.toml").read_bytes()
    path = tmp_path / "bad.toml"
    refused = []
    for k in range(MUTATIONS // 2):
        content = mutated(good if k % 2 else fluid, rng)
        path.write_bytes(content)
        try:
            p = Parameters.load(path)
        except InputError as error:
            refused.append(str(error))
        else:  # then it says what the file says
            values = tomllib.loads(content.decode())
            for name in set(values) - {"fluid"}:
                assert getattr(p, name) == values[name]
    assert MUTATIONS // 4 < len(refused) < MUTATIONS // 2
    assert not any("\n" in message for message in refused)
    assert {entry.name for entry in tmp_path.iterdir()} == {"good.toml", "bad.toml"}


def test_hdf5(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    assert cli.main(["simulate", "--time", "0.05", "-o", str(tmp_path / "good.h5"), "--json"]) == 0
    good = (tmp_path / "good.h5").read_bytes()
    right = storage.load(tmp_path / "good.h5")
    path = tmp_path / "bad.h5"
    refused = []
    for _ in range(MUTATIONS // 2):
        path.write_bytes(mutated(good, rng))
        try:
            found = storage.load(path)
        except StorageError as error:
            refused.append(str(error))
        else:  # a byte that nothing depends on, or numbers that differ: shapes and types are those of a trajectory
            assert len(found.time) <= 2 * len(right.time)
            assert all(getattr(found, name).dtype == getattr(right, name).dtype for name in columns(Trajectory))
    assert len(refused) > MUTATIONS // 4
    assert not any("\n" in message for message in refused)
    assert {entry.name for entry in tmp_path.iterdir()} == {"good.h5", "bad.h5"}


def test_nothing_in_a_file_is_followed_or_executed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    secret = tmp_path / "secret.h5"
    with h5py.File(secret, "w") as file:
        file["x"] = np.arange(51.0)
    assert cli.main(["simulate", "--time", "0.05", "-o", str(tmp_path / "run.h5"), "--json"]) == 0
    with h5py.File(tmp_path / "run.h5", "r+") as file:
        del file["y"]
        layout = h5py.VirtualLayout((51,), float)
        layout[:] = h5py.VirtualSource(secret, "x", (51,))
        file.create_virtual_dataset("y", layout)
    capsys.readouterr()
    assert cli.main(["inspect", str(tmp_path / "run.h5")]) == 2
    assert "'y' is not a dataset of its own" in capsys.readouterr().err
