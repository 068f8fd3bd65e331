"""The flowmeter: slopes of its curve omega_c(omega_0), hysteresis, unloading, pushes."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.polynomial import Polynomial

from compare.campaign.tasks import Task
from compare.method import settling
from compare.method.conditions import Conditions, state_of
from compare.method.protocol import Protocol
from compare.method.record import Measured, Measurement, Records, Sets, if_found
from compare.method.runner import Runner, coarse_step
from compare.method.scales import time_unit
from compare.method.settling import SettlingCriteria, SteadyState
from compare.method.statistics import Estimate, estimate, settled_case, uniform
from compare.method.step_pairs import Start, StepPair, StepPairResult, carry_out
from compare.method.together import Procedure, asked, settled, together
from model import Case, Flow, Parameters, State, Trajectory
from model.trajectory import columns

ACROSS_ONSET = (-1e-3, -5e-4, 5e-4, 1e-3, 2e-3, 4e-3, 8e-3)
"""Flows at which states settle for a slope, as relative distances from where slipping sets in."""
NEIGHBOURS = (-1e-3, -5e-4, 5e-4, 1e-3)
"""The same from a settled state; the nearer ones show the effect of curvature."""
SHARP = {"neighbours": 0.3, "jump": 0.1, "mean": 1.0}
"""How slopes are found, and a factor on the drift limit of the states: for the jump they lie close
together."""


def slope(runner: Runner, sets: Sets, records: Records) -> Measured:
    """Slopes at settled states, the jump where slip sets in, the mean to unloading.

    Only the flow is changed."""
    most = runner.sampling.slope_slipping
    curves = [curve for name, p in sets.items() for curve in _curves(name, p, records, most)]
    in_order = (_join(runner, curve) for by in SHARP for curve in curves if curve.by == by)
    return together(runner, in_order)


@dataclass(frozen=True)
class Curve:
    """Flows of settled states that are joined to a slope."""

    by: str
    set: str
    p: Parameters  # with the flow at which the slope is wanted
    flows: tuple[float, ...]
    x0: State = State()
    # standard uncertainty of the flow at which slipping sets in, and of others measured so, rad s-1
    noise: float = 0.0


def _join(runner: Runner, c: Curve) -> Procedure[None]:
    """The slope of a curve."""
    starts = [Start(c.set, c.p.replace(omega_0=flow), c.by, c.x0.stacked()) for flow in c.flows]
    criteria = SettlingCriteria(span=24.0, sharp=SHARP[c.by])
    (states,) = yield from settled(starts, criteria=criteria)
    where = f"{c.by} at omega_0 = {c.p.omega_0:.4g} rad/s"
    if failure := next((each.failure for each in states if each.failure), ""):
        yield runner.missing(c.set, f"{where}: {failure}")
    elif value := _slope(c, states):
        tasks, at = [s.task for s in states], Conditions(case=states[-1].case.name, by=c.by)
        row = runner.measurement(c.set, c.p, "slope", value, tasks, **at)
        yield if_found(row, f"{where}: no slope")
    else:
        cases = ", ".join(each.case.name for each in states)
        yield runner.missing(c.set, f"{where}: the states there are not of one kind ({cases})")


def _curves(name: str, p: Parameters, records: Records, most: int) -> Iterator[Curve]:
    """Rows of flows at which states are to settle for slopes of the characteristic curve of a set.

    Between neighbours of settled states that slip on the floor, at most so many, and of the fastest
    of the others; across the onset of slipping; and from there to the flow at which the wall begins
    to carry the ball."""
    states: dict[Case, dict[float, dict[str, Measurement]]] = {case: {} for case in Case}
    for m in records.select("settled", where=lambda m: m.set == name and m.quantity != "case"):
        if m.parameters.omega_0:
            at = states[settling.physical_case(m.case)].setdefault(m.parameters.omega_0, {})
            at[m.quantity] = m
    for case in (Case.RR, Case.SS, Case.NR):
        alike = sorted(states[case].items())
        if case is Case.SS:  # half the step may show that they are known too vaguely
            alike = [each for each in alike if settling.is_well_known(each[1]["omega_c"])]
        few = np.linspace(0, len(alike) - 1, most).round() if case is Case.SS else [len(alike) - 1]
        for k in sorted({int(n) for n in few if alike}):
            omega_0, values = alike[k]
            q = values["omega_c"].parameters
            moving = ("v_y", "omega_c", "slip_x", "slip_y", "slip_z")
            x0 = State(**{each: values[each].value for each in moving})
            if case is Case.NR:
                x0 = x0._replace(y=settling.safe_height(q))
            flows = tuple(omega_0 * (1 + d) for d in NEIGHBOURS)
            yield Curve("neighbours", name, q, flows, x0)
    slips, holds = records.threshold(name, "omega_01"), records.threshold(name, "omega_02")
    if slips is not None:
        q, x0 = p.replace(omega_0=slips.value), State(omega_c=slips.value)
        around = tuple(slips.value * (1 + d) for d in ACROSS_ONSET)
        yield Curve("jump", name, q, around, x0, slips.uncertainty)
        if holds is not None and holds.value > slips.value:
            noise = math.hypot(slips.uncertainty, holds.uncertainty)
            yield Curve("mean", name, q, (*around[:2], holds.value), noise=noise)


def _slope(curve: Curve, states: Sequence[SteadyState]) -> Estimate | None:
    """The slope of a curve from its settled states; None if these are of other cases.

    Between neighbours: central differences over two distances, so that the error of second order
    cancels. The jump: slope above minus slope below, each at the threshold itself, above by a cubic
    through four secants. The mean: from where slipping sets in, on the line on which the ball comes
    there, to the last flow."""
    cases = [each.case for each in states]
    f, onset = np.array(curve.flows), curve.p.omega_0
    orbits = [each.values["omega_c"] for each in states]
    w, noises = np.transpose([(orbit.value, orbit.uncertainty) for orbit in orbits])
    noise, below = float(noises.max()), (w[1] - w[0]) / (f[1] - f[0])
    if curve.by == "neighbours" and len(set(map(settling.physical_case, cases))) == 1:
        wide, near = (w[3] - w[0]) / (f[3] - f[0]), (w[2] - w[1]) / (f[2] - f[1])
        bent = (near - wide) / 3
        of = estimate(near + bent, curvature=uniform(abs(bent)), states=2 * noise / (f[2] - f[1]))
        return of.told_apart("states", orbits, noises)
    if curve.by == "jump" and cases[1:3] == [Case.RR, Case.SS]:
        secants, middles = np.diff(w[2:]) / np.diff(f[2:]), (f[2:-1] + f[3:]) / 2 - onset
        cubic, parabola = np.polyfit(middles, secants, 3), np.polyfit(middles[:3], secants[:3], 2)
        # noise of the states, propagated to the secants and from them to the slope
        to_secants = np.diff(np.eye(len(f) - 2), axis=0) / np.diff(f[2:])[:, None]
        weights = np.linalg.inv(np.vander(middles))[-1] @ to_secants
        carried = *weights * noises[2:], *noises[:2] / (f[1] - f[0])
        bent = uniform(abs(float(cubic[-1] - parabola[-1])))
        placed = abs(parabola[-2] * curve.noise)
        of = estimate(cubic[-1] - below, degree=bent, states=math.hypot(*carried), threshold=placed)
        return of.told_apart("states", [*orbits[2:], *orbits[:2]], carried)
    if curve.by == "mean" and cases == [Case.RR, Case.RR, Case.SS]:
        first, rise = w[1] + (onset - f[1]) * (w[1] - w[0]) / (f[1] - f[0]), f[2] - onset
        of = estimate((w[2] - first) / rise, 3 / rise, states=noise, threshold=curve.noise)
        return of.told_apart("states", orbits, noises)
    return None


def hysteresis(runner: Runner, sets: Sets, records: Records) -> Measured:
    """Case and omega_c at every level of the loop of Fig. 13, and the case at the level before.

    The flow rises and falls in held steps, all in one run: a ramp would overshoot the fold of the
    slipping branch, where settling slows down without bound. The levels are where cases were seen
    to change, and between."""
    return together(runner, (_loop(runner, name, p, records) for name, p in sets.items()))


def _loop(runner: Runner, name: str, p: Parameters, records: Records) -> Procedure[None]:
    """A run through all levels of the loop of a set, up and down, each held for a time."""
    rise = _levels(name, records, runner.sampling.hysteresis_parts)
    if not rise:
        yield runner.missing(name, "no flow at which SS gives way to NR")
        return
    sides = [("up", flow) for flow in rise] + [("down", flow) for flow in rise[-2::-1]]
    loop = [Start(name, p.replace(omega_0=flow), side, np.zeros(8)) for side, flow in sides]
    first, flows = loop[0].p, [flow for _, flow in sides]
    step, hold = coarse_step(first), settling.duration(first, runner.sampling.hysteresis_hold)
    samples = round(hold / (settling.STEPS_A_SAMPLE * step)) * len(flows)
    flow, x0, lasts = Flow.staircase(flows, hold), State(omega_c=flows[0]), hold * len(flows)
    task = runner.task(first, x0, lasts, step, flow=flow, samples=samples)
    (runs,) = yield from asked([task])
    if isinstance(runs, str):
        yield runner.missing(name, f"the run {runs}")
        return
    # By how much half the step changes omega_c, relative to omega_0: the largest of all settled
    # states.
    states = records.select("settled", "omega_c", lambda m: m.set == name)
    moving = (m for m in states if m.parameters.omega_0 > 0)
    certainty = max(m.uncertainty / m.parameters.omega_0 for m in moving)
    yield from _loop_rows(runner, loop, task, runs[0], certainty)


def _loop_rows(
    runner: Runner, loop: Sequence[Start], task: Task, run: Trajectory, certainty: float
) -> Measured:
    """Measurements at each level of a loop; `certainty` is that of omega_c divided by omega_0."""
    count, before = (len(run.time) - 1) // len(loop), "RR"
    for k, level in enumerate(loop):
        p, held = level.p, slice(k * count, (k + 1) * count)
        of_level = {column: getattr(run, column)[held] for column in columns(Trajectory)}
        part, loose = replace(run, **of_level), runner.sampling.settled_loose
        ended = settling.judge_run(replace(level, x0=part.x[0]), task, part, loose)
        why = ended.failure
        if not why and ended.case is Case.SR:
            # Next to where the wall begins to carry the ball it slips there more slowly than shows,
            # on a floor that bears next to nothing. (Chosen after a level had been seen 3e-5 below
            # that.)
            why = "its slip on the wall is too slow for its case to be told"
        if why:
            where = f"level {k + 1} ({level.name}, omega_0 = {p.omega_0:.4g} rad/s)"
            yield runner.missing(level.set, f"{where}: {why}")
        else:
            at = Conditions(case=ended.case.name, side=level.name, level=k + 1.0, before=before)
            omega_c = ended.values["omega_c"].also(time_step=certainty * p.omega_0)
            yield runner.measurement(level.set, p, "case", ended.case, [task], **at)
            yield runner.measurement(level.set, p, "omega_c", omega_c, [task], **at)
        before = settling.physical_case(ended.case).name


def _levels(name: str, records: Records, parts: int) -> list[float]:
    """Rising flows in rad s-1: one at which the ball rolls, and those about the changes of case.

    Empty unless a ball from rest slips at one flow and rides the wall at the next."""
    floor, wall = (settling.settled_cases(records, name, how) for how in ("rest", "on the wall"))
    gives_way = [(a, b) for a, b in pairwise(floor) if (floor[a], floor[b]) == (Case.SS, Case.NR)]
    if not gives_way:
        return []
    takes_up = [(a, b) for a, b in pairwise(wall) if (wall[a], wall[b]) == (Case.NS, Case.NR)]
    levels = set([flow for flow in floor if floor[flow] is Case.RR][-1:])
    for a, b in (*takes_up[:1], gives_way[-1]):
        levels |= {a + (b - a) * k / parts for k in range(parts + 1)}
    return sorted(levels)


LANDING, UNLOADED = "unloading until it lands", "unloading"
UPWARDS, BY_SPIN = "push upwards", "push by spin"  # names of pairs
Shown = dict[tuple[str, str], Estimate]  # what a run shows, by quantity and event
UNLOADED_FROM = 1.02  # flow before the unloading, in units of the measured omega_02
UNLOADED_TO = 0.95  # the flow after it, in the same unit
WALL_PUSH = 1e-2  # speed of a push in units of sqrt(g R), or more spin in units of that on the wall


def unloading(runner: Runner, sets: Sets, records: Records) -> Measured:
    """How a ball on the wall slips, falls and lands as the flow falls, or is pushed (section 5.3).

    Unloading: it rides the wall a little above the floor while the flow suddenly falls below what
    holds it there. Pushed, beside the floor, upwards or by a little more spin: does it stay off the
    floor, and how high? An engine may follow motions with landings to first order only."""
    starts, pairs = [], []
    for name, p in sets.items():
        if (limit := records.threshold(name, "omega_02")) is None:
            yield runner.missing(name, "no flow that is the least to hold a ball on the wall")
            continue
        # A pushed ball must neither sink nor roll again: the flow is above the end of rolling by
        # lifting, too.
        lifts = records.threshold(name, "omega_03") or limit
        flows = UNLOADED_FROM * limit.value, 1.1 * max(limit.value, lifts.value)
        starts.append(settling.starts_at(name, p, "on the wall", flows))
    criteria = SettlingCriteria(loose=runner.sampling.thresholds_loose)
    for states in settling.settle_groups(runner, starts, criteria):
        for state, names in zip(states, ((LANDING, UNLOADED), (UPWARDS, BY_SPIN)), strict=True):
            if state.failure:
                yield runner.missing(state.start.set, f"no ball on the wall: {state.failure}")
            else:
                pairs += [_pair(runner, state, name) for name in names]
    kinds: dict[tuple[str, str, str], list[tuple[StepPairResult, Estimate, float]]] = {}
    for result in (yield from carry_out(runner, pairs)):
        name, (before, coarse), (case, fine) = result.pair.name, result.coarse, result.fine
        if name != LANDING and before is case:
            yield result.row("case", case)
        elif name != LANDING:
            yield result.missing(f"{name}: with half the time step the ball ends up otherwise")
        if coarse.keys() != fine.keys() or (name == LANDING and not fine):
            yield result.missing(f"{name}: the ball does not slip and land")
            continue
        for shown, value in fine.items():
            change = abs(coarse[shown].value / value.value - 1)
            kinds.setdefault((name, *shown), []).append((result, value, change))
    for (name, quantity, event), alike in kinds.items():
        # The difference may be small by chance: at least the median of all pairs counts.
        usual = float(np.median([change for *_, change in alike]))
        for result, fine, change in alike:
            value = fine.also(time_step=uniform(max(change, usual) * abs(fine.value)))
            row = result.row(quantity, value, event=event)
            yield if_found(row, f"{name}: no {quantity}")


def _pair(runner: Runner, state: SteadyState, name: str) -> StepPair:
    """A pair from a ball that rides the wall; one that lands is sampled at every step."""
    p, x = state.start.p, State.of(state.mean)
    x0 = State(omega_c=x.omega_c, slip_x=x.slip_x)
    if name in (LANDING, UNLOADED):
        p, x0 = p.replace(omega_0=p.omega_0 * UNLOADED_TO / UNLOADED_FROM), x0._replace(y=0.2 * p.R)
    elif name == UPWARDS:
        x0 = x0._replace(v_y=WALL_PUSH * math.sqrt(p.g * p.R))
    else:
        x0 = x0._replace(slip_x=x.slip_x + WALL_PUSH * (x.slip_x + p.R / p.r * x.omega_c))
    coarse, fine = (
        times if name == LANDING else times // 4 for times in runner.sampling.unloading_divisors
    )
    # A ball slips some 0.5/c later, and then falls: it lands at 0.3 to 0.7 of this time on sets of
    # many kinds.
    lands = 1.2 + 7 * p.c * time_unit(p)
    t_end = settling.rounded_duration(p, lands if name == LANDING else 6.0)
    step = coarse_step(p) / fine

    def read(run: Trajectory) -> tuple[Case, Shown]:
        numbers = Shown()
        if name == LANDING:
            numbers = _landed(run)
        elif name == UPWARDS:  # it falls on the floor soon after
            numbers = {("lift", "first top"): first_top(run)}
        elif name == BY_SPIN:
            # it leaves the floor at a whole step, up to one late or early, which changes its height
            late = step / 2 * float(run.v_y.max())
            numbers = {("lift", "end"): estimate(run.y[-1], sampling=uniform(late))}
        return settling.physical_case(settled_case(run)), numbers

    at = Conditions(start=name, duration=t_end) | state_of(x0.stacked())
    samples = None if name == LANDING else 1000
    pair = StepPair(state.start.set, p, name, x0.stacked(), t_end, (coarse, fine), samples, read)
    return replace(pair, at=at)


def _landed(run: Trajectory) -> Shown:
    """Onset of slip, and landing: time, speed, vertical impulse. Empty without one."""
    p, step = run.header.parameters, float(run.time[1] - run.time[0])
    slip = run.slip_speed_B / math.sqrt(p.g * p.R)
    touches = np.flatnonzero(run.force_A[:, 1] > 0)
    # Slip grows as the square of time: its onset is extrapolated from speeds above the noise, but
    # small.
    growing = np.arange(*np.searchsorted(np.maximum.accumulate(slip), (1e-4, 1e-3)))
    if not len(touches) or not 1 < touches[0] < len(run.time) - 12 or len(growing) < 10:
        return {}
    root, times = np.sqrt(slip[growing]), run.time[growing]
    quadratic, cubic = (float(Polynomial.fit(root, times, degree)(0.0)) for degree in (2, 3))
    k = int(touches[0]) - 1
    wait = float(run.y[k] / -run.v_y[k])
    v_y = float(run.v_y[k] + (run.v_y[k] - run.v_y[k - 1]) / step * wait)
    rest = run.v_y[k + 5 : k + 12]  # by then it must have come to rest on the floor
    impulse = estimate(p.m * (float(rest.mean()) - v_y), p.m, rest=float(np.abs(rest).max()))
    sampling = step / math.sqrt(12)
    slips = estimate(cubic, degree=uniform(abs(cubic - quadratic)), sampling=sampling)
    return {
        ("time", "slip at B"): slips,
        ("time", "landing"): estimate(run.time[k] + wait, sampling=sampling),
        ("landing_speed", "landing"): Estimate(v_y, 0.0),
        ("landing_impulse", "landing"): impulse,
    }


def first_top(run: Trajectory) -> Estimate:
    """Height in m at which v_y first falls to zero.

    It lies between those that constant acceleration gives from the samples on either side: its
    uncertainty is half of that range."""
    k = int(np.argmax(run.v_y < 0))
    ends = [k - 1, k]
    (before, after), step = run.v_y[ends], run.time[k] - run.time[k - 1]
    heights = run.y[ends] + run.v_y[ends] ** 2 * step / (before - after) / 2
    return estimate(heights.mean(), sampling=uniform(float(np.ptp(heights)) / 2))


PROTOCOLS = (
    Protocol("hysteresis", hysteresis, ("settled",)),
    Protocol("unloading", unloading, ("thresholds",), drawn=lambda m: m.at["start"] == UNLOADED),
    Protocol("slope", slope, ("settled", "thresholds")),
)
