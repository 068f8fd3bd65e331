"""Flows that change: pulsation, jumps, ramps.

* A ball rolls in a pulsating flow: how it follows, at which amplitude it slips, what it then reads
  on average. A small pulsation about a fixed part of the flow at which two-point rolling ends shows
  how the ball follows; every other run starts from there, so that it need not settle. With Stokes'
  law the response is linear; with another one the amplitude is raised step by step until the ball
  slips, and each time settled anew. The ball slips where the engine shows slip at both contacts.
  Frequencies are powers of two. About other flows it is driven strongly, to slip at the wall alone
  or at both points.
* The flow changes once by a small jump. Half the difference of two runs, after a jump up and one
  down, is free of what goes with the square of the jump.
* A ramp starts from settled slipping well below the end of it, and ends well above; the ball has
  left slipping once it lags by half as much as at first."""

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
from compare.method.brackets import Attempt, Bracket, Search, narrow
from compare.method.conditions import Conditions, state_of
from compare.method.protocol import Protocol
from compare.method.quantities import QUANTITIES
from compare.method.record import Measured, Measurement, Missing, Records, Sets, if_found
from compare.method.runner import Runner, coarse_step
from compare.method.settling import rounded_duration, settle
from compare.method.statistics import COVERAGE, Estimate, estimate, peaks, top, uniform
from compare.method.step_pairs import (
    Start,
    StepPair,
    StepPairResult,
    at_zero_step,
    carry_out,
    constrained,
    of_no_order,
)
from model import Case, Contact, Flow, Parameters, State, Trajectory
from model.arrays import Array
from model.drag import STOKES

ROLLS_AT = 0.85
"""Flow of rolling, in units of that at which it ends."""
SLIPS_AT = 0.3
"""Flow of slipping, as a part of the way from there to where the wall carries the ball."""
RAMP = (0.75, 1.35)
"""Ends of a ramp of the flow, as parts of the way to where slipping ends in a jump."""
JUMP = 1e-3
"""Size of a jump from rolling divided by the flow, and from slipping by a third of the range of
flows in which it is: the response to a small jump is wanted, and near the ends of that range it is
far from linear."""


RAISED = 1.5
"""Factor by which the amplitude is raised at a time where the law of drag isn't Stokes'."""
PERIODS = 3
"""Of a pulsation in a run."""
ROUNDS = 5
"""Successive runs of a driven ball until it is settled, the last with half the step."""
LASTING = 5
"""Samples for which slip must last to count: friction may be full for a moment before."""
PHASES = 8
"""Phases of a period at which the motion is started anew from its state."""
STRONG = ((0.25, 4.0), (0.4, 4.0), (0.6, 5.5), (0.75, 4.0))
"""Flows, in units of that at which rolling ends, about which the ball is driven by an amplitude in
units of the flow: it slips at the wall alone about the slow ones, at both points about the
others."""
OCTAVE = 3
"""Octaves above the lowest frequency at which it is driven so."""


def pulsation(runner: Runner, sets: Sets, records: Records) -> Measured:
    """Gain and phase of rolling; the amplitude at which slip begins; the mean reading beyond it."""
    small = []  # about a flow at which a ball rolls, at several frequencies
    for name, p in sets.items():
        if (rolls := records.threshold(name, "omega_01")) is None:
            why = "no flow was measured at which two-point rolling ends by slipping"
            yield runner.missing(name, why)
            continue
        q = p.replace(omega_0=ROLLS_AT * rolls.value)
        room, lowest = rolls.value - q.omega_0, _lowest(p)
        octaves, reach = runner.sampling.pulsation_octaves, runner.sampling.pulsation_reach * room
        small += [Pulsation(runner, name, q, lowest * 2.0**n, 0.5 * room, reach) for n in octaves]
    followed = _as_followed(runner, small)
    for each in followed:
        if each.failure:
            yield runner.missing(each.set, f"at {each.frequency:g} Hz {each.failure}")
            continue
        gain, lag, sure = abs(each.ratio), -cmath.phase(each.ratio), each.uncertainty
        size = Conditions(amplitude=each.amplitude)
        yield each.row("gain", estimate(gain, time_step=sure), each.tasks, **size)
        yield each.row("phase_lag", estimate(lag, time_step=sure / gain), each.tasks, **size)
    rolling, slipping = _raised(runner, [each for each in followed if not each.failure]), []
    brackets = narrow(runner, [each.search() for each in rolling])
    for each, bracket in zip(rolling, brackets, strict=True):
        onset = each.onset(bracket)
        yield onset
        if isinstance(onset, Missing):
            continue
        # The predicted amplitude may be a tenth smaller than the measured one.
        least = QUANTITIES["slip_amplitude"].resolution * 0.9 * onset.value
        if COVERAGE * onset.uncertainty <= least:
            slipping.append((each, 1.5 * onset.value))
        else:
            at = f"a pulsation at {each.frequency:g} Hz"
            why = f"slip in {at} begins at no definite amplitude: no mean reading there"
            yield runner.missing(each.set, why)
    strong = [each for name, p in sets.items() for each in _strong(runner, name, p, records)]
    yield from mean_errors(runner, slipping + strong)


