"""Statements that no ball and no engine can show: theory against theory, by another way.

Where a contact would have to pull (Fig. 12, and (83) for eta > 1), algebra is all there is. Limits,
derivatives and the results of a search are held against closed forms, and the two ways to compute a
motion against each other. What these hold is listed in docs/records/statements.md."""

import math
from functools import partial
from itertools import product

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ai_zeros

import analytic
from analytic.bifurcation import diagram as bifurcation
from analytic.flowmeter import design, pulsation, real_fluid, response
from analytic.mechanics import dynamics
from analytic.slipping import slip_bounds, slip_stability
from analytic.stationary import slipping_branch
from model import Case, Flow, Parameters, State, drag
from model.kinematics import TURNING, state_units

P = Parameters.named("reference").replace(eta=0.43)
"""eta so little above j that the branch of SS is whole once (12) is released."""
ROUND_OFF = 3e-12
"""Relative: some thousand operations, each to the last digit."""


def approx(value, error=0.0):
    """A number that is known to round-off, or with an error."""
    return pytest.approx(value, rel=ROUND_OFF, abs=max(error, 0.0 if value else ROUND_OFF))


def test_figure_12_with_a_floor_that_pulls():
    """The branch with A_y < 0 solves the equations and joins the thresholds as drawn."""
    unit, t = math.sqrt(P.g / P.R), analytic.thresholds(P)
    curves = bifurcation.threshold_curves(P, P.mu, P.eta, released=True)
    s = np.linspace(-8.0, 8.0, 65)
    states, fluid = slipping_branch.states(s, P)
    ends = State.of(slipping_branch.states(np.array([-40.0, 40.0]), P)[0])
    places = zip(states.tolist(), fluid.tolist(), strict=True)
    rates = [dynamics.rates(Case.SS, x, P, w)[TURNING] for x, w in places]
    assert np.abs(rates).max() * P.r / P.g == approx(0.0)
    assert not np.any(slipping_branch.branch(s, P).A_y >= 0)
    assert ends.omega_c[0] == approx(float(curves["omega_01"]) * unit)  # P3: slip vanishes
    assert ends.omega_c[1] == approx(t.omega_02)  # NF2: slip_z vanishes

    def determinant(omega_0):
        """Of SR's Jacobian: its sign is that of the eigenvalue that isn't the decay of omega_c."""
        q = P.replace(omega_0=omega_0)
        (state,) = analytic.stationary_solutions(q, (Case.SR,))
        return float(np.linalg.det(dynamics.jacobian(Case.SR, state.x, q)))

    exchange = brentq(determinant, 0.8 * t.omega_03, 1.2 * t.omega_03, rtol=1e-14)
    assert exchange == approx(t.omega_03)  # NT1
    along = slipping_branch.states(np.linspace(-8.0, 8.0, 4001), P)[1]
    k = int(np.argmax(along))
    # The maximum is above the largest value by no more than its neighbours are below.
    spacing = float(along[k] - min(along[k - 1], along[k + 1]))
    assert along[k] == approx(float(curves["omega_04"]) * unit, spacing)  # F


def test_the_hopf_point_of_figure_12():
    """One, where a pair of eigenvalues is imaginary."""
    (place,) = slipping_branch.hopf_places(P)
    x, w = slipping_branch.states(place, P)
    values = np.linalg.eigvals(dynamics.jacobian(Case.SS, x, P.replace(omega_0=float(w))))
    pair = values[np.argmax(values.imag)]
    assert pair.real / pair.imag == approx(0.0, 3e-9)


def test_where_82_and_83_contradict_12():
    """(83) is a bound for eta > 1 only, where the wall would have to pull; at (82) the floor
    presses exactly for eta < j."""
    for mu, eta, side in product(np.geomspace(0.05, 3.0, 13), np.geomspace(0.05, 3.0, 13), (1, -1)):
        p, direction = P.replace(mu=mu, eta=eta), (0.0, float(side))
        square = slip_bounds.rr_to_ss(p, side).zero
        if 0 < square < math.inf:
            omega = math.sqrt(square)
            f = dynamics.forces(Case.SS, State(omega_c=omega), p, omega, direction, direction)
            assert (f.A_y > 0) == (eta < p.j) if side == 1 else f.B_x < 0 < eta - 1


def test_rolling_is_unstable_on_all_sides_beyond_omega_03():
    """(73), 5.2: for eta > j slip at the floor grows out of RR on either side, below it dies
    out."""
    for mu, eta, side, flow in product(
        np.geomspace(0.05, 3.0, 7), np.geomspace(0.42, 3.0, 7), (1.0, -1.0), (0.7, 0.99, 1.01, 1.4)
    ):
        p = P.replace(mu=mu, eta=eta)
        omega = flow * analytic.thresholds(p).omega_03
        q, n, x = p.replace(omega_0=omega), np.array([side]), State(omega_c=omega).stacked()
        assert (slip_stability.gamma(Case.RR, Case.SR, x, n, q) > 0) == (flow > 1)
        assert (slip_bounds.rr_to_sr(q, omega, int(side)).gamma(omega) > 0) == (flow > 1)


