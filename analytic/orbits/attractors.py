"""Attractors: whether motions from one start or many become stationary, periodic, or neither.

A run is followed window by window until it repeats what it did; any simulator may carry it out. A
recurrent motion is closed to an orbit by theory (`orbits`). One for which no stable orbit is found
is chaotic if neighbours of it part exponentially, else quasi-periodic. A run whose time is over
before that stays undecided, with its last window."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from enum import StrEnum
from itertools import islice

import numpy as np
import numpy.typing as npt

from analytic.orbits import periodic as orbits
from analytic.orbits.periodic import NoOrbitError, Orbit, active_variables, extent
from analytic.simulation.ensemble import interval, random_starts
from analytic.simulation.simulator import simulate
from analytic.stationary.solutions import StationarySolution, stable_solutions
from model import Case, InputError, Parameters, SimulationError, Trajectory
from model.arrays import Array
from model.cases import TRAITS
from model.errors import check_type
from model.kinematics import VARIABLES, full_state, state_units
from model.parameters import POSITIVE, check_number

WINDOW, WINDOW_SAMPLES = 100.0, 4000
"""Length of a window in units of sqrt(R/g), and samples in it."""
LASTING = 60.0
"""How long a run is followed, in units of 1/c."""
STATIONARY_RANGE = 1e-3
"""Range over a window, in natural units, below which a motion that still shrinks is stationary."""
NEAR = 1e-2
"""Distance in natural units up to which it is that of a stationary solution."""
ALIKE = 0.05
"""Distance relative to the motion's range up to which states, means and extremes are the same."""
GROWING = 400.0
"""Duration over which the Lyapunov exponent is taken, in units of sqrt(R/g)."""
APART = 1e-6
"""Distance in natural units of the two motions whose growing apart is the Lyapunov exponent."""
SIDE_BY_SIDE = 16
"""Runs that are followed at once: their windows take some 20 MB."""

Runs = Callable[[Parameters, Array, float, float], Sequence[Trajectory]]
"""A simulator: parameters, starts (n, 8), duration in s, sample interval in s; of a run that breaks
down what there is, with the reason in its header."""


class Kind(StrEnum):
    """The kind of attractor that a motion approaches."""

    STATIONARY = "stationary"
    PERIODIC = "periodic"
    QUASI_PERIODIC = "quasi-periodic"
    CHAOTIC = "chaotic"
    UNDECIDED = "undecided"


@dataclass(frozen=True)
class LimitSet:
    """The limit set of one run, and the last part of the run."""

    kind: Kind
    last: Trajectory
    """Its last window."""
    period: float = math.nan
    """s, as seen in the window; nan unless it is periodic."""
    solution: StationarySolution | None = None
    """The stationary solution that it came to, if theory has it."""
    orbit: Orbit | None = None
    """The periodic motion, as theory has it."""
    exponent: float = math.nan
    """Largest Lyapunov exponent, s-1, where it was taken."""
    failure: str = ""
    """Why the run broke down, if it did."""

    def same(self, other: LimitSet) -> bool:
        """Whether two runs came to one attractor; all that are undecided count as one."""
        if self.kind is not other.kind or (self.solution is None) is not (other.solution is None):
            return False
        if self.solution and other.solution:
            return self.solution.case is other.solution.case
        return self.kind is Kind.UNDECIDED or _windows_agree(self.last, other.last)


@dataclass(frozen=True)
class Attractor:
    """An attractor, and how many of the starts came to it."""

    limit: LimitSet
    """Of the one that settled first."""
    count: int
    starts: int
    """How many starts came to it, and how many there were."""

    @property
    def share(self) -> float:
        """Share of the starts that came to it."""
        return self.count / self.starts

    @property
    def interval(self) -> tuple[float, float]:
        """The share's confidence interval, `ensemble.interval`."""
        return interval(self.count, self.starts)

    @property
    def run(self) -> Trajectory:
        """The motion on it: a period by theory if there is an orbit, else a run's last window."""
        return self.limit.orbit.cycle if self.limit.orbit else self.limit.last


def event_driven(p: Parameters, x0s: Array, duration: float, interval: float) -> list[Trajectory]:
    """Event-driven simulations from states x0s (n, 8), in as many threads as cores; see `Runs`."""

    def motion(x0: Array) -> Trajectory:
        try:
            return simulate(p, x0, duration, sample_interval=interval, initial_impact=True)
        except SimulationError as error:
            run: Trajectory = error.trajectory
            return run

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(motion, x0s))


