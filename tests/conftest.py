"""Shared by all tests."""

import signal

import pytest
from hypothesis import settings

from compare.commands import waiting

# Times vary between machines: a deadline would be an assertion on wall time.
settings.register_profile("dualball", deadline=None, derandomize=True)
settings.load_profile("dualball")


# A shell that starts tests in the background has them ignore Ctrl-C, which some of them press.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(autouse=True)
def no_hurry(monkeypatch: pytest.MonkeyPatch) -> None:
    """No command says that it takes long, however busy the machine is."""
    monkeypatch.setattr(waiting, "SOON", 1e6)


@pytest.hookimpl(trylast=True)  # of those that are left
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What numba takes longest to compile comes first, runs of theory, and in the middle, Coulomb's
    law in MuJoCo.

    Two workers begin there: each compiles what the other one then loads."""
    first = ("test_many_runs", "test_orbits", "test_basins", "test_figures")
    theory = [item for item in items if item.path.stem in first]
    coulomb = [item for item in items if item.path.stem.startswith("test_coulomb")]
    others = [item for item in items if item not in {*theory, *coulomb}]
    before = max(len(items) // 2 - len(theory), 0)
    items[:] = theory + others[:before] + coulomb + others[before:]
