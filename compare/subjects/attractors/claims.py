"""Claims beyond the paper: periodic attractors exist, as a ball that hops for ever."""

import math
from collections.abc import Callable

import numpy as np

import analytic
from analytic.orbits import orbit_branch
from analytic.orbits import periodic as orbits
from analytic.orbits.orbit_branch import Bifurcation
from analytic.orbits.periodic import Orbit
from compare.method.record import Measurement, state
from compare.method.statistics import hops
from compare.plan import Level
from compare.subjects.attractors.measure import TOP
from compare.verification.claim import Criterion, claim, criteria
from compare.verification.judge import simulated, theory
from compare.verification.states import solution_of

_REFINED = "analytic.orbits.periodic.refine"
_PERIODIC = "Section 5.3, last paragraph"


def _hops(m: Measurement) -> float:
    """Whether theory's ball still hops after a run of the same length from the same state."""
    return hops(simulated(m.parameters, state(m), m.at["duration"], 2000))


def _rebounding(m: Measurement) -> Orbit:
    """The hop of a ball that rebounds, by continuation from the hop without a rebound."""
    p, end = m.parameters, m.at["restitution"]
    orbit = theory(orbits.refine, p, TOP, 0.22)  # s, about its period
    for restitution in [*np.arange(0.2, end, 0.1).tolist(), end] if end else []:
        orbit = theory(orbits.refine, p, tuple(orbit.loop.x.tolist()), orbit.period, restitution)
    return orbit


def _eta_at_torus(orbit: Orbit) -> float:
    """The wall friction at which multipliers leave the unit circle; nan if they don't."""
    branch = orbit_branch.follow(orbit, "eta", orbit.p.eta, 1.1 * orbit.p.eta)
    return next(
        (place.value for place in branch.places if place.kind is Bifurcation.TORUS), math.nan
    )


_ORBIT: dict[str, Callable[[Orbit], float]] = {
    "orbit_period": lambda orbit: orbit.period,
    "orbit_omega_c": lambda orbit: orbit.turn / orbit.period,
    "orbit_height": lambda orbit: float(orbit.cycle.y.max()),
    "orbit_multiplier": lambda orbit: float(np.abs(orbit.multipliers).max()),
    "orbit_death": _eta_at_torus,
    "swing_period": lambda orbit: orbit.period,
    "swing_omega_c": lambda orbit: orbit.turn / orbit.period,
    "swing_size": lambda orbit: float(np.ptp(orbit.cycle.omega_c)),
}


def _orbit_criteria(protocol: str, *quantities: str) -> tuple[Criterion, ...]:
    """Criteria on quantities of the periodic orbit that theory has near the measured one."""

    def predict(m: Measurement) -> float:
        return _ORBIT[m.quantity](theory(orbits.refine, m.parameters, state(m), m.at["period"]))

    return criteria(protocol, quantities, predict, by=_REFINED)


def _after_rest(m: Measurement) -> float:
    """The settled state of theory from rest, after 60/c: thirty times the slowest decay."""
    run = simulated(m.parameters, (0.0,) * 6, 60.0 / m.parameters.c)
    return float(getattr(run, m.quantity)[-1])


def _only_lasting(m: Measurement) -> float:
    """Case or omega_c of the only stationary motion that attracts; nan if there are more."""
    those = analytic.stable_solutions(m.parameters)
    lasts = those[0].case if m.quantity == "case" else those[0].state.omega_c
    return float(lasts) if len(those) == 1 else math.nan


_HOP = "orbit_period", "orbit_omega_c", "orbit_height"
_RULE = "analytic.simulate, which leaves rolling by Definitions 1-3"
CLAIMS = (
    claim(
        "choice",
        "Definitions 1-3",
        "For μ > 1, where forces allow rolling and slipping both, the ball slips as soon as slip "
        "grows.",
        *criteria("choice", ("case", "omega_c"), _after_rest, by=_RULE),
        *criteria("choice", ("case", "omega_c"), _only_lasting, by="analytic.stable_solutions"),
    ),
    claim(
        "hopping",
        _PERIODIC,
        "A periodic attractor exists: a ball hops on the floor for ever, rolling and slipping on "
        "the wall. The engine "
        "and Moreau-Jean time stepping come to the closed orbit of the event-driven simulation.",
        *_orbit_criteria("recurrent", *_HOP),
        *_orbit_criteria("stepped", *_HOP),
    ),
    claim(
        "hopping-multiplier",
        _PERIODIC,
        "Disturbances of a hop shrink from one to the next by a factor: the largest Floquet "
        "multiplier of its orbit.",
        *_orbit_criteria("recurrent", "orbit_multiplier"),
        level=Level.DEFAULT,
    ),
    claim(
        "swing",
        _PERIODIC,
        "Between the Hopf points of SS the ball swings for ever and slips all the time (very rough "
        "floor).",
        *_orbit_criteria("swing", "swing_period", "swing_omega_c", "swing_size"),
        level=Level.DEFAULT,
    ),
    claim(
        "calm",
        _PERIODIC,
        "In strong drag, κ > 2, no ball was found that hops on: each settles to a stationary "
        "motion.",
        Criterion("calm", "hops", _hops, by="analytic.simulate"),
        Criterion(
            "calm",
            "end_omega_c",
            lambda m: solution_of(m).state.omega_c,
            by="analytic.stable_solutions",
        ),
        level=Level.DEFAULT,
    ),
    claim(
        "hopping-birth",
        f"{_PERIODIC}, (85)",
        "Hopping begins with hops of no height at ω₀₂, where the wall begins to carry the ball.",
        Criterion(
            "recurrent",
            "orbit_birth",
            lambda m: analytic.thresholds(m.parameters).omega_02,
            by="analytic.thresholds: omega_02",
        ),
        level=Level.DEFAULT,
    ),
    claim(
        "hopping-rebound",
        _PERIODIC,
        "A ball that rebounds hops on, too, lower and lower, up to a coefficient of restitution of "
        "0.536, where a pair of Floquet multipliers leaves the unit circle. Beyond, the hops end. "
        "By continuation and time stepping: MuJoCo's contacts have no such coefficient.",
        Criterion("rebounding", "hops", lambda m: float(_rebounding(m).stable), by=_REFINED),
        *criteria(
            "rebounding",
            ("orbit_period", "orbit_omega_c"),
            lambda m: _ORBIT[m.quantity](_rebounding(m)),
            by=_REFINED,
        ),
        level=Level.DEFAULT,
        reason="Impacts are not in the paper: Newton's law of restitution and Coulomb's, at floor "
        "and wall at once.",
    ),
    claim(
        "hopping-death",
        _PERIODIC,
        "Along rougher walls hopping ends where a pair of Floquet multipliers leaves the unit "
        "circle.",
        *_orbit_criteria("followed", "orbit_death"),
        Criterion("followed", "hops", _hops, by="analytic.simulate"),
        level=Level.DEFAULT,
    ),
)
SECTIONS = {"Beyond the paper": CLAIMS}
