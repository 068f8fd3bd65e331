"""How slip begins: how it grows, from which flow on, and when a ball leaves the floor."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Unpack

import numpy as np

from compare.campaign.tasks import Task
from compare.method.brackets import Attempt, Bracket, Search
from compare.method.conditions import Conditions, state_of
from compare.method.protocol import Protocol
from compare.method.record import Found, Measured, Measurement, Missing, Records, Sets, if_found
from compare.method.runner import Runner, coarse_step
from compare.method.scales import dragged_speed, slip_unit, time_unit
from compare.method.settling import starts_at
from compare.method.statistics import (
    Estimate,
    estimate,
    extrapolated_zero,
    slope_error,
    straight_line,
    uniform,
    zero_and_slope,
)
from compare.method.step_pairs import (
    DOUBT,
    EXTRAPOLATION,
    HALF_WINDOW,
    STEP_RATIO,
    WINDOW_DEGREES,
    Start,
    at_zero_step,
    lag_error,
    polynomials,
    random_state,
)
from compare.method.together import Procedure, asked, narrowed, settled, together
from model import Case, Parameters, State, Trajectory
from model.arrays import Array
from model.drag import STOKES
from model.kinematics import SLIP_XYZ, state_units

PUSHES = {
    (Case.RR, Case.RS): 1,
    (Case.RR, Case.SR): 1,
    (Case.RR, Case.SS): 2,
    (Case.RS, Case.SS): 2,
    (Case.SR, Case.SS): 3,
    (Case.NR, Case.NS): 3,
}
"""Arrows of Fig. 6 along which slip begins, and directions at the quick level."""
SLIPS = {Case.RS: (1,), Case.SR: (0,), Case.SS: (0, 1, 2), Case.NS: (1, 2)}
"""Which of slip_x, slip_y, slip_z a case allows beyond the one it leaves."""
# steps of a record of slip; at its start, where contact forces build up; and at its end, in which
# the case must be the same for a slip to have passed into it
RECORD_STEPS, RECORD_SKIPPED, RECORD_SETTLED = 20, 6, 6
RECORD_DEGREES = (4, 3)  # of the polynomials; the lower one shows what the degree changes
# Slips at the start, in units of `start_unit`, each half of the one before:
LARGE_SLIPS = (3.0, 1.5)  # so large that they neither end nor turn much in a record
SMALL_SLIPS = (0.3, 0.15)  # where one contact has to hold
SLIPS_BESIDE = (1.2, 0.6, 0.3)  # beside a slip that is there: the direction depends on the size
FAST_SLIPS = (1.0, 0.5)  # of a ball that hangs on a smooth wall, and so goes fast
AT_START = slope_error(
    np.arange(RECORD_SKIPPED, RECORD_STEPS + 1.0), RECORD_DEGREES[0]
) / slope_error(np.arange(-HALF_WINDOW, HALF_WINDOW + 1.0), WINDOW_DEGREES[0])
"""Uncertainty of a rate at the start of a record, relative to that amid a window."""
FRICTIONLESS = "without friction at both contacts there is nothing that rolls"


def measure(runner: Runner, sets: Sets, records: Records) -> Measured:
    """gamma out of random states, along every arrow; of two sides their shares (69).

    A rolling ball is given a slip along one direction; in the first milliseconds it grows or dies
    out. gamma, the initial rate of change of the slip along its direction, is extrapolated from
    several sizes of the slip to none. A record counts only if all of it is, by the engine's own
    contacts, in the case in which the ball was to slip; else the case into which it passes is
    measured."""
    rough = yield from _rough(runner, sets)
    pushed = (_grow(pushes) for name, p in rough.items() for pushes in _pushes(runner, name, p))
    yield from together(runner, pushed)


def _rough(runner: Runner, sets: Sets) -> Found[Sets]:
    """The sets with friction at both contacts."""
    rough = {name: p for name, p in sets.items() if p.mu and p.eta}
    yield from (runner.missing(name, FRICTIONLESS) for name in sets if name not in rough)
    return rough


def _grow(pushes: Sequence[Push]) -> Procedure[None]:
    """gamma of a push, or of two to either side."""
    tasks = [push.tasks() for push in pushes]
    found, grown = (yield from asked(*tasks)), []
    for push, own, runs in zip(pushes, tasks, found, strict=True):
        if isinstance(runs, str):
            yield push.missing(f"the run {runs}")
        elif value := push.growth(runs):
            grown.append(value)
            yield push.row("gamma", value, own)
        else:
            yield push.stray(own, runs) or push.missing(STRAYS)
    if len(grown) == 2:
        # the share of the side of negative slip with which the two growth rates cancel
        plus, minus = grown if pushes[0].n.sum() > pushes[1].n.sum() else grown[::-1]
        both = plus.value + minus.value
        share = estimate(
            plus.value / both,
            1 / both**2,
            ahead=plus.uncertainty * abs(minus.value),
            back=minus.uncertainty * abs(plus.value),
        )
        for side, of in ("ahead", plus), ("back", minus):
            share = share.told_apart(side, [of], [1.0])
        yield push.row("filippov_share", share, own)


@dataclass(frozen=True, eq=False)
class Push:
    """A start that rolls, and the slip that it is given.

    The start's name: ``sideways`` for a direction that is almost that of the wall's contact alone,
    ``dragged`` where the fluid pulls hard, ``rest`` in a fluid at rest, empty for a direction at
    random, ``held`` and ``stationary`` for `bounds`."""

    runner: Runner
    start: Start
    inner: Case
    outer: Case
    n: Array  # direction, a unit vector (3,) of slip_x, slip_y, slip_z

    @property
    def sizes(self) -> tuple[float, ...]:
        """Sizes of slip, in units of `start_unit`."""
        if self.inner in (Case.RS, Case.SR):
            return SLIPS_BESIDE
        if self.inner is Case.NR and self.start.name == "stationary":
            return FAST_SLIPS
        return SMALL_SLIPS if self.outer in (Case.RS, Case.SR) else LARGE_SLIPS

    def pair(self, size: float, divisor: int = 1) -> list[Task]:
        """Tasks with one size of slip and both time steps, steps and times divided by
        `divisor`."""
        p, x = self.start.p, self.start.x0.copy()
        x[SLIP_XYZ] += size * start_unit(p, x) * self.n
        step = coarse_step(p) / (STEP_RATIO * divisor)
        return [
            self.runner.task(p, x, RECORD_STEPS * step, step / n, samples=RECORD_STEPS * n)
            for n in self.runner.sampling.halves
        ]

    def tasks(self) -> list[Task]:
        """Tasks with every size of slip and both time steps; of the engine on trial these are half
        as long, since the first ones of a run are seen in it for a while."""
        divisor = 1 if self.runner.has_own_steps else 2
        return [task for size in self.sizes for task in self.pair(size, divisor)]

    def rates(self, run: Trajectory) -> Array:
        """Initial rates of the slip along n by either degree (2,); nan in another case."""
        record = slice(RECORD_SKIPPED * (len(run.time) // RECORD_STEPS), None)
        # The wall carries nothing beside a ball at rest: that contact is not detected.
        alike = [self.outer, Case.RN] if self.start.name == "rest" else [self.outer]
        if not np.isin(run.case[record], alike).all():
            return np.full(2, np.nan)
        return polynomials(run.time[record], run.x[record, SLIP_XYZ] @ self.n, RECORD_DEGREES)[1]

    def growth(self, runs: Sequence[Trajectory]) -> Estimate | None:
        """gamma for a vanishing size and step from `tasks`, None if a record left the case.

        Its uncertainty is what the step and a degree of the polynomials change, and for three sizes
        a third of what the third one changes, since the next would change less. (That was a bound,
        until with a sharper lag one of 116 numbers had been seen 3.1 uncertainties off.)"""
        coarse, fine = (np.array([self.rates(run) for run in runs[k::2]]) for k in (0, 1))
        if np.isnan(coarse).any() or np.isnan(fine).any():
            return None
        best = fine + (fine - coarse) * EXTRAPOLATION
        value, lower = zero_size_limit(best)
        step = zero_size_limit(fine - coarse)[0] * DOUBT
        size = (value - zero_size_limit(best[-2:])[0]) / 3
        p = self.start.p
        # Slip at the wall alone of a ball that rolls on the floor neither turns nor changes its
        # load.
        later = 1.0 if self.outer is Case.RS else AT_START
        least = lag_error(self.runner, p) * later * slip_unit(p)
        return estimate(
            value,
            time_step=abs(float(step)),
            degree=uniform(abs(float(value - lower))),
            push=abs(float(size)),
            lag=least,
        )

    def stray(self, tasks: Sequence[Task], runs: Sequence[Trajectory]) -> Measurement | None:
        """The case that follows the first slip, of pairs with each of the `sizes`, that doesn't
        last; None if all do, or steps differ."""
        pairs = zip(tasks[::2], tasks[1::2], runs[::2], runs[1::2], strict=True)
        for size, (*own, coarse, fine) in zip(self.sizes, pairs, strict=False):
            ended = int(fine.case[-1])
            same = all(np.all(run.case[-RECORD_SETTLED:] == ended) for run in (coarse, fine))
            if same and ended != self.outer:
                slip, time = size * start_unit(self.start.p, self.start.x0), float(fine.time[-1])
                return self.row("case", ended, own, slip=slip, time=time)
        return None

    def missing(self, why: str, rows: int = 1) -> Missing:
        """A record of what was not measured, and why."""
        arrow = f"from {self.inner.name} to {self.outer.name}"
        return self.runner.missing(self.start.set, f"{arrow}: {why}", rows)

    def row(
        self,
        quantity: str,
        value: Estimate | float,
        tasks: Sequence[Task],
        **at: Unpack[Conditions],
    ) -> Measurement:
        """A measurement of the push, with its state and direction as conditions."""
        start, (n_x, n_y, n_z) = self.start, self.n.tolist()
        cases = Conditions(inner=self.inner.name, outer=self.outer.name, by=start.name)
        at = cases | state_of(start.x0) | Conditions(n_x=n_x, n_y=n_y, n_z=n_z) | at
        return self.runner.measurement(start.set, start.p, quantity, value, tasks, **at)


STRAYS = "slips pass through several cases"


def zero_size_limit(rates: Array) -> Array:
    """Rates extrapolated to no slip, from rows (2 or 3, n) for sizes that halve."""
    *first, before, last = rates
    return np.asarray((first[0] - 6 * before + 8 * last) / 3 if first else 2 * last - before)


def _pushes(runner: Runner, name: str, p: Parameters) -> Iterator[list[Push]]:
    """Pushes out of states of a set; two where one contact alone slips, to either side."""
    rng = np.random.default_rng([61, *name.encode()])
    slow = 0.4 / time_unit(p) * min(1.0, math.sqrt(p.mu / max(p.eta, p.j)))
    going = Start(name, p.replace(omega_0=slow), "sideways", State(omega_c=slow).stacked())
    sideways = np.array([0.3, 1.0, 0.3])
    yield [Push(runner, going, Case.RR, Case.SS, sideways / np.linalg.norm(sideways))]
    still = Start(name, p.replace(omega_0=0.0), "rest", np.zeros(8))
    for side in (1, -1):
        yield [Push(runner, still, Case.RR, Case.RS, np.array([0.0, side, 0.0]))]
        # It sinks half as fast as the fluid pulls it along the wall.
        sinking = State.of(random_state(Case.NR, p, rng))._replace(v_y=-0.5 * dragged_speed(p))
        dragged = p.replace(omega_0=sinking.omega_c + dragged_speed(p) / p.R)
        start = Start(name, dragged, "dragged", sinking.stacked())
        yield [Push(runner, start, Case.NR, Case.NS, np.array([0.0, 0.8 * side, 0.6]))]
    for (inner, outer), count in PUSHES.items():
        for _ in range(count * runner.sampling.growth_more):
            x = State.of(random_state(inner, p, rng))
            # The orbit is one at which both contacts press, whichever way friction acts.
            if outer is Case.SR:  # the spin axis turns with the orbit, and the wall alone turns it
                x = x._replace(omega_c=math.sqrt(rng.uniform(0.4, 0.8) * p.g / (p.j * p.R)))
            if outer is Case.SS:
                least, most = p.mu, min(1 / p.eta, 3.0)
                x = x._replace(
                    omega_c=math.sqrt((least + rng.uniform(0.3, 0.7) * (most - least)) * p.g / p.R)
                )
            # A slip that is there already is so fast that the new one hardly turns it.
            if inner is Case.RS:
                fast = rng.choice([-1, 1]) * rng.uniform(3.0, 5.0)
                x = x._replace(slip_y=fast * start_unit(p, x.stacked()))
            # the faster the ball spins about its radial axis, the faster slip_z sets in
            if inner is Case.SR:
                x = x._replace(slip_x=-rng.uniform(2.0, 3.0) * p.R / p.r * x.omega_c)
            free = [k for k in SLIPS[outer] if k != {Case.RS: 1, Case.SR: 0}.get(inner)]
            n = np.zeros(3)
            n[free] = rng.choice([-1, 1], len(free)) * rng.uniform(0.4, 1.0, len(free))
            n /= np.linalg.norm(n)
            q = p.replace(omega_0=float(x.omega_c * rng.uniform(0.6, 1.4)))
            start, sides = Start(name, q, "", x.stacked()), (1, -1) if len(free) == 1 else (1,)
            yield [Push(runner, start, inner, outer, side * n) for side in sides]


def start_unit(p: Parameters, x: Array) -> float:
    """The slip that weight and centrifugal force make in the unit of time, rad s-1."""
    return (p.g + p.R * float(State.of(x).omega_c) ** 2) / 2 / p.r * time_unit(p)


def steepest(runner: Runner, sets: Sets, records: Records) -> Measured:
    """The direction in which slip out of NR grows the most.

    It does where the first harmonic of gamma over all directions is greatest. The uncertainty is
    how far the other harmonics may turn that direction."""
    rough = {name: p for name, p in sets.items() if p.eta and p.c}
    why = "without friction at the wall, or drag, no direction stands out"
    yield from (runner.missing(name, why) for name in sets if name not in rough)
    fans = (_turn(fan) for name, p in rough.items() for fan in _fans(runner, name, p))
    yield from together(runner, fans)


def _fans(runner: Runner, name: str, p: Parameters) -> Iterator[list[Push]]:
    """Pushes out of random states of a set, at angles all round from slip_z to slip_y of the wall's
    contact."""
    rng = np.random.default_rng([58, *name.encode()])
    for _ in range(runner.sampling.steepest_states):
        x = random_state(Case.NR, p, rng)
        # The fluid pulls along the orbit, by half the weight to three times it: that turns the
        # direction.
        pull = rng.choice([-1, 1]) * rng.uniform(0.5, 3.0)
        q = p.replace(omega_0=State.of(x).omega_c + pull * dragged_speed(p) / p.R)
        betas = np.linspace(0.0, 2 * np.pi, 8, endpoint=False)
        ways = (np.array([0.0, np.sin(beta), np.cos(beta)]) for beta in betas)
        yield [Push(runner, Start(name, q, "", x), Case.NR, Case.NS, n) for n in ways]


def _turn(fan: Sequence[Push]) -> Procedure[None]:
    """The direction in which slip of a fan grows the most."""
    tasks, first = [push.tasks() for push in fan], fan[0]
    found, grown, why = (yield from asked(*tasks)), [], "no direction lasts, or stands out"
    for push, runs in zip(fan, found, strict=True):
        if isinstance(runs, str):
            why = f"the run {runs}"
        elif value := push.growth(runs):
            grown.append(value)
    angle = math.nan
    if len(grown) == len(fan):
        harmonics = np.fft.rfft([g.value for g in grown]) * 2 / len(fan)
        angle = float(-np.angle(harmonics[1]))
    if not abs(angle) < 3:  # one near pi may come out on either side of it
        yield first.missing(why)
        return
    worst = max(grown, key=lambda g: g.uncertainty)
    scatter = np.sqrt(2.0 / len(fan)) * worst.uncertainty
    others = np.arange(2, len(harmonics)) @ np.abs(harmonics[2:])
    size = 1 / float(np.abs(harmonics[1]))
    beta = estimate(angle, size, rates=float(scatter), harmonics=float(others))
    beta = beta.told_apart("rates", [worst], [1.0])
    at, own = state_of(first.start.x0), [task for each in tasks for task in each]
    yield first.runner.measurement(first.start.set, first.start.p, "steepest", beta, own, **at)


AROUND, AROUND_BENT = ((0.7, 1.3),), ((0.8, 1.1), (0.9, 1.05), (0.95, 1.15))
"""Pairs of flows, one after the other, divided by the zero that the pair before shows; the latter
where the law of drag bends the line."""
MOST_BEYOND = 2.1
"""Largest zero recorded, divided by the largest value at which slip stayed in its case."""
MOST_FOLLOWED = 100.0  # largest zero followed, divided by the largest of the first flows
HANGING = (1.05, 1.6, 1.3)
"""Flows at which balls hang on a smooth wall, in units of the least that holds them."""


def bounds(runner: Runner, sets: Sets, records: Records) -> Measured:
    """Zero and slope of gamma along every line: from two flows, then two more at the zero.

    A ball goes round at a held omega_c in faster and faster flows; or with the flow, rolling at
    both points or hanging on the wall alone."""
    rough = yield from _rough(runner, sets)
    rolling = [_cross(each) for name in rough for each in _lines(runner, name, rough[name])]
    hanging = [_cross_hanging(runner, name, p, records) for name, p in rough.items()]
    yield from together(runner, rolling + hanging)


def _cross_hanging(runner: Runner, name: str, p: Parameters, records: Records) -> Procedure[None]:
    """Zero and slope of gamma out of settled states of a ball that the wall alone carries."""
    if end := records.threshold(name, "omega_02"):
        flows = [end.value * factor for factor in HANGING]
        (states,) = yield from settled(starts_at(name, p, "on the wall", flows))
        if all(state.settled_in(Case.NR) for state in states):
            pushes = []
            for state in states:
                x = np.array([p.R, 0, *state.mean[2:4], 0, 0, 0, 0])
                rides = replace(state.start, name="stationary", x0=x)
                pushes.append(Push(runner, rides, Case.NR, Case.NS, np.array([0, 0, 1])))
            yield from _cross(pushes[:2], pushes[2:])
            return
    yield runner.missing(name, "no flow was found at which the wall alone carries the ball")


def _cross(pushes: Sequence[Push], more: Sequence[Push] = ()) -> Procedure[None]:
    """Zero and slope of gamma along a line of states, from pushes at two flows, and from `more`, or
    where the first two show the zero.

    gamma is a line in omega_0, or in its square where the orbit goes with it. Another law of drag
    than Stokes' bends it: then those first flows are far from the zero, and four near it count."""
    push = pushes[0]
    power = 1 if push.start.name == "held" else 2
    curved = power == 1 and push.start.p.drag != STOKES
    seen = yield from _growths(pushes)
    if not seen.complete:
        yield from seen.strays or [push.missing(STRAYS, 2)]
        return
    tasks, (near, *nearer) = seen.tasks, AROUND_BENT if curved else AROUND
    later = yield from _growths(more or _around(seen, push, power, near))
    for near in nearer:
        if later.complete:
            tasks, seen = tasks + later.tasks, later
            later = yield from _growths(_around(seen, push, power, near))
    known = zip(seen.flows + later.flows, seen.gammas + later.gammas, strict=True)
    flows, gammas = zip(*((flow, g) for flow, g in known if not math.isnan(g.value)), strict=True)
    q, tasks = np.array(flows) ** power, tasks + later.tasks
    # What the step changes may be little by chance at one of the flows. Points of a line share
    # causes of error: more of them don't reduce the uncertainty.
    least = max(gamma.uncertainty for gamma in seen.gammas)
    more_sure = 1.0 if curved else math.sqrt(len(q))
    points = [replace(g, uncertainty=max(g.uncertainty, least) * more_sure) for g in gammas]
    zero, slope = zero_and_slope(q, points) if curved else straight_line(q, points)
    square = "_square" if power == 2 else ""
    if abs(zero.value) <= MOST_BEYOND * np.abs(q).max():
        why = f"growth has no zero, {push.start.name}"
        yield if_found(push.row(f"gamma_zero{square}", zero, tasks), why)
    else:
        yield push.missing("growth is zero only far beyond the flows at which this case lasts")
    row = push.row(f"gamma_slope{square}", slope, tasks)
    yield if_found(row, f"growth has no slope, {push.start.name}")


