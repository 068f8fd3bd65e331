"""Figs. 9-11: bifurcation diagrams, by the spin of the ball on the wall, omega_x^0 of (91)."""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass

import analytic
from analytic.bifurcation import wall_spin
from compare import branches
from compare.claims import Check, Claim, Lab, Level
from compare.studies import COVERAGE, Bench, family, main, settled_case, settled_mean
from compare.tasks import Task
from mjsim import ContactSettings
from mjsim.measurement import Measured
from model import Case, Parameters
from model.arrays import Array

LASTS = 30.0
"""Duration of every run, s."""
OFFSET = 1.01
"""Start, in units of the predicted omega_c; where only the wall carries the ball, of the predicted slip_x."""
HEIGHT = {Case.NR: 1.0, Case.NS: 2e3}
"""Height at the start, in units of R."""
SETTLED = 1e-8
"""Relative accuracy of a settled state: of the integrator, and of the servo that removes penetration."""
FASTEST = 3.0
"""Slip speed up to which contact is to be continuous, m/s."""
REFERENCE, ROUGH = Parameters.named("reference"), Parameters.named("high-wall-friction")
DRAGGED = REFERENCE.replace(c=4.0)
"""With strong drag the ball sinks slowly."""


@dataclass(frozen=True)
class Row:
    """States of one case at several omega_0."""

    name: str
    p: Parameters
    case: Case
    omegas: tuple[float, ...]

    def tasks(self, engine: str, level: Level) -> list[Task]:
        """A run at each omega_0, every other one of them at the quick level."""
        omegas = self.omegas[:: 2 if level is Level.QUICK else 1]
        settings = ContactSettings.for_problem(REFERENCE, 4e-3, FASTEST) if engine == "mujoco" else None
        return [
            Task(
                engine=engine, parameters=p, x0=tuple(self._start(p).tolist()), t_end=LASTS, settings=settings,
                sample_interval=LASTS / 500,
            )
            for p in (self.p.replace(omega_0=omega_0) for omega_0 in omegas)
        ]  # fmt: skip

    def state(self, p: Parameters) -> analytic.StationarySolution:
        """The stable stationary solution."""
        return next(s for s in analytic.stationary_solutions(p) if s.case is self.case and s.stable)

    def _start(self, p: Parameters) -> Array:
        x = self.state(p).x.copy()
        x[2 if self.case in (Case.RR, Case.SS) else 3] *= OFFSET if self.case is not Case.NS else 1.0
        x[0] = HEIGHT.get(self.case, 0.0) * p.R
        return x


FIGURES: dict[str, list[Row]] = {
    "fig-9": [
        Row("reference, c = 4", DRAGGED, Case.NS, (6.0, 12.0, 18.0, 24.0, 30.0)),
        Row("reference", REFERENCE, Case.NR, (32.0, 35.0, 38.0, 42.0, 46.0)),
    ],
    "fig-10": [
        Row("reference", REFERENCE, Case.RR, (3.0, 6.0, 9.0, 12.0, 13.4)),
        Row("reference", REFERENCE, Case.SS, (14.0, 17.0, 20.0, 24.0, 28.0, 32.0, 36.0, 39.0, 41.0)),
        Row("reference", REFERENCE, Case.SR, (33.0, 37.0, 41.0, 45.0)),
    ],
    "fig-11": [
        Row("high-wall-friction", ROUGH, Case.RR, (4.0, 10.0, 15.0, 19.0, 21.8)),
        Row("high-wall-friction", ROUGH, Case.NR, (18.5, 21.0, 24.0)),
        Row("high-wall-friction", ROUGH, Case.SR, (23.0, 26.0, 30.0, 34.0)),
    ],
}


def engines(level: Level) -> Sequence[str]:
    """The witnesses of a level."""
    return ("mujoco",) if level is Level.QUICK else ("mujoco", "event")


def _study(figure: str, lab: Lab) -> list[Check]:
    # What the other figures need runs in the same batch.
    everything = [(row, engine) for rows in FIGURES.values() for row in rows for engine in engines(lab.level)]
    lab.campaign.complete(task for row, engine in everything for task in row.tasks(engine, lab.level))
    found = []
    for row in FIGURES[figure]:
        for engine in engines(lab.level):
            tasks = row.tasks(engine, lab.level)
            for task, run in zip(tasks, lab.run(tasks), strict=True):
                p = task.parameters
                mean = settled_mean(run, run.slip_x + p.R / p.r * run.omega_c)
                predicted = wall_spin(row.state(p), p)
                measured = Measured(mean.value, math.hypot(mean.uncertainty, SETTLED * p.R / p.r * p.omega_0))
                cases = family(row.case), family(settled_case(run))
                bench = Bench(lab, row.name)
                found.append(bench.number(task, "ω_x⁰", "rad/s", row.case.name, predicted, measured, cases))
    return found + (_beyond_fold(lab) if figure == "fig-10" else [])


def _beyond_fold(lab: Lab) -> list[Check]:
    """The unstable part of the branch, from the border between the attractors."""
    found, bench = [], Bench(lab, "reference")
    for line, border, task in branches.found(lab):
        p, toward = line.p, line.d[3] + line.p.R / line.p.r * line.d[2]
        predicted = float(line.x[3] + p.R / p.r * line.x[2])
        measured = Measured(predicted + border.value * toward, abs(toward) * border.uncertainty)
        where = f"SS, unstable, {line.name}"
        found.append(bench.number(task, "ω_x⁰", "rad/s", where, predicted, measured))
    return found


def _claim(id: str, source: str, statement: str) -> Claim:
    return Claim(
        id=id, source=source, statement=statement,
        prediction="(91) of the closed-form stationary solutions",
        measurement="runs from 1 % off, averaged over their last tenth; the unstable part from borders of attraction",
        tolerance=(
            f"{COVERAGE:g} standard uncertainties: scatter and drift of the window, and {SETTLED:g} of ω₀R/r for "
            "integrator and servo; the last bracket of a border"
        ),
        study=lambda lab: _study(id, lab),
    )  # fmt: skip


CLAIMS = (
    _claim("fig-9", "Fig. 9", "Off the floor, the spin on the wall rises with ω₀ up to ω₀₂ (NS) and falls above (NR)."),
    _claim("fig-10", "Fig. 10", "For η < j rolling, slipping, its unstable part and the lifted state join as drawn."),
    _claim("fig-11", "Fig. 11", "For η > j rolling ends at ω₀₃ upon the state whose spin falls like 1/ω₀."),
)

if __name__ == "__main__":
    sys.exit(main(CLAIMS))
