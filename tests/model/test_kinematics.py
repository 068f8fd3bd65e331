"""States go to the world and back without loss, and slip is the velocity of the material point."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from model import Parameters, State
from model.kinematics import (
    angular_velocity,
    frame,
    from_world,
    rotated,
    slip_speeds,
    slip_velocities,
    to_world,
)

P = Parameters.named("reference")
EPS = np.finfo(float).eps

speeds = st.floats(-100, 100)
states = st.tuples(
    st.floats(0, 1), speeds, speeds, speeds, speeds, speeds, st.floats(0, 0.9 * P.R), speeds
).map(np.array)
angles = st.floats(-3.1, 3.1)


@given(arrays(float, (2, 8), elements=st.floats(-1, 1)), arrays(float, 2, elements=angles))
def test_to_the_world_and_back(unit, theta):
    """Of many states at once."""
    x = unit * [1, 100, 100, 100, 100, 100, 0.9 * P.R, 100]
    back, angle = from_world(to_world(x, theta, P), P)
    # Each entry is a sum of terms no larger than this scale; a dozen operations lose at most that
    # many ulps of it, and dividing by the orbit's radius (>= R/10) magnifies the tangential
    # velocity's error.
    scale = 1 + np.abs(x).max() * (1 + P.R / P.r)
    np.testing.assert_allclose(back.stacked(), x, rtol=0, atol=64 * EPS * scale * 10 / P.R)
    np.testing.assert_allclose(angle, theta, rtol=0, atol=8 * EPS)


@given(st.tuples(speeds, speeds, speeds), st.tuples(speeds, speeds, speeds, st.floats(1, 2)))
def test_rotation_by_a_quaternion(vector, q):
    quaternion = np.roll(q, 1) / np.linalg.norm(q)
    expected = Rotation.from_quat(quaternion, scalar_first=True).apply(vector)
    error = 64 * EPS * (1 + max(map(abs, vector)))
    np.testing.assert_allclose(rotated(quaternion, np.array(vector)), expected, atol=error)


@given(states, angles)
def test_slip_is_the_velocity_of_the_material_point(x, theta):
    """(6) by rigid-body kinematics in the world frame: v = v_C + omega x r."""
    world, axes = to_world(x, theta, P), frame(theta)
    scale = 1 + np.abs(world.velocity).max() + P.r * np.abs(world.spin).max()
    for v, arm in zip(slip_velocities(x, P), (-P.r * axes[1], -P.r * axes[0]), strict=True):
        expected = axes @ (world.velocity + np.cross(world.spin, arm))
        np.testing.assert_allclose(v, expected, atol=64 * EPS * scale)


def test_slip_speeds_and_spin():
    x = np.array([0, 0, 5.0, 3.0, -2.0, 4.0])
    assert slip_speeds(x, P) == pytest.approx((P.r * 5, P.r * np.sqrt(20)))  # (7)
    # (4): without slip the ball turns against its orbit, R/r times as fast, about i and j.
    x = np.array([0, 0, 7.0, 0, 0, 0])
    assert not np.any(slip_velocities(x, P))
    np.testing.assert_allclose(angular_velocity(x, P), [P.R / P.r * 7, -P.R / P.r * 7, 0])


def test_on_the_axis_the_orbit_has_no_angular_velocity():
    world = to_world(np.array([0, 0, 3.0, 0, 0, 0, P.R, -1.0]), 0.0, P)
    x, theta = from_world(world, P)
    assert np.isnan(x.omega_c)
    assert theta == 0


def test_a_state_is_one_or_many():
    columns = State.of(np.arange(24.0).reshape(3, 8))
    assert State.of(columns) is columns
    np.testing.assert_array_equal(columns.stacked(), np.arange(24.0).reshape(3, 8))
