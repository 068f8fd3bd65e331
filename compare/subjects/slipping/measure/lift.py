"""The dotted arrows of Fig. 6: at which orbit does a ball on the floor leave it, by the engine's own contact?

States of a case differ only in omega_c, from slow, where the floor presses, to fast. A few show roughly where it stops
pressing; at slower ones its force is measured and extrapolated to zero as a function of omega_c^2.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from compare.kit.fits import vanishing
from compare.kit.lab import Lab, coarse_step, state_units, time_unit
from compare.kit.quantities import quantity
from compare.kit.record import Measurement, Missing, Records, measurement, state_of
from compare.kit.short import DOUBT, LIMIT, REFINED, polynomials
from compare.kit.statistics import COVERAGE, Measured
from compare.kit.tasks import Task
from model import Case, Parameters, Trajectory
from model.arrays import Array

PROTOCOL = "lift"
ARROWS: dict[tuple[Case, Case], tuple[float, float, float]] = {
    (Case.RR, Case.NR): (0.0, 0.0, 0.0),
    (Case.RS, Case.NS): (0.0, 0.8, 0.0),
    (Case.SR, Case.NR): (-0.6, 0.0, 0.0),
    (Case.SS, Case.NS): (0.3, 0.1, 0.8),
}
"""Slips at the beginning in units of sqrt(g R)/r; that of a rolling wall contact in units of R/r omega_c."""
ORBITS = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5)
"""The first orbits, omega_c sqrt(R/g)."""
NEAR = (0.05, 0.08, 0.12, 0.17)
"""Relative distances of the later orbits below the one at which the first ones show the ball to leave."""
STEPS, SKIPPED, FEWEST = 16, 4, 5
"""Steps of a run, those at its start in which contact forces build up, and the fewest that must be left."""
DEGREES = (3, 2)
"""Degrees of the polynomials; the lower one shows what the degree changes."""


@dataclass(frozen=True)
class Arrow:
    """States of a case that differ in omega_c, and the case to which the ball leaves the floor."""

    lab: Lab
    set: str
    p: Parameters
    inner: Case
    outer: Case

    def start(self, omega_c: float) -> tuple[Parameters, Array]:
        """The state at an orbit, with the fluid going round like the ball."""
        unit = self.p.R / self.p.r * omega_c if self.inner is Case.SR else state_units(self.p)[3]
        slips = np.array(ARROWS[self.inner, self.outer]) * unit
        return self.p.replace(omega_0=omega_c), np.array([0.0, 0.0, omega_c, *slips, 0.0, 0.0])

    def task(self, omega_c: float, times: int = 1) -> Task:
        """The run from there, with steps half as long as those of `short`, divided by `times`."""
        step = coarse_step(self.p) / (2 * REFINED * times)
        return self.lab.task(*self.start(omega_c), STEPS * step, step, samples=STEPS)

    def row(self, quantity: str, omega_c: float, value: Measured | float, tasks: Sequence[Task]) -> Measurement:
        """What was measured along it, with the state at an orbit."""
        p, x0 = self.start(omega_c)
        at = {"inner": self.inner.name, "outer": self.outer.name} | state_of(x0)
        return measurement(self.lab, PROTOCOL, self.set, p, quantity, value, tasks, **at)


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """omega_c at which the ball leaves the floor, along every arrow; or that it doesn't at the fastest orbit."""
    arrows = [Arrow(lab, name, p, *arrow) for name, p in sets.items() for arrow in ARROWS]
    first = [[arrow.task(Omega / time_unit(arrow.p)) for Omega in ORBITS] for arrow in arrows]
    seen: list[list[Trajectory]] = []
    near: list[list[Task]] = []
    for arrow, runs in zip(arrows, lab.groups(first), strict=True):
        # The first runs in a row in which the ball passes into no case but the two ends of the arrow.
        strays = [not np.isin(run.case[SKIPPED:], [arrow.inner, arrow.outer]).all() for run in runs]
        begin = [*strays, False].index(False)
        seen.append(runs[begin : [*strays, True].index(True, begin)])
        # Where the line over omega_c^2 through the forces at the last two orbits before the ball leaves vanishes.
        near.append([])
        pressed = [(run.omega_c[0] ** 2, force.value) for run in seen[-1] if (force := _force(run))]
        if 2 <= len(pressed) < len(seen[-1]):
            (a, high), (b, low) = pressed[-2:]
            where = math.sqrt(b + low * (b - a) / (high - low)) if high > low else 0.0
            near[-1] = [arrow.task(where * (1 - part), times) for part in NEAR for times in (1, 2) if where]
    for arrow, orbits, begun, tasks, runs in zip(arrows, first, seen, near, lab.groups(near), strict=True):
        lifted = next((run for run in begun if _force(run) is None), None)
        if not begun:
            yield Missing(PROTOCOL, arrow.set, f"the ball doesn't stay in {arrow.inner.name} at any orbit")
        elif lifted is None:
            yield arrow.row("lifts", float(begun[-1].omega_c[0]), 0.0, orbits)
        elif (to := Case(int(lifted.case[-1]))) is not arrow.outer:
            yield Missing(PROTOCOL, arrow.set, f"out of {arrow.inner.name} the ball leaves the floor for {to.name}")
        elif (value := _onset(runs)) is None:
            why = f"where the ball leaves {arrow.inner.name} the floor's contact comes and goes"
            yield Missing(PROTOCOL, arrow.set, why)
        else:
            yield arrow.row("lift_onset", value.value, value, tasks)


def _force(run: Trajectory) -> Measured | None:
    """Force of the floor at the beginning divided by the weight; None where it doesn't press for long enough."""
    p, force = run.header.parameters, run.force_A[SKIPPED:, 1]
    pressed = int(np.argmax(np.append(force <= 0, True)))
    if pressed < FEWEST:
        return None
    time = run.time[SKIPPED:][:pressed]
    # The force of a sample acts from then on for a step: it belongs to the middle of it.
    begin = -(time[1] - time[0]) / 2
    value, lower = (polynomials(time, force[:pressed], DEGREES, begin)[0] / (p.m * p.g)).tolist()
    return Measured(value, abs(value - lower))


def _onset(runs: Sequence[Trajectory]) -> Measured | None:
    """omega_c where the force vanishes, from runs with both steps at each orbit; None if it does not so smoothly."""
    squares, forces = np.array([run.omega_c[0] ** 2 for run in runs[::2]]), []
    for coarse, fine in zip(map(_force, runs[::2]), map(_force, runs[1::2]), strict=True):
        if coarse is None or fine is None:
            return None
        change = fine.value - coarse.value
        forces.append(Measured(fine.value + change * LIMIT, math.hypot(fine.uncertainty, change * DOUBT)))
    square = vanishing(squares, forces) if forces else Measured(0.0, math.inf)
    if not 0 < COVERAGE * square.uncertainty < 2 * quantity("lift_onset").resolves * square.value:
        return None
    return Measured(math.sqrt(square.value), square.uncertainty / (2 * math.sqrt(square.value)))
