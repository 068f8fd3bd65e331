"""What motions come to, from many starts."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from analytic import attractors, stable_solutions
from analytic.orbits import fates
from analytic.orbits import periodic as orbits
from analytic.orbits.fates import Kind, Run
from analytic.simulation import ensemble
from model import Case, Events, Flow, Header, InputError, Parameters, Trajectory
from model.arrays import Array
from model.trajectory import SAMPLE

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


def torus(time: float, z: Array) -> Array:
    """Two harmonic oscillators whose frequencies are in the golden ratio."""
    return 3 * np.array([-z[1], z[0], -(1 + 5**0.5) / 2 * z[3], (1 + 5**0.5) / 2 * z[2]])


def lorenz(time: float, z: Array) -> Array:
    """Lorenz's equations, five times as fast, in a tenth of their variables; the largest exponent is 5 times 0.906."""
    _, x, y, w = z
    return 5 * np.array([0.0, 10 * (y - x), x * (28 - 10 * w) - y, 10 * x * y - 8 / 3 * w])


def slipping_by(rates: Callable[[float, Array], Array]) -> Run:
    """A simulator of a ball that slips at both points, with omega_c and slips of these rates in natural units."""

    def run(p: Parameters, x0: Array, duration: float, interval: float) -> Trajectory:
        size, unit = orbits.scale(p)[2:6], (p.R / p.g) ** 0.5
        time = np.arange(round(duration / interval) + 1) * interval
        z = solve_ivp(rates, (0, time[-1] / unit), x0[2:6] / size, "DOP853", time / unit, rtol=1e-10, atol=1e-12).y
        block = np.zeros(len(time), SAMPLE)
        block["time"], block["case"] = time, Case.SS
        for name, values in zip(("omega_c", "slip_x", "slip_y", "slip_z"), size[:, None] * z, strict=True):
            block[name] = values
        return Trajectory.from_blocks(Header("made up", p, Flow.steady(p.omega_0)), [block], Events())

    return run


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rates", "kind", "exponent"), [(torus, Kind.QUASI_PERIODIC, 0.0), (lorenz, Kind.CHAOTIC, 5 * 0.906)]
)
def test_recurrent_motions_that_do_not_close(
    rates: Callable[[float, Array], Array], kind: Kind, exponent: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Flows whose largest Lyapunov exponents are known."""
    monkeypatch.setattr(fates, "GROWING", 100.0)
    unit = (HOPPING.R / HOPPING.g) ** 0.5
    start = np.concatenate([[0, 0], np.array([0.5, 1.0, 1.0, 2.0]) * orbits.scale(HOPPING)[2:6]])
    (only,) = attractors(HOPPING, start, lasting=3 * fates.WINDOW * unit, run=slipping_by(rates))
    assert only.fate.kind is kind
    # The growth in a turn of a tenth of a unit scatters by about itself: over 100 units its mean by some 3 %.
    assert only.fate.exponent * unit == pytest.approx(exponent, rel=0.1, abs=1e-6)
