"""Checks of what a run is asked for, before anything is simulated."""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence

import numpy.typing as npt

from mjsim.contact_settings import ContactSettings
from mjsim.corrections import Ball, resistance
from model import Flow, InputError, Parameters, State, time_scales
from model.errors import check_type
from model.parameters import Range, check_number


def check_runs(
    parameters: Sequence[Parameters],
    x0s: Sequence[npt.ArrayLike],
    flows: Sequence[Flow | None],
    settings: ContactSettings | None,
) -> None:
    """Refuse runs that lack parameters, a start or a flow, none at all, and what is of another type."""
    if not len(parameters) == len(x0s) == len(flows) or len(parameters) == 0:
        raise InputError(
            f"every run needs parameters, a start and a flow, but there are {len(parameters)} parameter sets, "
            f"{len(x0s)} starts and {len(flows)} flows"
        )
    for p, flow in zip(parameters, flows, strict=True):
        check_type("p", p, Parameters)
        check_type("flow", flow, Flow | None)
    check_type("settings", settings, ContactSettings | None)


def check_start(x0: npt.ArrayLike, p: Parameters, settings: ContactSettings) -> None:
    """Refuse a state on or beyond the axis, where polar coordinates end.

    Warn if friction at both contacts makes them chatter.
    """
    x = State.one(x0)
    if settings.contact_decay(p.mu, p.eta) > 1:
        warnings.warn(
            f"with mu = {p.mu:g} and eta = {p.eta:g} a ball that slips at both contacts chatters with these settings; "
            "ContactSettings.suited gives slower contacts",
            stacklevel=4,
        )
    check_place(x, p, settings.touching(p.g))


def check_place(x: State, p: Parameters, depth: float) -> None:
    """Refuse a ball deeper in floor or wall than `depth`, m, or on the axis, where its orbit has no direction."""
    check_number("y", x.y, "m", Range(-depth), "to be above the floor it")
    check_number("h", x.h, "m", Range(-depth, p.R, below=True), "to be between wall and axis it")


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
