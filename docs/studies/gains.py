"""What each correction of ours gains: one taken away at a time, against the event-driven
simulation.

``python -m docs.studies.tables docs/records/settings.md --only gains`` writes the table.
"""

from __future__ import annotations

import time
import warnings
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Any
from unittest import mock

import numpy as np

import analytic
import mjsim
from compare.kit.pages import Rows
from docs.studies import states
from mjsim import ContactSettings
from mjsim.corrections import Ball
from model import Parameters, SimulationError, State, Trajectory
from model.arrays import Array
from model.kinematics import state_units
from tests.random_motions import random_start

STEP = 1e-3
SEEDS, LASTS, SAMPLES = range(30), 1.0, 0.02
"""Random motions, how long each lasts and how often it is looked at, s."""
FALLING = State(y=100.0, v_y=-9.7, omega_c=7.489)
FALLS = Parameters.named("reference").replace(
    m=0.02, r=0.004, R=0.03, j=0.35, mu=0.15, eta=0.7, g=9.1, c=0.8, omega_0=7.489
)
"""A ball that slides down the wall as fast as drag lets it, 10 m/s, with a fifth of its weight on
the wall."""
Ball_of = Ball.of
Way = Callable[[Parameters], ContactSettings]


def _usual(p: Parameters) -> ContactSettings:
    return ContactSettings.for_problem(p, STEP)


def _without(**changes: Any) -> Way:
    return lambda p: ContactSettings.for_problem(p, STEP, **changes)


def _landings_left(p: Parameters) -> ContactSettings:
    return states.Unwatched(**vars(_usual(p)))


def _lifted(p: Parameters, settings: ContactSettings) -> Ball:
    return Ball_of(p, settings)._replace(hover_A=0.0, hover_B=0.0)


WAYS: dict[str, tuple[Way, AbstractContextManager[object]]] = {
    "all of them": (_usual, nullcontext()),
    "no memory of friction": (_without(memory=False), nullcontext()),
    "no servo, and so no landings": (_without(servo=0.0), nullcontext()),
    "forces of the beginning of a step (order 1)": (_without(order=1), nullcontext()),
    "slip lifts contacts, as in the engine's law": (_usual, mock.patch.object(Ball, "of", _lifted)),
    "contacts as fast on rough balls": (lambda p: ContactSettings.at(STEP), nullcontext()),
    "landings left to the contacts": (_landings_left, nullcontext()),
}
"""How a ball is simulated, each with one thing taken away."""


def gains() -> Rows:
    """Errors and cost, each with one correction taken away."""
    head = [
        "without",
        "RR at 12, SS at 25",
        "approach to SS at 25",
        "random, median",
        "75 %",
        "on the wall",
    ]
    exact = {seed: found for seed in SEEDS if (found := _exact(seed)) is not None}
    rows = [[*head, "relative time of these"]]
    usual = 0.0
    for (
        seed,
        found,
    ) in exact.items():  # scenes are built, and loops loaded, before anything is timed
        _error(seed, found, _usual)
    for name, (way, changed) in WAYS.items():
        with warnings.catch_warnings(), changed:
            warnings.simplefilter("ignore")  # of contacts that chatter
            begin = time.process_time()
            errors = [_error(seed, found, way) for seed, found in exact.items()]
            spent = time.process_time() - begin
            usual = usual or spent
            settled = max(abs(_held(state, way)) for state in (states.ROLLING, states.SLIPPING))
            approach = states.APPROACH
            run = _run(approach.p, approach.x0, approach.lasts, way)
            falls = mjsim.simulate(FALLS, FALLING, 2.0, settings=way(FALLS))
        touching = float(np.mean(falls.force_B[len(falls.time) // 2 :, 0] > 0))
        quarter, half = np.quantile(errors, [0.75, 0.5]).tolist()
        numbers = (settled, approach.errors(run.time, run.x)[0], half, quarter)
        rows.append([name, *map(states.number, numbers), f"{touching:.0%}", f"{spent / usual:.2f}"])
    return rows


def _held(state: states.Stationary, way: Way) -> float:
    p, x0, lasts, interval = state.run
    return state.held(
        mjsim.simulate(p, x0, lasts, settings=way(p), sample_interval=interval)
    ).omega_c


def _run(p: Parameters, x0: State, lasts: float, way: Way) -> Trajectory:
    return mjsim.simulate(p, x0, lasts, settings=way(p), sample_interval=SAMPLES)


def _exact(seed: int) -> Array | None:
    """The second half of a random motion; None if the event-driven simulation breaks down."""
    p, x0 = random_start(seed)
    try:
        sharp = analytic.Settings(rtol=1e-10)
        run = analytic.simulate(
            p, x0, LASTS, settings=sharp, sample_interval=SAMPLES, initial_impact=True
        )
    except SimulationError:
        return None
    return run.x[len(run.time) // 2 :]


def _error(seed: int, exact: Array, way: Way) -> float:
    """Rms of a random motion in natural units, rms over the coordinates; infinite if it breaks
    down."""
    p, x0 = random_start(seed)
    try:
        run = _run(p, x0, LASTS, way)
    except SimulationError:
        return float("inf")
    off = (run.x[-len(exact) :] - exact) / state_units(p)
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))
