"""Runs until they are settled, by their own drift; what a settled state is, and how sure each of its numbers is.

A mean over a window that falls off smoothly at both ends passes over the oscillation of a ball on the wall, which dies
out slowly or, while it sinks, not at all. Three overlapping windows show how far the mean still drifts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from compare.measure.lab import Lab, coarse_step, dragged_speed, time_unit
from compare.measure.quantities import quantity
from compare.measure.trials import Start
from compare.runs.tasks import Task
from compare.statistics import COVERAGE, Measured
from model import Case, Contact, Parameters, State, Trajectory
from model.arrays import Array
from model.drag import STOKES

SPAN = 40.0
"""Least length of a round in units of 1/c, the time in which the fluid stops a free ball."""
ROUNDS = (1.0, 2.0, 2.0)
"""What follows each other, in units of that length. The later rounds last longer: a ball on the wall that goes on from
its mean begins to swing anew, if less, and that has to die out, too."""
SOONER = (1 / 64, 1 / 8)
"""Rounds before those, in parts of one, where the law isn't Stokes': what lags or sinks is dragged harder than by
c, and settles sooner. In such a part it may drift only that part of what it may in a whole round."""
SHARES = (0.5, 0.125)
"""Lengths of the window over that of the run: a long one for what oscillates, a short one for what only decays."""
TAPER = 8
"""Exponent of the sine that the window is: m periods within it leave about (TAPER/2)!^2/(pi m^(TAPER+1)) of one."""
STEPS = 2048
"""Coarse time steps of which a round has a whole multiple, so that sets of about the same drag share a batch."""
PERIODS = 8
"""Least length of a round in turns of the fluid, in whose rhythm a slipping ball on the wall swings."""
STEPS_A_SAMPLE = 8
"""A coarse time step is a twentieth of sqrt(R/g) or so, and the ball goes round in more than that."""
SOLVED = 1e-12
"""Relative accuracy to which contact forces are solved in a step; errors of one sign add up for a time 1/c."""
MARGIN = 2.0
"""A run is settled once its drift lets each check resolve what it should with this to spare."""
SWING = 1e-3
"""Largest range of a settled quantity within the window, over its scale: what swings more goes on from its mean."""
STEADY = 0.98
"""Share of the samples in the window that must be of one case."""
FORCES = tuple(f"force_{contact}{axis}" for contact in "AB" for axis in "xyz")
SUMS = ("force_Az", "force_Bz", "force_Ax-By", "force_Ay+By", "force_Bx+By")
"""What mechanics determine of the forces where both contacts roll: the rest is a family of one parameter."""
GROUPS = (("omega_c",), ("slip_x", "slip_y", "slip_z", "wall_spin"), ("v_y",), (*FORCES, *SUMS[2:]))
"""Quantities whose errors have the same causes, and are taken to be as large as the largest of them."""


@dataclass(frozen=True, eq=False)
class Settled:
    """Where a run has come to; `failure` says why it doesn't count as settled, empty if it does."""

    start: Start
    case: Case
    values: Mapping[str, Measured] = field(repr=False)
    mean: Array
    """Its mean state, (8,), from which it goes on: without the oscillation that it still has."""
    task: Task = field(repr=False)
    excess: float = math.inf
    """How many times as much as it may for a comparison with theory it drifts or swings."""
    failure: str = ""


def begin(set: str, p: Parameters, how: str) -> Start:
    """At the flow of p from rest, going round with the fluid or half as fast, or with it and so high up on the wall."""
    orbit = {"rest": 0.0, "half as fast": p.omega_0 / 2}.get(how, p.omega_0)
    return Start(set, p, how, State(y=high(p) if how == "on the wall" else 0.0, omega_c=orbit).stacked())


def rotation_scale(p: Parameters) -> float:
    """Natural size of a rate of rotation, rad s-1: omega_0, in a fluid at rest 1/`time_unit`."""
    return abs(p.omega_0) or 1 / time_unit(p)


