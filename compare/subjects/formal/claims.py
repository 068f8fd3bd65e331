"""Claims that no ball and no engine can show: theory against theory, by another way.

Where a contact would have to pull (Fig. 12, and (83) for eta > 1), algebra is all there is. Limits,
derivatives and the results of a search are held against closed forms, and the two ways to compute a
motion against each other."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from itertools import product

import numpy as np
from scipy.optimize import brentq
from scipy.special import ai_zeros

import analytic
from analytic.bifurcation import diagram as bifurcation
from analytic.flowmeter import design, pulsation, real_fluid, response
from analytic.mechanics import dynamics
from analytic.slipping import slip_bounds, slip_stability
from analytic.stationary import slipping_branch
from compare.claim import Claim
from compare.kit.record import Check, Measurement
from compare.kit.statistics import COVERAGE
from model import Case, Flow, Parameters, State, drag
from model.kinematics import TURNING, VARIABLES, state_units

FORMAL = Parameters.named("reference").replace(eta=0.43)
"""eta so little above j that the branch of SS is whole once (12) is released."""
ROUND_OFF = 1e-12
"""Relative: some thousand operations, each to the last digit."""
CLAIMS: list[Claim] = []
"""In the order of the report: each stands at the algebra that decides it."""


def _formal(
    id: str, source: str, statement: str, reason: str
) -> Callable[[Callable[[], Iterator[Check]]], None]:
    """A decorator that makes a claim of the algebra that decides it; the reason why it is formal
    only."""
    return lambda algebra: CLAIMS.append(
        Claim(id, source, statement, algebra=algebra, reason=reason)
    )


def _check(
    quantity: str, what: str, value: float, predicted: float, error: float = 0.0, unit: float = 0.0
) -> Check:
    """A number found another way, with its standard uncertainty, in units of the predicted one, of
    `unit` or of 1."""
    scale = unit or abs(predicted) or 1.0
    own = max(error, ROUND_OFF * scale)
    algebra = Measurement(
        protocol="algebra",
        quantity=quantity,
        value=value,
        uncertainty=own,
        engine="theory",
        set="reference",
        parameters=FORMAL,
        conditions={"by": what},
    )
    return Check(measurement=algebra, predicted=predicted, tolerance=COVERAGE * own, scale=scale)


@_formal(
    "fig-12",
    "Fig. 12",
    "If floor and wall could pull, (12) released, all bifurcations of Table 5 would appear for η > "
    "j as well.",
    reason="The floor would have to pull: no ball and no engine does this.",
)
def _figure_12() -> Iterator[Check]:
    """The branch with A_y < 0 solves the equations and joins the thresholds as drawn."""
    p, unit = FORMAL, math.sqrt(FORMAL.g / FORMAL.R)
    t = analytic.thresholds(p)
    curves = bifurcation.threshold_curves(p, p.mu, p.eta, released=True)
    released = {name: float(value) * unit for name, value in curves.items()}
    s = np.linspace(-8.0, 8.0, 65)
    states, fluid = slipping_branch.states(s, p)
    ends = State.of(slipping_branch.states(np.array([-40.0, 40.0]), p)[0])
    rates = [
        dynamics.rates(Case.SS, x, p, w)[TURNING]
        for x, w in zip(states.tolist(), fluid.tolist(), strict=True)
    ]
    pushed = slipping_branch.branch(s, p).A_y

    def determinant(omega_0: float) -> float:
        """Determinant of SR's Jacobian, whose sign is that of the eigenvalue that isn't the decay
        of omega_c."""
        q = p.replace(omega_0=omega_0)
        (state,) = analytic.stationary_solutions(q, (Case.SR,))
        return float(np.linalg.det(dynamics.jacobian(Case.SR, state.x, q)))

    exchange = brentq(determinant, 0.8 * t.omega_03, 1.2 * t.omega_03, rtol=1e-14)
    along = slipping_branch.states(np.linspace(-8.0, 8.0, 4001), p)[1]
    k = int(np.argmax(along))
    # The maximum lies between the neighbours of the largest value, which is lower by no more than
    # they are.
    spacing = float(along[k] - min(along[k - 1], along[k + 1]))
    yield _check(
        "omega_01", "P3: ω_c where slip vanishes", float(ends.omega_c[0]), released["omega_01"]
    )
    yield _check("omega_02", "NF2: ω_c where w̃_z vanishes", float(ends.omega_c[1]), t.omega_02)
    yield _check("omega_03", "NT1: ω₀ where SR turns stable", float(exchange), t.omega_03)
    yield _check(
        "omega_04", "F: ω₀ where the branch turns", float(along[k]), released["omega_04"], spacing
    )
    yield _check(
        "law", "greatest rate on the branch divided by g/r", np.abs(rates).max() * p.r / p.g, 0.0
    )
    yield _check("law", "points with A_y ≥ 0", float(np.sum(pushed >= 0)), 0.0)
    turning = []
    for place in slipping_branch.hopf_places(p):
        x, w = slipping_branch.states(place, p)
        values = np.linalg.eigvals(dynamics.jacobian(Case.SS, x, p.replace(omega_0=float(w))))
        pair = values[np.argmax(values.imag)]
        turning.append(float(pair.real / pair.imag))
    yield _check(
        "law", "H: Hopf bifurcations on the branch, less the one drawn", len(turning) - 1.0, 0.0
    )
    yield _check(
        "law", "H: real part of its pair divided by the imaginary one", sum(turning), 0.0, 1e-9
    )


@_formal(
    "eq-83-rough",
    "(82), (83), end of section 4.3",
    "(83) is a bound for η > 1 only, and contradicts (12) there; (82) contradicts (12) unless η < "
    "j.",
    reason="At (83) the wall would have to pull, and at (82) for η > j the floor.",
)
def _pulling() -> Iterator[Check]:
    """The normal forces of slip at its onset, on either bound and a grid of friction
    coefficients."""
    grid = [
        FORMAL.replace(mu=mu, eta=eta)
        for mu in np.geomspace(0.05, 3.0, 13)
        for eta in np.geomspace(0.05, 3.0, 13)
    ]
    presses: dict[int, list[tuple[float, float, float]]] = {
        1: [],
        -1: [],
    }  # by side: eta, A_y and B_x in N
    for p, side in product(
        grid, presses
    ):  # along (0, 0), side 1, or (pi, pi) where (82) or (83) has it begin
        square, direction = slip_bounds.rr_to_ss(p, side).zero, (0.0, float(side))
        if 0 < square < math.inf:
            omega = math.sqrt(square)
            forces = dynamics.forces(Case.SS, State(omega_c=omega), p, omega, direction, direction)
            presses[side].append((p.eta, float(forces.A_y), float(forces.B_x)))
    yield _check(
        "law",
        "(83): friction at which the wall presses",
        sum(B_x >= 0 for _, _, B_x in presses[-1]),
        0.0,
    )
    wrong = sum((A_y > 0) != (eta < FORMAL.j) for eta, A_y, _ in presses[1])
    yield _check(
        "law", "(82): friction at which the floor presses and η > j, or pulls and η < j", wrong, 0.0
    )
    smooth = sum(eta <= 1 for eta, _, _ in presses[-1])
    yield _check("law", "(83): friction with a bound and η ≤ 1", smooth, 0.0)


@_formal(
    "section-5.2-virtual",
    "(73), section 5.2",
    "For η > j and ω₀ > ω₀₃ slip at the floor grows out of rolling at both points on either side, "
    "up to ω₀₁ and "
    "beyond: RR is unstable to SR from all directions; below, it dies out on either.",
    reason="The floor would have to pull: a ball lifts off there.",
)
def _on_all_sides() -> Iterator[Check]:
    """Signs of gamma of a slip at A out of RR, on either side and of any other direction, over a
    grid with eta > j."""
    grid = [
        FORMAL.replace(mu=mu, eta=eta)
        for mu in np.geomspace(0.05, 3.0, 7)
        for eta in np.geomspace(0.42, 3.0, 7)
    ]
    above = below = 0
    for p, side, flow in product(grid, (1.0, -1.0), (0.7, 0.99, 1.01, 1.4)):
        omega = flow * analytic.thresholds(p).omega_03
        q, n = p.replace(omega_0=omega), np.array([side])
        grows = bool(
            slip_stability.gamma(Case.RR, Case.SR, State(omega_c=omega).stacked(), n, q) > 0
        )
        stated = bool(slip_bounds.rr_to_sr(q, omega, int(side)).gamma(omega) > 0)
        wrong = (grows != (flow > 1)) + (stated != grows)
        above, below = (above + wrong, below) if flow > 1 else (above, below + wrong)
    yield _check("law", "(73): flows above ω₀₃ at which slip dies out on a side", above, 0.0)
    yield _check("law", "(73): flows below at which it grows", below, 0.0)


@_formal(
    "eq-69-edge",
    "after (69)",
    "The share δ is between 0 and 1 exactly where slip at the wall dies out on either side, (64).",
    reason="Where it does not, no ball rolls at both points: δ is measured in between, by eq-69.",
)
def _sliding() -> Iterator[Check]:
    """Where the share of (69) is between 0 and 1, and where slip at the wall dies out on both
    sides, (64)."""
    wrong = 0
    for mu, eta, lag in product(
        (0.1, 0.5), np.geomspace(0.05, 2.0, 8), np.linspace(-200.0, 200.0, 41)
    ):
        p = FORMAL.replace(mu=mu, eta=eta, omega_0=9.0 + lag)
        dies_out = all(slip_bounds.rr_to_rs(p, 9.0, side).gamma(p.omega_0) < 0 for side in (1, -1))
        wrong += (0 < slip_bounds.filippov_share(Case.RS, 9.0, p) < 1) != dies_out
    yield _check(
        "law", "(69), (64): states of which one says stable and the other unstable", wrong, 0.0
    )


@_formal(
    "design-sensitivities",
    "(84)-(86)",
    "A design's sensitivities are the logarithmic derivatives of thresholds by friction, inertia, "
    "size, gravity.",
    reason="Derivatives of the closed forms, which thresholds themselves are measured against.",
)
def _slopes() -> Iterator[Check]:
    """Logarithmic derivatives of the thresholds by hand (docs/design.md), and as a design gives
    them."""
    p = FORMAL.replace(eta=0.25)
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
    given = design.sensitivities(
        p.replace, {name: getattr(p, name) for name in ("mu", "eta", "j", "R", "g")}
    )
    for (threshold, name), slope in exact.items():
        of = given[threshold][name]
        yield _check(
            "law",
            f"d ln {threshold}/d ln {name}, off by",
            of.value - slope,
            0.0,
            max(of.error, 1e-9),
        )


@_formal(
    "ramp-law",
    "(88), docs/theory.md, 11",
    "A flow that rises slowly at a rate ρ passes the fold by K ρ^(2/3) before the ball lifts off.",
    reason="A limit: at rates that an engine can be asked for, terms ρ ln ρ and ρ are 1 to 30 % of "
    "it (ramp-fold).",
)
def _past_the_fold() -> Iterator[Check]:
    """The delay of a slow ramp by the normal form at the fold itself, q' = a (omega_0 - omega_04) +
    b q^2.

    From the null vectors of the Jacobian there and two derivatives of the vector field, instead of
    the branch."""
    for eta, mu, c in (0.2, 0.2, 1.0), (0.15, 0.45, 2.0), (0.3, 0.2, 0.5):
        p = FORMAL.replace(eta=eta, mu=mu, c=c)
        x, flow = slipping_branch.states(slipping_branch.fold(p), p)
        q = p.replace(omega_0=float(flow))
        J = dynamics.jacobian(Case.SS, x, q)
        along, across = np.zeros(8), np.zeros(8)
        for vector, matrix in (along, J), (across, J.T):
            values, vectors = np.linalg.eig(matrix)
            vector[TURNING] = np.real(vectors[:, np.argmin(np.abs(values))])
        across /= across @ along
        size = 1e-4 * float(np.abs(x).max())
        # The rate along the null vector, at the fold, on either side of it, and in a flow that is
        # faster by 1 rad/s.
        here, ahead, behind, faster = (
            across
            @ np.array(
                dynamics.rates(Case.SS, State(*(x + shift * along).tolist()), q, q.omega_0 + more)
            )
            for shift, more in ((0.0, 0.0), (size, 0.0), (-size, 0.0), (0.0, 1.0))
        )
        a, b = float(faster - here), float(ahead + behind - 2 * here) / (2 * size**2)
        delay = -float(ai_zeros(1)[0][0]) * (a * b) ** (-1 / 3)
        coefficient = response.ramp_coefficient(p)
        yield _check(
            "ramp_end", "K of K ρ^(2/3), by the normal form", delay, coefficient, 1e-4 * delay
        )


@_formal(
    "fluid-inertia",
    "extension",
    "A fluid with inertia shifts ω₀₁ and ω₀₂ as if mass, inertia and gravity were others; ω₀₃ "
    "stays.",
    reason="The paper and all simulators leave added mass and the pressure of the swirl out.",
)
def _with_inertia() -> Iterator[Check]:
    """Flows at which floor and wall can just hold a ball in a fluid with inertia, by its forces
    themselves."""
    for eta, ratio in product((0.1, 0.25, 0.6, 1.2), (0.1, 0.3, 0.6)):
        p = FORMAL.replace(eta=eta, density_ratio=ratio)
        expected = bifurcation.thresholds_with_inertia(p)
        carried = (
            (1 - ratio) * p.m * p.R
        )  # the swirl's pressure carries what the displaced fluid would take

        def slack(omega_0: float, p: Parameters = p, carried: float = carried) -> float:
            """What B_y the wall can give less what the floor needs, N; A_x = B_y - turns, B_x = the
            load less B_y."""
            turns = p.j * p.m * p.R * omega_0**2
            most = p.eta * (carried * omega_0**2 + turns) / (1 + p.eta)
            return most - (turns - p.mu * p.m * p.g) / (1 - p.mu)

        low, high = 1e-3 * expected["omega_02"], expected["omega_02"]
        if not math.isnan(expected["omega_01"]):
            onset = brentq(slack, low, 3 * high, rtol=1e-14)
            yield _check("omega_01", "forces of rolling", onset, expected["omega_01"])
        hangs = math.sqrt(p.m * p.g / (p.eta * carried))
        yield _check("omega_02", "weight on the wall", hangs, expected["omega_02"])


@_formal(
    "pulsation-extremes",
    "(66), (67), (73)",
    "The amplitude at which a pulsation makes the ball slip tends to a closed form for slow "
    "pulsations, which take the "
    "flow to ω₀₁, ω₀₃ or rest, and to another for fast ones, in which ω_c stands still.",
    reason="So slow or so fast, no engine could follow it; frequencies in between are measured "
    "(pulsation-slip).",
)
def _pulsating() -> Iterator[Check]:
    """The amplitude at which slip begins in a very slow and a very fast pulsation, against their
    limits."""
    for eta, mu, law in product(
        (0.1, 0.25, 0.35, 0.6), (0.1, 0.6), (drag.STOKES, drag.SCHILLER_NAUMANN)
    ):
        p = FORMAL.replace(eta=eta, mu=mu, drag=law, nu_f=1e-6)
        t = analytic.thresholds(p)
        end = t.omega_03 if math.isnan(t.omega_01) else t.omega_01
        p, slow = p.replace(omega_0=0.7 * end), p.replace(omega_0=0.3 * end)
        for limit, frequency in (
            (pulsation.slow_onset, 1e-5 * p.c),
            (pulsation.fast_onset, 1e5 * p.c),
        ):
            onset = pulsation.slip_onset(p, frequency)
            yield _check("slip_amplitude", limit.__name__, onset, limit(p), 1e-8 * onset)
        # Where a slow flow falls to rest the wall bears nothing: the limit is approached as the
        # frequency's root.
        onset, closer = (pulsation.slip_onset(slow, frequency * p.c) for frequency in (4e-5, 1e-5))
        what = "slow_onset, down to rest"
        yield _check(
            "slip_amplitude",
            what,
            2 * closer - onset,
            pulsation.slow_onset(slow),
            abs(closer - onset),
        )


@_formal(
    "two-methods",
    "Definitions 1-3",
    "The event-driven simulation and time stepping, extrapolated to no step, end in the same "
    "state, also where "
    "landings rebound.",
    reason="Two ways to compute theory's motions; motion and runs hold the first against MuJoCo.",
)
def _both_ways() -> Iterator[Check]:
    """Motions by time stepping, extrapolated from steps h and h/2, where the event-driven
    simulation has them."""
    p, flow = FORMAL.replace(eta=0.6), Flow.sines(12.0, [(3.0, 4.0, 1.0)])
    high = State(0.022, 0.042, 33.0, 39.6, 8.5, 1.5, 0.034, 0.178)
    starts = {
        # It falls onto the floor, slides, rolls out to the wall, hops, and slips at both points
        # till it rolls.
        "falls": (high, 0.138, 0.0),
        "rebounds": (high, 0.138, 0.5),
        # It slides out to the wall and rides it; at 0.1 s it comes down.
        "slides": (State(0.0, 0.0, -22.669, -0.266, 27.136, -7.88, 0.015, -0.085), 0.1, 0.0),
    }
    units = state_units(p)
    for name, (x, end, restitution) in starts.items():
        exact, coarse, fine = (
            analytic.simulate(
                p, x, end, flow, sample_interval=end, restitution=restitution, **way
            ).x[-1]
            for way in (
                {"rtol": 1e-11},
                {"method": "time-stepping", "timestep": end / 2**11},
                {"method": "time-stepping", "timestep": end / 2**12},
            )
        )
        for k, variable in enumerate(VARIABLES):
            # Landings and changes of case within a step leave an error of the first order, which is
            # not smooth.
            error = max(abs(fine[k] - coarse[k]), 1e-7 * units[k])
            what = f"a ball that {name}, by time stepping"
            yield _check(
                f"end_{variable}", what, 2 * fine[k] - coarse[k], exact[k], error, units[k]
            )


@_formal(
    "fluid-torque-friction",
    "extension",
    "A fluid that resists the ball's spin uses up friction; the least with which it still rolls "
    "follows from balances.",
    reason="Of engines only the lag is measured (fluid-torque).",
)
def _with_torque() -> Iterator[Check]:
    """The least friction with which a ball rolls in a fluid that resists its spin, by time
    stepping."""
    for eta, torque, flow in ((0.25, 2.0, 4.0), (0.6, 3.0, 5.0), (0.2, 0.5, 4.0)):
        p = FORMAL.replace(eta=eta, fluid_torque=torque, omega_0=flow, c=5.0)
        stated = real_fluid.rolling(p)
        slips, rolls = 0.5, 2.0  # parts of the stated friction
        while rolls - slips > 1e-5:
            middle = (slips + rolls) / 2
            share = middle * stated.friction
            q, x = p.replace(mu=share * p.mu, eta=share * p.eta), State(omega_c=stated.omega_c)
            run = analytic.simulate(
                q, x, 0.02, method="time-stepping", timestep=1e-3, sample_interval=1e-3
            )
            slips, rolls = (slips, middle) if run.case[-1] == Case.RR else (middle, rolls)
        # The stated one is the least at 2001 values of the force that (11) leaves free.
        what = "friction by time stepping divided by that stated, less 1"
        yield _check("law_in_motion", what, rolls - 1, 0.0, 1 / 4000)


@_formal(
    "design-best",
    "(84), (86), docs/design.md",
    "The flowmeter with the longest range has η = j, whatever the friction of the floor; among "
    "equals a design "
    "takes the quickest ball, the smallest.",
    reason="A search over closed forms.",
)
def _best() -> Iterator[Check]:
    """The friction of the wall and the radius that a search chooses, where the best is known."""
    fluid, fastest = {"nu_f": 1e-4, "rho_f": 1000.0}, 10.0
    for j, tolerance in product((0.3, 0.4), (0.0, 0.1)):
        exact = {"rho_b": 7800.0, "R": FORMAL.R, "mu": FORMAL.mu, "j": j}
        bounds = {name: (x, x) for name, x in exact.items()} | {
            "eta": (0.05, 0.9),
            "r": (FORMAL.r / 2, FORMAL.r),
        }
        chosen = design.best(
            partial(Parameters.from_fluid, **fluid), bounds, {"mu": tolerance}, fastest
        )
        ridge = math.sqrt(
            chosen.p.g / (FORMAL.R * j)
        )  # omega_01 = omega_03 at eta = j, whatever mu
        # The search ends when its candidates differ by 1e-5 of their cost.
        yield _check(
            "omega_03",
            "where the best meter's range ends",
            fastest * chosen.margin,
            ridge,
            1e-5 * ridge,
        )
        yield _check(
            "law",
            "radius of the best meter divided by the least, less 1",
            chosen.p.r / bounds["r"][0] - 1,
            0.0,
        )


SECTIONS = {"Formal": CLAIMS}
