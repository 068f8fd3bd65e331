"""The drag -m c(|w|) w of each law of `model.drag`, w relative to the fluid; fall under it alone.

With Re = 2 r |w|/nu_f every law is one formula, c(|w|) = max(linear + wake |w|^0.687, blunt |w|):
Stokes' has the first term alone, the quadratic one the last. So c never decreases with |w|, and a
drag force determines the speed.

Laws take floats or arrays, complex ones, too. `simulation` compiles `rate` and the fall."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from model import Parameters, State
from model.arrays import Array, Real
from model.drag import QUADRATIC, REYNOLDS, SCHILLER_NAUMANN, STOKES

EXPONENT, WAKE, BLUNT = 0.687, 0.15, 0.44
"""Schiller and Naumann's C_D = 24/Re (1 + WAKE Re^EXPONENT), and that of greater Re."""
SPEED_STEPS = 8
"""Steps of Newton's method from less than twice the root: 6, and 2 for the corner of `DragLaw`."""
FALL_STEPS = 100
"""Most steps of it to the end of a fall, far more than it takes."""


class DragLaw(NamedTuple):
    """c(|w|) = max(linear + wake |w|^0.687, blunt |w|) in s-1, with |w| in m s-1."""

    linear: float
    wake: float
    blunt: float


def law(p: Parameters) -> DragLaw:
    """The law of a parameter set; KeyError for a law of `model.drag` without a formula here."""
    per_speed = 2 * p.r / (p.nu_f or math.inf)
    laws = {
        STOKES: DragLaw(p.c, 0.0, 0.0),
        SCHILLER_NAUMANN: DragLaw(
            p.c, WAKE * p.c * per_speed**EXPONENT, BLUNT / 24 * p.c * per_speed
        ),
        QUADRATIC: DragLaw(0.0, 0.0, p.C_D / 24 * p.c * per_speed),
    }
    return laws[p.drag]


def rate(speed: Real, law: DragLaw) -> Real:
    """c(|w|) of a law, s-1."""
    slow, fast = law.linear + law.wake * speed**EXPONENT, law.blunt * speed
    return slow * (slow >= fast) + fast * (slow < fast)  # max, for all kinds of numbers


def coefficient(speed: Real, p: Parameters) -> Real:
    """c(|w|), s-1, at a speed |w| >= 0 (m s-1) relative to the fluid: drag is -m c(|w|) w, N."""
    return p.c if p.drag == STOKES else rate(speed, law(p))


def of_velocity(w_h: Real, w_y: Real, w_k: Real, p: Parameters) -> Real:
    """c(|w|), s-1, of a velocity relative to the fluid: inward, upward, rho (omega_c - omega_0)."""
    return p.c if p.drag == STOKES else rate(speed(w_h, w_y, w_k), law(p))


def speed(w_h: Real, w_y: Real, w_k: Real) -> Real:
    """The speed |w| relative to the fluid, m s-1, from components as in `of_velocity`."""
    square = w_h * w_h + w_y * w_y + w_k * w_k
    return math.sqrt(square) if isinstance(square, float) else np.sqrt(square)


def slope(speed: Real, p: Parameters) -> Real:
    """d(c(|w|) |w|)/d|w|, s-1: the answer to a change along w; across w it is `coefficient`."""
    if p.drag == STOKES:
        return p.c
    linear, wake, blunt = law(p)
    slow, fast = wake * speed**EXPONENT, blunt * speed
    is_slow, is_fast = linear + slow >= fast, linear + slow < fast
    return (linear + (1 + EXPONENT) * slow) * is_slow + 2 * fast * is_fast


