"""Growth of slip: a rolling ball is given a slip along one direction; in the first milliseconds it
grows or dies out.

gamma, the initial rate of change of the slip along its direction, is extrapolated from several
sizes of the slip to none. A record counts only if all of it is, by the engine's own contacts, in
the case in which the ball was to slip; else the case into which it passes is what is measured.
States are at random in natural units, and away from stationary ones.

Out of rolling on the wall alone, slip grows the most where the first harmonic of gamma over all
directions is greatest. Its uncertainty is how far the other harmonics may turn that direction."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from compare.kit import step_pairs
from compare.kit.record import Measurement, Missing, Records, measurement, state_of
from compare.kit.runner import Runner, coarse_step
from compare.kit.scales import dragged_speed, slip_unit, time_unit
from compare.kit.statistics import Estimate, estimate, slope_error, uniform
from compare.kit.step_pairs import Start
from compare.kit.tasks import Task
from model import Case, Parameters, State, Trajectory
from model.arrays import Array
from model.kinematics import SLIP_XYZ

PUSHES = {
    (Case.RR, Case.RS): 1,
    (Case.RR, Case.SR): 1,
    (Case.RR, Case.SS): 2,
    (Case.RS, Case.SS): 2,
    (Case.SR, Case.SS): 3,
    (Case.NR, Case.NS): 3,
}
"""Arrows of Fig. 6 along which a contact begins to slip, and directions out of random states at the
quick level."""
SLIPS = {Case.RS: (1,), Case.SR: (0,), Case.SS: (0, 1, 2), Case.NS: (1, 2)}
"""Which of slip_x, slip_y, slip_z a case allows beyond the one it leaves."""


RECORD_STEPS = 20
"""Of a record of slip."""
RECORD_SKIPPED = 6
"""At its start, in which contact forces build up."""
RECORD_SETTLED = 6
"""At its end, in which the case must be the same for a slip to have passed into it."""
RECORD_DEGREES = (4, 3)
"""Of the polynomials; the lower one shows what the degree changes."""
LARGE_SLIPS = (3.0, 1.5)
"""Slips at the start, in units of `start_unit`, each half of the one before: so large that they
neither end nor turn much in a record."""
SMALL_SLIPS = (0.3, 0.15)
"""Those where one contact has to hold."""
SLIPS_BESIDE = (1.2, 0.6, 0.3)
"""Those beside a slip that is there already, where the direction depends on the size."""


AT_START = slope_error(
    np.arange(RECORD_SKIPPED, RECORD_STEPS + 1.0), RECORD_DEGREES[0]
) / slope_error(
    np.arange(-step_pairs.HALF_WINDOW, step_pairs.HALF_WINDOW + 1.0), step_pairs.WINDOW_DEGREES[0]
)
"""Uncertainty of a rate extrapolated to the start of a record, relative to that at the centre of a
window."""
FRICTIONLESS = "without friction at both contacts there is nothing that rolls"


def measure(
    runner: Runner, sets: Mapping[str, Parameters], records: Records
) -> Iterator[Measurement | Missing]:
    """gamma out of random states, along every arrow; where one contact may slip to either side,
    their shares (69)."""
    rough = {name: p for name, p in sets.items() if p.mu and p.eta}
    yield from (Missing("growth", name, FRICTIONLESS) for name in sets if name not in rough)
    sides = [
        push for name, p in rough.items() for push in _pushes(name, p, runner.sampling.growth_more)
    ]
    tasks = [push.tasks(runner) for pushes in sides for push in pushes]
    runs = zip(tasks, runner.groups(tasks), strict=True)
    left = Counter[tuple[str, Case, Case]]()
    for pushes in sides:
        grown = []
        for push in pushes:
            own, pairs = next(runs)
            if isinstance(pairs, str):
                yield Missing(
                    "growth",
                    push.start.set,
                    f"from {push.inner.name} to {push.outer.name}: the run {pairs}",
                )
                continue
            if value := growth(push, pairs):
                grown.append(value)
                yield push.row(runner, "growth", "gamma", value, own)
                continue
            sized = ((size, slice(2 * k, 2 * k + 2)) for k, size in enumerate(push.sizes))
            strays = (
                push.following_case(runner, "growth", size, own[of], pairs[of])
                for size, of in sized
            )
            if stray := next(filter(None, strays), None):
                yield stray
            else:
                left[push.start.set, push.inner, push.outer] += 1
        # the share of the side of negative slip with which the two growth rates cancel
        if len(grown) == 2:
            plus, minus = grown if pushes[0].n.sum() > pushes[1].n.sum() else grown[::-1]
            both = plus.value + minus.value
            share = estimate(
                plus.value / both,
                1 / both**2,
                ahead=plus.uncertainty * abs(minus.value),
                back=minus.uncertainty * abs(plus.value),
            )
            yield push.row(runner, "growth", "filippov_share", share, own)
    for (name, inner, outer), count in left.items():
        yield Missing(
            "growth",
            name,
            f"slips from {inner.name} to {outer.name} pass through several cases",
            count,
        )


@dataclass(frozen=True, eq=False)
class Push:
    """A start that rolls, and the slip that it is given.

    The start's name: ``sideways`` for a direction that is almost that of the wall's contact alone,
    ``dragged`` where the fluid pulls hard, ``rest`` in a fluid at rest, empty for a direction at
    random, ``held`` and ``stationary`` for `bounds`."""

    start: Start
    inner: Case
    outer: Case
    n: Array  # direction, a unit vector (3,) of slip_x, slip_y, slip_z

    @property
    def sizes(self) -> tuple[float, ...]:
        """Sizes of slip, in units of `start_unit`."""
        if self.inner in (Case.RS, Case.SR):
            return SLIPS_BESIDE
        return SMALL_SLIPS if self.outer in (Case.RS, Case.SR) else LARGE_SLIPS

    def pair(self, runner: Runner, size: float, divisor: int = 1) -> list[Task]:
        """Tasks with one size of slip, in units of `start_unit`, with both time steps, divided by
        `divisor`."""
        p, x = self.start.p, self.start.x0.copy()
        x[SLIP_XYZ] += size * start_unit(p, x) * self.n
        steps, step = RECORD_STEPS * divisor, coarse_step(p) / (step_pairs.STEP_RATIO * divisor)
        return [
            runner.task(p, x, steps * step, step / n, samples=steps * n)
            for n in runner.sampling.halves
        ]

    def tasks(self, runner: Runner) -> list[Task]:
        """Tasks with every size of slip and both time steps; of the engine on trial these are half
        as long, since the first ones of a run are seen in it for a while."""
        divisor = 1 if runner.has_own_steps else 2
        return [task for size in self.sizes for task in self.pair(runner, size, divisor)]

    def rates(self, run: Trajectory) -> Array:
        """Initial rates of the slip along n by polynomials of either degree (2,), rad s-2; nan in
        another case."""
        record = slice(RECORD_SKIPPED * (len(run.time) // RECORD_STEPS), None)
        # The wall carries nothing beside a ball at rest: that contact is not detected.
        alike = [self.outer, Case.RN] if self.start.name == "rest" else [self.outer]
        if not np.isin(run.case[record], alike).all():
            return np.full(2, np.nan)
        return step_pairs.polynomials(
            run.time[record], run.x[record, SLIP_XYZ] @ self.n, RECORD_DEGREES
        )[1]

    def row(
        self,
        runner: Runner,
        protocol: str,
        quantity: str,
        value: Estimate | float,
        tasks: Sequence[Task],
        **at: float,
    ) -> Measurement:
        """A measurement of the push, with its state and direction as conditions."""
        start, n = self.start, dict(zip(("n_x", "n_y", "n_z"), self.n.tolist(), strict=True))
        along = (
            {"inner": self.inner.name, "outer": self.outer.name, "by": start.name}
            | state_of(start.x0)
            | n
        )
        return measurement(
            runner, protocol, start.set, start.p, quantity, value, tasks, **along, **at
        )

    def following_case(
        self,
        runner: Runner,
        protocol: str,
        size: float,
        tasks: Sequence[Task],
        runs: Sequence[Trajectory],
    ) -> Measurement | None:
        """The case that follows where a slip doesn't last; None if it lasts, or runs with both
        steps disagree."""
        fine = runs[1]
        ended = int(fine.case[-1])
        if ended == self.outer or any(np.any(run.case[-RECORD_SETTLED:] != ended) for run in runs):
            return None
        at = {"slip": size * start_unit(self.start.p, self.start.x0), "time": float(fine.time[-1])}
        return self.row(runner, protocol, "case", ended, tasks, **at)


def growth(push: Push, runs: Sequence[Trajectory]) -> Estimate | None:
    """gamma for a vanishing size and step from `Push.tasks`, None if a record left the case.

    Its uncertainty is what the step and a degree of the polynomials change, and for three sizes a
    third of what the third one changes, since the next would change less."""
    coarse, fine = (np.array([push.rates(run) for run in some]) for some in (runs[::2], runs[1::2]))
    if np.isnan(coarse).any() or np.isnan(fine).any():
        return None
    best = fine + (fine - coarse) * step_pairs.EXTRAPOLATION
    value, lower = limit_of_no_size(best)
    step = limit_of_no_size(fine - coarse)[0] * step_pairs.DOUBT
    size = (value - limit_of_no_size(best[-2:])[0]) / 3
    p = push.start.p
    # Slip at the wall alone of a ball that rolls on the floor neither turns nor changes its load.
    least = step_pairs.lag_error(p) * (1.0 if push.outer is Case.RS else AT_START) * slip_unit(p)
    return estimate(
        value,
        time_step=abs(float(step)),
        degree=uniform(abs(float(value - lower))),
        push=uniform(abs(float(size))),
        lag=least,
    )


def limit_of_no_size(rates: Array) -> Array:
    """Rates extrapolated to a slip of size zero, from rows (2 or 3, n) for sizes that halve from
    row to row."""
    *first, before, last = rates
    return np.asarray((first[0] - 6 * before + 8 * last) / 3 if first else 2 * last - before)


def _pushes(name: str, p: Parameters, more: int) -> Iterator[list[Push]]:
    """Pushes out of every state of a set; two of them where one contact alone slips, to either
    side."""
    rng = np.random.default_rng([61, *name.encode()])
    slow = 0.4 / time_unit(p) * min(1.0, math.sqrt(p.mu / max(p.eta, p.j)))
    going = Start(name, p.replace(omega_0=slow), "sideways", State(omega_c=slow).stacked())
    yield [
        Push(going, Case.RR, Case.SS, np.array([0.3, 1.0, 0.3]) / np.linalg.norm([0.3, 1.0, 0.3]))
    ]
    still = Start(name, p.replace(omega_0=0.0), "rest", np.zeros(8))
    for side in (1, -1):
        yield [Push(still, Case.RR, Case.RS, np.array([0.0, side, 0.0]))]
        # It sinks half as fast as the fluid pulls it along the wall.
        sinking = State.of(step_pairs.random_state(Case.NR, p, rng))._replace(
            v_y=-0.5 * dragged_speed(p)
        )
        dragged = p.replace(omega_0=sinking.omega_c + dragged_speed(p) / p.R)
        start = Start(name, dragged, "dragged", sinking.stacked())
        yield [Push(start, Case.NR, Case.NS, np.array([0.0, 0.8 * side, 0.6]))]
    for (inner, outer), count in PUSHES.items():
        for _ in range(count * more):
            x = State.of(step_pairs.random_state(inner, p, rng))
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
            start = Start(
                name, p.replace(omega_0=float(x.omega_c * rng.uniform(0.6, 1.4))), "", x.stacked()
            )
            yield [
                Push(start, inner, outer, side * n)
                for side in ((1, -1) if len(free) == 1 else (1,))
            ]


def start_unit(p: Parameters, x: Array) -> float:
    """The slip that the weight, and at the wall the centrifugal force, makes in the unit of time,
    rad s-1."""
    return (p.g + p.R * float(State.of(x).omega_c) ** 2) / 2 / p.r * time_unit(p)


def steepest(
    runner: Runner, sets: Mapping[str, Parameters], records: Records
) -> Iterator[Measurement | Missing]:
    """The direction in which slip out of NR grows the most, for every state: that of the first
    harmonic."""
    rough = {name: p for name, p in sets.items() if p.eta and p.c}
    why = "without friction at the wall, or drag, no direction stands out"
    yield from (Missing("steepest", name, why) for name in sets if name not in rough)
    # random states, each pushed at angles all round from slip_z to slip_y of the wall's contact
    fans = []
    for name, p in rough.items():
        rng = np.random.default_rng([58, *name.encode()])
        for _ in range(runner.sampling.steepest_states):
            x = step_pairs.random_state(Case.NR, p, rng)
            # The fluid pulls along the orbit, by half the weight to three times it: that turns the
            # direction.
            pull = rng.choice([-1, 1]) * rng.uniform(0.5, 3.0)
            start = Start(
                name, p.replace(omega_0=State.of(x).omega_c + pull * dragged_speed(p) / p.R), "", x
            )
            angles = np.linspace(0.0, 2 * np.pi, 8, endpoint=False)
            fans.append(
                [
                    Push(start, Case.NR, Case.NS, np.array([0.0, np.sin(b), np.cos(b)]))
                    for b in angles
                ]
            )
    runs = runner.groups([push.tasks(runner) for fan in fans for push in fan])
    for fan in fans:
        why, grown = "slip along some direction did not last, or no direction stands out", []
        for push in fan:
            if isinstance(got := next(runs), str):
                why = f"the run {got}"
            elif value := growth(push, got):
                grown.append(value)
        start, tasks = fan[0].start, [task for push in fan for task in push.tasks(runner)]
        angle = math.nan
        if len(grown) == len(fan):
            harmonics = np.fft.rfft([g.value for g in grown]) * 2 / len(fan)
            angle = float(-np.angle(harmonics[1]))
        if not abs(angle) < 3:  # one near pi may come out on either side of it
            yield Missing("steepest", start.set, why)
            continue
        scatter = np.sqrt(2.0 / len(fan)) * max(g.uncertainty for g in grown)
        others = np.arange(2, len(harmonics)) @ np.abs(harmonics[2:])
        first = float(np.abs(harmonics[1]))
        beta = estimate(angle, 1 / first, rates=float(scatter), harmonics=float(others))
        yield measurement(
            runner, "steepest", start.set, start.p, "steepest", beta, tasks, **state_of(start.x0)
        )
