"""Checks of what a run is asked for, before anything is simulated."""

from __future__ import annotations

import math
import warnings

import numpy as np
import numpy.typing as npt

from mjsim.contact_settings import ContactSettings
from mjsim.corrections import Ball, resistance
from model import Flow, InputError, Parameters, State
from model.drag import STOKES
from model.kinematics import slip_speeds
from model.parameters import Range, check_number


def check_start(x0: npt.ArrayLike, p: Parameters, settings: ContactSettings) -> None:
    """Refuse a state on or beyond the axis, where polar coordinates end.

    Warn if contact can't be continuous at its slip speeds, taking the load of gravity for both contacts, or if friction
    at both makes them chatter.
    """
    x = State.one(x0)
    if settings.contact_decay(p.mu, p.eta) > 1:
        warnings.warn(
            f"with mu = {p.mu:g} and eta = {p.eta:g} a ball that slips at both contacts chatters with these settings; "
            "ContactSettings.suited gives slower contacts",
            stacklevel=4,
        )
    if settings.coordinates == "polar":
        check_number("h", x.h, "m", Range(high=p.R, below=True), "to be off the axis it")
    for contact, friction, speed, gap in zip("AB", (p.mu, p.eta), slip_speeds(x, p), (x.y, x.h), strict=True):
        fastest = settings.fastest_slip(p.g, friction)
        if abs(gap) < settings.touching(p.g) and speed > fastest:
            warnings.warn(
                f"the ball slips at {speed:.3g} m s-1 at {contact} at the start, but with these settings contact "
                f"is continuous only up to {fastest:.3g} m s-1; ContactSettings.for_problem gives softer ones",
                stacklevel=4,
            )


def check_timestep(timestep: float, p: Parameters, flow: Flow, t_end: float) -> None:
    """Refuse a step beyond half the shortest time of the problem.

    A contact of the engine needs a time constant of two steps. Within it an acceleration a may not move the ball by the
    size of the vessel, a (2 h)^2 <= R: gravity's, a = g, asks for 2 h <= sqrt(R/g), and that of the orbit,
    a = R omega_0^2, for 2 h <= 1/omega_0. Drag, extrapolated to mid step, leaves z of a speed in a step, where
    z^2 - (1 - 3/2 c h) z - c h/2 = 0; that is stable up to c h = 1, and 2 h <= 1/c keeps to half of it. Where c depends
    on the speed w, c w changes by up to 2 c(w) with w, taken where the ball lags by all of the fluid's speed. A wave of
    the flow is met at least twice a radian, 2 h <= 1/(2 pi f).
    """
    times = np.append(flow.breakpoints[flow.breakpoints < t_end], [0.0, t_end])
    # Just before and after the jumps: between them omega_0 is linear.
    fastest = float(np.abs(flow.line(np.append(times, np.nextafter(times, -np.inf)))).max())
    fastest += float(np.abs(flow.waves[:, 0]).sum())
    scales = {"sqrt(R/g)": math.sqrt(p.R / p.g) if p.g else math.inf}
    name, drag = "1/c", p.c
    if p.drag != STOKES:
        name, drag = "1/(2 c(R omega_0))", 2 * resistance(p.R * fastest, 0.0, 0.0, Ball.of(p, ContactSettings())) / p.m
    scales |= {"1/omega_0": 1 / fastest if fastest else math.inf, name: 1 / drag if drag else math.inf}
    if len(flow.waves):
        scales["1/(2 pi f)"] = 1 / (2 * math.pi * float(flow.waves[:, 1].max()))
    name, shortest = min(scales.items(), key=lambda scale: scale[1])
    if timestep > shortest / 2:
        raise InputError(
            f"timestep = {timestep:g} s is out of range: must be <= {shortest / 2:.3g} s, half of {name}, "
            "the shortest time of the problem"
        )


def sampling(t_end: float, timestep: float, sample_interval: float | None) -> tuple[int, int]:
    """Steps between samples and number of samples, both ends included."""
    t_end = check_number("t_end", t_end, "s", Range(timestep), "to hold a time step it")
    if sample_interval is None:
        sample_interval = max(t_end / 1000, timestep)
    check_number("sample_interval", sample_interval, "s", Range(timestep * (1 - 1e-9)), "to hold a time step it")
    steps = max(1, round(sample_interval / timestep))
    return steps, math.floor(t_end / (steps * timestep) + 1e-9) + 1
