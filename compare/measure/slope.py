"""Slope of the characteristic curve omega_c(omega_0): at settled states, across the onset of slipping, and on average.

Only the flow is changed: each run goes out from a settled state, or from one next to it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from compare.measure.lab import Lab, Level
from compare.measure.quantities import quantity
from compare.measure.record import Measurement, Missing, Records, measurement
from compare.measure.settling import Settled, Start, family, high, settle
from compare.statistics import COVERAGE, Measured
from model import Case, Parameters
from model.arrays import Array

PROTOCOL = "slope"
STEP = 1e-3
"""Relative distance of neighbouring flows; half of it shows what the curvature does."""
ACROSS = (-1e-3, -5e-4, 5e-4, 1e-3, 2e-3, 4e-3, 8e-3)
"""Distances from the flow at which slipping sets in, relative to it."""
SLIPPING = {Level.QUICK: 2, Level.DEFAULT: 20, Level.FULL: 20}
"""Slipping states of a set at which the slope is measured, at most."""
SPAN = 24.0
"""Length of a round, in units of 1/c."""
SHARP = {"neighbours": 0.3, "jump": 0.1, "mean": 1.0}
"""How much less than it may a state is to drift, if it can be had, by what is measured: for the jump they lie close."""
_COMPONENTS = ("v_y", "omega_c", "slip_x", "slip_y", "slip_z")


@dataclass(frozen=True)
class Curve:
    """Settled states to be joined to slopes."""

    by: str
    set: str
    p: Parameters
    """With the flow at which the slope is wanted."""
    flows: tuple[float, ...]
    x0: tuple[float, ...]
    noise: float = 0.0
    """Standard uncertainty of the flows, rad s-1."""


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Slopes at the settled states, the jump where slipping sets in, and the mean slope from there to unloading."""
    curves = [
        each
        for name, p in sets.items()
        for each in [*_local(name, records, SLIPPING[lab.level]), *_wide(name, p, records)]
    ]
    for by, sharp in SHARP.items():
        yield from _measured(lab, [each for each in curves if each.by == by], sharp)


def _measured(lab: Lab, curves: Sequence[Curve], sharp: float) -> Iterator[Measurement | Missing]:
    starts = [
        Start(each.set, each.p.replace(omega_0=flow), each.by, np.array(each.x0))
        for each in curves
        for flow in each.flows
    ]
    ended = iter(settle(lab, starts, span=SPAN, sharp=sharp))
    for curve in curves:
        states = [next(ended) for _ in curve.flows]
        failure = next((each.failure for each in states if each.failure), "")
        value = Measured(math.nan, math.nan) if failure else REDUCTIONS[curve.by](curve, states)
        if not failure and math.isnan(value.value):
            failure = f"the states there are not of one kind ({', '.join(each.case.name for each in states)})"
        elif not failure and COVERAGE * value.uncertainty > quantity("slope").resolves:
            failure = f"the slope is uncertain by {value.uncertainty:.1g}, too much to be of use"
        if failure:
            yield Missing(PROTOCOL, curve.set, f"{curve.by} at omega_0 = {curve.p.omega_0:.4g} rad/s: {failure}")
            continue
        tasks, at = [each.task for each in states], {"case": states[-1].case.name, "by": curve.by}
        yield measurement(lab, PROTOCOL, curve.set, curve.p, "slope", value, tasks, **at)


def _local(name: str, records: Records, most: int) -> Iterator[Curve]:
    """Settled states that slip on the floor, at most so many; of the others, that of the fastest flow."""
    rows = [m for m in records.select("settled") if m.set == name and m.quantity != "case" and m.parameters.omega_0]
    rows.sort(key=_flow_and_case)
    states = [(*key, {m.quantity: m for m in same}) for key, same in groupby(rows, key=_flow_and_case)]
    for case in (Case.RR, Case.SS, Case.NR):
        alike = [(omega_0, values) for omega_0, each, values in states if each is case]
        few = np.linspace(0, len(alike) - 1, most).round() if case is Case.SS else [len(alike) - 1]
        for k in sorted({int(n) for n in few if alike}):
            omega_0, values = alike[k]
            p = values["omega_c"].parameters
            x0 = (high(p) * (case is Case.NR), *(values[q].value for q in _COMPONENTS), 0.0, 0.0)
            flows = tuple(omega_0 * (1 + d) for d in (-STEP, -STEP / 2, STEP / 2, STEP))
            yield Curve("neighbours", name, p, flows, x0)


