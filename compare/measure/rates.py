"""Decay rates and frequencies: settled states are pushed a little, and the motion itself shows its whole spectrum.

Every active variable of a case is pushed by itself, up and down. Half the difference of the two runs, over the size of
the push, is a column of D(t), which a linear motion turns into P D(t) some time later: the logarithms of the
eigenvalues of P are the exponents, all of them, and no direction is singled out. Two sizes of the push are extrapolated
to none, two time steps to none.

Two states are special. A ball that spins in a fluid at rest (RS) feels the wall only while it goes round, with a
friction of the order of omega_c^2: it takes a large push. And where floor and ball only just touch (SR), every push
makes the ball lean on the floor one way and lifts it off the other way: only the first is used.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

import model
from compare.measure.lab import Lab, Level, coarse_step, state_units, time_unit
from compare.measure.record import Condition, Measurement, Missing, Records, measurement, state_of, sure_enough
from compare.measure.settled import SPIN
from compare.measure.settling import SOLVED, family, high
from compare.runs.engines import STUDY_SLIP
from compare.runs.tasks import Task
from compare.statistics import Measured, exponents, matched, propagator
from model import Case, Contact, Parameters, Trajectory
from model.arrays import Array
from model.cases import TRAITS
from model.drag import QUADRATIC, STOKES
from model.kinematics import VARIABLES, slip_speeds

PROTOCOL = "rates"
REFINE = {Level.QUICK: (8, 16), Level.DEFAULT: (16, 32), Level.FULL: (32, 64)}
"""The two time steps are these parts of `coarse_step`."""
RECORD = (64, 256)
"""Length of a record in coarse steps, which is about 3 sqrt(R/g), and its samples."""
BRIEF = {Case.RS: (2, 16)}
"""The same where a large push soon changes the state itself."""
PUSH = {Case.RS: 0.3, Case.SR: 0.1}
"""Size of a push, in the `units`, in the two cases in which it is extrapolated to none from this and half of it."""
SMALL = 2e-4
"""Size of a push in all other cases; the run with the coarser step has half of it, and shows that it doesn't matter."""
SLIGHT = 2e-6
"""The same where the law of drag isn't Stokes': the drag of a lag that the push makes is then in proportion to it only
as far as its Reynolds number is nothing beside 1."""
SLOWEST = 0.04
"""Least slip speed of a state over sqrt(g R): a push is to be small beside it."""
ORDER = {Case.RS: 2, Case.SR: 1}
"""What is left of a push's size: its square, where up and down are subtracted."""
FAR = 0.4
"""A record ends once a variable is so far from its settled value, in the `units`."""
LEAST = {Case.SR: 48}
"""Samples that a record must have, else 8: a floor that is about to carry nothing follows its load less exactly."""
STATES = {Case.RR: 1, Case.SR: 2, Case.SS: 2, Case.NR: 1, Case.NS: 1}
"""Most states of a case and set at the quick level, spread over the flows; beyond it, `MORE` times as many."""
MORE = {Level.QUICK: 1, Level.DEFAULT: 2, Level.FULL: 5}
STOPPED = 4.0
"""Coarse steps in which friction may stop the slip of a state at the soonest: in less, its decay is not resolved."""
HOVERS = 10.0
"""How many times as fast as `STUDY_SLIP` allows for its load a contact may slip: at 20 times it hovers."""
RESOLVED = 0.25
"""Largest exponent in units of the finer time step."""
REST = 0.05
"""Share of the drag coefficient c below which a measured rate counts as none."""
Exponents = npt.NDArray[np.complex128]


@dataclass(frozen=True, eq=False)
class State:
    """A settled state, from which the ball is pushed."""

    set: str
    p: Parameters
    case: Case
    x: Array = field(repr=False)


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """All exponents of settled states in the six cases in which a ball can go round for ever."""
    states = [state for name, p in sets.items() for state in chosen(records, name, p, MORE[lab.level])]
    tasks = [_tasks(lab, state) for state in states]
    failures = lab.complete([task for pushes in tasks for push in pushes for task in push])
    failed = {failure.task.key: failure.reason for failure in failures}
    for state, pushes in zip(states, tasks, strict=True):
        broken = [failed[task.key] for push in pushes for task in push if task.key in failed]
        if broken:
            yield _missing(state, f"a run {broken[0]}")
            continue
        answers = [answer(state, size, lab.run(push)) for size, push in zip(_sizes(state), pushes, strict=True)]
        if min(map(len, answers)) < LEAST.get(state.case, 8):
            yield _missing(state, "pushed, the ball doesn't stay in this case")
            continue
        step = coarse_step(state.p) / REFINE[lab.level][1]
        exponents, uncertainty = spectrum(state, answers, step)
        yield from _measurements(lab, state, exponents, uncertainty, step, pushes[-1])
    for name in sets:
        there = {state.case for state in states if state.set == name}
        for case in STATES:
            if case not in there:
                why = (
                    f"the ball settles in {case.name} at no flow that was tried, or slips too slowly or too fast there"
                )
                yield Missing(PROTOCOL, name, why)


