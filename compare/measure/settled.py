"""Settled states: where the ball ends from fixed starts at fixed flows, with the forces that mechanics determine.

Flows are the same multiples of sqrt(g/R) for every set. States are measured with the coarse step, and once more with
half of it: what that changes belongs to their uncertainty, as does what different starts make of the same state. Beside
them stands the engine as it comes: the characteristic curve with its own contact parameters, for display.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import groupby

from compare.measure.lab import Lab, time_unit
from compare.measure.levels import Level
from compare.measure.record import Measurement, Missing, Records, measurement
from compare.measure.settling import GROUPS, Settled, begin, duration, family, judged, scale, settle
from compare.measure.trials import Start
from compare.runs import engines
from compare.statistics import Measured
from model import Parameters, State
from model.drag import QUADRATIC

PROTOCOL = "settled"
QUICK = (0.43, 0.62, 0.9, 1.13, 1.4, 1.7, 2.05, 2.5, 3.1, 4.2)
DEFAULT = tuple(sorted((*QUICK, 0.51, 0.75, 1.02, 1.26, 1.53, 1.87, 2.27, 2.78, 3.43, 3.8)))
"""Flows, omega_0 sqrt(R/g)."""
SPIN = 1.0
"""Spin slip_y of a ball in a fluid at rest, in units of sqrt(g/R) R/r."""
SHARP = {Level.QUICK: 1.0, Level.DEFAULT: 0.1, Level.FULL: 0.1}
"""How much less than it may a state is to drift, if it can be had."""
LIVELY = 10.0
"""How many times within a round the fluid would stop a free ball in a state whose values count."""
REFINED = 20.0
"""Length of a round with half the step, in units of 1/c: it goes out from a settled state."""
STEP, SAMPLES = 1e-3, 1000
"""Time step of the engine as it comes, s, and samples of a run of 40/c."""


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """The case that every start ends in, and once for every distinct state its values."""
    sharp = SHARP[lab.level]
    ended = settle(lab, [start for name, p in sets.items() for start in _starts(name, p, lab.level)], sharp=sharp)
    yield from _unsettled(ended)
    good = [state for state in ended if not state.failure]
    for state in good:
        yield _record(lab, state, "case", state.case)
    slack = [state for state in good if _stopping_rate(state) * duration(state.start.p) < LIVELY]
    for state in slack:
        what = f"{state.case.name} at omega_0 = {state.start.p.omega_0:.4g} rad/s"
        yield Missing(PROTOCOL, state.start.set, f"{what}: a slight lag is one for ever under the quadratic law")
    sure = sorted((state for state in good if state not in slack), key=_key)
    alike = [list(same) for _, same in groupby(sure, key=_key)]
    refined = settle(lab, [_again(same[0]) for same in alike], refine=2, span=REFINED, sharp=sharp)
    yield from _unsettled(refined)
    for same, fine in zip(alike, refined, strict=True):
        if not fine.failure and family(fine.case) is family(same[0].case):
            for quantity, value in _combined(fine, same).items():
                yield _record(lab, fine, quantity, value)


def newcomer(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """omega_c and case from rest with the engine's own contact parameters, with what they drift or swing by the end."""
    protocol, name, p = "newcomer", "reference", sets["reference"]
    if not lab.engine.as_it_comes:
        yield Missing(protocol, name, f"{lab.engine.name} has no settings of its own to be compared with")
        return
    plain = replace(lab, engine=engines.engine(lab.engine.as_it_comes))
    starts = [begin(name, q, "rest") for q in _flows(p, lab.level)]
    tasks = [plain.task(start.p, start.x0, 40.0 / p.c, STEP, samples=SAMPLES) for start in starts]
    for start, task, run in zip(starts, tasks, plain.each(tasks), strict=True):
        if isinstance(run, str):
            yield Missing(protocol, name, f"the run at {start.p.omega_0:.4g} rad/s {run}")
            continue
        ended = judged(start, task, run)
        at = {"case": ended.case.name, "start": start.name}
        for quantity, value in (("omega_c", ended.values["omega_c"]), ("case", ended.case)):
            yield measurement(plain, protocol, name, start.p, quantity, value, [task], **at)


def _flows(p: Parameters, level: Level) -> list[Parameters]:
    """A set at the flows of a level."""
    return [p.replace(omega_0=flow / time_unit(p)) for flow in (QUICK if level is Level.QUICK else DEFAULT)]


def _starts(name: str, p: Parameters, level: Level) -> Iterator[Start]:
    """From rest, going round with the fluid, and so high up on the wall; spinning where the fluid rests."""
    for q in _flows(p, level):
        for how in ("rest", "with the fluid", "on the wall"):
            yield begin(name, q, how)
    spinning = State(slip_y=SPIN / time_unit(p) * p.R / p.r)
    yield Start(name, p.replace(omega_0=0.0), "spinning", spinning.stacked())


def _unsettled(states: Sequence[Settled]) -> Iterator[Missing]:
    """Those that did not settle, each with what it did last."""
    for each in states:
        if each.failure:
            p = each.start.p
            at = f"omega_0 = {p.omega_0:.4g} rad/s (mu = {p.mu:.4g}, eta = {p.eta:.4g})"
            yield Missing(PROTOCOL, each.start.set, f"not settled from {each.start.name} at {at}: {each.failure}")


def _combined(fine: Settled, coarse: Sequence[Settled]) -> dict[str, Measured]:
    """The values with half the step; by group, what step and start change is added to their uncertainty."""
    values: dict[str, Measured] = {}
    p = fine.start.p
    for group in GROUPS:
        alike = [q for q in group if q in fine.values and all(q in each.values for each in coarse)]
        changes = [abs(each.values[q].value - fine.values[q].value) / scale(q, p) for each in coarse for q in alike]
        change = max(changes, default=0.0)
        for q in alike:
            own = fine.values[q]
            values[q] = Measured(own.value, math.hypot(own.uncertainty, change * scale(q, p)))
    return values


def _stopping_rate(each: Settled) -> float:
    """At what rate the fluid would stop a free ball, s-1: c, but in proportion to the lag under the quadratic law."""
    p, (_, v_y, omega_c, *_) = each.start.p, each.mean.tolist()
    if p.drag != QUADRATIC:
        return p.c
    Re = 2 * p.r / p.nu_f * math.hypot(v_y, p.R * (omega_c - p.omega_0))
    return p.c * p.C_D / 24 * Re


def _key(each: Settled) -> tuple[str, float, int]:
    return each.start.set, each.start.p.omega_0, int(family(each.case))


def _again(each: Settled) -> Start:
    height = max(State.of(each.start.x0).y, 0.0)
    return replace(each.start, x0=State.of(each.mean)._replace(y=height).stacked())


def _record(lab: Lab, each: Settled, quantity: str, value: Measured | float) -> Measurement:
    start, at = each.start, {"case": each.case.name, "start": each.start.name}
    return measurement(lab, PROTOCOL, start.set, start.p, quantity, value, [each.task], **at)