def scale(name: str, p: Parameters) -> float:
    """Natural size of a quantity of a settled state, over which errors are counted."""
    if name.startswith("force"):
        return p.m * p.g
    if name == "v_y":
        return dragged_speed(p)
    return rotation_scale(p) * (1.0 if name == "omega_c" else p.R / p.r)


def columns(run: Trajectory) -> dict[str, Array]:
    """Quantities of a settled state by name, each (n,)."""
    p, A, B = run.header.parameters, run.force_A, run.force_B
    values = {name: getattr(run, name) for name in ("omega_c", "slip_x", "slip_y", "slip_z", "v_y")}
    values["wall_spin"] = run.slip_x + p.R / p.r * run.omega_c
    values |= {f"force_{c}{axis}": force[:, k] for c, force in (("A", A), ("B", B)) for k, axis in enumerate("xyz")}
    sums = {"force_Ax-By": A[:, 0] - B[:, 1], "force_Ay+By": A[:, 1] + B[:, 1], "force_Bx+By": B[:, 0] + B[:, 1]}
    return values | sums


def determined(case: Case) -> tuple[str, ...]:
    """The quantities that a settled state of a case has.

    Where both contacts roll, only sums of forces; and nothing but the wall turns a ball about the vertical.
    """
    forces = SUMS if case is Case.RR else FORCES
    upright = () if case.B is Contact.N else ("slip_y",)
    return ("omega_c", "slip_x", *upright, "slip_z", "wall_spin", "v_y", *forces)


def family(case: Case) -> Case:
    """SR with an unloaded floor and NR at y = 0 are one physical state: both count as NR."""
    return Case.NR if case is Case.SR else case


def settle(
    lab: Lab,
    starts: Sequence[Start],
    *,
    refine: int = 1,
    span: float = SPAN,
    loose: float = 1.0,
    sharp: float = math.inf,
) -> list[Settled]:
    """Run each start until it is settled, in the order given; the step is that of `coarse_step` over `refine`.

    Settled may drift and swing `loose` times as much as values may that are held against theory; but as long as there
    are rounds, what exceeds `sharp` times goes on as well.

    It goes on from its mean, but at the height from which it started: a ball on the wall alone knows nothing of its
    height, and one that sinks must not land.
    """
    states: dict[int, Settled] = {}
    todo = dict(enumerate(starts))
    left = [[*(SOONER if start.p.drag != STOKES else ()), *ROUNDS] for start in starts]
    while todo:
        parts = {n: left[n].pop(0) for n in todo}
        tasks = {n: _task(lab, start, refine, span * parts[n]) for n, start in todo.items()}
        parts = {n: task.t_end / duration(task.parameters, span) for n, task in tasks.items()}
        todo = {}
        for (n, task), run in zip(tasks.items(), lab.each(list(tasks.values())), strict=True):
            if isinstance(run, str):
                states[n] = Settled(starts[n], Case.NN, {}, starts[n].x0, task, failure=f"the run {run}")
                continue
            states[n] = judged(starts[n], task, run, loose)
            if left[n] and states[n].excess > min(parts[n], 1.0) * min(loose, sharp):
                # A part of a round may end on the way to where the ball settles: it goes on as it is.
                todo[n] = replace(starts[n], x0=run.x[-1]) if parts[n] < 1 else _onward(states[n])
    return [states[n] for n in range(len(starts))]


def settle_groups(
    lab: Lab, groups: Sequence[Sequence[Start]], *, span: float = SPAN, loose: float = 1.0, sharp: float = math.inf
) -> list[list[Settled]]:
    """The same for groups of starts, all of them together."""
    states = iter(settle(lab, [start for group in groups for start in group], span=span, loose=loose, sharp=sharp))
    return [[next(states) for _ in group] for group in groups]


