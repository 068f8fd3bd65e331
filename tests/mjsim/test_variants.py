"""What each variant of the scene gets wrong is as predicted."""

import numpy as np
import pytest

import mjsim
from mjsim import ContactSettings
from model import Parameters, SimulationError, State

P = Parameters.named("reference").replace(omega_0=12.0)
ROLLING = [0, 0, 12.0, 0, 0, 0]


def free(**changes):
    return ContactSettings.at(1e-3, coordinates="free", memory=False, order=1, **changes)


def test_free_joint_creeps_up_the_wall() -> None:
    """MuJoCo drives J v' where it should drive J v' + J' v of the turning contact frame: B slips at R omega_c^2/b_f."""
    settings = free(impratio=1e6)
    run = mjsim.simulate(P, ROLLING, 6.0, settings=settings)
    assert {case.B.name for case in run.cases[10:]} == {"R"}
    predicted = P.R * run.omega_c[-1] ** 2 / settings.b_f
    assert P.r * run.slip_z[-1] == pytest.approx(predicted, rel=0.01)
    assert np.all(np.diff(run.theta) > 0)


@pytest.mark.filterwarnings("ignore:the ball slips")
@pytest.mark.parametrize("settings", [free(servo=0.0), free(wall="prism", servo=0.0), ContactSettings.rigid_at(1e-3)])
def test_a_free_ball_that_flies_through_the_wall_has_diverged(settings) -> None:
    for omega_c in (1e6, 1e9):
        with pytest.raises(SimulationError, match="the simulation diverged by t = "):
            mjsim.simulate(P, State(omega_c=omega_c), 0.1, settings=settings)


def test_prism_judders() -> None:
    """The edges of 36 facets turn the path by 10 degrees each: the ball is not held on the wall."""
    run = mjsim.simulate(P, ROLLING, 3.0, settings=free(wall="prism", facets=36, servo=0.0))
    assert np.mean(run.force_B[:, 0] > 0) < 0.9
    assert abs(run.omega_c[-100:].mean() / 12.0 - 1) > 0.1
