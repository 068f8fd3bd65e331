"""The flowmeter (section 5.3): slope, range and hysteresis, unloading, pushes."""

import math
from collections.abc import Callable
from functools import partial

import numpy as np

import analytic
from analytic.flowmeter import design
from analytic.flowmeter.characteristic import End
from compare.method.record import Measurement, state
from compare.method.settling import physical_case
from compare.method.statistics import Estimate
from compare.subjects.flowmeter.measure import BY_SPIN, UNLOADED, UPWARDS, first_top
from compare.verification.claim import Criterion, Text, When, all_of, claim, given
from compare.verification.judge import integrated, simulated, theory
from compare.verification.states import (
    by_stokes,
    case_of,
    from_floor,
    is_in,
    lasting_cases,
    lifts_first,
    slips_first,
    solution_of,
    solutions,
)
from model import Case, Contact, Trajectory
from model.drag import QUADRATIC

_SIMULATED, _UNLOADS = "analytic.simulate", "analytic.unloading_limit"
RTOL = 1e-9  # relative tolerance of simulations: the speed of a landing is measured to 1e-6


def _slope(by: str, predict: Callable[[Measurement], float], of: str, *cases: Case) -> Criterion:
    """A criterion on slopes of the curve measured in one way, in some cases."""
    when = all_of(given(by=by), is_in(*cases))
    return Criterion("slope", "slope", predict, when=when, by=f"analytic.{of}")


def _slope_at(m: Measurement) -> float:
    """d omega_c/d omega_0 in the case that was detected."""
    return theory(analytic.characteristic_slope, m.parameters, case_of(m))


def _only_rolling(m: Measurement) -> float:
    """The case: RR within the operating range; beyond it one that lasts, and not RR."""
    if m.parameters.omega_0 < analytic.operating_range(m.parameters):
        return float(Case.RR)
    # The start that shows that the range has ended: the ball slips on the floor, or stays on the
    # wall.
    ended = m.at["start"] == ("rest" if slips_first(m) else "on the wall")
    if case_of(m) not in lasting_cases(m.parameters) - ({Case.RR} if ended else set()):
        raise LookupError("beyond the range, rolling is not the only motion that lasts")
    return m.value


def _range(m: Measurement) -> float:
    """The flow up to which the meter can be used, rad s-1."""
    return analytic.operating_range(m.parameters)


def _unloads(m: Measurement) -> float:
    """The flow from which on the wall carries a ball, rad s-1."""
    return analytic.unloading_limit(m.parameters)


def _rides_or_sinks(m: Measurement) -> float:
    """NR where the wall carries a ball, else NS."""
    return float(Case.NR if m.parameters.omega_0 > _unloads(m) else Case.NS)


def _reads_flow(m: Measurement) -> float:
    """omega_0 within the reading range; beyond, that of slipping on the floor: less."""
    p = m.parameters
    within, reads = p.omega_0 < analytic.reading_range(p), float(solution_of(m).state.omega_c)
    if not within and (lifts_first(m) or (case_of(m) is not Case.NR and reads >= p.omega_0)):
        raise LookupError("beyond the range a ball on the floor lags")
    return p.omega_0 if within else reads


def _loop_case(m: Measurement) -> Case:
    """Case at a level of the loop: of the branch it comes from, or else of the other."""
    states = lasting_cases(m.parameters) - {Case.NS}
    lifted = m.at["before"] == Case.NR.name
    here = {case for case in states if (case is Case.NR) == lifted}
    if len(here or states) != 1:
        raise LookupError(f"no single state lasts at omega_0 = {m.parameters.omega_0:g}")
    return next(iter(here or states))


def _jumps(way: int) -> When:
    """A filter of levels of the loop: the ball was lifted (1), came down (-1), or neither."""
    return lambda m: (case_of(m) is Case.NR) - (m.at["before"] == Case.NR.name) == way


def _loop_reading(m: Measurement) -> float:
    """omega_c at a level of the hysteresis loop, in the case of `_loop_case`."""
    case = _loop_case(m)
    return next(float(s.state.omega_c) for s in solutions(m.parameters) if s.case is case)


def _does_not_sink(m: Measurement) -> bool:
    """Whether there is a flow, and the ball doesn't sink."""
    return m.parameters.omega_0 > 0 and case_of(m) is not Case.NS


def _simulated(m: Measurement) -> Trajectory:
    """Theory's motion from the state that was measured."""
    return simulated(m.parameters, state(m), m.at["duration"], 2000, rtol=RTOL)


def _end_case(m: Measurement) -> Case:
    """The case in which theory's motion ends."""
    return physical_case(Case(_simulated(m).case[-1]))


