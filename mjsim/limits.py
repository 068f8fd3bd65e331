"""Checks of what a run is asked for, before anything is simulated."""

from __future__ import annotations

import math
import warnings

from mjsim.contact_settings import ContactSettings
from mjsim.corrections import Ball, resistance
from model import Flow, Parameters, State, time_scales
from model.kinematics import check_place
from model.parameters import Range, check_number


def check_start(x: State, p: Parameters, settings: ContactSettings) -> None:
    """`check_place`, and a warning if friction at both contacts makes them chatter."""
    if settings.contact_decay(p.mu, p.eta) > 1:
        warnings.warn(
            f"with mu = {p.mu:g} and eta = {p.eta:g} a ball that slips at both contacts chatters with these settings; "
            "ContactSettings.suited gives slower contacts",
            stacklevel=4,
        )
    check_place(x, p, settings.touching(p.g))


def check_timestep(timestep: float, p: Parameters, flow: Flow, t_end: float) -> None:
    """`time_scales.check_timestep` with the drag of these engines."""
    ball = Ball.of(p, ContactSettings())
    time_scales.check_timestep(timestep, p, flow, t_end, lambda speed: resistance(speed, 0.0, 0.0, ball) / p.m)


def sampling(t_end: float, timestep: float, sample_interval: float | None) -> tuple[int, int]:
    """Steps between samples and number of samples, both ends included."""
    t_end = check_number("t_end", t_end, "s", Range(timestep), "to hold a time step it")
    if sample_interval is None:
        sample_interval = max(t_end / 1000, timestep)
    check_number("sample_interval", sample_interval, "s", Range(timestep * (1 - 1e-9)), "to hold a time step it")
    steps = max(1, round(sample_interval / timestep))
    return steps, math.floor(t_end / (steps * timestep) + 1e-9) + 1
