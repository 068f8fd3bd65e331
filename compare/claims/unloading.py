"""Claims about balls that leave the wall or the floor: unloading (Fig. 13, right) and the push of section 5.3."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

import analytic
from compare.claims.claim import Bearing, Claim
from compare.claims.judge import remembered
from compare.measure.record import Measurement, state
from compare.measure.settling import family
from compare.measure.unloading import first_top
from compare.statistics import Measured
from model import Case, Contact, Parameters, Trajectory

PROTOCOL = "unloading"
SAMPLES = 2000
STEPS = 100
"""Steps of the integrator up to an event, about, whose errors may be of one sign."""


@remembered
def _motion(p: Parameters, x0: tuple[float, ...], t_end: float) -> Trajectory:
    return analytic.simulate(p, x0, t_end, sample_interval=t_end / SAMPLES)


def _run(m: Measurement) -> Trajectory:
    return _motion(m.parameters, state(m), float(m.conditions["duration"]))


def _case(m: Measurement) -> float:
    return float(family(Case(_run(m).case[-1])))


def _event(run: Trajectory, happens: Callable[[Case, Case], bool]) -> int:
    """Index of the first change of case of a kind; LookupError if there is none."""
    pairs = zip(run.events.from_case, run.events.to_case, strict=True)
    for k, (before, after) in enumerate(pairs):
        if happens(Case(before), Case(after)):
            return k
    raise LookupError("theory has no such event")


def _landing(m: Measurement) -> tuple[Trajectory, int]:
    run = _run(m)
    return run, _event(run, lambda before, after: before.A is Contact.N and after.A is not Contact.N)


def _onset(m: Measurement) -> float:
    run = _run(m)
    return float(run.events.time[_event(run, lambda before, after: after.B is Contact.S)])


def _time_of_landing(m: Measurement) -> float:
    run, k = _landing(m)
    return float(run.events.time[k])


def _impulse(m: Measurement) -> float:
    """Vertical impulse of both contacts, N s; what they do at one moment may be several events."""
    run, k = _landing(m)
    now = np.isclose(run.events.time, run.events.time[k], rtol=0.0, atol=math.ulp(1.0) * 1e3)
    return float((run.events.impulse_A[now, 1] + run.events.impulse_B[now, 1]).sum())


def _landing_speed(m: Measurement) -> float:
    """The impulse is all that a landing without restitution takes away."""
    return -_impulse(m) / m.parameters.m


def _lift(m: Measurement) -> float:
    run = _run(m)
    return float(run.y[-1]) if m.conditions["event"] == "end" else first_top(run)


def _sure(predict: Callable[[Measurement], float]) -> Callable[[Measurement], Measured]:
    """A predicted number with the uncertainty of the integrator; a case has none."""

    def predicted(m: Measurement) -> Measured:
        value = predict(m)
        sure = 0.0 if predict is _case else STEPS * analytic.Settings().rtol * abs(value)
        return Measured(value, sure)

    return predicted


def _bearing(quantity: str, predict: Callable[[Measurement], float], event: str = "", start: str = "") -> Bearing:
    def when(m: Measurement) -> bool:
        begun, conditions = str(m.conditions["start"]), m.conditions
        return begun.startswith(start) and (not event or conditions["event"] == event)

    return Bearing(PROTOCOL, quantity, _sure(predict), when=when, by="analytic.simulate")


CLAIMS = (
    Claim(
        id="fig-13-right",
        source="Fig. 13, right; section 5.3",
        statement=(
            "Carried by the wall while ω₀ falls below ω₀₂, the ball slips, sinks, hits the floor, and ends slipping or "
            "rolling at both points."
        ),
        bearings=(
            _bearing("case", _case, start="unloading"),
            _bearing("time", _onset, "slip at B"),
            _bearing("time", _time_of_landing, "landing"),
            _bearing("landing_speed", _landing_speed, "landing"),
            _bearing("landing_impulse", _impulse, "landing"),
        ),
    ),
    Claim(
        id="push",
        source="section 5.3",
        statement="A small push lifts the ball from SR to NR, where it stays off the floor.",
        bearings=(_bearing("case", _case, start="push"), _bearing("lift", _lift)),
    ),
)
