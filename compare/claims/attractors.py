"""Claims beyond the paper, which asks whether periodic attractors exist: a ball that hops for ever."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import analytic
from analytic import orbits
from analytic.orbits import Orbit
from compare.claims.claim import Bearing, Claim
from compare.claims.judge import remembered
from compare.measure.calm import hops
from compare.measure.lab import Level
from compare.measure.record import Measurement, state
from model import Parameters, Trajectory
from model.kinematics import VARIABLES

LASTS = 60.0
"""How long theory simulates a motion that settles, in units of 1/c: the slowest part decays in 2 (1 + 2 j)/c."""


@remembered
def _orbit(p: Parameters, x: tuple[float, ...], period: float) -> Orbit:
    """The closed orbit of theory near what was measured."""
    return orbits.refine(p, x, period)


def _of(m: Measurement) -> Orbit:
    return _orbit(m.parameters, tuple(float(m.conditions[n]) for n in VARIABLES), float(m.conditions["period"]))


def _bearing(quantity: str, predict: Callable[[Orbit], float], protocol: str = "recurrent") -> Bearing:
    return Bearing(protocol=protocol, quantity=quantity, predict=lambda m: predict(_of(m)), by="analytic.orbits.refine")


@remembered
def _followed(p: Parameters, x: tuple[float, ...], duration: float) -> Trajectory:
    return analytic.simulate(p, x, duration, sample_interval=duration / 2000)


@remembered
def _settled(p: Parameters) -> Trajectory:
    """What theory's simulation comes to from rest."""
    return analytic.simulate(p, [0.0] * 6, LASTS / p.c, sample_interval=LASTS / p.c)


def _after_rest(quantity: str, predict: Callable[[Trajectory], float]) -> Bearing:
    return Bearing(
        protocol="choice",
        quantity=quantity,
        predict=lambda m: predict(_settled(m.parameters)),
        by="analytic.simulate, which leaves rolling by Definitions 1-3",
    )


CLAIMS = (
    Claim(
        id="choice",
        source="Definitions 1-3",
        statement="For μ > 1, where forces allow rolling and slipping both, the ball slips as soon as slip grows.",
        bearings=(
            _after_rest("case", lambda run: float(run.case[-1])),
            _after_rest("omega_c", lambda run: float(run.omega_c[-1])),
        ),
    ),
    Claim(
        id="hopping",
        source="Section 5.3, last paragraph",
        statement="A periodic attractor exists: a ball hops on the floor for ever, rolling and slipping on the wall.",
        bearings=(
            _bearing("orbit_period", lambda orbit: orbit.period),
            _bearing("orbit_omega_c", lambda orbit: orbit.turn / orbit.period),
            _bearing("orbit_height", lambda orbit: float(orbit.cycle.y.max())),
        ),
    ),
    Claim(
        id="hopping-multiplier",
        level=Level.DEFAULT,
        source="Section 5.3, last paragraph",
        statement="Disturbances of the hopping shrink from hop to hop by its largest Floquet multiplier.",
        bearings=(_bearing("orbit_multiplier", lambda orbit: float(np.abs(orbit.multipliers).max())),),
    ),
    Claim(
        id="swing",
        level=Level.DEFAULT,
        source="Section 5.3, last paragraph",
        statement="Between the Hopf points of SS the ball swings for ever and slips all the time (very rough floor).",
        bearings=(
            _bearing("swing_period", lambda orbit: orbit.period, "swing"),
            _bearing("swing_omega_c", lambda orbit: orbit.turn / orbit.period, "swing"),
            _bearing("swing_size", lambda orbit: float(np.ptp(orbit.cycle.omega_c)), "swing"),
        ),
    ),
    Claim(
        id="calm",
        level=Level.DEFAULT,
        source="Section 5.3, last paragraph",
        statement="In strong drag, κ > 2, no ball was found that hops on.",
        bearings=(
            Bearing(
                protocol="calm",
                quantity="hops",
                predict=lambda m: hops(_followed(m.parameters, state(m), float(m.conditions["duration"]))),
                by="analytic.simulate",
            ),
        ),
    ),
    Claim(
        id="hopping-birth",
        level=Level.DEFAULT,
        source="Section 5.3, last paragraph, (85)",
        statement="Hopping begins with hops of no height at ω₀₂, where the wall begins to carry the ball.",
        bearings=(
            Bearing(
                protocol="recurrent",
                quantity="orbit_birth",
                predict=lambda m: analytic.thresholds(m.parameters).omega_02,
                by="analytic.thresholds: omega_02",
            ),
        ),
    ),
)
