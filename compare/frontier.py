"""Error against cost: stationary states and a transient, with the step, by ways of setting MuJoCo and other methods.

What is compared is the relative error of omega_c: in stationary states, begun at the predicted state and held until an
error of the method has come up to all but exp(-7) of its size; and root mean square over a transient of steady
slipping, against the event-driven simulation.
"""

from __future__ import annotations

import json
import math
import statistics
import sys
import time
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

import analytic
from compare.claims import Check, Claim, Lab, Level
from compare.stationary import slowest
from compare.studies import Bench, main
from compare.tasks import Task, carry_out
from mjsim import ContactSettings, Run
from model import Case, Parameters, Trajectory
from model.files import write_text

ID = "frontier"
HOLDS = 7.0
"""How long states are held, in units of their slowest time constant."""
STEPS = {
    Level.QUICK: (4e-3, 2e-3, 1e-3), Level.DEFAULT: (4e-3, 2e-3, 1e-3, 5e-4),
    Level.FULL: (4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4, 1e-4),
}  # fmt: skip
REFERENCE = Parameters.named("reference")
STATES = {"RR 12": (Case.RR, 12.0), "SS 14.5": (Case.SS, 14.5), "SS 25": (Case.SS, 25.0)}
TRANSIENT = "transient"
COST = "time per simulated time"
DEPARTURE = (0.0, 0.0, 0.5, 3.0, 2.0, -3.0, 0.0, 0.0)
"""How far from steady slipping the transient starts, rad s-1."""
LASTS = 2.0
"""Duration of the transient, s."""
GOAL = 1e-8
"""Largest relative error of omega_c in a stationary state that ours may have, at any of the steps."""
ELSEWHERE: dict[str, dict[str, tuple[float, float, float]]] = {
    "Siconos, Moreau-Jean": {
        "RR 12": (7e-14, 5e-4, 20e-6), "SS 14.5": (5e-7, 5e-4, 20e-6), "SS 25": (9e-15, 5e-4, 20e-6),
        TRANSIENT: (4e-6, 1e-4, 20e-6),
    },
    "PyBullet": {
        "RR 12": (7e-14, 5e-4, 17e-6), "SS 14.5": (4e-6, 5e-4, 17e-6), "SS 25": (8e-7, 5e-4, 17e-6),
        TRANSIENT: (1.4e-5, 1e-4, 17e-6),
    },
    "Drake, TAMSI": {
        "RR 12": (5e-6, 5e-4, 23e-6), "SS 14.5": (6e-6, 5e-4, 23e-6), "SS 25": (5e-6, 5e-4, 23e-6),
        TRANSIENT: (4.8e-5, 1e-4, 23e-6),
    },
}  # fmt: skip
"""Relative error, time step (s) and time per step (s) of other engines in co-rotating coordinates: measured once, on
another machine, not part of this program."""


def mujoco_defaults(timestep: float, **changes: object) -> ContactSettings:
    """MuJoCo's own contact parameters, and none of the corrections between the steps."""
    plain = {
        "timestep": timestep, "solref": (0.02, 1.0), "solreffriction": 0.02, "solimp": 0.9, "impratio": 1.0,
        "servo": 0.0, "memory": False, "order": 1,
    }  # fmt: skip
    return ContactSettings.from_mapping(plain | changes)


OURS = "ours"
CONTENDERS: dict[str, Callable[[float], ContactSettings]] = {
    OURS: ContactSettings.at,
    "first order": lambda h: ContactSettings.at(h, order=1),
    "no servo, no memory": lambda h: ContactSettings.at(h, order=1, memory=False, servo=0.0),
    "MuJoCo's defaults": mujoco_defaults,
    "free joint": lambda h: ContactSettings.at(h, coordinates="free", memory=False, order=1),
}
"""Settings of MuJoCo for a step in s, by name."""


@dataclass(frozen=True)
class Score:
    """One quantity under one setting."""

    quantity: str
    """A key of `STATES`, or `TRANSIENT`."""
    error: float
    """Relative, of omega_c."""
    closed: float
    """Share of samples in which the contact that is open more often carries a force."""
    task: Task


def scores(lab: Lab, engine: str, chosen: Sequence[ContactSettings | analytic.Settings]) -> list[list[Score]]:
    """What each of the settings reaches in every state and in the transient."""
    starts = {name: _state(*state) for name, state in STATES.items()}
    parts: list[list[Task]] = []
    for settings in chosen:
        tasks = [_task(engine, p, x, hold, settings) for p, x, hold in starts.values()]
        parts.append([*tasks, transient(engine, settings)])
    lab.campaign.complete(task for tasks in parts for task in tasks)
    (exact,) = lab.run([transient("event", analytic.Settings(rtol=1e-12))])
    found = []
    for tasks in parts:
        runs = lab.run(tasks)
        errors = [
            abs(float(run.omega_c[-10:].mean()) / x[2] - 1)
            for run, (_, x, _) in zip(runs[:-1], starts.values(), strict=True)
        ]
        errors.append(float(np.sqrt(np.mean((runs[-1].omega_c / exact.omega_c - 1) ** 2))))
        names = [*STATES, TRANSIENT]
        found.append([Score(*each) for each in zip(names, errors, map(_closed, runs), tasks, strict=True)])
    return found


