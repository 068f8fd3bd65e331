"""Bad settings are refused by name, and those that fit a problem keep slipping continuous."""

import contextlib
import dataclasses

import numpy as np
import pytest

import analytic
import mjsim
from mjsim import ContactSettings
from model import Case, Parameters


def test_mapping_round_trip() -> None:
    settings = ContactSettings.at(4e-3, impratio=50.0)
    assert ContactSettings.from_mapping(dataclasses.asdict(settings)) == settings


@pytest.mark.parametrize("timestep", [1e-4, 1e-3, 4e-3])
@pytest.mark.parametrize("name", Parameters.names())
def test_for_problem_keeps_slipping_continuous(timestep, name) -> None:
    p = Parameters.named(name).replace(omega_0=60.0)
    settings = ContactSettings.for_problem(p, timestep, p.R * p.omega_0)
    for friction in (p.mu, p.eta):
        assert settings.hover_number(p.g, friction, p.R * p.omega_0) <= 0.5
    assert settings.largest_timestep >= timestep * (1 - 1e-12)


def test_contacts_die_out_for_all_friction_up_to_one() -> None:
    fast = ContactSettings.at(2e-3)
    for mu in np.linspace(0, 3, 13):
        for eta in np.linspace(0, 3, 13):
            assert (
                fast.suited(Parameters.named("reference").replace(mu=mu, eta=eta)).contact_decay(
                    mu, eta
                )
                < 1
            )


@pytest.mark.parametrize(
    ("solref", "holds"), [((3, 0.75), True), ((2, 1.0), True), ((2, 0.5), False)]
)
def test_decay_tells_which_contacts_hold_a_slipping_ball(solref, holds) -> None:
    p = Parameters(
        m=0.016, r=0.0221, R=0.0613, j=0.657, mu=0.92, eta=0.4, g=7.9, c=0.907, omega_0=15.9
    )
    (steady,) = (each for each in analytic.stationary_solutions(p) if each.case is Case.SS)
    step = 2e-3
    settings = ContactSettings.for_problem(
        p, step, p.R * p.omega_0, solref=(solref[0] * step, solref[1])
    )
    assert (settings.contact_decay(p.mu, p.eta) < 1) == holds
    with contextlib.nullcontext() if holds else pytest.warns(UserWarning, match="chatters"):
        run = mjsim.simulate(p, steady.x, 0.4, settings=settings, sample_interval=step)
    load, expected = run.force_A[-20:, 1], steady.force_A[1]
    assert (np.abs(load - expected).max() < 1e-2 * expected) == holds
