"""Where slip begins to grow: gamma along straight lines of states, its zero and its slope.

A ball goes round at a held omega_c in faster and faster flows; or with the flow, rolling at both points or hanging on
the wall alone. Two flows show about where gamma passes through zero, and two more are taken around it. gamma is a line
in omega_0, or in its square where the orbit goes with it; another law of drag than Stokes' makes it a cubic.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compare.kit.fits import straight_line, zero_and_slope
from compare.kit.lab import Lab, time_unit
from compare.kit.record import Measurement, Missing, Records, if_sure, sure_enough
from compare.kit.settling import begin, settle_groups
from compare.kit.short import DOUBT, LIMIT, lag_error, slip_unit
from compare.kit.tasks import Task
from compare.kit.trials import Start
from compare.subjects.slipping.measure.growth import SMOOTH, Push, without_size
from model import Case, Parameters, State
from model.arrays import Array
from model.drag import STOKES

PROTOCOL = "bounds"
AROUND, AROUND_BENT = (0.7, 1.3), (0.8, 1.1)
"""The second two flows, divided by the zero that the first two show; and where the law of drag bends the line."""
MEDIUM = (1.0, 0.5)
"""Sizes of slip of a ball that hangs on a smooth wall, and so goes round fast, in units as those of `Push.sizes`."""
BEYOND, LARGEST = 2.1, 100.0
"""Largest zero that is recorded, divided by the largest value at which slip stayed in its case; and that is followed,
divided by the largest of the first flows."""
HANGING = (1.05, 1.6, 1.3)
"""Flows at which a ball hangs on the wall, divided by the measured one at which it ceases to."""


@dataclass(frozen=True, eq=False)
class Crossing:
    """Pushes at several flows, between which gamma passes through zero."""

    pushes: tuple[Push, ...]
    """At the first two flows; and others than those around the zero, where the ball can't be at that."""

    @property
    def power(self) -> int:
        """Power of omega_0 in which gamma is a line: 1 where the orbit is held, 2 where it goes with the flow."""
        return 1 if self.pushes[0].start.name == "held" else 2

    @property
    def bent(self) -> bool:
        """Whether gamma isn't a straight line over omega_0, because drag isn't in proportion to the lag."""
        return self.power == 1 and self.pushes[0].start.p.drag != STOKES

    def around(self, gammas: Array) -> tuple[Push, ...]:
        """Pushes at two flows around the zero of the line through the first two; none if there is none ahead."""
        if len(self.pushes) > 2:
            return self.pushes[2:]
        flows = np.array([push.start.p.omega_0 for push in self.pushes])
        q = flows**self.power
        slope = np.diff(gammas)[0] / np.diff(q)[0]
        zero = float(q[0] - gammas[0] / slope) if slope else math.inf
        if not 0 < zero < (LARGEST * max(flows)) ** self.power:  # or nan
            return ()
        least, first = flows[0] if self.power == 1 else 0.0, self.pushes[0]
        pushes = []
        for factor in AROUND_BENT if self.bent else AROUND:
            omega_0 = float(least + (zero ** (1 / self.power) - least) * factor)
            orbit = State.of(first.start.x0).omega_c if self.power == 1 else omega_0
            p, x0 = first.start.p.replace(omega_0=omega_0), State(omega_c=orbit).stacked()
            pushes.append(replace(first, start=replace(first.start, p=p, x0=x0)))
        return tuple(pushes)


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Zero and slope of gamma along every line."""
    yield from (Missing(PROTOCOL, name, SMOOTH) for name, p in sets.items() if not (p.mu and p.eta))
    sets = {name: p for name, p in sets.items() if p.mu and p.eta}
    lines = [line for name, p in sets.items() for line in _rolling(name, p)]
    ends = {name: end.value for name in sets if (end := records.threshold(name, "omega_02"))}
    starts = [
        [begin(name, sets[name].replace(omega_0=end * factor), "on the wall") for factor in HANGING]
        for name, end in ends.items()
    ]
    hanging = dict(zip(ends, settle_groups(lab, starts), strict=True))
    for name, p in sets.items():
        states = hanging.get(name, [])
        if not states or any(state.failure or state.case is not Case.NR for state in states):
            yield Missing(PROTOCOL, name, "no flow was found at which the wall alone carries the ball")
            continue
        rides = [(state.start.p, np.array([p.R, 0, *state.mean[2:4], 0, 0, 0, 0])) for state in states]
        pushes = (Push(Start(name, q, "stationary", x), Case.NR, Case.NS, np.array([0, 0, 1])) for q, x in rides)
        lines.append(Crossing(tuple(pushes)))
    first = list(_points(lab, [line.pushes[:2] for line in lines]))
    around = _points(lab, [line.around(points[1]) for line, (points, _) in zip(lines, first, strict=True)])
    for line, (points, tasks), (more, others) in zip(lines, first, around, strict=True):
        push, square, tasks = line.pushes[0], "_square" if line.power == 2 else "", [*tasks, *others]
        name, slips = push.start.set, f"from {push.inner.name} to {push.outer.name}"
        if np.isnan(points[1]).any():
            yield Missing(PROTOCOL, name, f"slips {slips} did not stay in {push.outer.name}")
            continue
        least = points[2].max()  # what the step changes may be little by chance at one of the flows
        points = np.concatenate([points, more], axis=1)
        flows, gamma, noise = points[:, ~np.isnan(points[1])]
        q, noise = flows**line.power, np.maximum(noise, least)
        if line.bent:
            zero, slope = zero_and_slope(q, gamma, noise)
        else:
            # The points share their errors: that of their mean, and so of the zero, is no smaller; the slope has none.
            _, slope = straight_line(q, gamma, noise)
            zero, _ = straight_line(q, gamma, noise * math.sqrt(len(q)))
        growth = f"growth of slip {slips}, {push.start.name},"
        if not sure_enough("gamma_slope", slope, abs(slope.value)):
            yield Missing(PROTOCOL, name, f"{growth} changes too little with the flow, or is too uncertain")
            continue
        if abs(zero.value) <= BEYOND * np.abs(q).max():
            row = push.row(lab, PROTOCOL, f"gamma_zero{square}", zero, tasks)
            natural = (push.start.p.g / push.start.p.R) ** (line.power / 2)
            yield if_sure(row, max(abs(zero.value), natural), f"{growth} has too uncertain a zero")
        yield push.row(lab, PROTOCOL, f"gamma_slope{square}", slope, tasks)


def _points(lab: Lab, rows: Sequence[Sequence[Push]]) -> Iterator[tuple[Array, list[Task]]]:
    """Flows, gamma and its uncertainty (3, n), rad s-1 and rad s-2, of every row of pushes, and the runs.

    gamma is for a vanishing step and size of slip, from two sizes with the shorter step, and one with the longer one;
    it is uncertain by what the step and the degree of the polynomials change, and nan if the case was another.
    """
    tasks = []
    for push in (push for pushes in rows for push in pushes):
        large_size, small_size = MEDIUM if push.inner is Case.NR else push.sizes
        tasks.append([*push.pair(lab, large_size), push.pair(lab, small_size)[1]])
    runs, todo = lab.groups(tasks), iter(tasks)
    for pushes in rows:
        points, own = [], [task for _ in pushes for task in next(todo)]
        for push in pushes:
            coarse, large, small = (push.rates(run) for run in next(runs))
            best, change = without_size(np.array([large, small])), (large - coarse)[0]
            p = push.start.p
            noise = math.hypot(change * DOUBT, best[1] - best[0], lag_error(p) * slip_unit(p))
            points.append((p.omega_0, best[0] + change * LIMIT, noise))
        yield np.reshape(points, (-1, 3)).T, own


def _rolling(name: str, p: Parameters) -> Iterator[Crossing]:
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
        orbits = (flows[0], flows[0] if by == "held" else flows[1])
        starts = (
            Start(name, p.replace(omega_0=flow), by, State(omega_c=orbit).stacked())
            for flow, orbit in zip(flows, orbits, strict=True)
        )
        yield Crossing(tuple(Push(start, Case.RR, outer, np.array(n)) for start in starts))
