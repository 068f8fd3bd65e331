"""Where the ball, its contacts, forces and slips are in a run that is shown, in world axes."""

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
    """How the ball is turned, (n,); upright at first."""
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
        turns=_orientations(run, now.time),
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


def _orientations(run: Trajectory, times: Array) -> Rotation:
    """How the ball is turned since the first of times (n,) in s, from its angular velocity in the
    middle of short steps."""
    steps = max(1, math.ceil((times[-1] - times[0]) / STEP))
    points = np.linspace(times[0], times[-1], steps + 1)
    middle = resampled(run, (points[1:] + points[:-1]) / 2)
    spin = to_world(middle.x, middle.theta, run.header.parameters).spin
    each = Rotation.from_rotvec(spin * np.diff(points)[:, None]).as_quat()
    turned, summed = np.vstack([[0.0, 0.0, 0.0, 1.0], each]), 1
    while summed < len(turned):  # each holds the product of so many steps up to its own
        later = _product(turned[summed:], turned[:-summed])
        turned, summed = np.vstack([turned[:summed], later]), 2 * summed
    return Rotation.from_quat(turned[np.searchsorted(points, times).clip(max=steps)])


def _product(a: Array, b: Array) -> Array:
    """Quaternions x, y, z, w of turns by b (n, 4) and then a; scipy takes fifty times as long."""
    (u, v), (r, s) = (a[:, :3], b[:, :3]), (a[:, 3:], b[:, 3:])
    along = r * s - np.sum(u * v, axis=1, keepdims=True)
    return np.hstack([r * v + s * u + np.cross(u, v), along])
