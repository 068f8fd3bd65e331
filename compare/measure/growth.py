"""Growth of slip: a rolling ball is given a slip along one direction; in the first milliseconds it grows or dies out.

gamma, the initial rate of change of the slip along its direction, is taken to a vanishing size of the slip by runs of
several sizes. A record counts only if, by the engine's own contacts, all of it is in the case in which the ball was to
slip. States are at random in natural units, and away from stationary ones.

Out of rolling on the wall alone, growths along directions all round make a curve; where its first harmonic is greatest,
slip grows the most. That other harmonics are small is measured, not assumed: what they may turn the direction by is its
uncertainty.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from compare.measure import field
from compare.measure.field import DOUBT, LIMIT, random_state
from compare.measure.fits import slope_error, value_and_slope
from compare.measure.lab import Lab, coarse_step, dragged_speed, time_unit
from compare.measure.levels import Level
from compare.measure.quantities import quantity
from compare.measure.record import Condition, Measurement, Missing, Records, if_sure, measurement, state_of, sure_enough
from compare.runs.tasks import Task
from compare.statistics import COVERAGE, Measured
from model import Case, Parameters, State, Trajectory
from model.arrays import Array
from model.kinematics import SLIP_XYZ

SEED, FAN_SEED = 61, 58
PUSHES = {
    (Case.RR, Case.RS): 1,
    (Case.RR, Case.SR): 1,
    (Case.RR, Case.SS): 2,
    (Case.RS, Case.SS): 2,
    (Case.SR, Case.SS): 2,
    (Case.NR, Case.NS): 3,
}
"""Arrows of Fig. 6 along which a contact begins to slip, and directions out of random states at the quick level."""
MORE = {Level.QUICK: 1, Level.DEFAULT: 2, Level.FULL: 6}
"""How many times as many there are at each level."""
SLIPS = {Case.RS: (1,), Case.SR: (0,), Case.SS: (0, 1, 2), Case.NS: (1, 2)}
"""Which of slip_x, slip_y, slip_z a case allows beyond the one it leaves."""
REFINED = 16
"""Steps in one of `coarse_step`; every other run has twice as many."""
STEPS, SKIPPED = 20, 6
"""Steps of a record, and those at its start in which contact forces build up."""
LARGE, SMALL, BESIDE = (3.0, 1.5), (0.3, 0.15), (1.2, 0.6, 0.3)
"""Slips at the start in units of `start_unit`: so large that they neither end nor turn much in a record; small where
one contact has to hold, or the ball goes round slowly and the wall carries little; and three where the direction of a
contact that slips already depends on the size."""
DEGREES = (4, 3)
"""Of the polynomials through a record; the lower one shows what the degree changes."""
AT_END = float(
    slope_error(np.arange(SKIPPED, STEPS + 1.0), DEGREES[0])
    / slope_error(np.arange(-field.HALF, field.HALF + 1.0), field.DEGREES[0])
)
"""How many times as uncertain as in the middle of a window of `compare.measure.field` a rate is before a record."""
COARSE = quantity("gamma").resolves / COVERAGE
"""Largest uncertainty that counts, in units of `field.slip_unit`, all that a check may have: where a contact is hardly
loaded, slip turns too fast."""
SMOOTH = "without friction at both contacts there is nothing that rolls"
SINKING = 0.5
"""Speed over `dragged_speed` at which a ball sinks on which the fluid also pulls along the wall at that speed."""
SIDEWAYS = (0.3, 1.0, 0.3)
"""A direction of slip that is almost that of the wall's contact alone."""
FANS = {Level.QUICK: 1, Level.DEFAULT: 3, Level.FULL: 12}
"""Random states of every set out of which slip is pushed all round."""
DIRECTIONS = 8
DRAGGED = (0.5, 3.0)
"""How hard the fluid then pulls along the orbit over the weight, least and most, either way: it turns the direction."""
AHEAD = 3.0
"""Largest angle of the greatest growth from the vertical, rad, that is recorded: one beyond may come out on either side
of pi."""


