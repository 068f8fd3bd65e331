"""A rolling ball in a pulsating flow: how it follows, at which amplitude it slips, what it then reads on average.

The mean flow is a fixed part of that at which two-point rolling ends. A small pulsation shows the engine's own rhythm,
from which every other run starts, so that it need not settle. With Stokes' law a large pulsation is a small one
magnified; with another one the amplitude is raised step by step until the ball slips, and the rhythm looked at anew.
Slip is what the engine's contacts show: both slip. Frequencies are powers of two, so that sets of about the same drag
share batches.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compare.measure.brackets import Bracket, Care, Search, narrow
from compare.measure.lab import Lab, coarse_step
from compare.measure.levels import Level
from compare.measure.record import Measurement, Missing, Records, measurement, sure_enough
from compare.runs.tasks import Task
from compare.statistics import Measured
from model import Case, Contact, Flow, Parameters, State, Trajectory
from model.arrays import Array
from model.drag import STOKES

PROTOCOL = "pulsation"
MEAN = 0.85
"""Mean flow over that at which two-point rolling ends."""
SMALL = 0.5
"""Amplitude of the pulsation that shows the rhythm, over what the mean flow lacks to the end of rolling."""
RUNG, RUNGS = 1.5, 12
"""Factor by which the amplitude is raised at a time with another law of drag than Stokes', and how often at most."""
SLOWEST = 0.5
"""The lowest angular frequency, about, in units of c."""
OCTAVES = {Level.QUICK: (3, 6), Level.DEFAULT: (0, 1, 3, 4, 6, 7), Level.FULL: (0, 1, 2, 3, 4, 5, 6, 7)}
"""Where the frequencies are above it: two decades."""
STEPS = {Level.QUICK: 512, Level.DEFAULT: 1024, Level.FULL: 2048}
"""Least number of time steps in a period."""
PERIODS, ROUNDS = 3, 5
"""Length of the runs, and how many there are, each from where the one before points to, the last with half the step."""
WIDTH = {Level.QUICK: 1e-3, Level.DEFAULT: 2.5e-4, Level.FULL: 1.2e-4}
"""Relative width to which the onset of slip is bracketed; if half the step moves it, it counts eight times as much."""
REACH = 1.1
"""Largest amplitude that is tried: it would take the ball beyond its end of rolling by so much."""
LOOKED = 1.5
"""Length of the runs of a bracket in periods, of which the first sixth doesn't count."""
ALONE = 2e-4
"""How much the slip speeds of both may differ just below the onset, over sqrt(g R): beyond it, one slips alone."""
SAMPLES, LASTS = 256, 5
"""Samples in a period there, and how many of them slip must last to count: friction may be full for a moment before."""
SURE = 0.9
"""Part of what is measured that stands for what will be predicted, where it is asked whether it is sure enough."""
BEYOND = 1.5
"""Amplitude at which the mean reading is measured, over the one at which slip begins."""
ANEW = 8
"""Phases of a period at which the motion is started anew from its state: what changes then hangs on more than that."""


