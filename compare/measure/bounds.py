"""Where slip begins to grow: gamma along straight lines of states, its zero and its slope; and slight slips, watched.

A ball that goes round at a held omega_c is given more and more flow; or the flow takes it along at its own omega_0,
rolling at both points or hanging on the wall alone, as its settled states do. Two flows show about where gamma passes
through zero, and two more are taken around it. gamma is drawn over omega_0, or its square where the orbit goes with it.
Where another law of drag than Stokes' bends the line, a cubic is laid through the four.

On either side of the measured flows at which rolling ends, slight slips all round show by themselves whether the ball
comes back to rolling, or slips for good (Figs. 4 and 5, and RR).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from compare.measure.field import DOUBT, LIMIT, floor, slip_unit
from compare.measure.fits import straight_line, zero_and_slope
from compare.measure.growth import SMOOTH, Push, direction
from compare.measure.lab import Lab, coarse_step, time_unit
from compare.measure.levels import Level
from compare.measure.quantities import quantity
from compare.measure.record import Condition, Measurement, Missing, Records, if_sure, measurement, state_of
from compare.measure.settling import Settled, begin, family, settle
from compare.runs.tasks import Task
from compare.statistics import COVERAGE, settled_case
from model import Case, Parameters, State, Trajectory
from model.arrays import Array
from model.drag import STOKES
from model.kinematics import SLIP_XYZ

AROUND = (0.7, 1.3)
"""Where the second two flows are, over the zero that the first two show."""
AROUND_BENT = (0.8, 1.1)
"""The same on a line that the law of drag bends: apart from the first two, too."""
MEDIUM = (1.0, 0.5)
"""Sizes of slip of a ball that hangs on a smooth wall, and so goes round fast, in units as those of `Push.sizes`."""
COARSE = quantity("gamma_slope").resolves / COVERAGE
"""Largest uncertainty of a slope that counts, over the slope: all that a check may have."""
BEYOND = 2.1
"""Largest zero that counts, over the largest value at which slip stayed in its case: a line isn't followed farther."""
FAR = 100.0
"""Largest zero that is followed, over the largest of the first flows."""
HANGING = (1.05, 1.6, 1.3)
"""Flows at which a ball hangs on the wall, over the measured one at which it ceases to."""

ENDS = {"omega_01": Case.RR, "omega_03": Case.RR, "omega_02": Case.NR}
"""The measured flows at which rolling at both points, by slip or by lift, or at the wall alone, ends."""
SIDES = {"below": 0.97, "above": 1.03}
"""Flows, over that, at which slight slips are watched."""
DIRECTIONS = {Level.QUICK: 4, Level.DEFAULT: 8, Level.FULL: 32}
SLIGHT = 0.02
"""Size of the slip in units of sqrt(g R)/r."""
HIGH = 10.0
"""Height in R of a ball on the wall: room to slip down."""
LASTS_NR, LASTS_RR = 10.0, 8.0
"""How long a ball on the wall is watched, in units of sqrt(R/g), and one that rolls at both points, in units of 1/c:
the fluid has to bring back what the slip has taken."""


