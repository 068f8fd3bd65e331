"""A ball in a flow that changes once: small jumps up and down, and a ramp that passes the end of settled slipping.

Half the difference of two runs, after a jump up and one down, is free of what goes with the square of the jump. A ramp
starts from settled slipping well below the end of it, and ends well above; the ball has left slipping once it lags by
half as much as at first. Every number is measured with two time steps.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from compare.measure.lab import Lab, coarse_step
from compare.measure.levels import Level
from compare.measure.record import Measurement, Missing, Records, measurement, state_of, sure_enough
from compare.measure.settling import Settled, begin, lasting, settle
from compare.measure.trials import Start
from compare.runs.tasks import Task
from compare.statistics import Measured, peaks, top
from model import Case, Flow, Parameters, State, Trajectory
from model.arrays import Array
from model.drag import STOKES
from model.kinematics import SLIP_XYZ

PROTOCOL = "unsteady"
ROLLS = 0.85
"""Flow of the ball that rolls, over the one at which that ends."""
SLIPS, BEFORE, AFTER = 0.3, 0.75, 1.35
"""Flow of the ball that slips, from where slipping begins, 0, to where the wall holds a ball, 1; flows at which a ramp
begins and ends, from where slipping begins to where it ends."""
JUMP = 1e-3
"""Relative size of a jump."""
LASTS = 48.0
"""How long a jump is followed, in units of 1/c."""
SAMPLES = {"jump": 4000, "ramp": 16000}
RATES = {Level.QUICK: (1e-2,), Level.DEFAULT: (2.5e-3, 5e-3, 1e-2), Level.FULL: (1.25e-3, 2.5e-3, 5e-3, 1e-2)}
"""Rates of the ramps, in units of c times the range of slipping."""


@dataclass(frozen=True, eq=False)
class Trial:
    """A motion with both time steps, the coarser first: up and down after a jump, or along a ramp."""

    set: str
    p: Parameters
    x0: Array
    tasks: tuple[tuple[Task, ...], ...] = field(repr=False)
    rate: float = 0.0


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Start from rolling, and from settled slipping."""
    trials, starts = [], []
    for name, p in sets.items():
        begins, holds, ends = (_flow(records, name, f"omega_0{n}") for n in (1, 2, 4))
        if begins is None or holds is None:
            yield Missing(PROTOCOL, name, "no flows were measured between which the ball slips at both points")
            continue
        if p.drag == STOKES:  # with others there is no delay that all small jumps share
            q = p.replace(omega_0=ROLLS * begins)
            trials.append(_jump(lab, name, q, begin(name, q, "with the fluid").x0))
        flows = [("jump", begins + SLIPS * (holds - begins))]
        if ends is None:
            yield Missing(PROTOCOL, name, "no flow was measured at which slipping at both points ends in a jump")
        else:
            flows += [("ramp", begins + BEFORE * (ends - begins))]
        starts += [(kind, begins, ends, Start(name, p.replace(omega_0=w), kind, np.zeros(8))) for kind, w in flows]
    for (kind, begins, ends, start), state in zip(starts, settle(lab, [s for *_, s in starts]), strict=True):
        if state.failure or state.case is not Case.SS:
            yield Missing(PROTOCOL, start.set, f"no settled slipping to start from: {state.failure or state.case.name}")
        elif kind == "jump":
            trials.append(_jump(lab, start.set, start.p, _on_floor(state)))
        elif ends is not None:
            trials += [_ramp(lab, state, begins, ends, rate) for rate in RATES[lab.level]]
    lab.complete([task for trial in trials for pair in trial.tasks for task in pair])
    for trial in trials:
        yield from (_left if trial.rate else _jumped)(lab, trial)


def _flow(records: Records, name: str, quantity: str) -> float | None:
    return next((m.value for m in records.select("thresholds", quantity, lambda m: m.set == name)), None)


