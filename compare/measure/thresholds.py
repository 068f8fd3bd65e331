"""The thresholds of the bifurcation diagram, each measured in two ways that have nothing in common but the engine.

* Bisected, by the engine's own contacts: the largest flow at which a rolling ball stays without slip, or on the floor;
  the least at which the wall holds a ball that rides it; the flow up to which a lifted ball, pressed lightly on the
  floor, goes back to rolling on both; the largest flow at which a slipping ball settles.
* Extrapolated from settled states on one side: the flow at which their lag behind the fluid, their sinking or the force
  of the floor would vanish, or at which omega_0 along the branch has its maximum. It is a smooth function of the lag,
  whatever the law of drag; of the slip it needn't be.

And the drag below which slipping at both points ends in a fold, and above which it passes to the wall without a jump.
Where the branch of settled slipping comes to its end, the floor carries nothing. How omega_0 goes with the force of the
floor there, rising or falling, decides whether the branch turns back: the drag is looked for at which it does neither.
All states are settled in stronger drag than that, where the branch has no fold and they last up to its end.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from compare.measure import onset
from compare.measure.brackets import Bracket
from compare.measure.fits import POINTS, initial_slope, straight_line, turning, vanishing
from compare.measure.lab import Lab, time_unit
from compare.measure.questions import slip
from compare.measure.record import Condition, Measurement, Missing, Records, if_sure, measurement, sure_enough
from compare.measure.settling import Settled, begin, settle_groups
from compare.runs.tasks import Task
from compare.statistics import COVERAGE, Measured
from model import Case, Parameters
from model.arrays import Array

STRONG = (2.0, 4.0)
"""The first two drags where a fold is born, c sqrt(R/g): the fluid takes a ball along within a fraction of the time of
its fall."""
BEYOND = (1.6, 2.6)
"""The others, over the one to which the first two point: near to it, but so far off that states still settle soon."""
NEAR = (0.02, 0.035, 0.055, 0.08, 0.12)
"""Distances of the states from omega_02, in parts of the range of slipping."""


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Bracket every change on the grid, settle states beside it, then bisect and extrapolate."""
    cases = onset.look(lab, sets)
    brackets = onset.ends_of_rolling(lab, sets, cases)
    brackets |= onset.neighbourhoods(lab, sets, cases, brackets)
    states = onset.settled_beside(lab, sets, brackets)
    brackets = {key: b for key, b in brackets.items() if key[1] != "riding"} | onset.refined(
        lab, sets, brackets, states
    )
    ends = {}
    for name in sets:
        turned, riding = states.get((name, "turning"), []), brackets.get((name, "riding"))
        top = extrapolated(turned, "slip_x", turning)
        if top and not (riding and _reaches(extrapolated(turned, "force_Ay", vanishing), riding.high, lab)):
            ends[name] = top
    brackets |= onset.folded(lab, sets, ends, states)
    for name, p in sets.items():
        own = {kind: bracket for (one, kind), bracket in brackets.items() if one == name}
        rows = Rows(lab, name, p, own, {kind: s for (one, kind), s in states.items() if one == name})
        yield from rows.rolling()
        yield from rows.riding()
        yield from rows.slipping(ends.get(name))


def extrapolated(
    states: Sequence[Settled], quantity: str, to: Callable[[Array, Sequence[Measured]], Measured]
) -> Measured | None:
    """The flow to which a quantity of settled states points; None if they are too few, or point nowhere."""
    if len(states) < POINTS:
        return None
    omegas = np.array([state.start.p.omega_0 for state in states])
    place = to(omegas, [_lag(state) if quantity == "lag" else state.values[quantity] for state in states])
    return place if math.isfinite(place.uncertainty) else None


def _lag(state: Settled) -> Measured:
    """omega_0 - omega_c, rad s-1."""
    orbit = state.values["omega_c"]
    return Measured(state.start.p.omega_0 - orbit.value, orbit.uncertainty)


def _reaches(unloaded: Measured | None, carried: float, lab: Lab) -> bool:
    """Whether the floor's force on a slipping ball falls to zero just where the wall begins to carry it."""
    near = onset.FOLD_WIDTH[lab.level] * carried
    return bool(unloaded and abs(unloaded.value - carried) < near and COVERAGE * unloaded.uncertainty < near)


