"""Bifurcations of Table 5: the thresholds, from quantities that vanish there.

On one side of each threshold settled states are measured at a few omega_0, and what vanishes at the threshold is
extrapolated to zero: polynomials give omega_0 as a function of it. Theory chooses only where the points lie.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

import analytic
from analytic import StationarySolution, thresholds
from compare.claims import Check, Claim, Lab, Level
from compare.studies import COVERAGE, Bench, family, main, settled_case, settled_mean
from compare.tasks import Task
from mjsim import ContactSettings
from mjsim.measurement import Measured
from model import Case, Parameters, Trajectory
from model.arrays import Array

DISTANCES = {Level.QUICK: 1e-2 * 2.0 ** np.arange(5), Level.DEFAULT: 4e-3 * 2.0 ** np.arange(6)}
"""Distances of the points from the threshold, relative; the nearest first."""
LASTS = 25.0
"""Duration of every run, s: 25 time constants and more of the states with strong drag."""
OFFSET = 1.01
"""Start, in units of the predicted omega_c."""
LABELS = {"omega_01": "ω₀₁", "omega_02": "ω₀₂", "omega_03": "ω₀₃", "omega_04": "ω₀₄"}
HEIGHT = 400.0
"""Height at the start, in units of R, of a ball that sinks."""


@dataclass(frozen=True)
class Approach:
    """One side of a threshold."""

    threshold: str
    """Field of `analytic.Thresholds`."""
    name: str
    p: Parameters
    case: Case
    """Of the states measured."""
    side: int
    """1 above the threshold, -1 below."""
    symbol: str
    order: Callable[[Trajectory, Parameters], Array]
    """The quantity that vanishes, over the samples of a run."""
    turns: bool = False
    """The quantity doesn't vanish: omega_0 as its function has its maximum at the threshold (fold)."""

    @property
    def predicted(self) -> float:
        """The threshold by theory, rad/s."""
        return float(getattr(thresholds(self.p), self.threshold))

    def tasks(self, engine: str, level: Level) -> list[Task]:
        """A run at each omega_0, from a little off the state."""
        tasks = []
        for distance in DISTANCES[min(level, Level.DEFAULT)]:
            p = self.p.replace(omega_0=self.predicted * (1 + self.side * float(distance)))
            x = _state(self.case, p).x.copy()
            x[2] *= OFFSET
            x[0] = {Case.NR: 1.0, Case.NS: HEIGHT}.get(self.case, 0.0) * p.R
            settings = ContactSettings.at(4e-3) if engine == "mujoco" else None
            tasks.append(Task(engine=engine, parameters=p, x0=tuple(x.tolist()), t_end=LASTS, settings=settings))
        return tasks


def _state(case: Case, p: Parameters) -> StationarySolution:
    """The stable stationary solution of a case."""
    return next(s for s in analytic.stationary_solutions(p) if s.case is case and s.stable)


def check(lab: Lab, of: Approach, engine: str) -> Check:
    """The threshold that a row of runs shows."""
    tasks = of.tasks(engine, lab.level)
    runs = lab.run(tasks)
    omegas = np.array([task.parameters.omega_0 for task in tasks])
    means = [settled_mean(run, of.order(run, task.parameters)) for task, run in zip(tasks, runs, strict=True)]
    found = (turning if of.turns else vanishing)(omegas, means)
    cases = [family(settled_case(run)) for run in runs]
    odd = [case for case in cases if case is not family(of.case)]
    where = f"{of.symbol} {'turns' if of.turns else '→ 0'}, from {'above' if of.side > 0 else 'below'}"
    pair = family(of.case), odd[0] if odd else family(of.case)
    return Bench(lab, of.name).number(tasks[0], LABELS[of.threshold], "rad/s", where, of.predicted, found, pair)


def vanishing(omegas: Array, order: Sequence[Measured]) -> Measured:
    """Where an order parameter vanishes: the polynomial through all points, against that without the farthest."""
    values = np.array([m.value for m in order])
    noise = np.array([m.uncertainty for m in order])

    if not np.all(np.isfinite(values)):
        return Measured(math.nan, math.nan)

    def zero(of: Array, count: int) -> float:
        scaled = of[:count] / np.abs(values).max()
        return float(np.polynomial.Polynomial.fit(scaled, omegas[:count], count - 1)(0.0))

    return _with_noise(zero, values, noise)