def speed_of(acceleration: npt.ArrayLike, p: Parameters) -> Array:
    """Speed |w| (m s-1) at which drag per mass, c(|w|) |w|, is as given (m s-2); inf for c = 0."""
    given, terms = np.asarray(acceleration, dtype=float), law(p)
    powers = zip(terms, (1.0, 1.0 + EXPONENT, 2.0), strict=True)
    alone = [(given / term) ** (1 / power) for term, power in powers if term > 0]
    if not alone:
        return np.where(given > 0, np.inf, given)
    speed: Array = np.minimum.reduce(alone)
    if len(alone) == 1:
        return speed
    # One term alone makes the drag of this speed too great, but that of half of it is too small.
    # The drag is convex, so that Newton's method comes down to the root from there, with twice as
    # many digits each time.
    for _ in range(SPEED_STEPS):
        speed = speed - (rate(speed, terms) * speed - given) / slope(speed, p)
    return speed


def reynolds(speed: Real, p: Parameters) -> Real:
    """Reynolds number 2 r |w|/nu_f; nan if the viscosity isn't known."""
    return 2 * p.r / p.nu_f * speed if p.nu_f else math.nan * speed


def reynolds_of(x: State, p: Parameters) -> float:
    """Reynolds number of a ball in a state x in the flow p.omega_0; nan without viscosity."""
    return float(reynolds(speed(x.v_h, x.v_y, (p.R - x.h) * (x.omega_c - p.omega_0)), p))


def covers(Re: float, law: str) -> bool:
    """Whether a Reynolds number is within the range of a law; 0, without drag, always is."""
    low, high = REYNOLDS[law]
    return Re == 0 or low <= Re <= high


def sinking_speed(*, nu_f: float, rho_f: float, rho_b: float, r: float, gravity: float) -> float:
    """Terminal speed v, m s-1, of a sphere: weight less buoyancy is 6 pi rho_f nu_f r v.

    nu_f is the kinematic viscosity of the fluid, m2 s-1; rho_f and rho_b are densities of fluid and
    sphere, kg m-3; r is the radius, m; gravity is in vacuum, m s-2."""
    heavier = 4 / 3 * math.pi * r**3 * (rho_b - rho_f) * gravity
    return heavier / (6 * math.pi * rho_f * nu_f * r)


def fall(t: float, y: float, v_y: float, p: Any) -> tuple[float, float]:
    """Height (m) and vertical velocity (m s-1) after a time t (s) of flight with Stokes' drag.

    p : anything with c and g"""
    return y + v_y * t - (p.c * v_y + p.g) * t**2 * ramp_lag(p.c * t), fall_speed(t, v_y, p)


def fall_speed(t: float, v_y: float, p: Any) -> float:
    """The vertical velocity of `fall` alone."""
    decay = math.expm1(-p.c * t) / -p.c if p.c > 0 else t
    speed: float = v_y - (p.c * v_y + p.g) * decay
    return speed


def fall_time(y: float, v_y: float, p: Any) -> float:
    """Time until a flight with Stokes' drag ends on the floor, s; y >= 0, and v_y > 0 if y = 0.

    By Newton's method, which comes from where the path bends to: from below the floor, or from the
    start of a ball that falls faster than it sinks."""
    time: float = (v_y + math.sqrt(v_y**2 + 2 * p.g * y)) / p.g
    bends_down: bool = p.c * v_y + p.g > 0
    if time == 0:
        return 0.0
    if not bends_down:
        time = 0.0
    while bends_down and fall(time, y, v_y, p)[0] > 0:
        time *= 2
    for _ in range(FALL_STEPS):
        height, speed = fall(time, y, v_y, p)
        after = time - height / speed
        if (after >= time) if bends_down else (after <= time):  # round-off is left
            break
        time = after
    return time


def ramp_lag(s: float) -> float:
    """(s - 1 + exp(-s))/s^2, by its series where that cancels: the lag of linear drag in a ramp."""
    if abs(s) < 1e-2:
        return 1 / 2 - s / 6 * (1 - s / 4 * (1 - s / 5 * (1 - s / 6 * (1 - s / 7))))
    return (s + math.expm1(-s)) / s**2
