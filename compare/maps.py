"""Figs. 7 and 8: at random points of the parameter planes, the stationary states found are those predicted.

At every point the ball starts from rest, rolling with the fluid on the floor and high up on the wall, and near every
state that is predicted to attract. The set of cases in which it ends must be the predicted set.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

import analytic
from analytic import thresholds
from compare.claims import Check, Claim, Lab, Level
from compare.stationary import attractors
from compare.studies import Bench, family, main, settled_case
from compare.tasks import Task
from mjsim import ContactSettings
from model import Case, Parameters
from model.arrays import Array

PLANE = Parameters.named("reference").replace(c=2.0)
"""With this drag eta_cr, 0.13 at mu = 0.2, is well inside the plane, and states settle within seconds."""
ETA, OMEGA = (0.02, 0.8), (3.0, 36.0)
"""Ranges of the plane; omega_0 in rad/s."""
DEAD_BAND = 0.02
"""Relative distance of omega_0 from every threshold within which no point is taken: settling slows down there."""
COUNT = {
    "event": {Level.QUICK: 24, Level.DEFAULT: 200, Level.FULL: 1000},
    "mujoco": {Level.QUICK: 10, Level.DEFAULT: 200, Level.FULL: 1000},
}
SEED = 7
LASTS = 20.0
"""Duration of every run, s: 20 time constants of the slowest mode but near a threshold."""
SINKS = 250.0
"""Height in m above the floor at which a ball starts that may sink, at less than 5 m/s."""
FASTEST = 5.0 * PLANE.g / (PLANE.R * OMEGA[0] ** 2)
"""Slip speed in m/s up to which contact is to be continuous under the load of gravity. The wall carries no more than
R omega_c^2, so that at the slowest flow a ball that sinks at 5 m/s is as near to hovering."""
ENGINES: dict[str, analytic.Settings | ContactSettings] = {
    "event": analytic.Settings(rtol=1e-6),
    "mujoco": ContactSettings.for_problem(PLANE, 4e-3, FASTEST),
}
FIGURES = ("fig-7", "fig-8")


@dataclass(frozen=True)
class Point:
    """A point of a plane, and what is predicted there."""

    p: Parameters
    predicted: frozenset[Case]
    """Cases that attract; SR counts as NR."""
    starts: tuple[tuple[float, ...], ...]


def points(figure: str, count: int) -> list[Point]:
    """Points that fill the plane of a figure evenly (Halton), but for the dead band round its curves."""
    found: list[Point] = []
    design = qmc.Halton(2, seed=SEED + FIGURES.index(figure))
    while len(found) < count:
        ((a, b),) = design.random(1)
        eta = ETA[0] + float(a) * (ETA[1] - ETA[0])
        p = PLANE.replace(eta=eta, omega_0=OMEGA[0] + float(b) * (OMEGA[1] - OMEGA[0]))
        if figure == "fig-8":
            p = p.replace(mu=eta)
        if _clear(p):
            found.append(_point(p))
    return found


def _clear(p: Parameters) -> bool:
    t = thresholds(p)
    limits = np.array([t.omega_01, t.omega_02, t.omega_03, t.omega_04])
    return not np.any(np.abs(limits / p.omega_0 - 1) < DEAD_BAND)


def _point(p: Parameters) -> Point:
    states = attractors(p)
    sinks = [s for s in analytic.stationary_solutions(p) if s.case is Case.NS]
    near = [s.x * np.where(np.arange(8) == 2, 1.01, 1.0) for s in states if s.case is Case.SS]
    high = _with(SINKS, p.omega_0)
    starts = [_with(0.0, 0.0), _with(0.0, p.omega_0), high, *near]
    cases = {family(s.case) for s in [*states, *sinks]}
    return Point(p, frozenset(cases), tuple(tuple(x.tolist()) for x in starts))


def _with(y: float, omega_c: float) -> Array:
    return np.array([y, 0, omega_c, 0, 0, 0, 0, 0], dtype=float)


def tasks(chosen: Sequence[Point], engine: str) -> list[list[Task]]:
    """The runs of every point."""
    return [
        [
            Task(
                engine=engine, parameters=point.p, x0=x0, t_end=LASTS, settings=ENGINES[engine],
                sample_interval=LASTS / 200,
            )
            for x0 in point.starts
        ]
        for point in chosen
    ]  # fmt: skip


def _study(figure: str, lab: Lab) -> list[Check]:
    """One check for every point and witness: how many cases were found that should not be, or not found."""
    found = []
    for engine in ENGINES:
        chosen = points(figure, COUNT[engine][lab.level])
        rows = tasks(chosen, engine)
        runs = iter(lab.run([task for row in rows for task in row]))
        for point, row in zip(chosen, rows, strict=True):
            cases = frozenset(family(settled_case(next(runs), 0.05)) for _ in row)
            p = point.p
            where = f"μ = {p.mu:.4f}, η = {p.eta:.4f}: {_named(cases)}"
            amiss = len(cases ^ point.predicted)
            found.append(Bench(lab, "reference, c = 2").count(row[0], "cases amiss", where, 0, amiss))
    return found


def _named(cases: frozenset[Case]) -> str:
    return " ".join(sorted(case.name for case in cases))


def _claim(figure: str, source: str, plane: str) -> Claim:
    return Claim(
        id=figure, source=source,
        statement=f"ω₀₁ … ω₀₄ divide the plane of {plane} and ω₀ into regions of the same stationary states.",
        prediction="stationary solutions with admissible forces that are stable, also with respect to slipping",
        measurement=(
            "random points; at each, runs from rest, rolling with the fluid, high up on the wall, and near a predicted "
            "slipping state; the set of cases in which they end (SR, which touches a floor that carries nothing, "
            "counts as NR)"
        ),
        tolerance=f"none: the sets must be equal; points within {DEAD_BAND:.0%} of a surface in ω₀ are not taken",
        study=lambda lab: _study(figure, lab),
    )  # fmt: skip


CLAIMS = (_claim("fig-7", "Fig. 7", "η"), _claim("fig-8", "Fig. 8", "μ = η"))

if __name__ == "__main__":
    sys.exit(main(CLAIMS))
