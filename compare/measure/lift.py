"""The dotted arrows of Fig. 6: at which orbit does a ball on the floor leave it, by the engine's own contact?

States of every case with a floor, all alike but for the speed of the orbit, go from slow, where the floor presses, to
fast. A few orbits show about where the floor ceases to; its force at others, so much slower that the contact doesn't
come and go, is extrapolated to zero over omega_c^2, with which the forces of an orbit go.
Whether the wall's contact rolls or slips once the ball has left, the engine says.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from compare.measure.extrapolation import vanishing
from compare.measure.field import polynomial
from compare.measure.lab import Lab, coarse_step, time_unit
from compare.measure.record import Condition, Measurement, Missing, Records, measurement, state_of
from compare.runs.tasks import Task
from compare.statistics import Measured
from model import Case, Parameters, Trajectory
from model.arrays import Array

NAME = "lift"
ARROWS: dict[tuple[Case, Case], tuple[float, float, float]] = {
    (Case.RR, Case.NR): (0.0, 0.0, 0.0),
    (Case.RS, Case.NS): (0.0, 0.8, 0.0),
    (Case.SR, Case.NR): (-0.6, 0.0, 0.0),
    (Case.SS, Case.NS): (0.3, 0.1, 0.8),
}
"""Slips at the beginning in units of sqrt(g R)/r; that of a rolling wall contact in units of R/r omega_c."""
ORBITS = (0.5, 0.8, 1.2, 1.6, 2.0, 2.4, 2.8, 3.2, 3.6)
"""omega_c sqrt(R/g) at which the ball is looked at first."""
NEAR = (0.05, 0.08, 0.12, 0.17)
"""How much slower the others are than the orbit to which the first point, relative."""
REFINED = 64
"""Steps in one of `coarse_step`."""
STEPS, SKIPPED, FEWEST = 16, 4, 5
"""Steps of a run, those at its start in which contact forces build up, and the least number that must be left."""


@dataclass(frozen=True)
class Line:
    """States of a case that differ in omega_c, and the case to which the ball leaves the floor."""

    set: str
    p: Parameters
    inner: Case
    outer: Case

    def at(self, omega_c: float) -> tuple[Parameters, Array]:
        """Parameters, with the fluid going round like the ball, and state (8,)."""
        p = self.p
        unit = p.R / p.r * omega_c if self.inner is Case.SR else math.sqrt(p.g * p.R) / p.r
        slips = np.array(ARROWS[self.inner, self.outer]) * unit
        return p.replace(omega_0=omega_c), np.array([0.0, 0.0, omega_c, *slips, 0.0, 0.0])

    def task(self, lab: Lab, omega_c: float) -> Task:
        """The run from there."""
        p, x = self.at(omega_c)
        step = coarse_step(p) / REFINED
        return lab.task(p, x, STEPS * step, step, samples=STEPS)


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """omega_c at which the ball leaves the floor, along every arrow; or that it doesn't at the fastest orbit."""
    lines = [Line(name, p, *arrow) for name, p in sets.items() for arrow in ARROWS]
    first = _forces(lab, [(line, Omega / time_unit(line.p)) for line in lines for Omega in ORBITS])
    about = {line: _about(line, first) for line in lines}
    near = [(line, where * (1 - part)) for line, where in about.items() if where for part in NEAR]
    others = _forces(lab, near)
    for line in lines:
        along: dict[str, Condition] = {"inner": line.inner.name, "outer": line.outer.name}
        own = [(omega_c, *found) for (one, omega_c), found in others.items() if one is line]
        fastest = ORBITS[-1] / time_unit(line.p)
        gone = next((k for k in ORBITS if first[line, k / time_unit(line.p)][1] is None), None)
        if gone is None:
            p, x = line.at(fastest)
            yield measurement(lab, NAME, line.set, p, "lifts", 0.0, [line.task(lab, fastest)], **along, **state_of(x))
            continue
        seen = first[line, gone / time_unit(line.p)][0]
        forces = [force for *_, force in own if force]
        if seen is not line.outer or len(forces) < len(NEAR):
            yield Missing(NAME, line.set, f"out of {line.inner.name} the ball lifts to {seen.name}, not smoothly")
            continue
        square = vanishing(np.array([omega_c**2 for omega_c, _, _ in own]), forces)
        root = math.sqrt(square.value)
        value = Measured(root, square.uncertainty / (2 * root))
        p, x = line.at(value.value)
        tasks = [line.task(lab, omega_c) for omega_c, *_ in own]
        yield measurement(lab, NAME, line.set, p, "lift_onset", value, tasks, **along, **state_of(x))


def _forces(lab: Lab, states: Sequence[tuple[Line, float]]) -> dict[tuple[Line, float], tuple[Case, Measured | None]]:
    """By line and omega_c: the case at the end, and the force of the floor at the beginning over the weight.

    None for the force where the floor doesn't press for long enough.
    """
    tasks = [line.task(lab, omega_c) for line, omega_c in states]
    runs = lab.run(tasks)
    return {state: (Case(int(run.case[-1])), _force(run)) for state, run in zip(states, runs, strict=True)}


def _force(run: Trajectory) -> Measured | None:
    p, force = run.header.parameters, run.force_A[SKIPPED:, 1:2]
    pressed = int(np.argmax(np.append(force <= 0, True)))
    if pressed < FEWEST:
        return None
    time, force = run.time[SKIPPED:][:pressed], force[:pressed]
    # The force of a sample acts from then on for a step: it belongs to the middle of it.
    begin = -(time[1] - time[0]) / 2
    value, lower = (float(polynomial(time, force, degree, begin)[0][0]) / (p.m * p.g) for degree in (3, 2))
    return Measured(value, abs(value - lower))


def _about(line: Line, forces: Mapping[tuple[Line, float], tuple[Case, Measured | None]]) -> float | None:
    """Where the forces of the last two orbits before the ball leaves point to, over omega_c^2; None if nowhere."""
    orbits = [k / time_unit(line.p) for k in ORBITS]
    pressed = [(omega_c**2, force.value) for omega_c in orbits if (force := forces[line, omega_c][1])]
    if len(pressed) < 2 or len(pressed) == len(orbits):
        return None
    (a, high), (b, low) = pressed[-2:]
    return math.sqrt(b + low * (b - a) / (high - low)) if high > low else None
