"""Where the ball, its contacts, forces and slips are in a run that is shown, in world axes."""

from __future__ import annotations

import dataclasses
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from model import Trajectory
from model.arrays import Array
from model.kinematics import frame, slip_velocities, to_world
from model.trajectory import columns

STEP = 5e-3
"""Longest time between points of the rotation, s."""
ARROW = 3.0
"""Length of the arrows of a force m g and of the fastest slip of the run, in radii of the ball."""


@dataclass(frozen=True)
class Geometry:
    """What is seen at n times; of floor and wall, in this order, arrays (2, n, 3)."""

    turns: Rotation
    """How the ball is turned, (n,)."""
    centres: Array
    """(n, 3), m."""
    contacts: Array
    """Points of contact, m."""
    forces: Array
    """As arrows, m."""
    slips: Array
    """Velocities in the tangent plane, as arrows, m; none without a force."""


def geometry(run: Trajectory, now: Trajectory) -> Geometry:
    """Positions of ball, contacts and arrows at the samples of `now`, which is `run` resampled."""
    p = run.header.parameters
    steps = max(1, math.ceil((now.time[-1] - run.time[0]) / STEP))
    past = resampled(run, np.linspace(run.time[0], now.time[-1], steps + 1))
    centres, axes = to_world(now.x, now.theta, p).position, frame(now.theta)
    normals = np.stack([axes[:, 1], axes[:, 0]])
    forces, slips = (
        np.einsum("nab,cna->cnb", axes, v)
        for v in ([now.force_A, now.force_B], slip_velocities(now.x, p))
    )
    slips -= np.sum(slips * normals, axis=-1, keepdims=True) * normals
    fastest = max(float(np.abs(v).max()) for v in slip_velocities(run.x, p))
    slips *= np.any(forces, axis=-1, keepdims=True) * (
        ARROW * p.r / fastest if fastest > 0 else 0.0
    )
    return Geometry(
        turns=orientations(past)[np.searchsorted(past.time, now.time).clip(max=steps)],
        centres=centres,
        contacts=centres - p.r * normals,
        forces=forces * (ARROW * p.r / (p.m * p.g)),
        slips=slips,
    )


def resampled(run: Trajectory, times: Array) -> Trajectory:
    """The run at times (n,) in s, interpolated linearly; the case is that of the last sample
    before."""
    place = np.interp(times, run.time, np.arange(len(run.time)))
    before = place.astype(int)
    after, share = np.minimum(before + 1, len(run.time) - 1), place - before

    def at(values: Array) -> Array:
        change = values[after] - values[before]
        return np.asarray(values[before] + change * share.reshape(-1, *[1] * (values.ndim - 1)))

    values: dict[str, Any] = {
        name: at(getattr(run, name)) for name in columns(Trajectory) if name != "case"
    }
    return dataclasses.replace(run, **values, case=run.case[before])


def orientations(run: Trajectory) -> Rotation:
    """The ball's orientation at each sample, from its angular velocity in the middle between them;
    upright at first."""
    middle = resampled(run, (run.time[1:] + run.time[:-1]) / 2)
    spin = to_world(middle.x, middle.theta, run.header.parameters).spin
    steps = Rotation.from_rotvec(spin * np.diff(run.time)[:, None])
    turned, summed = Rotation.concatenate([Rotation.identity(), steps]), 1
    while summed < len(turned):  # each holds the product of so many steps up to its own
        turned = Rotation.concatenate([turned[:summed], turned[summed:] * turned[:-summed]])
        summed *= 2
    return turned