def _strong(
    runner: Runner, name: str, p: Parameters, records: Records
) -> Iterator[tuple[Pulsation, float]]:
    """Pulsations by several times the mean flow, under Stokes' law, and amplitudes."""
    end = records.threshold(name, "omega_01")
    if end and p.drag == STOKES:
        frequency = _lowest(p) * 2.0**OCTAVE
        for share, times in STRONG:
            q = p.replace(omega_0=share * end.value)
            amplitude = times * q.omega_0
            yield Pulsation(runner, name, q, frequency, amplitude, amplitude), amplitude


def _lowest(p: Parameters) -> float:
    """The lowest frequency of pulsations, Hz: a power of two near c/(4 pi)."""
    return 2.0 ** round(math.log2(0.5 * p.c / (2 * math.pi)))


class Timing(NamedTuple):
    """How a run in a pulsation is done."""

    periods: float
    samples: int  # in a period
    divisor: int  # by what the longest time step is divided
    phase: float = 0.0  # of the flow at the beginning, rad


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

    def task(self, amplitude: float, x: Array, timing: Timing, largest: float = 0.0) -> Task:
        """A run from a state; steps in a period, a power of two, suit the `largest` amplitude."""
        runner = self.runner
        fastest = 4 * (self.p.omega_0 + max(amplitude, largest)) / self.frequency
        least = max(
            runner.sampling.pulsation_steps, 1 / (self.frequency * coarse_step(self.p)), fastest
        )
        step = 1 / (self.frequency * 2 ** math.ceil(math.log2(least)) * timing.divisor)
        flow = Flow.sine(self.p.omega_0, amplitude, self.frequency, timing.phase)
        samples, t_end = round(timing.samples * timing.periods), timing.periods / self.frequency
        return runner.task(self.p, x, t_end, step, flow=flow, samples=samples)

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
            timing = Timing(1.5 * attempt.time, sampling.pulsation_samples, 2 * attempt.divisor)
            return self.task(amplitude, self.start(amplitude), timing, largest=around.high)

        return Search(around, task, rolls_on, sampling.pulsation_width * size)

    def onset(self, bracket: Bracket) -> Measurement | Missing:
        """The measurement of the amplitude at which slip begins."""
        at, place = f"a pulsation at {self.frequency:g} Hz", bracket.place
        low, high = bracket.runs
        if low is None or high is None:
            why = f"in {at} there is slip at no amplitude, or at all"
            return self.runner.missing(self.set, why)
        alone = np.abs(low.slip_speed_A - low.slip_speed_B)[low.time > low.time[-1] / 6].max()
        if alone > 2e-4 * math.sqrt(self.p.g * self.p.R):
            why = f"in {at} one contact slips before both do, too little to tell when"
            return self.runner.missing(self.set, why)
        # Near the phase at which it sets in, slip lasts for 2 sqrt(2 e) rad beyond the onset by e.
        samples = self.runner.sampling.pulsation_samples
        unseen = (math.pi * LASTING / samples) ** 2 / 2 * place.value
        return self.row("slip_amplitude", place.also(unseen_slip=unseen), bracket.tasks)

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


