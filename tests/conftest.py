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
