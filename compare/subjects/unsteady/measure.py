"""Flows that change: pulsation, jumps, ramps."""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, Unpack

import numpy as np
import numpy.typing as npt
from numpy.polynomial import Polynomial

from compare.campaign.tasks import Task
from compare.method.brackets import Attempt, Bracket, Search
from compare.method.conditions import Conditions, state_of
from compare.method.protocol import Protocol
from compare.method.quantities import QUANTITIES
from compare.method.record import Measured, Measurement, Missing, Records, Sets, if_found
from compare.method.runner import Runner, coarse_step
from compare.method.settling import rounded_duration
from compare.method.statistics import COVERAGE, Estimate, estimate, peaks, top, uniform
from compare.method.step_pairs import (
    Start,
    StepPair,
    StepPairResult,
    at_zero_step,
    constrained,
    of_no_order,
)
from compare.method.together import Procedure, asked, narrowed, settled, stepped, together
from model import Case, Contact, Flow, Parameters, State, Trajectory
from model.arrays import Array
from model.drag import STOKES

ROLLS_AT = 0.85  # flow of rolling, in units of that at which it ends
SLIPS_AT = 0.3  # flow of slipping, as a part of the way from there to where the wall carries
RAMP = (0.75, 1.35)
"""Ends of a ramp of the flow, as parts of the way to where slipping ends in a jump."""
JUMP = 1e-3
"""Size of a jump from rolling divided by the flow, and from slipping by a third of the range of
flows in which it is: the response to a small jump is wanted, and near the ends of that range it is
far from linear."""
RAISED = 1.5  # factor by which the amplitude is raised at a time under other laws than Stokes'
PERIODS = 3  # of a pulsation in a run
ROUNDS = 5  # successive runs of a driven ball until it is settled, the last with half the step
LASTING = 5  # samples for which slip must last to count: friction may be full for a moment before
PHASES = 8  # phases of a period at which the motion is started anew from its state
STRONG = ((0.25, 4.0), (0.4, 4.0), (0.6, 5.5), (0.75, 4.0))
"""Flows, in units of that at which rolling ends, about which the ball is driven by an amplitude in
units of the flow: it slips at the wall alone about the slow ones, at both points about the
others."""
AT_BOTH, AT_ONE = "at both points", "at one point"  # where it slips in a period
OCTAVE = 3  # octaves above the lowest frequency at which it is driven so


def pulsation(runner: Runner, sets: Sets, records: Records) -> Measured:
    """Gain and phase of rolling; the amplitude at which slip begins; the mean reading beyond it.

    A small pulsation about a fixed part of the flow at which two-point rolling ends shows how the
    ball follows; every other run starts from there, so that it need not settle. With Stokes' law
    the response is linear; with another one the amplitude is raised step by step until the ball
    slips, and each time settled anew. It slips where the engine shows slip at both contacts. About
    other flows it is driven strongly, to slip at the wall alone or at both points."""
    driven, strong = list[Procedure[None]](), list[Procedure[None]]()
    for name, p in sets.items():
        if (end := records.threshold(name, "omega_01")) is None:
            yield runner.missing(name, "no flow at which two-point rolling ends by slipping")
            continue
        q, lowest = p.replace(omega_0=ROLLS_AT * end.value), _lowest(p)
        room = end.value - q.omega_0
        for n in runner.sampling.pulsation_octaves:
            reach = runner.sampling.pulsation_reach * room
            driven.append(_drive(Pulsation(runner, name, q, lowest * 2.0**n, 0.5 * room, reach)))
        for share, times in STRONG if p.drag == STOKES else ():
            q = p.replace(omega_0=share * end.value)
            a = times * q.omega_0
            strong.append(mean_error(Pulsation(runner, name, q, lowest * 2.0**OCTAVE, a, a), a))
    yield from together(runner, driven + strong)


def _drive(first: Pulsation) -> Procedure[None]:
    """How a ball follows a small pulsation, where it slips in larger ones, and its reading then."""
    each = yield from _followed(first)
    if each.failure:
        yield each.missing(each.failure)
        return
    gain, lag, sure = abs(each.ratio), -cmath.phase(each.ratio), each.uncertainty
    size = Conditions(amplitude=each.amplitude)
    yield each.row("gain", estimate(gain, time_step=sure), each.tasks, **size)
    yield each.row("phase_lag", estimate(lag, time_step=sure / gain), each.tasks, **size)
    each = yield from _raised(each)
    (bracket,) = yield from narrowed(each.search())
    onset = each.onset(bracket)
    yield onset
    if isinstance(onset, Missing):
        return
    # The predicted amplitude may be a tenth smaller than the measured one.
    least = QUANTITIES["slip_amplitude"].resolution * 0.9 * onset.value
    if COVERAGE * onset.uncertainty <= least:
        yield from mean_error(each, 1.5 * onset.value)
    else:
        yield each.missing("slip begins at no definite amplitude: no mean reading there")