def chosen(records: Records, name: str, p: Parameters, more: int) -> list[State]:
    """The states of a set that are pushed: at most so many of a case, and spinning on the spot next to the wall."""
    unit = time_unit(p)
    still = np.array([0.0, 0.0, 0.0, 0.0, SPIN / unit * p.R / p.r, 0.0, 0.0, 0.0])
    kept = [State(name, p.replace(omega_0=0.0), Case.RS, still)]
    states = [state for state in settled(records, name) if _suits(state)]
    if p.drag == QUADRATIC:  # it settles no ball that goes round with the fluid; but one that begins so goes on so
        slow = 0.5 / unit
        states.append(State(name, p.replace(omega_0=slow), Case.RR, model.State(omega_c=slow).stacked()))
    for case, most in STATES.items():
        alike = sorted((s for s in states if s.case is case), key=lambda s: s.p.omega_0)
        if case is Case.SR:  # in the fastest flows the floor is unloaded within a few samples
            alike = alike[: math.ceil(2 / 3 * len(alike))]
        places = {int((k + 0.5) * len(alike) / (more * most)) for k in range(more * most)} if alike else set()
        kept += [alike[k] for k in sorted(places)]
    return kept


def settled(records: Records, name: str) -> Iterator[State]:
    """The settled states of a set; one on the wall alone high up, and also where it only just touches the floor."""
    values: dict[tuple[Parameters, Case], dict[str, float]] = {}
    for m in records.select("settled", where=lambda m: m.set == name and m.quantity in VARIABLES):
        values.setdefault((m.parameters, family(Case[str(m.conditions["case"])])), {})[m.quantity] = m.value
    for (p, case), value in values.items():
        if case in (Case.RR, Case.SS, Case.NR, Case.NS):
            on_floor = model.State(**value | {"y": 0.0, "h": 0.0, "v_h": 0.0})
            x = on_floor._replace(y=high(p)) if case.A is Contact.N else on_floor
            yield State(name, p, case, x.stacked())
            if case is Case.NR:
                yield State(name, p, Case.SR, on_floor.stacked())


def units(state: State) -> Array:
    """Natural sizes of the active variables."""
    return state_units(state.p)[_active(state)]


def _suits(state: State) -> bool:
    """Whether what slips does so neither too slowly nor too fast.

    Too slowly: a push turns it round, or friction stops it within a few steps. Too fast: it hovers under its load.
    """
    p = state.p
    loads = p.g, p.R * model.State.of(state.x).omega_c ** 2
    turned = math.sqrt(p.g * p.R) * max(SLOWEST, 2 * PUSH.get(state.case, 0.0))
    return all(
        max(turned, STOPPED * coarse_step(p) * friction * load) < speed
        and friction * speed < HOVERS * STUDY_SLIP * load / p.g
        for contact, speed, friction, load in zip(
            (state.case.A, state.case.B), slip_speeds(state.x, p), (p.mu, p.eta), loads, strict=True
        )
        if contact is Contact.S
    )


def _size(state: State) -> float:
    """Size of a push."""
    return PUSH.get(state.case, SMALL if state.p.drag == STOKES else SLIGHT)


def _sizes(state: State) -> tuple[float, ...]:
    """Sizes of the pushes: the first with the coarser step, the others with the finer one, the largest first."""
    size = _size(state)
    return (size / 2, size, size / 2) if state.case in PUSH else (size / 2, size)


def _tasks(lab: Lab, state: State) -> list[list[Task]]:
    """Runs for each of the `_sizes`: every active variable is pushed, up and down."""
    p, step = state.p, coarse_step(state.p)
    coarse, fine = REFINE[lab.level]
    lasts, samples = BRIEF.get(state.case, RECORD)
    pushes = []
    for size, refine in zip(_sizes(state), (coarse, fine, fine), strict=False):
        starts = state.x + np.kron(np.diag(size * units(state)), [[1], [-1]]) @ np.eye(8)[_active(state)]
        pushes.append([lab.task(p, x, lasts * step, step / refine, samples=samples) for x in starts])
    return pushes


def _active(state: State) -> list[int]:
    return [VARIABLES.index(name) for name in TRAITS[state.case].active]


def answer(state: State, size: float, runs: Sequence[Trajectory]) -> Array:
    """D (n, d, d): how the active variables, over `units`, follow pushes of one size; runs in the order of the tasks.

    Only as long as the ball stays in the case and near the state; the first sample, at which forces build up, is not
    among them.
    """
    ups, downs = runs[::2], runs[1::2]
    if state.case is Case.SR:
        leaning = [max(pair, key=lambda run: stays(run, state.case)) for pair in zip(ups, downs, strict=True)]
        columns = [(1 if run in ups else -1) * (run.x - state.x) for run in leaning]
    else:
        leaning = [*runs]
        columns = [(up.x - down.x) / 2 for up, down in zip(ups, downs, strict=True)]
    # Where the wall carries nothing, as beside a ball that only spins, no contact with it shows.
    seen = leaning[:2] if state.case is Case.RS else leaning
    D = np.stack(columns, axis=-1)[:, _active(state)] / (size * units(state)[:, None])
    ends = [stays(run, state.case) for run in seen]
    ends.append(int(np.argmax(np.append(size * np.abs(D).max(axis=(1, 2)) > FAR * (1 + 1e-9), True))))
    return np.asarray(D[1 : min(ends)])


