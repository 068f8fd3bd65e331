"""Runs until they are settled, by their drift; what a settled state is, and how sure it is.

The oscillation of a ball on the wall dies out slowly or, while it sinks, not at all; a mean over a
tapered window is free of it. Three overlapping windows show how far the mean still drifts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from compare.campaign.tasks import Task
from compare.method.quantities import quantity
from compare.method.record import Measured, Measurement, Records
from compare.method.runner import Runner, coarse_step
from compare.method.scales import dragged_speed, rotation_scale
from compare.method.statistics import COVERAGE, Estimate, estimate, steady_limit, steady_mean
from compare.method.step_pairs import Start
from model import Case, Contact, Parameters, State, Trajectory
from model.arrays import Array
from model.drag import STOKES

PRESSES = 0.05  #: normal force, in weights, above which friction is looked at: less may hover
SPIN = 1.0  #: spin slip_y of a ball in a fluid at rest, in units of sqrt(g/R) R/r
SPAN = 40.0
"""Least length of a round in units of 1/c, the time in which the fluid stops a free ball."""
LONGEST = 2.0  #: length of the longest round in units of `SPAN`
SHORT = (1 / 64, 1 / 8)
"""Rounds before those where the law isn't Stokes': other drag laws are stronger, so balls settle
sooner. The drift limit of such a round is reduced in proportion to its length."""
STARTED_NEAR = 1 / 4
"""The round before those where a ball begins from what it settled to with a longer step."""
NEARBY = 1e4
"""Times the limit below which a run goes on from where its means lead: speeds then drift by some
thousandths at most. What grows, as where a state is unstable, leads nowhere and is left as it is.
A guess that is wrong costs time: what counts is how the run drifts that begins there."""
AS_IT_COMES = 0.45  #: the one round of an engine as it comes
STEPS_A_SAMPLE = 8
"""A coarse step is about a twentieth of sqrt(R/g), and the ball goes round more slowly."""
SOLVED = 1e-12
"""Relative accuracy to which contact forces are solved in a step; errors of one sign add up for a
time 1/c. (It was 2e-11 as long as settled states of rigid contacts crept by as much.)"""
STATE_KNOWN = 1e-5
"""Relative uncertainty of omega_c up to which a state is known well enough for others to be
measured from it. (Chosen after states off by 1.4e-4 had been at the default level.)"""
FORCES = tuple(f"force_{contact}{axis}" for contact in "AB" for axis in "xyz")
SUMS = ("force_Az", "force_Bz", "force_Ax-By", "force_Ay+By", "force_Bx+By")
"""What mechanics determine of the forces in RR: the rest is a family of one parameter."""
ERROR_GROUPS = (
    ("omega_c",),
    ("slip_x", "slip_y", "slip_z", "wall_spin"),
    ("v_y",),
    (*FORCES, *SUMS[2:]),
)
"""Quantities whose errors have the same causes, and are taken to be alike."""


@dataclass(frozen=True, eq=False)
class SteadyState:
    """Where a run has come to."""

    start: Start
    case: Case
    values: Mapping[str, Estimate] = field(repr=False)
    mean: Array
    """Its mean state, (8,), or the one to which its means lead, from which it goes on: without the
    oscillation, and the drift, that it still has."""
    task: Task = field(repr=False)
    excess: float = math.inf  #: drift or swing divided by its limit for a comparison with theory
    failure: str = ""  #: why it doesn't count as settled

    def settled_in(self, *cases: Case) -> bool:
        """Whether it counts as settled, in one of these cases."""
        return not self.failure and self.case in cases


@dataclass(frozen=True)
class SettlingCriteria:
    """For how long a state is waited for, and how well it must be settled."""

    divisor: float = 1  #: time steps in one of `coarse_step`
    span: float = SPAN  #: length of a round in units of 1/c
    loose: float = 1.0
    """A settled state may drift and swing up to so many times the limit for a comparison."""
    sharp: float = math.inf
    """As long as there are rounds, one that exceeds so many times that limit goes on."""
    rounds: Sequence[float] = ()
    """Lengths of successive rounds in units of `span`; those of the level if none are given."""


def settle(
    runner: Runner, starts: Sequence[Start], criteria: SettlingCriteria = SettlingCriteria()
) -> list[SteadyState]:
    """Run the ball from each start until it is settled; the states, in order.

    Of an engine as it comes every state counts, for what it is after a round. After a part of a
    round the limit is that part of it. What isn't settled goes on from where its means lead, or, if
    it is far from there after a part of a round, as it is. On the wall alone it does so at the
    height from which it started: the motion there does not depend on its height, and a ball that
    sinks must not land."""
    rounds = criteria.rounds or runner.sampling.settling_rounds
    span, loose = criteria.span, criteria.loose
    left = [[*(SHORT if start.p.drag != STOKES else ()), *rounds] for start in starts]
    if runner.engine.relative_tolerance:
        loose, left = math.inf, [[AS_IT_COMES] for _ in starts]
    states: dict[int, SteadyState] = {}
    todo = dict(enumerate(starts))
    while todo:
        tasks = []
        for n, start in todo.items():
            step, t_end = coarse_step(start.p), duration(start.p, span * left[n].pop(0))
            samples = round(t_end / (STEPS_A_SAMPLE * step))
            step /= criteria.divisor
            task = runner.task(start.p, start.x0, t_end, step, samples=samples)
            # goes on as deep as it was
            tasks.append(replace(task, x0=start.x0) if n in states else task)
        under_way, todo = list(todo), {}
        for n, task, run in zip(under_way, tasks, runner.each(tasks), strict=True):
            start = starts[n]
            if isinstance(run, str):
                failure = f"the run {run}"
                states[n] = SteadyState(start, Case.NN, {}, start.x0, task, failure=failure)
                continue
            state = judge_run(start, task, run, loose, runner.sampling.settling_leads)
            states[n] = state
            part = task.t_end / duration(start.p, span)
            if left[n] and state.excess > min(part, 1.0) * min(loose, criteria.sharp):
                near = part >= 1 or (runner.sampling.settling_leads and state.excess < NEARBY)
                x = State.of(state.mean if near else run.x[-1])
                if state.case.A is Contact.N:
                    x = x._replace(y=max(State.of(start.x0).y, 0.0))
                todo[n] = replace(start, x0=x.stacked())
    return [states[n] for n in range(len(starts))]


def settle_groups(
    runner: Runner,
    groups: Sequence[Sequence[Start]],
    criteria: SettlingCriteria = SettlingCriteria(),
) -> list[list[SteadyState]]:
    """Settle groups of starts, all of them together."""
    states = iter(settle(runner, [start for group in groups for start in group], criteria))
    return [[next(states) for _ in group] for group in groups]


def judge_run(
    start: Start, task: Task, run: Trajectory, loose: float = 1.0, leads: bool = False
) -> SteadyState:
    """The state to which a run has settled, or why it has not; `loose` as in `SettlingCriteria`.

    It goes on from its mean, or, if means are to be `leads`, from where they lead.

    A run is settled once its drift lets each check resolve twice as much as it should, with no
    quantity swinging by more than a thousandth of its scale, in a window with 98 % of its samples
    in one case. Of two windows the one that drifts less counts: half of the run for what
    oscillates, an eighth for what only decays."""
    p = start.p
    series = {name: getattr(run, name) for name in ("omega_c", "slip_x", "slip_y", "slip_z", "v_y")}
    series["wall_spin"] = run.slip_x + p.R / p.r * run.omega_c
    acting = forces(run.force_A.T, run.force_B.T)
    series |= {f"force_{name}": values for name, values in acting.items()}
    lengths = len(run.time) // 2, len(run.time) // 8
    states = (_judge_window(start, task, run, series, length, loose) for length in lengths)
    state = min(states, key=lambda state: state.excess)
    return replace(state, mean=steady_limit(run.x.T, len(run.time) // 2)) if leads else state


def _judge_window(
    start: Start, task: Task, run: Trajectory, series: dict[str, Array], length: int, loose: float
) -> SteadyState:
    """The state by so many samples at the end of a run, of which these are series by quantity."""
    p, counts = start.p, np.bincount(run.case[-length:])
    case = Case(int(counts.argmax()))
    means, drifts = steady_mean(np.stack([*series.values(), *run.x.T]), length)
    mean, drift = (dict(zip(series, row.tolist(), strict=False)) for row in (means, drifts))
    sizes, solved = {q: quantity(q).size(p) for q in series}, SOLVED / (p.c * coarse_step(p))
    worst = {
        q: max(drift[each] / sizes[each] for each in group)
        for group in _determined(case)
        for q in group
    }
    values = {q: estimate(mean[q], sizes[q], solver=solved, drift=worst[q]) for q in worst}
    swings = max(float(np.ptp(series[q][-length:])) / sizes[q] for q in worst)
    drifting = max(COVERAGE * 2 * worst[q] / quantity(q).resolution for q in worst)
    # the same however long a run is
    solving = max(COVERAGE * solved / quantity(q).resolution for q in worst)
    excess, failure = max(drifting, swings / 1e-3), ""
    if counts.max() < 0.98 * length and loose < math.inf:
        share, excess = f"{case.name} in {counts.max() / length:.0%} of the last samples", math.inf
        failure = f"its contacts keep changing ({share})"
    elif max(excess, solving) > loose:
        way = "drifts" if max(drifting, solving) > loose else "swings"
        failure = f"{case.name} still {way}, {max(excess, solving):.2g} times the limit"
    return SteadyState(start, case, values, means[len(series) :], task, excess, failure)


def _determined(case: Case) -> list[list[str]]:
    """Of `ERROR_GROUPS` the quantities that are determined in a case: where both contacts roll only
    sums of forces are; nothing but the wall turns a ball about the vertical."""
    free = {"slip_y"} if case.B is Contact.N else set[str]()
    free |= set(FORCES) - set(SUMS) if case is Case.RR else set(SUMS) - set(FORCES)
    return [[q for q in group if q not in free] for group in ERROR_GROUPS]


def settle_finer(
    runner: Runner, states: Sequence[SteadyState], criteria: SettlingCriteria = SettlingCriteria()
) -> list[SteadyState]:
    """The same states with the time step divided by `Sampling.settled_divisor`, if that isn't one,
    each from its mean and the height from which it started."""
    divisor = runner.sampling.settled_divisor
    if divisor == 1:
        return list(states)
    starts = []
    for state in states:
        x0 = State.of(state.mean)._replace(y=max(State.of(state.start.x0).y, 0.0))
        starts.append(replace(state.start, x0=x0.stacked()))
    rounds = STARTED_NEAR, *(criteria.rounds or runner.sampling.settling_rounds)
    finer = replace(criteria, divisor=divisor * criteria.divisor, rounds=rounds)
    return settle(runner, starts, finer)


def not_found_again(coarse: SteadyState, fine: SteadyState) -> str:
    """Why a state isn't that which half the step finds, SR and NR being one; empty if it is."""
    if fine.failure or physical_case(coarse.case) is physical_case(fine.case):
        return fine.failure
    return f"{coarse.case.name} is {fine.case.name} with half the step"


