"""What is corrected between MuJoCo's steps, in the words of mechanics.

MuJoCo takes forces at the beginning of a step and lets contact be soft. Each block of `corrections` takes out one
consequence of that. None knows a solution of the problem: each is built from what the last step gave, and vanishes
where motion and forces are steady.

Every quantity is a float for one run and an array with an entry for each run of a batch; the same lines serve both.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from mjsim.contact_settings import ContactSettings
from model import Parameters
from model.drag import QUADRATIC, SCHILLER_NAUMANN, STOKES

Quantity = Any
"""A float, or an array with an entry for each run."""

_SLIDES = 9.0
"""A contact slides if its speed squared exceeds this times that of its change in a step; ending slip changes faster."""
NO_LIMIT = 1e30
"""Stands for infinity where that would make infinity times zero."""
_NEAR = 32.0
"""Steps to the axis from which on they are shorter: the azimuth turns by up to 1/32 in one."""
_FEW = 16.0
"""A hovering contact lands from the speed that its load gives it in so many steps; one that only hovers reaches 1.2."""


class Ball(NamedTuple):
    """What the corrections need of a ball and of the settings."""

    R: Quantity
    r: Quantity
    drag: Quantity
    """m c, kg s-1."""
    Re: Quantity
    """2 r/nu_f, Reynolds number per speed, s m-1; 0 with Stokes' drag."""
    creeping: Quantity
    """Three terms of C_D Re/24: 1, or 0 with quadratic drag;"""
    wake: Quantity
    """what Re^0.687 is multiplied by, 0.15 by Schiller and Naumann;"""
    blunt: Quantity
    """what Re is multiplied by once that is more, C_D/24."""
    mass: Quantity
    inertia: Quantity
    """j m r^2, kg m2."""
    torque: Quantity
    """Of the fluid, j m r^2 times its rate, kg m2 s-1; 0 where it is left out."""
    ahead: Quantity
    """Where in a step forces are taken, in steps after its beginning: 1/2, or 0 where the engine's order is kept."""
    gain: Quantity
    """Share of a gap that the servo takes off a margin in a step; 0 without servo."""
    fall: Quantity
    """Speed from which on a ball that comes down lands, m s-1; inf where landings are left to the contacts."""
    step: Quantity
    """The time step, s."""
    memory_A: Quantity
    memory_B: Quantity
    """R_t/b_f of the contacts, surface velocity per friction force, m s-1 N-1, 0 without memory."""
    lag_A: Quantity
    lag_B: Quantity
    """How many steps after the middle of a step friction takes its direction by itself."""
    hover_A: Quantity
    hover_B: Quantity
    """Load (m s-2) per slip speed below which a contact hovers, s-1."""
    weight: Quantity
    """g, m s-2; `NO_LIMIT` where there is none."""
    hover: Quantity
    """Largest hover number of a contact, `NO_LIMIT` where it is left as it is."""

    @classmethod
    def of(cls, p: Parameters, settings: ContactSettings) -> Ball:
        """The values of one run. Raises KeyError for a law of `model.drag` that has no formula here."""
        Re = 2 * p.r / (p.nu_f or math.inf)
        laws = {
            STOKES: (0.0, 1.0, 0.0, 0.0),
            SCHILLER_NAUMANN: (Re, 1.0, 0.15, 0.44 / 24),
            QUADRATIC: (Re, 0.0, 0.0, p.C_D / 24),
        }
        inertia = p.j * p.m * p.r**2
        memory = settings.softness / (p.m * settings.impratio * settings.b_f) if settings.memory else 0.0
        gain = settings.timestep / settings.servo if settings.servo else 0.0
        lag, hover = settings.friction_lag, settings.b_f / settings.softness
        return cls(
            p.R, p.r, p.m * p.c, *laws[p.drag], p.m, inertia, inertia * p.fluid_torque, settings.midpoint,
            gain, settings.slowest_fall(p.g), settings.timestep, memory, memory, lag, lag,
            p.mu * hover, p.eta * hover, p.g or NO_LIMIT,
            (settings.shifts_surfaces and settings.hover) or NO_LIMIT,
        )  # fmt: skip


class Velocity(NamedTuple):
    """Velocities of the ball's joints, along the paper's axes; o_y is the spin less omega_c."""

    omega_c: Quantity
    v_h: Quantity
    v_y: Quantity
    o_x: Quantity
    o_y: Quantity
    o_z: Quantity


