"""Past the vessel's axis, where polar coordinates end.

A ball that comes near the axis takes shorter and shorter steps. At the finest it is taken past the axis, for a fraction
of a whole step, with the acceleration that it had last in the resting frame; then the engine goes on.
"""

from __future__ import annotations

import math

import numpy as np

from mjsim import recorder
from mjsim.balls import Balls
from model import Parameters
from model.arrays import Array
from model.kinematics import Motion, from_world, to_world


def acceleration(balls: Balls, k: int, p: Parameters) -> Array:
    """What the last step of run k changed in velocity and spin, along world axes, (6,), m s-2 and rad s-2."""
    h, lead, v, last = balls.steps[k], balls.leads[k], balls.qvel[:, k], balls.last[:, k]
    place = balls.qpos[:3, k] - lead * (v + (v - last) / h * lead / 2)[:3]
    now, before = _motion(place, v, p), _motion(place - h * (v + last)[:3] / 2, last, p)
    change: Array = np.concatenate([now.velocity - before.velocity, now.spin - before.spin]) / h
    return change


def advance(balls: Balls, k: int, p: Parameters, rates: Array) -> None:
    """Take run k a step on with such an acceleration."""
    h, lead = balls.steps[k], balls.leads[k]
    place = balls.qpos[:3, k] - lead * balls.qvel[:3, k]
    now = _motion(place, balls.qvel[:, k], p)
    velocity, spin = now.velocity + h * rates[:3], now.spin + h * rates[3:]
    position = now.position + h * (now.velocity + velocity) / 2
    if math.hypot(*position[:2]) < 1e-3 * h * math.hypot(*velocity[:2]):  # on the axis there is no direction
        position += 2e-3 * h * velocity
    x, azimuth = from_world(Motion(position, velocity, spin), p)
    theta = float(azimuth) + math.tau * round((place[0] - float(azimuth)) / math.tau)
    balls.qpos[:, k], balls.qvel[:, k] = recorder.joint_state(x.stacked(), theta, p)
    balls.last[:, k] = balls.qvel[:, k]
    balls.qpos[:3, k] += lead * balls.qvel[:3, k]


def _motion(place: Array, v: Array, p: Parameters) -> Motion:
    """Motion in world axes from coordinates of the joints (azimuth, h, y) and velocities (6,)."""
    x = recorder.state(np.append(place, [1.0, 0.0, 0.0, 0.0]), v, p)
    return to_world(x.stacked(), place[0], p)