def _around(seen: Growths, first: Push, power: int, near: Sequence[float]) -> list[Push]:
    """Pushes at flows near the zero of the line through gamma at two flows, if any."""
    q, (low, high) = np.array(seen.flows) ** power, (gamma.value for gamma in seen.gammas)
    slope = (high - low) / np.diff(q)[0]
    zero = float(q[0] - low / slope) if slope else math.inf
    if not 0 < zero < (MOST_FOLLOWED * max(seen.flows)) ** power:
        return []
    held, pushes = State.of(first.start.x0).omega_c, []
    least = held if power == 1 else 0.0
    for factor in near:
        omega_0 = float(least + (zero ** (1 / power) - least) * factor)
        orbit = held if power == 1 else omega_0
        p, x0 = first.start.p.replace(omega_0=omega_0), State(omega_c=orbit).stacked()
        pushes.append(replace(first, start=replace(first.start, p=p, x0=x0)))
    return pushes


@dataclass(frozen=True, eq=False)
class Growths:
    """gamma at some flows of a line, for a vanishing step and size of slip."""

    flows: list[float] = field(default_factory=list)  # rad s-1
    gammas: list[Estimate] = field(default_factory=list)  # rad s-2; nan where a slip didn't last
    tasks: list[Task] = field(default_factory=list)
    # what became of slips that didn't last, and of runs that broke down
    strays: list[Measurement | Missing] = field(default_factory=list)

    @property
    def complete(self) -> bool:
        """Whether there are any, and each slip lasted."""
        return bool(self.gammas) and not any(math.isnan(gamma.value) for gamma in self.gammas)