def attractors(
    p: Parameters,
    starts: int | npt.ArrayLike = 20,
    *,
    seed: int = 0,
    lasting: float | None = None,
    run: Runs = event_driven,
    progress: Callable[[float], None] = lambda done: None,
) -> list[Attractor]:
    """The attractors that balls approach from many starts, the most frequent first.

    Parameters
    ----------
    starts : number of random starts (`ensemble.random_starts`), or states of shape (n, 6 or 8)
    lasting : how long a run is followed at most, s; `LASTING`/c if None
    run : the simulator that carries out the runs
    progress : called with the share of the starts that came to an attractor, from time to time

    Raises `InputError` if a start or a number is out of range, or c = 0 without `lasting`."""
    check_type("p", p, Parameters)
    states = (
        random_starts(p, starts, seed)
        if isinstance(starts, int)
        else np.atleast_2d(full_state(starts))
    )
    if lasting is None and p.c == 0:
        raise InputError("c = 0 s-1 leaves motions undamped: say how long to follow them (lasting)")
    duration = LASTING / p.c if lasting is None else check_number("lasting", lasting, "s", POSITIVE)
    groups, window = list[list[LimitSet]](), WINDOW * math.sqrt(p.R / p.g)
    todo = (_follow_to_attractor(p, x, duration, run, groups) for x in states)
    following = [(each, next(each)) for each in islice(todo, SIDE_BY_SIDE)]
    while following:
        windows = run(p, np.array([x for _, x in following]), window, window / WINDOW_SAMPLES)
        goes_on = []
        for (each, _), seen in zip(following, windows, strict=True):
            try:
                goes_on.append((each, each.send(seen)))
            except StopIteration as settled:
                limit: LimitSet = settled.value
                group = next((group for group in groups if group[0].same(limit)), None)
                if group is None:
                    groups.append(group := [])
                group.append(limit)
        progress(sum(map(len, groups)) / len(states))
        more = islice(todo, SIDE_BY_SIDE - len(goes_on))
        following = goes_on + [(each, next(each)) for each in more]
    groups.sort(key=len, reverse=True)
    return [Attractor(group[0], len(group), len(states)) for group in groups]


def _follow_to_attractor(
    p: Parameters, x: Array, lasting: float, run: Runs, known: Sequence[Sequence[LimitSet]]
) -> Generator[Array, Trajectory, LimitSet]:
    """Decide which attractor the motion from x approaches within `lasting` seconds.

    A generator: it yields where it needs the next window from, is sent that, returns the limit set.

    Stationary is what hardly moves, and less than before. Where two windows are alike the motion is
    recurrent: it has the limit set of one of the `known` groups, or closes; if it does neither, its
    largest Lyapunov exponent decides."""
    solutions, unit = stable_solutions(p), math.sqrt(p.R / p.g)
    seen, recurrent = list[Trajectory](), False
    for _ in range(math.ceil(lasting / (WINDOW * unit))):
        now = yield x
        if now.header.failure:
            return LimitSet(Kind.UNDECIDED, now, failure=now.header.failure)
        x, seen = now.x[-1], [*seen[-1:], now]
        if len(seen) < 2:
            continue
        before = seen[0]
        if extent(now) < STATIONARY_RANGE and extent(now) <= extent(before):
            return LimitSet(Kind.STATIONARY, now, solution=_nearest_solution(now, solutions))
        if recurrent := _windows_agree(before, now):
            decided = (limit for limit, *_ in known if limit.kind is not Kind.UNDECIDED)
            same = (limit for limit in decided if _windows_agree(limit.last, now))
            if limit := next(same, None) or periodic_limit(now):
                return limit
    if not recurrent:
        return LimitSet(Kind.UNDECIDED, seen[-1])
    try:
        exponent, deviation = lyapunov(p, *_highest_state(seen[-1]), GROWING * unit, unit, run)
    except (SimulationError, InputError) as reason:
        return LimitSet(Kind.UNDECIDED, seen[-1], failure=str(reason))
    kind = Kind.CHAOTIC if exponent > 3 * deviation else Kind.QUASI_PERIODIC
    return LimitSet(kind, seen[-1], exponent=exponent)


