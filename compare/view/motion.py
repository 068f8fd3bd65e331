"""A run between its samples: its states at any times, and how the ball is turned."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from model import Trajectory
from model.arrays import Array
from model.kinematics import to_world
from model.trajectory import columns


def resampled(run: Trajectory, times: Array) -> Trajectory:
    """The run at times (n,) in s, interpolated linearly; the case is that of the last sample before."""
    place = np.interp(times, run.time, np.arange(len(run.time)))
    before = place.astype(int)
    after, share = np.minimum(before + 1, len(run.time) - 1), place - before

    def at(values: Array) -> Array:
        change = values[after] - values[before]
        return np.asarray(values[before] + change * share.reshape(-1, *[1] * (values.ndim - 1)))

    values: dict[str, Any] = {name: at(getattr(run, name)) for name in columns(Trajectory) if name != "case"}
    return dataclasses.replace(run, **values, case=run.case[before])


def orientations(run: Trajectory) -> Rotation:
    """How the ball is turned at each sample, from its angular velocity in the middle between them; upright at first."""
    middle = resampled(run, (run.time[1:] + run.time[:-1]) / 2)
    spin = to_world(middle.x, middle.theta, run.header.parameters).spin
    turned = [Rotation.identity()]
    for step in Rotation.from_rotvec(spin * np.diff(run.time)[:, None]):
        turned.append(step * turned[-1])
    return Rotation.concatenate(turned)
