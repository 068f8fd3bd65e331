"""A run between its samples: its state at any time, and how the ball is turned."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from model import Case, Trajectory
from model.arrays import Array
from model.kinematics import angular_velocity, frame

STEP = 5e-3
"""Longest time between points of the trail and of the rotation, s."""


@dataclass(frozen=True)
class Moment:
    """A run at one time; vectors in the co-rotating frame."""

    time: float
    theta: float
    x: Array
    """State, shape (8,)."""
    forces: tuple[Array, Array]
    """At A and B, N."""
    case: Case


def moment(run: Trajectory, time: float) -> Moment:
    """The run at a time in s, interpolated linearly; the case is that of the last sample."""
    last = max(0, int(np.searchsorted(run.time, time, side="right")) - 1)

    def at(values: Array) -> Array:
        return np.array([np.interp(time, run.time, column) for column in values.T])

    theta = float(np.interp(time, run.time, run.theta))
    return Moment(time, theta, at(run.x), (at(run.force_A), at(run.force_B)), Case(run.case[last]))


@dataclass(frozen=True)
class Turning:
    """Orientations (n,) of the ball at times (n,) in s."""

    times: Array
    rotations: Rotation

    @classmethod
    def of(cls, run: Trajectory) -> Turning:
        """From the ball's angular velocity; the first orientation is upright."""
        steps = max(1, math.ceil((run.time[-1] - run.time[0]) / STEP))
        times = np.linspace(run.time[0], run.time[-1], steps + 1)
        middle = (times[1:] + times[:-1]) / 2
        x = np.stack([np.interp(middle, run.time, column) for column in run.x.T], axis=-1)
        theta = np.interp(middle, run.time, run.theta)
        world = np.einsum("nab,na->nb", frame(theta), angular_velocity(x, run.header.parameters))
        turned = [Rotation.identity()]
        for step in Rotation.from_rotvec(world * np.diff(times)[:, None]):
            turned.append(step * turned[-1])
        return cls(times, Rotation.concatenate(turned))

    def at(self, time: float) -> Rotation:
        """The orientation at the first of the times that is not before this one."""
        return self.rotations[min(int(np.searchsorted(self.times, time)), len(self.times) - 1)]
