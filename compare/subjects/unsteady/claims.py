"""Claims about flows that change: pulsation of a rolling ball, jumps, ramps past the fold."""

import cmath
import math
from functools import partial

import analytic
from analytic.flowmeter import pulsation, response
from compare.method.record import Measurement, Relation, state
from compare.method.statistics import Estimate
from compare.subjects.unsteady.measure import AT_BOTH, AT_ONE, caught_up
from compare.verification.claim import Criterion, all_of, claim, criteria, given
from compare.verification.judge import integrated, simulated, theory
from compare.verification.states import by_stokes, lifts_first, slips_first
from model import Case, Flow

_BY = "analytic.flowmeter"
_RATE = f"{_BY}.response.rolling_rate"


def _followed(m: Measurement) -> Estimate:
    """Gain, or phase lag, rad, of omega_c in a pulsation, while the ball rolls."""
    if by_stokes(m):
        ratio, left_out = complex(theory(response.transfer, m.parameters, Case.RR, m.at["f"])), 0.0
    else:
        ratio = theory(pulsation.first_harmonic, m.parameters, m.at["amplitude"], m.at["f"])
        left_out = pulsation.LEFT_OUT
    gain = Estimate(abs(ratio), left_out)
    return gain if m.quantity == "gain" else Estimate(-cmath.phase(ratio), left_out / gain.value)


def _onset_criterion(rule: str, relation: Relation) -> Criterion:
    """A criterion on the onset of slip, by a rule of `Settings.leave_rolling`."""

    def onset(m: Measurement) -> float:
        return theory(pulsation.slip_onset, m.parameters, m.at["f"], rule)

    by = f"{_BY}.pulsation.slip_onset, {rule}"
    return Criterion("pulsation", "slip_amplitude", onset, relation=relation, by=by)


def _peak(m: Measurement) -> float:
    """Time, s, or height of the peak after a jump of the flow, while the ball slips."""
    time, height = theory(response.peak, m.parameters, Case.SS)
    return time if m.quantity == "jump_peak" else height


def _ramp_end(m: Measurement) -> Estimate:
    """The flow at which a ramp ends slipping by theory; LookupError if it doesn't."""
    p, rate = m.parameters, m.at["rate"]
    # The ramp goes on three times as far beyond the fold as a slow one overshoots it.
    beyond = analytic.thresholds(p).omega_04 + 3.0 * response.ramp_coefficient(p) * rate ** (2 / 3)
    t_end = (beyond - p.omega_0) / rate
    end = caught_up(simulated(p, state(m), t_end, 5_000, Flow.ramp(p.omega_0, beyond, t_end)))
    if math.isnan(end):
        raise LookupError("in theory the ramp doesn't end slipping")
    return integrated(end, end)


def _fastest_flow(m: Measurement) -> float:
    """The greatest flow at which the ball slips in a very slow pulsation about four fifths of it,
    rad s-1."""
    p = m.parameters.replace(omega_0=0.8 * m.parameters.omega_0)
    return p.omega_0 + pulsation.slow_onset(p)


def _flow_when_fast(m: Measurement) -> float:
    """The greatest flow of a fast pulsation about the orbit when slip begins, rad s-1."""
    p = m.parameters.replace(omega_0=m.at["omega_c"])
    return p.omega_0 + pulsation.fast_onset(p)


def _lowest_flow(m: Measurement) -> float:
    """Lowest flow (rad s-1) of a slow pulsation about a slow flow, when slip begins: 0, at rest."""
    p = m.parameters.replace(omega_0=0.1 * math.sqrt(m.parameters.g / m.parameters.R))
    return p.omega_0 - pulsation.slow_onset(p)


_HELD = given(inner="RR", outer="RS", by="held")
_SLOW, _FAST, _MEAN = (
    f"{_BY}.pulsation.{function}" for function in ("slow_onset", "fast_onset", "mean_error")
)


