"""Periodic motions close, are as stable as their multipliers say, and motions from many starts come
to what they do."""

from types import SimpleNamespace

import numpy as np
import pytest

from analytic import attractors, simulate, stable_solutions
from analytic.orbits import attractors as limits
from analytic.orbits import orbit_branch
from analytic.orbits import periodic as orbits
from analytic.orbits.attractors import Kind
from analytic.orbits.orbit_branch import Bifurcation
from analytic.orbits.periodic import NoOrbitError
from analytic.simulation.ensemble import random_starts
from model import Case, InputError, Parameters, State
from model.kinematics import state_units
from tests.measured import motion

HOPPING = Parameters.named("hopping")
TOP = (6.37e-3, 0.0, 57.3, -106.2, 0.0, 0.0)
SWINGING = Parameters.named("reference").replace(mu=2.5, eta=0.38, c=1.0, omega_0=24.648)
"""Between the two Hopf points of SS."""
SWUNG = (0.0, 0.0, 22.39, -0.03, 0.0, 0.26)
"""States near the two orbits."""


@pytest.fixture(scope="module")
def hop():
    return orbits.refine(HOPPING, TOP, 0.223)


@pytest.fixture(scope="module")
def swing():
    return orbits.refine(SWINGING, SWUNG, 0.327)


def test_newton_closes_the_orbit(hop, swing):
    """After five periods of a simulation with another tolerance and other samples the ball is where
    it was."""
    for orbit in (hop, swing):
        assert orbit.steps <= 8
        how = {"sample_interval": orbit.period, "rtol": 1e-11}
        run = simulate(orbit.p, orbit.loop.x, 5 * orbit.period, **how)
        away = np.abs(run.x - orbit.loop.x) / state_units(orbit.p)
        # Each period adds about the defect and the tolerance, of which every disturbance dies out.
        assert away.max() < 5 * (orbits.CLOSED + 1e-9)
        assert orbit.turn == pytest.approx((run.theta[-1] - run.theta[0]) / 5, rel=1e-8)


def test_multipliers_are_how_disturbances_change(hop, swing):
    """Of the derivative M of the return map: two returns later a disturbance is M^2 of it, within 1
    %."""
    for orbit in (hop, swing):
        push = 1e-4 * orbit.loop.extent * np.ones(len(orbit.loop.free))
        loop = orbit.loop.moved(push)
        for _ in range(2):
            back = loop.back()
            loop = orbits.replace(loop, x=back.x, period=back.period)
        left = np.linalg.matrix_power(orbit.derivative, 2) @ push
        away = orbit.loop.coordinates(back.x - orbit.loop.x)
        assert np.abs(away - left).max() < 0.01 * np.abs(left).max()
        polynomial = np.poly(orbit.derivative)
        np.testing.assert_allclose(np.poly(orbit.multipliers), polynomial, rtol=1e-9, atol=1e-12)


def test_a_branch_ends_at_the_range(hop):
    """In a short range the branch has an orbit at either end, and all are stable."""
    branch = orbit_branch.follow(hop, "omega_0", 69.0, 69.4)
    assert branch.values[[0, -1]] == pytest.approx([69.0, 69.4])
    assert [place.kind for place in branch.places] == [Bifurcation.RANGE] * 2
    assert branch.stable.all()
    assert np.all(np.diff([orbit.cycle.y.max() for orbit in branch.orbits]) > 0)


def test_a_branch_is_lost_where_its_orbit_has_no_other_section(swing, monkeypatch):
    def fails(*loop):
        raise NoOrbitError("no section")

    monkeypatch.setattr(orbit_branch, "refine", fails)
    places = orbit_branch.follow(swing, "omega_0", 1.0, 100.0).places
    assert {(place.kind, place.reason) for place in places} == {(Bifurcation.LOST, "no section")}


@pytest.mark.slow
def test_hops_that_rebound_end_in_a_torus(hop):
    """Followed in the coefficient of restitution, from where the orbit can be found from that
    without."""
    x, period = hop.loop.x, hop.period
    for restitution in (0.2, 0.3, 0.4, 0.5, 0.53):
        orbit = orbits.refine(HOPPING, x, period, restitution)
        x, period = orbit.loop.x, orbit.period
    branch = orbit_branch.follow(orbit, orbits.RESTITUTION, 0.525, 0.545)
    (torus,) = (place for place in branch.places if place.kind is Bifurcation.TORUS)
    assert torus.value == pytest.approx(0.536, abs=1e-3)
    assert [value < torus.value for value in branch.values] == branch.stable.tolist()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("eta", "faster", "hops"), [(0.0905, 4e-4, True), (0.0905, 1e-3, False), (0.0915, 1e-4, False)]
)
def test_no_torus_attracts_beyond_the_torus_bifurcation(hop, eta, faster, hops):
    """It is subcritical: ever smaller disturbances end the hops before it, and beyond it any
    does."""
    orbit = orbit_branch.follow(hop, "eta", 0.0725, eta).orbits[-1]
    assert orbit.p.eta == pytest.approx(eta)
    assert orbit.stable is (eta < 0.0913)
    x = State.of(orbit.loop.x)
    pushed = x._replace(omega_c=x.omega_c * (1 + faster))
    run = simulate(orbit.p, pushed, 300.0, sample_interval=1.0)
    assert bool((run.events.time > 290.0).any()) is hops
    if not hops:
        assert run.cases[-1] is Case.NR


