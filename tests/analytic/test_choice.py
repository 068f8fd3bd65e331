"""The simulation leaves rolling where a contact with steep friction does in its limit, at any
friction.

The steep contact has friction against the direction of v/sqrt(v^2 + eps^2) in the place of v/|v|:
the equations of SS (26) hold throughout, nothing ever sticks and no case is chosen. The simulation
has to be its limit for eps -> 0."""

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from analytic import simulate
from analytic.mechanics import dynamics, rolling_forces
from analytic.mechanics.contact_problem import Closed, solve
from analytic.mechanics.rigid_body import Forces, slip_at_A, slip_at_B, velocities
from analytic.simulation import transitions
from analytic.simulation.equations import smooth_rates
from analytic.simulation.motion import HybridState, of_ball
from analytic.simulation.settings import Settings
from model import Case, Contact, Flow, State
from tests.random_motions import UNIT, P, random_start

JAMMING = [
    P.replace(mu=1.7222, eta=0.0388, j=0.482, r=0.292 * P.R, c=0.1099 * UNIT, omega_0=2.635 * UNIT),
    P.replace(mu=1.2277, eta=0.1721, j=0.611, r=0.154 * P.R, c=0.1198 * UNIT, omega_0=2.099 * UNIT),
]
"""Sets in which forces can hold RR beyond omega_01, by jamming."""


def steep(p, eps):
    """Rates of (omega_c, slip_x, slip_y, slip_z) with steep friction, and its forces."""

    def direction(across, along):
        size = math.sqrt(across**2 + along**2 + eps**2)
        return across / size, along / size

    def forces(z):
        _, slip_x, slip_y, slip_z = z
        directions = direction(slip_x, slip_z), direction(slip_y, slip_z)
        return dynamics.forces(Case.SS, State(0.0, 0.0, *z), p, p.omega_0, *directions)

    def rates(_, z):
        x = State(0.0, 0.0, *z)
        return dynamics.newton_euler(Case.SS, x, forces(z), p, p.omega_0)[2:6]

    return rates, forces


def random_rolling(rng):
    """Parameters and omega_c of a ball in RR: mu to 3, eta to 2, as much lag or lead as friction
    might just hold."""
    mu, eta = (10 ** rng.uniform(-1.5, math.log10(most)) for most in (3, 2))
    j = rng.uniform(0.1, 0.66)
    load = 10 ** rng.uniform(-1, 1)
    omega_c, most = math.sqrt(load) * UNIT, min(mu, eta * (1 + j) * load)
    lag = rng.choice([0.0, rng.uniform(-1.5, 1.5)]) * (1 + 2 * j) / j * most
    return P.replace(mu=mu, eta=eta, j=j, c=UNIT, omega_0=omega_c + lag * UNIT), omega_c


def test_a_steep_contact_creeps_exactly_where_the_margin_is_positive():
    """At a fixed omega_c the slip of a steep contact that starts from none comes to rest (creep),
    or runs away."""
    rng, eps, seen = np.random.default_rng(5), 1e-4, set()
    for _ in range(60):
        p, omega_c = random_rolling(rng)
        margin = float(rolling_forces.slip_margin(omega_c, p))
        if abs(margin) < 0.02:  # creep there is as slow and as wide as you like
            continue
        rates, forces = steep(p, eps)

        def leaves(_, slip, forces=forces, omega_c=omega_c):
            return min(100 * eps - np.abs(slip).max(), forces((omega_c, *slip)).A_y)

        leaves.terminal = True

        def held(t, slip, rates=rates, omega_c=omega_c):
            return rates(t, (omega_c, *slip))[1:]

        span, accuracy = (0, 1e4 * eps * p.r / p.g), {"rtol": 1e-6, "atol": 1e-9 * eps}
        run = solve_ivp(held, span, np.zeros(3), method="LSODA", events=leaves, **accuracy)
        assert (run.status == 0) == (margin > 0), (p, omega_c)
        seen.add((margin > 0, float(rolling_forces.margin(omega_c, p)) > 0))
    assert seen >= {(True, True), (False, False)}


@pytest.mark.parametrize("p", JAMMING)
def test_the_limit_of_a_steep_contact(p):
    """From SS through RS and RR into SS: errors shrink as eps does; those of rolling on while it is
    feasible don't.

    At the onset the creep eps/sqrt(2 (1 - utilisation)) ~ eps t^(-1/2) meets the slip ~ t^2 when
    both are of the order of eps^(4/5). So is the error from then on; that from where slip dies out
    is smaller, of the order of eps."""
    x0 = [0, 0, 0.9 * p.omega_0, 0, 0, 0]
    ours, jammed = (
        simulate(p, x0, 2.0, sample_interval=0.1, leave_rolling=policy)
        for policy in ("slip-stability", "infeasible")
    )
    assert (Case.RR, Case.SS) in zip(ours.events.from_case, ours.events.to_case, strict=True)
    errors = []
    for eps in (1e-2, 1e-3):
        how = {"method": "LSODA", "t_eval": ours.time, "rtol": 1e-8, "atol": 1e-9}
        run = solve_ivp(steep(p, eps)[0], (0, 2), x0[2:], **how)
        errors.append([np.abs(run.y.T - other.x[:, 2:6]).max() for other in (ours, jammed)])
    coarse, fine = np.array(errors)
    assert fine[0] < coarse[0] / 5  # 10^(4/5) = 6.3
    assert fine[1] > 0.9 * coarse[1]


