"""The ball on the paper's coordinates under the general law: settled states are those of the closed form.

Nothing of the engine `mujoco` but its scene, and drag and inertia in the middle of a step. Semi-implicit
steps are leapfrog: places are half a step ahead of velocities. The ball's axes are left to turn: set
upright, its contacts would seem to be fixed on it. Margins keep contacts in sight, so that they need no
depth."""

from __future__ import annotations

import dataclasses
import math

import mujoco
import numpy as np
import pytest

import analytic
from mjsim import recorder, scene
from mjsim.contact_settings import ContactSettings
from mjsim.corrections import Ball, Velocity, corrections
from mjsim.coulomb import Coulomb
from model import Parameters, State

_NO_FRICTION, _NO_LOADS = (0.0,) * 4, (0.0,) * 2


def advance(x, p, duration, step):
    """The state after a time, s, and the velocities (steps, 6) of the joints before each step."""
    settings = dataclasses.replace(ContactSettings.at(step), servo=0.0, memory=False)
    ball = Ball.of(p, settings)._replace(lag=0.0, gain=0.0, memory=0.0)
    model = scene.build(p, settings)[0]
    data, law = mujoco.MjData(model), Coulomb(model, rigid=True, depth=0.0)
    place, velocity = (np.ravel(each) for each in recorder.joint_state(x, 0.0, p))
    data.qpos[:3], data.qvel[:] = place + step / 2 * velocity[:3], velocity
    velocities = np.empty((round(duration / step) + 1, 6))
    velocities[0], axes = velocity, np.eye(3).ravel()
    with law.acting(data):
        for n in range(len(velocities) - 1):
            theta = data.qpos[0]
            data.mocap_quat[0] = math.cos(theta / 2), 0, 0, math.sin(theta / 2)
            mujoco.mju_quat2Mat(axes, data.qpos[3:7])
            turned, last = axes.reshape(3, 3), velocities[max(n - 1, 0)]
            force = corrections(
                Velocity(*velocities[n]), Velocity(*last), p.R - data.qpos[1], p.omega_0,
                _NO_FRICTION, _NO_LOADS, ball,
            )[0]  # fmt: skip
            data.qfrc_applied[:3], data.qfrc_applied[3:] = force[:3], turned.T @ force[3:]
            mujoco.mj_step(model, data)
            mujoco.mju_quat2Mat(axes, data.qpos[3:7])
            velocities[n + 1] = *data.qvel[:3], *(turned @ data.qvel[3:])
    return recorder.state(data.qpos[:3] - step / 2 * data.qvel[:3], velocities[-1], p), velocities


@pytest.mark.parametrize(
    ("case", "omega_0", "eta"), [("RR", 9, 0.2), ("SS", 20, 0.2), ("NR", 25, 0.6)]
)
def test_a_settled_state_is_that_of_the_closed_form(case, omega_0, eta):
    p = Parameters.named("reference").replace(omega_0=float(omega_0), eta=eta)
    exact = State.one(analytic.solution(p, case).state)
    found, _ = advance(exact, p, 8.0, 1e-3)
    # What the first step's places leave decays as slowly as RR does: exp(-8 c / (1 + 2 j)).
    assert found.omega_c == pytest.approx(exact.omega_c, rel=1e-9)
    # The depth that rigid contacts keep by default is a lever: RR would seem to slip by 1e-6 rad/s.
    for slip in ("slip_x", "slip_y", "slip_z"):
        assert getattr(found, slip) == pytest.approx(getattr(exact, slip), abs=1e-7)
