"""A ball that hops for ever: its hop, through flows that become slower, and along walls that become rougher.

* It starts near its hop; then the flow is lowered in held steps. At each the tops of the hops say period, height and
  orbit; how the heights settle says by what factor a disturbance shrinks from hop to hop; and the flow at which the
  height would be zero is extrapolated. At the flow of the set alone Moreau-Jean time stepping shows its hop, too.
* The hop is followed along rougher and rougher walls, to where disturbances grow: from tops that settle, or leave, the
  top of the steady hop is computed, and from two of them the start at the next wall is extrapolated. On both sides of
  the wall at which disturbances neither grow nor shrink, a ball is left alone: does it hop on?

An engine may locate a landing to a step only; the difference of two time steps is then the error of the finer one.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from compare.measure.field import constrained
from compare.measure.lab import Lab, coarse_step, time_unit
from compare.measure.record import Measurement, Missing, Records, if_sure, measurement, state_of
from compare.measure.trials import Trial, carry_out, finer, left_alone
from compare.runs.tasks import Task
from compare.statistics import Measured, peaks, top
from model import Case, Flow, Parameters, State, Trajectory
from model.arrays import Array

SET = "hopping"
TOP = State(y=6.4e-3, omega_c=57.3, slip_x=-106.0)
"""A state near the top of a hop of the set."""
HOLD, LAST, LATER = 12.0, 3.0, 2.0
"""How long each flow is held, the last part of it in which the motion is measured, and the first in which disturbances
are too large to be linear, s."""
REFINED = 8, 16
"""Steps of the engine in one of `coarse_step`."""
SAMPLE = 1e-3
"""Sample interval, s: a parabola through three samples then gives a top to 1e-6 of the height."""
WALLS = (1.0, 1.005, 1.015, 1.03, 1.06, 1.1, 1.14, 1.18, 1.22, 1.26, 1.3, 1.34)
"""Friction of the walls along which the hop is followed, in units of that of the set; few balls come to a hop that
start beside it, so that the first steps, with less to extrapolate from, are short."""
NEAR = 4
"""The last walls, among which disturbances come to grow."""
FOLLOWED, ALONE = 10.0, 60.0
"""How long the ball hops at each wall, and how long it is left alone, s."""


class Hops(NamedTuple):
    """The tops of the hops in part of a run: times and angles (n,), and states (n, 8)."""

    time: Array
    theta: Array
    x: Array

    @property
    def values(self) -> dict[str, Measured]:
        """Period, mean angular velocity and height, uncertain by half the range over single hops.

        Disturbances swing while they die out, so that means of parts may agree by chance.
        """
        span, periods, height = self.time[-1] - self.time[0], np.diff(self.time), self.x[:, 0]
        values = {
            "orbit_period": (span / len(periods), periods),
            "orbit_omega_c": ((self.theta[-1] - self.theta[0]) / span, np.diff(self.theta) / periods),
            "orbit_height": (height.mean(), height),
        }
        return {name: Measured(float(mean), float(np.ptp(hops)) / 2) for name, (mean, hops) in values.items()}

    def conditions(self, p: Parameters) -> dict[str, float]:
        """A state at a top, and the period: near a closed orbit."""
        return {**state_of(constrained(Case.NR, self.x[-1], p)), "period": self.values["orbit_period"].value}


def hopping(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Period, orbit, height and the shrinking of disturbances at each flow, and where hopping would begin."""
    yield from _staircase(lab, "recurrent", lab.effort("recurrent.flows"), REFINED)