def test_no_orbit_and_bad_input(hop):
    """Rolling for ever has no period; a guess far from all orbits doesn't converge; ranges must
    make sense."""
    with pytest.raises(NoOrbitError, match="rolls at both points"):
        orbits.refine(Parameters.named("reference"), (0, 0, 12, 0, 0, 0), 0.2)
    with pytest.raises(NoOrbitError):
        orbits.refine(HOPPING, (0, 0, 20, 0, 0, 0), 0.2)
    with pytest.raises(NoOrbitError, match="above the floor"):
        orbits.refine(HOPPING, (-1e-3, 0, 20, 0, 0, 0), 0.2)
    with pytest.raises(InputError, match="did you mean 'eta'"):
        orbit_branch.follow(hop, "etta", 0.0, 1.0)
    with pytest.raises(InputError, match="out of range"):
        orbit_branch.follow(hop, "eta", 0.2, 0.3)


SLIPS, RIDES = (0, 0, 20, 0, 0, 0), (0.03, 0, 69, -100, 0, 0)


def test_three_attractors_at_once():
    """The hopping set: hopping, slipping at both points, and riding the wall."""
    groups = attractors(HOPPING, (TOP, SLIPS, RIDES))
    assert [each.count for each in groups] == [1, 1, 1]
    assert {each.limit.kind for each in groups} == {Kind.PERIODIC, Kind.STATIONARY}
    hop = groups[0].limit
    assert hop.orbit
    assert hop.orbit.stable
    # The period as seen in the run is resolved to a sample, that of the orbit to round-off.
    sample = hop.last.time[1] - hop.last.time[0]
    assert hop.period == pytest.approx(hop.orbit.period, abs=2 * sample)
    known = {s.case for s in stable_solutions(HOPPING)}
    assert {each.limit.solution.case for each in groups[1:] if each.limit.solution} <= known
    low, high = groups[0].interval
    assert 0 < low < groups[0].share < high < 1


def test_random_starts_are_those_of_their_seed_and_inside():
    first, again, other = (random_starts(HOPPING, 50, seed) for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    assert np.all((first[:, 0] >= 0) & (first[:, 0] <= HOPPING.R))
    assert np.all(first[first[:, 0] == 0, 1] == 0)


def test_lyapunov_exponent_of_a_known_growth():
    """Neighbours part by a factor of e every 1/0.3 s."""

    def run(p, x0s, duration, interval):
        whole, growth = SimpleNamespace(failure=""), np.exp(0.3 * duration)
        paths = (np.array([x, x * growth]) for x in x0s)
        return [SimpleNamespace(x=path, case=[Case.NN], header=whole) for path in paths]

    found = limits.lyapunov(HOPPING, np.zeros(8), Case.NN, 20.0, 0.5, run)
    assert found == pytest.approx((0.3, 0.0), abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("exponent", "kind"), [(0.1, Kind.QUASI_PERIODIC), (0.4, Kind.CHAOTIC)])
def test_recurrent_motions_that_do_not_close(exponent, kind, monkeypatch):
    """omega_c and the slips go round at two rates whose ratio is the golden one: neighbours decide,
    in three errors."""
    monkeypatch.setattr(limits, "lyapunov", lambda *motion, run: (exponent, 0.1))
    size, unit = state_units(HOPPING)[2:6], (HOPPING.R / HOPPING.g) ** 0.5
    rates = np.array([3.0, 1.5 * (1 + 5**0.5)]) / unit

    def run(p, x0s, duration, interval):
        time = np.arange(round(duration / interval) + 1) * interval
        begun = (x0s[:, 2:6] / size).view(complex)
        turned = (begun[:, None] * np.exp(1j * time[:, None] * rates)).view(float) * size
        names = "omega_c", "slip_x", "slip_y", "slip_z"
        columns = (dict(zip(names, each.T, strict=True)) for each in turned)
        return [motion(p, time, case=Case.SS, **each) for each in columns]

    start = np.append([0.0, 0.0], [0.5, 0.0, 2.0, 0.0] * size)
    (only,) = attractors(HOPPING, start, lasting=3 * limits.WINDOW * unit, run=run)
    assert only.limit.kind is kind
    assert only.limit.exponent == exponent
