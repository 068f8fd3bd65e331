"""Claims about balls that leave the wall or the floor: unloading (Fig. 13, right) and the push of section 5.3."""

from __future__ import annotations

import math

import numpy as np

from compare.claim import Bearing, Claim
from compare.judge import simulated
from compare.kit.record import Measurement, state
from compare.kit.settling import family
from compare.kit.statistics import Measured
from compare.subjects.flowmeter.measure.unloading import BY_SPIN, UNLOADED, UPWARDS, first_top
from model import Case, Contact, Trajectory

RTOL = 1e-9
"""Relative tolerance of these simulations: the speed of a landing is measured to 1e-6."""


def _run(m: Measurement) -> Trajectory:
    return simulated(m.parameters, state(m), float(m.conditions["duration"]), 2000, rtol=RTOL)


def _ends(*starts: str) -> Bearing:
    """The case in which a motion ends that starts in one of these ways."""

    def case(m: Measurement) -> float:
        return float(family(Case(_run(m).case[-1])))

    return Bearing("unloading", "case", case, when=lambda m: m.conditions["start"] in starts, by="analytic.simulate")


def _read(m: Measurement) -> float:
    """A number at an event of theory's motion; LookupError if there is no such event."""
    run, events, event = _run(m), _run(m).events, m.conditions["event"]
    if m.quantity == "lift":
        return float(run.y[-1]) if event == "end" else first_top(run)
    changes = list(zip(map(Case, events.from_case), map(Case, events.to_case), strict=True))
    if event == "slip at B":
        happens = [after.B is Contact.S for _, after in changes]
    else:
        happens = [before.A is Contact.N and after.A is not Contact.N for before, after in changes]
    if not any(happens):
        raise LookupError("theory has no such event")
    k = happens.index(True)
    if m.quantity == "time":
        return float(events.time[k])
    # The vertical impulse of both contacts: what they do at one moment may be several events.
    now = np.isclose(events.time, events.time[k], rtol=0.0, atol=math.ulp(1.0) * 1e3)
    impulse = float((events.impulse_A[now, 1] + events.impulse_B[now, 1]).sum())
    # It is all that a landing without restitution takes away.
    return impulse if m.quantity == "landing_impulse" else -impulse / m.parameters.m


def _predict(m: Measurement) -> Measured:
    """With the uncertainty of the integrator: errors of some 100 steps may be of one sign."""
    value = _read(m)
    return Measured(value, 100 * RTOL * abs(value))


CLAIMS = (
    Claim(
        "fig-13-right",
        "Fig. 13, right; section 5.3",
        "Carried by the wall while ω₀ falls below ω₀₂, the ball slips, sinks, hits the floor, and ends slipping or "
        "rolling at both points.",
        (
            _ends(UNLOADED),
            *(
                Bearing("unloading", quantity, _predict, by="analytic.simulate")
                for quantity in ("time", "landing_speed", "landing_impulse")
            ),
        ),
    ),
    Claim(
        "push",
        "section 5.3",
        "A small push lifts the ball from SR to NR, where it stays off the floor.",
        (_ends(UPWARDS, BY_SPIN), Bearing("unloading", "lift", _predict, by="analytic.simulate")),
    ),
)
