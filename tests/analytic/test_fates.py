"""What motions come to, from many starts."""

import numpy as np
import pytest

from analytic import attractors, ensemble, fates, orbits, stable_solutions
from analytic.fates import Kind
from model import InputError, Parameters

HOPPING = Parameters.named("hopping")
HOPS, SLIPS, RIDES = (6.37e-3, 0, 57.3, -106.2, 0, 0), (0, 0, 20, 0, 0, 0), (0.03, 0, 69, -100, 0, 0)


def test_three_attractors_at_once() -> None:
    """The hopping set: hopping, slipping at both points, and riding the wall."""
    groups = attractors(HOPPING, (HOPS, SLIPS, RIDES))
    assert [each.count for each in groups] == [1, 1, 1]
    assert {each.fate.kind for each in groups} == {Kind.PERIODIC, Kind.STATIONARY}
    hop = groups[0].fate
    assert hop.orbit
    assert hop.orbit.stable
    # The period as seen in the run is resolved to a sample, that of the orbit to round-off.
    sample = hop.last.time[1] - hop.last.time[0]
    assert hop.period == pytest.approx(hop.orbit.period, abs=2 * sample)
    known = {s.case for s in stable_solutions(HOPPING)}
    assert {each.fate.solution.case for each in groups[1:] if each.fate.solution} <= known
    low, high = groups[0].interval
    assert 0 < low < groups[0].share < high < 1


def test_random_starts_are_reproducible_and_inside() -> None:
    """The same seed gives the same starts; all of them can be simulated."""
    first, again, other = (ensemble.random_starts(HOPPING, 50, seed) for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    assert np.all((first[:, 0] >= 0) & (first[:, 0] <= HOPPING.R))
    assert np.all(first[first[:, 0] == 0, 1] == 0)


def test_undecided_says_what_it_did_last() -> None:
    """A time too short: no verdict, but means and extremes of what there is."""
    (only,) = attractors(HOPPING, SLIPS, lasting=1.0)
    assert only.fate.kind is Kind.UNDECIDED
    assert only.run.omega_c[-1] == pytest.approx(20, rel=0.5)


@pytest.mark.parametrize(
    ("given", "match"),
    [
        ({"starts": [[-1e-3, 0, 20, 0, 0, 0]]}, "above the floor"),
        ({"starts": [[0, 0, 20, 0, 0, 0, 1.0, 0]]}, "h = 1 m"),
        ({"starts": 0}, "starts = 0"),
        ({"starts": SLIPS, "lasting": -1.0}, "lasting = -1"),
    ],
)
def test_bad_input(given: dict[str, object], match: str) -> None:
    with pytest.raises(InputError, match=match):
        attractors(HOPPING, **given)  # type: ignore[arg-type]


def test_without_drag_a_time_must_be_given() -> None:
    with pytest.raises(InputError, match="lasting"):
        attractors(HOPPING.replace(c=0.0), 1)


def test_lyapunov_exponent_of_an_orbit_is_zero() -> None:
    """Along the orbit disturbances neither grow nor die out."""
    hop = orbits.refine(HOPPING, HOPS, 0.223)
    exponent, error = fates.lyapunov(hop.p, hop.loop.x, 20 * hop.period, hop.period)
    # The first of the ten parts has the decay of what lies across, with the modulus of the largest multiplier.
    decay = -np.log(np.abs(hop.multipliers[0])) / hop.period
    assert abs(exponent) <= 3 * error + 0.1 * decay
