"""What the studies share: a number beside its prediction, rates of growth from samples, and a command line for each."""

from __future__ import annotations

import argparse
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
from rich.console import Console

from compare import progress, results, tables
from compare.campaign import Campaign
from compare.claims import Check, Claim, Lab, Level, judge
from compare.tasks import Task
from mjsim.measurement import Measured, window_mean
from model import Case, Trajectory
from model.arrays import Array

COVERAGE = 3.0
"""Tolerance in units of the standard uncertainty."""
WINDOW = 0.1
"""Last part of a settled run, which is averaged."""


@dataclass(frozen=True)
class Bench:
    """A lab, and the parameter set that its checks are about."""

    lab: Lab
    name: str

    def number(
        self, task: Task, quantity: str, unit: str, condition: str, predicted: float, found: Measured,
        cases: tuple[Case, Case] | None = None,
    ) -> Check:  # fmt: skip
        """A measured number that agrees within `COVERAGE` standard uncertainties; `cases` are predicted and found."""
        predicted_case, found_case = (case.name for case in cases) if cases else ("", "")
        return Check(
            quantity=quantity, unit=unit, witness=task.engine, parameters=self.name, omega_0=task.parameters.omega_0,
            condition=condition, predicted=predicted, measured=found.value, uncertainty=found.uncertainty,
            tolerance=COVERAGE * found.uncertainty, case_predicted=predicted_case, case_found=found_case,
            run=self.lab.file(task),
        )  # fmt: skip

    def count(self, task: Task, quantity: str, condition: str, predicted: int, found: int) -> Check:
        """A number of things, which must be right to the last one."""
        return self.number(task, quantity, "1", condition, predicted, Measured(found, 0.0))

    def shown(self, task: Task, quantity: str, condition: str, value: float) -> Check:
        """A dimensionless number that is shown beside others, with nothing claimed of it."""
        return replace(self.number(task, quantity, "1", condition, 0.0, Measured(value, 0.0)), judged=False)


def last_part(trajectory: Trajectory, share: float = WINDOW) -> slice:
    """The samples of the last part of a run."""
    return slice(int((1 - share) * len(trajectory.time)), None)


def settled_mean(trajectory: Trajectory, values: Array) -> Measured:
    """Mean of values (n,), one a sample, over the last part of a run."""
    last = last_part(trajectory)
    return window_mean(trajectory.time[last], values[last])


def settled_case(trajectory: Trajectory, share: float = WINDOW) -> Case:
    """The case of most samples in the last part of a run."""
    return Case(int(np.bincount(trajectory.case[last_part(trajectory, share)]).argmax()))


def family(case: Case) -> Case:
    """SR and NR are one state at y = 0, where the floor carries nothing in either: both count as NR."""
    return Case.NR if case is Case.SR else case


def growth(d: Array, interval: float, order: int, spacing: float) -> npt.NDArray[np.complex128]:
    """Exponents (order,) in s-1 of a sum of exponentials sampled every `interval` s, rows of d (n, channels).

    Prony's method: the recurrence d_(k+order) = sum a_i d_(k+i) that fits best, and its characteristic roots; the
    channels share it. Samples `spacing` s apart are held against each other, which steadies the roots; frequencies up
    to pi/spacing are told apart.
    """
    apart = max(1, min(round(spacing / interval), len(d) // (order + 2)))
    d = d / np.abs(d).max(axis=0)
    rows = np.stack([d[k * apart : len(d) - (order - k) * apart] for k in range(order)], axis=-1)
    last = d[order * apart :]
    coefficients = np.linalg.lstsq(rows.reshape(-1, order), last.reshape(-1))[0]
    roots = np.roots([1.0, *-coefficients[::-1]]).astype(complex)
    return np.asarray(np.log(roots) / (apart * interval))


def exponent(d: Array, interval: float, order: int, spacing: float) -> tuple[complex, float]:
    """The exponent of `growth` with the largest imaginary part, and how much the two halves of the row disagree."""
    whole, *halves = (
        max(growth(part, interval, order, spacing), key=lambda rate: rate.imag) for part in (d, *np.array_split(d, 2))
    )
    return complex(whole), abs(halves[1] - halves[0]) / 2


def straight_line(x: npt.ArrayLike, y: npt.ArrayLike, noise: npt.ArrayLike) -> tuple[Measured, Measured]:
    """Zero and slope of the line through points x, y (n,) whose y have the standard uncertainties `noise`.

    The uncertainties are those of the points carried over, and the scatter about the line where that is larger.
    """
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    weight = np.maximum(np.broadcast_to(noise, y.shape), np.finfo(float).eps * np.abs(y).max()) ** -2.0
    # About the weighted mean, height and slope are independent of each other, and one point may outweigh all others.
    x0, y0 = np.average(x, weights=weight), np.average(y, weights=weight)
    spread = np.sum(weight * (x - x0) ** 2)
    slope = np.sum(weight * (x - x0) * (y - y0)) / spread
    scatter = max(1.0, np.sum(weight * (y - y0 - slope * (x - x0)) ** 2) / max(1, len(x) - 2))
    height, rise = np.sqrt(scatter / weight.sum()), np.sqrt(scatter / spread)
    zero = x0 - y0 / slope
    return (
        Measured(float(zero), math.hypot(height / slope, (zero - x0) / slope * rise)),
        Measured(float(slope), float(rise)),
    )


def main(claims: Sequence[Claim]) -> int:
    """Judge the claims of one study from the command line; return 0 if they came out as expected, else 1."""
    parser = argparse.ArgumentParser(description=f"Run one study: {', '.join(claim.id for claim in claims)}.")
    parser.add_argument("-o", "--output", type=Path, default=Path("results"), metavar="DIR")
    parser.add_argument("--level", choices=[level.name.lower() for level in Level], default="default")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, metavar="N", help="processes (0: none)")
    args = parser.parse_args()
    level = Level[args.level.upper()]
    summary = results.open_directory(args.output)
    with progress.shown() as show, Campaign(args.output / results.RUNS, args.workers) as campaign:
        verdicts = []
        for claim in claims:
            campaign.report = lambda now, what=claim.id: show(what, now.done, now.total, now.failed)  # type: ignore[misc]
            verdicts.append(judge(claim, Lab(campaign, level)))
    results.save(summary.with_verdicts(level.name, verdicts), args.output)
    for table in tables.verdicts(verdicts):
        Console().print(table)
    return 0 if all(verdict.passed for verdict in verdicts) else 1
