"""Formulas are what MuJoCo does, and settings that fit a problem keep slipping continuous."""

import contextlib
import dataclasses
import itertools

import numpy as np
import pytest

import analytic
import mjsim
from mjsim import ContactSettings
from model import Case, Parameters, State


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
    fast, p = ContactSettings.at(2e-3), Parameters.named("reference")
    for mu, eta in itertools.product(np.linspace(0, 3, 13), repeat=2):
        assert fast.suited(p.replace(mu=mu, eta=eta)).contact_decay(mu, eta) < 1


@pytest.mark.parametrize(
    ("solref", "holds"), [((3, 0.75), True), ((2, 1.0), True), ((2, 0.5), False)]
)
def test_decay_tells_which_contacts_hold_a_slipping_ball(solref, holds) -> None:
    made = {"m": 0.016, "r": 0.0221, "R": 0.0613, "j": 0.657, "mu": 0.92, "eta": 0.4}
    p, step = Parameters(**made, g=7.9, c=0.907, omega_0=15.9), 2e-3
    (steady,) = (each for each in analytic.stationary_solutions(p) if each.case is Case.SS)
    stiff = solref[0] * step, solref[1]
    settings = ContactSettings.for_problem(p, step, p.R * p.omega_0, solref=stiff)
    assert (settings.contact_decay(p.mu, p.eta) < 1) == holds
    with contextlib.nullcontext() if holds else pytest.warns(UserWarning, match="chatters"):
        run = mjsim.simulate(p, steady.x, 0.4, settings=settings, sample_interval=step)
    load, expected = run.force_A[-20:, 1], steady.force_A[1]
    assert (np.abs(load - expected).max() < 1e-2 * expected) == holds


ROLLING = Parameters.named("reference").replace(omega_0=10.0)
SLIPPING = ROLLING.replace(omega_0=25.0)
STEP = 1e-3


def damped(solimp, damping=0.5, step=STEP, **more):
    """Settings with the given impedance and friction damping b_f h."""
    soft = 2 * step / (solimp * damping)
    return ContactSettings.at(step, solimp=solimp, solreffriction=soft, **more)


def slipping(settings):
    """The last sample of steady slipping at both points, which leaves out that the contact turns
    within a step, by an angle whose square counts."""
    start = State(omega_c=13.85, slip_x=-4.0, slip_z=10.0)
    *_, block = mjsim.Run(SLIPPING, start, 10.0, settings=settings)
    return block[-1], (13.85 * STEP) ** 2


@pytest.mark.parametrize("step", [4e-3, 1e-3])
def test_a_ball_at_rest_sinks_in_by_its_depth(step):
    still, settings = ROLLING.replace(omega_0=0.0), damped(0.03, step=step)
    run = mjsim.simulate(still, State(h=0.01), 2.0, settings=settings)
    assert -run.gap_A[-1] == pytest.approx(settings.depth(still.g), rel=1e-8)


@pytest.mark.parametrize(("contact", "axis", "mu"), [("A", 1, SLIPPING.mu), ("B", 0, SLIPPING.eta)])
def test_what_slips_sinks_in_less(contact, axis, mu):
    settings = damped(0.03, impratio=30.0)
    last, turning = slipping(settings)
    load = float(last[f"force_{contact}"][axis]) / SLIPPING.m
    hover = settings.hover_number(load, mu, float(last[f"slip_speed_{contact}"]))
    depth = settings.depth(load) * (1 - hover + mu**2 / settings.impratio)
    assert -last[f"gap_{contact}"] == pytest.approx(depth, rel=turning)


@pytest.mark.parametrize("impratio", [1e3, 1e5])
def test_what_rolls_creeps(impratio):
    """The solver stops within its tolerance, 1e-12, of the least cost, which is quadratic in the
    force, and impratio times as steep in the friction rows."""
    settings = damped(0.3, impratio=impratio)
    run = mjsim.simulate(ROLLING, State(omega_c=ROLLING.omega_0), 10.0, settings=settings)
    friction = float(np.hypot(run.force_A[-1, 0], run.force_A[-1, 2])) / ROLLING.m
    creep = settings.creep_speed(friction)
    assert run.slip_speed_A[-1] == pytest.approx(creep, rel=np.sqrt(1e-12 * impratio))


def test_slipping_begins_to_hover_at_the_damping_that_takes_all_its_depth():
    """On a line through two smaller ones: near it a contact that is disturbed goes on hovering."""
    settings = [damped(0.3, damping) for damping in (0.1, 0.2)]
    (first, _), (last, turning) = map(slipping, settings)
    load, slip = last["force_A"][1] / SLIPPING.m, last["slip_speed_A"]
    softer = settings[1].regularisation * load * (1 + SLIPPING.mu**2 / settings[1].impratio)
    limit = 0.2 * softer / (SLIPPING.mu * settings[1].b_f * slip)
    crossing = 0.1 + 0.1 * first["gap_A"] / (first["gap_A"] - last["gap_A"])
    assert crossing == pytest.approx(limit, rel=turning)


@pytest.mark.parametrize("impratio", [1e2, 1e5])
def test_slip_dies_out_in_rolling_by_a_share_a_step(impratio):
    """1 - b_f h A/(A + R_t), of a spin too slow to reach the cone; drag adds c h."""
    settings = damped(0.03, impratio=impratio)
    p = ROLLING.replace(omega_0=0.0, mu=1.0, eta=0.0)  # it is away from the wall
    spin = 0.5 * float(settings.creep_speed(p.mu * p.g)) / p.r
    x0 = -settings.depth(p.g), 0, 0, 0, 0, spin, 0.01, 0  # as deep as the floor bears it
    run = mjsim.simulate(p, x0, 0.02, settings=settings, sample_interval=STEP)
    share = 1 / (1 + settings.regularisation / impratio / (1 + 1 / p.j))
    left = run.slip_speed_A[3] / run.slip_speed_A[2]
    assert left == pytest.approx(1 - 0.5 * share, rel=p.c * STEP)
