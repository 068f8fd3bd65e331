"""A rolling ball in a pulsating flow: how it follows, at which amplitude it slips, what it then reads on average.

The mean flow is a fixed part of that at which two-point rolling ends. A small pulsation shows how the engine's ball
follows; every other run starts from there, so that it need not settle. With Stokes' law a large pulsation is a small
one magnified; with another one the amplitude is raised step by step until the ball slips, and each time settled anew.
Slip is what the engine's contacts show: both slip. Frequencies are powers of two, so that sets of about the same drag
share batches.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compare.kit.brackets import Bracket, Care, Search, narrow
from compare.kit.lab import Lab, coarse_step
from compare.kit.record import Measurement, Missing, Records, if_sure, measurement
from compare.kit.statistics import Measured
from compare.kit.tasks import Task
from compare.kit.trials import known_flow
from model import Case, Contact, Flow, Parameters, State, Trajectory
from model.arrays import Array
from model.drag import STOKES

PROTOCOL = "pulsation"
RAISE = 1.5
"""Factor by which the amplitude is raised at a time where the law of drag isn't Stokes'."""
PERIODS, ROUNDS = 3, 5
"""Length of a run, and how many follow each other until it is settled, the last with half the step."""
SAMPLES, LASTS = 256, 5
"""Samples in a period, and how many of them slip must last to count: friction may be full for a moment before."""
PHASES = 8
"""Phases of a period at which the motion is started anew from its state, to see whether the mean depends on more."""


@dataclass(frozen=True, eq=False)
class Pulsation:
    """A pulsating flow, and how a rolling ball follows it."""

    set: str
    p: Parameters
    """With the mean flow."""
    frequency: float
    amplitude: float
    """rad s-1"""
    reach: float
    """How far omega_c may swing in the largest pulsation that is tried, rad s-1."""
    begin: float = 0.0
    """omega_c less the mean flow as a period begins, divided by the amplitude."""
    power: float = 0.0
    """Power of the amplitude with which `begin` grows."""
    ratio: complex = 1.0
    """omega_c divided by omega_0, from the Fourier sums over two periods."""
    uncertainty: float = math.inf
    """Of the parts of `ratio`."""
    rolls: bool = True
    """Whether the ball rolls all the time."""
    tasks: tuple[Task, ...] = ()
    """The last two runs."""

    def start(self, amplitude: float) -> Array:
        """The state (8,) of a ball that follows a pulsation of an amplitude, as it begins."""
        grown = (amplitude / self.amplitude) ** self.power
        return State(omega_c=self.p.omega_0 + amplitude * self.begin * grown).stacked()

    def begun(self, omega_c: float) -> Pulsation:
        """The same with this omega_c as a period begins."""
        return replace(self, begin=(omega_c - self.p.omega_0) / self.amplitude)

    def task(
        self,
        lab: Lab,
        amplitude: float,
        x: Array,
        periods: float,
        refine: int,
        samples: int,
        phase: float = 0.0,
        largest: float = 0.0,
    ) -> Task:
        """A run from a state, with as many steps in a period, a power of two, as the `largest` amplitude needs."""
        fastest = 4 * (self.p.omega_0 + max(amplitude, largest)) / self.frequency
        least = max(lab.effort("pulsation.steps"), 1 / (self.frequency * coarse_step(self.p)), fastest)
        step = 1 / (self.frequency * 2 ** math.ceil(math.log2(least)) * refine)
        flow = Flow.sine(self.p.omega_0, amplitude, self.frequency, phase)
        return lab.task(self.p, x, periods / self.frequency, step, flow=flow, samples=round(samples * periods))

    def row(self, lab: Lab, quantity: str, value: Measured, tasks: Sequence[Task], **at: float) -> Measurement:
        """A measurement in this pulsation."""
        return measurement(lab, PROTOCOL, self.set, self.p, quantity, value, tasks, f=self.frequency, **at)


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Gain and phase of rolling; the amplitude at which slip begins; the mean reading beyond it."""
    small = []
    for name, p in sets.items():
        if (end := known_flow(records, name, "omega_01")) is None:
            yield Missing(PROTOCOL, name, "no flow was measured at which two-point rolling ends by slipping")
            continue
        q = p.replace(omega_0=0.85 * end)
        room, lowest = end - q.omega_0, 2.0 ** round(math.log2(0.5 * p.c / (2 * math.pi)))
        octaves = lab.effort("pulsation.octaves")
        small += [Pulsation(name, q, lowest * 2.0**n, 0.5 * room, 1.1 * room) for n in octaves]
    followed = _followed(lab, small)
    for each in followed:
        if not each.rolls:
            at = f"at {each.frequency:g} Hz a ball slips in a pulsation half as large as in a slow one"
            yield Missing(PROTOCOL, each.set, at)
            continue
        gain, lag = Measured(abs(each.ratio), each.uncertainty), -cmath.phase(each.ratio)
        yield each.row(lab, "gain", gain, each.tasks, amplitude=each.amplitude)
        angle = Measured(lag, gain.uncertainty / gain.value)
        yield each.row(lab, "phase_lag", angle, each.tasks, amplitude=each.amplitude)
    rolling, slipping = _raised(lab, [each for each in followed if each.rolls]), []
    for each, bracket in zip(rolling, narrow(lab, [_search(lab, each) for each in rolling]), strict=True):
        at, place, (low, high) = f"a pulsation at {each.frequency:g} Hz", bracket.place, bracket.runs
        # Near the phase at which it sets in, slip lasts for 2 sqrt(2 e) rad beyond the onset by e.
        unseen = (math.pi * LASTS / SAMPLES) ** 2 / 2 * place.value
        onset = Measured(place.value, math.hypot(place.uncertainty, unseen))
        if low is None or high is None:
            yield Missing(PROTOCOL, each.set, f"in {at} there is slip at no amplitude, or at all")
            continue
        alone = np.abs(low.slip_speed_A - low.slip_speed_B)[low.time > low.time[-1] / 6].max()
        if alone > 2e-4 * math.sqrt(each.p.g * each.p.R):
            yield Missing(PROTOCOL, each.set, f"in {at} one contact slips before both do, too little to tell when")
        else:
            measured = each.row(lab, "slip_amplitude", onset, bracket.tasks)
            # What will be predicted may be a tenth smaller than what is measured.
            yield (row := if_sure(measured, 0.9 * onset.value, f"slip in {at} begins at no definite amplitude"))
            if isinstance(row, Measurement):
                slipping.append((each, 1.5 * onset.value))
    yield from mean_errors(lab, slipping)