def _growths(pushes: Sequence[Push]) -> Procedure[Growths]:
    """gamma of pushes, from two sizes of slip with the short step, one with the long one.

    It is uncertain by what the step and the degree of the polynomials change."""
    tasks, found = [], Growths()
    for push in pushes:
        divisor = push.runner.sampling.bounds_divisor
        large, small = (push.pair(size, divisor) for size in push.sizes)
        tasks.append([*large, small[1]])
    for push, own, runs in zip(pushes, tasks, (yield from asked(*tasks)), strict=True):
        found.flows.append(push.start.p.omega_0)
        found.tasks.extend(own)
        if isinstance(runs, str):
            found.strays.append(push.missing(f"the run {runs}", 2))
            found.gammas.append(estimate(math.nan))
            continue
        if stray := push.stray(own[:2], runs[:2]):
            found.strays.append(stray)
        coarse, fine, half = (push.rates(run) for run in runs)
        best, change = zero_size_limit(np.array([fine, half])), (fine - coarse)[0]
        gamma = estimate(
            best[0] + change * EXTRAPOLATION,
            time_step=abs(change) * DOUBT,
            degree=uniform(abs(best[1] - best[0])),
            lag=lag_error(push.runner, push.start.p, divisor) * slip_unit(push.start.p),
        )
        found.gammas.append(gamma)
    return found


