"""A ball in a flow that changes once: small jumps up and down, and a ramp that passes the end of settled slipping.

Half the difference of two runs, after a jump up and one down, is free of what goes with the square of the jump. A ramp
starts from settled slipping well below the end of it, and ends well above; the ball has left slipping once it lags by
half as much as at first.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

import numpy as np

from compare.kit.lab import Lab, coarse_step
from compare.kit.record import Measurement, Missing, Records, if_sure, state_of
from compare.kit.settling import lasting, settle
from compare.kit.statistics import Measured, peaks, top
from compare.kit.trials import Start, Trial, carry_out, finer, known_flow
from model import Case, Flow, Parameters, State, Trajectory
from model.arrays import Array
from model.drag import STOKES

PROTOCOL = "unsteady"
JUMP = 1e-3
"""Relative size of a jump."""
SHOWS = {"RR": ("jump_delay",), "SS": ("jump_peak", "jump_height"), "ramp": ("ramp_end",)}
"""What is measured: after a jump, by the case of the ball before it, and along a ramp."""


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Delay, peak and height after a jump, from rolling and from settled slipping; the flow at which a ramp ends it."""
    trials: list[Trial] = []
    starts: list[tuple[tuple[float, float] | None, Start]] = []
    for name, p in sets.items():
        begins, holds, ends = (known_flow(records, name, f"omega_0{n}") for n in (1, 2, 4))
        if begins is None or holds is None:
            yield Missing(PROTOCOL, name, "no flows were measured between which the ball slips at both points")
            continue
        if p.drag == STOKES:  # with others there is no delay that all small jumps share
            q = p.replace(omega_0=0.85 * begins)
            trials.append(_jump(name, q, Case.RR, State(omega_c=q.omega_0)))
        starts.append((None, Start(name, p.replace(omega_0=begins + 0.3 * (holds - begins)), "jump", np.zeros(8))))
        if ends is None:
            yield Missing(PROTOCOL, name, "no flow was measured at which slipping at both points ends in a jump")
        else:
            span = ends - begins
            first = p.replace(omega_0=begins + 0.75 * span)
            starts.append(((span, begins + 1.35 * span), Start(name, first, "ramp", np.zeros(8))))
    for (ramp, start), state in zip(starts, settle(lab, [start for _, start in starts]), strict=True):
        if state.failure or state.case is not Case.SS:
            yield Missing(PROTOCOL, start.set, f"no settled slipping to start from: {state.failure or state.case.name}")
            continue
        x0 = State.of(state.mean)._replace(y=0.0, v_y=0.0, h=0.0, v_h=0.0)  # at both walls to the last digit
        if ramp is None:
            trials.append(_jump(start.set, start.p, Case.SS, x0))
        else:
            trials += [_ramp(start, x0, *ramp, rate) for rate in lab.effort("unsteady.rates")]
    for result in carry_out(lab, PROTOCOL, trials):
        if isinstance(result, Missing):
            yield result
            continue
        trial = result.trial
        for quantity in SHOWS[trial.name]:
            row = result.row(lab, quantity, finer(result.coarse[quantity].value, result.fine[quantity]))
            if trial.flow is None:
                yield if_sure(row, abs(row.value), f"{quantity} in {trial.name}: no peak, or one that is too uncertain")
            elif math.isfinite(row.value):
                yield row
            else:
                why = f"a ramp of {trial.conditions['rate']:.3g} rad/s^2 doesn't end slipping at both points"
                yield Missing(PROTOCOL, trial.set, why)


def _jump(set: str, p: Parameters, case: Case, x0: State) -> Trial:
    sides = tuple(p.replace(omega_0=p.omega_0 * (1 + side * JUMP)) for side in (1, -1))
    t_end, x, known = lasting(p, 48.0), x0.stacked(), {"case": case.name}
    return Trial(set, p, case.name, x, t_end, (2, 4), 4000, _jumped, variants=sides, conditions=known)


def _ramp(start: Start, x0: State, span: float, end: float, rate: float) -> Trial:
    p, rise, x = start.p, rate * start.p.c * span, x0.stacked()
    t_end = (end - p.omega_0) / rise
    flow, known = Flow.ramp(p.omega_0, end, t_end), {"rate": rise, **state_of(x[:6])}

    def read(run: Trajectory) -> dict[str, Measured]:
        return {"ramp_end": Measured(caught_up(run), 0.0)}

    return Trial(start.set, p, "ramp", x, t_end, (1, 2), 16000, read, flow, conditions=known)


def odd_part(up: Trajectory, down: Trajectory) -> Array:
    """The part of omega_c (n,) that has the sign of the jump, relative to its last value: from 0 to 1."""
    odd = up.omega_c - down.omega_c
    return np.asarray(odd / odd[-1])


def _jumped(up: Trajectory, down: Trajectory) -> dict[str, Measured]:
    """The delay; time and height of the highest peak, nan where there is none in the first half of the runs."""
    t, y = up.time, odd_part(up, down)
    # Forces act in the middle of a step: a moment is known to half of the finer one, either way.
    late = coarse_step(up.header.parameters) / 4 / math.sqrt(12)
    k, later = peaks(y)
    highest = (k == y.argmax()) & (k < len(t) // 2)
    at, height = (np.append(each[highest], math.nan)[0] for each in (t[k] + later * (t[1] - t[0]), top(y, k, later)))
    return {
        "jump_delay": Measured(float(np.trapezoid(1 - y, t)), late),
        "jump_peak": Measured(float(at), late),
        "jump_height": Measured(float(height), 0.0),
    }


def caught_up(run: Trajectory) -> float:
    """The flow in rad s-1 at which the lag has fallen to half of what it was at first; nan if it never does."""
    lag = run.header.flow(run.time) - run.omega_c
    below = np.flatnonzero(lag < lag[0] / 2)
    if not len(below):
        return math.nan
    near = slice(below[0], below[0] - 2, -1)
    return float(run.header.flow(np.interp(lag[0] / 2, lag[near], run.time[near])))
