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
    """A run at times in s, scalar or (n,), interpolated linearly; vectors in the co-rotating frame."""

    run: Trajectory
    time: Array

    def _at(self, values: Array) -> Array:
        columns = np.reshape(values, (len(values), -1)).T
        return np.stack([np.interp(self.time, self.run.time, column) for column in columns], axis=-1)

    @property
    def theta(self) -> Array:
        """Azimuth, rad."""
        return self._at(self.run.theta)[..., 0]

    @property
    def x(self) -> Array:
        """States (..., 8)."""
        return self._at(self.run.x)

    @property
    def forces(self) -> tuple[Array, Array]:
        """At A and B, (..., 3), N."""
        return self._at(self.run.force_A), self._at(self.run.force_B)

    @property
    def cases(self) -> list[Case]:
        """Those of the last samples."""
        last = np.searchsorted(self.run.time, np.atleast_1d(self.time), side="right") - 1
        return [Case(code) for code in self.run.case[np.maximum(last, 0)]]

    @property
    def centre(self) -> Array:
        """Of the ball in the world, (..., 3), m."""
        p, x, theta = self.run.header.parameters, self.x, self.theta
        rho = p.R - x[..., 6]
        return np.stack([rho * np.cos(theta), rho * np.sin(theta), p.r + x[..., 0]], axis=-1)


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
        there = Moment(run, (times[1:] + times[:-1]) / 2)
        world = np.einsum("nab,na->nb", frame(there.theta), angular_velocity(there.x, run.header.parameters))
        turned = [Rotation.identity()]
        for step in Rotation.from_rotvec(world * np.diff(times)[:, None]):
            turned.append(step * turned[-1])
        return cls(times, Rotation.concatenate(turned))

    def at(self, time: float) -> Rotation:
        """The orientation at the first of the times that is not before this one."""
        return self.rotations[min(int(np.searchsorted(self.times, time)), len(self.times) - 1)]
