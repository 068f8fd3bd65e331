"""What is corrected between MuJoCo's steps, in the words of mechanics.

MuJoCo takes forces at the beginning of a step and lets contact be soft. Each block of `corrections`
takes out one consequence of that. None knows a solution of the problem: each is built from what the
last step gave, and vanishes where motion and forces are steady.

All is written in floats, for plain Python or compiled loops (`mjsim.stepping`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from mjsim.contact_settings import ContactSettings
from model import Parameters
from model.drag import QUADRATIC, SCHILLER_NAUMANN, STOKES

_SLIDES = 9.0
"""A contact slides if its speed squared exceeds this times that of its change in a step; ending
slip changes faster."""
_NEAR = 32.0
"""Steps to the axis from which on they are shorter: the azimuth turns by up to 1/32 in one."""


class Ball(NamedTuple):
    """The numbers of a ball and of the settings that the corrections need."""

    R: float
    r: float
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
    ahead: float
    """Where in a step forces are taken, in steps after its beginning: 1/2, or 0 where the engine's
    order is kept."""
    gain: float
    """Share of a gap that the servo takes off a margin in a step; 0 without servo."""
    fall: float
    """Speed from which on a ball that comes down lands, m s-1; inf where landings are left to the
    contacts."""
    step: float
    """The time step, s."""
    memory: float
    """R_t/b_f of the contacts, surface velocity per friction force, m s-1 N-1, 0 without memory."""
    lag: float
    """How many steps after the middle of a step friction takes its direction by itself."""
    hover_A: float
    hover_B: float
    """Load (m s-2) per slip speed below which slip lifts a contact, s-1."""

    @classmethod
    def of(cls, p: Parameters, settings: ContactSettings) -> Ball:
        """The values of one run. Raises KeyError for a law of `model.drag` that has no formula
        here."""
        Re = 2 * p.r / (p.nu_f or math.inf)
        laws = {
            STOKES: (0.0, 1.0, 0.0, 0.0),
            SCHILLER_NAUMANN: (Re, 1.0, 0.15, 0.44 / 24),
            QUADRATIC: (Re, 0.0, 0.0, p.C_D / 24),
        }
        inertia = p.j * p.m * p.r**2
        memory = (
            settings.softness / (p.m * settings.impratio * settings.b_f) if settings.memory else 0.0
        )
        gain = settings.timestep / settings.servo if settings.servo else 0.0
        hover = settings.b_f / settings.softness
        return cls(
            p.R, p.r, p.m * p.c, *laws[p.drag], p.m, inertia, inertia * p.fluid_torque, settings.midpoint,
            gain, settings.slowest_fall(p.g), settings.timestep, memory, settings.friction_lag,
            p.mu * hover, p.eta * hover,
        )  # fmt: skip


class Velocity(NamedTuple):
    """Velocities of the ball's joints, along the paper's axes; o_y is the spin less omega_c."""

    omega_c: float
    v_h: float
    v_y: float
    o_x: float
    o_y: float
    o_z: float


def slip(v: Velocity, rho: float, r: float) -> tuple[float, ...]:
    """Velocities (5) of the ball's surface, A_x, A_z, B_y, B_z, at the distance rho from the axis;
    linear in v."""
    omega_c, v_h, v_y, o_x, o_y, o_z = v
    along, roll = rho * omega_c, r * o_z
    return v_h + roll, along - r * o_x, v_y - roll, along + r * (o_y + omega_c)


def resistance(w_z: float, w_h: float, w_y: float, ball: Ball) -> float:
    """Drag divided by the speed of a centre that moves with w relative to the fluid, m c C_D Re/24,
    kg s-1."""
    Re = ball.Re * (w_z * w_z + w_h * w_h + w_y * w_y) ** 0.5
    flowing, blunt = ball.creeping + ball.wake * Re**0.687, ball.blunt * Re
    found: float = ball.drag * (flowing + (blunt - flowing) * (blunt > flowing))  # of arrays, too
    return found


def corrections(
    v: Velocity, last: Velocity, rho: float, omega_0: float,
    contact: Sequence[float], normals: Sequence[float], ball: Ball,
) -> tuple[tuple[float, ...], tuple[float, ...], tuple[float, float]]:  # fmt: skip
    """Joint forces and surface velocities that correct a step which begins with velocities v, a
    step after `last`.

    Positions are half a step ahead, so that rho is already that at mid step.

    Parameters
    ----------
    contact, normals : generalised contact forces (inward, upward, moments about x, y) and normal
        ones (A_y, B_x) of the last step, N and N m

    Returns
    -------
    generalised forces of the joints (torque about the axis, inward, upward, moments about x, y, z),
    N and N m velocities of the surfaces (floor along z, x, wall along y, z), m s-1 forces that slip
    would take from the contacts A and B, N"""
    ahead = ball.ahead
    change = Velocity(
        v.omega_c - last.omega_c, v.v_h - last.v_h, v.v_y - last.v_y,
        v.o_x - last.o_x, v.o_y - last.o_y, v.o_z - last.o_z,
    )  # fmt: skip

    # Drag (9) at mid step: -m c (v - v_fluid). Mid-step values are extrapolated from the last
    # step's change.
    lag, w_h, w_y = (
        v.omega_c + ahead * change.omega_c - omega_0,
        v.v_h + ahead * change.v_h,
        v.v_y + ahead * change.v_y,
    )
    mc = resistance(rho * lag, w_h, w_y, ball)
    drag_z, drag_h, drag_y = -mc * rho * lag, -mc * w_h, -mc * w_y

    # Inertial forces at mid step. In the co-rotating frame they are 2 m omega_c v_h along the orbit
    # and -m rho omega_c^2 inwards, and I omega_c (-o_z, 0, o_x) on the spin. The engine has them
    # with the velocities of the beginning of the step; their change up to its middle, extrapolated
    # from the last step, is added. The axes' turning under the spin is not extrapolated, which
    # would let a ball that slips on the wall swing more and more: only what else changed the spin
    # is, and the middle solved for, by which turning leaves its size alone.
    omega_c = v.omega_c + ahead * change.omega_c
    v_h = v.v_h + ahead * change.v_h
    turn = ahead * ball.step * omega_c
    turned = ahead * ball.step * (v.omega_c + last.omega_c) / 4
    x = v.o_x + ahead * change.o_x + turned * (v.o_z + last.o_z)
    z = v.o_z + ahead * change.o_z - turned * (v.o_x + last.o_x)
    o_x, o_z = (x - turn * z) / (1 + turn * turn), (z + turn * x) / (1 + turn * turn)
    inertial_z = 2 * ball.mass * (omega_c * v_h - v.omega_c * v.v_h)
    inertial_h = -ball.mass * rho * (omega_c * omega_c - v.omega_c * v.omega_c)
    moment_x = -ball.inertia * (omega_c * o_z - v.omega_c * v.o_z)
    moment_z = ball.inertia * (omega_c * o_x - v.omega_c * v.o_x)

    # The fluid's torque at mid step, against the spin relative to the fluid; that about y turns the
    # joints' axis, too.
    torque_x, torque_z = -ball.torque * o_x, -ball.torque * o_z
    torque_y = -ball.torque * (v.o_y + ahead * change.o_y + omega_c - omega_0)

    v_Ax, v_Az, v_By, v_Bz = slip(v, rho, ball.r)
    A_x, A_z, B_y, B_z = slip(change, rho, ball.r)
    floor_x, floor_z = surface((v_Ax, v_Az), (A_x, A_z), ball)
    wall_y, wall_z = surface((v_By, v_Bz), (B_y, B_z), ball)

    # Memory of friction. A rolling contact of finite softness creeps at R_t f/b_f; a surface that
    # moves backwards at that speed for the last step's friction f leaves only the change of f to
    # creep: the friction rows then read a + R_t (f - f_last) = -b_f v, with the cone where it was.
    # That is the law of `mjsim.coulomb`, in a field that whole steps of MuJoCo's look at. The
    # friction forces follow from contact = (A_x + B_x, A_y + B_y, -r A_z, r B_z).
    (inward, upward, about_x, about_y), (A_normal, B_normal) = contact, normals
    floor_z -= ball.memory / ball.r * about_x
    floor_x += ball.memory * (inward - B_normal)
    wall_y += ball.memory * (upward - A_normal)
    wall_z += ball.memory / ball.r * about_y

    # De Saxce's share. In the engine's convex law slip lifts a contact: its normal row gets mu |w|,
    # with the w = b_f v of its friction rows. It is that law's, too; `mjsim.stepping` takes it
    # away.
    lift_A, lift_B = 0.0, 0.0
    if ball.memory > 0:
        lift_A = ball.mass * ball.hover_A * math.hypot(v_Ax + ahead * A_x, v_Az + ahead * A_z)
        lift_B = ball.mass * ball.hover_B * math.hypot(v_By + ahead * B_y, v_Bz + ahead * B_z)

    forces = (
        rho * (drag_z + inertial_z) + torque_y, drag_h + inertial_h, drag_y,
        moment_x + torque_x, torque_y, moment_z + torque_z,
    )  # fmt: skip
    return forces, (floor_z, floor_x, wall_y, wall_z), (lift_A, lift_B)


def surface(v: tuple[float, float], change: tuple[float, float], ball: Ball) -> tuple[float, float]:
    """The surface velocity, m s-1, that corrects a contact which slips at v, by `change` more than
    a step ago.

    Direction of sliding friction at mid step: the engine opposes friction to the slip that there
    would be 1/b_f after the beginning of the step. A surface velocity equal to the change of slip
    between the middle and then removes the difference; only where a contact clearly slides, since a
    slip that ends must be able to."""
    square, changed = v[0] * v[0] + v[1] * v[1], change[0] * change[0] + change[1] * change[1]
    lag = ball.lag if _SLIDES * changed < square else 0.0
    return lag * change[0], lag * change[1]


def near_axis(rho: float, v: Velocity, ball: Ball) -> bool:
    """Whether a ball at the distance rho from the axis, less than R/4, is less than `_NEAR` steps
    away from it."""
    along, reach = rho * v.omega_c, _NEAR * ball.step
    return rho < ball.R / 4 and rho * rho <= reach * reach * (v.v_h * v.v_h + along * along)


def lands(gap: float, speed: float, last: float, ball: Ball) -> bool:
    """Whether a gap, known `ahead` of its speed, closes by the end of a step with the acceleration
    of the last one."""
    change = speed - last
    gap = gap - ball.step * ball.ahead * (speed + ball.ahead / 2 * change)  # at the beginning
    end, closing = (
        gap + ball.step * (speed + change / 2),
        speed * speed - 2 * change * gap / ball.step,
    )
    return end < 0 and speed + change < 0 and closing > ball.fall * ball.fall