def with_changes(
    value: Estimate, change: float, p: Parameters, size: float, divisor: float
) -> Estimate:
    """A value of a settled state, of which half the step and other starts change so much; `size` is
    its natural size, and it has `divisor` time steps in a coarse one.

    An error of first order in the step is what half of it changes; errors of solving for forces,
    which add up with one sign for a time 1/c, are twice as much with half the step, and so minus
    twice the change. Between the two anything is as likely: in the mean its square is that of the
    change. What adds up at random the change may not show. Both take the place of what `judge_run`
    allows for them. (The second was added after a round played blind, where two claims were refuted
    without it.)"""
    if divisor == 1:
        return value.also(start=change)
    return estimate(
        value.value,
        drift=value.budget["drift"],
        solver_or_start=change,
        solver_at_random=SOLVED * math.sqrt(divisor / (p.c * coarse_step(p))) * size,
    )


def settled_readings(runner: Runner, starts: Sequence[Start]) -> Measured:
    """Case and omega_c to which the ball settles from each start, with half the step, too."""
    parts = runner.sampling.settled_divisor
    criteria = SettlingCriteria(sharp=runner.sampling.settled_sharp, divisor=parts)
    states = settle(runner, starts, criteria)
    yield from (runner.missing(each.start.set, each.failure) for each in states if each.failure)
    states = [each for each in states if not each.failure]
    for coarse, fine in zip(states, settle_finer(runner, states, criteria), strict=True):
        p, name = fine.start.p, fine.start.set
        yield runner.measurement(name, p, "case", coarse.case, [coarse.task])
        if why := not_found_again(coarse, fine):
            yield runner.missing(name, why)
            continue
        read, size = fine.values["omega_c"], quantity("omega_c").size(p)
        change = abs(coarse.values["omega_c"].value - read.value)
        read = with_changes(read, change, p, size, parts**2)
        yield runner.measurement(name, p, "omega_c", read, [fine.task])


