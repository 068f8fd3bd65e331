"""Claims about flows that change: pulsation of a rolling ball, jumps, ramps past the fold."""

from __future__ import annotations

import math
from collections.abc import Callable

import analytic
from analytic import pulsation, response
from compare.claims.claim import Bearing, Claim
from compare.claims.judge import remembered, simulated
from compare.measure.check import Relation
from compare.measure.record import Measurement, state
from compare.measure.unsteady import caught_up
from model import Case, Flow, Parameters
from model.drag import STOKES

PULSATION, UNSTEADY = "pulsation", "unsteady"
FAR, SAMPLES = 3.0, 5_000
"""Where theory's ramp ends beyond the fold, over the overshoot of a slow one; samples of it."""


def _ratio(m: Measurement) -> complex:
    return _followed(m.parameters, float(m.conditions["amplitude"]), float(m.conditions["f"]))


@remembered
def _followed(p: Parameters, amplitude: float, frequency: float) -> complex:
    """omega_c over omega_0 in a pulsation."""
    if p.drag == STOKES:
        return complex(response.transfer(p, Case.RR, frequency))
    return pulsation.first_harmonic(p, amplitude, frequency)


@remembered
def _slip_onset(p: Parameters, frequency: float, leave_rolling: str) -> float:
    return pulsation.slip_onset(p, frequency, leave_rolling)


@remembered
def _mean_error(p: Parameters, amplitude: float, frequency: float) -> float:
    return pulsation.mean_error(p, amplitude, frequency)


@remembered
def _peak(p: Parameters) -> tuple[float, float]:
    """Time and height of the peak after a jump in SS."""
    return response.peak(p, Case.SS)


@remembered
def ramp_end(p: Parameters, rate: float, x0: tuple[float, ...]) -> float:
    """The flow at which a ramp ends slipping at both points by theory; LookupError if it doesn't."""
    beyond = analytic.thresholds(p).omega_04 + FAR * response.ramp_coefficient(p) * rate ** (2 / 3)
    t_end = (beyond - p.omega_0) / rate
    end = caught_up(simulated(p, x0, t_end, SAMPLES, Flow.ramp(p.omega_0, beyond, t_end)))
    if math.isnan(end):
        raise LookupError("in theory the ramp doesn't end slipping")
    return end


def _left(m: Measurement) -> float:
    return ramp_end(m.parameters, float(m.conditions["rate"]), state(m))


def _at_frequency(quantity: str, predict: Callable[[Measurement], float], by: str) -> Bearing:
    return Bearing(protocol=PULSATION, quantity=quantity, predict=predict, by=by)


CLAIMS = (
    Claim(
        id="pulsation-lag",
        source="(23)",
        statement=(
            "Rolling at both points the ball follows the flow, pulsating or after a jump, as drag alone accelerates it "
            "and its spin: with Stokes' law as a lag of first order with the time constant (1 + 2j)/c."
        ),
        bearings=(
            _at_frequency("gain", lambda m: abs(_ratio(m)), "analytic.response.transfer, pulsation.first_harmonic"),
            _at_frequency("phase_lag", lambda m: -math.atan2(_ratio(m).imag, _ratio(m).real), "the same"),
            Bearing(
                protocol=UNSTEADY,
                quantity="jump_delay",
                predict=lambda m: 1 / response.rolling_rate(m.parameters),
                by="analytic.response.rolling_rate",
            ),
        ),
    ),
    Claim(
        id="pulsation-slip",
        source="(23), (66), (67), (73), (82)",
        statement=(
            "In a pulsating flow a rolling ball begins to slip where the friction that its acceleration takes, or the "
            "load at its fastest, is more than floor and wall can hold: not before slip can last, and not after no "
            "forces allow rolling, mostly the same amplitude. In between Coulomb's law allows both; slip that "
            "lasts below the first or rolling beyond the second would refute it."
        ),
        bearings=tuple(
            Bearing(
                protocol=PULSATION,
                quantity="slip_amplitude",
                predict=lambda m, rule=rule: _slip_onset(m.parameters, float(m.conditions["f"]), rule),  # type: ignore[misc]
                relation=relation,
                by=f"analytic.pulsation.slip_onset, {rule}",
            )
            for rule, relation in (("slip-stability", Relation.AT_LEAST), ("infeasible", Relation.AT_MOST))
        ),
    ),
    Claim(
        id="pulsation-mean",
        source="(23), (26), Definitions 1-3",
        statement="A pulsation that makes the ball slip makes its mean reading low.",
        bearings=(
            _at_frequency(
                "mean_error",
                lambda m: _mean_error(m.parameters, float(m.conditions["amplitude"]), float(m.conditions["f"])),
                "analytic.pulsation.mean_error",
            ),
        ),
    ),
    Claim(
        id="jump-slipping",
        source="(26), (38)-(42)",
        statement="After a jump of the flow a ball that slips at both points overshoots its new reading and rings.",
        bearings=(
            Bearing(
                protocol=UNSTEADY,
                quantity="jump_peak",
                predict=lambda m: _peak(m.parameters)[0],
                by="analytic.response.peak",
            ),
            Bearing(
                protocol=UNSTEADY,
                quantity="jump_height",
                predict=lambda m: _peak(m.parameters)[1],
                by="analytic.response.peak",
            ),
        ),
    ),
    Claim(
        id="ramp-fold",
        source="(26), (88)",
        statement="A flow that rises steadily keeps the ball slipping beyond the fold, before it catches up.",
        bearings=(
            Bearing(
                protocol=UNSTEADY,
                quantity="ramp_end",
                predict=_left,
                size=lambda m: abs(_left(m) - analytic.thresholds(m.parameters).omega_04),
                by="analytic.simulate",
            ),
        ),
    ),
)