def test_a_share_is_between_0_and_1_where_slip_dies_out_on_either_side():
    """(69) and (64)."""
    lags = np.linspace(-200.0, 200.0, 41)
    for mu, eta, lag in product((0.1, 0.5), np.geomspace(0.05, 2.0, 8), lags):
        p = P.replace(mu=mu, eta=eta, omega_0=9.0 + lag)
        dies_out = all(slip_bounds.rr_to_rs(p, 9.0, side).gamma(p.omega_0) < 0 for side in (1, -1))
        assert (0 < slip_bounds.filippov_share(Case.RS, 9.0, p) < 1) == dies_out


def test_sensitivities_are_logarithmic_derivatives_of_thresholds():
    """By hand, docs/design.md."""
    p = P.replace(eta=0.25)
    mu, eta, j = p.mu, p.eta, p.j
    D = mu * eta * (1 + j) + j - eta
    exact = {
        ("omega_01", "mu"): (j - eta) / (2 * D),
        ("omega_01", "eta"): eta * (1 + j) * (1 - mu) / (2 * (1 + eta) * D),
        ("omega_01", "j"): -j * (1 + mu * eta) / (2 * D),
        ("omega_01", "R"): -0.5,
        ("omega_02", "eta"): -0.5,
        ("omega_02", "mu"): 0.0,
        ("omega_03", "j"): -0.5,
        ("omega_03", "g"): 0.5,
    }
    names = ("mu", "eta", "j", "R", "g")
    given = design.sensitivities(p.replace, {name: getattr(p, name) for name in names})
    for (threshold, name), slope in exact.items():
        assert given[threshold][name].value == pytest.approx(slope, rel=0, abs=3e-9)


@pytest.mark.parametrize(("eta", "mu", "c"), [(0.2, 0.2, 1.0), (0.15, 0.45, 2.0), (0.3, 0.2, 0.5)])
def test_a_slow_ramp_passes_the_fold_as_its_normal_form_does(eta, mu, c):
    """(88): q' = a (omega_0 - omega_04) + b q^2 at the fold itself, from the null vectors of the
    Jacobian there and two derivatives of the vector field, instead of the branch."""
    p = P.replace(eta=eta, mu=mu, c=c)
    x, flow = slipping_branch.states(slipping_branch.fold(p), p)
    q = p.replace(omega_0=float(flow))
    J = dynamics.jacobian(Case.SS, x, q)
    along, across = np.zeros(8), np.zeros(8)
    for vector, matrix in (along, J), (across, J.T):
        values, vectors = np.linalg.eig(matrix)
        vector[TURNING] = np.real(vectors[:, np.argmin(np.abs(values))])
    across /= across @ along
    size = 1e-4 * float(np.abs(x).max())

    def rate(shift, more):
        """Along the null vector, beside the fold, in a flow that is faster by so many rad/s."""
        beside = State(*(x + shift * along).tolist())
        return float(across @ np.array(dynamics.rates(Case.SS, beside, q, q.omega_0 + more)))

    here = rate(0.0, 0.0)
    a, b = rate(0.0, 1.0) - here, (rate(size, 0.0) + rate(-size, 0.0) - 2 * here) / (2 * size**2)
    delay = -float(ai_zeros(1)[0][0]) * (a * b) ** (-1 / 3)
    assert response.ramp_coefficient(p) == pytest.approx(delay, rel=3e-4)


@pytest.mark.parametrize("eta", [0.1, 0.25, 0.6, 1.2])
@pytest.mark.parametrize("ratio", [0.1, 0.3, 0.6])
def test_the_inertia_of_the_fluid_shifts_thresholds(eta, ratio):
    """Flows at which floor and wall can just hold a ball in a fluid with inertia, by its forces
    themselves."""
    p = P.replace(eta=eta, density_ratio=ratio)
    expected = bifurcation.thresholds_with_inertia(p)
    # The swirl's pressure carries what the displaced fluid would take.
    carried = (1 - ratio) * p.m * p.R

    def slack(omega_0):
        """What B_y the wall can give less what the floor needs, N; A_x = B_y - turns, B_x = the
        load less B_y."""
        turns = p.j * p.m * p.R * omega_0**2
        most = p.eta * (carried * omega_0**2 + turns) / (1 + p.eta)
        return most - (turns - p.mu * p.m * p.g) / (1 - p.mu)

    low, high = 1e-3 * expected["omega_02"], expected["omega_02"]
    if not math.isnan(expected["omega_01"]):
        assert brentq(slack, low, 3 * high, rtol=1e-14) == approx(expected["omega_01"])
    assert math.sqrt(p.m * p.g / (p.eta * carried)) == approx(expected["omega_02"])