@dataclass(frozen=True, eq=False)
class Rows:
    """What was measured on one set, as records."""

    lab: Lab
    set: str
    p: Parameters
    brackets: Mapping[str, Bracket]
    states: Mapping[str, Sequence[Settled]]

    def rolling(self) -> Iterator[Measurement | Missing]:
        """The end of two-point rolling: omega_01 or omega_03, from both sides."""
        end, leaning = self._asked("rolling"), self._asked("leaning")
        if not end:
            yield self._missing(f"{self._range} ends two-point rolling")
        elif onset.lifts(end):
            yield self._missing("two-point rolling ends by losing the floor, not by slipping: there is no omega_01")
            yield self._bisected("omega_03", end, "from below", "loss of the floor")
            if leaning:
                yield self._bisected("omega_03", leaning, "from above", "return to rolling when pressed")
            else:
                yield self._missing("a lifted ball did not settle, and could not be pressed back to the floor")
        else:
            yield self._missing("two-point rolling ends by slipping before the ball is lifted: there is no omega_03")
            yield self._bisected("omega_01", end, "from below", "onset of slip")
            yield from self._extrapolated("omega_01", "slipping", "lag", "from above", "lag of settled slipping")

    def riding(self) -> Iterator[Measurement | Missing]:
        """The least flow that holds a ball on the wall: omega_02, from both sides."""
        if held := self._asked("riding"):
            yield self._bisected("omega_02", held, "from above", "onset of sliding on the wall")
        else:
            yield self._missing(f"{self._range} is the least to hold a ball on the wall")
        yield from self._extrapolated("omega_02", "sinking", "v_y", "from below", "speed of settled sinking")

    def slipping(self, top: Measured | None) -> Iterator[Measurement | Missing]:
        """The end of slipping on both: a fold, omega_04, or a passage to the wall without a jump at omega_02."""
        states, riding, fold = self.states.get("turning"), self.brackets.get("riding"), self._asked("fold")
        if not states:
            yield self._missing("a ball that slips at both points settles at no flow: there is no omega_04")
        elif top is None:
            by = "floor force of settled slipping"
            yield self._missing("slipping at both points passes to the wall without a jump: there is no omega_04")
            yield from self._extrapolated("omega_02", "turning", "force_Ay", "from below", by)
            yield self._record("folds", 0.0, self._tasks("turning"))
        else:
            by = "maximum of omega_0 along the branch"
            row = self._record("omega_04", top, self._tasks("turning"), side="from below", by=by)
            yield if_sure(row, top.value, f"the {by} is uncertain by {top.uncertainty:.1g} rad/s")
            if fold:
                yield self._bisected("omega_04", fold, "from below", "last settled slipping")
            else:
                yield self._missing("the end of slipping at both points could be extrapolated, but not be bracketed")
            last = fold.low if fold else states[0].start.p.omega_0
            if riding and last > riding.high:
                yield self._record("folds", 1.0, self._tasks("turning"))

    @property
    def _range(self) -> str:
        low, high = onset.GRID[[0, -1]] / time_unit(self.p)
        return f"no flow between omega_0 = {low:.3g} and {high:.3g} rad/s"

    def _asked(self, kind: str) -> Bracket | None:
        """A bracket of which runs show both ends."""
        bracket = self.brackets.get(kind)
        return bracket if bracket and None not in bracket.runs else None

    def _bisected(self, quantity: str, of: Bracket, side: str, by: str) -> Measurement | Missing:
        high = of.runs[1]
        assert high is not None
        # Slip that is still too small to count may have begun below: it is proportional to the distance.
        speed = max(slip(high.slip_speed_A, high), slip(high.slip_speed_B, high))
        unseen = (of.high - of.low) / max(1.0, speed) if quantity in ("omega_01", "omega_02") else 0.0
        place = Measured(of.place.value, math.hypot(of.place.uncertainty, unseen))
        row = self._record(quantity, place, of.tasks, side=side, by=by)
        return if_sure(row, place.value, f"{quantity} by {by} is uncertain by {place.uncertainty:.1g} rad/s")

    def _extrapolated(
        self, quantity: str, kind: str, vanishes: str, side: str, by: str
    ) -> Iterator[Measurement | Missing]:
        place = extrapolated(self.states.get(kind, []), vanishes, vanishing)
        if place and sure_enough(quantity, place, place.value):
            yield self._record(quantity, place, self._tasks(kind), side=side, by=f"{by} → 0")
        elif kind in self.states:
            yield self._missing(f"too few states settled for {quantity} by {by}, or they point to it too vaguely")

    def _tasks(self, kind: str) -> list[Task]:
        return [state.task for state in self.states[kind]]

    def _record(
        self, quantity: str, value: Measured | float, tasks: Sequence[Task], **conditions: Condition
    ) -> Measurement:
        p = self.p.replace(omega_0=value.value) if isinstance(value, Measured) else self.p
        return measurement(self.lab, "thresholds", self.set, p, quantity, value, tasks, **conditions)

    def _missing(self, reason: str) -> Missing:
        return Missing("thresholds", self.set, reason)