@dataclass(frozen=True)
class Line:
    """States in a row, and the slip that they are given."""

    set: str
    p: Parameters
    inner: Case
    outer: Case
    n: tuple[float, float, float]
    by: str
    """``held``: at the same omega_c; ``stationary``: going round with the fluid."""
    flows: tuple[float, ...]
    """The first two flows, rad s-1; and others than those around the zero, where the ball can't be at that."""
    hanging: Mapping[float, Array] = field(default_factory=dict)
    """States (8,) by flow of a ball on the wall alone; else it rolls at both points."""

    @property
    def power(self) -> int:
        """Of omega_0, over which gamma is drawn."""
        return 1 if self.by == "held" else 2

    @property
    def bent(self) -> bool:
        """Whether gamma isn't a straight line over omega_0 because drag isn't over the lag."""
        return self.by == "held" and self.p.drag != STOKES

    def push(self, omega_0: float) -> Push:
        """The state at a flow, and the slip."""
        rolling = State(omega_c=self.flows[0] if self.by == "held" else omega_0).stacked()
        x, p = self.hanging.get(omega_0, rolling), self.p.replace(omega_0=omega_0)
        return Push(self.set, p, self.inner, self.outer, x, np.array(self.n), self.by)


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Zero and slope of gamma along every line."""
    yield from (Missing("bounds", name, SMOOTH) for name, p in sets.items() if not (p.mu and p.eta))
    sets = {name: p for name, p in sets.items() if p.mu and p.eta}
    lines = [line for name, p in sets.items() for line in _lines(name, p)]
    states = _hanging(lab, sets, records, HANGING)
    for name, p in sets.items():
        own = [states[name, factor] for factor in HANGING if (name, factor) in states]
        if len(own) < len(HANGING):
            yield Missing("bounds", name, "no flow was found at which the wall alone carries the ball")
            continue
        hanging = {state.start.p.omega_0: np.array([p.R, 0, *state.mean[2:4], 0, 0, 0, 0]) for state in own}
        lines.append(Line(name, p, Case.NR, Case.NS, (0, 0, 1), "stationary", tuple(hanging), hanging))
    first = list(_points(lab, lines, [line.flows[:2] for line in lines]))
    around = _points(lab, lines, [_around(line, *rows[:2]) for line, (rows, _) in zip(lines, first, strict=True)])
    for line, (begun, tasks), (more, others) in zip(lines, first, around, strict=True):
        if np.isnan(begun[1]).any():
            arrow = f"slips from {line.inner.name} to {line.outer.name}"
            yield Missing("bounds", line.set, f"{arrow} did not stay in {line.outer.name}")
        else:
            yield from _result(lab, line, np.concatenate([begun, more], axis=1), [*tasks, *others])


def _points(lab: Lab, lines: Sequence[Line], flows: Sequence[Sequence[float]]) -> Iterator[tuple[Array, list[Task]]]:
    """Flows, gamma and its uncertainty (3, n), rad s-1 and rad s-2, of every line at its flows, and the runs.

    From two sizes of slip with the shorter step, and one with the longer one.
    """
    pushes = [[line.push(flow) for flow in own] for line, own in zip(lines, flows, strict=True)]
    tasks = [[_tasks(lab, push) for push in own] for own in pushes]
    runs = lab.groups([three for own in tasks for three in own])
    for own, some in zip(pushes, tasks, strict=True):
        rows = [(push.p.omega_0, *_point(push, *next(runs))) for push in own]
        yield np.reshape(rows, (-1, 3)).T, [task for three in some for task in three]


def _tasks(lab: Lab, push: Push) -> list[Task]:
    large, small = MEDIUM if push.inner is Case.NR else push.sizes
    return [push.task(lab, large, 2), push.task(lab, small, 2), push.task(lab, large)]


def _point(push: Push, large: Trajectory, small: Trajectory, coarse: Trajectory) -> tuple[float, float]:
    """gamma for a vanishing step and size of slip, and its uncertainty by what the step and a degree of the polynomials
    change; nan if a case was another.
    """
    rates = 2 * push.rate(small, 2) - push.rate(large, 2)  # one size is twice the other
    change = (push.rate(large, 2) - push.rate(coarse))[0]
    noise = math.hypot(change * DOUBT, rates[1] - rates[0], floor(push.p) * slip_unit(push.p))
    return float(rates[0] + change * LIMIT), noise


def _around(line: Line, flows: Array, gammas: Array) -> tuple[float, ...]:
    """Two flows around the zero of the line through the first two; none if there is none ahead."""
    if line.hanging:
        return line.flows[2:]
    q = flows**line.power
    slope = np.diff(gammas)[0] / np.diff(q)[0]
    zero = float(q[0] - gammas[0] / slope) if slope else math.inf
    if not 0 < zero < (FAR * max(flows)) ** line.power:  # or nan
        return ()
    start = line.flows[0] if line.power == 1 else 0.0
    around = AROUND_BENT if line.bent else AROUND
    return tuple(start + (zero ** (1 / line.power) - start) * factor for factor in around)


def _result(lab: Lab, line: Line, points: Array, tasks: Sequence[Task]) -> Iterator[Measurement | Missing]:
    floor = points[2, :2].max()  # what the step changes may be little by chance at one of the flows
    flows, gamma, noise = points[:, ~np.isnan(points[1])]
    q, noise = flows**line.power, np.maximum(noise, floor)
    if line.bent:
        zero, slope = zero_and_slope(q, gamma, noise)
    else:
        # The points share their errors: that of their mean, and so of the zero, is no smaller; the slope has none.
        _, slope = straight_line(q, gamma, noise)
        zero, _ = straight_line(q, gamma, noise * math.sqrt(len(q)))
    growth = f"growth of slip from {line.inner.name} to {line.outer.name}, {line.by},"
    if not slope.uncertainty <= COARSE * abs(slope.value):
        yield Missing("bounds", line.set, f"{growth} changes too little with the flow, or is too uncertain")
        return
    push, square = line.push(line.flows[0]), "_square" if line.power == 2 else ""
    if abs(zero.value) <= BEYOND * np.abs(q).max():
        row = measurement(lab, "bounds", line.set, push.p, f"gamma_zero{square}", zero, tasks, **push.conditions)
        natural = (line.p.g / line.p.R) ** (line.power / 2)
        yield if_sure(row, max(abs(zero.value), natural), f"{growth} has too uncertain a zero")
    yield measurement(lab, "bounds", line.set, push.p, f"gamma_slope{square}", slope, tasks, **push.conditions)


def _lines(name: str, p: Parameters) -> Iterator[Line]:
    """The lines out of rolling at both points, in natural units; what friction and inertia there are sets the scale."""
    unit = time_unit(p)
    slow = 0.5 / unit * min(1.0, math.sqrt(p.mu / max(p.eta, p.j)))
    rubbing, spinning = math.sqrt(p.mu) / unit, math.sqrt(1 / p.j) / unit
    fast, hanging = 0.7 * spinning, min(1.0, 1 / math.sqrt(p.eta)) / unit
    for outer, n, by, flows in (
        (Case.RS, (0, 1, 0), "held", (slow, 3 * slow)),
        (Case.RS, (0, 1, 0), "stationary", (0.5 * rubbing, 0.9 * rubbing)),
        (Case.RS, (0, -1, 0), "stationary", (0.5 * rubbing, 0.9 * rubbing)),
        (Case.SR, (-1, 0, 0), "held", (fast, 1.5 * fast)),
        (Case.SR, (1, 0, 0), "stationary", (0.5 * spinning, 0.8 * spinning)),
        (Case.SR, (-1, 0, 0), "stationary", (0.5 * spinning, 0.8 * spinning)),
        (Case.SS, (0, 0, 1), "stationary", (0.4 * hanging, 0.8 * hanging)),
        (Case.SS, (0, 0, -1), "stationary", (1.5 * rubbing, 2.2 * rubbing)),
    ):
        yield Line(name, p, Case.RR, outer, n, by, flows)


def _hanging(
    lab: Lab, sets: Mapping[str, Parameters], records: Records, factors: Sequence[float]
) -> dict[tuple[str, float], Settled]:
    """Balls that settle on the wall alone at flows over the measured omega_02, by set and factor."""
    starts = {
        (name, factor): begin(name, p.replace(omega_0=end.value * factor), "on the wall")
        for name, p in sets.items()
        if (end := records.threshold(name, "omega_02"))
        for factor in factors
    }
    ended = zip(starts, settle(lab, list(starts.values())), strict=True)
    return {key: state for key, state in ended if not state.failure and state.case is Case.NR}


def watched(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """The case in which every slight slip ends."""
    settled = _hanging(lab, sets, records, [SIDES["above"]])
    spins = {name: state.values["wall_spin"].value for (name, _), state in settled.items()}
    slips = []
    for omega, case in ENDS.items():
        for name, p in sets.items():
            end = records.threshold(name, omega)
            if end is None or (case is Case.NR and name not in spins):
                yield Missing("watched", name, f"{omega}, at which {case.name} would end, was not measured")
                continue
            for side, factor in SIDES.items():
                q = p.replace(omega_0=end.value * factor)
                x = State(omega_c=q.omega_0)
                if case is Case.NR:  # the spin about the radial axis is the same, whatever the orbit
                    x = x._replace(y=HIGH * p.R, slip_x=spins[name] - p.R / p.r * q.omega_0)
                for n in directions(case, DIRECTIONS[lab.level]):
                    at: dict[str, Condition] = {"inner": case.name, "side": side, "end": omega}
                    at |= state_of(x.stacked()) | direction(n)
                    slips.append((name, _slight(lab, q, case, x.stacked(), n), at))
    tasks = [task for _, task, _ in slips]
    for (name, task, at), run in zip(slips, lab.run(tasks), strict=True):
        yield measurement(lab, "watched", name, task.parameters, "case", family(settled_case(run)), [task], **at)


def _slight(lab: Lab, p: Parameters, case: Case, x: Array, n: Array) -> Task:
    """The run that shows what becomes of a slight slip."""
    x = x.copy()
    x[SLIP_XYZ] += SLIGHT * math.sqrt(p.g * p.R) / p.r * n
    step = coarse_step(p) / 2
    lasts = LASTS_NR * time_unit(p) if case is Case.NR else LASTS_RR / p.c
    return lab.task(p, x, 64 * step * math.ceil(lasts / step / 64), step, samples=64)


def directions(case: Case, count: int) -> Array:
    """Unit vectors (count, 3) all round: in the plane of slip_y, slip_z out of NR, over the sphere out of RR."""
    k = np.arange(count) + 0.5
    if case is Case.NR:
        angle = k * 2 * np.pi / count
        return np.stack([np.zeros(count), np.sin(angle), np.cos(angle)], axis=-1)
    z, around = 1 - 2 * k / count, np.pi * (1 + math.sqrt(5)) * k  # Fibonacci's lattice
    return np.stack([np.sqrt(1 - z**2) * np.cos(around), np.sqrt(1 - z**2) * np.sin(around), z], axis=-1)
