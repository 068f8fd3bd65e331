"""Shared by all tests."""

import pytest
from hypothesis import settings

from model import Parameters

# Times vary between machines: a deadline would be an assertion on wall time.
settings.register_profile("dualball", deadline=None, derandomize=True)
settings.load_profile("dualball")


@pytest.fixture
def reference() -> Parameters:
    return Parameters.named("reference")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What numba takes longest to compile comes first, and so to one of several workers, which compiles it alone."""
    first = ("test_many_runs", "test_orbits", "test_basins", "test_attractors", "test_figures", "test_time_stepping")
    items.sort(key=lambda item: item.path.stem not in first)
