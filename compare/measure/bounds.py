"""Where slip begins to grow: gamma along straight lines of states, its zero and its slope.

A ball that goes round at a held omega_c is given more and more flow; or the flow takes it along at its own omega_0,
rolling at both points or hanging on the wall alone, as its settled states do. Two flows show about where gamma passes
through zero, and two more are taken around it. gamma is drawn over omega_0, or its square where the orbit goes with it.
Where another law of drag than Stokes' bends the line, a cubic is laid through the four.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from compare.measure.field import DOUBT, LIMIT, floor, slip_unit
from compare.measure.growth import LARGE, SMALL, SMOOTH, Push
from compare.measure.lab import Lab, time_unit
from compare.measure.quantities import quantity
from compare.measure.record import Measurement, Missing, Records, measurement, sure_enough
from compare.measure.settling import Start, high, settle
from compare.runs.tasks import Task
from compare.statistics import COVERAGE, Measured, straight_line
from model import Case, Parameters, State, Trajectory
from model.arrays import Array
from model.drag import STOKES

NAME = "bounds"
AROUND = (0.7, 1.3)
"""Where the second two flows are, over the zero that the first two show."""
AROUND_BENT = (0.8, 1.1)
"""The same on a line that the law of drag bends: apart from the first two, too."""
MEDIUM = (1.0, 0.5)
"""Sizes of slip of a ball that hangs on a smooth wall, and so goes round fast, in units as those of `LARGE`."""
COARSE = quantity("gamma_slope").resolves / COVERAGE
"""Largest uncertainty of a slope that counts, over the slope: all that a check may have."""
BEYOND = 2.1
"""Largest zero that counts, over the largest value at which slip stayed in its case: a line isn't followed farther."""
FAR = 100.0
"""Largest zero that is followed, over the largest of the first flows."""
HANGING = (1.05, 1.6, 1.3)
"""Flows at which a ball hangs on the wall, over the measured one at which it ceases to."""


