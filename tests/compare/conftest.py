"""One quick validation, shared by all tests that look at its results."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

import compare
from compare import Verdict


@dataclass(frozen=True)
class Validated:
    directory: Path
    verdicts: list[Verdict]


@pytest.fixture(scope="session")
def validated(tmp_path_factory: pytest.TempPathFactory) -> Validated:
    directory = tmp_path_factory.mktemp("results")
    return Validated(directory, compare.validate(directory, workers=1))
