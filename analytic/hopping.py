"""Does a ball hop for ever? A cheap screen by time stepping, and the event-driven simulation to confirm it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from analytic.ensemble import simulate_many
from analytic.settings import Settings
from analytic.simulation import simulate
from model import Case, Parameters
from model.arrays import Array

DURATION = 60.0
"""How long the screen follows a ball, in 1/c: transients decay as exp(-c t) at the slowest, but near folds."""
QUIET = 3.0
"""Without a landing for this long, in 1/c, a ball has settled."""
STEPS = 70
"""Steps of the screen in sqrt(R/g)."""
CONFIRMING = 12.0
"""How long the confirmation follows a ball, in 1/c; the last third of it counts."""
MOST_HOPS = 16
"""Longest period that is looked for, in landings on the floor."""
REPEATS = 1e-3
"""How closely the impulses of landings must repeat, relative to the largest."""


def screen(p: Parameters, x0s: npt.ArrayLike) -> tuple[npt.NDArray[np.bool_], Array, int]:
    """Which of the starts (n, 8) still hop after 60/c, by time stepping; the states then (n, 8); how many runs failed.

    One thread; p.c must be positive.
    """
    settings, lasts, unit = Settings(method="time-stepping", step=math.sqrt(p.R / p.g) / STEPS), DURATION / p.c, 1 / p.c
    runs = simulate_many(p, x0s, lasts, settings=settings, sample_interval=unit, quiet=QUIET * unit, threads=1)
    failed = np.array([bool(each) for each in runs.failure])
    hops = np.any(runs.landings[:, -int(QUIET) :] > 0, axis=1) & ~failed
    return hops, runs.x[:, -1], int(failed.sum())


@dataclass(frozen=True)
class Hopping:
    """A motion that hops on, in natural units."""

    landings: int
    """Landings on the floor in a period; 0 if none was found up to `MOST_HOPS`."""
    period: float
    """In sqrt(R/g); with no period found the mean time between landings."""
    omega_c: float
    """Mean omega_c/omega_0."""
    height: float
    """Greatest height y/R."""


def confirm(p: Parameters, x: npt.ArrayLike) -> Hopping | None:
    """The hopping that a state leads to by the event-driven simulation; None if it ends.

    Raises `SimulationError` if that can't go on.
    """
    run = simulate(p, x, CONFIRMING / p.c, sample_interval=CONFIRMING / p.c / 3000)
    late = run.time[-1] * 2 / 3
    on_floor = (run.events.impulse_A[:, 1] > 0) & np.isin(run.events.from_case, [Case.NR, Case.NS, Case.NN])
    landings = on_floor & (run.events.impulse_A[:, 1] > 1e-3 * p.m * math.sqrt(p.g * p.R))
    times, impulses = run.events.time[landings], run.events.impulse_A[landings, 1]
    times, impulses = times[times > late], impulses[times > late]
    if len(times) < 3 or run.time[-1] - times[-1] > 3 * np.max(np.diff(times)):
        return None
    count = next((n for n in range(1, min(MOST_HOPS, len(times) // 2) + 1) if _repeats(impulses, n)), 0)
    unit = math.sqrt(p.R / p.g)
    last = run.time > late
    span = times[-1] - times[-1 - count] if count else float(np.mean(np.diff(times)))
    return Hopping(
        count, float(span) / unit, float(np.mean(run.omega_c[last])) / p.omega_0, float(run.y[last].max()) / p.R
    )


def _repeats(impulses: Array, n: int) -> bool:
    return bool(np.max(np.abs(impulses[n:] - impulses[:-n])) <= REPEATS * impulses.max())