def slip(v: Velocity, rho: Quantity, r: Quantity) -> tuple[Quantity, ...]:
    """Velocities (5) of the ball's surface, A_x, A_z, B_y, B_z, at the distance rho from the axis; linear in v."""
    omega_c, v_h, v_y, o_x, o_y, o_z = v
    along, roll = rho * omega_c, r * o_z
    return v_h + roll, along - r * o_x, v_y - roll, along + r * (o_y + omega_c)


def resistance(w_z: Quantity, w_h: Quantity, w_y: Quantity, ball: Ball) -> Quantity:
    """Drag over the speed of a centre that moves with w relative to the fluid, m c C_D Re/24, kg s-1."""
    Re = ball.Re * (w_z * w_z + w_h * w_h + w_y * w_y) ** 0.5
    flowing, blunt = ball.creeping + ball.wake * Re**0.687, ball.blunt * Re
    return ball.drag * (flowing + (blunt - flowing) * (blunt > flowing))


def corrections(
    v: Velocity, last: Velocity, rho: Quantity, omega_0: Quantity,
    contact: Sequence[Quantity], normals: Sequence[Quantity], ball: Ball,
) -> tuple[tuple[Quantity, ...], tuple[Quantity, ...]]:  # fmt: skip
    """What drives a step that begins with the velocities v, a step after `last`.

    Positions are half a step ahead, so that rho is already that at mid step.

    Parameters
    ----------
    contact, normals : generalised contact force and normal forces (A_y, B_x) of the last step, N and N m

    Returns
    -------
    generalised forces of the joints (torque about the axis, inward, upward, moments about x, y, z), N and N m
    velocities of the surfaces (floor along z, x, wall along y, z), m s-1
    """
    ahead = ball.ahead
    change = Velocity(
        v.omega_c - last.omega_c, v.v_h - last.v_h, v.v_y - last.v_y,
        v.o_x - last.o_x, v.o_y - last.o_y, v.o_z - last.o_z,
    )  # fmt: skip

    # Drag (9) at mid step: -m c (v - v_fluid). Mid-step values are extrapolated from the last step's change.
    lag, w_h, w_y = v.omega_c + ahead * change.omega_c - omega_0, v.v_h + ahead * change.v_h, v.v_y + ahead * change.v_y
    mc = resistance(rho * lag, w_h, w_y, ball)
    drag_z, drag_h, drag_y = -mc * rho * lag, -mc * w_h, -mc * w_y

    # Inertial forces at mid step. In the co-rotating frame they are 2 m omega_c v_h along the orbit and
    # -m rho omega_c^2 inwards, and I omega_c (-o_z, 0, o_x) on the spin. The engine has them with the velocities of the
    # beginning of the step; their change up to its middle, extrapolated from the last step, is added. The axes'
    # turning under the spin is not extrapolated, which would let a ball that slips on the wall swing more and more:
    # only what else changed the spin is, and the middle solved for, by which turning leaves its size alone.
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

    # The fluid's torque at mid step, against the spin relative to the fluid; that about y turns the joints' axis, too.
    torque_x, torque_z = -ball.torque * o_x, -ball.torque * o_z
    torque_y = -ball.torque * (v.o_y + ahead * change.o_y + omega_c - omega_0)

    # Direction of sliding friction at mid step. The engine opposes friction to the slip that there would be 1/b_f after
    # the beginning of the step. A surface velocity equal to the change of slip between the middle and then removes the
    # difference; only where a contact clearly slides, since a slip that ends must be able to.
    v_Ax, v_Az, v_By, v_Bz = slip(v, rho, ball.r)
    A_x, A_z, B_y, B_z = slip(change, rho, ball.r)
    v2_A, v2_B = v_Ax * v_Ax + v_Az * v_Az, v_By * v_By + v_Bz * v_Bz
    lag_A = ball.lag_A * (_SLIDES * (A_x * A_x + A_z * A_z) < v2_A)
    lag_B = ball.lag_B * (_SLIDES * (B_y * B_y + B_z * B_z) < v2_B)

    # Continuous sliding. A contact that slides fast would hover: its surface moves along with the excess, which leaves
    # the direction of friction as it is, and delays it by as much more as there is less damping. The floor bears the
    # weight, the wall the centrifugal force, counted up to the weight.
    weight, thrown = ball.weight, rho * v.omega_c * v.omega_c
    less_A = unbearable(ball.hover_A * v2_A**0.5, ball.hover * weight)
    less_B = unbearable(ball.hover_B * v2_B**0.5, ball.hover * (weight - (weight - thrown) * (thrown < weight)))
    lag_A, lag_B = lag_A + (lag_A > 0) * less_A / 2, lag_B + (lag_B > 0) * less_B / 2

    # Memory of friction. A rolling contact of finite softness creeps at R_t f/b_f; a surface that moves backwards at
    # that speed for the last step's friction f leaves only the change of f to creep: the friction rows then read
    # a + R_t (f - f_last) = -b_f v, with the cone where it was. That is the law of `mjsim.coulomb`;
    # surface velocities carry it into a batch, whose steps have no halves. The friction forces follow from
    # contact = (., A_x + B_x, A_y + B_y, -r A_z, r B_z, .).
    (_, inward, upward, about_x, about_y, _), (A_normal, B_normal) = contact, normals
    floor_z = lag_A * A_z + less_A * v_Az - ball.memory_A / ball.r * about_x
    floor_x = lag_A * A_x + less_A * v_Ax + ball.memory_A * (inward - B_normal)
    wall_y = lag_B * B_y + less_B * v_By + ball.memory_B * (upward - A_normal)
    wall_z = lag_B * B_z + less_B * v_Bz + ball.memory_B / ball.r * about_y

    forces = (
        rho * (drag_z + inertial_z) + torque_y, drag_h + inertial_h, drag_y,
        moment_x + torque_x, torque_y, moment_z + torque_z,
    )  # fmt: skip
    return forces, (floor_z, floor_x, wall_y, wall_z)


