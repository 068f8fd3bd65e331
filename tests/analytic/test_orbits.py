"""Periodic motions: the hopping ball and the oscillation beside a Hopf point, closed and followed to their births."""

import numpy as np
import pytest

from analytic import simulate, thresholds
from analytic.orbits import orbit_branch
from analytic.orbits import periodic as orbits
from analytic.orbits.orbit_branch import Bifurcation
from analytic.orbits.periodic import NoOrbitError, Orbit
from analytic.stationary import slipping_branch
from model import Case, InputError, Parameters, State

HOPPING = Parameters.named("hopping")
TOP = (6.37e-3, 0.0, 57.3, -106.2, 0.0, 0.0)
SWINGING = Parameters.named("reference").replace(mu=2.5, eta=0.38, c=1.0, omega_0=24.648)
"""Between the two Hopf points of SS."""
SWUNG = (0.0, 0.0, 22.39, -0.03, 0.0, 0.26)
"""States near the two orbits."""


@pytest.fixture(scope="module")
def hop() -> Orbit:
    return orbits.refine(HOPPING, TOP, 0.223)


@pytest.fixture(scope="module")
def swing() -> Orbit:
    return orbits.refine(SWINGING, SWUNG, 0.327)


def test_newton_closes_the_orbit(hop: Orbit, swing: Orbit) -> None:
    """After five periods of a simulation with another tolerance and other samples the ball is where it was."""
    for orbit in (hop, swing):
        assert orbit.steps <= 8
        run = simulate(orbit.p, orbit.loop.x, 5 * orbit.period, sample_interval=orbit.period, rtol=1e-11)
        away = np.abs(run.x - orbit.loop.x) / orbits.scale(orbit.p)
        # Each period adds about the defect and the tolerance, of which every disturbance dies out.
        assert away.max() < 5 * (orbits.CLOSED + 1e-9)
        assert orbit.turn == pytest.approx((run.theta[-1] - run.theta[0]) / 5, rel=1e-8)


def test_what_the_orbits_are(hop: Orbit, swing: Orbit) -> None:
    """The hop lands once a period; the swinging ball slips all the time."""
    assert sum(before.A.name == "N" != after.A.name for before, after in hop.changes) == 1
    assert set(swing.cases) == {Case.SS}
    for orbit in (hop, swing):
        assert orbit.stable
        assert np.all(orbit.cycle.x.min(axis=0) <= orbit.mean)
        assert np.all(orbit.mean <= orbit.cycle.x.max(axis=0))


def test_multipliers_are_how_disturbances_change(hop: Orbit, swing: Orbit) -> None:
    """Simulated returns to the section: the disturbance p periods later is M^p of it, within 1 %."""
    for orbit in (hop, swing):
        push = 1e-4 * orbit.loop.extent * np.ones(len(orbit.loop.free))
        loop, away = orbit.loop.moved(push), []
        for _ in range(6):
            back = loop.back()
            away.append(orbit.loop.coordinates(back.x - orbit.loop.x))
            loop = orbits.replace(loop, x=back.x, period=back.period)
        # The characteristic polynomial of the slow multipliers holds for every run of returns (Cayley and Hamilton).
        slow = orbit.multipliers[np.abs(orbit.multipliers) > 0.1]
        series = np.array(away[1:])[:, np.argmax(np.abs(away[0]))]
        polynomial = np.real(np.poly(slow))
        windows = np.lib.stride_tricks.sliding_window_view(series, len(polynomial))[:, ::-1]
        assert np.abs(windows @ polynomial).max() < 0.01 * np.abs(series).max()


def test_a_branch_ends_at_the_range(hop: Orbit) -> None:
    """In a short range the branch has an orbit at either end, and all are stable."""
    branch = orbit_branch.follow(hop, "omega_0", 69.0, 69.4)
    assert branch.values[[0, -1]] == pytest.approx([69.0, 69.4])
    assert [place.kind for place in branch.places] == [Bifurcation.RANGE] * 2
    assert branch.stable.all()
    assert np.all(np.diff([orbit.cycle.y.max() for orbit in branch.orbits]) > 0)


