"""Free balls get wrong what they must: facets judder, and who flies through the wall has diverged."""

import pytest

import mjsim
from compare.kit.engines import as_it_comes
from mjsim import ContactSettings
from model import Parameters, SimulationError, State

P = Parameters.named("reference").replace(omega_0=12.0)
FACETS = as_it_comes(1e-3)


@pytest.mark.parametrize("settings", [FACETS, ContactSettings.rigid_at(1e-3)])
def test_a_free_ball_that_flies_through_the_wall_has_diverged(settings) -> None:
    for omega_c in (1e6, 1e9):
        with pytest.raises(SimulationError, match="the simulation diverged by t = "):
            mjsim.simulate(P, State(omega_c=omega_c), 0.1, settings=settings)


def test_facets_judder() -> None:
    """The edges of 90 facets turn the path by 4 degrees each, and take away speed."""
    run = mjsim.simulate(P, State(omega_c=12.0), 3.0, settings=FACETS)
    assert run.omega_c[-100:].mean() / 12.0 < 0.9