@dataclass(frozen=True, eq=False)
class Rhythm:
    """How a rolling ball follows a small pulsation."""

    set: str
    p: Parameters
    """With the mean flow."""
    frequency: float
    amplitude: float
    """Of the pulsation, rad s-1."""
    reach: float
    """How far omega_c may swing in the largest pulsation that is tried, rad s-1."""
    begin: float = 0.0
    """omega_c less the mean flow as a period begins, over the amplitude;"""
    power: float = 0.0
    """the power of the amplitude with which that grows."""
    ratio: complex = 1.0
    """omega_c over omega_0."""
    uncertainty: float = math.inf
    """Of its parts."""
    tasks: tuple[Task, ...] = ()

    def start(self, amplitude: float) -> Array:
        """The state of a ball that follows a pulsation, as it begins."""
        return State(
            omega_c=self.p.omega_0 + amplitude * self.begin * (amplitude / self.amplitude) ** self.power
        ).stacked()

    def steps(self, lab: Lab, largest: float) -> int:
        """Usual number of time steps in a period, a power of two, for amplitudes up to the `largest`."""
        fastest = 4 * (self.p.omega_0 + largest) / self.frequency
        return int(
            2 ** math.ceil(math.log2(max(STEPS[lab.level], 1 / (self.frequency * coarse_step(self.p)), fastest)))
        )

    def task(
        self,
        lab: Lab,
        amplitude: float,
        x: Array,
        periods: float,
        largest: float,
        refine: int,
        samples: int = 64,
        phase: float = 0.0,
    ) -> Task:
        """A run from a state; no amplitude that it is compared with is above the `largest`."""
        step = 1 / (self.frequency * self.steps(lab, largest) * refine)
        flow = Flow.sine(self.p.omega_0, amplitude, self.frequency, phase)
        return lab.task(self.p, x, periods / self.frequency, step, flow=flow, samples=round(samples * periods))


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Gain and phase of rolling; the amplitude at which slip begins; the mean reading beyond it."""
    rhythms = []
    for name, p in sets.items():
        ends = [m.value for m in records.select("thresholds", "omega_01", lambda m, name=name: m.set == name)]  # type: ignore[misc]
        if not ends:
            yield Missing(PROTOCOL, name, "no flow was measured at which two-point rolling ends by slipping")
        else:
            base = 2.0 ** round(math.log2(SLOWEST * p.c / (2 * math.pi)))
            q = p.replace(omega_0=MEAN * ends[0])
            room = ends[0] - q.omega_0
            rhythms += [Rhythm(name, q, base * 2.0**n, SMALL * room, REACH * room) for n in OCTAVES[lab.level]]
    rhythms = _rhythms(lab, rhythms)
    for rhythm in rhythms:
        yield from _followed(lab, rhythm)
    rhythms = _raised(lab, [rhythm for rhythm in rhythms if _rolls(lab, rhythm)])
    brackets = narrow(lab, [_search(lab, rhythm) for rhythm in rhythms])
    slipping = []
    for rhythm, bracket in zip(rhythms, brackets, strict=True):
        at, place = f"a pulsation at {rhythm.frequency:g} Hz", bracket.place
        # Near the phase at which it sets in, slip lasts for 2 sqrt(2 e) rad beyond the onset by e.
        unseen = (math.pi * LASTS / SAMPLES) ** 2 / 2 * place.value
        onset = Measured(place.value, math.hypot(place.uncertainty, unseen))
        low, high = bracket.runs
        if low is None or high is None:
            yield Missing(PROTOCOL, rhythm.set, f"in {at} there is slip at no amplitude, or at all")
        elif _alone(low) > ALONE:
            yield Missing(PROTOCOL, rhythm.set, f"in {at} one contact slips before both do, too little to tell when")
        elif not sure_enough("slip_amplitude", onset, SURE * onset.value):
            yield Missing(PROTOCOL, rhythm.set, f"slip in {at} begins at no definite amplitude")
        else:
            yield _record(lab, rhythm, "slip_amplitude", onset, bracket.tasks)
            slipping.append((rhythm, BEYOND * onset.value))
    yield from mean_errors(lab, slipping)


def _rhythms(lab: Lab, rhythms: Sequence[Rhythm]) -> list[Rhythm]:
    """Runs in pulsations of their amplitudes, each from where the one before points to."""
    followed = list(rhythms)
    for n in range(ROUNDS):
        refine = 4 if n == ROUNDS - 1 else 2
        tasks = [
            r.task(lab, r.amplitude, r.start(r.amplitude), PERIODS, r.amplitude, refine, SAMPLES) for r in followed
        ]
        for k, (rhythm, task, run) in enumerate(zip(followed, tasks, lab.run(tasks), strict=True)):
            period = (len(run.time) - 1) // PERIODS
            ratio = _ratio(run, rhythm, period)
            followed[k] = replace(
                rhythm,
                begin=(limit(run.omega_c[period::period]) - rhythm.p.omega_0) / rhythm.amplitude,
                ratio=ratio,
                uncertainty=abs(ratio - rhythm.ratio),
                tasks=(*rhythm.tasks[-1:], task),
            )
    return followed


def _ratio(run: Trajectory, rhythm: Rhythm, period: int) -> complex:
    """omega_c over omega_0, by the Fourier sum over the last two periods."""
    phase = 2 * math.pi * rhythm.frequency * run.time[-2 * period :]
    return complex(2j * np.mean(run.omega_c[-2 * period :] * np.exp(-1j * phase)) / rhythm.amplitude)


def _followed(lab: Lab, rhythm: Rhythm) -> Iterator[Measurement | Missing]:
    if not _rolls(lab, rhythm):
        yield Missing(
            PROTOCOL,
            rhythm.set,
            f"at {rhythm.frequency:g} Hz a ball slips in a pulsation half as large as in a slow one",
        )
        return
    gain, lag, by = abs(rhythm.ratio), -math.atan2(rhythm.ratio.imag, rhythm.ratio.real), rhythm.uncertainty
    yield _record(lab, rhythm, "gain", Measured(gain, by), rhythm.tasks, amplitude=rhythm.amplitude)
    yield _record(lab, rhythm, "phase_lag", Measured(lag, by / gain), rhythm.tasks, amplitude=rhythm.amplitude)


def _raised(lab: Lab, rhythms: Sequence[Rhythm]) -> list[Rhythm]:
    """The rhythms at the last of rising amplitudes at which the ball rolls, and how their beginnings have changed."""
    raised, todo = list(rhythms), [k for k, rhythm in enumerate(rhythms) if rhythm.p.drag != STOKES]
    for _ in range(RUNGS):
        begin = [
            replace(each, amplitude=RUNG * each.amplitude, begin=each.begin * RUNG**each.power)
            for each in (raised[k] for k in todo)
        ]
        higher = {k: rhythm for k, rhythm in zip(todo, _rhythms(lab, begin), strict=True) if _rolls(lab, rhythm)}
        for k, rhythm in higher.items():
            raised[k] = replace(rhythm, power=math.log(rhythm.begin / raised[k].begin, RUNG))
        todo = list(higher)
    return raised


def _rolls(lab: Lab, rhythm: Rhythm) -> bool:
    return rolls_on(*lab.run(rhythm.tasks[-1:]))


def _search(lab: Lab, rhythm: Rhythm) -> Search:
    def task(amplitude: float, bracket: Bracket, care: Care) -> Task:
        start = rhythm.start(amplitude)
        return rhythm.task(lab, amplitude, start, LOOKED * care.time, begin.high, 2 * care.refine, SAMPLES)

    if rhythm.p.drag == STOKES:
        # Where slip begins is not known yet: the least amplitude at which it may is taken for a rough width.
        begin, width = Bracket(0.0, rhythm.reach / abs(rhythm.ratio)), rhythm.reach / abs(rhythm.ratio) / 2
    else:
        begin, width = Bracket(0.99 * rhythm.amplitude, RUNG * rhythm.amplitude), rhythm.amplitude
    return Search(begin, task, rolls_on, WIDTH[lab.level] * width)


def rolls_on(run: Trajectory) -> bool:
    """Whether the ball nowhere slips at both points or leaves the floor for `LASTS`, but for the beginning of a run."""
    gone = np.isin(run.case[run.time > run.time[-1] / 6], [Case.SS, *(case for case in Case if case.A is Contact.N)])
    return bool(np.convolve(gone, np.ones(LASTS)).max() < LASTS)


def _alone(run: Trajectory) -> float:
    """Largest difference of the slip speeds but for the beginning of a run, over sqrt(g R)."""
    p, late = run.header.parameters, run.time > run.time[-1] / 6
    return float(np.abs(run.slip_speed_A - run.slip_speed_B)[late].max() / math.sqrt(p.g * p.R))


def mean_errors(lab: Lab, slipping: Sequence[tuple[Rhythm, float]]) -> Iterator[Measurement | Missing]:
    """Means over the last period, with both steps, once each period is as the one before.

    The engine may remember what a state doesn't hold, such as how strongly floor and wall press against each other. How
    much the mean hangs on it is seen in periods that start anew from states of the last one.
    """
    states = [rhythm.start(amplitude) for rhythm, amplitude in slipping]
    means: list[list[float]] = [[] for _ in slipping]
    last: list[Array] = [np.empty(0) for _ in slipping]
    for n in range(ROUNDS):
        refine = 2 if n == ROUNDS - 1 else 1
        tasks = [r.task(lab, a, x, PERIODS, a, refine) for (r, a), x in zip(slipping, states, strict=True)]
        for k, run in enumerate(lab.run(tasks)):
            period = (len(run.time) - 1) // PERIODS
            turns = np.diff(run.theta[::period]) * slipping[k][0].frequency
            means[k] += [float(turns[-2]), float(turns[-1])]
            states[k] = State.of(run.x[-1])._replace(omega_c=limit(run.omega_c[period::period])).stacked()
            if n == ROUNDS - 2:
                last[k] = run.x[-1 - period : -1 : period // ANEW]
    anew = [
        r.task(lab, a, x, 1, a, 1, phase=2 * math.pi * k / ANEW)
        for (r, a), period in zip(slipping, last, strict=True)
        for k, x in enumerate(period)
    ]
    begun = np.reshape([run.theta[-1] - run.theta[0] for run in lab.run(anew)], (-1, ANEW))
    for (rhythm, amplitude), task, (*_, before, usual, coarse, fine), turns in zip(
        slipping, tasks, means, begun, strict=True
    ):
        value = fine - rhythm.p.omega_0
        spread = float(np.abs(turns * rhythm.frequency - usual).max())
        drift = abs(fine - usual) + abs(fine - coarse) + abs(usual - before) + spread
        # Slip begins and ends within a step: that much of a period, and of what it takes off the mean, is open.
        error = Measured(value, drift + abs(value) / (2 * rhythm.steps(lab, amplitude)))
        if sure_enough("mean_error", error, SURE * abs(error.value)):
            yield _record(lab, rhythm, "mean_error", error, [task], amplitude=amplitude)
        else:
            at = f"the mean reading at {rhythm.frequency:g} Hz"
            yield Missing(PROTOCOL, rhythm.set, f"{at} doesn't settle, or hangs on more than the state")


def limit(values: Array) -> float:
    """Where the last three values of a row point to, that of a geometric approach; the last one if they diverge."""
    first, second = values[-2] - values[-3], values[-1] - values[-2]
    return float(values[-1] + (second**2 / (first - second) if abs(second) < abs(first) else 0.0))


def _record(
    lab: Lab, rhythm: Rhythm, quantity: str, value: Measured, tasks: Sequence[Task], **conditions: float
) -> Measurement:
    at = {"f": rhythm.frequency} | conditions
    return measurement(lab, PROTOCOL, rhythm.set, rhythm.p, quantity, value, tasks, **at)