def _lines(runner: Runner, name: str, p: Parameters) -> Iterator[list[Push]]:
    """Pushes out of RR at two flows of a line, scaled by friction and inertia, by bound."""
    unit = time_unit(p)
    slow = 0.5 / unit * min(1.0, math.sqrt(p.mu / max(p.eta, p.j)))
    rubbing, spinning = math.sqrt(p.mu) / unit, math.sqrt(1 / p.j) / unit
    fast, hanging = 0.7 * spinning, min(1.0, 1 / math.sqrt(p.eta)) / unit
    for outer, n, by, flows in (
        (Case.RS, (0, 1, 0), "held", (slow, 3 * slow)),
        (Case.RS, (0, 1, 0), "stationary", (0.5 * rubbing, 0.9 * rubbing)),
        (Case.RS, (0, -1, 0), "stationary", (0.5 * rubbing, 0.9 * rubbing)),
        (Case.SR, (-1, 0, 0), "held", (fast, 1.5 * fast)),
        (Case.SR, (1, 0, 0), "stationary", (0.5 * spinning, 0.8 * spinning)),
        (Case.SR, (-1, 0, 0), "stationary", (0.5 * spinning, 0.8 * spinning)),
        (Case.SS, (0, 0, 1), "stationary", (0.4 * hanging, 0.8 * hanging)),
        (Case.SS, (0, 0, -1), "stationary", (1.5 * rubbing, 2.2 * rubbing)),
    ):
        orbits = (flows[0], flows[0] if by == "held" else flows[1])
        starts = (
            Start(name, p.replace(omega_0=flow), by, State(omega_c=orbit).stacked())
            for flow, orbit in zip(flows, orbits, strict=True)
        )
        yield [Push(runner, start, Case.RR, outer, np.array(n)) for start in starts]