def _settled_rounds(
    runner: Runner,
    driven: Sequence[tuple[Pulsation, float]],
    divisor: int,
    samples: int,
    slips: bool,
) -> list[list[Round] | str]:
    """Run pulsations until they are settled: of each the last two rounds, the second with half the
    step, or its error. A ball that slips goes on with the rest of its last state."""
    states = [each.start(a) for each, a in driven]
    seen = list[list[Round] | str]([[]] * len(driven))
    for n in range(ROUNDS):
        finer = runner.sampling.pulsation_divisor if n == ROUNDS - 1 else 1
        timing = Timing(PERIODS, samples, divisor * finer)
        todo = [
            (k, *driven[k], before) for k, before in enumerate(seen) if not isinstance(before, str)
        ]
        tasks = [each.task(a, states[k], timing) for k, each, a, _ in todo]
        for (k, each, a, before), task, run in zip(todo, tasks, runner.each(tasks), strict=True):
            if isinstance(run, str):
                seen[k] = f"the run {run}"
                continue
            # As the periods begin omega_c goes on as a geometric sequence to its limit, or
            # diverges.
            one, two, omega_c = run.omega_c[samples::samples][-3:].tolist()
            first, second = two - one, omega_c - two
            omega_c += second * second / (first - second) if abs(second) < abs(first) else 0.0
            slid = State.of(run.x[-1])._replace(omega_c=omega_c).stacked()
            states[k] = slid if slips else each.with_omega_c(omega_c).start(a)
            seen[k] = [*before[-1:], Round(task, run, omega_c)]
    return seen


def _as_followed(runner: Runner, pulsations: Sequence[Pulsation]) -> list[Pulsation]:
    """Pulsations with omega_c at the beginning of a period as runs show it."""
    followed, samples = [], runner.sampling.pulsation_samples
    last, driven = slice(-2 * samples, None), [(each, each.amplitude) for each in pulsations]
    rounds = _settled_rounds(runner, driven, 2, samples, slips=False)
    for each, seen in zip(pulsations, rounds, strict=True):
        if isinstance(seen, str):
            followed.append(replace(each, failure=seen))
            continue
        first, ratio = (
            complex(2j * np.mean(x * np.exp(-2j * math.pi * each.frequency * t)) / each.amplitude)
            for t, x in ((run.time[last], run.omega_c[last]) for _, run, _ in seen)
        )
        slips = "a ball slips in a pulsation half as large as in a slow one"
        new = replace(
            each.with_omega_c(seen[-1].omega_c),
            ratio=ratio,
            uncertainty=abs(ratio - first),
            failure="" if rolls_on(seen[-1].run) else slips,
            tasks=tuple(task for task, *_ in seen),
        )
        followed.append(new)
    return followed


def _raised(runner: Runner, pulsations: Sequence[Pulsation]) -> list[Pulsation]:
    """Pulsations of the largest amplitudes at which the ball rolls, unless Stokes'."""
    raised = list(pulsations)
    todo = [k for k, each in enumerate(pulsations) if each.p.drag != STOKES]
    for _ in range(12):
        higher = [
            replace(each, amplitude=RAISED * each.amplitude, lead=each.lead * RAISED**each.power)
            for each in (raised[k] for k in todo)
        ]
        followed = zip(todo, _as_followed(runner, higher), strict=True)
        still = {k: each for k, each in followed if not each.failure}
        for k, each in still.items():
            raised[k] = replace(each, power=math.log(each.lead / raised[k].lead, RAISED))
        todo = list(still)
    return raised


def rolls_on(run: Trajectory) -> bool:
    """Whether after a sixth slip at both points, or flight, never lasts: `LASTING`."""
    cases = [Case.SS, *(case for case in Case if case.A is Contact.N)]
    gone = np.isin(run.case[run.time > run.time[-1] / 6], cases)
    return bool(np.convolve(gone, np.ones(LASTING)).max() < LASTING)


