"""Claims about balls that leave the wall or the floor: unloading (Fig. 13, right) and the push of section 5.3."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from compare.claims.claim import Bearing, Claim
from compare.claims.judge import simulated
from compare.measure.record import Measurement, state
from compare.measure.settling import family
from compare.measure.unloading import BY_SPIN, UNLOADED, UPWARDS, first_top
from compare.statistics import Measured
from model import Case, Contact, Trajectory

RTOL = 1e-9
"""Relative tolerance of these simulations: the speed of a landing is measured to 1e-6."""


def _first(run: Trajectory, happens: Callable[[Case, Case], bool]) -> int:
    """Index of the first change of case of a kind; LookupError if there is none."""
    changes = zip(map(Case, run.events.from_case), map(Case, run.events.to_case), strict=True)
    if (k := next((k for k, change in enumerate(changes) if happens(*change)), None)) is None:
        raise LookupError("theory has no such event")
    return k


def _landing(run: Trajectory) -> int:
    return _first(run, lambda before, after: before.A is Contact.N and after.A is not Contact.N)


def _time(run: Trajectory, event: str) -> float:
    k = _landing(run) if event == "landing" else _first(run, lambda before, after: after.B is Contact.S)
    return float(run.events.time[k])


def _impulse(run: Trajectory, event: str = "") -> float:
    """Vertical impulse of both contacts, N s; what they do at one moment may be several events."""
    now = np.isclose(run.events.time, run.events.time[_landing(run)], rtol=0.0, atol=math.ulp(1.0) * 1e3)
    return float((run.events.impulse_A[now, 1] + run.events.impulse_B[now, 1]).sum())


def _speed(run: Trajectory, event: str) -> float:
    """The impulse is all that a landing without restitution takes away."""
    return -_impulse(run) / run.header.parameters.m


def _lift(run: Trajectory, event: str) -> float:
    return float(run.y[-1]) if event == "end" else first_top(run)


def _run(m: Measurement) -> Trajectory:
    return simulated(m.parameters, state(m), float(m.conditions["duration"]), 2000, rtol=RTOL)


def _ends(*starts: str) -> Bearing:
    """The case in which a motion ends that starts in one of these ways."""
    return Bearing(
        "unloading",
        "case",
        lambda m: float(family(Case(_run(m).case[-1]))),
        when=lambda m: m.conditions["start"] in starts,
        by="analytic.simulate",
    )


def _bearing(quantity: str, read: Callable[[Trajectory, str], float]) -> Bearing:
    """A number read off theory's motion; errors of some 100 steps of the integrator may be of one sign."""

    def predict(m: Measurement) -> Measured:
        value = read(_run(m), str(m.conditions["event"]))
        return Measured(value, 100 * RTOL * abs(value))

    return Bearing("unloading", quantity, predict, by="analytic.simulate")


CLAIMS = (
    Claim(
        "fig-13-right",
        "Fig. 13, right; section 5.3",
        "Carried by the wall while ω₀ falls below ω₀₂, the ball slips, sinks, hits the floor, and ends slipping or "
        "rolling at both points.",
        (
            _ends(UNLOADED),
            _bearing("time", _time),
            _bearing("landing_speed", _speed),
            _bearing("landing_impulse", _impulse),
        ),
    ),
    Claim(
        "push",
        "section 5.3",
        "A small push lifts the ball from SR to NR, where it stays off the floor.",
        (_ends(UPWARDS, BY_SPIN), _bearing("lift", _lift)),
    ),
)
