"""Decay rates and frequencies: settled states are pushed, and show their whole spectrum.

Every active variable of a case is pushed by itself, up and down. Half the difference of the two
runs, divided by the size of the push, is a column of D(t), which a linear motion turns into P D(t)
some time later: the logarithms of the eigenvalues of P are the exponents. Two sizes of the push are
extrapolated to zero, and so are two time steps.

Under another law of drag than Stokes' the rate of a ball without lag is that of the lag which the
push makes. With w = 1.6e-6 m/s, Re = 4e-4, drag by Schiller and Naumann is 7e-4 greater than by
Stokes; so these pushes are extrapolated to zero, too. (Until that was understood such states had an
uncertainty of up to 4e-2.)

Two states are special. A ball that spins in a fluid at rest (RS) feels the wall only by a friction
of the order of omega_c^2: it takes a large push. Where floor and ball only just touch (SR), every
push makes the ball lean on the floor one way and lifts it off the other way: only the first is
used."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from compare.campaign.tasks import Task
from compare.engines.study import STUDY_SLIP
from compare.method.conditions import Conditions, state_of
from compare.method.protocol import Protocol
from compare.method.quantities import quantity
from compare.method.record import Found, Measured, Measurement, Missing, Records, Sets
from compare.method.runner import Runner, coarse_step
from compare.method.scales import time_unit
from compare.method.settling import SPIN, is_well_known, physical_case, safe_height
from compare.method.statistics import (
    COVERAGE,
    Estimate,
    estimate,
    exponents,
    matched,
    propagator,
    propagator_error,
    uniform,
)
from compare.method.step_pairs import Start, unlike
from compare.method.together import Procedure, asked, together
from model import Case, Contact, Parameters, State, Trajectory
from model.arrays import Array
from model.cases import TRAITS
from model.drag import QUADRATIC, STOKES
from model.kinematics import SLIP_XYZ, VARIABLES, slip_speeds, state_units

PUSH_RECORD = (64, 256)
"""Of what follows a push: its length in coarse steps, about 3 sqrt(R/g), and samples."""
PUSH = {Case.RS: 0.3, Case.SR: 0.1}
"""Size of a push, in the `units`, where it is extrapolated to zero from this and half of it."""
USUAL_PUSH = 2e-4
"""Size of a push that isn't extrapolated to zero, under Stokes' law of drag. The run with the
coarser step has half of it, and shows that it doesn't matter."""
SLIGHT_PUSH = 2e-6  # the same under other laws: in proportion to a lag only far below Re = 1
SOLVED_MOVING = 2e-11
"""Relative accuracy to which contact forces are solved in a step after a push; those of a settled
state are solved better, see `settling.SOLVED`. (Chosen after states that swing had been seen.)"""
SLOWEST_SLIP = 0.04
"""Least slip speed of a state divided by sqrt(g R): a push is to be small beside it."""
ZERO_RATE = 0.05  # measured rates below this share of the drag coefficient c count as zero
STATES = {Case.RR: 1, Case.SR: 2, Case.SS: 2, Case.NR: 1, Case.NS: 1}
"""Most states of a case and set at the quick level, spread over the flows; more at the others."""
NOT_LINEAR = (
    "only drag by Stokes' law is in proportion to the lag that a push makes which this case needs"
)
Exponents = npt.NDArray[np.complex128]


def measure(runner: Runner, sets: Sets, records: Records) -> Measured:
    """All exponents of settled states in the six cases in which a ball can go round for ever."""
    pushed = list[Pushed]()
    for name, p in sets.items():
        pushed += yield from chosen_states(runner, records, name, p)
    yield from together(runner, (each.answer() for each in pushed))