@dataclass(frozen=True)
class Line:
    """States in a row, and the slip that they are given."""

    set: str
    inner: Case
    outer: Case
    n: tuple[float, float, float]
    by: str
    """``held``: at the same omega_c; ``stationary``: going round with the fluid."""
    first: tuple[float, float]
    """The first two flows, rad s-1."""
    at: Callable[[float], tuple[Parameters, Array]]
    """Parameters and state (8,) at a flow."""
    last: tuple[float, ...] = ()
    """Other flows than those around the zero: where the ball can't be at that."""

    @property
    def power(self) -> int:
        """Of omega_0, over which gamma is drawn."""
        return 1 if self.by == "held" else 2

    @property
    def bent(self) -> bool:
        """Whether gamma isn't a straight line over omega_0 because drag isn't over the lag."""
        return self.by == "held" and self.at(self.first[0])[0].drag != STOKES

    def push(self, omega_0: float) -> Push:
        """The state at a flow, and the slip."""
        p, x = self.at(omega_0)
        return Push(self.set, p, self.inner, self.outer, x, np.array(self.n))

    @property
    def sizes(self) -> tuple[float, float]:
        """Sizes of slip."""
        if self.inner is Case.NR:
            return MEDIUM
        return SMALL if self.outer in (Case.RS, Case.SR) else LARGE


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Zero and slope of gamma along every line."""
    yield from (Missing(NAME, name, SMOOTH) for name, p in sets.items() if not (p.mu and p.eta))
    sets = {name: p for name, p in sets.items() if p.mu and p.eta}
    lines = [line for name, p in sets.items() for line in _lines(name, p)]
    hanging, missing = _hanging(lab, sets, records)
    yield from missing
    lines += hanging
    begun = _points(lab, lines, [line.first for line in lines])
    around = _points(lab, lines, [_around(line, points) for line, points in zip(lines, begun, strict=True)])
    for line, first, more in zip(lines, begun, around, strict=True):
        if np.isnan(first.gammas).any():
            yield Missing(
                NAME, line.set, f"slips from {line.inner.name} to {line.outer.name} did not stay in {line.outer.name}"
            )
            continue
        yield from _result(lab, line, first, more)


@dataclass(frozen=True)
class _Points:
    """gamma along a line for a vanishing step and size of slip in rad s-2, (n,), nan where the case was another."""

    flows: Array
    gammas: Array
    noise: Array
    """Standard uncertainties."""
    tasks: tuple[Task, ...]


def _points(lab: Lab, lines: Sequence[Line], flows: Sequence[Sequence[float]]) -> list[_Points]:
    """The points of every line at its flows: from two sizes with the shorter step, and one with the longer one."""
    pushes = [[line.push(flow) for flow in own] for line, own in zip(lines, flows, strict=True)]
    tasks = [[_tasks(lab, line, push) for push in own] for line, own in zip(lines, pushes, strict=True)]
    lab.complete([task for own in tasks for three in own for task in three])
    points = []
    for own, some, at in zip(pushes, tasks, flows, strict=True):
        values = [_point(push, *lab.run(three)) for push, three in zip(own, some, strict=True)]
        gammas, noise = np.reshape(values, (-1, 2)).T
        points.append(_Points(np.array(at), gammas, noise, tuple(task for three in some for task in three)))
    return points


def _tasks(lab: Lab, line: Line, push: Push) -> tuple[Task, ...]:
    large, small = line.sizes
    return push.task(lab, large, 2), push.task(lab, small, 2), push.task(lab, large)


def _point(push: Push, large: Trajectory, small: Trajectory, coarse: Trajectory) -> tuple[float, float]:
    """gamma, and its uncertainty by what the step and a degree of the polynomials change; nan if a case was another."""
    rates = 2 * push.rate(small, 2) - push.rate(large, 2)  # for a vanishing size: one is twice the other
    change = (push.rate(large, 2) - push.rate(coarse))[0]
    noise = math.hypot(change * DOUBT, rates[1] - rates[0], floor(push.p) * slip_unit(push.p))
    return float(rates[0] + change * LIMIT), noise


def _around(line: Line, points: _Points) -> tuple[float, ...]:
    """Two flows around the zero of the line through the first two; none if there is none ahead."""
    if line.last:
        return line.last
    q, rates = points.flows**line.power, points.gammas
    slope = np.diff(rates)[0] / np.diff(q)[0]
    zero = float(q[0] - rates[0] / slope) if slope else math.inf
    if not 0 < zero < (FAR * max(points.flows)) ** line.power:  # or nan
        return ()
    _, x = line.at(points.flows[0])
    start = State.of(x).omega_c if line.power == 1 else 0.0
    around = AROUND_BENT if line.bent else AROUND
    return tuple(start + (zero ** (1 / line.power) - start) * factor for factor in around)


def _result(lab: Lab, line: Line, first: _Points, more: _Points) -> Iterator[Measurement | Missing]:
    there = ~np.isnan(more.gammas)
    q = np.append(first.flows, more.flows[there]) ** line.power
    gamma = np.append(first.gammas, more.gammas[there])
    # What the step changes may be little by chance at one of them.
    noise = np.maximum(np.append(first.noise, more.noise[there]), first.noise.max())
    if line.bent:
        zero, slope = _curve(q, gamma, noise)
    else:
        # The points share their errors: that of their mean, and so of the zero, is no smaller; the slope has none.
        _, slope = straight_line(q, gamma, noise)
        zero, _ = straight_line(q, gamma, noise * math.sqrt(len(q)))
    growth = f"growth of slip from {line.inner.name} to {line.outer.name}, {line.by},"
    if not slope.uncertainty <= COARSE * abs(slope.value):
        yield Missing(NAME, line.set, f"{growth} changes too little with the flow, or is too uncertain")
        return
    p, x = line.at(line.first[0])
    natural = (p.g / p.R) ** (line.power / 2)
    conditions = line.push(line.first[0]).conditions | {"by": line.by, "omega_c": State.of(x).omega_c}
    square = "_square" if line.power == 2 else ""
    for what, value in zip((f"gamma_zero{square}", f"gamma_slope{square}"), (zero, slope), strict=True):
        if value is zero and abs(zero.value) > BEYOND * np.abs(q).max():
            continue
        if value is zero and not sure_enough(what, zero, max(abs(zero.value), natural)):
            yield Missing(NAME, line.set, f"{growth} has too uncertain a zero")
            continue
        yield measurement(lab, NAME, line.set, p, what, value, (*first.tasks, *more.tasks), **conditions)


def _curve(q: Array, gamma: Array, noise: Array) -> tuple[Measured, Measured]:
    """Zero of a curve through points (n,), and its slope there; uncertain by a third of what the last degree changes.

    nan without a single zero between the points.
    """

    def at_zero(values: Array, degree: int) -> Array:
        fit = np.polynomial.Polynomial.fit(q, values, degree)
        zeros = [root.real for root in fit.roots() if abs(root.imag) < 1e-9 and q.min() < root.real < q.max()]
        return np.array([zeros[0], fit.deriv()(zeros[0])] if len(zeros) == 1 else [math.nan, math.nan])

    degree = len(q) - 1
    best = at_zero(gamma, degree)
    shifted = [at_zero(gamma + shift, degree) - best for shift in np.diag(noise)]
    spread = np.linalg.norm([(best - at_zero(gamma, degree - 1)) / 3, *shifted], axis=0)
    zero, slope = (Measured(*pair) for pair in zip(best.tolist(), spread.tolist(), strict=True))
    return zero, slope


def _lines(name: str, p: Parameters) -> Iterator[Line]:
    """The lines out of rolling at both points, in natural units; what friction and inertia there are sets the scale."""
    unit = time_unit(p)

    def held(omega_c: float) -> Callable[[float], tuple[Parameters, Array]]:
        return lambda omega_0: (p.replace(omega_0=omega_0), _rolling(omega_c))

    def along(omega_0: float) -> tuple[Parameters, Array]:
        return p.replace(omega_0=omega_0), _rolling(omega_0)

    slow = 0.5 / unit * min(1.0, math.sqrt(p.mu / max(p.eta, p.j)))
    yield Line(name, Case.RR, Case.RS, (0, 1, 0), "held", (slow, 3 * slow), held(slow))
    rubbing = math.sqrt(p.mu) / unit
    for side in (1, -1):
        yield Line(name, Case.RR, Case.RS, (0, side, 0), "stationary", (0.5 * rubbing, 0.9 * rubbing), along)
    spinning = math.sqrt(1 / p.j) / unit
    fast = 0.7 * spinning
    yield Line(name, Case.RR, Case.SR, (-1, 0, 0), "held", (fast, 1.5 * fast), held(fast))
    for side in (1, -1):
        yield Line(name, Case.RR, Case.SR, (side, 0, 0), "stationary", (0.5 * spinning, 0.8 * spinning), along)
    hanging = min(1.0, 1 / math.sqrt(p.eta)) / unit
    yield Line(name, Case.RR, Case.SS, (0, 0, 1), "stationary", (0.4 * hanging, 0.8 * hanging), along)
    yield Line(name, Case.RR, Case.SS, (0, 0, -1), "stationary", (1.5 * rubbing, 2.2 * rubbing), along)


def _rolling(omega_c: float) -> Array:
    return np.array([0.0, 0.0, omega_c, 0, 0, 0, 0, 0])


def _hanging(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> tuple[list[Line], list[Missing]]:
    """The lines out of NR, through states settled above the measured omega_02."""
    ends = {name: records.threshold(name, "omega_02") for name in sets}
    flows = {name: [end.value * factor for factor in HANGING] for name, end in ends.items() if end}
    starts = [
        Start(name, q, "on the wall", np.array([high(q), 0, q.omega_0, 0, 0, 0, 0, 0]))
        for name in flows
        for q in (sets[name].replace(omega_0=flow) for flow in flows[name])
    ]
    states = {(s.start.set, s.start.p.omega_0): s for s in settle(lab, starts) if not s.failure and s.case is Case.NR}
    lines, missing = [], []
    for name, p in sets.items():
        if name not in flows or any((name, flow) not in states for flow in flows[name]):
            missing.append(Missing(NAME, name, "no flow was found at which the wall alone carries the ball"))
            continue

        def at(omega_0: float, name: str = name, p: Parameters = p) -> tuple[Parameters, Array]:
            _, _, omega_c, slip_x, *_ = states[name, omega_0].mean.tolist()
            return p.replace(omega_0=omega_0), np.array([p.R, 0, omega_c, slip_x, 0, 0, 0, 0])

        first, second, *last = flows[name]
        lines.append(Line(name, Case.NR, Case.NS, (0, 0, 1), "stationary", (first, second), at, tuple(last)))
    return lines, missing