def birth(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """The drag at which the slope vanishes, by slopes over 1/c: what a force makes a ball lag by is proportional."""
    ranges = {}
    for name in sets:
        begins, ends = records.threshold(name, "omega_01"), records.threshold(name, "omega_02")
        if begins and ends and begins.value < ends.value:
            ranges[name] = begins.value, ends.value
    slopes = _slopes(lab, sets, ranges, [(name, kappa / time_unit(sets[name])) for name in ranges for kappa in STRONG])
    near = {name: 1 / lag.value for name in ranges if (lag := _vanishing_lag(slopes, name)) and lag.value > 0}
    slopes |= _slopes(lab, sets, ranges, [(name, c * k) for name, c in near.items() for k in BEYOND])
    for name, p in sets.items():
        own = [states for (one, _), (_, states) in slopes.items() if one == name]
        if name not in ranges:
            yield Missing("birth", name, "there is no range of slipping at both points that ends at the wall")
        elif len(own) < len(STRONG) + len(BEYOND) or not (lag := _vanishing_lag(slopes, name)):
            yield Missing("birth", name, "too few states of slipping at both points settle near the end of the branch")
        else:
            drag = Measured(1 / lag.value, lag.uncertainty / lag.value**2)
            tasks, q = [state.task for states in own for state in states], p.replace(c=drag.value)
            row = measurement(lab, "birth", name, q, "critical_drag", drag, tasks)
            why = f"the drag where the fold is born is too vague: {drag.uncertainty:.2g} 1/s"
            yield if_sure(row, drag.value, why)


Slopes = dict[tuple[str, float], tuple[Measured, list[Settled]]]
"""By set and drag: d omega_0 over that of the floor's force, where it vanishes; and the states that show it."""


def _slopes(
    lab: Lab,
    sets: Mapping[str, Parameters],
    ranges: Mapping[str, tuple[float, float]],
    drags: Sequence[tuple[str, float]],
) -> Slopes:
    starts = [
        [begin(name, sets[name].replace(c=c, omega_0=high - part * (high - low)), "rest") for part in NEAR]
        for name, c in drags
        for low, high in [ranges[name]]
    ]
    slopes = Slopes()
    for drag, states in zip(drags, settle_groups(lab, starts), strict=True):
        if not any(state.failure or state.case is not Case.SS for state in states):
            flows = np.array([state.start.p.omega_0 for state in states])
            slopes[drag] = initial_slope(flows, [state.values["force_Ay"] for state in states]), states
    return slopes


def _vanishing_lag(slopes: Slopes, name: str) -> Measured | None:
    """1/c where the line through the slopes of a set vanishes; None where too few were measured."""
    points = [(1 / c, slope) for (one, c), (slope, _) in slopes.items() if one == name]
    if len(points) < len(STRONG):
        return None
    lags, values = [lag for lag, _ in points], [slope.value for _, slope in points]
    zero, _ = straight_line(lags, values, [slope.uncertainty for _, slope in points])
    return zero