def _lowest(p: Parameters) -> float:
    """The lowest frequency of pulsations, Hz: a power of two near c/(4 pi)."""
    return 2.0 ** round(math.log2(0.5 * p.c / (2 * math.pi)))


@dataclass(frozen=True, eq=False)
class Pulsation:
    """A pulsating flow, and how a rolling ball follows it."""

    runner: Runner
    set: str
    p: Parameters  # with the mean flow
    frequency: float
    amplitude: float  # rad s-1
    reach: float  # largest amplitude of omega_c that is tried, rad s-1
    lead: float = 0.0  # omega_c less the mean flow as a period begins, divided by the amplitude
    power: float = 0.0  # power of the amplitude with which `lead` grows
    ratio: complex = 1.0  # omega_c divided by omega_0, from the Fourier sums over two periods
    uncertainty: float = math.inf  # of the parts of `ratio`
    failure: str = ""  # why it isn't known how the ball rolls; empty if it does all the time
    tasks: tuple[Task, ...] = ()  # the last two runs

    def start(self, amplitude: float) -> Array:
        """The state (8,) of a ball that follows a pulsation of an amplitude, as it begins."""
        grown = (amplitude / self.amplitude) ** self.power
        return State(omega_c=self.p.omega_0 + amplitude * self.lead * grown).stacked()

    def with_omega_c(self, omega_c: float) -> Pulsation:
        """The pulsation with a ball whose omega_c is this as a period begins, rad s-1."""
        return replace(self, lead=(omega_c - self.p.omega_0) / self.amplitude)

    def step(self, amplitude: float) -> float:
        """The longest time step for an amplitude, s: a period divided by a power of two."""
        f, least = self.frequency, self.runner.sampling.pulsation_steps
        fastest = 4 * (self.p.omega_0 + amplitude) / f
        most = max(least, 1 / (f * coarse_step(self.p)), fastest)
        return 1 / (f * 2.0 ** math.ceil(math.log2(most)))

    def task(
        self,
        amplitude: float,
        x: Array,
        periods: float,
        samples: int,
        step: float,
        phase: float = 0.0,
    ) -> Task:
        """A run from a state, with so many samples in a period; the flow begins at a phase, rad."""
        f = self.frequency
        flow, count = Flow.sine(self.p.omega_0, amplitude, f, phase), round(samples * periods)
        return self.runner.task(self.p, x, periods / f, step, flow=flow, samples=count)

    def search(self) -> Search:
        """A search for the amplitude at which slip begins, in runs of a period and a half."""
        sampling = self.runner.sampling
        if self.p.drag == STOKES:
            # Slip may begin from about half the largest amplitude on: the width is taken relative
            # to that.
            largest = self.reach / abs(self.ratio)
            around, size = Bracket(0.0, largest), largest / 2
        else:
            around = Bracket(0.99 * self.amplitude, RAISED * self.amplitude)
            size = self.amplitude

        def task(amplitude: float, bracket: Bracket, attempt: Attempt) -> Task:
            x, lasts = self.start(amplitude), 1.5 * attempt.time
            step = self.step(around.high) / (2 * attempt.divisor)
            return self.task(amplitude, x, lasts, sampling.pulsation_samples, step)

        return Search(around, task, rolls_on, sampling.pulsation_width * size)

    def onset(self, bracket: Bracket) -> Measurement | Missing:
        """The measurement of the amplitude at which slip begins."""
        place, (low, high) = bracket.place, bracket.runs
        if low is None or high is None:
            return self.missing("there is slip at no amplitude, or at all")
        alone = np.abs(low.slip_speed_A - low.slip_speed_B)[low.time > low.time[-1] / 6].max()
        if alone > 2e-4 * math.sqrt(self.p.g * self.p.R):
            return self.missing("one contact slips before both do, too little to tell when")
        # Near the phase at which it sets in, slip lasts for 2 sqrt(2 e) rad beyond the onset by e.
        samples = self.runner.sampling.pulsation_samples
        unseen = (math.pi * LASTING / samples) ** 2 / 2 * place.value
        return self.row("slip_amplitude", place.also(unseen_slip=unseen), bracket.tasks)

    def missing(self, why: str) -> Missing:
        """A record of what was not measured in this pulsation, and why."""
        return self.runner.missing(self.set, f"at {self.frequency:g} Hz {why}")

    def row(
        self, quantity: str, value: Estimate, tasks: Sequence[Task], **at: Unpack[Conditions]
    ) -> Measurement:
        """A measurement in this pulsation."""
        at = Conditions(f=self.frequency) | at
        return self.runner.measurement(self.set, self.p, quantity, value, tasks, **at)


