"""Event-driven simulation, time stepping and MuJoCo agree at random sets of parameters and starts."""

import os
import warnings
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import numpy as np
import pytest

import analytic
import mjsim
from mjsim import ContactSettings
from model import SimulationError
from tests.random_motions import random_start

SETS = int(os.environ.get("DUALBALL_SETS", "250"))
DURATION, STEP = 2.0, 1.25e-4
"""Of a run, and of one of its time steps, s."""
AGREE = 0.005
"""Difference of omega_c at the end, in units of omega_0, up to which simulators agree."""
BY_CHANCE = 2
"""Sets of 250 that may differ more, at any step: undisturbed, a ball may roll on where a slight slip would grow
(docs/theory.md, section 7), and does so for as long as one of the simulators likes."""


def ends(seed):
    """omega_c/omega_0 after the run by each simulator, or what went wrong with it."""
    p, x0 = random_start(seed, on_wall=True)
    simulators = {
        "event": analytic.simulate,
        "event, rolling on": partial(analytic.simulate, leave_rolling="infeasible"),
        "time-stepping": partial(analytic.simulate, method="time-stepping", timestep=STEP),
        "mujoco": partial(mjsim.simulate, settings=ContactSettings.for_problem(p, STEP)),
    }
    found = {}
    warnings.simplefilter("ignore", UserWarning)  # of contacts that chatter: what comes of it is to be seen
    for name, simulate in simulators.items():
        try:
            found[name] = float(simulate(p, x0, DURATION, sample_interval=DURATION / 100).omega_c[-1]) / p.omega_0
        except SimulationError as error:
            found[name] = str(error)
    return found


@pytest.mark.slow
def test_three_simulators_agree_on_random_sets(capsys):
    differ, failed, unexplained = {}, {}, []
    with ProcessPoolExecutor() as pool:
        for seed, found in enumerate(pool.map(ends, range(SETS))):
            if any(isinstance(each, str) for each in found.values()):
                failed[seed] = found
                continue
            rolls_on = found.pop("event, rolling on")
            if np.ptp(list(found.values())) > AGREE:
                differ[seed] = found
                unexplained += [seed] if abs(rolls_on - found["event"]) < AGREE else []
    with capsys.disabled():
        print(f"\nseeds whose omega_c/omega_0 differ: {differ}; that failed: {failed}", flush=True)
    assert not failed
    assert not unexplained
    assert len(differ) <= BY_CHANCE * max(1, SETS / 250)
