"""A run that is taken up again gives the bits of one that was never interrupted."""

from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from mjsim import ContactSettings, Run
from mjsim.journal import Journal
from model import Flow, Parameters, StorageError

P = Parameters.named("reference").replace(omega_0=25.0)


def run(directory: Path | None, runs: int = 1) -> Run:
    """Spin-up from rest through rolling into slipping: about four blocks of samples."""
    journal = Journal(directory, interval=0.0) if directory else None
    spin_up = [P] * runs, [np.zeros(8)] * runs, 4.5, [Flow.steady(25.0)] * runs, ContactSettings()
    return Run(*spin_up, sample_interval=5e-3, journal=journal)


def joined(part: Run) -> np.ndarray:
    return np.concatenate([block for own in zip(*part, strict=True) for block in own])


@pytest.fixture(scope="module")
def uninterrupted() -> dict[int, np.ndarray]:
    return {runs: joined(run(None, runs)) for runs in (1, 2)}


@pytest.mark.parametrize("runs", [1, 2])
@pytest.mark.parametrize("blocks", [0, 1, 2, 3])
def test_taken_up_after_some_blocks(tmp_path, uninterrupted, blocks, runs):
    list(islice(run(tmp_path / "journal", runs), blocks))
    again = run(tmp_path / "journal", runs)
    np.testing.assert_array_equal(joined(again), uninterrupted[runs])


def test_a_damaged_journal_says_what_to_do(tmp_path: Path) -> None:
    list(islice(run(tmp_path / "journal"), 2))
    (tmp_path / "journal" / "000000.h5").write_bytes(b"no HDF5")
    with pytest.raises(StorageError, match=r"remove .*journal to start anew"):
        joined(run(tmp_path / "journal"))
    Journal(tmp_path / "journal").discard()
    assert not (tmp_path / "journal").exists()