def _at_event(m: Measurement) -> Estimate:
    """A number at an event of theory's motion; LookupError if there is no such event."""
    run, event = _simulated(m), m.at["event"]
    if m.quantity == "lift":
        top = Estimate(float(run.y[-1]), 0.0) if event == "end" else first_top(run)
        return integrated(top.value, top.value, RTOL).also(reading=top.uncertainty)
    events = run.events
    changes = list(zip(map(Case, events.from_case), map(Case, events.to_case), strict=True))
    slips = [after.B is Contact.S for _, after in changes]
    lands = [before.A is Contact.N and after.A is not Contact.N for before, after in changes]
    happens = slips if event == "slip at B" else lands
    if not any(happens):
        raise LookupError("theory has no such event")
    time = float(events.time[happens.index(True)])
    # One landing may be several events at one time; the vertical impulse is that of all of them, at
    # both contacts.
    now = np.isclose(events.time, time, rtol=0.0, atol=math.ulp(1.0) * 1e3)
    impulse = float((events.impulse_A[now, 1] + events.impulse_B[now, 1]).sum())
    # A landing without restitution takes away all of the speed.
    speed = -impulse / m.parameters.m
    value = {"time": time, "landing_impulse": impulse, "landing_speed": speed}[m.quantity]
    return integrated(value, value, RTOL)


OFF = 0.05  # by how much, relatively, the friction of a meter may be off whose limits are claimed


def _nominal_friction(m: Measurement, off: float) -> dict[str, float]:
    """Nominal friction of a meter of which the ball is the worst case (best if off < 0).

    Less friction slips sooner; a rougher wall carries the ball sooner."""
    p = m.parameters
    return {"mu": p.mu / (1 - off), "eta": p.eta / (1 - off if slips_first(m) else 1 + off)}


def _one_end(m: Measurement) -> bool:
    """Whether one threshold ends the range of these meters at all their tolerances."""
    p, spread = m.parameters, (1 + OFF) / (1 - OFF)
    return not p.eta / spread < p.j < p.eta * spread


def _covered(m: Measurement, off: float) -> float:
    """The flow up to which a design covers a meter at worst, whose friction may be off."""
    nominal = _nominal_friction(m, off) if off else {}
    tolerances = dict.fromkeys(nominal, off)
    return design.choice(m.parameters.replace, nominal, tolerances, fastest=1.0).margin


def _end_of_spread(m: Measurement, end: int) -> float:
    """The lowest (end 0) or highest (1) threshold that a design gives for a tolerance."""
    nominal = _nominal_friction(m, (OFF, -OFF)[end])
    corners = list(design.corners(m.parameters.replace, nominal, dict.fromkeys(nominal, OFF)))
    return design.threshold_spread(corners)[m.quantity][end]


def _by_sensitivity(m: Measurement) -> float:
    """omega_02 from half the wall's friction, by the design's sensitivity to it."""
    p, half = m.parameters, {"eta": m.parameters.eta / 2}
    power = design.sensitivities(p.replace, half)["omega_02"]["eta"].value
    return analytic.thresholds(p.replace(**half)).omega_02 * 2**power


def _reading_of_design(m: Measurement) -> float:
    """The reading of a rising or falling flow, from the design's characteristic curve."""
    low, high = design.readings(m.parameters, m.parameters.omega_0)
    return float(low if m.at["side"] == "up" else high)