ARROWS: dict[tuple[Case, Case], tuple[float, float, float]] = {
    (Case.RR, Case.NR): (0.0, 0.0, 0.0),
    (Case.RS, Case.NS): (0.0, 0.8, 0.0),
    (Case.SR, Case.NR): (-0.6, 0.0, 0.0),
    (Case.SS, Case.NS): (0.3, 0.1, 0.8),
}
"""Slips at first in units of sqrt(g R)/r; of a rolling wall contact in R/r omega_c."""
LEAD = 1.5  # how much faster than the ball the fluid goes round where a contact slips
FIRST_ORBITS = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5)
"""Orbits at which the force on the floor is measured first, omega_c sqrt(R/g)."""
LATER_ORBITS = (0.05, 0.08, 0.12, 0.17)
"""Relative distances of others below that at which the ball leaves the floor."""
# steps of a run in which the force on the floor is measured; at its start, where contact forces
# build up; and the fewest samples on the floor that must be left
LIFT_STEPS, LIFT_SKIPPED, FEWEST_PRESSED = 16, 4, 5
LIFT_DEGREES = (3, 2)  # of the polynomials; the lower one shows what the degree changes


def lift(runner: Runner, sets: Sets, records: Records) -> Measured:
    """omega_c at which the ball leaves the floor, along every arrow; or that it doesn't.

    States of a case differ only in omega_c, from slow, where the floor presses, to fast. A few show
    roughly where it stops pressing; at slower ones its force is measured and extrapolated to zero
    as a function of omega_c^2. Out of rolling at both points, where floor and wall share the load
    in any way, that place is bracketed instead."""
    arrows = (Arrow(runner, name, p, *arrow) for name, p in sets.items() for arrow in ARROWS)
    yield from together(runner, map(_lift, arrows))