def duration(p: Parameters, span: float = SPAN) -> float:
    """Length of a round, s: at least 8 turns of the fluid, in whose rhythm balls swing.

    A multiple of 512 coarse steps: for batches of alike runs, as is `rounded_duration`."""
    unit = 512 * coarse_step(p)
    turns = 8 * 2 * math.pi / abs(p.omega_0) if p.omega_0 else 0.0
    return unit * math.ceil(max(span / p.c, turns) / unit)


def safe_height(p: Parameters) -> float:
    """A height in m from which a ball that sinks freely doesn't land within a round."""
    return 1.25 * dragged_speed(p) * duration(p, LONGEST * SPAN)


def rounded_duration(p: Parameters, units: float) -> float:
    """A duration of about `units` of 1/c, s: a power of two."""
    return float(2.0 ** round(math.log2(units / p.c)))


def initial_condition(set: str, p: Parameters, how: str) -> Start:
    """A start at the flow of p: from rest, with the fluid, half as fast, or on the wall."""
    orbit = {"rest": 0.0, "half as fast": p.omega_0 / 2}.get(how, p.omega_0)
    height = safe_height(p) if how == "on the wall" else 0.0
    return Start(set, p, how, State(y=height, omega_c=orbit).stacked())


def starts_at(set: str, p: Parameters, how: str, flows: Iterable[float]) -> list[Start]:
    """An `initial_condition` at each of several flows, rad s-1."""
    return [initial_condition(set, p.replace(omega_0=flow), how) for flow in flows]


def forces(A: Array, B: Array) -> dict[str, Array]:
    """Components of contact forces (3, ...), and the sums that are always determined."""
    components = dict(zip(("Ax", "Ay", "Az", "Bx", "By", "Bz"), (*A, *B), strict=True))
    return components | {"Ax-By": A[0] - B[1], "Ay+By": A[1] + B[1], "Bx+By": B[0] + B[1]}


def physical_case(case: Case) -> Case:
    """SR with an unloaded floor and NR at y = 0 are one physical state: both count as NR."""
    return Case.NR if case is Case.SR else case


def is_well_known(omega_c: Measurement) -> bool:
    """Whether others can be measured from a settled state."""
    return omega_c.uncertainty <= STATE_KNOWN * rotation_scale(omega_c.parameters)


def settled_cases(records: Records, set: str, how: str) -> dict[float, Case]:
    """The cases to which a ball of a set settled from a start, by flow, rad s-1, slowest first."""
    found = records.select("settled", "case", lambda m: m.set == set and m.at["start"] == how)
    return dict(sorted((m.parameters.omega_0, physical_case(Case(int(m.value)))) for m in found))