def _jump(lab: Lab, name: str, p: Parameters, x0: Array) -> Trial:
    jumped, t_end = [p.replace(omega_0=p.omega_0 * (1 + side * JUMP)) for side in (1, -1)], lasting(p, LASTS)
    tasks = tuple(
        tuple(lab.task(q, x0, t_end, coarse_step(p) / refine, samples=SAMPLES["jump"]) for q in jumped)
        for refine in (2, 4)
    )
    return Trial(name, p, x0, tasks)


def _ramp(lab: Lab, state: Settled, begins: float, ends: float, rate: float) -> Trial:
    p, rise = state.start.p, rate * state.start.p.c * (ends - begins)
    target = begins + AFTER * (ends - begins)
    t_end = (target - p.omega_0) / rise
    flow, x0 = Flow.ramp(p.omega_0, target, t_end), _on_floor(state)
    tasks = tuple(
        (lab.task(p, x0, t_end, coarse_step(p) / refine, flow=flow, samples=SAMPLES["ramp"]),) for refine in (1, 2)
    )
    return Trial(state.start.set, p, x0, tasks, rise)


def _on_floor(state: Settled) -> Array:
    """Its mean state, on the floor and at the wall to the last digit."""
    return State.of(state.mean)._replace(y=0.0, v_y=0.0, h=0.0, v_h=0.0).stacked()


def _jumped(lab: Lab, trial: Trial) -> Iterator[Measurement | Missing]:
    """Delay of a ball that rolls; time and height of the peak of one that slips, if there is one."""
    answers = []
    for pair in trial.tasks:
        up, down = lab.run(pair)
        answers.append(_answer(up, down))
    case, known = ("RR", ("jump_delay",)) if not trial.x0[SLIP_XYZ].any() else ("SS", ("jump_peak", "jump_height"))
    for name in known:
        coarse, fine = (answer[name] for answer in answers)
        # Forces act in the middle of a step: a moment is known to half of the finer one, either way.
        late = 0.0 if name == "jump_height" else coarse_step(trial.p) / 4 / math.sqrt(12)
        value = Measured(fine, math.hypot(fine - coarse, late))
        if np.isfinite(fine) and sure_enough(name, value, abs(fine)):
            yield measurement(lab, PROTOCOL, trial.set, trial.p, name, value, trial.tasks[-1], case=case)
        else:
            yield Missing(PROTOCOL, trial.set, f"{name} in {case}: no peak, or one that is too uncertain")


def _answer(up: Trajectory, down: Trajectory) -> dict[str, float]:
    """What the part of omega_c shows that has the sign of the jump: 0 at first, 1 in the end."""
    t, odd = up.time, up.omega_c - down.omega_c
    y = odd / odd[-1]
    k, late = peaks(y)
    peak = {"jump_peak": np.nan, "jump_height": np.nan}
    if 0 < (first := int(y.argmax())) < len(t) // 2:
        k, late = k[k == first], late[k == first]
        at, height = t[k] + late * (t[1] - t[0]), top(y, k, late)
        peak = {"jump_peak": float(at[0]), "jump_height": float(height[0])}
    return peak | {"jump_delay": float(np.trapezoid(1 - y, t))}


def _left(lab: Lab, trial: Trial) -> Iterator[Measurement | Missing]:
    """The flow at which the ball has caught up."""
    coarse, fine = (caught_up(lab.run([task])[0]) for (task,) in trial.tasks)
    value = Measured(fine, abs(fine - coarse))
    if np.isfinite(fine):
        at = {"rate": trial.rate} | state_of(trial.x0[:6])
        yield measurement(lab, PROTOCOL, trial.set, trial.p, "ramp_end", value, trial.tasks[-1], **at)
    else:
        yield Missing(PROTOCOL, trial.set, f"a ramp of {trial.rate:.3g} rad/s^2 doesn't end slipping at both points")


def caught_up(run: Trajectory) -> float:
    """The flow in rad s-1 at which the lag has fallen to half of what it was at first; nan if it never does."""
    lag = run.header.flow(run.time) - run.omega_c
    below = np.flatnonzero(lag < lag[0] / 2)
    if not len(below):
        return np.nan
    near = slice(below[0], below[0] - 2, -1)
    return float(run.header.flow(np.interp(lag[0] / 2, lag[near], run.time[near])))
