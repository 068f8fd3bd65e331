"""Drag and inertia in the middle of a step.

MuJoCo takes forces at the beginning of a step. Those that the velocity alone decides are taken
here at its middle, from what the last step changed. In the scalars of compiled loops, or arrays.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from model import Parameters
from model.drag import QUADRATIC, SCHILLER_NAUMANN, STOKES


class BallConstants(NamedTuple):
    """The numbers of a ball that drag and inertia need."""

    R: float
    drag: float
    """m c, kg s-1."""
    Re: float
    """2 r/nu_f, Reynolds number per speed, s m-1; 0 with Stokes' drag."""
    creeping: float
    """Three terms of C_D Re/24: 1, or 0 with quadratic drag;"""
    wake: float
    """what Re^0.687 is multiplied by, 0.15 by Schiller and Naumann;"""
    blunt: float
    """what Re is multiplied by once that is more, C_D/24."""
    mass: float
    inertia: float
    """j m r^2, kg m2."""
    torque: float
    """Of the fluid, j m r^2 times its rate, kg m2 s-1; 0 where it is left out."""

    @classmethod
    def of(cls, p: Parameters) -> BallConstants:
        """The numbers of one ball; raises KeyError for a law of `model.drag` without a formula
        here."""
        Re = 2 * p.r / (p.nu_f or math.inf)
        laws = {
            STOKES: (0.0, 1.0, 0.0, 0.0),
            SCHILLER_NAUMANN: (Re, 1.0, 0.15, 0.44 / 24),
            QUADRATIC: (Re, 0.0, 0.0, p.C_D / 24),
        }
        inertia = p.j * p.m * p.r**2
        return cls(p.R, p.m * p.c, *laws[p.drag], p.m, inertia, inertia * p.fluid_torque)


class Velocity(NamedTuple):
    """Velocities of the ball's joints, along the paper's axes; o_y is the spin less omega_c."""

    omega_c: float
    v_h: float
    v_y: float
    o_x: float
    o_y: float
    o_z: float


def resistance(w_z: float, w_h: float, w_y: float, ball: BallConstants) -> float:
    """Drag divided by the speed of a centre that moves with w relative to the fluid, m c C_D Re/24,
    kg s-1."""
    Re = ball.Re * (w_z * w_z + w_h * w_h + w_y * w_y) ** 0.5
    flowing, blunt = ball.creeping + ball.wake * Re**0.687, ball.blunt * Re
    found: float = ball.drag * (flowing + (blunt - flowing) * (blunt > flowing))  # of arrays, too
    return found


def mid_step_forces(
    v: Velocity,
    last: Velocity,
    rho: float,
    omega_0: float,
    ahead: float,
    step: float,
    ball: BallConstants,
) -> tuple[float, float, float, float, float, float]:
    """Forces of the joints: torque about the axis, inward, upward, N m and N; moments about x, y
    and z, N m.

    Drag and the fluid's torque, and what inertial forces change until `ahead` steps after the
    beginning, since MuJoCo has those of that.

    Parameters
    ----------
    v, last : velocities before this step and a step, s, earlier
    rho : distance from the axis, at the time that is asked for, m
    """
    change = Velocity(
        v.omega_c - last.omega_c, v.v_h - last.v_h, v.v_y - last.v_y,
        v.o_x - last.o_x, v.o_y - last.o_y, v.o_z - last.o_z,
    )  # fmt: skip
    omega_c, v_h = v.omega_c + ahead * change.omega_c, v.v_h + ahead * change.v_h

    # Drag (9), -m c (v - v_fluid).
    lag, w_y = omega_c - omega_0, v.v_y + ahead * change.v_y
    mc = resistance(rho * lag, v_h, w_y, ball)

    # In the co-rotating frame inertial forces are 2 m omega_c v_h along the orbit and
    # -m rho omega_c^2 inwards, and I omega_c (-o_z, 0, o_x) on the spin. The axes' turning under
    # the spin is not extrapolated, which would let a ball that slips on the wall swing more and
    # more: only what else changed the spin is, and the middle solved for, by which turning leaves
    # its size alone.
    turn = ahead * step * omega_c
    turned = ahead * step * (v.omega_c + last.omega_c) / 4
    x = v.o_x + ahead * change.o_x + turned * (v.o_z + last.o_z)
    z = v.o_z + ahead * change.o_z - turned * (v.o_x + last.o_x)
    o_x, o_z = (x - turn * z) / (1 + turn * turn), (z + turn * x) / (1 + turn * turn)
    inertial_z = 2 * ball.mass * (omega_c * v_h - v.omega_c * v.v_h)
    inertial_h = -ball.mass * rho * (omega_c * omega_c - v.omega_c * v.omega_c)
    moment_x = -ball.inertia * (omega_c * o_z - v.omega_c * v.o_z)
    moment_z = ball.inertia * (omega_c * o_x - v.omega_c * v.o_x)

    # The fluid's torque, against the spin relative to the fluid; that about y turns the joints'
    # axis, too.
    torque_x, torque_z = -ball.torque * o_x, -ball.torque * o_z
    torque_y = -ball.torque * (v.o_y + ahead * change.o_y + omega_c - omega_0)
    return (
        rho * (-mc * rho * lag + inertial_z) + torque_y, -mc * v_h + inertial_h, -mc * w_y,
        moment_x + torque_x, torque_y, moment_z + torque_z,
    )  # fmt: skip