def test_a_slight_disturbance_ends_rolling_in_time_stepping_too():
    """Beyond its end RR may go on undisturbed in time stepping; a slip of 1e-5 of the spin lasts as
    the rule says."""
    p, _ = random_start(75)  # a floor with mu = 1.6
    omega_c = 0.8435 * p.omega_0
    assert rolling_forces.slip_margin(omega_c, p) < 0 < rolling_forces.margin(omega_c, p)
    x0 = State(omega_c=omega_c, slip_z=1e-5 * p.omega_0 * p.R / p.r)
    ways = ("event", "time-stepping")
    event, stepped = (simulate(p, x0, 0.2, sample_interval=0.02, method=way) for way in ways)
    np.testing.assert_allclose(stepped.omega_c, event.omega_c, atol=1e-3 * p.omega_0)
    assert np.ptp(event.omega_c) > 0.01 * p.omega_0


def test_never_beyond_what_forces_can_hold_and_continuous_where_it_ends():
    """At the end of RR friction is full and opposes the slip that sets in, which has no
    acceleration yet."""
    rng, ends = np.random.default_rng(2), set()
    for sense in [1, -1] * 150:
        p, omega_c = random_rolling(rng)
        p, omega_c = p.replace(omega_0=sense * p.omega_0), sense * omega_c
        lag = p.omega_0 - omega_c

        def margin(share, p=p, omega_c=omega_c, lag=lag):
            return float(rolling_forces.slip_margin(omega_c, p, omega_c + share * lag))

        if margin(0) <= 0 or margin(3) >= 0:
            continue
        fluid = omega_c + brentq(margin, 0, 3, xtol=1e-14) * lag
        at = HybridState(0.0, 0.0, State(omega_c=omega_c))
        number, onset = transitions.leave(at, of_ball(p, Flow.steady(fluid), Settings()))
        case = Case(number)
        ends.add((case, sense))
        slips = (onset.alpha, case.A), (onset.beta, case.B)
        angles = [angle for angle, contact in slips if contact is Contact.S]
        directions = [(math.sin(angle), math.cos(angle)) for angle in angles]
        forces = dynamics.FORCES[case](at.x, p, fluid, *directions)
        assert rolling_forces.margin(omega_c, p, fluid) > -1e-12
        assert math.hypot(forces.A_x, forces.A_z) <= p.mu * forces.A_y * (1 + 1e-9)
        assert math.hypot(forces.B_y, forces.B_z) <= p.eta * forces.B_x * (1 + 1e-9)
        rate = dynamics.newton_euler(case, at.x, forces, p, fluid)
        assert np.abs(rate[3:6]).max() <= 1e-9 * p.g / p.r
    assert ends == set(itertools.product((Case.RS, Case.SR, Case.SS), (1, -1)))


@pytest.mark.parametrize("rolls", "AB")
def test_a_single_rolling_contact_holds_or_gives_way(rolls):
    """RS and SR: while friction can hold the contact no slip of it lasts, if the other's is below 2
    sqrt(1+j)/j.

    A slip along n that lasts has the acceleration gamma n > 0 with full friction against n: a fixed
    direction, found from any start by following it."""
    rng = np.random.default_rng(8)
    for _ in range(200):
        p, omega_c = random_rolling(rng)
        sense = rng.choice([-1.0, 1.0])
        slips, case = ("slip_y", Case.RS) if rolls == "A" else ("slip_x", Case.SR)
        x = State(omega_c=omega_c, **{slips: sense})
        f = dynamics.forces(case, x, p, p.omega_0)
        if f.A_y <= 0:
            continue
        k = of_ball(p, Flow.steady(p.omega_0), Settings())
        free = smooth_rates(velocities(x, p), 0.0, 0.0, k)
        known = Closed(0.0, 0.0, -sense if rolls == "B" else sense)
        A, B = (Closed(), known) if rolls == "A" else (known, Closed())
        load, friction = p.eta * f.B_x, (f.B_y, f.B_z)
        if rolls == "A":
            load, friction = p.mu * f.A_y, (f.A_x, f.A_z)
        if abs(math.hypot(*friction) / load - 1) < 1e-3:
            continue
        for angle in np.arange(8) * math.pi / 4:  # from full friction in any direction
            push = load * math.cos(angle), load * math.sin(angle)
            start = (push[0], f.A_y, push[1], *f[3:]) if rolls == "A" else (*f[:3], f.B_x, *push)
            rates, _, settled = solve(free, A, B, p, Forces(*start), 1e-13)
            assert settled
            slip = slip_at_A(rates, p) if rolls == "A" else slip_at_B(rates, p)
            assert (math.hypot(*slip) < 1e-9 * p.g) == (math.hypot(*friction) < load)