def test_a_branch_says_where_it_is_given_up(hop: Orbit) -> None:
    """One orbit further each way, far from the ends of the range."""
    branch = orbit_branch.follow(hop, "omega_0", 40.0, 100.0, most=1)
    assert [place.kind for place in branch.places] == [Bifurcation.LOST] * 2
    assert [place.value for place in branch.places] == branch.values[[0, -1]].tolist()
    assert all("not followed beyond 1 orbits" in str(place) for place in branch.places)


@pytest.mark.slow
def test_hopping_is_born_where_the_wall_begins_to_carry() -> None:
    """Down in omega_0 the hops become ever lower and vanish at omega_02; the multipliers don't tell of it."""
    low = HOPPING.replace(omega_0=53.77)
    hop = orbits.refine(low, (7.23e-4, 0.0, 52.54, -84.426, 0.0, 0.0), 0.2403)
    branch = orbit_branch.follow(hop, "omega_0", 40.0, 53.8)
    birth, edge = branch.places[0], branch.places[-1]
    assert birth.kind is Bifurcation.BIRTH
    assert birth.value == pytest.approx(thresholds(HOPPING).omega_02, rel=1e-4)
    assert edge.kind is Bifurcation.RANGE
    assert branch.values[-1] == pytest.approx(53.8)
    assert branch.stable.all()
    heights = [orbit.loop.x[0] for orbit in branch.orbits]
    assert heights == sorted(heights)


@pytest.mark.slow
def test_swinging_lives_between_hopf_points(swing: Orbit) -> None:
    """Followed both ways it ends where eigenvalues of SS cross the imaginary axis."""
    branch = orbit_branch.follow(swing, "omega_0", 20.0, 30.0)
    ends = branch.places[0], branch.places[-1]
    assert [end.kind for end in ends] == [Bifurcation.HOPF] * 2
    flows = sorted(float(slipping_branch.states(s, SWINGING)[1]) for s in slipping_branch.hopf_places(SWINGING))
    assert [end.value for end in ends] == pytest.approx(flows, rel=1e-4)


@pytest.mark.slow
def test_a_torus_bifurcation_and_a_fold(hop: Orbit) -> None:
    """With a rougher wall a pair of multipliers leaves the unit circle, later the branch turns back."""
    branch = orbit_branch.follow(hop, "eta", 0.072, 0.15)
    kinds = [place.kind for place in branch.places]
    assert kinds.index(Bifurcation.TORUS) < kinds.index(Bifurcation.FOLD)
    torus = branch.places[kinds.index(Bifurcation.TORUS)]
    assert np.abs(torus.orbit.multipliers[:2]) == pytest.approx(1.0, abs=1e-5)
    fold = branch.places[kinds.index(Bifurcation.FOLD)]
    assert branch.values.max() <= fold.value == pytest.approx(branch.values.max(), rel=1e-2)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("eta", "faster", "hops"), [(0.0905, 4e-4, True), (0.0905, 1e-3, False), (0.0915, 1e-4, False)]
)
def test_no_torus_attracts_beyond_the_torus_bifurcation(hop: Orbit, eta: float, faster: float, hops: bool) -> None:
    """It is subcritical: ever smaller disturbances end the hops before it, and beyond it any does."""
    orbit = orbit_branch.follow(hop, "eta", 0.0725, eta).orbits[-1]
    assert orbit.p.eta == pytest.approx(eta)
    assert orbit.stable is (eta < 0.0913)
    x = State.of(orbit.loop.x)
    run = simulate(orbit.p, x._replace(omega_c=x.omega_c * (1 + faster)).stacked(), 300.0, sample_interval=1.0)
    assert bool((run.events.time > 290.0).any()) is hops
    if not hops:
        assert run.cases[-1] is Case.NR


def test_no_orbit_and_bad_input(hop: Orbit) -> None:
    """Rolling for ever has no period; a guess far from all orbits doesn't converge; ranges must make sense."""
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