class Round(NamedTuple):
    """A run in a pulsation, and the limit of omega_c as its periods begin."""

    task: Task
    run: Trajectory
    omega_c: float


def _settle(
    each: Pulsation, amplitude: float, divisor: int, samples: int, slips: bool
) -> Procedure[list[Round] | str]:
    """Run a pulsation until it is settled: the last two rounds, the second with half the step, or
    why it broke down. A ball that slips goes on with the rest of its last state."""
    x, rounds = each.start(amplitude), list[Round]()
    for n in range(ROUNDS):
        finer = each.runner.sampling.pulsation_divisor if n == ROUNDS - 1 else 1
        step = each.step(amplitude) / (divisor * finer)
        task = each.task(amplitude, x, PERIODS, samples, step)
        (runs,) = yield from asked([task])
        if isinstance(runs, str):
            return f"the run {runs}"
        (run,) = runs
        # As the periods begin omega_c goes on as a geometric sequence to its limit, or diverges.
        one, two, omega_c = run.omega_c[samples::samples][-3:].tolist()
        first, second = two - one, omega_c - two
        omega_c += second * second / (first - second) if abs(second) < abs(first) else 0.0
        slid = State.of(run.x[-1])._replace(omega_c=omega_c).stacked()
        x = slid if slips else each.with_omega_c(omega_c).start(amplitude)
        rounds = [*rounds[-1:], Round(task, run, omega_c)]
    return rounds


def _followed(each: Pulsation) -> Procedure[Pulsation]:
    """A pulsation with omega_c at the beginning of a period as runs show it."""
    samples = each.runner.sampling.pulsation_samples
    seen = yield from _settle(each, each.amplitude, 2, samples, slips=False)
    if isinstance(seen, str):
        return replace(each, failure=seen)
    last, turns = slice(-2 * samples, None), -2j * math.pi * each.frequency
    first, ratio = (
        complex(2j * np.mean(run.omega_c[last] * np.exp(turns * run.time[last])) / each.amplitude)
        for _, run, _ in seen
    )
    return replace(
        each.with_omega_c(seen[-1].omega_c),
        ratio=ratio,
        uncertainty=abs(ratio - first),
        failure="" if rolls_on(seen[-1].run) else "a ball slips half as far as in a slow pulsation",
        tasks=tuple(task for task, *_ in seen),
    )


def _raised(each: Pulsation) -> Procedure[Pulsation]:
    """A pulsation of the largest amplitude at which the ball rolls, unless drag is Stokes'."""
    for _ in range(0 if each.p.drag == STOKES else 12):
        lead = each.lead * RAISED**each.power
        higher = yield from _followed(replace(each, amplitude=RAISED * each.amplitude, lead=lead))
        if higher.failure:
            break
        each = replace(higher, power=math.log(higher.lead / each.lead, RAISED))
    return each


def rolls_on(run: Trajectory) -> bool:
    """Whether after a sixth slip at both points, or flight, never lasts: `LASTING`."""
    cases = [Case.SS, *(case for case in Case if case.A is Contact.N)]
    gone = np.isin(run.case[run.time > run.time[-1] / 6], cases)
    return bool(np.convolve(gone, np.ones(LASTING)).max() < LASTING)


