"""Fig. 13: the hysteresis loop of the flowmeter (eta < j), and what happens at unloading (eta > j).

omega_0 is raised and lowered in steps, each held until the ball has settled: a ramp would overshoot the fold, where
settling slows down without bound. The levels lie close to the thresholds, on either side.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np

import analytic
from analytic import thresholds
from compare.claims import Check, Claim, Lab, Level
from compare.stationary import attractors
from compare.studies import COVERAGE, Bench, family, main
from compare.tasks import Task
from mjsim import ContactSettings
from mjsim.measurement import Measured, window_mean
from model import Case, Contact, Flow, Parameters, Trajectory
from model.arrays import Array

REFERENCE, ROUGH = Parameters.named("reference"), Parameters.named("high-wall-friction")
HOLD = {Level.QUICK: 16.0, Level.DEFAULT: 30.0, Level.FULL: 60.0}
"""How long each level is held, s."""
CLOSE = {Level.QUICK: 0.02, Level.DEFAULT: 0.01, Level.FULL: 0.005}
"""Relative distance of the levels nearest to the thresholds where the ball jumps."""
SAMPLES = 100
"""Samples a level."""
WINDOW = 0.2
"""Last part of a level that is averaged."""
STEP = 4e-3
"""MuJoCo's time step, s: stationary states don't depend on it."""
UNLOADING = (1.1, 1.02, 0.97)
"""Levels of the unloading, in units of omega_02, where the ball rides the wall."""
RIDES = 1.0
"""Height at which it rides, in units of R."""


def levels(p: Parameters, close: float) -> Array:
    """omega_0 up beyond omega_04 and down again below omega_02, rad/s."""
    t = thresholds(p)
    middle = math.sqrt(t.omega_02 * t.omega_04)
    up = [0.9 * t.omega_01, 1.2 * t.omega_01, t.omega_02 * (1 + close), middle, t.omega_04 * (1 - close)]
    top = [t.omega_04 * (1 + close), 1.1 * t.omega_04]
    down = [t.omega_04 * (1 - close), middle, t.omega_02 * (1 + close), t.omega_02 * (1 - close), 1.2 * t.omega_01]
    return np.array([*up, *top, *down, 0.9 * t.omega_01])


def followed(p: Parameters, omegas: Sequence[float]) -> list[tuple[Case, float]]:
    """Case and omega_c that the ball is predicted to settle to at every level, coming from the one before.

    It stays on its branch as long as that attracts (RR and SS count as one, since they join at omega_01), else goes to
    the other.
    """
    path: list[tuple[Case, float]] = []
    lifted = False
    for omega_0 in omegas:
        states = {family(s.case): float(s.x[2]) for s in attractors(p.replace(omega_0=float(omega_0)))}
        here = {case for case in states if (case is Case.NR) == lifted}
        lifted = lifted if here else not lifted
        (case,) = here or set(states)
        path.append((case, states[case]))
    return path


def _loop(lab: Lab) -> list[Check]:
    """Every level of the loop, with every witness."""
    p, hold, found = REFERENCE, HOLD[lab.level], []
    omegas = levels(p, CLOSE[lab.level])
    path = followed(p, omegas.tolist())
    tasks = [
        Task(
            engine=engine, parameters=p, x0=(0, 0, float(omegas[0]), 0, 0, 0), t_end=hold * len(omegas),
            flow=Flow.staircase(omegas.tolist(), hold), settings=settings, sample_interval=hold / SAMPLES,
        )
        for engine, settings in (("event", None), ("mujoco", ContactSettings.for_problem(p, STEP, p.R * omegas.max())))
    ]  # fmt: skip
    for task, run in zip(tasks, lab.run(tasks), strict=True):
        for k, (omega_0, (case, omega_c)) in enumerate(zip(omegas, path, strict=True)):
            window = slice(int((k + 1 - WINDOW) * SAMPLES), (k + 1) * SAMPLES)
            mean = window_mean(run.time[window], run.omega_c[window])
            ended = family(Case(int(np.bincount(run.case[window]).argmax())))
            where = f"level {k + 1}, {'up' if k <= np.argmax(omegas) else 'down'}"
            rounding = 1e-9 * abs(omega_c)  # of the integrator, and of the servo's margins
            number = Bench(lab, "reference").number(
                task,
                "ω_c",
                "rad/s",
                where,
                omega_c,
                Measured(mean.value, math.hypot(mean.uncertainty, rounding)),
                (case, ended),
            )
            found.append(_at(number, float(omega_0)))
    return found


def _at(number: Check, omega_0: float) -> Check:
    """The check at the level's omega_0."""
    return replace(number, omega_0=omega_0)