def _rounds(
    lab: Lab, driven: Sequence[tuple[Pulsation, float]], refine: int, samples: int, slips: bool
) -> list[list[tuple[Task, Trajectory, float]]]:
    """Runs in pulsations of these amplitudes until they are settled, the last with half the step: the last two rounds.

    Each run comes with its task and the limit of omega_c as its periods begin, from which the next one starts; a ball
    that slips goes on with the rest of its last state.
    """
    states, rounds = [each.start(a) for each, a in driven], []
    for n in range(ROUNDS):
        times = refine * (2 if n == ROUNDS - 1 else 1)
        tasks = [each.task(lab, a, x, PERIODS, times, samples) for (each, a), x in zip(driven, states, strict=True)]
        runs = lab.run(tasks)
        limits = [limit(run.omega_c[samples::samples]) for run in runs]
        states = [
            State.of(run.x[-1])._replace(omega_c=omega_c).stacked() if slips else each.begun(omega_c).start(a)
            for (each, a), run, omega_c in zip(driven, runs, limits, strict=True)
        ]
        rounds.append(list(zip(tasks, runs, limits, strict=True)))
    return rounds[-2:]


def _followed(lab: Lab, pulsations: Sequence[Pulsation]) -> list[Pulsation]:
    """How balls follow pulsations of their own amplitudes."""
    followed, last = [], slice(-2 * SAMPLES, None)
    rounds = _rounds(lab, [(each, each.amplitude) for each in pulsations], 2, SAMPLES, slips=False)
    for each, (earlier, before, _), (later, run, omega_c) in zip(pulsations, *rounds, strict=True):
        ratios = []
        for shown in (before, run):
            phase = 2 * math.pi * each.frequency * shown.time[last]
            ratios.append(complex(2j * np.mean(shown.omega_c[last] * np.exp(-1j * phase)) / each.amplitude))
        change, new = abs(ratios[1] - ratios[0]), each.begun(omega_c)
        tasks, rolls = (earlier, later), rolls_on(run)
        followed.append(replace(new, ratio=ratios[1], uncertainty=change, rolls=rolls, tasks=tasks))
    return followed