@dataclass(frozen=True, eq=False)
class Pushed:
    """A settled state, from which the ball is pushed."""

    runner: Runner
    start: Start
    case: Case

    @property
    def active(self) -> list[int]:
        """Which of the variables are pushed."""
        return [VARIABLES.index(name) for name in TRAITS[self.case].active]

    @property
    def units(self) -> Array:
        """Natural sizes of the active variables."""
        return state_units(self.start.p)[self.active]

    @property
    def record(self) -> tuple[int, int]:
        """Length of a run after a push, in coarse steps, and samples; short for RS."""
        return (2, 16) if self.case is Case.RS else PUSH_RECORD

    @property
    def bends(self) -> bool:
        """Whether drag answers a slight lag by a broken power of it."""
        return self.start.p.drag != STOKES

    @property
    def order(self) -> int:
        """The power of the push's size in its error: 2 where up and down are subtracted, unless
        drag `bends`."""
        return 1 if self.case is Case.SR or self.bends else 2

    @property
    def sizes(self) -> tuple[float, ...]:
        """Sizes of the pushes: the first with the coarser step, then the largest first."""
        if not self.bends and self.case not in PUSH:
            return USUAL_PUSH / 2, USUAL_PUSH
        size = PUSH.get(self.case, SLIGHT_PUSH)
        return size / 2, size, size / 2

    def solver_error(self, record: Array, lag: int) -> float:
        """Standard uncertainty of a response `lag` samples later, from the accuracy of forces.

        What no motion explains of the record; at most an error of one sign and of all that the law
        may be off, more where slip is fast."""
        slip = np.abs(self.start.x0 / state_units(self.start.p))[SLIP_XYZ].max()
        most = uniform(SOLVED_MOVING * max(1.0, float(slip)) / max(self.sizes) * lag)
        return min(propagator_error(record, lag), most)

    @property
    def steps(self) -> tuple[float, float]:
        """The longer and the shorter time step, s."""
        sampling, step = self.runner.sampling, coarse_step(self.start.p)
        divisors = sampling.rates_SR if self.case is Case.SR else sampling.rates_divisors
        return step / divisors[0], step / divisors[1]

    @property
    def fast(self) -> bool:
        """Whether contacts slip fast enough for a push.

        Neither so slowly that it turns the slip, or friction stops it within four coarse steps, for
        a faster decay is not resolved; nor at half the speed, divided by what `STUDY_SLIP` allows
        for the load, at which they hover."""
        p, x = self.start.p, self.start.x0
        turned = math.sqrt(p.g * p.R) * max(SLOWEST_SLIP, 2 * PUSH.get(self.case, 0.0))
        loads = (p.mu, p.g), (p.eta, p.R * State.of(x).omega_c ** 2)
        contacts = zip(self.case.name, slip_speeds(x, p), loads, strict=True)
        return all(
            max(turned, 4 * coarse_step(p) * friction * load) < speed
            and friction * speed < 10 * STUDY_SLIP * load / p.g
            for contact, speed, (friction, load) in contacts
            if contact == "S"
        )

    def answer(self) -> Procedure[None]:
        """The exponents of the state, and how it answers each push."""
        if self.case in PUSH and self.bends:  # that push is too large
            yield self.missing(NOT_LINEAR, 2 * len(self.active) + len(self.active) ** 2)
            return
        tasks, count, (_, step) = self.tasks(), 2 * len(self.active), self.steps
        (runs,) = yield from asked(tasks)
        if isinstance(runs, str):
            yield self.missing(f"a run {runs}")
            return
        pushes = zip(self.sizes, range(0, len(runs), count), strict=True)
        answers = [push_response(self, size, runs[k : k + count]) for size, k in pushes]
        # An almost unloaded floor follows its load less exactly. (48 was 32 before rates by
        # shorter records had been seen to be off.)
        if min(map(len, answers)) < (48 if self.case is Case.SR else 8):
            yield self.missing("pushed, the ball doesn't stay in this case")
            return
        start, own = self.start, tasks[-count:]
        at = Conditions(case=self.case.name) | state_of(start.x0)
        row = partial(self.runner.measurement, start.set, start.p, tasks=own, **at)
        yield from _modes(self, spectrum(self, answers, step), step, row)
        yield from _responses(self, answers, row)

    def tasks(self) -> list[Task]:
        """Runs for each of the `sizes`: every active variable is pushed, up and down."""
        p, step, (coarse, fine) = self.start.p, coarse_step(self.start.p), self.steps
        lasts, samples = self.record
        tasks = []
        for size, h in zip(self.sizes, (coarse, fine, fine), strict=False):
            for k, unit in zip(self.active, size * self.units, strict=True):
                for push in (unit, -unit):
                    x = self.start.x0.copy()
                    x[k] += push
                    tasks.append(self.runner.task(p, x, lasts * step, h, samples=samples))
        return tasks

    def missing(self, why: str, rows: int = 0) -> Missing:
        """A record of numbers that were not measured, and why; by default of all decay rates and
        frequencies."""
        at = f"{self.case.name} at omega_0 = {self.start.p.omega_0:.4g} rad/s"
        return self.runner.missing(self.start.set, f"{at}: {why}", rows or 2 * len(self.active))