def _lift(arrow: Arrow) -> Procedure[None]:
    """omega_c at which the ball leaves the floor along an arrow."""
    tasks = [arrow.task(Omega / time_unit(arrow.p)) for Omega in FIRST_ORBITS]
    (got,) = yield from asked(tasks)
    runs = [] if isinstance(got, str) else arrow.staying(got)
    if not runs:
        strays = "the ball doesn't stay in it at any orbit"
        yield arrow.missing(f"the run {got}" if isinstance(got, str) else strays)
        return
    orbits, forces = [float(run.omega_c[0]) for run in runs], [_force(run) for run in runs]
    if None not in forces:
        yield arrow.row("lifts", orbits[-1], 0.0, tasks)
        if arrow.inner is not Case.RR:  # whose floor and wall share the load in any way
            yield from _load(arrow, orbits[-1])
        return
    off = forces.index(None)
    if (leaves := Case(int(runs[off].case[-1]))) is not arrow.outer:
        yield arrow.missing(f"a ball that leaves the floor ends in {leaves.name}")
    elif arrow.inner is Case.RR and off:
        yield from _bracketed_onset(arrow, Bracket(orbits[off - 1], orbits[off]))
    else:
        yield from _extrapolated_onset(arrow, orbits, forces)


def _load(arrow: Arrow, orbit: float) -> Procedure[None]:
    """Force of the floor at an orbit at which it presses, N, from both steps."""
    (p, _), load = arrow.start(orbit), None
    tasks = [arrow.task(orbit, times) for times in arrow.runner.sampling.halves]
    (runs,) = yield from asked(tasks)
    if not isinstance(runs, str):
        coarse, fine = map(_force, runs)
        if coarse and fine:
            limit = at_zero_step(coarse.value, fine, lag=lag_error(arrow.runner, p, 2))
            load = limit.times(p.m * p.g)
    row = arrow.row("moving_force_Ay", orbit, load or math.nan, tasks)
    yield if_found(row, f"the force of the floor in {arrow.inner.name} is none")


