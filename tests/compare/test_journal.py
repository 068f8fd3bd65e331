"""A run that is taken up again gives the bits of one that was never interrupted."""

from itertools import islice
from pathlib import Path

import numpy as np
import pytest

from compare.kit.journal import Journal
from mjsim import ContactSettings, Run
from model import Parameters, StorageError

P = Parameters.named("reference").replace(omega_0=25.0)
SETTINGS = {"joints": ContactSettings.at(2.5e-4), "free": ContactSettings.rigid_at(2.5e-4)}


def carried_out(directory: Path, settings: ContactSettings, blocks: int | None = None) -> np.ndarray:
    """Spin-up from rest through rolling into slipping, about four blocks of samples: those so far."""
    journal = Journal(directory, interval=0.0)
    earlier, state = journal.recall()
    seen, run = list(earlier), Run(P, np.zeros(8), 4.5, settings=settings, sample_interval=5e-3, state=state)
    for block in islice(run, blocks):
        journal.note(block, run.state())
        seen.append(block)
    return np.concatenate(seen) if seen else np.empty(0)


@pytest.fixture(scope="module")
def whole() -> dict[str, np.ndarray]:
    return {
        name: np.concatenate(list(Run(P, np.zeros(8), 4.5, settings=settings, sample_interval=5e-3)))
        for name, settings in SETTINGS.items()
    }


@pytest.mark.parametrize("name", SETTINGS)
@pytest.mark.parametrize("blocks", [0, 1, 3])
def test_taken_up_after_some_blocks(tmp_path: Path, whole: dict[str, np.ndarray], blocks: int, name: str) -> None:
    assert len(carried_out(tmp_path / "journal", SETTINGS[name], blocks)) < len(whole[name])
    np.testing.assert_array_equal(carried_out(tmp_path / "journal", SETTINGS[name]), whole[name])


def test_a_damaged_journal_says_what_to_do(tmp_path: Path) -> None:
    carried_out(tmp_path / "journal", SETTINGS["joints"], 2)
    (tmp_path / "journal" / "000000.h5").write_bytes(b"no HDF5")
    with pytest.raises(StorageError, match=r"remove .*journal to start anew"):
        carried_out(tmp_path / "journal", SETTINGS["joints"])
    Journal(tmp_path / "journal").discard()
    assert not (tmp_path / "journal").exists()