@dataclass(frozen=True)
class Push:
    """A rolling state, and the direction of slip along which it is pushed."""

    set: str
    p: Parameters
    inner: Case
    outer: Case
    x: Array
    """(8,)"""
    n: Array
    """Unit vector (3,) over slip_x, slip_y, slip_z."""
    by: str = ""
    """``sideways`` for the direction `SIDEWAYS`, ``dragged`` where the fluid pulls hard, ``rest`` out of rest in a
    fluid at rest; empty for one at random; how a line of `compare.measure.bounds` goes."""

    @property
    def sizes(self) -> tuple[float, ...]:
        """Sizes of slip, in units of `start_unit`, each half of the one before."""
        if self.inner in (Case.RS, Case.SR):
            return BESIDE
        return SMALL if self.outer in (Case.RS, Case.SR) else LARGE

    def task(self, lab: Lab, size: float, times: int = 1) -> Task:
        """The run with one size of slip, in units of `start_unit`, and `times` as many steps."""
        p, step = self.p, coarse_step(self.p) / REFINED
        x = self.x.copy()
        x[SLIP_XYZ] += size * start_unit(p, x) * self.n
        return lab.task(p, x, STEPS * step, step / times, samples=STEPS * times)

    def tasks(self, lab: Lab) -> list[Task]:
        """Every size, with either step."""
        return [self.task(lab, size, times) for times in (1, 2) for size in self.sizes]

    def rate(self, run: Trajectory, times: int = 1) -> Array:
        """Initial rates of the slip along n by polynomials of degrees 4 and 3, rad s-2; nan if the case was another."""
        # Beside a ball at rest the wall carries nothing: its contact doesn't show.
        alike = {self.outer, Case.RN} if self.by == "rest" else {self.outer}
        if not np.isin(run.case[SKIPPED * times :], list(alike)).all():
            return np.full(2, np.nan)
        time, slip = run.time[SKIPPED * times :], run.x[SKIPPED * times :, SLIP_XYZ] @ self.n
        return np.array([value_and_slope(time, slip, degree)[1] for degree in DEGREES])

    @property
    def conditions(self) -> dict[str, Condition]:
        """What the growth belongs to."""
        along: dict[str, Condition] = {"inner": self.inner.name, "outer": self.outer.name, "by": self.by}
        return along | state_of(self.x) | direction(self.n)


def direction(n: Array) -> dict[str, float]:
    """A unit vector (3,) over slip_x, slip_y, slip_z as conditions."""
    return dict(zip(("n_x", "n_y", "n_z"), n.tolist(), strict=True))


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """gamma out of random states, along every arrow; where one contact slips to either side, how they share rolling."""
    protocol, rough = "growth", {name: p for name, p in sets.items() if p.mu and p.eta}
    yield from (Missing(protocol, name, SMOOTH) for name in sets if name not in rough)
    pushes = [push for name, p in rough.items() for push in _pushes(name, p, MORE[lab.level])]
    planned = [push.tasks(lab) for push in pushes]
    left = Counter[tuple[str, Case, Case]]()
    before: tuple[Push, Measured] | None = None
    for push, tasks, runs in zip(pushes, planned, lab.groups(planned), strict=True):
        value = growth(push, runs)
        if value is None:
            left[push.set, push.inner, push.outer] += 1
            continue
        yield measurement(lab, protocol, push.set, push.p, "gamma", value, tasks, **push.conditions)
        if before and before[0].x is push.x:
            share = _share(*before, push, value)
            if sure_enough("filippov_share", share, 1.0):
                yield measurement(lab, protocol, push.set, push.p, "filippov_share", share, tasks, **push.conditions)
        before = push, value
    for (name, inner, outer), count in left.items():
        slips = f"{count} slips from {inner.name} to {outer.name}"
        yield Missing(protocol, name, f"{slips} did not stay in {outer.name}, or turned too fast")


