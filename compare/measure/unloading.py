"""Balls that leave the wall or the floor: unloading at omega_02, and a push that lifts a ball (section 5.3).

A ball rides the wall a little above the floor while the flow is suddenly less than what holds it there: when does it
begin to slip, when does it land, how fast, with what impulse? And a ball that the wall carries beside the floor is
pushed, upwards or by a little more spin: does it stay off the floor, and how high? Every number is measured with two
time steps: an engine may follow motions with landings to first order only, and the difference is then the error of the
finer one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from compare.measure.lab import Lab, coarse_step
from compare.measure.levels import Level
from compare.measure.record import Condition, Measurement, Missing, Records, if_sure, measurement, state_of
from compare.measure.settling import Settled, begin, family, lasting, settle_groups
from compare.runs.tasks import Task
from compare.statistics import Measured, settled_case
from model import Parameters, State, Trajectory
from model.arrays import Array

PROTOCOL = "unloading"
LANDING, UNLOADED, UPWARDS, BY_SPIN = "unloading until it lands", "unloading", "push upwards", "push by spin"
"""Names of the trials."""
ABOVE, BELOW = 1.02, 0.95
"""Flows before and after the unloading, in units of the measured omega_02."""
LIFTED = 1.1
"""The flow of a ball that is to be pushed, in units of the larger of the flows that hold it on the wall and end rolling
by lifting."""
HEIGHT = 0.2
"""How high over the floor the ball rides, in units of R."""
PUSH = 1e-2
"""How hard it is pushed: speed over sqrt(g R), or more spin over its spin on the wall."""
REFINE = {Level.QUICK: (16, 32), Level.DEFAULT: (32, 64), Level.FULL: (64, 128)}
"""Time steps, as parts of the coarse one, of motions with a landing that counts; four times as long without."""
UNLOADING, SETTLING = 2.5, 6.0
"""Lengths of the runs in units of 1/c: of an unloading until after the landing, and of all others."""
ONSET = (1e-4, 1e-3)
"""Slip speeds over sqrt(g R) between which the onset of slip is looked for: it grows like the square of the time."""
BOUNCE = (5, 12)
"""Steps after a landing between which the ball must have come to rest on the floor."""


@dataclass(frozen=True, eq=False)
class Trial:
    """One motion: how it began, and the runs with both steps, the coarser first."""

    set: str
    name: str
    p: Parameters
    x0: Array
    steps: Sequence[float]
    tasks: Sequence[Task] = field(repr=False)


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Settle a ball on the wall of every set that carries it, and begin from there."""
    starts, trials = [], []
    for name, p in sets.items():
        if (limit := records.threshold(name, "omega_02")) is None:
            yield Missing(PROTOCOL, name, "no flow was measured that is the least to hold a ball on the wall")
            continue
        lifts = records.threshold(name, "omega_03") or limit
        flows = ABOVE * limit.value, LIFTED * max(limit.value, lifts.value)
        starts.append([begin(name, p.replace(omega_0=omega), "on the wall") for omega in flows])
    for states in settle_groups(lab, starts, loose=lab.effort("thresholds.loose")):
        for state, begun in zip(states, (_unloaded, _pushed), strict=True):
            if state.failure:
                yield Missing(PROTOCOL, state.start.set, f"no ball to begin with on the wall: {state.failure}")
            else:
                trials += [_trial(lab, state.start.set, *each) for each in begun(state)]
    yield from _rows(lab, trials)


Begun = Iterator[tuple[str, Parameters, State]]
"""Names of trials, parameters with the flow, and states."""


def _unloaded(state: Settled) -> Begun:
    p, x = state.start.p, State.of(state.mean)
    for name in (LANDING, UNLOADED):
        x0 = State(y=HEIGHT * p.R, omega_c=x.omega_c, slip_x=x.slip_x)
        yield name, p.replace(omega_0=p.omega_0 * BELOW / ABOVE), x0


def _pushed(state: Settled) -> Begun:
    p, x = state.start.p, State.of(state.mean)
    yield UPWARDS, p, State(v_y=PUSH * math.sqrt(p.g * p.R), omega_c=x.omega_c, slip_x=x.slip_x)
    spin = PUSH * (x.slip_x + p.R / p.r * x.omega_c)
    yield BY_SPIN, p, State(omega_c=x.omega_c, slip_x=x.slip_x + spin)