def _windows_agree(a: Trajectory, b: Trajectory) -> bool:
    """Whether means and extremes of two windows agree, relative to the range of the motion."""
    size = state_units(a.header.parameters) * max(extent(a), STATIONARY_RANGE)
    off = [of(a.x, axis=0) - of(b.x, axis=0) for of in (np.mean, np.min, np.max)]
    return bool(np.all(np.abs(off) <= ALIKE * size))


def _nearest_solution(
    last: Trajectory, solutions: Sequence[StationarySolution]
) -> StationarySolution | None:
    """The solution nearest to the last state, free variables aside; of two that of its case."""
    x, case = last.x[-1], last.cases[-1]
    size = state_units(last.header.parameters)

    def distance(of: StationarySolution) -> float:
        bound = [k for k, name in enumerate(VARIABLES) if name not in of.family]
        return float((np.abs(x - of.x) / size)[bound].max())

    near = [each for each in solutions if distance(each) <= NEAR]
    return min(near, key=lambda each: (each.case is not case, distance(each)), default=None)


def periodic_limit(last: Trajectory) -> LimitSet | None:
    """The periodic motion in a window of a run, with the stable orbit that theory has near it.

    None if it doesn't close. Candidates for the period are the first three good minima of the
    distance between the last quarter of the window and what was a lag of up to half the window
    earlier."""
    p, size = last.header.parameters, extent(last)
    z, n, interval = last.x / state_units(p), len(last.x) // 2, float(last.time[1] - last.time[0])
    quarter = -n // 4
    earlier = (z[quarter - lag : len(z) - lag : 5] for lag in range(n))
    away = np.array([np.abs(z[quarter::5] - each).max() for each in earlier])
    left = int(np.argmax(away > size / 2))
    inner = np.arange(left + 1, n - 1)
    dips = inner[(away[inner] <= away[inner - 1]) & (away[inner] < away[inner + 1])]
    good = dips[away[dips] <= 2 * away[dips].min(initial=size) + ALIKE * size]
    seen = [(float(k * interval), float(away[k])) for k in good[:3]]
    for period, _ in seen:
        try:
            orbit = orbits.refine(p, _highest_state(last)[0], period)
        except NoOrbitError:
            continue
        if orbit.stable and abs(orbit.period / period - 1) < ALIKE:
            return LimitSet(Kind.PERIODIC, last, period, orbit=orbit)
    exact = [period for period, defect in seen if defect < STATIONARY_RANGE * size]
    return LimitSet(Kind.PERIODIC, last, exact[0]) if exact else None


def _highest_state(last: Trajectory) -> tuple[Array, Case]:
    """The highest state of a window, with exact zeros where its case has them, and the case."""
    k = int(np.argmax(last.y))
    case = Case(last.case[k])
    return np.where([name in TRAITS[case].constraints for name in VARIABLES], 0.0, last.x[k]), case


def lyapunov(
    p: Parameters, x: npt.ArrayLike, case: Case, duration: float, renewed: float, run: Runs
) -> tuple[float, float]:
    """Largest Lyapunov exponent of the motion from x, in a case, and its standard error, s-1.

    A second motion starts beside the first, a distance `APART` away in natural units, and is
    brought back to that distance every `renewed` seconds, as soon as both are in one case; the mean
    growth between is the exponent (Benettin's method). The error is that of the mean of ten parts
    of the duration. Raises `SimulationError` if a motion breaks down."""
    first = full_state(x)
    active, push = active_variables(case), np.zeros(8)
    push[active] = np.random.default_rng(0).normal(size=len(active))
    second = first + push * state_units(p) * APART / np.linalg.norm(push)
    growth, before = [], APART
    for _ in range(math.ceil(duration / renewed)):
        runs = run(p, np.array([first, second]), renewed, renewed)
        for each in runs:
            if each.header.failure:
                raise SimulationError(each.header.failure, each)
        first, second = (each.x[-1] for each in runs)
        apart = second - first
        distance = float(np.linalg.norm(apart / state_units(p)))
        if distance == 0:
            return -math.inf, 0.0
        growth.append(math.log(distance / before))
        before = distance
        if runs[0].case[-1] == runs[1].case[-1]:
            second, before = first + apart * APART / distance, APART
    parts = np.array([part.mean() for part in np.array_split(np.array(growth), 10)]) / renewed
    return float(np.mean(growth)) / renewed, float(parts.std(ddof=1) / math.sqrt(len(parts)))
