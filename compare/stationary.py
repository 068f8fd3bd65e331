"""Stationary states (Propositions 1, 3, 4, 5 and Fig. 13): where the ball ends, held against where it should.

Every state is approached twice: from 2 % off in omega_c, and from rest against the wall. What the run has settled to
is averaged over its last part; the prediction is the attracting stationary solution of the paper nearest to it.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

import analytic
from analytic import StationarySolution
from compare.claims import Check, Claim, Lab, Level
from compare.studies import COVERAGE, Bench, family, last_part, main, settled_case, settled_mean
from compare.tasks import Task
from mjsim import ContactSettings
from mjsim.measurement import Measured
from model import Case, Contact, Parameters, Trajectory
from model.arrays import Array
from model.kinematics import VARIABLES

OFFSET = 1.02
"""Start of the first run, in units of the predicted omega_c."""
TIME_CONSTANTS = 25.0
"""How long to run, in units of the slowest time constant of the predicted state: 2 % times exp(-25) = 3e-13."""
SPIN_UP = 4.0
"""How much longer from rest, in units of 1/c: spinning up takes that to come as near as the other start is."""
HEIGHT = 1.0
"""Height y, in units of R, at which a ball is started that only the wall carries: it bobs before it comes to rest."""
QUANTITIES = {"omega_c": "ω_c", "slip_x": "ω̃_x", "slip_y": "ω̃_y", "slip_z": "ω̃_z"}

Omegas = dict[Level, Sequence[float]]
REFERENCE: Omegas = {Level.QUICK: (4, 8, 12, 13, 14.5, 17, 20, 25, 30), Level.DEFAULT: range(2, 32)}
ROUGH: Omegas = {Level.QUICK: (8, 14, 17, 21, 24, 27, 31, 35), Level.DEFAULT: range(2, 41)}


@dataclass(frozen=True)
class Point:
    """A stationary state to be approached from a start."""

    name: str
    """Parameter set."""
    p: Parameters
    target: StationarySolution
    start: str
    x0: Array
    settles: float
    """Time it takes, s."""


def attractors(p: Parameters) -> list[StationarySolution]:
    """The stationary solutions that a disturbed ball returns to; the one that only sinks (NS) is none."""
    return [
        solution
        for solution in analytic.stationary_solutions(p)
        if solution.exists and solution.stable and solution.slip_stable and not solution.moves
    ]


def points(name: str, omegas: Sequence[float], cases: Sequence[Case]) -> list[Point]:
    """Both starts towards every attractor of the given cases."""
    found = []
    for omega_0 in omegas:
        p = Parameters.named(name).replace(omega_0=float(omega_0))
        targets = attractors(p)
        for target in targets:
            if target.case not in cases or (target.case is Case.SR and any(t.case is Case.NR for t in targets)):
                continue  # at y = 0 the states of SR and NR are one
            near = target.x.copy()
            near[2] *= OFFSET
            near[0] = HEIGHT * p.R if target.case is Case.NR else 0.0
            settles = TIME_CONSTANTS * slowest(target)
            found.append(Point(name, p, target, "2 % off", near, settles))
            if len({family(t.case) for t in targets}) == 1:  # from rest, only where there is one place to go
                found.append(Point(name, p, target, "from rest", np.zeros(8), settles + SPIN_UP / p.c))
    return found


def check(bench: Bench, point: Point, task: Task, run: Trajectory) -> list[Check]:
    """Hold omega_c and the slip of a settled run against the prediction."""
    target, found = point.target, settled_case(run)
    cases = (found if family(found) is family(target.case) else target.case), found
    checks = []
    for (name, symbol), systematic in zip(QUANTITIES.items(), _systematic(task, run, target), strict=True):
        mean = settled_mean(run, getattr(run, name))
        measured = Measured(mean.value, math.hypot(mean.uncertainty, systematic))
        predicted = float(target.x[VARIABLES.index(name)])
        checks.append(bench.number(task, symbol, "rad/s", point.start, predicted, measured, cases))
    return checks


def _study(name: str, omegas: Omegas, cases: Sequence[Case], lab: Lab) -> list[Check]:
    chosen = points(name, omegas[min(lab.level, Level.DEFAULT)], cases)
    t_end = math.ceil(max(point.settles for point in chosen))  # one for all: they share a batch
    tasks = [
        Task(engine="mujoco", parameters=point.p, x0=tuple(point.x0.tolist()), t_end=t_end, settings=ContactSettings())
        for point in chosen
    ]
    return [
        number
        for point, task, run in zip(chosen, tasks, lab.run(tasks), strict=True)
        for number in check(Bench(lab, point.name), point, task, run)
    ]


def slowest(target: StationarySolution) -> float:
    """Slowest time constant of a state's own dynamics, s; neutral directions have none."""
    rates = -target.eigenvalues.real
    return float(1 / rates[rates > 1e-9 * np.abs(target.eigenvalues).max()].min())


