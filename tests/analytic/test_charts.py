"""A motion begins in each case as its vector field says, and spends the energy that drag and friction take."""

import itertools

import numpy as np
import pytest

from analytic import simulate, vector_field
from model import Case, Flow, Parameters
from model.cases import TRAITS
from model.drag import LAWS
from model.kinematics import VARIABLES

P = Parameters.named("reference").replace(omega_0=17.0, mu=0.3, eta=0.45, nu_f=1e-4)
FLOW = Flow.ramp(17.0, 20.0, 1.0)
STEP = 1e-6


def start(case, rng):
    """A random state of the case."""
    values = dict(zip(VARIABLES, rng.normal(size=8) * [0.1, 0.3, 10, 20, 20, 20, 0, 0.3], strict=True))
    values |= {"y": abs(values["y"]), "h": P.R * rng.uniform(0.1, 0.9)}
    x = np.array([values[name] if name in TRAITS[case].active else 0.0 for name in VARIABLES])
    return x + (case is Case.RN) * np.eye(8)[5] * -x[7] / P.r


def lasting(case, p):
    """Motions in which the forces allow the case."""
    rng = np.random.default_rng(1)
    for _ in range(200):
        run = simulate(p, start(case, rng), 2 * STEP, FLOW, sample_interval=STEP)
        if set(run.cases) == {case} and not len(run.events):
            yield run


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("case", list(Case))
def test_rates_are_those_of_the_vector_field(case, law):
    """Differences err by round-off/STEP, and by STEP^2 times third derivatives; angles turn at some 1e3 rad/s."""
    p = P.replace(drag=law)
    runs = list(itertools.islice(lasting(case, p), 10))
    assert len(runs) >= 5
    for run in runs:
        slope, expected = (run.x[2] - run.x[0]) / (2 * STEP), vector_field(case, run.x[1], p, FLOW(STEP))
        np.testing.assert_allclose(slope, expected, rtol=1e-6, atol=1e-6 * np.max(np.abs(expected)))
        assert (run.theta[2] - run.theta[0]) / (2 * STEP) == pytest.approx(run.omega_c[1], abs=1e-6)
        assert run.header.settings["energy_residual"] < 1e-11 * run.header.settings["energy_scale"]
