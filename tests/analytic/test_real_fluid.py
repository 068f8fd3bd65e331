"""A ball that rolls in a fluid with torque obeys Newton and Euler, and its mirror image, too."""

import numpy as np
import pytest

from analytic import simulate
from analytic.flowmeter import real_fluid
from analytic.mechanics import drag
from model import Case, InputError, Parameters, State


@pytest.mark.parametrize("name", ["steel-in-water", "plastic-in-oil", "air", "reference"])
@pytest.mark.parametrize("layer", [False, True])
def test_rolling_with_the_torque_obeys_newton_and_euler(name, layer):
    """(20) with one torque more, as vectors, with the forces of rolling that the two balances
    leave."""
    p = Parameters.named(name)
    at = real_fluid.rolling(p, layer)
    inwards, up, _ = np.eye(3)
    spin = p.R / p.r * at.omega_c * (inwards - up)
    relative = spin - p.omega_0 * up
    inertia = p.j * p.m * p.r**2
    Re = np.linalg.norm(relative) * p.r**2 / p.nu_f if p.nu_f else np.nan
    assert at.Re == pytest.approx(Re, nan_ok=True)
    torque = -inertia * real_fluid.torque_rate(np.linalg.norm(relative), p, layer) * relative
    lag = p.R * (at.omega_c - p.omega_0)
    push = -p.m * drag.coefficient(abs(lag), p) * lag
    # Moments along x and y give A_z and B_z; the orbit is steady if they hold the fluid's push.
    A_z, B_z = torque[0] / p.r, -torque[1] / p.r
    assert A_z + B_z + push == pytest.approx(0, abs=1e-9 * push)
    for B_y in (0.0, 0.3 * p.m * p.g):
        A_x = B_y - p.j * p.m * p.R * at.omega_c**2
        F_A, F_B = [A_x, p.m * p.g - B_y, A_z], [p.m * p.R * at.omega_c**2 - A_x, B_y, B_z]
        moment = np.cross(-p.r * up, F_A) + np.cross(-p.r * inwards, F_B) + torque
        turning, error = np.cross(at.omega_c * up, inertia * spin), 1e-9 * np.abs(moment).max()
        np.testing.assert_allclose(moment, turning, atol=error)


def test_the_torque_is_of_the_order_of_the_drag_for_every_ball():
    """8 pi rho_f nu r/(j m), which is 10/3 of the drag's rate for a uniform ball; the two laws meet
    at Re = 8."""
    p = Parameters.named("steel-in-water")
    rho_f = p.density_ratio * p.m / (4 / 3 * np.pi * p.r**3)
    stokes = real_fluid.torque_rate(1.0, p, layer=False)
    assert stokes == pytest.approx(8 * np.pi * rho_f * p.nu_f * p.r / (p.j * p.m))
    assert stokes == pytest.approx(10 / 3 * p.c)
    spins = np.array([7.9, 8.0, 8.1, 2000.0]) * p.nu_f / p.r**2
    rates = [real_fluid.torque_rate(spin, p) / stokes for spin in spins]
    assert rates[:3] == pytest.approx([1.0] * 3, abs=5e-3)
    assert rates[3] == pytest.approx(2000 / (16 * np.pi) * (6.45 / np.sqrt(2000) + 32.1 / 2000))


def test_time_stepping_takes_the_torque_and_the_event_driven_simulation_refuses_it():
    """Where friction suffices the ball stays in the stationary motion; the work of the torque is in
    the balance."""
    p = Parameters.named("reference").replace(mu=1.0, eta=1.0, fluid_torque=10 / 3)
    start = State(omega_c=real_fluid.rolling(p).omega_c)
    run = simulate(p, start, 2.0, method="time-stepping", timestep=2e-3)
    assert np.abs(run.omega_c - start.omega_c).max() <= 1e-12
    assert run.cases[-1] is Case.RR
    up = State(y=9.0, h=0.02, slip_x=30.0, slip_y=-40.0)
    thrown = simulate(p, up, 0.2, method="time-stepping", timestep=1e-3)
    balance = thrown.header.settings
    assert abs(balance["energy_residual"]) < 1e-9 * balance["energy_scale"]
    says = r"fluid_torque = 3\.33333 s-1: the event-driven simulation leaves"
    with pytest.raises(InputError, match=says):
        simulate(p, start, 1.0)


def test_the_mirror_image_and_where_nothing_moves():
    p = Parameters.named("steel-in-water")
    there, back = (real_fluid.rolling(p.replace(omega_0=flow)) for flow in (15.0, -15.0))
    assert back.omega_c == -there.omega_c
    assert (back.shift, back.friction) == (there.shift, there.friction)
    assert np.isnan(real_fluid.rolling(p.replace(omega_0=0.0)).shift)
    # by the fluid's inertia alone
    assert real_fluid.model_error(p.replace(omega_0=0.0)) > real_fluid.LIMIT
    assert real_fluid.model_error(Parameters.named("reference")) == 0.0
