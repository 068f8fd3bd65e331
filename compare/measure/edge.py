"""The unstable state between two attractors, by following the edge of their basins.

Where at one flow a ball slips on the floor (SS) or goes round with the fluid (SR, which is NR at y = 0), the straight
line between the two measured states crosses the border between the two basins. Two runs close to it on either side stay
together for a while near the unstable state, which a ball on the border would reach. The mean of their states while
they are together begins the next line, across the same border.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compare.measure.brackets import Bracket, Care, Search, narrow
from compare.measure.fits import vanishing
from compare.measure.lab import Lab, coarse_step
from compare.measure.levels import Level
from compare.measure.questions import lasting
from compare.measure.record import Measurement, Missing, Records, if_sure, measurement, sure_enough
from compare.measure.settling import begin, family, rotation_scale, settle_groups, taper
from compare.runs.tasks import Task
from compare.statistics import Measured, tail
from model import Case, Parameters, State, Trajectory
from model.arrays import Array
from model.drag import QUADRATIC
from model.kinematics import SLIP_XYZ

PROTOCOL = "edge"
CLOSING = (0.1, 0.17, 0.26, 0.38)
"""Flows, as parts of the way from omega_02 to omega_04, from which the edge is followed to where it begins."""
PARTS = {Level.QUICK: (0.3,), Level.DEFAULT: (*CLOSING, 0.6), Level.FULL: (*CLOSING, 0.45, 0.6, 0.8)}
"""The flows at each set; at the quick level that with most drag, which settles soonest, has `CLOSING`."""
TIME = {Level.QUICK: 20.0, Level.DEFAULT: 60.0, Level.FULL: 60.0}
"""How long a ball has to leave the edge, in units of 1/c."""
ROUGHLY = 10.0
"""How much more than values that are held against theory themselves the two states may drift."""
FIRST, NEXT = 3e-4, 2.5e-6
"""Widths of the last brackets on the first line and on the others, in parts of the distance of the attractors."""
REACH = 5e-3
"""Half the length of a later line, in those parts."""
TOGETHER = 2e-3
"""The distance up to which two runs count as being together, in those parts."""
UNDAMPED = "on the border the ball swings on: quadratic drag of a slight lag damps next to nothing"
CYCLES = {Level.QUICK: 3, Level.DEFAULT: 4, Level.FULL: 6}
"""Lines for each edge."""


@dataclass(frozen=True, eq=False)
class Edge:
    """A line across the border, and where it crosses it."""

    set: str
    p: Parameters
    slipping: Array
    """The settled states on either side, (8,)."""
    lifted: Array
    centre: Array
    line: Array
    """Direction and unit of the line."""
    reach: tuple[float, float]
    """The part of the line that is searched, from its centre, in units of the distance of the states."""
    bracket: Bracket | None = None
    moved: Array | None = None
    """How far the crossing is from that of the line before; None for the first line, and after one without crossing."""
    before: Array | None = None
    """The same one line earlier."""
    stretched: int = 0
    """How many lines were too short since the last crossing."""

    @property
    def crossing(self) -> Array:
        """The state in the middle of the last bracket, (8,)."""
        assert self.bracket is not None
        return np.asarray(self.centre + self.bracket.place.value * self.line)

    @property
    def tasks(self) -> tuple[Task, ...]:
        """The runs that the crossing follows from."""
        return self.bracket.tasks if self.bracket else ()


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """Between the measured omega_02 and omega_04, cross the border again and again.

    Not under the quadratic law: near SR the ball lags so little that this hardly damps its swing along the border.
    """
    yield from (Missing(PROTOCOL, name, UNDAMPED) for name, p in sets.items() if p.drag == QUADRATIC)
    sets = {name: p for name, p in sets.items() if p.drag != QUADRATIC}
    limits = {name: [records.threshold(name, omega) for omega in ("omega_02", "omega_04")] for name in sets}
    folds = {name: (low.value, high.value) for name, (low, high) in limits.items() if low and high}
    for name in sets:
        if name not in folds:
            yield Missing(PROTOCOL, name, "at no flow are a slipping ball and a lifted one both settled")
    parts = dict.fromkeys(folds, PARTS[lab.level])
    if folds and lab.level is Level.QUICK:
        parts[max(folds, key=lambda name: sets[name].c)] = CLOSING
    flows = [
        (name, sets[name].replace(omega_0=low + part * (high - low)))
        for name, (low, high) in folds.items()
        for part in parts[name]
    ]
    begun = list(_lines(lab, flows))
    yield from (each for each in begun if isinstance(each, Missing))
    followed = _followed(lab, [each for each in begun if isinstance(each, Edge)])
    for edge in followed:
        yield from _rows(lab, edge)
    for name, (low, high) in folds.items():
        last = low + (max(CLOSING) + 1e-6) * (high - low)
        yield from _closing(lab, name, [edge for edge in followed if edge.set == name and edge.p.omega_0 < last])


def _lines(lab: Lab, flows: Sequence[tuple[str, Parameters]]) -> Iterator[Edge | Missing]:
    """The first lines, between the settled states at each flow."""
    starts = [[begin(name, q, "rest"), begin(name, q, "on the wall")] for name, q in flows]
    for (name, q), (slipping, lifted) in zip(flows, settle_groups(lab, starts, loose=ROUGHLY), strict=True):
        if slipping.failure or lifted.failure or (slipping.case, family(lifted.case)) != (Case.SS, Case.NR):
            fates = ", ".join(state.failure or state.case.name for state in (slipping, lifted))
            yield Missing(PROTOCOL, name, f"no two attractors settled at omega_0 = {q.omega_0:.4g} rad/s: {fates}")
        else:
            low, high = (_grounded(state.mean) for state in (slipping, lifted))
            yield Edge(name, q, low, high, low, high - low, (0.0, 1.0))


def _grounded(x: Array) -> Array:
    """The state on the floor: a lifted ball knows nothing of its height."""
    return State.of(x)._replace(y=0.0, v_y=0.0, h=0.0, v_h=0.0).stacked()


def _followed(lab: Lab, edges: Sequence[Edge]) -> list[Edge]:
    """Cross the border on one line after the other; where all runs end alike the next is longer."""
    current = list(edges)
    for cycle in range(CYCLES[lab.level]):
        lines = [edge if cycle == 0 else _onward(edge) for edge in current]
        searches = [_search(lab, line, FIRST if cycle == 0 else NEXT) for line in lines]
        for k, bracket in enumerate(narrow(lab, searches, careful=False)):
            if None in bracket.runs:
                current[k] = replace(current[k], moved=None, stretched=current[k].stretched + 1)
            else:
                crossed = replace(lines[k], bracket=bracket, stretched=0)
                moved = np.abs(crossed.crossing - current[k].crossing) if current[k].bracket else None
                current[k] = replace(crossed, moved=moved, before=current[k].moved)
    return [edge for edge in current if edge.bracket and edge.moved is not None]


def _search(lab: Lab, edge: Edge, width: float) -> Search:
    t_end, step = lasting(edge.p, TIME[lab.level]), coarse_step(edge.p)

    def task(s: float, bracket: Bracket, care: Care) -> Task:
        return lab.task(edge.p, edge.centre + s * edge.line, t_end, step, samples=round(t_end / (8 * step)))

    def falls_behind(run: Trajectory) -> bool:
        return ends_slipping(run, edge)

    return Search(Bracket(*edge.reach), task, falls_behind, width)


def ends_slipping(run: Trajectory, edge: Edge) -> bool:
    """Whether a ball ends up slipping: by which way it still goes, or where it has come to rest."""
    last = run.omega_c[tail(run, 0.2)]
    first, second = np.array_split(last, 2)
    gap = float(State.of(edge.lifted).omega_c - State.of(edge.slipping).omega_c)
    going = float(second.mean() - first.mean())
    if abs(going) > 1e-5 * gap:
        return going < 0
    return float(second.mean() - State.of(edge.slipping).omega_c) < gap / 2


def _onward(edge: Edge) -> Edge:
    """A line through the mean of the time in which the last two runs have stayed together, the way they part."""
    if edge.bracket is None:
        return edge
    low, high = (run.x for run in edge.bracket.runs if run is not None)
    along = np.abs((high - low) @ edge.line / float(edge.line @ edge.line))
    together = int(np.argmax(along > TOGETHER)) or len(along)
    length = max(together - together // 4, 1)
    weights = taper(length)
    mean = weights @ (low + high)[together - length : together] / (2 * weights.sum())
    parting = _grounded((high - low)[together - 1])
    line = parting * float(edge.line @ edge.line) / float(parting @ edge.line)
    reach = REACH * 4.0**edge.stretched
    return replace(edge, centre=_grounded(mean), line=line, reach=(-reach, reach))


def _rows(lab: Lab, edge: Edge) -> Iterator[Measurement | Missing]:
    """omega_c, the slips and the spin on the wall, as far as they are sure enough; the uncertainties are alike."""
    x, sure, roll = State.of(edge.crossing), State.of(_sure(edge)), edge.p.R / edge.p.r
    slips = max(sure.slip_x, sure.slip_y, sure.slip_z, roll * sure.omega_c)
    values = {
        "omega_c": Measured(x.omega_c, slips / roll),
        **{name: Measured(getattr(x, name), slips) for name in ("slip_x", "slip_y", "slip_z")},
        "wall_spin": Measured(x.slip_x + roll * x.omega_c, slips),
    }
    for name, value in values.items():
        row = measurement(lab, PROTOCOL, edge.set, edge.p, f"edge_{name}", value, edge.tasks, case="SS")
        why = (
            f"{name} on the edge at omega_0 = {edge.p.omega_0:.4g} rad/s is uncertain by {value.uncertainty:.1g} rad/s"
        )
        yield if_sure(row, rotation_scale(edge.p) * (1.0 if name == "omega_c" else roll), why)


def _sure(edge: Edge) -> Array:
    """Standard uncertainty of the crossing, (8,): of the last bracket, and of all moves to come.

    They are taken to shrink as the last two did: together they are at least the last one, and at most ten of its size;
    and no less than what a next line, through the mean of the last two runs, would pass by the crossing at.
    """
    assert edge.bracket is not None
    assert edge.moved is not None
    sizes = (0.0 if moved is None else float(np.linalg.norm(moved[SLIP_XYZ])) for moved in (edge.moved, edge.before))
    last, before = sizes
    ratio = min(last / before, 0.9) if before else 0.0
    onward, roll = _onward(edge), edge.p.R / edge.p.r
    alike = np.array([1.0, 1.0, roll, 1.0, 1.0, 1.0, 1.0, 1.0])
    off, along = (onward.centre - edge.crossing) * alike, onward.line * alike
    ahead = np.abs(off - (off @ along) / (along @ along) * along) / alike
    moves = np.maximum(edge.moved / (1 - ratio), ahead)
    return np.asarray(np.hypot(edge.bracket.place.uncertainty * edge.line, moves))


def _closing(lab: Lab, name: str, edges: Sequence[Edge]) -> Iterator[Measurement]:
    """Where the edge would meet the lifted ball: the distance in omega_c, extrapolated to zero."""
    if len(edges) < len(CLOSING):
        return
    omegas = np.array([edge.p.omega_0 for edge in edges])
    noise = max(float(_sure(edge)[2]) for edge in edges)
    apart = [Measured(float(State.of(edge.crossing).omega_c - State.of(edge.lifted).omega_c), noise) for edge in edges]
    place = vanishing(omegas, apart)
    if math.isfinite(place.uncertainty) and sure_enough("omega_02", place, place.value):
        tasks, by = [task for edge in edges for task in edge.tasks], "unstable slipping meets the lifted ball"
        q = edges[0].p.replace(omega_0=place.value)
        yield measurement(lab, PROTOCOL, name, q, "omega_02", place, tasks, side="from above", by=by)