def _raised(lab: Lab, pulsations: Sequence[Pulsation]) -> list[Pulsation]:
    """The largest of rising amplitudes at which the ball still rolls, where the law of drag isn't Stokes'."""
    raised, todo = list(pulsations), [k for k, each in enumerate(pulsations) if each.p.drag != STOKES]
    for _ in range(12):
        higher = [
            replace(each, amplitude=RAISE * each.amplitude, begin=each.begin * RAISE**each.power)
            for each in (raised[k] for k in todo)
        ]
        still = [(k, each) for k, each in zip(todo, _followed(lab, higher), strict=True) if each.rolls]
        for k, each in still:
            raised[k] = replace(each, power=math.log(each.begin / raised[k].begin, RAISE))
        todo = [k for k, _ in still]
    return raised


def _search(lab: Lab, pulsation: Pulsation) -> Search:
    """For the amplitude at which slip begins, in runs of one period and a half of which the first sixth is left out."""

    def task(amplitude: float, bracket: Bracket, care: Care) -> Task:
        x = pulsation.start(amplitude)
        return pulsation.task(lab, amplitude, x, 1.5 * care.time, 2 * care.refine, SAMPLES, largest=begin.high)

    if pulsation.p.drag == STOKES:
        # Where slip begins is not known yet: the least amplitude at which it may is taken for a rough width.
        largest = pulsation.reach / abs(pulsation.ratio)
        begin, size = Bracket(0.0, largest), largest / 2
    else:
        begin, size = Bracket(0.99 * pulsation.amplitude, RAISE * pulsation.amplitude), pulsation.amplitude
    return Search(begin, task, rolls_on, lab.effort("pulsation.width") * size)


def rolls_on(run: Trajectory) -> bool:
    """Whether after the first sixth of a run the ball nowhere slips at both points or leaves the floor for `LASTS`."""
    gone = np.isin(run.case[run.time > run.time[-1] / 6], [Case.SS, *(case for case in Case if case.A is Contact.N)])
    return bool(np.convolve(gone, np.ones(LASTS)).max() < LASTS)


def mean_errors(lab: Lab, slipping: Sequence[tuple[Pulsation, float]]) -> Iterator[Measurement | Missing]:
    """Means over the last period in pulsations of these amplitudes, with both steps, once periods repeat.

    The engine may remember what a state doesn't hold, such as how strongly floor and wall press against each other. How
    much the mean depends on it is seen in periods that start anew from states of the last one.
    """

    samples = 8 * PHASES
    coarse, fine = _rounds(lab, slipping, 1, samples, slips=True)
    anew = [
        each.task(lab, a, x, 1, 1, samples, phase=2 * math.pi * k / PHASES)
        for (each, a), (_, run, _) in zip(slipping, coarse, strict=True)
        for k, x in enumerate(run.x[-1 - samples : -1 : samples // PHASES])
    ]
    begun = np.reshape([run.theta[-1] - run.theta[0] for run in lab.run(anew)], (-1, PHASES))
    pairs = zip(slipping, begun, coarse, fine, strict=True)
    for (each, amplitude), turns, (_, run, _), (task, finer, _) in pairs:
        before, usual = (np.diff(run.theta[::samples]) * each.frequency)[-2:].tolist()
        first, mean = (np.diff(finer.theta[::samples]) * each.frequency)[-2:].tolist()
        value = mean - each.p.omega_0
        spread = float(np.abs(turns * each.frequency - usual).max())
        drift = abs(mean - usual) + abs(mean - first) + abs(usual - before) + spread
        # Slip begins and ends within a coarse step: half of that part of the mean error is uncertain.
        error = Measured(value, drift + abs(value) / round(task.steps / PERIODS))
        row = each.row(lab, "mean_error", error, [task], amplitude=amplitude)
        at = f"the mean reading at {each.frequency:g} Hz"
        yield if_sure(row, 0.9 * abs(value), f"{at} doesn't settle, or depends on more than the state")


def limit(values: Array) -> float:
    """The limit of the last three values of a geometric sequence; the last one if they diverge."""
    first, second = values[-2] - values[-3], values[-1] - values[-2]
    return float(values[-1] + (second**2 / (first - second) if abs(second) < abs(first) else 0.0))