def stepped(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """The same at the flow of the set, by time stepping: it lets slip begin and turn at steps only."""
    yield from _staircase(lab, "stepped", (1.0,), (40, 80))


def _staircase(
    lab: Lab, protocol: str, shares: Sequence[float], refine: tuple[int, int]
) -> Iterator[Measurement | Missing]:
    p = Parameters.named(SET)
    flows = [share * p.omega_0 for share in shares]
    lasts = HOLD * len(flows)
    samples, flow = round(lasts / SAMPLE), Flow.staircase(flows, HOLD)
    trial = Trial(SET, p, "hops", TOP.stacked(), lasts, refine, samples, flow=flow)
    (result,) = carry_out(lab, protocol, [trial])
    if isinstance(result, Missing):
        yield result
        return
    heights = []
    for k, omega_0 in enumerate(flows):
        q, begin, end = p.replace(omega_0=omega_0), k * HOLD, (k + 1) * HOLD
        coarse, fine = (tops(run, end - LAST, end) for run in (result.coarse, result.fine))
        at = f"at omega_0 = {omega_0:.4g} rad/s"
        if min(len(coarse.time), len(fine.time)) < 6:
            yield Missing(protocol, SET, f"{at} the ball does not hop any more")
            break
        known, conditions = coarse.values, fine.conditions(q)
        heights.append([each["orbit_height"].value for each in (known, fine.values)])
        for quantity, value in fine.values.items():
            sure = finer(known[quantity], value)
            yield measurement(lab, protocol, SET, q, quantity, sure, result.tasks, **conditions)
        if k:
            parts = (result.coarse, LATER), (result.fine, LATER), (result.fine, 2 * LATER)
            slow, fast, later = (hop_map(tops(run, begin + after, end - LAST).x, q)[0] for run, after in parts)
            factor = finer(Measured(slow, 0.0), Measured(fast, abs(fast - later)))
            row = measurement(lab, protocol, SET, q, "orbit_multiplier", factor, result.tasks, **conditions)
            yield if_sure(row, 1.0, f"how disturbances shrink {at} is too uncertain")
    if len(heights) >= 3:
        place = finer(*(birth(flows[: len(heights)], each) for each in zip(*heights, strict=True)))
        yield measurement(lab, protocol, SET, p, "orbit_birth", place, result.tasks)


def tops(run: Trajectory, start: float, end: float) -> Hops:
    """The tops of the hops between two times, those at least half as high as the highest of them."""
    t, y = run.time, run.y
    k, late = peaks(y)
    inside = (t[k] > start) & (t[k] < end)
    high = inside & (y[k] > y[k][inside].max(initial=0.0) / 2)
    k, late = k[high], late[high]
    x, by = run.x, late * (t[1] - t[0])
    states = x[k] + late[:, None] * (x[k + 1] - x[k - 1]) / 2
    states[:, 0], states[:, 1] = top(y, k, late), 0.0
    return Hops(t[k] + by, run.theta[k] + by * run.omega_c[k], states)


def hop_map(states: Array, p: Parameters) -> tuple[float, State]:
    """What states (n, 8) at tops say of the map from hop to hop, linear in height, omega_c and slip_x.

    The modulus of its largest eigenvalue, the factor by which disturbances grow or shrink; and its fixed point.
    """
    units = np.array([p.R, 1 / time_unit(p), math.sqrt(p.g * p.R) / p.r])
    z = states[:, [0, 2, 3]] / units
    changes = np.diff(z, axis=0)
    weight = 1 / np.linalg.norm(changes[:-1], axis=1, keepdims=True)
    matrix = np.linalg.lstsq(weight * changes[:-1], weight * changes[1:])[0]
    shift = z[1:].mean(axis=0) - z[:-1].mean(axis=0) @ matrix
    y, omega_c, slip_x = (units * np.linalg.solve(np.eye(3) - matrix.T, shift)).tolist()
    return float(np.abs(np.linalg.eigvals(matrix)).max()), State(y=y, omega_c=omega_c, slip_x=slip_x)


def birth(flows: Sequence[float], heights: Sequence[float]) -> Measured:
    """Flow at which hops would have no height: a parabola through the last three, uncertain by what a line differs."""
    parabola, line = (float(np.polyfit(heights[-n:], flows[-n:], n - 1)[-1]) for n in (3, 2))
    return Measured(parabola, abs(parabola - line))


def followed(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """The wall beyond which disturbances of the hop grow, and whether balls hop on, on both sides of it."""
    p = Parameters.named(SET)
    walls = [p.replace(eta=share * p.eta) for share in WALLS]
    etas = [q.eta for q in walls]
    steady = [TOP.stacked().repeat(2).reshape(8, 2).T]  # where hops return to themselves, with both steps (2, 8)
    factors, tasks, near = [], [], []
    for k, q in enumerate(walls):
        ahead = steady[-1]
        if k > 1:
            ahead = steady[-2] + (q.eta - etas[k - 2]) / (etas[k - 1] - etas[k - 2]) * (steady[-1] - steady[-2])
        pair = [_followed(lab, q, x, FOLLOWED, refined) for x, refined in zip(ahead, REFINED, strict=True)]
        runs = lab.attempt(pair)
        hops = [] if isinstance(runs, str) else [tops(run, LATER, FOLLOWED) for run in runs]
        if isinstance(runs, str) or min(len(each.time) for each in hops) < 8:
            why = f"the run {runs}" if isinstance(runs, str) else "the ball does not hop"
            yield Missing("followed", SET, f"at eta = {q.eta:.4g} {why}")
            return
        maps = [hop_map(each.x, q) for each in (*hops, tops(runs[1], 2 * LATER, FOLLOWED))]
        factors.append([factor for factor, _ in maps])
        steady.append(np.array([state for _, state in maps[:2]]))
        tasks.append(pair)
        near.append(hops[1].conditions(q))
    place = death(etas[-NEAR:], factors[-NEAR:])
    used = [task for pair in tasks[-NEAR:] for task in pair]
    yield measurement(lab, "followed", SET, walls[-NEAR], "orbit_death", place, used, **near[-NEAR])
    again = [_followed(lab, walls[k], tasks[k][1].x0, ALONE, REFINED[0]) for k in (-NEAR, -1)]
    yield from left_alone(lab, "followed", SET, again)


def _followed(lab: Lab, p: Parameters, x: npt.ArrayLike, lasts: float, refined: int) -> Task:
    return lab.task(p, x, lasts, coarse_step(p) / refined, samples=round(lasts / SAMPLE))


def death(etas: Sequence[float], factors: Sequence[Sequence[float]]) -> Measured:
    """The wall at which disturbances neither grow nor shrink, by lines through eta (n,) and factors (n, 3).

    Factors are those with the coarser step, with the finer one, and in a later part of the run with the finer one.
    """
    slow, fast, later = (float(np.polyfit(np.array(each) - 1, etas, 1)[-1]) for each in zip(*factors, strict=True))
    return finer(Measured(slow, 0.0), Measured(fast, abs(fast - later)))
