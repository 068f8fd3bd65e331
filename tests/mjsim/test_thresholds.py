"""Measured thresholds against balances that fit in a line; omega_01 and the fold are held against theory in compare."""

import math

import pytest
from mjsim.thresholds import measure

from model import InputError, Parameters


@pytest.mark.slow
def test_thresholds_of_high_wall_friction() -> None:
    """NR ends where eta m R omega^2 = m g; with eta > j, RR ends where j m R omega^2 = m g lifts the ball."""
    p = Parameters.named("high-wall-friction")
    found = measure(p, omega_max=30.0)
    for value, exact in (
        (found.omega_02, math.sqrt(p.g / (p.eta * p.R))),
        (found.omega_03, math.sqrt(p.g / (p.j * p.R))),
    ):
        assert value.value == pytest.approx(exact, rel=1e-6)
        assert abs(value.value - exact) <= 3 * value.uncertainty + 1e-12 * exact
    assert math.isnan(found.omega_01.value)
    assert math.isnan(found.omega_04.value)


def test_nothing_settles_without_drag() -> None:
    with pytest.raises(InputError, match="c = 0"):
        measure(Parameters.named("reference").replace(c=0.0), omega_max=30.0)