def _flow_and_case(m: Measurement) -> tuple[float, Case]:
    return m.parameters.omega_0, family(Case[str(m.conditions["case"])])


def _wide(name: str, p: Parameters, records: Records) -> Iterator[Curve]:
    """Across the onset of slipping, and from there to the flow at which the wall begins to carry the ball."""
    one, two = records.threshold(name, "omega_01"), records.threshold(name, "omega_02")
    if one is not None:
        q, x0 = p.replace(omega_0=one.value), (0.0, 0.0, one.value, 0.0, 0.0, 0.0, 0.0, 0.0)
        around = tuple(one.value * (1 + d) for d in ACROSS)
        yield Curve("jump", name, q, around, x0, one.uncertainty)
        if two is not None and two.value > one.value:
            noise = math.hypot(one.uncertainty, two.uncertainty)
            yield Curve("mean", name, q, (*around[:2], two.value), (0.0,) * 8, noise)


def _neighbours(curve: Curve, states: Sequence[Settled]) -> Measured:
    """Central differences over two distances, without the error that goes with the square of the distance."""
    if len({family(each.case) for each in states}) > 1:
        return Measured(math.nan, math.nan)
    f, w, noise = _points(curve, states)
    wide, near = (w[3] - w[0]) / (f[3] - f[0]), (w[2] - w[1]) / (f[2] - f[1])
    return Measured(near + (near - wide) / 3, math.hypot((near - wide) / 3, 2 * noise / (f[2] - f[1])))


def _jump(curve: Curve, states: Sequence[Settled]) -> Measured:
    """Slope above less slope below, each brought to the threshold itself: above by a cubic through four secants."""
    if [each.case for each in states[1:3]] != [Case.RR, Case.SS]:
        return Measured(math.nan, math.nan)
    f, w, noise = _points(curve, states)
    below = (w[1] - w[0]) / (f[1] - f[0])
    secants, middles = np.diff(w[2:]) / np.diff(f[2:]), (f[2:-1] + f[3:]) / 2 - curve.p.omega_0
    cubic, parabola = np.polyfit(middles, secants, 3), np.polyfit(middles[:3], secants[:3], 2)
    # What noise of the states does to the secants, and these to the slope: no weight in the cubic exceeds 4.
    solved = 4 * math.sqrt(2) * noise / (f[3] - f[2])
    placed = parabola[-2] * curve.noise
    return Measured(float(cubic[-1] - below), math.hypot(cubic[-1] - parabola[-1], solved, placed))


def _mean(curve: Curve, states: Sequence[Settled]) -> Measured:
    """From where slipping sets in, along the line on which the ball comes there, to the last flow."""
    if [each.case for each in states] != [Case.RR, Case.RR, Case.SS]:
        return Measured(math.nan, math.nan)
    f, w, noise = _points(curve, states)
    onset = w[1] + (curve.p.omega_0 - f[1]) * (w[1] - w[0]) / (f[1] - f[0])
    rise = f[2] - curve.p.omega_0
    return Measured(float((w[2] - onset) / rise), 3 * math.hypot(noise, curve.noise) / rise)


REDUCTIONS = {"neighbours": _neighbours, "jump": _jump, "mean": _mean}


def _points(curve: Curve, states: Sequence[Settled]) -> tuple[Array, Array, float]:
    """Flows, omega_c and the largest standard uncertainty of an omega_c, rad s-1."""
    values = [each.values["omega_c"] for each in states]
    return np.array(curve.flows), np.array([v.value for v in values]), max(v.uncertainty for v in values)