def _unloading(lab: Lab) -> list[Check]:
    """The ball rides the wall while omega_0 falls below omega_02: it slips, sinks, hits the floor, and rolls on."""
    p, found = ROUGH, []
    omegas = thresholds(p).omega_02 * np.array(UNLOADING)
    hold = HOLD[lab.level]
    (state,) = (s for s in analytic.stationary_solutions(p.replace(omega_0=float(omegas[0]))) if s.case is Case.NR)
    x0 = (RIDES * p.R, *state.x[1:].tolist())
    tasks = [
        Task(
            engine=engine, parameters=p, x0=x0, t_end=hold * len(omegas),
            flow=Flow.staircase(omegas.tolist(), hold), settings=settings, sample_interval=4e-3,
        )
        for engine, settings in (("event", None), ("mujoco", ContactSettings.at(2e-3)))
    ]  # fmt: skip
    for task, run in zip(tasks, lab.run(tasks), strict=True):
        bench = Bench(lab, "high-wall-friction")
        for what, holds in sequence(run, hold * (len(omegas) - 1)).items():
            found.append(replace(bench.count(task, what, "0 or 1", 1, int(holds)), omega_0=float(omegas[-1])))
    return found


def sequence(run: Trajectory, drop: float) -> dict[str, bool]:
    """What the paper says of the unloading, whether it happened: the last fall of omega_0 is at the time `drop`."""
    before, after = run.time < drop, run.time >= drop
    cases = [case for case, _ in groupby(run.cases)]
    first = run.time[after & (run.case == Case.NS)]
    changes = [(float(t), Case(case)) for t, case in zip(run.events.time, run.events.to_case, strict=True) if t >= drop]
    lands = next((t for t, case in changes if case.A is not Contact.N), math.inf)
    # Hops may be too short for the one to be sampled, for the other to count as a case.
    gaps = np.maximum(run.y, run.h)[run.time > lands]
    hops = bool(np.any(gaps > 1e-5 * run.header.parameters.R))
    return {
        "NR kept above ω₀₂": bool(np.all(run.case[before][1:] == Case.NR)),
        "then NS": len(first) > 0 and float(first[0]) < lands,
        "then the floor is hit": math.isfinite(lands) and bool(np.min(run.v_y[after]) < 0),
        "then a contact opens again": hops or any(t >= lands and Contact.N in (c.A, c.B) for t, c in changes),
        "RR in the end": cases[-1] is Case.RR,
    }


CLAIMS = (
    Claim(
        id="fig-13-left", source="Fig. 13, left",
        statement="For η < j the ball jumps up to ω₀ above ω₀₄, down below ω₀₂, and keeps to its branch in between.",
        prediction="the attracting stationary solution of the branch that the ball is on, as long as there is one",
        measurement="ω₀ raised and lowered in held steps in one run; the last fifth of every step averaged",
        tolerance=f"{COVERAGE:g} standard uncertainties: scatter and drift of the window, and 1e-9 of the integrators",
        study=_loop,
    ),
    Claim(
        id="fig-13-right", source="Fig. 13, right; section 5.3",
        statement=(
            "Carried by the wall until ω₀ falls below ω₀₂, the ball slips, sinks, hits the floor, and ends in RR."
        ),
        prediction="the order of cases that section 5.3 tells",
        measurement="one run in which ω₀ falls in held steps; each part of the story happened (1) or not (0)",
        tolerance="none: each part must happen",
        study=_unloading,
    ),
)  # fmt: skip

if __name__ == "__main__":
    sys.exit(main(CLAIMS))