def chosen_states(
    runner: Runner, records: Records, name: str, p: Parameters
) -> Found[list[Pushed]]:
    """States of a set to be pushed: one that spins on the spot next to the wall, and several
    settled ones of each case.

    Where there are fewer that can be pushed, the rest is missing."""
    unit = time_unit(p)
    spinning = State(slip_y=SPIN / unit * p.R / p.r).stacked()
    chosen = [Pushed(runner, Start(name, p.replace(omega_0=0.0), "spinning", spinning), Case.RS)]
    values: dict[tuple[Parameters, Case], dict[str, float]] = {}
    for m in records.select("settled", where=lambda m: m.set == name and m.quantity in VARIABLES):
        if m.quantity != "omega_c" or is_well_known(m):
            values.setdefault((m.parameters, physical_case(m.case)), {})[m.quantity] = m.value
    values = {state: value for state, value in values.items() if "omega_c" in value}
    states = []
    # on the wall alone it is high up, and just touching the floor
    for (q, case), value in values.items():
        x = State(**value | {"y": 0.0, "h": 0.0, "v_h": 0.0})
        raised = x._replace(y=safe_height(q)) if case.A is Contact.N else x
        states.append(Pushed(runner, Start(name, q, "settled", raised.stacked()), case))
        if case is Case.NR:
            states.append(Pushed(runner, Start(name, q, "settled", x.stacked()), Case.SR))
    # no ball settles to going round with the fluid, but one that starts so goes on so
    if p.drag == QUADRATIC:
        q, x = p.replace(omega_0=0.5 / unit), State(omega_c=0.5 / unit)
        states.append(Pushed(runner, Start(name, q, "settled", x.stacked()), Case.RR))
    states.sort(key=lambda each: each.start.p.omega_0)
    for case, most in STATES.items():
        of = [each for each in states if each.case is case]
        alike = [state for state in of if state.fast]
        if case is Case.SR:  # in the fastest flows the floor is unloaded within a few samples
            alike = alike[: math.ceil(2 / 3 * len(alike))]
        count = math.ceil(runner.sampling.rates_more * most)
        places = {int((k + 0.5) * len(alike) / count) for k in range(count)} if alike else set()
        chosen += [alike[k] for k in sorted(places)]
        if (lacking := min(count, len(of)) - len(places)) > 0 or not of:
            why = f"{len(alike)} of {len(of)} states of {case.name} slip fast enough for a push"
            yield runner.missing(name, why, max(lacking, 0) * 2 * len(TRAITS[case].active))
    return chosen


def push_response(state: Pushed, size: float, runs: Sequence[Trajectory]) -> Array:
    """The response D (n, d, d) of active variables, in `units`, to pushes of one size.

    Only as long as the ball stays in the case and no variable is 0.4 away from the state, and
    without the first sample: forces build up then."""
    ups, downs = runs[::2], runs[1::2]
    if state.case is Case.SR:
        pairs = zip(ups, downs, strict=True)
        seen = [max(pair, key=lambda run: stays(run, state.case)) for pair in pairs]
        columns = [(1 if run in ups else -1) * (run.x - state.start.x0) for run in seen]
    else:
        # Where the wall carries nothing, as beside a ball that only spins, its contact is not
        # detected.
        seen = list(runs[:2] if state.case is Case.RS else runs)
        columns = [(up.x - down.x) / 2 for up, down in zip(ups, downs, strict=True)]
    D = np.stack(columns, axis=-1)[:, state.active] / (size * state.units[:, None])
    far = size * np.abs(D).max(axis=(1, 2)) > 0.4 * (1 + 1e-9)
    ends = [*(stays(run, state.case) for run in seen), int(np.argmax(np.append(far, True)))]
    return np.asarray(D[1 : min(ends)])


def stays(run: Trajectory, case: Case) -> int:
    """For how many samples a run stays in a case; the first one counts, whatever it is in.

    A ball on an almost unloaded floor may bounce; it is in SR until the floor lets go."""
    left = run.case[1:] != case
    if case is Case.SR:
        left |= run.force_A[1:, 1] <= 0
    return int(np.argmax(np.append(left, True))) + 1


class Spectrum(NamedTuple):
    """Exponents and what they may be off, each (d,), s-1."""

    exponents: Exponents
    uncertainty: Array
    budget: Mapping[str, Array]  # standard uncertainties by cause


