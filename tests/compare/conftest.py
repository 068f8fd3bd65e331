"""One quick validation, shared by all tests that look at its results."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import pytest

import compare
from compare import Level, Verdict


@dataclass(frozen=True)
class Validated:
    directory: Path
    verdicts: list[Verdict]


@pytest.fixture(scope="session")
def validated(tmp_path_factory: pytest.TempPathFactory) -> Validated:
    directory = tmp_path_factory.mktemp("results")
    return Validated(directory, compare.validate(directory, level=Level.QUICK, workers=os.cpu_count() or 1))


@pytest.hookimpl(tryfirst=True)  # before xdist reads the groups
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Tests that share the validation run in one process, which makes it once."""
    for item in items:
        if "validated" in getattr(item, "fixturenames", ()):
            item.add_marker(pytest.mark.xdist_group("validated"))