def _share(one: Push, its: Measured, other: Push, value: Measured) -> Measured:
    """Share of the side of negative slip in rolling, as which the two sides' growths cancel."""
    plus, minus = (its, value) if one.n.sum() > other.n.sum() else (value, its)
    both = plus.value + minus.value
    uncertainty = math.hypot(plus.uncertainty * minus.value, minus.uncertainty * plus.value) / both**2
    return Measured(plus.value / both, uncertainty)


def growth(push: Push, runs: Sequence[Trajectory]) -> Measured | None:
    """gamma for a vanishing size and step, None if a record was not in the case or is too coarse.

    Its uncertainty is what the step and a degree of the polynomials change, and for three sizes a third of what the
    third one does: the next would change less.
    """
    half = len(runs) // 2
    coarse, fine = (np.array([push.rate(run, n) for run in runs[k : k + half]]) for n, k in ((1, 0), (2, half)))
    if np.isnan(coarse).any() or np.isnan(fine).any():
        return None
    value, lower = _vanishing(fine + (fine - coarse) * LIMIT)
    step, _ = _vanishing(fine - coarse) * DOUBT
    size = (value - _vanishing(fine[-2:] + (fine[-2:] - coarse[-2:]) * LIMIT)[0]) / 3
    p = push.p
    # Slip at the wall alone of a ball that rolls on the floor neither turns nor changes its load.
    floor = field.floor(p) * (1.0 if push.outer is Case.RS else AT_END) * field.slip_unit(p)
    uncertainty = math.hypot(step, value - lower, size, floor)
    if uncertainty > COARSE * field.slip_unit(p):
        return None
    return Measured(float(value), uncertainty)


def _vanishing(rates: Array) -> Array:
    """The limit of rows (2 or 3, n), each of which belongs to half the size of the one before."""
    *first, before, last = rates
    return np.asarray((first[0] - 6 * before + 8 * last) / 3 if first else 2 * last - before)


def _pushes(name: str, p: Parameters, more: int) -> Iterator[Push]:
    rng = np.random.default_rng([SEED, *name.encode()])
    slow = 0.4 / time_unit(p) * min(1.0, math.sqrt(p.mu / max(p.eta, p.j)))
    n = np.array(SIDEWAYS) / np.linalg.norm(SIDEWAYS)
    x = State(omega_c=slow).stacked()
    yield Push(name, p.replace(omega_0=slow), Case.RR, Case.SS, x, n, "sideways")
    still = p.replace(omega_0=0.0)
    for side in (1, -1):
        yield Push(name, still, Case.RR, Case.RS, np.zeros(8), np.array([0.0, side, 0.0]), "rest")
        sinking = State.of(random_state(Case.NR, p, rng))._replace(v_y=-SINKING * dragged_speed(p))
        dragged = p.replace(omega_0=sinking.omega_c + dragged_speed(p) / p.R)
        yield Push(name, dragged, Case.NR, Case.NS, sinking.stacked(), np.array([0.0, 0.8 * side, 0.6]), "dragged")
    for (inner, outer), count in PUSHES.items():
        for _ in range(count * more):
            begin = State.of(random_state(inner, p, rng))
            begin = begin._replace(omega_c=_orbit(outer, p, rng) or begin.omega_c)
            slides = {Case.RS: 1, Case.SR: 0}.get(inner)
            # A slip that is there already is so fast that a slower one beside it hardly turns it.
            if inner is Case.RS:
                fast = rng.choice([-1, 1]) * rng.uniform(3.0, 5.0)
                begin = begin._replace(slip_y=fast * start_unit(p, begin.stacked()))
            if inner is Case.SR:  # the faster the ball spins about its radial axis, the faster slip_z sets in
                begin = begin._replace(slip_x=-rng.uniform(2.0, 3.0) * p.R / p.r * begin.omega_c)
            n, x = np.zeros(3), begin.stacked()
            free = [k for k in SLIPS[outer] if k != slides]
            n[free] = rng.choice([-1, 1], len(free)) * rng.uniform(0.4, 1.0, len(free))
            omega_0 = float(begin.omega_c * rng.uniform(0.6, 1.4))
            for side in (1, -1) if len(free) == 1 else (1,):
                yield Push(name, p.replace(omega_0=omega_0), inner, outer, x, side * n / np.linalg.norm(n))