_ENDS_OF_RANGES = (("omega_01", slips_first), ("omega_02", lifts_first))
_DESIGN, _STABLE = "analytic.flowmeter.design", "analytic.stable_solutions"
_WITHIN_TOLERANCES: tuple[Callable[[Measurement], float], ...] = (
    partial(_covered, off=OFF),
    *(partial(_end_of_spread, end=k) for k in (0, 1)),
)
_settled, _thresholds, _unloading, _loop = (
    partial(Criterion, protocol)
    for protocol in ("settled", "thresholds", "unloading", "hysteresis")
)
CLAIMS = (
    claim(
        "slope-rolling",
        "Section 5.3",
        "Rolling at both points, or carried by the wall alone, the ball reads the flow: dω_c/dω₀ = "
        "1.",
        _slope("neighbours", _slope_at, "characteristic_slope", Case.RR, Case.NR),
    ),
    claim(
        "slope-slipping",
        "Section 5.3, (38), (41)",
        "While the ball slips at both points its reading rises by (38), (41), at first hardly at "
        "all.",
        _slope("neighbours", _slope_at, "characteristic_slope", Case.SS),
    ),
    claim(
        "slope-jump",
        "Section 5.3",
        "At ω₀₁ the slope of the characteristic curve jumps: from 1 to 0, as the equations have "
        "it.",
        _slope("jump", lambda m: analytic.slope_jump(m.parameters), "slope_jump", Case.SS),
    ),
    claim(
        "slope-mean",
        "Section 5.3",
        "Between ω₀₁ and ω₀₂ the characteristic curve has a small mean slope: a few hundredths for "
        "the reference.",
        _slope("mean", lambda m: analytic.mean_slope(m.parameters), "mean_slope", Case.SS),
    ),
    claim(
        "operating-range",
        "Section 5.3",
        "Up to ω₀₁ (η < j) rolling is the only motion that lasts, up to ω₀₂ for η > j. Beyond, "
        "from rest the ball slips (η < j), and on the wall it stays (η > j).",
        # Slipping on the floor no ball sinks.
        *(
            _settled("case", _only_rolling, when=all_of(*whens))
            for whens in ((from_floor, _does_not_sink, slips_first), (_does_not_sink, lifts_first))
        ),
        _settled("omega_c", _reads_flow, when=_does_not_sink),
        *(_thresholds(end, _range, when=first) for end, first in _ENDS_OF_RANGES),
        _thresholds(
            "lifts",
            lambda m: analytic.operating_limit(m.parameters).end is End.UNLOADING,
            when=lambda m: _range(m) > 0,
            by="analytic.operating_limit",
        ),
    ),
    claim(
        "unloading-limit",
        "Section 5.3, (85)",
        "The wall carries the ball at flows above ω₀₂, the limit at unloading; below, it slips and "
        "sinks.",
        _settled("case", _rides_or_sinks, when=given(start="on the wall")),
        _thresholds("omega_02", _unloads, when=given(side="from above"), by=_UNLOADS),
    ),
    claim(
        "fig-13-left",
        "Fig. 13, left",
        "For η < j the ball jumps up to ω₀ above ω₀₄, down below ω₀₂, and keeps to its branch in "
        "between.",
        *(_loop("case", _loop_case, when=_jumps(way), by=_STABLE) for way in (1, -1, 0)),
        _loop("omega_c", _loop_reading, by="(32), (38), (46)"),
        text=Text.CORRECTED,
        reason="Section 5.3 prints that the flow can be read again above ω₀₂; on the way up that "
        "is above ω₀₄.",
    ),
    claim(
        "fig-13-right",
        "Fig. 13, right; section 5.3",
        "Carried by the wall while ω₀ falls below ω₀₂, the ball slips, sinks, hits the floor, and "
        "ends slipping or rolling at both points.",
        _unloading("case", _end_case, when=given(start=UNLOADED), by=_SIMULATED),
        *(
            _unloading(quantity, _at_event, by=_SIMULATED)
            for quantity in ("time", "landing_speed", "landing_impulse")
        ),
    ),
    claim(
        "push",
        "section 5.3",
        "A small push lifts the ball from SR to NR, where it stays off the floor.",
        _unloading("case", _end_case, when=given(start=UPWARDS), by=_SIMULATED),
        _unloading("case", _end_case, when=given(start=BY_SPIN), by=_SIMULATED),
        _unloading("lift", _at_event, by=_SIMULATED),
    ),
    claim(
        "design-limit",
        "extension",
        "The operating range of a meter ends where its design says; with friction 5 % off its "
        "nominal value, at the lowest or the highest limit of that tolerance. ω₀₂ follows the "
        "wall's friction by the design's sensitivity.",
        *(
            _thresholds(end, partial(_covered, off=0), when=all_of(first, by_stokes), by=_DESIGN)
            for end, first in _ENDS_OF_RANGES
        ),
        *(
            _thresholds(end, predict, when=all_of(first, by_stokes, _one_end), by=_DESIGN)
            for end, first in _ENDS_OF_RANGES
            for predict in _WITHIN_TOLERANCES
        ),
        _thresholds("omega_02", _by_sensitivity, by=f"{_DESIGN}.sensitivities"),
    ),
    claim(
        "design-reading",
        "extension, Fig. 13",
        "Where a flow has several stable readings, the meter shows the lowest while the flow rises "
        "and the highest while it falls, as its design says.",
        _loop("omega_c", _reading_of_design, by=f"{_DESIGN}.readings"),
    ),
    claim(
        "time-constants",
        "Prop. 1, section 5.2",
        "The slowest disturbance of rolling dies out with the time constant that a design gives "
        "for a meter.",
        Criterion(
            "rates",
            "slowest_decay",
            lambda m: 1 / design.response_time(m.parameters),
            when=all_of(given(case="RR"), lambda m: m.parameters.drag != QUADRATIC),
            by=f"{_DESIGN}.response_time",
        ),
    ),
)
SECTIONS = {"Flowmeter": CLAIMS}