def duration(p: Parameters, span: float = SPAN) -> float:
    """Length of a round, s."""
    unit = STEPS * coarse_step(p)
    turns = PERIODS * 2 * math.pi / abs(p.omega_0) if p.omega_0 else 0.0
    return unit * math.ceil(max(span / p.c, turns) / unit)


def high(p: Parameters) -> float:
    """A height in m from which a ball that sinks as fast as it may freely doesn't land within a round."""
    return 1.25 * dragged_speed(p) * duration(p, max(ROUNDS) * SPAN)


def _task(lab: Lab, start: Start, refine: int, span: float) -> Task:
    step, t_end = coarse_step(start.p), duration(start.p, span)
    return lab.task(start.p, start.x0, t_end, step / refine, samples=round(t_end / (STEPS_A_SAMPLE * step)))


def _onward(state: Settled) -> Start:
    x0 = State.of(state.mean)
    if state.case.A is Contact.N:
        x0 = x0._replace(y=max(State.of(state.start.x0).y, 0.0))
    return replace(state.start, x0=x0.stacked())


def judged(start: Start, task: Task, run: Trajectory, loose: float = 1.0) -> Settled:
    """What a run has come to, over the window in which it drifts the least; `loose` as in `settle`."""
    windows = (_judged(start, task, run, int(share * len(run.time)), loose) for share in SHARES)
    return min(windows, key=lambda state: state.excess)


def _judged(start: Start, task: Task, run: Trajectory, length: int, loose: float) -> Settled:
    counts = np.bincount(run.case[-length:])
    case, p = Case(int(counts.argmax())), start.p
    series = columns(run)
    swings = max(float(np.ptp(series[q][-length:])) / scale(q, p) for q in determined(case))
    means, drifts = steady_mean(np.stack([*series.values(), *run.x.T]), length)
    mean, drift = (dict(zip(series, row.tolist(), strict=False)) for row in (means, drifts))
    groups = [[q for q in group if q in determined(case)] for group in GROUPS]
    worst = {q: max(drift[each] / scale(each, p) for each in group) for group in groups for q in group}
    solved = SOLVED / (p.c * coarse_step(p))
    values = {q: Measured(mean[q], math.hypot(solved, worst[q]) * scale(q, p)) for q in worst}
    drifting = max(COVERAGE * MARGIN * worst[q] / quantity(q).resolves for q in worst)
    floor = max(COVERAGE * solved / quantity(q).resolves for q in worst)  # the same however long a run is
    failure = ""
    excess = max(drifting, swings / SWING)
    if counts.max() < STEADY * length:
        excess = math.inf
        failure = f"its contacts keep changing ({case.name} in {counts.max() / length:.0%} of the last samples)"
    elif max(excess, floor) > loose:
        way = "drifts" if max(drifting, floor) > loose else "swings"
        failure = f"in {case.name} it still {way} {max(excess, floor):.2g} times as much as it may"
    return Settled(start, case, values, means[len(series) :], task, excess, failure)


def taper(length: int) -> Array:
    """The window (n,): it falls off smoothly at both ends."""
    return np.asarray(np.sin(np.pi * (np.arange(length) + 0.5) / length) ** TAPER)


def steady_mean(values: Array, length: int) -> tuple[Array, Array]:
    """Mean of rows (k, n) over their last `length` samples, tapered, and how far it may be from its limit; both (k,).

    From three windows, each a quarter of its length later than the one before: what is left of an approach by a
    constant ratio, plus the last change itself.
    """
    weights = taper(length)
    weights /= weights.sum()
    n, shift = values.shape[1], length // 4
    first, second, last = (values[:, n - length - k * shift : n - k * shift] @ weights for k in (2, 1, 0))
    before, after = np.abs(second - first), np.abs(last - second)
    ratio = np.minimum(np.divide(after, before, out=np.zeros_like(after), where=before > 0), 0.9)
    return last, after / (1 - ratio)