def _orbit(outer: Case, p: Parameters, rng: np.random.Generator) -> float | None:
    """An omega_c at which both contacts press, in whatever way they rub; None where that of `random_state` will do."""
    if outer is Case.SR:  # the spin axis turns with the orbit, and the wall alone turns it
        return float(math.sqrt(rng.uniform(0.4, 0.8) * p.g / (p.j * p.R)))
    if outer is Case.SS:
        least, most = p.mu, min(1 / p.eta, 3.0)
        return float(math.sqrt((least + rng.uniform(0.3, 0.7) * (most - least)) * p.g / p.R))
    return None


def start_unit(p: Parameters, x: Array) -> float:
    """The slip that the weight, and at the wall the centrifugal force, makes in the unit of time, rad s-1."""
    return (p.g + p.R * float(State.of(x).omega_c) ** 2) / 2 / p.r * time_unit(p)


def steepest(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """The direction in which slip out of NR grows the most, for every state."""
    protocol, rough = "steepest", {name: p for name, p in sets.items() if p.eta and p.c}
    why = "without friction at the wall, or drag, no direction stands out"
    yield from (Missing(protocol, name, why) for name in sets if name not in rough)
    fans = [fan for name, p in rough.items() for fan in _fans(name, p, FANS[lab.level])]
    runs = lab.groups([push.tasks(lab) for fan in fans for push in fan])
    for fan in fans:
        first, growths = fan[0], [growth(push, next(runs)) for push in fan]
        beta = _greatest([g for g in growths if g])
        why = "slip along some direction did not last, or no direction stands out"
        if beta and abs(beta.value) < AHEAD:
            tasks, at = [task for push in fan for task in push.tasks(lab)], state_of(first.x)
            yield if_sure(measurement(lab, protocol, first.set, first.p, "steepest", beta, tasks, **at), 1.0, why)
        else:
            yield Missing(protocol, first.set, why)


def _fans(name: str, p: Parameters, count: int) -> Iterator[list[Push]]:
    """Random states, each pushed at angles all round from slip_z to slip_y of the wall's contact (8)."""
    rng = np.random.default_rng([FAN_SEED, *name.encode()])
    for _ in range(count):
        x = random_state(Case.NR, p, rng)
        pull = rng.choice([-1, 1]) * rng.uniform(*DRAGGED)
        q = p.replace(omega_0=State.of(x).omega_c + pull * dragged_speed(p) / p.R)
        angles = np.linspace(0.0, 2 * np.pi, DIRECTIONS, endpoint=False)
        yield [Push(name, q, Case.NR, Case.NS, x, np.array([0.0, np.sin(b), np.cos(b)])) for b in angles]


def _greatest(growths: Sequence[Measured]) -> Measured | None:
    """Direction of the first harmonic; None without growths in all directions."""
    if len(growths) < DIRECTIONS:
        return None
    harmonics = np.fft.rfft([g.value for g in growths]) * 2 / DIRECTIONS
    scatter = np.sqrt(2.0 / DIRECTIONS) * max(g.uncertainty for g in growths)
    others = np.arange(2, len(harmonics)) @ np.abs(harmonics[2:])
    return Measured(float(-np.angle(harmonics[1])), float(np.hypot(scatter, others) / np.abs(harmonics[1])))