def _trial(lab: Lab, set: str, name: str, p: Parameters, x0: State) -> Trial:
    """Runs with both steps, sampled at every step where a landing is looked at."""
    landing = name == LANDING
    t_end = lasting(p, UNLOADING if landing else SETTLING)
    steps = [coarse_step(p) / (refine if landing else refine // 4) for refine in REFINE[lab.level]]
    tasks = [lab.task(p, x0, t_end, step, samples=round(t_end / step) if landing else 1000) for step in steps]
    return Trial(set, name, p, x0.stacked(), steps, tasks)


def _rows(lab: Lab, trials: Sequence[Trial]) -> Iterator[Measurement | Missing]:
    """Numbers of all trials; the step counts for each at least as much as for half of the trials."""
    measured: dict[tuple[str, str, str], list[tuple[Trial, float, float, float]]] = {}
    for trial, runs in zip(trials, lab.groups([trial.tasks for trial in trials]), strict=True):
        if trial.name != LANDING:
            coarse, fine = (family(settled_case(run)) for run in runs)
            if coarse is fine:
                yield _record(lab, trial, "case", fine)
            else:
                yield Missing(PROTOCOL, trial.set, f"{trial.name}: with half the time step the ball ends up otherwise")
        before, numbers = (_numbers(trial.name, run, step) for run, step in zip(runs, trial.steps, strict=True))
        if before.keys() != numbers.keys() or (trial.name == LANDING and not numbers):
            yield Missing(PROTOCOL, trial.set, f"{trial.name}: the ball does not slip and land")
            continue
        for key, (value, own) in numbers.items():
            measured.setdefault((trial.name, *key), []).append((trial, value, own, abs(before[key][0] / value - 1)))
    for (_, quantity, event), rows in measured.items():
        usual = float(np.median([change for *_, change in rows]))
        for trial, value, own, change in rows:
            sure = Measured(value, math.hypot(max(change, usual) * value, own))
            row = _record(lab, trial, quantity, sure, event=event)
            yield if_sure(row, abs(value), f"{trial.name}: {quantity} is uncertain by {row.uncertainty:.1g}")


def _record(lab: Lab, trial: Trial, quantity: str, value: Measured | float, **conditions: Condition) -> Measurement:
    begun: dict[str, Condition] = {"start": trial.name, **state_of(trial.x0), "duration": trial.tasks[0].t_end}
    return measurement(lab, PROTOCOL, trial.set, trial.p, quantity, value, trial.tasks, **(begun | conditions))


Numbers = dict[tuple[str, str], tuple[float, float]]
"""Value and own uncertainty by quantity and event."""


def _numbers(name: str, run: Trajectory, step: float) -> Numbers:
    """What a trial shows; of a push upwards, after which the ball falls on the floor first, how high it came first."""
    if name == LANDING:
        return _landed(run)
    if name == UPWARDS:
        return {("lift", "first top"): (first_top(run), 0.0)}
    # It leaves the floor at a step, up to one late or early, and rises so much less or more.
    late = step / 2 * float(run.v_y.max())
    return {("lift", "end"): (float(run.y[-1]), late)} if name == BY_SPIN else {}


def _landed(run: Trajectory) -> Numbers:
    """Onset of slip, and landing: time, speed and vertical impulse. Empty where it doesn't come to that."""
    p, step = run.header.parameters, float(run.time[1] - run.time[0])
    slip = run.slip_speed_B / math.sqrt(p.g * p.R)
    touches = np.flatnonzero(run.force_A[:, 1] > 0)
    growing = np.arange(*np.searchsorted(np.maximum.accumulate(slip), ONSET))
    if not len(touches) or not 1 < touches[0] < len(run.time) - BOUNCE[1] or len(growing) < 10:
        return {}
    onsets = [_zero(run.time[growing], np.sqrt(slip[growing]), degree) for degree in (2, 3)]
    k = int(touches[0]) - 1
    wait = float(run.y[k] / -run.v_y[k])
    v_y = float(run.v_y[k] + (run.v_y[k] - run.v_y[k - 1]) / step * wait)
    after = run.v_y[k + BOUNCE[0] : k + BOUNCE[1]]
    return {
        ("time", "slip at B"): (onsets[1], math.hypot(onsets[1] - onsets[0], step / math.sqrt(12))),
        ("time", "landing"): (float(run.time[k]) + wait, step / math.sqrt(12)),
        ("landing_speed", "landing"): (v_y, 0.0),
        ("landing_impulse", "landing"): (p.m * (float(after.mean()) - v_y), p.m * float(np.abs(after).max())),
    }


def _zero(time: Array, values: Array, degree: int) -> float:
    """When rising values would be zero: time as a polynomial of them."""
    return float(np.polynomial.Polynomial.fit(values, time, degree)(0.0))


def first_top(run: Trajectory) -> float:
    """Height in m at which v_y first falls to zero, between the samples as under constant acceleration."""
    k = int(np.argmax(run.v_y < 0))
    before, after = run.v_y[k - 1], run.v_y[k]
    wait = (run.time[k] - run.time[k - 1]) * before / (before - after)
    return float(run.y[k - 1] + before * wait / 2)
