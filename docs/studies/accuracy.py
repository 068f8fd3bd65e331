"""What MuJoCo reaches with this project's settings, and what it can't do.

Each function runs what it needs in a campaign and returns the rows of one table; `document` writes
them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from analytic.mechanics import rolling_forces
from compare.kit.campaign import Campaign
from compare.kit.engines import MUJOCO
from compare.kit.pages import Rows
from docs.studies.states import (
    APPROACH,
    AT_REST,
    HITTING,
    LANDING,
    SMOOTH,
    STATES,
    WINDOW,
    Contestant,
    Stationary,
    number,
)
from mjsim import ContactSettings, RigidContacts
from mjsim.contact_settings import ContactModel
from model import Case, Contact, Events, State

STEPS = (4e-3, 1e-3)
"""Time steps of stationary states, s."""
_MORE = [
    Stationary(SMOOTH.replace(omega_0=w), case)
    for w, case in ((8.0, Case.RR), (20.0, Case.SS), (30.0, Case.SS))
]
REACHED = sorted([*STATES, *_MORE], key=lambda state: (state.case, state.p.omega_0))
"""Stationary states: those of the other tables, and some between them."""
OFF = 1.02
"""Start near a state, in units of its variables."""
FINE = (4e-3, 2e-3, 1e-3, 4e-4, 2e-4, 1e-4)
"""Time steps of the transient, s; from the last three it is extrapolated."""

KINDS = CLOSE, STICK = "close", "stick"


def _at(step: float, settings: ContactModel | None = None) -> Contestant:
    """MuJoCo with our settings for a time step, or others."""
    return Contestant(MUJOCO.name, MUJOCO, step, settings or RigidContacts(timestep=step))


def reached(
    campaign: Campaign, states: Sequence[Stationary] = REACHED, steps: Sequence[float] = STEPS
) -> Rows:
    """Errors of stationary states from rest and from near them, the worse of the two."""
    lasts = max(state.settles for state in states)
    tasks = {
        (state, h): [
            _at(h).task((state.p, x0, lasts, lasts / 1000)) for x0 in (AT_REST, _near(state))
        ]
        for state in states
        for h in steps
    }
    campaign.complete(task for pair in tasks.values() for task in pair)
    rows = [["state", "η", "h", "ω_c", "slip", "creep (m/s)", "open"]]
    for (state, h), pair in tasks.items():
        held = [state.held(run, (1 - WINDOW) * lasts) for run in campaign.run(pair)]
        orbital = float(abs(state.solution.state.omega_c)) * state.p.R
        errors = max(abs(each.omega_c) for each in held), max(each.slip for each in held) / orbital
        creep = (
            number(max(each.creep for each in held))
            if Contact.R in (state.case.A, state.case.B)
            else "–"
        )
        lost = f"{max(each.open for each in held):.1%}"
        rows.append(
            [state.name, f"{state.p.eta:g}", _milliseconds(h), *map(number, errors), creep, lost]
        )
    return rows


def _near(state: Stationary) -> State:
    """A start off the state in all of its variables; high over the floor where only the wall
    carries the ball."""
    return State.of(OFF * state.solution.x)._replace(y=state.p.R if state.case is Case.NR else 0.0)


def transient(campaign: Campaign, steps: Sequence[float] = FINE) -> Rows:
    """Rms errors of the transient with the step, the order from one step to the next, and the
    extrapolation."""
    runs = campaign.run([_at(step).task(APPROACH.run) for step in steps])
    errors = np.array([APPROACH.errors(run.time, run.x) for run in runs])
    ratios = np.array(steps[:-1]) / steps[1:]
    orders = np.log(errors[:-1] / errors[1:]) / np.log(ratios)[:, None]
    texts = [("", ""), *((f"{first:.1f}", f"{second:.1f}") for first, second in orders)]
    rows = [["h", "ω_c", "order", "slip", "order"]]
    for step, (omega_c, slip), (first, second) in zip(steps, errors, texts, strict=True):
        rows.append([_milliseconds(step), number(omega_c), first, number(slip), second])
    # The terms of second and third order, from the last three steps.
    terms = np.array([[1.0, h**2, h**3] for h in steps[-3:]])
    states = np.stack([run.x for run in runs[-3:]])
    limit = np.tensordot(np.linalg.inv(terms)[0], states, axes=1)
    omega_c, slip = APPROACH.errors(runs[-1].time, limit)
    return [*rows, ["extrapolated from the last three", number(omega_c), "", number(slip), ""]]


def event_times(campaign: Campaign, steps: Sequence[float] = (1e-3, 5e-4, 2.5e-4, 1e-4)) -> Rows:
    """Largest error of the moments at which contacts close, and at which they stick, and orders
    from step to step."""
    rows = [["motion", "h", *(name for kind in KINDS for name in (f"contacts {kind}", "order"))]]
    for motion in (LANDING, HITTING):
        exact, before = _moments(motion.exact.events), dict.fromkeys(KINDS, (math.nan, math.nan))
        runs = campaign.run(
            [_at(step).task((motion.p, motion.x0, motion.lasts, motion.lasts)) for step in steps]
        )
        for step, run in zip(steps, runs, strict=True):
            cells, seen = [], _moments(run.events)
            for kind in KINDS:
                these = [(at, time) for at, time in exact.items() if at[1] == kind]
                error = max(abs(seen[at] - time) if at in seen else math.inf for at, time in these)
                order = math.log(before[kind][1] / error) / math.log(before[kind][0] / step)
                cells += [f"{1e6 * error:.2g} µs", "" if math.isnan(order) else f"{order:.1f}"]
                before[kind] = step, error
            rows.append([motion.course, _milliseconds(step), *cells])
    return rows


def _moments(events: Events) -> dict[tuple[str, str], float]:
    """When contacts close and when they stick, by contact and kind, s; the last time of each."""
    moments = {}
    for time, *cases in zip(events.time.tolist(), events.from_case, events.to_case, strict=True):
        for contact in "AB":
            before, after = (getattr(Case(case), contact) for case in cases)
            if before is Contact.N is not after:
                moments[contact, CLOSE] = time
            elif before is Contact.S and after is Contact.R:
                moments[contact, STICK] = time
    return moments


def force_split(campaign: Campaign, omegas: Sequence[float] = (6.0, 10.0, 13.0)) -> Rows:
    """B_y in two-point rolling, where it may lie anywhere in an interval."""
    rows = [
        [
            "ω₀ (rad/s)",
            "admissible B_y (N)",
            "MuJoCo's contacts",
            "Coulomb's law, from 12 % off",
            "Coulomb's law, from rest",
        ]
    ]
    plain, ours = ContactSettings(), RigidContacts()
    for omega_0 in omegas:
        p = SMOOTH.replace(omega_0=omega_0)
        least, greatest = (float(end) for end in rolling_forces.admissible_interval(omega_0, p))
        off = State(omega_c=0.88 * omega_0)
        lasts = Stationary(p, Case.RR).settles
        starts = (plain, off), (ours, off), (ours, AT_REST)
        runs = campaign.run(
            [_at(s.timestep, s).task((p, x0, lasts, lasts / 1000)) for s, x0 in starts]
        )
        forces = [run.force_B[run.time >= (1 - WINDOW) * lasts, 1].mean() for run in runs]
        rows.append(
            [f"{omega_0:g}", f"{least:.4f} … {greatest:.4f}", *(f"{force:.4f}" for force in forces)]
        )
    return rows


def _milliseconds(step: float) -> str:
    return f"{1e3 * step:g} ms"