def eventful(
    place: Sequence[Quantity], v: Velocity, last: Velocity, normals: Sequence[Quantity], ball: Ball
) -> Quantity:
    """Whether a ball that lacks a contact lands in the coming step, or comes near the vessel's axis."""
    (_, h, y), (A_normal, B_normal) = place, normals
    hover_A, hover_B = hovering(v, ball.R - h, ball)
    return (
        (A_normal == 0) & lands(y, v.v_y, last.v_y, hover_A, ball)
        | (B_normal == 0) & (lands(h, v.v_h, last.v_h, hover_B, ball) | near_axis(ball.R - h, v, ball))
    )  # fmt: skip


def near_axis(rho: Quantity, v: Velocity, ball: Ball) -> Quantity:
    """Whether a ball at the distance rho from the axis, less than R/4, is less than `_NEAR` steps away from it."""
    along = rho * v.omega_c
    return (rho < ball.R / 4) & (rho * rho <= (_NEAR * ball.step) ** 2 * (v.v_h * v.v_h + along * along))


def hovering(v: Velocity, rho: Quantity, ball: Ball) -> tuple[Quantity, Quantity]:
    """Loads, m s-2, below which slipping contacts hover with the present damping."""
    A_x, A_z, B_y, B_z = slip(v, rho, ball.r)
    return ball.hover_A * (A_x * A_x + A_z * A_z) ** 0.5, ball.hover_B * (B_y * B_y + B_z * B_z) ** 0.5


def unbearable(hover: Quantity, most: Quantity) -> Quantity:
    """The share of a slip speed beyond that up to which the contact is continuous."""
    excess = hover - most
    return excess * (excess > 0) / (hover + (hover == 0))


def lands(gap: Quantity, speed: Quantity, last: Quantity, hover: Quantity, ball: Ball) -> Quantity:
    """Whether a gap, known `ahead` of its speed, closes by the end of a step with the acceleration of the last one.

    A contact that would hover under half of the weight, or under what presses it now, may open and close all the time:
    that is no landing, unless it comes down faster than the forces of a few steps can make it.
    """
    change = speed - last
    gap = gap - ball.step * ball.ahead * (speed + ball.ahead / 2 * change)  # at the beginning
    end, closing = gap + ball.step * (speed + change / 2), speed * speed - 2 * change * gap / ball.step
    presses = (2 * hover < ball.weight) & (ball.step * hover < -change)
    falls = (closing > ball.fall**2) & (presses | (closing > (_FEW * ball.step * hover) ** 2))
    return (end < 0) & (speed + change < 0) & falls


def followed(margin: Quantity, gap: Quantity, gain: Quantity) -> Quantity:
    """Servo of a margin: it takes a share `gain` of the gap, not below 0, until the gap is zero.

    The contact point lies midway in the overlap, so that a ball that sinks in rolls on a shorter lever.
    """
    left = margin - gain * gap
    return left * (left > 0)
