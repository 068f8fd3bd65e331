"""Settled states: where the ball ends from fixed starts at fixed flows, with the forces that mechanics determine.

Flows are the same multiples of sqrt(g/R) for every set. States are measured with the coarse step, and once more with
half of it: what that changes belongs to their uncertainty, as does what different starts make of the same state.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

from compare.kit.lab import Lab, time_unit
from compare.kit.programme import FOUR, ONE, Protocol
from compare.kit.record import Measurement, Missing, Records, measurement
from compare.kit.settling import ERROR_GROUPS, SPIN, Settled, begin, duration, family, scale, settle
from compare.kit.statistics import Measured
from compare.kit.trials import Start
from model import Parameters, State
from model.drag import QUADRATIC

PROTOCOL = "settled"
MIRRORED = ("rest", 0.62), ("rest", 1.4), ("on the wall", 4.2)
"""Starts and flows, in units of sqrt(g/R), of those that are measured the other way round, too."""


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """The case that every start ends in, and once for every distinct state its values.

    Starts are at rest, going round with the fluid, and so high up on the wall; and spinning in a fluid at rest. Engines
    beside the one on trial don't start at rest.
    """
    sharp, starts = lab.effort("settled.sharp"), []
    for name, p in sets.items():
        for how, flows in lab.effort("settled.starts").items():
            starts += [begin(name, p.replace(omega_0=flow / time_unit(p)), how) for flow in flows]
        spinning = State(slip_y=SPIN / time_unit(p) * p.R / p.r)
        starts.append(Start(name, p.replace(omega_0=0.0), "spinning", spinning.stacked()))
    ended = settle(lab, starts, sharp=sharp, loose=lab.effort("settled.loose"))
    groups: dict[tuple[str, float, int], list[Settled]] = {}
    without: dict[tuple[str, float, int], Missing] = {}
    for state in ended:
        p, named = state.start.p, f"{state.case.name} at omega_0 = {state.start.p.omega_0:.4g} rad/s"
        key = state.start.set, p.omega_0, int(family(state.case))
        if state.failure:
            yield _unsettled(state, 1)
            without[key] = Missing(PROTOCOL, state.start.set, f"{named}: no values of it", len(state.values))
            continue
        yield _record(lab, state, "case", state.case)
        rate = p.c  # at which the fluid would stop a free ball: in proportion to the lag under the quadratic law
        if p.drag == QUADRATIC:
            _, v_y, omega_c, *_ = state.mean.tolist()
            Re = 2 * p.r / p.nu_f * math.hypot(v_y, p.R * (omega_c - p.omega_0))
            rate *= p.C_D / 24 * Re
        if rate * duration(p) < 10:  # a round lasts too few of the times in which the fluid would stop a free ball
            why = f"{named}: quadratic drag fades with the lag, so that a small lag hardly dies out"
            without[key] = Missing(PROTOCOL, state.start.set, why, len(state.values))
        else:
            groups.setdefault(key, []).append(state)
    yield from (each for key, each in without.items() if key not in groups)
    alike = [groups[key] for key in sorted(groups)]
    again = []  # with half the step, from the mean, at the height from which it started
    for state, *_ in alike:
        x0 = State.of(state.mean)._replace(y=max(State.of(state.start.x0).y, 0.0))
        again.append(replace(state.start, x0=x0.stacked()))
    # With several time steps the limit is extrapolated from all of them, and half the step isn't needed here.
    refined = settle(lab, again, refine=2, span=20.0, sharp=sharp) if not lab.beside else [same for same, *_ in alike]
    for same, fine in zip(alike, refined, strict=True):
        if fine.failure:
            yield _unsettled(fine, len(fine.values))
        elif family(fine.case) is not family(same[0].case):
            at = f"omega_0 = {fine.start.p.omega_0:.4g} rad/s"
            why = f"{same[0].case.name} at {at} is {fine.case.name} with half the time step"
            yield Missing(PROTOCOL, fine.start.set, why, len(fine.values))
        else:
            for (
                group
            ) in ERROR_GROUPS:  # what step and start change is added to the uncertainty, the largest in the group
                sizes = {n: scale(n, fine.start.p) for n in group if all(n in each.values for each in (fine, *same))}
                changes = [abs(s.values[n].value - fine.values[n].value) / sizes[n] for s in same for n in sizes]
                for n, size in sizes.items():
                    uncertainty = math.hypot(fine.values[n].uncertainty, max(changes) * size)
                    yield _record(lab, fine, n, Measured(fine.values[n].value, uncertainty))


def mirrored(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Case and values to which a ball settles in a flow the other way round."""
    starts = [
        begin(name, p.replace(omega_0=-flow / time_unit(p)), how) for name, p in sets.items() for how, flow in MIRRORED
    ]
    for state in settle(lab, starts):
        if state.failure:
            yield _unsettled(state, 1 + len(state.values), "mirrored")
            continue
        yield _record(lab, state, "case", state.case, "mirrored")
        for quantity, value in state.values.items():
            yield _record(lab, state, quantity, value, "mirrored")


def _unsettled(each: Settled, rows: int, protocol: str = PROTOCOL) -> Missing:
    """That a start did not settle, and what it did last."""
    p = each.start.p
    at = f"omega_0 = {p.omega_0:.4g} rad/s (mu = {p.mu:.4g}, eta = {p.eta:.4g})"
    return Missing(protocol, each.start.set, f"not settled at {at} (start: {each.start.name}): {each.failure}", rows)


def _record(lab: Lab, each: Settled, quantity: str, value: Measured | float, protocol: str = PROTOCOL) -> Measurement:
    start, at = each.start, {"case": each.case.name, "start": each.start.name}
    return measurement(lab, protocol, start.set, start.p, quantity, value, [each.task], **at)


PROTOCOLS = (
    Protocol("settled", measure, plain=FOUR, steps=(4, 4), defaults=ONE, cost=11),
    Protocol("mirrored", mirrored, quick=ONE),
)
