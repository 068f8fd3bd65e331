"""Motions that never settle: a ball that hops for ever, one that swings; do others?"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from compare.campaign.sweep import sobol
from compare.campaign.tasks import Task
from compare.engines.study import MOREAU
from compare.method.conditions import Conditions, state_of
from compare.method.protocol import Protocol
from compare.method.quantities import QUANTITIES
from compare.method.record import Measured, Records, Sets, if_found
from compare.method.runner import Runner, coarse_step
from compare.method.scales import time_unit
from compare.method.settling import settled_readings
from compare.method.statistics import Estimate, estimate, hops, peaks, settled_case, tail, top
from compare.method.step_pairs import (
    Start,
    StepPair,
    at_zero_step,
    carry_out,
    constrained,
    of_no_order,
)
from model import Case, Flow, Parameters, State, Trajectory
from model.arrays import Array

SET = "hopping"
TOP = State(y=6.4e-3, omega_c=57.3, slip_x=-106.0)  # near the top of a hop of the set
# times in s
HOLD = 12.0  # for which each flow is held
MEASURED = 3.0  # the last part of it, which is measured
DISTURBED = 2.0  # the first part of it, in which disturbances are not yet linear
FOLLOWED = 10.0  # for which a hop is followed at a wall
LEFT_ALONE = 60.0  # for which it is then left alone
SWINGING = 24.0  # for which a ball swings
SWUNG = 4.0  # the last part of it, which is measured
SAMPLE = 1e-3  # between samples: a parabola through three gives a top to 1e-6 of the height
PARTS = 128  # times of a swing for which omega_c is averaged
# time steps in a coarse one
HOPS_DIVISORS, STEPPED_DIVISORS = (16, 32), (40, 80)  # the latter by time stepping
FOLLOWED_DIVISORS = 64, 128
"""Those with which a hop is followed. (With those above its end was off by two tolerances: how
disturbances grow is of no clear order there. Chosen after that was seen.)"""


def recurrent(runner: Runner, sets: Sets, records: Records) -> Measured:
    """Hops at flows that fall in held steps."""
    return _hopping(runner, runner.sampling.recurrent_flows, HOPS_DIVISORS)


def stepped(runner: Runner, sets: Sets, records: Records) -> Measured:
    """Hops at the flow of the set by time stepping, in which slip begins and turns at whole steps
    only."""
    return _hopping(runner, (1.0,), STEPPED_DIVISORS)


def _hopping(runner: Runner, shares: Sequence[float], divisors: tuple[int, int]) -> Measured:
    """Period, orbit, height, shrinking of disturbances by flow, from the tops of hops; and where
    hopping begins: the flow at which hops would have no height.

    At flows that are these shares of that of the set, with so many time steps in a coarse one."""
    p = Parameters.named(SET)
    flows = [share * p.omega_0 for share in shares]
    lasts, flow = HOLD * len(flows), Flow.staircase(flows, HOLD)
    samples = round(lasts / SAMPLE)
    pair = StepPair(SET, p, "hops", TOP.stacked(), lasts, divisors, samples, flow=flow)
    for result in (yield from carry_out(runner, [pair])):
        heights = []
        for k, omega_0 in enumerate(flows):
            q, end, at = p.replace(omega_0=omega_0), (k + 1) * HOLD, f"at {omega_0:.4g} rad/s"
            coarse, fine = (tops(run, end - MEASURED, end) for run in result.reads)
            if min(len(coarse.time), len(fine.time)) < 6:
                yield runner.missing(SET, f"{at} the ball does not hop any more")
                break
            row = partial(runner.measurement, SET, q, tasks=result.tasks, **fine.conditions(q))
            for name, value in fine.values.items():
                yield row(quantity=name, value=of_no_order(coarse.values[name].value, value))
            if k:
                begin, last = k * HOLD + DISTURBED, end - MEASURED
                coarse_run, run = result.reads
                parts = (coarse_run, begin), (run, begin), (run, begin + DISTURBED)
                factors = (hop_map(tops(of, start, last).x, q)[0] for of, start in parts)
                growth = row(quantity="orbit_multiplier", value=_limit(of_no_order, *factors))
                yield if_found(growth, f"{at} no disturbance is seen to shrink")
            heights.append([each.values["orbit_height"].value for each in (coarse, fine)])
        if len(heights) >= 3:
            births = [birth(flows[: len(heights)], each) for each in zip(*heights, strict=True)]
            yield result.row("orbit_birth", at_zero_step(births[0].value, births[1]))


def _limit(
    by: Callable[[float, Estimate], Estimate], coarse: float, fine: float, later: float
) -> Estimate:
    """A number for a vanishing step, by what it is with two steps and in a later part of the run
    with the finer one, which should not differ."""
    return by(coarse, estimate(fine, part=abs(fine - later)))


def with_groups(p: Parameters, kappa: float, Omega_0: float, **others: float) -> Parameters:
    """The set p with kappa = c sqrt(R/g) and Omega_0 = omega_0 sqrt(R/g), and other parameters."""
    return p.replace(**others, c=kappa / time_unit(p), omega_0=Omega_0 / time_unit(p))


class Hops(NamedTuple):
    """The tops of the hops in part of a run: times and angles (n,), and states (n, 8)."""

    time: Array
    theta: Array
    x: Array

    @property
    def values(self) -> dict[str, Estimate]:
        """Period, mean angular velocity and height, uncertain by half the range over single hops.

        Means of two parts could agree by chance, because disturbances swing while they die out."""
        span, periods, height = self.time[-1] - self.time[0], np.diff(self.time), self.x[:, 0]
        turn, turns = self.theta[-1] - self.theta[0], np.diff(self.theta)

        def mean(value: float, hops: Array) -> Estimate:
            return estimate(value, swing=float(np.ptp(hops)) / 2)

        return {
            "orbit_period": mean(span / len(periods), periods),
            "orbit_omega_c": mean(turn / span, turns / periods),
            "orbit_height": mean(height.mean(), height),
        }

    def conditions(self, p: Parameters) -> Conditions:
        """Conditions of a measurement: a state at a top, and the period, near a closed orbit."""
        state = state_of(constrained(Case.NR, self.x[-1], p))
        return state | Conditions(period=self.values["orbit_period"].value)


def tops(run: Trajectory, start: float, end: float) -> Hops:
    """The tops of hops between two times, at least half as high as the highest."""
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
    """The map from hop to hop, linear in height, omega_c, slip_x, of states (n, 8) at tops.

    The modulus of its largest eigenvalue, by which disturbances grow; and its fixed point."""
    units = np.array([p.R, 1 / time_unit(p), math.sqrt(p.g * p.R) / p.r])
    z = states[:, [0, 2, 3]] / units
    changes = np.diff(z, axis=0)
    weight = 1 / np.linalg.norm(changes[:-1], axis=1, keepdims=True)
    matrix = np.linalg.lstsq(weight * changes[:-1], weight * changes[1:])[0]
    shift = z[1:].mean(axis=0) - z[:-1].mean(axis=0) @ matrix
    y, omega_c, slip_x = (units * np.linalg.solve(np.eye(3) - matrix.T, shift)).tolist()
    fixed = State(y=y, omega_c=omega_c, slip_x=slip_x)
    return float(np.abs(np.linalg.eigvals(matrix)).max()), fixed


def birth(flows: Sequence[float], heights: Sequence[float]) -> Estimate:
    """Flow at which hops would have no height: by a parabola, uncertain by a line."""
    parabola, line = (float(np.polyfit(heights[-n:], flows[-n:], n - 1)[-1]) for n in (3, 2))
    return estimate(parabola, degree=abs(parabola - line))


WALLS = (1.0, 1.005, 1.015, 1.03, 1.06, 1.1, 1.14, 1.18, 1.22, 1.26, 1.3, 1.34)
"""eta of the walls along which the hop is followed, in units of that of the set. The first steps
are short: their starts are extrapolated from one or two hops, which attract from nearby only."""


def followed(runner: Runner, sets: Sets, records: Records) -> Measured:
    """The wall friction beyond which disturbances grow; do balls hop on, on both sides?

    A hop is followed along rougher walls to there."""
    p = Parameters.named(SET)
    walls = [p.replace(eta=share * p.eta) for share in WALLS]
    etas = [q.eta for q in walls]

    def task(q: Parameters, x: Array, lasts: float, divisor: int) -> Task:
        return runner.task(q, x, lasts, coarse_step(q) / divisor, samples=round(lasts / SAMPLE))

    # fixed points of the map from hop to hop, with both steps (2, 8)
    steady = [np.array([TOP.stacked()] * 2)]
    factors, tasks = [], []
    for k, q in enumerate(walls):
        ahead = steady[-1]
        if k > 1:
            way = (q.eta - etas[k - 2]) / (etas[k - 1] - etas[k - 2])
            ahead = steady[-2] + way * (steady[-1] - steady[-2])
        both = zip(ahead, FOLLOWED_DIVISORS, strict=True)
        tasks.append([task(q, x, FOLLOWED, divisor) for x, divisor in both])
        (runs,) = runner.groups(tasks[-1:])
        if isinstance(runs, str):
            yield runner.missing(SET, f"at eta = {q.eta:.4g} the run {runs}")
            return
        begun = zip((*runs, runs[1]), (DISTURBED, DISTURBED, 2 * DISTURBED), strict=True)
        parts = [tops(run, begin, FOLLOWED) for run, begin in begun]
        if min(len(each.time) for each in parts[:2]) < 8:
            yield runner.missing(SET, f"at eta = {q.eta:.4g} the ball does not hop")
            return
        growths, fixed = zip(*(hop_map(each.x, q) for each in parts), strict=True)
        factors.append(growths)
        steady.append(np.array(fixed[:2]))
        if q is walls[-4]:  # disturbances begin to grow at one of the last four walls
            near = parts[1].conditions(q)
    place, used = death(etas[-4:], factors[-4:]), [task for pair in tasks[-4:] for task in pair]
    yield runner.measurement(SET, walls[-4], "orbit_death", place, used, **near)
    last = [(walls[k], np.array(tasks[k][1].x0)) for k in (-4, -1)]
    again = [task(q, x, LEFT_ALONE, FOLLOWED_DIVISORS[0]) for q, x in last]
    yield from _hops_at_end(runner, SET, again)


RESTITUTIONS = tuple(round(0.04 * k, 2) for k in range(18))
"""From which coefficient of restitution to the next a rebounding ball is followed."""
REBOUNDING, REBOUNDS_ALONE = (0.0, 0.2, 0.4, 0.48, 0.6), 20.0
"""At which of them it is run without further change, and how long, s. (0.6 is among them since
results had been seen: at 0.56 disturbances grow so slowly that this doesn't show it.)"""


def rebounding(runner: Runner, sets: Sets, records: Records) -> Measured:
    """Whether balls that rebound hop on, and their hops, followed from one coefficient of
    restitution to the next.

    By time stepping: MuJoCo's contacts have no such coefficient. At some, and at the first at which
    a ball no longer hops, it is run without further change, with a half and a quarter of the
    step."""
    p, x = Parameters.named(SET), TOP.stacked()

    def task(x: Array, lasts: float, restitution: float, divisor: int = 40) -> Task:
        step = coarse_step(p) / divisor
        settings = MOREAU.configure({"timestep": step, "restitution": restitution}, p)
        usual = runner.task(p, x, lasts, step, samples=round(lasts / SAMPLE))
        return replace(usual, settings=settings)

    for e in RESTITUTIONS:
        (run,) = runner.campaign.run([task(x, MEASURED, e)])
        if hops(run):
            last = tops(run, 0.0, MEASURED)
            # the hops swing about their mean, and attract from nearby only
            x = last.x[-8:].mean(axis=0)
        elif not e:
            yield runner.missing(SET, "the ball does not hop")
            return
        if not hops(run) or e in REBOUNDING:
            alone = [task(x, REBOUNDS_ALONE, e, divisor) for divisor in (80, 160)]
            runs = runner.campaign.run(alone)
            at = last.conditions(p) | {"restitution": e, "duration": REBOUNDS_ALONE}
            yield runner.measurement(SET, p, "hops", hops(runs[0]), alone[:1], **at)
            if not hops(runs[0]):
                return
            coarse, fine = (tops(run, REBOUNDS_ALONE / 2, REBOUNDS_ALONE).values for run in runs)
            for name in ("orbit_period", "orbit_omega_c"):
                value = at_zero_step(coarse[name].value, fine[name])
                yield runner.measurement(SET, p, name, value, alone, **at)


def death(etas: Sequence[float], factors: Sequence[Sequence[float]]) -> Estimate:
    """The wall friction at which disturbances neither grow nor shrink, by lines through eta (n,).

    Factors (n, 3) are those with the coarser step, with the finer one, and in a later part of the
    run with the finer one."""
    ways = zip(*factors, strict=True)
    places = [float(np.polyfit(np.array(each) - 1, etas, 1)[-1]) for each in ways]
    return _limit(at_zero_step, *places)


def swing(runner: Runner, sets: Sets, records: Records) -> Measured:
    """Period, mean and size of the swing of omega_c beside a Hopf point, on a very rough floor.

    The ball slips at both points. With other steps the floor's contact, a hundredth of the weight,
    opens and closes."""
    p = sets["reference"].replace(mu=2.5, eta=0.38, c=1.0, omega_0=24.648)
    x0 = State(omega_c=22.39, slip_x=-0.03, slip_z=0.26).stacked()
    pair = StepPair("reference", p, "swing", x0, SWINGING, (60, 80), 12_000)
    # a disturbance that halves in half of the run has left less than it lost since (chosen after
    # the part just before had shown a quarter of that)
    end, half = SWINGING - SWUNG, SWINGING / 2 - SWUNG
    for result in (yield from carry_out(runner, [pair])):
        coarse, fine = result.reads
        if any(np.any(run.case[run.time > end] != Case.SS) for run in (coarse, fine)):
            yield runner.missing("reference", "the ball does not slip at both points for ever")
            return
        parts = [_swing(run, start) for run, start in ((coarse, end), (fine, end), (fine, half))]
        at = state_of(constrained(Case.SS, fine.x[-1], p)) | Conditions(period=parts[1][0])
        names = "swing_period", "swing_omega_c", "swing_size"
        for name, *values in zip(names, *parts, strict=True):
            yield result.row(name, _limit(at_zero_step, *values), **at)


def _swing(run: Trajectory, start: float) -> tuple[float, float, float]:
    """Period, mean and size of the swing of omega_c in the part of a run after a time."""
    inside = (run.time > start) & (run.time <= start + SWUNG)
    time, omega_c = run.time[inside], run.omega_c[inside]
    # where it rises through its middle: tops are too flat to tell a time where loads are rough
    middle = (omega_c.min() + omega_c.max()) / 2
    k = np.flatnonzero((omega_c[:-1] < middle) & (omega_c[1:] >= middle))
    late = (middle - omega_c[k]) / (omega_c[k + 1] - omega_c[k])
    at = time[k] + late * (time[1] - time[0])
    span, turn = at[-1] - at[0], np.diff(np.interp(at[[0, -1]], run.time, run.theta))[0]
    spans = (np.linspace(*ends, PARTS) for ends in pairwise(at.tolist()))
    periods = [np.interp(times, time, omega_c) for times in spans]
    return float(span / len(periods)), float(turn / span), float(np.ptp(np.mean(periods, axis=0)))


def calm(runner: Runner, sets: Sets, records: Records) -> Measured:
    """Whether balls hop after 60/c of the weakest drag: three of each of 16 sets."""
    reference, rng, tasks = sets["reference"], np.random.default_rng(5), []
    low, high = np.array([0.05, 0.05, 0.2, 2.0, 0.5]), np.array([1.0, 1.0, 0.6, 8.0, 6.0])
    for mu, eta, j, kappa, Omega_0 in (low + sobol(len(low), 16, 5) * (high - low)).tolist():
        p = with_groups(reference, kappa, Omega_0, mu=mu, eta=eta, j=j)
        lasts = 60.0 * time_unit(p) / low[3]
        for _ in range(3):
            slips = p.omega_0 * p.R / p.r * rng.uniform(-2, 2, 3)
            x = State(rng.uniform(0, p.R), 0.0, p.omega_0 * rng.uniform(-0.5, 2), *slips)
            tasks.append(runner.task(p, x, lasts, coarse_step(p) / 4, samples=2000))
    yield from _hops_at_end(runner, "strong drag", tasks)
    for task, run in zip(tasks, runner.each(tasks), strict=True):
        if not isinstance(run, str) and not hops(run):
            p, last, case = task.parameters, run.omega_c[tail(run)], settled_case(run).name
            # By chance samples may be the same: no state is known better than a settled one.
            least = QUANTITIES["omega_c"].resolution * p.omega_0
            end = estimate(last[-1], swing=max(float(np.ptp(last)), least))
            yield runner.measurement("strong drag", p, "end_omega_c", end, [task], case=case)


def _hops_at_end(runner: Runner, set: str, tasks: list[Task]) -> Measured:
    """Whether each ball hops at the end of a run from a state: 1 or 0."""
    for task, run in zip(tasks, runner.each(tasks), strict=True):
        if isinstance(run, str):
            yield runner.missing(set, f"a run {run}")
        else:
            at = Conditions(duration=task.t_end) | state_of(State.of(task.x0).stacked())
            yield runner.measurement(set, task.parameters, "hops", hops(run), [task], **at)


def choice(runner: Runner, sets: Sets, records: Records) -> Measured:
    """Case and omega_c of what a ball settles to from rest, in a flow above omega_01.

    On floors so rough (mu > 1) that forces allow rolling and slipping both."""
    p = sets["reference"]
    one = {"mu": 1.7222, "eta": 0.0388, "j": 0.482, "r": 0.292 * p.R}
    two = {"mu": 1.2277, "eta": 0.1721, "j": 0.611, "r": 0.154 * p.R}
    rough = with_groups(p, 0.1099, 2.635, **one), with_groups(p, 0.1198, 2.099, **two)
    starts = [Start(f"rough-floor-{k}", q, "rest", np.zeros(8)) for k, q in enumerate(rough, 1)]
    yield from settled_readings(runner, starts[: runner.sampling.choice_sets])


PROTOCOLS = (
    Protocol("recurrent", recurrent),
    Protocol("stepped", stepped),
    Protocol("choice", choice),
    Protocol("followed", followed),
    Protocol("rebounding", rebounding),
    Protocol("swing", swing),
    Protocol("calm", calm),
)