def mean_errors(runner: Runner, slipping: Sequence[tuple[Pulsation, float]]) -> Measured:
    """Means over the last period in pulsations, with both steps, once periods repeat.

    The engine may remember what a state doesn't hold, such as how strongly floor and wall press
    against each other. How much the mean depends on it is seen in periods that start anew from
    states of the last one."""
    samples = 8 * PHASES
    rounds = _settled_rounds(runner, slipping, 1, samples, slips=True)
    anew = [
        [
            each.task(a, x, Timing(1, samples, 1, phase=2 * math.pi * k / PHASES))
            for k, x in enumerate(seen[0].run.x[-1 - samples : -1 : samples // PHASES])
        ]
        for (each, a), seen in zip(slipping, rounds, strict=True)
        if not isinstance(seen, str)
    ]
    begun = runner.groups(anew)
    for (each, amplitude), seen in zip(slipping, rounds, strict=True):
        at = f"the mean reading at {each.frequency:g} Hz"
        if isinstance(seen, str) or isinstance(again := next(begun), str):
            why = f"{at}: {seen if isinstance(seen, str) else f'the run {again}'}"
            yield runner.missing(each.set, why)
            continue
        (_, run, _), (task, halved, _) = seen
        turns = np.array([period.theta[-1] - period.theta[0] for period in again])
        before, usual = (np.diff(run.theta[::samples]) * each.frequency)[-2:].tolist()
        first, mean = (np.diff(halved.theta[::samples]) * each.frequency)[-2:].tolist()
        value = mean - each.p.omega_0
        spread = float(np.abs(turns * each.frequency - usual).max())
        drift = abs(mean - usual) + abs(mean - first) + abs(usual - before) + spread
        # Slip begins and ends within a coarse step, if there is one: the mean error is uncertain by
        # half of that part. Both may be of one sign, and are added.
        within = abs(value) / round(task.steps / PERIODS) if task.settings.timestep else 0.0
        error = Estimate(value, drift + within, {"drift": drift, "time_step": within})
        slips = _slips(halved.case[-samples:])
        row = each.row("mean_error", error, [task], amplitude=amplitude, slips=slips)
        yield if_found(row, f"{at} is none")


def _slips(cases: npt.NDArray[np.int8]) -> str:
    """Where the ball slips in a period, by its samples of which one may stray."""
    seen = {Case(case) for case in np.unique(cases) if np.sum(cases == case) > 1}
    if any(Contact.N in (case.A, case.B) for case in seen):
        return "off the floor or the wall"
    if Case.SS in seen:
        return "at both points"
    return "at one point" if seen - {Case.RR} else "nowhere"


def jumps(runner: Runner, sets: Sets, records: Records) -> Measured:
    """Delay, peak and height after jumps, rolling and slipping; where a ramp ends slip."""
    # where slipping begins, the wall carries the ball, a jump ends
    flows: dict[str, tuple[float, float, float]] = {}
    # from rest, to settle slipping before a jump or a ramp
    pairs = list[StepPair]()
    starts = list[Start]()
    for name, p in sets.items():
        slips, carries, folds = (records.threshold(name, f"omega_0{n}") for n in (1, 2, 4))
        if slips is None or carries is None:
            why = "no flows were measured between which the ball slips at both points"
            yield runner.missing(name, why)
            continue
        begins, holds, ends = slips.value, carries.value, folds.value if folds else math.nan
        flows[name] = begins, holds, ends
        if p.drag == STOKES:  # with other laws the delay depends on the size of the jump
            q = p.replace(omega_0=ROLLS_AT * begins)
            rolls = Start(name, q, "RR", State(omega_c=q.omega_0).stacked())
            pairs.append(_jump(runner, rolls, JUMP * q.omega_0))
        q = p.replace(omega_0=begins + SLIPS_AT * (holds - begins))
        starts.append(Start(name, q, "jump", np.zeros(8)))
        if folds is None:
            why = "no flow was measured at which slipping at both points ends in a jump"
            yield runner.missing(name, why)
        else:
            q = p.replace(omega_0=begins + RAMP[0] * (ends - begins))
            starts.append(Start(name, q, "ramp", np.zeros(8)))
    for start, state in zip(starts, settle(runner, starts), strict=True):
        if state.failure or state.case is not Case.SS:
            why = state.failure or state.case.name
            yield runner.missing(start.set, f"no settled slipping to start from: {why}")
            continue
        begins, holds, ends = flows[start.set]
        # At both walls to the last digit.
        begun = replace(start, x0=constrained(Case.SS, state.mean, start.p))
        if start.name == "jump":
            pairs.append(_jump(runner, replace(begun, name="SS"), JUMP / 3 * (holds - begins)))
        else:
            pairs += _ramps(runner, begun, begins, ends)
    for result in (yield from carry_out(runner, pairs)):
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
        ramp = f"a ramp of {pair.at['rate']:.3g} rad/s^2"
        yield result.missing(f"{ramp} doesn't end slipping at both points")


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
    at, height = (
        np.append(each[highest], math.nan)[0]
        for each in (t[k] + later * (t[1] - t[0]), top(y, k, later))
    )
    return float(at), float(height)


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
