"""Balls that leave the wall or the floor: unloading at omega_02, and a push that lifts a ball (section 5.3).

A ball rides the wall a little above the floor while the flow is suddenly less than what holds it there: when does it
begin to slip, when does it land, how fast, with what impulse? And a ball that the wall carries beside the floor is
pushed, upwards or by a little more spin: does it stay off the floor, and how high? An engine may follow motions with
landings to first order only.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np
from numpy.polynomial import Polynomial

from compare.kit.lab import Lab, coarse_step
from compare.kit.record import Condition, Measurement, Missing, Records, if_sure, state_of
from compare.kit.settling import Settled, begin, family, lasting, settle_groups
from compare.kit.statistics import Measured, settled_case
from compare.kit.trials import Result, Trial, carry_out
from model import Case, Parameters, State, Trajectory

PROTOCOL = "unloading"
LANDING, UNLOADED, UPWARDS, BY_SPIN = "unloading until it lands", "unloading", "push upwards", "push by spin"
"""Names of the trials."""
ABOVE, BELOW = 1.02, 0.95
"""Flows before and after the unloading, in units of the measured omega_02."""
PUSH = 1e-2
"""How hard a ball is pushed: speed in units of sqrt(g R), or more spin in units of its spin on the wall."""
Numbers = dict[tuple[str, str], Measured]
"""What a run shows, by quantity and event."""


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Settle a ball on the wall of every set that carries it, and begin from there."""
    starts, trials = [], []
    for name, p in sets.items():
        if (limit := records.threshold(name, "omega_02")) is None:
            yield Missing(PROTOCOL, name, "no flow was measured that is the least to hold a ball on the wall")
            continue
        # A pushed ball must neither sink nor roll again: the flow is above the end of rolling by lifting, too.
        lifts = records.threshold(name, "omega_03") or limit
        flows = ABOVE * limit.value, 1.1 * max(limit.value, lifts.value)
        starts.append([begin(name, p.replace(omega_0=omega), "on the wall") for omega in flows])
    for states in settle_groups(lab, starts, loose=lab.effort("thresholds.loose")):
        for state, names in zip(states, ((LANDING, UNLOADED), (UPWARDS, BY_SPIN)), strict=True):
            if state.failure:
                yield Missing(PROTOCOL, state.start.set, f"no ball to begin with on the wall: {state.failure}")
            else:
                trials += [_trial(lab, state, name) for name in names]
    measured: dict[tuple[str, str, str], list[tuple[Result, Measured, float]]] = {}
    for result in carry_out(lab, PROTOCOL, trials):
        if isinstance(result, Missing):
            yield result
            continue
        name, (before, coarse), (case, numbers) = result.trial.name, result.coarse, result.fine
        if name != LANDING and before is case:
            yield result.row(lab, "case", case)
        elif name != LANDING:
            yield Missing(PROTOCOL, result.trial.set, f"{name}: with half the time step the ball ends up otherwise")
        if coarse.keys() != numbers.keys() or (name == LANDING and not numbers):
            yield Missing(PROTOCOL, result.trial.set, f"{name}: the ball does not slip and land")
            continue
        for key, fine in numbers.items():
            change = abs(coarse[key].value / fine.value - 1)
            measured.setdefault((name, *key), []).append((result, fine, change))
    for (name, quantity, event), rows in measured.items():
        # The difference may be small by chance: it counts at least as much as in half of the trials.
        usual = float(np.median([change for *_, change in rows]))
        for result, fine, change in rows:
            value = Measured(fine.value, math.hypot(max(change, usual) * fine.value, fine.uncertainty))
            row = result.row(lab, quantity, value, event=event)
            yield if_sure(row, abs(row.value), f"{name}: {quantity} is uncertain by {row.uncertainty:.1g}")


def _trial(lab: Lab, state: Settled, name: str) -> Trial:
    """A trial from a ball that rides the wall; one that lands is sampled at every step."""
    p, x = state.start.p, State.of(state.mean)
    x0 = State(omega_c=x.omega_c, slip_x=x.slip_x)
    if name in (LANDING, UNLOADED):
        p, x0 = p.replace(omega_0=p.omega_0 * BELOW / ABOVE), x0._replace(y=0.2 * p.R)
    elif name == UPWARDS:
        x0 = x0._replace(v_y=PUSH * math.sqrt(p.g * p.R))
    else:
        x0 = x0._replace(slip_x=x.slip_x + PUSH * (x.slip_x + p.R / p.r * x.omega_c))
    refine = tuple(times if name == LANDING else times // 4 for times in lab.effort("unloading.refine"))
    t_end, step = lasting(p, 2.5 if name == LANDING else 6.0), coarse_step(p) / refine[1]

    def read(run: Trajectory) -> tuple[Case, Numbers]:
        numbers: Numbers = {}
        if name == LANDING:
            numbers = _landed(run)
        elif name == UPWARDS:  # it falls on the floor soon after
            numbers = {("lift", "first top"): Measured(first_top(run), 0.0)}
        elif name == BY_SPIN:  # it leaves the floor at a step, up to one late or early, and rises so much less or more
            numbers = {("lift", "end"): Measured(float(run.y[-1]), step / 2 * float(run.v_y.max()))}
        return family(settled_case(run)), numbers

    known: dict[str, Condition] = {"start": name, **state_of(x0.stacked()), "duration": t_end}
    samples = None if name == LANDING else 1000
    return Trial(state.start.set, p, name, x0.stacked(), t_end, refine, samples, read, conditions=known)


def _landed(run: Trajectory) -> Numbers:
    """Onset of slip, and landing: time, speed and vertical impulse. Empty where it doesn't come to that."""
    p, step = run.header.parameters, float(run.time[1] - run.time[0])
    slip = run.slip_speed_B / math.sqrt(p.g * p.R)
    touches = np.flatnonzero(run.force_A[:, 1] > 0)
    # Slip grows like the square of the time: its onset is extrapolated from speeds that are neither noise nor large.
    growing = np.arange(*np.searchsorted(np.maximum.accumulate(slip), (1e-4, 1e-3)))
    if not len(touches) or not 1 < touches[0] < len(run.time) - 12 or len(growing) < 10:
        return {}
    quadratic, cubic = (
        float(Polynomial.fit(np.sqrt(slip[growing]), run.time[growing], degree)(0.0)) for degree in (2, 3)
    )
    k = int(touches[0]) - 1
    wait = float(run.y[k] / -run.v_y[k])
    v_y = float(run.v_y[k] + (run.v_y[k] - run.v_y[k - 1]) / step * wait)
    rest = run.v_y[k + 5 : k + 12]  # by then it must have come to rest on the floor
    return {
        ("time", "slip at B"): Measured(cubic, math.hypot(cubic - quadratic, step / math.sqrt(12))),
        ("time", "landing"): Measured(float(run.time[k]) + wait, step / math.sqrt(12)),
        ("landing_speed", "landing"): Measured(v_y, 0.0),
        ("landing_impulse", "landing"): Measured(p.m * (float(rest.mean()) - v_y), p.m * float(np.abs(rest).max())),
    }


def first_top(run: Trajectory) -> float:
    """Height in m at which v_y first falls to zero, between the samples as under constant acceleration."""
    k = int(np.argmax(run.v_y < 0))
    before, after = run.v_y[k - 1], run.v_y[k]
    wait = (run.time[k] - run.time[k - 1]) * before / (before - after)
    return float(run.y[k - 1] + before * wait / 2)
