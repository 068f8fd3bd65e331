"""A run that is taken up again gives the bits of one that was never interrupted."""

from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from mjsim import ContactSettings, Run
from mjsim.journal import Journal
from model import Parameters, StorageError

P = Parameters.named("reference").replace(omega_0=25.0)


def run(directory: Path | None) -> Run:
    """Spin-up from rest through rolling into slipping: about four blocks of samples."""
    journal = Journal(directory, interval=0.0) if directory else None
    return Run(P, np.zeros(8), 4.5, settings=ContactSettings.at(2.5e-4), sample_interval=5e-3, journal=journal)


@pytest.fixture(scope="module")
def whole() -> list[np.ndarray]:
    return list(run(None))


@pytest.mark.parametrize("blocks", [0, 1, 2, 3])
def test_taken_up_after_some_blocks(tmp_path: Path, whole: list[np.ndarray], blocks: int) -> None:
    assert len(whole) > blocks
    list(islice(run(tmp_path / "journal"), blocks))
    np.testing.assert_array_equal(np.concatenate(list(run(tmp_path / "journal"))), np.concatenate(whole))


def test_a_damaged_journal_says_what_to_do(tmp_path: Path) -> None:
    list(islice(run(tmp_path / "journal"), 2))
    (tmp_path / "journal" / "000000.h5").write_bytes(b"no HDF5")
    with pytest.raises(StorageError, match=r"remove .*journal to start anew"):
        list(run(tmp_path / "journal"))
    Journal(tmp_path / "journal").discard()
    assert not (tmp_path / "journal").exists()