def stays(run: Trajectory, case: Case) -> int:
    """Samples after the first for which a run is in a case, and the first."""
    return int(np.argmax(np.append(run.case[1:] != case, True))) + 1


def spectrum(state: State, answers: Sequence[Array], step: float) -> tuple[Exponents, Array]:
    """Exponents (d,) in s-1 and their standard uncertainties, from the answers to pushes of the `_sizes`.

    The engine's order in the time step is taken to be 2. The uncertainty is that correction, which is larger than what
    is left if the order is 1; by how much the first half of the record differs; the next term in the size of the push,
    in which it is once more as small, or the first term over the whole; the error of a step for the fastest exponent;
    and the accuracy of the engine's solver.
    """
    lasts, samples = BRIEF.get(state.case, RECORD)
    interval = lasts * coarse_step(state.p) / samples
    # All records are as long as the shortest: extrapolated is one and the same thing.
    length = min(map(len, answers))

    def exponents_of(large: Array, small: Array, share: float = 1.0) -> Exponents:
        last = max(4, round(share * length))
        gain = 1 / (2 ** ORDER[state.case] - 1) if large is not small else 0.0

        def at(lag: int) -> Array:
            P = propagator(small[:last], lag)
            return P + gain * (P - propagator(large[:last], lag)) if gain else P

        return exponents(at, interval, last // 3)

    coarse, large, small = answers[0], answers[1], answers[-1]
    values = exponents_of(large, small)
    plain = matched(exponents_of(small, small), values)
    correction = (plain - matched(exponents_of(coarse, coarse), plain)) / 3
    half = np.abs(values - matched(exponents_of(large, small, 0.5), values))
    bent = np.abs(values - plain)
    size = _size(state) ** ORDER.get(state.case, 2)
    bent *= np.clip(bent / np.maximum(np.abs(values), np.finfo(float).tiny), size, 1.0)
    stepped = np.abs(values) * (np.abs(values).max() * step) ** 2 / 12
    solved = SOLVED / (_size(state) * interval)
    uncertainty = np.sqrt(np.abs(correction) ** 2 + half**2 + bent**2 + stepped**2 + solved**2)
    # Relative errors of one propagator have the same causes; that of one exponent may vanish by chance.
    alike = np.abs(values) * uncertainty.max() / np.abs(values).max()
    return values + correction, np.maximum(uncertainty, alike)


def _measurements(
    lab: Lab, state: State, exponents: Exponents, uncertainty: Array, step: float, tasks: Sequence[Task]
) -> Iterator[Measurement | Missing]:
    """One of each pair of conjugates, in the order of their decay, slowest first; and how many there are in all."""

    at: dict[str, Condition] = {"case": state.case.name, **state_of(state.x)}
    yield measurement(lab, PROTOCOL, state.set, state.p, "modes", len(exponents), tasks, **at)
    parts: list[tuple[str, Measured, float, dict[str, Condition]]] = []
    order = [k for k in np.argsort(-exponents.real) if exponents[k].imag >= 0]
    for mode, k in enumerate(order, start=1):
        if abs(exponents[k]) * step > RESOLVED:
            yield _missing(state, f"one of its motions, by {abs(exponents[k]):.3g} 1/s, is too fast for the time step")
            continue
        decay, frequency, sure = -float(exponents[k].real), float(exponents[k].imag), float(uncertainty[k])
        parts.append(("decay_rate", Measured(decay, sure), frequency, {"mode": mode, "frequency": frequency}))
        parts.append(("frequency", Measured(frequency, sure), decay, {"mode": mode, "decay_rate": decay}))
    # They come from one propagator: where one is too vague for a check, the others are not to be trusted either.
    for quantity, value, other, _ in parts:
        if not sure_enough(quantity, value, natural_size(value.value, other, state.p)):
            yield _missing(
                state, f"one of its exponents, {value.value:.3g} 1/s, is uncertain by {value.uncertainty:.1g}"
            )
            return
    for quantity, value, _, which in parts:
        yield measurement(lab, PROTOCOL, state.set, state.p, quantity, value, tasks, **at, **which)


def natural_size(rate: float, other: float, p: Parameters) -> float:
    """Natural size in s-1 of a part of an exponent, of which `other` is the other part.

    Its own, or that of the exponent if it is none, or else that of free fall.
    """
    for size in (abs(rate), math.hypot(rate, other)):
        if size > REST * p.c:
            return size
    return 1 / time_unit(p)


def _missing(state: State, why: str) -> Missing:
    return Missing(PROTOCOL, state.set, f"{state.case.name} at omega_0 = {state.p.omega_0:.4g} rad/s: {why}")
