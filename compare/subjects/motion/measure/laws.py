"""What holds at every instant: contacts that roll and rub as Table 3 and (14)-(17) say; and the
fluid's drag.

Balls go through the cases of Fig. 2 while the flow rises and falls; each law is measured at its
worst over all samples of a set but those next to a change of case, when friction takes a few steps
to build up. (12) and (13) are not measured: what solves for forces in a friction cone can't violate
them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from compare.kit.record import Measurement, Missing, Records, measurement
from compare.kit.runner import Runner, coarse_step
from compare.kit.scales import time_unit
from compare.kit.settling import PRESSES
from compare.kit.statistics import estimate
from model import Flow, Parameters, State, Trajectory
from model.arrays import Array
from model.kinematics import slip_velocities

PROTOCOL = "laws"
RUN_LENGTH = 768
"""Length of a run in coarse steps, which is about 40 sqrt(R/g), and its samples."""
ROUNDING = 100 * float(np.finfo(float).eps)
FLUIDS: Mapping[str, Mapping[str, float]] = {
    "steel-in-water": {
        "nu_f": 1.004e-6,
        "rho_f": 998.2,
        "rho_b": 7850.0,
        "r": 5e-3,
        "gravity": 9.81,
    },
    "steel-in-air": {"nu_f": 1.516e-5, "rho_f": 1.204, "rho_b": 7850.0, "r": 5e-3, "gravity": 9.81},
    "glass-in-glycerine": {
        "nu_f": 1.18e-3,
        "rho_f": 1260.0,
        "rho_b": 2500.0,
        "r": 8e-3,
        "gravity": 9.81,
    },
}
"""Balls that fall in a fluid, SI."""


class ContactLaw(NamedTuple):
    """A law of a contact, by the quantity that shows how far it is off."""

    quantity: str
    law: str
    contact: str


def measure(
    runner: Runner, sets: Mapping[str, Parameters], records: Records
) -> Iterator[Measurement | Missing]:
    """How far each law of contact is off at its worst in motions from rest, down the wall, and
    along the floor.

    And the speed at which balls sink in the middle of still fluid, off floor and wall.
    """
    tasks = []
    for p in sets.values():
        t_end, fast = RUN_LENGTH * coarse_step(p), 3.0 / time_unit(p)
        up = Flow.sampled([0.0, 0.3 * t_end, 0.7 * t_end], [0.0, fast / 3, fast])
        down = Flow.sampled([0.0, 0.2 * t_end, 0.6 * t_end], [fast, fast, fast / 4])
        half = Flow.steady(fast / 2)
        starts = (
            (up, State()),
            (down, State(y=2 * p.R, omega_c=fast)),
            (half, State(omega_c=fast / 3, h=p.R / 2)),
        )
        finer = [
            (coarse_step(p) / parts, *start)
            for parts in runner.sampling.laws_divisors
            for start in starts
        ]
        tasks.append(
            [runner.task(p, x, t_end, h, flow=flow, samples=RUN_LENGTH) for h, flow, x in finer]
        )
    for (name, p), own, runs in zip(sets.items(), tasks, runner.groups(tasks), strict=True):
        if isinstance(runs, str):
            yield Missing(PROTOCOL, name, f"the run {runs}")
            continue
        coarse, fine = deviations(runs[: len(runs) // 2]), deviations(runs[len(runs) // 2 :])
        for law, value in fine.items():
            if math.isnan(value) or math.isnan(coarse[law]):
                yield Missing(PROTOCOL, name, f"no sample at {law.contact} to test: {law.law}", 0)
                continue
            # Halving the step may by chance change little: the larger change of the two contacts
            # counts.
            changes = [abs(fine[k] - coarse[k]) for k in fine if k[:2] == law[:2]]
            change, at = float(np.nanmax(changes)), law._asdict()
            sure = estimate(value, time_step=change, rounding=ROUNDING)
            yield measurement(
                runner, PROTOCOL, name, p, at.pop("quantity"), sure, own[len(own) // 2 :], **at
            )
    balls = {
        name: Parameters.from_fluid(**fluid, R=5 * fluid["r"], mu=0.2, eta=0.2)
        for name, fluid in FLUIDS.items()
    }
    falls, divisors = [], runner.sampling.laws_divisors
    for p in balls.values():
        step, rest = coarse_step(p), State(y=100 * p.R, h=p.R / 2)
        begun = rest, rest._replace(v_y=-math.sqrt(p.g * p.R))
        falls.append(
            [
                runner.task(p, x, 64 * step, step / parts, samples=64)
                for parts in divisors
                for x in begun
            ]
        )
    for (name, p), own, runs in zip(balls.items(), falls, runner.groups(falls), strict=True):
        if isinstance(runs, str):
            yield Missing(PROTOCOL, name, f"the run {runs}")
            continue
        (before, _), (speed, lasts) = _sinking_speed(*runs[:2]), _sinking_speed(*runs[2:])
        # What is left of a fall that has only just begun is a difference of speeds, each of them
        # rounded in every step.
        rounding = ROUNDING * abs(speed) / (p.c * lasts)
        sinking = estimate(speed, time_step=abs(speed - before), rounding=rounding)
        yield measurement(
            runner, PROTOCOL, name, p, "v_y", sinking, own[2:], case="NN", by=name, **FLUIDS[name]
        )


def deviations(runs: Sequence[Trajectory]) -> dict[ContactLaw, float]:
    """How far runs of one set are from every law, dimensionless; nan where no sample can show
    it."""

    def largest(values: Array, off: float) -> float:
        return float(values[np.argmax(np.abs(values - off))]) if len(values) else math.nan

    worst: dict[ContactLaw, float] = {}
    for contact in "AB":
        rows = [_rows(run, contact) for run in runs]
        normal, friction, against, speed, gap, letter = (
            np.concatenate(row) for row in zip(*rows, strict=True)
        )
        # A contact that slips so fast must have the friction of slipping, whatever case is
        # detected.
        slides = (speed > 0.02) & (normal > PRESSES) & (letter != "")
        for law, values in (
            ("where it rolls it doesn't slip", speed[letter == "R"]),
            ("where it is closed there is no gap", np.abs(gap[(letter == "R") | (letter == "S")])),
            ("(14), (15): friction opposes the slip", against[slides]),
        ):
            worst[ContactLaw("law_in_motion", law, contact)] = largest(values, 0.0)
        ratios = friction[slides] / normal[slides]
        usual = float(np.median(ratios)) if len(ratios) else 0.0
        worst[ContactLaw("friction_ratio", "friction over normal force", contact)] = largest(
            ratios, usual
        )
    return worst


def _rows(run: Trajectory, contact: str) -> tuple[Array, ...]:
    """Normal force, friction, and its difference from friction against the slip, divided by the
    weight.

    Of the difference only what exceeds the turn of the slip from one sample to the next. Then slip
    speed divided by sqrt(g R), gap divided by R and the contact's letter, empty within 5 samples of
    a change of case, each (n,)."""
    p, k = run.header.parameters, "AB".index(contact)
    across, along = ((1, [0, 2]), (0, [1, 2]))[k]
    force, slip = (run.force_A, run.force_B)[k], slip_velocities(run.x, p)[k][:, along]
    normal, tangent, speed = force[:, across], force[:, along], np.hypot(*slip.T)
    friction = np.hypot(*tangent.T)
    direction = slip / np.maximum(speed, np.finfo(float).tiny)[:, None]
    turns = np.hypot(*np.diff(direction, axis=0, prepend=direction[:1]).T)
    against = np.maximum(
        np.hypot(*(tangent + friction[:, None] * direction).T) - friction * turns, 0.0
    )
    changes = np.flatnonzero(np.diff(run.case))[:, None] + np.arange(-4, 6)
    letters = np.array([case.name[k] for case in run.cases])
    letters[np.clip(changes, 0, len(letters) - 1)] = ""
    forces = (each / (p.m * p.g) for each in (normal, friction, against))
    return *forces, speed / math.sqrt(p.g * p.R), (run.gap_A, run.gap_B)[k] / p.R, letters


def _sinking_speed(slow: Trajectory, fast: Trajectory) -> tuple[float, float]:
    """v_y in m/s at which gravity and drag balance, of two falls that differ in speed, and their
    duration in s.

    With a drag proportional to speed, v' = (v_end - v)/T: the fall from rest gains (1 - q) v_end
    while the difference of the two shrinks to q of what it was."""
    gap = fast.v_y - slow.v_y
    lost = (gap[0] - gap[-1]) / gap[0]
    return float(slow.v_y[0] + (slow.v_y[-1] - slow.v_y[0]) / lost), float(fast.time[-1])