def _systematic(task: Task, run: Trajectory, target: StationarySolution) -> tuple[float, float, float, float]:
    """What creep and round-off do to omega_c and the three slip components, standard uncertainties in rad s-1.

    A rolling contact of a regularised engine slips at its creep speed under the friction it carries: a slip of
    creep / r. Its power is taken from the drag, m c R^2 omega_c d(omega_c); and where friction at the wall alone holds
    the ball up, it sinks at that speed, and the drag then carries c creep of its weight.
    Round-off adds an error of eps of the ball's spin at each step, which dies out with the slowest time constant.
    """
    p, settings, last = task.parameters, task.contact_settings, last_part(run)
    rolls_A, rolls_B = (contact is Contact.R for contact in (target.case.A, target.case.B))
    friction_A = rolls_A * float(np.hypot(*run.force_A[last][:, [0, 2]].T).max())
    friction_B = rolls_B * float(np.hypot(*run.force_B[last][:, [1, 2]].T).max())
    v_A, v_B = (float(settings.creep_speed(friction / p.m)) for friction in (friction_A, friction_B))
    omega_c = abs(float(target.x[2]))
    steps = slowest(target) / settings.timestep
    round_off = np.finfo(float).eps * omega_c * (1 + p.R / p.r) * math.sqrt(steps / 2)
    lost = (friction_A * v_A + friction_B * v_B) / (p.m * p.c * p.R**2 * omega_c)
    carried = p.c * v_B / (p.j * p.r * omega_c) if target.case is Case.NR else 0.0
    by_creep = (lost, v_A / p.r + carried, v_B / p.r, (v_A + v_B) / p.r)
    return tuple(math.hypot(creep, round_off) for creep in by_creep)  # type: ignore[return-value]


def _claim(id: str, source: str, statement: str, name: str, omegas: Omegas, cases: Sequence[Case]) -> Claim:
    return Claim(
        id=id, source=source, statement=statement,
        prediction="closed-form stationary solution, checked for admissible forces and stability",
        measurement=(
            "MuJoCo runs from 2 % off in ω_c and, where there is one attractor, from rest against the wall; mean over "
            "the last tenth of a run of 25 time constants"
        ),
        tolerance=(
            f"{COVERAGE:g} standard uncertainties: scatter and drift of the window, and the creep of rolling contacts "
            "that the theory of the contact settings gives for the friction they carry"
        ),
        study=lambda lab: _study(name, omegas, cases, lab),
    )  # fmt: skip


CLAIMS = (
    _claim(
        "prop-1", "Prop. 1, (32)",
        "Rolling at both points, the ball goes round exactly with the fluid: ω_c = ω₀, no slip.",
        "reference", REFERENCE, [Case.RR],
    ),
    _claim(
        "prop-4", "Prop. 4, (37)-(41)",
        "Above ω₀₁ the ball slips at both points and lags behind the fluid, by (38)-(41).",
        "reference", REFERENCE, [Case.SS],
    ),
    _claim(
        "prop-1-rough", "Prop. 1, (86)", "With η > j the ball rolls at both points up to ω₀₃ = √(g/jR).",
        "high-wall-friction", ROUGH, [Case.RR],
    ),
    _claim(
        "prop-3-5", "Props. 3 and 5, (35), (46)",
        "Carried by the wall alone the ball keeps ω_c = ω₀ and spins on it, ω̃_x = g/(jω₀r) - ω₀R/r, at any height.",
        "high-wall-friction", ROUGH, [Case.SR, Case.NR],
    ),
)  # fmt: skip

if __name__ == "__main__":
    sys.exit(main(CLAIMS))
