"""A free ball in the vessel's axes: what drives it, its spin and slip, a plane that stands for the
wall.

The same lines serve floats and, compiled, the loop of `mjsim.compiled`.
"""

from __future__ import annotations

import math
from typing import Any

from mjsim.corrections import Ball, resistance


def driven(
    place: Any, turned: Any, velocity: Any, last: Any, ahead: float, omega_0: float, ball: Ball
) -> tuple[float, ...]:
    """Drag (9) and the torque of the fluid on a free ball, N along the vessel's axes and N m along
    the ball's.

    With velocities `ahead` s before places, and the accelerations of the `last` step, m s-2 and rad
    s-2, it is that at the middle of the step. What is continued from now and from a step before is
    not the velocity, which turns fast, but the lag behind the fluid, with the places then: off the
    chords between those known."""
    back = 1.5 * ahead * ahead
    x, y = place[0] - back * last[0], place[1] - back * last[1]
    v_x, v_y, v_z = (
        velocity[0] + ahead * last[0],
        velocity[1] + ahead * last[1],
        velocity[2] + ahead * last[2],
    )
    o_x, o_y, o_z = (
        velocity[3] + ahead * last[3],
        velocity[4] + ahead * last[4],
        velocity[5] + ahead * last[5],
    )
    w, a, b, c = turned[0], turned[1], turned[2], turned[3]
    w_x, w_y = v_x + omega_0 * y, v_y - omega_0 * x
    mc = resistance(w_x, w_y, v_z, ball)
    upright = (
        2 * (a * c - w * b),
        2 * (b * c + w * a),
        1 - 2 * (a * a + b * b),
    )  # the vessel's axis along the ball's
    return (
        -mc * w_x,
        -mc * w_y,
        -mc * v_z,
        -ball.torque * (o_x - omega_0 * upright[0]),
        -ball.torque * (o_y - omega_0 * upright[1]),
        -ball.torque * (o_z - omega_0 * upright[2]),
    )


def spun(turned: Any, velocity: Any) -> tuple[float, float, float]:
    """Spin of a free ball along the vessel's axes, rad/s."""
    w, a, b, c = turned[0], turned[1], turned[2], turned[3]
    x, y, z = velocity[3], velocity[4], velocity[5]
    return (
        (1 - 2 * (b * b + c * c)) * x + 2 * (a * b - w * c) * y + 2 * (a * c + w * b) * z,
        2 * (a * b + w * c) * x + (1 - 2 * (a * a + c * c)) * y + 2 * (b * c - w * a) * z,
        2 * (a * c - w * b) * x + 2 * (b * c + w * a) * y + (1 - 2 * (a * a + b * b)) * z,
    )


def outwards(place: Any, velocity: Any, ahead: float) -> tuple[float, float]:
    """Unit vector (2) from the vessel's axis to where the ball was `ahead` s before."""
    x, y = place[0] - ahead * velocity[0], place[1] - ahead * velocity[1]
    rho = math.hypot(x, y)
    return (x / rho, y / rho) if rho > 0 else (0.0, 0.0)


def joint_velocities(place: Any, turned: Any, velocity: Any, ahead: float) -> tuple[float, ...]:
    """Velocities of a free ball as the joints of `recorder.joint_state` have them, (6), `ahead` s
    before its place."""
    out_x, out_y = outwards(place, velocity, ahead)
    (o_x, o_y, o_z), (v_x, v_y) = spun(turned, velocity), (velocity[0], velocity[1])
    v_h = -out_x * v_x - out_y * v_y
    rho = math.hypot(place[0], place[1]) + ahead * v_h
    omega_c = (out_x * v_y - out_y * v_x) / rho if rho > 0 else math.nan
    return (
        omega_c, v_h, velocity[2],
        -out_x * o_x - out_y * o_y, o_z - omega_c, out_x * o_y - out_y * o_x,
    )  # fmt: skip


def against(
    place: Any, velocity: Any, spin: Any, ahead: float, R: float, r: float
) -> tuple[float, float, float]:
    """Surface velocity (inwards, along, up), m/s, that makes a tangent plane act like the cylinder
    during a step.

    What is at rest against it is so against the cylinder `ahead` s later, when velocities are where
    the place is now. By then the normal has turned by ahead Omega: of the velocity Omega R along
    the wall the share ahead Omega will point into the plane, and (ahead Omega)^2/2 will be missing
    along it; and where ball and wall touch the turning about the normal will show as ahead Omega r
    o_n of slip. Without the first the ball would lose h Omega^2/2 of its speed a second."""
    out_x, out_y = outwards(place, velocity, ahead)
    rate = (out_x * velocity[1] - out_y * velocity[0]) / R
    turn = ahead * rate
    return (
        turn * rate * R,
        -turn * turn / 2 * rate * R,
        -turn * r * (out_x * spin[0] + out_y * spin[1]),
    )


def slip(
    place: Any, velocity: Any, spin: Any, ahead: float, ball: Ball
) -> tuple[float, float, float, float]:
    """Slip velocities, m/s, at floor (x, y) and wall (round, up) where the ball was `ahead` s
    before its place."""
    (out_x, out_y), r = outwards(place, velocity, ahead), ball.r
    return (
        velocity[0] - r * spin[1],
        velocity[1] + r * spin[0],
        out_x * velocity[1] - out_y * velocity[0] + r * spin[2],
        velocity[2] + r * (spin[0] * out_y - spin[1] * out_x),
    )


def unwrapped(azimuth: float, last: float) -> float:
    """An azimuth plus the whole turns that bring it nearest to the last one; the last one if it
    isn't finite."""
    return (
        azimuth + math.tau * round((last - azimuth) / math.tau) if math.isfinite(azimuth) else last
    )