@pytest.mark.parametrize("eta", [0.1, 0.25, 0.35, 0.6])
@pytest.mark.parametrize("mu", [0.1, 0.6])
@pytest.mark.parametrize("law", [drag.STOKES, drag.SCHILLER_NAUMANN])
def test_onsets_of_slip_in_very_slow_and_very_fast_pulsations(eta, mu, law):
    """(66), (67), (73): their limits in closed form."""
    p = P.replace(eta=eta, mu=mu, drag=law, nu_f=1e-6)
    t = analytic.thresholds(p)
    end = t.omega_03 if math.isnan(t.omega_01) else t.omega_01
    p, slow = p.replace(omega_0=0.7 * end), p.replace(omega_0=0.3 * end)
    for limit, frequency in (pulsation.slow_onset, 1e-5 * p.c), (pulsation.fast_onset, 1e5 * p.c):
        assert pulsation.slip_onset(p, frequency) == pytest.approx(limit(p), rel=3e-8)
    # Where a slow flow falls to rest the wall bears nothing: the limit is approached as the
    # frequency's root.
    onset, closer = (pulsation.slip_onset(slow, frequency * p.c) for frequency in (4e-5, 1e-5))
    near = 3 * abs(closer - onset)
    assert 2 * closer - onset == pytest.approx(pulsation.slow_onset(slow), rel=0, abs=near)


HIGH = State(0.022, 0.042, 33.0, 39.6, 8.5, 1.5, 0.034, 0.178)
MOTIONS = {
    # It falls onto the floor, slides, rolls out to the wall, hops, and slips at both points till it
    # rolls.
    "falls": (HIGH, 0.138, 0.0),
    "rebounds": (HIGH, 0.138, 0.5),
    # It slides out to the wall and rides it; at 0.1 s it comes down.
    "slides": (State(0.0, 0.0, -22.669, -0.266, 27.136, -7.88, 0.015, -0.085), 0.1, 0.0),
}


@pytest.mark.parametrize("name", MOTIONS)
def test_two_methods_end_in_the_same_state(name):
    """The event-driven simulation, and time stepping, whose errors of first order in the step h are
    extrapolated away: those of second order are left, h^2 in natural units."""
    x, end, restitution = MOTIONS[name]
    p, flow = P.replace(eta=0.6), Flow.sines(12.0, [(3.0, 4.0, 1.0)])
    exact, coarse, fine = (
        analytic.simulate(p, x, end, flow, sample_interval=end, restitution=restitution, **way).x[
            -1
        ]
        for way in (
            {"rtol": 1e-11},
            {"method": "time-stepping", "timestep": end / 2**11},
            {"method": "time-stepping", "timestep": end / 2**12},
        )
    )
    off = np.abs(2 * fine - coarse - exact) / state_units(p)
    assert off.max() < (math.sqrt(p.g / p.R) * end / 2**12) ** 2


@pytest.mark.parametrize(
    ("eta", "torque", "flow"), [(0.25, 2.0, 4.0), (0.6, 3.0, 5.0), (0.2, 0.5, 4.0)]
)
def test_the_least_friction_that_rolls_against_the_torque_of_the_fluid(eta, torque, flow):
    """By time stepping; the stated one is the least at 2001 values of the force that (11) leaves
    free."""
    p = P.replace(eta=eta, fluid_torque=torque, omega_0=flow, c=5.0)
    stated = real_fluid.rolling(p)
    slips, rolls = 0.5, 2.0  # parts of the stated friction
    while rolls - slips > 1e-5:
        middle = (slips + rolls) / 2
        share = middle * stated.friction
        q, x = p.replace(mu=share * p.mu, eta=share * p.eta), State(omega_c=stated.omega_c)
        how = {"method": "time-stepping", "timestep": 1e-3, "sample_interval": 1e-3}
        run = analytic.simulate(q, x, 0.02, **how)
        slips, rolls = (slips, middle) if run.case[-1] == Case.RR else (middle, rolls)
    assert rolls == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize("j", [0.3, 0.4])
@pytest.mark.parametrize("tolerance", [0.0, 0.1])
def test_the_best_design_has_a_wall_as_rough_as_the_inertia_and_the_smallest_ball(j, tolerance):
    """(84), (86), docs/design.md: the longest range has eta = j, where omega_01 = omega_03,
    whatever mu."""
    exact = {"rho_b": 7800.0, "R": P.R, "mu": P.mu, "j": j}
    bounds = {name: (x, x) for name, x in exact.items()}
    bounds |= {"eta": (0.05, 0.9), "r": (P.r / 2, P.r)}
    make, fastest = partial(Parameters.from_fluid, nu_f=1e-4, rho_f=1000.0), 10.0
    chosen = design.best(make, bounds, {"mu": tolerance}, fastest)
    # The search ends when its candidates differ by 1e-5 of their cost.
    ridge = math.sqrt(chosen.p.g / (P.R * j))
    assert fastest * chosen.margin == pytest.approx(ridge, rel=3e-5)
    assert chosen.p.r == approx(bounds["r"][0])
