"""The drag below which slipping at both points ends in a fold, and above which it passes to the wall without a jump.

Where the branch of settled slipping comes to its end, the floor carries nothing. How omega_0 goes with the force of the
floor there, rising or falling, decides whether the branch turns back: the drag is looked for at which it does neither.
All states are settled in stronger drag than that, where the branch has no fold and they last up to its end.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from compare.measure.extrapolation import initial_slope
from compare.measure.lab import Lab, time_unit
from compare.measure.record import Measurement, Missing, Records, measurement, sure_enough
from compare.measure.settling import Settled, Start, settle
from compare.statistics import Measured, straight_line
from model import Case, Parameters

PROTOCOL = "birth"
STRONG = (2.0, 4.0)
"""The first two drags, c sqrt(R/g): the fluid takes a ball along within a fraction of the time of its fall."""
BEYOND = (1.6, 2.6)
"""The others, over the one to which the first two point: near to it, but so far off that states still settle soon."""
NEAR = (0.02, 0.035, 0.055, 0.08, 0.12)
"""Distances of the states from omega_02, in parts of the range of slipping."""


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """The drag at which the slope vanishes, by slopes over 1/c: what a force makes a ball lag by is proportional."""
    ranges = {name: flows for name in sets if (flows := _range(records, name))}
    first = {(name, kappa / time_unit(sets[name])) for name in ranges for kappa in STRONG}
    rough = _slopes(lab, sets, ranges, sorted(first))
    near = {name: 1 / lag.value for name in ranges if (lag := _lag(rough, name)) and lag.value > 0}
    slopes = rough | _slopes(lab, sets, ranges, [(name, c * k) for name, c in near.items() for k in BEYOND])
    for name, p in sets.items():
        own = [states for (one, _), (_, states) in slopes.items() if one == name]
        if name not in ranges:
            yield Missing(PROTOCOL, name, "there is no range of slipping at both points that ends at the wall")
        elif len(own) < len(STRONG) + len(BEYOND) or not (lag := _lag(slopes, name)):
            yield Missing(PROTOCOL, name, "too few states of slipping at both points settle near the end of the branch")
        else:
            drag = Measured(1 / lag.value, lag.uncertainty / lag.value**2)
            if not sure_enough("critical_drag", drag, drag.value):
                yield Missing(
                    PROTOCOL, name, f"the drag where the fold is born is too vague: {drag.uncertainty:.2g} 1/s"
                )
                continue
            tasks = [state.task for states in own for state in states]
            q = p.replace(c=drag.value)
            yield measurement(lab, PROTOCOL, name, q, "critical_drag", drag, tasks)


def _range(records: Records, name: str) -> tuple[float, float] | None:
    """The measured flows at which slipping begins and at which the wall begins to carry; None without either."""
    begins, ends = records.threshold(name, "omega_01"), records.threshold(name, "omega_02")
    return (begins.value, ends.value) if begins and ends and begins.value < ends.value else None


Slopes = dict[tuple[str, float], tuple[Measured, list[Settled]]]
"""By set and drag: d omega_0 over that of the floor's force, where it vanishes; and the states that show it."""


def _slopes(
    lab: Lab,
    sets: Mapping[str, Parameters],
    ranges: Mapping[str, tuple[float, float]],
    drags: Sequence[tuple[str, float]],
) -> Slopes:
    starts = [
        Start(name, sets[name].replace(c=c, omega_0=high - part * (high - low)), "rest", np.zeros(8))
        for name, c in drags
        for low, high in [ranges[name]]
        for part in NEAR
    ]
    ended, slopes = iter(settle(lab, starts)), Slopes()
    for drag in drags:
        states = [state for state in [next(ended) for _ in NEAR] if not state.failure and state.case is Case.SS]
        if len(states) == len(NEAR):
            flows = np.array([state.start.p.omega_0 for state in states])
            slopes[drag] = initial_slope(flows, [state.values["force_Ay"] for state in states]), states
    return slopes


def _lag(slopes: Slopes, name: str) -> Measured | None:
    """1/c where the line through the slopes of a set vanishes; None where too few were measured."""
    points = [(1 / c, slope) for (one, c), (slope, _) in slopes.items() if one == name]
    if len(points) < len(STRONG):
        return None
    lags, values = [lag for lag, _ in points], [slope.value for _, slope in points]
    zero, _ = straight_line(lags, values, [slope.uncertainty for _, slope in points])
    return zero
