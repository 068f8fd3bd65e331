"""The direction along which slip grows the most, out of rolling on the wall alone.

Growths along directions all round make a curve; where its first harmonic is greatest, slip grows the most. That other
harmonics are small is measured, not assumed: what they may turn the direction by is its uncertainty.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from compare.measure import growth
from compare.measure.field import random_state
from compare.measure.growth import Push
from compare.measure.lab import Lab, Level, dragged_speed
from compare.measure.record import Measurement, Missing, Records, measurement, state_of, sure_enough
from compare.statistics import Measured
from model import Case, Parameters, State
from model.arrays import Array

NAME = "steepest"
SEED = 58
STATES = {Level.QUICK: 1, Level.DEFAULT: 3, Level.FULL: 12}
"""Random states of every set."""
DIRECTIONS = 8
DRAGGED = (0.5, 3.0)
"""How hard the fluid pulls along the orbit over the weight, least and most, either way: it turns the direction."""
AHEAD = 3.0
"""Largest angle from the vertical, rad, that is recorded: one beyond may come out on either side of pi."""


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """beta of the greatest growth for every state."""
    rough = {name: p for name, p in sets.items() if p.eta and p.c}
    yield from (Missing(NAME, name, "without friction at the wall, or drag, no direction stands out")
                for name in sets if name not in rough)  # fmt: skip
    fans = [fan for name, p in rough.items() for fan in _fans(name, p, STATES[lab.level])]
    lab.complete([task for fan in fans for push in fan for task in growth.tasks_of(lab, push)])
    for fan in fans:
        first, planned = fan[0], [growth.tasks_of(lab, push) for push in fan]
        growths = [growth.growth(push, lab.run(tasks)) for push, tasks in zip(fan, planned, strict=True)]
        beta = _greatest([g for g in growths if g])
        if beta and sure_enough("steepest", beta, 1.0) and abs(beta.value) < AHEAD:
            runs = [task for tasks in planned for task in tasks]
            yield measurement(lab, NAME, first.set, first.p, "steepest", beta, runs, **state_of(first.x))
        else:
            yield Missing(NAME, first.set, "slip along some direction did not last, or no direction stands out")


def _fans(name: str, p: Parameters, count: int) -> Iterator[list[Push]]:
    rng = np.random.default_rng([SEED, *name.encode()])
    for _ in range(count):
        x = random_state(Case.NR, p, rng)
        pull = rng.choice([-1, 1]) * rng.uniform(*DRAGGED)
        q = p.replace(omega_0=State.of(x).omega_c + pull * dragged_speed(p) / p.R)
        yield [Push(name, q, Case.NR, Case.NS, x, _along(beta)) for beta in _angles()]


def _angles() -> Array:
    return np.linspace(0.0, 2 * np.pi, DIRECTIONS, endpoint=False, dtype=np.float64)


def _along(beta: float) -> Array:
    """The unit vector over slip_x, slip_y, slip_z of a slip of the wall's contact (8)."""
    return np.array([0.0, np.sin(beta), np.cos(beta)])


def _greatest(growths: list[Measured]) -> Measured | None:
    """Direction of the first harmonic; None without growths in all directions."""
    if len(growths) < DIRECTIONS:
        return None
    harmonics = np.fft.rfft([g.value for g in growths]) * 2 / DIRECTIONS
    scatter = np.sqrt(2.0 / DIRECTIONS) * max(g.uncertainty for g in growths)
    others = np.arange(2, len(harmonics)) @ np.abs(harmonics[2:])
    return Measured(float(-np.angle(harmonics[1])), float(np.hypot(scatter, others) / np.abs(harmonics[1])))
