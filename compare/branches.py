"""The two sub-branches of slipping at both points (Prop. 7, Fig. 10): the unstable one divides two attractors.

Between omega_02 and omega_04 a ball ends on the stable branch of SS or, lifted by its spin, in SR and NR. On straight
lines of initial states through the predicted unstable state, the place where the one end gives way to the other is
narrowed down: the unstable state lies on that border, so on every line the place is the state itself.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

import analytic
from analytic import thresholds
from compare.claims import Check, Claim, Lab, Level
from compare.studies import COVERAGE, Bench, main
from compare.table_5 import vanishing
from compare.tasks import Task
from mjsim import ContactSettings
from mjsim.measurement import Measured
from model import Case, Parameters
from model.arrays import Array

REFERENCE = Parameters.named("reference")
LASTS = {Level.QUICK: 10.0, Level.DEFAULT: 16.0, Level.FULL: 20.0}
"""s: in units of 1/c, what a start as near to the border as the last bracket takes to leave it, and a little."""
RTOL = 1e-7
"""Tolerance of the event-driven integrator: only where the ball ends is wanted."""
SECTIONS = 3
"""Starts in every round, by which a bracket shrinks to a quarter."""
ROUNDS = {
    "event": {Level.QUICK: 3, Level.DEFAULT: 8, Level.FULL: 12},
    "mujoco": {Level.DEFAULT: 6, Level.FULL: 8},
}
ENDS = (-0.2, 0.23)
"""First ends of a line, in units of it, so that no start falls upon the unstable state."""
PLACES = {Level.QUICK: (0.3,), Level.DEFAULT: (0.1, 0.3, 0.5, 0.7), Level.FULL: tuple(np.linspace(0.05, 0.9, 12))}
"""omega_0 as a part of the way from omega_02 to omega_04."""


@dataclass(frozen=True)
class Line:
    """Initial states x + s d."""

    p: Parameters
    x: Array
    """The predicted unstable state, shape (8,)."""
    d: Array
    name: str


def lines(p: Parameters) -> list[Line]:
    """Lines through the unstable state: from either attractor, and along omega_c."""
    solutions = analytic.stationary_solutions(p)
    stable, unstable = (s.x for s in solutions if s.case is Case.SS)
    (lifted,) = (s.x for s in solutions if s.case is Case.SR)
    return [
        Line(p, unstable, unstable - stable, "from stable SS"),
        Line(p, unstable, unstable - lifted, "from SR"),
        Line(p, unstable, np.eye(8)[2] * unstable[2], "along ω_c"),
    ]


def borders(lab: Lab, chosen: list[Line], engine: str, rounds: int) -> list[tuple[Measured, Task]]:
    """Where on each line, in units of it, one end gives way to the other; nan where its ends don't differ."""
    low, high = (np.full(len(chosen), end) for end in ENDS)
    ends = _lifts(lab, chosen, np.stack([low, high], axis=-1), engine)[0]
    single = ends[:, 0] != ends[:, 1]
    rows = np.arange(len(chosen))
    tasks: list[Task] = []
    for _ in range(rounds):
        s = np.linspace(low, high, SECTIONS + 2, axis=-1)
        lifts, tasks = _lifts(lab, chosen, s[:, 1:-1], engine)
        lifts = np.column_stack([ends[:, 0], lifts, ends[:, 1]])
        k = np.argmax(lifts[:, 1:] != lifts[:, :-1], axis=-1)
        low, high = s[rows, k], s[rows, k + 1]
    middle, width = np.where(single, (low + high) / 2, np.nan), high - low
    return [
        (Measured(float(value), float(w / math.sqrt(12))), task)
        for value, w, task in zip(middle, width, tasks[::SECTIONS], strict=True)
    ]


def _lifts(lab: Lab, chosen: list[Line], s: Array, engine: str) -> tuple[npt.NDArray[np.bool_], list[Task]]:
    """For every start s, shape (lines, n), whether the ball ends up going round with the fluid, not slipping behind."""
    settings = ContactSettings.at(4e-3) if engine == "mujoco" else analytic.Settings(rtol=RTOL)
    tasks = [
        Task(
            engine=engine, parameters=line.p, x0=tuple((line.x + value * line.d).tolist()), t_end=LASTS[lab.level],
            settings=settings, sample_interval=0.1,
        )
        for line, row in zip(chosen, s, strict=True)
        for value in row
    ]  # fmt: skip
    last = np.reshape([run.omega_c[-1] for run in lab.run(tasks)], s.shape)
    return last > np.array([line.x[2] for line in chosen])[:, None], tasks


def _flow(part: float) -> Parameters:
    t = thresholds(REFERENCE)
    return REFERENCE.replace(omega_0=t.omega_02 + part * (t.omega_04 - t.omega_02))


def found(lab: Lab) -> list[tuple[Line, Measured, Task]]:
    """The borders on all lines, with every witness of the level."""
    chosen = [line for part in PLACES[lab.level] for line in lines(_flow(part))]
    return [
        (line, border, task)
        for engine, rounds in ROUNDS.items()
        if lab.level in rounds
        for line, (border, task) in zip(chosen, borders(lab, chosen, engine, rounds[lab.level]), strict=True)
    ]


def _sub_branches(lab: Lab) -> list[Check]:
    bench = Bench(lab, "reference")
    return [bench.number(task, "border", "of the line", line.name, 0.0, border) for line, border, task in found(lab)]


def _nonsmooth_fold(lab: Lab) -> list[Check]:
    """Distance in slip_x of the unstable state from SR, near omega_02, extrapolated to zero."""
    t = thresholds(REFERENCE)
    count = 3 if lab.level is Level.QUICK else 5
    omegas = np.array([t.omega_02 + (t.omega_04 - t.omega_02) * 0.04 * 2.0**k for k in range(count)])
    chosen = [lines(REFERENCE.replace(omega_0=float(omega_0)))[1] for omega_0 in omegas]
    measured = borders(lab, chosen, "event", ROUNDS["event"][lab.level])
    apart = [
        Measured(line.d[3] * (1 + border.value), abs(line.d[3]) * border.uncertainty)
        for line, (border, _) in zip(chosen, measured, strict=True)
    ]
    where = "distance in ω̃_x from SR → 0"
    return [
        Bench(lab, "reference").number(
            measured[0][1], "ω₀₂", "rad/s", where, t.omega_02, vanishing(omegas, apart)
        )
    ]  # fmt: skip


CLAIMS = (
    Claim(
        id="sub-branches", source="Prop. 7, (87)-(90), Fig. 10",
        statement="Between ω₀₂ and ω₀₄ an unstable state of slipping at both points divides two attractors.",
        prediction="the root of (41) beyond the fold",
        measurement=(
            "initial states on straight lines through the predicted state, sorted by where the ball ends; the border "
            "is narrowed down round by round"
        ),
        tolerance=f"{COVERAGE:g} standard uncertainties: the last bracket of the border, as a uniform distribution",
        study=_sub_branches,
    ),
    Claim(
        id="table-5-NF2", source="Table 5, NF2",
        statement="At ω₀₂ the unstable state of slipping at both points merges with the state carried by the wall.",
        prediction="closed-form threshold",
        measurement="distance in ω̃_x of the two states, from borders between the attractors, extrapolated to zero",
        tolerance=(
            f"{COVERAGE:g} standard uncertainties: what leaving out the farthest point changes, and the last brackets"
        ),
        study=_nonsmooth_fold,
    ),
)  # fmt: skip

if __name__ == "__main__":
    sys.exit(main(CLAIMS))
