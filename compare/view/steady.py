"""What a run comes to, and how far it may be from there: what hasn't settled says so.

A mean over the last quarter is free of swings, and its drift tells how far it has to go, as long as
some of the way is seen. Of a ball that takes minutes seconds show almost none: no limit is taken to
be nearer than the time in which the fluid takes the ball along lets it be."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

import analytic
from analytic.stationary.solutions import time_constant, time_taken_along
from compare.method.statistics import steady_mean
from model import Flow, Parameters, Trajectory
from model.arrays import Array
from model.kinematics import VARIABLES

QUARTER = 0.25
FEWEST = 6
"""Samples of the last quarter of a run below which it has no mean."""
DRIFT = 1e-3
"""Drift, relative to the orbit's angular velocity, from which a run hasn't settled."""
AT_REST = 1e-6
"""Angular velocity, rad/s, of which nobody asks what share it may change by: a turn in ten
weeks."""
SETS_ASKED = 64
"""Most sets of a sweep that are asked for their time constants: some .6 s."""


def enough(sets: Sequence[Parameters]) -> tuple[float, float]:
    """How long a run of the slowest of these sets should last for its last quarter to be within
    `DRIFT` of the limit, rounded up, and its time constant, both in s; of many sets some are
    asked."""
    some = sets[:: math.ceil(len(sets) / SETS_ASKED)]
    states = ((p, state) for p in some if p.c for state in analytic.stable_solutions(p))
    slowest = max((time_constant(p, state) for p, state in states), default=0.0)
    longest = -math.log(DRIFT) * slowest / (1 - QUARTER)
    unit = 10.0 ** math.floor(math.log10(longest) - 1) if longest else 1.0
    return unit * math.ceil(longest / unit), slowest


def last_quarter(run: Trajectory) -> tuple[list[float], list[float]] | None:
    """Means of each state variable over the last quarter of a run, and how far they may be from
    their limits; None for fewer than `FEWEST` samples."""
    time, x, header = run.time, run.x, run.header
    length = int(QUARTER * len(time))
    if length < FEWEST:
        return None
    p = header.parameters.replace(omega_0=float(header.flow(time[-1])))
    interval = float(time[-1] - time[-length]) / (length - 1)
    slowest = time_taken_along(p, float(x[-length:, 2].mean())) / interval
    means, drifts = steady_mean(x.T, length, slowest)
    return means.tolist(), drifts.tolist()


def described(
    settled: tuple[Sequence[float], Sequence[float]] | None,
) -> dict[str, dict[str, float]]:
    """What `last_quarter` gives as JSON-able data by the name of the variable."""
    rows = zip(VARIABLES, *(settled or ((), ())), strict=bool(settled))
    return {name: {"mean": mean, "drift": drift} for name, mean, drift in rows}


def of_run(run: Trajectory) -> str:
    """`in_words` of a run that is at hand."""
    found = described(last_quarter(run))
    lasts = float(run.time[-1]) if len(run.time) else 0.0
    return in_words(run.header.flow, lasts, found.get("omega_c"))


def in_words(flow: Flow, lasts: float, of: Mapping[str, float] | None) -> str:
    """The steady omega_c of a run, and whether it is one, by what `described` says of it."""
    if of is None:
        return "none: too few samples"
    mean, drift = of["mean"], of["drift"]
    if not flow.is_steady and np.ptp(flow(np.linspace(1 - QUARTER, 1, 100) * lasts)):
        return "none: the flow still changes in the last quarter"
    off = float(share(np.array(mean), np.array(drift), flow(lasts)))
    digits = min(max(math.ceil(-math.log10(drift)) + 1, 1), 9) if drift else 9
    said = f"omega_c = {mean:z.{digits}f} ± {drift:.1g} rad/s over the last quarter"
    if off > DRIFT:
        return f"not settled: {said}, which may change by {percent(off)} % yet"
    return said


def percent(share: float) -> str:
    return f"{float(f'{100 * share:.2g}'):g}"


def share(omega_c: Array, drift: Array, omega_0: Array) -> Array:
    """Drifts of omega_c relative to that, or to a hundredth of omega_0 if it is less."""
    return drift / np.maximum(np.maximum(np.abs(omega_c), np.abs(omega_0) / 100), AT_REST)