def _mean_error(m: Measurement) -> Estimate:
    """The mean of omega_c in a pulsation less that of the flow, rad s-1."""
    value = theory(pulsation.mean_error, m.parameters, m.at["amplitude"], m.at["f"])
    return Estimate(value, pulsation.SETTLED * abs(m.parameters.omega_0))


_mean = partial(Criterion, "pulsation", "mean_error")


def _flow(m: Measurement) -> float:
    """The mean flow, rad s-1, by which an error is divided that is none."""
    return m.parameters.omega_0


CLAIMS = (
    claim(
        "pulsation-lag",
        "(23)",
        "Rolling at both points the ball follows the flow, pulsating or after a jump, as drag "
        "alone accelerates it and its spin. With Stokes' law that is a lag of first order with the "
        "time constant (1 + 2j)/c.",
        *criteria(
            "pulsation",
            ("gain", "phase_lag"),
            _followed,
            by=f"{_BY}.response.transfer, pulsation.first_harmonic",
        ),
        Criterion(
            "unsteady", "jump_delay", lambda m: 1 / response.rolling_rate(m.parameters), by=_RATE
        ),
    ),
    claim(
        "pulsation-slip",
        "(23), (66), (67), (73), (82)",
        "In a pulsating flow a rolling ball begins to slip once rolling needs more friction than "
        "floor and wall can give. It doesn't below the amplitude at which slip first lasts, and "
        "does above the one up to which forces allow rolling. Mostly the two are the same; in "
        "between Coulomb's law allows both.",
        _onset_criterion("slip-stability", Relation.AT_LEAST),
        _onset_criterion("infeasible", Relation.AT_MOST),
    ),
    claim(
        "pulsation-limits",
        "(66), (67), (82)",
        "A slow pulsation makes the ball slip when the flow reaches ω₀₁ or ω₀₃, or falls to rest. "
        "In a fast one ω_c hardly changes, and the ball slips when the drag of the fluid alone is "
        "too strong.",
        Criterion("thresholds", "omega_01", _fastest_flow, when=slips_first, by=_SLOW),
        Criterion("thresholds", "omega_03", _fastest_flow, when=lifts_first, by=_SLOW),
        Criterion(
            "bounds",
            "gamma_zero_square",
            lambda m: _lowest_flow(m) ** 2,
            when=given(inner="RR", outer="RS", by="stationary"),
            size=lambda m: m.parameters.g / m.parameters.R,
            by=_SLOW,
        ),
        Criterion("bounds", "gamma_zero", _flow_when_fast, when=_HELD, by=_FAST),
    ),
    claim(
        "pulsation-mean",
        "(20), (23), (24), (26), Definitions 1-3",
        "A pulsation that makes the ball slip at both points makes its mean reading low: on "
        "average its spin about the tangent takes drag. One that makes it slip at the wall alone "
        "does not change the mean, under Stokes' law.",
        _mean(_mean_error, when=given(slips=AT_BOTH), by=_MEAN),
        _mean(_mean_error, when=given(slips=AT_ONE), size=_flow, by=_MEAN),
        _mean(
            lambda m: 0.0,
            when=all_of(given(slips=AT_ONE), by_stokes),
            size=_flow,
            by="the balance of spin, docs/theory.md, 11",
        ),
    ),
    claim(
        "jump-slipping",
        "(26), (38)-(42)",
        "After a jump of the flow a ball that slips at both points overshoots its new reading and "
        "rings.",
        *criteria("unsteady", ("jump_peak", "jump_height"), _peak, by=f"{_BY}.response.peak"),
    ),
    claim(
        "ramp-fold",
        "(26), (88)",
        "A flow that rises steadily keeps the ball slipping beyond the fold, before it catches up.",
        Criterion(
            "unsteady",
            "ramp_end",
            _ramp_end,
            size=lambda m: abs(_ramp_end(m).value - analytic.thresholds(m.parameters).omega_04),
            by="analytic.simulate",
        ),
    ),
)
SECTIONS = {"Unsteady flow": CLAIMS}