def mean_error(each: Pulsation, amplitude: float) -> Procedure[None]:
    """The mean of omega_c over the last period in a pulsation, with both steps, once periods
    repeat.

    The engine may remember what a state doesn't hold, such as how strongly floor and wall press
    against each other. How much the mean depends on it is seen in periods that start anew from
    states of the last one."""
    samples, f = 8 * PHASES, each.frequency
    seen = yield from _settle(each, amplitude, 1, samples, slips=True)
    if isinstance(seen, str):
        yield each.missing(seen)
        return
    (_, run, _), (task, halved, _) = seen
    states = enumerate(run.x[-1 - samples : -1 : samples // PHASES])
    phases = ((x, 2 * math.pi * k / PHASES) for k, x in states)
    step = each.step(amplitude)
    anew = [each.task(amplitude, x, 1, samples, step, phase) for x, phase in phases]
    (again,) = yield from asked(anew)
    if isinstance(again, str):
        yield each.missing(f"the run {again}")
        return
    turns = np.array([period.theta[-1] - period.theta[0] for period in again])
    before, usual = (np.diff(run.theta[::samples]) * f)[-2:].tolist()
    first, mean = (np.diff(halved.theta[::samples]) * f)[-2:].tolist()
    value = mean - each.p.omega_0
    spread = float(np.abs(turns * f - usual).max())
    drift = abs(mean - usual) + abs(mean - first) + abs(usual - before) + spread
    # Slip begins and ends within a coarse step, if there is one: the mean error is uncertain by
    # half of that part. Both may be of one sign, and are added.
    within = abs(value) / round(task.steps / PERIODS) if task.settings.timestep else 0.0
    error = Estimate(value, drift + within, {"drift": drift, "time_step": within})
    slips = _slips(halved.case[-samples:])
    row = each.row("mean_error", error, [task], amplitude=amplitude, slips=slips)
    yield if_found(row, f"at {f:g} Hz there is no mean reading")


def _slips(cases: npt.NDArray[np.int8]) -> str:
    """Where the ball slips in a period, by its samples of which one may stray."""
    seen = {Case(case) for case in np.unique(cases) if np.sum(cases == case) > 1}
    if any(Contact.N in (case.A, case.B) for case in seen):
        return "off the floor or the wall"
    if Case.SS in seen:
        return AT_BOTH
    return AT_ONE if seen - {Case.RR} else "nowhere"


def jumps(runner: Runner, sets: Sets, records: Records) -> Measured:
    """Delay, peak and height after jumps, rolling and slipping; where a ramp ends slip.

    Half the difference of two runs, after a small jump up and one down, is free of what goes with
    the square of the jump. A ramp starts from settled slipping well below the end of it, and ends
    well above; the ball has left slipping once it lags by half as much as at first."""
    return together(runner, (_change(runner, name, p, records) for name, p in sets.items()))


def _change(runner: Runner, name: str, p: Parameters, records: Records) -> Procedure[None]:
    """Jumps and ramps of a set."""
    slips, carries, folds = (records.threshold(name, f"omega_0{n}") for n in (1, 2, 4))
    if slips is None or carries is None:
        yield runner.missing(name, "no flows between which the ball slips at both points")
        return
    begins, holds, pairs = slips.value, carries.value, list[StepPair]()
    if p.drag == STOKES:  # with other laws the delay depends on the size of the jump
        q = p.replace(omega_0=ROLLS_AT * begins)
        rolls = Start(name, q, "RR", State(omega_c=q.omega_0).stacked())
        pairs.append(_jump(runner, rolls, JUMP * q.omega_0))
    # from rest, to settle slipping before a jump or a ramp
    flows = {"SS": begins + SLIPS_AT * (holds - begins)}
    if folds is None:
        yield runner.missing(name, "no flow at which slipping at both points ends in a jump")
    else:
        flows["ramp"] = begins + RAMP[0] * (folds.value - begins)
    starts = [Start(name, p.replace(omega_0=flow), of, np.zeros(8)) for of, flow in flows.items()]
    (states,) = yield from settled(starts)
    for start, state in zip(starts, states, strict=True):
        if not state.settled_in(Case.SS):
            why = state.failure or state.case.name
            yield runner.missing(name, f"no settled slipping to start from: {why}")
            continue
        # At both walls to the last digit.
        begun = replace(start, x0=constrained(Case.SS, state.mean, start.p))
        if start.name == "SS":
            pairs.append(_jump(runner, begun, JUMP / 3 * (holds - begins)))
        elif folds:
            pairs += _ramps(runner, begun, begins, folds.value)
    for result in (yield from stepped(*pairs)):
        yield from _rows(result)


def _rows(result: StepPairResult) -> Measured:
    """Measurements of a pair of jumps, or of a ramp."""
    pair, coarse, fine = result.pair, result.coarse, result.fine
    if pair.flow is None:
        rolls = pair.name == "RR"
        limit = at_zero_step if rolls else of_no_order
        for quantity in ("jump_delay",) if rolls else ("jump_peak", "jump_height"):
            row = result.row(quantity, limit(coarse[quantity].value, fine[quantity]))
            yield if_found(row, f"{quantity} in {pair.name}: no peak")
    elif math.isfinite(coarse) and math.isfinite(fine):
        yield result.row("ramp_end", at_zero_step(coarse, estimate(fine)))
    else:
        yield result.missing(f"a ramp of {pair.at['rate']:.3g} rad/s^2 doesn't end slipping")


def _jump(runner: Runner, start: Start, size: float) -> StepPair:
    """The pair of jumps of the flow up and down, rad s-1, from a state in a case."""
    p, t_end = start.p, rounded_duration(start.p, runner.sampling.unsteady_lasts)
    # drag may be weak, and peaks come soon
    samples = max(4000, round(t_end / (4 * coarse_step(p))))
    divisors, read = runner.sampling.unsteady_divisors, _jump_quantities
    both = StepPair(start.set, p, start.name, start.x0, t_end, divisors, samples, read)
    sides = tuple(replace(both, p=p.replace(omega_0=p.omega_0 + side * size)) for side in (1, -1))
    return replace(both, together=sides, at=Conditions(case=start.name))


def _ramps(runner: Runner, start: Start, begins: float, ends: float) -> Iterator[StepPair]:
    """Step pairs of ramps, rad s-2, between two flows, rad s-1, from settled SS."""
    p, span = start.p, ends - begins
    last = begins + RAMP[1] * span
    for rate in runner.sampling.unsteady_rates:
        rise = rate * p.c * span
        t_end, at = (last - p.omega_0) / rise, Conditions(rate=rise) | state_of(start.x0[:6])
        flow, divisors = Flow.ramp(p.omega_0, last, t_end), runner.sampling.unsteady_ramps
        ramp = StepPair(start.set, p, "ramp", start.x0, t_end, divisors, 16000, caught_up, flow)
        yield replace(ramp, at=at)


def odd_part(up: Trajectory, down: Trajectory) -> Array:
    """The part of omega_c (n,) with the sign of the jump: from 0 to 1."""
    odd = up.omega_c - down.omega_c
    return np.asarray(odd / odd[-1])


def _jump_quantities(up: Trajectory, down: Trajectory) -> dict[str, Estimate]:
    """The delay; time and height of the highest peak, nan without one that surely is one."""
    t, y = up.time, odd_part(up, down)
    # Forces act in the middle of a step: times are known to half a finer step.
    late = coarse_step(up.header.parameters) / 4 / math.sqrt(12)
    at, top_of_all = _highest(t, y)
    _, seldom = _highest(t[::2], y[::2])
    # What is left of the size of a jump is of its second order.
    height = estimate(top_of_all, sampling=uniform(abs(seldom - top_of_all)), jump=JUMP**2)
    peak = estimate(at, sampling=late)
    if height.value - 1 <= COVERAGE * height.uncertainty:  # too low to be told from none
        peak = height = estimate(math.nan)
    return {
        "jump_delay": estimate(float(np.trapezoid(1 - y, t)), sampling=late),
        "jump_peak": peak,
        "jump_height": height,
    }


def _highest(t: Array, y: Array) -> tuple[float, float]:
    """Time and height of the highest peak of samples (n,) in their first half; nan without one."""
    k, later = peaks(y)
    highest = (k == y.argmax()) & (k < len(t) // 2)
    found = t[k] + later * (t[1] - t[0]), top(y, k, later)
    at, height = (float(np.append(each[highest], math.nan)[0]) for each in found)
    return at, height


def caught_up(run: Trajectory) -> float:
    """The flow, rad s-1, at which the lag has fallen to half; nan if it never does."""
    lag = run.header.flow(run.time) - run.omega_c
    below = np.flatnonzero(lag < lag[0] / 2)
    if not len(below):
        return math.nan
    near = slice(below[0] - 2, below[0] + 2)
    time = Polynomial.fit(lag[near], run.time[near], 3)(lag[0] / 2)
    return float(run.header.flow(time))


PROTOCOLS = (
    Protocol("pulsation", pulsation, ("thresholds",)),
    Protocol("unsteady", jumps, ("thresholds",), drawn=lambda m: m.quantity == "jump_height"),
)
