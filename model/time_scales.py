"""The shortest time of a problem, and the longest step that resolves it."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from model.drag import STOKES
from model.errors import InputError
from model.flow import Flow
from model.kinematics import State
from model.parameters import Parameters

SLIP = "slip_x", "slip_y", "slip_z"


class Rate(NamedTuple):
    """How fast something goes, by which quantity."""

    rate: float  # s-1
    time: str  # the formula of 1/rate
    name: str
    value: float
    unit: str


def turns(p: Parameters, flow: Flow, t_end: float, x0: State) -> list[Rate]:
    """How fast the fluid and the ball go round, and the flow's waves, in a run of t_end s from a
    state x0."""
    times = np.append(flow.knots(t_end), [0.0, t_end])
    # Just before and after the jumps: between them omega_0 is linear.
    flows = flow.line(np.append(times, np.nextafter(times, -np.inf)))
    fastest = float(flows[np.abs(flows).argmax()])
    fastest += math.copysign(float(np.abs(flow.waves[:, 0]).sum()), fastest)
    ball, wave = float(x0.omega_c), float(flow.waves[:, 1].max(initial=0.0))
    around = 1 - float(x0.h) / p.R
    return [
        Rate(2 * abs(fastest), "1/(2 omega_0)", "omega_0", fastest, "rad s-1"),
        Rate(2 * abs(ball) * around, "1/(2 omega_c)", "omega_c", ball, "rad s-1"),
        Rate(2 * math.pi * wave, "1/(2 pi f)", "f", wave, "Hz"),
    ]


def shortest_time(
    p: Parameters, flow: Flow, t_end: float, c: Callable[[float], float], x0: State
) -> Rate:
    """What asks for the shortest time in a run of t_end s from a state x0; c(|w|) in s-1 is the law
    of drag.

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
    rates = turns(p, flow, t_end, x0)
    fluid, v_y, v_h = rates[0], float(x0.v_y), float(x0.v_h)
    slips = {name: float(getattr(x0, name)) for name in SLIP}
    lag = 2 * c(p.R * abs(fluid.value))
    rates += [
        Rate(math.sqrt(p.g / p.R), "sqrt(R/g)", "g", p.g, "m s-2"),
        Rate(abs(v_y) / (p.R + float(x0.y)), "(R+y)/v_y", "v_y", v_y, "m s-1"),
        Rate(abs(v_h) / p.R, "R/v_h", "v_h", v_h, "m s-1"),
        *(Rate(abs(v) / 100, f"100/{name}", name, v, "rad s-1") for name, v in slips.items()),
        Rate(p.fluid_torque, "1/fluid_torque", "fluid_torque", p.fluid_torque, "s-1"),
        Rate(p.c, "1/c", "c", p.c, "s-1")
        if p.drag == STOKES
        else fluid._replace(rate=lag, time="1/(2 c(R omega_0))"),
    ]
    return max(rates)


def check_timestep(
    timestep: float, p: Parameters, flow: Flow, t_end: float, c: Callable[[float], float], x0: State
) -> None:
    """`InputError` for a step beyond half of `shortest_time`, to which every engine is held."""
    of = shortest_time(p, flow, t_end, c, x0)
    if timestep > 0.5 / of.rate:
        raise InputError(
            f"timestep = {timestep:g} s is out of range: with {of.name} = {of.value:g} {of.unit} "
            f"it must be <= {0.5 / of.rate:.3g} s, half of {of.time}, the shortest time of the "
            "problem"
        )