def _bracketed_onset(arrow: Arrow, around: Bracket) -> Procedure[None]:
    """The orbit at which a ball leaves the floor, between one at which it presses and another."""

    def task(omega_c: float, bracket: Bracket, attempt: Attempt) -> Task:
        return arrow.task(omega_c, attempt.divisor)

    sampling = arrow.runner.sampling
    width = sampling.thresholds_width * around.high
    search = Search(around, task, lambda run: _force(run) is not None, width)
    (bracket,) = yield from narrowed(search, careful=not sampling.granted)
    last, _ = bracket.runs
    if bracket.failure or not last or not arrow.staying([last]):
        slips = "the ball slips before it leaves the floor"
        yield arrow.missing(f"the run {bracket.failure}" if bracket.failure else slips)
    else:
        yield arrow.row("lift_onset", 1 / time_unit(arrow.p), bracket.place, bracket.tasks)


def _extrapolated_onset(
    arrow: Arrow, orbits: Sequence[float], forces: Sequence[Estimate | None]
) -> Procedure[None]:
    """The orbit at which the floor's force would be zero, from others just below that at which it
    is by a line through the last two forces."""
    pressed = [(w**2, force.value) for w, force in zip(orbits, forces, strict=True) if force]
    where = 0.0
    if len(pressed) >= 2 and arrow.inner is not Case.RR:
        (a, high), (b, low) = pressed[-2:]
        where = math.sqrt(b + low * (b - a) / (high - low)) if high > low else 0.0
    nearer = [where * (1 - part) for part in LATER_ORBITS if where]
    halves = arrow.runner.sampling.halves
    tasks = [arrow.task(orbit, times) for orbit in nearer for times in halves]
    (runs,) = yield from asked(tasks)
    if isinstance(runs, str) or (onset := _onset(runs)) is None:
        chatters = "the contact at the floor opens and closes"
        yield arrow.missing(f"the run {runs}" if isinstance(runs, str) else chatters)
    else:
        yield arrow.row("lift_onset", 1 / time_unit(arrow.p), onset, tasks)