def _state(case: Case, omega_0: float) -> tuple[Parameters, tuple[float, ...], float]:
    """Parameters, the stable stationary state, and how long it is held."""
    p = REFERENCE.replace(omega_0=omega_0)
    (solution,) = [s for s in analytic.stationary_solutions(p) if s.case is case and s.stable]
    return p, tuple(solution.x.tolist()), math.ceil(HOLDS * slowest(solution))


def transient(engine: str, settings: ContactSettings | analytic.Settings) -> Task:
    p, x, _ = _state(Case.SS, 25.0)
    return _task(engine, p, tuple(a + b for a, b in zip(x, DEPARTURE, strict=True)), LASTS, settings)


def _task(
    engine: str, p: Parameters, x0: tuple[float, ...], lasts: float, settings: ContactSettings | analytic.Settings
) -> Task:  # fmt: skip
    return Task(
        engine=engine, parameters=p, x0=x0, t_end=lasts, settings=settings, sample_interval=lasts / 100, hovers=True
    )


def _closed(run: Trajectory) -> float:
    return float(min(np.mean(run.force_A[:, 1] > 0), np.mean(run.force_B[:, 0] > 0)))


def cost(lab: Lab, task: Task) -> float:
    """Processor time over simulated time of one simulation by itself: measured once, and kept beside the run."""
    path = lab.campaign.path(task).with_suffix(".cost.json")
    if not path.exists():
        write_text(path, json.dumps({COST: _measured_cost(task)}))
    return float(json.loads(path.read_text("utf-8"))[COST])


def _measured_cost(task: Task, repeats: int = 3) -> float:
    """Median over repeats."""
    found = []
    for _ in range(repeats):
        if task.engine == "mujoco":
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of hovering
                run = Run(
                    [task.parameters], [task.x0], task.t_end, [task.fluid], task.contact_settings,
                    sample_interval=task.sample_interval, batched=False,
                )  # fmt: skip
            start = time.process_time()
            list(run)
        else:
            start = time.process_time()
            carry_out([task])
        found.append((time.process_time() - start) / task.t_end)
    return statistics.median(found)


def _study(lab: Lab) -> list[Check]:
    steps = STEPS[lab.level]
    coarse = steps[: 1 if lab.level is Level.QUICK else len(steps)]
    methods: list[tuple[str, str, Sequence[tuple[float, ContactSettings | analytic.Settings]]]] = [
        *[(name, "mujoco", [(h, make(h)) for h in steps]) for name, make in CONTENDERS.items()],
        ("Moreau-Jean", "time-stepping", [(h, analytic.Settings(step=h)) for h in coarse]),
        ("event-driven", "event", [(0.0, analytic.Settings())]),
    ]
    found = []
    for name, engine, settings in methods:
        for (h, _), row in zip(settings, scores(lab, engine, [each for _, each in settings]), strict=True):
            found += _checks(Bench(lab, "reference"), name, h, row)
    return found


def _checks(bench: Bench, name: str, step: float, row: Sequence[Score]) -> list[Check]:
    """What one method reaches at one step, and for ours in how many of the states it misses the goal."""
    where, last = f"{name}; h = {step:g} s", row[-1].task
    found = [bench.shown(score.task, score.quantity, where, score.error) for score in row]
    found.append(bench.shown(last, COST, where, cost(bench.lab, last)))
    if name == OURS:
        missed = sum(not score.error <= GOAL for score in row if score.quantity in STATES)
        found.append(bench.count(last, f"states off by more than {GOAL:g}", where, 0, missed))
    return found


CLAIMS = (
    Claim(
        id=ID, source="docs/mujoco-settings.md",
        statement="With servo, memory and midpoint MuJoCo holds the stationary states whatever the step.",
        prediction="closed-form stationary states; the event-driven simulation for the transient",
        measurement="relative error of ω_c in RR 12, SS 14.5, SS 25, and rms in a transient of 2 s; processor time",
        tolerance=f"none: no stationary state may be off by more than {GOAL:g}; what else is shown is for comparison",
        level=Level.DEFAULT, study=_study,
    ),
)  # fmt: skip

if __name__ == "__main__":
    sys.exit(main(CLAIMS))