def spectrum(state: Pushed, answers: Sequence[Array], step: float) -> Spectrum:
    """Exponents with their uncertainties, from answers to pushes of the `Pushed.sizes`.

    They are extrapolated to a vanishing push, and to a vanishing step by second order. The
    uncertainty is made up of that correction, which exceeds the remainder even of first order; the
    difference from the first half of the record; the next order in the size of the push; the error
    of a step for the fastest exponent; the accuracy of the solver."""
    lasts, samples = state.record
    interval, order = lasts * coarse_step(state.start.p) / samples, state.order
    # All records are cut to the length of the shortest, so that all are extrapolated from the same
    # motion.
    length = min(map(len, answers))

    def exponents_of(large: Array, small: Array, share: float = 1.0) -> Exponents:
        last, gain = max(4, round(share * length)), 1 / (2**order - 1)

        def at(lag: int) -> Array:
            P, P_large = (propagator(record[:last], lag) for record in (small, large))
            return np.asarray(P + gain * (P - P_large))

        return exponents(at, interval, last // 3)

    coarse, large, small = answers[0], answers[1], answers[-1]
    values = exponents_of(large, small)
    plain = matched(exponents_of(small, small), values)
    correction = (plain - matched(exponents_of(coarse, coarse), plain)) / 3
    half = np.abs(values - matched(exponents_of(large, small, 0.5), values))
    bent, size = np.abs(values - plain), max(state.sizes)
    if not state.bends:  # the next order of the push is smaller by as much again
        bent *= np.clip(bent / np.maximum(np.abs(values), np.finfo(float).tiny), size**order, 1.0)
    stepped = np.abs(values) * (np.abs(values).max() * step) ** 2 / 12
    budget = {
        "time_step": np.abs(correction),
        # pushed to one side, its two halves differ by as much as either is off
        "record": half * (1.0 if state.case is Case.SR else uniform(1.0)),
        "push": bent * uniform(1.0),
        "fastest_motion": stepped * uniform(1.0),
        "solver": np.full(len(values), state.solver_error(small[:length], 1) / interval),
    }
    uncertainty = np.sqrt(sum(u**2 for u in budget.values()))
    # Relative errors of one propagator have the same causes; that of one exponent may vanish by
    # chance.
    alike = np.abs(values) * uncertainty.max() / np.abs(values).max()
    return Spectrum(values + correction, np.maximum(uncertainty, alike), budget)


Row = Callable[..., Measurement]
"""Makes a measurement of a state from quantity, value and conditions."""


def _modes(state: Pushed, modes: Spectrum, step: float, row: Row) -> Measured:
    """Measurements of decay rate and frequency of each mode, one of each pair."""
    p, parts, exponents = state.start.p, [], modes.exponents
    order = np.lexsort((-exponents.real, exponents.imag))
    for mode, k in enumerate((k for k in order if exponents[k].imag >= 0), start=1):
        if abs(exponents[k]) * step > 0.25:
            why = f"one of its motions, by {abs(exponents[k]):.3g} 1/s, is too fast"
            yield state.missing(f"{why} for the time step", 2)
            continue
        rate, frequency = -float(exponents[k].real), float(exponents[k].imag)
        for name, value, other in (("decay_rate", rate, frequency), ("frequency", frequency, rate)):
            parts.append((name, mode, value, natural_size(value, other, p), k))
    # They come from one propagator: where one is too vague for a check, the others aren't to be
    # trusted more.
    sure = modes.uncertainty.tolist()
    powers = (COVERAGE * sure[k] / size / quantity(name).resolution for name, *_, size, k in parts)
    vague = max(powers)
    decays = [part for part in parts if part[0] == "decay_rate" and part[2] > ZERO_RATE * p.c]
    if decays:
        parts.append(("slowest_decay", *min(decays, key=lambda part: part[2])[1:]))
    for name, mode, value, size, k in parts:
        least = vague * quantity(name).resolution * size / COVERAGE if vague > 1 else 0.0
        budget = {cause: float(u[k]) for cause, u in modes.budget.items()}
        yield row(quantity=name, value=Estimate(value, max(sure[k], least), budget), mode=mode)


def _responses(state: Pushed, answers: Sequence[Array], row: Row) -> Iterator[Measurement]:
    """How each active variable follows a push of each, a third of the record later.

    This shows the directions of the motions, not only their rates. It is extrapolated as `spectrum`
    does, to a vanishing push and step, and uncertain by what they change, by what two thirds of the
    record say, each see `unlike`, and by the accuracy of the solver."""
    names, length = TRAITS[state.case].active, min(map(len, answers))
    lasts, samples = state.record
    lag = length // 3
    coarse, large, small = (propagator(answers[k][:length], lag) for k in (0, 1, -1))
    shorter = propagator(answers[-1][: 2 * lag], lag)
    bent, late = (small - large) / (2**state.order - 1), (small - coarse) / 3
    value, time = small + bent + late, lag * lasts * coarse_step(state.start.p) / samples
    solver = state.solver_error(answers[-1][:length], lag)
    pushes, steps, records = unlike(bent), unlike(late), unlike(small - shorter)
    for (i, of), (j, by) in product(enumerate(names), repeat=2):
        sure = estimate(
            value[i, j],
            push=uniform(float(pushes[i, j])),
            time_step=float(steps[i, j]),
            record=uniform(float(records[i, j])),
            solver=solver,
        )
        yield row(quantity="response", value=sure, time=time, of=of, pushed=by)


def natural_size(rate: float, other: float, p: Parameters) -> float:
    """Natural size, s-1, of the real or imaginary part of an exponent; `other` is the other.

    Its own, or that of the exponent if it is none, or else that of free fall."""
    for size in (abs(rate), math.hypot(rate, other)):
        if size > ZERO_RATE * p.c:
            return size
    return 1 / time_unit(p)


PROTOCOLS = (Protocol("rates", measure, ("settled",)),)
