"""What MuJoCo reaches with this project's settings, and what it can't do.

Each function runs what it needs in a campaign and returns the rows of one table; `document` writes them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from analytic import rolling_forces
from compare.pages import Rows
from compare.runs.campaign import Campaign
from compare.runs.engines import EVENT, MUJOCO
from compare.runs.tasks import Task
from compare.scorecard import trials
from compare.scorecard.trials import AT_REST, KICKED, PASSES, ROUGH, SLIPPING, SMOOTH, WINDOW, Held, State
from mjsim import ContactSettings
from model import Case, Contact, Parameters
from model.arrays import Array

STEPS = (4e-3, 1e-3)
"""Time steps of stationary states, s."""
REACHED = (
    *(State(SMOOTH.replace(omega_0=omega_0), Case.RR) for omega_0 in (8.0, 12.0)),
    *(State(SMOOTH.replace(omega_0=omega_0), Case.SS) for omega_0 in (14.5, 20.0, 25.0, 30.0)),
    State(ROUGH.replace(omega_0=25.0), Case.NR),
)
OFF = 1.02
"""Start near a state, in units of its variables."""
FINE = (4e-3, 2e-3, 1e-3, 4e-4, 2e-4, 1e-4)
"""Time steps of the transient, s; from the last three it is extrapolated."""
MOTIONS = {
    "slides down the wall, lands, slips at both points, sticks": (0.02, -0.2, 12.0, 30.0, -10.0, 20.0, 0.0, 0.0),
    "slides on the floor, hits the wall, is lifted, lands, sticks": (0.0, 0.0, 10.0, 1.0, 2.0, 3.0, 0.002, -0.3),
}
"""Starts of motions through landings, slip, stick and lift-off, of the reference set."""
LASTS = 0.7
"""Their duration, s."""


def _mujoco(
    p: Parameters, x0: Sequence[float], t_end: float, settings: ContactSettings, interval: float | None = None
) -> Task:
    return Task(
        engine=MUJOCO.name, parameters=p, x0=tuple(x0), t_end=t_end, settings=settings, sample_interval=interval
    )


def _near(state: State) -> tuple[float, ...]:
    """A start off the state in all of its variables; high over the floor where only the wall carries the ball."""
    x = OFF * state.solution.x
    x[0] = state.p.R if state.case is Case.NR else 0.0
    return tuple(x.tolist())


def _held(campaign: Campaign, states: Sequence[State], tasks: Sequence[Task]) -> list[Held]:
    runs = campaign.run(tasks)
    return [
        trials.held(run, state, (1 - WINDOW) * task.t_end) for run, state, task in zip(runs, states, tasks, strict=True)
    ]


def _relative_slip(held: Held, state: State) -> float:
    """Error of slip in units of the ball's orbital speed."""
    return held.slip / (float(abs(state.solution.state.omega_c)) * state.p.R)


def reached(campaign: Campaign, states: Sequence[State] = REACHED, steps: Sequence[float] = STEPS) -> Rows:
    """Errors of stationary states from rest and from near them, the worse of the two."""
    starts = [(state, x0) for state in states for x0 in (AT_REST, _near(state))]
    lasts = math.ceil(max(state.forgets for state in states) / (1 - WINDOW))
    tasks = {h: [_mujoco(s.p, x0, lasts, ContactSettings.at(h)) for s, x0 in starts] for h in steps}
    campaign.complete(task for each in tasks.values() for task in each)
    rows = [["state", "η", "h", "ω_c", "slip", "creep (m/s)", "open"]]
    of_start = [state for state, _ in starts]
    by_step = {h: _held(campaign, of_start, each) for h, each in tasks.items()}
    for k, state in enumerate(states):
        for h, results in by_step.items():
            pair = results[2 * k : 2 * k + 2]
            rolls = Contact.R in (state.case.A, state.case.B)
            errors = (max(abs(each.omega_c) for each in pair), max(_relative_slip(each, state) for each in pair))
            creep = number(max(each.creep for each in pair)) if rolls else "–"
            cells = [*map(number, errors), creep, f"{max(each.open for each in pair):.1%}"]
            rows.append([state.name, f"{state.p.eta:g}", _milliseconds(h), *cells])
    return rows


