"""Claims beyond the paper, which asks whether periodic attractors exist: a ball that hops for ever."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

import analytic
from analytic import orbit_branch, orbits
from analytic.orbit_branch import Bifurcation
from analytic.orbits import Orbit
from compare.claims.claim import Bearing, Claim
from compare.claims.judge import simulated, theory
from compare.measure.levels import Level
from compare.measure.record import Measurement, state
from compare.statistics import hops
from model import Trajectory

_PERIODIC = "Section 5.3, last paragraph"


def _left_alone(protocol: str) -> Bearing:
    """Whether the ball hops on that theory lets go in the same state for as long."""

    def of(m: Measurement) -> float:
        return hops(simulated(m.parameters, state(m), float(m.conditions["duration"]), 2000))

    return Bearing(protocol, "hops", of, by="analytic.simulate")


def _orbiting(protocol: str, quantity: str, predict: Callable[[Orbit], float]) -> Bearing:
    """A number of the closed orbit of theory near what was measured."""

    def of(m: Measurement) -> float:
        return predict(theory(orbits.refine, m.parameters, state(m), float(m.conditions["period"])))

    return Bearing(protocol, quantity, of, by="analytic.orbits.refine")


_ORBIT: dict[str, Callable[[Orbit], float]] = {
    "orbit_period": lambda orbit: orbit.period,
    "orbit_omega_c": lambda orbit: orbit.turn / orbit.period,
    "orbit_height": lambda orbit: float(orbit.cycle.y.max()),
}


def _death(orbit: Orbit) -> float:
    """Where multipliers leave the unit circle, on the branch from an orbit along rougher walls."""
    branch = orbit_branch.follow(orbit, "eta", orbit.p.eta, 1.1 * orbit.p.eta)
    return next((place.value for place in branch.places if place.kind is Bifurcation.TORUS), math.nan)


def _after_rest(quantity: str, predict: Callable[[Trajectory], float]) -> Bearing:
    """A number of what theory comes to from rest within 60/c; the slowest part decays in 2 (1 + 2 j)/c."""

    def of(m: Measurement) -> float:
        return predict(simulated(m.parameters, (0.0,) * 6, 60.0 / m.parameters.c))

    return Bearing("choice", quantity, of, by="analytic.simulate, which leaves rolling by Definitions 1-3")


CLAIMS = (
    Claim(
        "choice",
        "Definitions 1-3",
        "For μ > 1, where forces allow rolling and slipping both, the ball slips as soon as slip grows.",
        (
            _after_rest("case", lambda run: float(run.case[-1])),
            _after_rest("omega_c", lambda run: float(run.omega_c[-1])),
        ),
    ),
    Claim(
        "hopping",
        _PERIODIC,
        "A periodic attractor exists: a ball hops on the floor for ever, rolling and slipping on the wall. The engine "
        "and Moreau-Jean time stepping come to the closed orbit of the event-driven simulation.",
        tuple(
            _orbiting(protocol, quantity, predict)
            for protocol in ("recurrent", "stepped")
            for quantity, predict in _ORBIT.items()
        ),
    ),
    Claim(
        "hopping-multiplier",
        _PERIODIC,
        "Disturbances of the hopping shrink from hop to hop by its largest Floquet multiplier.",
        (_orbiting("recurrent", "orbit_multiplier", lambda orbit: float(np.abs(orbit.multipliers).max())),),
        level=Level.DEFAULT,
    ),
    Claim(
        "swing",
        _PERIODIC,
        "Between the Hopf points of SS the ball swings for ever and slips all the time (very rough floor).",
        (
            _orbiting("swing", "swing_period", lambda orbit: orbit.period),
            _orbiting("swing", "swing_omega_c", lambda orbit: orbit.turn / orbit.period),
            _orbiting("swing", "swing_size", lambda orbit: float(np.ptp(orbit.cycle.omega_c))),
        ),
        level=Level.DEFAULT,
    ),
    Claim(
        "calm",
        _PERIODIC,
        "In strong drag, κ > 2, no ball was found that hops on.",
        (_left_alone("calm"),),
        level=Level.DEFAULT,
    ),
    Claim(
        "hopping-birth",
        f"{_PERIODIC}, (85)",
        "Hopping begins with hops of no height at ω₀₂, where the wall begins to carry the ball.",
        (
            Bearing(
                "recurrent",
                "orbit_birth",
                lambda m: analytic.thresholds(m.parameters).omega_02,
                by="analytic.thresholds: omega_02",
            ),
        ),
        level=Level.DEFAULT,
    ),
    Claim(
        "hopping-death",
        _PERIODIC,
        "Along rougher walls hopping ends where a pair of Floquet multipliers leaves the unit circle.",
        (_orbiting("followed", "orbit_death", _death), _left_alone("followed")),
        level=Level.DEFAULT,
    ),
)
