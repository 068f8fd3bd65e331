"""Motions with one time step and with shorter ones, whose differences show the error; polynomials
through records of a few steps, which give values and rates of change."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Unpack

import numpy as np

from compare.campaign.tasks import Task
from compare.method.conditions import Conditions
from compare.method.record import Found, Measurement, Missing
from compare.method.runner import Runner, coarse_step
from compare.method.scales import time_unit
from compare.method.statistics import Estimate, uniform
from model import Case, Contact, Flow, Parameters, State
from model.arrays import Array
from model.cases import TRAITS
from model.kinematics import VARIABLES


@dataclass(frozen=True, eq=False)
class Start:
    """From where a run begins."""

    set: str
    p: Parameters
    name: str
    x0: Array


@dataclass(frozen=True, eq=False)
class StepPair(Start):
    """A motion that is run with two time steps, or three; or with one, for no error."""

    t_end: float  #: s
    divisors: tuple[int, ...]  #: time steps in one of `coarse_step`, the fewest first
    samples: int | None = None  #: None for every step
    read: Callable[..., Any] = lambda run: run  #: what is read from the runs with one time step
    flow: Flow | None = None
    together: tuple[StepPair, ...] = ()
    """Motions in the place of this one that are read together: other parameters, starts, flows."""
    at: Conditions = field(default_factory=Conditions)  #: of all measurements of this pair
    rows: int = 1  #: measurements that are left out if a run breaks down


@dataclass(frozen=True, eq=False)
class StepPairResult:
    """What was read from a pair with each time step."""

    runner: Runner
    pair: StepPair
    tasks: Sequence[Task] = field(repr=False)  #: the runs, those with the coarsest step first
    reads: Sequence[Any]  #: one for each step, the coarsest first

    @property
    def coarse(self) -> Any:
        """What was read with the finest step but one."""
        return self.reads[-2]

    @property
    def fine(self) -> Any:
        """What was read with the finest step."""
        return self.reads[-1]

    def row(self, quantity: str, value: Estimate | float, **at: Unpack[Conditions]) -> Measurement:
        """A measurement of this pair."""
        pair, at = self.pair, self.pair.at | at
        return self.runner.measurement(pair.set, pair.p, quantity, value, self.tasks, **at)

    def missing(self, why: str) -> Missing:
        """All measurements of this pair as missing, and why."""
        return self.runner.missing(self.pair.set, why, self.pair.rows)


def results_of(runner: Runner, pairs: Sequence[StepPair]) -> Iterator[StepPairResult | Missing]:
    """Run all pairs, and read each; those of which a run broke down are missing."""
    tasks = [_tasks(runner, pair) for pair in pairs]
    for pair, own, runs in zip(pairs, tasks, runner.groups(tasks), strict=True):
        if isinstance(runs, str):
            yield runner.missing(pair.set, f"{pair.name}: the run {runs}", pair.rows)
        else:
            each = len(runs) // len(pair.divisors)
            reads = [pair.read(*runs[k : k + each]) for k in range(0, len(runs), each)]
            yield StepPairResult(runner, pair, own, reads)


def _tasks(runner: Runner, pair: StepPair) -> list[Task]:
    """The runs of a pair, those with the coarsest step first."""
    tasks = []
    for step in (coarse_step(pair.p) / divisor for divisor in pair.divisors):
        samples = pair.samples or round(pair.t_end / step)
        for one in pair.together or (pair,):
            task = runner.task(one.p, one.x0, pair.t_end, step, flow=one.flow, samples=samples)
            tasks.append(task)
    return tasks


def carry_out(runner: Runner, pairs: Iterable[StepPair]) -> Found[list[StepPairResult]]:
    """What was read from pairs; those of which a run broke down are missing."""
    return (yield from without_missing(results_of(runner, [*pairs])))


def without_missing(found: Iterable[StepPairResult | Missing]) -> Found[list[StepPairResult]]:
    """What was read; what is missing is handed in."""
    results = []
    for each in found:
        if isinstance(each, Missing):
            yield each
        else:
            results.append(each)
    return results


EXTRAPOLATION, DOUBT = 1 / 2, 1 / math.sqrt(12)
"""By how much the limit of a vanishing step lies beyond the run with half the step, and its
standard uncertainty, in differences of the two runs.

