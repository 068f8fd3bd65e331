"""What holds at every instant: contacts that roll, press and rub as Table 3 and (12)-(17) say; and the fluid's drag.

Balls go through the cases of Fig. 2 while the flow rises and falls; the laws are looked at in all samples of a set.
(12) and (13), which a contact solver keeps in every step, are measured at their worst; the others at their typical
value, because friction needs a few steps after an impact or a change of case.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from compare.kit.lab import Lab, coarse_step, time_unit
from compare.kit.record import Measurement, Missing, Records, if_sure, measurement
from compare.kit.settling import PRESSES
from compare.kit.statistics import Measured
from model import Flow, Parameters, State, Trajectory
from model.arrays import Array
from model.kinematics import slip_velocities

PROTOCOL = "laws"
LASTS = 768
"""Length of a run in coarse steps, which is about 40 sqrt(R/g), and its samples."""
FASTEST = 3.0
"""The flow rises from rest to this, or falls from it, omega_0 sqrt(R/g)."""
SLIPS = 0.02
"""Slip speed divided by sqrt(g R) above which friction must be that of slipping, whatever case is detected."""
FEWEST = 20
"""Samples of a law that a set must have."""
ROUNDING = 100 * float(np.finfo(float).eps)
FLUIDS: Mapping[str, Mapping[str, float]] = {
    "steel-in-water": {"nu_f": 1.004e-6, "rho_f": 998.2, "rho_b": 7850.0, "r": 5e-3, "gravity": 9.81},
    "steel-in-air": {"nu_f": 1.516e-5, "rho_f": 1.204, "rho_b": 7850.0, "r": 5e-3, "gravity": 9.81},
    "glass-in-glycerine": {"nu_f": 1.18e-3, "rho_f": 1260.0, "rho_b": 2500.0, "r": 8e-3, "gravity": 9.81},
}
"""Balls that fall in a fluid, SI."""


def measure(lab: Lab, sets: Mapping[str, Parameters], records: Records) -> Iterator[Measurement | Missing]:
    """How far the laws are off, the ratio of friction to normal force, and the speed at which balls sink in a fluid."""
    refined = lab.effort("laws.refined")
    balls = {name: Parameters.from_fluid(**fluid, R=5 * fluid["r"], mu=0.2, eta=0.2) for name, fluid in FLUIDS.items()}
    tasks = []
    for p in sets.values():
        step, fast = coarse_step(p), FASTEST / time_unit(p)
        t_end = LASTS * step
        # From rest in a flow that rises; high on the wall in one that falls; and along the floor towards the wall.
        up = Flow.sampled([0.0, 0.3 * t_end, 0.7 * t_end], [0.0, fast / 3, fast])
        down = Flow.sampled([0.0, 0.2 * t_end, 0.6 * t_end], [fast, fast, fast / 4])
        half = Flow.steady(fast / 2)
        starts = (up, State()), (down, State(y=2 * p.R, omega_c=fast)), (half, State(omega_c=fast / 3, h=p.R / 2))
        for parts in refined:
            tasks.append([lab.task(p, x, t_end, step / parts, flow=flow, samples=LASTS) for flow, x in starts])
    falls = []
    for p in balls.values():
        # In the middle of still fluid, off floor and wall, from rest and sinking already.
        step, middle = coarse_step(p), State(y=100 * p.R, h=p.R / 2)
        falling = middle, middle._replace(v_y=-math.sqrt(p.g * p.R))
        falls += [[lab.task(p, x, 64 * step, step / parts, samples=64) for x in falling] for parts in refined]
    runs = lab.groups([*tasks, *falls])
    for (name, p), fine_tasks in zip(sets.items(), tasks[1::2], strict=True):
        coarse, fine = deviations(next(runs)), deviations(next(runs))
        for key, value in fine.items():
            quantity, law, contact = key
            if math.isnan(value) or math.isnan(coarse[key]):
                yield Missing(PROTOCOL, name, f"fewer than {FEWEST} samples show at {contact}: {law}")
                continue
            # Halving the step may by chance not show what it does: of all laws of a kind the largest change stands.
            changes = [abs(fine[k] - coarse[k]) for k in fine if k[0] == quantity]
            sure = Measured(value, math.hypot(np.nanmax(changes), ROUNDING))
            row = measurement(lab, PROTOCOL, name, p, quantity, sure, fine_tasks, law=law, contact=contact)
            yield if_sure(row, 1.0, f"the step changes what is seen at {contact}: {law}")
    for (name, p), fine_tasks in zip(balls.items(), falls[1::2], strict=True):
        (before, _), (speed, lasts) = _sinking_speed(*next(runs)), _sinking_speed(*next(runs))
        # What is left of a fall that has only just begun is a difference of speeds, each of them rounded in every step.
        sinking = Measured(speed, math.hypot(speed - before, ROUNDING * abs(speed) / (p.c * lasts)))
        yield measurement(lab, PROTOCOL, name, p, "v_y", sinking, fine_tasks, case="NN", by=name, **FLUIDS[name])


def deviations(runs: Sequence[Trajectory]) -> dict[tuple[str, str, str], float]:
    """How far runs of one set are from every law, dimensionless: by quantity, law and contact.

    nan where too few samples show it.
    """

    def typical(values: Array) -> float:
        return float(np.median(values)) if len(values) >= FEWEST else math.nan

    worst: dict[tuple[str, str, str], float] = {}
    for contact in "AB":
        rows = [_rows(run, contact) for run in runs]
        normal, friction, limit, against, speed, gap, letter = (np.concatenate(row) for row in zip(*rows, strict=True))
        slides = (speed > SLIPS) & (normal > PRESSES)
        worst["law", "(12): the contact presses", contact] = float(np.max(-normal, initial=0.0))
        worst["law", "(13): friction is within its limit", contact] = float(np.max(friction - limit, initial=0.0))
        for law, values in (
            ("where it rolls it doesn't slip", speed[letter == "R"]),
            ("where it is closed there is no gap", np.abs(gap[letter != "N"])),
            (f"({14 if contact == 'A' else 15}): friction opposes the slip", against[slides]),
        ):
            worst["law_in_motion", law, contact] = typical(values)
        worst["friction_ratio", "friction over normal force", contact] = typical(friction[slides] / normal[slides])
    return worst


def _rows(run: Trajectory, contact: str) -> tuple[Array, ...]:
    """Normal force, friction, its limit, and its difference from full friction against the slip, divided by the weight.

    Then slip speed divided by sqrt(g R), gap divided by R and the contact's letter, each (n,).
    """
    p, k = run.header.parameters, "AB".index(contact)
    across, along = ((1, [0, 2]), (0, [1, 2]))[k]
    force, slip = (run.force_A, run.force_B)[k], slip_velocities(run.x, p)[k][:, along]
    normal, tangent, speed = force[:, across], force[:, along], np.hypot(*slip.T)
    friction, limit = np.hypot(*tangent.T), (p.mu, p.eta)[k] * normal
    direction = slip / np.maximum(speed, np.finfo(float).tiny)[:, None]
    against = np.hypot(*(tangent + friction[:, None] * direction).T)
    letters = np.array([case.name[k] for case in run.cases])
    forces = (each / (p.m * p.g) for each in (normal, friction, limit, against))
    return *forces, speed / math.sqrt(p.g * p.R), (run.gap_A, run.gap_B)[k] / p.R, letters


def _sinking_speed(slow: Trajectory, fast: Trajectory) -> tuple[float, float]:
    """v_y in m/s at which gravity and drag balance, of two falls that differ in speed, and their duration in s.

    With a drag proportional to speed, v' = (v_end - v)/T: the fall from rest gains (1 - q) v_end while the difference
    of the two shrinks to q of what it was.
    """
    gap = fast.v_y - slow.v_y
    lost = (gap[0] - gap[-1]) / gap[0]
    return float(slow.v_y[0] + (slow.v_y[-1] - slow.v_y[0]) / lost), float(fast.time[-1])
