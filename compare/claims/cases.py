"""Claims about cases and impacts: which case it is (Fig. 2), and what a landing leaves."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

import analytic
from analytic.rolling_forces import margin, slip_margin
from compare.claims.claim import Bearing, Claim
from compare.claims.judge import remembered
from compare.measure.impacts import NAMES
from compare.measure.record import Measurement, state
from model import Parameters, State, Trajectory


@remembered
def _after(x: tuple[float, ...], p: Parameters, time: float) -> Trajectory:
    return analytic.simulate(p, np.array(x), time, sample_interval=time)


def _simulated(m: Measurement) -> Trajectory:
    return _after(state(m), m.parameters, float(m.conditions["time"]))


def _decides(m: Measurement) -> bool:
    """Whether the case follows from the state alone.

    Where forces admit rolling at both points and yet slip would last, a ball that has rolled until now may go on so: it
    hangs on the internal force between floor and wall, which the state doesn't hold (docs/theory.md, 7).
    """
    x, p = State(*state(m)), m.parameters
    rolls = all(value == 0 for value in x._replace(omega_c=0.0))
    return not rolls or float(margin(x.omega_c, p)) < 0 or float(slip_margin(x.omega_c, p)) >= 0


_SPEEDS: dict[str, Callable[[Parameters], float]] = {
    "v_y": lambda p: math.sqrt(p.g * p.R),
    "v_h": lambda p: math.sqrt(p.g * p.R),
    "omega_c": lambda p: math.sqrt(p.g / p.R),
    **{f"slip_{axis}": lambda p: math.sqrt(p.g * p.R) / p.r for axis in "xyz"},
}


def _impact(name: str) -> Bearing:
    return Bearing(
        "impacts",
        f"after_{name}",
        lambda m: float(getattr(_simulated(m), name)[-1]),
        scale=_SPEEDS[name],
        by="analytic.simulate",
    )


CLAIMS = (
    Claim(
        id="cases",
        source="Fig. 2, Table 3",
        statement=(
            "Slip speeds and normal forces tell all nine kinematic cases apart; the ball passes through them as the "
            "equations of motion say."
        ),
        bearings=(
            Bearing("motions", "case", lambda m: float(_simulated(m).case[-1]), when=_decides, by="analytic.simulate"),
        ),
    ),
    Claim(
        id="impacts",
        source="extension",
        statement="A ball that lands does not rebound, and friction takes its share of the impulse.",
        bearings=tuple(_impact(name) for name in NAMES),
        reason="Impacts are not in the paper: Newton's law with restitution 0, and Coulomb's for the impulses.",
    ),
)