def turning(omegas: Array, order: Sequence[Measured]) -> Measured:
    """The maximum of omega_0 as a polynomial of the parameter, against that without the farthest point."""
    values = np.array([m.value for m in order])
    noise = np.array([m.uncertainty for m in order])

    def maximum(of: Array, count: int) -> float:
        scaled = of[:count] / np.abs(values).max()
        fit = np.polynomial.Polynomial.fit(scaled, omegas[:count], count - 1)
        places = [root.real for root in fit.deriv().roots() if abs(root.imag) < 1e-9]
        return float(fit(min(places, key=lambda s: abs(s - scaled[0])))) if places else math.nan

    return _with_noise(maximum, values, noise)


def _with_noise(estimate: Callable[[Array, int], float], values: Array, noise: Array) -> Measured:
    count = len(values)
    best, other = estimate(values, count), estimate(values, count - 1)
    carried = [estimate(values + shift, count) - best for shift in np.diag(noise)]
    rounding = np.finfo(float).eps * abs(best) * 2**count
    return Measured(best, math.hypot(best - other, rounding, *carried))


REFERENCE, ROUGH = Parameters.named("reference"), Parameters.named("high-wall-friction")
DRAGGED, ROUGH_DRAGGED = REFERENCE.replace(c=4.0), ROUGH.replace(c=4.0)
"""With strong drag the states settle sooner; omega_01 … omega_03 don't depend on it."""


def _unused(run: Trajectory, p: Parameters) -> Array:
    return np.asarray(1 - run.force_B[:, 1] / (p.eta * run.force_B[:, 0]))


APPROACHES = {
    "P3": [
        Approach("omega_01", "reference, c = 4", DRAGGED, Case.SS, 1, "ω̃_z", lambda run, p: run.slip_z),
    ],
    "P2": [
        Approach("omega_02", "reference, c = 4", DRAGGED, Case.NR, 1, "1 − B_y/(ηB_x)", _unused),
        Approach("omega_02", "reference, c = 4", DRAGGED, Case.NS, -1, "v_y", lambda run, p: run.v_y),
    ],
    "NT1": [
        Approach(
            "omega_03", "high-wall-friction, c = 4", ROUGH_DRAGGED, Case.RR, -1, "A_x + A_y",
            lambda run, p: run.force_A[:, 0] + run.force_A[:, 1],
        ),
    ],
    "F": [
        Approach("omega_04", "reference", REFERENCE, Case.SS, -1, "ω₀(ω̃_x)", lambda run, p: run.slip_x, turns=True),
    ],
}  # fmt: skip


def _study(bifurcation: str, lab: Lab) -> list[Check]:
    engines = ("mujoco",) if lab.level is Level.QUICK else ("mujoco", "event")
    # What the other claims need runs in the same batch.
    lab.campaign.complete(t for some in APPROACHES.values() for of in some for t in of.tasks("mujoco", lab.level))
    return [check(lab, of, engine) for of in APPROACHES[bifurcation] for engine in engines]


def _claim(bifurcation: str, statement: str) -> Claim:
    return Claim(
        id=f"table-5-{bifurcation}", source=f"Table 5, {bifurcation}", statement=statement,
        prediction="closed-form threshold; omega_04 by a bracketed root of (89)",
        measurement=(
            "settled states at a few ω₀ on one side; a quantity that vanishes at the threshold is extrapolated to "
            "zero, or for the fold ω₀ along the branch to its maximum"
        ),
        tolerance=(
            f"{COVERAGE:g} standard uncertainties: what leaving out the farthest point changes, and the scatter and "
            "drift of the settled states"
        ),
        study=lambda lab: _study(bifurcation, lab),
    )  # fmt: skip


CLAIMS = (
    _claim("P3", "At ω₀₁ two-point rolling gives way to slipping at both points, whose slip begins at zero."),
    _claim("P2", "At ω₀₂ the sinking state (NS) and the state carried by the wall (NR) meet."),
    _claim("NT1", "With η > j two-point rolling ends at ω₀₃, where gyroscopic moment and wall carry all the weight."),
    _claim("F", "The stable branch of slipping at both points ends in a fold at ω₀₄."),
)

if __name__ == "__main__":
    sys.exit(main(CLAIMS))
