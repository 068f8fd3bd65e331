"""The thresholds of the bifurcation diagram, each measured in two ways that have nothing in common but the engine.

* Bisected, by the engine's own contacts: the largest flow at which a rolling ball stays without slip, or on the floor;
  the least at which the wall holds a ball that rides it; the flow up to which a lifted ball, pressed lightly on the
  floor, goes back to rolling on both; the largest flow at which a slipping ball settles.
* Extrapolated from settled states on one side: the flow at which their lag behind the fluid, their sinking or the force
  of the floor would vanish, or at which omega_0 along the branch has its maximum. It is a smooth function of the lag,
  whatever the law of drag; of the slip it needn't be.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from compare.measure import onset
from compare.measure.brackets import Bracket
from compare.measure.extrapolation import POINTS, turning, vanishing
from compare.measure.lab import Lab, time_unit
from compare.measure.questions import slip
from compare.measure.record import Condition, Measurement, Missing, Records, measurement, sure_enough
from compare.measure.settling import Settled
from compare.runs.tasks import Task
from compare.statistics import COVERAGE, Measured
from model import Parameters
from model.arrays import Array

PROTOCOL = "thresholds"


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Bracket every change on the grid, settle states beside it, then bisect and extrapolate."""
    maps = onset.look(lab, sets)
    brackets = onset.ends_of_rolling(lab, sets, maps)
    brackets |= onset.neighbourhoods(lab, sets, maps, brackets)
    states = onset.settled_beside(lab, sets, brackets)
    carried = {key: b for key, b in brackets.items() if key[1] != "riding"} | onset.refined(lab, sets, brackets, states)
    tops = {name: extrapolated(states.get((name, "turning"), []), "slip_x", turning) for name in sets}
    ends = {name: top for name in sets if (top := tops[name]) and not _reaches_wall(lab, name, carried, states)}
    folds = onset.folded(lab, sets, ends, states)
    for name, p in sets.items():
        own = {kind: bracket for (one, kind), bracket in carried.items() if one == name}
        rows = Rows(lab, name, p, own, {kind: s for (one, kind), s in states.items() if one == name})
        yield from rows.rolling()
        yield from rows.riding()
        yield from rows.slipping(ends.get(name), folds.get(name))


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


def _reaches_wall(lab: Lab, name: str, brackets: onset.Brackets, states: onset.States) -> bool:
    """Whether the floor's force on a slipping ball falls to zero just where the wall begins to carry it."""
    unloaded = extrapolated(states.get((name, "turning"), []), "force_Ay", vanishing)
    riding = brackets.get((name, "riding"))
    if unloaded is None or riding is None:
        return False
    near = onset.FOLD_WIDTH[lab.level] * riding.high
    return abs(unloaded.value - riding.high) < near and COVERAGE * unloaded.uncertainty < near


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
        end = self.brackets.get("rolling")
        if end is None or None in end.runs:
            yield self._missing(f"{self._range} ends two-point rolling")
        elif onset.lifts(end):
            yield self._missing("two-point rolling ends by losing the floor, not by slipping: there is no omega_01")
            yield self._bisected("omega_03", end, "from below", "loss of the floor")
            leaning = self.brackets.get("leaning")
            if leaning is None or None in leaning.runs:
                yield self._missing("a lifted ball did not settle, and could not be pressed back to the floor")
            else:
                yield self._bisected("omega_03", leaning, "from above", "return to rolling when pressed")
        else:
            yield self._missing("two-point rolling ends by slipping before the ball is lifted: there is no omega_03")
            yield self._bisected("omega_01", end, "from below", "onset of slip")
            yield from self._extrapolated("omega_01", "slipping", "lag", "from above", "lag of settled slipping")

    def riding(self) -> Iterator[Measurement | Missing]:
        """The least flow that holds a ball on the wall: omega_02, from both sides."""
        held = self.brackets.get("riding")
        if held is None or None in held.runs:
            yield self._missing(f"{self._range} is the least to hold a ball on the wall")
        else:
            yield self._bisected("omega_02", held, "from above", "onset of sliding on the wall")
        yield from self._extrapolated("omega_02", "sinking", "v_y", "from below", "speed of settled sinking")

    def slipping(self, top: Measured | None, fold: Bracket | None) -> Iterator[Measurement | Missing]:
        """The end of slipping on both: a fold, omega_04, or a passage to the wall without a jump at omega_02."""
        states = self.states.get("turning", [])
        riding = self.brackets.get("riding")
        if not states:
            yield self._missing("a ball that slips at both points settles at no flow: there is no omega_04")
        elif top is None:
            by = "floor force of settled slipping"
            yield self._missing("slipping at both points passes to the wall without a jump: there is no omega_04")
            yield from self._extrapolated("omega_02", "turning", "force_Ay", "from below", by)
            yield self._record("folds", 0.0, self._tasks("turning"))
        else:
            by = "maximum of omega_0 along the branch"
            if sure_enough("omega_04", top, top.value):
                yield self._record("omega_04", top, self._tasks("turning"), side="from below", by=by)
            else:
                yield self._missing(f"the {by} is uncertain by {top.uncertainty:.1g} rad/s")
            last = states[0].start.p.omega_0
            if fold is None or None in fold.runs:
                yield self._missing("the end of slipping at both points could be extrapolated, but not be bracketed")
            else:
                yield self._bisected("omega_04", fold, "from below", "last settled slipping")
                last = fold.low
            if riding is not None and last > riding.high:
                yield self._record("folds", 1.0, self._tasks("turning"))

    @property
    def _range(self) -> str:
        low, high = onset.GRID[[0, -1]] / time_unit(self.p)
        return f"no flow between omega_0 = {low:.3g} and {high:.3g} rad/s"

    def _bisected(self, quantity: str, of: Bracket, side: str, by: str) -> Measurement | Missing:
        high = of.runs[1]
        assert high is not None
        # Slip that is still too small to count may have begun below: it is proportional to the distance.
        speed = max(slip(high.slip_speed_A, high), slip(high.slip_speed_B, high))
        unseen = (of.high - of.low) / max(1.0, speed) if quantity in ("omega_01", "omega_02") else 0.0
        place = Measured(of.place.value, math.hypot(of.place.uncertainty, unseen))
        if not sure_enough(quantity, place, place.value):
            return self._missing(f"{quantity} by {by} is uncertain by {place.uncertainty:.1g} rad/s")
        return self._record(quantity, place, of.tasks, side=side, by=by)

    def _extrapolated(
        self, quantity: str, kind: str, vanishes: str, side: str, by: str
    ) -> Iterator[Measurement | Missing]:
        place = extrapolated(self.states.get(kind, []), vanishes, vanishing)
        if place is not None and sure_enough(quantity, place, place.value):
            yield self._record(quantity, place, self._tasks(kind), side=side, by=f"{by} → 0")
        elif kind in self.states:
            yield self._missing(f"too few states settled for {quantity} by {by}, or they point to it too vaguely")

    def _tasks(self, kind: str) -> list[Task]:
        return [state.task for state in self.states[kind]]

    def _record(
        self, quantity: str, value: Measured | float, tasks: Sequence[Task], **conditions: Condition
    ) -> Measurement:
        p = self.p.replace(omega_0=value.value) if isinstance(value, Measured) else self.p
        return measurement(self.lab, PROTOCOL, self.set, p, quantity, value, tasks, **conditions)

    def _missing(self, reason: str) -> Missing:
        return Missing(PROTOCOL, self.set, reason)