The error of the finer run is as large as the difference if it is of first order in the step, a
third of it if of second, and next to none where it is what is left of the start: contacts forget
that by a factor in each step (`ContactSettings.contact_decay`, up to 0.95), and twice the steps
forget much more. So it is anything between none and all of the difference: a uniform
distribution."""


def at_zero_step(coarse: float, fine: Estimate, **causes: float) -> Estimate:
    """The limit of a vanishing step of a number that is a smooth function of it, from the values
    with a step and with half of it; with further causes of error."""
    change = fine.value - coarse
    limit = replace(fine, value=fine.value + change * EXTRAPOLATION)
    return limit.also(time_step=abs(change) * DOUBT, **causes)


def of_no_order(coarse: float, fine: Estimate) -> Estimate:
    """What is off in no clear order of the step, from the values with a step and with half of it:
    as uncertain as the difference.

    Balls that hop land at any part of a step, and peaks of small differences show what contacts
    forget from step to step. (A limit was sought beyond both, until orbits of the default level had
    been seen 3.2 uncertainties off, and a blind round had raised a false alarm by a peak.)"""
    return fine.also(time_step=abs(fine.value - coarse))


def of_three_steps(values: Array) -> tuple[Array, Array]:
    """Limits (n,) of a vanishing step of values (3, n) with a step, half of it, and a quarter,
    in two ways, each (n,).

    The first is free of errors of first and second order. The second is by the order that each
    number shows, no less than the first, or by second order alone, whichever is farther from the
    first. Where one power of the step is all there is, the order that shows is right; where the
    first two are, the first way. The difference bounds the first's error where the motion is so
    short that further orders are smaller. (Second order alone was added after an error of 5
    uncertainties had been seen. It fell as if by first order between the longer steps and faster
    then, so that two ways agreed by chance.)"""
    before, last = np.diff(values, axis=0)
    ratios = np.divide(last, before, out=np.zeros_like(last), where=before != 0)
    ratios = np.clip(ratios, 0.0, 0.5)
    limits = values[2] + (5 * last - before) / 3
    ways = values[2] + last * np.stack([ratios / (1 - ratios), np.full_like(last, 1 / 3)])
    farther = np.argmax(np.abs(ways - limits), axis=0)
    return limits, np.take_along_axis(ways, farther[None], axis=0)[0]


SURER = 1 / 8
"""The share in `unlike` of changes that three ways show, which seldom agree by chance. (Chosen with
the results of quick in sight. Of 1496 rates and forces of six other sets none is then off by three
uncertainties.)"""


def unlike(changes: Array, share: float = 1 / 4) -> Array:
    """Changes (n, ...) as uncertainties go by them: each by its own size, and by a share of the
    largest.

    A change is a sum of parts of first order and of what is left of the start. Where they cancel by
    chance it is little, but what is left of them once the step is extrapolated isn't; and equations
    couple the numbers, so that their parts are of like size. (A quarter was chosen after results
    had been seen: with a tenth 3 of 2104 numbers were off by more than three uncertainties. That
    was before `of_three_steps` looked three ways, see `SURER`.)"""
    sizes = np.abs(changes)
    return np.asarray(np.hypot(sizes, share * sizes.max(initial=0.0)))


STEP_RATIO = 16
"""Steps in one of `coarse_step`; the finer run has twice as many. With shorter ones the studies'
settings come to the engine's least impedance, and contacts then answer no faster."""
HALF_WINDOW, WINDOW_DEGREES = 8, (5, 3)
"""Half the width of a window in the middle of a motion, in steps of the coarser run; degrees of the
polynomials through it, of which the lower one shows what the degree changes."""


def lag_error(runner: Runner, p: Parameters, divisor: int = 1) -> float:
    """Standard uncertainty of a force divided by the weight, where halving the step may by chance
    change nothing.

    The error is at most half the square of `Engine.lag` in units of `time_unit`: the second order,
    once the first is extrapolated. The steps of `STEP_RATIO` may be divided by `divisor`."""
    lag = runner.engine.lag * coarse_step(p) / (STEP_RATIO * divisor)
    return uniform((lag / time_unit(p)) ** 2 / 2)


def polynomials(
    time: Array, values: Array, degrees: tuple[int, int], at: float = 0.0
) -> tuple[Array, Array]:
    """Values and slopes at a time, each (2, ...), of polynomials of two degrees through values
    (n, ...) in least squares."""
    unit = float(np.ptp(time)) / 2
    powers = [np.vander((time - at) / unit, degree + 1, increasing=True) for degree in degrees]
    fits = [np.linalg.lstsq(each, values, rcond=None)[0] for each in powers]
    return np.array([fit[0] for fit in fits]), np.array([fit[1] / unit for fit in fits])


def random_state(case: Case, p: Parameters, rng: np.random.Generator) -> Array:
    """A state (8,) that satisfies the constraints of a case, in which friction has something to
    spare; a ball that the wall alone keeps from turning spins backwards about its radial axis."""
    unit, speed = time_unit(p), math.sqrt(p.g * p.R)
    slips = rng.uniform(0.4, 1.0, 3) * rng.choice([-1, 1], 3) * speed / p.r
    omega_c = rng.uniform(0.4, 1.6) / unit
    if case.A is Contact.R and case.B is not Contact.N:
        omega_c = rng.uniform(0.2, 0.7) / unit * min(1.0, math.sqrt(p.mu), math.sqrt(p.mu / p.j))
    if case.B is Contact.R and case.A is not Contact.R:
        hangs = 1.0 if case.A is Contact.N else p.mu
        omega_c = rng.uniform(1.05, 1.3) / unit * max(1.0, math.sqrt(hangs / max(p.eta, 0.01)))
        slips[0] = -rng.uniform(0.6, 1.2) * p.R * omega_c / p.r
    values = {
        "y": rng.uniform(0.2, 0.6) * p.R,
        "v_y": rng.uniform(-0.2, 0.3) * speed,
        "omega_c": omega_c,
        **dict(zip(("slip_x", "slip_y", "slip_z"), slips, strict=True)),
        "h": rng.uniform(0.3, 0.5) * p.R,
        "v_h": rng.uniform(-0.2, 0.3) * speed,
    }
    x = np.array([values[name] if name in TRAITS[case].active else 0.0 for name in VARIABLES])
    return constrained(case, x, p)


def constrained(case: Case, x: Array, p: Parameters) -> Array:
    """The state (8,) with what the case holds at zero set to exactly that."""
    held = [name in TRAITS[case].constraints for name in VARIABLES]
    x = np.where(held, 0.0, x)
    return State.of(x)._replace(slip_z=-State.of(x).v_h / p.r).stacked() if case is Case.RN else x