def transient(campaign: Campaign, steps: Sequence[float] = FINE) -> Rows:
    """Rms errors of the transient with the step, the order from one step to the next, and the extrapolation."""
    tasks = [_mujoco(SLIPPING.p, KICKED, PASSES, ContactSettings.at(step), PASSES / 100) for step in steps]
    exact, *runs = campaign.run([trials.EXACT, *tasks])
    errors = np.array([trials.deviation(run.time, run.x, exact) for run in runs])
    ratios = np.array(steps[:-1]) / steps[1:]
    orders = np.log(errors[:-1] / errors[1:]) / np.log(ratios)[:, None]
    rows = [["h", "ω_c", "order", "slip", "order"]]
    for step, (omega_c, slip), (first, second) in zip(steps, errors, [("", ""), *_fixed(orders)], strict=True):
        rows.append([_milliseconds(step), number(omega_c), first, number(slip), second])
    # The terms of second and third order, from the last three steps.
    terms = np.array([[1.0, h**2, h**3] for h in steps[-3:]])
    states = np.stack([run.x for run in runs[-3:]])
    limit = np.tensordot(np.linalg.inv(terms)[0], states, axes=1)
    omega_c, slip = trials.deviation(runs[-1].time, limit, exact)
    return [*rows, ["extrapolated from the last three", number(omega_c), "", number(slip), ""]]


def _fixed(values: Array) -> list[tuple[str, ...]]:
    return [tuple(f"{value:.1f}" for value in row) for row in values]


def event_times(campaign: Campaign, steps: Sequence[float] = (1e-3, 5e-4, 2.5e-4, 1e-4)) -> Rows:
    """Largest error of the times at which the case changes."""
    rows = [["motion", "h", "changes", "largest error", "in steps"]]
    for name, x0 in MOTIONS.items():
        tasks = [_mujoco(SMOOTH, x0, LASTS, ContactSettings.at(step), step) for step in steps]
        exact, *runs = campaign.run([Task(engine=EVENT.name, parameters=SMOOTH, x0=x0, t_end=LASTS), *tasks])
        for step, run in zip(steps, runs, strict=True):
            cells = ["another sequence of cases", ""]
            if run.events.to_case.tolist() == exact.events.to_case.tolist():
                error = float(np.abs(run.events.time - exact.events.time).max())
                cells = [f"{1e3 * error:.2g} ms", f"{error / step:.1f}"]
            rows.append([name, _milliseconds(step), str(len(exact.events)), *cells])
    return rows


def force_split(campaign: Campaign, omegas: Sequence[float] = (6.0, 10.0, 13.0)) -> Rows:
    """B_y in two-point rolling, where it may lie anywhere in an interval."""
    rows = [["ω₀ (rad/s)", "admissible B_y (N)", "no memory", "memory, from 12 % off", "memory, from rest"]]
    plain, ours = ContactSettings(memory=False, order=1), ContactSettings()
    for omega_0 in omegas:
        p = SMOOTH.replace(omega_0=omega_0)
        least, greatest = (float(end) for end in rolling_forces.admissible_interval(omega_0, p))
        off = (0.0, 0.0, 0.88 * omega_0, 0.0, 0.0, 0.0, 0.0, 0.0)
        lasts = math.ceil(State(p, Case.RR).forgets / (1 - WINDOW))
        runs = campaign.run([_mujoco(p, x0, lasts, s) for s, x0 in ((plain, off), (ours, off), (ours, AT_REST))])
        forces = [run.force_B[run.time >= (1 - WINDOW) * lasts, 1].mean() for run in runs]
        rows.append([f"{omega_0:g}", f"{least:.4f} … {greatest:.4f}", *(f"{force:.4f}" for force in forces)])
    return rows


def number(value: float) -> str:
    """An error for a table: round-off is shown as such, a run without one as diverged."""
    return "diverged" if math.isnan(value) else "< 1e-14" if value < 1e-14 else f"{value:.1e}"


def _milliseconds(step: float) -> str:
    return f"{1e3 * step:g} ms"