@dataclass(frozen=True)
class Arrow:
    """States of a case that differ in omega_c, and the case to which the ball leaves the floor."""

    runner: Runner
    set: str
    p: Parameters
    inner: Case
    outer: Case

    def start(self, omega_c: float) -> tuple[Parameters, Array]:
        """Parameters with the flow, and the state (8,), of a ball that goes round with omega_c."""
        unit = self.p.R / self.p.r * omega_c if self.inner is Case.SR else state_units(self.p)[3]
        slips = np.array(ARROWS[self.inner, self.outer]) * unit
        # a ball that rolls at both points can hardly lag
        leads = 1.0 if self.inner is Case.RR else LEAD
        return self.p.replace(omega_0=leads * omega_c), np.array(
            [0.0, 0.0, omega_c, *slips, 0.0, 0.0]
        )

    def task(self, omega_c: float, times: int = 1) -> Task:
        """A short run from an orbit, with half of `STEP_RATIO`'s steps, divided by `times`."""
        step = coarse_step(self.p) / (2 * STEP_RATIO * times)
        return self.runner.task(*self.start(omega_c), LIFT_STEPS * step, step, samples=LIFT_STEPS)

    def staying(self, runs: Sequence[Trajectory]) -> Sequence[Trajectory]:
        """The first runs in succession that stay in the two cases of the arrow."""
        strays = [
            not np.isin(run.case[LIFT_SKIPPED:], [self.inner, self.outer]).all() for run in runs
        ]
        first = [*strays, False].index(False)
        return runs[first : [*strays, True].index(True, first)]

    def missing(self, why: str) -> Missing:
        """A record that it isn't known where the ball leaves the floor, and why."""
        return self.runner.missing(self.set, f"out of {self.inner.name}: {why}")

    def row(
        self, quantity: str, omega_c: float, value: Estimate | float, tasks: Sequence[Task]
    ) -> Measurement:
        """A measurement along the arrow, with the state at one orbit as conditions."""
        p, x0 = self.start(omega_c)
        at = Conditions(inner=self.inner.name, outer=self.outer.name) | state_of(x0)
        return self.runner.measurement(self.set, p, quantity, value, tasks, **at)


def _force(run: Trajectory) -> Estimate | None:
    """Force of the floor at first in weights; None where it doesn't press for long."""
    p, force = run.header.parameters, run.force_A[LIFT_SKIPPED:, 1]
    pressed = int(np.argmax(np.append(force <= 0, True)))
    if pressed < FEWEST_PRESSED:
        return None
    time = run.time[LIFT_SKIPPED:][:pressed]
    # The force of a sample acts from then on for a step: it belongs to the middle of it.
    begin = -(time[1] - time[0]) / 2
    value, lower = (
        polynomials(time, force[:pressed], LIFT_DEGREES, begin)[0] / (p.m * p.g)
    ).tolist()
    return estimate(value, degree=uniform(abs(value - lower)))


def _onset(runs: Sequence[Trajectory]) -> Estimate | None:
    """omega_c at which the floor's force is zero, from both steps; None without one."""
    squares, forces = np.array([run.omega_c[0] ** 2 for run in runs[::2]]), []
    for coarse, fine in zip(map(_force, runs[::2]), map(_force, runs[1::2]), strict=True):
        if coarse is None or fine is None:
            return None
        forces.append(at_zero_step(coarse.value, fine))
    square = extrapolated_zero(squares, forces) if forces else Estimate(0.0, math.inf)
    if not square.value > 0 or math.isinf(square.uncertainty):
        return None
    root = math.sqrt(square.value)
    return replace(square.times(1 / (2 * root)), value=root)


PROTOCOLS = (
    Protocol("growth", measure),
    Protocol("steepest", steepest),
    Protocol("lift", lift),
    Protocol("bounds", bounds, ("thresholds",)),
)
