"""Settled states: where balls end from fixed starts at fixed flows, and their forces.

Flows are the same multiples of sqrt(g/R) for every set. States are measured with the coarse step,
and once more with half of it: what that changes belongs to their uncertainty, as does what
different starts make of the same state."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from compare.method import settling
from compare.method.conditions import Conditions
from compare.method.protocol import Protocol
from compare.method.quantities import quantity
from compare.method.record import Measured, Measurement, Missing, Records, Sets
from compare.method.runner import Runner
from compare.method.scales import time_unit
from compare.method.settling import SettlingCriteria, SteadyState
from compare.method.statistics import Estimate
from compare.method.step_pairs import Start, unlike
from model import Case, State
from model.drag import QUADRATIC


def measure(runner: Runner, sets: Sets, records: Records) -> Measured:
    """The case that every start ends in, and once for every distinct state its values."""
    sharp, starts = runner.sampling.settled_sharp, []
    for name, p in sets.items():
        for how, flows in runner.sampling.settled_starts:
            starts += settling.starts_at(name, p, how, [flow / time_unit(p) for flow in flows])
        spinning = State(slip_y=settling.SPIN / time_unit(p) * p.R / p.r)
        starts.append(Start(name, p.replace(omega_0=0.0), "spinning", spinning.stacked()))
    alike: dict[Attractor, list[SteadyState]] = {}
    without: dict[Attractor, Missing] = {}
    criteria = SettlingCriteria(sharp=sharp, loose=runner.sampling.settled_loose)
    for state in settling.settle(runner, starts, criteria):
        if state.failure:
            yield _unsettled(runner, state, 1)
        else:
            yield _row(runner, state, "case", state.case)
        if why := "no values of it" if state.failure else _why_drag_fades(state):
            why = f"{state.case.name} at omega_0 = {state.start.p.omega_0:.4g} rad/s: {why}"
            without[Attractor.of(state)] = runner.missing(state.start.set, why, len(state.values))
        else:
            alike.setdefault(Attractor.of(state), []).append(state)
    yield from (each for kind, each in without.items() if kind not in alike)
    groups = [alike[kind] for kind in sorted(alike)]
    # With several time steps the limit is extrapolated from all of them, and half the step isn't
    # needed here.
    firsts = [state for state, *_ in groups]
    refined = settling.settle_finer(runner, firsts, SettlingCriteria(span=20.0, sharp=sharp))
    for same, fine in zip(groups, refined, strict=True):
        yield from _values(runner, same, fine)


@dataclass(frozen=True, order=True)
class Attractor:
    """What starts have in common that come to one state."""

    set: str
    omega_0: float
    case: Case

    @classmethod
    def of(cls, state: SteadyState) -> Self:
        """The attractor of a settled state."""
        return cls(state.start.set, state.start.p.omega_0, settling.physical_case(state.case))


def _why_drag_fades(state: SteadyState) -> str:
    """Why drag fades as the ball settles; empty if it doesn't, in a round of 10/c."""
    p = state.start.p
    if p.drag != QUADRATIC:
        return ""
    mean = State.of(state.mean)
    Re = 2 * p.r / p.nu_f * math.hypot(mean.v_y, p.R * (mean.omega_c - p.omega_0))
    rate = p.c * (p.C_D / 24 * Re)  # at which the fluid would stop a free ball
    if rate * settling.duration(p) >= 10:
        return ""
    return "quadratic drag fades with the lag, so that a small lag hardly dies out"


def _values(runner: Runner, same: Sequence[SteadyState], fine: SteadyState) -> Measured:
    """Values of a settled state with half the step; uncertain by step and start."""
    p, divisor = fine.start.p, runner.sampling.settled_divisor
    if why := settling.not_found_again(same[0], fine):
        yield _unsettled(runner, replace(fine, failure=why), len(fine.values))
        return
    for group in settling.ERROR_GROUPS:
        shown = [n for n in group if all(n in each.values for each in (fine, *same))]
        sizes = [quantity(n).size(p) for n in shown]
        off = [max(abs(s.values[n].value - fine.values[n].value) for s in same) for n in shown]
        for n, size, change in zip(shown, sizes, unlike(np.divide(off, sizes)), strict=True):
            sure = settling.with_changes(fine.values[n], float(change) * size, p, size, divisor)
            yield _row(runner, fine, n, sure)


def mirrored(runner: Runner, sets: Sets, records: Records) -> Measured:
    """Case and values to which a ball settles in a flow the other way round."""
    starts = [
        settling.initial_condition(name, p.replace(omega_0=-flow / time_unit(p)), how)
        for name, p in sets.items()
        for how, flow in (("rest", 0.62), ("rest", 1.4), ("on the wall", 4.2))
    ]
    settled = []
    for state in settling.settle(runner, starts):
        if state.failure:
            yield _unsettled(runner, state, 1 + len(state.values))
            continue
        yield _row(runner, state, "case", state.case)
        if why := _why_drag_fades(state):
            yield _unsettled(runner, replace(state, failure=why), len(state.values))
        else:
            settled.append(state)
    for state, fine in zip(settled, settling.settle_finer(runner, settled), strict=True):
        yield from _values(runner, [state], fine)


def _unsettled(runner: Runner, each: SteadyState, rows: int) -> Missing:
    """A record of a start from which the ball did not settle, and of what it did last."""
    p = each.start.p
    at = f"omega_0 = {p.omega_0:.4g} rad/s (mu = {p.mu:.4g}, eta = {p.eta:.4g})"
    why = f"not settled at {at} (start: {each.start.name}): {each.failure}"
    return runner.missing(each.start.set, why, rows)


def _row(runner: Runner, each: SteadyState, name: str, value: Estimate | float) -> Measurement:
    """The measurement of a quantity, by its name, of a settled state."""
    start, at = each.start, Conditions(case=each.case.name, start=each.start.name)
    return runner.measurement(start.set, start.p, name, value, [each.task], **at)


PROTOCOLS = (Protocol("settled", measure), Protocol("mirrored", mirrored))
