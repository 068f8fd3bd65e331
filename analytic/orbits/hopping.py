"""Does a ball hop for ever? A cheap screen by time stepping, and the event-driven simulation to confirm it."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from analytic.orbits.fates import periodic
from analytic.simulation.ensemble import simulate_many
from analytic.simulation.settings import Settings, fitting_step
from analytic.simulation.simulator import simulate
from model import Case, Contact, Flow, Parameters, State
from model.arrays import Array

DURATION = 60.0
"""How long the screen follows a ball, in 1/c: transients decay as exp(-c t) at the slowest, but near folds."""
QUIET, LOOKS = 3.0, 12
"""Without a landing for this long, in 1/c, a ball has settled; how often that is looked for in this time."""
STEPS = 70
"""Steps of the screen in sqrt(R/g)."""
SEEN, SEEN_SAMPLES = 25.0, 4000
"""How long the ball is watched for a period, in sqrt(R/g): twice the longest that is looked for; and samples."""
CONFIRMING = 12.0
"""How long a ball with no period is followed, in 1/c, or four times `SEEN`; the last third of it counts."""


def screen(p: Parameters, x0s: npt.ArrayLike) -> tuple[npt.NDArray[np.bool_], Array, int]:
    """Which of the starts (n, 8) still hop after 60/c, by time stepping; the states then (n, 8); how many runs failed.

    One thread; p.c must be positive.
    """
    lasts, quiet = DURATION / p.c, QUIET / p.c
    settings = Settings(timestep=fitting_step(STEPS, p, Flow.steady(p.omega_0), lasts))
    runs = simulate_many(p, x0s, lasts, settings=settings, sample_interval=quiet / LOOKS, quiet=quiet, threads=1)
    failed = np.array([bool(each) for each in runs.failure])
    hops = np.any(runs.landings[:, -LOOKS:] > 0, axis=1) & ~failed
    return hops, runs.x[:, -1], int(failed.sum())


@dataclass(frozen=True)
class Hopping:
    """A motion that hops on, in natural units."""

    landings: int
    """Landings on the floor in a period; 0 if no periodic motion was found near it."""
    period: float
    """In sqrt(R/g); with no period found the mean time between landings."""
    omega_c: float
    """Mean omega_c/omega_0."""
    height: float
    """Greatest height y/R."""
    multiplier: float | None = None
    """Largest modulus of the Floquet multipliers; None without a period."""


def confirm(p: Parameters, x: npt.ArrayLike) -> Hopping | None:
    """The hopping that a state leads to by the event-driven simulation; None if it ends.

    That is a stable periodic motion near it if there is one; else the ball is followed for `CONFIRMING`.
    Raises `SimulationError` if the simulation can't go on.
    """
    unit = math.sqrt(p.R / p.g)
    seen = simulate(p, x, SEEN * unit, sample_interval=SEEN * unit / SEEN_SAMPLES)
    if not any(map(_lands, seen.events.from_case, seen.events.to_case)):
        return None
    fate = periodic(seen)
    if fate and fate.orbit and (landings := sum(itertools.starmap(_lands, fate.orbit.changes))):
        orbit = fate.orbit
        omega_c, height = State.of(orbit.mean).omega_c / p.omega_0, float(orbit.cycle.y.max()) / p.R
        return Hopping(landings, orbit.period / unit, omega_c, height, float(np.abs(orbit.multipliers).max()))
    lasts = max(CONFIRMING / p.c, 4 * SEEN * unit)
    run = simulate(p, seen.x[-1], lasts, sample_interval=lasts / SEEN_SAMPLES)
    last = run.time > run.time[-1] * 2 / 3
    times = run.events.time[list(map(_lands, run.events.from_case, run.events.to_case))]
    times = times[times > run.time[-1] * 2 / 3]
    if len(times) < 3 or run.time[-1] - times[-1] > 3 * np.max(np.diff(times)):
        return None
    between, omega_c = float(np.mean(np.diff(times))), float(np.mean(run.omega_c[last]))
    return Hopping(0, between / unit, omega_c / p.omega_0, float(run.y[last].max()) / p.R)


def _lands(before: int, after: int) -> bool:
    return Case(before).A is Contact.N and Case(after).A is not Contact.N
