"""The shortest time of a problem, and the longest step that resolves it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from model.drag import STOKES
from model.errors import InputError
from model.flow import Flow
from model.kinematics import State
from model.parameters import Parameters

SLIP = "slip_x", "slip_y", "slip_z"


def shortest_time(
    p: Parameters, flow: Flow, t_end: float, c: Callable[[float], float], x0: State
) -> tuple[float, str]:
    """The shortest time of a run of t_end s from a state x0, in s, and its formula; c(|w|) in s-1
    is the law of drag.

    Within two steps h an acceleration a may not move the ball by the size of the vessel, a (2 h)^2
    <= R: gravity's, a = g, asks for 2 h <= sqrt(R/g). The orbit's, a = R omega^2, asks for half of
    that, 4 h <= 1/omega: on its joints a ball leaves theory between .30 and .35 of a radian a step.
    Other speeds v of the start, 2 h <= R/v, may take the ball half as far, and as much further as
    it is above the floor; its slip may be fifty radians a step, where friction on a ball that spins
    so fast is still right to 1e-3.
    Drag, extrapolated to mid step, leaves z of a speed in a step, where z^2 - (1 -
    3/2 c h) z - c h/2 = 0; that is stable up to c h = 1, and 2 h <= 1/c keeps to half of it. Where
    c depends on the speed w, c w changes by up to 2 c(w) with w, taken where the ball lags by all
    of the fluid's speed. A wave of the flow is met at least twice a radian, 2 h <= 1/(2 pi f)."""
    times = np.append(flow.knots(t_end), [0.0, t_end])
    # Just before and after the jumps: between them omega_0 is linear.
    fastest = float(np.abs(flow.line(np.append(times, np.nextafter(times, -np.inf)))).max())
    fastest += float(np.abs(flow.waves[:, 0]).sum())
    rates = {
        "sqrt(R/g)": math.sqrt(p.g / p.R),
        "1/(2 omega_0)": 2 * fastest,
        "1/(2 omega_c)": 2 * abs(float(x0.omega_c)) * (1 - float(x0.h) / p.R),
        "(R+y)/v_y": abs(float(x0.v_y)) / (p.R + float(x0.y)),
        "R/v_h": abs(float(x0.v_h)) / p.R,
        **{f"100/{name}": abs(float(getattr(x0, name))) / 100 for name in SLIP},
        "1/fluid_torque": p.fluid_torque,
        "1/(2 pi f)": 2 * math.pi * float(flow.waves[:, 1].max(initial=0.0)),
    }
    rates |= {"1/c": p.c} if p.drag == STOKES else {"1/(2 c(R omega_0))": 2 * c(p.R * fastest)}
    name, rate = max(rates.items(), key=lambda each: each[1])
    return 1 / rate, name


def check_timestep(
    timestep: float, p: Parameters, flow: Flow, t_end: float, c: Callable[[float], float], x0: State
) -> None:
    """`InputError` for a step beyond half of `shortest_time`, to which every engine is held."""
    shortest, name = shortest_time(p, flow, t_end, c, x0)
    if timestep > shortest / 2:
        raise InputError(
            f"timestep = {timestep:g} s is out of range: must be <= {shortest / 2:.3g} s, half of "
            f"{name}, the shortest time of the problem"
        )
